//! How good the joint actions are that the optimizer finds, beside other algorithms of distributed constraint
//! optimization, on random games of airplanes.
//!
//! `cargo bench -p sidestep-airspace --bench optima [-- --games FILE]`; with a file the games are also written as JSON, for
//! `benches/optima/beside_toulbar2.py`, which solves them with toulbar2.

use cpu_time::ProcessTime;
use sidestep_airspace::flight::{
    AfterLastWaypoint, AircraftModel, Autopilot, ChangeAlternatives, DetourAlternatives,
    FlightLevelRange, Frame, Pose2, TimeDiscretization, WaypointRule, actions,
};
use sidestep_airspace::objective::{ActionPredictions, Objective, build_group_game};
use sidestep_collectives::{
    Choice, Estimator, Game, LocalSearch, OptimizerConfig, PairwiseGame, StopCriterion, Update,
    UpdateOrder, Utility, find_minimum, optimize, tight_lower_bound,
};
use sidestep_kernel::Seed;
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use std::f64::consts::{PI, TAU};

/// Games of each number of airplanes.
const GAMES: u32 = 60;
/// Restarts of pair moves that stand for the minimum where branch and bound takes too long.
const RESTARTS: u32 = 2_000;
/// Partial joint actions that branch and bound looks at in a game.
const MAX_NODES: u64 = 100_000;
/// Added to both costs of a ratio, which has no sense where the least cost is 0.
const TINY: f64 = 1e-6;

const TIMING: TimeDiscretization = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 100 };

fn draws(game: u32, n: u32, purpose: u16) -> Draws {
    Streams::new(Seed(u64::from(n))).draws(game, 0, Purpose(purpose))
}

/// Returns the game of `n` airplanes that fly through a disc in which all meet, in any direction.
fn random_game(n: u32, number: u32) -> PairwiseGame {
    let model = AircraftModel {
        v_m_s: 35.0,
        omega_max_rad_s: 4f64.to_radians(),
        separation_m: 500.0,
        turns: 5,
    };
    let objective = Objective {
        alpha: 0.001,
        beta: 0.995,
        inflation: 1.08,
        mask: true,
        vertical_m: 300.0,
        level_weight: 1.0,
        speed_weight: 0.0,
    };
    let actions = actions(
        &model,
        TIMING.dt_s,
        &[],
        &DetourAlternatives::default_preset(),
        &ChangeAlternatives::default(),
    );
    let mut draws = draws(number, n, 1);
    let radius_m = 1500.0 * f64::from(n).sqrt();
    let options: Vec<ActionPredictions> = (0..n)
        .map(|_| {
            let angle = TAU * draws.uniform();
            let from_m = radius_m * (0.6 + 0.4 * draws.uniform());
            let heading_rad = angle + PI + 0.8 * (draws.uniform() - 0.5);
            let at = [from_m * cos(angle), from_m * sin(angle)];
            let goal = [0, 1]
                .map(|k: usize| at[k] + 2.5 * radius_m * [cos(heading_rad), sin(heading_rad)][k]);
            let pilot = Autopilot {
                model: &model,
                mission: &[goal],
                passing: WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: false },
                after: AfterLastWaypoint::Straight,
                dtau_s: TIMING.dtau_s,
            };
            let predictions = actions
                .iter()
                .map(|action| pilot.predict(action.turn, Pose2 { at, heading_rad }, 0, &TIMING))
                .collect();
            ActionPredictions::new(
                predictions,
                Frame::PLANE,
                model.separation_m,
                FlightLevelRange::from_level(0.0),
            )
        })
        .collect();
    build_group_game(&objective, &options)
}

/// Returns the settings of the default preset, with or without its local search.
fn settings(local_search: LocalSearch, random_starts: u32) -> OptimizerConfig {
    OptimizerConfig {
        estimator: Estimator::Exact,
        update: Update::NearestNewton { step: 0.5 },
        order: UpdateOrder::Sequence,
        utility: Utility::Joint,
        cooling: if local_search == LocalSearch::None { 0.7 } else { 0.5 },
        stop: StopCriterion { threshold: 1e-3, calm_rounds: 3, max_rounds: 200 },
        choice: Choice::Argmax,
        local_search,
        random_starts,
    }
}

fn uniform(player: usize, k: u64) -> f64 {
    Streams::new(Seed(1)).draws(player as u32, k, Purpose(2)).uniform()
}

/// A game as the other algorithms see it: costs of each player beside the strategies of the others.
struct Network<'g> {
    game: &'g PairwiseGame,
    pairs: Vec<(usize, usize, &'g [f64])>,
    neighbors: Vec<Vec<usize>>,
}

impl<'g> Network<'g> {
    fn new(game: &'g PairwiseGame) -> Self {
        let players = game.strategies().len();
        let neighbors = (0..players).map(|player| game.neighbors(player).collect()).collect();
        Self { game, pairs: game.pair_costs().collect(), neighbors }
    }

    fn cost_of(&self, (a, b, costs): (usize, usize, &[f64]), x_a: usize, x_b: usize) -> f64 {
        debug_assert!(a != b);
        costs[x_a * self.game.strategies()[b] + x_b]
    }

    /// Returns the costs of a player's strategies beside those of the others.
    fn costs_given(&self, player: usize, joint: &[usize]) -> Vec<f64> {
        let mut given = self.game.own_costs(player).to_vec();
        for &pair in self.pairs.iter().filter(|(a, b, _)| *a == player || *b == player) {
            for (x, sum) in given.iter_mut().enumerate() {
                *sum += if pair.0 == player {
                    self.cost_of(pair, x, joint[pair.1])
                } else {
                    self.cost_of(pair, joint[pair.0], x)
                };
            }
        }
        given
    }

    /// Returns the best move of two players and what it saves.
    fn best_of_two(&self, a: usize, b: usize, joint: &[usize]) -> (f64, [usize; 2]) {
        let pair = *self
            .pairs
            .iter()
            .find(|(i, j, _)| (*i, *j) == (a.min(b), a.max(b)))
            .expect("neighbors share a pair");
        let [i, j] = [pair.0, pair.1];
        let [of_i, of_j] = [i, j].map(|player| self.costs_given(player, joint));
        let total = |x: usize, y: usize| {
            of_i[x] - self.cost_of(pair, x, joint[j]) + of_j[y] - self.cost_of(pair, joint[i], y)
                + self.cost_of(pair, x, y)
        };
        let now = total(joint[i], joint[j]);
        let mut best = (0.0, [joint[i], joint[j]]);
        for x in 0..of_i.len() {
            for y in 0..of_j.len() {
                let gain = now - total(x, y);
                if gain > best.0 {
                    best = (gain, [x, y]);
                }
            }
        }
        if i == a { best } else { (best.0, [best.1[1], best.1[0]]) }
    }
}

fn lowest(costs: &[f64]) -> usize {
    let mut best = 0;
    for x in 1..costs.len() {
        if costs[x] < costs[best] {
            best = x;
        }
    }
    best
}

/// MGM-2 as published (Maheswaran, Pearce and Tambe 2004): half of the players offer a move of two to a random neighbor.
fn mgm_2(network: &Network<'_>, draws: &mut Draws) -> Vec<usize> {
    /// Rounds; later ones change nothing in these games.
    const ROUNDS: usize = 60;
    let players = network.neighbors.len();
    let mut joint: Vec<usize> =
        (0..players).map(|player| lowest(network.game.own_costs(player))).collect();
    for _ in 0..ROUNDS {
        let offers: Vec<Option<usize>> = (0..players)
            .map(|player| {
                let all = &network.neighbors[player];
                let is_offerer = draws.uniform() < 0.5 && !all.is_empty();
                let chosen =
                    ((draws.uniform() * all.len() as f64) as usize).min(all.len().max(1) - 1);
                is_offerer.then(|| all[chosen])
            })
            .collect();
        let mut plans: Vec<(f64, usize, Option<usize>)> = (0..players)
            .map(|player| {
                let given = network.costs_given(player, &joint);
                let best = lowest(&given);
                (given[joint[player]] - given[best], best, None)
            })
            .collect();
        // One that has not offered accepts the best offer to it.
        for receiver in (0..players).filter(|&player| offers[player].is_none()) {
            let senders = (0..players).filter(|&sender| offers[sender] == Some(receiver));
            let best = senders
                .map(|sender| (network.best_of_two(sender, receiver, &joint), sender))
                .max_by(|(a, _), (b, _)| a.0.total_cmp(&b.0));
            if let Some(((gain, [x, y]), sender)) = best
                && gain > plans[receiver].0
            {
                plans[sender] = (gain, x, Some(receiver));
                plans[receiver] = (gain, y, Some(sender));
            }
        }
        let wins = |player: usize| {
            let (gain, _, partner) = plans[player];
            let mut others = network.neighbors[player].iter().filter(|&&o| Some(o) != partner);
            gain > 0.0 && others.all(|&other| plans[other].0 < gain)
        };
        let moves: Vec<usize> = (0..players)
            .filter(|&player| wins(player) && plans[player].2.is_none_or(wins))
            .collect();
        for player in moves {
            joint[player] = plans[player].1;
        }
    }
    joint
}

/// Max-sum (Farinelli et al. 2008), here of costs, with damped messages; the best joint action of all rounds.
fn max_sum(network: &Network<'_>) -> Vec<usize> {
    const ROUNDS: usize = 60;
    const DAMPING: f64 = 0.5;
    let players = network.neighbors.len();
    let strategies = network.game.strategies();
    // From each pair to its two players.
    let mut messages: Vec<[Vec<f64>; 2]> = network
        .pairs
        .iter()
        .map(|(a, b, _)| [vec![0.0; strategies[*a]], vec![0.0; strategies[*b]]])
        .collect();
    let mut best: Option<(f64, Vec<usize>)> = None;
    for _ in 0..ROUNDS {
        let mut sums: Vec<Vec<f64>> =
            (0..players).map(|player| network.game.own_costs(player).to_vec()).collect();
        for ((a, b, _), [to_a, to_b]) in network.pairs.iter().zip(&messages) {
            sums[*a].iter_mut().zip(to_a).for_each(|(sum, m)| *sum += m);
            sums[*b].iter_mut().zip(to_b).for_each(|(sum, m)| *sum += m);
        }
        let joint: Vec<usize> = sums.iter().map(|sum| lowest(sum)).collect();
        let cost = network.game.cost(&joint);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, joint));
        }
        for (&pair, [to_a, to_b]) in network.pairs.iter().zip(&mut messages) {
            let from_a: Vec<f64> = sums[pair.0].iter().zip(&*to_a).map(|(s, m)| s - m).collect();
            let from_b: Vec<f64> = sums[pair.1].iter().zip(&*to_b).map(|(s, m)| s - m).collect();
            let new_a = (0..from_a.len()).map(|x| {
                let all = (0..from_b.len()).map(|y| network.cost_of(pair, x, y) + from_b[y]);
                all.fold(f64::INFINITY, f64::min)
            });
            let new_b = (0..from_b.len()).map(|y| {
                let all = (0..from_a.len()).map(|x| network.cost_of(pair, x, y) + from_a[x]);
                all.fold(f64::INFINITY, f64::min)
            });
            for (message, new) in [(to_a, new_a.collect::<Vec<_>>()), (to_b, new_b.collect())] {
                // Costs relative to the least one, because those of a loop would grow without end.
                let least = new.iter().copied().fold(f64::INFINITY, f64::min);
                for (m, new) in message.iter_mut().zip(new) {
                    *m = DAMPING * *m + (1.0 - DAMPING) * (new - least);
                }
            }
        }
    }
    best.map_or_else(Vec::new, |(_, joint)| joint)
}

/// Best response of one player after the other, from random starts.
fn best_responses(network: &Network<'_>, draws: &mut Draws, starts: u32) -> Vec<usize> {
    let strategies = network.game.strategies();
    let mut best: Option<(f64, Vec<usize>)> = None;
    for _ in 0..starts {
        let mut joint: Vec<usize> = strategies
            .iter()
            .map(|&n| ((draws.uniform() * n as f64) as usize).min(n - 1))
            .collect();
        loop {
            let before = joint.clone();
            for player in 0..joint.len() {
                let given = network.costs_given(player, &joint);
                let x = lowest(&given);
                if given[x] < given[joint[player]] {
                    joint[player] = x;
                }
            }
            if joint == before {
                break;
            }
        }
        let cost = network.game.cost(&joint);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, joint));
        }
    }
    best.map_or_else(Vec::new, |(_, joint)| joint)
}

/// The costs that an algorithm has reached, relative to the least ones known, and its time.
#[derive(Default)]
struct Reached {
    name: &'static str,
    ratios: Vec<f64>,
    cpu_s: f64,
}

impl Reached {
    fn print(&mut self) {
        self.ratios.sort_by(f64::total_cmp);
        let count = self.ratios.len();
        let minima = self.ratios.iter().filter(|ratio| **ratio < 1.0 + 1e-6).count();
        println!(
            "  {:32} minimum in {:5.1} %, G over the least: median {:.3}, 90 % {:7.3}, worst {:9.2}; {:.3} ms",
            self.name,
            100.0 * minima as f64 / count as f64,
            self.ratios[count / 2],
            self.ratios[count * 9 / 10],
            self.ratios[count - 1],
            1e3 * self.cpu_s / count as f64,
        );
    }
}

type Algorithm<'a> = (&'static str, Box<dyn Fn(&PairwiseGame) -> Vec<usize> + 'a>);

fn algorithms<'a>() -> Vec<Algorithm<'a>> {
    let ours = |search, starts| {
        move |game: &PairwiseGame| optimize(game, &settings(search, starts), uniform).joint
    };
    vec![
        ("rounds alone", Box::new(ours(LocalSearch::None, 0))),
        ("rounds and local search (default)", Box::new(ours(LocalSearch::Pairs, 8))),
        ("and branch and bound", Box::new(ours(LocalSearch::BranchAndBound, 8))),
        ("best response, 20 starts", {
            Box::new(|game| best_responses(&Network::new(game), &mut draws(0, 0, 3), 20))
        }),
        ("MGM-2", Box::new(|game| mgm_2(&Network::new(game), &mut draws(0, 0, 4)))),
        ("max-sum", Box::new(|game| max_sum(&Network::new(game)))),
    ]
}

/// How tight the lower bounds are, and how long the search for the minimum takes from the default's joint action.
#[derive(Default)]
struct Bounds {
    /// The bound that every optimization tells, relative to the least cost known.
    told: Vec<f64>,
    tight: Vec<f64>,
    minimum_s: Vec<f64>,
    proved: u32,
}

impl Bounds {
    /// Adds a game, and returns the least cost that is known. `found` are joint actions, that of the default second.
    fn add(&mut self, game: &PairwiseGame, found: &[Vec<usize>]) -> f64 {
        let started = ProcessTime::now();
        let minimum = find_minimum(game, &found[1], MAX_NODES);
        self.minimum_s.push(started.elapsed().as_secs_f64());
        self.proved += u32::from(minimum.is_proved);
        let mut least = minimum.cost;
        if !minimum.is_proved {
            let restarts = settings(LocalSearch::Pairs, RESTARTS);
            least = least.min(optimize(game, &restarts, uniform).cost);
            least = found.iter().fold(least, |least, joint| least.min(game.cost(joint)));
        }
        let share = |bound: f64| (bound + TINY) / (least + TINY);
        self.told.push(share(game.lower_bound()));
        self.tight.push(share(tight_lower_bound(game, &found[1])));
        least
    }

    fn print(&mut self) {
        let Self { told, tight, minimum_s, proved } = self;
        for all in [&mut *told, tight, minimum_s] {
            all.sort_by(f64::total_cmp);
        }
        let count = told.len();
        println!(
            "  bound over the least: told {:.3}, tight {:.3} in the median, {:.3} and {:.3} in one of ten",
            told[count / 2],
            tight[count / 2],
            told[count / 10],
            tight[count / 10],
        );
        println!(
            "  minimum proved in {proved} of {count}: median {:.3} ms, 90 % {:.3} ms, longest {:.1} ms",
            1e3 * minimum_s[count / 2],
            1e3 * minimum_s[count * 9 / 10],
            1e3 * minimum_s[count - 1],
        );
    }
}

fn game_json(game: &PairwiseGame, least: f64) -> serde_json::Value {
    let own: Vec<&[f64]> =
        (0..game.strategies().len()).map(|player| game.own_costs(player)).collect();
    let pairs: Vec<_> = game.pair_costs().collect();
    serde_json::json!({ "own": own, "pairs": pairs, "least": least })
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let games_file = args.iter().position(|arg| arg == "--games").and_then(|k| args.get(k + 1));
    let mut written = Vec::new();
    for n in [2, 3, 4, 6, 8, 10, 20] {
        let all = algorithms();
        let mut reached: Vec<Reached> =
            all.iter().map(|(name, _)| Reached { name, ..Reached::default() }).collect();
        let mut bounds = Bounds::default();
        // Games in which nobody meets have nothing to find.
        let games = (0..).map(|number| random_game(n, number));
        let games = games.filter(|game| game.pair_costs().next().is_some()).take(GAMES as usize);
        for game in games {
            let mut found = Vec::new();
            for ((_, run), reached) in all.iter().zip(&mut reached) {
                let started = ProcessTime::now();
                found.push(run(&game));
                reached.cpu_s += started.elapsed().as_secs_f64();
            }
            let least = bounds.add(&game, &found);
            for (joint, reached) in found.iter().zip(&mut reached) {
                reached.ratios.push((game.cost(joint) + TINY) / (least + TINY));
            }
            if games_file.is_some() {
                written.push(game_json(&game, least));
            }
        }
        println!("{n} airplanes, {GAMES} games:");
        reached.iter_mut().for_each(Reached::print);
        bounds.print();
    }
    if let Some(file) = games_file {
        let text = serde_json::to_vec(&written).expect("plain data");
        std::fs::write(file, text).expect("the file of games can be written");
    }
}
