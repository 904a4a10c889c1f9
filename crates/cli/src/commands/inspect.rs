//! `sidestep inspect`: what files are, and what becomes of them when they are read.

use crate::console::{Console, align_pairs, group_thousands, prose_columns, wrap_text};
use crate::exit::{ExitCode, Failure};
use crate::worlds;
use clap::Args;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep::kernel::terminal::escape_controls;
use sidestep::scenario::ImportOptions;
use sidestep_session::{InspectedFile, display_path, inspect as inspect_file, write_clean};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep inspect building.yaml
  sidestep inspect logs/*.csv --json | jq '.files[].findings'
  sidestep inspect day.csv --strict && sidestep run day.csv
  sidestep inspect day.csv --clean clean.csv
  sidestep inspect day.csv --set import.max_gap_s=120 --clean clean.csv

Reads what any command reads: maps, starts and goals (.scen), robot models (.urdf, .srdf), worlds of \
Stage, meshes, logs (CARMEN, MRCLAM), bags of ROS 1 and ROS 2, BlueSky scenarios, recorded traffic, \
scenarios and profiles of this program, run folders, sweeps, recordings (MCAP).
Of recordings of the world (bags, logs, tracks), what is bad is left out and counted, and the exit code is 2 if \
more than half is. With --strict it is 2 if anything was left out.";

/// Say what a file is, and what becomes of it when it is read.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct InspectArgs {
    /// Files or folders
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,

    /// Fail (exit code 2) if anything of a file is left out
    #[arg(long)]
    strict: bool,

    /// Write what was kept of one file to this one: tracks as CSV, a CARMEN log, a bag as MCAP, a map as YAML and PGM
    #[arg(long, value_name = "OUT")]
    clean: Option<PathBuf>,

    /// Set an option of an import, as for `run`: import.max_gap_s=600, import.ground_speed_kt=30 or
    /// import.leave_out_suspicious=true of recorded traffic, import.navdata=DIR and import.openap=DIR of a BlueSky file
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
}

/// # Errors
/// When the only file is wrong, or what was kept of it cannot be written. Several errors are printed, and reported by
/// the exit code alone.
pub(crate) fn inspect(args: &InspectArgs, console: Console) -> Result<ExitCode, Failure> {
    check_clean_target(args)?;
    let options = import_options(args)?;
    let mut reports = Vec::with_capacity(args.files.len());
    let mut failures = Vec::new();
    for file in &args.files {
        match inspect_file(worlds(), file, &options) {
            Ok(report) => reports.push(report),
            Err(failure) => failures.push(failure),
        }
    }
    if args.strict {
        failures.extend(reports.iter().filter_map(loss).map(Failure::from));
    }
    let errors: Vec<String> = failures.iter().map(ToString::to_string).collect();
    let json = json!({ "files": reports, "errors": errors });
    console.print_result(&json, || reports.iter().map(format_report).collect())?;
    if failures.is_empty()
        && let (Some(out), [file]) = (&args.clean, &args.files[..])
    {
        for written in write_clean(file, out, &options)? {
            console.note(format!("wrote {}", display_path(written)));
        }
    }
    end(failures, console)
}

/// Returns the options of an import, and refuses settings of a scenario: nothing is run here.
fn import_options(args: &InspectArgs) -> Result<ImportOptions, InputError> {
    if let Some(other) = args.overrides.iter().find(|text| !ImportOptions::is_option(text)) {
        let cause = format!("`{other}` is no option of an import");
        let remedy =
            "give options such as import.max_gap_s=600; `sidestep check` sets keys of scenarios";
        return Err(InputError::new("--set", cause, remedy));
    }
    Ok(ImportOptions::from_overrides(&args.overrides))
}

/// Refuses a file to write to for several files.
fn check_clean_target(args: &InspectArgs) -> Result<(), InputError> {
    if args.clean.is_none() || args.files.len() == 1 {
        return Ok(());
    }
    let cause = format!("it is one file, and {} are given", args.files.len());
    Err(InputError::new("--clean", cause, "clean one file at a time"))
}

/// Returns the error about a file of which something was left out.
fn loss(inspected: &InspectedFile) -> Option<InputError> {
    let dropped = inspected.report.dropped();
    if dropped == 0 {
        return None;
    }
    let cause = format!("{} items were left out, and --strict is given", group_thousands(dropped));
    let remedy = "mend them in the file, or go without --strict";
    Some(InputError::new(&inspected.file, cause, remedy))
}

/// Returns the exit code of errors that are printed; a single one is for the caller to print.
fn end(mut failures: Vec<Failure>, console: Console) -> Result<ExitCode, Failure> {
    if failures.len() == 1 {
        return Err(failures.remove(0));
    }
    failures.iter().for_each(|failure| console.error(failure));
    Ok(failures.first().map_or(ExitCode::Done, ExitCode::from))
}

/// Returns a report as text: the file, what was found in it, and what was not taken as it stood.
fn format_report(inspected: &InspectedFile) -> String {
    let report = &inspected.report;
    let mut text =
        format!("{}\n{}", escape_controls(&inspected.file), align_pairs(&report.lines()));
    if report.findings.is_empty() {
        text.push_str("  Nothing was dropped, repaired or guessed\n");
    }
    for finding in &report.findings {
        let columns = usize::from(prose_columns()).saturating_sub(INDENT);
        let lines = wrap_text(&finding.to_string(), columns);
        text.push_str(&format!("  {}\n", lines.join("\n    ")));
    }
    text
}

/// Columns by which the lines of a finding after the first are indented.
const INDENT: usize = 4;
