//! The part that `run` and `resume` share: advancing the run to its end, and printing its summary.

use crate::console::Console;
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::report::summary_text;
use sidestep::kernel::shell::sidestep_command;
use sidestep_session::{ManagedRun, RunStatus, Summary};

/// Advances the run to its end (or until Ctrl-C), and stores and prints the summary.
///
/// # Errors
/// When something cannot be stored.
pub(super) fn run_to_end(run: ManagedRun, console: Console) -> Result<ExitCode, Failure> {
    let summary = run.run_to_end(&ConsoleWatcher::new(console))?;
    let digest = format!("{}\n", summary.digest);
    console.print_result_or_short(&summary, &digest, || summary_text(&summary))?;
    Ok(print_next_step(&summary, console))
}

fn print_next_step(summary: &Summary, console: Console) -> ExitCode {
    if let Some(folder) = summary.folder.as_deref() {
        console.note(match summary.status {
            RunStatus::Complete => {
                let report = sidestep_command("report", folder);
                format!("Next: `{report}` writes a page with pictures and numbers.")
            }
            RunStatus::Incomplete => {
                let resume = sidestep_command("resume", folder);
                format!("The run is marked as incomplete; `{resume}` continues it.")
            }
        });
    }
    // A run whose last cycle ended despite Ctrl-C is complete, and so is the command.
    if interrupt::is_requested() && summary.status == RunStatus::Incomplete {
        return ExitCode::Interrupted;
    }
    ExitCode::Done
}
