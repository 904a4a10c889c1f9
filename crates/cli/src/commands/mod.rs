//! One file per command.

mod arm;
mod arm_picture;
mod check;
mod compare;
mod completions;
mod dispatch;
mod drive;
mod exact;
mod export;
mod finish;
mod fk;
mod fleet;
mod flight;
mod ik;
mod inspect;
mod learn;
mod man;
mod map;
mod mavlink;
mod new;
mod node;
mod replay;
mod report;
mod reproduce;
mod resume;
mod ros2;
mod run;
mod schema;
mod studio;
mod sweep;
mod verify;

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Subcommand;

/// The commands by their use, in the order in which people meet them.
pub(crate) const GROUPS: &[(&str, &[&str])] = &[
    ("Prepare", &["new", "check", "schema", "inspect", "map", "learn"]),
    ("Run and look at it", &["run", "studio", "resume", "replay", "verify", "report", "export"]),
    ("Fly on a network", &["fleet", "node", "drive", "dispatch"]),
    ("Study", &["sweep", "compare", "exact", "reproduce"]),
    ("Robot arms", &["fk", "ik"]),
    ("This command", &["completions", "man"]),
];

/// The commands of `sidestep`.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scenario; record it with --out
    Run(run::RunArgs),
    /// Watch, steer, replay and edit in the browser
    Studio(studio::StudioArgs),
    /// Run a scenario with a process for each of its agents
    Fleet(Box<fleet::FleetArgs>),
    /// Run one agent of a fleet on this machine
    Node(Box<node::NodeArgs>),
    /// Let vehicles of a warehouse carry out a plan, by VDA 5050
    Dispatch(Box<dispatch::DispatchArgs>),
    /// Drive a real robot of ROS 2 by the program of a simulated one
    Drive(Box<drive::DriveArgs>),
    /// Validate a scenario and describe it, without running it
    Check(check::CheckArgs),
    /// Create a commented scenario as a starting point
    New(new::NewArgs),
    /// Write the keys of scenarios as JSON Schema, for editors
    Schema(schema::SchemaArgs),
    /// Say what a file is, and what becomes of it when it is read
    Inspect(inspect::InspectArgs),
    /// Show a map as the simulator sees it, in the terminal or as PNG
    Map(map::MapArgs),
    /// Learn error models of sensors and wheels from a robot's logs
    Learn(learn::LearnArgs),
    /// Compute the exact Markov chain of a scenario with one robot
    Exact(exact::ExactArgs),
    /// Run many variants of a scenario, each with many seeds
    Sweep(Box<sweep::SweepArgs>),
    /// Compare collision avoidance methods on the same air traffic
    Compare(compare::CompareArgs),
    /// Forward kinematics: where an arm's tip and connectors are
    Fk(fk::FkArgs),
    /// Inverse kinematics: joint values that bring the tip to a target
    Ik(ik::IkArgs),
    /// Continue a recorded run or a sweep that was stopped or killed
    Resume(resume::ResumeArgs),
    /// Write a report of a run or a sweep: one HTML file, and Markdown
    Report(report::ReportArgs),
    /// Reproduce a paper's experiments and judge its claims
    Reproduce(reproduce::ReproduceArgs),
    /// Compute a recorded run again and compare it with the recording
    Replay(replay::ReplayArgs),
    /// Check that every file of a recording is as it was written
    Verify(verify::VerifyArgs),
    /// Export a recorded run: tables, pictures, animations, recordings
    Export(export::ExportArgs),
    /// Print the completions of a shell
    Completions(completions::CompletionsArgs),
    /// Write manual pages, one for each command
    Man(man::ManArgs),
}

/// Executes a command and returns its exit code.
///
/// # Errors
/// When the command fails; the failure knows its exit code.
pub(crate) fn execute(command: Command, console: &Console) -> Result<ExitCode, Failure> {
    match command {
        Command::Run(args) => run::run(&args, *console),
        Command::Studio(args) => studio::studio(&args, *console),
        Command::Fleet(args) => fleet::fleet(&args, *console),
        Command::Node(args) => node::node(&args, *console),
        Command::Dispatch(args) => dispatch::dispatch(&args, *console),
        Command::Drive(args) => drive::drive(&args, *console),
        Command::Check(args) => check::check(&args, *console),
        Command::New(args) => new::new(&args, *console),
        Command::Schema(args) => schema::schema(&args, *console),
        Command::Inspect(args) => inspect::inspect(&args, *console),
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
        Command::Verify(args) => verify::verify(&args, *console),
        Command::Export(args) => export::export(&args, *console),
        Command::Completions(args) => completions::completions(&args, *console),
        Command::Man(args) => man::man(&args, *console),
    }
}
