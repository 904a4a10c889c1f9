//! Colors a map with probability collectives: no airplane in sight.
//!
//! `cargo run -p sidestep-collectives --example graph_coloring`
//!
//! Every country is a player, its strategies are the colors, and two neighbors of one color
//! cost 1. Countries only ever learn from the cost of their own color.

use sidestep_collectives::{
    Choice, Estimator, Game, OptimizerConfig, PairwiseGame, StopCriterion, Update, UpdateOrder,
    Utility, optimize,
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
        let same = |k: usize| f64::from(u8::from(k / COLORS.len() == k % COLORS.len()));
        game.add_pair(a, b, (0..COLORS.len() * COLORS.len()).map(same).collect());
    }
    let settings = OptimizerConfig {
        estimator: Estimator::Sampled { block: 30, ageing: 0.5 },
        update: Update::NearestNewton { step: 0.3 },
        order: UpdateOrder::Sequence,
        utility: Utility::Private,
        cooling: 0.95,
        stop: StopCriterion { threshold: 1e-3, calm_rounds: 3, max_rounds: 500 },
        choice: Choice::Argmax,
    };
    let streams = Streams::new(Seed(1));
    let outcome = optimize(&game, &settings, |country, k| {
        let words = streams.block(country as u32, k, Purpose(1), 0);
        f64::from(words[0]) / 4_294_967_296.0
    });
    for (country, &color) in COUNTRIES.iter().zip(&outcome.joint) {
        println!("{country:<12} {}", COLORS[color]);
    }
    let clashes = game.cost(&outcome.joint);
    let end = if outcome.converged { "settled" } else { "stopped" };
    println!("{clashes} borders between equal colors; {end} after {} rounds", outcome.rounds);
}
