//! `sidestep man`: manual pages made of the help texts.

use crate::args;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Args;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_session::display_path;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep man ~/.local/share/man/man1      then `man sidestep-run`
  sidestep man man1 && man ./man1/sidestep.1";

/// Write manual pages, one for each command.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ManArgs {
    /// Folder to write them to; created if missing
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// # Errors
/// When the folder cannot be written to.
pub(crate) fn man(args: &ManArgs, console: Console) -> Result<ExitCode, Failure> {
    let folder = &args.folder;
    write_pages(folder).map_err(|e| {
        let remedy = "give a folder where you may write";
        InputError::new(folder.display(), format!("cannot write manual pages: {e}"), remedy)
    })?;
    console.print_result(&json!({ "folder": display_path(folder) }), || {
        format!("Wrote manual pages to {}.\n", folder.display())
    })?;
    Ok(ExitCode::Done)
}

fn write_pages(folder: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    clap_mangen::generate_to(args::command(), folder)
}
