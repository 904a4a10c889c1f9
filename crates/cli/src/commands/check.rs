//! `sidestep check`: validates a scenario and describes it.

use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use crate::plan::ScenarioArgs;
use clap::Args;
use serde_json::Value;
use sidestep::scenario::Foreign;
use sidestep::worlds::WORLDS;

const EXAMPLES: &str = "\
Examples:
  sidestep check office.toml
  sidestep check office.toml --set robots.0.size=3
  sidestep check office.toml --json | jq .bodies";

/// Validate a scenario and describe it, without running it.
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
    let foreign = WORLDS.translate(&args.scenario.file)?;
    if let Some(Foreign { scenario: Err(error), json, lines }) = foreign {
        // The report says what was found in the file, and the error why it cannot be run.
        console.result(&json, || aligned(&lines));
        return Err(error.into());
    }
    let (source, compiled) = args.scenario.compile()?;
    let mut found = compiled.contents(&source);
    if let Some(foreign) = foreign {
        if let (Some(all), Value::Object(more)) = (found.json.as_object_mut(), foreign.json) {
            all.extend(more);
        }
        found.text.push_str(&aligned(&foreign.lines));
    }
    let heading = format!("{} is a valid scenario\n", args.scenario.file.display());
    console.result(&found.json, || heading + &found.text);
    Ok(ExitCode::Done)
}
