//! Statistics: intervals, pairs, and the stopping rule; a value that is not finite is missing.

use crate::error::argument_error;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use sidestep::statistics::{self, Bootstrap, Interval, Pairs, Sample, StopDecision, StoppingRule};

/// The lower and upper ends of an interval.
type IntervalEnds = Option<(f64, f64)>;
/// Values that come from Python.
type PyValues<'py> = PyReadonlyArray1<'py, f64>;

fn ends(interval: Interval) -> (f64, f64) {
    (interval.low, interval.high)
}

fn to_options(values: &PyValues<'_>) -> Vec<Option<f64>> {
    values.as_array().iter().map(|value| value.is_finite().then_some(*value)).collect()
}

/// Mean, standard deviation, Student's and the bootstrap's interval of the mean, the number of values and of missing
/// ones: the native part of `sidestep.stats.mean`.
#[pyfunction]
pub(crate) fn stats_mean(
    py: Python<'_>,
    values: PyValues<'_>,
) -> (Option<f64>, Option<f64>, IntervalEnds, IntervalEnds, usize, usize) {
    let sample = Sample::from_runs(to_options(&values));
    let bootstrap = py.detach(|| Bootstrap::default().mean(&sample.values));
    (
        statistics::mean(&sample.values),
        statistics::sample_sd(&sample.values),
        statistics::mean_interval(&sample.values).map(ends),
        bootstrap.map(ends),
        sample.values.len(),
        sample.missing,
    )
}

/// Wilson's and Clopper and Pearson's intervals of a share: the native part of `sidestep.stats.share`.
#[pyfunction]
pub(crate) fn stats_share(successes: u64, n: u64) -> PyResult<((f64, f64), (f64, f64))> {
    if successes > n {
        let cause = format!("there cannot be {successes} successes in {n} trials");
        return Err(argument_error("successes", cause, "give at most as many as there are trials"));
    }
    let wilson = statistics::wilson(successes as f64, n as f64);
    let exact = if n == 0 {
        // Without a trial, any share is possible.
        Interval { low: 0.0, high: 1.0 }
    } else {
        statistics::clopper_pearson(successes, n)
    };
    Ok((ends(wilson), ends(exact)))
}

/// A quantile, its interval by order statistics and the coverage of that: the native part of
/// `sidestep.stats.quantile`.
#[pyfunction]
pub(crate) fn stats_quantile(
    values: PyValues<'_>,
    q: f64,
) -> (Option<f64>, IntervalEnds, Option<f64>) {
    let sorted = Sample::from_runs(to_options(&values)).sorted();
    let interval = statistics::quantile_interval(&sorted, q);
    let coverage = interval.map(|interval| interval.coverage);
    (statistics::percentile(&sorted, q), interval.map(|quantile| ends(quantile.interval)), coverage)
}

/// The outcome of two treatments of the same cases.
type PairedResult = (
    (usize, usize, Option<f64>),
    (IntervalEnds, IntervalEnds),
    (Option<f64>, Option<f64>),
    (usize, usize, usize),
    (Option<f64>, IntervalEnds),
);

/// Differences and ratios of pairs: the native part of `sidestep.stats.paired`.
#[pyfunction]
pub(crate) fn stats_paired(
    py: Python<'_>,
    a: PyValues<'_>,
    b: PyValues<'_>,
) -> PyResult<PairedResult> {
    let a = to_options(&a);
    let b = to_options(&b);
    if a.len() != b.len() {
        let cause = format!("{} and {} values are no pairs", a.len(), b.len());
        return Err(argument_error(
            "paired",
            cause,
            "give two values for each case, NaN where one is missing",
        ));
    }
    let pairs = Pairs::from_columns(&a, &b);
    let bootstrap = py.detach(|| pairs.difference_bootstrap(&Bootstrap::default()));
    let ratio = pairs.ratio();
    Ok((
        (pairs.n(), pairs.incomplete(), pairs.difference()),
        (pairs.difference_interval().map(ends), bootstrap.map(ends)),
        (pairs.p_value(), pairs.sign_p_value()),
        pairs.sign_counts(),
        (ratio.map(|(ratio, _)| ratio), ratio.map(|(_, interval)| ends(interval))),
    ))
}

/// P-values adjusted by Holm: the native part of `sidestep.stats.holm`.
#[pyfunction]
pub(crate) fn stats_holm(p_values: Vec<Option<f64>>) -> Vec<Option<f64>> {
    statistics::holm(&p_values)
}

/// The rank correlation of two quantities with its interval and p-value: the native part of
/// `sidestep.stats.correlation`.
#[pyfunction]
pub(crate) fn stats_correlation(
    a: PyValues<'_>,
    b: PyValues<'_>,
) -> Option<(f64, IntervalEnds, usize)> {
    let pair = |(a, b): (Option<f64>, Option<f64>)| Some((a?, b?));
    let pairs: Vec<(f64, f64)> =
        to_options(&a).into_iter().zip(to_options(&b)).filter_map(pair).collect();
    let correlation = statistics::rank_correlation(&pairs)?;
    Some((correlation.value, correlation.interval.map(ends), pairs.len()))
}

/// The stopping rule: the native part of `sidestep.stats.StoppingRule`. Returns the number of runs, and the reason if
/// they are enough.
#[pyfunction]
pub(crate) fn stats_next(
    half_width: f64,
    relative: bool,
    runs: (usize, usize),
    columns: Vec<PyValues<'_>>,
) -> (usize, Option<&'static str>) {
    let (min_runs, max_runs) = runs;
    let rule = StoppingRule { half_width, relative, min_runs, max_runs };
    let columns: Vec<Vec<Option<f64>>> = columns.iter().map(to_options).collect();
    let columns: Vec<&[Option<f64>]> = columns.iter().map(Vec::as_slice).collect();
    match rule.decide_columns(&columns) {
        StopDecision::Run(runs) => (runs, None),
        StopDecision::Enough(runs, reason) => (runs, Some(reason.describe())),
    }
}
