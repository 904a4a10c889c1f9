//! Many runs: options -> a sweep, and its results as text.
//!
//! ```text
//! ask.rs      options and files -> a sweep         say.rs       its results, as text and JSON
//! status.rs   how far it is
//! ```

mod ask;
mod say;
mod status;

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::watch::Watch;
use crate::worlds;
pub(crate) use ask::ManyArgs;
pub(crate) use say::{Told, tell, tell_share};
use sidestep_session::sweep::{self, Folder};
pub(crate) use status::tell_status;

/// Runs all cells of a sweep's folder that are not finished.
///
/// # Errors
/// When runs cannot be read or stored.
pub(crate) fn go_on(
    folder: &Folder,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    interrupt::listen()?;
    let ended = sweep::go_on(worlds(), folder, workers, &Watch::new(console))?;
    let told = Told { plan: folder.plan(), folder: Some(folder), console };
    tell(told, ended, "All runs are finished already.")
}
