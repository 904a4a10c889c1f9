//! The only place that knows the order of the phases.
//!
//! ```text
//! pool one                      joining                pool two
//! perceive, decide, claim  ──|  claims -> groups  ──|  groups react  ──|  next cycle
//!                         barrier                barrier            barrier
//! ```
//!
//! The source paper merges tasks while they are inserted into pool two and so needs two
//! barriers, but a lock or an atomic exchange per claimed box. Here claims are plain stores
//! and joining is a pass of its own, for the price of one more barrier a cycle.

use crate::conflict::Groups;
use crate::ports::Clock;
use crate::units::{Cycle, Slot};
use crate::workers::{self, Worker};
use crate::world::World;

/// Time spent in each phase by worker 0, waiting at the barrier included, in nanoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PhaseTimes {
    /// Pool one: perceive, decide, claim.
    pub perceive_decide_ns: u64,
    /// Joining claims into groups.
    pub conflicts_ns: u64,
    /// Pool two: react.
    pub react_ns: u64,
}

impl PhaseTimes {
    /// Adds the times of another stretch of cycles.
    pub fn add(&mut self, other: Self) {
        self.perceive_decide_ns += other.perceive_decide_ns;
        self.conflicts_ns += other.conflicts_ns;
        self.react_ns += other.react_ns;
    }

    /// All phases together.
    pub fn total_ns(&self) -> u64 {
        self.perceive_decide_ns + self.conflicts_ns + self.react_ns
    }
}

/// One worker's share of a run: the world's scratch and the kernel's own.
#[derive(Debug)]
pub struct Mate<S> {
    /// The world's scratch.
    pub scratch: S,
    /// Conflict groups seen by size: index k counts groups of `2^k .. 2^(k+1)` bodies.
    pub group_sizes: [u64; 32],
    /// The largest group seen.
    pub largest_group: u64,
    members: Vec<Slot>,
    /// Bodies in conflict that have not acted yet, where a world reacts in rounds.
    pending: Vec<Slot>,
    times: PhaseTimes,
}

impl<S> Mate<S> {
    /// A worker that has done nothing yet.
    pub fn new(scratch: S) -> Self {
        Self {
            scratch,
            group_sizes: [0; 32],
            largest_group: 0,
            members: Vec::new(),
            pending: Vec::new(),
            times: PhaseTimes::default(),
        }
    }

    fn count_group(&mut self, size: usize) {
        self.group_sizes[size.ilog2() as usize] += 1;
        self.largest_group = self.largest_group.max(size as u64);
    }
}

/// Runs `cycles` cycles from `from` on, with one worker per element of `crew`.
///
/// The result is the same bits for every length of `crew`.
pub fn advance<W: World>(
    world: &W,
    state: &W::State,
    groups: &Groups,
    crew: &mut [Mate<W::Scratch>],
    (from, cycles): (Cycle, u64),
    clock: &impl Clock,
) -> PhaseTimes {
    workers::run(crew, |worker, mate| {
        let mut before = PhaseTimes::default();
        std::mem::swap(&mut before, &mut mate.times);
        for k in 0..cycles {
            one_cycle(world, state, groups, worker, mate, (from + k, k), clock);
        }
    });
    crew.first().map_or_else(PhaseTimes::default, |mate| mate.times)
}

#[inline]
fn one_cycle<W: World>(
    world: &W,
    state: &W::State,
    groups: &Groups,
    worker: &Worker<'_>,
    mate: &mut Mate<W::Scratch>,
    (now, round): (Cycle, u64),
    clock: &impl Clock,
) {
    let n = world.bodies(state);
    let started_ns = clock.now_ns();
    worker.for_each_chunk(3 * round, n, |bodies| {
        bodies.clone().for_each(|body| groups.reset(body as Slot));
        world.perceive_and_decide(state, now, bodies, &mut mate.scratch);
    });
    worker.barrier();
    let decided_ns = clock.now_ns();
    worker.for_each_chunk(3 * round + 1, n, |bodies| {
        world.find_conflicts(state, now, bodies, groups, &mut mate.scratch);
    });
    worker.barrier();
    let joined_ns = clock.now_ns();
    worker.for_each_chunk(3 * round + 2, n, |bodies| {
        bodies.for_each(|body| react_as_leader(world, state, groups, mate, (now, body as Slot)));
    });
    if world.reacts_in_rounds() {
        react_in_rounds(world, state, worker, mate, now);
    }
    worker.barrier();
    mate.times.perceive_decide_ns += decided_ns - started_ns;
    mate.times.conflicts_ns += joined_ns - decided_ns;
    mate.times.react_ns += clock.now_ns() - joined_ns;
}

/// Lets the group of `body` react if `body` leads one.
#[inline]
fn react_as_leader<W: World>(
    world: &W,
    state: &W::State,
    groups: &Groups,
    mate: &mut Mate<W::Scratch>,
    (now, body): (Cycle, Slot),
) {
    if !groups.is_leader(body) {
        return;
    }
    if groups.is_alone(body) {
        mate.group_sizes[0] += 1;
        return world.react(state, now, &mut [body], &mut mate.scratch);
    }
    let mut members = std::mem::take(&mut mate.members);
    groups.members(body, &mut members);
    mate.count_group(members.len());
    if world.reacts_in_rounds() {
        mate.pending.extend_from_slice(&members);
    } else {
        world.react(state, now, &mut members, &mut mate.scratch);
    }
    mate.members = members;
}

/// Rounds of bidding until every body in conflict has acted. A group's bodies are all in one
/// worker's list, so the groups spread over the workers.
fn react_in_rounds<W: World>(
    world: &W,
    state: &W::State,
    worker: &Worker<'_>,
    mate: &mut Mate<W::Scratch>,
    now: Cycle,
) {
    while worker.any(!mate.pending.is_empty()) {
        for &body in &mate.pending {
            world.bid(state, now, body, &mut mate.scratch);
        }
        worker.barrier();
        world.act_on_bids(state, now, &mut mate.pending, &mut mate.scratch);
        worker.barrier();
        world.retract_bids(state, &mut mate.scratch);
    }
}
