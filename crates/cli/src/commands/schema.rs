//! `sidestep schema`: the keys of scenarios as JSON Schema, for editors and other programs.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::worlds;
use clap::Args;
use serde_json::Value;
use sidestep::kernel::InputError;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep schema -o sidestep.schema.json
  sidestep schema robots | jq '.properties | keys'

An editor completes and checks the keys of a scenario that begins with the line
  #:schema ./sidestep.schema.json
if it knows TOML by taplo (Even Better TOML for VS Code, and others).";

/// Write the keys of scenarios as JSON Schema, for editors and other programs.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SchemaArgs {
    /// World of the scenarios [default: any, by their key `world`]
    #[arg(value_name = "WORLD", value_parser = super::new::names())]
    world: Option<String>,

    /// Output file, which is replaced [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn schema(args: &SchemaArgs, console: Console) -> Result<ExitCode, Failure> {
    let schema = worlds().schema(args.world.as_deref());
    let schema = schema.expect("the parser takes the names of worlds alone");
    let text = format!("{schema:#}\n");
    match &args.out {
        None => console.result(&schema, || text),
        Some(file) => {
            write(file, &text)?;
            let written = serde_json::json!({ "file": file, "world": args.world });
            console.result(&written, || told(file, &schema));
        }
    }
    Ok(ExitCode::Done)
}

/// Returns the line by which editors find the schema.
fn told(file: &Path, schema: &Value) -> String {
    let title = schema["title"].as_str().unwrap_or_default();
    let file = file.display();
    format!("Wrote {file}: {title}\nBegin scenarios with the line\n  #:schema {file}\n")
}

fn write(file: &Path, text: &str) -> Result<(), InputError> {
    std::fs::write(file, text).map_err(|e| {
        let remedy = "name a file in a folder where you may write";
        InputError::new(file.display(), format!("cannot be written: {e}"), remedy)
    })
}
