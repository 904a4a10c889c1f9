//! The summary of a table of runs, as plain data.

use super::Label;
use super::compare::Comparison;
use super::groups::{Level, Parameter};
use serde::Serialize;
use sidestep_document::{Estimate, Figure, Table};
use sidestep_statistics::{Correlation, Interval, QuantileInterval};

/// The quantiles that are reported: the median, the quartiles, and the bounds of the middle 90 % of
/// the runs.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// The reason why a metric is not shown if others were requested.
pub(super) const NOT_REQUESTED: &str = "not asked for";

/// Runs that differ by their seeds alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariantSummary {
    /// Its name in tables.
    pub name: String,
    /// Number of its runs in the table.
    pub runs: usize,
    /// Its values of the [`Summary::parameters`].
    pub levels: Vec<Level>,
}

/// A quantile of the runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantile {
    /// Its probability, from 0 to 1.
    pub q: f64,
    /// Its estimate.
    pub value: f64,
    /// Its confidence interval; absent with fewer runs than
    /// [`runs_for_quantile`](sidestep_statistics::runs_for_quantile).
    pub interval: Option<QuantileInterval>,
}

/// A numeric metric of a variant.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct NumericSummary {
    /// Arithmetic mean.
    pub mean: Option<f64>,
    /// Standard deviation of the runs (divisor `n - 1`).
    pub sd: Option<f64>,
    /// Student's 95 % confidence interval of the mean.
    pub interval: Option<Interval>,
    /// The bootstrap's (BCa) 95 % confidence interval of the mean.
    pub bootstrap: Option<Interval>,
    /// The [`QUANTILES`], if there is any run.
    pub quantiles: Vec<Quantile>,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
    /// Number of runs that would give an interval of 5 % of the mean to either side, if runs vary
    /// as now.
    pub runs_for_5_percent: Option<u64>,
}

/// A share of the runs of a variant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Proportion {
    /// Number of runs for which it is true.
    pub yes: usize,
    /// Their share; absent without runs.
    pub share: Option<f64>,
    /// Wilson's 95 % confidence interval; absent where seeds change nothing.
    pub interval: Option<Interval>,
}

/// The values of a metric: a share where its column holds truth values, else numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MetricValues {
    /// Of a metric that counts or measures.
    Numbers(NumericSummary),
    /// Of a metric that is true or false.
    Share(Proportion),
}

/// One metric over the runs of one variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariantMetric {
    /// Name of the variant in tables.
    pub variant: String,
    /// Number of runs with a value.
    pub n: usize,
    /// Number of runs without a value, or with one that is infinite or not a number.
    pub missing: usize,
    /// Number of runs among these with a value that is infinite or not a number.
    pub not_finite: usize,
    /// Whether seeds change nothing that a metric shows in the variant: it counts as one run.
    pub seedless: bool,
    /// Mean, spread and quantiles of numbers, or a share.
    pub values: MetricValues,
}

/// The marginal mean of a metric at one level of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectLevel {
    /// One of the levels of [`Effect::parameter`].
    pub level: Level,
    /// Number of variants that are averaged over.
    pub variants: usize,
    /// Mean over these, of each replicate, and over replicates: `n` is the number of replicates.
    pub estimate: Estimate,
}

/// The main effect of a parameter: means over all others, in a full grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// Name of the parameter, as in [`Parameter::name`].
    pub parameter: String,
    /// In the order of [`Parameter::levels`].
    pub levels: Vec<EffectLevel>,
}

/// Everything about one metric, over all variants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricSummary {
    /// Name of its column.
    pub name: String,
    /// Its label, with its unit.
    pub label: Label,
    /// The thing counted or measured; empty where the world does not say.
    pub meaning: &'static str,
    /// Whether it is a share of runs.
    pub is_share: bool,
    /// Share of its variance that lies between variants, adjusted; at least 0. It is used as a
    /// rank, not as a result.
    pub explained: Option<f64>,
    /// In the order of [`Summary::variants`].
    pub variants: Vec<VariantMetric>,
    /// Comparison of each other variant with the baseline.
    pub comparisons: Vec<Comparison>,
    /// Main effects, if there are several parameters in a full grid.
    pub effects: Vec<Effect>,
}

/// The correlation of a metric with a parameter over samples of a box.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trend {
    /// Name of the metric's column.
    pub metric: String,
    /// Name of the parameter, as in [`Parameter::name`].
    pub parameter: String,
    /// Spearman's rank correlation over the variants, with its 95 % interval; absent where one of both
    /// is constant.
    pub rank_correlation: Option<Correlation>,
    /// Number of variants that have a mean of the metric.
    pub n: usize,
}

/// A metric that is not shown.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OmittedMetric {
    /// Name of its column.
    pub metric: String,
    /// The reason, in words for a table.
    pub reason: String,
}

/// The summary of a table of runs, as plain data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Number of rows of the table.
    pub runs: usize,
    /// In the order of their first runs.
    pub variants: Vec<VariantSummary>,
    /// The parameters that differ between variants.
    pub parameters: Vec<Parameter>,
    /// The name of the baseline of the variants; each comparison has the variant itself.
    pub baseline: Option<String>,
    /// The metrics shown: as requested, else the most informative first.
    pub metrics: Vec<MetricSummary>,
    /// The metrics that are not shown.
    pub left_out: Vec<OmittedMetric>,
    /// Correlations of metrics with parameters, if the variants are samples of a box of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trends: Vec<Trend>,
    /// Remarks that a reader must know.
    pub notes: Vec<String>,
    #[serde(skip)]
    pub(super) lead: Vec<Figure>,
    #[serde(skip)]
    pub(super) figures: Vec<(String, Figure)>,
}

/// The part of the summary about one metric.
#[derive(Debug, Clone, PartialEq)]
pub struct MetricSection {
    /// Name of its column.
    pub name: String,
    /// The metric as text.
    pub title: String,
    /// The thing counted or measured; may be empty.
    pub meaning: &'static str,
    /// Over each parameter, or over the variants where there is none.
    pub figures: Vec<Figure>,
    /// All numbers of the metric, in tables that a page shows folded.
    pub tables: Vec<Table>,
}
