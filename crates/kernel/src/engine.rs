//! Runs a world for many cycles: the states of the workers, the conflict groups, and the choice of the number of
//! workers.
//!
//! A cycle that is too small to be worth sharing runs on one worker alone. The engine measures instead of
//! guessing, see `WorkerCountTuner`. Results do not depend on its choice.

use crate::conflict::ConflictGroups;
use crate::cycle::{
    CycleSegment, CycleSegmentTiming, EngineParts, Observer, PhaseTimes, WorkerState, advance, lock,
};
use crate::interrupt::Interrupt;
use crate::ports::Clock;
use crate::units::Cycle;
use crate::workers::WorkerTeam;
use crate::world::Phases;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Bodies are rearranged after at least this many cycles, because they have not gone far by then,
/// and sorting is below 1 % of the work.
const ARRANGE_INTERVAL_CYCLES: u64 = 64;

/// Cycles in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleRange {
    /// The first cycle, counted from the start of the run.
    pub from: Cycle,
    /// Number of cycles; 0 for none.
    pub cycles: u64,
}

/// Runs a world with as many workers as asked for, and keeps their shared data.
#[derive(Debug)]
pub struct Engine<W: Phases> {
    groups: ConflictGroups,
    /// Cycles since the bodies were arranged.
    since_arranged: u64,
    worker_states: Vec<Mutex<WorkerState<W::Scratch>>>,
    /// Barrier and cursors of all workers, created when they first work together.
    team: Option<WorkerTeam>,
    autotuner: WorkerCountTuner,
    times: PhaseTimes,
    interrupt: Interrupt,
}

impl<W: Phases> Engine<W> {
    /// Creates an engine of `workers` workers (at least 1) for `bodies` bodies.
    pub fn new(world: &W, bodies: usize, workers: usize) -> Self {
        Self {
            groups: ConflictGroups::new(bodies),
            // The bodies are arranged before the first cycle.
            since_arranged: ARRANGE_INTERVAL_CYCLES,
            worker_states: (0..workers.max(1))
                .map(|_| Mutex::new(WorkerState::new(world.new_scratch())))
                .collect(),
            team: None,
            autotuner: WorkerCountTuner::default(),
            times: PhaseTimes::default(),
            interrupt: Interrupt::default(),
        }
    }

    /// Lets [`Engine::advance`] unwind from a half-done cycle when `interrupt` is raised.
    pub fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.interrupt = interrupt;
    }

    /// Uses all workers from now on, even where one would be faster; for tests and benchmarks.
    pub fn force_parallel(&mut self) {
        self.autotuner.force_parallel = true;
    }

    /// Returns the states of the workers, for reading their results.
    pub fn worker_states(&self) -> impl Iterator<Item = MutexGuard<'_, WorkerState<W::Scratch>>> {
        self.worker_states.iter().map(lock)
    }

    /// Returns the states of the workers, for moving their results out.
    pub fn worker_states_mut(&mut self) -> impl Iterator<Item = &mut WorkerState<W::Scratch>> {
        self.worker_states
            .iter_mut()
            .map(|worker_state| worker_state.get_mut().unwrap_or_else(PoisonError::into_inner))
    }

    /// Time spent in each phase so far.
    pub fn phase_times(&self) -> PhaseTimes {
        self.times
    }

    /// Bytes on the heap, which grow with the number of bodies.
    pub fn heap_bytes(&self) -> usize {
        self.groups.heap_bytes()
    }

    /// Runs the cycles of a range without an observer, for worlds whose events carry their cycle and
    /// wait in the scratches until the end.
    pub fn advance(
        &mut self,
        world: &W,
        state: &mut W::State,
        range: CycleRange,
        clock: &impl Clock,
    ) {
        self.run(world, state, range, clock, None);
    }

    /// Runs the cycles of a range, and returns their number: fewer where `observer`, which is called
    /// between all cycles, has stopped the run. One call with many cycles is cheaper than many
    /// calls, because every call starts the threads anew.
    pub fn advance_with_observer(
        &mut self,
        world: &W,
        state: &mut W::State,
        range: CycleRange,
        clock: &impl Clock,
        observer: &mut dyn Observer<W>,
    ) -> u64 {
        self.run(world, state, range, clock, Some(observer))
    }

    fn run(
        &mut self,
        world: &W,
        state: &mut W::State,
        range: CycleRange,
        clock: &impl Clock,
        mut observer: Option<&mut dyn Observer<W>>,
    ) -> u64 {
        let CycleRange { from, cycles } = range;
        let mut done = 0;
        while done < cycles {
            if self.since_arranged >= ARRANGE_INTERVAL_CYCLES {
                world.reorder_slots(state);
                self.since_arranged = 0;
            }
            let options = self.autotuner.segment_options(self.worker_states.len());
            let segment = CycleSegment {
                from: from + done,
                cycles: cycles - done,
                limit_ns: options.limit_ns,
            };
            let workers = &self.worker_states[..options.workers];
            let team = (options.workers > 1)
                .then(|| self.team.get_or_insert_with(|| WorkerTeam::new(options.workers)));
            let parts = EngineParts {
                groups: &self.groups,
                workers,
                team,
                clock,
                interrupt: &self.interrupt,
            };
            let observer = observer.as_mut().map(|observer| &mut **observer as _);
            let timing = advance(world, state, parts, segment, observer);
            self.autotuner.record_timing(options, &timing);
            self.times.add(timing.times);
            self.since_arranged += timing.cycles;
            done += timing.cycles;
            if timing.is_stopped {
                break;
            }
        }
        done
    }
}

/// Approximate duration of a segment with one worker: long beside the clock readings around it, and short enough that a
/// probe starts soon after it is due.
const SERIAL_SEGMENT_NS: u64 = 5_000_000;
/// Duration of a segment with all workers: starting their threads is below 1 % of it.
const PARALLEL_SEGMENT_NS: u64 = 20_000_000;
/// Duration of a probe of the other mode, or that of [`PROBE_CYCLES`] cycles with one worker where that
/// is longer: the first cycle says little, because a thread is started in it and caches are cold.
const PROBE_NS: u64 = 1_000_000;
const PROBE_CYCLES: f64 = 2.0;

/// A cycle of less work than this is never run in parallel, because three barriers cost about 1 us where
/// every worker has a processor of its own, and 100 times that where not.
const MIN_PARALLEL_CYCLE_NS: f64 = 10_000.0;
/// A cycle of more work than this is tried with all workers from the start, because runs have
/// hundreds of cycles and a probe takes two or three.
const EAGER_PROBE_CYCLE_NS: f64 = 1_000_000.0;

/// All workers are chosen only if a cycle takes them less than this share of one worker's time: a smaller gain is
/// within the error of a probe of few cycles, and not worth the processor time of all.
const MAX_PARALLEL_COST_FRACTION: f64 = 0.9;

/// Time before the first probe, and between probes after one that changed the favorite: [`PROBE_WAIT_FACTOR`] times
/// [`PROBE_NS`].
const MIN_PROBE_WAIT_NS: f64 = 64e6;
/// Longest time between probes that changed nothing; each of these waits is twice as long as the
/// one before.
const MAX_PROBE_WAIT_NS: f64 = 5e9;
/// A probe is followed by at least this many times its own duration without one.
const PROBE_WAIT_FACTOR: f64 = 64.0;

/// Weight of the newest segment in the exponential moving average of the cost of a cycle: one slow segment does not
/// change the favorite, but a change of load does after a few.
const EMA_WEIGHT: f64 = 0.25;

/// Decides by measurement whether one worker or all run the next segment.
///
/// It uses whichever was faster, its favorite, and re-measures the other occasionally: a probe. However
/// costly the other is (with a barrier on processors that are busy with other work, a thousand
/// times as much), probing takes at most 1 part in [`PROBE_WAIT_FACTOR`] of the time: a probe ends after
/// [`PROBE_NS`] or [`PROBE_CYCLES`], and its own cost determines when the next is due. A probe that
/// changes nothing doubles the wait for the next, up to [`MAX_PROBE_WAIT_NS`], so that a change of load is
/// still noticed. Only a probe can make all workers the favorite, so an old measurement never does;
/// one worker takes over as soon as all are slower.
#[derive(Debug)]
struct WorkerCountTuner {
    /// Nanoseconds per cycle with one worker and with all; `None` where not measured yet.
    serial_ns: Option<f64>,
    parallel_ns: Option<f64>,
    favors_parallel: bool,
    /// Nanoseconds since the last probe.
    since_probe_ns: f64,
    /// Nanoseconds from the last probe to the next.
    probe_wait_ns: f64,
    force_parallel: bool,
}

/// The number of workers of the next segment, and its maximum duration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct CycleSegmentOptions {
    workers: usize,
    limit_ns: u64,
    /// Whether this measures the other mode, not the favorite.
    is_probe: bool,
}

impl Default for WorkerCountTuner {
    fn default() -> Self {
        Self {
            serial_ns: None,
            parallel_ns: None,
            favors_parallel: false,
            since_probe_ns: 0.0,
            probe_wait_ns: MIN_PROBE_WAIT_NS,
            force_parallel: false,
        }
    }
}

impl WorkerCountTuner {
    fn segment_options(&self, workers: usize) -> CycleSegmentOptions {
        if self.force_parallel {
            return CycleSegmentOptions { workers, limit_ns: PARALLEL_SEGMENT_NS, is_probe: false };
        }
        let is_probe = workers > 1 && self.is_probe_due();
        let is_parallel = self.favors_parallel != is_probe;
        let limit_ns = if is_probe {
            PROBE_NS.max((PROBE_CYCLES * self.serial_ns.unwrap_or(0.0)) as u64)
        } else if is_parallel {
            PARALLEL_SEGMENT_NS
        } else {
            SERIAL_SEGMENT_NS
        };
        CycleSegmentOptions { workers: if is_parallel { workers } else { 1 }, limit_ns, is_probe }
    }

    fn is_probe_due(&self) -> bool {
        let Some(serial_ns) = self.serial_ns else { return false };
        if !self.favors_parallel && serial_ns < MIN_PARALLEL_CYCLE_NS {
            return false;
        }
        let is_first = self.parallel_ns.is_none();
        self.since_probe_ns >= self.probe_wait_ns || (is_first && serial_ns >= EAGER_PROBE_CYCLE_NS)
    }

    fn record_timing(&mut self, options: CycleSegmentOptions, timing: &CycleSegmentTiming) {
        let took_ns = timing.took_ns as f64;
        let is_parallel = self.favors_parallel != options.is_probe;
        let measured = if is_parallel { &mut self.parallel_ns } else { &mut self.serial_ns };
        if options.is_probe {
            // An old measurement says nothing about the present load, so the probe replaces it.
            *measured = Some(per_cycle_ns(timing, timing.cycles > 1));
            self.since_probe_ns = 0.0;
            self.choose_after_probe(took_ns);
        } else {
            let newest = per_cycle_ns(timing, false);
            *measured = Some(measured.map_or(newest, |old| old + EMA_WEIGHT * (newest - old)));
            self.since_probe_ns += took_ns;
            self.fall_back_to_one(timing);
        }
    }

    fn choose_after_probe(&mut self, took_ns: f64) {
        let (Some(serial_ns), Some(parallel_ns)) = (self.serial_ns, self.parallel_ns) else {
            return;
        };
        // In doubt the favorite stays: all workers must be clearly faster to replace one.
        let threshold_ns =
            if self.favors_parallel { serial_ns } else { MAX_PARALLEL_COST_FRACTION * serial_ns };
        let favored_parallel = self.favors_parallel;
        self.favors_parallel = parallel_ns < threshold_ns;
        self.probe_wait_ns = if favored_parallel == self.favors_parallel {
            (2.0 * self.probe_wait_ns).min(MAX_PROBE_WAIT_NS)
        } else {
            MIN_PROBE_WAIT_NS
        };
        self.probe_wait_ns = self.probe_wait_ns.max(PROBE_WAIT_FACTOR * took_ns);
    }

    /// Goes back to one worker where all have become slower; the time lost counts like that of a probe.
    fn fall_back_to_one(&mut self, timing: &CycleSegmentTiming) {
        let (Some(serial_ns), Some(parallel_ns)) = (self.serial_ns, self.parallel_ns) else {
            return;
        };
        if self.favors_parallel && parallel_ns > serial_ns {
            let lost_ns = timing.took_ns as f64 - timing.cycles as f64 * serial_ns;
            self.favors_parallel = false;
            self.since_probe_ns = 0.0;
            self.probe_wait_ns = MIN_PROBE_WAIT_NS.max(PROBE_WAIT_FACTOR * lost_ns);
        }
    }
}

/// Nanoseconds per cycle, without the first one if it is to be left out: threads were started in
/// it, and caches were cold.
fn per_cycle_ns(timing: &CycleSegmentTiming, without_first: bool) -> f64 {
    let mut took_ns = timing.took_ns;
    let mut cycles = timing.cycles;
    if without_first {
        took_ns -= timing.first_ns;
        cycles -= 1;
    }
    (took_ns as f64 / cycles as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::Scratches;
    use crate::ports::ManualClock;
    use crate::units::EntitySlot;
    use crate::world::PhaseContext;
    use std::ops::{ControlFlow, Range};
    use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

    const SECOND_NS: u64 = 1_000_000_000;

    /// A pace on a machine with cycles of a known duration.
    #[derive(Default)]
    struct Trial {
        pace: WorkerCountTuner,
        /// More for the first cycle of all workers: threads are started.
        start_ns: u64,
        now_ns: u64,
        looking_ns: u64,
        with_all_ns: u64,
        looks_at_ns: Vec<u64>,
    }

    impl Trial {
        /// Runs for a time, with cycles of `[one worker, all workers]`.
        fn run(&mut self, time_ns: u64, cycle_ns: [u64; 2]) -> &mut Self {
            let until_ns = self.now_ns + time_ns;
            while self.now_ns < until_ns {
                let plan = self.pace.segment_options(2);
                let cycle_ns = cycle_ns[usize::from(plan.workers > 1)];
                let start_ns = if plan.workers > 1 { self.start_ns } else { 0 };
                let cycles = plan.limit_ns.saturating_sub(start_ns).div_ceil(cycle_ns).max(1);
                let took_ns = start_ns + cycles * cycle_ns;
                let first_ns = start_ns + cycle_ns;
                let timing = CycleSegmentTiming {
                    cycles,
                    took_ns,
                    first_ns,
                    ..CycleSegmentTiming::default()
                };
                if plan.is_probe {
                    self.looks_at_ns.push(self.now_ns);
                    self.looking_ns += took_ns;
                }
                self.with_all_ns += if plan.workers > 1 { took_ns } else { 0 };
                self.pace.record_timing(plan, &timing);
                self.now_ns += took_ns;
            }
            self
        }

        fn share_of_looking(&self) -> f64 {
            self.looking_ns as f64 / self.now_ns as f64
        }
    }

    #[test]
    fn the_faster_way_is_kept_for_nearly_all_of_the_time() {
        for (cycle_ns, least, most) in [
            ([2_000_000, 1_100_000], 0.97, 1.0),
            ([100_000, 60_000], 0.93, 1.0),
            ([100_000, 300_000], 0.0, 0.02),
            // Not worth the other processors.
            ([100_000, 95_000], 0.0, 0.02),
        ] {
            let mut trial = Trial::default();
            trial.run(4 * SECOND_NS, cycle_ns);
            let is_parallel = trial.with_all_ns as f64 / trial.now_ns as f64;
            assert!((least..=most).contains(&is_parallel), "{cycle_ns:?}: {is_parallel}");
        }
    }

    #[test]
    fn a_slow_start_of_threads_hides_no_faster_team() {
        for (cycle_ns, start_ns) in
            [([2_000_000, 1_100_000], 900_000), ([100_000, 60_000], 300_000)]
        {
            let mut trial = Trial { start_ns, ..Trial::default() };
            trial.run(SECOND_NS / 10, cycle_ns);
            assert!(trial.pace.favors_parallel, "{cycle_ns:?}");
            assert_eq!(trial.looks_at_ns.len(), 1);
        }
    }

    #[test]
    fn looking_takes_two_percent_at_most_however_slow_the_other_way_is() {
        for serial_ns in [12_000, 50_000, 900_000, 3_000_000] {
            for times_slower in [1, 3, 30, 1000] {
                let mut trial = Trial::default();
                let cycle_ns = [serial_ns, serial_ns * times_slower];
                trial.run(100 * SECOND_NS + 1000 * cycle_ns[1], cycle_ns);
                let share = trial.share_of_looking();
                assert!(share <= 0.02, "{cycle_ns:?}: {share}");
                assert!(!trial.looks_at_ns.is_empty());
            }
        }
    }

    #[test]
    fn a_hopeless_team_is_looked_at_ever_less_often_but_never_given_up() {
        let mut trial = Trial::default();
        trial.run(100 * SECOND_NS, [100_000, 500_000]);
        let waits: Vec<u64> = trial.looks_at_ns.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(waits.len() > 10, "{waits:?}");
        let longest = MAX_PROBE_WAIT_NS as u64;
        let grows = |w: &[u64]| 2 * w[1] > 3 * w[0] || w[1].abs_diff(longest) < longest / 50;
        assert!(waits.windows(2).all(grows), "{waits:?}");
    }

    #[test]
    fn a_tiny_world_never_gets_a_team() {
        let mut trial = Trial::default();
        trial.run(60 * SECOND_NS, [9_000, 1]);
        assert_eq!(trial.with_all_ns, 0);
    }

    #[test]
    fn a_change_is_noticed_in_either_direction() {
        let mut trial = Trial::default();
        trial.run(60 * SECOND_NS, [100_000, 2_000_000]);
        assert!(!trial.pace.favors_parallel);
        trial.run(2 * MAX_PROBE_WAIT_NS as u64, [100_000, 55_000]);
        assert!(trial.pace.favors_parallel, "the other work has ended");
        trial.run(20 * SECOND_NS, [100_000, 55_000]);
        trial.run(SECOND_NS / 10, [100_000, 100_000_000]);
        assert!(!trial.pace.favors_parallel, "other work has begun");
        trial.run(60 * SECOND_NS, [100_000, 55_000]);
        assert!(trial.pace.favors_parallel, "and has ended");
        trial.run(20 * SECOND_NS, [30_000, 55_000]);
        assert!(!trial.pace.favors_parallel, "one worker has become faster");
    }

    #[test]
    fn what_a_false_hope_costs_is_paid_off_before_the_next() {
        let mut trial = Trial::default();
        // Looks are promising, and everything after them is slow.
        for _ in 0..300 {
            while !trial.pace.segment_options(2).is_probe {
                trial.run(1, [100_000, 400_000]);
            }
            trial.run(1, [100_000, 50_000]);
        }
        let lost = trial.with_all_ns as f64 * 0.75 / trial.now_ns as f64;
        assert!(lost <= 0.02, "{lost}");
    }

    /// Counts its cycles; a cycle takes time on the clock, more of it for a second worker.
    struct Ticking<'a> {
        clock: &'a ManualClock,
        serial_ns: u64,
        helper_ns: u64,
    }

    struct Ticks(Vec<AtomicU64>);

    impl Phases for Ticking<'_> {
        type State = Ticks;
        type Scratch = Vec<(Cycle, usize)>;

        fn new_scratch(&self) -> Self::Scratch {
            Vec::new()
        }

        fn body_count(&self, state: &Ticks) -> usize {
            // Every worker calls it once a cycle.
            let is_helper = std::thread::current().name().is_some_and(|n| n.starts_with("worker"));
            self.clock.advance_ns(if is_helper { self.helper_ns } else { self.serial_ns });
            state.0.len()
        }

        fn claim(turn: &mut PhaseContext<'_, Self>, bodies: Range<usize>) {
            for body in bodies {
                turn.state.0[body].fetch_add(1, Relaxed);
                turn.scratch.push((turn.now, body));
            }
        }

        fn join(_: &mut PhaseContext<'_, Self>, _: Range<usize>, _: &ConflictGroups) {}

        fn act(_: &mut PhaseContext<'_, Self>, _: &mut [EntitySlot]) {}
    }

    fn ticks(n: usize) -> Ticks {
        Ticks((0..n).map(|_| AtomicU64::new(0)).collect())
    }

    #[test]
    fn an_engine_spends_two_percent_at_most_on_a_team_that_is_a_thousand_times_slower() {
        let clock = ManualClock::default();
        let world = Ticking { clock: &clock, serial_ns: 20_000, helper_ns: 20_000_000 };
        let (mut state, cycles) = (ticks(3), 200_000);
        let mut engine = Engine::new(&world, 3, 2);
        engine.advance(&world, &mut state, CycleRange { from: 0, cycles }, &clock);
        assert!(engine.team.is_some(), "it was looked at");
        let took_ns = clock.now_ns() as f64;
        let serial_ns = (cycles * world.serial_ns) as f64;
        assert!(took_ns <= 1.02 * serial_ns, "{took_ns} against {serial_ns}");
        engine.worker_states_mut().for_each(|worker_state| worker_state.scratch.clear());
        assert!(state.0.iter().all(|n| n.load(Relaxed) == cycles));
    }

    #[test]
    fn an_engine_never_makes_a_team_for_a_tiny_world() {
        let clock = ManualClock::default();
        let world = Ticking { clock: &clock, serial_ns: 5_000, helper_ns: 1 };
        let mut engine = Engine::new(&world, 3, 2);
        engine.advance(&world, &mut ticks(3), CycleRange { from: 0, cycles: 200_000 }, &clock);
        assert!(engine.team.is_none());
    }

    /// Notes the cycles it sees, and ends the run after `last`.
    #[derive(Default)]
    struct Notes {
        last: Cycle,
        began: Vec<(Cycle, u64)>,
        done: Vec<(Cycle, usize)>,
    }

    impl Observer<Ticking<'_>> for Notes {
        fn before_cycle(&mut self, now: Cycle, state: &Ticks) {
            self.began.push((now, state.0[0].load(Relaxed)));
        }

        fn after_cycle(
            &mut self,
            now: Cycle,
            state: &Ticks,
            mut scratches: Scratches<'_, Vec<(Cycle, usize)>>,
        ) -> ControlFlow<()> {
            assert!(state.0.iter().all(|n| n.load(Relaxed) == now + 1));
            let mut seen = Vec::new();
            scratches.for_each(|scratch| seen.append(scratch));
            seen.sort_unstable();
            self.done.extend(seen);
            if now == self.last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
    }

    #[test]
    fn an_observer_sees_every_cycle_whole_and_ends_the_run_where_it_likes() {
        let clock = ManualClock::default();
        // Several stretches.
        let world = Ticking { clock: &clock, serial_ns: 400_000, helper_ns: 400_000 };
        for workers in [1, 2, 3] {
            let mut engine = Engine::new(&world, 5, workers);
            engine.force_parallel();
            let (mut state, mut notes) = (ticks(5), Notes { last: 149, ..Notes::default() });
            for (from, cycles) in [(0, 1), (1, 99), (100, 1000)] {
                let range = CycleRange { from, cycles };
                let done =
                    engine.advance_with_observer(&world, &mut state, range, &clock, &mut notes);
                assert_eq!(done, cycles.min(150 - from));
            }
            assert_eq!(notes.began, (0..150).map(|now| (now, now)).collect::<Vec<_>>());
            let all = (0..150).flat_map(|now| (0..5).map(move |body| (now, body)));
            assert_eq!(notes.done, all.collect::<Vec<_>>());
        }
    }
}
