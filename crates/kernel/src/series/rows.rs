//! Rows as numbers, for charts and sweeps.

use crate::units::Cycle;

/// Metrics of a run after some cycles, column by column, in the order of [`series_columns`].
///
/// [`series_columns`]: crate::Simulation::series_columns
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SeriesRows {
    /// The number of cycles done before each row.
    pub cycles_done: Vec<Cycle>,
    /// The values of each column, row by row; NaN where a metric has no value.
    pub columns: Vec<Vec<f64>>,
}

impl SeriesRows {
    /// Appends a row with a value for each column, after all others.
    ///
    /// # Panics
    /// When it is not later than the last row.
    pub fn push(&mut self, cycles_done: Cycle, row: impl IntoIterator<Item = f64>) {
        let is_later = self.cycles_done.last().is_none_or(|&last| last < cycles_done);
        assert!(is_later, "a row of {cycles_done} cycles comes after a later one");
        self.cycles_done.push(cycles_done);
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
    }

    /// Returns the values of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = f64> {
        self.columns.iter().map(move |column| column[row])
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.cycles_done.len()
    }

    /// Returns whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.cycles_done.is_empty()
    }
}
