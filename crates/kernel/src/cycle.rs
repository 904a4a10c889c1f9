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
use crate::workers::{Team, Worker};
use crate::world::World;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

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
        }
    }

    fn count_group(&mut self, size: usize) {
        self.group_sizes[size.ilog2() as usize] += 1;
        self.largest_group = self.largest_group.max(size as u64);
    }
}

/// The workers of an engine. A worker holds its lock while it works, so it never waits for one.
pub(crate) type Crew<S> = [Mutex<Mate<S>>];

/// Looks on between the cycles of a run, on the calling thread, while all workers wait.
///
/// It sees the state and takes what the workers have gathered, so that a caller who must look
/// after every cycle (keep poses, gather events, ask whether the run is over) costs no thread
/// and no call of the system per cycle. It cannot change the state.
pub trait Observer<W: World> {
    /// Sees the state as cycle `now` begins.
    fn before_cycle(&mut self, _now: Cycle, _state: &W::State) {}

    /// Sees the state that cycle `now` has left, and what the workers have gathered.
    /// `Break` ends the run there.
    fn after_cycle(
        &mut self,
        now: Cycle,
        state: &W::State,
        scratches: Scratches<'_, W::Scratch>,
    ) -> ControlFlow<()>;
}

/// The scratches of all workers, while they wait.
#[derive(Debug)]
pub struct Scratches<'a, S>(&'a Crew<S>);

impl<S> Scratches<'_, S> {
    /// Calls `take` for the scratch of each worker. Which worker has gathered what differs from
    /// run to run: no result may depend on the order.
    pub fn for_each(&mut self, mut take: impl FnMut(&mut S)) {
        self.0.iter().for_each(|mate| take(&mut lock(mate).scratch));
    }
}

/// A worker that panicked ends the run, so what it left behind is never looked at.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Cycles in a row that are run without a change of workers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch {
    /// The first cycle.
    pub(crate) from: Cycle,
    /// How many at most,
    pub(crate) cycles: u64,
    /// and how long: no cycle begins later than this after the first.
    pub(crate) limit_ns: u64,
}

/// What became of a [`Stretch`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ran {
    /// Cycles done, at least 1.
    pub(crate) cycles: u64,
    /// Their time, with the start of the threads and the observer,
    pub(crate) took_ns: u64,
    /// and the time until the first of them was done.
    pub(crate) first_ns: u64,
    /// Whether the observer ended the run.
    pub(crate) is_ended: bool,
    /// Time per phase.
    pub(crate) times: PhaseTimes,
}

/// Runs a stretch of at least one cycle with one worker per element of `crew`, on `team` where
/// there are several.
///
/// The result is the same bits for every length of `crew`.
pub(crate) fn advance<W: World, C: Clock>(
    world: &W,
    state: &W::State,
    groups: &Groups,
    (crew, team): (&Crew<W::Scratch>, Option<&mut Team>),
    stretch: Stretch,
    clock: &C,
    mut observer: Option<&mut dyn Observer<W>>,
) -> Ran {
    let started_ns = clock.now_ns();
    if let Some(observer) = &mut observer {
        observer.before_cycle(stretch.from, state);
    }
    let is_observed = observer.is_some();
    let stop = AtomicBool::new(false);
    let shared = Shared { world, state, groups, crew, stretch, is_observed, stop };
    let mark_ns = clock.now_ns();
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

/// What all workers see of a stretch.
struct Shared<'a, W: World> {
    world: &'a W,
    state: &'a W::State,
    groups: &'a Groups,
    crew: &'a Crew<W::Scratch>,
    stretch: Stretch,
    is_observed: bool,
    /// Whether the present cycle is the last one. Worker 0 writes it before a barrier, and all
    /// read it after that barrier.
    stop: AtomicBool,
}

/// The part of worker 0 alone: it reads the clock, calls the observer, and says when to stop.
struct Lead<'a, 'b, W: World, C> {
    clock: &'a C,
    observer: Option<&'a mut (dyn Observer<W> + 'b)>,
    started_ns: u64,
    /// When the present phase began.
    mark_ns: u64,
    ran: Ran,
}

impl<W: World, C: Clock> Lead<'_, '_, W, C> {
    /// Adds the time since the last call to one phase.
    fn end_phase(&mut self, phase: impl FnOnce(&mut PhaseTimes) -> &mut u64) {
        let now_ns = self.clock.now_ns();
        *phase(&mut self.ran.times) += now_ns - self.mark_ns;
        self.mark_ns = now_ns;
    }

    /// Counts a cycle, and says whether the stretch ends with it.
    fn count(&mut self, stretch: Stretch) -> bool {
        let since_ns = self.mark_ns - self.started_ns;
        self.ran.cycles += 1;
        if self.ran.cycles == 1 {
            self.ran.first_ns = since_ns;
        }
        self.ran.cycles == stretch.cycles || since_ns >= stretch.limit_ns
    }
}

impl<W: World> Shared<'_, W> {
    /// One worker's part of the stretch.
    fn work<C: Clock>(&self, worker: &Worker<'_>, mut lead: Option<&mut Lead<'_, '_, W, C>>) {
        let mut held = None;
        for (round, now) in (0..).zip(self.stretch.from..) {
            let mate = held.get_or_insert_with(|| lock(&self.crew[worker.index()]));
            self.one_cycle(worker, mate, (now, round), lead.as_deref_mut());
            if self.is_observed {
                held = None;
                worker.barrier();
                if let Some(lead) = &mut lead {
                    self.observe(now, lead);
                }
            }
            if let Some(lead) = &mut lead
                && !self.is_observed
                && lead.count(self.stretch)
            {
                self.stop.store(true, Ordering::Relaxed);
            }
            worker.barrier();
            if let Some(lead) = &mut lead
                && worker.team_size() > 1
            {
                // The wait for the others.
                lead.end_phase(|times| &mut times.react_ns);
            }
            if self.stop.load(Ordering::Relaxed) {
                return;
            }
        }
    }

    /// Lets the observer look at the cycle that is done and, if there is one, at the next.
    fn observe<C: Clock>(&self, now: Cycle, lead: &mut Lead<'_, '_, W, C>) {
        lead.end_phase(|times| &mut times.react_ns);
        let is_last = lead.count(self.stretch);
        let Some(observer) = &mut lead.observer else { return };
        lead.ran.is_ended = observer.after_cycle(now, self.state, Scratches(self.crew)).is_break();
        if is_last || lead.ran.is_ended {
            self.stop.store(true, Ordering::Relaxed);
        } else {
            observer.before_cycle(now + 1, self.state);
        }
        lead.mark_ns = lead.clock.now_ns();
    }

    /// All phases of one cycle; what the last one has done is seen after the next barrier.
    #[inline]
    fn one_cycle<C: Clock>(
        &self,
        worker: &Worker<'_>,
        mate: &mut Mate<W::Scratch>,
        (now, round): (Cycle, u64),
        mut lead: Option<&mut Lead<'_, '_, W, C>>,
    ) {
        let (world, state, groups) = (self.world, self.state, self.groups);
        let n = world.bodies(state);
        worker.for_each_chunk(3 * round, n, |bodies| {
            bodies.clone().for_each(|body| groups.reset(body as Slot));
            world.perceive_and_decide(state, now, bodies, &mut mate.scratch);
        });
        worker.barrier();
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.perceive_decide_ns);
        }
        worker.for_each_chunk(3 * round + 1, n, |bodies| {
            world.find_conflicts(state, now, bodies, groups, &mut mate.scratch);
        });
        worker.barrier();
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.conflicts_ns);
        }
        worker.for_each_chunk(3 * round + 2, n, |bodies| {
            bodies
                .for_each(|body| react_as_leader(world, state, groups, mate, (now, body as Slot)));
        });
        if world.reacts_in_rounds() {
            react_in_rounds(world, state, worker, mate, now);
        }
        if let Some(lead) = &mut lead {
            lead.end_phase(|times| &mut times.react_ns);
        }
    }
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
