//! The progress of robots with goals: what is kept of it from one look to the next.
//!
//! It follows from the states of the cycles before, and no robot's action depends on it. It is a part of checkpoints,
//! so that a resumed run goes on with it, and of digests where the end of a run depends on it.

use serde::{Deserialize, Serialize};
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::text::group_thousands;
use sidestep_kernel::{Cycle, EntityId};
use std::fmt;

/// Cycles between two looks: few, because robots in a jam stray and are seldom at their foremost place, and not fewer,
/// because each look ends a segment of cycles that workers share.
pub const CHECK_CYCLES: Cycle = 50;

/// The progress of all robots with goals.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// In the order of `RobotsWorld::watched_robots`.
    pub(super) approaches: Vec<Approach>,
    /// Number of cycles before the last look.
    pub(super) checked: Cycle,
    /// Gridlocks that stand.
    pub(super) gridlocks: Vec<Gridlock>,
    /// Number of all gridlocks so far.
    pub(super) gridlocks_begun: u64,
    /// The first one of the run, when it was found.
    pub(super) first_found: Option<(Cycle, Gridlock)>,
}

/// The way of one robot to its present goal.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Approach {
    /// The number of the goal among those of its behavior, or of its errand; none for a robot that has none left.
    pub(super) goal: Option<u32>,
    /// Its place at the last look,
    pub(super) place: (u32, u32),
    /// and its moves until then.
    pub(super) moves: u32,
    /// What the cheapest path from there costs,
    pub(super) cost: u32,
    /// and from the place where it was nearest to its goal.
    pub(super) least_cost: u32,
    /// The look at which it had come there. Of a robot with tasks, the place is that at this look, and costs are those of the
    /// looks since then at which its path was searched for.
    pub(super) nearer_at: Cycle,
    /// A number that changes with each errand that it has done.
    pub(super) errands_done: u32,
    /// The looks since then at which bodies stood in its way.
    pub(super) obstructions: Vec<Obstruction>,
}

/// Bodies in the way of a robot at one look.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Obstruction {
    /// Number of cycles before the look.
    pub(super) at: Cycle,
    /// For each step that would have brought the robot nearer, the bodies in the boxes that it would have covered.
    pub(super) steps: Vec<Vec<EntityId>>,
}

/// Robots of which some wait for each other in a circle, and the others for these.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gridlock {
    /// The number of cycles after which none of them came nearer to its goal, up to the interval between two looks.
    pub since: Cycle,
    /// The robots by rising id.
    pub robots: Vec<EntityId>,
}

/// A gridlock that has begun or come loose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridlockEvent {
    /// The last cycle before the look at which it was found.
    pub cycle: Cycle,
    /// Whether it begins, rather than ends.
    pub has_begun: bool,
    /// Its robots, and since when they wait.
    pub gridlock: Gridlock,
}

impl Progress {
    /// Returns the gridlocks that stand.
    pub fn gridlocks(&self) -> &[Gridlock] {
        &self.gridlocks
    }

    /// Number of gridlocks so far, those that came loose included.
    pub fn gridlocks_begun(&self) -> u64 {
        self.gridlocks_begun
    }

    /// Returns the first gridlock of the run, as it was when it was found.
    pub fn first_gridlock(&self) -> Option<&Gridlock> {
        self.first_found.as_ref().map(|(_, gridlock)| gridlock)
    }

    /// Returns the cycle after which the first gridlock of the run was found.
    pub fn first_gridlock_cycle(&self) -> Option<Cycle> {
        self.first_found.as_ref().map(|&(cycle, _)| cycle)
    }

    /// Writes all that the next looks depend on. Places and moves are those of the bodies at the last look.
    pub(super) fn write_to(&self, hasher: &mut Hasher) {
        hasher.write_u64(self.checked);
        hasher.write_u64(self.gridlocks_begun);
        self.approaches.iter().for_each(|approach| approach.write_to(hasher));
        hasher.write_u64(self.gridlocks.len() as u64);
        self.gridlocks.iter().for_each(|gridlock| gridlock.write_to(hasher));
        hasher.write_u64(self.first_gridlock_cycle().unwrap_or(0));
        self.first_gridlock().iter().for_each(|gridlock| gridlock.write_to(hasher));
    }
}

impl Approach {
    fn write_to(&self, hasher: &mut Hasher) {
        let goal = self.goal.map_or(0, |goal| goal + 1);
        let place = [self.place.0, self.place.1];
        let costs = [self.cost, self.least_cost];
        let words = [&[goal], &place[..], &[self.moves], &costs, &[self.errands_done]].concat();
        words.iter().for_each(|&word| hasher.write_u32(word));
        hasher.write_u64(self.nearer_at);
        hasher.write_u64(self.obstructions.len() as u64);
        for obstruction in &self.obstructions {
            hasher.write_u64(obstruction.at);
            hasher.write_u64(obstruction.steps.len() as u64);
            obstruction.steps.iter().for_each(|ids| write_ids(hasher, ids));
        }
    }
}

impl Obstruction {
    /// Returns whether on each step there is one of some bodies.
    pub(super) fn is_complete(&self, includes: impl Fn(&EntityId) -> bool) -> bool {
        self.steps.iter().all(|bodies| bodies.iter().any(&includes))
    }
}

impl Gridlock {
    /// Returns whether some of these robots are in it.
    pub(super) fn shares_robot(&self, robots: &[EntityId]) -> bool {
        robots.iter().any(|id| self.robots.binary_search(id).is_ok())
    }

    /// Returns the ids of its robots with something between them.
    pub(super) fn ids_text(&self, separator: &str) -> String {
        let ids: Vec<_> = self.robots.iter().map(ToString::to_string).collect();
        ids.join(separator)
    }

    fn write_to(&self, hasher: &mut Hasher) {
        hasher.write_u64(self.since);
        write_ids(hasher, &self.robots);
    }
}

impl fmt::Display for Gridlock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.robots.len();
        let ids = self.ids_text(", ");
        let since = group_thousands(self.since);
        write!(
            f,
            "{count} robots ({ids}), of which none has come nearer to its goal since cycle {since}"
        )
    }
}

fn write_ids(hasher: &mut Hasher, ids: &[EntityId]) {
    hasher.write_u64(ids.len() as u64);
    ids.iter().for_each(|&id| hasher.write_u32(id));
}
