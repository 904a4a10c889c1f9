//! `sidestep fleet`: a world with agents that are processes on a network.

use super::flight::GuardArgs;
use crate::console::{Console, align_pairs, group_thousands};
use crate::exit::{ExitCode, Failure};
use crate::fleet_table::FleetTable;
use crate::link::{LOST_SERVER_REMEDY, LinkArgs, run_job};
use crate::scenario_args::ScenarioArgs;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sidestep::kernel::InputError;
use sidestep::kernel::shell::sidestep_command;
use sidestep::kernel::text::{KeyValues, key_value_pair};
use sidestep_document::estimate::format_short;
use sidestep_session::fleet::{
    ClockMode, FleetJob, FleetStatus, FlightClock, FlightNetwork, FlightRecorderJob, Job,
    LinkMessage, NodeStatus, Topology, check_loopback_multicast,
};
use std::net::SocketAddrV4;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep fleet ring.toml --set airspace.deployment=compact-team
  sidestep fleet ring.toml --clock realtime --speed 10 --watch
  sidestep fleet ring.toml --out runs/fleet    then report, replay, export
  sidestep fleet ring.toml --clock realtime --listen tcp/127.0.0.1:7600
                                           and sidestep studio tcp/127.0.0.1:7600
                                           shows it
  sidestep fleet ring.toml --nodes 0 --listen tcp/10.0.0.1:7600 --insecure
                                           the airplanes are elsewhere: see
                                           sidestep node --help
  sidestep fleet chain.toml --set chain.deployment=team
                                           a process for each connector; where all
                                           rules are local: see the book
  sidestep fleet office.toml --watch       a process for each robot
  sidestep fleet scenarios/airspace/multirotors.toml --no-server --out runs/air
                                           airplanes without a server, as in the
                                           field; this command only records

The program sidestep-link does it: `cargo install --path crates/link`. In lockstep a fleet comes \
out as `sidestep run` does, bit for bit. Ctrl-C ends all of its processes; a fleet in lockstep \
continues with `sidestep resume DIR`. A flight in real time is on disk up to the last second, \
whatever ends it, and is not continued.";

/// How time passes, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ClockArg {
    /// The server waits for every agent: the same results as in one process
    Lockstep,
    /// Each cycle is a deadline: a late airplane stays on its orbit, a late chain or robot stands
    /// still
    Realtime,
}

/// How packets get from node to node, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TopologyArg {
    /// Every node is connected to every other
    Mesh,
    /// All packets go through the server
    Star,
    /// By UDP multicast: a packet to many is sent once
    Multicast,
}

/// Run a scenario with a process for each airplane, for each connector of a chain, or for each robot.
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
    #[arg(long, value_enum, default_value_t = ClockArg::Lockstep)]
    clock: ClockArg,

    /// Speed: seconds of the scenario per second of real time
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = parse_speed)]
    speed: f64,

    /// Network topology: the route of packets from node to node [default: multicast where all
    /// nodes are started here, without --listen and without certificates; else mesh]
    #[arg(long, value_enum)]
    topology: Option<TopologyArg>,

    /// Multicast group of the nodes, e.g. 239.255.7.1:7601
    /// [default: one that no other fleet has]
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = parse_group)]
    multicast_group: Option<SocketAddrV4>,

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

    /// Fly airplanes without a server: nodes know each other by their reports, and this command only
    /// records. In real time, with models of vehicles
    #[arg(long, conflicts_with_all = ["clock", "topology", "multicast_group", "packets"])]
    no_server: bool,

    /// Seconds by which the clocks of two nodes may differ, without a server
    #[arg(long, value_name = "S", default_value_t = 0.1, requires = "no_server")]
    clock_tolerance: f64,

    #[command(flatten)]
    guard: GuardArgs,

    #[command(flatten)]
    link: LinkArgs,
}

pub(super) fn parse_speed(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.01..=1000.0).contains(x));
    number.ok_or_else(|| "give a number from 0.01 to 1000".into())
}

fn parse_group(text: &str) -> Result<SocketAddrV4, String> {
    let group = text
        .parse()
        .ok()
        .filter(|group: &SocketAddrV4| group.ip().is_multicast() && group.port() > 0);
    group.ok_or_else(|| {
        "give an address from 224.0.0.0 to 239.255.255.255 and a port, as in 239.255.7.1:7601"
            .into()
    })
}

/// What a fleet has come to.
struct FleetEnd {
    /// The route of packets; none without a server.
    topology: Option<TopologyArg>,
    summary: Value,
    outcome: KeyValues,
    fleet: FleetStatus,
}

/// # Errors
/// When anything is wrong with its input, or the fleet fails.
pub(crate) fn fleet(args: &FleetArgs, console: Console) -> Result<ExitCode, Failure> {
    let mut table = FleetTable::new(console, args.watch);
    let mut end = None;
    args.check_group()?;
    let topology = (!args.no_server).then(|| args.topology());
    let job = match topology {
        Some(topology) => Job::Fleet(args.job(topology)),
        None => Job::FlightRecorder(Box::new(args.recorder_job())),
    };
    let result = run_job(&job, |message| match message {
        LinkMessage::Listens(endpoints) => {
            // A fleet in lockstep with all its nodes here ends before a user could join or watch it.
            let has_server = !args.no_server;
            if has_server && (args.nodes.is_some() || args.clock == ClockArg::Realtime) {
                console.note(format!("The server listens at {}", endpoints.join(", ")));
            }
        }
        LinkMessage::Fleet(now) => table.update(&now),
        LinkMessage::Ended { summary, outcome, fleet } => {
            end = Some(FleetEnd { topology, summary, outcome, fleet });
        }
        // `run_job` returns the failure; scenes and views are for watchers, the others answer other jobs.
        LinkMessage::Failed(_)
        | LinkMessage::Scene(_)
        | LinkMessage::Seen(_)
        | LinkMessage::Ros2(_)
        | LinkMessage::Dispatch(_)
        | LinkMessage::Drives(_)
        | LinkMessage::Driven(_)
        | LinkMessage::Flight(_) => {}
    });
    table.clear();
    if let Some(end) = end {
        args.print_results(end, console)?;
    }
    match result {
        Ok(()) => Ok(ExitCode::Done),
        Err(Failure::Interrupted) => {
            args.print_next_step(console);
            Ok(ExitCode::Interrupted)
        }
        Err(failure) => Err(args.with_remedy(failure)),
    }
}

/// Returns a line with the time from percepts to the last control; none before the first cycle.
fn latency_line(fleet: &FleetStatus) -> Option<(String, String)> {
    let half_ms = format_short(fleet.talk_p50_ms?);
    let most_ms = format_short(fleet.talk_p99_ms?);
    let times = format!("{half_ms} ms for half of the cycles, {most_ms} ms for 99 %");
    Some(key_value_pair("percept to control", times))
}

/// Returns a line with what a node used in the mean, per second in which the fleet ran; none where that is not known.
fn usage_line(fleet: &FleetStatus) -> Option<(String, String)> {
    let node_s = fleet.flown_s * fleet.nodes.len() as f64;
    if node_s <= 0.0 {
        return None;
    }
    let bytes: u64 = fleet.nodes.iter().map(|node| node.frame_bytes).sum();
    let processor_ms: Option<u64> = fleet.nodes.iter().map(|node| node.processor_ms).sum();
    let processor = processor_ms.map_or(String::new(), |ms| {
        let percent = 0.1 * ms as f64 / node_s;
        format!("{} % of a processor, ", format_short(percent))
    });
    let kilobytes = format_short(1e-3 * bytes as f64 / node_s);
    let server_kilobytes = format_short(1e-3 * fleet.server_frame_bytes as f64 / fleet.flown_s);
    let usage = format!("{processor}{kilobytes} kB/s; the server {server_kilobytes} kB/s");
    Some(key_value_pair("a node", usage))
}

impl FleetArgs {
    /// Checks that a multicast group is given only where nodes use one.
    ///
    /// # Errors
    /// Where they do not.
    fn check_group(&self) -> Result<(), InputError> {
        if self.multicast_group.is_some()
            && !matches!(self.topology, None | Some(TopologyArg::Multicast))
        {
            let cause = "only nodes by multicast have a group";
            let remedy = "give --topology multicast, or leave --multicast-group out";
            return Err(InputError::new("--multicast-group", cause, remedy));
        }
        Ok(())
    }

    /// Returns the topology: if none is given, the cheapest that needs nothing of a network.
    fn topology(&self) -> TopologyArg {
        let by_group = self.multicast_group.map(|_| TopologyArg::Multicast);
        self.topology.or(by_group).unwrap_or_else(|| {
            let is_local = self.nodes.is_none() && self.listen.is_empty();
            // A group can be read by everybody on this machine; links with certificates cannot.
            if is_local && !self.link.is_encrypted() && check_loopback_multicast().is_ok() {
                TopologyArg::Multicast
            } else {
                TopologyArg::Mesh
            }
        })
    }

    fn job(&self, topology: TopologyArg) -> FleetJob {
        let loopback = format!("{}/127.0.0.1:0", self.link.protocol());
        FleetJob {
            common: self
                .link
                .common_settings(self.scenario.file.clone(), self.scenario.all_overrides()),
            nodes: self.nodes,
            clock: match self.clock {
                ClockArg::Lockstep => ClockMode::Lockstep,
                ClockArg::Realtime => ClockMode::Realtime { speed: self.speed },
            },
            topology: match topology {
                TopologyArg::Mesh => Topology::Mesh,
                TopologyArg::Star => Topology::Star,
                TopologyArg::Multicast => Topology::Multicast,
            },
            multicast_group: self.multicast_group,
            listen: if self.listen.is_empty() { vec![loopback] } else { self.listen.clone() },
            out: self.out.clone(),
            replace: self.replace,
            packets: self.packets,
        }
    }

    /// Returns the job of a recorder, which starts nodes here.
    fn recorder_job(&self) -> FlightRecorderJob {
        FlightRecorderJob {
            common: self
                .link
                .common_settings(self.scenario.file.clone(), self.scenario.all_overrides()),
            nodes: self.nodes,
            clock: FlightClock {
                start_s: None,
                speed: self.speed,
                tolerance_s: self.clock_tolerance,
            },
            network: FlightNetwork {
                listen: self.listen.clone(),
                peers: Vec::new(),
                is_scouting: false,
            },
            plant: self.guard.plant(),
            guard: self.guard.settings(),
            out: self.out.clone(),
            replace: self.replace,
        }
    }

    /// Returns whether time passes by a clock.
    fn is_realtime(&self) -> bool {
        self.no_server || self.clock == ClockArg::Realtime
    }

    fn print_next_step(&self, console: Console) {
        let Some(folder) = &self.out else { return };
        let resume = sidestep_command("resume", folder);
        console.note(if self.is_realtime() {
            let report = sidestep_command("report", folder);
            format!("The flight is cut off here, and what was flown is kept; `{report}` shows it.")
        } else {
            format!("The run is incomplete; `{resume}` continues it.")
        });
    }

    /// Returns the failure of a fleet whose server has ended unasked, with what can be done with its folder.
    fn with_remedy(&self, failure: Failure) -> Failure {
        match (&self.out, failure) {
            (Some(folder), Failure::Other { cause, remedy })
                if remedy == LOST_SERVER_REMEDY && self.is_realtime() =>
            {
                let resume = sidestep_command("resume", folder);
                let kept = "what was flown is on disk up to the last second";
                Failure::other(cause, format!("{kept}: `{resume}` closes its recording"))
            }
            (Some(folder), Failure::Other { cause, remedy }) if remedy == LOST_SERVER_REMEDY => {
                let resume = sidestep_command("resume", folder);
                Failure::other(
                    cause,
                    format!("its nodes end by themselves; `{resume}` continues it"),
                )
            }
            (_, failure) => failure,
        }
    }

    fn print_results(&self, end: FleetEnd, console: Console) -> Result<(), Failure> {
        let FleetEnd { topology, summary, outcome, fleet } = end;
        let digest = summary["digest"].as_str().unwrap_or_default();
        let mut all = summary.clone();
        all["fleet"] = json!(fleet);
        console.print_result_or_short(&all, &format!("{digest}\n"), || {
            let name = summary["name"].as_str().unwrap_or_default();
            let cycles = group_thousands(summary["cycles"].as_u64().unwrap_or(0));
            let mut lines = vec![key_value_pair("cycles", cycles)];
            lines.extend(outcome);
            lines.extend(self.network_lines(topology, &fleet));
            lines.push(key_value_pair("digest", digest));
            lines
                .extend(summary["folder"].as_str().map(|folder| key_value_pair("results", folder)));
            format!("{name}, seed {}\n{}", summary["seed"], align_pairs(&lines))
        })
    }

    fn network_lines(&self, topology: Option<TopologyArg>, fleet: &FleetStatus) -> KeyValues {
        let nodes = &fleet.nodes;
        let topology = match topology {
            Some(TopologyArg::Mesh) => "in a mesh",
            Some(TopologyArg::Star) => "in a star",
            Some(TopologyArg::Multicast) => "by multicast",
            None => "without a server",
        };
        let clock = if self.is_realtime() { "real time" } else { "lockstep" };
        let restarted: u64 = nodes.iter().map(|node| node.lives.saturating_sub(1)).sum();
        let packets = nodes.iter().map(|node| node.packets).sum();
        let bytes = nodes.iter().map(|node| node.bytes).sum();
        let mut lines = vec![
            key_value_pair("nodes", format!("{} {topology}, {clock}", nodes.len())),
            key_value_pair(
                "packets",
                format!("{} sent, {} bytes", group_thousands(packets), group_thousands(bytes)),
            ),
        ];
        if self.no_server {
            lines.extend(flight_lines(fleet));
        } else if self.clock == ClockArg::Realtime {
            let late = format!(
                "{} controls, {} cycles of the server",
                group_thousands(nodes.iter().map(|node| node.late).sum()),
                group_thousands(fleet.late_cycles)
            );
            lines.push(key_value_pair("late", late));
        }
        // Without a server there are no percepts from one, and the recorder has lines of its own for the rest.
        if fleet.server_frame_bytes > 0 {
            lines.extend(latency_line(fleet));
            lines.extend(usage_line(fleet));
        }
        if restarted > 0 {
            lines.push(key_value_pair("restarted", format!("{restarted} nodes")));
        }
        lines
    }
}

/// Returns what has become of the controls and reports of a flight without a server.
fn flight_lines(fleet: &FleetStatus) -> KeyValues {
    let sum = |number: fn(&NodeStatus) -> u64| fleet.nodes.iter().map(number).sum();
    let counted = |name: &str| {
        let counts = fleet.nodes.iter().flat_map(|node| &node.counts);
        counts.filter(|(counted, _)| counted == name).map(|(_, count)| count).sum()
    };
    let controls = format!(
        "{} flown, {} late, {} not recorded",
        group_thousands(sum(|node| node.flown)),
        group_thousands(counted("late-controls") + counted("refused-controls")),
        group_thousands(sum(|node| node.late)),
    );
    let unheard = format!(
        "{} cycles of an airplane without all reports around it",
        group_thousands(counted("unheard-cycles"))
    );
    let milliseconds = |within_ms: Option<f64>| {
        within_ms.map_or("-".into(), |within_ms| group_thousands(within_ms as u64))
    };
    let decided = format!(
        "within {} ms (half), {} ms (99 %) of a cycle",
        milliseconds(fleet.talk_p50_ms),
        milliseconds(fleet.talk_p99_ms)
    );
    let differing = format!("{} reports", group_thousands(sum(|node| node.differing)));
    let held = fleet.nodes.iter().filter(|node| node.state == "held").count();
    vec![
        key_value_pair("controls", controls),
        key_value_pair("decided", decided),
        key_value_pair("unheard", unheard),
        key_value_pair("differ from the record", differing),
        key_value_pair("handed over", format!("{held} vehicles")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_session::fleet::NodeStatus;

    fn fleet_of_two(processor_ms: Option<u64>) -> FleetStatus {
        let node = NodeStatus { frame_bytes: 50_000, processor_ms, ..NodeStatus::default() };
        FleetStatus {
            flown_s: 10.0,
            server_frame_bytes: 200_000,
            nodes: vec![node.clone(), node],
            ..FleetStatus::default()
        }
    }

    #[test]
    fn what_a_node_uses_is_told_per_second_and_node() {
        let usage = usage_line(&fleet_of_two(Some(250))).expect("it ran").1;
        assert_eq!(usage, "2.50 % of a processor, 5.00 kB/s; the server 20.0 kB/s");
        let untold = usage_line(&fleet_of_two(None)).expect("it ran").1;
        assert_eq!(untold, "5.00 kB/s; the server 20.0 kB/s");
        assert_eq!(usage_line(&FleetStatus::default()), None, "nothing has run");
    }
}
