//! A scenario file and the options of the command line -> a scenario that is known to be right.

use clap::Args;
use sidestep::kernel::{InputError, workers};
use sidestep::scenario::Compiled;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep_session::read;
use std::path::PathBuf;

/// The scenario, and what the command line changes in it.
#[derive(Debug, Clone, Args)]
pub(crate) struct ScenarioArgs {
    /// Scenario file (TOML, BlueSky .scn or recorded traffic .csv; may be packed with gzip)
    #[arg(value_name = "SCENARIO")]
    pub(crate) file: PathBuf,

    #[command(flatten)]
    pub(crate) changes: ChangeArgs,
}

/// What the command line changes in a scenario.
#[derive(Debug, Clone, Args)]
pub(crate) struct ChangeArgs {
    /// Run this many cycles [default: the scenario's `cycles`]
    #[arg(long, value_name = "N", value_parser = toml_integer())]
    pub(crate) cycles: Option<u64>,

    /// Grow all randomness from this number [default: the scenario's `seed`]
    #[arg(long, value_name = "S", value_parser = toml_integer())]
    pub(crate) seed: Option<u64>,

    /// Switch errors on: none, those of effectors, those of sensors, or both
    #[arg(long, value_name = "R", value_parser = ["reliable", "effectors", "sensors", "both"])]
    pub(crate) regime: Option<String>,

    /// Replace any key of the scenario, e.g. robots.count=20; may be given often
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
}

/// How many threads work on a run.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct WorkersArg {
    /// Run on this many threads; no result depends on it [default: all processors]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u16).range(1..=1024))]
    workers: Option<u16>,
}

impl WorkersArg {
    /// The number of threads.
    pub(crate) fn count(self) -> usize {
        self.workers.map_or_else(workers::available, usize::from)
    }
}

/// TOML knows integers up to 2^63 - 1.
fn toml_integer() -> clap::builder::RangedU64ValueParser<u64> {
    clap::value_parser!(u64).range(..=i64::MAX as u64)
}

impl ScenarioArgs {
    /// Reads the scenario, applies the options and compiles it.
    ///
    /// # Errors
    /// When anything in it is wrong.
    pub(crate) fn compile(&self) -> Result<(Source, Box<dyn Compiled>), InputError> {
        read(WORLDS, &self.file, &self.all_overrides())
    }

    fn all_overrides(&self) -> Vec<String> {
        let mut all = self.changes.settings();
        all.extend(self.changes.seed.map(|seed| format!("seed={seed}")));
        all
    }
}

impl ChangeArgs {
    /// All overrides but for the seed: `--set` first, so that the options of their own win.
    pub(crate) fn settings(&self) -> Vec<String> {
        let mut all = self.overrides.clone();
        all.extend(self.cycles.map(|cycles| format!("cycles={cycles}")));
        all.extend(self.regime.as_ref().map(|r| format!("regime=\"{r}\"")));
        all
    }
}

/// The scenario itself, for commands that are about one world alone.
///
/// # Errors
/// When it is of another world.
pub(crate) fn of_world<'a, C: 'static>(
    compiled: &'a dyn Compiled,
    source: &Source,
    world: &str,
) -> Result<&'a C, InputError> {
    compiled.as_any().downcast_ref().ok_or_else(|| {
        let cause = format!("this command is about the world `{world}` alone");
        let remedy = format!("give a scenario with world = \"{world}\"");
        InputError::new(&source.place, cause, remedy)
    })
}
