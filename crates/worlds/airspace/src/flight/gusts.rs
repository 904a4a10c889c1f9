//! Gusts: a wind that no airplane knows, beside the one that all know.
//!
//! East and north parts are two random processes of normal numbers, constant within a cycle, whose correlation falls
//! with the time between two cycles as `exp(-t / correlation_s)`: a Gauss-Markov process of first order, as in Dryden's
//! model of turbulence. Each value is a weighted sum of independent draws of this cycle and those before it, so it
//! follows from the seed and the cycle alone: no run has to remember it, and none that starts in the middle has other
//! gusts.

use super::motion::Point;
use crate::purpose;
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntitySlot, math};
use std::sync::Arc;

/// Weight, relative to the first, below which earlier draws no longer count.
const MIN_WEIGHT: f64 = 1e-4;
/// Largest number of cycles in a correlation time: some nine times as many draws make one gust.
pub(crate) const MAX_CORRELATION_CYCLES: f64 = 100.0;

/// Gusts of all airplanes.
#[derive(Debug, Clone, PartialEq)]
pub struct Gusts {
    /// Whether all airplanes are in the same gust; otherwise each is in one of its own.
    pub is_shared: bool,
    /// Standard deviation of the east and of the north part times the weights of the draws, the latest first.
    weights_m_s: Arc<[f64]>,
}

impl Gusts {
    /// Returns gusts with a standard deviation in each direction, in cycles of `dt_s` seconds.
    pub(crate) fn new(noise_m_s: f64, correlation_s: f64, dt_s: f64, is_shared: bool) -> Self {
        let ratio = math::exp(-dt_s / correlation_s);
        let mut weights = vec![1.0];
        let mut weight = ratio;
        while weight >= MIN_WEIGHT {
            weights.push(weight);
            weight *= ratio;
        }
        // The variance of a sum of independent numbers is the sum of the squares of their weights.
        let norm = weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
        let weights_m_s = weights.into_iter().map(|weight| noise_m_s * weight / norm).collect();
        Self { is_shared, weights_m_s }
    }

    /// Returns the gust in which an airplane is in a cycle, in meters per second.
    pub(crate) fn velocity_m_s(&self, streams: &Streams, slot: EntitySlot, now: Cycle) -> Point {
        let slot = if self.is_shared { 0 } else { slot };
        let mut gust_m_s = [0.0; 2];
        // The draws of the first cycles reach back before the start.
        let latest = now + self.weights_m_s.len() as Cycle;
        for (back, weight_m_s) in self.weights_m_s.iter().enumerate() {
            let mut draws = streams.draws(slot, latest - back as Cycle, purpose::GUST);
            for part_m_s in &mut gust_m_s {
                *part_m_s += weight_m_s * normal(&mut draws);
            }
        }
        gust_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::Seed;

    #[test]
    fn gusts_have_the_standard_deviation_and_the_correlation_that_are_asked_for() {
        let gusts = Gusts::new(2.0, 20.0, 5.0, true);
        let streams = Streams::new(Seed(4));
        let all: Vec<Point> = (0..20_000).map(|now| gusts.velocity_m_s(&streams, 0, now)).collect();
        let mean_of =
            |product: &dyn Fn(usize) -> f64| (0..19_000).map(product).sum::<f64>() / 19_000.0;
        let variance = mean_of(&|k| all[k][0] * all[k][0]);
        assert!((variance.sqrt() - 2.0).abs() < 0.1, "{variance}");
        assert!(mean_of(&|k| all[k][0]).abs() < 0.15);
        assert!(mean_of(&|k| all[k][0] * all[k][1]).abs() < 0.2, "east and north are independent");
        for lag in [1, 4] {
            let expected = math::exp(-5.0 * lag as f64 / 20.0);
            let found = mean_of(&|k| all[k][1] * all[k + lag][1]) / 4.0;
            assert!((found - expected).abs() < 0.07, "{lag}: {found} {expected}");
        }
    }

    #[test]
    fn each_airplane_is_in_a_gust_of_its_own_unless_all_share_one() {
        let streams = Streams::new(Seed(4));
        let of_two = |is_shared: bool| {
            let gusts = Gusts::new(2.0, 20.0, 5.0, is_shared);
            [3, 7].map(|slot| gusts.velocity_m_s(&streams, slot, 11))
        };
        let [one, other] = of_two(true);
        assert_eq!(one, other);
        let [one, other] = of_two(false);
        assert_ne!(one, other);
    }
}
