//! The simulator against the exact chain: a test of the distribution of final poses.

use crate::markov_chain::total_variation;
use crate::obstacle::GridPose;
use serde::Serialize;
use sidestep_kernel::math;
use std::collections::BTreeMap;

/// Chance that a simulator without fault is reported to disagree.
pub const SIGNIFICANCE: f64 = 1e-4;

/// The final poses of independent runs, compared with the exact distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// Length of each run in cycles.
    pub cycles: u64,
    /// Number of runs, each with a seed of its own.
    pub runs: u32,
    /// Total variation between the runs' final poses and the exact distribution.
    pub total_variation: f64,
    /// Limit that sampling alone exceeds with a probability of at most `significance`.
    pub limit: f64,
    /// See [`SIGNIFICANCE`].
    pub significance: f64,
    /// Number of runs from which on a simulator could be found to disagree: the limit is below 1 then, which no total
    /// variation exceeds.
    pub runs_to_tell: u64,
    /// Whether the total variation is within the limit; none where the runs are too few to tell.
    pub agrees: Option<bool>,
}

impl Comparison {
    /// Compares how often each pose was the final one of `runs` independent runs of `cycles` cycles with the exact
    /// distribution of final poses, see [`MarkovChain::distribution_after`](crate::MarkovChain::distribution_after).
    ///
    /// The limit holds whether or not the chain mixes, because the runs are independent.
    pub fn new(
        exact: &BTreeMap<GridPose, f64>,
        counts: &BTreeMap<GridPose, u32>,
        cycles: u64,
        runs: u32,
    ) -> Self {
        // Poses that the model does not know count in full, because their exact probability is 0.
        let unknown = counts.keys().filter(|pose| !exact.contains_key(pose));
        let poses: Vec<GridPose> = exact.keys().chain(unknown).copied().collect();
        let expected: Vec<f64> =
            poses.iter().map(|p| exact.get(p).copied().unwrap_or(0.0)).collect();
        let observed: Vec<f64> = poses
            .iter()
            .map(|pose| f64::from(counts.get(pose).copied().unwrap_or(0)) / f64::from(runs))
            .collect();
        let total_variation = total_variation(&expected, &observed);
        let limit = sampling_limit(&expected, f64::from(runs), SIGNIFICANCE);
        // The limit falls with the square root of the number of runs.
        let runs_to_tell = (limit * limit * f64::from(runs)).floor() as u64 + 1;
        let agrees = (limit < 1.0).then_some(total_variation <= limit);
        let significance = SIGNIFICANCE;
        Self { cycles, runs, total_variation, limit, significance, runs_to_tell, agrees }
    }
}

/// Returns the total variation that the shares of `samples` independent samples of `distribution`
/// exceed with a probability of at most `significance`.
///
/// The mean is at most half the sum of the shares' standard deviations; one sample more or
/// less changes the total variation by at most 1 / `samples`, so that McDiarmid's inequality
/// bounds how far above its mean it lies.
pub fn sampling_limit(distribution: &[f64], samples: f64, significance: f64) -> f64 {
    let deviations = distribution.iter().map(|p| (p * (1.0 - p).max(0.0) / samples).sqrt());
    let mean = 0.5 * deviations.sum::<f64>();
    mean + (math::ln(1.0 / significance) / (2.0 * samples)).sqrt()
}
