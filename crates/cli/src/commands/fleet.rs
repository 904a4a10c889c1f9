//! `sidestep fleet`: a world with agents that are processes on a network.

use crate::console::{Console, aligned, grouped};
use crate::exit::{ExitCode, Failure};
use crate::fleet_table::Shown;
use crate::link::{LinkArgs, run};
use crate::plan::ScenarioArgs;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sidestep::kernel::words::{Lines, line};
use sidestep_session::fleet::{Clock, FleetJob, FleetNow, Job, Told, Topology};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep fleet ring.toml --set airspace.deployment=compact-team
  sidestep fleet ring.toml --clock realtime --speed 10 --watch
  sidestep fleet ring.toml --out runs/fleet    then report, replay, export
  sidestep fleet ring.toml --clock realtime --listen tcp/127.0.0.1:7600
                                           and sidestep studio tcp/127.0.0.1:7600
                                           shows it
  sidestep fleet ring.toml --nodes 0 --listen tcp/10.0.0.1:7600
                                           the airplanes are elsewhere: see
                                           sidestep node --help
  sidestep fleet chain.toml --set chain.deployment=team
                                           a process for each connector; where all
                                           rules are local: see the book

The program sidestep-link does it: `cargo install --path crates/link`. In lockstep a fleet comes \
out as `sidestep run` does, bit for bit. Ctrl-C ends all of its processes; what is recorded \
continues with `sidestep resume DIR`.";

/// The course of time, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ClockName {
    /// The server waits for every agent: the same results as in one process
    Lockstep,
    /// Each cycle is a deadline: a late airplane stays on its orbit, a late chain stands still
    Realtime,
}

/// The way from node to node, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TopologyName {
    /// Every node is connected to every other
    Mesh,
    /// All packets go through the server
    Star,
}

/// Run a scenario with a process for each airplane, or for each connector of a chain.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FleetArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Number of nodes to start here, of the agents with the lowest ids; the fleet waits for the
    /// others [default: all]
    #[arg(long, value_name = "N")]
    nodes: Option<usize>,

    /// Clock: how time passes
    #[arg(long, value_enum, default_value_t = ClockName::Lockstep)]
    clock: ClockName,

    /// Speed: seconds of the scenario per second of real time
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,

    /// Network topology: the way of packets from node to node
    #[arg(long, value_enum, default_value_t = TopologyName::Mesh)]
    topology: TopologyName,

    /// Endpoint on which the server listens, e.g. tcp/10.0.0.1:7600; repeatable
    /// [default: any free port of this machine alone]
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,

    /// Show a table of the nodes while they fly
    #[arg(long)]
    watch: bool,

    /// Output folder for the recorded run; it must be new or empty
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Overwrite an earlier run in DIR
    #[arg(long, requires = "out")]
    replace: bool,

    /// Also record every packet, in the table `packets`
    #[arg(long, requires = "out")]
    packets: bool,

    #[command(flatten)]
    link: LinkArgs,
}

/// Parses a speed.
fn speed(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.01..=1000.0).contains(x));
    number.ok_or_else(|| "give a number from 0.01 to 1000".into())
}

/// Runs the command.
///
/// # Errors
/// When anything is wrong with its input, or the fleet comes to no end.
pub(crate) fn fleet(args: &FleetArgs, console: Console) -> Result<ExitCode, Failure> {
    let mut shown = Shown::new(console, args.watch);
    let mut ended = None;
    let done = run(&Job::Fleet(args.job()), |told| match told {
        Told::Listens(endpoints) => {
            // Lockstep is over before it could be watched, unless it waits for nodes.
            if args.nodes.is_some() || args.clock == ClockName::Realtime {
                console.note(format!("The server listens at {}", endpoints.join(", ")));
            }
        }
        Told::Fleet(now) => shown.show(&now),
        Told::Ended { summary, outcome, fleet } => ended = Some((summary, outcome, fleet)),
        // The caller has it already; the others are for watchers.
        Told::Failed(_) | Told::Scene(_) | Told::Seen(_) => {}
    });
    shown.clear();
    if let Some((summary, outcome, fleet)) = ended {
        args.tell(&summary, outcome, &fleet, console)?;
    }
    match done {
        Ok(()) => Ok(ExitCode::Done),
        Err(Failure::Interrupted) => {
            if let Some(folder) = args.out.as_ref().map(|folder| folder.display()) {
                console.note(format!(
                    "The run is incomplete; `sidestep resume {folder}` continues it."
                ));
            }
            Ok(ExitCode::Interrupted)
        }
        Err(failure) => Err(failure),
    }
}

impl FleetArgs {
    fn job(&self) -> FleetJob {
        let any = || vec![format!("{}/127.0.0.1:0", self.link.protocol())];
        FleetJob {
            common: self.link.common(self.scenario.file.clone(), self.scenario.all_overrides()),
            nodes: self.nodes,
            clock: match self.clock {
                ClockName::Lockstep => Clock::Lockstep,
                ClockName::Realtime => Clock::Realtime { speed: self.speed },
            },
            topology: match self.topology {
                TopologyName::Mesh => Topology::Mesh,
                TopologyName::Star => Topology::Star,
            },
            listen: if self.listen.is_empty() { any() } else { self.listen.clone() },
            out: self.out.clone(),
            replace: self.replace,
            packets: self.packets,
        }
    }

    /// Prints the results.
    fn tell(
        &self,
        summary: &Value,
        outcome: Lines,
        fleet: &FleetNow,
        console: Console,
    ) -> Result<(), Failure> {
        let text = |key: &str| summary[key].as_str().unwrap_or_default().to_string();
        let short = || format!("{}\n", text("digest"));
        let lines = || {
            let mut lines = vec![line("cycles", grouped(summary["cycles"].as_u64().unwrap_or(0)))];
            lines.extend(outcome);
            lines.extend(self.network_lines(fleet));
            lines.push(line("digest", text("digest")));
            lines.extend(summary["folder"].as_str().map(|folder| line("results", folder)));
            format!("{}, seed {}\n{}", text("name"), summary["seed"], aligned(&lines))
        };
        let mut all = summary.clone();
        all["fleet"] = json!(fleet);
        console.result_or_short(&all, short, lines)
    }

    fn network_lines(&self, fleet: &FleetNow) -> Lines {
        let sum = |of: fn(&sidestep_session::fleet::NodeNow) -> u64| {
            fleet.nodes.iter().map(of).sum::<u64>()
        };
        let topology = if self.topology == TopologyName::Mesh { "mesh" } else { "star" };
        let clock = if self.clock == ClockName::Lockstep { "lockstep" } else { "real time" };
        let restarted = sum(|node| node.lives.saturating_sub(1));
        let mut lines = vec![
            line("nodes", format!("{} in a {topology}, {clock}", fleet.nodes.len())),
            line(
                "packets",
                format!(
                    "{} sent, {} bytes",
                    grouped(sum(|node| node.packets)),
                    grouped(sum(|node| node.bytes))
                ),
            ),
        ];
        if self.clock == ClockName::Realtime {
            let late = format!(
                "{} controls, {} cycles of the server",
                grouped(sum(|node| node.late)),
                grouped(fleet.late_cycles)
            );
            lines.push(line("late", late));
        }
        if restarted > 0 {
            lines.push(line("restarted", format!("{restarted} nodes")));
        }
        lines
    }
}
