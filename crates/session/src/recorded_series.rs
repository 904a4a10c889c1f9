//! The metrics over time of a recording, for charts.

use crate::RecordedRun;
use sidestep_kernel::series::{SERIES_TABLE, SeriesRows};
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{RunReader, Table, for_each_block};

/// The maximum number of rows that are read: beyond it every second one is left out, or more, by the numbers of their
/// cycles. A chart has fewer pixels.
const MAX_ROWS: Cycle = 4096;

/// Metrics over time that were recorded.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordedSeries {
    /// The names of the metrics, in the order of the columns.
    pub names: Vec<String>,
    /// The rows.
    pub rows: SeriesRows,
}

impl RecordedRun {
    /// Returns the recorded metrics over time, at most some thousand rows; none of a recording without them.
    ///
    /// # Errors
    /// When the table can no longer be read.
    pub fn series(&self) -> Result<Option<RecordedSeries>, InputError> {
        let Some(folder) = &self.folder else { return Ok(None) };
        let every = RunReader::open(folder)?.manifest.series_every.unwrap_or(0);
        if every == 0 || !self.tables()?.iter().any(|name| name == SERIES_TABLE) {
            return Ok(None);
        }
        let kept = (self.cycles_done / every).div_ceil(MAX_ROWS).max(1).next_power_of_two() * every;
        let mut series = RecordedSeries::default();
        for_each_block(folder, SERIES_TABLE, .., |block| {
            series.add(&block, kept);
            Ok::<(), InputError>(())
        })?;
        Ok(Some(series))
    }
}

impl RecordedSeries {
    /// Adds the rows after a multiple of so many cycles.
    fn add(&mut self, block: &Table, kept: Cycle) {
        let Some((cycle, values)) = block.columns.split_first() else { return };
        if self.names.is_empty() {
            let columns = block.schema.columns.iter().skip(1);
            self.names = columns.map(|column| column.name.clone()).collect();
            self.rows.columns = vec![Vec::new(); self.names.len()];
        }
        for row in 0..block.rows() {
            // The table has the number of the last cycle.
            let cycles_done = cycle.number(row).map_or(0, |last| last as Cycle + 1);
            if cycles_done > 0 && cycles_done.is_multiple_of(kept) {
                let row = values.iter().map(|column| column.number(row).unwrap_or(f64::NAN));
                self.rows.push(cycles_done, row);
            }
        }
    }
}
