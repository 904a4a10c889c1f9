//! The interface of a world for programs that run scenarios without knowing any world.

use crate::{MetricInfo, Remark, ResolvedScenario, Source, suggestion};
use serde::{Deserialize, Serialize};
use sidestep_kernel::text::{Description, KeyValues};
use sidestep_kernel::{InputError, RunConfig, Simulation};
use std::any::Any;
use std::path::Path;

/// A world: its name, its files, and the compilation of its scenarios.
pub trait WorldType: Sync {
    /// The name, as scenarios write it.
    fn name(&self) -> &'static str;

    /// The noun for one of its agents, e.g. `robot`.
    fn agent(&self) -> &'static str;

    /// One line about the subject of its simulation.
    fn about(&self) -> &'static str;

    /// A commented scenario with every key.
    fn default_scenario(&self) -> &'static str;

    /// Returns the JSON Schema of its sections, without the keys that all worlds share: see
    /// [`crate::schema`]. Without one, all keys are accepted.
    fn sections(&self) -> serde_json::Value {
        serde_json::json!({ "additionalProperties": true })
    }

    /// The other kinds of TOML files that this world reads, each by a word for it and the JSON Schema of its keys.
    fn other_files(&self) -> Vec<(&'static str, serde_json::Value)> {
        Vec::new()
    }

    /// The quantities that are drawn at random in a scenario of this world, as a list of nouns with the keys that cause
    /// it; empty where a world gives none.
    fn random_quantities(&self) -> &'static str {
        ""
    }

    /// Its metrics in words. Reports make words from the names of metrics that are not listed.
    fn metric_infos(&self) -> &'static [MetricInfo] {
        &[]
    }

    /// Translates a file of another program into a scenario; `None` for files that this world does
    /// not read.
    ///
    /// # Errors
    /// When such a file cannot be read.
    fn translate(&self, _: &Path) -> Result<Option<ImportedScenario>, InputError> {
        Ok(None)
    }

    /// Compiles a scenario of this world.
    ///
    /// # Errors
    /// When it is invalid; with place, line, column, cause and remedy.
    fn compile(&self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError>;
}

/// A scenario that was checked and compiled; many runs of it share one world.
pub trait CompiledScenario: Send + Sync {
    /// Name of its world.
    fn world(&self) -> &'static str;

    /// The settings of its runs.
    fn plan(&self) -> RunConfig;

    /// Number of simulated bodies, the measure of a run's size.
    fn body_count(&self) -> usize;

    /// Returns the contents of the scenario, for people to check.
    fn contents(&self, source: &Source) -> Description;

    /// Returns the effects that the scenario's author may not expect, warnings first.
    fn remarks(&self) -> Vec<Remark> {
        Vec::new()
    }

    /// Returns the effect of another seed.
    fn seed_effect(&self) -> SeedEffect {
        SeedEffect::Decide
    }

    /// Returns the scenario as stored in a run folder: complete, with all its files.
    ///
    /// # Errors
    /// When a file that it refers to can no longer be read.
    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError>;

    /// Returns the same scenario with another seed, if that is faster than compiling it: without
    /// reading files or computing tables again. `None` if it is not.
    ///
    /// # Errors
    /// When the scenario is invalid with that seed.
    fn reseeded(&self, _seed: u64) -> Option<Result<Box<dyn CompiledScenario>, InputError>> {
        None
    }

    /// Creates a run at its start; `source` identifies it in checkpoints.
    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation>;

    /// Returns the world's own type, for features of one world alone.
    fn as_any(&self) -> &dyn Any;
}

/// The effect of another seed on the runs of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SeedEffect {
    /// Nothing: no random number is drawn.
    Nothing,
    /// Draws only guide a search, which may find the same result with every seed.
    Perhaps,
    /// Draws decide the run; also the answer of a world that cannot say.
    #[default]
    Decide,
}

/// A file of another program, translated.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedScenario {
    /// The scenario's text, or the reason why nothing in the file can be simulated.
    pub scenario: Result<String, InputError>,
    /// The report of the translation, as JSON.
    pub json: serde_json::Value,
    /// The same as lines of text.
    pub lines: KeyValues,
}

/// All worlds of a program.
#[derive(Clone, Copy)]
pub struct Worlds(pub &'static [&'static dyn WorldType]);

impl Worlds {
    /// Returns the names of the worlds.
    pub fn names(self) -> Vec<&'static str> {
        self.0.iter().map(|world| world.name()).collect()
    }

    /// Returns the world with this name.
    pub fn find(self, name: &str) -> Option<&'static dyn WorldType> {
        self.0.iter().copied().find(|world| world.name() == name)
    }

    /// Compiles a scenario of any of these worlds.
    ///
    /// # Errors
    /// When no such world is known, or the scenario is invalid.
    pub fn compile(self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError> {
        let world = source.preamble()?.world;
        let kind = self.find(world.get_ref()).ok_or_else(|| {
            let cause = format!("unknown world `{}`", world.get_ref());
            source.error(Some(world.span()), cause, suggestion(world.get_ref(), &self.names()))
        })?;
        kind.compile(source)
    }

    /// Translates a file of another program; `None` for scenario files.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn translate(self, file: &Path) -> Result<Option<ImportedScenario>, InputError> {
        for kind in self.0 {
            if let Some(foreign) = kind.translate(file)? {
                return Ok(Some(foreign));
            }
        }
        Ok(None)
    }
}
