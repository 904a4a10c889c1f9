//! A second computation of a recorded run, ahead of the one that is watched, whenever there is nothing else to do:
//! so a page knows all events of a recording, any cycle is near, and the digest is confirmed, before everything was
//! played.

use super::history::RunHistory;
use super::pace::SliceSize;
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Cycle, Interrupt, Simulation};
use std::time::{Duration, Instant};

/// The time between two transfers of events: a run keeps only some thousands.
const EVENTS_INTERVAL: Duration = Duration::from_millis(100);

/// A run on its way to its end.
pub(super) struct Prefetcher {
    run: Box<dyn Simulation>,
    until: Cycle,
    pace: SliceSize,
    noted: Instant,
}

impl Prefetcher {
    /// Sends out a run that is at its start.
    pub(super) fn new(mut run: Box<dyn Simulation>, until: Cycle, interrupt: Interrupt) -> Self {
        run.set_interrupt(interrupt);
        run.enable_events();
        Self { run, until, pace: SliceSize::default(), noted: Instant::now() }
    }

    /// Goes on for some milliseconds. Returns the run once it is at its end.
    pub(super) fn advance_slice(&mut self, memory: &mut RunHistory) -> Option<&dyn Simulation> {
        self.skip_known(memory);
        let asked = self.pace.cycles().min(self.until.saturating_sub(self.run.cycle()));
        let started = Instant::now();
        let done = self.run.advance(asked);
        let took = started.elapsed();
        self.pace.adapt(done, took);
        memory.record(self.run.as_ref(), took);
        let is_at_end = self.run.cycle() >= self.until || self.run.is_over() || done == 0;
        if is_at_end || self.noted.elapsed() >= EVENTS_INTERVAL {
            memory.log.record_ahead(&mut self.run.frame(FrameOptions::WITHOUT_SCANS));
            self.noted = Instant::now();
        }
        is_at_end.then_some(self.run.as_ref())
    }

    /// Leaves out the cycles that the watched run was the first to compute.
    fn skip_known(&mut self, memory: &mut RunHistory) {
        let known = memory.keyframes.before(memory.log.frontier());
        if let Some((at, checkpoint)) = known
            && at > self.run.cycle()
        {
            self.run.restore(checkpoint).unwrap_or_else(|error| panic!("a keyframe: {error}"));
            // The events before are known.
            drop(self.run.frame(FrameOptions::WITHOUT_SCANS));
        }
    }
}
