//! The metrics of a run over time, for charts: exact values after cycles that follow from their numbers alone.
//!
//! The run itself keeps the rows while it advances, so that neither the load of the machine nor the way of a page through
//! the run decides which cycles have one. Rows begin with the first and leave none out: whoever computes a cycle first,
//! the played run or the one ahead of it, has computed all cycles before.

use crate::protocol::{MetricName, MetricRow, ReplyBody};
use crate::usage_registry::StoreBytes;
use sidestep_kernel::series::{SeriesInterval, SeriesRows};
use sidestep_kernel::{Cycle, Simulation};
use sidestep_scenario::{MetricInfo, MetricLabel, WorldType, metric_label};
use sidestep_session::RecordedSeries;
use std::time::{Duration, Instant};

/// A recording with fewer rows than this is computed for its charts: a run of millions of planned cycles that was
/// interrupted early has a few rows.
const MIN_RECORDED_ROWS: usize = 200;

/// Minimum ratio of the time of play to the time spent on metrics of cycles without a row: a page asks for them several times
/// a second, and those of some worlds take a millisecond.
const MIN_COST_RATIO: u32 = 50;
/// Number of rows of a run of 2^64 cycles: a thousand, and half as many for each time that the interval doubles.
const MAX_ROWS: u64 = 28_000;

/// The words of a world for its metrics, and its choice for charts.
#[derive(Clone, Copy, Default)]
pub(crate) struct MetricWords {
    infos: &'static [MetricInfo],
    chart_metrics: &'static [&'static str],
    /// The name under which metrics of agents have the agent's number, which is no metric.
    agent_number: Option<&'static str>,
}

impl MetricWords {
    pub(crate) fn from_world(world_type: &dyn WorldType) -> Self {
        Self {
            infos: world_type.metric_infos(),
            chart_metrics: world_type.chart_metrics(),
            agent_number: world_type.facts().positions.map(|positions| positions.agent),
        }
    }

    /// Returns the words for a metric of agents; none for one that the world has no words for, such as a part of a
    /// configuration.
    pub(crate) fn agent_metric_name(&self, key: &str) -> Option<MetricName> {
        if self.agent_number == Some(key) || metric_label(self.infos, key).meaning.is_empty() {
            return None;
        }
        // Counters of an agent have the names of their sums, in a table of their own.
        let own = key.rsplit_once('.').map_or(key, |(_, own)| own);
        let is_primary = self.chart_metrics.contains(&own);
        Some(MetricName { is_primary, ..self.metric_name(key) })
    }

    /// Returns the place of a metric among those that charts show first; those that they do not have the last.
    fn rank(&self, key: &str) -> usize {
        let place = self.chart_metrics.iter().position(|name| *name == key);
        place.unwrap_or(self.chart_metrics.len())
    }

    fn metric_name(&self, key: &str) -> MetricName {
        let MetricLabel { words, unit, .. } = metric_label(self.infos, key);
        MetricName {
            key: key.into(),
            label: words,
            unit: unit.unwrap_or_default().into(),
            is_primary: self.rank(key) < self.chart_metrics.len(),
        }
    }
}

/// The metrics of one run over time.
pub(crate) struct MetricHistory {
    interval: SeriesInterval,
    names: Vec<MetricName>,
    /// For each name, its column in the rows.
    columns: Vec<usize>,
    rows: SeriesRows,
    /// The metrics of a cycle without a row, which were computed last.
    present: Option<PresentRow>,
}

/// The metrics of one cycle, and what they cost.
struct PresentRow {
    cycle: Cycle,
    values: Vec<f64>,
    cost: Duration,
    computed: Instant,
}

impl MetricHistory {
    /// Starts with a run that is at its start, and the rows that are recorded of it, if there are any. A recording that
    /// can only be shown has no others.
    pub(crate) fn from_run(
        run: &mut dyn Simulation,
        until: Cycle,
        recorded: Option<RecordedSeries>,
        words: MetricWords,
    ) -> Self {
        let interval = SeriesInterval::from_planned_cycles(until);
        run.start_series(interval);
        let computed_keys: Vec<String> =
            run.series_columns().iter().map(|column| column.name.clone()).collect();
        let recorded = recorded.filter(|series| {
            let is_enough = series.rows.len() >= MIN_RECORDED_ROWS && series.names == computed_keys;
            computed_keys.is_empty() || is_enough
        });
        let columns = vec![Vec::new(); computed_keys.len()];
        let mut rows = SeriesRows { columns, ..SeriesRows::default() };
        if !computed_keys.is_empty() {
            rows.push(run.cycle(), run.series_row());
        }
        let mut history =
            Self { interval, names: Vec::new(), columns: Vec::new(), rows, present: None };
        let keys = match recorded {
            None => computed_keys,
            Some(series) => {
                history.rows.columns.resize(series.names.len(), Vec::new());
                history.add(&series.rows);
                series.names
            }
        };
        let mut order: Vec<usize> = (0..keys.len()).collect();
        order.sort_by_key(|&column| words.rank(&keys[column]));
        history.names = order.iter().map(|&column| words.metric_name(&keys[column])).collect();
        history.columns = order;
        history
    }

    /// The cycles after which rows are wanted of any computation of the run.
    pub(crate) fn interval(&self) -> SeriesInterval {
        self.interval
    }

    /// Adds the rows that a computation of the run has kept, as far as they are new.
    pub(crate) fn add(&mut self, rows: &SeriesRows) {
        let last = self.rows.cycles_done.last().copied();
        let known = rows.cycles_done.partition_point(|&cycle| Some(cycle) <= last);
        for row in known..rows.len() {
            self.rows.push(rows.cycles_done[row], rows.row(row));
        }
    }

    /// Returns the rows from a number on, none if there are not so many, and the metrics of the run's present cycle; while
    /// it advances, those of a cycle not long ago, where they take long to compute.
    pub(crate) fn metrics_reply(
        &mut self,
        run: &dyn Simulation,
        from: u32,
        is_advancing: bool,
    ) -> ReplyBody {
        self.update_present(run, is_advancing);
        let first = (from as usize).min(self.rows.len());
        let present = self.present.as_ref().filter(|present| !present.values.is_empty());
        let column = |&column: &usize| self.rows.columns[column][first..].iter();
        ReplyBody::Metrics {
            names: self.names.clone(),
            first: first as u32,
            cycles: self.rows.cycles_done[first..].iter().map(|&cycle| cycle as f64).collect(),
            values: self.columns.iter().map(|at| column(at).map(|v| known(*v)).collect()).collect(),
            present: present.map(|present| MetricRow {
                cycle: present.cycle as f64,
                values: self.columns.iter().map(|&column| known(present.values[column])).collect(),
            }),
        }
    }

    /// Returns the bytes of all rows.
    pub(crate) fn bytes(&self) -> StoreBytes {
        let value_bytes = size_of::<f64>() as u64;
        let rows = self.rows.cycles_done.capacity() as u64;
        let values: u64 = self.rows.columns.iter().map(|column| column.capacity() as u64).sum();
        let row_values = 1 + self.rows.columns.len() as u64;
        // Lists grow to twice what they hold.
        StoreBytes {
            used: (rows + values) * value_bytes,
            max: 2 * MAX_ROWS * row_values * value_bytes,
        }
    }

    /// Computes the metrics of the present cycle, unless they are known, or were computed not long ago.
    fn update_present(&mut self, run: &dyn Simulation, is_advancing: bool) {
        let cycle = run.cycle();
        if let Some(present) = &self.present {
            let rest = present.cost.saturating_mul(MIN_COST_RATIO);
            if present.cycle == cycle || (is_advancing && present.computed.elapsed() < rest) {
                return;
            }
        }
        let started = Instant::now();
        let values = match self.rows.cycles_done.binary_search(&cycle) {
            // Of a recording that cannot be computed again no present metrics are known, only rows.
            Ok(row) if !run.series_columns().is_empty() => self.rows.row(row).collect(),
            _ => run.series_row(),
        };
        let cost = started.elapsed();
        self.present = Some(PresentRow { cycle, values, cost, computed: Instant::now() });
    }
}

/// Returns a value that a metric has.
fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;
    use sidestep_scenario::Source;

    const ROBOTS: &str = "format = 1\nworld = \"robots\"\nseed = 5\ncycles = 20000\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\n\
    ..............\n..............\n....##........\n....##........\n..............\n..............\n\"\"\"\n\
    [robots]\ncount = 6\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n[people]\ncount = 2\n";

    fn present_cycle(history: &mut MetricHistory, run: &dyn Simulation, is_advancing: bool) -> f64 {
        match history.metrics_reply(run, 0, is_advancing) {
            ReplyBody::Metrics { present: Some(row), .. } => row.cycle,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn dear_metrics_of_a_running_cycle_are_computed_seldom_and_those_of_a_pause_at_once() {
        let source = Source::new("s.toml", ROBOTS, "");
        let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
        let words = MetricWords::default();
        let mut history = MetricHistory::from_run(run.as_mut(), 20_000, None, words);
        run.advance(7);
        assert_eq!(present_cycle(&mut history, run.as_ref(), true), 7.0, "the first are computed");
        history.present.as_mut().expect("some").cost = Duration::from_secs(3600);
        run.advance(5);
        assert_eq!(present_cycle(&mut history, run.as_ref(), true), 7.0, "they took an hour");
        assert_eq!(present_cycle(&mut history, run.as_ref(), false), 12.0);
        history.present.as_mut().expect("some").cost = Duration::ZERO;
        run.advance(1);
        assert_eq!(present_cycle(&mut history, run.as_ref(), true), 13.0, "they cost nothing");
    }
}
