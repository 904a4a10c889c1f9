//! Fleets to test.

use serde_json::Value;
use sidestep::kernel::{Cycle, EntityId};
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::WORLDS;
use sidestep_link::agent::{AgentActivity, AgentProgram, OutgoingPacket};
use sidestep_link::distributed::DistributedWorld;
use sidestep_link::hosted_run::HostedRun;
use sidestep_link::messenger::Messenger;
use sidestep_link::node::{JoinConfig, Node, NodeError, Seat, join};
use sidestep_link::protocol::{ClockMode, JoinRequest, NodeStatusReport, Topology, Welcome};
use sidestep_link::server::{
    FleetContext, FleetError, FleetServer, ServerConfig, ServerHooks, ServerMetrics,
};
use sidestep_link::wire::{PeerId, Wire};
use sidestep_link::worlds::{distributed_world, fingerprint};
use sidestep_session::{ManagedRun, NoWatcher, OutputPaths};
use std::sync::Arc;
use std::thread::{JoinHandle, spawn};
use std::time::Duration;

/// Time longer than any test needs, on a machine that has much else to do.
pub(crate) const TEST_TIMEOUT: Duration = Duration::from_secs(300);

/// Returns the text of a scenario: `n` airplanes on a circle, each of which wants to get to the other side.
pub(crate) fn superconflict(n: usize, deployment: &str, cycles: u64, more: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nname = \"ring\"\nseed = 5\ncycles = {cycles}\n[airspace]\n\
         deployment = \"{deployment}\"\nmax_rounds = 40\n{more}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\nradius_m = 1500.0\n"
    )
}

/// Returns the part of a scenario that is common to all with chains.
fn chains(cycles: u64, more: &str) -> String {
    format!(
        "format = 1\nworld = \"chain\"\nname = \"chain\"\nseed = 3\ncycles = {cycles}\n[chain]\ndt_s = 0.05\n\
         self_collision = false\nbacktracks = 0\nescape = \"off\"\ndeployment = \"team\"\n{more}"
    )
}

/// Returns the text of a scenario: two chains in each other's way, in the plane, past a disc.
pub(crate) fn two_chains(connectors: usize, cycles: u64, network: &str) -> String {
    let more = format!(
        "{network}\n[[obstacles]]\nat_m = [2, -1]\nradius_m = 0.3\n\
         [[chains]]\nconnectors = {connectors}\nat_m = [0, 0]\nrod_m = [0.3, 0.35]\ncount = 2\napart_m = [0.0, 0.5]\n\
         [[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-3, -3], [4, 3]]\npatience_s = 100\n"
    );
    chains(cycles, &more)
}

/// Returns the text of a scenario: a chain in space among balls.
pub(crate) fn chain_in_space(connectors: usize, cycles: u64, network: &str) -> String {
    let more = format!(
        "dimensions = 3\n{network}\n[[fields]]\nlo_m = [-1, -2, -2]\nhi_m = [4, 2, 2]\npart = 0.1\nradius_m = 0.3\n\
         [[chains]]\nconnectors = {connectors}\nat_m = [-1.5, 0, 0]\nalong = [-1, 0, 0]\nrod_m = [0.25, 0.3]\n\
         radius_m = 0.05\n[[chains.tasks]]\nkind = \"wander\"\nwithin_m = [[-2, -2, -2], [4, 2, 2]]\npatience_s = 100\n"
    );
    chains(cycles, &more)
}

/// Returns the same scenario on a circle of another size, so that it takes longer.
pub(crate) fn wide(text: &str, radius_m: u32) -> String {
    text.replace("radius_m = 1500.0", &format!("radius_m = {radius_m}.0"))
}

/// The outcome of a run: the digest of its state, and the metrics except those that a clock measures.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunResult {
    pub(crate) digest: String,
    pub(crate) metrics: Value,
}

fn compiled(text: &str) -> (Source, Box<dyn CompiledScenario>) {
    let source = Source::new("s.toml", text, "");
    let compiled = WORLDS.compile(&source).expect("a scenario");
    (source, compiled)
}

/// Returns metrics without those that a clock measures.
pub(crate) fn untimed(mut metrics: Value) -> Value {
    let all = metrics.as_object_mut().expect("an object");
    all.retain(|key, _| !key.contains("cpu") && !key.contains("wall"));
    metrics
}

fn run_result(run: ManagedRun) -> RunResult {
    let summary = run.finish(&NoWatcher).expect("stored");
    RunResult { digest: summary.digest, metrics: untimed(summary.metrics) }
}

/// Returns the outcome of a scenario in one process.
pub(crate) fn run_in_one_process(text: &str) -> RunResult {
    let (source, compiled) = compiled(text);
    let mut run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, OutputPaths::default())
        .expect("started");
    let cycles = run.simulation().config().cycles;
    run.advance_to(cycles, &NoWatcher).expect("flown");
    run_result(run)
}

/// Hooks that do nothing.
pub(crate) struct NoHooks;

impl ServerHooks for NoHooks {
    fn on_poll(&mut self, _: &FleetContext<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
        Ok(Vec::new())
    }
}

/// The setup of a fleet in a test.
pub(crate) struct FleetSetup<'a> {
    pub(crate) clock: ClockMode,
    pub(crate) topology: Topology,
    pub(crate) lease: Duration,
    /// The wire of each peer.
    pub(crate) wire: &'a dyn Fn(PeerId) -> Box<dyn Wire>,
    /// Endpoints at which a node is reached.
    pub(crate) listens: &'a dyn Fn(EntityId) -> Vec<String>,
    pub(crate) hooks: &'a mut dyn ServerHooks,
    /// The agent with a node that sends nonsense instead of its control.
    pub(crate) liar: Option<EntityId>,
}

/// The program of an agent that sends nonsense instead of its control.
struct FaultyProgram(Box<dyn AgentProgram>);

impl AgentProgram for FaultyProgram {
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String> {
        self.0.start_cycle(cycle, percept)
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

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        self.0.take_packets()
    }

    fn is_done(&self) -> bool {
        self.0.is_done()
    }

    fn control(&self) -> Option<Vec<u8>> {
        self.0.control().map(|control| control[..control.len() / 2].to_vec())
    }

    fn activity(&self) -> AgentActivity {
        self.0.activity()
    }

    fn heard_agents(&self) -> Vec<EntityId> {
        self.0.heard_agents()
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        self.0.drop_counts()
    }
}

/// Flies a scenario with a thread for each agent.
pub(crate) fn run_in_threads(
    text: &str,
    setup: FleetSetup<'_>,
) -> (RunResult, Result<(), FleetError>, ServerMetrics) {
    let (source, compiled) = compiled(text);
    let scenario = fingerprint(compiled.as_ref(), &source).expect("a fingerprint");
    let world = distributed_world(compiled.as_ref(), &source).expect("agents of their own");
    let welcome = Welcome {
        clock: setup.clock,
        topology: setup.topology,
        multicast_group: None,
        overrides: Vec::new(),
        logs_packets: false,
    };
    let config = ServerConfig {
        scenario: scenario.clone(),
        build: "test".into(),
        welcome,
        lease: setup.lease,
        has_faults: world.has_faults(),
    };
    let run = ManagedRun::start(&WORLDS, compiled.as_ref(), &source, 1, OutputPaths::default())
        .expect("started");
    let mut run = HostedRun::new(run, world.clone(), &NoWatcher);
    let messenger = Messenger::new(PeerId::Server, (setup.wire)(PeerId::Server));
    let nodes: Vec<JoinHandle<Result<NodeStatusReport, NodeError>>> = (0..world.agent_count()
        as EntityId)
        .map(|agent| {
            let messenger = Messenger::new(PeerId::Node(agent), (setup.wire)(PeerId::Node(agent)));
            let join = JoinRequest {
                agent,
                scenario: scenario.clone(),
                build: "test".into(),
                listens: (setup.listens)(agent),
                process: 0,
                session: None,
            };
            let world = world.clone();
            let lease = setup.lease;
            let is_liar = setup.liar == Some(agent);
            spawn(move || run_node(messenger, join, world, lease, is_liar))
        })
        .collect();
    let (flown, metrics) = FleetServer::new(messenger, &mut run, setup.hooks, config).run();
    for node in nodes {
        let ended = node.join().expect("no panic");
        match (&flown, ended) {
            (Ok(()), ended) => assert!(ended.is_ok(), "{ended:?}"),
            (Err(broken), ended) => println!("{broken}; a node: {ended:?}"),
        }
    }
    (run_result(run.into_managed_run()), flown, metrics)
}

fn run_node(
    mut messenger: Messenger,
    request: JoinRequest,
    world: Arc<dyn DistributedWorld>,
    lease: Duration,
    is_liar: bool,
) -> Result<NodeStatusReport, NodeError> {
    let agent = request.agent;
    let welcome = join(&mut messenger, &JoinConfig { join: request, timeout: TEST_TIMEOUT })?;
    let program = world.program(agent, "test");
    let program: Box<dyn AgentProgram> =
        if is_liar { Box::new(FaultyProgram(program)) } else { program };
    let node = Node::new(agent, Seat::new(messenger), program, world.channel(agent), &welcome);
    node.with_server_timeout(lease).run()
}
