//! Flights of nodes in threads, over a network in memory.

use super::board::FlightBoard;
use super::channel::{ChannelConfig, FlightChannel};
use super::fence::Fence;
use super::guard::{Guard, GuardLimits};
use super::journal::FlightJournal;
use super::message::flight_number;
use super::node::{FlightError, FlightNode, FlightParts, FlightSettings};
use super::recorder::{FlightRecorder, RecorderHooks};
use super::time::{FlightTime, WallClock};
use crate::hosted_run::HostedRun;
use crate::plant::model::ModelPlant;
use crate::wire::PeerId;
use crate::wire::memory::MemoryHub;
use crate::worlds::distributed_world;
use sidestep::kernel::EntityId;
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::pilot::Pilot;
use sidestep::worlds::airspace::replica::{Replica, check_flight};
use sidestep::worlds::airspace::scenario::CompiledAirspace;
use sidestep_session::fleet::{FenceSettings, FleetStatus, FlightStatus, ModelPlantSettings};
use sidestep_session::{Error, ManagedRun, NoWatcher, OutputPaths};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, spawn};
use std::time::{Duration, Instant};

/// Time longer than any test needs, on a machine that has much else to do.
const TEST_TIMEOUT: Duration = Duration::from_secs(300);

/// Seconds of the scenario in a second: a cycle takes half a second.
const SPEED: f64 = 4.0;

/// Returns the text of a scenario: a ring of airplanes with cycles of two seconds.
fn ring(n: usize, cycles: u64, network: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 3\ncycles = {cycles}\n[airspace]\n\
         deployment = \"replica-team\"\ngroups = \"heard\"\ndt_s = 2.0\nmax_rounds = 20\n\
         [airspace.network]\ndeadline_s = 0.7\npatience_s = 0.08\n{network}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\nradius_m = 200.0\njitter_m = 5.0\n\
         [airplane]\nv_m_s = 10.0\nomega_max_deg_s = 20.0\nseparation_m = 30.0\nnic = 11\n"
    )
}

/// A scenario in a test, which all parties share.
#[derive(Clone)]
struct FlightTest {
    text: Arc<str>,
    hub: MemoryHub,
    tolerance_s: f64,
    /// The folder of journals, if nodes have them.
    journals: Option<Arc<tempfile::TempDir>>,
}

/// One node in threads of its own.
struct NodeThread {
    has_to_end: Arc<AtomicBool>,
    thread: JoinHandle<Result<FlightStatus, FlightError>>,
}

impl FlightTest {
    fn new(text: &str) -> Self {
        Self { text: text.into(), hub: MemoryHub::default(), tolerance_s: 10.0, journals: None }
    }

    fn with_journals(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        Self { journals: Some(Arc::new(folder)), ..Self::new(text) }
    }

    fn journal(&self, id: EntityId) -> Option<FlightJournal> {
        let (source, _) = self.compiled();
        let flight = flight_number(&source.text, "test", SPEED);
        let folder = self.journals.as_ref()?;
        Some(FlightJournal::new(folder.path().join(format!("{id}.journal")), flight))
    }

    fn compiled(&self) -> (Source, Box<dyn CompiledScenario>) {
        let source = Source::new("ring.toml", &*self.text, "");
        let compiled = WORLDS.compile(&source).expect("a scenario");
        (source, compiled)
    }

    fn channel(&self, me: PeerId, clock: WallClock) -> FlightChannel {
        let (source, compiled) = self.compiled();
        let flight = flight_number(&source.text, "test", SPEED);
        let config = ChannelConfig { me, flight, tolerance_s: self.tolerance_s, speed: SPEED };
        let world = distributed_world(compiled.as_ref(), &source).expect("airplanes");
        let faults = match me {
            PeerId::Node(agent) => world.channel(agent),
            PeerId::Server => None,
        };
        FlightChannel::new(config, Box::new(self.hub.open_wire(me)), clock, faults)
    }

    /// Starts a node, whose clock is some seconds ahead; without a start it waits for that of the recorder.
    fn start_node(&self, id: EntityId, start_s: Option<f64>, ahead_s: f64) -> NodeThread {
        let has_to_end = Arc::new(AtomicBool::new(false));
        let test = self.clone();
        let ends = Arc::clone(&has_to_end);
        let thread = spawn(move || test.fly(id, start_s, WallClock::with_offset(ahead_s), &ends));
        NodeThread { has_to_end, thread }
    }

    fn fly(
        &self,
        id: EntityId,
        start_s: Option<f64>,
        clock: WallClock,
        ends: &AtomicBool,
    ) -> Result<FlightStatus, FlightError> {
        let (_, compiled) = self.compiled();
        let airspace: &CompiledAirspace = compiled.as_any().downcast_ref().expect("an airspace");
        check_flight(airspace).expect("it can be flown");
        let world = airspace.world.clone();
        let board = Arc::new(FlightBoard::default());
        let parts = FlightParts {
            replica: Replica::new(airspace, id),
            pilot: Pilot::new(world.clone(), id, Default::default()),
            channel: self.channel(PeerId::Node(id), clock),
            board: Arc::clone(&board),
            journal: self.journal(id),
        };
        let patience_s = TEST_TIMEOUT.as_secs_f64();
        let settings = FlightSettings {
            start_s,
            speed: SPEED,
            cycles: compiled.plan().cycles,
            patience_s: 60.0,
            lease_s: 60.0,
        };
        let limits = GuardLimits {
            max_deviation_m: f64::INFINITY,
            max_age_s: patience_s,
            patience_s,
            run_up_s: 0.0,
            fence: Fence::new(&FenceSettings::default(), world.surface).expect("a fence"),
            surface: world.surface,
        };
        let settings_of_model = ModelPlantSettings { lag_s: 0.5, noise_m: 0.5 };
        let plant = ModelPlant::new(world.surface, settings_of_model, SPEED, id.into());
        let guard = Guard::new(Box::new(plant), board, clock, limits);
        let guard_ends = AtomicBool::new(false);
        let has_to_end = || ends.load(Ordering::Relaxed);
        std::thread::scope(|scope| {
            scope.spawn(|| guard.run(&guard_ends));
            let flown = FlightNode::new(id, parts, settings, &has_to_end, |_| {}).run();
            guard_ends.store(true, Ordering::Relaxed);
            flown
        })
    }

    /// Records the flight to its end. `on_poll` is called with the start, once that is known.
    fn record(&self, on_poll: &mut dyn FnMut(Option<f64>, &FleetStatus)) -> Recorded {
        let (source, compiled) = self.compiled();
        let world = distributed_world(compiled.as_ref(), &source).expect("airplanes");
        let dt_s = world.cycle_s();
        let paths = OutputPaths::default();
        let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths);
        let hosted = HostedRun::new(run.expect("started"), world, &NoWatcher);
        let mut hooks = TestHooks {
            on_poll,
            last: FleetStatus::default(),
            until: Instant::now() + TEST_TIMEOUT,
        };
        let time = FlightTime { start_s: f64::INFINITY, speed: SPEED, dt_s };
        let channel = self.channel(PeerId::Server, WallClock::system());
        let mut recorder = FlightRecorder::new(channel, hosted, time, &mut hooks);
        recorder.listen().expect("recorded");
        let (status, hosted) = recorder.finish();
        let summary = hosted.into_managed_run().finish(&NoWatcher).expect("finished");
        Recorded { status, digest: summary.digest, metrics: summary.metrics }
    }

    /// Returns the digest of the same in one process.
    fn digest_of_one_process(&self) -> String {
        let (source, compiled) = self.compiled();
        let paths = OutputPaths::default();
        let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, paths);
        let mut run = run.expect("started");
        let cycles = run.simulation().config().cycles;
        run.advance_to(cycles, &NoWatcher).expect("flown");
        run.finish(&NoWatcher).expect("finished").digest
    }
}

/// What a recorder has recorded.
struct Recorded {
    status: FleetStatus,
    digest: String,
    metrics: serde_json::Value,
}

impl Recorded {
    /// Returns how often something was counted by all nodes.
    fn counted(&self, name: &str) -> u64 {
        let counts = self.status.nodes.iter().flat_map(|node| &node.counts);
        counts.filter(|(counted, _)| counted == name).map(|(_, count)| count).sum()
    }

    /// Checks that no pair has lost separation.
    fn check_separation(&self) {
        assert_eq!(self.metrics["losses_of_separation"], 0, "{}", self.metrics);
    }
}

struct TestHooks<'a> {
    on_poll: &'a mut dyn FnMut(Option<f64>, &FleetStatus),
    last: FleetStatus,
    until: Instant,
}

impl RecorderHooks for TestHooks<'_> {
    fn poll(&mut self, start_s: Option<f64>) -> Result<(), Error> {
        assert!(Instant::now() < self.until, "the flight does not end: {:?}", self.last);
        (self.on_poll)(start_s, &self.last);
        Ok(())
    }

    fn report(&mut self, status: &FleetStatus) {
        self.last = status.clone();
    }
}

#[test]
fn a_flight_in_which_nothing_is_lost_ends_as_in_one_process() {
    let test = FlightTest::new(&ring(4, 18, ""));
    let nodes: Vec<NodeThread> = (0..4).map(|id| test.start_node(id, None, 0.0)).collect();
    let recorded = test.record(&mut |_, _| {});
    for node in nodes {
        node.thread.join().expect("no panic").expect("flown");
    }
    recorded.check_separation();
    let differing: u64 = recorded.status.nodes.iter().map(|node| node.differing).sum();
    let unknown: u64 = recorded.status.nodes.iter().map(|node| node.late).sum();
    let late = ["late-controls", "refused-controls", "late-cycles", "unheard-cycles"];
    let late: u64 = late.into_iter().map(|name| recorded.counted(name)).sum();
    let late = late + recorded.metrics["contacts_lost"].as_u64().expect("a count");
    assert_eq!(differing, 0, "what is recorded is what was flown");
    // A machine that is too busy for half a second a cycle flies otherwise, and says so.
    if late + unknown > 0 {
        println!("not compared with one process: {late} late, {unknown} unknown");
        return;
    }
    assert_eq!(recorded.digest, test.digest_of_one_process());
}

#[test]
fn losses_and_a_node_that_is_gone_and_returns_make_no_pair_lose_separation() {
    let test = FlightTest::new(&ring(4, 36, "loss = 0.2\nmax_delay_s = 0.02\nduplication = 0.1"));
    let mut nodes: Vec<Option<NodeThread>> =
        (0..4).map(|id| Some(test.start_node(id, None, 0.0))).collect();
    let gone = nodes[2].take().expect("a node");
    let mut returned: Option<NodeThread> = None;
    let recorded = test.record(&mut |start_s, status| {
        if status.cycle >= 6 {
            gone.has_to_end.store(true, Ordering::Relaxed);
        }
        if gone.thread.is_finished() && returned.is_none() {
            returned = Some(test.start_node(2, start_s, 0.0));
        }
    });
    assert_eq!(gone.thread.join().expect("no panic"), Err(FlightError::Interrupted));
    let returned = returned.expect("it was started again");
    for node in nodes.into_iter().flatten().chain([returned]) {
        node.thread.join().expect("no panic").expect("flown");
    }
    recorded.check_separation();
    assert!(recorded.counted("unheard-cycles") > 0, "{:?}", recorded.status);
    assert_eq!(recorded.counted("returns"), 1);
    assert_eq!(recorded.status.nodes[2].lives, 2);
}

/// Ends two nodes at the same time in the middle of a flight, and starts them again. Returns what was recorded, and how the
/// two have ended.
fn restart_two(test: &FlightTest) -> (Recorded, Vec<Result<FlightStatus, FlightError>>) {
    let mut nodes: Vec<Option<NodeThread>> =
        (0..4).map(|id| Some(test.start_node(id, None, 0.0))).collect();
    let gone = [1, 2].map(|id: usize| nodes[id].take().expect("a node"));
    let mut returned: Vec<NodeThread> = Vec::new();
    let recorded = test.record(&mut |start_s, status| {
        if status.cycle >= 7 {
            gone.iter().for_each(|node| node.has_to_end.store(true, Ordering::Relaxed));
        }
        if returned.is_empty() && gone.iter().all(|node| node.thread.is_finished()) {
            returned.extend([1, 2].map(|id| test.start_node(id, start_s, 0.0)));
        }
    });
    for node in nodes.into_iter().flatten() {
        node.thread.join().expect("no panic").expect("flown");
    }
    let ends = returned.into_iter().map(|node| node.thread.join().expect("no panic"));
    (recorded, ends.collect())
}

#[test]
fn nodes_that_end_at_the_same_time_go_on_by_their_journals_and_are_recorded_as_they_fly() {
    let test = FlightTest::with_journals(&ring(4, 30, "loss = 0.3\nmax_delay_s = 0.02"));
    let (recorded, ends) = restart_two(&test);
    assert!(ends.iter().all(Result::is_ok), "{ends:?}");
    recorded.check_separation();
    assert_eq!(recorded.counted("returns"), 2);
    assert!(recorded.counted("quiet-cycles") <= 2, "{:?}", recorded.status);
    let differing: u64 = recorded.status.nodes.iter().map(|node| node.differing).sum();
    assert_eq!(differing, 0, "{:?}", recorded.status);
}

#[test]
fn nodes_without_journals_that_end_at_the_same_time_do_not_fly_again_because_nobody_remembers_all()
{
    let test = FlightTest::new(&ring(4, 20, "loss = 0.2\nmax_delay_s = 0.02"));
    let (recorded, ends) = restart_two(&test);
    for ended in ends {
        let Err(FlightError::NotRemembered(reason)) = ended else { panic!("{ended:?}") };
        assert!(reason.contains("have not answered"), "{reason}");
    }
    recorded.check_separation();
}

#[test]
fn a_clock_that_is_off_makes_its_reports_count_as_missing_and_no_pair_lose_separation() {
    let mut test = FlightTest::new(&ring(3, 16, ""));
    // Far more than a busy machine delays the fastest of 32 messages, and less than a cycle of half a second.
    test.tolerance_s = 0.2;
    let nodes: Vec<NodeThread> = [0.0, 0.0, -0.4]
        .into_iter()
        .zip(0..)
        .map(|(ahead_s, id)| test.start_node(id, None, ahead_s))
        .collect();
    let recorded = test.record(&mut |_, _| {});
    for node in nodes {
        node.thread.join().expect("no panic").expect("flown");
    }
    recorded.check_separation();
    assert!(recorded.counted("clock-reports") > 0, "{:?}", recorded.status);
    assert!(recorded.counted("unheard-cycles") > 0, "{:?}", recorded.status);
}

#[test]
fn nobody_sets_out_unless_all_are_there() {
    let test = FlightTest::new(&ring(3, 10, ""));
    let start_s = WallClock::system().now_s() + 3.0;
    let nodes: Vec<NodeThread> = (0..2).map(|id| test.start_node(id, Some(start_s), 0.0)).collect();
    for node in nodes {
        let ended = node.thread.join().expect("no panic");
        let Err(FlightError::NotAllThere(reason)) = ended else { panic!("{ended:?}") };
        assert!(reason.contains("airplanes 2"), "{reason}");
    }
}

#[test]
fn a_node_of_a_flight_that_nobody_remembers_does_not_set_out() {
    let test = FlightTest::new(&ring(2, 10, ""));
    let start_s = WallClock::system().now_s() - 100.0;
    let node = test.start_node(0, Some(start_s), 0.0);
    let ended = node.thread.join().expect("no panic");
    let Err(FlightError::NotRemembered(reason)) = ended else { panic!("{ended:?}") };
    assert!(reason.contains("airplanes 1 have not answered"), "{reason}");
}
