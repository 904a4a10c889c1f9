//! Results of cases, shared by all papers: columns, each declared once, that say how the runs of a case are summed up. The
//! results are printed as a table, kept as JSON and read by claims.

use crate::study::{StudyResults, setting_number};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use sidestep::experiment::sweep::{RunTable, Variant};
use sidestep::statistics::{Interval, clopper_pearson, percentile};
use sidestep_document::figure::Point;
use sidestep_document::{Estimate, Figure, Series, Table};
use std::fmt;

/// The rows of one variant in the table of runs.
pub(crate) struct CaseRuns<'a> {
    results: &'a StudyResults,
    variant: &'a Variant,
    rows: Vec<usize>,
}

/// One row of the table of runs.
#[derive(Clone, Copy)]
pub(crate) struct CaseRun<'a> {
    results: &'a StudyResults,
    row: usize,
}

impl CaseRun<'_> {
    /// Returns a metric as a number; true is 1.
    pub(crate) fn number(&self, metric: &str) -> Option<f64> {
        self.results.table.column(metric)?.values.number(self.row)
    }

    /// Empty if the run does not have it.
    pub(crate) fn text(&self, metric: &str) -> String {
        self.results.table.column(metric).map_or_else(String::new, |c| c.values.text(self.row))
    }

    /// Returns a metric as a number; 0 if it is missing.
    pub(crate) fn number_or_zero(&self, metric: &str) -> f64 {
        self.number(metric).unwrap_or(0.0)
    }

    /// Above 100 where a step may count several times.
    pub(crate) fn percent_of_steps(&self, metric: &str) -> f64 {
        100.0 * self.number_or_zero(metric) / self.number_or_zero("steps")
    }

    /// A metric that is missing counts as not true.
    pub(crate) fn is_true(&self, metric: &str) -> bool {
        self.number_or_zero(metric) > 0.0
    }
}

impl CaseRuns<'_> {
    /// A key that the case does not set is a bug, and panics.
    pub(crate) fn setting(&self, key: &str) -> Value {
        match self.variant.value(key) {
            Some(toml::Value::Integer(n)) => Value::Count(*n as u64),
            Some(toml::Value::Float(x)) => Value::Number(*x),
            Some(toml::Value::Boolean(is)) => Value::Yes(*is),
            Some(toml::Value::String(word)) => Value::Word(word.clone()),
            value => panic!("`{key}` of a case is {value:?}"),
        }
    }

    pub(crate) fn variant(&self) -> &Variant {
        self.variant
    }

    /// As [`Self::setting`], of a key that is a number.
    pub(crate) fn setting_number(&self, key: &str) -> f64 {
        setting_number(self.variant, key)
    }

    /// Returns the runs, by seed.
    pub(crate) fn iter_runs(&self) -> impl Iterator<Item = CaseRun<'_>> {
        self.rows.iter().map(|&row| CaseRun { results: self.results, row })
    }

    /// Runs that do not have the metric do not count.
    pub(crate) fn mean(&self, metric: &str) -> Value {
        Value::Estimate(Estimate::from_values(self.iter_runs().map(|run| run.number(metric))))
    }

    /// As [`Self::mean`], of a value for which there is no metric.
    pub(crate) fn mean_of(&self, of: impl Fn(&CaseRun<'_>) -> f64) -> Value {
        Value::Estimate(Estimate::from_values(self.iter_runs().map(|run| Some(of(&run)))))
    }

    /// Returns the mean of shares in percent, one of each run: neither it nor its interval leaves 0 to 100.
    pub(crate) fn mean_proportion(&self, of: impl Fn(&CaseRun<'_>) -> f64) -> Value {
        let mean = Estimate::from_values(self.iter_runs().map(|run| Some(of(&run))));
        Value::Estimate(mean.clamped(0.0, 100.0))
    }

    /// Returns the mean of a count of steps in percent of all, of which a step may have several.
    pub(crate) fn mean_rate(&self, metric: &str) -> Value {
        let mean =
            Estimate::from_values(self.iter_runs().map(|run| Some(run.percent_of_steps(metric))));
        Value::Estimate(mean.clamped(0.0, f64::INFINITY))
    }

    /// Of all runs, with the interval of the share.
    pub(crate) fn proportion(&self, holds: impl Fn(&CaseRun<'_>) -> bool) -> Value {
        Value::Share(Proportion::from_flags(self.iter_runs().map(|run| holds(&run))))
    }

    /// Returns the sum of a count over all runs.
    pub(crate) fn sum(&self, metric: &str) -> Value {
        Value::Count(self.iter_runs().map(|run| run.number_or_zero(metric) as u64).sum())
    }

    /// As [`Self::proportion`], without an interval.
    pub(crate) fn count(&self, holds: impl Fn(&CaseRun<'_>) -> bool) -> Value {
        Value::Count(self.iter_runs().filter(|run| holds(run)).count() as u64)
    }

    /// Returns the smallest value of the runs that have it.
    pub(crate) fn min_value(&self, metric: &str) -> Option<f64> {
        min_value(self.iter_runs().map(|run| run.number(metric)))
    }

    /// Returns the greatest value; 0 if there is none.
    pub(crate) fn max_value(&self, metric: &str) -> f64 {
        max_value(self.iter_runs().filter_map(|run| run.number(metric)))
    }

    /// Returns the median; 0 if there is none.
    pub(crate) fn median(&self, metric: &str) -> f64 {
        median(self.iter_runs().filter_map(|run| run.number(metric)))
    }
}

/// How the runs of a case are summed up in one value.
#[derive(Clone, Copy)]
pub(crate) enum Summary {
    /// The value that the case sets this key to.
    Setting(&'static str),
    /// The mean of a metric over the runs.
    Mean(&'static str),
    /// The mean of a count of steps in percent of all steps; a step may have several, so that it may exceed 100.
    RatePercent(&'static str),
    /// The same of a count that a step adds to at most once: neither the mean nor its interval leaves 0 to 100.
    SharePercent(&'static str),
    /// The sum of a count over all runs.
    Sum(&'static str),
    /// The median of a metric; 0 if no run has it.
    Median(&'static str),
    /// The greatest value of a metric; 0 if no run has it.
    Max(&'static str),
    /// The smallest value of the runs that have it.
    Min(&'static str),
    /// The runs in which a metric is true, or above 0, out of all.
    Share(&'static str),
    /// The number of runs in which a metric is true, or above 0.
    Count(&'static str),
    /// A value that only this experiment computes.
    Computed(fn(&CaseRuns<'_>) -> Value),
}

impl Summary {
    fn of(self, runs: &CaseRuns<'_>) -> Value {
        match self {
            Self::Setting(key) => runs.setting(key),
            Self::Mean(metric) => runs.mean(metric),
            Self::RatePercent(metric) => runs.mean_rate(metric),
            Self::SharePercent(metric) => runs.mean_proportion(|run| run.percent_of_steps(metric)),
            Self::Sum(metric) => runs.sum(metric),
            Self::Median(metric) => Value::Number(runs.median(metric)),
            Self::Max(metric) => Value::Number(runs.max_value(metric)),
            Self::Min(metric) => Value::Maybe(runs.min_value(metric)),
            Self::Share(metric) => runs.proportion(|run| run.is_true(metric)),
            Self::Count(metric) => runs.count(|run| run.is_true(metric)),
            Self::Computed(value) => value(runs),
        }
    }
}

/// How a table shows the value of a column.
#[derive(Clone, Copy)]
pub(crate) enum Format {
    /// As the value prints.
    Plain,
    /// A number with this many decimals.
    Decimals(usize),
    /// A number with this many decimals and an exponent.
    Exponent(usize),
    /// A length in meters as millimeters, or `far`.
    Millimeters,
    /// A text that only this experiment makes, from any of the case's values.
    Computed(fn(&CaseResults) -> String),
}

/// A column: how the runs of a case are summed up, and shown.
pub(crate) struct Column {
    /// Its name in JSON, and for claims.
    name: &'static str,
    /// Its head in the table; a column without one is not shown there.
    head: &'static str,
    summary: Summary,
    format: Format,
}

/// Returns a column that is shown as its value prints.
pub(crate) const fn column(name: &'static str, head: &'static str, summary: Summary) -> Column {
    Column { name, head, summary, format: Format::Plain }
}

impl Column {
    /// Sets how the column is shown.
    pub(crate) const fn with_format(self, format: Format) -> Self {
        Self { format, ..self }
    }

    fn text(&self, case: &CaseResults) -> String {
        match self.format {
            Format::Plain => case.value(self.name).to_string(),
            Format::Decimals(decimals) => format!("{:.*}", decimals, case.number(self.name)),
            Format::Exponent(decimals) => format!("{:.*e}", decimals, case.number(self.name)),
            Format::Millimeters => case.format_mm(self.name),
            Format::Computed(text) => text(case),
        }
    }
}

/// The columns of an experiment: the settings of its cases, and their results.
pub(crate) struct Columns {
    pub(crate) case: &'static [Column],
    pub(crate) results: &'static [Column],
}

impl Columns {
    /// In the order of the sweep's variants.
    pub(crate) fn cases(&self, results: &StudyResults) -> Vec<CaseResults> {
        case_runs(results)
            .map(|runs| CaseResults {
                case: named_values(self.case, &runs),
                results: named_values(self.results, &runs),
                runs: runs.rows.len(),
            })
            .collect()
    }

    /// Columns without a head are left out.
    pub(crate) fn table(&self, title: &str, note: &str, cases: &[CaseResults]) -> Table {
        let columns: Vec<&Column> =
            self.case.iter().chain(self.results).filter(|c| !c.head.is_empty()).collect();
        let heads: Vec<&str> = columns.iter().map(|c| c.head).collect();
        let mut table = Table::new(title, note, &heads);
        for case in cases {
            table.push_row(columns.iter().map(|column| column.text(case)));
        }
        table
    }
}

fn named_values(columns: &[Column], runs: &CaseRuns<'_>) -> Vec<(&'static str, Value)> {
    columns.iter().map(|column| (column.name, column.summary.of(runs))).collect()
}

/// In the order of the sweep's variants, the runs of each by seed.
pub(crate) fn case_runs(results: &StudyResults) -> impl Iterator<Item = CaseRuns<'_>> {
    let variants = (0..).zip(&results.variants);
    variants.map(|(number, variant)| CaseRuns {
        results,
        variant,
        rows: rows_of_variant(&results.table, number),
    })
}

fn rows_of_variant(table: &RunTable, number: u32) -> Vec<usize> {
    let Some(variants) = table.column("variant") else { return Vec::new() };
    (0..table.runs())
        .filter(|row| variants.values.number(*row) == Some(f64::from(number)))
        .collect()
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Value {
    Count(u64),
    Number(f64),
    Maybe(Option<f64>),
    Yes(bool),
    Word(String),
    Words(Vec<String>),
    Share(Proportion),
    Estimate(Estimate),
    /// Some numbers of every run, by name.
    #[serde(serialize_with = "of_runs")]
    BySeed(Vec<NamedNumbers>),
}

pub(crate) type NamedNumbers = Vec<(&'static str, f64)>;

fn of_runs<S: Serializer>(runs: &[NamedNumbers], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(runs.iter().map(json_object))
}

fn json_object(numbers: &NamedNumbers) -> serde_json::Map<String, serde_json::Value> {
    numbers.iter().map(|(name, x)| ((*name).into(), (*x).into())).collect()
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(n) => n.fmt(f),
            Self::Number(x) | Self::Maybe(Some(x)) => x.fmt(f),
            Self::Maybe(None) => f.write_str("-"),
            Self::Yes(is) => f.write_str(if *is { "yes" } else { "no" }),
            Self::Word(word) => f.write_str(word),
            Self::Words(words) => f.write_str(&words.join(", ")),
            Self::Share(share) => share.fmt(f),
            Self::Estimate(estimate) => estimate.fmt(f),
            Self::BySeed(runs) => write!(f, "{} runs", runs.len()),
        }
    }
}

/// Settings and results of one case, by the names of its columns.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CaseResults {
    case: Vec<(&'static str, Value)>,
    results: Vec<(&'static str, Value)>,
    runs: usize,
}

impl CaseResults {
    /// Returns made-up results of 10 runs.
    #[cfg(test)]
    pub(crate) fn new(
        case: impl IntoIterator<Item = (&'static str, Value)>,
        results: impl IntoIterator<Item = (&'static str, Value)>,
    ) -> Self {
        Self { case: case.into_iter().collect(), results: results.into_iter().collect(), runs: 10 }
    }

    #[cfg(test)]
    pub(crate) fn set_value(&mut self, name: &str, value: Value) {
        let mut all = self.case.iter_mut().chain(&mut self.results);
        all.find(|(own, _)| *own == name).expect("a column of this name").1 = value;
    }

    pub(crate) fn runs(&self) -> usize {
        self.runs
    }

    /// Returns the value of a column.
    ///
    /// # Panics
    /// If the experiment has no such column.
    pub(crate) fn value(&self, name: &str) -> &Value {
        let mut all = self.case.iter().chain(&self.results);
        let value = all.find(|(own, _)| *own == name).map(|(_, value)| value);
        value.unwrap_or_else(|| panic!("there is no column `{name}`"))
    }

    /// Returns a number of any kind; a mean is 0 if nothing was measured.
    pub(crate) fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            Value::Count(n) => *n as f64,
            Value::Number(x) => *x,
            Value::Maybe(x) => x.unwrap_or(0.0),
            Value::Yes(is) => f64::from(*is),
            Value::Share(share) => share.percent(),
            Value::Estimate(estimate) => estimate.mean_or_zero(),
            other => panic!("`{name}` is no number: {other:?}"),
        }
    }

    /// Panics where the column is no count.
    pub(crate) fn count(&self, name: &str) -> u64 {
        match self.value(name) {
            Value::Count(n) => *n,
            other => panic!("`{name}` is no count: {other:?}"),
        }
    }

    /// Returns a number that may be missing.
    pub(crate) fn optional_number(&self, name: &str) -> Option<f64> {
        match self.value(name) {
            Value::Maybe(x) => *x,
            _ => Some(self.number(name)),
        }
    }

    /// A value that is no truth value is not true.
    pub(crate) fn is_true(&self, name: &str) -> bool {
        *self.value(name) == Value::Yes(true)
    }

    /// Returns whether the value is this word.
    pub(crate) fn has_text(&self, name: &str, word: &str) -> bool {
        matches!(self.value(name), Value::Word(own) if own == word)
    }

    pub(crate) fn proportion(&self, name: &str) -> &Proportion {
        match self.value(name) {
            Value::Share(share) => share,
            other => panic!("`{name}` is no share: {other:?}"),
        }
    }

    /// Returns whether it is true in all runs, of which there is at least one.
    pub(crate) fn is_true_in_all_runs(&self, name: &str) -> bool {
        self.proportion(name).holds_always()
    }

    pub(crate) fn estimate(&self, name: &str) -> &Estimate {
        match self.value(name) {
            Value::Estimate(estimate) => estimate,
            other => panic!("`{name}` is no mean: {other:?}"),
        }
    }

    /// Returns results of runs, one by one.
    pub(crate) fn by_seed(&self, column: &str, name: &str) -> Vec<Option<f64>> {
        let Value::BySeed(runs) = self.value(column) else { return Vec::new() };
        let mut values = Vec::with_capacity(runs.len());
        for run in runs {
            values.push(run.iter().find(|(own, _)| *own == name).map(|(_, x)| *x));
        }
        values
    }

    /// Returns a length, in millimeters.
    pub(crate) fn format_mm(&self, name: &str) -> String {
        format_mm(self.optional_number(name))
    }

    /// Nothing where no run has a value.
    pub(crate) fn point(&self, x: f64, y: &str) -> Option<Point> {
        match self.value(y) {
            Value::Share(share) => Some(share.point(x)),
            Value::Estimate(estimate) => estimate.point(x),
            _ => Some(Point::new(x, self.number(y))),
        }
    }
}

impl Serialize for CaseResults {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        struct NamedValues<'a>(&'a [(&'static str, Value)]);
        impl Serialize for NamedValues<'_> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
            }
        }
        let mut map = serializer.serialize_map(None)?;
        if !self.case.is_empty() {
            map.serialize_entry("case", &NamedValues(&self.case))?;
        }
        map.serialize_entry("runs", &self.runs)?;
        self.results.iter().try_for_each(|(name, value)| map.serialize_entry(name, value))?;
        map.end()
    }
}

/// A column of a table: its head, and the text of an item below it.
pub(crate) type TextColumn<'a, T> = (&'a str, &'a dyn Fn(&T) -> String);

/// Returns a table of items by its columns.
pub(crate) fn table<T>(
    title: impl Into<String>,
    note: impl Into<String>,
    items: impl IntoIterator<Item = T>,
    columns: &[TextColumn<'_, T>],
) -> Table {
    let heads: Vec<&str> = columns.iter().map(|(head, _)| *head).collect();
    let mut table = Table::new(title, note, &heads);
    for item in items {
        table.push_row(columns.iter().map(|(_, text)| text(&item)));
    }
    table
}

/// Returns a series of cases: column `y` over column `x`.
pub(crate) fn series<'a>(
    name: impl Into<String>,
    cases: impl IntoIterator<Item = &'a CaseResults>,
    [x, y]: [&str; 2],
) -> Series {
    let points = cases.into_iter().filter_map(|c| c.point(c.number(x), y)).collect();
    Series { name: name.into(), points }
}

/// Returns a series over the numbers of categories.
pub(crate) fn bars<'a>(
    name: impl Into<String>,
    cases: impl IntoIterator<Item = &'a CaseResults>,
    y: &str,
) -> Series {
    let points = (0..).zip(cases).filter_map(|(k, c)| c.point(f64::from(k), y)).collect();
    Series { name: name.into(), points }
}

/// Returns a figure of lines.
pub(crate) fn figure(title: &str, [x, y]: [&str; 2], series: impl Into<Vec<Series>>) -> Figure {
    Figure {
        title: title.into(),
        x_label: x.into(),
        y_label: y.into(),
        series: series.into(),
        ..Figure::default()
    }
}

/// A number of runs out of several, with the 95 % interval of its share of all runs, by Clopper and Pearson: it never covers
/// less than 95 %, also for shares near 0 and 1, which are what claims are about.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Proportion {
    /// Number of runs in which it was true,
    pub(crate) hits: u64,
    /// out of this many.
    pub(crate) n: u64,
    /// Interval of the share, 0 to 1.
    interval: Interval,
}

impl Proportion {
    /// Returns the share of those that are true.
    pub(crate) fn from_flags(all: impl IntoIterator<Item = bool>) -> Self {
        let mut hits = 0;
        let mut n = 0;
        for hit in all {
            hits += u64::from(hit);
            n += 1;
        }
        Self::new(hits, n)
    }

    pub(crate) fn new(hits: u64, n: u64) -> Self {
        Self { hits, n, interval: clopper_pearson(hits, n) }
    }

    /// Returns whether it is all of one or more.
    pub(crate) fn holds_always(&self) -> bool {
        self.n > 0 && self.hits == self.n
    }

    /// Returns the share in percent, 0 without runs.
    pub(crate) fn percent(&self) -> f64 {
        100.0 * self.hits as f64 / self.n.max(1) as f64
    }

    fn point(&self, x: f64) -> Point {
        let Interval { low, high } = self.interval;
        let interval = Some((100.0 * low, 100.0 * high));
        Point::new(x, self.percent()).with_interval(interval).with_runs(self.n as usize)
    }
}

impl fmt::Display for Proportion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let low_percent = (100.0 * self.interval.low).round();
        let high_percent = (100.0 * self.interval.high).round();
        write!(f, "{}/{} [{low_percent}, {high_percent}] %", self.hits, self.n)
    }
}

/// Returns the median; 0 if there are no values.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    percentile(&values, 0.5).unwrap_or(0.0)
}

/// Returns the smallest of the values that are present.
pub(crate) fn min_value(values: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    values.into_iter().flatten().reduce(f64::min)
}

/// Returns the greatest; 0 if there are none.
pub(crate) fn max_value(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}

/// Returns a length in millimeters, with its sign, or `far` if there is none.
pub(crate) fn format_mm(value_m: Option<f64>) -> String {
    match value_m {
        None => "far".into(),
        // Less than the last digit shown is rounding, and would print as -0.000 or 0.001.
        Some(m) if m.abs() < 1e-6 => "0.000".into(),
        Some(m) => format!("{:.3}", 1e3 * m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_says_how_sure_it_is() {
        let share = Proportion::from_flags([true, true, true, false]);
        assert_eq!(share.to_string(), "3/4 [19, 99] %");
        assert!(
            !share.holds_always()
                && Proportion::from_flags([true; 2]).holds_always()
                && !Proportion::from_flags([]).holds_always()
        );
    }
}
