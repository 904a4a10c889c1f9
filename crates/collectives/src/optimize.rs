//! The rounds: estimate, update, cool, until the distributions have converged.

use super::game::{Game, PairwiseGame};
use super::local_search::{LocalSearch, is_at_bound, run_descents, start_strategies};
use super::minimum::{Minimum, find_minimum};
use super::player::{Choice, Player, Update, Utility};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::interrupt;

/// Largest number of partial joint moves that branch and bound looks at: about 50 ms. Nine of ten random games of twenty
/// airplanes are solved in 4 ms.
const MAX_NODES: u64 = 10_000;

/// The estimator of `E[G | x_i]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind", from = "EstimatorTable")]
#[schemars(with = "EstimatorTable")]
pub enum Estimator {
    /// Estimates from blocks of joint samples, as in the paper.
    Sampled {
        /// Samples per block, `N_SB`.
        block: usize,
        /// The factor on a block's weight after each further block, in [0, 1].
        ageing: f64,
    },
    /// Closed form, for games that are sums over pairs.
    Exact,
}

/// An estimator as a table. Beside the name of a variant without braces serde accepts any keys.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind", deny_unknown_fields)]
#[schemars(rename = "Estimator")]
enum EstimatorTable {
    /// Estimates from blocks of joint samples, as in the paper.
    Sampled {
        /// Samples per block, `N_SB`.
        block: usize,
        /// The factor on a block's weight after each further block, in [0, 1].
        ageing: f64,
    },
    /// Closed form, for games that are sums over pairs.
    Exact {},
}

impl From<EstimatorTable> for Estimator {
    fn from(table: EstimatorTable) -> Self {
        match table {
            EstimatorTable::Sampled { block, ageing } => Self::Sampled { block, ageing },
            EstimatorTable::Exact {} => Self::Exact,
        }
    }
}

/// The order in which the players update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Order")]
pub enum UpdateOrder {
    /// All at once, on the distributions of the round before.
    #[default]
    Parallel,
    /// One after the other, each on the new distributions of those before it.
    Sequence,
}

/// The settings of an optimization.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OptimizerConfig {
    /// How the players get `E[G | x_i]`.
    pub estimator: Estimator,
    /// How a round moves the distributions.
    pub update: Update,
    /// Whether players see the updates of the same round.
    pub order: UpdateOrder,
    /// The cost that players learn from.
    pub utility: Utility,
    /// Factor on the temperature after each round, in (0, 1].
    pub cooling: f64,
    /// When the rounds end.
    pub stop: StopCriterion,
    /// The choice of final strategies from the distributions.
    pub choice: Choice,
    /// What follows the rounds.
    pub local_search: LocalSearch,
    /// The number of random starts of the local search, besides the choice from the distributions and the joint move in
    /// which each player has the strategy that is cheapest for it alone.
    pub random_starts: u32,
}

impl OptimizerConfig {
    /// Returns the numbers of the uniform draws for the random starts, when the rounds have taken `drawn`.
    pub fn start_draws(&self, drawn: u64) -> std::ops::Range<u64> {
        // The first one is for the final choice.
        let first = drawn + 1;
        first..first + u64::from(self.random_starts)
    }
}

/// An optimization stops after enough calm rounds in a row, or else at the maximum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StopCriterion {
    /// The largest change of a probability in a calm round.
    pub threshold: f64,
    /// The number of calm rounds in a row that counts as converged.
    pub calm_rounds: u32,
    /// The maximum number of rounds; the outcome says whether the distributions had converged.
    pub max_rounds: u32,
}

impl StopCriterion {
    /// Counts calm rounds: returns the number in a row after a round in which probabilities changed
    /// by at most `change`.
    pub fn count_calm_rounds(&self, previous: u32, change: f64) -> u32 {
        if change <= self.threshold { previous + 1 } else { 0 }
    }
}

/// The outcome of an optimization.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizeResult {
    /// The chosen strategy of each player.
    pub joint: Vec<usize>,
    /// The final distributions.
    pub q: Vec<Vec<f64>>,
    /// Each player's final estimate of `E[G | x]`, up to a constant: it ranks the strategies that
    /// were not chosen. After a local search it is the cost beside the chosen strategies of the others; none follows where
    /// the rounds have come to the lower bound.
    pub expected: Vec<Vec<f64>>,
    /// The cost of the chosen joint move.
    pub cost: f64,
    /// A lower bound on the cost of every joint move, where the game is a sum over pairs.
    pub bound: Option<f64>,
    /// Number of rounds that were run, at most `max_rounds`.
    pub rounds: u32,
    /// Whether the distributions converged, rather than the rounds run out.
    pub converged: bool,
}

/// Optimizes a game. `uniform(player, k)` is the `k`-th uniform number in [0, 1) of a player's own
/// stream: samples use them in order, the one after the last is for the final draw, and those after it for the random
/// starts of a local search.
///
/// # Panics
/// When the estimator is exact, or a local search is to follow, and the game is not a sum over pairs.
pub fn optimize(
    game: &impl Game,
    config: &OptimizerConfig,
    uniform: impl Fn(usize, u64) -> f64,
) -> OptimizeResult {
    let mut optimizer = OptimizerState::new(game, config, uniform);
    let mut rounds = 0;
    let mut calm = 0;
    while calm < config.stop.calm_rounds && rounds < config.stop.max_rounds {
        let change = match config.estimator {
            Estimator::Sampled { block, ageing } => optimizer.run_sampled_round(block, ageing),
            Estimator::Exact => optimizer.run_exact_round(),
        };
        calm = config.stop.count_calm_rounds(calm, change);
        rounds += 1;
    }
    let rounds_end = RoundsEnd { rounds, converged: calm >= config.stop.calm_rounds };
    optimizer.finish(rounds_end)
}

/// How the rounds have ended.
struct RoundsEnd {
    rounds: u32,
    converged: bool,
}

/// All players and their samples during an optimization.
struct OptimizerState<'g, G, U> {
    game: &'g G,
    config: &'g OptimizerConfig,
    uniform: U,
    players: Vec<Player>,
    /// The distributions on which updates of the present round are based.
    q: Vec<Vec<f64>>,
    /// Number of samples drawn by each player.
    drawn: u64,
}

impl<'g, G: Game, U: Fn(usize, u64) -> f64> OptimizerState<'g, G, U> {
    fn new(game: &'g G, config: &'g OptimizerConfig, uniform: U) -> Self {
        let players: Vec<Player> = game.strategies().iter().map(|&n| Player::new(n)).collect();
        let q = players.iter().map(|p| p.q.clone()).collect();
        Self { game, config, uniform, players, q, drawn: 0 }
    }

    /// Runs a round with exact expectations; returns the largest change of a probability.
    fn run_exact_round(&mut self) -> f64 {
        let game = self.game.as_pairwise().expect("exact expectations need a sum over pairs");
        let mut change: f64 = 0.0;
        for i in 0..self.players.len() {
            interrupt::check();
            let player = &mut self.players[i];
            player.set_expected(|expected| game.expected_costs(i, &self.q, expected));
            change = change.max(player.update(self.config.update, self.config.cooling));
            // In sequence, the next players use the new distribution of this one.
            if self.config.order == UpdateOrder::Sequence {
                self.q[i].clone_from(&player.q);
            }
        }
        self.q.iter_mut().zip(&self.players).for_each(|(q, p)| q.clone_from(&p.q));
        change
    }

    /// Runs a round with a block of joint samples, sample `k` of all players being joint move `k`.
    /// In sequence, each player draws a new block with those before it. Returns the largest change
    /// of a probability.
    fn run_sampled_round(&mut self, block: usize, ageing: f64) -> f64 {
        let mut samples = self.sample_block(block);
        let mut change: f64 = 0.0;
        for i in 0..self.players.len() {
            let costs: Vec<f64> = (0..block).map(|k| self.sample_cost(&samples, k, i)).collect();
            let player = &mut self.players[i];
            player.learn(&samples[i], &costs, ageing);
            change = change.max(player.update(self.config.update, self.config.cooling));
            if self.config.order == UpdateOrder::Sequence {
                samples = self.sample_block(block);
            }
        }
        change
    }

    /// Draws the next `block` samples of each player.
    fn sample_block(&mut self, block: usize) -> Vec<Vec<usize>> {
        let first = self.drawn;
        self.drawn += block as u64;
        let mut samples = Vec::with_capacity(self.players.len());
        for (i, player) in self.players.iter().enumerate() {
            let draws = first..self.drawn;
            samples.push(draws.map(|k| player.sample((self.uniform)(i, k))).collect());
        }
        samples
    }

    /// Returns the cost of joint move `k` that a player learns from.
    fn sample_cost(&self, samples: &[Vec<usize>], k: usize, player: usize) -> f64 {
        interrupt::check();
        let joint: Vec<usize> = samples.iter().map(|strategies| strategies[k]).collect();
        match self.config.utility {
            Utility::Joint => self.game.cost(&joint),
            Utility::Private => self.game.private_cost(&joint, player),
        }
    }

    /// Chooses strategies from the distributions, and improves them by local search where that is asked for.
    fn finish(self, end: RoundsEnd) -> OptimizeResult {
        let joint = self.final_joint();
        let cost = self.game.cost(&joint);
        let bound = self.game.as_pairwise().map(PairwiseGame::lower_bound);
        let mut result = OptimizeResult {
            joint,
            expected: self.players.iter().map(|p| p.expected().to_vec()).collect(),
            cost,
            bound,
            q: Vec::new(),
            rounds: end.rounds,
            converged: end.converged,
        };
        let is_minimum = bound.is_some_and(|bound| is_at_bound(cost, bound));
        match self.config.local_search {
            LocalSearch::None => {}
            _ if is_minimum => {}
            LocalSearch::Pairs => self.search_locally(&mut result),
            LocalSearch::BranchAndBound => {
                self.search_locally(&mut result);
                self.search_minimum(&mut result);
            }
        }
        result.q = self.players.into_iter().map(|p| p.q).collect();
        result
    }

    fn final_joint(&self) -> Vec<usize> {
        let mut joint = Vec::with_capacity(self.players.len());
        for (i, player) in self.players.iter().enumerate() {
            joint.push(player.choose(self.config.choice, (self.uniform)(i, self.drawn)));
        }
        joint
    }

    /// Replaces the joint move by the cheapest end of a local search.
    fn search_locally(&self, result: &mut OptimizeResult) {
        let game = self.game.as_pairwise().expect("a local search needs a sum over pairs");
        let mut starts = Vec::with_capacity(self.players.len());
        for (i, &chosen) in result.joint.iter().enumerate() {
            let draws = self.config.start_draws(self.drawn).map(|k| (self.uniform)(i, k));
            starts.push(start_strategies(game, i, chosen, draws));
        }
        let descents = run_descents(game, &starts);
        result.joint = descents.best_joint().to_vec();
        result.cost = descents.best_cost();
        for (i, expected) in result.expected.iter_mut().enumerate() {
            expected.clear();
            expected.extend_from_slice(descents.best_costs_given(i));
        }
    }

    /// Replaces the joint move by the minimum, or by the cheapest that a search of limited length finds.
    fn search_minimum(&self, result: &mut OptimizeResult) {
        let game = self.game.as_pairwise().expect("branch and bound needs a sum over pairs");
        let Minimum { joint, cost, is_proved } = find_minimum(game, &result.joint, MAX_NODES);
        if joint != result.joint {
            for (player, expected) in result.expected.iter_mut().enumerate() {
                *expected = game.costs_given(player, &joint);
            }
            result.joint = joint;
            result.cost = cost;
        }
        if is_proved {
            result.bound = Some(cost);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::game::tests::{game, joints};
    use super::super::minimum::find_minimum;
    use super::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::math;
    use sidestep_kernel::stream::{Purpose, Streams};

    const EXACT: OptimizerConfig = OptimizerConfig {
        estimator: Estimator::Exact,
        update: Update::NearestNewton { step: 0.5 },
        order: UpdateOrder::Sequence,
        utility: Utility::Joint,
        cooling: 0.8,
        stop: StopCriterion { threshold: 1e-3, calm_rounds: 3, max_rounds: 200 },
        choice: Choice::Argmax,
        local_search: LocalSearch::None,
        random_starts: 0,
    };

    fn uniform(seed: u64) -> impl Fn(usize, u64) -> f64 {
        let streams = Streams::new(Seed(seed));
        move |player, k| {
            let words = streams.block(player as u32, k / 2, Purpose(1), 0);
            f64::from(words[(k % 2) as usize]) / 4_294_967_296.0
        }
    }

    /// Costs in which strategy 1 is best for every player, whichever strategies the others choose.
    fn easy() -> super::super::PairwiseGame {
        let mut game = game(&[3, 3, 3], &[2.0, 0.0, 3.0]);
        game.add_pair(0, 1, vec![1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        game
    }

    #[test]
    fn every_combination_finds_an_easy_minimum() {
        let sampled = Estimator::Sampled { block: 20, ageing: 0.7 };
        for estimator in [Estimator::Exact, sampled] {
            for update in [Update::NearestNewton { step: 0.5 }, Update::Brouwer { step: 0.5 }] {
                for order in [UpdateOrder::Parallel, UpdateOrder::Sequence] {
                    for utility in [Utility::Joint, Utility::Private] {
                        let settings =
                            OptimizerConfig { estimator, update, order, utility, ..EXACT };
                        let outcome = optimize(&easy(), &settings, uniform(3));
                        assert_eq!(outcome.joint, [1, 1, 1], "{settings:?}");
                        assert!(outcome.converged, "{settings:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_exact_optimum_is_at_least_a_local_minimum() {
        for salt in 0..40 {
            let costs: Vec<f64> = (0..53).map(|k| uniform(salt)(1, k)).collect();
            let sizes = [3, 4, 2, 3];
            let game = game(&sizes, &costs);
            let outcome = optimize(&game, &EXACT, uniform(salt));
            let found = game.cost(&outcome.joint);
            for joint in joints(&sizes) {
                let apart = joint.iter().zip(&outcome.joint).filter(|(a, b)| a != b).count();
                assert!(apart != 1 || game.cost(&joint) >= found - 1e-9, "salt {salt}");
            }
        }
    }

    #[test]
    fn a_local_search_finds_most_minima_of_random_games_and_tells_a_bound() {
        let mut found = 0;
        for salt in 0..100 {
            let costs: Vec<f64> = (0..400).map(|k| uniform(salt)(1, k)).collect();
            let game = game(&[5, 6, 4, 5, 6], &costs);
            let config =
                OptimizerConfig { local_search: LocalSearch::Pairs, random_starts: 8, ..EXACT };
            let outcome = optimize(&game, &config, uniform(salt));
            let least = find_minimum(&game, &outcome.joint, u64::MAX).cost;
            assert!(outcome.bound.is_some_and(|bound| bound <= least + 1e-9), "salt {salt}");
            assert_eq!(outcome.cost, game.cost(&outcome.joint), "salt {salt}");
            found += usize::from(outcome.cost <= least + 1e-9);
        }
        assert!(found >= 95, "{found} of 100");
    }

    #[test]
    fn branch_and_bound_after_a_local_search_finds_every_minimum_and_proves_it() {
        for salt in 0..100 {
            let costs: Vec<f64> = (0..400).map(|k| uniform(salt)(1, k)).collect();
            let game = game(&[5, 6, 4, 5, 6], &costs);
            // Without random starts, so that there is something left to find.
            let config = OptimizerConfig { local_search: LocalSearch::BranchAndBound, ..EXACT };
            let outcome = optimize(&game, &config, uniform(salt));
            let least = find_minimum(&game, &[0; 5], u64::MAX).cost;
            assert!((outcome.cost - least).abs() < 1e-9, "salt {salt}");
            assert_eq!(outcome.bound, Some(outcome.cost), "salt {salt}");
            for (player, expected) in outcome.expected.iter().enumerate() {
                let cheapest = expected.iter().copied().fold(f64::INFINITY, f64::min);
                assert_eq!(expected[outcome.joint[player]], cheapest, "salt {salt}");
            }
        }
    }

    #[test]
    fn rounds_that_run_out_are_told() {
        let stop = StopCriterion { max_rounds: 2, ..EXACT.stop };
        let outcome = optimize(&easy(), &OptimizerConfig { stop, ..EXACT }, uniform(1));
        assert_eq!((outcome.rounds, outcome.converged), (2, false));
    }

    /// The error of the estimates falls as one over the root of the number of samples: the
    /// slope of its logarithm is -1/2, within 0.1 (fixed seeds, 64 blocks per size).
    #[test]
    fn sampled_estimates_approach_the_exact_ones_as_one_over_the_root_of_the_samples() {
        let costs: Vec<f64> = (0..53).map(|k| uniform(7)(1, k)).collect();
        let sizes = [3, 3, 3, 3];
        let game = game(&sizes, &costs);
        let q: Vec<Vec<f64>> = sizes.iter().map(|&n| vec![1.0 / n as f64; n]).collect();
        let mut exact = Vec::new();
        game.expected_costs(0, &q, &mut exact);
        let rms = |block: usize| {
            let mut squares = 0.0;
            for seed in 0..64 {
                let players: Vec<Player> = sizes.iter().map(|&n| Player::new(n)).collect();
                let draw = |i: usize, k: usize| players[i].sample(uniform(100 + seed)(i, k as u64));
                let samples: Vec<usize> = (0..block).map(|k| draw(0, k)).collect();
                let cost = |k: usize| {
                    let joint: Vec<usize> = (0..sizes.len()).map(|i| draw(i, k)).collect();
                    game.private_cost(&joint, 0)
                };
                let costs: Vec<f64> = (0..block).map(cost).collect();
                let mut player = Player::new(3);
                player.learn(&samples, &costs, 1.0);
                let errors = player.expected().iter().zip(&exact).map(|(a, b)| a - b);
                squares += errors.map(|e| e * e).sum::<f64>();
            }
            (squares / 64.0).sqrt()
        };
        let (few, many) = (rms(64), rms(4096));
        let slope = math::log2(many / few) / math::log2(4096.0 / 64.0);
        assert!((slope + 0.5).abs() < 0.1, "errors {few} and {many}: slope {slope}");
    }
}
