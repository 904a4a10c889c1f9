//! The four-part beam model fitted to ranges with known truth, by expectation and maximization.
//!
//! Source: Thrun, Burgard, Fox, "Probabilistic Robotics" (2005), table 6.2 (`learn_intrinsic_parameters`), with the
//! weights of the parts in the expectation, and with densities that are cut to the range of the sensor: the standard
//! deviation and the rate solve the likelihood equations of the cut densities. The book's stop "until convergence" is
//! here a rise of the mean log-likelihood below [`MIN_RISE_NAT`].
//!
//! Intervals (95 %) are of Fisher's information, on the scale of the logit for weights and of the logarithm for the
//! noise and the rate. Beams of one scan are not independent, so where scans are known their scores are summed first
//! (the sandwich of White and Huber). A weight that rests on few readings has an interval of the likelihood ratio.

use std::array;

use serde::Serialize;

use super::beam_interval::{likelihood_interval, log_interval, logit_interval};
use super::readings::Readings;
use crate::beam_information::{Information, Scores};
use crate::counts::rounded;
use sidestep_error_models::beam::{BeamModel, PartChances};
use sidestep_kernel::math::{exp, ln};
use sidestep_statistics::{Interval, percentile};

/// The fit ends when a step raises the mean log-likelihood of a reading by less than this.
const MIN_RISE_NAT: f64 = 1e-9;
/// or after this number of steps, which the report then says.
const MAX_STEPS: usize = 1000;
/// Longest leap, in steps: so far a part that is not there loses all of its weight at once.
const MAX_LEAP: f64 = 1e4;
/// Most readings that are fitted: neighboring beams say nearly the same, and each step reads all of them.
const MAX_READINGS: usize = 100_000;
/// Fewer readings say nothing about four parts.
const MIN_READINGS: usize = 100;
/// Limits of the noise in meters and of the rate in 1/m, beyond which the parts are no longer told apart.
const SIGMA_LIMITS_M: [f64; 2] = [1e-4, 10.0];
const LAMBDA_LIMITS_PER_M: [f64; 2] = [1e-3, 1e3];
/// Number of lengths of short parts that are told apart where their rate is solved for.
const LENGTH_BINS: usize = 512;
/// A weight below this, times the number of readings, rests on so few that it is not normally distributed.
const MIN_NORMAL_READINGS: f64 = 20.0;
/// A larger difference between the distributions of fit and readings shows that the model is not theirs.
const MAX_DEVIATION: f64 = 0.05;

/// The names of the parameters, in the order of [`BeamFit::parameters`].
const NAMES: [&str; 6] = ["hit", "short", "max", "random", "sigma_hit_m", "lambda_short_per_m"];

/// The beam model that describes some readings best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeamFit {
    /// The parameters with their intervals.
    pub parameters: Vec<BeamParameter>,
    /// Number of readings that were fitted.
    pub fitted: u64,
    /// Number of readings in the log that could be; where there are very many, some are taken evenly.
    pub readings: u64,
    /// Number of scans of those that were fitted: groups of readings that depend on each other.
    pub scans: u64,
    /// Number of steps of expectation and maximization.
    pub steps: usize,
    /// Whether the last step raised the mean log-likelihood by less than 1e-9 nat.
    pub has_converged: bool,
    /// Mean log-likelihood of a reading in nat; ranges are in meters.
    pub log_likelihood: f64,
    /// Largest difference between the distribution of ranges by the model and by the log, from 0 to 1.
    pub largest_deviation: f64,
    /// The same as a model, from which a simulation draws.
    #[serde(skip)]
    pub model: BeamModel,
}

/// One parameter of a beam model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeamParameter {
    /// Its name, which is that of its key in a profile.
    pub name: &'static str,
    /// Its most likely value.
    pub value: f64,
    /// Its 95 % interval; `None` where the readings say nothing about it, or too many were left out.
    pub interval: Option<Interval>,
}

/// A range that a sensor reported, and the truth.
#[derive(Debug, Clone, Copy)]
struct RangePair {
    true_m: Option<f64>,
    reported_m: Option<f64>,
    /// Number of its scan.
    scan: u32,
}

/// The interval of ranges that a sensor measures, in meters.
pub(super) type RangeLimits = [f64; 2];

impl BeamFit {
    /// Fits the readings of a sensor that measures from `limits` first to last; `None` where they are too few.
    pub(super) fn from_readings(readings: &dyn Readings, limits: RangeLimits) -> Option<Self> {
        let mut total = 0;
        visit_pairs(readings, limits, &mut |_| total += 1);
        let pairs = thinned_pairs(readings, limits, total);
        if pairs.len() < MIN_READINGS {
            return None;
        }
        let fit = Fit { pairs: &pairs, limits };
        let (model, steps, has_converged, log_likelihood) = fit.maximize();
        let mut scans: Vec<u32> = pairs.iter().map(|pair| pair.scan).collect();
        scans.dedup();
        let sigma = model.sigma_hit_m;
        let lambda = model.lambda_short_per_m;
        let values = [model.hit, model.short, model.max, model.random, sigma, lambda];
        let intervals = fit.intervals(&model);
        let parameters = NAMES.into_iter().zip(values).zip(intervals);
        Some(Self {
            parameters: parameters
                .map(|((name, value), interval)| BeamParameter { name, value, interval })
                .collect(),
            fitted: pairs.len() as u64,
            readings: total as u64,
            scans: scans.len() as u64,
            steps,
            has_converged,
            log_likelihood,
            largest_deviation: fit.largest_deviation(&model),
            model,
        })
    }

    /// Returns the parameters by name with nine decimals; the weights sum to 1.
    pub(crate) fn rounded_parameters(&self) -> Vec<(&'static str, f64)> {
        let BeamModel { sigma_hit_m, lambda_short_per_m, .. } = self.model;
        let round = |x: f64| (x * 1e9).round() / 1e9;
        let mut values = rounded(&self.model.weights());
        values.extend([round(sigma_hit_m), round(lambda_short_per_m)]);
        NAMES.into_iter().zip(values).collect()
    }

    /// Returns warnings of a fit that is not to be trusted.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.has_converged {
            warnings.push(format!(
                "the beam model was not found in {} steps: its parts are not told apart",
                self.steps
            ));
        }
        if self.largest_deviation > MAX_DEVIATION {
            warnings.push(format!(
                "the beam model does not describe these ranges: the shares of ranges below some distance differ by up \
                 to {:.1} %, so use the table of classes",
                100.0 * self.largest_deviation
            ));
        }
        warnings
    }
}

/// Visits the ranges that can be fitted.
fn visit_pairs(
    readings: &dyn Readings,
    [least_m, range_m]: RangeLimits,
    visit: &mut dyn FnMut(RangePair),
) {
    readings.visit(&mut |reading| {
        let (true_m, reported_m) = reading.ranges_m();
        let is_inside = |m: f64| (least_m..range_m).contains(&m);
        if true_m.is_none_or(|m| m > least_m && m < range_m) && reported_m.is_none_or(is_inside) {
            visit(RangePair { true_m, reported_m, scan: reading.scan });
        }
    });
}

/// Returns at most about [`MAX_READINGS`] of `total` pairs, spread evenly over beams and time.
fn thinned_pairs(readings: &dyn Readings, limits: RangeLimits, total: usize) -> Vec<RangePair> {
    let share = MAX_READINGS as f64 / total as f64;
    // Multiples of the golden ratio are spread evenly, and have no period in common with the number of beams.
    let is_kept = |index: usize| {
        if total <= MAX_READINGS {
            return true;
        }
        let turned = (index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (turned >> 32) as f64 / 4_294_967_296.0 < share
    };
    let mut pairs = Vec::new();
    let mut index = 0;
    visit_pairs(readings, limits, &mut |pair| {
        if is_kept(index) {
            pairs.push(pair);
        }
        index += 1;
    });
    pairs
}

/// Ranges to which a model is fitted.
struct Fit<'a> {
    pairs: &'a [RangePair],
    limits: RangeLimits,
}

/// Sums over all readings of what each part is responsible for.
struct Expectation {
    weights: [f64; 4],
    /// Sum of squared deviations of hits.
    squares_m2: f64,
    /// Sum of hits, less what the cut of their density takes from the squares.
    sigma_divisor: f64,
    /// Sum of short ranges from the least on, in meters.
    short_m: f64,
    /// Short readings by the length of the interval that they are cut to.
    short_by_length: Vec<f64>,
    log_likelihood: f64,
}

/// A model with what the readings say of it.
struct Evaluation {
    model: BeamModel,
    expected: Expectation,
    /// Mean over the readings, in nat.
    log_likelihood: f64,
}

impl Fit<'_> {
    fn length_m(&self) -> f64 {
        self.limits[1] - self.limits[0]
    }

    fn chances(&self, model: &BeamModel, pair: &RangePair) -> PartChances {
        model.part_chances(pair.true_m, pair.reported_m, self.limits)
    }

    /// Returns the most likely model, the number of steps, whether it has converged, and its mean log-likelihood.
    ///
    /// Two steps are followed by a leap along their direction, which is kept where it is more likely: a part that is
    /// not there loses less and less with each step, so steps alone would hardly come to an end.
    fn maximize(&self) -> (BeamModel, usize, bool, f64) {
        let mut first = self.evaluate(self.first_guess());
        for round in 1..=MAX_STEPS / 2 {
            let second = self.step_from(&first);
            let third = self.step_from(&second);
            let rise = third.log_likelihood - second.log_likelihood;
            if rise < MIN_RISE_NAT {
                return (third.model, 2 * round, true, third.log_likelihood);
            }
            let far = self.evaluate(leap([&first, &second, &third].map(|point| &point.model)));
            first = if far.log_likelihood > third.log_likelihood { far } else { third };
        }
        (first.model, MAX_STEPS, false, first.log_likelihood)
    }

    fn evaluate(&self, model: BeamModel) -> Evaluation {
        let expected = self.expectation(&model);
        let log_likelihood = expected.log_likelihood / self.pairs.len() as f64;
        Evaluation { model, expected, log_likelihood }
    }

    /// Takes one step of expectation and maximization.
    fn step_from(&self, point: &Evaluation) -> Evaluation {
        self.evaluate(self.maximization(&point.model, &point.expected))
    }

    /// Returns a model from which no part is missing; the noise is a robust spread of the deviations.
    fn first_guess(&self) -> BeamModel {
        let deviations =
            self.pairs.iter().filter_map(|pair| Some((pair.reported_m? - pair.true_m?).abs()));
        let mut deviations: Vec<f64> = deviations.collect();
        deviations.sort_by(f64::total_cmp);
        let spread_m = percentile(&deviations, 0.5).unwrap_or(0.1) * 1.4826;
        let [least_m, most_m] = SIGMA_LIMITS_M;
        BeamModel {
            hit: 0.7,
            short: 0.1,
            max: 0.1,
            random: 0.1,
            sigma_hit_m: spread_m.clamp(10.0 * least_m, most_m),
            lambda_short_per_m: 2.0 / self.length_m(),
        }
    }

    fn expectation(&self, model: &BeamModel) -> Expectation {
        let mut sums = Expectation {
            weights: [0.0; 4],
            squares_m2: 0.0,
            sigma_divisor: 0.0,
            short_m: 0.0,
            short_by_length: vec![0.0; LENGTH_BINS],
            log_likelihood: 0.0,
        };
        for pair in self.pairs {
            let shares = weighted(model, self.chances(model, pair));
            let total: f64 = shares.iter().sum();
            sums.log_likelihood += ln(total);
            let [hit, short, ..] = shares.map(|share| share / total);
            sums.weights.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share / total);
            let Some(z_m) = pair.reported_m else { continue };
            if let Some(at_m) = pair.true_m {
                sums.squares_m2 += hit * (z_m - at_m) * (z_m - at_m);
                sums.sigma_divisor += hit * (1.0 - self.cut_term(model.sigma_hit_m, at_m));
            }
            sums.short_m += short * (z_m - self.limits[0]);
            let length_m = pair.true_m.unwrap_or(self.limits[1]) - self.limits[0];
            let bin = (length_m / self.length_m() * LENGTH_BINS as f64) as usize;
            sums.short_by_length[bin.min(LENGTH_BINS - 1)] += short;
        }
        sums
    }

    /// Returns `(b phi(b) - a phi(a)) / (Phi(b) - Phi(a))` with the limits `a`, `b` in standard deviations from `at_m`:
    /// what the cut takes from the mean square of a normal variable.
    fn cut_term(&self, sigma_m: f64, at_m: f64) -> f64 {
        let [a, b] = self.limits.map(|limit_m| (limit_m - at_m) / sigma_m);
        // Beyond eight standard deviations nothing is cut.
        if a < -8.0 && b > 8.0 {
            return 0.0;
        }
        let phi = |x: f64| exp(-0.5 * x * x) / std::f64::consts::TAU.sqrt();
        (b * phi(b) - a * phi(a)) / sidestep_error_models::beam::normal_mass(a, b)
    }

    fn maximization(&self, model: &BeamModel, expected: &Expectation) -> BeamModel {
        let n = self.pairs.len() as f64;
        let [hit, short, max, random] = expected.weights.map(|weight| weight / n);
        let [least_m, most_m] = SIGMA_LIMITS_M;
        let sigma_hit_m = if expected.sigma_divisor > 0.0 {
            (expected.squares_m2 / expected.sigma_divisor).sqrt().clamp(least_m, most_m)
        } else {
            model.sigma_hit_m
        };
        let lambda_short_per_m = self.solved_lambda(expected).unwrap_or(model.lambda_short_per_m);
        BeamModel { hit, short, max, random, sigma_hit_m, lambda_short_per_m }
    }

    /// Returns the root of the likelihood equation of the rate of short readings; `None` without such readings. The
    /// derivative falls with the rate, so the root is found by halving, on the scale of the logarithm.
    fn solved_lambda(&self, expected: &Expectation) -> Option<f64> {
        let total: f64 = expected.short_by_length.iter().sum();
        if total <= 1e-9 {
            return None;
        }
        let width_m = self.length_m() / LENGTH_BINS as f64;
        let derivative = |rate: f64| {
            let cut = expected
                .short_by_length
                .iter()
                .enumerate()
                .map(|(bin, weight)| weight * mean_cut(rate, (bin as f64 + 0.5) * width_m));
            total / rate - expected.short_m - cut.sum::<f64>()
        };
        let [mut low, mut high] = LAMBDA_LIMITS_PER_M.map(ln);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if derivative(exp(middle)) > 0.0 { low = middle } else { high = middle }
        }
        Some(exp(0.5 * (low + high)))
    }

    /// Returns the 95 % intervals of all parameters.
    fn intervals(&self, model: &BeamModel) -> [Option<Interval>; 6] {
        let n = self.pairs.len() as f64;
        let weights = model.weights();
        // A part with hardly any reading has no curvature, and what depends on it none either.
        let is_normal = weights.map(|weight| weight * n >= MIN_NORMAL_READINGS);
        let mut information = Information::new(is_normal);
        let chances: Vec<PartChances> =
            self.pairs.iter().map(|pair| self.chances(model, pair)).collect();
        for (pair, chances) in self.pairs.iter().zip(&chances) {
            information.add(pair.scan, &self.scores(model, pair, *chances));
        }
        let deviations = information.standard_deviations();
        let sigma = deviations[4].filter(|_| is_normal[0]);
        let lambda = deviations[5].filter(|_| is_normal[1]);
        let weight = |part: usize| match deviations[part] {
            Some(sd) if is_normal[part] => Some(logit_interval(weights[part], sd)),
            _ => Some(likelihood_interval(weights, part, &chances)),
        };
        [
            weight(0),
            weight(1),
            weight(2),
            weight(3),
            sigma.map(|sd| log_interval(model.sigma_hit_m, sd)),
            lambda.map(|sd| log_interval(model.lambda_short_per_m, sd)),
        ]
    }

    /// Returns the derivatives of the log-likelihood of one reading.
    fn scores(&self, model: &BeamModel, pair: &RangePair, chances: PartChances) -> Scores {
        let shares = weighted(model, chances);
        let total: f64 = shares.iter().sum();
        let parts = [chances.hit, chances.short, chances.max, chances.random];
        let mut scores =
            Scores { weights: parts.map(|chance| chance / total), sigma: 0.0, lambda: 0.0 };
        let Some(z_m) = pair.reported_m else { return scores };
        if let Some(at_m) = pair.true_m {
            let deviation = (z_m - at_m) / model.sigma_hit_m;
            let squares = deviation * deviation - 1.0 + self.cut_term(model.sigma_hit_m, at_m);
            scores.sigma = shares[0] / total * squares / model.sigma_hit_m;
        }
        let length_m = pair.true_m.unwrap_or(self.limits[1]) - self.limits[0];
        let rate = model.lambda_short_per_m;
        let slope = 1.0 / rate - (z_m - self.limits[0]) - mean_cut(rate, length_m);
        scores.lambda = shares[1] / total * slope;
        scores
    }

    /// Returns the largest difference between the uniform distribution and that of the probabilities, by the model, of
    /// a range below the reported one (Kolmogorov's distance), over the readings with an echo.
    fn largest_deviation(&self, model: &BeamModel) -> f64 {
        let [least_m, range_m] = self.limits;
        let below = |pair: &RangePair| {
            let all = model.probability_between(pair.true_m, [least_m, range_m], range_m);
            let below =
                model.probability_between(pair.true_m, [least_m, pair.reported_m?], range_m);
            Some(below / all)
        };
        let mut shares: Vec<f64> = self.pairs.iter().filter_map(below).collect();
        shares.sort_by(f64::total_cmp);
        let n = shares.len() as f64;
        let deviations = shares.iter().enumerate().map(|(k, share)| {
            let (before, after) = (k as f64 / n, (k + 1) as f64 / n);
            (share - before).abs().max((after - share).abs())
        });
        deviations.fold(0.0, f64::max)
    }
}

/// Returns `d / (e^(rate d) - 1)`, what the cut at length `d` adds to the mean of an exponential variable.
fn mean_cut(rate: f64, length_m: f64) -> f64 {
    let x = rate * length_m;
    // Where the exponential overflows nothing is cut.
    if x > 700.0 { 0.0 } else { length_m / (exp(x) - 1.0) }
}

/// Returns the model to which the direction of two steps leads: squared extrapolation of the logarithms of all
/// parameters.
///
/// Source: Varadhan, Roland, "Simple and globally convergent methods for accelerating the convergence of any EM
/// algorithm" (2008), scheme S3.
fn leap(models: [&BeamModel; 3]) -> BeamModel {
    let [start, middle, end] = models.map(log_parameters);
    let step: [f64; 6] = array::from_fn(|k| middle[k] - start[k]);
    let bend: [f64; 6] = array::from_fn(|k| end[k] - middle[k] - step[k]);
    let length = |vector: &[f64; 6]| vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length(&bend) == 0.0 {
        return *models[2];
    }
    // A factor of 1 is where the two steps themselves have led.
    let factor = (length(&step) / length(&bend)).clamp(1.0, MAX_LEAP);
    let values: [f64; 6] =
        array::from_fn(|k| exp(start[k] + 2.0 * factor * step[k] + factor * factor * bend[k]));
    let [hit, short, max, random, sigma_hit_m, lambda_short_per_m] = values;
    let total = hit + short + max + random;
    let within = |value: f64, [least, most]: [f64; 2]| value.clamp(least, most);
    BeamModel {
        hit: hit / total,
        short: short / total,
        max: max / total,
        random: random / total,
        sigma_hit_m: within(sigma_hit_m, SIGMA_LIMITS_M),
        lambda_short_per_m: within(lambda_short_per_m, LAMBDA_LIMITS_PER_M),
    }
}

fn log_parameters(model: &BeamModel) -> [f64; 6] {
    let [hit, short, max, random] = model.weights();
    let values = [hit, short, max, random, model.sigma_hit_m, model.lambda_short_per_m];
    // A weight of nothing has no logarithm.
    values.map(|value| ln(value.max(f64::MIN_POSITIVE)))
}

fn weighted(model: &BeamModel, chances: PartChances) -> [f64; 4] {
    let parts = [
        model.hit * chances.hit,
        model.short * chances.short,
        model.max * chances.max,
        model.random * chances.random,
    ];
    // A reading that no part explains any more must not make the likelihood 0.
    if parts.iter().sum::<f64>() > 0.0 { parts } else { [0.0, 0.0, 0.0, f64::MIN_POSITIVE] }
}

#[cfg(test)]
mod tests;
