//! The summary as tables.

use super::compare::Comparison;
use super::label::sentence;
use super::summary::{
    Described, LeftOut, MetricSummary, NOT_ASKED_FOR, Numbers, Quantile, Share, Summary,
    VariantMetric,
};
use crate::statistics::Interval;
use sidestep_document::{Estimate, Table};
use sidestep_kernel::math;

pub(super) fn tables(summary: &Summary) -> Vec<Table> {
    let of_metrics = summary.metrics.iter().flat_map(|metric| of_metric(summary, metric));
    of_metrics.chain(left_out(summary)).collect()
}

/// Returns a table per metric with the most important numbers: means and differences, each with its
/// interval and number of runs.
pub(super) fn brief(summary: &Summary) -> Vec<Table> {
    summary.metrics.iter().map(|metric| brief_of(summary, metric)).collect()
}

/// Largest number of characters of a heading.
const MOST_OF_HEADING: usize = 24;

fn brief_of(summary: &Summary, metric: &MetricSummary) -> Table {
    let minus = summary.baseline.as_ref().map(|name| format!("minus {name}"));
    // A long name stands in the title.
    let is_long = |words: &&String| words.chars().count() > MOST_OF_HEADING;
    let (title, against) = match minus.as_ref().filter(is_long) {
        Some(words) => {
            let title = format!("{}, difference: {words}", sentence(&metric.label));
            (title, Some("difference".to_string()))
        }
        None => (sentence(&metric.label), minus),
    };
    let mean = if metric.is_share { "share of runs" } else { "mean" };
    let mut columns = vec!["variant", "n", mean];
    columns.extend(against.as_deref());
    columns.extend(against.as_ref().map(|_| "p (Holm)"));
    let mut table = Table::new(title, "", &columns);
    for variant in &metric.variants {
        let value = match &variant.values {
            Described::Numbers(numbers) => center(variant, numbers.mean, numbers.interval),
            Described::Share(share) => center(variant, share.share, share.interval),
        };
        let mut row = vec![variant.variant.clone(), variant.n.to_string(), value];
        if let Some(c) = metric.comparisons.iter().find(|c| c.variant == variant.variant) {
            row.push(match (c.seedless, c.difference) {
                (true, Some(difference)) => number(difference, Some(0.0)),
                _ => format!("{} n={}", with_interval(c.difference, c.interval), c.pairs),
            });
            row.push(c.p_holm.map_or("-".into(), p_value));
        }
        table.row(row);
    }
    table
}

/// Returns the tables of a metric.
pub(super) fn of_metric(summary: &Summary, metric: &MetricSummary) -> Vec<Table> {
    let mut tables = vec![values(metric)];
    if let Some(baseline) = &summary.baseline {
        tables.push(differences(metric, baseline));
    }
    if !metric.effects.is_empty() {
        tables.push(effects(metric));
    }
    tables
}

fn values(metric: &MetricSummary) -> Table {
    if metric.is_share { shares(metric) } else { numbers(metric) }
}

fn numbers(metric: &MetricSummary) -> Table {
    let note = "95 % intervals in brackets: of the mean by Student's t and by the bootstrap (BCa), \
                of quantiles by order statistics; `-` where n is too small for one. n: runs with a \
                value. sd, min and max describe these very runs. `for ±5 %`: runs that would narrow \
                Student's interval to 5 % of the mean to either side, if runs go on to vary by this \
                sd.";
    let columns = [
        "variant",
        "n",
        "missing",
        "mean",
        "bootstrap",
        "median",
        "5 %",
        "25 %",
        "75 %",
        "95 %",
        "sd",
        "min",
        "max",
        "for ±5 %",
    ];
    let mut table = Table::new(sentence(&metric.label), note, &columns);
    for variant in &metric.variants {
        if let Described::Numbers(numbers) = &variant.values {
            table.row(number_row(variant, numbers));
        }
    }
    table
}

fn number_row(variant: &VariantMetric, numbers: &Numbers) -> Vec<String> {
    let width = numbers.interval.map(|i| i.half_width());
    let plain = |value: Option<f64>| value.map_or("-".into(), |v| number(v, width));
    let quantile = |k: usize| numbers.quantiles.get(k).map_or("-".into(), |q| quantile(q, width));
    let bootstrap = numbers.bootstrap.map_or("-".into(), brackets);
    let needed = numbers.runs_for_5_percent.map_or("-".into(), |n| n.to_string());
    vec![
        variant.variant.clone(),
        variant.n.to_string(),
        variant.missing.to_string(),
        center(variant, numbers.mean, numbers.interval),
        bootstrap,
        quantile(2),
        quantile(0),
        quantile(1),
        quantile(3),
        quantile(4),
        plain(numbers.sd),
        plain(numbers.min),
        plain(numbers.max),
        needed,
    ]
}

fn quantile(quantile: &Quantile, width: Option<f64>) -> String {
    match quantile.interval {
        Some(found) => with_interval(Some(quantile.value), Some(found.interval)),
        None => format!("{} [-]", number(quantile.value, width)),
    }
}

fn shares(metric: &MetricSummary) -> Table {
    let note =
        "Share of runs of which it is true, with Wilson's 95 % interval. n: runs with a value.";
    let columns = ["variant", "n", "missing", "runs", "share"];
    let mut table = Table::new(sentence(&metric.label), note, &columns);
    for variant in &metric.variants {
        if let Described::Share(Share { yes, share, interval }) = variant.values {
            let counts = [variant.n, variant.missing, yes].map(|count| count.to_string());
            let share = center(variant, share, interval);
            table.row([variant.variant.clone()].into_iter().chain(counts).chain([share]));
        }
    }
    table
}

fn differences(metric: &MetricSummary, baseline: &str) -> Table {
    let family = metric.comparisons.iter().filter(|c| c.p.is_some()).count();
    let test =
        if metric.is_share { "the exact sign test (McNemar's)" } else { "Student's paired test" };
    let note = format!(
        "Variant minus `{baseline}`, replicate by replicate on the same seeds. 95 % intervals in \
         brackets: by Student's t, then by the bootstrap (BCa); of the ratio of means by Fieller's \
         method, where no value is negative and the baseline's mean is well away from 0. `lower`, \
         `higher`: pairs in which the variant is. p: of no difference by {test}, adjusted by Holm over \
         the {family} comparisons of this metric; over several metrics chances add up. `-`: the pairs \
         do not give it."
    );
    let columns = [
        "variant",
        "pairs",
        "incomplete",
        "difference",
        "bootstrap",
        "ratio",
        "bootstrap",
        "lower",
        "higher",
        "p (Holm)",
    ];
    let mut table =
        Table::new(format!("{}: against {baseline}", sentence(&metric.label)), note, &columns);
    metric.comparisons.iter().for_each(|c| table.row(difference_row(c)));
    table
}

fn difference_row(comparison: &Comparison) -> Vec<String> {
    let interval = |i: Option<Interval>| i.map_or("-".into(), brackets);
    let of_pairs = |count: usize| format!("{count} of {}", comparison.pairs);
    vec![
        comparison.variant.clone(),
        comparison.pairs.to_string(),
        comparison.incomplete.to_string(),
        with_interval(comparison.difference, comparison.interval),
        interval(comparison.bootstrap),
        with_interval(comparison.ratio, comparison.ratio_interval),
        interval(comparison.ratio_bootstrap),
        of_pairs(comparison.lower),
        of_pairs(comparison.higher),
        comparison.p_holm.map_or("-".into(), p_value),
    ]
}

fn effects(metric: &MetricSummary) -> Table {
    let note = "Means over all variants that have the level, with 95 % intervals; n: replicates of \
                which all these variants have a value. Each replicate counts as one, since its \
                variants share their seeds.";
    let columns = ["parameter", "level", "variants", "marginal mean", "n"];
    let mut table =
        Table::new(format!("{}: main effects", sentence(&metric.label)), note, &columns);
    for effect in &metric.effects {
        for level in &effect.levels {
            let Estimate { mean, interval, n, .. } = level.estimate;
            let cells = [effect.parameter.clone(), level.level.name(), level.variants.to_string()];
            table.row(cells.into_iter().chain([with_interval(mean, interval), n.to_string()]));
        }
    }
    table
}

/// Returns the reasons why metrics are not shown, if there are such metrics.
pub(super) fn left_out(summary: &Summary) -> Option<Table> {
    let mut table = Table::new("Metrics not shown", "", &["metric", "why"]);
    let asked = |l: &&LeftOut| l.reason != NOT_ASKED_FOR;
    summary
        .left_out
        .iter()
        .filter(asked)
        .for_each(|l| table.row([l.metric.clone(), l.reason.clone()]));
    (!table.rows.is_empty()).then_some(table)
}

/// Returns the mean of a variant with its interval; alone where seeds change nothing.
fn center(variant: &VariantMetric, value: Option<f64>, interval: Option<Interval>) -> String {
    match value {
        Some(value) if variant.seedless => number(value, Some(0.0)),
        value => with_interval(value, interval),
    }
}

/// `12.3 [11.9, 12.7]`; `-` for what is absent.
pub(super) fn with_interval(value: Option<f64>, interval: Option<Interval>) -> String {
    let Some(value) = value else { return "-".into() };
    match interval {
        Some(interval) => {
            let width = interval.half_width();
            format!("{} {}", number(value, Some(width)), brackets(interval))
        }
        None => format!("{} [-]", number(value, None)),
    }
}

fn brackets(interval: Interval) -> String {
    let end = |value| number(value, Some(interval.half_width()));
    format!("[{}, {}]", end(interval.low), end(interval.high))
}

/// Formats a number with two digits of the half width of its interval: more would be noise, fewer
/// would hide the interval. Without a width it has four digits.
fn number(value: f64, half_width: Option<f64>) -> String {
    let width = half_width.filter(|w| *w > 0.0 && w.is_finite());
    let scale = width.unwrap_or(value.abs() * 0.01);
    if value == 0.0 && width.is_none() {
        return "0".into();
    }
    let decimals = 1.0 - math::log10(scale).floor();
    // If runs agree to the last bits, more than six decimals of a number of usual size say nothing.
    let decimals = if value.abs() >= 1e-3 { decimals.min(6.0) } else { decimals };
    let text = if !value.is_finite() || decimals > 8.0 || value.abs() >= 1e9 {
        format!("{value:.3e}")
    } else {
        format!("{value:.*}", decimals.max(0.0) as usize)
    };
    // A width of 0 is not a precision: constants are written as they are.
    if half_width == Some(0.0) && text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').into();
    }
    if text.trim_matches(['-', '0', '.']).is_empty() { text.replace('-', "") } else { text }
}

fn p_value(p: f64) -> String {
    if p < 0.0001 { "< 0.0001".into() } else { format!("{p:.4}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_their_interval_leaves() {
        let shown = |value, low, high| with_interval(Some(value), Some(Interval { low, high }));
        assert_eq!(shown(100.123, 100.112, 100.134), "100.123 [100.112, 100.134]");
        assert_eq!(shown(1234.5, 1100.0, 1369.0), "1234 [1100, 1369]");
        assert_eq!(shown(0.333_33, 0.0, 0.7), "0.33 [0.00, 0.70]");
        assert_eq!(shown(-0.001, -0.8, 0.8), "0.00 [-0.80, 0.80]");
        assert_eq!(shown(2.5, 2.5, 2.5), "2.5 [2.5, 2.5]");
        assert_eq!(shown(0.0, 0.0, 0.0), "0 [0, 0]");
        assert_eq!(with_interval(Some(12.345), None), "12.35 [-]");
        assert_eq!(with_interval(None, None), "-");
        assert_eq!(shown(0.0, f64::NEG_INFINITY, f64::INFINITY), "0 [-inf, inf]");
        assert_eq!(p_value(0.00001), "< 0.0001");
        assert_eq!(p_value(0.0312), "0.0312");
    }
}
