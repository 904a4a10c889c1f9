//! The memory of a session as its run goes on: places to go back to, samples of metrics, and events.

use crate::chronicle::Chronicle;
use crate::keyframes::{Budget, Keyframes};
use crate::samples::Samples;
use sidestep::kernel::Simulation;
use sidestep::scenario::Meaning;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The memory of one run, filled by the first of its computations to come to a cycle.
pub(super) struct Memory {
    pub(super) keyframes: Keyframes,
    pub(super) samples: Samples,
    pub(super) log: Chronicle,
    sampled: Instant,
}

impl Memory {
    /// Returns the memory of a run that is at its start.
    pub(super) fn of(
        run: &dyn Simulation,
        meanings: &'static [Meaning],
        budget: &Arc<Budget>,
    ) -> Self {
        let mut memory = Self {
            keyframes: Keyframes::new(budget),
            samples: Samples::new(meanings),
            log: Chronicle::default(),
            sampled: Instant::now(),
        };
        memory.keep_keyframe(run);
        memory.sample(run);
        memory
    }

    /// Records a run that has gone on for a time.
    pub(super) fn note(&mut self, run: &dyn Simulation, took: Duration) {
        if self.keyframes.is_due(run.cycle(), took) {
            self.keep_keyframe(run);
        }
        if self.samples.is_due(run.cycle(), self.sampled.elapsed()) {
            self.sample(run);
        }
    }

    /// Records the place where a run stands still.
    pub(super) fn note_stand(&mut self, run: &dyn Simulation) {
        if self.samples.is_new(run.cycle()) {
            self.sample(run);
        }
    }

    fn keep_keyframe(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let checkpoint = run.checkpoint();
        self.keyframes.keep(run.cycle(), checkpoint, started.elapsed());
    }

    fn sample(&mut self, run: &dyn Simulation) {
        let started = Instant::now();
        let metrics = run.metrics();
        self.samples.keep(run.cycle(), &metrics, started.elapsed());
        self.sampled = Instant::now();
    }
}
