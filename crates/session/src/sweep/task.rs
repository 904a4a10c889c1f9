//! Trials that another process sends: run here, without its files.

use super::executor::Engine;
use super::trial_runner::TrialRunner;
use crate::{Error, Watcher};
use sidestep_experiment::sweep::{Outcome, Trial};
use sidestep_kernel::InputError;
use sidestep_scenario::{ResolvedScenario, Source, Worlds};
use std::path::Path;

/// Some trials of a sweep that another process drives.
#[derive(Debug, Clone)]
pub struct Task {
    /// The build that drives the sweep.
    pub build: String,
    /// The scenarios of the trials, by variant.
    pub scenarios: Vec<(u32, ResolvedScenario)>,
    /// The trials, in the order in which they are run.
    pub trials: Vec<Trial>,
    /// The metrics that they keep over time; none for those that their world is about.
    pub series: Option<Vec<String>>,
}

impl Task {
    /// Runs the trials, one after another, and returns their outcomes: those of all, unless the watcher asks to stop.
    ///
    /// # Errors
    /// When another build drives the sweep, or files cannot be unpacked.
    pub fn run(&self, worlds: &Worlds, watcher: &dyn Watcher) -> Result<Vec<Outcome>, Error> {
        let own = worlds.build();
        if self.build != own {
            let cause = format!("the sweep is of sidestep {}, this is {own}", self.build);
            let remedy = "install the same build of sidestep wherever tasks run";
            return Err(InputError::new("a task of a sweep", cause, remedy).into());
        }
        let place =
            tempfile::tempdir().map_err(|e| Error::cannot_write(&std::env::temp_dir(), &e))?;
        let mut sources: Vec<(u32, Source)> = Vec::new();
        for (variant, scenario) in &self.scenarios {
            let folder = place.path().join(variant.to_string());
            unpack(&folder, &scenario.files).map_err(|e| Error::cannot_write(&folder, &e))?;
            let source = Source::new("scenario.toml", scenario.text.clone(), folder);
            sources.push((*variant, source));
        }
        let source = |variant: u32| find_source(&sources, variant);
        // One worker: the executor decides how many tasks a node runs at once.
        let engine = Engine::Workers(1);
        let series = self.series.as_deref();
        let runner = TrialRunner {
            worlds,
            agents: 0,
            source: &source,
            record: None,
            series,
            engine,
            watcher,
        };
        let mut outcomes = Vec::with_capacity(self.trials.len());
        runner.run(&self.trials, 0, self.trials.len() as u64, &mut |outcome| {
            outcomes.push(outcome);
            Ok(())
        })?;
        Ok(outcomes)
    }
}

fn find_source(sources: &[(u32, Source)], variant: u32) -> Result<Source, InputError> {
    match sources.iter().find(|(own, _)| *own == variant) {
        Some((_, source)) => Ok(source.clone()),
        None => {
            let cause = format!("the scenario of variant {variant} is missing");
            Err(InputError::new("a task of a sweep", cause, "send it along"))
        }
    }
}

/// Writes the files of a scenario.
fn unpack(folder: &Path, files: &[(String, Vec<u8>)]) -> std::io::Result<()> {
    for (name, bytes) in files {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(folder))?;
        std::fs::write(path, bytes)?;
    }
    Ok(())
}
