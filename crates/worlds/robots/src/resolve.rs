//! Who meets whom, and in which order the bodies of a conflict group act.

use super::Scratch;
use super::state::{CLEAR, IDLE, RobotsState};
use super::world::{RobotsWorld, Role, purpose};
use serde::{Deserialize, Serialize};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::space::{BoxWord, Floor};
use sidestep_kernel::{Column, Cycle, EntityId, Slot};

/// The order within a conflict group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ConflictPolicy {
    /// A fair draw per body and cycle.
    #[default]
    Random,
    /// By entity id.
    Fixed,
    /// By the rank of the kind (`kind_order`), then a fair draw.
    ByKind,
    /// Who comes from the right goes first; where all four headings meet, a fair draw says
    /// which heading begins.
    RightOfWay,
    /// The fair draw of `random`, but in rounds: whoever has the highest key among its
    /// neighbors acts, until all have. The same outcome, in parallel inside large groups.
    Rounds,
}

impl ConflictPolicy {
    /// All policies.
    pub const ALL: [Self; 5] =
        [Self::Random, Self::Fixed, Self::ByKind, Self::RightOfWay, Self::Rounds];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Fixed => "fixed",
            Self::ByKind => "by_kind",
            Self::RightOfWay => "right_of_way",
            Self::Rounds => "rounds",
        }
    }
}

/// A body's place in the order of its group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    key: (u8, u32, u32),
    pub(super) slot: Slot,
    pub(super) word: u32,
}

impl RobotsWorld {
    /// Joins a body with all whose claims meet its own: a box that it may come to cover names
    /// another, be it one that stands there or one that may come too.
    #[inline]
    pub(super) fn join_one(&self, state: &RobotsState, slot: Slot, groups: &Groups) {
        let intent = state.bodies[slot as usize].intent.get();
        if intent == IDLE {
            return;
        }
        match &state.floor {
            Floor::Narrow(floor) => self.join_on(floor, state, slot, intent, groups),
            Floor::Wide(floor) => self.join_on(floor, state, slot, intent, groups),
        }
    }

    #[inline]
    fn join_on<T: BoxWord>(
        &self,
        floor: &Column<T>,
        state: &RobotsState,
        slot: Slot,
        intent: u8,
        groups: &Groups,
    ) {
        // A neighbor is often met in several boxes.
        let mut last_met = slot;
        let mut meet = |word: T| {
            let other = word.slot();
            if other != slot && other != last_met {
                last_met = other;
                groups.join(slot, other);
            }
        };
        if intent & CLEAR == 0 {
            return self.for_each_claimed(floor, state, slot, |_, word| meet(word));
        }
        let cell = &state.bodies[slot as usize];
        let base = cell.at().index(self.stride);
        let body = &self.types[usize::from(cell.ty)];
        let boxes = &*body.actions[usize::from(cell.action.get())].claims;
        boxes.iter().for_each(|&o| meet(floor.get(base.wrapping_add_signed(o) as usize)));
    }

    /// Fills `scratch.order` with a group in its order of acting, and each body's draw of
    /// what its action comes to (the priority is drawn beside it).
    pub(super) fn order(
        &self,
        state: &RobotsState,
        now: Cycle,
        group: &[Slot],
        scratch: &mut Scratch,
    ) {
        let first = if self.policy == ConflictPolicy::RightOfWay {
            self.first_heading(state, now, group)
        } else {
            0
        };
        let order = &mut scratch.order;
        order.clear();
        order.extend(group.iter().map(|&slot| {
            let words = self.act_words(state.bodies[slot as usize].id, now);
            Place { key: self.priority(state, slot, words[1], first), slot, word: words[0] }
        }));
        order.sort_unstable_by_key(|place| place.key);
    }

    /// The draws of a body's action: what it comes to, and its priority.
    #[inline]
    pub(super) fn act_words(&self, id: EntityId, now: Cycle) -> [u32; 2] {
        let [effect, priority, ..] = self.streams.block(id, now, purpose::ACT, 0);
        [effect, priority]
    }

    /// Smaller acts earlier: rank by the policy, fair draw, id. Unique per body.
    #[inline]
    pub(super) fn priority(
        &self,
        state: &RobotsState,
        slot: Slot,
        draw: u32,
        first_heading: u8,
    ) -> (u8, u32, u32) {
        let id = state.bodies[slot as usize].id;
        match self.policy {
            ConflictPolicy::Fixed => (0, 0, id),
            ConflictPolicy::Random | ConflictPolicy::Rounds => (0, draw, id),
            ConflictPolicy::ByKind => {
                (self.kind_rank[usize::from(state.type_in(self, slot).kind)], draw, id)
            }
            ConflictPolicy::RightOfWay => {
                let rank = match self.heading_of(state, slot) {
                    // Each heading yields to the one a quarter to its left.
                    Some(heading) => 1 + (4 + first_heading - heading) % 4,
                    None => 0,
                };
                (rank, draw, id)
            }
        }
    }

    /// Doors have no heading and go first.
    fn heading_of(&self, state: &RobotsState, slot: Slot) -> Option<u8> {
        let is_door = matches!(state.type_in(self, slot).role, Role::Door(_));
        (!is_door).then(|| state.bodies[slot as usize].facing.get())
    }

    /// Whoever heads `h` sees on its right those that head `h + 1` (a quarter to the left),
    /// so a heading begins when the next one is absent; among several, and when all four are
    /// there, a fair draw per cycle decides.
    fn first_heading(&self, state: &RobotsState, now: Cycle, group: &[Slot]) -> u8 {
        let mut present = [false; 4];
        for heading in group.iter().filter_map(|&slot| self.heading_of(state, slot)) {
            present[usize::from(heading)] = true;
        }
        let draw = (self.streams.block(u32::MAX, now, purpose::ACT, 0)[1] >> 30) as usize;
        let candidates = (0..4).map(|k| (draw + k) % 4);
        let begins = |h: &usize| present[*h] && !present[(h + 1) % 4];
        candidates.clone().find(begins).unwrap_or(draw) as u8
    }
}
