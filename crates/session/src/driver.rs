//! Drives a run to its end, in slices short enough for the watcher.

use crate::Error;
use crate::film::Film;
use crate::live::Steered;
use crate::recording::{Recording, next};
use crate::watcher::{Progress, Watched, Watcher};
use cpu_time::ProcessTime;
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;
use sidestep::kernel::ports::Recorder;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::{Duration, Instant};

/// Duration of a slice, and so the longest wait for a stop.
const SLICE: Duration = Duration::from_millis(20);

/// The cycles and the time of a stretch of a run in this process.
#[derive(Debug, Clone, Copy, Default)]
pub struct Effort {
    /// Cycles done.
    pub cycles: u64,
    /// Elapsed time.
    pub wall: Duration,
    /// CPU time of all threads.
    pub cpu: Duration,
}

impl std::ops::AddAssign for Effort {
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
    pub recording: Option<&'a mut Recording>,
    /// Rows alone, for callers that keep them in memory; they are handed over once, so there is no recording then.
    pub rows: Option<&'a mut dyn Recorder>,
    /// The recording or animation that takes frames.
    pub film: Option<&'a mut dyn Film>,
    /// The viewers that watch it, and may hold it.
    pub viewers: Option<&'a mut Steered>,
}

/// Drives the run up to cycle `until`, or until the watcher asks to stop; the run's cycle shows
/// whether it reached the end. A film starts with the present state of the run.
///
/// # Errors
/// When rows, checkpoints or frames cannot be stored; [`Error::WithinACycle`] when the watcher's
/// interrupt was raised.
pub fn drive(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<Effort, Error> {
    heeding(run, watcher, |run| slices(run, until, sinks, watcher))
}

/// Lets a run work so that the watcher can interrupt it within a cycle.
///
/// # Errors
/// Those of `work`; [`Error::WithinACycle`] when the watcher's interrupt was raised, and the run is useless then.
pub(crate) fn heeding<T>(
    run: &mut dyn Simulation,
    watcher: &dyn Watcher,
    work: impl FnOnce(&mut dyn Simulation) -> Result<T, Error>,
) -> Result<T, Error> {
    let interrupt = watcher.interrupt();
    run.heed(interrupt.clone());
    let worked = catch_unwind(AssertUnwindSafe(|| work(&mut *run)));
    worked.unwrap_or_else(|payload| match interrupt.explains(payload.as_ref()) {
        true => Err(Error::WithinACycle(run.cycle())),
        false => resume_unwind(payload),
    })
}

fn slices(
    run: &mut dyn Simulation,
    until: Cycle,
    mut sinks: Sinks<'_>,
    watcher: &dyn Watcher,
) -> Result<Effort, Error> {
    let (from, wall, cpu) = (run.cycle(), Instant::now(), ProcessTime::now());
    let watched = Watched(watcher);
    let mut pace = Pace::default();
    if let Some(film) = &mut sinks.film {
        film.shoot(run)?;
    }
    watched.at(Progress::Cycles { from, done: from, until });
    while run.cycle() < until && !run.is_over() && watcher.go_on() {
        let allowed = sinks.viewers.as_mut().map_or(until, |viewers| viewers.attend(run));
        let allowed = allowed.saturating_sub(run.cycle());
        if allowed > 0 {
            slice(run, until, &mut sinks, &mut pace, allowed)?;
        }
        watched.at(Progress::Cycles { from, done: run.cycle(), until });
    }
    if let Some(viewers) = &mut sinks.viewers {
        viewers.end(run);
    }
    Ok(Effort { cycles: run.cycle() - from, wall: wall.elapsed(), cpu: cpu.elapsed() })
}

/// Advances a little, by at most `allowed` cycles, and passes on rows and frames that are due.
fn slice(
    run: &mut dyn Simulation,
    until: Cycle,
    sinks: &mut Sinks<'_>,
    pace: &mut Pace,
    allowed: Cycle,
) -> Result<(), Error> {
    let rows_due = sinks.recording.as_ref().map_or(until, |r| r.next_stop(run.cycle()).min(until));
    let frame_due = sinks.film.as_ref().map_or(until, |f| next(f.every(), run.cycle()).min(until));
    let asked = pace.cycles().min(allowed).min(rows_due.min(frame_due) - run.cycle());
    let started = Instant::now();
    let done = match sinks.film.as_mut().and_then(|film| Some((film.follows_every()?, film))) {
        Some((step, film)) => followed(run, asked, step, &mut **film),
        None => run.advance(asked),
    };
    pace.note(done, started.elapsed());
    // A run may be over exactly at the end of a slice: then there is no further slice.
    let is_due = |due: Cycle, run: &dyn Simulation| run.cycle() == due || run.is_over();
    if let Some(recording) = &mut sinks.recording
        && (done < asked || is_due(rows_due, run))
    {
        recording.take(run)?;
    }
    if let Some(rows) = &mut sinks.rows
        && (done < asked || is_due(until, run))
    {
        run.record(&mut **rows)?;
    }
    if let Some(film) = &mut sinks.film
        && is_due(frame_due, run)
    {
        film.shoot(run)?;
    }
    Ok(())
}

/// Advances by at most `asked` cycles, and lets a film look at every `step`-th of them.
fn followed(run: &mut dyn Simulation, asked: Cycle, step: Cycle, film: &mut dyn Film) -> Cycle {
    let from = run.cycle();
    while run.cycle() - from < asked && !run.is_over() {
        let left = asked - (run.cycle() - from);
        if run.advance(left.min(step)) == 0 {
            break;
        }
        film.follow(run);
    }
    run.cycle() - from
}

/// The number of cycles of a slice.
#[derive(Debug)]
struct Pace(u64);

impl Default for Pace {
    fn default() -> Self {
        Self(1)
    }
}

impl Pace {
    fn cycles(&self) -> u64 {
        self.0
    }

    /// Adapts the number of cycles to [`SLICE`]; it grows at most fourfold at a time.
    fn note(&mut self, cycles: u64, took: Duration) {
        let per_cycle_s = took.as_secs_f64() / cycles.max(1) as f64;
        let fitting = (SLICE.as_secs_f64() / per_cycle_s.max(1e-12)) as u64;
        self.0 = fitting.clamp(1, self.0.saturating_mul(4));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_grow_towards_their_time_and_shrink_at_once() {
        let mut pace = Pace::default();
        pace.note(1, Duration::from_micros(1));
        assert_eq!(pace.cycles(), 4);
        (0..20).for_each(|_| pace.note(100, Duration::from_micros(100)));
        assert_eq!(pace.cycles(), 20_000);
        pace.note(20_000, Duration::from_secs(20));
        assert_eq!(pace.cycles(), 20);
        pace.note(1, Duration::from_secs(30));
        assert_eq!(pace.cycles(), 1);
    }
}
