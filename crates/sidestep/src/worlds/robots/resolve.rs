//! Who meets whom, and in which order the bodies of a conflict group act.

use super::Scratch;
use super::state::{IDLE, RobotsState};
use super::world::{RobotsWorld, Role, purpose};
use serde::{Deserialize, Serialize};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::space::{StoredTag, Tags};
use sidestep_kernel::{Column, Cycle, Slot};

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

impl RobotsWorld {
    /// Joins a body with all whose claims meet its own: a box that it may come to cover has
    /// another's tag, be it of a body that stands there or of one that may come too.
    #[inline]
    pub(super) fn join_one(&self, state: &RobotsState, slot: Slot, groups: &Groups) {
        let intent = state.bodies[slot as usize].intent.get();
        if intent == IDLE {
            return;
        }
        match state.claims.tags() {
            Tags::Narrow(tags) => self.join_in(tags, state, slot, intent, groups),
            Tags::Wide(tags) => self.join_in(tags, state, slot, intent, groups),
        }
    }

    #[inline]
    fn join_in<T: StoredTag>(
        &self,
        tags: &Column<T>,
        state: &RobotsState,
        slot: Slot,
        intent: u8,
        groups: &Groups,
    ) {
        let at = state.at(slot);
        let own = T::of(state.claims.tag(at));
        self.for_each_claimed(state, slot, at.index(self.stride), intent, |index, _| {
            let tag = tags.get(index);
            if tag != own {
                let other = state.claims.body(index as u32, tag.tag(), |body| state.at(body));
                groups.join(slot, other);
            }
        });
    }

    /// Sorts a group into its order of acting.
    pub(super) fn order(
        &self,
        state: &RobotsState,
        now: Cycle,
        group: &mut [Slot],
        scratch: &mut Scratch,
    ) {
        let first = if self.policy == ConflictPolicy::RightOfWay {
            self.first_heading(state, now, group)
        } else {
            0
        };
        let keys = &mut scratch.keys;
        keys.clear();
        keys.extend(group.iter().map(|&slot| (self.priority(state, now, slot, first), slot)));
        keys.sort_unstable();
        group.iter_mut().zip(keys).for_each(|(place, key)| *place = key.1);
    }

    /// Smaller acts earlier: rank by the policy, fair draw, id. Unique per body.
    #[inline]
    pub(super) fn priority(
        &self,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        first_heading: u8,
    ) -> (u8, u32, u32) {
        let id = self.bodies[slot as usize].id;
        let draw = || self.streams.block(id, now, purpose::PRIORITY, 0)[0];
        match self.policy {
            ConflictPolicy::Fixed => (0, 0, id),
            ConflictPolicy::Random | ConflictPolicy::Rounds => (0, draw(), id),
            ConflictPolicy::ByKind => {
                (self.kind_rank[usize::from(self.body_type(slot).kind)], draw(), id)
            }
            ConflictPolicy::RightOfWay => {
                let rank = match self.heading_of(state, slot) {
                    // Each heading yields to the one a quarter to its left.
                    Some(heading) => 1 + (4 + first_heading - heading) % 4,
                    None => 0,
                };
                (rank, draw(), id)
            }
        }
    }

    /// Doors have no heading and go first.
    fn heading_of(&self, state: &RobotsState, slot: Slot) -> Option<u8> {
        let is_door = matches!(self.body_type(slot).role, Role::Door(_));
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
        let draw = (self.streams.block(u32::MAX, now, purpose::PRIORITY, 0)[0] >> 30) as usize;
        let candidates = (0..4).map(|k| (draw + k) % 4);
        let begins = |h: &usize| present[*h] && !present[(h + 1) % 4];
        candidates.clone().find(begins).unwrap_or(draw) as u8
    }
}
