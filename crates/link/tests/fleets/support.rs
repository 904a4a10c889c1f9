//! Fleets to test.

use serde_json::Value;
use sidestep::kernel::{Cycle, EntityId};
use sidestep::scenario::{Compiled, Source};
use sidestep::worlds::WORLDS;
use sidestep_link::airspace::{Aboard, Airspace, Faults, fingerprint, world_of};
use sidestep_link::mail::Mail;
use sidestep_link::node::{Asked, Node, NodeError, join};
use sidestep_link::ports::{Channel, Doing, Outgoing, Program};
use sidestep_link::server::{Attendant, Broken, Look, Server, Tally, Terms};
use sidestep_link::wire::{Party, Wire};
use sidestep_link::words::{Clock, Join, Status, Topology, Welcome};
use sidestep_session::{Journey, Keep, Unwatched};
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

/// Time that no test needs.
pub(crate) const LONG: Duration = Duration::from_secs(60);

/// Returns the text of a scenario: `n` airplanes on a circle, each of which wants to the other side.
pub(crate) fn superconflict(n: usize, deployment: &str, cycles: u64, more: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nname = \"ring\"\nseed = 5\ncycles = {cycles}\n[airspace]\n\
         deployment = \"{deployment}\"\nmax_rounds = 40\n{more}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\nradius_m = 1500.0\n"
    )
}

/// Returns the same on a circle of another size, so that it takes longer.
pub(crate) fn wide(text: &str, radius_m: u32) -> String {
    text.replace("radius_m = 1500.0", &format!("radius_m = {radius_m}.0"))
}

/// The outcome of a run: the digest of its state, and the metrics but for those that a clock measures.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Came {
    pub(crate) digest: String,
    pub(crate) metrics: Value,
}

fn compiled(text: &str) -> (Source, Box<dyn Compiled>) {
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    (source, compiled)
}

/// Returns metrics without what a clock has measured.
pub(crate) fn untimed(mut metrics: Value) -> Value {
    let all = metrics.as_object_mut().expect("an object");
    all.retain(|key, _| !key.contains("cpu") && !key.contains("wall"));
    metrics
}

fn came(journey: Journey) -> Came {
    let summary = journey.finish(&Unwatched).expect("stored");
    Came { digest: summary.digest, metrics: untimed(summary.metrics) }
}

/// Returns what comes of a scenario in one process.
pub(crate) fn alone(text: &str) -> Came {
    let (source, compiled) = compiled(text);
    let mut journey =
        Journey::start(compiled.as_ref(), &source, 1, Keep::default(), None).expect("started");
    let cycles = journey.simulation().plan().cycles;
    journey.advance_to(cycles, &Unwatched).expect("flown");
    came(journey)
}

/// Somebody who leaves a fleet alone.
pub(crate) struct Nobody;

impl Attendant for Nobody {
    fn attend(&mut self, _: &Look<'_>) -> Result<Vec<(EntityId, String)>, Broken> {
        Ok(Vec::new())
    }
}

/// The manner in which a fleet is flown in a test.
pub(crate) struct Way<'a> {
    pub(crate) clock: Clock,
    pub(crate) topology: Topology,
    pub(crate) lease: Duration,
    /// The wire of each party.
    pub(crate) wire: &'a dyn Fn(Party) -> Box<dyn Wire>,
    /// Endpoints at which a node is reached.
    pub(crate) listens: &'a dyn Fn(EntityId) -> Vec<String>,
    pub(crate) attendant: &'a mut dyn Attendant,
    /// The agent whose node says nonsense instead of its control.
    pub(crate) liar: Option<EntityId>,
}

/// A pilot aboard a node that says nonsense instead of its control.
struct Liar(Aboard);

impl Program for Liar {
    fn begin(&mut self, cycle: Cycle, sight: &[u8]) -> Result<u64, String> {
        self.0.begin(cycle, sight)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.0.on_packet(from, payload, tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.0.on_timer(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        self.0.next_timer()
    }

    fn take_packets(&mut self) -> Vec<Outgoing> {
        self.0.take_packets()
    }

    fn is_done(&self) -> bool {
        self.0.is_done()
    }

    fn control(&self) -> Option<Vec<u8>> {
        self.0.control().map(|control| control[..control.len() / 2].to_vec())
    }

    fn doing(&self) -> Doing {
        self.0.doing()
    }

    fn heard(&self) -> Vec<EntityId> {
        self.0.heard()
    }

    fn dropped(&self) -> Vec<(String, u64)> {
        self.0.dropped()
    }
}

/// Flies a scenario with a thread for each airplane.
pub(crate) fn in_threads(text: &str, way: Way<'_>) -> (Came, Result<(), Broken>, Tally) {
    let (source, compiled) = compiled(text);
    let scenario = fingerprint(compiled.as_ref(), &source).expect("a fingerprint");
    let world = world_of(compiled.as_ref(), &source).expect("an airspace");
    let welcome = Welcome {
        clock: way.clock,
        topology: way.topology,
        overrides: Vec::new(),
        logs_packets: false,
    };
    let terms = Terms {
        scenario: scenario.clone(),
        build: "test".into(),
        welcome,
        lease: way.lease,
        has_faults: world.network.is_some(),
    };
    let journey =
        Journey::start(compiled.as_ref(), &source, 1, Keep::default(), None).expect("started");
    let mut stage = Airspace::new(journey, &Unwatched);
    let mail = Mail::new(Party::Server, (way.wire)(Party::Server));
    let nodes: Vec<JoinHandle<Result<Status, NodeError>>> = (0..world.airplanes.len() as EntityId)
        .map(|agent| {
            let mail = Mail::new(Party::Node(agent), (way.wire)(Party::Node(agent)));
            let (listens, scenario) = ((way.listens)(agent), scenario.clone());
            let join = Join { agent, scenario, build: "test".into(), listens, process: 0 };
            let (world, lease, is_liar) = (world.clone(), way.lease, way.liar == Some(agent));
            spawn(move || node(mail, join, world, (lease, is_liar)))
        })
        .collect();
    let (flown, tally) = Server::new(mail, &mut stage, way.attendant, terms).run();
    for node in nodes {
        let ended = node.join().expect("no panic");
        match (&flown, ended) {
            (Ok(()), ended) => assert!(ended.is_ok(), "{ended:?}"),
            (Err(broken), ended) => println!("{broken}; a node: {ended:?}"),
        }
    }
    (came(stage.into_journey()), flown, tally)
}

fn node(
    mut mail: Mail,
    question: Join,
    world: std::sync::Arc<sidestep::worlds::airspace::AirspaceWorld>,
    (lease, is_liar): (Duration, bool),
) -> Result<Status, NodeError> {
    let agent = question.agent;
    let welcome = join(&mut mail, &Asked { join: question, patience: LONG })?;
    let aboard = Aboard::new(world.clone(), agent, "test");
    let program: Box<dyn Program> = if is_liar { Box::new(Liar(aboard)) } else { Box::new(aboard) };
    let channel = Faults::new(world, agent).map(|faults| Box::new(faults) as Box<dyn Channel>);
    Node::new(agent, mail, (program, channel), &welcome, lease).run()
}
