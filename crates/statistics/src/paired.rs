//! Two treatments of the same cases.

use super::Bootstrap;
use super::interval::binomial_cdf;
use super::interval::{Interval, mean_interval, student_p_value, student_t};
use super::moments::{TIE_FRACTION, largest_magnitude, mean, sample_sd, sum};

/// Number of pairs below which no test is made: two pairs that agree by chance would give any p-value.
pub const MIN_TEST_PAIRS: usize = 5;

/// Values of a treatment and of a baseline on the same cases (runs of the same seed), so that
/// effects common to both cancel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pairs {
    pairs: Vec<(f64, f64)>,
    incomplete: usize,
}

impl Pairs {
    /// Creates the pairs `(a[i], b[i])` of which both have a finite value; all others, and the rest
    /// of the longer list, count as incomplete.
    pub fn from_columns(a: &[Option<f64>], b: &[Option<f64>]) -> Self {
        let mut pairs: Vec<(f64, f64)> = Vec::new();
        for pair in a.iter().zip(b) {
            if let (Some(a), Some(b)) = pair
                && a.is_finite()
                && b.is_finite()
            {
                pairs.push((*a, *b));
            }
        }
        let incomplete = a.len().max(b.len()) - pairs.len();
        Self { pairs, incomplete }
    }

    /// Number of complete pairs.
    pub fn n(&self) -> usize {
        self.pairs.len()
    }

    /// Number of cases of which one or both have no value.
    pub fn incomplete(&self) -> usize {
        self.incomplete
    }

    /// Returns `a - b` for each complete pair, in the order of the cases.
    pub fn differences(&self) -> Vec<f64> {
        self.pairs.iter().map(|(a, b)| a - b).collect()
    }

    /// Returns the mean of `a - b`; `None` without pairs.
    pub fn difference(&self) -> Option<f64> {
        mean(&self.differences())
    }

    /// Returns Student's 95 % interval of the mean difference; `None` for fewer than two pairs, and where all
    /// differences are equal but for rounding: they show no spread, and an interval without width would claim that there
    /// is none.
    pub fn difference_interval(&self) -> Option<Interval> {
        if self.is_tied() {
            return None;
        }
        mean_interval(&self.differences())
    }

    /// Returns the spread that rounding may give to a difference: 1e-9 of the largest magnitude of both.
    fn rounding(&self) -> f64 {
        let (a, b) = self.columns();
        TIE_FRACTION * largest_magnitude(&a).max(largest_magnitude(&b))
    }

    /// Returns whether all differences are equal but for rounding.
    fn is_tied(&self) -> bool {
        sample_sd(&self.differences()).is_some_and(|sd| sd <= self.rounding())
    }

    /// Returns whether all pairs are the same one but for rounding: all differences are equal, and are measured, because
    /// those of counts may be equal by chance. They tell nothing of other cases.
    pub fn is_one_case(&self) -> bool {
        self.is_tied() && self.pairs.iter().any(|(a, b)| a.fract() != 0.0 || b.fract() != 0.0)
    }

    /// Returns the mean of `a` over the mean of `b`, with its 95 % interval, which is absent where
    /// [all pairs are one case](Self::is_one_case), or their ratios are all equal.
    ///
    /// The interval is Fieller's (1954) for pairs: exact where both are normal. `None` where a
    /// value is negative (a ratio of signed quantities means little), with fewer than two pairs,
    /// and where the interval of the baseline's mean contains 0, so that no factor is excluded.
    pub fn ratio(&self) -> Option<(f64, Option<Interval>)> {
        let (a, b) = self.columns();
        if self.n() < 2 || self.pairs.iter().any(|(a, b)| *a < 0.0 || *b < 0.0) {
            return None;
        }
        let center_a = mean(&a)?;
        let center_b = mean(&b)?;
        if center_b <= 0.0 {
            return None;
        }
        // In units of the baseline's mean, so that no square overflows and the baseline is 1.
        let unit = center_b;
        let u: Vec<f64> = a.iter().map(|a| (a - center_a) / unit).collect();
        let v: Vec<f64> = b.iter().map(|b| (b - center_b) / unit).collect();
        let n = self.n() as f64;
        let t = student_t(self.n() - 1);
        // The covariance of the means, times t squared.
        let covariance = |x: &[f64], y: &[f64]| {
            t * t * sum(x.iter().zip(y).map(|(x, y)| x * y)) / ((n - 1.0) * n)
        };
        let ratio = center_a / unit;
        let aa = covariance(&u, &u);
        let ab = covariance(&u, &v);
        let bb = covariance(&v, &v);
        // The ratios r with (ratio - r)^2 <= aa - 2 r ab + r^2 bb are between the two roots of a quadratic equation.
        // Its leading coefficient is positive where the interval of the baseline's mean excludes 0.
        let leading = 1.0 - bb;
        let excludes_zero = leading > 0.0;
        if !excludes_zero || !ratio.is_finite() {
            return None;
        }
        let root = ((ratio - ab) * (ratio - ab) - leading * (ratio * ratio - aa)).max(0.0).sqrt();
        let interval =
            Interval { low: (ratio - ab - root) / leading, high: (ratio - ab + root) / leading };
        let has_width = interval.high - interval.low > TIE_FRACTION * interval.high.abs();
        Some((ratio, (has_width && !self.is_one_case()).then_some(interval)))
    }

    /// Returns the bootstrap's 95 % interval of the mean difference; `None` where
    /// [that of Student](Self::difference_interval) is.
    pub fn difference_bootstrap(&self, bootstrap: &Bootstrap) -> Option<Interval> {
        if self.is_tied() {
            return None;
        }
        bootstrap.mean(&self.differences())
    }

    /// Returns the bootstrap's 95 % interval of the ratio of means; present where that of
    /// [`Self::ratio`] is.
    pub fn ratio_bootstrap(&self, bootstrap: &Bootstrap) -> Option<Interval> {
        self.ratio()?.1?;
        bootstrap.interval(&self.pairs, |pairs| {
            let total_a: f64 = pairs.iter().map(|(a, _)| a).sum();
            let total_b: f64 = pairs.iter().map(|(_, b)| b).sum();
            Some(total_a / total_b).filter(|ratio| ratio.is_finite())
        })
    }

    /// Returns the number of pairs in which `a` is lower than `b`, equal but for rounding, and higher.
    pub fn sign_counts(&self) -> (usize, usize, usize) {
        let rounding = self.rounding();
        let lower = self.pairs.iter().filter(|(a, b)| b - a > rounding).count();
        let higher = self.pairs.iter().filter(|(a, b)| a - b > rounding).count();
        (lower, self.n() - lower - higher, higher)
    }

    /// Returns the two-sided p-value of Student's paired test of no difference.
    ///
    /// 1 where no pair differs but for rounding. `None` for fewer than [`MIN_TEST_PAIRS`], and where all
    /// differ by the same amount but for rounding, because the test needs a spread: seeds that change nothing give any
    /// number of equal pairs.
    pub fn p_value(&self) -> Option<f64> {
        if self.n() < MIN_TEST_PAIRS {
            return None;
        }
        let differences = self.differences();
        let center = mean(&differences)?;
        let sd = sample_sd(&differences)?;
        let rounding = self.rounding();
        if sd <= rounding {
            return (center.abs() <= rounding).then_some(1.0);
        }
        student_p_value(center / sd * (self.n() as f64).sqrt(), self.n() - 1)
    }

    /// Returns the two-sided p-value of the exact sign test: among pairs that differ, `a` is as
    /// often lower as higher. 1 where none differs; `None` for fewer than [`MIN_TEST_PAIRS`].
    pub fn sign_p_value(&self) -> Option<f64> {
        let (lower, _, higher) = self.sign_counts();
        let rarer = binomial_cdf(lower.min(higher), lower + higher, 0.5);
        let is_tested = self.n() >= MIN_TEST_PAIRS && !self.is_one_case();
        is_tested.then_some((2.0 * rarer).min(1.0))
    }

    fn columns(&self) -> (Vec<f64>, Vec<f64>) {
        self.pairs.iter().copied().unzip()
    }
}

/// Returns Holm's adjustment ("A simple sequentially rejective multiple test procedure",
/// Scandinavian Journal of Statistics 6, 1979) of the p-values of one family: the probability that
/// any difference with a value below 0.05 is none is at most 5 %, however the tests depend on
/// each other. Absent values are not part of the family and stay absent.
pub fn holm(p_values: &[Option<f64>]) -> Vec<Option<f64>> {
    let mut family: Vec<(usize, f64)> = Vec::new();
    for (i, p_value) in p_values.iter().enumerate() {
        if let Some(p) = p_value.filter(|p| !p.is_nan()) {
            family.push((i, p));
        }
    }
    family.sort_by(|(_, a), (_, b)| a.total_cmp(b));
    let mut adjusted = vec![None; p_values.len()];
    // An adjusted value is never below that of a smaller p-value: the procedure stops at the first that it accepts.
    let mut largest = 0.0_f64;
    for (rank, &(i, p)) in family.iter().enumerate() {
        let factor = (family.len() - rank) as f64;
        largest = largest.max((factor * p).min(1.0));
        adjusted[i] = Some(largest);
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::super::testing::assert_close;
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::Seed;
    use sidestep_kernel::distr::normal;
    use sidestep_kernel::stream::{Purpose, Streams};

    fn some(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().map(|v| Some(*v)).collect()
    }

    /// Student 1908, additional hours of sleep; R's data set `sleep`.
    fn sleep() -> Pairs {
        let a = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
        let b = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];
        Pairs::from_columns(&some(&a), &some(&b))
    }

    #[test]
    fn students_sleep_gives_what_r_gives() {
        // R: t.test(extra ~ group, data = sleep, paired = TRUE); binom.test(0, 9).
        let pairs = sleep();
        assert_close(pairs.difference().unwrap(), -1.58, 1e-12);
        let interval = pairs.difference_interval().unwrap();
        assert_close(interval.low, -2.459_885_8, 1e-7);
        assert_close(interval.high, -0.700_114_2, 1e-7);
        assert_close(pairs.p_value().unwrap(), 0.002_832_89, 1e-7);
        assert_eq!(pairs.sign_counts(), (9, 1, 0));
        assert_close(pairs.sign_p_value().unwrap(), 0.003_906_25, 1e-12);
        assert_eq!(pairs.ratio(), None, "some are negative");
        let bootstrap = pairs.difference_bootstrap(&Bootstrap::default()).unwrap();
        assert!(bootstrap.contains(-1.58) && bootstrap.high < 0.0);
    }

    #[test]
    fn only_complete_finite_pairs_count() {
        let a = [Some(1.0), None, Some(f64::NAN), Some(4.0), Some(9.0)];
        let b = [Some(2.0), Some(1.0), Some(1.0), Some(f64::INFINITY)];
        let pairs = Pairs::from_columns(&a, &b);
        assert_eq!((pairs.n(), pairs.incomplete(), pairs.sign_counts()), (1, 4, (1, 0, 0)));
        assert_eq!(
            (pairs.p_value(), pairs.difference_interval(), pairs.ratio()),
            (None, None, None)
        );
        assert_eq!(Pairs::from_columns(&[], &[]).sign_p_value(), None);
    }

    #[test]
    fn differences_without_spread_have_no_p_value_but_none() {
        assert_eq!(Pairs::from_columns(&some(&[1.0; 5]), &some(&[1.0; 5])).p_value(), Some(1.0));
        assert_eq!(Pairs::from_columns(&some(&[1.0; 5]), &some(&[2.0; 5])).p_value(), None);
        let sure = Pairs::from_columns(&some(&[1.0; 5]), &some(&[2.0; 5])).ratio().unwrap();
        assert_eq!(sure, (0.5, None), "an interval without width would claim too much");
        let counts = Pairs::from_columns(&some(&[2.0; 5]), &some(&[3.0; 5]));
        assert_eq!((counts.difference(), counts.difference_interval()), (Some(-1.0), None));
        assert_eq!(counts.difference_bootstrap(&Bootstrap::default()), None);
    }

    #[test]
    fn differences_that_are_equal_but_for_rounding_are_one_case() {
        let zeros = some(&[0.0; 5]);
        let turned = [14.285714348, 14.285714349, 14.285714348, 14.285714347, 14.285714348];
        let pairs = Pairs::from_columns(&some(&turned), &zeros);
        assert!(pairs.is_one_case());
        assert_eq!(
            (pairs.p_value(), pairs.sign_p_value(), pairs.difference_interval()),
            (None, None, None)
        );
        assert_eq!(pairs.difference_bootstrap(&Bootstrap::default()), None);
        // Both vary, and differ by rounding alone.
        let cases = [1e6 + 0.1, 2e6 + 0.2, 3e6 + 0.3, 4e6 + 0.4, 5e6 + 0.5];
        let rounded = cases.map(|case| case * (1.0 + 1e-14));
        let pairs = Pairs::from_columns(&some(&rounded), &some(&cases));
        assert_eq!((pairs.p_value(), pairs.sign_counts()), (Some(1.0), (0, 5, 0)));
        // A small effect that is more than rounding is one.
        let moved = [1e-3, 2e-3, 1.5e-3, 1e-3, 2e-3].map(|effect| 1e3 + effect);
        let pairs = Pairs::from_columns(&some(&moved), &some(&[1e3; 5]));
        assert!(pairs.p_value().is_some_and(|p| p < 0.01) && !pairs.is_one_case());
    }

    #[test]
    fn fewer_than_five_pairs_have_an_interval_and_no_p_value() {
        let a = some(&[3.0, 4.5, 3.5, 4.0, 3.2]);
        let b = some(&[1.0, 1.2, 1.1, 1.3, 1.0]);
        let four = Pairs::from_columns(&a[..4], &b[..4]);
        assert!(four.difference_interval().is_some());
        assert_eq!((four.p_value(), four.sign_p_value()), (None, None));
        let five = Pairs::from_columns(&a, &b);
        assert!(five.p_value().is_some() && five.sign_p_value().is_some());
    }

    #[test]
    fn holm_gives_what_r_gives() {
        // R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm").
        let adjusted = holm(&[Some(0.01), Some(0.04), None, Some(0.03), Some(0.005)]);
        let expected = [Some(0.03), Some(0.06), None, Some(0.06), Some(0.02)];
        for (a, e) in adjusted.iter().zip(expected) {
            assert_eq!(a.is_some(), e.is_some());
            assert_close(a.unwrap_or(0.0), e.unwrap_or(0.0), 1e-12);
        }
        assert_eq!(holm(&[Some(f64::NAN), None]), [None, None]);
        assert_eq!(holm(&[Some(0.9), Some(0.8)]), [Some(1.0), Some(1.0)]);
    }

    /// Fixed seed. 2,000 families of five treatments, none of which differs, 12 pairs each: the
    /// standard error of a share of 5 % is 0.5 %, bounds are four of these away.
    #[test]
    fn intervals_of_pairs_cover_and_families_err_as_rarely_as_told() {
        let (families, n) = (2000, 12_u32);
        let (mut ratios, mut wrong) = (0, 0);
        for family in 0..families {
            let mut draws = Streams::new(Seed(21)).draws(family, 0, Purpose(0));
            let case: Vec<f64> = (0..n).map(|_| 20.0 + 2.0 * normal(&mut draws)).collect();
            let mut treated =
                || -> Vec<_> { case.iter().map(|c| Some(c + normal(&mut draws))).collect() };
            let baseline = treated();
            let pairs: Vec<Pairs> =
                (0..5).map(|_| Pairs::from_columns(&treated(), &baseline)).collect();
            ratios += usize::from(pairs[0].ratio().unwrap().1.unwrap().contains(1.0));
            let p: Vec<_> = pairs.iter().map(Pairs::p_value).collect();
            wrong += usize::from(holm(&p).iter().any(|p| p.unwrap() < 0.05));
        }
        let (ratios, wrong) = (ratios as f64 / 2000.0, wrong as f64 / 2000.0);
        println!("Fieller covers {ratios}; families with an error {wrong}");
        assert_close(ratios, 0.95, 0.02);
        assert!(wrong < 0.07, "{wrong}");
    }

    proptest! {
        #[test]
        fn fieller_of_the_inverse_is_the_inverse(
            pairs in prop::collection::vec((50.0_f64..60.0, 80.0_f64..100.0), 3..30),
        ) {
            let (a, b): (Vec<_>, Vec<_>) = pairs.into_iter().map(|(a, b)| (Some(a), Some(b))).unzip();
            let (ratio, interval) = Pairs::from_columns(&a, &b).ratio().unwrap();
            let (other, inverse) = Pairs::from_columns(&b, &a).ratio().unwrap();
            let (Some(interval), Some(inverse)) = (interval, inverse) else { return Ok(()) };
            prop_assert!((ratio * other - 1.0).abs() < 1e-12 && interval.contains(ratio));
            prop_assert!((interval.low * inverse.high - 1.0).abs() < 1e-9);
            prop_assert!((interval.high * inverse.low - 1.0).abs() < 1e-9);
        }

        #[test]
        fn no_pairs_make_a_comparison_panic(
            a in prop::collection::vec(prop::option::of(prop::num::f64::ANY), 0..8),
            b in prop::collection::vec(prop::option::of(prop::num::f64::ANY), 0..8),
        ) {
            let pairs = Pairs::from_columns(&a, &b);
            let few = Bootstrap { resamples: 50, ..Bootstrap::default() };
            let _ = (pairs.difference(), pairs.difference_interval(), pairs.ratio(), pairs.p_value());
            let _ = (pairs.difference_bootstrap(&few), pairs.ratio_bootstrap(&few), pairs.sign_p_value());
        }

        #[test]
        fn adjusted_p_values_keep_their_order_and_only_grow(p in prop::collection::vec(0.0_f64..1.0, 0..12)) {
            let adjusted = holm(&some(&p));
            for (i, a) in adjusted.iter().enumerate() {
                prop_assert!(a.unwrap() >= p[i] && a.unwrap() <= 1.0);
                prop_assert!((0..p.len()).all(|j| p[i] > p[j] || adjusted[i] <= adjusted[j]));
            }
        }
    }
}
