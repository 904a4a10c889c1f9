//! What a session keeps of a run as it advances: keyframes to seek to, samples of metrics, and events.

use crate::event_store::EventStore;
use crate::keyframes::{Keyframes, MemoryBudget};
use crate::samples::MetricSamples;
use sidestep_kernel::Simulation;
use sidestep_scenario::MetricInfo;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The history of one run. Each cycle is recorded by the computation that gets there first: the played one, or the
/// [`AheadRun`](super::ahead_run::AheadRun).
pub(super) struct RunHistory {
    pub(super) keyframes: Keyframes,
    pub(super) samples: MetricSamples,
    pub(super) log: EventStore,
    last_sample: Instant,
}

impl RunHistory {
    /// Starts the history of a run with a keyframe and a sample of its start.
    pub(super) fn from_run(
        run: &dyn Simulation,
        infos: &'static [MetricInfo],
        budget: &Arc<MemoryBudget>,
    ) -> Self {
        let mut history = Self {
            keyframes: Keyframes::new(budget),
            samples: MetricSamples::new(infos),
            log: EventStore::default(),
            last_sample: Instant::now(),
        };
        history.add_keyframe(run);
        history.add_sample(run);
        history
    }

    /// Takes a keyframe and a sample of a run that has advanced for some computing time, where they are due.
    pub(super) fn record(&mut self, run: &dyn Simulation, computing_time: Duration) {
        if self.keyframes.is_due(run.cycle(), computing_time) {
            self.add_keyframe(run);
        }
        if self.samples.is_due(run.cycle(), self.last_sample.elapsed()) {
            self.add_sample(run);
        }
    }

    /// Records the cycle at which a run pauses, so that its metrics are those on display.
    pub(super) fn record_sample_at_pause(&mut self, run: &dyn Simulation) {
        if self.samples.is_new_cycle(run.cycle()) {
            self.add_sample(run);
        }
    }

    fn add_keyframe(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let checkpoint = run.checkpoint();
        self.keyframes.push(run.cycle(), checkpoint, started.elapsed());
    }

    fn add_sample(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let metrics = run.metrics();
        self.samples.push(run.cycle(), &metrics, started.elapsed());
        self.last_sample = Instant::now();
    }
}
