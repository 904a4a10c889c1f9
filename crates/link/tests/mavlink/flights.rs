//! Flights without a server whose nodes lead vehicles by MAVLink.

use crate::vehicles::{ORIGIN, TEST_TIMEOUT, Vehicles};
use serde_json::{Value, json};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::flight::AirplaneStart;
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep_session::fleet::{
    AgentName, CommonSettings, FlightClock, FlightJob, FlightNetwork, FlightRecorderJob,
    FlightStatus, GuardSettings, Job, JobScenario, LinkMessage, MavlinkSettings,
    ModelPlantSettings, PlantChoice, link_command,
};
use sidestep_session::{NoWatcher, RecordedRun, replay_all};
use sidestep_testing::{JsonProcess, has_modules, root};
use std::path::Path;
use std::time::{Duration, Instant};

/// Meters above the sea at which the scenario's altitude 0 is: 60 m above the home of all vehicles.
const LEVEL_M: f64 = 548.0;

/// Seconds before the start in which vehicles take up their speed.
const RUN_UP_S: f64 = 5.0;

/// Seconds by which clocks may differ: one machine has one clock, but it may be busy.
const TOLERANCE_S: f64 = 0.3;

/// The type of vehicles in the scenario that is shipped.
const SPEED_M_S: f64 = 8.0;

/// The errors for which the shield allows there, in meters.
const BOUND_M: f64 = 7.5;

/// Returns the shipped scenario of multirotors, with so many of them on a circle, for some cycles of a second.
pub(crate) fn scenario(n: usize, radius_m: f64, cycles: u64) -> JobScenario {
    JobScenario {
        file: root().join("scenarios/airspace/multirotors.toml"),
        overrides: vec![
            format!("cycles={cycles}"),
            format!("airspace.generator.n={n}"),
            format!("airspace.generator.radius_m={radius_m}"),
            "airspace.network.loss=0.2".into(),
            "airspace.network.max_delay_s=0.02".into(),
        ],
        build: WORLDS.build().into(),
    }
}

/// Returns where the airplanes of a scenario start.
fn airplanes(flown: &JobScenario) -> Vec<AirplaneStart> {
    let read = sidestep_session::read_scenario(&WORLDS, &flown.file, &flown.overrides);
    let compiled = read.expect("a scenario").1;
    let airspace = compiled.as_any().downcast_ref::<CompiledAirspace>().expect("an airspace");
    airspace.world.airplanes.to_vec()
}

/// Returns a multirotor that hovers where the run-up of an airplane begins.
fn vehicle(number: usize, airplane: &AirplaneStart) -> Value {
    let heading_rad = airplane.start.heading_rad;
    let back_m = RUN_UP_S * SPEED_M_S;
    let [x, y] = airplane.start.at;
    let at = [x - back_m * heading_rad.cos(), y - back_m * heading_rad.sin()];
    let compass_deg = 90.0 - heading_rad.to_degrees();
    json!({
        "kind": "copter", "autopilot": "ardupilot", "system": number + 1,
        "start": [at[0], at[1], 60.0, compass_deg], "wind": [2.0, -1.0], "noise": 0.3,
        // It loiters until its node asks for it.
        "mode": 5,
    })
}

/// A program that does a job.
type LinkProcess = JsonProcess<LinkMessage>;

fn start(job: &Job) -> LinkProcess {
    JsonProcess::start_with(link_command(env!("CARGO_BIN_EXE_sidestep-link")), job)
}

/// Waits until a node listens, and returns where.
fn endpoints(node: &LinkProcess) -> Vec<String> {
    loop {
        match node.next("endpoints", TEST_TIMEOUT) {
            LinkMessage::Listens(endpoints) => return endpoints,
            LinkMessage::Failed(error) => panic!("{error:?}"),
            _ => {}
        }
    }
}

/// A node, and all that it has told.
pub(crate) struct Node {
    job: FlightJob,
    process: LinkProcess,
    pub(crate) last: FlightStatus,
    events: Vec<String>,
}

impl Node {
    fn start(job: FlightJob) -> Self {
        let process = start(&Job::Flight(Box::new(job.clone())));
        Self { job, process, last: FlightStatus::default(), events: Vec::new() }
    }

    pub(crate) fn process_id(&self) -> u32 {
        self.process.child.id()
    }

    /// Kills the node if it runs, starts it again with the endpoints of all others, and returns where it listens.
    fn restart(&mut self, peers: Vec<String>) -> String {
        self.job.network.peers = peers;
        self.process = start(&Job::Flight(Box::new(self.job.clone())));
        endpoints(&self.process).remove(0)
    }

    /// Takes what has come.
    fn read(&mut self) {
        while let Ok(message) = self.process.lines.try_recv() {
            self.take(message);
        }
    }

    fn take(&mut self, message: LinkMessage) {
        match message {
            LinkMessage::Flight(status) => {
                self.events.extend(status.events.iter().cloned());
                self.last = status;
            }
            LinkMessage::Failed(error) => panic!("{error:?}, {:?}", self.events),
            _ => {}
        }
    }

    pub(crate) fn counted(&self, name: &str) -> u64 {
        self.last.counts.iter().filter(|count| count.0 == name).map(|count| count.1).sum()
    }
}

/// A flight of vehicles, with a recorder.
pub(crate) struct Flight {
    pub(crate) vehicles: Vehicles,
    pub(crate) nodes: Vec<Node>,
    /// Where each node listens.
    endpoints: Vec<String>,
    recorder: LinkProcess,
}

impl Flight {
    /// Starts a flight whose recorder sets the start once all are ready.
    fn start(folder: &Path, flown: &JobScenario, guard: &GuardSettings) -> Self {
        Self::start_at(folder, flown, guard, None)
    }

    /// Starts a flight that begins at a time, in seconds since 1970, so that a node that is started again knows it.
    pub(crate) fn start_at(
        folder: &Path,
        flown: &JobScenario,
        guard: &GuardSettings,
        start_s: Option<f64>,
    ) -> Self {
        let airplanes = airplanes(flown);
        let all: Vec<Value> =
            airplanes.iter().enumerate().map(|(n, airplane)| vehicle(n, airplane)).collect();
        let vehicles = Vehicles::start(&Value::Array(all));
        let common = CommonSettings {
            flown: flown.clone(),
            tls: None,
            is_insecure: false,
            lease_s: 60.0,
            metrics: None,
            json_log: false,
            log: "error".into(),
        };
        let clock = FlightClock { start_s, speed: 1.0, tolerance_s: TOLERANCE_S };
        let mut peers: Vec<String> = Vec::new();
        let mut nodes = Vec::new();
        for (airplane, port) in (0..).zip(&vehicles.ports) {
            let job = FlightJob {
                common: common.clone(),
                agent: AgentName::new("airplane", airplane, None),
                clock,
                network: FlightNetwork {
                    listen: vec!["tcp/127.0.0.1:0".into()],
                    peers: peers.clone(),
                    is_scouting: false,
                },
                plant: PlantChoice::Mavlink(mavlink(*port)),
                guard: guard.clone(),
                journal: Some(folder.join(format!("airplane-{airplane}.journal"))),
            };
            let node = Node::start(job);
            peers.extend(endpoints(&node.process));
            nodes.push(node);
        }
        let network =
            FlightNetwork { listen: Vec::new(), peers: peers.clone(), is_scouting: false };
        let job = FlightRecorderJob {
            common,
            nodes: Some(0),
            clock,
            network,
            plant: PlantChoice::Model(ModelPlantSettings::default()),
            guard: guard.clone(),
            out: Some(folder.join("run")),
            replace: false,
        };
        let recorder = start(&Job::FlightRecorder(Box::new(job)));
        Self { vehicles, nodes, endpoints: peers, recorder }
    }

    pub(crate) fn read(&mut self) {
        self.nodes.iter_mut().for_each(Node::read);
    }

    /// Kills a node, and starts it again.
    pub(crate) fn restart(&mut self, node: usize) {
        let mut peers = self.endpoints.clone();
        peers.remove(node);
        self.endpoints[node] = self.nodes[node].restart(peers);
    }

    /// Waits until something holds for the nodes.
    pub(crate) fn wait_for(&mut self, what: &str, holds: impl Fn(&[Node]) -> bool) {
        let until = Instant::now() + TEST_TIMEOUT;
        loop {
            self.read();
            if holds(&self.nodes) {
                return;
            }
            assert!(Instant::now() < until, "waited for {what}: {:?}", self.nodes[0].last);
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Waits for the end.
    fn end(&mut self) {
        let until = Instant::now() + TEST_TIMEOUT;
        while !self.has_ended() {
            assert!(Instant::now() < until, "waited for the end: {:?}", self.nodes[0].last);
            std::thread::sleep(Duration::from_millis(50));
        }
        self.read();
    }

    /// Returns whether the recorder has told the end.
    pub(crate) fn has_ended(&mut self) -> bool {
        let messages = self.recorder.lines.try_iter();
        messages.fold(false, |has_ended, message| match message {
            LinkMessage::Ended { .. } => true,
            LinkMessage::Failed(error) => panic!("{error:?}"),
            _ => has_ended,
        })
    }

    /// Tells how far all were from where they were to be, and how near those came to each other that are not left out.
    pub(crate) fn tell(&mut self, without: &[usize]) -> f64 {
        let nearest = self.vehicles.ask(&json!({ "do": "separation", "without": without }));
        let nearest_m = nearest.as_f64().expect("meters");
        for (k, node) in self.nodes.iter().enumerate() {
            let Node { last, events, .. } = node;
            let off_m = last.max_deviation_m;
            println!("airplane {k}: {} {off_m:.2} m {:?} {events:?}", last.state, last.counts);
        }
        println!("nearest: {nearest_m:.2} m");
        nearest_m
    }

    pub(crate) fn handed_over(&self) -> Vec<usize> {
        let held = |k: &usize| self.nodes[*k].counted("handed-over") > 0;
        (0..self.nodes.len()).filter(held).collect()
    }
}

fn mavlink(port: u16) -> MavlinkSettings {
    MavlinkSettings {
        endpoint: format!("udpout:127.0.0.1:{port}"),
        system_id: None,
        own_system_id: 245,
        key_file: None,
        origin: Some(format!("{},{},{LEVEL_M}", ORIGIN.latitude_deg, ORIGIN.longitude_deg)),
        takes_control: true,
        max_speed_m_s: None,
        max_acceleration_m_s2: None,
        patience_s: TEST_TIMEOUT.as_secs_f64(),
    }
}

/// Limits that a busy machine does not exceed, but for the distance from the reference, which the shield allows.
pub(crate) fn guard() -> GuardSettings {
    GuardSettings {
        max_age_s: 3.0,
        patience_s: 60.0,
        run_up_s: RUN_UP_S,
        ..GuardSettings::default()
    }
}

/// Returns the smallest distance that the shield promises to vehicles within their errors.
pub(crate) fn separation_m(flown: &JobScenario) -> f64 {
    airplanes(flown)[0].model.separation_m
}

#[test]
fn ten_multirotors_with_a_lossy_radio_keep_the_separation_that_the_shield_promises() {
    if !has_modules(crate::PEER) {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let flown = scenario(10, 100.0, 20);
    let mut flight = Flight::start(folder.path(), &flown, &guard());
    flight.end();
    let nearest_m = flight.tell(&[]);
    let recorded = RecordedRun::open(&WORLDS, &folder.path().join("run")).expect("a run");
    replay_all(&recorded, 1, &NoWatcher).expect("computed again, to the same digest");
    let handed_over = flight.handed_over();
    if !handed_over.is_empty() {
        // A machine that is too busy to lead them in time: they are with their autopilots, and nothing is promised.
        println!("not judged: {handed_over:?} were handed over");
        return;
    }
    for node in &flight.nodes {
        assert!(node.last.max_deviation_m < BOUND_M - TOLERANCE_S * SPEED_M_S, "{:?}", node.last);
    }
    assert!(nearest_m >= separation_m(&flown), "{nearest_m} m");
    // They have met in the middle.
    assert!(nearest_m < 60.0, "{nearest_m} m");
}

#[test]
fn autopilots_that_boot_lag_or_refuse_are_handed_over_and_the_others_keep_apart() {
    if !has_modules(crate::PEER) {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let flown = scenario(6, 100.0, 16);
    let mut flight = Flight::start(folder.path(), &flown, &guard());
    flight.wait_for("some cycles", |nodes| nodes.iter().all(|node| node.last.cycle >= 2));
    assert_eq!(flight.vehicles.ask(&json!({ "do": "reboot", "vehicle": 0, "seconds": 5 })), "done");
    flight.vehicles.set(&json!({ "vehicle": 1, "lag": 4.5 }));
    flight.vehicles.set(&json!({ "vehicle": 2, "frozen": true, "deny": { "176": 2, "17": 4 } }));
    flight.wait_for("the hand-over of three", |nodes| {
        nodes[..3].iter().all(|node| node.counted("handed-over") > 0)
    });
    flight.end();
    let nearest_m = flight.tell(&[0, 1, 2]);
    let has_told = |node: usize, words: &str| {
        flight.nodes[node].events.iter().any(|event| event.contains(words))
    };
    for node in 0..3 {
        assert!(has_told(node, "handed over to its autopilot"), "{:?}", flight.nodes[node].events);
    }
    assert!(flight.nodes[0].counted("reboots") == 1, "{:?}", flight.nodes[0].last);
    for words in ["BRAKE is refused with MAV_RESULT_DENIED", "MAV_RESULT_FAILED"] {
        assert!(has_told(2, words), "{:?}", flight.nodes[2].events);
    }
    // It brakes, though its acknowledgment is late.
    assert_eq!(flight.vehicles.report(1)["mode"], 17);
    let handed_over = flight.handed_over();
    if handed_over != [0, 1, 2] {
        println!("not judged: {handed_over:?} were handed over");
        return;
    }
    assert!(nearest_m >= separation_m(&flown), "{nearest_m} m");
}
