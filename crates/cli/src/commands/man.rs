//! `sidestep man`: manual pages made of the help texts.

use crate::args;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::{Args, Command};
use clap_mangen::Man;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_session::{display_path, write_atomically};
use std::path::PathBuf;

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
    if folder.exists() && !folder.is_dir() {
        let remedy = "give a folder where you may write";
        return Err(InputError::new(folder.display(), "this is no folder", remedy).into());
    }
    for page in pages() {
        let path = folder.join(page.get_filename());
        write_atomically(&path, |file| page.render(file))?;
    }
    console.print_result(&json!({ "folder": display_path(folder) }), || {
        format!("Wrote manual pages to {}.\n", folder.display())
    })?;
    Ok(ExitCode::Done)
}

/// Returns the pages of all commands that are not hidden, that of `sidestep` itself last.
fn pages() -> Vec<Man> {
    let mut command = args::command().disable_help_subcommand(true);
    // The names of pages are those of whole commands, such as `sidestep-run`, once this is done.
    command.build();
    let mut pages = Vec::new();
    add_pages(&command, &mut pages);
    pages
}

fn add_pages(command: &Command, pages: &mut Vec<Man>) {
    for subcommand in command.get_subcommands().filter(|command| !command.is_hide_set()) {
        add_pages(subcommand, pages);
    }
    pages.push(Man::new(command.clone()));
}
