//! The rows of a row group, kept encoded until there are enough to be written.

use parquet::errors::Result;
use parquet::schema::types::{SchemaDescriptor, TypePtr};
use sidestep_kernel::ports::{ColumnValues, TableSchema};

use crate::encode::ColumnEncoder;

/// Number of rows in a row group. Only encoded rows wait in memory, at a few bytes each.
const ROWS: usize = 1 << 20;

/// The columns of the row group that is being filled.
pub(crate) struct RowGroup {
    columns: Vec<ColumnEncoder>,
    rows: usize,
}

impl RowGroup {
    /// Returns an empty group for the columns of `schema`, which Parquet knows as `stored`.
    pub(crate) fn new(schema: &TableSchema, stored: &TypePtr) -> Self {
        let descriptor = SchemaDescriptor::new(stored.clone());
        let columns = schema.columns.iter().zip(descriptor.columns());
        let columns = columns.map(|(spec, d)| ColumnEncoder::new(spec, d.clone())).collect();
        Self { columns, rows: 0 }
    }

    /// Takes as many rows of a block as fit, from `start` on, and returns the first row that is
    /// left.
    pub(crate) fn fill(&mut self, block: &[ColumnValues], start: usize) -> Result<usize> {
        let rows = block.first().map_or(0, ColumnValues::len);
        let end = rows.min(start + ROWS - self.rows);
        for (column, values) in self.columns.iter_mut().zip(block) {
            column.append(values, start..end)?;
        }
        self.rows += end - start;
        Ok(end)
    }

    /// Returns whether the group must be written before it can take more rows.
    pub(crate) fn is_full(&self) -> bool {
        self.rows == ROWS
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows == 0
    }

    /// Returns the columns to be written; afterwards the group has no rows.
    pub(crate) fn drain(&mut self) -> &mut [ColumnEncoder] {
        self.rows = 0;
        &mut self.columns
    }
}
