//! The process integrated mechanism: one coordinator whose state migrates.
//!
//! The coordinator visits the airplanes in turn. While it is on an airplane it can read that
//! airplane's model: it lets it predict ways, which it then carries along. Its whole state is
//! serialized for every hop, and read back on the other side; these bytes are what is counted.
//! With sampled expectations it makes a tour per round, since each round has new samples; with
//! exact ones it gathers the ways of all actions in a first tour, and can then go through the
//! rounds wherever it is. A last tour brings each airplane its control.

use super::super::airplane::Prediction;
use super::super::objective::{Options, couple, own_costs};
use super::network::{Traffic, bytes_of};
use super::{Decided, Own};
use crate::collectives::{Estimator, PairwiseGame, Player, optimize};
use serde::{Deserialize, Serialize};

/// What the coordinator carries.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Coordinator {
    round: u32,
    calm: u32,
    players: Vec<Player>,
    /// Ways gathered in this tour, by airplane.
    ways: Vec<Vec<Prediction>>,
    samples: Vec<Vec<usize>>,
    own_costs: Vec<Vec<f64>>,
    separations_m: Vec<f64>,
    altitudes_m: Vec<f64>,
    /// Parts of the costs of joint samples, by airplane.
    parts: Vec<Vec<f64>>,
    chosen: Vec<usize>,
    converged: bool,
}

impl Coordinator {
    fn new(group: usize) -> Self {
        Self {
            round: 0,
            calm: 0,
            players: Vec::new(),
            ways: vec![Vec::new(); group],
            samples: vec![Vec::new(); group],
            own_costs: vec![Vec::new(); group],
            separations_m: vec![0.0; group],
            altitudes_m: vec![0.0; group],
            parts: vec![Vec::new(); group],
            chosen: Vec::new(),
            converged: false,
        }
    }
}

/// Runs the coordinator over a group.
pub(super) fn run(hosts: Vec<Own<'_>>) -> (Vec<Decided>, Traffic) {
    let mut traffic = Traffic::default();
    let mut coordinator = Coordinator::new(hosts.len());
    let expected = match hosts[0].settings().estimator {
        Estimator::Exact => exact(&mut coordinator, &hosts, &mut traffic),
        Estimator::Sampled { block, ageing } => {
            sampled(&mut coordinator, &hosts, (block, ageing), &mut traffic)
        }
    };
    // It stands on the first airplane and brings the others their controls.
    for _ in 1..hosts.len() {
        migrate(&mut coordinator, &mut traffic);
    }
    let decided = coordinator.chosen.iter().zip(expected).map(|(&chosen, expected)| Decided {
        chosen,
        expected,
        rounds: coordinator.round,
        converged: coordinator.converged,
    });
    (decided.collect(), traffic)
}

/// One hop.
fn migrate(coordinator: &mut Coordinator, traffic: &mut Traffic) {
    let bytes = bytes_of(coordinator);
    traffic.count(1, bytes.len());
    *coordinator = postcard::from_bytes(&bytes).expect("the state can be read");
}

fn exact(coordinator: &mut Coordinator, hosts: &[Own<'_>], traffic: &mut Traffic) -> Vec<Vec<f64>> {
    for host in hosts {
        let Own { me, options, .. } = host;
        coordinator.ways[*me].clone_from(&options.predictions);
        coordinator.own_costs[*me] = own_costs(&host.world.objective, options);
        coordinator.separations_m[*me] = options.separation_m;
        coordinator.altitudes_m[*me] = options.altitude_m;
        migrate(coordinator, traffic);
    }
    let levels = coordinator.separations_m.iter().zip(&coordinator.altitudes_m);
    let options =
        |(ways, (r, z)): (&Vec<Prediction>, (&f64, &f64))| Options::new(ways.clone(), *r, *z);
    let all: Vec<Options> = coordinator.ways.iter().zip(levels).map(options).collect();
    let mut game = PairwiseGame::new(coordinator.own_costs.clone());
    let world = hosts[0].world;
    for i in 0..all.len() {
        for j in i + 1..all.len() {
            couple(&mut game, &world.objective, (i, &all[i]), (j, &all[j]));
        }
    }
    let outcome = optimize(&game, &world.settings, |player, k| hosts[player].uniform(k));
    coordinator.round = outcome.rounds;
    coordinator.converged = outcome.converged;
    coordinator.chosen = outcome.joint;
    coordinator.ways.iter_mut().for_each(Vec::clear);
    coordinator.own_costs.iter_mut().for_each(Vec::clear);
    outcome.expected
}

fn sampled(
    coordinator: &mut Coordinator,
    hosts: &[Own<'_>],
    (block, ageing): (usize, f64),
    traffic: &mut Traffic,
) -> Vec<Vec<f64>> {
    let settings = *hosts[0].settings();
    coordinator.players = hosts.iter().map(|h| Player::new(h.options.predictions.len())).collect();
    while coordinator.calm < settings.stop.calm_rounds
        && coordinator.round < settings.stop.max_rounds
    {
        let drawn = u64::from(coordinator.round) * block as u64;
        for host in hosts {
            visit(coordinator, host, (drawn, block));
            migrate(coordinator, traffic);
        }
        let change = learn(coordinator, hosts, (block, ageing));
        coordinator.calm = settings.stop.calm(coordinator.calm, change);
        coordinator.round += 1;
    }
    let drawn = u64::from(coordinator.round) * block as u64;
    let choose =
        |(player, host): (&Player, &Own<'_>)| player.choose(settings.choice, host.uniform(drawn));
    coordinator.chosen = coordinator.players.iter().zip(hosts).map(choose).collect();
    coordinator.converged = coordinator.calm >= settings.stop.calm_rounds;
    coordinator.ways.iter_mut().for_each(Vec::clear);
    coordinator.players.iter().map(|p| p.expected().to_vec()).collect()
}

/// On one airplane: its samples, their ways, and what the ways already gathered cost with them.
fn visit(coordinator: &mut Coordinator, host: &Own<'_>, (drawn, block): (u64, usize)) {
    let me = host.me;
    let samples = host.samples(&coordinator.players[me], drawn, block);
    coordinator.ways[me] = samples.iter().map(|&x| host.options.predictions[x].clone()).collect();
    let own = own_costs(&host.world.objective, &host.options);
    coordinator.parts[me] = samples.iter().map(|&x| own[x]).collect();
    coordinator.separations_m[me] = host.options.separation_m;
    coordinator.altitudes_m[me] = host.options.altitude_m;
    coordinator.samples[me] = samples;
}

/// All ways of a round are known: costs, summed as everywhere else, and everybody's update.
fn learn(coordinator: &mut Coordinator, hosts: &[Own<'_>], (block, ageing): (usize, f64)) -> f64 {
    let objective = &hosts[0].world.objective;
    let n = hosts.len();
    let mut total = vec![0.0; block];
    for (k, sum) in total.iter_mut().enumerate() {
        for i in 0..n {
            let r = coordinator.separations_m[i];
            let z = &coordinator.altitudes_m;
            let near = |j: &usize| *j != i && (z[*j] - z[i]).abs() < objective.vertical_m;
            let others = (0..n).filter(near);
            *sum += others.fold(coordinator.parts[i][k], |part, j| {
                let (a, b) = (&coordinator.ways[i][k], &coordinator.ways[j][k]);
                part + objective.collision(a, b, [r, r])[0]
            });
        }
    }
    let settings = hosts[0].settings();
    let update = |(player, samples): (&mut Player, &Vec<usize>)| {
        player.learn(samples, &total, ageing);
        player.update(settings.update, settings.cooling)
    };
    let moved = coordinator.players.iter_mut().zip(&coordinator.samples).map(update);
    moved.fold(0.0, f64::max)
}
