//! The `sidestep` command: arguments -> plan -> session -> words.
//!
//! ```text
//! args.rs      the command line                  commands/*.rs   one file per command
//! plan.rs      options -> a scenario             sweep/          options -> a sweep; its results
//! watch.rs     progress and Ctrl-C for sessions  progress.rs     progress bars
//! report.rs    a run's summary as text           pages.rs        documents as files
//! exit.rs      exit codes and failures           console.rs      standard output and error
//! ```
//!
//! The crate `sidestep-session` drives the runs.

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

use exit::ExitCode;

fn main() -> std::process::ExitCode {
    let cli = args::Cli::of_process();
    let console = console::Console::new(cli.json, cli.quiet);
    match commands::execute(cli.command, &console) {
        Ok(code) => code.into(),
        Err(failure) => {
            console.error(&failure);
            ExitCode::from(&failure).into()
        }
    }
}
