//! The teams that planners lead: their robots, and what a planner remembers of them.

use sidestep_kernel::{EntityId, Seed};
use sidestep_map::planning::FreeSpace;
use sidestep_planners::{GridPose, Pibt, PibtConfig, PibtState};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Robots of one section that a planner leads. All have one size and act in the same cycles.
#[derive(Debug, Clone)]
pub(crate) struct Team {
    /// Their ids.
    pub(crate) robots: Range<EntityId>,
}

/// The planner of a team: what changes, and a cache.
#[derive(Debug)]
pub(crate) struct TeamState {
    /// Directions to goals and buffers. No result depends on what they hold, so copies of a state share them.
    planner: Arc<Mutex<Pibt>>,
    /// Only the phase *plan* writes it, on one worker.
    memory: Mutex<TeamMemory>,
}

/// All that the planner of a team remembers.
#[derive(Debug, Clone)]
pub(crate) struct TeamMemory {
    pub(crate) pibt: PibtState,
    /// The pose that each robot has after its planned action; none before the first.
    pub(crate) planned: Vec<Option<GridPose>>,
    /// Times that a robot was elsewhere than planned.
    off_plan: Vec<u32>,
}

/// Words of a robot's share of [`TeamMemory`] in a snapshot.
pub(crate) const WORDS: usize = 5;

/// Locks a value. A poisoned lock is fine: after a panic nothing of the run is read.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl TeamState {
    /// Returns the state of a team of robots of these sizes before the first cycle.
    pub(crate) fn new(free: &FreeSpace, sizes: &[u32], seed: Seed) -> Self {
        let config = PibtConfig { seed, ..PibtConfig::default() };
        let planner = Pibt::new(free, sizes, config).expect("a body has at least one box");
        let robots = sizes.len();
        let memory = TeamMemory {
            pibt: PibtState::new(robots),
            planned: vec![None; robots],
            off_plan: vec![0; robots],
        };
        Self { planner: Arc::new(Mutex::new(planner)), memory: Mutex::new(memory) }
    }

    /// Returns the planner and what it remembers, for planning a step.
    pub(crate) fn locked(&self) -> (MutexGuard<'_, Pibt>, MutexGuard<'_, TeamMemory>) {
        (lock(&self.planner), lock(&self.memory))
    }

    /// Returns a copy for trying a cycle.
    pub(crate) fn trial_copy(&self) -> Self {
        let memory = Mutex::new(lock(&self.memory).clone());
        Self { planner: Arc::clone(&self.planner), memory }
    }

    /// Returns a robot's share of the state in words.
    pub(crate) fn words(&self, robot: usize) -> [u32; WORDS] {
        let memory = lock(&self.memory);
        let [goal, planned] = [memory.pibt.goals[robot], position(memory.planned[robot])];
        let heading = memory.planned[robot].map_or(0, |pose| u32::from(pose.heading));
        [memory.pibt.ages[robot], packed(goal), packed(planned), heading, memory.off_plan[robot]]
    }

    /// Takes over what [`Self::words`] returned. The number of steps follows from the cycle.
    pub(crate) fn restore(&self, robot: usize, words: [u32; WORDS], step: u64) {
        let [age, goal, planned, heading, off_plan] = words;
        let mut memory = lock(&self.memory);
        memory.pibt.step = step;
        memory.pibt.ages[robot] = age;
        memory.pibt.goals[robot] = unpacked(goal);
        memory.planned[robot] =
            unpacked(planned).map(|(col, row)| GridPose::new(col, row, heading as u8));
        memory.off_plan[robot] = off_plan;
    }

    /// Returns how often a robot was elsewhere than planned.
    pub(crate) fn off_plan(&self, robot: usize) -> u32 {
        lock(&self.memory).off_plan[robot]
    }
}

fn position(pose: Option<GridPose>) -> Option<(u32, u32)> {
    pose.map(GridPose::position)
}

/// Returns a place in one word, 0 for none. A map has less than 65,535 columns and rows, as positions in a state have
/// 16 bits each.
fn packed(place: Option<(u32, u32)>) -> u32 {
    place.map_or(0, |(col, row)| (col + 1) << 16 | row)
}

fn unpacked(word: u32) -> Option<(u32, u32)> {
    (word != 0).then(|| ((word >> 16) - 1, word & 0xffff))
}

impl TeamMemory {
    /// Counts the robots that are elsewhere than planned.
    pub(crate) fn compare(&mut self, poses: &[GridPose]) {
        for (robot, &pose) in poses.iter().enumerate() {
            let is_off = self.planned[robot].is_some_and(|planned| planned != pose);
            self.off_plan[robot] += u32::from(is_off);
        }
    }
}
