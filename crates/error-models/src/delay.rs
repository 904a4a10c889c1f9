//! Delays: cycles in which a robot does nothing although an action is due.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::math::exp;

/// Largest number of cycles of one delay; each number has a row in a table.
pub const MAX_DELAY_CYCLES: u32 = 10_000;

/// What may start a delay of a robot that is not delayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DelayEvent {
    /// Each action, before it begins: at most one delay an action.
    #[default]
    Action,
    /// Each cycle, whether or not an action is due.
    Cycle,
    /// Each cycle, for a section of robots together: how many delays start is drawn from a Poisson distribution with a mean
    /// of the chance times the robots, and whom they meet from those that are not delayed.
    Team,
}

impl DelayEvent {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Action => "action",
            Self::Cycle => "cycle",
            Self::Team => "team",
        }
    }
}

/// The length of a delay, and its probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DelayDuration {
    /// Number of cycles, 1 or more.
    pub cycles: u32,
    /// Its probability among all delays.
    pub p: f64,
}

/// How often a robot is delayed, and for how long.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayModel {
    /// Probability that a delay starts.
    pub p: f64,
    /// The event that may start one.
    pub per: DelayEvent,
    /// The lengths of delays; their probabilities sum to 1.
    pub durations: Vec<DelayDuration>,
}

impl DelayModel {
    /// Returns the mean length of a delay, in cycles.
    pub fn mean_cycles(&self) -> f64 {
        self.durations.iter().map(|duration| f64::from(duration.cycles) * duration.p).sum()
    }
}

/// Returns durations from `min` to `max` cycles, all alike.
pub fn uniform_durations(min: u32, max: u32) -> Vec<DelayDuration> {
    weighted_durations(min, max, |_| 1.0)
}

/// Returns durations from `min` to `max` cycles by the density of a normal distribution at whole cycles; a standard
/// deviation of 0 leaves the durations nearest to the mean.
pub fn gaussian_durations(min: u32, max: u32, mean: f64, sd: f64) -> Vec<DelayDuration> {
    let distance2 = |cycles: u32| (f64::from(cycles) - mean) * (f64::from(cycles) - mean);
    // Relative to the nearest one, so that its weight is 1 however narrow the distribution is.
    let nearest2 = (min..=max).map(distance2).fold(f64::INFINITY, f64::min);
    weighted_durations(min, max, |cycles| match distance2(cycles) - nearest2 {
        0.0 => 1.0,
        more => exp(-0.5 * more / (sd * sd)),
    })
}

fn weighted_durations(min: u32, max: u32, weight: impl Fn(u32) -> f64) -> Vec<DelayDuration> {
    let weights: Vec<f64> = (min..=max).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    (min..=max).zip(weights).map(|(cycles, w)| DelayDuration { cycles, p: w / sum }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_sum_to_one_and_have_the_mean_that_was_given() {
        for durations in [
            uniform_durations(2, 8),
            gaussian_durations(2, 8, 5.0, 1.5),
            gaussian_durations(2, 8, 5.0, 0.0),
            gaussian_durations(2, 8, 5.0, 1e-200),
        ] {
            let model = DelayModel { p: 0.1, per: DelayEvent::Action, durations };
            assert!((model.durations.iter().map(|d| d.p).sum::<f64>() - 1.0).abs() < 1e-12);
            assert!((model.mean_cycles() - 5.0).abs() < 1e-12, "{model:?}");
        }
    }

    #[test]
    fn a_narrow_gaussian_is_one_duration() {
        let all = gaussian_durations(1, 5, 4.0, 0.0);
        assert_eq!(all.iter().map(|d| d.p).collect::<Vec<_>>(), [0.0, 0.0, 0.0, 1.0, 0.0]);
    }
}
