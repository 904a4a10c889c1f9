//! The `sidestep` command: arguments -> plan -> run.
//!
//! ```text
//! args.rs      what can be typed                commands/*.rs   one file per command
//! plan.rs      scenario + options -> a run      worlds/         the only place that knows worlds
//! driver.rs    advances, records, checkpoints   report.rs       what a run says at its end
//! sweep/       many runs of one scenario                  recording.rs    a run folder that grows
//! film/        frames into files                rerun.rs        recorded runs, computed again
//! exit.rs      how the command ends             console.rs      what it prints, and where
//! ```

mod args;
mod commands;
mod compare;
mod console;
mod driver;
mod exit;
mod files;
mod film;
mod interrupt;
mod pages;
mod picture;
mod plan;
mod progress;
mod recorded;
mod recording;
mod report;
mod rerun;
mod sweep;

use clap::Parser;

fn main() -> std::process::ExitCode {
    let cli = args::Cli::parse();
    let console = console::Console::new(cli.json, cli.quiet);
    match commands::execute(cli.command, &console) {
        Ok(code) => code.into(),
        Err(failure) => {
            console.error(&failure);
            failure.exit_code().into()
        }
    }
}
