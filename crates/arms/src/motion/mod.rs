//! The motion of an arm's joints in time.
//!
//! ```text
//! rates   highest speed, acceleration and jerk of each joint
//! filter  reference postures -> joint values within these rates, cycle by cycle
//! ```

mod filter;
mod rates;
#[cfg(test)]
mod tests;

pub use filter::{MotionFilter, MotionState, MotionStep};
pub use rates::{AssumedSpeed, CutRates, JointRates, assumed_speeds, joint_rates, rates_cut_by};
