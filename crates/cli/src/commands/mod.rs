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

/// The commands of `sidestep`.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scenario; record it with --out
    Run(run::RunArgs),
    /// Validate a scenario and describe it, without running it
    Check(check::CheckArgs),
    /// Create a commented scenario as a starting point
    New(new::NewArgs),
    /// Show a map as the simulator sees it, in the terminal or as PNG
    Map(map::MapArgs),
    /// Learn the error models of a real robot's sensors and wheels from its logs
    Learn(learn::LearnArgs),
    /// Compute the exact Markov chain of a scenario with one robot
    Exact(exact::ExactArgs),
    /// Run a parameter sweep: many variants of a scenario, each with many seeds
    Sweep(Box<sweep::SweepArgs>),
    /// Compare collision avoidance methods on the same air traffic
    Compare(compare::CompareArgs),
    /// Forward kinematics: compute the positions of a robot arm's tip and connectors
    Fk(fk::FkArgs),
    /// Inverse kinematics: compute joint values that bring a robot arm's tip to a target
    Ik(ik::IkArgs),
    /// Continue a recorded run or a sweep that was stopped or killed
    Resume(resume::ResumeArgs),
    /// Write a report of a run or a sweep: one HTML file, and Markdown
    Report(report::ReportArgs),
    /// Reproduce a paper's experiments and judge its claims
    Reproduce(reproduce::ReproduceArgs),
    /// Compute a recorded run again and compare it with the recording
    Replay(replay::ReplayArgs),
    /// Export a recorded run as tables, pictures, animations or recordings for viewers
    Export(export::ExportArgs),
}

/// Executes a command and returns its exit code.
///
/// # Errors
/// When the command fails; the failure knows its exit code.
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
