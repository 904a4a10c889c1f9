#![deny(clippy::disallowed_methods)]
//! Probability collectives: optimization by players that learn distributions over strategies.
//!
//! Source: the 2009 paper "Integration of Probability Collectives for Collision Avoidance in
//! AGENTFLY", section 2, after Wolpert and Bieniawski. Instead of searching for the joint move
//! `x` that minimizes `G(x)` (eq. 1), every player `i` keeps a distribution `q_i` over its own
//! strategies; the joint distribution is their product (eq. 2). At temperature `T` player `i`
//! minimizes (eq. 7)
//!
//! ```text
//! L_i(q_i, T) = sum_x q_i(x) E[G | x_i = x]  -  T S(q_i)
//! ```
//!
//! with the entropy `S` (eq. 4). A round estimates `E[G | x_i]`, moves every `q_i` toward the
//! minimum of its `L_i`, and lowers `T`; as `T` falls the distributions settle on strategies.
//!
//! ```text
//! game.rs      the games: joint costs, and costs that are sums over pairs
//! player.rs    one player: its distribution, its estimates, its update
//! optimize.rs  the rounds: estimate, update, cool, until no distribution moves
//! ```
//!
//! The crate is independent of air traffic; `examples/graph_coloring.rs` colors a graph.
//!
//! **Two estimators.** [`Estimator::Sampled`] is the paper's: blocks of joint samples, with
//! older blocks weighing less. [`Estimator::Exact`] computes the expectation where the cost is
//! a sum over pairs ([`PairwiseGame`]); it is the limit of infinitely many samples.
//!
//! **Two updates.** [`Update::NearestNewton`] steps along the natural gradient of `L_i`;
//! [`Update::Brouwer`] moves toward the distribution that would be the minimum if no other
//! player moved, `q_i ~ exp(-E[G | x_i] / T)`.

mod game;
mod optimize;
mod player;

pub use game::{Game, PairwiseGame};
pub use optimize::{
    Estimator, OptimizeResult, OptimizerConfig, StopCriterion, UpdateOrder, optimize,
};
pub use player::{Choice, Player, Update, Utility};
