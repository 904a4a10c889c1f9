//! `sidestep check`: what a scenario describes, or what is wrong with it.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::plan::ScenarioArgs;
use clap::Args;

const EXAMPLES: &str = "\
Examples:
  sidestep check office.toml
  sidestep check office.toml --set robots.0.size=3
  sidestep check office.toml --json | jq .bodies";

/// Say what a scenario describes, or what is wrong with it; run nothing.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
}

/// Runs the command.
///
/// # Errors
/// When the scenario is wrong.
pub(crate) fn check(args: &CheckArgs, console: Console) -> Result<ExitCode, Failure> {
    let (source, compiled) = args.scenario.compile()?;
    let found = compiled.start(&source, 1).contents();
    let heading = format!("{} is a valid scenario\n", args.scenario.file.display());
    console.result(&found.json, || heading + &found.text);
    Ok(ExitCode::Done)
}
