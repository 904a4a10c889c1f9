//! Epochs: the order of coordinators by age, the progress of each, and the definition of a majority.

use serde::{Deserialize, Serialize};
use std::cmp::Ordering;

/// The largest number that an epoch or a hop may have: no conversation comes near it, so a larger one in a message is
/// refused.
const MAX_NUMBER: u32 = 1 << 24;

/// The epoch of a coordinator: the same as long as its state only moves, and a newer one whenever
/// it had to be brought back from a copy. It names the host that began it, so no two hosts begin the
/// same one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct CoordinatorEpoch {
    /// The higher one is newer.
    pub number: u32,
    /// Place of the host that began it; among equal numbers the lower one is newer.
    pub owner: u16,
}

impl Ord for CoordinatorEpoch {
    fn cmp(&self, other: &Self) -> Ordering {
        self.number.cmp(&other.number).then(other.owner.cmp(&self.owner))
    }
}

impl PartialOrd for CoordinatorEpoch {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl CoordinatorEpoch {
    /// Returns the epoch in which all begin, without an election.
    pub(super) fn initial(owner: usize) -> Self {
        Self { number: 0, owner: owner as u16 }
    }

    /// Returns the start of the epoch, before the first hop.
    pub(super) fn first_version(self) -> CoordinatorVersion {
        CoordinatorVersion { epoch: self, hop: 0 }
    }

    /// Returns whether its owner is in a group of this size, and its number within reach.
    pub(super) fn is_valid_for(self, group: usize) -> bool {
        usize::from(self.owner) < group && self.number < MAX_NUMBER
    }
}

/// A point on a coordinator's itinerary: the epoch, and the number of hops in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub(super) struct CoordinatorVersion {
    pub epoch: CoordinatorEpoch,
    /// Number of hops since the epoch began.
    pub hop: u32,
}

impl CoordinatorVersion {
    /// Returns the position after the next hop.
    pub(super) fn after_hop(self) -> Self {
        Self { hop: self.hop + 1, ..self }
    }

    pub(super) fn is_valid_for(self, group: usize) -> bool {
        self.epoch.is_valid_for(group) && self.hop < MAX_NUMBER
    }
}

/// Returns whether some hosts suffice to elect: more than half of the group, or half of it with the
/// first of all. Any two such sets have a member in common, which is all that elections rest on.
pub(super) fn is_majority(members: &[bool]) -> bool {
    let count = members.iter().filter(|is_in| **is_in).count();
    2 * count > members.len() || (2 * count == members.len() && members[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_epoch_has_the_highest_number_and_then_the_lowest_id() {
        let epoch = |number, owner| CoordinatorEpoch { number, owner };
        let mut all = [epoch(1, 2), epoch(0, 0), epoch(2, 3), epoch(1, 0), epoch(2, 1)];
        all.sort_unstable();
        assert_eq!(all, [epoch(0, 0), epoch(1, 2), epoch(1, 0), epoch(2, 3), epoch(2, 1)]);
        assert!(epoch(1, 0).first_version() > epoch(1, 2).first_version().after_hop());
    }

    #[test]
    fn any_two_majorities_have_a_member_in_common_and_one_of_any_two_halves_is_one() {
        for n in 1..=8u32 {
            let sets: Vec<Vec<bool>> =
                (0..1u32 << n).map(|bits| (0..n).map(|k| bits >> k & 1 == 1).collect()).collect();
            let majorities: Vec<_> = sets.iter().filter(|set| is_majority(set)).collect();
            for a in &majorities {
                assert!(majorities.iter().all(|b| (0..n as usize).any(|k| a[k] && b[k])), "{n}");
            }
            for set in &sets {
                let others: Vec<bool> = set.iter().map(|is_in| !is_in).collect();
                assert!(is_majority(set) != is_majority(&others), "{set:?}");
            }
        }
    }
}
