//! The part that `run` and `resume` share: driving the run to its end, and its report.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::report::text;
use crate::watch::Watch;
use sidestep_session::{Journey, Status, Summary};
use std::path::Path;

/// Drives the run to its end (or until Ctrl-C), and stores and prints the summary.
///
/// # Errors
/// When something cannot be stored.
pub(super) fn travel(journey: Journey, console: Console) -> Result<ExitCode, Failure> {
    let summary = journey.travel(&Watch::new(console))?;
    let short = || format!("{}\n", summary.digest);
    console.result_or_short(&summary, short, || text(&summary))?;
    Ok(ending(&summary, console))
}

fn ending(summary: &Summary, console: Console) -> ExitCode {
    if let Some(folder) = summary.folder.as_deref().map(Path::display) {
        console.note(match summary.status {
            Status::Complete => {
                format!("Next: `sidestep report {folder}` writes a page with pictures and numbers.")
            }
            Status::Incomplete => {
                format!("The run is marked as incomplete; `sidestep resume {folder}` continues it.")
            }
        });
    }
    match interrupt::requested() && summary.status == Status::Incomplete {
        true => ExitCode::Interrupted,
        false => ExitCode::Done,
    }
}
