#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

mod cost_network;
mod game;
mod local_search;
mod minimum;
mod optimize;
mod player;

pub use game::{Game, PairwiseGame};
pub use local_search::{
    Descents, LocalSearch, PairMove, PlayerCosts, is_at_bound, start_strategies,
};
pub use minimum::{Minimum, find_minimum, tight_lower_bound};
pub use optimize::{
    Estimator, OptimizeResult, OptimizerConfig, StopCriterion, UpdateOrder, optimize,
};
pub use player::{Choice, Player, Update, Utility};
