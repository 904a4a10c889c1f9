//! `sidestep schema`: the keys of scenarios as JSON Schema, for editors and other programs.

use super::new::world_value;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::worlds;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use serde_json::Value;
use sidestep_session::{Error, display_path, write_atomically};
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep schema -o sidestep.schema.json
  sidestep schema robots | jq '.properties | keys'
  sidestep schema sweep -o sweep.schema.json     also: profile

An editor completes and checks the keys of a file that begins with the line
  #:schema ./sidestep.schema.json
if it knows TOML by taplo (Even Better TOML for VS Code, and others).";

/// Write the keys of scenarios as JSON Schema, for editors and other programs.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SchemaArgs {
    /// World of the scenarios, or another kind of file [default: any world, by the key `world`]
    #[arg(value_name = "WORLD", value_parser = schema_names())]
    of: Option<String>,

    /// Output file, which is replaced [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// The name of sweep files, beside those of worlds.
const SWEEP_NAME: &str = "sweep";

/// Returns the kinds of files besides scenarios, by name, each with its schema.
fn other_files() -> Vec<(&'static str, Value)> {
    let of_worlds = worlds().iter().flat_map(|world| world.other_files());
    of_worlds.chain([(SWEEP_NAME, sidestep::experiment::sweep::file::schema())]).collect()
}

fn schema_names() -> PossibleValuesParser {
    let mut values: Vec<PossibleValue> = worlds().iter().map(world_value).collect();
    for (name, schema) in other_files() {
        let title = schema["title"].as_str().unwrap_or_default().to_string();
        values.push(PossibleValue::new(name).help(title));
    }
    PossibleValuesParser::new(values)
}

/// # Errors
/// When the file cannot be written.
pub(crate) fn schema(args: &SchemaArgs, console: Console) -> Result<ExitCode, Failure> {
    let of = args.of.as_deref();
    let other = other_files().into_iter().find(|(name, _)| Some(*name) == of);
    let schema = other.map(|(_, schema)| schema).or_else(|| worlds().schema(of));
    let schema = schema.expect("the parser takes these names alone");
    let text = format!("{schema:#}\n");
    match &args.out {
        None => console.print_result(&schema, || text)?,
        Some(file) => {
            write(file, &text)?;
            let written = serde_json::json!({ "file": display_path(file), "of": args.of });
            console.print_result(&written, || schema_comment(file, &schema))?;
        }
    }
    Ok(ExitCode::Done)
}

/// Returns the line by which editors find the schema.
fn schema_comment(file: &Path, schema: &Value) -> String {
    let title = schema["title"].as_str().unwrap_or_default();
    let file = file.display();
    format!("Wrote {file}: {title}\nBegin such files with the line\n  #:schema {file}\n")
}

fn write(file: &Path, text: &str) -> Result<(), Error> {
    write_atomically(file, |out| out.write_all(text.as_bytes()))
}
