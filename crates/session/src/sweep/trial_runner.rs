//! Trials -> outcomes: many at once, or one after another on all workers.

use super::executor::{Engine, TrialBatch, TrialExecutor};
use crate::managed_run::record_to_end;
use crate::run_recorder::{RecordingPlan, RunRecorder};
use crate::watcher::{NestedWatcher, Progress, ProgressGuard};
use crate::{Error, Watcher};
use serde_json::json;
use sidestep_experiment::sweep::scheduler::{self, run_trials};
use sidestep_experiment::sweep::series::TrialSeries;
use sidestep_experiment::sweep::trial::series_metrics;
use sidestep_experiment::sweep::{Outcome, Trial, start_trial};
use sidestep_kernel::InputError;
use sidestep_record::{CycleOrigin, IfExists};
use sidestep_scenario::{Source, Worlds};
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Number of agents from which a single world fills the caches: such runs are made one after
/// another, each on all workers, which also bounds the memory. Smaller runs are faster side by side, because they never
/// wait for each other.
const LARGE_WORLD_AGENTS: u64 = 20_000;

/// Returns the number of runs in progress at once, of `runs` with at most so many agents.
pub fn runs_at_once(agents: u64, workers: usize, runs: usize) -> usize {
    let max = if agents >= LARGE_WORLD_AGENTS { 1 } else { workers };
    max.min(runs).max(1)
}

/// Everything that is needed to run trials.
pub(super) struct TrialRunner<'a> {
    pub(super) worlds: &'a Worlds,
    /// Number of agents of the largest variant.
    pub(super) agents: u64,
    /// The scenario of a variant.
    pub(super) source: &'a (dyn Fn(u32) -> Result<Source, InputError> + Sync),
    /// Returns the folder in which the run of a trial is recorded, if it is.
    pub(super) record: Option<&'a (dyn Fn(u64) -> PathBuf + Sync)>,
    /// The metrics that trials keep over time; none for those that their world is about.
    pub(super) series: Option<&'a [String]>,
    pub(super) engine: Engine<'a>,
    pub(super) watcher: &'a dyn Watcher,
}

/// Takes an outcome: once it returns, the run is finished.
pub(super) type OutcomeHandler<'a> = scheduler::ResultSink<'a, Outcome, Error>;

impl TrialRunner<'_> {
    /// Runs the trials, in order as far as there are workers, until all are done, something fails,
    /// or the watcher asks to stop. `before` and `total` are for the progress bar: the runs that
    /// were done before, and all.
    ///
    /// # Errors
    /// The error of `take`; no trial starts after that.
    pub(super) fn run(
        &self,
        trials: &[Trial],
        before: u64,
        total: u64,
        take: &mut OutcomeHandler<'_>,
    ) -> Result<(), Error> {
        let watched = ProgressGuard(self.watcher);
        watched.report(Progress::Runs { before, done: before, of: total });
        let mut done = before;
        let mut take = |outcome| {
            take(outcome)?;
            done += 1;
            watched.report(Progress::Runs { before, done, of: total });
            Ok(())
        };
        match self.engine {
            Engine::Executor(executor) => self.run_on_executor(executor, trials, &mut take),
            Engine::Workers(workers) => {
                let at_once = self.parallelism(trials.len());
                let each = (workers / at_once).max(1);
                run_trials(trials, at_once, |trial| self.run_trial(*trial, each), &mut take)
            }
        }
    }

    /// Runs the trials on an executor. The first outcome of a trial counts: an executor that lost contact with a process
    /// may run its trials again.
    fn run_on_executor(
        &self,
        executor: &dyn TrialExecutor,
        trials: &[Trial],
        take: &mut OutcomeHandler<'_>,
    ) -> Result<(), Error> {
        let mut open: BTreeSet<u64> = trials.iter().map(|trial| trial.id).collect();
        let Self { worlds, source, series, .. } = *self;
        executor.run(&TrialBatch { trials, worlds, source, series }, &mut |outcome| {
            if open.remove(&outcome.trial) {
                return take(outcome);
            }
            Ok(())
        })
    }

    /// Returns the number of `runs` in progress at once; each has its part of the workers.
    pub(super) fn parallelism(&self, runs: usize) -> usize {
        match self.engine {
            Engine::Executor(executor) => executor.parallelism().min(runs).max(1),
            Engine::Workers(workers) => runs_at_once(self.agents, workers, runs),
        }
    }

    /// Runs a trial; `None` if it was interrupted.
    fn run_trial(&self, trial: Trial, workers: usize) -> Option<Result<Outcome, Error>> {
        if !self.watcher.should_continue() {
            return None;
        }
        // An error of the folder is not an outcome of a run, because it may be repaired.
        let source = match (self.source)(trial.variant) {
            Ok(source) => source,
            Err(e) => return Some(Err(e.into())),
        };
        let result = catch_unwind(AssertUnwindSafe(|| match self.record {
            None => self.run_unrecorded(trial, &source, workers),
            Some(folder) => {
                let folder = &folder(trial.id);
                let run = RecordedTrial { trial, source, workers, folder, series: self.series };
                run.run(self.worlds, self.watcher)
            }
        }));
        match result {
            Ok(Ok(outcome)) => outcome.map(Ok),
            // For example a seed for which a scenario has no start: the other runs continue.
            Ok(Err(Error::Input(e))) => Some(Ok(Outcome::from_failure(trial, e.to_string()))),
            Ok(Err(Error::InterruptedInCycle(_))) => None,
            // What cannot be stored would fail for every run, so it stops the sweep.
            Ok(Err(failure)) => Some(Err(failure)),
            Err(payload) if self.watcher.interrupt().has_caused_unwind(payload.as_ref()) => None,
            // A bug in one run costs only that run, not a sweep of days.
            Err(_) => {
                Some(Ok(Outcome::from_failure(trial, "a bug in sidestep: see standard error")))
            }
        }
    }

    /// Runs a trial and keeps only its row.
    fn run_unrecorded(
        &self,
        trial: Trial,
        variant: &Source,
        workers: usize,
    ) -> Result<Option<Outcome>, Error> {
        let started_at = Instant::now();
        let mut started = start_trial(self.worlds, trial, variant, workers)?
            .with_interrupt(self.watcher.interrupt());
        if let Some(series) = self.series {
            started = started.with_series(series.to_vec());
        }
        let compiled_at = Instant::now();
        let outcome = started.run(&|| self.watcher.should_continue());
        let times = [compiled_at - started_at, compiled_at.elapsed()];
        Ok(outcome.map(|outcome| with_times(outcome, times)))
    }
}

/// A trial that is run into a run folder of its own.
pub(super) struct RecordedTrial<'a> {
    pub(super) trial: Trial,
    /// The scenario of its variant.
    pub(super) source: Source,
    pub(super) workers: usize,
    pub(super) folder: &'a Path,
    /// The metrics that it keeps over time; none for those that its world is about.
    pub(super) series: Option<&'a [String]>,
}

impl RecordedTrial<'_> {
    /// Runs the trial; `None` if it was interrupted. A folder left by a killed process is started again, because a run
    /// of a sweep is short beside the sweep.
    ///
    /// # Errors
    /// When the scenario is wrong with this seed, or something cannot be stored.
    pub(super) fn run(
        self,
        worlds: &Worlds,
        watcher: &dyn Watcher,
    ) -> Result<Option<Outcome>, Error> {
        let Self { trial, source, workers, folder, series } = self;
        let started_at = Instant::now();
        let source = source.with_overrides(&[format!("seed={}", trial.seed)])?;
        let compiled = worlds.compile(&source)?;
        let resolved = compiled.resolve(&source)?;
        // The run is of the text in its folder, so that it can be computed again from there.
        let in_folder = Source::new("scenario.toml", &*resolved.text, folder);
        let mut run = compiled.start(&in_folder, workers);
        let plan = RecordingPlan {
            existing: IfExists::Replace,
            build: worlds.build(),
            cycle_origin: CycleOrigin::Simulated,
            mcap: None,
        };
        let recording =
            RunRecorder::create(folder, &resolved, run.as_mut(), plan).map_err(folder_error)?;
        let until = run.config().cycles;
        let metrics = series_metrics(worlds, compiled.world(), series);
        let series = TrialSeries::start(run.as_mut(), until, metrics);
        let compiled_at = Instant::now();
        let is_complete = record_to_end(run.as_mut(), recording, workers, &NestedWatcher(watcher))?;
        if !is_complete {
            return Ok(None);
        }
        let series = series.take(run.as_mut());
        let outcome = Outcome { series, ..Outcome::from_simulation(trial, run.as_ref()) };
        Ok(Some(with_times(outcome, [compiled_at - started_at, compiled_at.elapsed()])))
    }
}

/// Returns an error of the folder itself as a stop, because it is not an outcome of a run.
fn folder_error(failure: Error) -> Error {
    match failure {
        Error::Input(e) => Error::other(format!("{}: {}", e.place(), e.cause()), e.remedy()),
        other => other,
    }
}

fn with_times(mut outcome: Outcome, [compiling, running]: [std::time::Duration; 2]) -> Outcome {
    outcome.costs.insert("compile_wall_s".into(), json!(compiling.as_secs_f64()));
    outcome.costs.insert("run_wall_s".into(), json!(running.as_secs_f64()));
    outcome
}
