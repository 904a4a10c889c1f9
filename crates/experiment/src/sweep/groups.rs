//! Runs by variant and replicate.

use super::Label;
use super::options::SummaryOptions;
use super::table::{Role, RunColumn, RunTable};
use super::variant::DEFAULT_LABEL;
use serde::Serialize;
use sidestep_document::Estimate;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::Values;
use sidestep_scenario::{MetricInfo, metric_label};
use sidestep_statistics::{Sample, wilson};
use std::collections::{BTreeMap, BTreeSet};

/// Most characters of a value in the name of a level that stands for several parameters.
const MAX_LEVEL_NAME_CHARS: usize = 40;

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Level {
    /// A number.
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
    /// Path of its key.
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
    /// Whether seeds change nothing, variant by variant.
    pub(super) seedless: Vec<bool>,
    /// The run of each variant and replicate.
    run: BTreeMap<(usize, i64), usize>,
}

impl<'a> RunGroups<'a> {
    /// Groups the runs of `table`, of which the options give the names, tell the variants in which seeds
    /// change nothing, and have the metrics in words.
    pub(super) fn from_table(
        table: &'a RunTable,
        options: &SummaryOptions,
    ) -> Result<Self, InputError> {
        table.check()?;
        let runs = row_order(table);
        let label = |run: usize| variant_name(table, run, options.names.as_deref());
        let replicate = table.columns_with_role(Role::Replicate).next();
        let mut variants: Vec<String> = Vec::new();
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        let mut counts: Vec<i64> = Vec::new();
        let mut run_of = BTreeMap::new();
        for run in runs {
            let name = label(run);
            let variant = *places.entry(name.clone()).or_insert_with(|| {
                variants.push(name.clone());
                counts.push(0);
                variants.len() - 1
            });
            let number =
                replicate.and_then(|c| c.values.number(run)).map_or(counts[variant], |v| v as i64);
            counts[variant] += 1;
            if run_of.insert((variant, number), run).is_some() {
                let cause = format!("variant `{name}` has two runs of replicate {number}");
                let remedy = "number the replicates of a variant, each run once";
                return Err(InputError::new("the table of runs", cause, remedy));
            }
        }
        let replicates: BTreeSet<i64> = run_of.keys().map(|(_, r)| *r).collect();
        let parameters = parameters(table, &run_of, variants.len());
        let paired = replicate.is_some();
        let replicates = replicates.into_iter().collect();
        let seedless = variants.iter().map(|name| options.seedless.contains(name)).collect();
        let meanings = options.meanings;
        Ok(Self {
            table,
            variants,
            replicates,
            paired,
            parameters,
            meanings,
            seedless,
            run: run_of,
        })
    }

    /// Returns the label of a metric.
    pub(super) fn label(&self, metric: &RunColumn) -> Label {
        Label::from_metric(&metric.name, self.meanings)
    }

    /// Returns the thing that a metric counts or measures; empty where its world does not say.
    pub(super) fn meaning(&self, metric: &RunColumn) -> &'static str {
        metric_label(self.meanings, &metric.name).meaning
    }

    /// Returns the number of runs of a variant.
    pub(super) fn runs_of(&self, variant: usize) -> usize {
        self.run.range((variant, i64::MIN)..=(variant, i64::MAX)).count()
    }

    /// Returns the rows of a variant, by replicate.
    pub(super) fn rows(&self, variant: usize) -> impl Iterator<Item = usize> {
        self.run.range((variant, i64::MIN)..=(variant, i64::MAX)).map(|(_, run)| *run)
    }

    /// Returns the values of a variant, one for each of its runs; one where seeds change nothing.
    pub(super) fn values(&self, metric: &RunColumn, variant: usize) -> Vec<Option<f64>> {
        let most = if self.seedless[variant] { 1 } else { usize::MAX };
        self.rows(variant).take(most).map(|run| metric.values.number(run)).collect()
    }

    /// Returns the values of a variant, one for each replicate of the whole table. Where seeds change
    /// nothing, all have that of the first run.
    pub(super) fn by_replicate(&self, metric: &RunColumn, variant: usize) -> Vec<Option<f64>> {
        let same = self.rows(variant).next().filter(|_| self.seedless[variant]);
        let run_of = |r: &i64| same.or_else(|| self.run.get(&(variant, *r)).copied());
        let value = |r: &i64| metric.values.number(run_of(r)?);
        self.replicates.iter().map(value).collect()
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
            if matches!(metric.values, Values::Bool(_)) {
                return proportion(&values, self.seedless[*variant]);
            }
            return Estimate::from_values(values);
        }
        let columns: Vec<_> = group.iter().map(|v| self.by_replicate(metric, *v)).collect();
        let finite = |value: Option<f64>| value.filter(|v| v.is_finite());
        let mean = |r: usize| {
            let of_all: Option<Vec<f64>> = columns.iter().map(|c| finite(c[r])).collect();
            sidestep_statistics::mean(&of_all?)
        };
        // Where all are seedless, every replicate gives the same number.
        let all = if group.iter().all(|v| self.seedless[*v]) { 1 } else { usize::MAX };
        Estimate::from_values((0..self.replicates.len().min(all)).map(mean))
    }

    /// Returns whether every level of `parameter` occurs with the same levels of all others, as in a full
    /// grid: only then does a mean over the others compare like with like.
    pub(super) fn is_balanced(&self, parameter: usize) -> bool {
        let mut others = vec![Vec::new(); self.parameters[parameter].levels.len()];
        for variant in 0..self.variants.len() {
            let rest: Vec<usize> = (0..self.parameters.len())
                .filter(|p| *p != parameter)
                .map(|p| self.parameters[p].of_variant[variant])
                .collect();
            others[self.parameters[parameter].of_variant[variant]].push(rest);
        }
        others.iter_mut().for_each(|o| o.sort());
        others.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Returns the variants that have this level.
    pub(super) fn with_level(&self, parameter: usize, level: usize) -> Vec<usize> {
        let of = &self.parameters[parameter].of_variant;
        (0..of.len()).filter(|v| of[*v] == level).collect()
    }
}

fn proportion(values: &[Option<f64>], seedless: bool) -> Estimate {
    let values = Sample::from_runs(values.iter().copied()).values;
    let (yes, n) = (values.iter().sum::<f64>(), values.len());
    let mut share = Estimate::from_values(values.into_iter().map(Some));
    share.interval = (n > 0 && !seedless).then(|| wilson(yes, n as f64));
    share
}

/// Returns the rows in the order of their trials.
fn row_order(table: &RunTable) -> Vec<usize> {
    let mut rows: Vec<usize> = (0..table.runs()).collect();
    if let Some(trial) = table.columns_with_role(Role::Trial).next() {
        match &trial.values {
            Values::I64(numbers) => rows.sort_by_key(|&run| numbers.get(run)),
            values => rows.sort_by_key(|&run| values.text(run)),
        }
    }
    rows
}

/// Returns the variant's name, or its parameters if the table has no names; with `names`, the table
/// has their numbers.
fn variant_name(table: &RunTable, run: usize, names: Option<&[String]>) -> String {
    if let Some(column) = table.columns_with_role(Role::Variant).next() {
        let number = || column.values.number(run).map(|n| n as usize);
        let named = names.and_then(|names| names.get(number()?).cloned());
        return named.unwrap_or_else(|| column.values.text(run));
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
    let varied = |column: &RunColumn| {
        let mut of_variant: Vec<Option<String>> = vec![None; variants];
        let mut numbers: Vec<Option<f64>> = vec![None; variants];
        for ((variant, _), run) in run_of {
            let text = column.values.text(*run);
            if of_variant[*variant].as_ref().is_some_and(|first| *first != text) {
                return None;
            }
            numbers[*variant] = column.values.number(*run).filter(|v| v.is_finite());
            of_variant[*variant] = Some(text);
        }
        let numeric = column.values.is_numeric() && numbers.iter().all(Option::is_some);
        let level = |variant: usize| match numbers[variant] {
            Some(number) if numeric => Level::Number(number),
            _ => Level::Text(of_variant[variant].clone().unwrap_or_default()),
        };
        let mut levels: Vec<Level> = Vec::new();
        for variant in 0..variants {
            let level = level(variant);
            if !levels.contains(&level) {
                levels.push(level);
            }
        }
        if let [Level::Number(_), ..] = levels[..] {
            levels.sort_by(|a, b| match (a, b) {
                (Level::Number(a), Level::Number(b)) => a.total_cmp(b),
                _ => std::cmp::Ordering::Equal,
            });
        }
        let place = |variant| levels.iter().position(|l| *l == level(variant)).unwrap_or(0);
        let of_variant = (0..variants).map(place).collect();
        let name = column.name.clone();
        (levels.len() > 1).then_some(Parameter { name, numeric, levels, of_variant })
    };
    merge_confounded(table.columns_with_role(Role::Parameter).filter_map(varied))
}

/// Returns the parameters, of which those that always change together are one: their variants are the
/// same, and share an axis. Numbers stay apart, because each is an axis of its own.
fn merge_confounded(parameters: impl Iterator<Item = Parameter>) -> Vec<Parameter> {
    let mut apart: Vec<Parameter> = Vec::new();
    for parameter in parameters {
        match apart.iter_mut().find(|other| other.is_confounded_with(&parameter)) {
            Some(other) => other.absorb(&parameter),
            None => apart.push(parameter),
        }
    }
    apart
}

impl Parameter {
    /// Returns whether two parameters, not both of them numbers, tell the same variants apart.
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
        let level = |l: usize| {
            let own = self.levels[l].name();
            let variant = self.of_variant.iter().position(|of| *of == l);
            let others =
                variant.map_or(String::new(), |v| other.levels[other.of_variant[v]].name());
            // A whole list of things is no name of a bar.
            let is_short = !others.is_empty() && others.chars().count() <= MAX_LEVEL_NAME_CHARS;
            Level::Text(if is_short { format!("{own}, {others}") } else { own })
        };
        self.levels = (0..self.levels.len()).map(level).collect();
        self.name = format!("{}, {}", self.name, other.name);
        self.numeric = false;
    }
}
