//! Comparison of all rows of a run that is computed again with the recorded ones.
//!
//! Rows are compared as sets, because a run that was stopped in between recorded them in other blocks. Of each segment
//! of cycles only the number of rows and the sum of their hashes is kept, so that tables may be larger than memory.

use crate::Error;
use crate::compare::bits;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnValues, RecordError, Recorder, TableSchema};
use sidestep_record::{for_each_block, tables};
use std::collections::BTreeMap;
use std::path::Path;

/// Cycles of a segment: a difference is told with its segment.
const SEGMENT_CYCLES: u64 = 100;

/// Number of rows of a segment, and the sum of their hashes.
type RowSums = BTreeMap<u64, (u64, u64)>;

/// The rows of a run so far, for comparison with a folder.
pub(crate) struct RowComparison {
    tables: Vec<(TableSchema, RowSums)>,
}

impl RowComparison {
    /// Returns a comparison of rows of these tables.
    pub(crate) fn new(schemas: Vec<TableSchema>) -> Self {
        Self { tables: schemas.into_iter().map(|schema| (schema, RowSums::new())).collect() }
    }

    /// Compares all rows with those that are recorded in a folder, and returns their number.
    ///
    /// # Errors
    /// When rows differ, or the folder is damaged.
    pub(crate) fn compare(&self, folder: &Path) -> Result<u64, Error> {
        let recorded = tables(folder)?;
        let mut rows = 0;
        for (schema, computed) in &self.tables {
            if !recorded.contains(&schema.name) {
                let cause = "the run records this table, and the folder has none";
                let remedy = "restore it, or run the scenario again";
                let place = folder.join(&schema.name);
                return Err(InputError::new(place.display(), cause, remedy).into());
            }
            let mut stored = RowSums::new();
            for_each_block::<InputError>(folder, &schema.name, .., |block| {
                add_rows(&block.schema, &block.columns, &mut stored);
                Ok(())
            })?;
            if let Some(segment) = first_difference(computed, &stored) {
                return Err(mismatch(folder, schema, segment));
            }
            rows += stored.values().map(|(count, _)| count).sum::<u64>();
        }
        Ok(rows)
    }
}

impl Recorder for RowComparison {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        let (schema, sums) =
            self.tables.get_mut(table).ok_or_else(|| RecordError::new(table, "no such table"))?;
        add_rows(schema, block, sums);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        Ok(())
    }
}

fn mismatch(folder: &Path, schema: &TableSchema, segment: u64) -> Error {
    let from = segment * SEGMENT_CYCLES;
    let until = from + SEGMENT_CYCLES - 1;
    let place = folder.join(&schema.name);
    let cause = if schema.columns.iter().any(|column| column.name == "cycle") {
        format!("the rows of cycles {from} to {until} differ from those of the run computed again")
    } else {
        "its rows differ from those of the run computed again".to_string()
    };
    let remedy = "the folder was changed, or this is a bug: please report it with the folder";
    Error::other(format!("{}: {cause}", place.display()), remedy)
}

/// Returns the first segment with other rows.
fn first_difference(a: &RowSums, b: &RowSums) -> Option<u64> {
    let differs = |segment: &&u64| a.get(segment) != b.get(segment);
    a.keys().chain(b.keys()).filter(differs).min().copied()
}

fn add_rows(schema: &TableSchema, columns: &[ColumnValues], sums: &mut RowSums) {
    let cycle = schema.columns.iter().position(|column| column.name == "cycle");
    let cycles = cycle.and_then(|index| columns.get(index));
    for row in 0..columns.first().map_or(0, ColumnValues::len) {
        let segment = cycles.map_or(0, |cycles| bits(cycles, row) / SEGMENT_CYCLES);
        let hash = columns.iter().fold(0, |hash, values| mix(hash, cell_hash(values, row)));
        let (count, sum) = sums.entry(segment).or_default();
        *count += 1;
        *sum = sum.wrapping_add(hash);
    }
}

fn cell_hash(values: &ColumnValues, row: usize) -> u64 {
    if values.is_missing(row) {
        return mix(1, 0);
    }
    match values {
        ColumnValues::Text(texts) => {
            let text = texts.get(row).unwrap_or_default();
            text.bytes().fold(2, |hash, byte| mix(hash, byte.into()))
        }
        _ => mix(3, bits(values, row)),
    }
}

/// Adds a word to a hash; the finalizer of SplitMix64.
fn mix(hash: u64, word: u64) -> u64 {
    let mut z = hash.rotate_left(23).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ word;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::{ColumnSpec, ColumnType};

    fn schema() -> TableSchema {
        let columns = [("cycle", ColumnType::U64), ("x_m", ColumnType::F64)];
        let columns = columns.map(|(name, ty)| ColumnSpec::new(name, ty, ""));
        TableSchema::new("trajectories", columns.to_vec())
    }

    fn sums(rows: &[(u64, f64)]) -> RowSums {
        let mut sums = RowSums::new();
        let cycles = rows.iter().map(|(cycle, _)| *cycle).collect();
        let x_m = rows.iter().map(|(_, x)| *x).collect();
        add_rows(&schema(), &[ColumnValues::U64(cycles), ColumnValues::F64(x_m)], &mut sums);
        sums
    }

    #[test]
    fn rows_are_equal_in_any_order_and_a_changed_or_missing_one_is_found() {
        let rows = [(0, 1.0), (1, 0.0), (250, 2.0)];
        let all = sums(&rows);
        assert_eq!(first_difference(&all, &sums(&[rows[2], rows[0], rows[1]])), None);
        assert_eq!(first_difference(&all, &sums(&[rows[0], (1, -0.0), rows[2]])), Some(0));
        assert_eq!(first_difference(&all, &sums(&rows[..2])), Some(2));
        assert_eq!(first_difference(&all, &sums(&[rows[0], rows[1], rows[2], rows[2]])), Some(2));
    }
}
