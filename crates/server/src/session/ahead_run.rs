//! A second computation of a recorded run, ahead of the one that is played, whenever there is nothing else to do: so all
//! events of a recording are known, any cycle is near a keyframe, and the digest is confirmed, before the run was played
//! to its end.

use super::history::{ComputedCycles, RunHistory};
use super::pace::CyclesPerSlice;
use sidestep_kernel::series::SeriesInterval;
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Cycle, Interrupt, Simulation};
use std::time::{Duration, Instant};

/// Time between two transfers of events: a simulation keeps only the last some thousands.
const EVENTS_INTERVAL: Duration = Duration::from_millis(100);

/// A second copy of a recorded run, which nobody sees.
pub(super) struct AheadRun {
    run: Box<dyn Simulation>,
    until: Cycle,
    pace: CyclesPerSlice,
    events_taken: Instant,
}

impl AheadRun {
    /// Returns a prefetcher for a run that is at its start.
    pub(super) fn new(mut run: Box<dyn Simulation>, until: Cycle, interrupt: Interrupt) -> Self {
        run.set_interrupt(interrupt);
        run.enable_events();
        Self { run, until, pace: CyclesPerSlice::default(), events_taken: Instant::now() }
    }

    /// Keeps the metrics after the cycles of an interval too.
    pub(super) fn with_series(mut self, interval: SeriesInterval) -> Self {
        self.run.start_series(interval);
        self
    }

    /// Advances for some milliseconds. Returns the run once it is at its end.
    pub(super) fn advance_slice(&mut self, history: &mut RunHistory) -> Option<&dyn Simulation> {
        self.skip_computed_cycles(history);
        let left = self.until.saturating_sub(self.run.cycle());
        let until_sample = history.trails.cycles_until_due(self.run.cycle());
        let cycles = self.pace.cycles().min(left).min(until_sample);
        let started = Instant::now();
        let done = self.run.advance(cycles);
        let computing_time = started.elapsed();
        self.pace.adapt_cycles_per_slice(done, computing_time);
        let computed = ComputedCycles { count: done, computing_time, is_played: false };
        history.record(self.run.as_mut(), &computed);
        let is_at_end = self.run.cycle() >= self.until || self.run.is_over() || done == 0;
        if is_at_end || self.events_taken.elapsed() >= EVENTS_INTERVAL {
            history.log.record_ahead(&mut self.run.frame(FrameOptions::WITHOUT_SCANS));
            self.events_taken = Instant::now();
        }
        is_at_end.then_some(self.run.as_ref())
    }

    /// Skips the cycles that the played run was the first to compute.
    fn skip_computed_cycles(&mut self, history: &mut RunHistory) {
        let known = history.keyframes.latest_until(history.log.known_until());
        if let Some((at, checkpoint)) = known
            && at > self.run.cycle()
        {
            self.run.restore(checkpoint).unwrap_or_else(|error| panic!("a keyframe: {error}"));
            // Takes the events of the cycles before, which are known, out of the simulation.
            drop(self.run.frame(FrameOptions::WITHOUT_SCANS));
        }
    }
}
