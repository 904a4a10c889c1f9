#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

mod compare;
mod markov_chain;
mod model;
mod names;
mod observe;
mod obstacle;
mod policy;
mod pomdp;
mod robot;
mod sparse;
mod summary;

pub use compare::{Comparison, SIGNIFICANCE, sampling_limit};
pub use markov_chain::{ChainState, MarkovChain, StationaryDistribution, total_variation};
pub use model::{MAX_STATES, MarkovModel};
pub use observe::Beam;
pub use obstacle::{ActionOutcome, GridPose, outcome_distribution};
pub use policy::{POLICIES, policy};
pub use pomdp::{MAX_BEAMS, Pomdp, PomdpOptions, PomdpSize};
pub use robot::SingleRobot;
pub use summary::{Summary, VisitedBox};
