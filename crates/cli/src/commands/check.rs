//! `sidestep check`: validates a scenario and describes it.

use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use crate::plan::ScenarioArgs;
use clap::Args;
use serde_json::Value;
use sidestep::scenario::{Foreign, Remark};
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
        // A file of another program may be readable and correct and still hold no agent that can be
        // placed. Any other error is one, as in every scenario.
        let mut json = json;
        json["airplanes"] = 0.into();
        json["no_scenario"] = error.to_string().into();
        console.result(&json, || format!("{error}\n{}", aligned(&lines)));
        return Ok(ExitCode::Done);
    }
    let (source, compiled) = args.scenario.compile()?;
    let mut found = compiled.contents(&source);
    if let Some(foreign) = foreign {
        if let (Some(all), Value::Object(more)) = (found.json.as_object_mut(), foreign.json) {
            all.extend(more);
        }
        found.text.push_str(&aligned(&foreign.lines));
    }
    let remarks = compiled.remarks();
    found.json["remarks"] = serde_json::to_value(&remarks).expect("remarks are plain data");
    let heading = format!("{} is a valid scenario\n", args.scenario.file.display());
    console.result(&found.json, || heading + &found.text + &in_words(&remarks));
    Ok(ExitCode::Done)
}

/// Returns remarks as text: severity and key on a line, and what is to be said below.
fn in_words(remarks: &[Remark]) -> String {
    let one = |r: &Remark| format!("{}: {}\n  {}\n", r.severity.name(), r.key, r.words);
    remarks.iter().map(one).collect()
}
