//! Colors a map with probability collectives.
//!
//! `cargo run -p sidestep-collectives --example graph_coloring`
//!
//! Every country is a player, its strategies are the colors, and two neighbors of one color
//! cost 1. Countries learn only from the cost of their own color.

use sidestep_collectives::{
    Choice, Estimator, Game, LocalSearch, OptimizerConfig, PairwiseGame, StopCriterion, Update,
    UpdateOrder, Utility, optimize,
};
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};

const COUNTRIES: [&str; 8] =
    ["Portugal", "Spain", "France", "Belgium", "Germany", "Switzerland", "Italy", "Austria"];
const BORDERS: [(usize, usize); 11] =
    [(0, 1), (1, 2), (2, 3), (2, 4), (2, 5), (2, 6), (3, 4), (4, 5), (4, 7), (5, 6), (6, 7)];
const COLORS: [&str; 3] = ["red", "green", "blue"];

fn main() {
    let mut game = PairwiseGame::new(vec![vec![0.0; COLORS.len()]; COUNTRIES.len()]);
    for (a, b) in BORDERS {
        let mut costs = Vec::new();
        for color_a in 0..COLORS.len() {
            for color_b in 0..COLORS.len() {
                costs.push(if color_a == color_b { 1.0 } else { 0.0 });
            }
        }
        game.add_pair(a, b, costs);
    }
    let config = OptimizerConfig {
        estimator: Estimator::Sampled { block: 30, ageing: 0.5 },
        update: Update::NearestNewton { step: 0.3 },
        order: UpdateOrder::Sequence,
        utility: Utility::Private,
        cooling: 0.95,
        stop: StopCriterion { threshold: 1e-3, calm_rounds: 3, max_rounds: 500 },
        choice: Choice::Argmax,
        local_search: LocalSearch::None,
        random_starts: 0,
    };
    let streams = Streams::new(Seed(1));
    let result = optimize(&game, &config, |country, k| {
        let words = streams.block(country as u32, k, Purpose(1), 0);
        f64::from(words[0]) / 4_294_967_296.0
    });
    for (country, &color) in COUNTRIES.iter().zip(&result.joint) {
        println!("{country:<12} {}", COLORS[color]);
    }
    let clashes = game.cost(&result.joint);
    let end = if result.converged { "converged" } else { "stopped" };
    println!("{clashes} borders between equal colors; {end} after {} rounds", result.rounds);
}
