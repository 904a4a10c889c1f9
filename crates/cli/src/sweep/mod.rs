//! Many runs: options -> a sweep, and its results.
//!
//! ```text
//! args.rs     options and files -> a sweep         output.rs    its results, as text and JSON
//! status.rs   its progress
//! ```

mod args;
mod output;
mod status;

use crate::console::Console;
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::worlds;
pub(crate) use args::ReplicationArgs;
pub(crate) use output::{SweepOutput, print_results, print_share};
use sidestep_session::sweep::{self, Folder};
pub(crate) use status::print_status;

/// Runs all trials of a sweep's folder that are not finished.
///
/// # Errors
/// When runs cannot be read or stored.
pub(crate) fn run_remaining(
    folder: &Folder,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    interrupt::listen()?;
    let end = sweep::run_remaining(worlds(), folder, workers, &ConsoleWatcher::new(console))?;
    let output = SweepOutput { plan: folder.plan(), folder: Some(folder), console };
    print_results(output, end, "All runs are finished already.")
}
