//! All comparisons with the baseline in one figure: effects against zero.

use super::compare::{BaselineIndex, Comparison};
use super::groups::RunGroups;
use super::label::capitalized;
use super::run_charts::{VariantNames, baseline_name};
use super::summary::{MetricSummary, MetricValues};
use super::text::difference;
use sidestep_document::figure::{ForestWords, Point};
use sidestep_document::{Figure, FigureKind, Series};

/// Largest number of variants that each metric has a mark of; of more, a figure shows one metric.
const MAX_SERIES: usize = 4;
/// Largest number of marks.
const MAX_MARKS: usize = 24;

/// Returns all differences of all metrics from the baseline; of many variants, those of the first metric. `None`
/// without any.
pub(super) fn forest(
    groups: &RunGroups<'_>,
    metrics: &[MetricSummary],
    reference: &BaselineIndex,
) -> Option<Figure> {
    let names = VariantNames::new(groups);
    let baseline = baseline_name(groups, reference, &names);
    let compared: Vec<usize> =
        (0..groups.variants.len()).filter(|v| reference.of[*v].is_some()).collect();
    let first = metrics.first().filter(|first| first.comparisons.len() == compared.len())?;
    match compared.len() {
        0 => None,
        1..=MAX_SERIES => Some(metrics_forest(metrics, &names, &compared, &baseline)),
        _ => variants_forest(first, &names, &compared, &baseline),
    }
}

/// Returns a row for each metric and a series for each variant.
fn metrics_forest(
    metrics: &[MetricSummary],
    names: &VariantNames,
    compared: &[usize],
    baseline: &str,
) -> Figure {
    let metrics = &metrics[..metrics.len().min(MAX_MARKS / compared.len())];
    let unit = EffectUnit::choose(metrics);
    let mut series = Vec::with_capacity(compared.len());
    let mut texts = Vec::with_capacity(compared.len());
    for (k, variant) in compared.iter().enumerate() {
        let mut points = Vec::with_capacity(metrics.len());
        for (row, metric) in metrics.iter().enumerate() {
            let effect = unit.effect(metric, &metric.comparisons[k]);
            let pairs = metric.comparisons[k].pairs;
            points.extend(effect.map(|effect| effect.point(row).with_runs(pairs)));
        }
        texts.push(metrics.iter().map(|metric| difference_text(&metric.comparisons[k])).collect());
        series.push(Series { name: names.names[*variant].clone(), points });
    }
    let only = match compared {
        [one] => format!("{} against {baseline}", names.names[*one]),
        _ => format!("All variants against {baseline}"),
    };
    Figure {
        title: format!("{only}: differences in all metrics"),
        note: note(metrics, unit.remark()),
        x_label: format!("difference from {baseline} ({})", unit.words()),
        kind: FigureKind::Forest {
            rows: metrics.iter().map(|metric| capitalized(&metric.label)).collect(),
            texts,
            words: ForestWords { heading: heading(metrics), unmarked: unit.unmarked().into() },
        },
        series,
        ..Figure::default()
    }
}

/// Returns a row for each variant: the differences of one metric in its own unit.
fn variants_forest(
    metric: &MetricSummary,
    names: &VariantNames,
    compared: &[usize],
    baseline: &str,
) -> Option<Figure> {
    if compared.len() > MAX_MARKS {
        return None;
    }
    let mut points = Vec::with_capacity(compared.len());
    for (row, comparison) in metric.comparisons.iter().enumerate() {
        let interval = comparison.interval.map(|i| (i.low, i.high));
        let value = comparison.difference;
        let point = value.map(|y| Point::new(row as f64, y).with_interval(interval));
        points.extend(point.map(|point| point.with_runs(comparison.pairs)));
    }
    Some(Figure {
        title: format!("{}: all variants against {baseline}", capitalized(&metric.label)),
        note: note(std::slice::from_ref(metric), ""),
        x_label: format!("difference from {baseline}: {}", metric.label),
        kind: FigureKind::Forest {
            rows: compared.iter().map(|v| names.names[*v].clone()).collect(),
            texts: vec![metric.comparisons.iter().map(difference_text).collect()],
            words: ForestWords {
                heading: heading(std::slice::from_ref(metric)),
                unmarked: String::new(),
            },
        },
        series: vec![Series { name: String::new(), points }],
        ..Figure::default()
    })
}

/// Returns a difference in the unit of its metric, with its p.
fn difference_text(comparison: &Comparison) -> String {
    let sign = if comparison.difference.is_some_and(|d| d > 0.0) { "+" } else { "" };
    let text = format!("{sign}{}", difference(comparison)).replace(" [-]", "");
    let text = text.replace('-', "\u{2212}");
    comparison.p_holm.map_or(text.clone(), |p| format!("{text}, {}", p_text(p)))
}

/// Returns a p-value with as many digits as a paper gives.
fn p_text(p: f64) -> String {
    match p {
        p if p < 0.0001 => "p < 0.0001".into(),
        p if p < 0.01 => format!("p = {p:.4}"),
        p if p < 0.1 => format!("p = {p:.3}"),
        p => format!("p = {p:.2}"),
    }
}

fn has_p(metrics: &[MetricSummary]) -> bool {
    metrics.iter().flat_map(|metric| &metric.comparisons).any(|one| one.p_holm.is_some())
}

/// Returns the head of the differences in words.
fn heading(metrics: &[MetricSummary]) -> String {
    let p = if has_p(metrics) { ", p (Holm)" } else { "" };
    format!("difference [95 % interval]{p}")
}

fn note(metrics: &[MetricSummary], remark: &str) -> String {
    let comparisons = metrics.iter().flat_map(|metric| &metric.comparisons);
    let pairs = comparisons.clone().map(|comparison| comparison.pairs);
    let min = pairs.clone().min().unwrap_or(0);
    let max = pairs.max().unwrap_or(0);
    let count = if min == max { max.to_string() } else { format!("{min} to {max}") };
    let holm = if has_p(metrics) { " and p, adjusted by Holm" } else { "" };
    let text = format!(
        "Mean differences on the same seeds with 95 % intervals, {count} pairs; hollow where the interval has zero in \
         it. On the right in the unit of the metric{holm}. An arrow leads beyond the axis; a number beside it is the \
         difference. {remark}"
    );
    text.trim_end().to_string()
}

/// The unit in which effects of all metrics share an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum EffectUnit {
    /// Of the baseline's mean.
    Percent,
    /// Of the baseline's runs.
    StandardDeviations,
}

/// An effect in such a unit.
struct Effect {
    value: f64,
    interval: Option<(f64, f64)>,
}

impl Effect {
    fn point(&self, row: usize) -> Point {
        Point::new(row as f64, self.value).with_interval(self.interval)
    }
}

impl EffectUnit {
    /// Returns percent, unless more effects have a number of standard deviations: a mean near zero is no measure.
    fn choose(metrics: &[MetricSummary]) -> Self {
        let count = |unit: Self| {
            let effects = metrics
                .iter()
                .flat_map(|metric| metric.comparisons.iter().map(move |c| unit.effect(metric, c)));
            effects.flatten().count()
        };
        let has_percent = count(Self::Percent) >= count(Self::StandardDeviations);
        if has_percent { Self::Percent } else { Self::StandardDeviations }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Percent => "% of its mean",
            Self::StandardDeviations => "standard deviations of its runs",
        }
    }

    fn remark(self) -> &'static str {
        match self {
            Self::Percent => "Without a mark: the baseline's mean is 0 or too near to it.",
            Self::StandardDeviations => "Without a mark: all runs of the baseline are equal.",
        }
    }

    /// Returns why an effect has no mark, in few letters: there is little room.
    fn unmarked(self) -> &'static str {
        match self {
            Self::Percent => "baseline \u{2248} 0",
            Self::StandardDeviations => "equal runs",
        }
    }

    fn effect(self, metric: &MetricSummary, comparison: &Comparison) -> Option<Effect> {
        match self {
            Self::Percent => percent(comparison),
            Self::StandardDeviations => deviations(metric, comparison),
        }
    }
}

fn percent(comparison: &Comparison) -> Option<Effect> {
    let percent = |ratio: f64| 100.0 * (ratio - 1.0);
    let interval = comparison.ratio_interval.map(|i| (percent(i.low), percent(i.high)));
    let is_bounded = interval.is_none_or(|(low, high)| low.is_finite() && high.is_finite());
    let value = percent(comparison.ratio.filter(|_| is_bounded)?);
    Some(Effect { value, interval })
}

fn deviations(metric: &MetricSummary, comparison: &Comparison) -> Option<Effect> {
    let baseline = metric.variants.iter().find(|v| v.variant == comparison.baseline)?;
    let MetricValues::Numbers(numbers) = &baseline.values else { return None };
    let sd = numbers.sd.filter(|sd| *sd > 0.0)?;
    let interval = comparison.interval.map(|i| (i.low / sd, i.high / sd));
    Some(Effect { value: comparison.difference? / sd, interval })
}
