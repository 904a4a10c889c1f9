//! A table as one Parquet file, to be used in other programs.

use std::path::{Path, PathBuf};

use sidestep_kernel::ports::recorder::check_block;
use sidestep_kernel::ports::{ColumnValues, RecordError, TableSchema};

use crate::disk;
use crate::group::RowGroup;
use crate::part::{PartWriter, error_cause};
use crate::read::Table;
use crate::schema::{Provenance, check_schema, key_values, parquet_schema};
use crate::sealed_json::FileDigest;

/// The writer of a table to one file, with the same key-value pairs as a run's own parts. If it is
/// dropped before it is finished, it deletes the file.
pub struct TableFileWriter {
    path: PathBuf,
    schema: TableSchema,
    group: RowGroup,
    /// `None` once the file is finished.
    part: Option<PartWriter>,
}

impl TableFileWriter {
    /// Starts the file that is called `path` once it is complete.
    ///
    /// # Errors
    /// A schema that cannot become a file; an I/O error.
    pub fn create(
        path: &Path,
        schema: &TableSchema,
        origin: &Provenance,
    ) -> Result<Self, RecordError> {
        check_schema(schema)?;
        let stored =
            parquet_schema(schema).map_err(|e| RecordError::new(&schema.name, error_cause(e)))?;
        Ok(Self {
            group: RowGroup::new(schema, &stored),
            part: Some(PartWriter::create(path.to_path_buf(), stored, key_values(schema, origin))?),
            path: path.to_path_buf(),
            schema: schema.clone(),
        })
    }

    /// Appends rows: one [`ColumnValues`] per column, all of the same length.
    ///
    /// # Errors
    /// A block that does not match the schema; an I/O error.
    pub fn append(&mut self, block: &[ColumnValues]) -> Result<(), RecordError> {
        check_block(&self.schema, block)?;
        let rows = block.first().map_or(0, ColumnValues::len);
        let mut start = 0;
        while start < rows {
            let filled = self.group.fill(block, start);
            start = filled.map_err(|e| RecordError::new(self.path.display(), error_cause(e)))?;
            if self.group.is_full() {
                self.write_row_group()?;
            }
        }
        Ok(())
    }

    fn write_row_group(&mut self) -> Result<(), RecordError> {
        let group = self.group.drain();
        self.part.as_mut().map_or(Ok(()), |part| part.write_row_group(group))
    }

    /// Finishes the file: waits for the disk and gives it its name.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(self) -> Result<(), RecordError> {
        self.finish_before(None).map(drop)
    }

    /// Finishes the file as a part of a run's table, of which the next part starts at `next_cycle`.
    fn finish_before(mut self, next_cycle: Option<u64>) -> Result<FileDigest, RecordError> {
        if !self.group.is_empty() {
            self.write_row_group()?;
        }
        let part = self.part.take().expect("open until the file is finished");
        let ended = part.close(next_cycle);
        ended.inspect_err(|_| drop(std::fs::remove_file(disk::partial_path(&self.path))))
    }
}

/// Replaces a part of a run's table by the rows of `table`, all of which are of cycles before `next_cycle`. Returns the
/// digest of the new bytes.
///
/// # Errors
/// An I/O error; the part stays as it was.
pub(crate) fn write_part(
    path: &Path,
    table: &Table,
    next_cycle: u64,
) -> Result<FileDigest, RecordError> {
    let mut file = TableFileWriter::create(path, &table.schema, &table.origin)?;
    file.append(&table.columns)?;
    file.finish_before(Some(next_cycle))
}

impl Drop for TableFileWriter {
    fn drop(&mut self) {
        if self.part.take().is_some() {
            let _ = std::fs::remove_file(disk::partial_path(&self.path));
        }
    }
}
