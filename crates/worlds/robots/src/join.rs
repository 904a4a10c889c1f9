//! *Join*, the paper's detection of conflicts: groups of bodies with claims that meet, and the order in which a
//! group's bodies act.

use super::Scratch;
use super::cycle_context::{CycleContext, box_index};
use super::decide::pass_request::{
    HEARD_REQUEST_WORD, MAX_REQUEST_BOXES, OWN_REQUEST_WORD, own_request,
};
use super::effector::FORWARD;
use super::policy::ConflictPolicy;
use super::purpose;
use super::state::BodyState;
use super::world::{BodyType, Role};
use sidestep_kernel::EntitySlot;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::space::OccupantWord;

/// A body's place in the order of its group.
#[derive(Debug, Clone, Copy)]
pub(super) struct GroupMember {
    /// The body with the smaller key acts earlier, see [`CycleContext::priority`].
    pub(super) key: (u8, u32, u32),
    pub(super) slot: EntitySlot,
    /// The draw of its action's outcome.
    pub(super) word: u32,
}

/// Joins one body with those that it meets in boxes.
struct NeighborJoiner<'a> {
    slot: EntitySlot,
    last_met: EntitySlot,
    groups: &'a ConflictGroups,
}

impl NeighborJoiner<'_> {
    /// Joins the body with the one that stands in a box of the floor or claims it. The same neighbor is
    /// mostly met in several boxes one after the other, and joining it once is enough.
    #[inline(always)]
    fn meet<T: OccupantWord>(&mut self, word: T) {
        let other = word.slot();
        if other != self.slot && other != self.last_met {
            self.last_met = other;
            self.groups.join_groups(self.slot, other);
        }
    }
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Joins a body with all bodies that have claims meeting its own: those named in a box that
    /// it may come to cover, because they stand there or may come there too.
    #[inline]
    pub(super) fn join(&self, slot: EntitySlot, groups: &ConflictGroups) {
        let body = self.body(slot);
        let intent = body.intent.get();
        if intent.is_idle() {
            return;
        }
        if self.world.has_requests {
            self.deliver_request(body);
        }
        let mut joiner = NeighborJoiner { slot, last_met: slot, groups };
        if !intent.is_clear() {
            return self.for_each_claimed(slot, |_, word| joiner.meet(word));
        }
        // All boxes were free when the body claimed them, so that no wall cuts the tree of its steps, and
        // the flat list of boxes is enough.
        let base = self.base(body);
        let boxes = &*self.type_of(body).actions[usize::from(body.action.get())].claims;
        boxes.iter().for_each(|&offset| joiner.meet(self.floor.get(box_index(base, offset))));
    }

    /// Hands a robot's request to the first bodies in its direction, where these are robots that take
    /// part. Bodies stand still in this phase, so they are the same ones in every order.
    fn deliver_request(&self, body: &BodyState) {
        let ty = self.type_of(body);
        if !has_requests(ty) {
            return;
        }
        let Some((direction, word)) = own_request(body.memory[OWN_REQUEST_WORD].get()) else {
            return;
        };
        let forward = &ty.actions[usize::from(ty.action_index(direction, FORWARD))];
        // The intended transition comes first; an effector may have none that moves.
        let Some(step) = forward.walks.first().and_then(|walk| walk.steps.first()) else { return };
        let base = self.base(body);
        let one_box = step.delta.1 * self.world.stride as i32 + step.delta.0;
        for k in 0..MAX_REQUEST_BOXES {
            let mut is_taken = false;
            for &offset in &step.enter {
                let occupant = self.floor.get(box_index(base, offset + k * one_box));
                if occupant.is_free() {
                    continue;
                }
                is_taken = true;
                if occupant != T::WALL {
                    self.hear_request(occupant.slot(), word);
                }
            }
            // Bodies behind those that stand in the way are not asked.
            if is_taken {
                return;
            }
        }
    }

    /// Hands a request to the body in a slot, if that takes part; of several it keeps the greatest word,
    /// in whatever order workers deliver them.
    fn hear_request(&self, slot: EntitySlot, word: u32) {
        let body = self.body(slot);
        if has_requests(self.type_of(body)) {
            body.memory[HEARD_REQUEST_WORD].raise_to(word);
        }
    }

    /// Fills `scratch.order` with a group in its order of acting, each body with the draw of its
    /// action's outcome, because one block of the stream holds that and the priority.
    pub(super) fn order(&self, group: &[EntitySlot], scratch: &mut Scratch) {
        let has_right_of_way = self.world.policy == ConflictPolicy::RightOfWay;
        let first_heading = if has_right_of_way { self.first_heading(group) } else { 0 };
        let order = &mut scratch.order;
        order.clear();
        order.extend(group.iter().map(|&slot| {
            let body = self.body(slot);
            let [word, draw] = self.act_words(body.id);
            GroupMember { key: self.priority(body, draw, first_heading), slot, word }
        }));
        order.sort_unstable_by_key(|place| place.key);
    }

    /// Returns the key by which the smaller acts earlier: rank by the policy, fair draw, id. It is
    /// unique per body because the id is part of it.
    #[inline]
    fn priority(&self, body: &BodyState, draw: u32, first_heading: u8) -> (u8, u32, u32) {
        let id = body.id;
        match self.world.policy {
            ConflictPolicy::Fixed => (0, 0, id),
            ConflictPolicy::Random | ConflictPolicy::Rounds | ConflictPolicy::Simultaneous => {
                (0, draw, id)
            }
            ConflictPolicy::ByKind => {
                (self.world.kind_rank[usize::from(self.type_of(body).kind)], draw, id)
            }
            ConflictPolicy::RightOfWay => {
                let rank = match self.heading_of(body) {
                    // Each heading yields to the one a quarter to its left.
                    Some(heading) => 1 + (4 + first_heading - heading) % 4,
                    None => 0,
                };
                (rank, draw, id)
            }
        }
    }

    /// Returns the heading of a body; none for doors, which have no heading and go first.
    fn heading_of(&self, body: &BodyState) -> Option<u8> {
        let is_door = matches!(self.type_of(body).role, Role::Door(_));
        (!is_door).then(|| body.facing.get().heading())
    }

    /// Returns the heading that goes first. A body with heading `h` sees on its right those with
    /// heading `h + 1` (a quarter to the left), so a heading starts when the next one is absent.
    /// Among several such headings, and when all four are present, a fair draw decides: one per
    /// group, by its smallest id, because groups have nothing to do with each other.
    fn first_heading(&self, group: &[EntitySlot]) -> u8 {
        let mut present = [false; 4];
        for heading in group.iter().filter_map(|&slot| self.heading_of(self.body(slot))) {
            present[usize::from(heading)] = true;
        }
        let first_id = group.iter().map(|&slot| self.body(slot).id).min().unwrap_or(0);
        let words = self.world.streams.block(first_id, self.now, purpose::RIGHT_OF_WAY, 0);
        let draw = (words[0] >> 30) as usize;
        let mut from_draw = (0..4).map(|k| (draw + k) % 4);
        let first = from_draw.find(|&heading| present[heading] && !present[(heading + 1) % 4]);
        first.unwrap_or(draw) as u8
    }
}

/// Returns whether a body is a robot that takes part in requests.
fn has_requests(ty: &BodyType) -> bool {
    matches!(&ty.role, Role::Robot(model) if model.behaviour.has_requests())
}

#[cfg(test)]
mod tests {
    use crate::robots_run;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    const ARENAS: usize = 50;

    /// Returns the number of arenas in which the robot from the west has taken the box between the
    /// two, after one cycle. Each arena is a row of its own, with walls around it.
    fn won_from_the_west(seed: u32) -> usize {
        let rows = "#####\n#...#\n".repeat(ARENAS) + "#####\n";
        let places = |col: u32, heading: u32| {
            let rows = (0..ARENAS).map(|k| format!("[{col}, {}, {heading}]", 2 * k + 1));
            rows.collect::<Vec<_>>().join(", ")
        };
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nconflict_policy = \"right_of_way\"\n\
             map.ascii = \"\"\"\n{rows}\"\"\"\n[robots]\nat = [{}, {}]\n\
             behaviour = {{ kind = \"replay\", actions = [\"forward\"] }}\n",
            places(1, 0),
            places(3, 2),
        );
        let mut run = robots_run(&Source::new("s", &text, ""), 1).expect("fits");
        run.advance(1);
        (0..ARENAS as u32).filter(|&id| run.state().body(id).moves.get() == 1).count()
    }

    /// Two robots head-on are a tie. Of 50 fair draws, fewer than 10 or more than 40 fall to one
    /// side with probability 2.4e-5; seeds are fixed.
    #[test]
    fn separate_groups_break_their_ties_by_draws_of_their_own() {
        let won: Vec<usize> = (0..24).map(won_from_the_west).collect();
        assert!(won.iter().all(|n| (10..=40).contains(n)), "{won:?}");
        // Five standard deviations of 1,200 fair draws.
        assert!(won.iter().sum::<usize>().abs_diff(600) < 87, "{won:?}");
    }
}
