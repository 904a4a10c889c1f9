//! Summarizes a table of runs.
//!
//! # Which metrics are shown
//!
//! The requested ones, in that order. Otherwise all that differ between any two runs, the most
//! informative first: by the share of their variance that lies between the variants, adjusted for
//! the number of variants (epsilon squared, Kelley 1935: 1 - mean square within / mean square in
//! total), so that effects of the parameters come before noise. Those that the world is about come before
//! others, in its order, if variants explain at least [`MIN_EXPLAINED`] of their variance: a method is judged by the
//! losses of separation, not by a count of its own steps that differs even more. Ties stay in the order of the
//! columns, and so do all metrics if the share cannot be computed: with one variant, or one run of
//! each. Metrics beyond [`SummaryOptions::max_metrics`] are left out. [`Summary::left_out`] lists
//! every metric that is not shown, and why.
use super::charts;
use super::compare::{BaselineIndex, Comparison, comparisons};
use super::front::Better;
use super::groups::{Level, RunGroups};
use super::lead_charts::{self, LeadContext};
use super::options::{BaselineChoice, SummaryOptions};
use super::summary::{
    Effect, EffectLevel, MetricSummary, MetricValues, NOT_REQUESTED, NumericSummary, OmittedMetric,
    Proportion, QUANTILES, Quantile, Summary, Trend, VariantMetric, VariantSummary,
};
use super::table::{Role, RunColumn, RunTable};
use sidestep_document::Figure;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_scenario::suggestion;
use sidestep_statistics::{
    Bootstrap, MIN_TEST_PAIRS, Sample, holm, is_tied, mean, mean_interval, percentile,
    quantile_interval, rank_correlation, runs_for_half_width, sample_sd, wilson,
};
use std::collections::BTreeMap;

/// Number of runs of a variant above which no bootstrap is drawn: a mean of so many runs is as good as normal (central
/// limit theorem), so Student's interval is as good, and thousands of resamples of each metric would take long.
const BOOTSTRAP_RUNS: usize = 10_000;

/// Share of the variance from which on a metric that the world is about counts as different: a medium effect (Cohen
/// 1988).
const MIN_EXPLAINED: f64 = 0.06;

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
        let mut metrics = Vec::with_capacity(columns.len());
        let mut figures: Vec<(String, Figure)> = Vec::new();
        let context = MetricContext {
            groups: &groups,
            reference: reference.as_ref(),
            bootstrap: bootstrap_for(&groups, &options.bootstrap),
        };
        for (k, column) in columns.iter().enumerate() {
            metrics.push(summarize_metric(&context, column, &mut |share| {
                progress((k as f64 + share) / columns.len() as f64);
            }));
            for figure in charts::figures(&groups, column) {
                figures.push((column.name.clone(), figure));
            }
        }
        // In other designs a parameter has few levels, and figures and tables over them show more than a coefficient.
        let trends =
            if charts::is_sampled(&groups) { trends(&groups, &columns) } else { Vec::new() };
        adjust_p_values(&mut metrics);
        let lead = lead_charts::figures(&LeadContext {
            groups: &groups,
            columns: &columns,
            metrics: &metrics,
            reference: reference.as_ref(),
            aims: &aims(&groups, options)?,
        });
        let mut summary = Self {
            runs: table.runs(),
            variants: (0..groups.variants.len()).map(|v| variant_summary(&groups, v)).collect(),
            baseline: reference.map(|r| r.name),
            metrics,
            left_out,
            trends,
            notes: Vec::new(),
            lead,
            figures,
            parameters: groups.parameters.clone(),
        };
        summary.notes = notes(&summary, &groups, options.against.as_ref());
        Ok(summary)
    }
}

/// Adjusts the p-values of all comparisons of all metrics. Of many comparisons without any effect, some differ by chance:
/// Holm's method holds the chance of a single wrong finding among all that a reader sees.
fn adjust_p_values(metrics: &mut [MetricSummary]) {
    let mut comparisons: Vec<&mut Comparison> =
        metrics.iter_mut().flat_map(|metric| &mut metric.comparisons).collect();
    let p_values: Vec<Option<f64>> = comparisons.iter().map(|c| c.p).collect();
    for (comparison, adjusted) in comparisons.iter_mut().zip(holm(&p_values)) {
        comparison.p_holm = adjusted;
    }
}

/// What all metrics are summarized with.
struct MetricContext<'a> {
    groups: &'a RunGroups<'a>,
    reference: Option<&'a BaselineIndex>,
    bootstrap: Option<&'a Bootstrap>,
}

/// Returns the bootstrap, unless a variant has too many runs for it.
fn bootstrap_for<'a>(groups: &RunGroups<'_>, bootstrap: &'a Bootstrap) -> Option<&'a Bootstrap> {
    let max_runs = (0..groups.variants.len()).map(|v| groups.runs_of(v)).max().unwrap_or(0);
    (max_runs <= BOOTSTRAP_RUNS).then_some(bootstrap)
}

/// Returns the correlation of each metric with each parameter that is a number.
fn trends(groups: &RunGroups<'_>, columns: &[&RunColumn]) -> Vec<Trend> {
    let mut trends = Vec::new();
    for column in columns {
        for p in charts::numeric_parameters(groups) {
            let parameter = &groups.parameters[p];
            let mut pairs = Vec::new();
            for variant in 0..groups.variants.len() {
                if let Level::Number(x) = parameter.levels[parameter.of_variant[variant]]
                    && let Some(mean) = groups.mean_over(column, &[variant]).mean
                {
                    pairs.push((x, mean));
                }
            }
            trends.push(Trend {
                metric: column.name.clone(),
                parameter: parameter.name.clone(),
                rank_correlation: rank_correlation(&pairs),
                n: pairs.len(),
            });
        }
    }
    trends
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
    let Some(against) = &options.against else {
        // In a grid or among samples the first variant is like no other: no comparison with it would be of one
        // parameter alone.
        let is_compared = groups.paired
            && groups.variants.len() > 1
            && !is_grid(groups)
            && !charts::is_sampled(groups);
        return Ok(is_compared.then(|| single_baseline(groups, 0)));
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
            Ok(Some(single_baseline(groups, found)))
        }
        BaselineChoice::Matched { name, of, .. } => {
            let index_of: BTreeMap<&String, usize> = groups.variants.iter().zip(0..).collect();
            let mut baselines = Vec::with_capacity(groups.variants.len());
            for variant in &groups.variants {
                // A sweep in progress may have no run of a baseline yet.
                let baseline = of.get(variant).and_then(|baseline| index_of.get(baseline));
                baselines.push(baseline.copied());
            }
            Ok(Some(BaselineIndex { name: name.clone(), of: baselines }))
        }
    }
}

/// Returns the index in which all other variants are compared with one.
fn single_baseline(groups: &RunGroups<'_>, one: usize) -> BaselineIndex {
    let variants = 0..groups.variants.len();
    BaselineIndex {
        name: groups.variants[one].clone(),
        of: variants.map(|v| (v != one).then_some(one)).collect(),
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
    let mut central: Vec<(usize, &RunColumn)> = Vec::new();
    let mut others: Vec<(f64, &RunColumn)> = Vec::new();
    for column in all {
        if let Some(reason) = omission_reason(column) {
            left_out.push(OmittedMetric { metric: column.name.clone(), reason });
            continue;
        }
        let explained = explained_variance(groups, column).unwrap_or(0.0);
        let place = options.central_metrics.iter().position(|name| *name == column.name);
        match place.filter(|_| explained >= MIN_EXPLAINED) {
            Some(place) => central.push((place, column)),
            None => others.push((explained, column)),
        }
    }
    central.sort_by_key(|(place, _)| *place);
    // A stable sort, so that ties stay in the order of the columns.
    others.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let central = central.into_iter().map(|(_, column)| column);
    let mut shown: Vec<&RunColumn> =
        central.chain(others.into_iter().map(|(_, column)| column)).collect();
    for column in shown.split_off(options.max_metrics.min(shown.len())) {
        let reason = format!("beyond the {} most informative metrics", options.max_metrics);
        left_out.push(OmittedMetric { metric: column.name.clone(), reason });
    }
    Ok((shown, left_out))
}

/// Returns the columns of the metrics of which some values are better.
fn aims<'a>(
    groups: &RunGroups<'a>,
    options: &SummaryOptions,
) -> Result<Vec<(&'a RunColumn, Better)>, InputError> {
    let all: Vec<&RunColumn> = groups.table.columns_with_role(Role::Metric).collect();
    let names: Vec<String> = options.better.iter().map(|aim| aim.metric.clone()).collect();
    let (columns, _) = metrics_by_name(&all, &names)?;
    let directions = options.better.iter().map(|aim| aim.better);
    Ok(columns.into_iter().zip(directions).collect())
}

fn metrics_by_name<'a>(
    all: &[&'a RunColumn],
    names: &[String],
) -> Result<MetricSelection<'a>, InputError> {
    let known: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
    let mut shown: Vec<&RunColumn> = Vec::new();
    for name in names {
        let Some(column) = all.iter().find(|c| c.name == *name) else {
            let cause = format!("there is no metric `{name}`");
            let remedy = suggestion(name, &known);
            return Err(InputError::new(format!("metrics {name}"), cause, remedy));
        };
        if matches!(column.values, ColumnValues::Text(_)) {
            let cause = format!("the metric `{name}` is words, not numbers");
            return Err(InputError::new(format!("metrics {name}"), cause, "leave it out"));
        }
        if !shown.iter().any(|c| c.name == *name) {
            shown.push(column);
        }
    }
    let mut left_out = Vec::new();
    for column in all.iter().filter(|c| !names.contains(&c.name)) {
        let reason = NOT_REQUESTED.into();
        left_out.push(OmittedMetric { metric: column.name.clone(), reason });
    }
    Ok((shown, left_out))
}

/// Returns the reason why a metric is uninformative, if it is.
fn omission_reason(column: &RunColumn) -> Option<String> {
    if matches!(column.values, ColumnValues::Text(_)) {
        return Some("words, not numbers".into());
    }
    let runs = column.values.len();
    let sample = Sample::from_runs((0..runs).map(|run| column.values.number(run)));
    let Some(first) = sample.values.first() else {
        return Some(format!("no run has a value (n = {runs})"));
    };
    // The values of a single run are results, though they vary with nothing.
    let is_constant = runs > 1 && sample.missing == 0 && sample.values.iter().all(|v| v == first);
    is_constant.then(|| format!("{} in all runs (n = {runs})", column.values.text(0)))
}

/// Returns epsilon squared of a metric over the variants, at least 0; `None` without degrees of
/// freedom within.
fn explained_variance(groups: &RunGroups<'_>, column: &RunColumn) -> Option<f64> {
    let mut samples: Vec<Vec<f64>> = (0..groups.variants.len())
        .map(|variant| Sample::from_runs(groups.values(column, variant)).values)
        .collect();
    samples.retain(|sample| !sample.is_empty());
    if samples.len() < 2 {
        return None;
    }
    let all = samples.concat();
    let degrees_within = all.len() - samples.len();
    let total_sd = sample_sd(&all).filter(|sd| *sd > 0.0 && sd.is_finite())?;
    if degrees_within == 0 {
        return None;
    }
    // Computed in units of the total spread, so that squares keep their digits.
    let squares = samples.iter().map(|sample| {
        let relative = sample_sd(sample).unwrap_or(0.0) / total_sd;
        relative * relative * (sample.len() as f64 - 1.0)
    });
    let mean_square_within = squares.sum::<f64>() / degrees_within as f64;
    // Below 0 where variants differ by less than chance makes them.
    Some((1.0 - mean_square_within).max(0.0))
}

fn summarize_metric(
    context: &MetricContext<'_>,
    column: &RunColumn,
    progress: &mut dyn FnMut(f64),
) -> MetricSummary {
    let MetricContext { groups, reference, bootstrap } = *context;
    let count = groups.variants.len();
    let mut variants = Vec::with_capacity(count);
    for variant in 0..count {
        progress(variant as f64 / count as f64);
        variants.push(metric_values(groups, column, variant, bootstrap));
    }
    MetricSummary {
        name: column.name.clone(),
        label: groups.label(column),
        meaning: groups.meaning(column),
        is_share: matches!(column.values, ColumnValues::Bool(_)),
        explained: explained_variance(groups, column),
        variants,
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
    let values = if matches!(column.values, ColumnValues::Bool(_)) {
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
    // Equal values, but for rounding, show no spread: an interval without width would claim that there is none.
    let is_tied = is_tied(values);
    let mut quantiles = Vec::new();
    for q in QUANTILES {
        if let Some(value) = percentile(&sorted, q) {
            let interval = quantile_interval(&sorted, q).filter(|_| !is_tied);
            quantiles.push(Quantile { q, value, interval });
        }
    }
    let mean = mean(values);
    let sd = sample_sd(values);
    NumericSummary {
        mean,
        sd,
        interval: mean_interval(values).filter(|_| !is_tied),
        bootstrap: bootstrap.filter(|_| !is_tied).and_then(|b| b.mean(values)),
        quantiles,
        min: sorted.first().copied(),
        max: sorted.last().copied(),
        runs_for_5_percent: mean
            .zip(sd.filter(|sd| *sd > 0.0 && !is_tied))
            .and_then(|(mean, sd)| runs_for_half_width(sd, 0.05 * mean.abs())),
    }
}

/// Returns the main effects; with one parameter these are the variants themselves.
fn effects(groups: &RunGroups<'_>, column: &RunColumn) -> Vec<Effect> {
    if groups.parameters.len() < 2 {
        return Vec::new();
    }
    let mut effects = Vec::new();
    for (p, parameter) in groups.parameters.iter().enumerate() {
        let is_averaged = groups.with_level(p, 0).len() > 1;
        if !groups.is_balanced(p) || !is_averaged {
            continue;
        }
        let mut levels = Vec::with_capacity(parameter.levels.len());
        for (l, level) in parameter.levels.iter().enumerate() {
            let group = groups.with_level(p, l);
            levels.push(EffectLevel {
                level: level.clone(),
                variants: group.len(),
                estimate: groups.mean_over(column, &group),
            });
        }
        effects.push(Effect { parameter: parameter.name.clone(), levels });
    }
    effects
}

/// Returns the note that a reader must know about the comparisons.
fn baseline_note(groups: &RunGroups<'_>, against: Option<&BaselineChoice>) -> Option<String> {
    match against {
        Some(BaselineChoice::Matched { name, alone: alone @ 1.., .. }) => Some(format!(
            "No variant with {name} is equal to {alone} of the others in all else: these are not \
             compared."
        )),
        None if groups.paired && is_grid(groups) => {
            let name = &groups.parameters[0].name;
            let level = groups.parameters[0].levels[0].name();
            Some(format!(
                "Nothing is compared: several keys vary. A baseline is compared within the others, \
                 e.g. --baseline {name}={level}"
            ))
        }
        _ => None,
    }
}

/// Returns the note that seeds change nothing that a metric shows, where that is so.
fn unseen_note(groups: &RunGroups<'_>) -> Option<String> {
    let all = groups.variants.len();
    let in_variants = match groups.unseen {
        0 => return None,
        unseen if unseen == all => String::new(),
        unseen => format!(" in {unseen} of {all} variants"),
    };
    Some(format!(
        "Seeds change nothing that a metric shows{in_variants}: in all runs the \
         metrics are equal but for rounding. So these runs count as one, without an interval."
    ))
}

/// Returns the notes that a reader must know about p-values.
fn test_notes(summary: &Summary) -> Vec<String> {
    let compared: Vec<&Comparison> =
        summary.metrics.iter().flat_map(|metric| &metric.comparisons).collect();
    let mut notes = Vec::new();
    let tested = compared.iter().filter(|comparison| comparison.p.is_some()).count();
    if tested > 1 {
        notes.push(format!("p is adjusted by Holm over the {tested} tests of all metrics shown."));
    }
    let is_small = |c: &Comparison| !c.seedless && (2..MIN_TEST_PAIRS).contains(&c.pairs);
    if compared.iter().any(|comparison| is_small(comparison)) {
        notes.push(format!("Fewer than {MIN_TEST_PAIRS} pairs have an interval, and no p."));
    }
    notes
}

fn notes(
    summary: &Summary,
    groups: &RunGroups<'_>,
    against: Option<&BaselineChoice>,
) -> Vec<String> {
    let mut notes = Vec::new();
    notes.extend(groups.privilege_note.map(String::from));
    notes.extend(unseen_note(groups));
    notes.extend(baseline_note(groups, against));
    notes.extend(test_notes(summary));
    let hidden = summary.left_out.iter().filter(|l| l.reason.starts_with("beyond")).count();
    if hidden > 0 {
        notes.push(format!("{hidden} more metrics vary and are not shown."));
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
