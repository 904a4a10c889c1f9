//! `sidestep verify`: whether every file of a recording is as it was written.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Args;
use serde_json::{Value, json};
use sidestep::kernel::terminal::escape_controls;
use sidestep_record::verify::{Verification, verify as verify_path};
use sidestep_session::display_path;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep verify runs/office
  sidestep verify runs/* sweeps/methods
  sidestep verify office.html           a report, by its page
  sidestep verify runs/office-csv runs/office.gif runs/office.mcap
  sidestep verify runs/office --json | jq '.paths[].damaged'

Compares every file with the digest that was written of it: of runs, sweeps with their recorded runs, reports and \
exports. MCAP files are compared with their own checksums. Files of others in a folder are listed, and are no error. The exit code is 2 if a file is damaged, was \
changed, or is missing.";

/// Check that every file of a recording is as it was written.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct VerifyArgs {
    /// Folders of runs, sweeps or exports; exported files, MCAP files, pages of reports
    #[arg(value_name = "RUN", required = true)]
    paths: Vec<PathBuf>,
}

/// # Errors
/// When the only path is no recording. Several errors are printed, and reported by the exit code alone.
pub(crate) fn verify(args: &VerifyArgs, console: Console) -> Result<ExitCode, Failure> {
    let mut results = Vec::with_capacity(args.paths.len());
    let mut failures = Vec::new();
    for path in &args.paths {
        match verify_path(path) {
            Ok(result) => results.push(result),
            Err(error) => failures.push(Failure::from(error)),
        }
    }
    let is_sound = failures.is_empty() && results.iter().all(Verification::is_sound);
    let paths: Vec<Value> = results.iter().map(to_json).collect();
    let errors: Vec<String> = failures.iter().map(ToString::to_string).collect();
    let json = json!({ "sound": is_sound, "paths": paths, "errors": errors });
    console.print_result(&json, || results.iter().map(to_text).collect())?;
    if args.paths.len() == 1
        && let Some(failure) = failures.pop()
    {
        return Err(failure);
    }
    failures.iter().for_each(|failure| console.error(failure));
    Ok(if is_sound { ExitCode::Done } else { ExitCode::WrongInput })
}

fn to_json(result: &Verification) -> Value {
    let damaged = result.damaged.iter();
    let damaged: Vec<Value> = damaged
        .map(|file| json!({ "path": display_path(&file.path), "cause": file.cause() }))
        .collect();
    json!({
        "path": display_path(&result.path),
        "kind": result.kind.name(),
        "sound": result.is_sound(),
        "sound_files": result.sound,
        "damaged": damaged,
        "others": result.others.iter().map(display_path).collect::<Vec<_>>(),
        "remarks": result.remarks,
    })
}

fn to_text(result: &Verification) -> String {
    let path = escape_controls(&display_path(&result.path)).into_owned();
    let sound = result.sound;
    let mut text = match result.damaged.len() {
        0 => format!("{path}: sound, {sound} files\n"),
        1 => format!("{path}: 1 of {} files is damaged\n", sound + 1),
        damaged => format!("{path}: {damaged} of {} files are damaged\n", sound + damaged),
    };
    let damaged = result.damaged.iter();
    let damaged = damaged.map(|file| format!("{}: {}", display_path(&file.path), file.cause()));
    let others = result
        .others
        .iter()
        .map(|file| format!("{}: not of this program, left alone", display_path(file)));
    for line in damaged.chain(result.remarks.iter().cloned()).chain(others) {
        text.push_str(&format!("  {}\n", escape_controls(&line)));
    }
    text
}
