//! A scenario file and the options of the command line -> a valid scenario.

use crate::worlds;
use clap::Args;
use sidestep::kernel::{InputError, workers};
use sidestep::scenario::CompiledScenario;
use sidestep::scenario::Source;
use sidestep_session::{problems, read_scenario};
use std::path::PathBuf;

/// The scenario, and the options that change it.
#[derive(Debug, Clone, Args)]
pub(crate) struct ScenarioArgs {
    /// Scenario file (TOML, BlueSky .scn or recorded traffic .csv, .json, .parquet, .so6,
    /// problem of the Robot Runners .json; gzip is fine)
    #[arg(value_name = "SCENARIO")]
    pub(crate) file: PathBuf,

    #[command(flatten)]
    pub(crate) changes: ChangeArgs,

    #[command(flatten)]
    pub(crate) import: ImportArgs,
}

/// The options for a file of another program.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ImportArgs {
    /// Folder with airports.dat, fix.dat and nav.dat of BlueSky, for the places that a .scn file names
    #[arg(long, value_name = "DIR")]
    navdata: Option<PathBuf>,

    /// Folder openap/data of an installed OpenAP, for the types of aircraft that a .scn file names: what a type cannot fly is
    /// clipped and counted [without: types are not used]
    #[arg(long, value_name = "DIR")]
    openap: Option<PathBuf>,
}

impl ImportArgs {
    /// Returns the options as overrides, `key=value`.
    fn settings(&self) -> impl Iterator<Item = String> {
        let navdata =
            self.navdata.as_ref().map(|folder| format!("import.navdata={}", folder.display()));
        let openap =
            self.openap.as_ref().map(|folder| format!("import.openap={}", folder.display()));
        navdata.into_iter().chain(openap)
    }

    /// Refuses the options for a command that has no use for them.
    ///
    /// # Errors
    /// When one is given.
    pub(crate) fn check_none(&self, because: &str) -> Result<(), InputError> {
        let given = [("--navdata", self.navdata.is_some()), ("--openap", self.openap.is_some())];
        let Some((option, _)) = given.into_iter().find(|(_, is_given)| *is_given) else {
            return Ok(());
        };
        let remedy =
            format!("run the file once with {option} and --out DIR, then give DIR/scenario.toml");
        Err(InputError::new(option, because, remedy))
    }
}

/// The options that change a scenario.
#[derive(Debug, Clone, Args)]
pub(crate) struct ChangeArgs {
    /// Number of cycles to run [default: the scenario's `cycles`]
    #[arg(long, value_name = "N", value_parser = toml_integer())]
    pub(crate) cycles: Option<u64>,

    /// Random seed [default: the scenario's `seed`]
    #[arg(long, value_name = "S", value_parser = toml_integer())]
    pub(crate) seed: Option<u64>,

    /// Error regime: no errors (reliable), those of effectors, of sensors, or of both
    #[arg(long, value_name = "R", value_parser = ["reliable", "effectors", "sensors", "both"])]
    pub(crate) regime: Option<String>,

    /// Override a key of the scenario, e.g. robots.count=20, or set an option of the import of recorded traffic:
    /// import.max_gap_s=600, import.ground_speed_kt=30, import.leave_out_suspicious=true; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
}

/// The option for the number of worker threads.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct WorkersArg {
    /// Number of worker threads; results do not depend on it [default: all processors]
    #[arg(long, value_name = "W", value_parser = clap::value_parser!(u16).range(1..=1024))]
    workers: Option<u16>,
}

impl WorkersArg {
    pub(crate) fn count(self) -> usize {
        self.workers.map_or_else(workers::available_workers, usize::from)
    }
}

/// Parses an integer that TOML can hold, up to 2^63 - 1, because it becomes a key of the scenario.
fn toml_integer() -> clap::builder::RangedU64ValueParser<u64> {
    clap::value_parser!(u64).range(..=i64::MAX as u64)
}

impl ScenarioArgs {
    /// Reads the scenario, applies the options and compiles it.
    ///
    /// # Errors
    /// When anything in it is wrong.
    pub(crate) fn compile(&self) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
        read_scenario(worlds(), &self.file, &self.all_overrides())
    }

    /// Returns all that is wrong with the scenario and the options; none if it is right.
    ///
    /// # Errors
    /// When the scenario cannot be read, or an override does not fit.
    pub(crate) fn problems(&self) -> Result<Vec<InputError>, InputError> {
        problems(worlds(), &self.file, &self.all_overrides())
    }

    /// Returns all overrides, as `key=value`.
    pub(crate) fn all_overrides(&self) -> Vec<String> {
        let mut all = self.changes.settings();
        all.extend(self.import.settings());
        all.extend(self.changes.seed.map(|seed| format!("seed={seed}")));
        all
    }
}

impl ChangeArgs {
    /// Returns all overrides except the seed: `--set` first, so that options with a name of their own replace its values.
    pub(crate) fn settings(&self) -> Vec<String> {
        let mut all = self.overrides.clone();
        all.extend(self.cycles.map(|cycles| format!("cycles={cycles}")));
        all.extend(self.regime.as_ref().map(|r| format!("regime=\"{r}\"")));
        all
    }
}

/// Returns the scenario of one world, for commands that support this world alone.
///
/// # Errors
/// When the scenario is of another world.
pub(crate) fn downcast_scenario<'a, C: 'static>(
    compiled: &'a dyn CompiledScenario,
    source: &Source,
    world: &str,
) -> Result<&'a C, InputError> {
    compiled.as_any().downcast_ref().ok_or_else(|| {
        let cause = format!("this command is about the world `{world}` alone");
        let remedy = format!("give a scenario with world = \"{world}\"");
        InputError::new(&source.place, cause, remedy)
    })
}
