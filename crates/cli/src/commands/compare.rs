//! `sidestep compare`: collision avoidance methods on the same traffic, side by side; or what robots have done in drives, beside
//! what a simulation predicts.

use crate::console::{Console, LINE_COLS, format_columns, wrap_text};
use crate::exit::{ExitCode, Failure};
use crate::progress::StageBar;
use crate::scenario_args::{ScenarioArgs, WorkersArg, downcast_scenario};
use clap::{Args, ValueEnum};
use serde_json::json;
use sidestep::kernel::Interrupt;
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep::worlds::airspace::settings::BuiltInMethod;
use sidestep::worlds::robots::scenario::Compiled as CompiledRobots;
use sidestep_document::Table;
use sidestep_papers::drives::{self, DrivePrediction, read_motions};
use sidestep_papers::methods::{Comparison, SeedSpan, table};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep compare scenarios/airspace/superconflict.toml --runs 20
  sidestep compare sky.toml --methods pc,mvp --json
  sidestep compare hall.toml --motions motions-0.csv motions-1.csv --trips 4
                                   does the model tell what was driven?";

/// Compare collision avoidance methods on the same air traffic, or what robots have driven with what a model predicts.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    #[command(flatten)]
    workers: WorkersArg,

    /// Methods to compare, separated by commas
    #[arg(long, value_delimiter = ',', default_value = "pc,orca,mvp,bands,none")]
    methods: Vec<MethodName>,

    /// Number of runs of each method, with consecutive seeds from the scenario's on; where the scenario has a shield, as
    /// many without it [default: 10; beside drives 100]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    runs: Option<u32>,

    /// Tables of motions of `sidestep drive --out`, one for each robot of one drive: the scenario, with what was learned, is
    /// asked for the same trips
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "methods")]
    motions: Vec<PathBuf>,

    /// Trips that each robot has made in the drive
    #[arg(long, value_name = "N", default_value_t = 1, requires = "motions", value_parser = clap::value_parser!(u64).range(1..))]
    trips: u64,
}

/// Runs of each method, and of a model beside drives, unless they are given.
const METHOD_RUNS: u32 = 10;
const MODEL_RUNS: u32 = 100;

/// The collision avoidance methods.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum MethodName {
    /// Probability collectives
    Pc,
    /// Optimal reciprocal collision avoidance (ORCA)
    Orca,
    /// Modified voltage potential (MVP)
    Mvp,
    /// Track bands of detect and avoid, as DAIDALUS computes them
    Bands,
    /// No avoidance: all airplanes fly straight on
    None,
}

impl MethodName {
    fn method(self) -> BuiltInMethod {
        match self {
            Self::Pc => BuiltInMethod::Pc,
            Self::Orca => BuiltInMethod::Orca,
            Self::Mvp => BuiltInMethod::Mvp,
            Self::Bands => BuiltInMethod::Bands,
            Self::None => BuiltInMethod::None,
        }
    }
}

/// # Errors
/// When the scenario is wrong, or of another world.
pub(crate) fn compare(args: &CompareArgs, console: Console) -> Result<ExitCode, Failure> {
    let (source, compiled) = args.scenario.compile()?;
    if !args.motions.is_empty() {
        return compare_drives(args, &source, compiled.as_ref(), console);
    }
    let compiled: &CompiledAirspace = downcast_scenario(compiled.as_ref(), &source, "airspace")?;
    let methods: Vec<BuiltInMethod> = args.methods.iter().map(|name| name.method()).collect();
    let stages = StageBar::new(console);
    let comparison = Comparison {
        source: &source,
        methods: &methods,
        seeds: SeedSpan { first: compiled.seed, runs: args.runs.unwrap_or(METHOD_RUNS) as usize },
        workers: args.workers.count(),
        interrupt: Interrupt::default(),
    };
    let results = comparison.run(&mut |what, share| stages.set(what, share));
    stages.clear();
    let results = results?;
    let json = json!({ "name": compiled.name, "seed": compiled.seed, "methods": results });
    console.print_result(&json, || text(&table(&compiled.name, &results)))?;
    Ok(ExitCode::Done)
}

/// Says whether a model predicts what robots have driven.
///
/// # Errors
/// When a table or the scenario is wrong, or trips are not made.
fn compare_drives(
    args: &CompareArgs,
    source: &Source,
    compiled: &dyn CompiledScenario,
    console: Console,
) -> Result<ExitCode, Failure> {
    let robots: &CompiledRobots = downcast_scenario(compiled, source, "robots")?;
    let driven = read_motions(&args.motions)?;
    let runs = args.runs.unwrap_or(MODEL_RUNS) as usize;
    let prediction = DrivePrediction {
        source,
        driven: &driven,
        trips: args.trips,
        seeds: SeedSpan { first: robots.seed, runs },
        workers: args.workers.count(),
    };
    let stages = StageBar::new(console);
    let numbers = prediction.run(&mut |what, share| stages.set(what, share));
    stages.clear();
    let numbers = numbers?;
    let json = json!({
        "name": robots.name,
        "seed": robots.seed,
        "runs": runs,
        "trips": args.trips,
        "driven": driven,
        "numbers": numbers,
    });
    console.print_result(&json, || text(&drives::table(&numbers, runs)))?;
    Ok(ExitCode::Done)
}

/// Returns the results for people: a few measures beside each other, the rest below.
fn text(table: &Table) -> String {
    let title =
        if table.title.is_empty() { String::new() } else { format!("# {}\n\n", table.title) };
    let note = wrap_text(&table.note, LINE_COLS).join("\n");
    format!("{title}{}\n{note}\n", format_columns(table))
}
