//! Statistics: intervals, pairs, and the stopping rule; a value that is not finite is missing.

use crate::error::argument_error;
use crate::result::{Fields, ResultClass};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use sidestep::statistics::{self, Bootstrap, Interval, Pairs, Sample, StopDecision, StoppingRule};

/// Values that come from Python.
type PyValues<'py> = PyReadonlyArray1<'py, f64>;

fn class(name: &'static str) -> ResultClass {
    ResultClass("sidestep.stats", name)
}

fn to_options(values: &PyValues<'_>) -> Vec<Option<f64>> {
    values.as_array().iter().map(|value| value.is_finite().then_some(*value)).collect()
}

/// The mean of values with its intervals: the native part of `sidestep.stats.mean`.
#[pyfunction]
pub(crate) fn stats_mean<'py>(
    py: Python<'py>,
    values: PyValues<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    let sample = Sample::from_runs(to_options(&values));
    let bootstrap = py.detach(|| Bootstrap::default().mean(&sample.values));
    // A spread that is rounding is none, and gives no interval.
    let has_spread = !statistics::is_tied_measure(&sample.values);
    let interval = statistics::mean_interval(&sample.values).filter(|_| has_spread);
    let bootstrap = bootstrap.filter(|_| has_spread);
    Fields::new(py)
        .with("mean", statistics::mean(&sample.values))?
        .with("sd", statistics::sample_sd(&sample.values))?
        .with_interval("interval", interval)?
        .with_interval("bootstrap", bootstrap)?
        .with("n", sample.values.len())?
        .with("missing", sample.missing)?
        .build(class("Mean"))
}

/// A proportion with its intervals: the native part of `sidestep.stats.proportion`.
#[pyfunction]
pub(crate) fn stats_share(py: Python<'_>, successes: u64, n: u64) -> PyResult<Bound<'_, PyAny>> {
    if successes > n {
        let cause = format!("there cannot be {successes} successes in {n} trials");
        return Err(argument_error("successes", cause, "give at most as many as there are trials"));
    }
    let share = (n > 0).then(|| successes as f64 / n as f64);
    let exact = if n == 0 {
        // Without a trial, any proportion is possible.
        Interval { low: 0.0, high: 1.0 }
    } else {
        statistics::clopper_pearson(successes, n)
    };
    Fields::new(py)
        .with("share", share)?
        .with_interval("interval", Some(statistics::wilson(successes as f64, n as f64)))?
        .with_interval("exact", Some(exact))?
        .build(class("Share"))
}

/// A quantile with its interval: the native part of `sidestep.stats.quantile`.
#[pyfunction]
pub(crate) fn stats_quantile<'py>(
    py: Python<'py>,
    values: PyValues<'py>,
    q: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let sorted = Sample::from_runs(to_options(&values)).sorted();
    let interval = statistics::quantile_interval(&sorted, q);
    Fields::new(py)
        .with("value", statistics::percentile(&sorted, q))?
        .with_interval("interval", interval.map(|quantile| quantile.interval))?
        .with("coverage", interval.map(|quantile| quantile.coverage))?
        .build(class("Quantile"))
}

/// Differences and ratios of pairs: the native part of `sidestep.stats.paired`.
#[pyfunction]
pub(crate) fn stats_paired<'py>(
    py: Python<'py>,
    a: PyValues<'py>,
    b: PyValues<'py>,
) -> PyResult<Bound<'py, PyAny>> {
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
    let (lower, equal, higher) = pairs.sign_counts();
    let (ratio, ratio_interval) = pairs.ratio().unzip();
    let ratio_interval = ratio_interval.flatten();
    Fields::new(py)
        .with("n", pairs.n())?
        .with("incomplete", pairs.incomplete())?
        .with("difference", pairs.difference())?
        .with_interval("interval", pairs.difference_interval())?
        .with_interval("bootstrap", bootstrap)?
        .with("p_value", pairs.p_value())?
        .with("sign_p_value", pairs.sign_p_value())?
        .with("lower", lower)?
        .with("equal", equal)?
        .with("higher", higher)?
        .with("ratio", ratio)?
        .with_interval("ratio_interval", ratio_interval)?
        .build(class("Paired"))
}

/// P-values adjusted by Holm: the native part of `sidestep.stats.holm`.
#[pyfunction]
pub(crate) fn stats_holm(p_values: Vec<Option<f64>>) -> Vec<Option<f64>> {
    statistics::holm(&p_values)
}

/// The rank correlation of two quantities, None if one of them is constant: the native part of
/// `sidestep.stats.correlation`.
#[pyfunction]
pub(crate) fn stats_correlation<'py>(
    py: Python<'py>,
    a: PyValues<'py>,
    b: PyValues<'py>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let cases = to_options(&a).into_iter().zip(to_options(&b));
    let pairs: Vec<(f64, f64)> = cases.filter_map(|(a, b)| a.zip(b)).collect();
    let Some(correlation) = statistics::rank_correlation(&pairs) else { return Ok(None) };
    let result = Fields::new(py)
        .with("value", correlation.value)?
        .with_interval("interval", correlation.interval)?
        .with("n", pairs.len())?
        .build(class("Correlation"))?;
    Ok(Some(result))
}

/// The settings of the stopping rule, as passed by `sidestep.stats.StoppingRule`.
#[derive(FromPyObject)]
pub(crate) struct StoppingRuleSettings {
    half_width: f64,
    relative: bool,
    min_runs: usize,
    max_runs: usize,
}

/// The number of runs, and the reason if they are enough: the native part of `sidestep.stats.StoppingRule.next`.
#[pyfunction]
pub(crate) fn stats_next<'py>(
    py: Python<'py>,
    rule: StoppingRuleSettings,
    columns: Vec<PyValues<'py>>,
) -> PyResult<Bound<'py, PyAny>> {
    let StoppingRuleSettings { half_width, relative, min_runs, max_runs } = rule;
    let rule = StoppingRule { half_width, relative, min_runs, max_runs };
    let columns: Vec<Vec<Option<f64>>> = columns.iter().map(to_options).collect();
    let columns: Vec<&[Option<f64>]> = columns.iter().map(Vec::as_slice).collect();
    let (runs, reason) = match rule.decide_columns(&columns) {
        StopDecision::Run(runs) => (runs, None),
        StopDecision::Enough(runs, reason) => (runs, Some(reason.describe())),
    };
    Fields::new(py).with("runs", runs)?.with("reason", reason)?.build(class("StopDecision"))
}
