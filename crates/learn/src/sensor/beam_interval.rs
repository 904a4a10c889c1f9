//! 95 % intervals of the parameters of a beam model.

use sidestep_error_models::beam::PartChances;
use sidestep_kernel::math::{exp, ln};
use sidestep_statistics::Interval;

/// Half of the 95 % quantile of chi-square with one degree of freedom.
const HALF_CHI_SQUARE: f64 = 1.920_729;
/// Quantile of the normal distribution for 95 %.
const Z: f64 = 1.959_964;

pub(super) fn logit_interval(weight: f64, sd: f64) -> Interval {
    let logit = ln(weight / (1.0 - weight).max(f64::MIN_POSITIVE));
    let half = Z * sd / (weight * (1.0 - weight)).max(f64::MIN_POSITIVE);
    let share = |x: f64| 1.0 / (1.0 + exp(-x));
    Interval { low: share(logit - half), high: share(logit + half) }
}

pub(super) fn log_interval(value: f64, sd: f64) -> Interval {
    let half = Z * sd / value;
    Interval { low: value * exp(-half), high: value * exp(half) }
}

/// Returns the weights of a part, the others in proportion, at which the likelihood is as low as chance brings the
/// true weight in one of twenty logs.
pub(super) fn likelihood_interval(
    weights: [f64; 4],
    part: usize,
    chances: &[PartChances],
) -> Interval {
    let at = weights[part];
    let others = (1.0 - at).max(f64::MIN_POSITIVE);
    let log_likelihood = |weight: f64| {
        let scale = (1.0 - weight) / others;
        let model: [f64; 4] =
            std::array::from_fn(|k| if k == part { weight } else { weights[k] * scale });
        let of = |c: &PartChances| {
            let parts = [c.hit, c.short, c.max, c.random];
            let sum: f64 = model.iter().zip(parts).map(|(weight, chance)| weight * chance).sum();
            ln(sum.max(f64::MIN_POSITIVE))
        };
        chances.iter().map(of).sum::<f64>()
    };
    let least = log_likelihood(at) - HALF_CHI_SQUARE;
    let root = |mut inside: f64, mut outside: f64| {
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            if log_likelihood(middle) >= least { inside = middle } else { outside = middle }
        }
        0.5 * (inside + outside)
    };
    let low = if log_likelihood(0.0) >= least { 0.0 } else { root(at, 0.0) };
    let high = if log_likelihood(1.0) >= least { 1.0 } else { root(at, 1.0) };
    Interval { low, high }
}
