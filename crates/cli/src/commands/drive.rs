//! `sidestep drive`: a real robot of ROS 2, driven by the program of a robot of a scenario.

use super::ros2::{DistributionArg, LEASE_S, MAX_DOMAIN, ROUTER_ENDPOINT, parse_namespace};
use crate::console::{Console, align_pairs};
use crate::exit::{ExitCode, Failure};
use crate::link::run_job;
use crate::scenario_args::ScenarioArgs;
use crate::worlds;
use clap::{ArgGroup, Args};
use serde_json::json;
use sidestep::kernel::EntityId;
use sidestep::kernel::text::key_value_pair;
use sidestep_session::fleet::{
    BeaconCounts, CommonSettings, DriveJob, DriveSettings, DriveStatus, DriveTopics, Job,
    JobScenario, LinkMessage, PlanStatus, RosGraph, RosNetwork,
};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep drive hall.toml --robot 2 --namespace robot_2 --trips 1
                                   by the router of this machine
  sidestep drive hall.toml --robot 2 --connect tcp/10.0.0.1:7447 --insecure \\
      --base robot_2/base_link --out motions.csv
                                   its pose is that frame's in /tf; then
                                   sidestep learn effector --csv motions.csv
  sidestep drive hall.toml --robot 2 --bag drives/2 \\
      --set 'robots.2.behaviour={kind=\"external\"}'
                                   it goes where goal_pose says, and its
                                   messages are kept as a bag
  sidestep drive hall.toml --robot 2 --namespace hall/r2 --peers 'hall/r{}'
                                   it hears what the programs of the other
                                   robots tell, and keeps to a common plan

The program sidestep-link does it: `cargo install --path crates/link`. The robot needs no Sidestep: \
it is a node of rmw_zenoh with odometry or frames, a laser, and a topic for velocities. It stands \
when its messages stop, off the map, and after Ctrl-C. Read the page \"Drive a robot\" of the book \
first: it says what is promised and what is not. Have an emergency stop at hand.";

/// Drive a real robot of ROS 2 by the program of a robot of a scenario.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group = ArgGroup::new("written").args(["out", "bag"]).multiple(true))]
pub(crate) struct DriveArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Id of the robot of the scenario, from 0
    #[arg(long, value_name = "ID")]
    robot: EntityId,

    /// End after so many trips [default: after the cycles of the scenario, one for each action]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    trips: Option<u64>,

    /// File for the table of its motions, for `sidestep learn effector --csv`
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// New folder for a ROS 2 bag of what it measures and is told
    #[arg(long, value_name = "DIR")]
    bag: Option<PathBuf>,

    /// Overwrite an earlier table and an earlier bag
    #[arg(long, requires = "written")]
    replace: bool,

    #[command(flatten)]
    network: NetworkArgs,

    #[command(flatten)]
    topics: TopicArgs,

    #[command(flatten)]
    limits: LimitArgs,
}

/// The network of the robot.
#[derive(Debug, Args)]
#[command(next_help_heading = "ROS 2")]
struct NetworkArgs {
    /// Endpoint of the router of ROS 2; repeatable
    /// [default: tcp/127.0.0.1:7447, unless --listen is given]
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,

    /// Endpoint on which this node listens as the router of ROS 2; repeatable
    #[arg(long, value_name = "ENDPOINT", conflicts_with = "connect")]
    listen: Vec<String>,

    /// Domain, as in ROS_DOMAIN_ID
    #[arg(long, value_name = "N", default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(0..=MAX_DOMAIN))]
    domain: u32,

    /// Namespace of the topics of the robot, except those of frames
    #[arg(long, value_name = "NS", default_value = "/", value_parser = parse_namespace)]
    namespace: String,

    /// Distribution of ROS 2 of the robot
    #[arg(long, value_enum, default_value_t = DistributionArg::Jazzy)]
    distro: DistributionArg,

    /// Allow endpoints of other machines: whoever reaches them can move the robot
    #[arg(long)]
    insecure: bool,
}

/// The topics and frames of the robot.
#[derive(Debug, Args)]
#[command(next_help_heading = "Topics and frames")]
struct TopicArgs {
    /// Odometry (nav_msgs/Odometry); a name with a slash before it is in no namespace
    #[arg(long, value_name = "TOPIC", default_value = "odom")]
    odom: String,

    /// Laser (sensor_msgs/LaserScan)
    #[arg(long, value_name = "TOPIC", default_value = "scan")]
    scan: String,

    /// Bumper (std_msgs/Bool); a robot without one is stopped by what it sees, or by standing
    #[arg(long, value_name = "TOPIC", default_value = "bumper")]
    bumper: String,

    /// Velocities for the robot (geometry_msgs/Twist)
    #[arg(long, value_name = "TOPIC", default_value = "cmd_vel")]
    cmd_vel: String,

    /// Goals (geometry_msgs/PoseStamped), for a robot whose behavior is external
    #[arg(long, value_name = "TOPIC", default_value = "goal_pose")]
    goal: String,

    /// What robots tell each other (sidestep_msgs/RobotBeacon)
    #[arg(long, value_name = "TOPIC", default_value = "beacon")]
    beacon: String,

    /// Namespaces of all robots with {} for the id, to hear their beacons
    /// [default: that of this one, if its id is at the end]
    #[arg(long, value_name = "NS", value_parser = parse_peers)]
    peers: Option<String>,

    /// Send velocities with a time (geometry_msgs/TwistStamped)
    #[arg(long)]
    stamped: bool,

    /// Frame of the map
    #[arg(long, value_name = "FRAME", default_value = "map")]
    map_frame: String,

    /// Take the pose of this frame in /tf, e.g. base_link, in place of that of odometry
    #[arg(long, value_name = "FRAME")]
    base: Option<String>,
}

/// The limits of the robot.
#[derive(Debug, Args)]
#[command(next_help_heading = "Limits")]
struct LimitArgs {
    /// Largest speed in m/s
    #[arg(long, value_name = "M/S", default_value_t = 0.3, value_parser = parse_limit)]
    max_speed: f64,

    /// Largest rate of turning in rad/s
    #[arg(long, value_name = "RAD/S", default_value_t = 1.0, value_parser = parse_limit)]
    max_turn: f64,

    /// Largest acceleration in m/s2; the robot must brake as hard at least
    #[arg(long, value_name = "M/S2", default_value_t = 0.5, value_parser = parse_limit)]
    acceleration: f64,

    /// Radius of the robot in m [default: 0.4 of its side in the scenario]
    #[arg(long, value_name = "M", value_parser = parse_limit)]
    radius: Option<f64>,

    /// Distance in m that it keeps from what its laser sees before it
    #[arg(long, value_name = "M", default_value_t = 0.02, value_parser = parse_clearance)]
    clearance: f64,

    /// Seconds without a new pose and scan after which it stands
    #[arg(long, value_name = "S", default_value_t = 0.5, value_parser = parse_limit)]
    patience: f64,

    /// Seconds without a beacon of another robot after which it is silent
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = parse_limit)]
    beacon_patience: f64,

    /// Seconds of an action that waits
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = parse_limit)]
    cycle: f64,

    /// Seconds after which an action ends where it is
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = parse_limit)]
    timeout: f64,
}

fn parse_limit(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.01..=1000.0).contains(x));
    number.ok_or_else(|| "give a number from 0.01 to 1000".into())
}

fn parse_peers(text: &str) -> Result<String, String> {
    if text.matches("{}").count() != 1 {
        return Err("give a namespace with one {} in place of the id, as in robot_{}".into());
    }
    // An id stands for all: a namespace is one for each id or for none.
    parse_namespace(&text.replace("{}", "0"))?;
    Ok(if text.starts_with('/') { text.into() } else { format!("/{text}") })
}

fn parse_clearance(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.0..=10.0).contains(x));
    number.ok_or_else(|| "give a number from 0 to 10".into())
}

impl DriveArgs {
    fn job(&self) -> DriveJob {
        let flown = JobScenario {
            file: self.scenario.file.clone(),
            overrides: self.scenario.all_overrides(),
            build: worlds().build().into(),
        };
        DriveJob {
            common: CommonSettings {
                flown,
                tls: None,
                is_insecure: self.network.insecure,
                lease_s: LEASE_S,
                metrics: None,
                json_log: false,
                log: "warn".into(),
            },
            robot: self.robot,
            network: self.network.network(),
            topics: self.topics.topics(),
            settings: self.limits.settings(),
            trips: self.trips,
            out: self.out.clone(),
            bag: self.bag.clone(),
            replace: self.replace,
        }
    }
}

impl NetworkArgs {
    fn network(&self) -> RosNetwork {
        let is_default = self.connect.is_empty() && self.listen.is_empty();
        let default_endpoint = vec![ROUTER_ENDPOINT.to_string()];
        RosNetwork {
            domain: self.domain,
            namespace: self.namespace.clone(),
            distribution: self.distro.distribution(),
            listen: self.listen.clone(),
            connect: if is_default { default_endpoint } else { self.connect.clone() },
        }
    }
}

impl TopicArgs {
    fn topics(&self) -> DriveTopics {
        DriveTopics {
            odom: self.odom.clone(),
            scan: self.scan.clone(),
            bumper: self.bumper.clone(),
            cmd_vel: self.cmd_vel.clone(),
            goal: self.goal.clone(),
            beacon: self.beacon.clone(),
            peers: self.peers.clone(),
            is_stamped: self.stamped,
            map_frame: self.map_frame.clone(),
            base_frame: self.base.clone(),
        }
    }
}

impl LimitArgs {
    fn settings(&self) -> DriveSettings {
        DriveSettings {
            speed_mps: self.max_speed,
            turn_radps: self.max_turn,
            acceleration_mps2: self.acceleration,
            radius_m: self.radius,
            clearance_m: self.clearance,
            cycle_s: self.cycle,
            patience_s: self.patience,
            beacon_patience_s: self.beacon_patience,
            timeout_s: self.timeout,
        }
    }
}

/// # Errors
/// When anything is wrong with its input, the router is not there, or the robot is lost.
pub(crate) fn drive(args: &DriveArgs, console: Console) -> Result<ExitCode, Failure> {
    let mut end = None;
    let mut guarded_by = None;
    let mut goal = None;
    let mut hold = None;
    let mut silent = Vec::new();
    let result = run_job(&Job::Drive(Box::new(args.job())), |message| match message {
        LinkMessage::Ros2(graph) => print_graph(args, &graph, console),
        LinkMessage::Drives(status) => {
            if status.guarded_by != guarded_by {
                let text = status.guarded_by.as_deref().unwrap_or("drives");
                console.note(format!("Robot {} {text}", args.robot));
                guarded_by = status.guarded_by;
            }
            if let Some((column, row)) = status.goal.filter(|at| goal != Some(*at)) {
                console.note(format!("Robot {} goes to column {column}, row {row}", args.robot));
            }
            goal = status.goal;
            let now_holds = status.plan.and_then(|plan| plan.hold);
            if now_holds != hold {
                let text = now_holds.as_deref().unwrap_or("goes on by its plan");
                console.note(format!("Robot {} {text}", args.robot));
                hold = now_holds;
            }
            if status.silent != silent {
                console.note(silence_note(args.robot, &status.silent));
                silent = status.silent;
            }
        }
        LinkMessage::Driven(status) => end = Some(status),
        // `run_job` returns the failure; the others are of runs and fleets.
        _ => {}
    });
    if let Some(status) = &end {
        print_end(args, status, console)?;
    }
    match result {
        Ok(()) => Ok(ExitCode::Done),
        Err(Failure::Interrupted) => Ok(ExitCode::Interrupted),
        Err(failure) => Err(failure),
    }
}

fn print_graph(args: &DriveArgs, graph: &RosGraph, console: Console) {
    let mut lines = vec![format!("Node {} in domain {}", graph.node, args.network.domain)];
    lines.extend(graph.topics.iter().map(|(name, kind)| format!("  {name}  {kind}")));
    console.note(lines.join("\n"));
}

fn silence_note(robot: EntityId, silent: &[EntityId]) -> String {
    if silent.is_empty() {
        return format!("Robot {robot} hears all again");
    }
    let ids: Vec<String> = silent.iter().map(ToString::to_string).collect();
    format!("Robot {robot} does not hear anymore: {}", ids.join(", "))
}

fn print_end(args: &DriveArgs, status: &DriveStatus, console: Console) -> Result<(), Failure> {
    let result = json!({
        "robot": args.robot,
        "actions": status.actions,
        "contacts": status.contacts,
        "timeouts": status.timeouts,
        "trips": status.trips,
        "goals": status.goals,
        "refused_goals": status.refused_goals,
        "stops_for_old_states": status.old_states,
        "stops_off_map": status.off_map,
        "brakes_before_obstacles": status.obstacles,
        "unreadable_messages": status.unreadable,
        "outdated_messages": status.outdated,
        "beacons": {
            "sent": status.beacons.sent,
            "heard": status.beacons.heard,
            "unreadable": status.beacons.unreadable,
            "foreign": status.beacons.foreign,
            "outdated": status.beacons.outdated,
        },
        "plan": status.plan.as_ref().map(|plan| json!({
            "actions": plan.actions,
            "done": plan.done,
            "waits": plan.waits,
        })),
    });
    console.print_result_or_short(&result, &format!("{}\n", status.actions), || {
        let stops = format!(
            "{} for old measurements, {} off the map, {} before obstacles",
            status.old_states, status.off_map, status.obstacles
        );
        let dropped = format!("{} unreadable, {} outdated", status.unreadable, status.outdated);
        let mut lines = vec![
            key_value_pair("actions", status.actions.to_string()),
            key_value_pair("contacts", status.contacts.to_string()),
            key_value_pair("trips", status.trips.to_string()),
            key_value_pair("goals", format!("{}, {} refused", status.goals, status.refused_goals)),
            key_value_pair("timeouts", status.timeouts.to_string()),
            key_value_pair("guard", stops),
            key_value_pair("dropped", dropped),
            key_value_pair("beacons", beacons_text(&status.beacons)),
        ];
        lines.extend(status.plan.as_ref().map(|plan| key_value_pair("plan", plan_text(plan))));
        let path = |name, path: &PathBuf| key_value_pair(name, path.display().to_string());
        lines.extend(args.out.iter().map(|file| path("motions", file)));
        lines.extend(args.bag.iter().map(|folder| path("bag", folder)));
        format!("Robot {}\n{}", args.robot, align_pairs(&lines))
    })
}

fn beacons_text(counts: &BeaconCounts) -> String {
    format!(
        "{} sent, {} heard; dropped: {} unreadable, {} foreign, {} outdated",
        counts.sent, counts.heard, counts.unreadable, counts.foreign, counts.outdated
    )
}

fn plan_text(plan: &PlanStatus) -> String {
    let done = plan.done.map_or("an unknown number".into(), |done| done.to_string());
    format!("{done} of {} actions, {} waits for others", plan.actions, plan.waits)
}
