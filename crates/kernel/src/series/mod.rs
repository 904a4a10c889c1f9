//! The metrics of a run over time: a table with a row for every so many cycles.
//!
//! ```text
//! interval.rs   the cycles that have a row, by their numbers alone
//! leaves.rs     metrics -> numbers, in the order of their fields
//! rows.rs       rows as numbers, for charts and sweeps
//! ```
//!
//! The columns are the metrics that are numbers or truth values, by dotted name, as in tables of sweeps. Metrics that
//! a clock measured are left out, because they differ when the run is computed again.

mod interval;
mod leaves;
mod rows;

pub use interval::SeriesInterval;
pub use rows::SeriesRows;

use crate::ports::{ColumnSpec, ColumnType, ColumnValues, TableBuffer, TableSchema};
use crate::units::Cycle;
use leaves::{LeafKind, LeafValue, leaf_specs, leaf_values};
use serde::Serialize;

/// Name of the table, in which the column `cycle` has the number of the last cycle done: one less than [`SeriesRows`] say.
pub const SERIES_TABLE: &str = "series";

/// Endings of the names of metrics that a clock measured.
const CLOCK_METRIC_SUFFIXES: [&str; 2] = ["cpu_s", "wall_s"];

/// The maximum number of cells before rows must be recorded: some 16 MB.
const MAX_CELLS: usize = 1 << 20;

/// Returns whether a clock measured a metric, by its name: its value differs when the run is computed again.
pub fn is_clock_metric(name: &str) -> bool {
    CLOCK_METRIC_SUFFIXES.iter().any(|end| name.ends_with(end))
}

/// The rows of the table that wait to be recorded.
#[derive(Debug, Default)]
pub(crate) struct MetricSeries {
    interval: SeriesInterval,
    /// The columns after that of the cycles; none until recording starts.
    columns: Vec<ColumnSpec>,
    /// For each leaf of the metrics, whether it has a column.
    has_column: Vec<bool>,
    cycles: Vec<Cycle>,
    /// The values of the columns, row by row.
    values: Vec<LeafValue>,
}

impl MetricSeries {
    /// Keeps rows from now on, with the columns of `metrics`; `meaning` has the words of the world.
    pub(crate) fn start(
        &mut self,
        interval: SeriesInterval,
        metrics: &impl Serialize,
        meaning: impl Fn(&str) -> &'static str,
    ) {
        *self = Self { interval, ..Self::default() };
        if interval == SeriesInterval::NONE {
            return;
        }
        for leaf in leaf_specs(metrics) {
            let column = leaf.kind.column_type().filter(|_| !is_clock_metric(&leaf.name));
            // Lists of numbers are histograms, whose length says nothing: the world has no words for it.
            let column =
                column.filter(|_| leaf.kind != LeafKind::List || !meaning(&leaf.name).is_empty());
            self.has_column.push(column.is_some());
            self.columns.extend(column.map(|ty| ColumnSpec {
                is_nullable: leaf.is_optional || ty == ColumnType::F64,
                ..ColumnSpec::new(&leaf.name, ty, meaning(&leaf.name))
            }));
        }
    }

    /// Returns the number of cycles after which the next row is due, if any is.
    pub(crate) fn next_due(&self, cycles_done: Cycle) -> Option<Cycle> {
        self.interval.next_due(cycles_done)
    }

    /// Keeps the metrics of a run after so many cycles.
    pub(crate) fn push(&mut self, cycles_done: Cycle, metrics: &impl Serialize) {
        let Some(last) = cycles_done.checked_sub(1) else { return };
        let row = self.row_of(metrics);
        self.cycles.push(last);
        self.values.extend(row);
    }

    /// Returns the values of the columns in some metrics.
    fn row_of(&self, metrics: &impl Serialize) -> Vec<LeafValue> {
        let leaves = leaf_values(metrics, self.has_column.len());
        debug_assert_eq!(
            leaves.len(),
            self.has_column.len(),
            "metrics have the same fields in every cycle"
        );
        let kept = leaves.into_iter().zip(&self.has_column).filter(|(_, has_column)| **has_column);
        let mut row: Vec<_> = kept.map(|(value, _)| value).collect();
        row.resize(self.columns.len(), LeafValue::Missing);
        row
    }

    /// The columns after that of the cycles; none before the series is started.
    pub(crate) fn columns(&self) -> &[ColumnSpec] {
        &self.columns
    }

    /// Returns the present metrics as numbers, one for each column.
    pub(crate) fn number_row(&self, metrics: &impl Serialize) -> Vec<f64> {
        self.row_of(metrics).iter().map(LeafValue::number).collect()
    }

    /// Takes the waiting rows as numbers.
    pub(crate) fn take_rows(&mut self) -> SeriesRows {
        let width = self.columns.len();
        let column =
            |index| self.values.iter().skip(index).step_by(width).map(LeafValue::number).collect();
        let columns = (0..width).map(column).collect();
        let cycles_done = self.cycles.iter().map(|last| last + 1).collect();
        self.clear();
        SeriesRows { cycles_done, columns }
    }

    /// Forgets the waiting rows: they belong to an abandoned past.
    pub(crate) fn clear(&mut self) {
        self.cycles.clear();
        self.values.clear();
    }

    fn column_values(&self, index: usize, ty: ColumnType) -> ColumnValues {
        let width = self.columns.len();
        let column = self.values.iter().skip(index).step_by(width.max(1));
        match ty {
            ColumnType::U64 => ColumnValues::U64(column.map(LeafValue::unsigned).collect()),
            ColumnType::I64 => ColumnValues::I64(column.map(LeafValue::signed).collect()),
            ColumnType::Bool => ColumnValues::Bool(column.map(LeafValue::truth).collect()),
            _ => ColumnValues::F64(column.map(LeafValue::float).collect()),
        }
    }
}

impl TableBuffer for MetricSeries {
    fn schema(&self) -> Option<TableSchema> {
        if self.columns.is_empty() {
            return None;
        }
        let meaning = "the metrics after this cycle, which are those of a run of one cycle more than its number";
        let mut columns = vec![ColumnSpec::new("cycle", ColumnType::U64, meaning)];
        columns.extend(self.columns.iter().cloned());
        Some(TableSchema::new(SERIES_TABLE, columns))
    }

    fn row_count(&self) -> usize {
        self.cycles.len()
    }

    fn is_full(&self) -> bool {
        self.values.len() >= MAX_CELLS
    }

    fn take(&mut self) -> Option<Vec<ColumnValues>> {
        self.schema()?;
        let columns = self.columns.iter().enumerate();
        let mut block: Vec<_> =
            columns.map(|(index, column)| self.column_values(index, column.ty)).collect();
        block.insert(0, ColumnValues::U64(std::mem::take(&mut self.cycles).into()));
        self.clear();
        Some(block)
    }
}

#[cfg(test)]
mod tests;
