#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

mod game;
mod optimize;
mod player;

pub use game::{Game, PairwiseGame};
pub use optimize::{
    Estimator, OptimizeResult, OptimizerConfig, StopCriterion, UpdateOrder, optimize,
};
pub use player::{Choice, Player, Update, Utility};
