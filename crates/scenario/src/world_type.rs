//! The interface of a world for programs that run scenarios without knowing any world.

use crate::{
    Editing, ImportReport, MetricInfo, Remark, ResolvedScenario, Source, WorldFacts, suggestion,
};
use serde::{Deserialize, Serialize};
use sidestep_kernel::text::{JsonTextReport, KeyValues};
use sidestep_kernel::view::{BodyKind, Kinds};
use sidestep_kernel::{InputError, RunConfig, Simulation};
use std::any::Any;
use std::path::Path;
use std::sync::Arc;

/// Digits of the digest of added code in the name of a build: as many as a build's own digest has.
const ADDED_CODE_DIGITS: usize = 12;

/// A world: its name, its files, and the compilation of its scenarios.
pub trait WorldType: Send + Sync {
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

    /// The names of the metrics that its runs are about, the most telling first: those that are charted where nobody has
    /// chosen any. None of them is a processor time or an error of rounding.
    fn chart_metrics(&self) -> &'static [&'static str] {
        &[]
    }

    /// The kinds of bodies that its runs show: names in files and requests stand for these.
    fn kinds(&self) -> &'static [BodyKind] {
        &[]
    }

    /// Facts for programs that control, plot and learn from its runs.
    fn facts(&self) -> WorldFacts {
        WorldFacts::default()
    }

    /// The editing of its scenarios on the canvas of the studio's page.
    fn editing(&self) -> Editing {
        Editing::default()
    }

    /// Translates a file of another program into a scenario; `None` for files that this world does
    /// not read.
    ///
    /// # Errors
    /// When such a file cannot be read.
    fn import_scenario(
        &self,
        _: &Path,
        _: &ImportOptions,
    ) -> Result<Option<ImportedScenario>, InputError> {
        Ok(None)
    }

    /// Returns what is in one of its other files, see [`Self::other_files`]; `None` for files that this world does not
    /// read.
    ///
    /// # Errors
    /// When such a file cannot be read, or something in it is wrong.
    fn inspect_other_file(&self, _: &Path) -> Result<Option<ImportReport>, InputError> {
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
    /// Name of its world, as scenarios write it.
    fn world(&self) -> &'static str;

    /// The settings of its runs.
    fn plan(&self) -> RunConfig;

    /// Number of simulated bodies, the measure of a run's size.
    fn body_count(&self) -> usize;

    /// Returns the contents of the scenario, for people to check.
    fn contents(&self, source: &Source) -> JsonTextReport;

    /// Returns the effects that the scenario's author may not expect, warnings first.
    fn remarks(&self) -> Vec<Remark> {
        Vec::new()
    }

    /// Returns what another seed would change: a sweep runs a scenario once where that is nothing.
    fn seed_effect(&self) -> SeedEffect {
        SeedEffect::Decide
    }

    /// Returns what somebody in it knows that no agent could know by itself, in words like "a planner knows all places":
    /// tables mark it as privileged, because it is a bound rather than an equal of methods without that.
    fn privilege(&self) -> Option<&'static str> {
        None
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

/// Choices of a translation that the file of another program does not tell: overrides of the keys `import.*`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImportOptions {
    /// The key without its prefix, and the value, in the order in which they were given.
    pairs: Vec<(String, String)>,
}

impl ImportOptions {
    const PREFIX: &str = "import.";

    /// Returns those among overrides `key=value` of a scenario.
    pub fn from_overrides(overrides: &[String]) -> Self {
        let mut pairs = Vec::new();
        for text in overrides.iter().filter(|text| Self::is_option(text)) {
            let text = text.trim_start().trim_start_matches(Self::PREFIX);
            let (key, value) = text.split_once('=').unwrap_or((text, ""));
            pairs.push((key.trim().to_owned(), value.trim().trim_matches('"').to_owned()));
        }
        Self { pairs }
    }

    /// Returns whether an override is an option of a translation.
    pub fn is_option(text: &str) -> bool {
        text.trim_start().starts_with(Self::PREFIX)
    }

    /// Returns whether none are given.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Returns the options, as keys and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.pairs.iter().map(|(key, value)| (key.as_str(), value.as_str()))
    }
}

/// A file of another program, translated.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedScenario {
    /// The scenario's text, or the reason why nothing in the file can be simulated.
    pub scenario: Result<String, InputError>,
    /// What became of the file.
    pub report: ImportReport,
    /// The report of the translation, as JSON.
    pub json: serde_json::Value,
    /// The same as lines of text.
    pub lines: KeyValues,
}

/// The worlds of a program, by name, and the build that their results follow from. Clones share the worlds.
#[derive(Clone)]
pub struct Worlds {
    types: Vec<Arc<dyn WorldType>>,
    build: Arc<str>,
}

impl Worlds {
    /// Returns an empty list for a build, as `0.1.0+0123456789ab`. Only the build that started a run or a sweep
    /// continues it.
    pub fn new(build: impl Into<Arc<str>>) -> Self {
        Self { types: Vec::new(), build: build.into() }
    }

    /// Returns the list with a further world, which takes the place of one with the same name.
    #[must_use]
    pub fn with(mut self, world: impl WorldType + 'static) -> Self {
        let world = Arc::new(world);
        match self.types.iter_mut().find(|known| known.name() == world.name()) {
            Some(known) => *known = world,
            None => self.types.push(world),
        }
        self
    }

    /// Returns the list for a program that adds code that affects results, identified by a digest of it: recordings
    /// belong to the program that made them.
    #[must_use]
    pub fn with_added_code(self, digest: &str) -> Self {
        let short = &digest[..digest.len().min(ADDED_CODE_DIGITS)];
        let build = format!("{}.own-{short}", self.build).into();
        Self { build, ..self }
    }

    /// The build that results follow from.
    pub fn build(&self) -> &str {
        &self.build
    }

    /// Returns the worlds, in the order of the list.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &dyn WorldType> + Clone {
        self.types.iter().map(AsRef::as_ref)
    }

    /// Returns the names of the worlds, in the order of the list.
    pub fn names(&self) -> Vec<&'static str> {
        self.iter().map(WorldType::name).collect()
    }

    /// Returns the kinds of bodies that runs of any of these worlds show.
    pub fn kinds(&self) -> Kinds {
        Kinds::new(self.iter().flat_map(|world| world.kinds().iter().copied()))
    }

    /// Returns the world with this name.
    pub fn find(&self, name: &str) -> Option<&dyn WorldType> {
        self.iter().find(|world| world.name() == name)
    }

    /// Compiles a scenario of any of these worlds.
    ///
    /// # Errors
    /// When no such world is known, or the scenario is invalid.
    pub fn compile(&self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError> {
        let name = source.preamble()?.world;
        let world = self.find(name.get_ref()).ok_or_else(|| {
            let cause = format!("unknown world `{}`", name.get_ref());
            source.error(Some(name.span()), cause, suggestion(name.get_ref(), &self.names()))
        })?;
        world.compile(source)
    }

    /// Translates a file of another program; `None` for scenario files.
    ///
    /// # Errors
    /// When it cannot be read, or an option does not fit.
    pub fn import_scenario(
        &self,
        file: &Path,
        options: &ImportOptions,
    ) -> Result<Option<ImportedScenario>, InputError> {
        for world in self.iter() {
            if let Some(foreign) = world.import_scenario(file, options)? {
                return Ok(Some(foreign));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Named(&'static str, &'static str);

    impl WorldType for Named {
        fn name(&self) -> &'static str {
            self.0
        }

        fn agent(&self) -> &'static str {
            "agent"
        }

        fn about(&self) -> &'static str {
            self.1
        }

        fn default_scenario(&self) -> &'static str {
            ""
        }

        fn compile(&self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError> {
            Err(source.error(None, "not in this test", ""))
        }
    }

    #[test]
    fn a_world_takes_the_place_of_the_one_with_its_name() {
        let worlds = Worlds::new("1+a").with(Named("sea", "old")).with(Named("sky", "old"));
        let worlds = worlds.clone().with(Named("sea", "new"));
        assert_eq!(worlds.names(), ["sea", "sky"]);
        assert_eq!(worlds.find("sea").map(WorldType::about), Some("new"));
    }

    #[test]
    fn added_code_is_part_of_the_build() {
        let worlds = Worlds::new("1+a").with_added_code("0123456789abcdef");
        assert_eq!(worlds.build(), "1+a.own-0123456789ab");
    }

    #[test]
    fn options_of_an_import_are_told_from_other_overrides() {
        let overrides = ["import.max_gap_s=60", "seed=3", " import.navdata = \"a b\""];
        let options = ImportOptions::from_overrides(&overrides.map(str::to_owned));
        let found: Vec<(&str, &str)> = options.iter().collect();
        assert_eq!(found, [("max_gap_s", "60"), ("navdata", "a b")]);
    }
}
