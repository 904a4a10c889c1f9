//! Many runs: what was typed -> a sweep, and what came of it in words.
//!
//! ```text
//! ask.rs      options and files -> what to run         say.rs       what it came to, in words
//! ```

mod ask;
mod say;

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::watch::Watch;
pub(crate) use ask::ManyArgs;
pub(crate) use say::{Told, tell, tell_share};
use sidestep::worlds::WORLDS;
use sidestep_session::sweep::{self, Folder};

/// Runs whatever is not finished yet in the folder of a sweep.
///
/// # Errors
/// When runs cannot be read or stored.
pub(crate) fn go_on(
    folder: &Folder,
    workers: usize,
    console: Console,
) -> Result<ExitCode, Failure> {
    interrupt::listen()?;
    let ended = sweep::go_on(WORLDS, folder, workers, &Watch::new(console))?;
    let told = Told { plan: folder.plan(), folder: Some(folder), console };
    tell(told, ended, "All runs are finished already.")
}
