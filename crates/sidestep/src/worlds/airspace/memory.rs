//! How much memory optimizing a group takes: said before, not after.

use super::Scratch;
use super::airplane::{Point, distance_m};
use super::decide::Known;
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use crate::collectives::PairwiseGame;
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::{Slot, World};

impl AirspaceWorld {
    /// Bytes that the tables of a group's pairs take at most, and its predictions.
    pub(super) fn table_bytes(&self, group: &[Known]) -> u64 {
        let actions = |known: &Known| self.actions_of(known.slot).len() as u64;
        let mut entries = 0;
        for (k, a) in group.iter().enumerate() {
            let meets = |b: &&Known| {
                let apart_m = distance_m(a.pose.at, b.pose.at);
                (a.altitude_m - b.altitude_m).abs() < self.vertical_m
                    && apart_m <= self.look_m(a.slot as usize, b.slot as usize)
            };
            entries +=
                group[k + 1..].iter().filter(meets).map(|b| actions(a) * actions(b)).sum::<u64>();
        }
        let points = group.iter().map(actions).sum::<u64>() * self.timing.horizon as u64;
        entries * PairwiseGame::BYTES_PER_ENTRY + points * size_of::<Point>() as u64
    }

    /// The members of the group that takes most at the start of a run, and its bytes.
    pub(super) fn largest_at_start(&self, state: &AirspaceState) -> (usize, u64) {
        let n = self.airplanes.len();
        let (groups, mut scratch) = (Groups::new(n), Scratch::default());
        self.perceive_and_decide(state, 0, 0..n, &mut scratch);
        self.find_conflicts(state, 0, 0..n, &groups, &mut scratch);
        let mut members = Vec::new();
        let leaders =
            (0..n as Slot).filter(|&slot| groups.is_leader(slot) && !groups.is_alone(slot));
        let taken = leaders.map(|leader| {
            groups.members(leader, &mut members);
            let flown = members.iter().filter(|&&slot| !self.is_replayed(slot, 0));
            let known: Vec<Known> = flown.map(|&slot| self.known(state, 0, slot)).collect();
            (known.len(), self.table_bytes(&known))
        });
        taken.max_by_key(|(_, bytes)| *bytes).unwrap_or_default()
    }
}
