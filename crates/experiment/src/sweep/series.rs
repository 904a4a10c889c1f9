//! Metrics over time of the runs of a sweep: kept by each trial after the same cycles, and their means over seeds.
//!
//! A trial keeps the metrics that its world is about, as text in its outcome: a hundred numbers each. In the table of
//! runs they are columns with the role [`Role::Series`], which [`RunTable::split_series`] turns into a table of their
//! own, a row for each run and cycle.

use super::table::{CYCLES, Role, RunColumn, RunTable};
use serde_json::{Map, Value};
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::series::SeriesInterval;
use sidestep_kernel::{Cycle, Simulation};
use sidestep_statistics::{Interval, mean, mean_interval};
use std::collections::{BTreeMap, BTreeSet};

/// Number of rows of a run of the planned number of cycles: a curve in a figure is a few hundred pixels wide, and a sweep
/// may have many runs.
const ROWS: Cycle = 100;

/// Name of the column with the number of cycles done before a row.
pub const CYCLE: &str = "cycle";

/// The metrics over time that a trial keeps.
#[derive(Debug, Clone)]
pub struct TrialSeries(Vec<String>);

impl TrialSeries {
    /// Starts to keep these metrics of a simulation that is at its start and runs until a cycle.
    pub fn start(simulation: &mut dyn Simulation, until: Cycle, metrics: Vec<String>) -> Self {
        if !metrics.is_empty() {
            simulation.start_series(SeriesInterval::with_rows(until, ROWS));
        }
        Self(metrics)
    }

    /// Takes the rows of a simulation that has ended, as fields of an outcome: numbers with commas between them, nothing
    /// where a metric has no value.
    pub fn take(self, simulation: &mut dyn Simulation) -> Map<String, Value> {
        let rows = simulation.take_series();
        let mut fields = Map::new();
        if rows.is_empty() {
            return fields;
        }
        let cycles: Vec<String> = rows.cycles_done.iter().map(ToString::to_string).collect();
        fields.insert(CYCLE.into(), cycles.join(",").into());
        let names: Vec<&str> =
            simulation.series_columns().iter().map(|column| column.name.as_str()).collect();
        for metric in &self.0 {
            let Some(at) = names.iter().position(|name| name == metric) else { continue };
            let values: Vec<String> = rows.columns[at].iter().map(|value| cell(*value)).collect();
            fields.insert(metric.clone(), values.join(",").into());
        }
        fields
    }
}

/// Returns a number with as many digits as it takes to read it back; nothing for what is no number.
fn cell(value: f64) -> String {
    // Beyond this, not every whole number is a float.
    const MAX_WHOLE: f64 = 1e15;
    if !value.is_finite() {
        return String::new();
    }
    if value.fract() == 0.0 && value.abs() < MAX_WHOLE {
        return format!("{value:.0}");
    }
    format!("{value:?}")
}

/// Reads the cells of a run.
fn cells<T: std::str::FromStr>(column: &RunColumn, run: usize) -> Vec<Option<T>> {
    let text = column.values.text(run);
    if text.is_empty() {
        return Vec::new();
    }
    text.split(',').map(|cell| cell.parse().ok()).collect()
}

impl RunTable {
    /// Returns the table without the metrics over time, and these as a table of their own: by run and cycle, without
    /// columns where no run has any.
    #[must_use]
    pub fn split_series(mut self) -> (Self, Self) {
        let series = self.series();
        self.columns.retain(|column| column.role != Role::Series);
        (self, series)
    }

    /// Returns the metrics over time: number, variant, replicate and seed of the run, the number of cycles done, and the
    /// metrics after it.
    pub fn series(&self) -> Self {
        let kept: Vec<&RunColumn> = self.columns_with_role(Role::Series).collect();
        let Some(cycle_column) = kept.iter().find(|column| column.name == CYCLE) else {
            return Self::default();
        };
        let mut runs = Vec::new();
        let mut cycles = Vec::new();
        let metrics: Vec<_> = kept.iter().filter(|column| column.name != CYCLE).collect();
        let mut values: Vec<Vec<Option<f64>>> = vec![Vec::new(); metrics.len()];
        for run in 0..self.runs() {
            cycles.extend(cells::<i64>(cycle_column, run));
            runs.resize(cycles.len(), run);
            for (column, values) in metrics.iter().zip(&mut values) {
                values.extend(cells::<f64>(column, run));
                values.resize(cycles.len(), None);
            }
        }
        let identity = [Role::Trial, Role::Variant, Role::Replicate, Role::Seed];
        let of_run = self.columns.iter().filter(|column| identity.contains(&column.role));
        let mut columns: Vec<RunColumn> = of_run
            .map(|column| RunColumn { values: column.values.gather_rows(&runs), ..column.clone() })
            .collect();
        let cycles = ColumnValues::I64(cycles.into_iter().collect());
        columns.push(RunColumn { name: CYCLE.into(), role: Role::Cycle, values: cycles });
        for (column, values) in metrics.into_iter().zip(values) {
            let values = ColumnValues::F64(values.into_iter().collect());
            columns.push(RunColumn { name: column.name.clone(), role: Role::Series, values });
        }
        Self { columns }
    }
}

/// The mean of a metric over the runs of a variant, after equal numbers of cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesBand {
    /// The number of the variant in the plan.
    pub variant: u32,
    /// The name of the metric.
    pub metric: String,
    /// The means, by rising cycles.
    pub points: Vec<BandPoint>,
}

/// The mean of a metric over the runs of a variant after a number of cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandPoint {
    /// The number of cycles done.
    pub cycle: Cycle,
    /// The number of runs in which the metric has a value there.
    pub runs: usize,
    /// The mean over these runs.
    pub mean: f64,
    /// The 95 % interval of the mean; none of a single run.
    pub interval: Option<Interval>,
}

/// Returns the mean of each metric over the runs of each variant, by the table of runs and that of their metrics over
/// time. A run that was over before a cycle has the metrics of its end there: nothing can happen in it anymore, and
/// without it a mean would be one of the runs that lasted.
pub fn series_bands(runs: &RunTable, series: &RunTable) -> Vec<SeriesBand> {
    let variants = Variants::from_runs(runs, series);
    let mut bands = Vec::new();
    for (variant, rows) in &variants.0 {
        let cycles: BTreeSet<Cycle> =
            rows.iter().flat_map(|run| run.by_cycle.keys().copied()).collect();
        for column in series.columns_with_role(Role::Series) {
            let end = runs.columns_with_role(Role::Metric).find(|end| end.name == column.name);
            let values = |cycle| rows.iter().filter_map(move |run| run.value(cycle, column, end));
            let points = cycles.iter().filter_map(|&cycle| {
                let values: Vec<f64> = values(cycle).collect();
                let mean = mean(&values)?;
                Some(BandPoint {
                    cycle,
                    runs: values.len(),
                    mean,
                    interval: mean_interval(&values),
                })
            });
            let points: Vec<BandPoint> = points.collect();
            bands.push(SeriesBand { variant: *variant, metric: column.name.clone(), points });
        }
    }
    bands
}

/// The rows of a run.
struct RunRows {
    /// Its row in the table of runs.
    run: usize,
    /// The number of cycles that it lasted.
    end: Cycle,
    /// The rows of its metrics over time, by cycle.
    by_cycle: BTreeMap<Cycle, usize>,
}

impl RunRows {
    /// Returns a metric after a cycle, from its column over time or that of the ends of runs.
    fn value(&self, cycle: Cycle, column: &RunColumn, end: Option<&RunColumn>) -> Option<f64> {
        match self.by_cycle.get(&cycle) {
            Some(&row) => column.values.number(row),
            None if self.end < cycle => end?.values.number(self.run),
            None => None,
        }
    }
}

/// The runs of each variant that have metrics over time.
struct Variants(BTreeMap<u32, Vec<RunRows>>);

impl Variants {
    fn from_runs(runs: &RunTable, series: &RunTable) -> Self {
        let number = |table: &RunTable, role, row| {
            let column = table.columns_with_role(role).next()?;
            column.values.number(row).map(|number| number as u64)
        };
        let mut of_trial: BTreeMap<u64, BTreeMap<Cycle, usize>> = BTreeMap::new();
        for row in 0..series.runs() {
            let trial = number(series, Role::Trial, row);
            if let (Some(trial), Some(cycle)) = (trial, number(series, Role::Cycle, row)) {
                of_trial.entry(trial).or_default().insert(cycle, row);
            }
        }
        let mut variants: BTreeMap<u32, Vec<RunRows>> = BTreeMap::new();
        for run in 0..runs.runs() {
            let trial = number(runs, Role::Trial, run);
            let rows = trial.and_then(|trial| of_trial.remove(&trial));
            if let (Some(by_cycle), Some(variant)) = (rows, number(runs, Role::Variant, run)) {
                let end = runs.column(CYCLES);
                let end = end.and_then(|column| column.values.number(run)).unwrap_or(0.0) as Cycle;
                variants.entry(variant as u32).or_default().push(RunRows { run, end, by_cycle });
            }
        }
        Self(variants)
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::Trial;
    use super::super::trial::start_trial;
    use super::*;
    use crate::testing::worlds;
    use sidestep_scenario::Source;

    const AIRSPACE: &str = "format = 1\nworld = \"airspace\"\ncycles = 60\n[airspace.generator]\n\
                            kind = \"superconflict\"\nn = 3\n";

    fn column(name: &str, role: Role, values: ColumnValues) -> RunColumn {
        RunColumn { name: name.into(), role, values }
    }

    fn whole(values: &[i64]) -> ColumnValues {
        ColumnValues::I64(values.iter().copied().map(Some).collect())
    }

    fn text(values: &[&str]) -> ColumnValues {
        ColumnValues::Text(values.iter().map(|text| Some((*text).to_string())).collect())
    }

    /// Two runs of a variant and one of another; the second is over after 15 cycles.
    fn table() -> RunTable {
        RunTable {
            columns: vec![
                column("cell", Role::Trial, whole(&[0, 1, 10])),
                column("variant", Role::Variant, whole(&[0, 0, 1])),
                column("replicate", Role::Replicate, whole(&[0, 1, 0])),
                column("seed", Role::Seed, whole(&[7, 8, 7])),
                column("cycles_run", Role::Metric, whole(&[30, 15, 30])),
                column("hops", Role::Metric, whole(&[6, 8, 1])),
                column(CYCLE, Role::Series, text(&["10,20,30", "10", "10,20,30"])),
                column("hops", Role::Series, text(&["1,2.5,6", "3", ",,1"])),
            ],
        }
    }

    #[test]
    fn metrics_over_time_become_a_table_by_run_and_cycle() {
        let (runs, series) = table().split_series();
        assert!(runs.columns_with_role(Role::Series).next().is_none());
        let numbers = |name: &str| -> Vec<Option<f64>> {
            let column = series.column(name).expect("a column");
            (0..series.runs()).map(|row| column.values.number(row)).collect()
        };
        let some = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
        assert_eq!(numbers("cell"), some(&[0.0, 0.0, 0.0, 1.0, 10.0, 10.0, 10.0]));
        assert_eq!(numbers("seed"), some(&[7.0, 7.0, 7.0, 8.0, 7.0, 7.0, 7.0]));
        assert_eq!(numbers(CYCLE), some(&[10.0, 20.0, 30.0, 10.0, 10.0, 20.0, 30.0]));
        let hops = [Some(1.0), Some(2.5), Some(6.0), Some(3.0), None, None, Some(1.0)];
        assert_eq!(numbers("hops"), hops);
        assert!(series.check().is_ok());
    }

    #[test]
    fn a_run_that_is_over_has_the_metrics_of_its_end_in_later_means() {
        let (runs, series) = table().split_series();
        let bands = series_bands(&runs, &series);
        let means = |band: &SeriesBand| -> Vec<(Cycle, usize, f64)> {
            band.points.iter().map(|point| (point.cycle, point.runs, point.mean)).collect()
        };
        assert_eq!((bands.len(), bands[0].variant, &*bands[0].metric), (2, 0, "hops"));
        assert_eq!(means(&bands[0]), [(10, 2, 2.0), (20, 2, 5.25), (30, 2, 7.0)]);
        let interval = bands[0].points[0].interval.expect("of two runs");
        assert!(interval.contains(2.0) && !interval.contains(30.0));
        assert_eq!(means(&bands[1]), [(30, 1, 1.0)], "a mean of what has a value");
        assert!(bands[1].points[0].interval.is_none());
    }

    #[test]
    fn no_metrics_over_time_make_no_table() {
        let mut runs = table();
        runs.columns.retain(|column| column.role != Role::Series);
        assert_eq!(runs.series(), RunTable::default());
        assert!(series_bands(&runs, &RunTable::default()).is_empty());
    }

    #[test]
    fn numbers_are_read_back_as_they_were() {
        for value in [0.0, -3.0, 0.1 + 0.2, 1e300, 5e-324, 123_456_789.25] {
            assert_eq!(cell(value).parse::<f64>(), Ok(value));
        }
        assert_eq!((cell(f64::NAN), cell(12.0)), (String::new(), "12".into()));
    }

    #[test]
    fn a_trial_keeps_what_its_world_is_about_with_any_number_of_workers() {
        let source = Source::new("s.toml", AIRSPACE, "");
        let kept = |workers| {
            let trial = Trial { id: 0, variant: 0, replicate: 0, seed: 1 };
            let started = start_trial(&worlds(), trial, &source, workers).expect("valid");
            started.run(&|| true).expect("not stopped")
        };
        let outcome = kept(1);
        let cycles = outcome.series[CYCLE].as_str().expect("text").split(',').count();
        assert_eq!(cycles as u64, outcome.cycles, "every cycle of a short run");
        let arrived = outcome.series["arrived"].as_str().expect("text");
        let last = arrived.rsplit(',').next().expect("a number");
        assert_eq!(last, outcome.metrics["arrived"].to_string());
        assert_eq!(outcome.series, kept(2).series);
    }

    #[test]
    fn a_trial_keeps_the_metrics_that_it_is_told_and_nothing_without_any() {
        let source = Source::new("s.toml", AIRSPACE, "");
        let kept = |names: &[&str]| {
            let trial = Trial { id: 0, variant: 0, replicate: 0, seed: 1 };
            let started = start_trial(&worlds(), trial, &source, 1).expect("valid");
            let names: Vec<String> = names.iter().map(ToString::to_string).collect();
            started.with_series(names).run(&|| true).expect("not stopped").series
        };
        let series = kept(&["in_flight"]);
        assert_eq!(series.keys().collect::<Vec<_>>(), [CYCLE, "in_flight"]);
        assert!(kept(&[]).is_empty());
    }
}
