//! One file per command.

mod arm;
mod check;
mod compare;
mod exact;
mod export;
mod finish;
mod fk;
mod ik;
mod learn;
mod map;
mod new;
mod replay;
mod report;
mod reproduce;
mod resume;
mod run;
mod sweep;

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Subcommand;

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scenario, and record it with --out
    Run(run::RunArgs),
    /// Say what a scenario describes, or what is wrong with it; run nothing
    Check(check::CheckArgs),
    /// Write a commented scenario to begin with
    New(new::NewArgs),
    /// Show a map as the program sees it, on the terminal and as PNG
    Map(map::MapArgs),
    /// Learn the errors of a real robot's sensors and wheels from its logs
    Learn(learn::LearnArgs),
    /// Compute the exact Markov chain of a scenario with one robot
    Exact(exact::ExactArgs),
    /// Run many variants of a scenario, each with many seeds, and sum them up
    Sweep(Box<sweep::SweepArgs>),
    /// Run methods of avoiding each other on the same traffic
    Compare(compare::CompareArgs),
    /// Compute where a robot arm's tip and connectors are
    Fk(fk::FkArgs),
    /// Compute joint values that bring a robot arm's tip to a target
    Ik(ik::IkArgs),
    /// Continue a recorded run or a sweep that was stopped or killed
    Resume(resume::ResumeArgs),
    /// Write a report of a run folder: one HTML file, and Markdown
    Report(report::ReportArgs),
    /// Run a paper's experiments anew and judge its claims
    Reproduce(reproduce::ReproduceArgs),
    /// Compute a recorded run again and compare it with what was recorded
    Replay(replay::ReplayArgs),
    /// Write a recorded run as tables, pictures, films or recordings for viewers
    Export(export::ExportArgs),
}

/// Does what was typed.
///
/// # Errors
/// When it cannot be done; the failure knows its exit code.
pub(crate) fn execute(command: Command, console: &Console) -> Result<ExitCode, Failure> {
    match command {
        Command::Run(args) => run::run(&args, *console),
        Command::Check(args) => check::check(&args, *console),
        Command::New(args) => new::new(&args, *console),
        Command::Map(args) => map::map(&args, *console),
        Command::Learn(args) => learn::learn(&args, *console),
        Command::Exact(args) => exact::exact(&args, *console),
        Command::Sweep(args) => sweep::sweep(&args, *console),
        Command::Compare(args) => compare::compare(&args, *console),
        Command::Fk(args) => fk::fk(&args, *console),
        Command::Ik(args) => ik::ik(&args, *console),
        Command::Resume(args) => resume::resume(&args, *console),
        Command::Report(args) => report::report(&args, *console),
        Command::Reproduce(args) => reproduce::reproduce(&args, *console),
        Command::Replay(args) => replay::replay(&args, *console),
        Command::Export(args) => export::export(&args, *console),
    }
}
