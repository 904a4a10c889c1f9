//! Runs by variant and replicate.

use super::Label;
use super::options::SummaryOptions;
use super::table::{Role, RunColumn, RunTable};
use super::variant::DEFAULT_LABEL;
use serde::Serialize;
use sidestep_document::Estimate;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_scenario::{MetricInfo, metric_label};
use sidestep_statistics::{Sample, is_tied, sample_sd, wilson};
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of characters of a value in the name of a level that stands for several parameters: it is the name of
/// a bar.
const MAX_LEVEL_NAME_CHARS: usize = 40;

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Level {
    /// All values of the parameter are numbers.
    Number(f64),
    /// Text; empty if the parameter is not set.
    Text(String),
}

impl Level {
    pub(super) fn name(&self) -> String {
        match self {
            Self::Number(value) => value.to_string(),
            Self::Text(text) if text.is_empty() => DEFAULT_LABEL.into(),
            Self::Text(text) => text.clone(),
        }
    }
}

/// A parameter that differs between variants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Path of its key; of parameters that always change together, the paths of all.
    pub name: String,
    /// Whether all its values are numbers.
    pub numeric: bool,
    /// Its values: numbers in ascending order, text in order of first use.
    pub levels: Vec<Level>,
    /// The level of every variant, as an index into `levels`.
    #[serde(skip)]
    pub(super) of_variant: Vec<usize>,
}

/// The runs of a table, found by variant and replicate.
pub(super) struct RunGroups<'a> {
    pub(super) table: &'a RunTable,
    /// Names of the variants, in the order of their first runs.
    pub(super) variants: Vec<String>,
    /// All replicates of any variant.
    pub(super) replicates: Vec<i64>,
    /// Whether equal replicates of two variants are related by a common seed.
    pub(super) paired: bool,
    pub(super) parameters: Vec<Parameter>,
    /// The metrics in words.
    meanings: &'static [MetricInfo],
    /// Whether seeds change nothing that metrics show, variant by variant.
    pub(super) seedless: Vec<bool>,
    /// Number of variants of which the metrics alone show that.
    pub(super) unseen: usize,
    /// The note on variants in which somebody knows what no agent could.
    pub(super) privilege_note: Option<&'a str>,
    /// Row of the table, by variant and replicate.
    run: BTreeMap<(usize, i64), usize>,
}

impl<'a> RunGroups<'a> {
    /// Groups the runs of `table`. The options have the names of variants, those in which seeds change nothing, and the
    /// metrics in words.
    pub(super) fn from_table(
        table: &'a RunTable,
        options: &'a SummaryOptions,
    ) -> Result<Self, InputError> {
        table.check()?;
        let replicate_column = table.columns_with_role(Role::Replicate).next();
        let mut variants: Vec<String> = Vec::new();
        let mut index_of: BTreeMap<String, usize> = BTreeMap::new();
        let mut counts: Vec<i64> = Vec::new();
        let mut run_of = BTreeMap::new();
        for run in row_order(table) {
            let name = variant_name(table, run, options.names.as_deref());
            let variant = *index_of.entry(name.clone()).or_insert_with(|| {
                variants.push(name.clone());
                counts.push(0);
                variants.len() - 1
            });
            // Without numbers of replicates, runs are numbered as they come.
            let replicate = match replicate_column.and_then(|c| c.values.number(run)) {
                Some(number) => number as i64,
                None => counts[variant],
            };
            counts[variant] += 1;
            if run_of.insert((variant, replicate), run).is_some() {
                let cause = format!("variant `{name}` has two runs of replicate {replicate}");
                let remedy = "number the replicates of a variant, each run once";
                return Err(InputError::new("the table of runs", cause, remedy));
            }
        }
        let replicates: BTreeSet<i64> = run_of.keys().map(|(_, replicate)| *replicate).collect();
        let draws_nothing: Vec<bool> =
            variants.iter().map(|name| options.seedless.contains(name)).collect();
        let unseen = unseen_variants(table, &run_of, &draws_nothing);
        let seedless = draws_nothing.iter().zip(&unseen).map(|(a, b)| *a || *b).collect();
        Ok(Self {
            table,
            replicates: replicates.into_iter().collect(),
            paired: replicate_column.is_some(),
            parameters: parameters(table, &run_of, variants.len()),
            meanings: options.meanings,
            privilege_note: options.privilege_note.as_deref(),
            seedless,
            unseen: unseen.iter().filter(|is_unseen| **is_unseen).count(),
            variants,
            run: run_of,
        })
    }

    /// In the words of the world, as far as it has some.
    pub(super) fn label(&self, metric: &RunColumn) -> Label {
        Label::from_metric(&metric.name, self.meanings)
    }

    /// Returns the thing that a metric counts or measures; empty where its world does not say.
    pub(super) fn meaning(&self, metric: &RunColumn) -> &'static str {
        metric_label(self.meanings, &metric.name).meaning
    }

    /// Counts all runs; [`Self::values`] has fewer where seeds change nothing.
    pub(super) fn runs_of(&self, variant: usize) -> usize {
        self.run.range((variant, i64::MIN)..=(variant, i64::MAX)).count()
    }

    /// In the order of replicates.
    pub(super) fn rows(&self, variant: usize) -> impl Iterator<Item = usize> {
        rows_of(&self.run, variant).into_iter()
    }

    /// Returns the values of a variant, one for each of its runs; one where seeds change nothing.
    pub(super) fn values(&self, metric: &RunColumn, variant: usize) -> Vec<Option<f64>> {
        let max_runs = if self.seedless[variant] { 1 } else { usize::MAX };
        self.rows(variant).take(max_runs).map(|run| metric.values.number(run)).collect()
    }

    /// Returns the values of a variant, one for each replicate of the whole table. Where seeds change
    /// nothing, all have that of the first run.
    pub(super) fn by_replicate(&self, metric: &RunColumn, variant: usize) -> Vec<Option<f64>> {
        let first_run = self.rows(variant).next();
        let mut values = Vec::with_capacity(self.replicates.len());
        for replicate in &self.replicates {
            let own_run = self.run.get(&(variant, *replicate)).copied();
            let run = if self.seedless[variant] { first_run } else { own_run };
            values.push(run.and_then(|run| metric.values.number(run)));
        }
        values
    }

    /// Returns the mean over a group of variants.
    ///
    /// For one variant it is the mean of its runs, with Wilson's interval for a share. For several,
    /// each replicate gives one number, the mean over the group, and Student's interval is that of
    /// these numbers, because replicates are independent but the variants of one replicate are not.
    /// Replicates without a value in some variant do not count.
    pub(super) fn mean_over(&self, metric: &RunColumn, group: &[usize]) -> Estimate {
        if let [variant] = group {
            let values = self.values(metric, *variant);
            if matches!(metric.values, ColumnValues::Bool(_)) {
                return proportion(&values, self.seedless[*variant]);
            }
            let mut estimate = Estimate::from_values(values.iter().copied());
            if is_tied(&Sample::from_runs(values).values) {
                estimate.interval = None;
            }
            return estimate;
        }
        let columns: Vec<_> = group.iter().map(|v| self.by_replicate(metric, *v)).collect();
        // Where all are seedless, every replicate gives the same number.
        let are_all_seedless = group.iter().all(|v| self.seedless[*v]);
        let max_replicates = if are_all_seedless { 1 } else { usize::MAX };
        Estimate::from_values((0..self.replicates.len().min(max_replicates)).map(|replicate| {
            let values = columns.iter().map(|column| column[replicate].filter(|v| v.is_finite()));
            let of_all: Option<Vec<f64>> = values.collect();
            sidestep_statistics::mean(&of_all?)
        }))
    }

    /// Returns whether every level of `parameter` occurs with the same levels of all others, as in a full
    /// grid: only then does a mean over the others compare like with like.
    pub(super) fn is_balanced(&self, parameter: usize) -> bool {
        let mut others = vec![Vec::new(); self.parameters[parameter].levels.len()];
        for variant in 0..self.variants.len() {
            let other_levels: Vec<usize> = (0..self.parameters.len())
                .filter(|p| *p != parameter)
                .map(|p| self.parameters[p].of_variant[variant])
                .collect();
            others[self.parameters[parameter].of_variant[variant]].push(other_levels);
        }
        for of_level in &mut others {
            of_level.sort();
        }
        others.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// By index into [`Self::variants`].
    pub(super) fn with_level(&self, parameter: usize, level: usize) -> Vec<usize> {
        let of = &self.parameters[parameter].of_variant;
        (0..of.len()).filter(|v| of[*v] == level).collect()
    }
}

/// Returns the rows of a variant, in the order of replicates.
fn rows_of(run_of: &BTreeMap<(usize, i64), usize>, variant: usize) -> Vec<usize> {
    run_of.range((variant, i64::MIN)..=(variant, i64::MAX)).map(|(_, run)| *run).collect()
}

/// Returns for each variant whether its seeds change nothing that a metric shows. Counts alone do not tell, because those
/// of a few runs may be equal by chance; beside a variant in which measures tell, they do.
fn unseen_variants(
    table: &RunTable,
    run_of: &BTreeMap<(usize, i64), usize>,
    draws_nothing: &[bool],
) -> Vec<bool> {
    let mut equal: Vec<Option<Equality>> = Vec::with_capacity(draws_nothing.len());
    for (variant, draws_nothing) in draws_nothing.iter().enumerate() {
        let rows = rows_of(run_of, variant);
        let is_asked = !draws_nothing && rows.len() > 1;
        equal.push(if is_asked { equality_of_metrics(table, &rows) } else { None });
    }
    let is_told = equal.contains(&Some(Equality::Measures));
    equal.iter().map(|equality| is_told && equality.is_some()).collect()
}

/// Returns how all metrics are equal in some runs; `None` where one differs.
fn equality_of_metrics(table: &RunTable, rows: &[usize]) -> Option<Equality> {
    let mut whole = Equality::Counts;
    for column in table.columns_with_role(Role::Metric) {
        if matches!(column.values, ColumnValues::Text(_)) {
            let texts: BTreeSet<String> = rows.iter().map(|row| column.values.text(*row)).collect();
            if texts.len() > 1 {
                return None;
            }
            continue;
        }
        let values: Vec<Option<f64>> = rows.iter().map(|row| column.values.number(*row)).collect();
        whole = whole.max(equality(&values)?);
    }
    Some(whole)
}

/// How values of several runs are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Equality {
    /// They are whole numbers, or none has a value.
    Counts,
    /// They are measured, and equal but for rounding.
    Measures,
}

/// Part of the largest magnitude up to which the runs of a metric have no spread: a world finds some times and distances
/// by bisection, to about six digits.
const SPREAD_FRACTION: f64 = 1e-5;

/// Magnitude below which a metric is 0: rounding of positions, in any unit of a metric.
const ZERO_MAGNITUDE: f64 = 1e-9;

/// Returns how values are equal but for rounding; `None` where they differ.
pub(super) fn equality(values: &[Option<f64>]) -> Option<Equality> {
    let finite = values.iter().map(|value| value.filter(|v| v.is_finite()));
    let numbers: Vec<f64> = finite
        .flatten()
        .map(|value| if value.abs() < ZERO_MAGNITUDE { 0.0 } else { value })
        .collect();
    // A metric without a value in some runs tells them apart.
    if !numbers.is_empty() && numbers.len() < values.len() {
        return None;
    }
    let largest = numbers.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    if sample_sd(&numbers).unwrap_or(0.0) > SPREAD_FRACTION * largest {
        return None;
    }
    let is_measure = numbers.iter().any(|value| value.fract() != 0.0);
    Some(if is_measure { Equality::Measures } else { Equality::Counts })
}

fn proportion(values: &[Option<f64>], seedless: bool) -> Estimate {
    let values = Sample::from_runs(values.iter().copied()).values;
    let yes: f64 = values.iter().sum();
    let n = values.len();
    let mut share = Estimate::from_values(values.into_iter().map(Some));
    // Student's interval may leave 0 to 1, and has no width where all runs agree; Wilson's does not.
    share.interval = (n > 0 && !seedless).then(|| wilson(yes, n as f64));
    share
}

/// Returns the rows in the order of their trials.
fn row_order(table: &RunTable) -> Vec<usize> {
    let mut rows: Vec<usize> = (0..table.runs()).collect();
    if let Some(trial) = table.columns_with_role(Role::Trial).next() {
        match &trial.values {
            ColumnValues::I64(numbers) => rows.sort_by_key(|&run| numbers.get(run)),
            values => rows.sort_by_key(|&run| values.text(run)),
        }
    }
    rows
}

/// Returns the variant's name, or its parameters if the table has no names; with `names`, the table
/// has their numbers.
fn variant_name(table: &RunTable, run: usize, names: Option<&[String]>) -> String {
    if let Some(column) = table.columns_with_role(Role::Variant).next() {
        let number = column.values.number(run).map(|number| number as usize);
        if let Some(names) = names
            && let Some(name) = number.and_then(|number| names.get(number))
        {
            return name.clone();
        }
        return column.values.text(run);
    }
    let parts: Vec<String> = table
        .columns_with_role(Role::Parameter)
        .map(|p| format!("{}={}", p.name, p.values.text(run)))
        .collect();
    if parts.is_empty() { "all runs".into() } else { parts.join(", ") }
}

/// Returns the parameters that differ between variants and not within one.
fn parameters(
    table: &RunTable,
    run_of: &BTreeMap<(usize, i64), usize>,
    variants: usize,
) -> Vec<Parameter> {
    let columns = table.columns_with_role(Role::Parameter);
    merge_confounded(columns.filter_map(|column| parameter(column, run_of, variants)))
}

/// Returns the parameter of a column; `None` where it has one value, or differs within a variant.
fn parameter(
    column: &RunColumn,
    run_of: &BTreeMap<(usize, i64), usize>,
    variants: usize,
) -> Option<Parameter> {
    let mut texts: Vec<Option<String>> = vec![None; variants];
    let mut numbers: Vec<Option<f64>> = vec![None; variants];
    for ((variant, _), run) in run_of {
        let text = column.values.text(*run);
        if texts[*variant].as_ref().is_some_and(|first| *first != text) {
            return None;
        }
        numbers[*variant] = column.values.number(*run).filter(|v| v.is_finite());
        texts[*variant] = Some(text);
    }
    let numeric = column.values.is_numeric() && numbers.iter().all(Option::is_some);
    let mut level_of: Vec<Level> = Vec::with_capacity(variants);
    for (text, number) in texts.into_iter().zip(numbers) {
        level_of.push(match number {
            Some(number) if numeric => Level::Number(number),
            _ => Level::Text(text.unwrap_or_default()),
        });
    }
    let mut levels: Vec<Level> = Vec::new();
    for level in &level_of {
        if !levels.contains(level) {
            levels.push(level.clone());
        }
    }
    // Numbers are positions on an axis; words stay in the order in which the sweep has them.
    if let [Level::Number(_), ..] = levels[..] {
        levels.sort_by(|a, b| match (a, b) {
            (Level::Number(a), Level::Number(b)) => a.total_cmp(b),
            _ => std::cmp::Ordering::Equal,
        });
    }
    let indices = level_of.iter().map(|level| levels.iter().position(|l| l == level).unwrap_or(0));
    let of_variant = indices.collect();
    (levels.len() > 1).then_some(Parameter {
        name: column.name.clone(),
        numeric,
        levels,
        of_variant,
    })
}

/// Returns the parameters, of which those that always change together are one: their variants are the
/// same, and share an axis. Numbers stay apart, because each is an axis of its own.
fn merge_confounded(parameters: impl Iterator<Item = Parameter>) -> Vec<Parameter> {
    let mut merged: Vec<Parameter> = Vec::new();
    for parameter in parameters {
        match merged.iter_mut().find(|other| other.is_confounded_with(&parameter)) {
            Some(other) => other.absorb(&parameter),
            None => merged.push(parameter),
        }
    }
    merged
}

impl Parameter {
    /// Returns whether two parameters, not both of them numbers, distinguish the same variants.
    fn is_confounded_with(&self, other: &Self) -> bool {
        let mut pairs: Vec<_> = self.of_variant.iter().zip(&other.of_variant).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let is_one_to_one =
            self.levels.len() == other.levels.len() && pairs.len() == self.levels.len();
        is_one_to_one && !(self.numeric && other.numeric)
    }

    /// Adds the values of a parameter that changes together with this one.
    fn absorb(&mut self, other: &Self) {
        let mut levels = Vec::with_capacity(self.levels.len());
        for (index, level) in self.levels.iter().enumerate() {
            let own = level.name();
            let variant = self.of_variant.iter().position(|of| *of == index);
            let others =
                variant.map_or(String::new(), |v| other.levels[other.of_variant[v]].name());
            // A whole list of things is no name of a bar.
            let is_short = !others.is_empty() && others.chars().count() <= MAX_LEVEL_NAME_CHARS;
            levels.push(Level::Text(if is_short { format!("{own}, {others}") } else { own }));
        }
        self.levels = levels;
        self.name = format!("{}, {}", self.name, other.name);
        self.numeric = false;
    }
}
