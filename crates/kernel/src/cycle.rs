//! The only place that knows the order of the phases.
//!
//! ```text
//! claim                         join                   act
//! perceive, decide, claim  ──|  claims -> groups  ──|  groups act  ──|  next cycle
//!                         barrier                barrier          barrier
//! ```
//!
//! Agents that decide together ([`crate::world::Decides`]) do so in the last phase.
//!
//! The source paper merges tasks while they are inserted into pool two and so needs two barriers,
//! but a lock or an atomic exchange per claimed box. Here claims are plain stores and joining is a
//! pass of its own, at the price of one more barrier per cycle.

use crate::conflict::Groups;
use crate::interrupt::{self, Interrupt};
use crate::plan::GroupSizes;
use crate::ports::Clock;
use crate::units::{Cycle, Slot};
use crate::workers::{Team, Worker};
use crate::world::{Auction, Phases, Turn};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Time of worker 0 in each phase, waiting at the barrier included, in nanoseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PhaseTimes {
    /// Every body perceives, decides (where agents decide alone), and claims.
    pub claim_ns: u64,
    /// Claims become groups.
    pub join_ns: u64,
    /// Groups decide where agents decide together, and act.
    pub act_ns: u64,
}

impl PhaseTimes {
    /// Adds the times of another stretch of cycles.
    pub fn add(&mut self, other: Self) {
        self.claim_ns += other.claim_ns;
        self.join_ns += other.join_ns;
        self.act_ns += other.act_ns;
    }
}

/// One worker's share of a run: the world's scratch and the kernel's own.
#[derive(Debug)]
pub struct Mate<S> {
    /// The world's scratch.
    pub scratch: S,
    /// The kernel's own.
    pub tally: Tally,
}

/// A worker's group sizes, processor time and buffers.
#[derive(Debug, Default)]
pub struct Tally {
    /// Conflict groups seen.
    pub groups: GroupSizes,
    /// Processor time of the worker's thread, in nanoseconds; where calls are of a single cycle, only some are
    /// measured and stand for all.
    pub cpu_ns: u64,
    /// Calls of a single cycle.
    single: u64,
    members: Vec<Slot>,
    /// Bodies in conflict that have not acted yet, in worlds with an auction.
    pending: Vec<Slot>,
}

/// The number of first calls of a single cycle that are all measured, and of later calls per measured one: reading
/// the processor time is a system call, and small worlds that get orders from cycle to cycle take not much longer.
const MEASURED_SINGLE: u64 = 64;
const SINGLE_PER_MEASURED: u64 = 16;

impl Tally {
    /// Returns the number of calls for which the processor time of the next one stands; 0 if it is not measured.
    fn weight(&mut self, cycles: u64) -> u64 {
        if cycles > 1 {
            return 1;
        }
        self.single += 1;
        match self.single {
            ..=MEASURED_SINGLE => 1,
            k if k.is_multiple_of(SINGLE_PER_MEASURED) => SINGLE_PER_MEASURED,
            _ => 0,
        }
    }
}

impl<S> Mate<S> {
    /// Creates a worker that has done nothing yet.
    pub fn new(scratch: S) -> Self {
        Self { scratch, tally: Tally::default() }
    }
}

/// The workers of an engine. A worker holds its lock while it works, so it never waits for one.
pub(crate) type Crew<S> = [Mutex<Mate<S>>];

/// An onlooker between the cycles of a run, on the calling thread, while all workers wait.
///
/// It sees the state and takes over the results of the workers, so that a caller that must look
/// after every cycle (keep poses, gather events, ask whether the run is over) costs no thread and
/// no system call per cycle. It cannot change the state.
pub trait Observer<W: Phases> {
    /// Sees the state at the start of cycle `now`.
    fn before_cycle(&mut self, _now: Cycle, _state: &W::State) {}

    /// Sees the state after cycle `now`, and the results of the workers. `Break` ends the run
    /// there.
    fn after_cycle(
        &mut self,
        now: Cycle,
        state: &W::State,
        scratches: Scratches<'_, W::Scratch>,
    ) -> ControlFlow<()>;
}

/// The scratches of all workers, while these wait.
#[derive(Debug)]
pub struct Scratches<'a, S>(&'a Crew<S>);

impl<S> Scratches<'_, S> {
    /// Calls `take` for the scratch of each worker. The share of each worker differs from run to
    /// run: no result may depend on the order.
    pub fn for_each(&mut self, mut take: impl FnMut(&mut S)) {
        self.0.iter().for_each(|mate| take(&mut lock(mate).scratch));
    }
}

/// A worker that panicked ends the run, so nothing it left behind is ever read.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Cycles in a row that are run without a change of workers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    /// The first cycle.
    pub(crate) from: Cycle,
    /// The maximum number of cycles.
    pub(crate) cycles: u64,
    /// The longest time in nanoseconds: no cycle starts later than this after the first.
    pub(crate) limit_ns: u64,
}

/// The result of a [`Stretch`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ran {
    /// Cycles done, at least 1.
    pub(crate) cycles: u64,
    /// Their time in nanoseconds, including the start of the threads and the observer.
    pub(crate) took_ns: u64,
    /// Nanoseconds until the first of them was done.
    pub(crate) first_ns: u64,
    /// Whether the observer ended the run.
    pub(crate) is_ended: bool,
    /// Time per phase.
    pub(crate) times: PhaseTimes,
}

/// The parts of an engine that run a stretch.
pub(crate) struct Parts<'a, S, C> {
    pub(crate) groups: &'a Groups,
    /// One worker per element.
    pub(crate) crew: &'a Crew<S>,
    /// The threads of the crew, where it has several workers.
    pub(crate) team: Option<&'a mut Team>,
    pub(crate) clock: &'a C,
    pub(crate) interrupt: &'a Interrupt,
}

/// Runs a stretch of at least one cycle.
///
/// The result is the same bits for every length of the crew.
pub(crate) fn advance<W: Phases, C: Clock>(
    world: &W,
    state: &W::State,
    parts: Parts<'_, W::Scratch, C>,
    stretch: Stretch,
    mut observer: Option<&mut dyn Observer<W>>,
) -> Ran {
    let Parts { groups, crew, team, clock, interrupt } = parts;
    let started_ns = clock.now_ns();
    if let Some(observer) = &mut observer {
        observer.before_cycle(stretch.from, state);
    }
    let is_observed = observer.is_some();
    let stop = AtomicBool::new(false);
    let shared =
        Shared { world, state, groups, crew, clock, interrupt, stretch, is_observed, stop };
    // The observer's own time belongs to no phase.
    let mark_ns = if is_observed { clock.now_ns() } else { started_ns };
    let mut lead = Lead { clock, observer, started_ns, mark_ns, ran: Ran::default() };
    match team {
        None => shared.work(&Worker::ALONE, Some(&mut lead)),
        Some(team) => team.run(
            &mut vec![(); crew.len()],
            |worker, ()| shared.work(worker, Some(&mut lead)),
            |worker, ()| shared.work::<C>(worker, None),
        ),
    }
    Ran { took_ns: clock.now_ns() - started_ns, ..lead.ran }
}

/// The data of a stretch that all workers share.
struct Shared<'a, W: Phases> {
    world: &'a W,
    state: &'a W::State,
    groups: &'a Groups,
    crew: &'a Crew<W::Scratch>,
    clock: &'a dyn Clock,
    interrupt: &'a Interrupt,
    stretch: Stretch,
    is_observed: bool,
    /// Whether the present cycle is the last one. Worker 0 writes it before a barrier, and all
    /// read it after that barrier.
    stop: AtomicBool,
}

/// The part of worker 0 alone: it reads the clock, calls the observer, and ends the stretch.
struct Lead<'a, 'b, W: Phases, C> {
    clock: &'a C,
    observer: Option<&'a mut (dyn Observer<W> + 'b)>,
    started_ns: u64,
    /// Clock reading at the start of the present phase, in nanoseconds.
    mark_ns: u64,
    ran: Ran,
}

impl<W: Phases, C: Clock> Lead<'_, '_, W, C> {
    /// Adds the time since the last call to one phase.
    fn end_phase(&mut self, phase: impl FnOnce(&mut PhaseTimes) -> &mut u64) {
        let now_ns = self.clock.now_ns();
        *phase(&mut self.ran.times) += now_ns - self.mark_ns;
        self.mark_ns = now_ns;
    }

    /// Counts a cycle, and returns whether the stretch ends with it.
    fn count(&mut self, stretch: Stretch) -> bool {
        let since_ns = self.mark_ns - self.started_ns;
        self.ran.cycles += 1;
        if self.ran.cycles == 1 {
            self.ran.first_ns = since_ns;
        }
        self.ran.cycles == stretch.cycles || since_ns >= stretch.limit_ns
    }
}

impl<W: Phases> Shared<'_, W> {
    /// One worker's part of the stretch.
    fn work<C: Clock>(&self, worker: &Worker<'_>, lead: Option<&mut Lead<'_, '_, W, C>>) {
        let weight = lock(&self.crew[worker.index()]).tally.weight(self.stretch.cycles);
        let began_ns = if weight > 0 { self.clock.thread_cpu_ns() } else { 0 };
        let _heeded = self.interrupt.heeded_here();
        self.all_cycles(worker, lead);
        if weight > 0 {
            let took_ns = self.clock.thread_cpu_ns() - began_ns;
            lock(&self.crew[worker.index()]).tally.cpu_ns += weight * took_ns;
        }
    }

    fn all_cycles<C: Clock>(&self, worker: &Worker<'_>, mut lead: Option<&mut Lead<'_, '_, W, C>>) {
        let mut held = None;
        for now in self.stretch.from.. {
            let mate = held.get_or_insert_with(|| lock(&self.crew[worker.index()]));
            self.one_cycle(worker, mate, now, lead.as_deref_mut());
            if self.is_observed {
                // The observer locks the scratches of all workers, so each releases its own first.
                held = None;
                worker.barrier();
                if let Some(lead) = &mut lead {
                    self.observe(now, lead);
                }
            }
            if let Some(lead) = &mut lead
                // `observe` has counted the cycle already.
                && !self.is_observed
                && lead.count(self.stretch)
            {
                self.stop.store(true, Ordering::Relaxed);
            }
            worker.barrier();
            if let Some(lead) = &mut lead
                && worker.team_size() > 1
            {
                // The wait for the others counts as part of the phase.
                lead.end_phase(|times| &mut times.act_ns);
            }
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
        }
    }

    /// Lets the observer look at the cycle that is done and, if there is one, at the next.
    fn observe<C: Clock>(&self, now: Cycle, lead: &mut Lead<'_, '_, W, C>) {
        lead.end_phase(|times| &mut times.act_ns);
        let is_last = lead.count(self.stretch);
        let Some(observer) = &mut lead.observer else { return };
        lead.ran.is_ended = observer.after_cycle(now, self.state, Scratches(self.crew)).is_break();
        if is_last || lead.ran.is_ended {
            self.stop.store(true, Ordering::Relaxed);
        } else {
            observer.before_cycle(now + 1, self.state);
        }
        // The observer's own time belongs to no phase.
        lead.mark_ns = lead.clock.now_ns();
    }

    /// Runs all phases of one cycle; the effects of the last one are visible after the next
    /// barrier.
    #[inline]
    fn one_cycle<C: Clock>(
        &self,
        worker: &Worker<'_>,
        mate: &mut Mate<W::Scratch>,
        now: Cycle,
        mut lead: Option<&mut Lead<'_, '_, W, C>>,
    ) {
        let &Self { world, state, groups, clock, stretch, .. } = self;
        let Mate { scratch, tally } = mate;
        let pool = 3 * (now - stretch.from);
        let turn = &mut Turn { world, state, now, clock, scratch };
        let n = world.bodies(state);
        worker.for_each_chunk(pool, n, |bodies| {
            interrupt::look();
            bodies.clone().for_each(|body| groups.reset(body as Slot));
            W::claim(turn, bodies);
        });
        worker.barrier();
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.claim_ns);
        }
        worker.for_each_chunk(pool + 1, n, |bodies| {
            interrupt::look();
            W::join(turn, bodies, groups);
        });
        worker.barrier();
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.join_ns);
        }
        let auction = world.auction();
        worker.for_each_chunk(pool + 2, n, |bodies| {
            interrupt::look();
            bodies.for_each(|body| {
                act_as_leader(turn, groups, tally, auction.is_some(), body as Slot);
            });
        });
        if let Some(auction) = auction {
            hold_auction(auction, turn, &mut tally.pending, worker);
        }
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.act_ns);
        }
    }
}

/// Lets the group of `body` act if `body` leads one.
#[inline]
fn act_as_leader<W: Phases>(
    turn: &mut Turn<'_, W>,
    groups: &Groups,
    own: &mut Tally,
    by_auction: bool,
    body: Slot,
) {
    if !groups.is_leader(body) {
        return;
    }
    // A body without a conflict needs neither a list of members nor an auction.
    if groups.is_alone(body) {
        own.groups.counts[0] += 1;
        return W::act(turn, &mut [body]);
    }
    let mut members = std::mem::take(&mut own.members);
    groups.members(body, &mut members);
    own.groups.add(members.len());
    if by_auction {
        own.pending.extend_from_slice(&members);
    } else {
        W::act(turn, &mut members);
    }
    own.members = members;
}

/// Holds rounds of bidding until every body in conflict has acted. A group's bodies are all in
/// one worker's list, so the groups spread over the workers.
fn hold_auction<W: Phases>(
    auction: &dyn Auction<W>,
    turn: &mut Turn<'_, W>,
    pending: &mut Vec<Slot>,
    worker: &Worker<'_>,
) {
    while worker.any(!pending.is_empty()) {
        interrupt::look();
        for &body in &*pending {
            auction.bid(turn, body);
        }
        worker.barrier();
        auction.act_on_bids(turn, pending);
        worker.barrier();
        auction.retract_bids(turn);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_calls_stand_for_all() {
        let mut tally = Tally::default();
        let weights: Vec<u64> = (0..64 + 1600).map(|_| tally.weight(1)).collect();
        assert_eq!(weights.iter().sum::<u64>(), 64 + 1600);
        assert_eq!(weights.iter().filter(|&&weight| weight > 0).count(), 64 + 100);
        assert!([2, 100].map(|cycles| tally.weight(cycles)) == [1, 1]);
    }
}
