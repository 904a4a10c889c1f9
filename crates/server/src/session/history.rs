//! What a session keeps of a run as it advances: keyframes to seek to, metrics over time, events, and trails.

use super::open_run::OpenRun;
use crate::event_store::EventStore;
use crate::keyframes::Keyframes;
use crate::metric_history::MetricHistory;
use crate::protocol::Problem;
use crate::trail_history::TrailHistory;
use crate::usage_registry::SessionBytes;
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Cycle, Simulation};
use std::time::{Duration, Instant};

/// The history of one run. Each cycle is recorded by the computation that gets there first: the played one, or the
/// [`AheadRun`](super::ahead_run::AheadRun).
pub(super) struct RunHistory {
    pub(super) keyframes: Keyframes,
    pub(super) metrics: MetricHistory,
    pub(super) log: EventStore,
    pub(super) trails: TrailHistory,
}

/// Cycles that a run has just computed.
pub(super) struct ComputedCycles {
    pub(super) count: Cycle,
    pub(super) computing_time: Duration,
    /// Whether the page is shown the run, and hears of its events with the next frame.
    pub(super) is_played: bool,
}

impl RunHistory {
    /// Starts the history of a run that is at its start, with a keyframe and the metrics there.
    ///
    /// # Errors
    /// When its recorded metrics cannot be read.
    pub(super) fn from_run(open: &mut OpenRun) -> Result<Self, Problem> {
        let recorded = open.recorded_series()?;
        let words = open.metric_words();
        let mut history = Self {
            keyframes: Keyframes::new(open.keyframe_budget()),
            metrics: MetricHistory::from_run(open.run.as_mut(), open.until, recorded, words),
            log: EventStore::default(),
            trails: TrailHistory::default(),
        };
        history.add_keyframe(open.run.as_ref());
        history.sample_trails(open.run.as_mut(), true);
        Ok(history)
    }

    /// Records a run that has advanced: its metrics, and a keyframe and places for trails where they are due.
    pub(super) fn record(&mut self, run: &mut dyn Simulation, computed: &ComputedCycles) {
        self.metrics.add(&run.take_series());
        if self.keyframes.is_due(run.cycle(), computed.computing_time) {
            self.add_keyframe(run);
        }
        self.trails.add_computing_time(computed.count, computed.computing_time);
        if self.trails.is_due(run.cycle()) {
            self.sample_trails(run, computed.is_played);
        }
    }

    fn sample_trails(&mut self, run: &mut dyn Simulation, is_played: bool) {
        let started = Instant::now();
        let mut frame = run.frame(FrameOptions::WITHOUT_SCANS);
        self.trails.push(&frame, started.elapsed());
        // A frame takes the events out of the simulation.
        if is_played {
            self.log.record(&mut frame);
        } else {
            self.log.record_ahead(&mut frame);
        }
    }

    /// Returns the bytes of all parts.
    pub(super) fn bytes(&self) -> SessionBytes {
        SessionBytes {
            keyframes: self.keyframes.bytes(),
            events: self.log.bytes(),
            metrics: self.metrics.bytes(),
            trails: self.trails.bytes(),
        }
    }

    fn add_keyframe(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let checkpoint = run.checkpoint();
        self.keyframes.push(run.cycle(), checkpoint, started.elapsed());
    }
}
