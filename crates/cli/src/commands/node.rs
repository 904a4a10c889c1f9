//! `sidestep node`: one agent of a fleet, as a process of its own.

use super::flight::{FlightArgs, GuardArgs};
use super::mavlink::MavlinkArgs;
use crate::console::{Console, align_pairs};
use crate::exit::{ExitCode, Failure};
use crate::link::{LinkArgs, run_job};
use crate::scenario_args::ScenarioArgs;
use clap::{ArgGroup, Args};
use serde_json::json;
use sidestep::kernel::EntityId;
use sidestep::kernel::text::key_value_pair;
use sidestep_session::fleet::{
    AgentName, FlightClock, FlightJob, FlightStatus, Job, LinkMessage, NodeJob, VehicleJob,
};

const EXAMPLES: &str = "\
Examples:
  sidestep node ring.toml --airplane 3 --connect tcp/10.0.0.1:7600 \\
      --listen tcp/10.0.0.4:0 --insecure
                                   no --listen for --topology star or multicast
  sidestep node chain.toml --connector 0.3 --connect tcp/10.0.0.1:7600 \\
      --listen tcp/10.0.0.4:0 --insecure
                                   connector 3 of chain 0
  sidestep node office.toml --robot 2 --connect tcp/10.0.0.1:7600 --insecure
  sidestep node office.toml --robot 2 --connect tcp/127.0.0.1:7600 \\
      --vehicle tcp/127.0.0.1:7700
                                   your own program decides: see examples/vehicle.py
  sidestep node ring.toml --airplane 1 --start 2026-12-01T04:45:00Z --insecure \\
      --listen tcp/10.0.0.2:7601 --peers tcp/10.0.0.1:7601
                                   without a server
  sidestep node ring.toml --airplane 0 --start 60 --origin 47.398,8.546,550 \\
      --mavlink udp:127.0.0.1:14550 --take-control
                                   a real aircraft: see docs/src/mavlink.md

Give it the scenario, --set, --seed and --cycles of the fleet, and on a network that you do not trust certificates in place of --insecure. It runs its agent until the fleet \
ends. When it has not heard the server for the time of --lease, it ends in lockstep; in real time \
it waits for another minute, and takes its place again when the server is back.";

const USAGE: &str = "\
sidestep node <SCENARIO> --airplane <ID> --connect <ENDPOINT> [OPTIONS]
       sidestep node <SCENARIO> --connector <CHAIN.K> --connect <ENDPOINT>
       sidestep node <SCENARIO> --robot <ID> --connect <ENDPOINT>
       sidestep node <SCENARIO> --airplane <ID> --start <TIME> [OPTIONS]";

/// The nouns of agents, which are the options that select them.
const AIRPLANE: &str = "airplane";
const CONNECTOR: &str = "connector";
const ROBOT: &str = "robot";

/// Run one airplane, connector or robot of a fleet on this machine, or one airplane without a server.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, override_usage = USAGE)]
#[command(group = ArgGroup::new("agent").required(true))]
pub(crate) struct NodeArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Id of the airplane, from 0
    #[arg(long, value_name = "ID", group = "agent")]
    airplane: Option<EntityId>,

    /// Chain and number of the connector in it, both from 0, e.g. 0.3
    #[arg(long, value_name = "CHAIN.K", group = "agent", value_parser = connector)]
    connector: Option<AgentName>,

    /// Id of the robot, from 0
    #[arg(long, value_name = "ID", group = "agent")]
    robot: Option<EntityId>,

    /// Endpoint of the server, e.g. tcp/10.0.0.1:7600; repeatable, if it may be at several
    #[arg(
        long,
        value_name = "ENDPOINT",
        required_unless_present = "start",
        conflicts_with = "start"
    )]
    connect: Vec<String>,

    /// Endpoint at which the other nodes reach this one, in a mesh or without a server; port 0 for any
    /// free one
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,

    /// Let a vehicle decide: a program of yours that reaches this node at this endpoint, e.g.
    /// tcp/127.0.0.1:7700; port 0 for any free one
    #[arg(long, value_name = "ENDPOINT", conflicts_with = "start")]
    vehicle: Option<String>,

    /// Seconds to wait for the server, or for the heartbeat of an aircraft
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    patience: f64,

    #[command(flatten)]
    flight: FlightArgs,

    #[command(flatten)]
    guard: GuardArgs,

    #[command(flatten)]
    mavlink: MavlinkArgs,

    #[command(flatten)]
    link: LinkArgs,
}

/// Parses `CHAIN.CONNECTOR`, both from 0.
fn connector(text: &str) -> Result<AgentName, String> {
    let numbers = text.split_once('.').map(|(chain, connector)| (chain.parse(), connector.parse()));
    match numbers {
        Some((Ok(chain), Ok(connector))) => Ok(AgentName::new(CONNECTOR, chain, Some(connector))),
        _ => Err("give the numbers of chain and connector, e.g. 0.3".into()),
    }
}

impl NodeArgs {
    fn agent(&self) -> AgentName {
        let airplane = self.airplane.map(|id| AgentName::new(AIRPLANE, id, None));
        let robot = self.robot.map(|id| AgentName::new(ROBOT, id, None));
        let given = airplane.or(robot).or_else(|| self.connector.clone());
        given.expect("the command line has one of them")
    }

    fn patience_s(&self) -> f64 {
        self.patience.clamp(0.1, 86_400.0)
    }
}

/// # Errors
/// When anything is wrong with its input, or the server is not there.
pub(crate) fn node(args: &NodeArgs, console: Console) -> Result<ExitCode, Failure> {
    match args.flight.clock() {
        Some(clock) => fly(args, clock, console),
        None => join(args, console),
    }
}

/// Flies an airplane without a server.
///
/// # Errors
/// When anything is wrong with its input, or the flight does not begin.
fn fly(args: &NodeArgs, clock: FlightClock, console: Console) -> Result<ExitCode, Failure> {
    let common =
        args.link.common_settings(args.scenario.file.clone(), args.scenario.all_overrides());
    let agent = args.agent();
    let job = Job::Flight(Box::new(FlightJob {
        common,
        agent: agent.clone(),
        clock,
        network: args.flight.network(&args.listen),
        plant: args.mavlink.plant(args.patience_s()).unwrap_or_else(|| args.guard.plant()),
        guard: args.guard.settings(),
        journal: args.flight.journal(),
    }));
    let mut end = FlightStatus::default();
    let mut state = String::new();
    let flown = run_job(&job, |message| match message {
        LinkMessage::Listens(endpoints) if !endpoints.is_empty() => {
            console.note(format!("The other nodes reach this one at {}", endpoints.join(", ")));
        }
        LinkMessage::Flight(status) => {
            for event in &status.events {
                console.note(format!("cycle {}: {event}", status.cycle));
            }
            // Within a cycle it changes several times.
            let is_news = ["waits", "returns", "held", "arrived", "done"].contains(&&*status.state);
            if is_news && status.state != state {
                console.note(format!("cycle {}: {}", status.cycle, status.state));
                state.clone_from(&status.state);
            }
            end = status;
        }
        // They answer other jobs.
        _ => {}
    });
    let result = json!({ "airplane": agent.number, "flight": end });
    let was_flown = flown.is_ok();
    // One that was refused has no state.
    if !end.state.is_empty() {
        console.print_result_or_short(&result, "", || flight_text(&agent, &end, was_flown))?;
    }
    flown.map(|()| ExitCode::Done)
}

/// Returns the end of a flight as text.
fn flight_text(agent: &AgentName, end: &FlightStatus, was_flown: bool) -> String {
    let has_ended = if was_flown { "has ended" } else { "was ended before its time" };
    let mut lines = vec![
        key_value_pair("cycle", end.cycle.to_string()),
        key_value_pair("farthest off", format!("{:.2} m", end.max_deviation_m)),
    ];
    lines.extend(end.counts.iter().map(|(name, count)| key_value_pair(name, count.to_string())));
    format!("The flight of airplane {agent} {has_ended}.\n{}", align_pairs(&lines))
}

/// Runs an agent of a fleet.
///
/// # Errors
/// When anything is wrong with its input, or the server is not there.
fn join(args: &NodeArgs, console: Console) -> Result<ExitCode, Failure> {
    let job = NodeJob {
        common: args
            .link
            .common_settings(args.scenario.file.clone(), args.scenario.all_overrides()),
        agent: args.agent(),
        connect: args.connect.clone(),
        listen: args.listen.clone(),
        patience_s: args.patience_s(),
    };
    let job = match args.vehicle.clone() {
        None => Job::Node(job),
        Some(endpoint) => Job::Vehicle(VehicleJob { node: job, endpoint }),
    };
    run_job(&job, |message| {
        // Only a node with a vehicle listens for one.
        if let LinkMessage::Listens(endpoints) = message {
            console.note(format!("The vehicle connects to {}", endpoints.join(", ")));
        }
    })?;
    let agent = args.agent();
    let result = match agent.part {
        None => json!({ agent.noun.as_ref(): agent.number }),
        Some(connector) => json!({ "chain": agent.number, "connector": connector }),
    };
    console.print_result_or_short(&result, "", || {
        format!("The fleet has ended; {} {agent} needs no node anymore.\n", agent.noun)
    })?;
    Ok(ExitCode::Done)
}
