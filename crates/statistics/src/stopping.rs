//! Stopping rules: the number of runs that is enough.
//!
//! # The effect of stopping early on an interval
//!
//! A sweep that checks repeatedly and stops as soon as the interval is narrow stops when the
//! spread happens to be small, and with a relative target when the mean happens to be large.
//! The interval then contains the true value a little less often than 95 % (Anscombe 1953; Chow and
//! Robbins 1965: the loss vanishes as the target gets narrower, not before). Three rules keep it
//! small: no check before [`StoppingRule::min_runs`], checks only at the ends of rounds, and rounds
//! that grow by at least a half and at most double the number of runs, toward the number that the
//! present spread predicts, so that there are few checks. Measured by the tests of this module over
//! 4,000 sweeps each (standard error 0.4 %), nominal 95 %:
//!
//! | values | target | first check | runs | coverage |
//! |---|---|---|---|---|
//! | normal | a quarter sd | 10 | 76 | 94.7 % |
//! | normal | half an sd | 10 | 21 | 93.8 % |
//! | normal, mean 10 sd | 2 % of the mean | 10 | 117 | 94.4 % |
//! | exponential | 20 % of the mean | 10 | 117 | 94.8 % |
//! | exponential | 50 % of the mean | 10 | 20 | 90.4 % |
//! | exponential | 50 % of the mean | 20 | 23 | 91.7 % |
//! | exponential | none, 20 runs | | 20 | 91.7 % |
//! | exponential | none, 100 runs | | 100 | 95.0 % |
//!
//! So the loss is small, and few runs of skewed values lose as much without any stopping: 20 runs
//! are few. A first round of 20 costs little.
//!
//! Where that matters, choose a larger first round, or a fixed number of runs.

use super::interval::runs_for_half_width;
use super::mean_interval;
use super::moments::{Sample, is_tied, mean, sample_sd};
use serde::Serialize;

/// The number of equal values from which on they are called constant: by the rule of three (`3 / n`) at
/// most about 5 % of all runs then differ. With fewer, an interval without width is no evidence.
const MIN_CONSTANT_RUNS: usize = 60;

/// A rule that ends the runs at a half-width of Student's 95 % interval of the mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StoppingRule {
    /// The target half-width, in the metric's unit, or as a fraction of the mean.
    pub half_width: f64,
    /// Whether it is a fraction of the mean's magnitude.
    pub relative: bool,
    /// Number of runs of the first round; at least 2.
    pub min_runs: usize,
    /// Number of runs after which it stops in any case.
    pub max_runs: usize,
}

/// The next step of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopDecision {
    /// Run until there is this number of runs in total, then decide again.
    Run(usize),
    /// The first runs, of this number, are the result; later ones are not part of it.
    Enough(usize, StopReason),
}

/// The reason why runs are enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StopReason {
    /// The interval is as narrow as the target.
    Reached,
    /// All values are equal but for rounding, and there are enough of them (60) to call the metric constant.
    Constant,
    /// All values of all metrics are equal but for rounding: seeds change nothing that a metric shows, so that no number
    /// of runs gives an interval.
    Unseen,
    /// The maximum number of runs is reached, and the interval is wider than the target.
    Maximum,
    /// The maximum number of runs is reached, and the interval contains 0: no fraction of a mean that
    /// may be 0 is narrow enough. Give an absolute half-width instead.
    MeanNearZero,
    /// The maximum number of runs is reached, and fewer than two have a value.
    TooFewValues,
    /// No run of the first round has a value.
    NoValues,
    /// Seeds change nothing, so one run is enough.
    Seedless,
}

impl StopReason {
    /// Returns the reason as a clause, without a capital letter or a period.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Reached => "the interval is as narrow as wanted",
            Self::Constant => "all values are equal",
            Self::Unseen => {
                "seeds change nothing that a metric shows: all values are equal but for rounding, \
                 so no number of runs gives an interval"
            }
            Self::Maximum => "the maximum of runs is reached; the interval is wider than wanted",
            Self::MeanNearZero => {
                "the maximum of runs is reached; the mean may be 0, of which no share is narrow \
                 enough: ask for an absolute half-width"
            }
            Self::TooFewValues => "the maximum of runs is reached; fewer than two have a value",
            Self::Seedless => "seeds change nothing",
            Self::NoValues => "none of them has come to a value",
        }
    }
}

impl StoppingRule {
    /// Returns the next step after these runs, one value each, in the order of the runs.
    ///
    /// A function of the values alone: it repeats the rounds from the first run on, for any
    /// number of values. The result therefore does not depend on the number of workers, on runs that
    /// they did in advance, or on whether a sweep was killed in the middle of a round.
    pub fn decide(&self, values: &[Option<f64>]) -> StopDecision {
        self.decide_columns(&[values])
    }

    /// Returns the next step for several columns at once (metrics, or variants that are run side by
    /// side): enough when all are, with the worst reason. Only runs that all columns have count.
    ///
    /// Without columns there is no target, and the first round is enough.
    pub fn decide_columns(&self, columns: &[&[Option<f64>]]) -> StopDecision {
        let runs = columns.iter().map(|c| c.len()).min().unwrap_or(usize::MAX);
        let mut total = self.min_runs.max(2).min(self.max_runs);
        while runs >= total {
            let mut next_total = None;
            let mut worst_reason = StopReason::Reached;
            for column in columns {
                match self.decide_round(&column[..total]) {
                    StopDecision::Run(more) => next_total = next_total.max(Some(more)),
                    // Reasons are declared from the best to the worst.
                    StopDecision::Enough(_, reason) => worst_reason = worst_reason.max(reason),
                }
            }
            match next_total {
                Some(next_total) => total = next_total,
                None => return StopDecision::Enough(total, worst_reason),
            }
        }
        StopDecision::Run(total)
    }

    /// Decides at the end of a round. A target that the last possible run reaches counts as reached.
    fn decide_round(&self, values: &[Option<f64>]) -> StopDecision {
        let runs = values.len();
        let sample = Sample::from_runs(values.iter().copied()).values;
        match self.reason_before_max(&sample) {
            Some(reason) => StopDecision::Enough(runs, reason),
            None if runs >= self.max_runs => {
                StopDecision::Enough(runs, self.reason_at_max(&sample))
            }
            None => StopDecision::Run(self.next_round_end(runs, &sample)),
        }
    }

    fn reason_before_max(&self, sample: &[f64]) -> Option<StopReason> {
        let interval = mean_interval(sample)?;
        if is_tied(sample) {
            return (sample.len() >= MIN_CONSTANT_RUNS).then_some(StopReason::Constant);
        }
        let reached = interval.half_width() <= self.target(sample);
        // A target of 0 is only reached by values that never vary.
        reached.then_some(StopReason::Reached)
    }

    fn reason_at_max(&self, sample: &[f64]) -> StopReason {
        match mean_interval(sample) {
            None => StopReason::TooFewValues,
            Some(interval) if self.relative && interval.contains(0.0) => StopReason::MeanNearZero,
            // Too wide, or without width but from too few runs to be called constant.
            Some(_) => StopReason::Maximum,
        }
    }

    /// Returns the target half-width, in the metric's unit.
    fn target(&self, sample: &[f64]) -> f64 {
        let unit = if self.relative { mean(sample).unwrap_or(0.0).abs() } else { 1.0 };
        self.half_width * unit
    }

    /// Returns the end of the next round: the number that the spread so far predicts, at least half
    /// as much again and at most twice the present number.
    fn next_round_end(&self, runs: usize, sample: &[f64]) -> usize {
        let values = if is_tied(sample) {
            Some(MIN_CONSTANT_RUNS as u64)
        } else {
            sample_sd(sample).and_then(|sd| runs_for_half_width(sd, self.target(sample)))
        };
        // Runs without a value do not count, so more runs are needed than values.
        let fraction = sample.len() as f64 / runs as f64;
        let predicted = values.map_or(usize::MAX, |n| (n as f64 / fraction).ceil() as usize);
        let min_total = runs + runs.div_ceil(2);
        let max_total = runs.saturating_mul(2);
        predicted.clamp(min_total, max_total).min(self.max_runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_kernel::distr::normal;
    use sidestep_kernel::stream::{Draws, Purpose, Streams};
    use sidestep_kernel::{Seed, math};

    const ABSOLUTE: StoppingRule =
        StoppingRule { half_width: 0.25, relative: false, min_runs: 10, max_runs: 1000 };

    fn drawn(case: u32, n: usize, draw: impl Fn(&mut Draws) -> f64) -> Vec<Option<f64>> {
        let mut draws = Streams::new(Seed(3)).draws(case, 0, Purpose(0));
        (0..n).map(|_| Some(draw(&mut draws))).collect()
    }

    #[test]
    fn the_first_look_is_after_the_first_round() {
        assert_eq!(ABSOLUTE.decide(&[]), StopDecision::Run(10));
        assert_eq!(ABSOLUTE.decide(&[Some(1.0); 9]), StopDecision::Run(10));
        assert_eq!(StoppingRule { min_runs: 0, ..ABSOLUTE }.decide(&[]), StopDecision::Run(2));
        assert_eq!(StoppingRule { max_runs: 5, ..ABSOLUTE }.decide(&[]), StopDecision::Run(5));
        assert_eq!(
            StoppingRule { max_runs: 0, ..ABSOLUTE }.decide(&[]),
            StopDecision::Enough(0, StopReason::TooFewValues)
        );
        assert_eq!(ABSOLUTE.decide_columns(&[]), StopDecision::Enough(10, StopReason::Reached));
    }

    #[test]
    fn equal_values_are_believed_after_sixty() {
        assert_eq!(ABSOLUTE.decide(&[Some(1.0); 59]), StopDecision::Run(60));
        assert_eq!(
            ABSOLUTE.decide(&[Some(1.0); 60]),
            StopDecision::Enough(60, StopReason::Constant)
        );
        let relative = StoppingRule { relative: true, max_runs: 20, ..ABSOLUTE };
        assert_eq!(
            relative.decide(&[Some(0.0); 20]),
            StopDecision::Enough(20, StopReason::MeanNearZero)
        );
        assert_eq!(
            relative.decide(&[Some(2.0); 20]),
            StopDecision::Enough(20, StopReason::Maximum)
        );
    }

    #[test]
    fn a_mean_near_zero_runs_to_the_maximum_and_says_so() {
        let rule = StoppingRule { half_width: 0.05, relative: true, min_runs: 10, max_runs: 300 };
        let values: Vec<_> = (0..300).map(|i| Some(if i % 2 == 0 { 1.0 } else { -1.0 })).collect();
        assert_eq!(rule.decide(&values), StopDecision::Enough(300, StopReason::MeanNearZero));
    }

    #[test]
    fn runs_without_a_value_are_made_up_for() {
        let nothing = vec![None; 1000];
        assert_eq!(ABSOLUTE.decide(&nothing), StopDecision::Enough(1000, StopReason::TooFewValues));
        let half: Vec<_> = drawn(1, 1000, normal)
            .into_iter()
            .enumerate()
            .map(|(i, v)| v.filter(|_| i % 2 == 0))
            .collect();
        let StopDecision::Enough(runs, StopReason::Reached) = ABSOLUTE.decide(&half) else {
            panic!("not reached")
        };
        assert!((100..=300).contains(&runs), "{runs}");
    }

    #[test]
    fn columns_go_on_until_the_last_of_them_is_narrow() {
        let (wide, narrow) = (drawn(1, 1000, normal), drawn(2, 1000, |d| 0.01 * normal(d)));
        let StopDecision::Enough(alone, StopReason::Reached) = ABSOLUTE.decide(&narrow) else {
            panic!()
        };
        let both = ABSOLUTE.decide_columns(&[&narrow, &wide]);
        assert_eq!(alone, 10);
        assert_eq!(both, ABSOLUTE.decide(&wide));
    }

    /// Share of intervals at the stop that contain the mean, over 4,000 sweeps, and their mean
    /// number of runs.
    fn coverage(rule: StoppingRule, truth: f64, draw: impl Fn(&mut Draws) -> f64) -> (f64, f64) {
        let (mut held, mut total) = (0, 0);
        let sweeps = 4000;
        for case in 0..sweeps {
            let values = drawn(case, rule.max_runs, &draw);
            let StopDecision::Enough(runs, _) = rule.decide(&values) else {
                panic!("all runs are there")
            };
            let sample = Sample::from_runs(values[..runs].iter().copied()).values;
            held += usize::from(mean_interval(&sample).unwrap().contains(truth));
            total += runs;
        }
        (held as f64 / f64::from(sweeps), total as f64 / f64::from(sweeps))
    }

    /// Fixed seed. The standard error of a coverage is 0.0036; the bounds are three errors below
    /// the measured values, so a rule as good as ours fails at about one seed in 700.
    #[test]
    fn stopping_early_costs_little_coverage() {
        let normal_rule = |half_width| StoppingRule { half_width, max_runs: 400, ..ABSOLUTE };
        let relative = |half_width| StoppingRule { relative: true, ..normal_rule(half_width) };
        let exponential = |d: &mut Draws| -math::ln(1.0 - d.uniform());
        let fixed = |n| StoppingRule { min_runs: n, max_runs: n, ..ABSOLUTE };
        let later = |half_width| StoppingRule { min_runs: 20, ..relative(half_width) };
        let measured = [
            ("normal, 0.25 sd", 0.925, coverage(normal_rule(0.25), 0.0, normal)),
            ("normal, 0.5 sd", 0.925, coverage(normal_rule(0.5), 0.0, normal)),
            ("normal, 2 %", 0.925, coverage(relative(0.02), 10.0, |d| 10.0 + normal(d))),
            ("exponential, 20 %", 0.925, coverage(relative(0.2), 1.0, exponential)),
            ("exponential, 50 %", 0.89, coverage(relative(0.5), 1.0, exponential)),
            ("exponential, 50 %, from 20", 0.90, coverage(later(0.5), 1.0, exponential)),
            ("exponential, 20 runs", 0.90, coverage(fixed(20), 1.0, exponential)),
            ("exponential, 100 runs", 0.92, coverage(fixed(100), 1.0, exponential)),
        ];
        for (name, at_least, (held, runs)) in measured {
            println!("{name}: {held} at {runs} runs");
            assert!(held > at_least, "{name}: {held}");
        }
    }

    proptest! {
        #[test]
        fn the_decision_does_not_depend_on_when_one_looks(
            values in prop::collection::vec(prop::option::of(-10.0_f64..30.0), 200), half_width in 0.1_f64..5.0,
            relative: bool,
        ) {
            let rule = StoppingRule { half_width, relative, min_runs: 10, max_runs: 200 };
            let last = rule.decide(&values);
            let StopDecision::Enough(end, _) = last else { panic!("all runs are there") };
            for there in 0..=200 {
                match rule.decide(&values[..there]) {
                    StopDecision::Run(total) => prop_assert!(there < total && total <= end),
                    enough => prop_assert!(there >= end && enough == last),
                }
            }
        }

        #[test]
        fn no_rule_and_no_values_make_it_panic_or_hang(
            values in prop::collection::vec(prop::option::of(prop::num::f64::ANY), 0..40),
            half_width in prop::num::f64::ANY, relative: bool, min_runs in 0_usize..50, max_runs in 0_usize..50,
        ) {
            let rule = StoppingRule { half_width, relative, min_runs, max_runs };
            match rule.decide(&values) {
                StopDecision::Run(total) => prop_assert!(total > values.len() && total <= max_runs),
                StopDecision::Enough(runs, _) => prop_assert!(runs <= values.len()),
            }
        }
    }
}
