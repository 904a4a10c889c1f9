//! Drives a run to its end, in slices short enough for the watcher.

use crate::Error;
use crate::frame_sink::FrameSink;
use crate::live::LiveControl;
use crate::run_recorder::{RunRecorder, next_multiple};
use crate::watcher::{Progress, ProgressGuard, Watcher};
use cpu_time::ProcessTime;
use sidestep_kernel::Cycle;
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::Recorder;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::{Duration, Instant};

/// Duration of a slice, and so the longest wait for a stop.
const SLICE_DURATION: Duration = Duration::from_millis(20);

/// The cycles and the time of a stretch of a run in this process.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunTiming {
    /// Cycles done.
    pub cycles: u64,
    /// Elapsed time.
    pub wall: Duration,
    /// CPU time of all threads.
    pub cpu: Duration,
}

impl std::ops::AddAssign for RunTiming {
    fn add_assign(&mut self, more: Self) {
        self.cycles += more.cycles;
        self.wall += more.wall;
        self.cpu += more.cpu;
    }
}

/// The destinations of a run's rows and frames.
#[derive(Default)]
pub struct Sinks<'a> {
    /// Rows and checkpoints.
    pub recording: Option<&'a mut RunRecorder>,
    /// Rows alone, for callers that keep them in memory; they are handed over once, so there is no recording then.
    pub rows: Option<&'a mut dyn Recorder>,
    /// The recording or animation that takes frames.
    pub frames: Option<&'a mut dyn FrameSink>,
    /// The viewers that watch it, and may hold it.
    pub viewers: Option<&'a mut LiveControl>,
}

/// Drives the run up to cycle `until`, or until the watcher asks to stop; the run's cycle shows
/// whether it reached the end. A film starts with the present state of the run.
///
/// # Errors
/// When rows, checkpoints or frames cannot be stored; [`Error::InterruptedInCycle`] when the watcher's
/// interrupt was raised.
pub fn drive(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<RunTiming, Error> {
    with_interrupt(run, watcher, |run| drive_slices(run, until, sinks, watcher))
}

/// Lets a run work so that the watcher can interrupt it within a cycle.
///
/// # Errors
/// Those of `work`; [`Error::InterruptedInCycle`] when the watcher's interrupt was raised, and the run is useless then.
pub(crate) fn with_interrupt<T>(
    run: &mut dyn Simulation,
    watcher: &dyn Watcher,
    work: impl FnOnce(&mut dyn Simulation) -> Result<T, Error>,
) -> Result<T, Error> {
    let interrupt = watcher.interrupt();
    run.set_interrupt(interrupt.clone());
    let worked = catch_unwind(AssertUnwindSafe(|| work(&mut *run)));
    worked.unwrap_or_else(|payload| match interrupt.caused(payload.as_ref()) {
        true => Err(Error::InterruptedInCycle(run.cycle())),
        false => resume_unwind(payload),
    })
}

fn drive_slices(
    run: &mut dyn Simulation,
    until: Cycle,
    mut sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<RunTiming, Error> {
    let (from, wall, cpu) = (run.cycle(), Instant::now(), ProcessTime::now());
    let watched = ProgressGuard(watcher);
    let mut pace = SliceSize::default();
    if let Some(film) = &mut sinks.frames {
        film.capture(run)?;
    }
    watched.report(Progress::Cycles { from, done: from, until });
    while run.cycle() < until && !run.is_over() && watcher.should_continue() {
        let allowed = sinks.viewers.as_mut().map_or(until, |viewers| viewers.next_target(run));
        let allowed = allowed.saturating_sub(run.cycle());
        if allowed > 0 {
            drive_slice(run, until, &mut sinks, &mut pace, allowed)?;
        }
        watched.report(Progress::Cycles { from, done: run.cycle(), until });
    }
    if let Some(viewers) = &mut sinks.viewers {
        viewers.finish(run);
    }
    Ok(RunTiming { cycles: run.cycle() - from, wall: wall.elapsed(), cpu: cpu.elapsed() })
}

/// Advances a little, by at most `allowed` cycles, and passes on rows and frames that are due.
fn drive_slice(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: &mut Sinks<'_>,
    pace: &mut SliceSize,
    allowed: Cycle,
) -> Result<(), Error> {
    let rows_due = sinks.recording.as_ref().map_or(until, |r| r.next_flush(run.cycle()).min(until));
    let frame_due = sinks
        .frames
        .as_ref()
        .map_or(until, |f| next_multiple(f.interval(), run.cycle()).min(until));
    let asked = pace.cycles().min(allowed).min(rows_due.min(frame_due) - run.cycle());
    let started = Instant::now();
    let done = match sinks.frames.as_mut().and_then(|film| Some((film.sample_interval()?, film))) {
        Some((step, film)) => advance_sampling(run, asked, step, &mut **film),
        None => run.advance(asked),
    };
    pace.adapt(done, started.elapsed());
    // A run may be over exactly at the end of a slice: then there is no further slice.
    let is_due = |due: Cycle, run: &dyn Simulation| run.cycle() == due || run.is_over();
    if let Some(recording) = &mut sinks.recording
        && (done < asked || is_due(rows_due, run))
    {
        recording.record(run)?;
    }
    if let Some(rows) = &mut sinks.rows
        && (done < asked || is_due(until, run))
    {
        run.record(&mut **rows)?;
    }
    if let Some(film) = &mut sinks.frames
        && is_due(frame_due, run)
    {
        film.capture(run)?;
    }
    Ok(())
}

/// Advances by at most `asked` cycles, and lets a film look at every `step`-th of them.
fn advance_sampling(
    run: &mut dyn Simulation,
    asked: Cycle,
    step: Cycle,
    film: &mut dyn FrameSink,
) -> Cycle {
    let from = run.cycle();
    while run.cycle() - from < asked && !run.is_over() {
        let left = asked - (run.cycle() - from);
        if run.advance(left.min(step)) == 0 {
            break;
        }
        film.sample(run);
    }
    run.cycle() - from
}

/// The number of cycles of a slice.
#[derive(Debug)]
struct SliceSize(u64);

impl Default for SliceSize {
    fn default() -> Self {
        Self(1)
    }
}

impl SliceSize {
    fn cycles(&self) -> u64 {
        self.0
    }

    /// Adapts the number of cycles to [`SLICE_DURATION`]; it grows at most fourfold at a time.
    fn adapt(&mut self, cycles: u64, took: Duration) {
        let per_cycle_s = took.as_secs_f64() / cycles.max(1) as f64;
        let fitting = (SLICE_DURATION.as_secs_f64() / per_cycle_s.max(1e-12)) as u64;
        self.0 = fitting.clamp(1, self.0.saturating_mul(4));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_grow_towards_their_time_and_shrink_at_once() {
        let mut pace = SliceSize::default();
        pace.adapt(1, Duration::from_micros(1));
        assert_eq!(pace.cycles(), 4);
        (0..20).for_each(|_| pace.adapt(100, Duration::from_micros(100)));
        assert_eq!(pace.cycles(), 20_000);
        pace.adapt(20_000, Duration::from_secs(20));
        assert_eq!(pace.cycles(), 20);
        pace.adapt(1, Duration::from_secs(30));
        assert_eq!(pace.cycles(), 1);
    }
}
