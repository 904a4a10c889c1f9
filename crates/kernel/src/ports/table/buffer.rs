//! Rows that wait to be recorded.

use super::declare::Table;
use super::schema::TableSchema;
use super::values::ColumnValues;
use crate::ports::recorder::{RecordError, Recorder};
use std::fmt;

/// The maximum number of rows of a table before they must be recorded: some 100 MB of the widest tables, and few
/// enough blocks for columns to be compressed well.
const MAX_ROWS: usize = 1 << 20;

/// The rows of one table that wait to be recorded.
pub trait TableBuffer {
    /// The table's schema; `None` for a table that is not recorded.
    fn schema(&self) -> Option<TableSchema>;

    /// Number of waiting rows.
    fn row_count(&self) -> usize;

    /// Returns whether rows must be recorded before more should be kept.
    fn is_full(&self) -> bool {
        self.row_count() >= MAX_ROWS
    }

    /// Moves all waiting rows out as one block. `None` for a table that is not recorded.
    fn take(&mut self) -> Option<Vec<ColumnValues>>;
}

/// The tables of a run; the recorded ones are numbered in their order.
pub trait TableBuffers {
    /// Returns all tables, also those that are not recorded.
    fn table_buffers(&self) -> Vec<&dyn TableBuffer>;

    /// Returns all tables, in the same order.
    fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer>;

    /// Returns whether rows must be recorded before more can be kept.
    fn is_full(&self) -> bool {
        self.table_buffers().iter().any(|buffer| buffer.is_full())
    }

    /// Returns the schemas of the recorded tables; the index is a table's number in a recorder.
    fn schemas(&self) -> Vec<TableSchema> {
        self.table_buffers().iter().filter_map(|buffer| buffer.schema()).collect()
    }

    /// Appends all rows to a recorder of these [`schemas`](Self::schemas), and forgets them.
    ///
    /// # Errors
    /// When rows cannot be stored.
    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        let blocks = self.table_buffers_mut().into_iter().filter_map(TableBuffer::take);
        blocks.enumerate().try_for_each(|(table, block)| recorder.append(table, &block))
    }
}

/// Rows that are kept one by one.
pub struct TableRowsBuffer<R> {
    table: Option<Table<R>>,
    rows: Vec<R>,
}

impl<R> TableRowsBuffer<R> {
    /// Keeps rows of `table` from now on; none without a table.
    pub fn set_table(&mut self, table: Option<Table<R>>) {
        self.table = table;
    }

    /// Returns whether rows are kept at all.
    pub fn is_enabled(&self) -> bool {
        self.table.is_some()
    }

    /// Keeps a row, if rows are kept at all.
    pub fn push(&mut self, row: R) {
        if self.is_enabled() {
            self.rows.push(row);
        }
    }
}

impl<R> Extend<R> for TableRowsBuffer<R> {
    fn extend<I: IntoIterator<Item = R>>(&mut self, rows: I) {
        if self.is_enabled() {
            self.rows.extend(rows);
        }
    }
}

impl<R> Default for TableRowsBuffer<R> {
    fn default() -> Self {
        Self { table: None, rows: Vec::new() }
    }
}

impl<R> fmt::Debug for TableRowsBuffer<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = self.rows.len();
        f.debug_struct("RowBuffer").field("table", &self.table).field("rows", &rows).finish()
    }
}

impl<R> TableBuffer for TableRowsBuffer<R> {
    fn schema(&self) -> Option<TableSchema> {
        self.table.as_ref().map(Table::schema)
    }

    fn row_count(&self) -> usize {
        self.rows.len()
    }

    fn take(&mut self) -> Option<Vec<ColumnValues>> {
        let rows = std::mem::take(&mut self.rows);
        self.table.as_ref().map(|table| table.block_from_rows(&rows))
    }
}

/// Whole columns, for tables that have too many rows to keep them one by one.
#[derive(Debug, Default)]
pub struct ColumnBlockBuffer {
    schema: Option<TableSchema>,
    block: Option<Vec<ColumnValues>>,
}

impl ColumnBlockBuffer {
    /// Keeps a block of `schema` from now on; none without a schema.
    pub fn set_schema(&mut self, schema: Option<TableSchema>) {
        self.schema = schema;
    }

    /// Returns whether a block is kept at all.
    pub fn is_enabled(&self) -> bool {
        self.schema.is_some()
    }

    /// Keeps the block that is recorded next, and replaces one that waits.
    pub fn set(&mut self, block: Vec<ColumnValues>) {
        self.block = Some(block);
    }
}

impl TableBuffer for ColumnBlockBuffer {
    fn schema(&self) -> Option<TableSchema> {
        self.schema.clone()
    }

    fn row_count(&self) -> usize {
        self.block.as_ref().and_then(|block| block.first()).map_or(0, ColumnValues::len)
    }

    fn take(&mut self) -> Option<Vec<ColumnValues>> {
        let schema = self.schema.as_ref()?;
        let empty = || schema.columns.iter().map(|column| ColumnValues::empty(column.ty)).collect();
        Some(self.block.take().unwrap_or_else(empty))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::MemoryRecorder;

    #[derive(Default)]
    struct Two {
        kept: TableRowsBuffer<u32>,
        unwanted: TableRowsBuffer<u32>,
        blocks: ColumnBlockBuffer,
    }

    impl TableBuffers for Two {
        fn table_buffers(&self) -> Vec<&dyn TableBuffer> {
            vec![&self.unwanted, &self.kept, &self.blocks]
        }

        fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer> {
            vec![&mut self.unwanted, &mut self.kept, &mut self.blocks]
        }
    }

    fn table(name: &str) -> Table<u32> {
        Table::new(name).u32("k", "its number", |k| *k)
    }

    #[test]
    fn rows_wait_until_they_are_recorded() {
        let mut tables = Two::default();
        tables.kept.set_table(Some(table("kept")));
        tables.blocks.set_schema(Some(table("blocks").schema()));
        assert_eq!((tables.kept.is_enabled(), tables.unwanted.is_enabled()), (true, false));
        tables.kept.extend([1, 2]);
        tables.unwanted.push(3);
        let mut recorder = MemoryRecorder::new(&tables.schemas());
        tables.record(&mut recorder).unwrap();
        tables.kept.push(4);
        tables.blocks.set(vec![ColumnValues::U32(vec![5].into())]);
        tables.record(&mut recorder).unwrap();
        assert_eq!(recorder.column("kept", "k"), Some(&ColumnValues::U32(vec![1, 2, 4].into())));
        assert_eq!(recorder.column("blocks", "k"), Some(&ColumnValues::U32(vec![5].into())));
        assert_eq!(recorder.column("unwanted", "k"), None);
    }

    #[test]
    fn a_table_with_many_rows_is_full() {
        let mut tables = Two::default();
        tables.kept.set_table(Some(table("kept")));
        tables.kept.extend(0..MAX_ROWS as u32 - 1);
        assert!(!tables.is_full());
        tables.kept.push(0);
        assert!(tables.is_full());
        tables.record(&mut MemoryRecorder::new(&tables.schemas())).unwrap();
        assert!(!tables.is_full());
    }
}
