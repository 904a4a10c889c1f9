//! The summary as tables.

use super::Label;
use super::compare::Comparison;
use super::label::capitalized;
use super::summary::{
    MetricSection, MetricSummary, MetricValues, NOT_REQUESTED, NumericSummary, OmittedMetric,
    Proportion, QUANTILES, Quantile, Summary, VariantMetric,
};
use sidestep_document::{Estimate, Figure, Table};
use sidestep_kernel::math;
use sidestep_statistics::Interval;

impl Summary {
    /// Returns all numbers of all metrics shown, then the metrics that are not.
    pub fn tables(&self) -> Vec<Table> {
        tables(self)
    }

    /// Returns a short summary for a terminal: means and differences with their intervals.
    pub fn brief(&self) -> Vec<Table> {
        brief(self)
    }

    /// Returns the whole summary in one table: of every metric and variant the mean, the difference from
    /// the baseline, p and n; of samples of a box of parameters how each metric goes with each of them.
    pub fn overview(&self) -> Table {
        if self.trends.is_empty() { overview(self) } else { trends(self) }
    }

    /// Returns the notes that all tables of metrics have in common, to be given once.
    pub fn footnotes(&self) -> Vec<&'static str> {
        footnotes(self)
    }

    /// Returns [`Self::tables`] and [`Self::figures`], put together for each metric.
    pub fn sections(&self) -> Vec<MetricSection> {
        let mut sections = Vec::with_capacity(self.metrics.len());
        for metric in &self.metrics {
            let figures = self.figures.iter().filter(|(name, _)| *name == metric.name);
            sections.push(MetricSection {
                name: metric.name.clone(),
                title: capitalized(&metric.label),
                meaning: metric.meaning,
                figures: figures.map(|(_, figure)| figure.clone()).collect(),
                tables: metric_tables(self, metric).into_iter().map(Table::folded).collect(),
            });
        }
        sections
    }

    /// Returns the metrics that are not shown, if there are any.
    pub fn omitted_metrics(&self) -> Option<Table> {
        omitted_metrics(self)
    }

    /// Returns the figures of the first page: at most six, which show what differs.
    pub fn lead_figures(&self) -> &[Figure] {
        &self.lead
    }

    /// Returns the summary as figures: each metric over each parameter.
    pub fn figures(&self) -> Vec<Figure> {
        self.figures.iter().map(|(_, figure)| figure.clone()).collect()
    }
}

fn tables(summary: &Summary) -> Vec<Table> {
    let of_metrics = summary.metrics.iter().flat_map(|metric| metric_tables(summary, metric));
    of_metrics.chain(omitted_metrics(summary)).collect()
}

/// Returns a table per metric with the most important numbers: means and differences, each with its
/// interval and number of runs.
fn brief(summary: &Summary) -> Vec<Table> {
    summary.metrics.iter().map(|metric| brief_table(summary, metric)).collect()
}

/// Largest number of characters of a heading.
const MAX_HEADING_CHARS: usize = 24;

fn brief_table(summary: &Summary, metric: &MetricSummary) -> Table {
    let mut title = format!("{}: {}", capitalized(&metric.label), metric.name);
    let mut difference_heading = summary.baseline.as_ref().map(|name| format!("minus {name}"));
    // A long name stands in the title, because a column is as wide as its heading.
    if let Some(heading) = &mut difference_heading
        && heading.chars().count() > MAX_HEADING_CHARS
    {
        title = format!("{title}, difference: {heading}");
        *heading = "difference".to_string();
    }
    let mean = if metric.is_share { "share of runs" } else { "mean" };
    let mut columns = vec!["variant", "n", mean];
    if let Some(heading) = &difference_heading {
        columns.extend([heading.as_str(), "p (Holm)"]);
    }
    let mut table = Table::new(title, "", &columns);
    for variant in &metric.variants {
        let mut row =
            vec![variant.variant.clone(), variant.n.to_string(), center_with_interval(variant)];
        if let Some(c) = metric.comparisons.iter().find(|c| c.variant == variant.variant) {
            let n = if c.seedless { String::new() } else { format!(" n={}", c.pairs) };
            row.push(difference(c) + &n);
            row.push(c.p_holm.map_or("-".into(), format_p_value));
        }
        table.push_row(row);
    }
    table
}

/// Returns the mean of a metric, or its share, with its interval.
fn center_with_interval(variant: &VariantMetric) -> String {
    let (value, interval) = match &variant.values {
        MetricValues::Numbers(numbers) => (numbers.mean, numbers.interval),
        MetricValues::Share(share) => (share.share, share.interval),
    };
    match value {
        // A value that no seed changes has no spread.
        Some(value) if variant.seedless => format_number(value, Some(0.0)),
        value => with_interval(value, interval),
    }
}

/// Returns a table of all metrics in all variants: mean, difference from the baseline, p and n.
fn overview(summary: &Summary) -> Table {
    let title = match &summary.baseline {
        Some(name) => format!("All metrics, compared with {name}"),
        None => "All metrics".into(),
    };
    let mut columns = vec!["metric", "variant", "mean"];
    if summary.baseline.is_some() {
        columns.extend(["difference", "p (Holm)"]);
    }
    columns.push("n");
    let mut table = Table::new(title, "", &columns);
    for metric in &summary.metrics {
        for variant in &metric.variants {
            let mut row = vec![
                capitalized(&metric.label),
                variant.variant.clone(),
                center_with_interval(variant),
            ];
            if summary.baseline.is_some() {
                row.extend(difference_cells(metric, &variant.variant));
            }
            table.push_row(row.into_iter().chain([variant.n.to_string()]));
        }
    }
    table
}

/// Returns the difference of a variant from the baseline and its p; both empty for the baseline itself.
fn difference_cells(metric: &MetricSummary, variant: &str) -> [String; 2] {
    let Some(found) = metric.comparisons.iter().find(|c| c.variant == variant) else {
        return [String::new(), String::new()];
    };
    let p = found.p_holm.map_or("-".into(), format_p_value);
    [difference(found), p]
}

/// Returns the difference of a variant from its baseline; alone where seeds change nothing.
pub(super) fn difference(comparison: &Comparison) -> String {
    match comparison.difference {
        Some(difference) if comparison.seedless => format_number(difference, Some(0.0)),
        difference => with_interval(difference, comparison.interval),
    }
}

/// Returns a table of how each metric goes with each parameter.
fn trends(summary: &Summary) -> Table {
    let note = "Spearman's rank correlation over the variants, from -1 to 1: near 1 the metric rises with \
                the parameter, near -1 it falls. 95 % intervals by Fisher's transformation.";
    let columns = ["metric", "goes with", "rank correlation", "n"];
    let mut table = Table::new("What the metrics depend on", note, &columns);
    for trend in &summary.trends {
        let metric = summary.metrics.iter().find(|metric| metric.name == trend.metric);
        let words = metric.map_or_else(|| trend.metric.clone(), |m| capitalized(&m.label));
        let value = match trend.rank_correlation {
            Some(found) => with_interval(Some(found.value), found.interval),
            None => "-".into(),
        };
        let over = Label::from_name(&trend.parameter).to_string();
        table.push_row([words, over, value, trend.n.to_string()]);
    }
    table
}

/// Returns the notes that the tables of all metrics have in common.
fn footnotes(summary: &Summary) -> Vec<&'static str> {
    let mut notes = Vec::new();
    if summary.metrics.iter().any(|metric| !metric.is_share) {
        notes.push(INTERVALS_NOTE);
    }
    if summary.metrics.iter().any(|metric| metric.is_share) {
        notes.push(PROPORTIONS_NOTE);
    }
    if summary.baseline.is_some() {
        notes.push(DIFFERENCES_NOTE);
    }
    if summary.metrics.iter().any(|metric| !metric.effects.is_empty()) {
        notes.push(EFFECTS_NOTE);
    }
    notes
}

const INTERVALS_NOTE: &str = "95 % intervals stand in brackets: of a mean by Student's t and by the bootstrap \
                       (BCa), of quantiles by order statistics; `-` where n is too small for one, or all values are \
                       equal but for rounding. n: runs \
                       with a value. sd, min and max describe these very runs. `for ±5 %`: runs that would \
                       narrow Student's interval to 5 % of the mean to either side, if runs go on to vary by \
                       this sd.";

const PROPORTIONS_NOTE: &str = "Of a metric that is yes or no, the share of runs of which it is true, with Wilson's \
                      95 % interval.";

const DIFFERENCES_NOTE: &str = "Differences are variant minus baseline, replicate by replicate on the same seeds; \
                           95 % intervals by Student's t, then by the bootstrap (BCa); of the ratio of means \
                           by Fieller's method, where no value is negative and the baseline's mean is well \
                           away from 0. `lower`, `higher`: pairs in which the variant is. p: of no difference \
                           by Student's paired test (of shares the exact sign test, McNemar's), adjusted by \
                           Holm over the comparisons of all metrics shown. `-`: the pairs do not give it, \
                           because they are fewer than 5 or equal but for rounding.";

const EFFECTS_NOTE: &str = "Main effects are means over all variants that have the level; n: replicates of which all \
                       these variants have a value. Each replicate counts as one, since its variants share \
                       their seeds.";

/// Values; then differences if there is a baseline, and main effects in a full grid.
fn metric_tables(summary: &Summary, metric: &MetricSummary) -> Vec<Table> {
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
    if metric.is_share { proportions(metric) } else { numbers(metric) }
}

fn numbers(metric: &MetricSummary) -> Table {
    let columns = [
        "variant",
        "n",
        "mean",
        "median",
        "sd",
        "min",
        "max",
        "bootstrap",
        "5 %",
        "25 %",
        "75 %",
        "95 %",
        "missing",
        "for ±5 %",
    ];
    let mut table =
        Table::new(format!("{}: all numbers", capitalized(&metric.label)), "", &columns);
    for variant in &metric.variants {
        if let MetricValues::Numbers(numbers) = &variant.values {
            table.push_row(number_row(variant, numbers));
        }
    }
    table
}

fn number_row(variant: &VariantMetric, numbers: &NumericSummary) -> Vec<String> {
    let width = numbers.interval.map(|i| i.half_width());
    let quantiles: [String; QUANTILES.len()] =
        std::array::from_fn(|k| format_quantile(numbers.quantiles.get(k), width));
    let [low, lower_quartile, median, upper_quartile, high] = quantiles;
    vec![
        variant.variant.clone(),
        variant.n.to_string(),
        center_with_interval(variant),
        median,
        format_optional(numbers.sd, width),
        format_optional(numbers.min, width),
        format_optional(numbers.max, width),
        format_optional_interval(numbers.bootstrap),
        low,
        lower_quartile,
        upper_quartile,
        high,
        variant.missing.to_string(),
        numbers.runs_for_5_percent.map_or("-".into(), |n| n.to_string()),
    ]
}

fn format_quantile(quantile: Option<&Quantile>, width: Option<f64>) -> String {
    let Some(quantile) = quantile else { return "-".into() };
    match quantile.interval {
        Some(found) => with_interval(Some(quantile.value), Some(found.interval)),
        None => format!("{} [-]", format_number(quantile.value, width)),
    }
}

fn format_optional(value: Option<f64>, width: Option<f64>) -> String {
    value.map_or("-".into(), |value| format_number(value, width))
}

fn format_optional_interval(interval: Option<Interval>) -> String {
    interval.map_or("-".into(), format_interval)
}

fn proportions(metric: &MetricSummary) -> Table {
    let columns = ["variant", "n", "share", "runs", "missing"];
    let title = format!("{}: all numbers", capitalized(&metric.label));
    let mut table = Table::new(title, "", &columns);
    for variant in &metric.variants {
        if let MetricValues::Share(Proportion { yes, .. }) = variant.values {
            table.push_row([
                variant.variant.clone(),
                variant.n.to_string(),
                center_with_interval(variant),
                yes.to_string(),
                variant.missing.to_string(),
            ]);
        }
    }
    table
}

fn differences(metric: &MetricSummary, baseline: &str) -> Table {
    let columns = [
        "variant",
        "pairs",
        "difference",
        "p (Holm)",
        "lower",
        "higher",
        "ratio",
        "bootstrap",
        "bootstrap of ratio",
        "incomplete",
    ];
    let mut table =
        Table::new(format!("{}: against {baseline}", capitalized(&metric.label)), "", &columns);
    for comparison in &metric.comparisons {
        table.push_row(difference_row(comparison));
    }
    table
}

fn difference_row(comparison: &Comparison) -> Vec<String> {
    vec![
        comparison.variant.clone(),
        comparison.pairs.to_string(),
        difference(comparison),
        comparison.p_holm.map_or("-".into(), format_p_value),
        format!("{} of {}", comparison.lower, comparison.pairs),
        format!("{} of {}", comparison.higher, comparison.pairs),
        with_interval(comparison.ratio, comparison.ratio_interval),
        format_optional_interval(comparison.bootstrap),
        format_optional_interval(comparison.ratio_bootstrap),
        comparison.incomplete.to_string(),
    ]
}

fn effects(metric: &MetricSummary) -> Table {
    let columns = ["parameter", "level", "variants", "marginal mean", "n"];
    let mut table =
        Table::new(format!("{}: main effects", capitalized(&metric.label)), "", &columns);
    for effect in &metric.effects {
        for level in &effect.levels {
            let Estimate { mean, interval, n, .. } = level.estimate;
            let cells = [effect.parameter.clone(), level.level.name(), level.variants.to_string()];
            table.push_row(cells.into_iter().chain([with_interval(mean, interval), n.to_string()]));
        }
    }
    table
}

/// Returns the reasons why metrics are not shown, if there are such metrics.
fn omitted_metrics(summary: &Summary) -> Option<Table> {
    let mut table = Table::new("Metrics not shown", "", &["metric", "why"]);
    for OmittedMetric { metric, reason } in &summary.left_out {
        // A reader who requested some metrics needs no list of the others.
        if reason != NOT_REQUESTED {
            table.push_row([metric.clone(), reason.clone()]);
        }
    }
    (!table.rows.is_empty()).then_some(table)
}

/// `12.3 [11.9, 12.7]`; `-` for an absent value.
pub(super) fn with_interval(value: Option<f64>, interval: Option<Interval>) -> String {
    let Some(value) = value else { return "-".into() };
    match interval {
        Some(interval) => {
            let width = interval.half_width();
            format!("{} {}", format_number(value, Some(width)), format_interval(interval))
        }
        None => format!("{} [-]", format_number(value, None)),
    }
}

fn format_interval(interval: Interval) -> String {
    let width = Some(interval.half_width());
    format!("[{}, {}]", format_number(interval.low, width), format_number(interval.high, width))
}

/// Formats a number with two digits of the half width of its interval: more would be noise, fewer
/// would hide the interval. Without a width it has four digits.
fn format_number(value: f64, half_width: Option<f64>) -> String {
    let width = half_width.filter(|w| *w > 0.0 && w.is_finite());
    let scale = width.unwrap_or(value.abs() * 0.01);
    if value == 0.0 && width.is_none() {
        return "0".into();
    }
    let decimals = 1.0 - math::log10(scale).floor();
    // If runs agree to the last bits, more than six decimals of a number of usual size say nothing.
    let decimals = if value.abs() >= 1e-3 { decimals.min(6.0) } else { decimals };
    // An exponent where plain digits would be wider than a column.
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

fn format_p_value(p: f64) -> String {
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
        assert_eq!(format_p_value(0.00001), "< 0.0001");
        assert_eq!(format_p_value(0.0312), "0.0312");
    }
}
