//! The language in which a command asks the program `sidestep-link` to fly a fleet or to show a run to ROS 2, and in which
//! that answers.
//!
//! One line of JSON goes in, a [`Job`]; lines of JSON come out, [`LinkMessage`]. The program ends in good order when its
//! standard input ends: the process that started it is gone, or wants it to end. So no process is left over, however
//! its parent has ended.

use crate::error::STORAGE_REMEDY;
use serde::{Deserialize, Serialize};
use sidestep_kernel::text::KeyValues;
use sidestep_kernel::view::{Frame, Scenery};
use sidestep_kernel::{Cycle, EntityId, InputError};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

/// The program beside `sidestep` that alone contains the network stack.
pub const LINK_PROGRAM: &str = "sidestep-link";

/// The environment variable, with its value, by which the allocator of glibc keeps one heap for all threads of the program
/// and of the nodes that it starts. By default it has a heap for each of a dozen threads, and what one of them has ever
/// needed for a silent link stays in its heap: a server whose nodes come and go grew by megabytes in an hour.
const ONE_HEAP: (&str, &str) = ("MALLOC_ARENA_MAX", "1");

/// Returns the command of the program at a path, or of one that starts it. A number of heaps that the user has set stays.
pub fn link_command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    let (variable, one_heap) = ONE_HEAP;
    if std::env::var_os(variable).is_none() {
        command.env(variable, one_heap);
    }
    command
}

/// A job for the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Job {
    /// Serve a world to nodes, some of which it starts itself.
    Fleet(FleetJob),
    /// Run one agent of a fleet, whose server another process is.
    Node(NodeJob),
    /// Run one agent of a fleet for which a vehicle decides.
    Vehicle(VehicleJob),
    /// Watch a fleet that flies already.
    Watch(WatchJob),
    /// Run a scenario as a node of ROS 2.
    Ros2(Ros2Job),
    /// Let vehicles of a warehouse carry out the plan of a scenario.
    Dispatch(DispatchJob),
    /// Drive a real robot by ROS 2.
    Drive(Box<DriveJob>),
    /// Fly one airplane without a server.
    Flight(Box<FlightJob>),
    /// Record a flight without a server, of which some nodes are started here.
    FlightRecorder(Box<FlightRecorderJob>),
}

/// The name of an agent, in the form used by people: `airplane 3`, or `connector 0.3` for part 3 of body 0.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AgentName {
    /// What people call such an agent, e.g. `airplane`.
    pub noun: Cow<'static, str>,
    /// The number of its visible body.
    pub number: EntityId,
    /// The part of that body that the agent is, if it is a part.
    pub part: Option<u32>,
}

impl AgentName {
    /// Returns the name of a body's agent, or with `part` of the agent that is this part of it.
    pub fn new(noun: impl Into<Cow<'static, str>>, number: EntityId, part: Option<u32>) -> Self {
        Self { noun: noun.into(), number, part }
    }

    /// Returns the option of the command that selects it.
    pub fn option(&self) -> String {
        format!("--{} {self}", self.noun)
    }
}

impl fmt::Display for AgentName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.part {
            None => write!(f, "{}", self.number),
            Some(part) => write!(f, "{}.{part}", self.number),
        }
    }
}

/// A scenario, and the build that is to fly it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobScenario {
    /// Path of the scenario; relative paths in it start at its folder.
    pub file: PathBuf,
    /// Changes of it, as `key=value`.
    pub overrides: Vec<String>,
    /// The build that asks: another one gives other results.
    pub build: String,
}

/// Settings that a server and its nodes share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommonSettings {
    /// The scenario, from which each party makes its own copy of the world.
    pub flown: JobScenario,
    /// Certificates, where links are encrypted and both ends prove their identity.
    pub tls: Option<Tls>,
    /// Whether links without certificates may leave this machine.
    pub is_insecure: bool,
    /// Time in seconds after which a party that is not heard counts as gone.
    pub lease_s: f64,
    /// The address at which it serves its metrics, as `HOST:PORT`.
    pub metrics: Option<String>,
    /// Whether each line of the log is a JSON object, for programs that collect logs.
    pub json_log: bool,
    /// The least severe log lines that are written, e.g. `info`.
    pub log: String,
}

/// Job of the server: it advances the world, and collects the controls of all nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetJob {
    /// Settings that nodes have, too.
    pub common: CommonSettings,
    /// Number of nodes that are started here, of the agents with the lowest ids; all of them unless given.
    pub nodes: Option<usize>,
    /// Whether cycles wait for nodes or come at their time.
    pub clock: ClockMode,
    /// The way from node to node.
    pub topology: Topology,
    /// The multicast group of the nodes, where they have one; one that no other fleet of this machine uses unless given.
    pub multicast_group: Option<SocketAddrV4>,
    /// Endpoints at which the server listens, e.g. `tcp/127.0.0.1:0`.
    pub listen: Vec<String>,
    /// Folder in which the run is recorded.
    pub out: Option<PathBuf>,
    /// Whether an earlier run there is replaced.
    pub replace: bool,
    /// Whether the folder gets a table of all packets.
    pub packets: bool,
}

/// Job of one node: it decides for one agent, and sees nothing of the world but that agent's percepts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NodeJob {
    /// Settings that the server has, too.
    pub common: CommonSettings,
    /// The agent for which it decides; the server knows the node by it.
    pub agent: AgentName,
    /// Endpoints, at one of which the server listens.
    pub connect: Vec<String>,
    /// Endpoints at which other nodes reach it, in a mesh.
    pub listen: Vec<String>,
    /// Time in seconds that it waits for the server.
    pub patience_s: f64,
}

/// Job of a node that hands its agent's percepts to a vehicle, a program of a user, and takes controls from there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VehicleJob {
    /// The node.
    pub node: NodeJob,
    /// The endpoint at which the vehicle reaches it, e.g. `tcp/127.0.0.1:7700`; port 0 for any free one.
    pub endpoint: String,
}

/// Job of the node of one airplane in a flight without a server.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightJob {
    /// Settings that all nodes and the recorder have.
    pub common: CommonSettings,
    /// The airplane.
    pub agent: AgentName,
    /// The time of the flight.
    pub clock: FlightClock,
    /// The network of the nodes.
    pub network: FlightNetwork,
    /// The aircraft that it leads.
    pub plant: PlantChoice,
    /// The limits of its guard.
    pub guard: GuardSettings,
    /// The file in which it keeps what it has reported last, for a node that is started in its place.
    #[serde(default)]
    pub journal: Option<PathBuf>,
}

/// Job of the recorder of a flight without a server: it only listens, but for the nodes that it starts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightRecorderJob {
    /// Settings that all nodes and the recorder have.
    pub common: CommonSettings,
    /// Number of nodes that are started here, of the airplanes with the lowest ids; all of them unless given.
    pub nodes: Option<usize>,
    /// The time of the flight.
    pub clock: FlightClock,
    /// The network of the nodes.
    pub network: FlightNetwork,
    /// The aircraft that nodes lead which are started here.
    pub plant: PlantChoice,
    /// The limits of their guards.
    pub guard: GuardSettings,
    /// Folder in which the run is recorded.
    pub out: Option<PathBuf>,
    /// Whether an earlier run there is replaced.
    pub replace: bool,
}

/// The time of a flight without a server: each node goes by its own clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlightClock {
    /// When cycle 0 begins, in seconds since 1970, UTC; none if the recorder sets it once it has heard all.
    pub start_s: Option<f64>,
    /// Seconds of the scenario in a second.
    pub speed: f64,
    /// Seconds by which the clocks of two nodes may differ.
    pub tolerance_s: f64,
}

/// The network of a flight without a server, and the place of a party in it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlightNetwork {
    /// Endpoints at which others reach this party.
    pub listen: Vec<String>,
    /// Endpoints of others to which it connects; one link between two parties is enough.
    pub peers: Vec<String>,
    /// Whether it also looks for others by multicast.
    pub is_scouting: bool,
}

/// The aircraft that a node leads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlantChoice {
    /// A model in the node's own process, so that everything runs without hardware.
    Model(ModelPlantSettings),
    /// An aircraft whose autopilot speaks MAVLink.
    Mavlink(MavlinkSettings),
}

/// How an aircraft is reached by MAVLink, and what may be asked of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MavlinkSettings {
    /// Where it is, as ground stations write it, e.g. `udp:127.0.0.1:14550`.
    pub endpoint: String,
    /// Its system; none for the only one that is there.
    pub system_id: Option<u8>,
    /// The system as which the node speaks.
    pub own_system_id: u8,
    /// A file with the key of signed frames.
    pub key_file: Option<PathBuf>,
    /// Where the origin of a planar scenario lies, as `LATITUDE,LONGITUDE[,ALTITUDE]` in degrees and meters.
    pub origin: Option<String>,
    /// Whether the aircraft is asked, once, to follow its node.
    pub takes_control: bool,
    /// The largest speed in meters per second that it is asked for; none for half as much again as that of its type.
    pub max_speed_m_s: Option<f64>,
    /// The largest acceleration in meters per second squared; none for half as much again as its type has in a turn.
    pub max_acceleration_m_s2: Option<f64>,
    /// Seconds to wait for its first heartbeat.
    pub patience_s: f64,
}

/// How a model of an aircraft follows its setpoints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ModelPlantSettings {
    /// Seconds by which it lags behind; 0 to be where it is to be.
    pub lag_s: f64,
    /// Largest error in meters of each coordinate that it measures.
    pub noise_m: f64,
}

/// The limits of the guard beside a node.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct GuardSettings {
    /// The area that the aircraft must not leave.
    pub fence: FenceSettings,
    /// Distance in meters from its reference beyond which it is handed over; none for the errors for which the shield allows.
    pub max_deviation_m: Option<f64>,
    /// Age in seconds of its measurements beyond which it is handed over.
    pub max_age_s: f64,
    /// Seconds without a sign of life of the node's program after which it is handed over.
    pub patience_s: f64,
    /// Seconds before the start from which on it flies straight toward its first pose; 0 to wait there.
    pub run_up_s: f64,
}

/// The area that an aircraft must not leave; everything unless something is given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FenceSettings {
    /// Center and radius in meters of a circle.
    pub circle: Option<([f64; 2], f64)>,
    /// The corners of a polygon, if there are any. Meters east and north, as the center of the circle; on the earth
    /// latitudes and longitudes in degrees.
    pub polygon: Vec<[f64; 2]>,
    /// The lowest and the highest altitude in meters.
    pub altitude_m: Option<[f64; 2]>,
}

/// The state of a node in a flight without a server.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FlightStatus {
    /// The cycle that is flown.
    pub cycle: Cycle,
    /// What the node does, e.g. `waits`, `flies`, `orbits`, `held`, `arrived`.
    pub state: String,
    /// Distance in meters of the aircraft from its reference at the last measurement.
    pub deviation_m: Option<f64>,
    /// The largest one so far.
    pub max_deviation_m: f64,
    /// Acts of the guard since the last such line, in words.
    pub events: Vec<String>,
    /// What was counted, by name.
    pub counts: Vec<(String, u64)>,
}

/// A watcher of a fleet, which takes no part in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WatchJob {
    /// The build that asks: others may show it differently.
    pub build: String,
    /// Endpoints, at one of which the server listens.
    pub connect: Vec<String>,
    /// Certificates, where links are encrypted.
    pub tls: Option<Tls>,
    /// Whether links without certificates may leave this machine.
    pub is_insecure: bool,
    /// Time in seconds that it waits for the server; after a silence of this length the server counts as gone.
    pub patience_s: f64,
}

/// A run in one process that others see as a node of ROS 2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ros2Job {
    /// Settings that servers and nodes of fleets have, too.
    pub common: CommonSettings,
    /// The domain, by which ROS 2 separates systems on one network.
    pub domain: u32,
    /// The namespace of the node and of its topics: `/`, or names with a slash before each.
    pub namespace: String,
    /// The distribution of ROS 2 of the others.
    pub distribution: RosDistribution,
    /// Endpoints at which the others connect; none if this node only connects.
    pub listen: Vec<String>,
    /// Endpoints of routers to which this node connects.
    pub connect: Vec<String>,
    /// Seconds of the scenario in a second: 1 is as fast as in the scenario.
    pub speed: f64,
    /// Whether the run waits for the service `resume` or `step` before its first cycle.
    pub starts_paused: bool,
    /// Number of threads that compute the run.
    pub workers: usize,
    /// Folder in which the run is recorded.
    pub out: Option<PathBuf>,
    /// Whether an earlier run there is replaced.
    pub replace: bool,
}

/// A network of ROS 2, and the place of a node in it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RosNetwork {
    /// The domain, by which ROS 2 separates systems on one network.
    pub domain: u32,
    /// The namespace of the node: `/`, or names with a slash before each.
    pub namespace: String,
    /// The distribution of ROS 2 of the others.
    pub distribution: RosDistribution,
    /// Endpoints at which the others connect; none if this node only connects.
    pub listen: Vec<String>,
    /// Endpoints of routers to which this node connects.
    pub connect: Vec<String>,
}

/// Job of the program of a real robot, which a node of ROS 2 measures and moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveJob {
    /// The settings of all jobs; its scenario has the robot and its map.
    pub common: CommonSettings,
    /// The robot of the scenario that the real one stands for.
    pub robot: EntityId,
    /// The network on which the real robot is.
    pub network: RosNetwork,
    /// The topics and the frames of the real robot.
    pub topics: DriveTopics,
    /// How it drives.
    pub settings: DriveSettings,
    /// Number of trips after which it ends; none to end after the cycles of the scenario.
    pub trips: Option<u64>,
    /// File for the table of its motions.
    pub out: Option<PathBuf>,
    /// Folder for a bag of what it measures and is commanded.
    pub bag: Option<PathBuf>,
    /// Whether an earlier file and an earlier bag there are replaced.
    pub replace: bool,
}

/// Topics and frames of a real robot. Names of topics without a slash at their beginning are of the namespace.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DriveTopics {
    /// Odometry, `nav_msgs/msg/Odometry`.
    pub odom: String,
    /// The scanner, `sensor_msgs/msg/LaserScan`.
    pub scan: String,
    /// The bumper, `std_msgs/msg/Bool`.
    pub bumper: String,
    /// Where commands go, `geometry_msgs/msg/Twist`.
    pub cmd_vel: String,
    /// Goals, `geometry_msgs/msg/PoseStamped`, for a robot that has no behavior of its own.
    pub goal: String,
    /// What robots tell each other, `sidestep_msgs/msg/RobotBeacon`; with a slash at its beginning it is one for all robots.
    pub beacon: String,
    /// The namespaces of the robots, with `{}` for the id; none for that of the robot, with its id at the end.
    pub peers: Option<String>,
    /// Whether commands have a time: `geometry_msgs/msg/TwistStamped`.
    pub is_stamped: bool,
    /// The frame of the map.
    pub map_frame: String,
    /// The frame of the robot, if its pose is that frame's in `/tf` and not that of odometry.
    pub base_frame: Option<String>,
}

/// How a real robot drives, and the limits of its guard.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriveSettings {
    /// Largest speed in m/s.
    pub speed_mps: f64,
    /// Largest rate of turning in rad/s.
    pub turn_radps: f64,
    /// Largest acceleration in m/s2, with which the robot must be able to brake.
    pub acceleration_mps2: f64,
    /// Radius of the robot in meters; none for 0.4 of its side in the scenario.
    pub radius_m: Option<f64>,
    /// Distance in meters that it keeps from what its scanner sees before it.
    pub clearance_m: f64,
    /// Time in seconds of an action that waits.
    pub cycle_s: f64,
    /// Age in seconds of its measurements from which on it stands.
    pub patience_s: f64,
    /// Age in seconds of the last beacon of another robot from which on that is silent.
    pub beacon_patience_s: f64,
    /// Time in seconds of an action after which it ends where it is.
    pub timeout_s: f64,
}

/// The state of a drive, after each action and when the guard steps in or lets go.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DriveStatus {
    /// Actions that are over.
    pub actions: u64,
    /// Those that a contact ended.
    pub contacts: u64,
    /// Those that took too long.
    pub timeouts: u64,
    /// Trips that are complete.
    pub trips: u64,
    /// Column and row of the lower-left box after the last action.
    pub at: Option<(u32, u32)>,
    /// Why the guard makes the robot stand or slow down, if it does.
    pub guarded_by: Option<String>,
    /// Times that the guard stopped the robot because measurements were too old.
    pub old_states: u64,
    /// Times that it stopped the robot because that was off the free boxes of the map.
    pub off_map: u64,
    /// Times that it slowed or stopped the robot because something was near.
    pub obstacles: u64,
    /// Goals that it has taken.
    #[serde(default)]
    pub goals: u64,
    /// Goals that were refused: in another frame, off the map, or out of reach.
    #[serde(default)]
    pub refused_goals: u64,
    /// The goal to which it goes: column and row of its lower-left box.
    #[serde(default)]
    pub goal: Option<(u32, u32)>,
    /// Messages that could not be read, and so were dropped.
    pub unreadable: u64,
    /// Messages that were older than the one before, and so were dropped.
    pub outdated: u64,
    /// What it has told and heard of other robots.
    #[serde(default)]
    pub beacons: BeaconCounts,
    /// Ids of the robots whose words were a part of its last percept.
    #[serde(default)]
    pub heard: Vec<EntityId>,
    /// Ids of the robots that it has heard before, and does not hear anymore.
    #[serde(default)]
    pub silent: Vec<EntityId>,
    /// Its part in a plan, if there is one.
    #[serde(default)]
    pub plan: Option<PlanStatus>,
}

/// Beacons of robots that are driven: those that were told, and those that came and why some were dropped.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BeaconCounts {
    /// Beacons that it has sent.
    pub sent: u64,
    /// Beacons of others that it has taken.
    pub heard: u64,
    /// Those that could not be read, or were too many at once.
    pub unreadable: u64,
    /// Those of another scenario or plan, and of robots that the scenario does not have.
    pub foreign: u64,
    /// Those that were not newer than the one before.
    pub outdated: u64,
}

/// The part of a robot in a plan.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanStatus {
    /// Number of its actions.
    pub actions: u32,
    /// Number of those that it has done; none as long as it does not know.
    pub done: Option<u32>,
    /// Times that it began to wait for others.
    pub waits: u64,
    /// Why it stands instead of doing the next one.
    pub hold: Option<String>,
    /// Ids of the robots for which it waits.
    pub waits_for: Vec<EntityId>,
}

/// Distributions of ROS 2 that differ in what they send.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RosDistribution {
    /// Its types have no hashes.
    Humble,
    /// Jazzy, and all others since Iron: keys have the hashes of types.
    Jazzy,
}

/// What a run shows to ROS 2.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RosGraph {
    /// The full name of the node.
    pub node: String,
    /// The topics that it sends or receives, each with its type, by name.
    pub topics: Vec<(String, String)>,
    /// The services that it has, each with its type.
    pub services: Vec<(String, String)>,
}

/// Job of a master control: vehicles of a warehouse (VDA 5050) carry out the plan of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DispatchJob {
    /// The scenario.
    pub planned: JobScenario,
    /// The MQTT broker, as `mqtt://HOST:PORT`.
    pub broker: String,
    /// Whether the broker may be on another machine, to which the link is not encrypted.
    pub is_insecure: bool,
    /// The first level of all topics, e.g. `uagv`.
    pub interface: String,
    /// The manufacturer of all vehicles.
    pub manufacturer: String,
    /// The serial number of a vehicle is this and the number of its robot.
    pub serial_prefix: String,
    /// The name of the map in which places are given.
    pub map_id: String,
    /// Nodes after the released ones that a vehicle is told of.
    pub horizon_nodes: usize,
    /// Time in seconds without a state after which a vehicle counts as silent.
    pub silence_s: f64,
    /// Time in seconds after which an order is sent again that no state has confirmed.
    pub resend_s: f64,
    /// Time in seconds without any progress after which the job is given up; never unless given.
    pub give_up_s: Option<f64>,
    /// Whether each line of the log is a JSON object.
    pub json_log: bool,
    /// The least severe log lines that are written, e.g. `info`.
    pub log: String,
}

/// The course of time in a fleet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClockMode {
    /// The server waits for every control.
    Lockstep,
    /// Each cycle is a deadline; time passes at a speed.
    Realtime {
        /// Seconds of the scenario in a second: 1 is as fast as in the scenario.
        speed: f64,
    },
}

/// The way of packets from node to node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Topology {
    /// Every node listens, and every two are connected.
    Mesh,
    /// Through the server.
    Star,
    /// By UDP multicast: a packet to many is sent once.
    Multicast,
}

/// Returns whether a datagram to a multicast group comes back on this machine, by its loopback interface.
///
/// # Errors
/// With the reason of the system why it does not.
pub fn check_loopback_multicast() -> std::io::Result<()> {
    /// Time in which it comes back: it goes nowhere.
    const TIMEOUT: Duration = Duration::from_secs(1);
    // Of those that stay on a link (RFC 5771), and of no protocol.
    const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 0, 250);
    let receiver = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    receiver.join_multicast_v4(&GROUP, &Ipv4Addr::LOCALHOST)?;
    receiver.set_read_timeout(Some(TIMEOUT))?;
    let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    sender.send_to(&[0], (GROUP, receiver.local_addr()?.port()))?;
    receiver.recv(&mut [0]).map(drop)
}

/// Certificates with which both ends of a link prove their identity; files in the format PEM.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tls {
    /// Certificate of the authority that signs those of all parties.
    pub authority: PathBuf,
    /// Certificate of this party.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
}

/// A line of the program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinkMessage {
    /// It listens at these endpoints.
    Listens(Vec<String>),
    /// The node of ROS 2 is there, with its first messages.
    Ros2(RosGraph),
    /// The present state of a robot that is driven.
    Drives(DriveStatus),
    /// A robot was driven, to its end or until it was stopped.
    Driven(DriveStatus),
    /// The present state of a node in a flight without a server; the last such line is that at the end.
    Flight(FlightStatus),
    /// The present state of the fleet.
    Fleet(FleetStatus),
    /// The scenery for watchers: everything that stays the same.
    Scene(Box<FleetScene>),
    /// The present state of the world and of the fleet, for watchers.
    Seen(Box<FleetFrame>),
    /// The fleet has come to its end, or was stopped.
    Ended {
        /// The summary of the run, as in `summary.json`.
        summary: serde_json::Value,
        /// The world's own results as text.
        outcome: KeyValues,
        /// The state of the fleet at the end.
        fleet: FleetStatus,
    },
    /// The present state of the vehicles of a plan; the last such line is that at the end.
    Dispatch(DispatchStatus),
    /// It could not do its job.
    Failed(JobError),
}

/// The reason why the program could not do its job, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobError {
    /// Whether an option, a file or another party's input is wrong: then nothing was started.
    pub is_input: bool,
    /// Whether it was asked to stop.
    pub is_interrupted: bool,
    /// The file, option or endpoint concerned; empty if none is.
    pub place: String,
    /// Becomes the message, without its place.
    pub cause: String,
    /// Is shown below the message, as an instruction.
    pub remedy: String,
}

/// Everything of a fleet that stays the same, for its watchers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetScene {
    /// The build of its server.
    pub build: String,
    /// The world's name.
    pub world: String,
    /// What people call an agent of this world, e.g. `airplane`.
    pub agent: String,
    /// Identifies the run together with the scenario: viewers show it.
    pub seed: u64,
    /// Walls, floor and starts, which frames do not repeat.
    pub scenery: Scenery,
}

/// A world and its fleet at one moment, for its watchers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FleetFrame {
    /// Its number among all that were shown, from 1.
    pub number: u64,
    /// The bodies; its log has the last events of the run, not only those since the frame before, which a viewer may
    /// not have seen.
    pub frame: Frame,
    /// Counts and states of the nodes at the same moment as the frame.
    pub fleet: FleetStatus,
    /// Whether the fleet has come to its end.
    pub is_over: bool,
}

/// A fleet at one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FleetStatus {
    /// Cycles done.
    pub cycle: Cycle,
    /// Cycles planned.
    pub cycles: Cycle,
    /// Whether all nodes have joined.
    pub has_begun: bool,
    /// Number of cycles that began late, in real time.
    pub late_cycles: u64,
    /// Seconds of real time since all nodes had joined; 0 before.
    pub flown_s: f64,
    /// Median time in milliseconds from the percepts to the last control.
    pub talk_p50_ms: Option<f64>,
    /// The time in milliseconds below which 99 of 100 of them are.
    pub talk_p99_ms: Option<f64>,
    /// Bytes of all frames that the server has sent, percepts for the most part.
    pub server_frame_bytes: u64,
    /// What people call an agent of this world, e.g. `airplane`.
    pub noun: String,
    /// Names of the agents for which all wait, because their nodes are not heard.
    pub waits_for: Vec<String>,
    /// The nodes, by rising id.
    pub nodes: Vec<NodeStatus>,
}

/// A node at one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeStatus {
    /// Its agent, by its id on the network.
    pub agent: EntityId,
    /// The name of its agent, e.g. `3`, or `0.3` for part 3 of body 0.
    pub name: String,
    /// The number of its agent's visible body.
    pub number: EntityId,
    /// The part of that body that the agent is, if it is a part.
    pub part: Option<u32>,
    /// A word for its state: `awaited`, `joined`, `gone`, `silent` if it was not heard for a second, or its part in
    /// the cycle.
    pub state: String,
    /// System id of the node's process on its machine; `None` before the node has joined.
    pub process: Option<u32>,
    /// The epoch of the coordinator that it follows.
    pub epoch: u64,
    /// The number of others that it has heard in the last cycle.
    pub heard: usize,
    /// The ids of these.
    pub heard_of: Vec<EntityId>,
    /// The round of its talk.
    pub round: u32,
    /// Number of its controls that were flown.
    pub flown: u64,
    /// Number of its controls that came late, or not at all.
    pub late: u64,
    /// Number of times that it has joined.
    pub lives: u64,
    /// Packets that it has sent.
    pub packets: u64,
    /// Bytes of these packets.
    pub bytes: u64,
    /// Bytes of all frames that it has sent: packets, controls and its status, but no headers of the network.
    pub frame_bytes: u64,
    /// Processor time in milliseconds that its process has used since its first cycle; none where its system does not
    /// tell.
    pub processor_ms: Option<u64>,
    /// Packets that it sends in a second.
    pub packets_per_s: f64,
    /// Bytes that it sends in a second.
    pub bytes_per_s: f64,
    /// Number of its reports that differ from the recorded run, in a flight without a server.
    #[serde(default)]
    pub differing: u64,
    /// What the node has counted, by name, in a flight without a server.
    #[serde(default)]
    pub counts: Vec<(String, u64)>,
    /// Seconds since it was last heard.
    pub silent_s: Option<f64>,
}

/// The vehicles of a plan at one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DispatchStatus {
    /// Seconds since the start.
    pub elapsed_s: f64,
    /// Whether all vehicles have reached the ends of their routes.
    pub is_complete: bool,
    /// The vehicles, by the numbers of their robots.
    pub vehicles: Vec<VehicleStatus>,
    /// Messages that were dropped and are of no vehicle of the plan, by reason.
    pub dropped: BTreeMap<String, u64>,
}

/// A vehicle of a plan at one moment.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct VehicleStatus {
    /// Its serial number.
    pub serial: String,
    /// What it does, or why it gets no orders, in words.
    pub state: String,
    /// Whether it is at the end of its route.
    pub is_complete: bool,
    /// The nodes that it has reached, without its start.
    pub nodes_done: usize,
    /// The nodes of its route, without its start.
    pub nodes: usize,
    /// Times at which it stood at the end of what was released and had to wait.
    pub waits: u64,
    /// Seconds for which it has waited so.
    pub waited_s: f64,
    /// Seconds from its first order to the end of its route, or until now.
    pub time_s: Option<f64>,
    /// Orders that it was sent: more than one if it has lost one.
    pub orders: u64,
    /// Updates of these orders.
    pub updates: u64,
    /// Messages that were sent again.
    pub resent: u64,
    /// The errors of its last state.
    pub errors: Vec<String>,
    /// Its messages that were dropped, by reason.
    pub dropped: BTreeMap<String, u64>,
}

impl JobError {
    /// Returns the failure as an error of a session.
    pub fn into_error(self) -> crate::Error {
        let Self { is_input, is_interrupted, place, cause, remedy } = self;
        match () {
            () if is_interrupted => crate::Error::Interrupted,
            () if is_input => InputError::new(place, cause, remedy).into(),
            () => crate::Error::other(cause, remedy),
        }
    }
}

impl From<&crate::Error> for JobError {
    fn from(error: &crate::Error) -> Self {
        let none = String::new;
        let stopped = |cause: String, remedy: String| Self {
            is_input: false,
            is_interrupted: false,
            place: none(),
            cause,
            remedy,
        };
        match error {
            crate::Error::Input(input) => Self {
                is_input: true,
                place: input.place().to_string(),
                ..stopped(input.cause().to_string(), input.remedy().to_string())
            },
            crate::Error::Interrupted => {
                Self { is_interrupted: true, ..stopped(error.to_string(), none()) }
            }
            crate::Error::Other { cause, remedy } => stopped(cause.clone(), remedy.clone()),
            crate::Error::Record(error) => stopped(error.to_string(), STORAGE_REMEDY.to_string()),
            other => stopped(other.to_string(), none()),
        }
    }
}
