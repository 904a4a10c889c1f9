//! *Act*, the paper's second pool: the bodies of a group act one after the other; the environment decides.

use super::action::{Action, StepPath};
use super::cycle_context::{CycleContext, are_free, box_index};
use super::decide::Contact;
use super::effector::{ObstacleRule, Side};
use super::state::{BodyState, Facing, LastContact};
use super::world::Role;
use super::{Event, EventKind, MotionSample, Scratch};
use sidestep_kernel::EntitySlot;
use sidestep_kernel::distr::Categorical;
use sidestep_kernel::space::OccupantWord;

/// The result that a walk would have in the present state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WalkResult {
    /// Number of steps that are made.
    pub(super) steps: usize,
    /// The obstacle that stopped it.
    pub(super) contact: Option<Blocker>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Blocker {
    /// Index into the scenario's kinds.
    pub(super) kind: u8,
    /// Side of the body that touches it.
    pub(super) side: Side,
    /// The body that stands there; none for a wall.
    pub(super) by: Option<EntitySlot>,
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Lets one body act with the draw of its own stream.
    #[inline]
    pub(super) fn act_with_draw(&self, slot: EntitySlot, scratch: &mut Scratch) {
        let [word, _] = self.act_words(self.body(slot).id);
        self.act(slot, word, scratch);
    }

    /// Lets one body act on the state left by those before it; `word` is its draw.
    #[inline]
    pub(super) fn act(&self, slot: EntitySlot, word: u32, scratch: &mut Scratch) {
        let body = self.body(slot);
        if body.intent.get().is_idle() {
            return;
        }
        let ty = self.type_of(body);
        // A door has no actions in its type, so it toggles.
        let Some(action) = ty.actions.get(usize::from(body.action.get())) else {
            return self.toggle(slot, scratch);
        };
        let walk = &action.walks[self.draw_transition(action, slot, word)];
        if are_free(self.floor, self.base(body), &walk.whole.enter) {
            self.execute_free(walk, slot, scratch);
        } else {
            self.execute_blocked(walk, self.walk_result(walk, slot), slot, scratch);
        }
    }

    /// Makes a walk with a known result, and returns the number of steps made.
    pub(super) fn execute_result(
        &self,
        walk: &StepPath,
        result: WalkResult,
        slot: EntitySlot,
        scratch: &mut Scratch,
    ) -> usize {
        if result.contact.is_some() {
            return self.execute_blocked(walk, result, slot, scratch);
        }
        self.execute_free(walk, slot, scratch);
        walk.steps.len()
    }

    /// Makes a whole walk that meets no obstacle.
    #[inline]
    fn execute_free(&self, walk: &StepPath, slot: EntitySlot, scratch: &mut Scratch) {
        self.execute_whole(walk, slot);
        if scratch.keep_motions {
            let result = WalkResult { steps: walk.steps.len(), contact: None };
            self.record_motion(walk, result, self.body(slot), scratch);
        }
    }

    /// Returns the number of the transition in which an action ends; `word` is the body's draw.
    #[inline(always)]
    pub(super) fn draw_transition(&self, action: &Action, slot: EntitySlot, word: u32) -> usize {
        match self.world.obstacle_rule {
            // Here obstacles change the effect of a transition, not its probability.
            ObstacleRule::Cut | ObstacleRule::Stay => action.distribution.sample(word),
            ObstacleRule::Renormalise => {
                let is_free = |walk: &StepPath| self.walk_result(walk, slot).contact.is_none();
                match self.unblocked_distribution(action, is_free) {
                    Ok(distribution) => distribution.sample(word),
                    Err(blocked) => blocked,
                }
            }
        }
    }

    /// Moves a body to the end of a whole walk. It writes only the boxes that differ at its end, and not
    /// those that steps enter and leave again, because nearly all walks are made whole.
    #[inline]
    fn execute_whole(&self, walk: &StepPath, slot: EntitySlot) {
        let floor = self.floor;
        let body = self.body(slot);
        let base = self.base(body);
        body.contact.set(LastContact::NONE);
        if walk.turn != 0 {
            body.facing.set(body.facing.get().turned(walk.turn));
        }
        if walk.steps.is_empty() {
            if walk.turn == 0 {
                self.state.count_wait(self.world, body);
            }
            return;
        }
        if self.holds_way(body) {
            return self.execute_steps(walk, walk.steps.len(), slot);
        }
        let whole = &walk.whole;
        whole.leave.iter().for_each(|&offset| floor.set(box_index(base, offset), T::FREE));
        whole
            .fill
            .iter()
            .for_each(|&offset| floor.set(box_index(base, offset), T::from_body(slot)));
        body.anchor.set(body.position().translate(whole.delta.0, whole.delta.1).word());
        body.moves.set(body.moves.get() + walk.steps.len() as u32);
        if self.type_of(body).marks {
            let mut first_visits = 0;
            for &offset in &whole.enter {
                first_visits += u32::from(self.state.visited.insert(box_index(base, offset)));
            }
            body.first_visits.set(body.first_visits.get() + first_visits);
        }
    }

    /// Returns whether a body keeps the steps of a walk before an obstacle. People try single boxes, which cannot be
    /// cut short.
    pub(super) fn keeps_steps(&self, slot: EntitySlot) -> bool {
        let is_mover = matches!(self.type_of(self.body(slot)).role, Role::Mover(_));
        self.world.obstacle_rule == ObstacleRule::Cut && !is_mover
    }

    /// Makes a walk that an obstacle may cut short, and returns the number of steps made.
    fn execute_blocked(
        &self,
        walk: &StepPath,
        result: WalkResult,
        slot: EntitySlot,
        scratch: &mut Scratch,
    ) -> usize {
        let body = self.body(slot);
        let is_whole = result.contact.is_none();
        let steps = if is_whole || self.keeps_steps(slot) { result.steps } else { 0 };
        self.execute_steps(walk, steps, slot);
        // Only robots keep contacts; people just try another time.
        if matches!(self.type_of(body).role, Role::Mover(_)) {
            return steps;
        }
        if scratch.keep_motions {
            let result = WalkResult { steps, ..result };
            self.record_motion(walk, result, body, scratch);
        }
        if steps == 0 && (!is_whole || walk.turn == 0) {
            self.state.count_wait(self.world, body);
        }
        match result.contact {
            None => {
                body.contact.set(LastContact::NONE);
                if walk.turn != 0 {
                    body.facing.set(body.facing.get().turned(walk.turn));
                }
            }
            Some(blocker) => self.record_contact(body, blocker, scratch),
        }
        steps
    }

    /// Records a contact in the body's state, in its counters and, where events are kept, as an event.
    fn record_contact(&self, body: &BodyState, blocker: Blocker, scratch: &mut Scratch) {
        let Blocker { kind, side, by } = blocker;
        body.contact.set(LastContact::from_contact(Contact { kind, side }));
        let kinds = self.world.kinds.len();
        self.state.contacts.add(body.id as usize * kinds + usize::from(kind), 1);
        if scratch.keep_events {
            let with = by.map(|slot| self.body(slot).id);
            let event = EventKind::Contact { kind, side, with };
            scratch.events.push(self.body_event(body, event));
        }
    }

    /// Returns an event of a body, which is where it happens.
    fn body_event(&self, body: &BodyState, event: EventKind) -> Event {
        let at = self.world.map_position(body.position());
        Event { cycle: self.now, body: body.id, at, event }
    }

    /// Returns how far a walk gets: to the first step that enters a box that is not free.
    #[inline]
    pub(super) fn walk_result(&self, walk: &StepPath, slot: EntitySlot) -> WalkResult {
        let base = self.base(self.body(slot));
        for (steps, step) in walk.steps.iter().enumerate() {
            for &offset in &step.enter {
                let word = self.floor.get(box_index(base, offset));
                // A path that turns back enters boxes that the body itself still covers.
                if !word.is_free() && word.slot() != slot {
                    let by = (word != T::WALL).then(|| word.slot());
                    let kind = self.state.kind_of(word);
                    return WalkResult {
                        steps,
                        contact: Some(Blocker { kind, side: step.side, by }),
                    };
                }
            }
        }
        WalkResult { steps: walk.steps.len(), contact: None }
    }

    /// Makes a walk up to its contact, step by step, so that a path over its own boxes ends right. A body whose action goes
    /// on holds the boxes behind it.
    #[inline]
    fn execute_steps(&self, walk: &StepPath, steps: usize, slot: EntitySlot) {
        if steps == 0 {
            return;
        }
        let floor = self.floor;
        let body = self.body(slot);
        let base = self.base(body);
        let marks = self.type_of(body).marks;
        let holds_way = self.holds_way(body);
        if holds_way {
            self.note_way(body, walk, steps);
        }
        let mut moved = body.position();
        let mut first_visits = 0;
        for step in &walk.steps[..steps] {
            if !holds_way {
                step.leave.iter().for_each(|&offset| floor.set(box_index(base, offset), T::FREE));
            }
            for &offset in &step.enter {
                let index = box_index(base, offset);
                floor.set(index, T::from_body(slot));
                first_visits += u32::from(marks && self.state.visited.insert(index));
            }
            moved = moved.translate(step.delta.0, step.delta.1);
        }
        body.anchor.set(moved.word());
        body.moves.set(body.moves.get() + steps as u32);
        body.first_visits.set(body.first_visits.get() + first_visits);
    }

    /// Returns the distribution over the walks that are not blocked here (the paper's update of the
    /// distribution in the presence of a conflict: an occurrence is allowed or denied), or, when none is
    /// left, the first blocked one as an error: the action then ends in its contact.
    pub(super) fn unblocked_distribution(
        &self,
        action: &Action,
        is_free: impl Fn(&StepPath) -> bool,
    ) -> Result<Categorical, usize> {
        let walks = action.probabilities.iter().zip(&action.walks);
        let mut row: Vec<f64> = walks
            .map(|(&p, walk)| {
                let is_allowed = p > 0.0 && is_free(walk);
                if is_allowed { p } else { 0.0 }
            })
            .collect();
        let sum: f64 = row.iter().sum();
        if sum <= 0.0 {
            return Err(action.probabilities.iter().position(|&p| p > 0.0).unwrap_or(0));
        }
        row.iter_mut().for_each(|p| *p /= sum);
        Ok(Categorical::new(&row).expect("a rescaled row is a distribution"))
    }

    /// Opens a door, or closes it when no body stands in it; otherwise closing waits.
    pub(super) fn toggle(&self, slot: EntitySlot, scratch: &mut Scratch) {
        let floor = self.floor;
        let body = self.body(slot);
        let base = self.base(body);
        let own = &self.type_of(body).own;
        let opens = body.facing.get() == Facing::CLOSED;
        if !opens && !are_free(floor, base, own) {
            return;
        }
        let word = if opens { T::FREE } else { T::from_body(slot) };
        own.iter().for_each(|&offset| floor.set(box_index(base, offset), word));
        body.facing.set(if opens { Facing::OPEN } else { Facing::CLOSED });
        if scratch.keep_events {
            let event = if opens { EventKind::DoorOpened } else { EventKind::DoorClosed };
            scratch.events.push(self.body_event(body, event));
        }
    }

    /// Records the result of an action in a log for learning: the steps and the turn that were
    /// really made, not those that the drawn transition would have made in free space.
    /// People have no effector to learn, so theirs are left out.
    fn record_motion(
        &self,
        walk: &StepPath,
        result: WalkResult,
        body: &BodyState,
        scratch: &mut Scratch,
    ) {
        if matches!(self.type_of(body).role, Role::Mover(_)) {
            return;
        }
        let mut ahead = 0;
        let mut left = 0;
        for step in &walk.steps[..result.steps] {
            step.side.add_to(&mut ahead, &mut left);
        }
        scratch.motion_samples.push(MotionSample {
            cycle: self.now,
            robot: body.id,
            action: body.intent.get().number(),
            ahead,
            left,
            quarter_turns: if result.contact.is_none() { walk.turn } else { 0 },
            contact: result.contact.is_some(),
            delay_cycles: self.state.delays.before_action(body.id),
        });
    }
}
