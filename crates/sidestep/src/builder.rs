//! From a file or a text to a run, for all worlds alike.

use crate::kernel::{InputError, workers::available_workers};
use crate::run::Run;
use crate::scenario::{ImportOptions, Remark, Source, Worlds};
use crate::session::{Error, GivenScenario, ManagedRun, OutputPaths, RowSelection};
use crate::worlds::WORLDS;
use serde::Serialize;
use std::fmt::{self, Display, Formatter};
use std::path::{Path, PathBuf};

/// Reads the scenario in a file, or the one that a file of another program represents (`.scn` of BlueSky, for example).
///
/// # Errors
/// When the file cannot be read. Mistakes in the scenario are found by [`Scenario::check`] and [`Scenario::start`].
pub fn load(file: impl AsRef<Path>) -> Result<Scenario, InputError> {
    Scenario::load(&WORLDS, file)
}

/// Takes the text of a scenario. Paths in it are relative to the present folder.
pub fn parse(text: impl Into<String>) -> Scenario {
    Scenario::parse(&WORLDS, text)
}

/// A scenario of any world, with changes, that is about to be started. It can be started many times.
///
/// ```
/// let text = "format = 1\nworld = \"chain\"\n[[chains]]\nconnectors = 3\nat_m = [0.0, 0.0]\n";
/// let error = sidestep::parse(text).set("chains.0.rod_m", -1.0)?.start().err().unwrap();
/// assert!(error.to_string().contains("rod_m"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Scenario {
    worlds: Worlds,
    given: GivenScenario,
    /// The file that it was read from.
    file: Option<PathBuf>,
    /// Changes as `key=value`, each of which fits the text.
    overrides: Vec<String>,
    workers: Option<usize>,
    folder: Option<PathBuf>,
    keeps_tables: bool,
}

/// All that is wrong with a scenario, in the order of its text.
#[derive(Debug, Clone)]
pub struct Problems(pub Vec<InputError>);

impl Display for Problems {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        for (number, problem) in self.0.iter().enumerate() {
            if number > 0 {
                f.write_str("\n\n")?;
            }
            problem.fmt(f)?;
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

impl Scenario {
    /// Reads a scenario of one of `worlds`, see [`load`]: for worlds or parts of your own.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn load(worlds: &Worlds, file: impl AsRef<Path>) -> Result<Self, InputError> {
        let file = file.as_ref();
        let given = GivenScenario::read(worlds, file, &[])?;
        Ok(Self { file: Some(file.to_path_buf()), ..Self::new(worlds, given) })
    }

    /// Takes the text of a scenario of one of `worlds`, see [`parse`].
    pub fn parse(worlds: &Worlds, text: impl Into<String>) -> Self {
        Self::new(worlds, Source::new("scenario.toml", text, "").into())
    }

    fn new(worlds: &Worlds, given: GivenScenario) -> Self {
        let worlds = worlds.clone();
        Self {
            worlds,
            given,
            file: None,
            overrides: Vec::new(),
            workers: None,
            folder: None,
            keeps_tables: false,
        }
    }

    /// Changes a value, like `--set` of the command: a key goes by tables and by the numbers of arrays, as
    /// `robots.0.count`; the value is anything that TOML has. Keys `import.*` are choices for the reading of a file of
    /// another program, as `import.max_gap_s`.
    ///
    /// # Errors
    /// When the text has no room for the key, or TOML for the value.
    pub fn set(mut self, key: &str, value: impl Serialize) -> Result<Self, InputError> {
        let value = toml::Value::try_from(value).map_err(|error| {
            InputError::new(
                key,
                error.to_string(),
                "give a number, a truth value, a text, or a list",
            )
        })?;
        self.overrides.push(format!("{key}={value}"));
        if let (true, Some(file)) = (ImportOptions::is_option(key), &self.file) {
            self.given = GivenScenario::read(&self.worlds, file, &self.overrides)?;
        }
        let overrides = self.given.scenario_overrides(&self.overrides);
        self.given.source().clone().with_overrides(&overrides)?;
        Ok(self)
    }

    /// Chooses the seed from which all randomness grows; TOML holds those below 2^63.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.overrides.push(format!("seed={seed}"));
        self
    }

    /// Chooses the number of worker threads, by default one per core. It changes no result.
    #[must_use]
    pub fn workers(self, workers: usize) -> Self {
        Self { workers: Some(workers), ..self }
    }

    /// Records the run to a new folder, with tables, checkpoints, summary and picture, as `sidestep run --out` does.
    #[must_use]
    pub fn record_to(self, folder: impl Into<PathBuf>) -> Self {
        Self { folder: Some(folder.into()), ..self }
    }

    /// Keeps the rows of all tables in memory, for [`Run::tables`].
    #[must_use]
    pub fn keep_tables(self) -> Self {
        Self { keeps_tables: true, ..self }
    }

    /// Returns likely surprises to the scenario's author, the weightiest first.
    ///
    /// # Errors
    /// All that is wrong with the scenario, not the first mistake alone.
    pub fn check(&self) -> Result<Vec<Remark>, Problems> {
        let problems = self.given.problems(&self.worlds, &self.overrides);
        let problems = problems.map_err(|error| Problems(vec![error]))?;
        if !problems.is_empty() {
            return Err(Problems(problems));
        }
        let compiled = self.given.compile(&self.worlds, &self.overrides);
        let (_, compiled) = compiled.map_err(|error| Problems(vec![error]))?;
        Ok(compiled.remarks())
    }

    /// Compiles the scenario, and returns a run at its start.
    ///
    /// # Errors
    /// When something is wrong with the scenario: the first mistake, with its place and a remedy. When the folder for
    /// the recording is taken or cannot be made.
    pub fn start(&self) -> Result<Run, Error> {
        let (source, compiled) = self.given.compile(&self.worlds, &self.overrides)?;
        let workers = self.workers.unwrap_or_else(available_workers);
        let outputs = OutputPaths { folder: self.folder.as_deref(), ..OutputPaths::default() };
        let run = ManagedRun::start(&self.worlds, compiled.as_ref(), &source, workers, outputs)?;
        let mut run = run.with_import_report(self.given.import_report().cloned());
        if self.keeps_tables {
            run.keep_rows(&RowSelection::default())?;
        }
        Ok(Run::new(run))
    }
}
