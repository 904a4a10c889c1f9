//! Summarizes a table of runs.
//!
//! # Which metrics are shown
//!
//! The requested ones, in that order. Otherwise all that differ between any two runs, the most
//! informative first: by the share of their variance that lies between the variants, adjusted for
//! the number of variants (epsilon squared, Kelley 1935: 1 - mean square within / mean square in
//! total), so that effects of the parameters come before noise. Ties stay in the order of the
//! columns, and so do all metrics if the share cannot be computed: with one variant, or one run of
//! each. Metrics beyond [`SummaryOptions::max_metrics`] are left out. [`Summary::left_out`] lists
//! every metric that is not shown, and why.
use super::charts;
use super::compare::{BaselineIndex, comparisons};
use super::groups::{Level, RunGroups};
use super::options::{BaselineChoice, SummaryOptions};
use super::summary::{
    Effect, EffectLevel, MetricSummary, MetricValues, NOT_REQUESTED, NumericSummary, OmittedMetric,
    Proportion, QUANTILES, Quantile, Summary, Trend, VariantMetric, VariantSummary,
};
use super::table::{Role, RunColumn, RunTable};
use sidestep_document::Figure;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::Values;
use sidestep_scenario::suggestion;
use sidestep_statistics::{
    Bootstrap, Sample, mean, mean_interval, percentile, quantile_interval, rank_correlation,
    runs_for_half_width, sample_sd, wilson,
};
use std::collections::BTreeMap;

/// Number of runs of a variant above which no bootstrap is drawn: Student's interval is as good
/// there.
const BOOTSTRAP_RUNS: usize = 10_000;

impl Summary {
    /// Summarizes a table of runs.
    ///
    /// # Errors
    /// When columns differ in length, a variant has a replicate twice, or a metric or the
    /// baseline does not exist.
    pub fn from_table(table: &RunTable, options: &SummaryOptions) -> Result<Self, InputError> {
        Self::from_table_with_progress(table, options, &mut |_| ())
    }

    /// Summarizes a table of runs like [`Summary::from_table`], and passes on the share of the work that is
    /// done.
    ///
    /// # Errors
    /// The same.
    pub fn from_table_with_progress(
        table: &RunTable,
        options: &SummaryOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, InputError> {
        let groups = RunGroups::from_table(table, options)?;
        let (columns, left_out) = select_metrics(&groups, options)?;
        let reference = baseline_index(&groups, options)?;
        let metric = |(k, c): (usize, &&RunColumn)| {
            let within = &mut |share| progress((k as f64 + share) / columns.len() as f64);
            summarize_metric(&groups, c, reference.as_ref(), &options.bootstrap, within)
        };
        let metrics: Vec<MetricSummary> = columns.iter().enumerate().map(metric).collect();
        let named = |c: &&RunColumn, f: Figure| (c.name.clone(), f);
        let figures = columns
            .iter()
            .flat_map(|c| charts::figures(&groups, c).into_iter().map(move |f| named(c, f)))
            .collect();
        let mut summary = Self {
            runs: table.runs(),
            variants: (0..groups.variants.len()).map(|v| variant_summary(&groups, v)).collect(),
            baseline: reference.map(|r| r.name),
            metrics,
            left_out,
            trends: if charts::is_sampled(&groups) {
                trends(&groups, &columns)
            } else {
                Vec::new()
            },
            notes: Vec::new(),
            figures,
            parameters: groups.parameters.clone(),
        };
        summary.notes = notes(&summary, &groups, options.against.as_ref());
        Ok(summary)
    }
}

/// Returns how each metric goes with each parameter that is a number.
fn trends(groups: &RunGroups<'_>, columns: &[&RunColumn]) -> Vec<Trend> {
    let parameters = charts::numeric_parameters(groups);
    let trend = |column: &&RunColumn, p: usize| {
        let parameter = &groups.parameters[p];
        let pair = |v: usize| match parameter.levels[parameter.of_variant[v]] {
            Level::Number(x) => Some((x, groups.mean_over(column, &[v]).mean?)),
            Level::Text(_) => None,
        };
        let pairs: Vec<(f64, f64)> = (0..groups.variants.len()).filter_map(pair).collect();
        Trend {
            metric: column.name.clone(),
            parameter: parameter.name.clone(),
            rank_correlation: rank_correlation(&pairs),
            n: pairs.len(),
        }
    };
    columns.iter().flat_map(|column| parameters.iter().map(move |p| trend(column, *p))).collect()
}

fn variant_summary(groups: &RunGroups<'_>, variant: usize) -> VariantSummary {
    let levels = groups.parameters.iter().map(|p| p.levels[p.of_variant[variant]].clone());
    VariantSummary {
        name: groups.variants[variant].clone(),
        runs: groups.runs_of(variant),
        levels: levels.collect(),
    }
}

fn baseline_index(
    groups: &RunGroups<'_>,
    options: &SummaryOptions,
) -> Result<Option<BaselineIndex>, InputError> {
    let variants = groups.variants.len();
    let all_with = |one: usize| BaselineIndex {
        name: groups.variants[one].clone(),
        of: (0..variants).map(|v| (v != one).then_some(one)).collect(),
    };
    let Some(against) = &options.against else {
        let is_compared =
            groups.paired && variants > 1 && !is_grid(groups) && !charts::is_sampled(groups);
        return Ok(is_compared.then(|| all_with(0)));
    };
    if !groups.paired {
        let cause = "the table has no column of replicates, so runs have no counterparts";
        return Err(InputError::new("baseline", cause, "leave out the baseline"));
    }
    match against {
        BaselineChoice::Variant(name) => {
            let known: Vec<&str> = groups.variants.iter().map(String::as_str).collect();
            let found = known.iter().position(|v| v == name).ok_or_else(|| {
                let cause = format!("there is no variant `{name}`");
                InputError::new(format!("baseline {name}"), cause, suggestion(name, &known))
            })?;
            Ok(Some(all_with(found)))
        }
        BaselineChoice::Matched { name, of, .. } => {
            let places: BTreeMap<&String, usize> = groups.variants.iter().zip(0..).collect();
            // A sweep in progress may have no run of a baseline yet.
            let of_one = |variant| places.get(of.get(variant)?).copied();
            let of = groups.variants.iter().map(of_one).collect();
            Ok(Some(BaselineIndex { name: name.clone(), of }))
        }
    }
}

/// Returns whether several parameters are varied independently.
fn is_grid(groups: &RunGroups<'_>) -> bool {
    let parameters = groups.parameters.len();
    parameters > 1 && (0..parameters).all(|p| groups.is_balanced(p))
}

type MetricSelection<'a> = (Vec<&'a RunColumn>, Vec<OmittedMetric>);

/// Returns the metrics shown, and those that are not.
fn select_metrics<'a>(
    groups: &RunGroups<'a>,
    options: &SummaryOptions,
) -> Result<MetricSelection<'a>, InputError> {
    let all: Vec<&RunColumn> = groups.table.columns_with_role(Role::Metric).collect();
    if let Some(names) = &options.metrics {
        return metrics_by_name(&all, names);
    }
    let mut left_out = Vec::new();
    let mut shown: Vec<(f64, &RunColumn)> = Vec::new();
    for column in all {
        match omission_reason(column) {
            Some(reason) => left_out.push(OmittedMetric { metric: column.name.clone(), reason }),
            None => shown.push((explained_variance(groups, column).unwrap_or(0.0), column)),
        }
    }
    shown.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let beyond = shown.split_off(options.max_metrics.min(shown.len()));
    let reason = format!("beyond the {} most informative metrics", options.max_metrics);
    let beyond = beyond.into_iter().map(|(_, c)| c.name.clone());
    left_out.extend(beyond.map(|metric| OmittedMetric { metric, reason: reason.clone() }));
    Ok((shown.into_iter().map(|(_, column)| column).collect(), left_out))
}

fn metrics_by_name<'a>(
    all: &[&'a RunColumn],
    names: &[String],
) -> Result<MetricSelection<'a>, InputError> {
    let known: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
    let mut shown: Vec<&RunColumn> = Vec::new();
    for name in names {
        let place = || format!("metrics {name}");
        let Some(column) = all.iter().find(|c| c.name == *name) else {
            let cause = format!("there is no metric `{name}`");
            return Err(InputError::new(place(), cause, suggestion(name, &known)));
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
        |c: &&RunColumn| OmittedMetric { metric: c.name.clone(), reason: NOT_REQUESTED.into() };
    Ok((shown, others.map(left_out).collect()))
}

/// Returns the reason why a metric is uninformative, if it is.
fn omission_reason(column: &RunColumn) -> Option<String> {
    if matches!(column.values, Values::Text(_)) {
        return Some("words, not numbers".into());
    }
    let runs = column.values.len();
    let sample = Sample::from_runs((0..runs).map(|run| column.values.number(run)));
    match sample.values.first() {
        None => Some(format!("no run has a value (n = {runs})")),
        // One run tells its own values, and nothing of their variation.
        Some(first)
            if runs > 1 && sample.missing == 0 && sample.values.iter().all(|v| v == first) =>
        {
            Some(format!("{} in all runs (n = {runs})", column.values.text(0)))
        }
        Some(_) => None,
    }
}

/// Returns epsilon squared of a metric over the variants, at least 0; `None` without degrees of
/// freedom within.
fn explained_variance(groups: &RunGroups<'_>, column: &RunColumn) -> Option<f64> {
    let of = |variant| Sample::from_runs(groups.values(column, variant)).values;
    let samples: Vec<Vec<f64>> = (0..groups.variants.len()).map(of).collect();
    let samples: Vec<&Vec<f64>> = samples.iter().filter(|s| !s.is_empty()).collect();
    let all: Vec<f64> = samples.iter().flat_map(|s| s.iter().copied()).collect();
    let within = all.len().checked_sub(samples.len()).filter(|f| *f > 0)? as f64;
    let total = sample_sd(&all).filter(|sd| *sd > 0.0 && sd.is_finite() && samples.len() > 1)?;
    // Computed in units of the total spread, so that squares keep their digits.
    let square = |s: &&Vec<f64>| {
        let relative = sample_sd(s).unwrap_or(0.0) / total;
        relative * relative * (s.len() as f64 - 1.0)
    };
    let mean_square_within = samples.iter().map(square).sum::<f64>() / within;
    Some((1.0 - mean_square_within).max(0.0))
}

fn summarize_metric(
    groups: &RunGroups<'_>,
    column: &RunColumn,
    reference: Option<&BaselineIndex>,
    bootstrap: &Bootstrap,
    progress: &mut dyn FnMut(f64),
) -> MetricSummary {
    let count = groups.variants.len();
    let variants = 0..count;
    let most = variants.clone().map(|v| groups.runs_of(v)).max().unwrap_or(0);
    let bootstrap = (most <= BOOTSTRAP_RUNS).then_some(bootstrap);
    let describe = |v| {
        progress(v as f64 / count as f64);
        metric_values(groups, column, v, bootstrap)
    };
    MetricSummary {
        name: column.name.clone(),
        label: groups.label(column),
        meaning: groups.meaning(column),
        is_share: matches!(column.values, Values::Bool(_)),
        explained: explained_variance(groups, column),
        variants: variants.map(describe).collect(),
        comparisons: reference.map_or(Vec::new(), |r| comparisons(groups, column, r, bootstrap)),
        effects: effects(groups, column),
    }
}

fn metric_values(
    groups: &RunGroups<'_>,
    column: &RunColumn,
    variant: usize,
    bootstrap: Option<&Bootstrap>,
) -> VariantMetric {
    let sample = Sample::from_runs(groups.values(column, variant));
    let values = if matches!(column.values, Values::Bool(_)) {
        MetricValues::Share(proportion(&sample.values, groups.seedless[variant]))
    } else {
        MetricValues::Numbers(numeric_summary(&sample, bootstrap))
    };
    VariantMetric {
        variant: groups.variants[variant].clone(),
        n: sample.values.len(),
        missing: sample.missing,
        not_finite: sample.not_finite,
        seedless: groups.seedless[variant],
        values,
    }
}

fn proportion(values: &[f64], seedless: bool) -> Proportion {
    let yes = values.iter().filter(|v| **v > 0.5).count();
    let interval = (!seedless).then(|| wilson(yes as f64, values.len() as f64));
    Proportion { yes, share: mean(values), interval }
}

fn numeric_summary(sample: &Sample, bootstrap: Option<&Bootstrap>) -> NumericSummary {
    let values = &sample.values;
    let sorted = sample.sorted();
    let quantile = |q: &f64| {
        let value = percentile(&sorted, *q)?;
        Some(Quantile { q: *q, value, interval: quantile_interval(&sorted, *q) })
    };
    let (center, sd) = (mean(values), sample_sd(values));
    NumericSummary {
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

/// Returns the main effects; with one parameter these are the variants themselves.
fn effects(groups: &RunGroups<'_>, column: &RunColumn) -> Vec<Effect> {
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

/// Returns the note that a reader must know about the comparisons.
fn baseline_note(groups: &RunGroups<'_>, against: Option<&BaselineChoice>) -> Option<String> {
    match against {
        Some(BaselineChoice::Matched { name, alone: alone @ 1.., .. }) => Some(format!(
            "No variant with {name} is equal to {alone} of the others in all else: these are not \
             compared."
        )),
        None if groups.paired && is_grid(groups) => {
            let (name, level) = (&groups.parameters[0].name, groups.parameters[0].levels[0].name());
            Some(format!(
                "Nothing is compared: several keys vary. A baseline is compared within the others, \
                 e.g. --baseline {name}={level}"
            ))
        }
        _ => None,
    }
}

fn notes(
    summary: &Summary,
    groups: &RunGroups<'_>,
    against: Option<&BaselineChoice>,
) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(baseline_note(groups, against));
    let hidden: Vec<&OmittedMetric> =
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
    if parameters > 1 && !is_grid(groups) {
        notes.push(
            "The variants are no full grid: the marginal mean of a parameter would mix in the \
             others, and is not given where it does."
                .into(),
        );
    }
    notes
}
