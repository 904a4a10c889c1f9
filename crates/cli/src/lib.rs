//! The `sidestep` command: arguments -> plan -> session -> output.
//!
//! ```text
//! args.rs             the command line                  commands/*.rs    one file per command
//! scenario_args.rs    options -> a scenario             sweep/           options -> a sweep; its results
//! console_watcher.rs  progress and Ctrl-C for sessions  progress.rs      progress bars
//! interrupt.rs        Ctrl-C                            foxglove.rs      messages about live viewers
//! report.rs           a run's summary as text           report_files.rs  documents as files
//! exit.rs             exit codes and failures           console.rs       standard output and error
//! link.rs             the program of fleets             fleet_table.rs   its nodes as a table
//! fleet_watch.rs      fleets that the studio watches    gallery/         scenarios that the program carries
//! size.rs             sizes of figures and pictures
//! ```
//!
//! The crate `sidestep-session` drives the runs.
//!
//! A program with worlds or parts of its own has the whole command line by [`main_with`]: it checks, runs,
//! sweeps, animates and replays scenarios that name them.

mod args;
mod commands;
mod console;
mod console_watcher;
mod exit;
mod fleet_table;
mod fleet_watch;
mod fonts;
mod foxglove;
mod gallery;
#[cfg(test)]
mod hints;
mod interrupt;
mod link;
mod progress;
mod report;
mod report_files;
mod scenario_args;
mod size;
mod sweep;

use exit::ExitCode;
use sidestep::kernel::Digest;
use sidestep::scenario::Worlds;
use sidestep::worlds::WORLDS;
use std::sync::OnceLock;

/// The worlds of [`main_with`].
static OWN_WORLDS: OnceLock<Worlds> = OnceLock::new();

/// Returns the worlds of [`main_with`], else those of this project.
fn worlds() -> &'static Worlds {
    OWN_WORLDS.get().unwrap_or(&WORLDS)
}

/// Runs the command that the arguments of this process ask for, with other worlds: further ones, or those of
/// [`WORLDS`] with parts of your own. Recordings belong to the program that made them: another program, or
/// this one with other code, does not continue them.
pub fn main_with(worlds: Worlds) -> std::process::ExitCode {
    // A recording must not be continued by code that would give other results. The added code is known only as a part of
    // the program's file, so the digest of that file stands for it.
    let program = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
    let digest = Digest::hash_bytes(&program).to_string();
    OWN_WORLDS.get_or_init(|| worlds.with_added_code(&digest));
    main()
}

/// Runs the command that the arguments of this process ask for.
pub fn main() -> std::process::ExitCode {
    let cli = args::Cli::parse_process_args();
    let console = console::Console::new(cli.json, cli.quiet);
    match commands::execute(cli.command, &console) {
        Ok(code) => code.into(),
        Err(failure) => {
            console.error(&failure);
            ExitCode::from(&failure).into()
        }
    }
}
