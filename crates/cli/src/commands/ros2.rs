//! `sidestep run --ros2`: a run that others see as a node of ROS 2.

use crate::console::{Console, align_pairs, group_thousands};
use crate::exit::{ExitCode, Failure};
use crate::link::run_job;
use crate::scenario_args::ScenarioArgs;
use crate::worlds;
use clap::{Args, ValueEnum};
use serde_json::Value;
use sidestep::kernel::InputError;
use sidestep::kernel::shell::sidestep_command;
use sidestep::kernel::text::{KeyValues, key_value_pair};
use sidestep_session::fleet::{
    CommonSettings, Job, JobScenario, LinkMessage, Ros2Job, RosDistribution, RosGraph,
};
use std::path::PathBuf;

/// The endpoint at which nodes of ROS 2 look for a router on their machine.
pub(super) const ROUTER_ENDPOINT: &str = "tcp/127.0.0.1:7447";

/// Time in seconds after which a silent party counts as gone: fleets have an option for it, and nodes of ROS 2 have no
/// lease.
pub(super) const LEASE_S: f64 = 10.0;

/// Largest number of a domain in ROS 2.
pub(super) const MAX_DOMAIN: i64 = 232;

/// Distributions of ROS 2, by their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum DistributionArg {
    /// Types without hashes
    Humble,
    /// Types with hashes, as in Kilted and all others since Iron
    Jazzy,
}

impl DistributionArg {
    pub(super) fn distribution(self) -> RosDistribution {
        match self {
            Self::Humble => RosDistribution::Humble,
            Self::Jazzy => RosDistribution::Jazzy,
        }
    }
}

/// Options of a run as a node of ROS 2.
#[derive(Debug, Args)]
#[command(next_help_heading = "ROS 2")]
pub(crate) struct Ros2Args {
    /// Show the run to ROS 2 while it passes in real time: clock, map, and per robot odometry, frames and scans; with
    /// services that pause, step and reset it. It needs no ROS; the others need rmw_zenoh
    #[arg(long, conflicts_with_all = ["mcap", "foxglove"])]
    ros2: bool,

    /// Domain, as in ROS_DOMAIN_ID
    #[arg(long, value_name = "N", default_value_t = 0, requires = "ros2",
        value_parser = clap::value_parser!(u32).range(0..=MAX_DOMAIN))]
    domain: u32,

    /// Namespace of the node and of its topics, except those of clock and frames
    #[arg(long, value_name = "NS", default_value = "/", requires = "ros2", value_parser = parse_namespace)]
    namespace: String,

    /// Distribution of ROS 2 of the others
    #[arg(long, value_enum, default_value_t = DistributionArg::Jazzy, requires = "ros2")]
    distro: DistributionArg,

    /// Speed: seconds of the scenario per second of real time
    #[arg(long, value_name = "X", default_value_t = 1.0, requires = "ros2",
        value_parser = super::fleet::parse_speed)]
    speed: f64,

    /// Start paused: the services resume and step let time pass
    #[arg(long, requires = "ros2")]
    paused: bool,

    /// Endpoint on which the node listens as the router of ROS 2; repeatable
    /// [default: tcp/127.0.0.1:7447, unless --connect is given]
    #[arg(long, value_name = "ENDPOINT", requires = "ros2")]
    listen: Vec<String>,

    /// Endpoint of a router of ROS 2 that runs already, e.g. tcp/127.0.0.1:7447; repeatable
    #[arg(long, value_name = "ENDPOINT", requires = "ros2")]
    connect: Vec<String>,

    /// Allow endpoints that other machines reach: whoever reaches them sees the run, and can pause and reset it
    #[arg(long, requires = "ros2")]
    insecure: bool,
}

/// Parses a namespace; the slash at its beginning may be left out.
pub(super) fn parse_namespace(text: &str) -> Result<String, String> {
    let namespace = if text.starts_with('/') { text.to_string() } else { format!("/{text}") };
    let is_name = |name: &str| {
        let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_';
        !name.starts_with(|c: char| c.is_ascii_digit())
            && !name.is_empty()
            && name.chars().all(is_allowed)
    };
    if namespace == "/" || namespace[1..].split('/').all(is_name) {
        return Ok(namespace);
    }
    Err("give names of letters, digits and _ that begin with no digit, as in /hall or /hall/north"
        .into())
}

/// What else the command says about the run.
pub(crate) struct RunToShow<'a> {
    pub(crate) scenario: &'a ScenarioArgs,
    pub(crate) workers: usize,
    pub(crate) out: Option<PathBuf>,
    pub(crate) replace: bool,
}

impl Ros2Args {
    /// Returns whether the run is to be shown to ROS 2.
    pub(crate) fn is_requested(&self) -> bool {
        self.ros2
    }

    fn job(&self, run: &RunToShow<'_>) -> Ros2Job {
        let flown = JobScenario {
            file: run.scenario.file.clone(),
            overrides: run.scenario.all_overrides(),
            build: worlds().build().into(),
        };
        let default_endpoint = vec![ROUTER_ENDPOINT.to_string()];
        let is_default = self.listen.is_empty() && self.connect.is_empty();
        Ros2Job {
            common: CommonSettings {
                flown,
                tls: None,
                is_insecure: self.insecure,
                lease_s: LEASE_S,
                metrics: None,
                json_log: false,
                log: "warn".into(),
            },
            domain: self.domain,
            namespace: self.namespace.clone(),
            distribution: self.distro.distribution(),
            listen: if is_default { default_endpoint } else { self.listen.clone() },
            connect: self.connect.clone(),
            speed: self.speed,
            starts_paused: self.paused,
            workers: run.workers,
            out: run.out.clone(),
            replace: run.replace,
        }
    }
}

/// Runs a scenario as a node of ROS 2.
///
/// # Errors
/// When anything is wrong with its input, or the node fails.
pub(crate) fn run_as_node(
    args: &Ros2Args,
    run: &RunToShow<'_>,
    console: Console,
) -> Result<ExitCode, Failure> {
    let mut end = None;
    let result = run_job(&Job::Ros2(args.job(run)), |message| match message {
        LinkMessage::Listens(endpoints) if endpoints.is_empty() => {
            console.note(format!("Connected to {}", args.connect.join(", ")));
        }
        LinkMessage::Listens(endpoints) => {
            console.note(format!("Listening on {}", endpoints.join(", ")));
        }
        LinkMessage::Ros2(graph) => print_graph(args, &graph, console),
        LinkMessage::Ended { summary, outcome, .. } => end = Some((summary, outcome)),
        // `run_job` returns the failure; the others are of fleets and drives.
        LinkMessage::Failed(_)
        | LinkMessage::Drives(_)
        | LinkMessage::Driven(_)
        | LinkMessage::Flight(_)
        | LinkMessage::Fleet(_)
        | LinkMessage::Scene(_)
        | LinkMessage::Seen(_)
        | LinkMessage::Dispatch(_) => {}
    });
    if let Some((summary, outcome)) = end {
        print_results(&summary, outcome, console)?;
    }
    match result {
        Ok(()) => Ok(ExitCode::Done),
        Err(Failure::Interrupted) => {
            if let Some(folder) = &run.out {
                let resume = sidestep_command("resume", folder);
                console.note(format!("The run is marked as incomplete; `{resume}` continues it."));
            }
            Ok(ExitCode::Interrupted)
        }
        Err(failure) => Err(failure),
    }
}

/// Largest number of topics that are printed one by one.
const MAX_TOPIC_LINES: usize = 12;

fn print_graph(args: &Ros2Args, graph: &RosGraph, console: Console) {
    let mut lines = vec![format!("Node {} in domain {}", graph.node, args.domain)];
    let topics = graph.topics.iter().map(|(name, kind)| format!("  {name}  {kind}"));
    lines.extend(topics.take(MAX_TOPIC_LINES));
    if graph.topics.len() > MAX_TOPIC_LINES {
        let more = graph.topics.len() - MAX_TOPIC_LINES;
        lines.push(format!("  and {} more topics", group_thousands(more as u64)));
    }
    lines.extend(graph.services.iter().map(|(name, kind)| format!("  {name}  {kind}")));
    if args.paused {
        lines.push(format!("Paused: call {}/resume or {}/step", graph.node, graph.node));
    }
    console.note(lines.join("\n"));
}

fn print_results(summary: &Value, outcome: KeyValues, console: Console) -> Result<(), Failure> {
    let digest = summary["digest"].as_str().unwrap_or_default();
    console.print_result_or_short(summary, &format!("{digest}\n"), || {
        let given = summary["name"].as_str().filter(|name| !name.is_empty());
        let name = given.or(summary["world"].as_str()).unwrap_or_default();
        let cycles = group_thousands(summary["cycles"].as_u64().unwrap_or(0));
        let mut lines = vec![key_value_pair("cycles", cycles)];
        lines.extend(outcome);
        lines.push(key_value_pair("digest", digest));
        lines.extend(summary["folder"].as_str().map(|folder| key_value_pair("results", folder)));
        format!("{name}, seed {}\n{}", summary["seed"], align_pairs(&lines))
    })
}

/// Refuses `--ros2` for many runs.
///
/// # Errors
/// When it is given.
pub(crate) fn check_no_sweep(args: &Ros2Args) -> Result<(), InputError> {
    if args.ros2 {
        let remedy = "leave it out, or run one of them alone";
        return Err(InputError::new("--ros2", "a sweep has no single run to show", remedy));
    }
    Ok(())
}
