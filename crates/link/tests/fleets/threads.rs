//! In lockstep a fleet gives the same results as one process: in threads, over memory and over sockets.

use crate::support::{
    FleetSetup, NoHooks, RunResult, TEST_TIMEOUT, run_in_one_process, run_in_threads,
    superconflict, two_chains,
};
use sidestep::kernel::EntityId;
use sidestep_link::protocol::{ClockMode, Message, Topology, TransportFrame};
use sidestep_link::server::{FleetContext, FleetError, ServerHooks};
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_link::wire::memory::{MemoryHub, MemoryWire};
use sidestep_link::wire::zenoh::ZenohWire;
use sidestep_link::wire::{PeerId, Wire};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Deployments in which each airplane has a program of its own.
const DEPLOYMENTS: [&str; 4] = ["team", "compact-team", "pim", "hierarchical-pim"];

const BAD_NETWORK: &str = "network = { loss = 0.1, duplication = 0.1, max_delay_s = 0.003, \
    bursts = { loss = 0.8, lasts_s = 3, every_s = 20 }, range_m = 2500, \
    silent = [{ airplane = 2, from_s = 40, until_s = 80 }], \
    partitions = [{ sides = [[0, 1], [2, 3]], from_s = 20, until_s = 50 }], \
    one_way = [{ sender = 0, receiver = 3, from_s = 60 }] }";

pub(crate) fn run_over_memory(text: &str) -> RunResult {
    run_over(text, &mut NoHooks, |_, wire| Box::new(wire))
}

/// Flies a scenario in threads, with the wire that `wrap` makes of each peer's.
fn run_over(
    text: &str,
    hooks: &mut dyn ServerHooks,
    wrap: impl Fn(PeerId, MemoryWire) -> Box<dyn Wire>,
) -> RunResult {
    let exchange = MemoryHub::default();
    let setup = FleetSetup {
        clock: ClockMode::Lockstep,
        topology: Topology::Star,
        lease: TEST_TIMEOUT,
        wire: &|me| wrap(me, exchange.open_wire(me)),
        listens: &|_| Vec::new(),
        hooks,
        liar: None,
    };
    let (result, flown, metrics) = run_in_threads(text, setup);
    flown.expect("flown to the end");
    assert_eq!((metrics.late_controls, metrics.invalid_controls), (0, 0));
    result
}

#[test]
fn threads_come_out_as_one_process_does_in_every_deployment() {
    for deployment in DEPLOYMENTS {
        let text = superconflict(4, deployment, 30, "");
        assert_eq!(run_over_memory(&text), run_in_one_process(&text), "{deployment}");
    }
}

/// Levels and speeds are commanded, some of them not cleared, and messages lost.
#[test]
fn threads_come_out_as_one_process_does_where_levels_and_speeds_are_commanded() {
    let mvp = "method = \"mvp\"\nmvp = { resolution = \"heading-speed-vertical\" }";
    for (deployment, network) in [("team", ""), ("replica-team", BAD_NETWORK)] {
        let text = superconflict(4, deployment, 20, &format!("{mvp}\n{network}"));
        assert_eq!(run_over_memory(&text), run_in_one_process(&text), "{deployment}");
        let tuples = superconflict(4, deployment, 12, &format!("level_weight = 0.01\n{network}"))
            + "[airplane]\nlevel_changes_m = [-310.0, 310.0]\nspeed_changes_m_s = [-5.0]\n";
        assert_eq!(run_over_memory(&tuples), run_in_one_process(&tuples), "{deployment}");
    }
}

/// A wire at which frames of different senders arrive in an order of its own, some of them later than they could: as where
/// a machine gives its time to others.
struct LoadedWire {
    wire: MemoryWire,
    waiting: BTreeMap<PeerId, VecDeque<Vec<u8>>>,
    /// State of a linear congruential generator.
    draws: u64,
}

impl LoadedWire {
    fn draw(&mut self, below: usize) -> usize {
        self.draws = self.draws.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.draws >> 33) as usize % below
    }

    fn keep(&mut self, frame: Vec<u8>) {
        let from = TransportFrame::<Message>::decode(&frame).expect("a frame").from;
        self.waiting.entry(from).or_default().push_back(frame);
    }
}

impl Wire for LoadedWire {
    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        self.wire.send(to, frame);
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        if self.waiting.is_empty() {
            let frame = self.wire.receive(within)?;
            self.keep(frame);
        }
        while let Some(frame) = self.wire.receive(Duration::ZERO) {
            self.keep(frame);
        }
        if self.draw(3) == 0 {
            return None;
        }
        let k = self.draw(self.waiting.len());
        let from = *self.waiting.keys().nth(k)?;
        let frames = self.waiting.get_mut(&from)?;
        let frame = frames.pop_front();
        if frames.is_empty() {
            self.waiting.remove(&from);
        }
        frame
    }
}

#[test]
fn the_order_in_which_packets_of_different_agents_arrive_changes_nothing() {
    let airplanes = DEPLOYMENTS.map(|deployment| superconflict(4, deployment, 8, ""));
    for (k, text) in airplanes.into_iter().chain([two_chains(5, 20, "")]).enumerate() {
        let loaded = run_over(&text, &mut NoHooks, |me, wire| {
            let me = if let PeerId::Node(agent) = me { u64::from(agent) + 1 } else { 0 };
            let draws = 1_000 * k as u64 + me;
            Box::new(LoadedWire { wire, waiting: BTreeMap::new(), draws })
        });
        assert_eq!(loaded, run_in_one_process(&text), "{text}");
    }
}

/// The wire of a node that loses the first frames which the node sends after the fleet's end.
struct LossyFarewell {
    wire: MemoryWire,
    /// Number of frames that are lost yet; none before the end.
    losses: Option<u32>,
}

impl Wire for LossyFarewell {
    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        match &mut self.losses {
            Some(left) if *left > 0 => *left -= 1,
            _ => self.wire.send(to, frame),
        }
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        let frame = self.wire.receive(within)?;
        let read = TransportFrame::<Message>::decode(&frame).expect("a frame");
        if read.message == Some(Message::End) {
            // The last status and the goodbye, twice each: the third time is later than half a second.
            self.losses.get_or_insert(4);
        }
        Some(frame)
    }
}

/// The packets that nodes have counted, at the end, and whether all nodes have said goodbye.
#[derive(Default)]
struct LastCounts {
    packets: u64,
    have_left: bool,
}

impl ServerHooks for LastCounts {
    fn on_poll(&mut self, _: &FleetContext<'_>) -> Result<Vec<(EntityId, String)>, FleetError> {
        Ok(Vec::new())
    }

    fn on_end(&mut self, fleet: &FleetContext<'_>) {
        self.packets = fleet.nodes.values().map(|node| node.status.packets).sum();
        self.have_left = fleet.nodes.values().all(|node| node.has_left);
    }
}

#[test]
fn what_nodes_say_last_is_waited_for_where_it_is_lost_on_its_way() {
    let text = superconflict(3, "compact-team", 4, "");
    let mut counts = LastCounts::default();
    let result = run_over(&text, &mut counts, |me, wire| match me {
        PeerId::Server => Box::new(wire),
        PeerId::Node(_) => Box::new(LossyFarewell { wire, losses: None }),
    });
    assert!(counts.have_left, "all have said goodbye");
    assert_eq!(result.metrics["messages"], counts.packets);
}

#[test]
fn the_scenarios_own_faults_are_the_same_ones_in_threads_to_the_last_message() {
    for deployment in DEPLOYMENTS {
        let text = superconflict(4, deployment, 20, BAD_NETWORK);
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["contacts_lost"].as_u64() > Some(0), "{}", one.metrics);
        assert_eq!(threads, one, "{deployment}");
    }
}

/// Each sees no more than those near it, and finds its group from their beacons.
#[test]
fn airplanes_that_find_their_groups_come_out_as_in_one_process() {
    for more in ["groups = \"heard\"".to_string(), format!("groups = \"heard\"\n{BAD_NETWORK}")] {
        let text = superconflict(4, "compact-team", 20, &more);
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["beacons"].as_u64() > Some(0), "{}", one.metrics);
        assert_eq!(threads, one, "{more}");
    }
}

#[test]
fn messages_that_take_time_by_their_size_take_it_in_threads_too() {
    let text = superconflict(4, "team", 6, "network = { bandwidth_bit_s = 1e6, loss = 0.05 }");
    assert_eq!(run_over_memory(&text), run_in_one_process(&text));
}

/// The budget of a radio spaces the packets of each agent out, and drops those that are too late, in a process of its own
/// as in one process.
#[test]
fn the_budget_of_a_radio_defers_and_drops_the_same_messages_in_threads() {
    for network in ["budget_bytes_s = 4000.0", "budget_bytes_s = 20000.0, loss = 0.05"] {
        let text = superconflict(4, "compact-team", 12, &format!("network = {{ {network} }}"));
        let (threads, one) = (run_over_memory(&text), run_in_one_process(&text));
        assert!(one.metrics["budget_dropped"].as_u64() > Some(0), "{}", one.metrics);
        assert_eq!(threads, one, "{network}");
    }
}

/// Sockets of this machine, in both topologies.
#[test]
fn sockets_come_out_as_one_process_does_in_a_mesh_and_in_a_star() {
    for (topology, more) in
        [(Topology::Mesh, ""), (Topology::Star, ""), (Topology::Mesh, BAD_NETWORK)]
    {
        let text = superconflict(4, "compact-team", 12, more);
        let count = if topology == Topology::Mesh { 5 } else { 1 };
        // All are held at once, so that they differ.
        let held: Vec<_> =
            (0..count).map(|_| reserve_port("tcp/127.0.0.1:0").expect("a free port")).collect();
        let mut ports: Vec<String> = held.iter().map(|held| held.endpoint.clone()).collect();
        drop(held);
        let server = ports.remove(0);
        let listens = |agent: EntityId| ports.get(agent as usize).cloned().into_iter().collect();
        let wire = |me: PeerId| -> Box<dyn Wire> {
            let at = std::slice::from_ref(&server);
            let PeerId::Node(agent) = me else {
                return Box::new(ZenohWire::server_wire(at, None).expect("a server"));
            };
            let wire =
                ZenohWire::node_wire(me, at, None, TEST_TIMEOUT).expect("the server answers");
            let held = ports.get(agent as usize).map(|port| reserve_port(port).expect("free"));
            Box::new(wire.with_listeners(held.into_iter().collect()))
        };
        let (clock, lease) = (ClockMode::Lockstep, TEST_TIMEOUT);
        let setup = FleetSetup {
            clock,
            topology,
            lease,
            wire: &wire,
            listens: &listens,
            hooks: &mut NoHooks,
            liar: None,
        };
        let (result, flown, _) = run_in_threads(&text, setup);
        flown.expect("flown to the end");
        assert_eq!(result, run_in_one_process(&text), "{topology:?} {more}");
    }
}

/// A control that cannot be flown is refused and counted, and the airplane stays on its orbit; so do those of its group where
/// the network is reliable, because plans are safe only if all fly them.
#[test]
fn a_node_that_says_nonsense_is_counted_and_harms_nobody() {
    let exchange = MemoryHub::default();
    let text = superconflict(3, "compact-team", 8, "");
    let setup = FleetSetup {
        clock: ClockMode::Lockstep,
        topology: Topology::Star,
        lease: TEST_TIMEOUT,
        wire: &|me| Box::new(exchange.open_wire(me)),
        listens: &|_| Vec::new(),
        hooks: &mut NoHooks,
        liar: Some(1),
    };
    let (result, flown, metrics) = run_in_threads(&text, setup);
    flown.expect("flown to the end");
    assert_eq!(metrics.invalid_controls, 8);
    assert_eq!(result.metrics["losses_of_separation"], 0);
}
