//! The part that `run` and `resume` share: driving the run to its end, and its report.

use crate::console::Console;
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::report::summary_text;
use sidestep_session::{ManagedRun, RunStatus, Summary};
use std::path::Path;

/// Drives the run to its end (or until Ctrl-C), and stores and prints the summary.
///
/// # Errors
/// When something cannot be stored.
pub(super) fn run_to_end(journey: ManagedRun, console: Console) -> Result<ExitCode, Failure> {
    let summary = journey.run_to_end(&ConsoleWatcher::new(console))?;
    let short = || format!("{}\n", summary.digest);
    console.print_result_or_short(&summary, short, || summary_text(&summary))?;
    Ok(print_next_step(&summary, console))
}

fn print_next_step(summary: &Summary, console: Console) -> ExitCode {
    if let Some(folder) = summary.folder.as_deref().map(Path::display) {
        console.note(match summary.status {
            RunStatus::Complete => {
                format!("Next: `sidestep report {folder}` writes a page with pictures and numbers.")
            }
            RunStatus::Incomplete => {
                format!("The run is marked as incomplete; `sidestep resume {folder}` continues it.")
            }
        });
    }
    match interrupt::is_requested() && summary.status == RunStatus::Incomplete {
        true => ExitCode::Interrupted,
        false => ExitCode::Done,
    }
}
