//! The beam model of a range finder: the range that a beam reports, given the one at which something stands.
//!
//! Source: Thrun, Burgard, Fox, "Probabilistic Robotics" (2005), section 6.3.1 and table 6.1, as in the beam models of
//! localization programs (AMCL). A report is one of four: the range of what stands there with Gaussian noise (*hit*),
//! cut to the range of the sensor; something unexpected before it, of exponential density (*short*); no echo (*max*);
//! or any range (*random*). Where nothing stands within range, a hit is no echo.

use std::f64::consts::{SQRT_2, TAU};

use sidestep_kernel::math::{cos, erfc, exp, ln};

/// Largest number of times that a Gaussian range outside the sensor's range is drawn again; each has at least one chance
/// in three.
const MAX_REDRAWS: u16 = 63;
/// The width of a draw's first coordinate, beyond which further draws of the same beam lie.
pub const BEAMS_PER_DRAW: u16 = 1024;
/// Weights may differ from a sum of 1 by this, because people round them.
const SUM_TOLERANCE: f64 = 1e-6;

/// The four-part beam model. The weights sum to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamModel {
    /// Weight of reports of what stands there.
    pub hit: f64,
    /// Weight of reports of something before it.
    pub short: f64,
    /// Weight of reports without an echo.
    pub max: f64,
    /// Weight of random reports.
    pub random: f64,
    /// Standard deviation of hits, in meters.
    pub sigma_hit_m: f64,
    /// Rate of the exponential density of short reports, in 1/m.
    pub lambda_short_per_m: f64,
}

/// The chances of a report that is a range, per meter, by part; or that is no echo, as probabilities.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PartChances {
    /// That of a hit.
    pub hit: f64,
    /// That of a short report.
    pub short: f64,
    /// That of no echo.
    pub max: f64,
    /// That of a random report.
    pub random: f64,
}

impl BeamModel {
    /// Returns the weights in the order hit, short, max, random.
    pub fn weights(&self) -> [f64; 4] {
        [self.hit, self.short, self.max, self.random]
    }

    /// Returns the model with weights that sum to 1 to the last bit that they can.
    ///
    /// # Errors
    /// With what is wrong where the weights are not from 0 to 1 or do not sum to 1, or the noise or the rate is not
    /// positive.
    pub fn normalized(mut self) -> Result<Self, String> {
        let weights = self.weights();
        let sum: f64 = weights.iter().sum();
        if weights.iter().any(|w| !(0.0..=1.0).contains(w)) {
            return Err("a weight that is not from 0 to 1".into());
        }
        if (sum - 1.0).abs() > SUM_TOLERANCE {
            return Err(format!(
                "the weights hit, short, max and random sum to {sum:.6}, not to 1"
            ));
        }
        if !(self.sigma_hit_m > 0.0 && self.sigma_hit_m.is_finite()) {
            return Err("sigma_hit_m is not above 0".into());
        }
        if !(self.lambda_short_per_m > 0.0 && self.lambda_short_per_m.is_finite()) {
            return Err("lambda_short_per_m is not above 0".into());
        }
        for weight in [&mut self.hit, &mut self.short, &mut self.max, &mut self.random] {
            *weight /= sum;
        }
        Ok(self)
    }

    /// Returns the chance of each part, without its weight, for a report of `reported_m` (`None` for no echo) where
    /// something stands at `true_m`, and the sensor measures from `least_m` to `range_m`.
    pub fn part_chances(
        &self,
        true_m: Option<f64>,
        reported_m: Option<f64>,
        [least_m, range_m]: [f64; 2],
    ) -> PartChances {
        let Some(z_m) = reported_m else {
            let hit = if true_m.is_none() { 1.0 } else { 0.0 };
            return PartChances { hit, max: 1.0, ..PartChances::default() };
        };
        let end_m = true_m.unwrap_or(range_m);
        let short_of = ShortPart { rate: self.lambda_short_per_m, least_m, end_m };
        PartChances {
            hit: true_m.map_or(0.0, |at_m| {
                let noise = HitPart { at_m, sigma_m: self.sigma_hit_m };
                noise.density(z_m) / noise.mass(least_m, range_m)
            }),
            short: short_of.density(z_m),
            max: 0.0,
            random: 1.0 / (range_m - least_m),
        }
    }

    /// Returns the probability that the report lies in [`from_m`, `to_m`) where something stands at `true_m`, for a
    /// sensor that measures up to `range_m`.
    pub fn probability_between(
        &self,
        true_m: Option<f64>,
        [from_m, to_m]: [f64; 2],
        range_m: f64,
    ) -> f64 {
        let to_m = to_m.min(range_m);
        if to_m <= from_m {
            return 0.0;
        }
        let hit = true_m.map_or(0.0, |at_m| {
            let noise = HitPart { at_m, sigma_m: self.sigma_hit_m };
            noise.mass(from_m, to_m) / noise.mass(0.0, range_m)
        });
        let end_m = true_m.unwrap_or(range_m);
        let short_of = ShortPart { rate: self.lambda_short_per_m, least_m: 0.0, end_m };
        self.hit * hit
            + self.short * short_of.mass(from_m, to_m)
            + self.random * (to_m - from_m) / range_m
    }

    /// Returns the probability of no echo.
    pub fn no_echo_probability(&self, true_m: Option<f64>) -> f64 {
        self.max + if true_m.is_none() { self.hit } else { 0.0 }
    }

    /// Draws a report, `None` for no echo, where something stands at `true_m`, for a sensor that measures up to
    /// `range_m`. `words` returns four uniform words of the draw with a number; the first is 0.
    pub fn sample(
        &self,
        true_m: Option<f64>,
        range_m: f64,
        words: impl Fn(u16) -> [u32; 4],
    ) -> Option<f64> {
        let [part, first, ..] = words(0);
        let u = unit(part);
        let range = if u < self.hit {
            self.sample_hit(true_m?, range_m, words)
        } else if u < self.hit + self.short {
            let end_m = true_m.unwrap_or(range_m);
            let short_of = ShortPart { rate: self.lambda_short_per_m, least_m: 0.0, end_m };
            short_of.quantile(unit(first))
        } else if u < self.hit + self.short + self.random {
            unit(first) * range_m
        } else {
            return None;
        };
        // Rounding may bring a range up to the end, from which on there is no echo.
        (range < range_m).then_some(range)
    }

    fn sample_hit(&self, at_m: f64, range_m: f64, words: impl Fn(u16) -> [u32; 4]) -> f64 {
        for draw in 0..MAX_REDRAWS {
            let [_, first, second, _] = words(draw);
            // Box-Muller; the first number is above 0, where the logarithm is finite.
            let radius = (-2.0 * ln(unit(first))).sqrt();
            let range = at_m + self.sigma_hit_m * radius * cos(TAU * unit(second));
            if (0.0..range_m).contains(&range) {
                return range;
            }
        }
        at_m
    }
}

/// Returns the probability that a standard normal variable lies from `a` to `b`, at least the smallest number, because
/// others divide by it.
pub fn normal_mass(a: f64, b: f64) -> f64 {
    // Beyond eight standard deviations nothing is left that a number could hold beside 1.
    if a < -8.5 && b > 8.5 {
        return 1.0;
    }
    let above = |x: f64| 0.5 * erfc(x / SQRT_2);
    (above(a) - above(b)).max(f64::MIN_POSITIVE)
}

/// Returns a uniform number in (0, 1): the middle of the word's interval.
fn unit(word: u32) -> f64 {
    (f64::from(word) + 0.5) / 4_294_967_296.0
}

/// The Gaussian noise of a hit.
struct HitPart {
    at_m: f64,
    sigma_m: f64,
}

impl HitPart {
    fn density(&self, z_m: f64) -> f64 {
        let deviation = (z_m - self.at_m) / self.sigma_m;
        exp(-0.5 * deviation * deviation) / (self.sigma_m * TAU.sqrt())
    }

    /// Returns the probability of a range in [`from_m`, `to_m`).
    fn mass(&self, from_m: f64, to_m: f64) -> f64 {
        let [a, b] = [from_m, to_m].map(|z_m| (z_m - self.at_m) / self.sigma_m);
        normal_mass(a, b)
    }
}

/// The exponential density of short reports, cut to [`least_m`, `end_m`].
struct ShortPart {
    rate: f64,
    least_m: f64,
    end_m: f64,
}

impl ShortPart {
    /// Returns the mass of the uncut density on the interval, relative to that at its beginning.
    fn norm(&self) -> f64 {
        1.0 - exp(-self.rate * (self.end_m - self.least_m))
    }

    fn density(&self, z_m: f64) -> f64 {
        if z_m < self.least_m || z_m > self.end_m || self.end_m <= self.least_m {
            return 0.0;
        }
        self.rate * exp(-self.rate * (z_m - self.least_m)) / self.norm()
    }

    fn mass(&self, from_m: f64, to_m: f64) -> f64 {
        // At the very sensor there is no room before a thing: such a report is at 0.
        if self.end_m <= self.least_m {
            return if from_m <= self.least_m { 1.0 } else { 0.0 };
        }
        let above =
            |z_m: f64| exp(-self.rate * (z_m.clamp(self.least_m, self.end_m) - self.least_m));
        (above(from_m) - above(to_m)) / self.norm()
    }

    fn quantile(&self, u: f64) -> f64 {
        if self.end_m <= self.least_m {
            return self.least_m;
        }
        let z_m = self.least_m - ln(1.0 - u * self.norm()) / self.rate;
        z_m.min(self.end_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    const BEAM: BeamModel = BeamModel {
        hit: 0.7,
        short: 0.12,
        max: 0.08,
        random: 0.1,
        sigma_hit_m: 0.3,
        lambda_short_per_m: 0.8,
    };
    const RANGE_M: f64 = 5.0;

    /// Chi-square of draws in ten bins and no echo against the exact probabilities; 10 degrees of freedom.
    fn chi_square(true_m: Option<f64>) -> f64 {
        let streams = Streams::new(Seed(11));
        let n = 20_000;
        let mut counts = [0.0; 11];
        for now in 0..n {
            let words = |draw| streams.block(3, now, Purpose(16), draw * BEAMS_PER_DRAW);
            let bin = BEAM.sample(true_m, RANGE_M, words).map_or(10, |z| (2.0 * z) as usize);
            counts[bin] += 1.0;
        }
        let mut statistic = 0.0;
        for (bin, count) in counts.iter().enumerate() {
            let from_m = 0.5 * bin as f64;
            let p = match bin {
                10 => BEAM.no_echo_probability(true_m),
                _ => BEAM.probability_between(true_m, [from_m, from_m + 0.5], RANGE_M),
            };
            let expected = p * n as f64;
            statistic += (count - expected) * (count - expected) / expected;
        }
        statistic
    }

    #[test]
    fn draws_have_the_probabilities_of_the_model() {
        // 29.6 is reached by chance once in a thousand times; the seed is fixed.
        for true_m in [Some(0.1), Some(2.6), Some(4.9), None] {
            let statistic = chi_square(true_m);
            assert!(statistic < 29.6, "{true_m:?}: {statistic}");
        }
    }

    #[test]
    fn probabilities_of_all_reports_sum_to_one() {
        for true_m in [Some(0.0), Some(0.02), Some(3.0), Some(4.99), None] {
            let edges = [0.0, 0.3, 1.7, 2.9, 3.1, 9.0];
            let classes: f64 = edges
                .windows(2)
                .map(|e| BEAM.probability_between(true_m, [e[0], e[1]], RANGE_M))
                .sum();
            let sum = classes + BEAM.no_echo_probability(true_m);
            assert!((sum - 1.0).abs() < 1e-12, "{true_m:?}: {sum}");
        }
    }

    #[test]
    fn densities_are_the_derivatives_of_probabilities() {
        let z_m = 1.3;
        let h = 1e-5;
        for true_m in [Some(1.5), Some(4.0), None] {
            let chances = BEAM.part_chances(true_m, Some(z_m), [0.0, RANGE_M]);
            let density =
                BEAM.hit * chances.hit + BEAM.short * chances.short + BEAM.random * chances.random;
            let mass = BEAM.probability_between(true_m, [z_m - h, z_m + h], RANGE_M);
            assert!((density - mass / (2.0 * h)).abs() < 1e-6, "{true_m:?}");
        }
    }

    #[test]
    fn models_that_mean_nothing_are_refused() {
        assert!(BeamModel { hit: 0.6, ..BEAM }.normalized().unwrap_err().contains("sum to 0.9"));
        assert!(BeamModel { sigma_hit_m: 0.0, ..BEAM }.normalized().is_err());
        assert!(BeamModel { lambda_short_per_m: f64::NAN, ..BEAM }.normalized().is_err());
        assert!(BeamModel { hit: 1.7, short: -0.88, ..BEAM }.normalized().is_err());
        assert!(BEAM.normalized().is_ok());
    }
}
