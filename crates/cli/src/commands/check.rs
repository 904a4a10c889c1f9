//! `sidestep check`: validates a scenario and describes it.

use crate::console::{Console, align_pairs};
use crate::exit::{ExitCode, Failure};
use crate::scenario_args::ScenarioArgs;
use crate::worlds;
use clap::Args;
use serde_json::Value;
use sidestep::experiment::MAX_PROBLEMS;
use sidestep::kernel::InputError;
use sidestep::kernel::text::JsonTextReport;
use sidestep::scenario::{CompiledScenario, ImportOptions, ImportedScenario, Remark, Source};

const EXAMPLES: &str = "\
Examples:
  sidestep check office.toml
  sidestep check office.toml --set robots.0.size=3
  sidestep check office.toml --json | jq .bodies";

/// Memory that recording takes besides the run, as measured: the writers of tables, and the picture.
const RECORDING_BYTES: u64 = 35_000_000;
/// The same for each body: buffered rows, its track, and its part of the picture.
const RECORDING_BYTES_PER_BODY: u64 = 3000;

/// Validate a scenario and describe it, without running it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
}

/// # Errors
/// When one thing is wrong with the scenario. Several are printed, and reported by the exit code alone.
pub(crate) fn check(args: &CheckArgs, console: Console) -> Result<ExitCode, Failure> {
    let options = ImportOptions::from_overrides(&args.scenario.all_overrides());
    let foreign = worlds().import_scenario(&args.scenario.file, &options)?;
    if let Some(ImportedScenario { scenario: Err(error), json, lines, .. }) = foreign {
        // The report lists the contents of the file, and the error says why it cannot be run.
        let mut json = json;
        json["no_scenario"] = error.to_string().into();
        console.print_result(&json, || align_pairs(&lines))?;
        return Err(error.into());
    }
    let (source, compiled) = match args.scenario.compile() {
        Ok(compiled) => compiled,
        Err(first) => return print_all_errors(args, first, console),
    };
    let mut contents = compiled.contents(&source);
    if let Some(foreign) = foreign {
        if let (Some(fields), Value::Object(added)) = (contents.json.as_object_mut(), foreign.json)
        {
            fields.extend(added);
        }
        contents.text.push_str(&align_pairs(&foreign.lines));
    }
    measure_memory(&source, compiled.as_ref(), &mut contents);
    let remarks = compiled.remarks();
    contents.json["remarks"] = serde_json::to_value(&remarks).expect("remarks are plain data");
    let heading = format!("{} is a valid scenario\n", args.scenario.file.display());
    console
        .print_result(&contents.json, || heading + &contents.text + &format_remarks(&remarks))?;
    Ok(ExitCode::Done)
}

/// Prints all errors of a scenario of which `first` is one.
///
/// # Errors
/// When that is the only one.
fn print_all_errors(
    args: &CheckArgs,
    first: InputError,
    console: Console,
) -> Result<ExitCode, Failure> {
    let all = args.scenario.problems().unwrap_or_default();
    if all.len() < 2 {
        return Err(all.into_iter().next().unwrap_or(first).into());
    }
    all.iter().for_each(|error| console.error(error));
    let more = if all.len() == MAX_PROBLEMS { " at least" } else { "" };
    console.error(format!("{}:{more} {} errors", args.scenario.file.display(), all.len()));
    Ok(ExitCode::WrongInput)
}

/// Adds the memory that a run takes: the peak of this process once it has started one with one worker.
fn measure_memory(source: &Source, compiled: &dyn CompiledScenario, contents: &mut JsonTextReport) {
    let _run = compiled.start(source, 1);
    let Some(bytes) = peak_bytes() else { return };
    let recorded =
        bytes + RECORDING_BYTES + RECORDING_BYTES_PER_BODY * compiled.body_count() as u64;
    contents.json["memory_bytes"] = bytes.into();
    contents.json["recorded_memory_bytes"] = recorded.into();
    contents.text.push_str(&format!(
        "  A run takes about {} MB of memory, recorded up to {} MB\n",
        bytes.div_ceil(BYTES_PER_MB),
        recorded.div_ceil(BYTES_PER_MB)
    ));
}

const BYTES_PER_MB: u64 = 1_000_000;

/// Returns the peak of this process's memory so far; `None` on systems without `/proc`.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = peak.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Returns remarks as text: severity and key on a line, and the text below.
fn format_remarks(remarks: &[Remark]) -> String {
    let mut text = String::new();
    for Remark { severity, key, words, .. } in remarks {
        text.push_str(&format!("{}: {key}\n  {words}\n", severity.name()));
    }
    text
}
