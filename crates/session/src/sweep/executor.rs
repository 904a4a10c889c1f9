//! Runners of trials outside of this process: other processes, nodes of a cluster.
//!
//! The plan, the journal and the stopping rule stay with the process that drives the sweep. An executor gets trials and
//! self-contained scenarios, and returns outcomes, in any order: no common file system is needed.

use crate::Error;
use sidestep_experiment::sweep::{Outcome, Trial};
use sidestep_kernel::InputError;
use sidestep_scenario::{ResolvedScenario, Source, Worlds};

/// Takes an outcome; `Ok` once it is safe.
pub type OutcomeSink<'a> = dyn FnMut(Outcome) -> Result<(), Error> + Send + 'a;

/// A runner of trials.
pub trait TrialExecutor: Sync {
    /// Runs all trials of a batch, in any order, and passes each outcome on; a second outcome of a trial is ignored.
    /// Trials that it does not finish are in the batch of the next call.
    ///
    /// # Errors
    /// Those of `take`; any error that ends the sweep.
    fn run(&self, batch: &TrialBatch<'_>, take: &mut OutcomeSink<'_>) -> Result<(), Error>;

    /// Returns the number of runs in progress at once.
    fn parallelism(&self) -> usize;
}

/// The runner of a sweep's trials.
#[derive(Clone, Copy)]
pub enum Engine<'a> {
    /// This many threads of this process.
    Workers(usize),
    /// An executor outside of this process.
    Executor(&'a dyn TrialExecutor),
}

impl From<usize> for Engine<'_> {
    fn from(workers: usize) -> Self {
        Self::Workers(workers)
    }
}

impl Engine<'_> {
    /// Returns the number of threads of this process that plan the sweep.
    pub fn planning_workers(self) -> usize {
        match self {
            Self::Workers(workers) => workers,
            Self::Executor(_) => 1,
        }
    }
}

/// Trials that an executor is to run, with their scenarios.
pub struct TrialBatch<'a> {
    pub(super) trials: &'a [Trial],
    pub(super) worlds: &'a Worlds,
    /// The scenario of a variant.
    pub(super) source: &'a (dyn Fn(u32) -> Result<Source, InputError> + Sync),
    pub(super) series: Option<&'a [String]>,
}

impl TrialBatch<'_> {
    /// Returns the trials, first those on which others may depend.
    pub fn trials(&self) -> &[Trial] {
        self.trials
    }

    /// Returns the metrics that the trials keep over time; none for those that their world is about.
    pub fn series(&self) -> Option<&[String]> {
        self.series
    }

    /// Returns the scenario of a variant, with all its files.
    ///
    /// # Errors
    /// When a file can no longer be read, or was edited since the plan was made.
    pub fn scenario(&self, variant: u32) -> Result<ResolvedScenario, InputError> {
        let source = (self.source)(variant)?;
        self.worlds.compile(&source)?.resolve(&source)
    }
}
