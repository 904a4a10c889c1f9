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

/// Duration of a slice, and so the longest wait for a stop: short enough that a key press seems to act at once.
const SLICE_DURATION: Duration = Duration::from_millis(20);

/// A stretch of a run in this process: its cycles, and the time that they took.
#[derive(Debug, Clone, Copy, Default)]
pub struct RunTiming {
    /// Cycles done in the stretch, not since the run's start.
    pub cycles: u64,
    /// Elapsed time, including that in which viewers held the run.
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
    /// The run folder, which takes rows at multiples of cycles and saves checkpoints when they are due.
    pub recording: Option<&'a mut RunRecorder>,
    /// Rows alone, for callers that keep them in memory; they are handed over once, so there is no recording then.
    pub rows: Option<&'a mut dyn Recorder>,
    /// The recording or animation that takes frames.
    pub frames: Option<&'a mut dyn FrameSink>,
    /// The viewers that watch it, and may hold it.
    pub viewers: Option<&'a mut LiveControl>,
}

/// Drives the run up to cycle `until`, or until the watcher asks to stop; the run's cycle shows
/// whether it reached the end. The first frame is of the present state of the run.
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
    // An interrupt leaves the cycle by unwinding, because it may be raised deep in a search that returns no errors.
    match catch_unwind(AssertUnwindSafe(|| work(&mut *run))) {
        Ok(result) => result,
        Err(payload) if interrupt.has_caused_unwind(payload.as_ref()) => {
            Err(Error::InterruptedInCycle(run.cycle()))
        }
        Err(payload) => resume_unwind(payload),
    }
}

fn drive_slices(
    run: &mut dyn Simulation,
    until: Cycle,
    mut sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<RunTiming, Error> {
    let from = run.cycle();
    let wall = Instant::now();
    let cpu = ProcessTime::now();
    let watched = ProgressGuard(watcher);
    let mut slice_size = SliceSize::default();
    if let Some(frames) = &mut sinks.frames {
        frames.capture(run)?;
    }
    watched.report(Progress::Cycles { from, done: from, until });
    while run.cycle() < until && !run.is_over() && watcher.should_continue() {
        let target = match &mut sinks.viewers {
            Some(viewers) => viewers.next_target(run),
            None => until,
        };
        // Viewers that pause the run give its present cycle, after a short wait: there is no slice then, but the
        // watcher is still asked whether to stop.
        let allowed = target.saturating_sub(run.cycle());
        if allowed > 0 {
            drive_slice(run, until, &mut sinks, &mut slice_size, allowed)?;
        }
        watched.report(Progress::Cycles { from, done: run.cycle(), until });
    }
    if let Some(viewers) = &mut sinks.viewers {
        viewers.finish(run);
    }
    Ok(RunTiming { cycles: run.cycle() - from, wall: wall.elapsed(), cpu: cpu.elapsed() })
}

/// Advances by at most `allowed` cycles, and by no more than fit a slice or come before the next rows or frame are
/// due.
fn drive_slice(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: &mut Sinks<'_>,
    size: &mut SliceSize,
    allowed: Cycle,
) -> Result<(), Error> {
    let mut rows_due = until;
    if let Some(recording) = &sinks.recording {
        rows_due = recording.next_flush(run.cycle()).min(until);
    }
    let mut frame_due = until;
    if let Some(frames) = &sinks.frames {
        frame_due = next_multiple(frames.interval(), run.cycle()).min(until);
    }
    let until_due = rows_due.min(frame_due) - run.cycle();
    let asked = size.cycles().min(allowed).min(until_due);
    let started = Instant::now();
    let done = advance(run, asked, sinks);
    size.adapt(done, started.elapsed());
    // The run hands over rows early when its buffers are full (`done < asked`). It may also be over exactly at the
    // end of a slice: then there is no further slice, and everything is due now.
    let are_buffers_full = done < asked;
    if let Some(recording) = &sinks.recording {
        recording.folder().check_in_place()?;
    }
    if let Some(recording) = &mut sinks.recording
        && (are_buffers_full || run.cycle() == rows_due || run.is_over())
    {
        recording.record(run)?;
    }
    if let Some(rows) = &mut sinks.rows
        && (are_buffers_full || run.cycle() == until || run.is_over())
    {
        run.record(&mut **rows)?;
    }
    if let Some(frames) = &mut sinks.frames
        && (run.cycle() == frame_due || run.is_over())
    {
        frames.capture(run)?;
    }
    Ok(())
}

/// Advances by at most `asked` cycles; returns the number of cycles done.
fn advance(run: &mut dyn Simulation, asked: Cycle, sinks: &mut Sinks<'_>) -> Cycle {
    if let Some(frames) = &mut sinks.frames
        && let Some(step) = frames.sample_interval()
    {
        return advance_sampling(run, asked, step, &mut **frames);
    }
    run.advance(asked)
}

/// Advances by at most `asked` cycles, and lets a sink of frames see every `step`-th of them.
fn advance_sampling(
    run: &mut dyn Simulation,
    asked: Cycle,
    step: Cycle,
    frames: &mut dyn FrameSink,
) -> Cycle {
    let from = run.cycle();
    while run.cycle() - from < asked && !run.is_over() {
        let left = asked - (run.cycle() - from);
        if run.advance(left.min(step)) == 0 {
            break;
        }
        frames.sample(run);
    }
    run.cycle() - from
}

/// The number of cycles that take about [`SLICE_DURATION`], by the times of the slices before.
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

    /// Adapts the number of cycles to [`SLICE_DURATION`]. It grows at most fourfold at a time, because a first cycle in
    /// which nothing happens says little about the next thousand.
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
