//! The `sidestep` command: arguments -> plan -> session -> words.
//!
//! ```text
//! args.rs      what can be typed                 commands/*.rs   one file per command
//! plan.rs      options -> a scenario             sweep/          options -> a sweep; its words
//! watch.rs     progress and Ctrl-C for sessions  progress.rs     bars on a terminal
//! report.rs    a run's summary in words          pages.rs        documents as files
//! exit.rs      how the command ends              console.rs      what it prints, and where
//! ```
//!
//! What is done with runs is done by the crate `sidestep-session`.

mod args;
mod commands;
mod console;
mod exit;
mod interrupt;
mod pages;
mod plan;
mod progress;
mod report;
mod sweep;
mod watch;

use clap::Parser;
use exit::ExitCode;

fn main() -> std::process::ExitCode {
    let cli = args::Cli::parse();
    let console = console::Console::new(cli.json, cli.quiet);
    match commands::execute(cli.command, &console) {
        Ok(code) => code.into(),
        Err(failure) => {
            console.error(&failure);
            ExitCode::from(&failure).into()
        }
    }
}
