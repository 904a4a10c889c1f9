//! What a session keeps of a run as it advances: keyframes to seek to, metrics over time, and events.

use super::open_run::OpenRun;
use crate::event_store::EventStore;
use crate::keyframes::Keyframes;
use crate::metric_history::MetricHistory;
use crate::protocol::Problem;
use crate::usage::SessionBytes;
use sidestep_kernel::Simulation;
use std::time::{Duration, Instant};

/// The history of one run. Each cycle is recorded by the computation that gets there first: the played one, or the
/// [`AheadRun`](super::ahead_run::AheadRun).
pub(super) struct RunHistory {
    pub(super) keyframes: Keyframes,
    pub(super) metrics: MetricHistory,
    pub(super) log: EventStore,
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
        };
        history.add_keyframe(open.run.as_ref());
        Ok(history)
    }

    /// Records a run that has advanced for some computing time: its metrics, and a keyframe where one is due.
    pub(super) fn record(&mut self, run: &mut dyn Simulation, computing_time: Duration) {
        self.metrics.add(&run.take_series());
        if self.keyframes.is_due(run.cycle(), computing_time) {
            self.add_keyframe(run);
        }
    }

    /// Returns the bytes of all parts.
    pub(super) fn bytes(&self) -> SessionBytes {
        SessionBytes {
            keyframes: self.keyframes.bytes(),
            events: self.log.bytes(),
            metrics: self.metrics.bytes(),
        }
    }

    fn add_keyframe(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let checkpoint = run.checkpoint();
        self.keyframes.push(run.cycle(), checkpoint, started.elapsed());
    }
}
