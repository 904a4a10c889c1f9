//! `sidestep new`: a commented scenario as a starting point.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::worlds;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep::kernel::shell::sidestep_command;
use sidestep::scenario::WorldType;
use sidestep_record::{is_wrong_path, missing_folders, remove_folders};
use sidestep_session::display_path;
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep new robots                 writes robots.toml
  sidestep new robots warehouse.toml
  sidestep new robots w.toml && sidestep check w.toml";

/// Create a commented scenario as a starting point.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NewArgs {
    /// World of the scenario
    #[arg(value_name = "WORLD", value_parser = world_names())]
    world: String,

    /// Output file; an existing one is never overwritten [default: WORLD.toml]
    #[arg(value_name = "NAME.toml")]
    file: Option<PathBuf>,
}

/// The worlds as values of an option, each with its description as help.
pub(crate) fn world_names() -> PossibleValuesParser {
    PossibleValuesParser::new(worlds().iter().map(world_value))
}

/// Returns a world as the value of an option.
pub(super) fn world_value(world: &dyn WorldType) -> PossibleValue {
    PossibleValue::new(world.name()).help(world.about())
}

/// # Errors
/// When the file is there already or cannot be written.
pub(crate) fn new(args: &NewArgs, console: Console) -> Result<ExitCode, Failure> {
    let world = worlds().find(&args.world).expect("the parser takes these names alone");
    let path = args.file.clone().unwrap_or_else(|| PathBuf::from(format!("{}.toml", world.name())));
    write_new(&path, world.default_scenario())?;
    let [check, run] = ["check", "run"].map(|command| sidestep_command(command, &path));
    let next = format!("Try:\n  {check}\n  {run}\n");
    let json = json!({ "file": display_path(&path), "world": args.world });
    console.print_result(&json, || format!("Wrote {}\n{next}", path.display()))?;
    Ok(ExitCode::Done)
}

fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    create_with_text(path, text).map_err(|e| {
        let remedy = "give a file that does not exist yet, in a folder where you may write, on a disk with room";
        if is_wrong_path(&e) {
            let cause = format!("cannot create the file: {e}");
            return InputError::new(path.display(), cause, remedy).into();
        }
        Failure::other(format!("cannot create {}: {e}", path.display()), remedy)
    })
}

fn create_with_text(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = path.parent().unwrap_or(path);
    let folders = missing_folders(folder);
    let created = std::fs::create_dir_all(folder).and_then(|()| std::fs::File::create_new(path));
    let written = created.and_then(|mut file| {
        // A full disk leaves no half of it, and the next try finds the place free.
        file.write_all(text.as_bytes()).inspect_err(|_| drop(std::fs::remove_file(path)))
    });
    written.inspect_err(|_| remove_folders(&folders))
}
