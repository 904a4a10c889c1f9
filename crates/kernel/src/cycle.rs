//! The only place that knows the order of the phases.
//!
//! ```text
//! claim                         join                   act
//! perceive, decide, claim  ──|  claims -> groups  ──|  groups act  ──|  next cycle
//!                         barrier                barrier          barrier
//! ```
//!
//! In worlds that plan ([`crate::world::Phases::has_plan`]), worker 0 does so alone before all that, at the price of one
//! more barrier; in all others nothing of it is left.
//!
//! Agents that decide together ([`crate::world::DecisionMode::Joint`]) do so in the last phase.
//!
//! The source paper merges tasks while they are inserted into pool two and so needs two barriers,
//! but a lock or an atomic exchange per claimed box. Here claims are plain stores and joining is a
//! pass of its own, at the price of one more barrier per cycle.

use crate::conflict::ConflictGroups;
use crate::interrupt::{self, Interrupt};
use crate::ports::Clock;
use crate::run_config::GroupSizeHistogram;
use crate::units::{Cycle, EntitySlot};
use crate::workers::{Worker, WorkerTeam};
use crate::world::{Auction, PhaseContext, Phases};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time of worker 0 in each phase, waiting at the barrier included, in nanoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PhaseTimes {
    /// Every body perceives, decides (where agents decide alone), and claims; before that, the plan of worlds that have
    /// one.
    pub claim_ns: u64,
    /// Claims become groups.
    pub join_ns: u64,
    /// Groups decide where agents decide together, and act.
    pub act_ns: u64,
}

impl PhaseTimes {
    /// Adds the times of further cycles, phase by phase.
    pub fn add(&mut self, other: Self) {
        self.claim_ns += other.claim_ns;
        self.join_ns += other.join_ns;
        self.act_ns += other.act_ns;
    }
}

/// One worker's share of a run: the world's scratch and the kernel's stats.
#[derive(Debug)]
pub struct WorkerState<S> {
    /// Buffers, events and sums that the world keeps per worker.
    pub scratch: S,
    /// What the kernel measures of the worker, the same in all worlds.
    pub stats: WorkerStats,
}

/// A worker's group sizes, processor time and buffers.
#[derive(Debug, Default)]
pub struct WorkerStats {
    /// Conflict groups whose leaders this worker has handled.
    pub groups: GroupSizeHistogram,
    /// Processor time of the worker's thread, in nanoseconds; where calls are of a single cycle, only some are
    /// measured and stand for all.
    pub cpu_ns: u64,
    /// Processor time that this worker has planned, in nanoseconds.
    pub plan_ns: u64,
    /// Calls of a single cycle so far, by which those to measure are chosen.
    single_cycle_calls: u64,
    /// Buffer for the members of a group, kept to allocate none per group.
    members: Vec<EntitySlot>,
    /// Bodies in conflict that have not acted yet, in worlds with an auction.
    pending: Vec<EntitySlot>,
}

/// The first calls of a single cycle are all measured, because a short run has too few for a sample.
const MEASURED_FIRST_CALLS: u64 = 64;
/// One of this many later calls is measured, and stands for all of them: reading the processor time is a system call,
/// and a cycle of a small world that gets orders before each cycle takes hardly longer than that call.
const CALLS_PER_MEASUREMENT: u64 = 16;

impl WorkerStats {
    /// Returns the number of calls for which the processor time of the next one stands; 0 if it is not measured.
    fn measurement_weight(&mut self, cycles: u64) -> u64 {
        if cycles > 1 {
            return 1;
        }
        self.single_cycle_calls += 1;
        match self.single_cycle_calls {
            ..=MEASURED_FIRST_CALLS => 1,
            k if k.is_multiple_of(CALLS_PER_MEASUREMENT) => CALLS_PER_MEASUREMENT,
            _ => 0,
        }
    }
}

impl<S> WorkerState<S> {
    /// Creates a worker that has done nothing yet.
    pub fn new(scratch: S) -> Self {
        Self { scratch, stats: WorkerStats::default() }
    }
}

/// The states of an engine's workers. A worker holds the lock of its own state while it works, and no other takes it
/// then, so it never waits for one.
pub(crate) type WorkerStates<S> = [Mutex<WorkerState<S>>];

/// Hooks that run between the cycles of a run, on the calling thread, while all workers are parked.
///
/// They read the state and collect the results of the workers, so that a caller that acts after
/// every cycle (keeps poses, gathers events, asks whether the run is over) costs no thread and
/// no system call per cycle. They cannot change the state.
pub trait Observer<W: Phases> {
    /// Called with the state at the start of cycle `now`.
    fn before_cycle(&mut self, _now: Cycle, _state: &W::State) {}

    /// Called with the state after cycle `now`, and the results of the workers. `Break` ends the run
    /// there.
    fn after_cycle(
        &mut self,
        now: Cycle,
        state: &W::State,
        scratches: Scratches<'_, W::Scratch>,
    ) -> ControlFlow<()>;
}

/// The scratches of all workers, while these are parked.
#[derive(Debug)]
pub struct Scratches<'a, S>(&'a WorkerStates<S>);

impl<S> Scratches<'_, S> {
    /// Calls `collect` for the scratch of each worker. The share of each worker differs from run to
    /// run: no result may depend on the order.
    pub fn for_each(&mut self, mut collect: impl FnMut(&mut S)) {
        self.0.iter().for_each(|worker_state| collect(&mut lock(worker_state).scratch));
    }
}

/// Locks a worker's state. A poisoned lock is fine: a worker that panicked ends the run, so nothing it left behind is
/// ever read.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Cycles in a row that are run without a change of the number of workers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CycleSegment {
    pub(crate) from: Cycle,
    /// The maximum number of cycles.
    pub(crate) cycles: u64,
    /// The maximum time in nanoseconds: no cycle starts later than this after the first.
    pub(crate) limit_ns: u64,
}

/// What a segment did, from which the number of workers for the next one is chosen.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CycleSegmentTiming {
    /// Cycles done, at least 1.
    pub(crate) cycles: u64,
    /// Their time in nanoseconds, including the start of the threads and the observer.
    pub(crate) took_ns: u64,
    /// Nanoseconds until the first of them was done.
    pub(crate) first_ns: u64,
    pub(crate) is_stopped: bool,
    pub(crate) times: PhaseTimes,
}

/// The fields of an engine that a segment borrows one by one, because only `team` is borrowed mutably.
pub(crate) struct EngineParts<'a, S, C> {
    pub(crate) groups: &'a ConflictGroups,
    /// One element per worker.
    pub(crate) workers: &'a WorkerStates<S>,
    /// The threads of the workers, where there are several.
    pub(crate) team: Option<&'a mut WorkerTeam>,
    pub(crate) clock: &'a C,
    pub(crate) interrupt: &'a Interrupt,
}

/// Runs a segment of at least one cycle.
///
/// The result is the same bits for every number of workers.
pub(crate) fn advance<W: Phases, C: Clock>(
    world: &W,
    state: &W::State,
    parts: EngineParts<'_, W::Scratch, C>,
    segment: CycleSegment,
    mut observer: Option<&mut dyn Observer<W>>,
) -> CycleSegmentTiming {
    let EngineParts { groups, workers, team, clock, interrupt } = parts;
    let started_ns = clock.now_ns();
    if let Some(observer) = &mut observer {
        observer.before_cycle(segment.from, state);
    }
    let is_observed = observer.is_some();
    let stop = AtomicBool::new(false);
    let shared = CycleSegmentContext {
        world,
        state,
        groups,
        workers,
        clock,
        interrupt,
        segment,
        is_observed,
        stop,
    };
    // The observer's own time belongs to no phase.
    let mark_ns = if is_observed { clock.now_ns() } else { started_ns };
    let mut leader = LeadWorkerState {
        clock,
        observer,
        started_ns,
        mark_ns,
        timing: CycleSegmentTiming::default(),
    };
    match team {
        None => shared.run(&Worker::ALONE, Some(&mut leader)),
        Some(team) => team.run(
            &mut vec![(); workers.len()],
            |worker, ()| shared.run(worker, Some(&mut leader)),
            |worker, ()| shared.run::<C>(worker, None),
        ),
    }
    CycleSegmentTiming { took_ns: clock.now_ns() - started_ns, ..leader.timing }
}

/// The data of a segment that all workers share.
struct CycleSegmentContext<'a, W: Phases> {
    world: &'a W,
    state: &'a W::State,
    groups: &'a ConflictGroups,
    workers: &'a WorkerStates<W::Scratch>,
    clock: &'a dyn Clock,
    interrupt: &'a Interrupt,
    segment: CycleSegment,
    is_observed: bool,
    /// Whether the present cycle is the last one. Worker 0 writes it before a barrier, and all
    /// read it after that barrier, so relaxed order is enough.
    stop: AtomicBool,
}

/// The data of worker 0 alone: it reads the clock, calls the observer, and ends the segment.
struct LeadWorkerState<'a, 'b, W: Phases, C> {
    clock: &'a C,
    observer: Option<&'a mut (dyn Observer<W> + 'b)>,
    started_ns: u64,
    /// Clock reading at the start of the present phase, in nanoseconds.
    mark_ns: u64,
    timing: CycleSegmentTiming,
}

impl<W: Phases, C: Clock> LeadWorkerState<'_, '_, W, C> {
    /// Adds the time since the last call to one phase.
    fn end_phase(&mut self, phase: impl FnOnce(&mut PhaseTimes) -> &mut u64) {
        let now_ns = self.clock.now_ns();
        *phase(&mut self.timing.times) += now_ns - self.mark_ns;
        self.mark_ns = now_ns;
    }

    /// Counts a cycle, and returns whether the segment ends with it.
    fn count_cycle(&mut self, segment: CycleSegment) -> bool {
        let since_ns = self.mark_ns - self.started_ns;
        self.timing.cycles += 1;
        if self.timing.cycles == 1 {
            self.timing.first_ns = since_ns;
        }
        self.timing.cycles == segment.cycles || since_ns >= segment.limit_ns
    }
}

impl<W: Phases> CycleSegmentContext<'_, W> {
    /// One worker's part of the segment, with its processor time where this call is measured.
    fn run<C: Clock>(
        &self,
        worker: &Worker<'_>,
        leader: Option<&mut LeadWorkerState<'_, '_, W, C>>,
    ) {
        let weight =
            lock(&self.workers[worker.index()]).stats.measurement_weight(self.segment.cycles);
        let start_ns = if weight > 0 { self.clock.thread_cpu_ns() } else { 0 };
        let _attached = self.interrupt.attach();
        self.run_cycles(worker, leader);
        if weight > 0 {
            let took_ns = self.clock.thread_cpu_ns() - start_ns;
            lock(&self.workers[worker.index()]).stats.cpu_ns += weight * took_ns;
        }
    }

    fn run_cycles<C: Clock>(
        &self,
        worker: &Worker<'_>,
        mut leader: Option<&mut LeadWorkerState<'_, '_, W, C>>,
    ) {
        let mut guard = None;
        for now in self.segment.from.. {
            let worker_state = guard.get_or_insert_with(|| lock(&self.workers[worker.index()]));
            self.run_cycle(worker, worker_state, now, leader.as_deref_mut());
            if self.is_observed {
                // The observer locks the scratches of all workers, so each releases its own first.
                guard = None;
                worker.wait_at_barrier();
                if let Some(leader) = &mut leader {
                    self.observe(now, leader);
                }
            }
            if let Some(leader) = &mut leader
                // `observe` has counted the cycle already.
                && !self.is_observed
                && leader.count_cycle(self.segment)
            {
                self.stop.store(true, Ordering::Relaxed);
            }
            worker.wait_at_barrier();
            if let Some(leader) = &mut leader
                && worker.team_size() > 1
            {
                // The wait for the others counts as part of the phase.
                leader.end_phase(|times| &mut times.act_ns);
            }
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
        }
    }

    /// Calls the observer after the cycle that is done and, if there is one, before the next.
    fn observe<C: Clock>(&self, now: Cycle, leader: &mut LeadWorkerState<'_, '_, W, C>) {
        leader.end_phase(|times| &mut times.act_ns);
        let is_last = leader.count_cycle(self.segment);
        let Some(observer) = &mut leader.observer else { return };
        leader.timing.is_stopped =
            observer.after_cycle(now, self.state, Scratches(self.workers)).is_break();
        if is_last || leader.timing.is_stopped {
            self.stop.store(true, Ordering::Relaxed);
        } else {
            observer.before_cycle(now + 1, self.state);
        }
        // The observer's own time belongs to no phase.
        leader.mark_ns = leader.clock.now_ns();
    }

    /// Runs all phases of one cycle; the effects of the last one are visible after the next
    /// barrier.
    #[inline]
    fn run_cycle<C: Clock>(
        &self,
        worker: &Worker<'_>,
        worker_state: &mut WorkerState<W::Scratch>,
        now: Cycle,
        mut leader: Option<&mut LeadWorkerState<'_, '_, W, C>>,
    ) {
        let &Self { world, state, groups, clock, segment, .. } = self;
        let WorkerState { scratch, stats } = worker_state;
        // Three pools of tasks per cycle, one per phase, counted from the start of the segment.
        let pool = 3 * (now - segment.from);
        let context = &mut PhaseContext { world, state, now, clock, scratch };
        if world.has_plan() {
            if leader.is_some() {
                interrupt::check();
                let start_ns = clock.thread_cpu_ns();
                W::plan(context);
                stats.plan_ns += clock.thread_cpu_ns() - start_ns;
            }
            worker.wait_at_barrier();
        }
        let n = world.body_count(state);
        worker.for_each_chunk(pool, n, |bodies| {
            interrupt::check();
            bodies.clone().for_each(|body| groups.make_singleton(body as EntitySlot));
            W::claim(context, bodies);
        });
        worker.wait_at_barrier();
        if let Some(leader) = &mut leader {
            leader.end_phase(|times| &mut times.claim_ns);
        }
        worker.for_each_chunk(pool + 1, n, |bodies| {
            interrupt::check();
            W::join(context, bodies, groups);
        });
        worker.wait_at_barrier();
        if let Some(leader) = &mut leader {
            leader.end_phase(|times| &mut times.join_ns);
        }
        let auction = world.auction();
        worker.for_each_chunk(pool + 2, n, |bodies| {
            interrupt::check();
            bodies.for_each(|body| {
                act_if_group_leader(context, groups, stats, auction.is_some(), body as EntitySlot);
            });
        });
        if let Some(auction) = auction {
            run_auction(auction, context, &mut stats.pending, worker);
        }
        if let Some(leader) = &mut leader {
            leader.end_phase(|times| &mut times.act_ns);
        }
    }
}

/// Lets the group of `body` act if `body` leads one.
#[inline]
fn act_if_group_leader<W: Phases>(
    context: &mut PhaseContext<'_, W>,
    groups: &ConflictGroups,
    stats: &mut WorkerStats,
    by_auction: bool,
    body: EntitySlot,
) {
    if !groups.is_leader(body) {
        return;
    }
    // A body without a conflict needs neither a list of members nor an auction.
    if groups.is_singleton(body) {
        stats.groups.counts[0] += 1;
        return W::act(context, &mut [body]);
    }
    let mut members = std::mem::take(&mut stats.members);
    groups.members(body, &mut members);
    stats.groups.add(members.len());
    if by_auction {
        stats.pending.extend_from_slice(&members);
    } else {
        W::act(context, &mut members);
    }
    stats.members = members;
}

/// Holds rounds of bidding until every body in conflict has acted. A group's bodies are all in
/// one worker's list, so the groups spread over the workers.
fn run_auction<W: Phases>(
    auction: &dyn Auction<W>,
    context: &mut PhaseContext<'_, W>,
    pending: &mut Vec<EntitySlot>,
    worker: &Worker<'_>,
) {
    while worker.any_worker(!pending.is_empty()) {
        interrupt::check();
        for &body in &*pending {
            auction.bid(context, body);
        }
        worker.wait_at_barrier();
        auction.act_on_bids(context, pending);
        worker.wait_at_barrier();
        auction.retract_bids(context);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_calls_stand_for_all() {
        let mut stats = WorkerStats::default();
        let weights: Vec<u64> = (0..64 + 1600).map(|_| stats.measurement_weight(1)).collect();
        assert_eq!(weights.iter().sum::<u64>(), 64 + 1600);
        assert_eq!(weights.iter().filter(|&&weight| weight > 0).count(), 64 + 100);
        assert!([2, 100].map(|cycles| stats.measurement_weight(cycles)) == [1, 1]);
    }
}
