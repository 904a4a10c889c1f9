//! A table of runs summed up.
//!
//! # Which metrics are shown
//!
//! Those asked for, in that order. Otherwise all that differ between any two runs, the most
//! informative first: by the share of their variance that lies between the variants, adjusted
//! for the number of variants (epsilon squared, Kelley 1935: 1 - mean square within / mean
//! square in total), so that what the parameters move comes before what is mere noise. Equals
//! stay in the order of the columns, and so does everything where the share cannot be told: one
//! variant, or one run of each. Beyond [`SummaryOptions::max_metrics`] metrics are left out.
//! [`Summary::left_out`] tells every metric that is not shown, and why.

use super::Label;
use super::compare::{Comparison, comparisons};
use super::groups::{Groups, Level, Parameter};
use super::table::{Role, RunColumn, RunTable};
use super::{charts, text};
use crate::scenario::nearest;
use crate::statistics::{
    Bootstrap, Interval, QuantileInterval, Sample, mean, mean_interval, percentile,
    quantile_interval, runs_for_half_width, sample_sd, wilson,
};
use serde::Serialize;
use sidestep_document::{Estimate, Figure, Table};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::Values;

/// Quantiles that are told.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Above this many runs of a variant no bootstrap is drawn: Student's interval is as good there.
const BOOTSTRAP_RUNS: usize = 10_000;

/// Why a metric is not shown where others are named.
pub(super) const NOT_ASKED_FOR: &str = "not asked for";

/// What to sum up, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryOptions {
    /// Metrics to show, in this order; without, see the module.
    pub metrics: Option<Vec<String>>,
    /// Metrics shown at most where none are named.
    pub max_metrics: usize,
    /// Name of the variant that the others are compared with; without, the first, but in
    /// scattered designs none.
    pub baseline: Option<String>,
    /// How bootstrap intervals are drawn.
    pub bootstrap: Bootstrap,
}

impl Default for SummaryOptions {
    fn default() -> Self {
        Self { metrics: None, max_metrics: 12, baseline: None, bootstrap: Bootstrap::default() }
    }
}

/// Runs that differ by their seeds alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// Its runs.
    pub runs: usize,
    /// Its values of [`Summary::parameters`].
    pub levels: Vec<Level>,
}

/// A quantile of the runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quantile {
    /// Which one, from 0 to 1.
    pub q: f64,
    /// Its estimate.
    pub value: f64,
    /// Its interval; absent with fewer runs than
    /// [`runs_for_quantile`](crate::statistics::runs_for_quantile).
    pub interval: Option<QuantileInterval>,
}

/// A numeric metric of a variant.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Numbers {
    /// Arithmetic mean.
    pub mean: Option<f64>,
    /// Standard deviation of the runs (divisor `n - 1`).
    pub sd: Option<f64>,
    /// Student's 95 % interval of the mean.
    pub interval: Option<Interval>,
    /// The bootstrap's (BCa).
    pub bootstrap: Option<Interval>,
    /// [`QUANTILES`], where there is any run.
    pub quantiles: Vec<Quantile>,
    /// Smallest value seen.
    pub min: Option<f64>,
    /// Largest value seen.
    pub max: Option<f64>,
    /// Runs that would give an interval of 5 % of the mean to either side, if runs vary as now.
    pub runs_for_5_percent: Option<u64>,
}

/// A share of the runs of a variant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Runs of which it is true.
    pub yes: usize,
    /// Their share; absent without runs.
    pub share: Option<f64>,
    /// Wilson's 95 % interval.
    pub interval: Interval,
}

/// What a metric is.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Described {
    /// Numbers.
    Numbers(Numbers),
    /// Yes or no.
    Share(Share),
}

/// A metric in a variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VariantMetric {
    /// The variant.
    pub variant: String,
    /// Runs with a value.
    pub n: usize,
    /// Runs without one,
    pub missing: usize,
    /// of these, runs whose value is infinite or not a number.
    pub not_finite: usize,
    /// What the values come to.
    pub values: Described,
}

/// The marginal mean of a metric at one level of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectLevel {
    /// The level.
    pub level: Level,
    /// Variants that have it.
    pub variants: usize,
    /// Mean over these, of each replicate, and over replicates: `n` is the number of replicates.
    pub estimate: Estimate,
}

/// The main effect of a parameter: means over all others, in a full grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effect {
    /// The parameter.
    pub parameter: String,
    /// Its levels.
    pub levels: Vec<EffectLevel>,
}

/// A metric summed up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MetricSummary {
    /// Name of its column.
    pub name: String,
    /// What it is called, with its unit.
    pub label: Label,
    /// Whether it is a share of runs.
    pub is_share: bool,
    /// Share of its variance that lies between variants, adjusted; at least 0. A rank, not a
    /// result.
    pub explained: Option<f64>,
    /// In each variant.
    pub variants: Vec<VariantMetric>,
    /// Each other variant against the baseline.
    pub comparisons: Vec<Comparison>,
    /// Main effects, where there are several parameters in a full grid.
    pub effects: Vec<Effect>,
}

/// A metric that is not shown.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Its column.
    pub metric: String,
    /// Why.
    pub reason: String,
}

/// A table of runs summed up, as plain data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Runs in all.
    pub runs: usize,
    /// The variants.
    pub variants: Vec<Variant>,
    /// Parameters that differ between variants.
    pub parameters: Vec<Parameter>,
    /// The variant that others are compared with.
    pub baseline: Option<String>,
    /// The metrics shown.
    pub metrics: Vec<MetricSummary>,
    /// The others.
    pub left_out: Vec<LeftOut>,
    /// What a reader must know.
    pub notes: Vec<String>,
    #[serde(skip)]
    figures: Vec<(String, Figure)>,
}

/// What there is to say about a metric.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// The metric, in words.
    pub title: String,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// Its tables.
    pub tables: Vec<Table>,
}

impl Summary {
    /// Sums up a table of runs.
    ///
    /// # Errors
    /// When columns differ in length, a variant has a replicate twice, or a metric or the
    /// baseline does not exist.
    pub fn of(table: &RunTable, options: &SummaryOptions) -> Result<Self, InputError> {
        let groups = Groups::of(table)?;
        let (columns, left_out) = chosen(&groups, options)?;
        let scattered = charts::is_scattered(&groups);
        let baseline = baseline(&groups, options, scattered)?;
        let metric = |c: &&RunColumn| summed(&groups, c, baseline, &options.bootstrap);
        let metrics: Vec<MetricSummary> = columns.iter().map(metric).collect();
        let named = |c: &&RunColumn, f: Figure| (c.name.clone(), f);
        let figures = columns
            .iter()
            .flat_map(|c| charts::figures(&groups, c).into_iter().map(move |f| named(c, f)))
            .collect();
        let mut summary = Self {
            runs: table.runs(),
            variants: (0..groups.variants.len()).map(|v| variant(&groups, v)).collect(),
            baseline: baseline.map(|b| groups.variants[b].clone()),
            metrics,
            left_out,
            notes: Vec::new(),
            figures,
            parameters: groups.parameters.clone(),
        };
        summary.notes = notes(&summary, &groups);
        Ok(summary)
    }

    /// The summary as tables.
    pub fn tables(&self) -> Vec<Table> {
        text::tables(self)
    }

    /// The summary in short, for a terminal: means and differences with their intervals.
    pub fn brief(&self) -> Vec<Table> {
        text::brief(self)
    }

    /// The summary metric by metric.
    pub fn sections(&self) -> Vec<Section> {
        let section = |metric: &MetricSummary| Section {
            title: super::label::sentence(&Label { unit: None, ..metric.label.clone() }),
            figures: self
                .figures
                .iter()
                .filter(|(of, _)| *of == metric.name)
                .map(|(_, f)| f.clone())
                .collect(),
            tables: text::of_metric(self, metric),
        };
        self.metrics.iter().map(section).collect()
    }

    /// The metrics that are not shown, if there are any.
    pub fn left_out(&self) -> Option<Table> {
        text::left_out(self)
    }

    /// The summary as figures: each metric over each parameter.
    pub fn figures(&self) -> Vec<Figure> {
        self.figures.iter().map(|(_, figure)| figure.clone()).collect()
    }
}

fn variant(groups: &Groups<'_>, variant: usize) -> Variant {
    let levels = groups.parameters.iter().map(|p| p.levels[p.of_variant[variant]].clone());
    Variant {
        name: groups.variants[variant].clone(),
        runs: groups.runs_of(variant),
        levels: levels.collect(),
    }
}

fn baseline(
    groups: &Groups<'_>,
    options: &SummaryOptions,
    scattered: bool,
) -> Result<Option<usize>, InputError> {
    let Some(name) = &options.baseline else {
        let compared = groups.paired && groups.variants.len() > 1 && !scattered;
        return Ok(compared.then_some(0));
    };
    let place = || format!("baseline {name}");
    let known: Vec<&str> = groups.variants.iter().map(String::as_str).collect();
    let Some(found) = known.iter().position(|v| v == name) else {
        let cause = format!("there is no variant `{name}`");
        return Err(InputError::new(place(), cause, nearest(name, &known)));
    };
    if !groups.paired {
        let cause = "the table has no column of replicates, so runs have no counterparts";
        return Err(InputError::new(place(), cause, "leave out the baseline"));
    }
    Ok(Some(found))
}

type Chosen<'a> = (Vec<&'a RunColumn>, Vec<LeftOut>);

/// The metrics shown, and those that are not.
fn chosen<'a>(groups: &Groups<'a>, options: &SummaryOptions) -> Result<Chosen<'a>, InputError> {
    let all: Vec<&RunColumn> = groups.table.of_role(Role::Metric).collect();
    if let Some(names) = &options.metrics {
        return named(&all, names);
    }
    let mut left_out = Vec::new();
    let mut shown: Vec<(f64, &RunColumn)> = Vec::new();
    for column in all {
        match uninformative(column) {
            Some(reason) => left_out.push(LeftOut { metric: column.name.clone(), reason }),
            None => shown.push((explained(groups, column).unwrap_or(0.0), column)),
        }
    }
    shown.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let beyond = shown.split_off(options.max_metrics.min(shown.len()));
    let reason = format!("beyond the {} most informative metrics", options.max_metrics);
    let beyond = beyond.into_iter().map(|(_, c)| c.name.clone());
    left_out.extend(beyond.map(|metric| LeftOut { metric, reason: reason.clone() }));
    Ok((shown.into_iter().map(|(_, column)| column).collect(), left_out))
}

fn named<'a>(all: &[&'a RunColumn], names: &[String]) -> Result<Chosen<'a>, InputError> {
    let known: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
    let mut shown: Vec<&RunColumn> = Vec::new();
    for name in names {
        let place = || format!("metrics {name}");
        let Some(column) = all.iter().find(|c| c.name == *name) else {
            let cause = format!("there is no metric `{name}`");
            return Err(InputError::new(place(), cause, nearest(name, &known)));
        };
        if matches!(column.values, Values::Text(_)) {
            let cause = format!("the metric `{name}` is words, not numbers");
            return Err(InputError::new(place(), cause, "leave it out"));
        }
        if !shown.iter().any(|c| c.name == *name) {
            shown.push(column);
        }
    }
    let others = all.iter().filter(|c| !names.contains(&c.name));
    let left_out =
        |c: &&RunColumn| LeftOut { metric: c.name.clone(), reason: NOT_ASKED_FOR.into() };
    Ok((shown, others.map(left_out).collect()))
}

/// Why a metric has nothing to tell, if so.
fn uninformative(column: &RunColumn) -> Option<String> {
    if matches!(column.values, Values::Text(_)) {
        return Some("words, not numbers".into());
    }
    let runs = column.values.len();
    let sample = Sample::of((0..runs).map(|run| column.values.number(run)));
    match sample.values.first() {
        None => Some(format!("no run has a value (n = {runs})")),
        Some(first) if sample.missing == 0 && sample.values.iter().all(|v| v == first) => {
            Some(format!("{} in all runs (n = {runs})", column.values.text(0)))
        }
        Some(_) => None,
    }
}

/// Epsilon squared of a metric over the variants, at least 0; `None` without freedom within.
fn explained(groups: &Groups<'_>, column: &RunColumn) -> Option<f64> {
    let of = |variant| Sample::of(groups.values(column, variant)).values;
    let samples: Vec<Vec<f64>> = (0..groups.variants.len()).map(of).collect();
    let samples: Vec<&Vec<f64>> = samples.iter().filter(|s| !s.is_empty()).collect();
    let all: Vec<f64> = samples.iter().flat_map(|s| s.iter().copied()).collect();
    let within = all.len().checked_sub(samples.len()).filter(|f| *f > 0)? as f64;
    let total = sample_sd(&all).filter(|sd| *sd > 0.0 && sd.is_finite() && samples.len() > 1)?;
    // In units of the total spread, so that squares keep their digits.
    let square = |s: &&Vec<f64>| {
        let relative = sample_sd(s).unwrap_or(0.0) / total;
        relative * relative * (s.len() as f64 - 1.0)
    };
    let mean_square_within = samples.iter().map(square).sum::<f64>() / within;
    Some((1.0 - mean_square_within).max(0.0))
}

fn summed(
    groups: &Groups<'_>,
    column: &RunColumn,
    baseline: Option<usize>,
    bootstrap: &Bootstrap,
) -> MetricSummary {
    let variants = 0..groups.variants.len();
    let most = variants.clone().map(|v| groups.runs_of(v)).max().unwrap_or(0);
    let bootstrap = (most <= BOOTSTRAP_RUNS).then_some(bootstrap);
    let describe = |v| described(groups, column, v, bootstrap);
    MetricSummary {
        name: column.name.clone(),
        label: Label::of(&column.name),
        is_share: matches!(column.values, Values::Bool(_)),
        explained: explained(groups, column),
        variants: variants.map(describe).collect(),
        comparisons: baseline.map_or(Vec::new(), |b| comparisons(groups, column, b, bootstrap)),
        effects: effects(groups, column),
    }
}

fn described(
    groups: &Groups<'_>,
    column: &RunColumn,
    variant: usize,
    bootstrap: Option<&Bootstrap>,
) -> VariantMetric {
    let sample = Sample::of(groups.values(column, variant));
    let values = if matches!(column.values, Values::Bool(_)) {
        Described::Share(share(&sample.values))
    } else {
        Described::Numbers(numbers(&sample, bootstrap))
    };
    VariantMetric {
        variant: groups.variants[variant].clone(),
        n: sample.values.len(),
        missing: sample.missing,
        not_finite: sample.not_finite,
        values,
    }
}

fn share(values: &[f64]) -> Share {
    let yes = values.iter().filter(|v| **v > 0.5).count();
    let interval = wilson(yes as f64, values.len() as f64);
    Share { yes, share: mean(values), interval }
}

fn numbers(sample: &Sample, bootstrap: Option<&Bootstrap>) -> Numbers {
    let values = &sample.values;
    let sorted = sample.sorted();
    let quantile = |q: &f64| {
        let value = percentile(&sorted, *q)?;
        Some(Quantile { q: *q, value, interval: quantile_interval(&sorted, *q) })
    };
    let (center, sd) = (mean(values), sample_sd(values));
    Numbers {
        mean: center,
        sd,
        interval: mean_interval(values),
        bootstrap: bootstrap.and_then(|b| b.mean(values)),
        quantiles: QUANTILES.iter().filter_map(quantile).collect(),
        min: sorted.first().copied(),
        max: sorted.last().copied(),
        runs_for_5_percent: center
            .zip(sd.filter(|sd| *sd > 0.0))
            .and_then(|(center, sd)| runs_for_half_width(sd, 0.05 * center.abs())),
    }
}

/// Main effects; of one parameter they are the variants themselves.
fn effects(groups: &Groups<'_>, column: &RunColumn) -> Vec<Effect> {
    if groups.parameters.len() < 2 {
        return Vec::new();
    }
    let effect = |p: usize| {
        let parameter = &groups.parameters[p];
        let level = |l: usize| {
            let group = groups.with_level(p, l);
            EffectLevel {
                level: parameter.levels[l].clone(),
                variants: group.len(),
                estimate: groups.mean_over(column, &group),
            }
        };
        let levels = (0..parameter.levels.len()).map(level).collect();
        Effect { parameter: parameter.name.clone(), levels }
    };
    let balanced = (0..groups.parameters.len()).filter(|p| groups.is_balanced(*p));
    balanced.filter(|p| groups.with_level(*p, 0).len() > 1).map(effect).collect()
}

fn notes(summary: &Summary, groups: &Groups<'_>) -> Vec<String> {
    let mut notes = Vec::new();
    let hidden: Vec<&LeftOut> =
        summary.left_out.iter().filter(|l| l.reason.starts_with("beyond")).collect();
    if !hidden.is_empty() {
        notes.push(format!("{} more metrics vary and are not shown.", hidden.len()));
    }
    let not_finite: usize =
        summary.metrics.iter().flat_map(|m| &m.variants).map(|v| v.not_finite).sum();
    if not_finite > 0 {
        notes.push(format!("{not_finite} values are infinite or no number and count as missing."));
    }
    if groups.variants.len() > 1 && !groups.paired {
        notes.push(
            "There is no column of replicates, so variants are not compared in pairs.".into(),
        );
    }
    if (0..groups.variants.len()).any(|v| groups.runs_of(v) > BOOTSTRAP_RUNS) {
        notes.push(format!(
            "Above {BOOTSTRAP_RUNS} runs of a variant no bootstrap is drawn: Student's interval is as good."
        ));
    }
    let parameters = groups.parameters.len();
    if parameters > 1 && !(0..parameters).all(|p| groups.is_balanced(p)) {
        notes.push(
            "The variants are no full grid: the marginal mean of a parameter would mix in the \
             others, and is not given where it does."
                .into(),
        );
    }
    notes
}
