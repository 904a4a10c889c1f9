//! A team moves as one process does, bit for bit, and not at all where it cannot be sure.

mod hostile;
mod scenarios;
mod silence;

use super::final_positions;
use super::negotiation::{NegotiationContext, first_tick, run_agents};
use crate::agents::side::NeighborSide;
use crate::agents::{
    ConnectorAgent, ConnectorControl, ConnectorPercept, ConnectorRole, Intention, LeaderOutcome,
    SensedObstacle,
};
use crate::fixtures::chains::AnyWorld;
use crate::motion::recovery::{
    InitiatorSituation, RecoveryLimits, RecoveryMemory, RecoveryOutcome,
};
use proptest::prelude::*;
use sidestep_kernel::Seed;
use sidestep_kernel::network::Network;
use sidestep_kernel::stream::Streams;
use sidestep_rods::geometry::Point;
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{
    Chain, MotionOutcome, MotionRequest, Obstacles, Propagator, ReactionRules, RequestSource,
    RequestedMotion, VetoEffect,
};

/// A network with some faults and all the time that talks need.
fn network(loss: f64, delay: f64, duplication: f64, deadline: f64) -> Network {
    Network {
        loss,
        duplication,
        latency_s: 1e-3,
        bandwidth_bit_s: f64::INFINITY,
        budget: None,
        max_delay_s: 1e-3 * delay,
        patience_s: 3e-3 * (1.0 + delay),
        deadline_s: 1e-3 * deadline,
        range_m: f64::INFINITY,
        bursts: None,
        radio_outages: Vec::new(),
        partitions: Vec::new(),
        unidirectional_links: Vec::new(),
    }
}

/// Perception of all connectors of a chain, whose sensors see everything.
fn sights<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    leader: usize,
    wish: &Intention<D>,
) -> Vec<ConnectorPercept<D>> {
    let (points, n) = (chain.points(), chain.points().len() as u32);
    let all = obstacles.still().iter().chain(obstacles.moving());
    let seen: Vec<SensedObstacle> = all.map(SensedObstacle::from_obstacle).collect();
    let sight = |k: u32| ConnectorPercept {
        cycle: 5,
        at: WirePoint(points[k as usize]),
        neighbors: NeighborSide::ALL
            .map(|side| side.neighbor(k, n).map(|j| WirePoint(points[j as usize]))),
        max_bend_rad: chain.connectors()[k as usize].max_bend_rad,
        seen: seen.clone(),
        is_silent: false,
        missing: [None; 2],
        role: if k as usize == leader {
            ConnectorRole::Leads(wish.clone())
        } else {
            ConnectorRole::Follows
        },
    };
    (0..n).map(sight).collect()
}

/// A team that makes a motion; returns its decisions.
fn talked<const D: usize>(
    (chain, obstacles, rules): (&Chain<D>, &Obstacles<D>, &ReactionRules),
    (leader, to, source): (usize, Point<D>, RequestSource),
    network: Option<&Network>,
    seed: u64,
) -> Vec<Option<ConnectorControl<D>>> {
    let is_empty = obstacles.is_empty();
    let wish = Intention {
        to: WirePoint(to),
        source,
        situation: InitiatorSituation::default(),
        memory: RecoveryMemory::default(),
        is_empty,
        is_open: is_empty && chain.is_plain(),
    };
    let agent = |k: usize| {
        ConnectorAgent::from_chain(chain, k as u32, rules, RecoveryLimits::default())
            .with_network(network)
    };
    let mut agents: Vec<_> = (0..chain.points().len()).map(agent).collect();
    let streams = Streams::new(Seed(seed));
    let talk =
        NegotiationContext { network, streams, first_id: 0, begins: (first_tick(network, 5), 0.0) };
    run_agents(talk, &mut agents, sights(chain, obstacles, leader, &wish))
}

/// Makes random motions in both ways; returns the number of those that moved something, and of the vetoes.
fn compared<const D: usize>(seed: u64, network: Option<&Network>, tries: usize) -> (usize, usize) {
    let mut world = AnyWorld::<D>::new(seed);
    let rules = ReactionRules { self_collision: false, backtracks: 0, ..world.rules };
    let mut propagator = Propagator::new(rules);
    let (mut moved, mut vetoed) = (0, 0);
    for t in 0..tries {
        let MotionRequest { motion: RequestedMotion::Connector { k, to }, .. } =
            world.any_request(0.15)
        else {
            continue;
        };
        let source = RequestSource::Operator;
        let before = world.chain.clone();
        let obstacles = &world.obstacles;
        let controls =
            talked((&before, obstacles, &rules), (k, to, source), network, seed + t as u64);
        let request = MotionRequest {
            motion: RequestedMotion::Connector { k, to },
            source,
            mode: VetoEffect::Exact,
        };
        let outcome = propagator.propagate(&mut world.chain, &world.obstacles, &request).unwrap();
        let points = final_positions(&before, &controls).unwrap_or(before.points().to_vec());
        assert_eq!(points, world.chain.points(), "seed {seed}, motion {t}: {outcome:?}");
        let ended = controls[k].as_ref().and_then(|control| control.ended.clone());
        let climbed = match outcome.clone() {
            MotionOutcome::Moved(moved) => RecoveryOutcome::Straight(moved),
            MotionOutcome::Vetoed(veto) => RecoveryOutcome::Vetoed(veto),
        };
        match ended {
            Some(LeaderOutcome::Climbed { climbed: told, .. }) => {
                assert_eq!(told, climbed, "seed {seed}, motion {t}")
            }
            other => panic!("seed {seed}, motion {t}: {other:?}"),
        }
        moved += usize::from(outcome.motion().is_some_and(|m| m.changed > 1));
        vetoed += usize::from(outcome.veto().is_some());
    }
    (moved, vetoed)
}

/// The chain of a world after one process has moved it.
fn compared_on<const D: usize>(
    world: &mut AnyWorld<D>,
    rules: &ReactionRules,
    (k, to): (usize, Point<D>),
) -> Chain<D> {
    let motion = RequestedMotion::Connector { k, to };
    let request =
        MotionRequest { motion, source: RequestSource::Operator, mode: VetoEffect::Exact };
    let moved = Propagator::new(*rules).propagate(&mut world.chain, &world.obstacles, &request);
    assert!(moved.is_ok_and(|outcome| outcome.motion().is_some()));
    world.chain.clone()
}

#[test]
fn a_team_moves_as_one_process_does_bit_for_bit() {
    let (mut moved, mut vetoed) = (0, 0);
    for seed in 0..150 {
        for (m, v) in [compared::<2>(seed, None, 12), compared::<3>(seed, None, 12)] {
            (moved, vetoed) = (moved + m, vetoed + v);
        }
    }
    assert!(moved > 500 && vetoed > 200, "{moved} moved, {vetoed} vetoed");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Packets that are lost, doubled and overtaken cost time and nothing else.
    #[test]
    fn losses_cost_time_and_not_agreement(
        seed in 0u64..1000, loss in 0.0f64..0.3, delay in 0.0f64..5.0, duplication in 0.0f64..0.3,
    ) {
        let network = network(loss, delay, duplication, 1e6);
        compared::<2>(seed, Some(&network), 3);
        compared::<3>(seed, Some(&network), 3);
    }
}
