//! `sidestep compare`: collision avoidance methods on the same traffic, side by side.

use crate::console::{Console, LINE_COLS, format_columns, wrap_text};
use crate::exit::{ExitCode, Failure};
use crate::progress::StageBar;
use crate::scenario_args::{ScenarioArgs, WorkersArg, downcast_scenario};
use clap::{Args, ValueEnum};
use serde_json::json;
use sidestep::kernel::Interrupt;
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep::worlds::airspace::settings::BuiltInMethod;
use sidestep_document::Table;
use sidestep_papers::methods::{Comparison, SeedSpan, table};

const EXAMPLES: &str = "\
Examples:
  sidestep compare scenarios/airspace/superconflict.toml --runs 20
  sidestep compare sky.toml --methods pc,mvp --json";

/// Compare collision avoidance methods on the same air traffic.
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
    /// many without it
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
}

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
    let compiled: &CompiledAirspace = downcast_scenario(compiled.as_ref(), &source, "airspace")?;
    let methods: Vec<BuiltInMethod> = args.methods.iter().map(|name| name.method()).collect();
    let stages = StageBar::new(console);
    let comparison = Comparison {
        source: &source,
        methods: &methods,
        seeds: SeedSpan { first: compiled.seed, runs: args.runs as usize },
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

/// Returns the results for people: a few measures beside each other, the rest below.
fn text(table: &Table) -> String {
    let title =
        if table.title.is_empty() { String::new() } else { format!("# {}\n\n", table.title) };
    let note = wrap_text(&table.note, LINE_COLS).join("\n");
    format!("{title}{}\n{note}\n", format_columns(table))
}
