//! In lockstep a fleet gives the same results as one process: in threads, over memory and over sockets.

use crate::support::{
    FleetSetup, NoHooks, TEST_TIMEOUT, run_in_one_process, run_in_threads, superconflict,
};
use sidestep::kernel::EntityId;
use sidestep_link::protocol::{ClockMode, Topology};
use sidestep_link::wire::endpoint::reserve_port;
use sidestep_link::wire::memory::MemoryHub;
use sidestep_link::wire::zenoh::ZenohWire;
use sidestep_link::wire::{PeerId, Wire};
use std::time::Duration;

/// Deployments in which each airplane has a program of its own.
const DEPLOYMENTS: [&str; 4] = ["team", "compact-team", "pim", "hierarchical-pim"];

const BAD_NETWORK: &str = "network = { loss = 0.1, duplication = 0.1, max_delay_s = 0.003, \
    bursts = { loss = 0.8, lasts_s = 3, every_s = 20 }, range_m = 2500, \
    silent = [{ airplane = 2, from_s = 40, until_s = 80 }], \
    partitions = [{ sides = [[0, 1], [2, 3]], from_s = 20, until_s = 50 }], \
    one_way = [{ sender = 0, receiver = 3, from_s = 60 }] }";

pub(crate) fn run_over_memory(text: &str) -> crate::support::RunResult {
    let exchange = MemoryHub::default();
    let setup = FleetSetup {
        clock: ClockMode::Lockstep,
        topology: Topology::Star,
        lease: TEST_TIMEOUT,
        wire: &|me| Box::new(exchange.open_wire(me)),
        listens: &|_| Vec::new(),
        hooks: &mut NoHooks,
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
        let (clock, lease) = (ClockMode::Lockstep, Duration::from_secs(10));
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
