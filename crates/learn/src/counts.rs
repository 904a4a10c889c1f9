//! Tables of counts: rows are the truth, columns the outcomes.

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use sidestep_statistics::{Interval, wilson};

/// Counts of outcomes by row. A count may be fractional where one event is spread over outcomes
/// (phase averaging); the total of a row is its number of events all the same.
///
/// Serialized as `{row: {column: count}}` without empty cells and rows.
#[derive(Debug, Clone, PartialEq)]
pub struct CountTable {
    name: String,
    rows: Vec<String>,
    columns: Vec<String>,
    /// Row by row; shape `(rows, columns)`.
    cells: Vec<Vec<f64>>,
}

/// One estimated probability and the counts on which it rests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Name of the table of counts, such as `confusion` or `moves`.
    pub table: String,
    /// The truth, or the command.
    pub row: String,
    /// The outcome, or what was reported.
    pub column: String,
    /// Number of times that the outcome occurred.
    pub count: f64,
    /// Number of events of the row.
    pub of: f64,
    /// `count / of`, without smoothing.
    pub probability: f64,
    /// Wilson's 95 % interval of that probability; `None` where too many samples were left out for a reason that
    /// nothing explains, see [`max_unexplained`](crate::EstimateOptions::max_unexplained).
    pub interval: Option<Interval>,
}

/// A row that rests on few counts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LowCountRow {
    /// Name of the table of counts, as in [`Estimate`].
    pub table: String,
    /// The truth, or the command.
    pub row: String,
    /// Sum of the row's cells, which is its number of events; may be 0.
    pub count: f64,
}

impl CountTable {
    /// Returns a table of zeros; rows are truths or commands, columns outcomes.
    pub fn new(name: &str, rows: &[String], columns: &[String]) -> Self {
        Self {
            name: name.to_owned(),
            rows: rows.to_vec(),
            columns: columns.to_vec(),
            cells: vec![vec![0.0; columns.len()]; rows.len()],
        }
    }

    /// Adds `weight` to a cell: 1 for an event, or a share of one that is spread over several
    /// cells.
    pub fn add(&mut self, row: usize, column: usize, weight: f64) {
        self.cells[row][column] += weight;
    }

    /// Adds the counts of a table of the same shape, each times `weight`.
    pub(crate) fn add_table(&mut self, other: &Self, weight: f64) {
        for (row, added) in self.cells.iter_mut().zip(&other.cells) {
            row.iter_mut().zip(added).for_each(|(cell, count)| *cell += weight * count);
        }
    }

    /// Returns the name under which reports and profiles list the table.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the names of the rows: truths or commands.
    pub fn rows(&self) -> &[String] {
        &self.rows
    }

    /// Returns the names of the columns: outcomes.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns all counts, shape `(rows, columns)`.
    pub fn cells(&self) -> &[Vec<f64>] {
        &self.cells
    }

    /// Returns the counts of one row, one per column.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.cells[row]
    }

    /// Returns the sum of one row, its number of events.
    pub fn total(&self, row: usize) -> f64 {
        self.cells[row].iter().sum()
    }

    /// Returns the row as probabilities after `alpha` is added to every cell; `None` when the row
    /// has no counts, because then only the shape of the table would show.
    pub fn smoothed(&self, row: usize, alpha: f64) -> Option<Vec<f64>> {
        (self.total(row) > 0.0).then(|| smooth(&self.cells[row], alpha))
    }

    /// Returns every cell of every row that has counts, as a probability.
    pub fn estimates(&self) -> Vec<Estimate> {
        (0..self.rows.len())
            .filter(|&row| self.total(row) > 0.0)
            .flat_map(|row| (0..self.columns.len()).map(move |column| self.estimate(row, column)))
            .collect()
    }

    fn estimate(&self, row: usize, column: usize) -> Estimate {
        let count = self.cells[row][column];
        let of = self.total(row);
        Estimate {
            table: self.name.clone(),
            row: self.rows[row].clone(),
            column: self.columns[column].clone(),
            count,
            of,
            probability: count / of,
            interval: Some(wilson(count, of)),
        }
    }

    /// Returns the rows with fewer than `below` counts, including those with none.
    pub fn low_count_rows(&self, below: u32) -> Vec<LowCountRow> {
        let mut thin = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            let count = self.total(index);
            if count < f64::from(below) {
                thin.push(LowCountRow { table: self.name.clone(), row: row.clone(), count });
            }
        }
        thin
    }
}

/// Returns probabilities from counts, `alpha` added to each; all equal when every sum is zero.
pub(crate) fn smooth(counts: &[f64], alpha: f64) -> Vec<f64> {
    let total: f64 = counts.iter().map(|count| count + alpha).sum();
    if total <= 0.0 {
        return vec![1.0 / counts.len() as f64; counts.len()];
    }
    counts.iter().map(|count| (count + alpha) / total).collect()
}

/// Returns probabilities with nine decimals that sum to 1: the rounding error is given to the
/// greatest, where it is the smallest in proportion and cannot make a probability negative.
pub(crate) fn rounded(probabilities: &[f64]) -> Vec<f64> {
    let mut row: Vec<f64> = probabilities.iter().map(|p| round_to_nine(*p)).collect();
    let greatest = (0..row.len()).max_by(|a, b| row[*a].total_cmp(&row[*b]));
    if let Some(greatest) = greatest {
        let others: f64 = (0..row.len()).filter(|i| *i != greatest).map(|i| row[i]).sum();
        row[greatest] = round_to_nine(1.0 - others);
    }
    row
}

fn round_to_nine(p: f64) -> f64 {
    (p * 1e9).round() / 1e9
}

/// A count, written as an integer where it is one: only phase averaging makes fractions.
struct Count(f64);

impl Serialize for Count {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0.fract() == 0.0 {
            serializer.serialize_u64(self.0 as u64)
        } else {
            serializer.serialize_f64(self.0)
        }
    }
}

/// A table that is serialized as its bare numbers, shape `(rows, columns)`.
#[derive(Debug, Clone, PartialEq)]
pub struct CountMatrix(pub CountTable);

impl Serialize for CountMatrix {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = self.0.cells.iter();
        serializer.collect_seq(rows.map(|row| row.iter().map(|&c| Count(c)).collect::<Vec<_>>()))
    }
}

/// The non-empty cells of one row.
struct NonzeroCells<'a> {
    columns: &'a [String],
    cells: &'a [f64],
}

impl Serialize for NonzeroCells<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let filled = self.columns.iter().zip(self.cells).filter(|(_, count)| **count != 0.0);
        serializer.collect_map(filled.map(|(column, &count)| (column, Count(count))))
    }
}

impl Serialize for CountTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (row, cells) in self.rows.iter().zip(&self.cells) {
            if cells.iter().any(|count| *count != 0.0) {
                map.serialize_entry(row, &NonzeroCells { columns: &self.columns, cells })?;
            }
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    fn small() -> CountTable {
        let mut counts = CountTable::new("t", &names(&["a", "b"]), &names(&["x", "y"]));
        counts.add(0, 0, 3.0);
        counts.add(0, 1, 1.0);
        counts
    }

    #[test]
    fn smoothing_adds_alpha_to_every_cell_and_leaves_an_empty_row_alone() {
        assert_eq!(small().smoothed(0, 0.5), Some(vec![0.7, 0.3]));
        assert_eq!(small().smoothed(0, 0.0), Some(vec![0.75, 0.25]));
        assert_eq!(small().smoothed(1, 0.5), None);
        assert_eq!(smooth(&[0.0, 0.0], 0.0), [0.5, 0.5]);
    }

    #[test]
    fn every_estimate_has_its_count_and_interval_and_thin_rows_are_listed() {
        let estimates = small().estimates();
        assert_eq!(estimates.len(), 2);
        assert_eq!(
            (estimates[0].count, estimates[0].of, estimates[0].probability),
            (3.0, 4.0, 0.75)
        );
        assert_eq!(estimates[0].interval, Some(wilson(3.0, 4.0)));
        let thin = small().low_count_rows(4);
        assert_eq!((thin.len(), thin[0].row.as_str(), thin[0].count), (1, "b", 0.0));
        assert_eq!(small().low_count_rows(5).len(), 2);
    }

    #[test]
    fn rounded_rows_still_sum_to_one() {
        let row = rounded(&smooth(&[1.0, 1.0, 1.0, 4.0, 1e-7], 0.1));
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(rounded(&[1.0 / 3.0; 3])[0], 0.333_333_333);
    }

    #[test]
    fn json_names_the_filled_cells_with_whole_counts() {
        assert_eq!(serde_json::to_string(&small()).unwrap(), r#"{"a":{"x":3,"y":1}}"#);
        assert_eq!(serde_json::to_string(&CountMatrix(small())).unwrap(), "[[3,1],[0,0]]");
    }
}
