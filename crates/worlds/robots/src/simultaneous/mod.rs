//! The policy `simultaneous`: all transitions of a group are drawn before anybody moves, then made at once.
//!
//! A body waits for those that stand where it wants to go. Bodies that wait for nobody any more are resolved first,
//! by their draws, so that each box goes to one body and whoever comes later finds out who has left and who has
//! stayed. Bodies that wait for each other (rings) are resolved together: their walks are cut until they fit.
//!
//! A box that a body has entered in the cycle, even only to pass through, is closed to all others until the next. One that
//! it leaves is closed until the action ends, where that takes several cycles.

mod dependencies;
#[cfg(test)]
mod tests;

use super::Scratch;
use super::act::{Blocker, WalkResult};
use super::action::{Action, StepPath};
use super::cycle_context::{CycleContext, box_index};
use super::effector::{ObstacleRule, Side};
use super::join::GroupMember;
use super::state::Facing;
use super::world::Role;
use dependencies::DependencyGraph;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::space::OccupantWord;

/// The moves of a group, with buffers that are kept between groups.
#[derive(Debug, Default)]
pub(super) struct GroupMoves {
    /// By turn: the order of the members' draws.
    moves: Vec<Move>,
    graph: DependencyGraph,
    /// The boxes that the bodies of a ring would enter, sorted.
    entries: Vec<BoxEntry>,
    /// Boxes of the floor that were entered.
    entered: Vec<usize>,
}

/// What one body of a group does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Move {
    pub(super) slot: EntitySlot,
    /// The number of the drawn transition; none for doors and for bodies that do nothing.
    pub(super) transition: Option<usize>,
    /// As far as it is known.
    pub(super) result: WalkResult,
}

/// A box that a body of a ring enters with a step of its walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct BoxEntry {
    index: usize,
    turn: u32,
    step: usize,
}

impl GroupMoves {
    /// Returns the move of a body, once its group has acted.
    pub(super) fn move_of(&self, slot: EntitySlot) -> Option<&Move> {
        self.moves.iter().find(|one| one.slot == slot)
    }
}

impl<'a, T: OccupantWord> CycleContext<'a, T> {
    /// Lets the group in `scratch.order` act at once.
    pub(super) fn act_at_once(&self, scratch: &mut Scratch) {
        // Taken out, because acting borrows the whole scratch.
        let order = std::mem::take(&mut scratch.order);
        let mut group = std::mem::take(&mut scratch.group_moves);
        self.draw_moves(&order, &mut group);
        // Told apart before doors open, because an open door that is to act would close.
        let closing = self.doors_to_toggle(&order, Facing::OPEN);
        let opening = self.doors_to_toggle(&order, Facing::CLOSED);
        // They can be entered in this cycle.
        opening.iter().for_each(|&slot| self.toggle(slot, scratch));
        self.find_dependencies(&mut group);
        for set in group.graph.schedule().sets() {
            match *set {
                [turn] => self.move_alone(turn, &mut group, scratch),
                _ => self.move_together(set, &mut group, scratch),
            }
        }
        for &slot in closing.iter().filter(|&&slot| !self.was_entered(slot)) {
            self.toggle(slot, scratch);
        }
        group.entered.drain(..).for_each(|index| self.state.entered_by.set(index, 0));
        scratch.order = order;
        scratch.group_moves = group;
    }

    /// Draws every transition, before anybody moves.
    fn draw_moves(&self, order: &[GroupMember], group: &mut GroupMoves) {
        group.moves.clear();
        for (turn, member) in (0..).zip(order) {
            let slot = member.slot;
            self.state.turns.set(slot as usize, turn);
            let action = self.action_of(slot);
            let transition = action.map(|action| self.draw_before_moves(action, member));
            let walk = action.zip(transition).map(|(action, k)| &action.walks[k]);
            let steps = walk.map_or(0, |walk| walk.steps.len());
            let result = WalkResult { steps, contact: None };
            group.moves.push(Move { slot, transition, result });
        }
    }

    /// Returns the action that a body is about to do; none for doors, and for bodies that do nothing.
    fn action_of(&self, slot: EntitySlot) -> Option<&'a Action> {
        let body = self.body(slot);
        if body.intent.get().is_idle() {
            return None;
        }
        self.type_of(body).actions.get(usize::from(body.action.get()))
    }

    fn walk_of(&self, one: &Move) -> Option<&'a StepPath> {
        Some(&self.action_of(one.slot)?.walks[one.transition?])
    }

    /// Returns the number of the transition in which an action ends. Under `renormalise`, what is blocked here and
    /// now is what meets an obstacle that cannot make room in this cycle.
    fn draw_before_moves(&self, action: &Action, member: &GroupMember) -> usize {
        match self.world.obstacle_rule {
            ObstacleRule::Cut | ObstacleRule::Stay => action.distribution.sample(member.word),
            ObstacleRule::Renormalise => {
                let is_free =
                    |walk: &StepPath| self.lasting_result(walk, member.slot).contact.is_none();
                match self.unblocked_distribution(action, is_free) {
                    Ok(distribution) => distribution.sample(member.word),
                    Err(blocked) => blocked,
                }
            }
        }
    }

    /// Returns how far a walk gets before anybody has moved, if all that can make room do.
    pub(super) fn lasting_result(&self, walk: &StepPath, slot: EntitySlot) -> WalkResult {
        self.result_with(walk, slot, |index| {
            let word = self.floor.get(index);
            (!word.is_free() && word.slot() != slot && !self.can_make_room(word)).then_some(word)
        })
    }

    /// Returns whether what stands in a box may leave it in this cycle: a body that is about to do an action with
    /// steps, or a door that is about to open.
    fn can_make_room(&self, word: T) -> bool {
        if word == T::WALL {
            return false;
        }
        let slot = word.slot();
        match self.action_of(slot) {
            Some(action) => !action.sweep.nodes.is_empty() && !self.holds_way(self.body(slot)),
            None => !self.body(slot).intent.get().is_idle(),
        }
    }

    /// Returns how far a walk gets among those that have moved in this cycle and those that have not.
    fn result_now(&self, walk: &StepPath, slot: EntitySlot) -> WalkResult {
        self.result_with(walk, slot, |index| self.obstacle_now(index, slot))
    }

    /// Returns who keeps a body out of a box: whoever stands there, or has entered it in this cycle.
    fn obstacle_now(&self, index: usize, slot: EntitySlot) -> Option<T> {
        let word = self.floor.get(index);
        if !word.is_free() && word.slot() != slot {
            return Some(word);
        }
        let by = self.state.entered_by.get(index).checked_sub(1)?;
        (by != slot).then(|| T::from_body(by))
    }

    /// Returns how far a walk gets where `obstacle` says what is in a box.
    fn result_with(
        &self,
        walk: &StepPath,
        slot: EntitySlot,
        obstacle: impl Fn(usize) -> Option<T>,
    ) -> WalkResult {
        let base = self.base(self.body(slot));
        for (steps, step) in walk.steps.iter().enumerate() {
            for &offset in &step.enter {
                if let Some(word) = obstacle(box_index(base, offset)) {
                    return WalkResult { steps, contact: Some(self.blocker(word, step.side)) };
                }
            }
        }
        WalkResult { steps: walk.steps.len(), contact: None }
    }

    fn blocker(&self, word: T, side: Side) -> Blocker {
        let by = (word != T::WALL).then(|| word.slot());
        Blocker { kind: self.state.kind_of(word), side, by }
    }

    /// Lets each body wait for those that stand where its walk leads, up to the first wall.
    fn find_dependencies(&self, group: &mut GroupMoves) {
        group.graph.clear();
        for one in &group.moves {
            if let Some(walk) = self.walk_of(one) {
                self.add_dependencies(walk, one.slot, &mut group.graph);
            }
            group.graph.add_node();
        }
    }

    fn add_dependencies(&self, walk: &StepPath, slot: EntitySlot, graph: &mut DependencyGraph) {
        let base = self.base(self.body(slot));
        for &offset in walk.steps.iter().flat_map(|step| &step.enter) {
            let word = self.floor.get(box_index(base, offset));
            if word == T::WALL {
                return;
            }
            if !word.is_free() && word.slot() != slot {
                graph.add_edge(self.state.turns.get(word.slot() as usize));
            }
        }
    }

    /// Moves a body that waits for nobody any more.
    fn move_alone(&self, turn: u32, group: &mut GroupMoves, scratch: &mut Scratch) {
        let one = group.moves[turn as usize];
        let Some(walk) = self.walk_of(&one) else { return };
        let result = self.result_now(walk, one.slot);
        group.moves[turn as usize].result = result;
        self.make_move(turn, group, scratch);
    }

    /// Makes the move of a body, with its result, and closes the boxes that it enters to all others.
    fn make_move(&self, turn: u32, group: &mut GroupMoves, scratch: &mut Scratch) {
        let one = group.moves[turn as usize];
        let Some(walk) = self.walk_of(&one) else { return };
        let base = self.base(self.body(one.slot));
        let steps = self.execute_result(walk, one.result, one.slot, scratch);
        for &offset in walk.steps[..steps].iter().flat_map(|step| &step.enter) {
            let index = box_index(base, offset);
            self.state.entered_by.set(index, one.slot + 1);
            group.entered.push(index);
        }
    }

    /// Moves bodies that wait for each other.
    fn move_together(&self, ring: &[u32], group: &mut GroupMoves, scratch: &mut Scratch) {
        self.collect_entries(ring, group);
        while self.cut_walks(ring, group) {}
        let moves = |group: &GroupMoves, turn: u32| {
            let one = &group.moves[turn as usize];
            self.is_some_made(one.slot, one.result)
        };
        let makes_move: Vec<bool> = ring.iter().map(|&turn| moves(group, turn)).collect();
        let moving = || ring.iter().zip(&makes_move).filter(|(_, makes)| **makes);
        moving().for_each(|(&turn, _)| self.make_move(turn, group, scratch));
        // Each has freed boxes that another of the ring may have entered before.
        moving().for_each(|(&turn, _)| self.stand(group.moves[turn as usize].slot));
        let others = ring.iter().zip(&makes_move).filter(|(_, makes)| !**makes);
        self.try_again(others.map(|(&turn, _)| turn).collect(), group, scratch);
    }

    /// Returns whether a walk with this result makes any step or turn.
    fn is_some_made(&self, slot: EntitySlot, result: WalkResult) -> bool {
        result.contact.is_none() || result.steps > 0 && self.keeps_steps(slot)
    }

    fn collect_entries(&self, ring: &[u32], group: &mut GroupMoves) {
        group.entries.clear();
        for &turn in ring {
            let one = &group.moves[turn as usize];
            let Some(walk) = self.walk_of(one) else { continue };
            let base = self.base(self.body(one.slot));
            for (step, all) in walk.steps.iter().enumerate() {
                let boxes = all.enter.iter().map(|&offset| box_index(base, offset));
                group.entries.extend(boxes.map(|index| BoxEntry { index, turn, step }));
            }
        }
        group.entries.sort_unstable();
    }

    /// Cuts the walks of a ring that meet something, as they are now, and returns whether there was one.
    fn cut_walks(&self, ring: &[u32], group: &mut GroupMoves) -> bool {
        let mut is_any_cut = false;
        for &turn in ring {
            if let Some(cut) = self.result_in_ring(turn, ring, group) {
                let one = &mut group.moves[turn as usize];
                let steps = if self.keeps_steps(one.slot) { cut.steps } else { 0 };
                one.result = WalkResult { steps, ..cut };
                is_any_cut = true;
            }
        }
        is_any_cut
    }

    /// Returns the result of a walk that meets something before the end that was known for it.
    fn result_in_ring(&self, turn: u32, ring: &[u32], group: &GroupMoves) -> Option<WalkResult> {
        let one = &group.moves[turn as usize];
        let walk = self.walk_of(one)?;
        let base = self.base(self.body(one.slot));
        for (steps, step) in walk.steps[..one.result.steps].iter().enumerate() {
            for &offset in &step.enter {
                let index = box_index(base, offset);
                if let Some(word) = self.obstacle_in_ring(index, turn, ring, group) {
                    return Some(WalkResult {
                        steps,
                        contact: Some(self.blocker(word, step.side)),
                    });
                }
            }
        }
        None
    }

    /// Returns who keeps a body of a ring, in which none has moved yet, out of a box: whoever stays in it, would exchange
    /// boxes with the body, or has a better draw for it.
    fn obstacle_in_ring(
        &self,
        index: usize,
        turn: u32,
        ring: &[u32],
        group: &GroupMoves,
    ) -> Option<T> {
        let slot = group.moves[turn as usize].slot;
        let word = self.obstacle_now(index, slot);
        if let Some(word) = word {
            let leaves = self.floor.get(index) == word
                && self.mover_in_ring(word, ring, group).is_some_and(|one| {
                    !self.holds_way(self.body(one.slot))
                        && !self.covers_at_end(one, index)
                        && !self.enters_boxes_of(one, slot)
                });
            if !leaves {
                return Some(word);
            }
        }
        let first = group.entries.partition_point(|entry| entry.index < index);
        let here = group.entries[first..].iter().take_while(|entry| entry.index == index);
        // Those of one box are in the order of their draws.
        let mut wanting = here.filter(|w| w.step < group.moves[w.turn as usize].result.steps);
        let winner = wanting.next().filter(|winner| winner.turn < turn)?;
        Some(T::from_body(group.moves[winner.turn as usize].slot))
    }

    /// Returns the move of what stands in a box, if that is a body of the ring.
    fn mover_in_ring<'g>(&self, word: T, ring: &[u32], group: &'g GroupMoves) -> Option<&'g Move> {
        if word == T::WALL {
            return None;
        }
        let turn = self.state.turns.get(word.slot() as usize);
        ring.binary_search(&turn).is_ok().then(|| &group.moves[turn as usize])
    }

    /// Returns whether a body covers a box after the steps that are known for it.
    fn covers_at_end(&self, one: &Move, index: usize) -> bool {
        let body = self.body(one.slot);
        let steps = self.walk_of(one).map_or(&[][..], |walk| &walk.steps[..one.result.steps]);
        let end = steps.iter().fold(body.position(), |at, s| at.translate(s.delta.0, s.delta.1));
        let base = end.row_major_index(self.world.stride);
        self.type_of(body).own.iter().any(|&offset| box_index(base, offset) == index)
    }

    /// Returns whether the steps that are known for a body lead into boxes in which another one stands.
    fn enters_boxes_of(&self, one: &Move, other: EntitySlot) -> bool {
        let base = self.base(self.body(one.slot));
        let steps = self.walk_of(one).map_or(&[][..], |walk| &walk.steps[..one.result.steps]);
        steps.iter().flat_map(|step| &step.enter).any(|&offset| {
            let word = self.floor.get(box_index(base, offset));
            !word.is_free() && word != T::WALL && word.slot() == other
        })
    }

    /// Writes a body into the boxes that it covers.
    fn stand(&self, slot: EntitySlot) {
        let body = self.body(slot);
        let base = self.base(body);
        let own = &self.type_of(body).own;
        own.iter().for_each(|&offset| self.floor.set(box_index(base, offset), T::from_body(slot)));
    }

    /// Lets the bodies of a ring that have not moved try again, because the one that kept them out may have been kept
    /// out itself; those that still cannot move stay.
    fn try_again(&self, mut turns: Vec<u32>, group: &mut GroupMoves, scratch: &mut Scratch) {
        loop {
            let before = turns.len();
            turns.retain(|&turn| {
                let one = group.moves[turn as usize];
                let Some(walk) = self.walk_of(&one) else { return false };
                let result = self.result_now(walk, one.slot);
                group.moves[turn as usize].result = result;
                let is_made = self.is_some_made(one.slot, result);
                if is_made {
                    self.make_move(turn, group, scratch);
                }
                !is_made
            });
            if turns.len() == before {
                break;
            }
        }
        turns.iter().for_each(|&turn| self.make_move(turn, group, scratch));
    }

    /// Returns the doors in a position that are about to change it.
    fn doors_to_toggle(&self, order: &[GroupMember], facing: Facing) -> Vec<EntitySlot> {
        let is_due = |slot: EntitySlot| {
            let body = self.body(slot);
            let is_door = matches!(self.type_of(body).role, Role::Door(_));
            is_door && !body.intent.get().is_idle() && body.facing.get() == facing
        };
        order.iter().map(|member| member.slot).filter(|&slot| is_due(slot)).collect()
    }

    /// Returns whether some body has entered a door's boxes in this cycle. The door waits then, as it does while a
    /// body stands in it.
    fn was_entered(&self, slot: EntitySlot) -> bool {
        let body = self.body(slot);
        let base = self.base(body);
        let own = &self.type_of(body).own;
        own.iter().any(|&offset| self.state.entered_by.get(box_index(base, offset)) != 0)
    }
}
