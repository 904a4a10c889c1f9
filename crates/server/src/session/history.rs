//! The memory of a session as its run goes on: places to go back to, samples of metrics, and events.

use crate::event_store::EventStore;
use crate::keyframes::{Keyframes, MemoryBudget};
use crate::samples::Samples;
use sidestep_kernel::Simulation;
use sidestep_scenario::MetricInfo;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The memory of one run, filled by the first of its computations to come to a cycle.
pub(super) struct RunHistory {
    pub(super) keyframes: Keyframes,
    pub(super) samples: Samples,
    pub(super) log: EventStore,
    sampled: Instant,
}

impl RunHistory {
    /// Returns the memory of a run that is at its start.
    pub(super) fn from_run(
        run: &dyn Simulation,
        meanings: &'static [MetricInfo],
        budget: &Arc<MemoryBudget>,
    ) -> Self {
        let mut memory = Self {
            keyframes: Keyframes::new(budget),
            samples: Samples::new(meanings),
            log: EventStore::default(),
            sampled: Instant::now(),
        };
        memory.add_keyframe(run);
        memory.add_sample(run);
        memory
    }

    /// Records a run that has gone on for a time.
    pub(super) fn record(&mut self, run: &dyn Simulation, took: Duration) {
        if self.keyframes.is_due(run.cycle(), took) {
            self.add_keyframe(run);
        }
        if self.samples.is_due(run.cycle(), self.sampled.elapsed()) {
            self.add_sample(run);
        }
    }

    /// Records the place where a run stands still.
    pub(super) fn record_pause(&mut self, run: &dyn Simulation) {
        if self.samples.is_new(run.cycle()) {
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
        self.sampled = Instant::now();
    }
}
