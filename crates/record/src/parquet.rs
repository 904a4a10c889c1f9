//! Rows written to Parquet files: one folder of parts for each table.
//!
//! A table `trajectories` is the folder `trajectories/` of files `part-CYCLE.parquet`, which
//! pyarrow, polars and DuckDB read as one table. While the run continues, the folder is called
//! `trajectories.partial/`, and the part that is being written ends in `.parquet.partial`. Each
//! checkpoint [seals](sidestep_kernel::ports::Recorder::make_durable) the part; the name of the next one is
//! the cycle at which it starts. So a folder without `.partial` holds every row of the run, and
//! returning to a checkpoint at cycle C means deleting the parts that start at C or later.
//!
//! The rows of a flight in real time must be on disk within a second. A file for each second would be too many files, so
//! there a part [grows](ParquetRecorder::with_growing_parts): each seal replaces it by one with more rows, in one step,
//! until it has those of 60 seals.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use parquet::file::metadata::KeyValue;
use parquet::schema::types::TypePtr;
use sidestep_kernel::ports::recorder::check_block;
use sidestep_kernel::ports::{ColumnValues, RecordError, Recorder, TableSchema};

use crate::disk;
use crate::file_list::{SharedFileList, hash_file};
use crate::group::RowGroup;
use crate::part::{PartWriter, error_cause, first_cycle, next_cycle, part_name, parts};
use crate::read::check_part;
use crate::schema::{Provenance, check_schema, key_values, parquet_schema};

/// Number of seals by which a part grows: of half a second each, 120 files an hour and table remain, and a part is
/// written 60 times.
const MAX_SEALS: u32 = 60;

/// Number of rows with which a part does not grow any more: writing it again takes milliseconds.
const MAX_GROWING_ROWS: usize = 1 << 16;

/// The end of the causes of errors about tables that others have taken away: no room on the disk would help.
pub const DELETED_TABLE: &str = "was deleted or moved while the run wrote to it";

/// Writes every table to Parquet files; the [module](self) describes their names.
pub struct ParquetRecorder {
    tables: Vec<TableWriter>,
    /// The error that broke the recording; rows are missing since then.
    broken: Option<RecordError>,
}

impl ParquetRecorder {
    /// Starts new tables in `folder`, for a run that starts at cycle 0.
    ///
    /// # Errors
    /// A schema that cannot become a file; a table that exists already; an I/O error.
    pub fn create(
        folder: &Path,
        schemas: &[TableSchema],
        origin: &Provenance,
    ) -> Result<Self, RecordError> {
        for table in schemas.iter().map(|s| folder.join(&s.name)) {
            if table.exists() || disk::partial_path(&table).exists() {
                return Err(RecordError::new(table.display(), "the table is there already"));
            }
        }
        Self::resume(folder, schemas, origin, 0)
    }

    /// Continues the tables in `folder` at `cycle`: rows of that cycle and later ones are deleted,
    /// because the run is about to write them again. Cycle 0 starts from the beginning.
    ///
    /// `cycle` must be one at which the recorder was [sealed](Recorder::make_durable).
    ///
    /// # Errors
    /// A schema that cannot become a file; a cycle at which the recorder was not sealed; an I/O
    /// error.
    pub fn resume(
        folder: &Path,
        schemas: &[TableSchema],
        origin: &Provenance,
        cycle: u64,
    ) -> Result<Self, RecordError> {
        Self::resume_listed(folder, schemas, origin, cycle, &SharedFileList::default())
    }

    /// Continues the tables like [`Self::resume`]. Every part that is complete is in `files`, with its digest.
    pub(crate) fn resume_listed(
        folder: &Path,
        schemas: &[TableSchema],
        origin: &Provenance,
        cycle: u64,
        files: &SharedFileList,
    ) -> Result<Self, RecordError> {
        schemas.iter().try_for_each(check_schema)?;
        let tables = schemas.iter().map(|schema| {
            rewind(folder, &schema.name, cycle, files)?;
            TableWriter::open(folder, schema, origin, cycle, files.clone())
        });
        Ok(Self { tables: tables.collect::<Result<_, _>>()?, broken: None })
    }

    /// Lets parts grow from seal to seal, for a recorder that is sealed about twice a second.
    #[must_use]
    pub fn with_growing_parts(mut self) -> Self {
        self.tables.iter_mut().for_each(TableWriter::let_parts_grow);
        self
    }

    /// Does `work` unless rows are missing already, and remembers a failure.
    fn run_unless_failed(
        &mut self,
        work: impl FnOnce(&mut [TableWriter]) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        if let Some(RecordError { place, cause }) = &self.broken {
            return Err(RecordError::new(place, format!("recording stopped earlier: {cause}")));
        }
        let worked = work(&mut self.tables).map_err(|e| {
            // A file of a folder that is gone fails in many ways, none of which says so.
            let gone = self.tables.iter().find_map(|table| table.check_in_place().err());
            gone.unwrap_or(e)
        });
        worked.inspect_err(|e| self.broken = Some(RecordError::new(&e.place, &e.cause)))
    }
}

impl Recorder for ParquetRecorder {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        let schema = self.tables.get(table).map(|t| &t.schema);
        check_block(schema.ok_or_else(|| RecordError::new(table, "no such table"))?, block)?;
        self.run_unless_failed(|tables| tables[table].append(block))
    }

    fn make_durable(&mut self, next_cycle: u64) -> Result<(), RecordError> {
        self.run_unless_failed(|tables| tables.iter_mut().try_for_each(|t| t.seal(next_cycle)))
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.run_unless_failed(|tables| tables.iter_mut().try_for_each(TableWriter::finish))
    }
}

/// The writer of one table, from the first part to the last.
struct TableWriter {
    schema: TableSchema,
    parquet_schema: TypePtr,
    key_values: Vec<KeyValue>,
    /// The folder's name once the table is complete.
    folder: PathBuf,
    /// The first cycle of the open part, and of the next one if none is open.
    part_cycle: u64,
    part: Option<PartWriter>,
    group: RowGroup,
    growing: Option<GrowingPart>,
    finished: bool,
    files: SharedFileList,
}

/// The rows of a part that is written anew with each seal.
struct GrowingPart {
    columns: Vec<ColumnValues>,
    /// Whether there are rows since the last seal.
    has_unsealed: bool,
    seals: u32,
}

impl GrowingPart {
    fn rows(&self) -> usize {
        self.columns.first().map_or(0, ColumnValues::len)
    }
}

impl TableWriter {
    fn open(
        parent: &Path,
        schema: &TableSchema,
        origin: &Provenance,
        cycle: u64,
        files: SharedFileList,
    ) -> Result<Self, RecordError> {
        let parquet_schema =
            parquet_schema(schema).map_err(|e| RecordError::new(&schema.name, error_cause(e)))?;
        let folder = parent.join(&schema.name);
        Ok(Self {
            group: RowGroup::new(schema, &parquet_schema),
            schema: schema.clone(),
            parquet_schema,
            key_values: key_values(schema, origin),
            folder,
            part_cycle: cycle,
            part: None,
            growing: None,
            finished: false,
            files,
        })
    }

    fn let_parts_grow(&mut self) {
        let columns = self.schema.columns.iter().map(|c| ColumnValues::empty(c.ty)).collect();
        self.growing = Some(GrowingPart { columns, has_unsealed: false, seals: 0 });
    }

    fn append(&mut self, block: &[ColumnValues]) -> Result<(), RecordError> {
        if self.finished {
            return Err(RecordError::new(self.folder.display(), "the table is finished"));
        }
        let Some(growing) = &mut self.growing else { return self.encode(block) };
        for (column, values) in growing.columns.iter_mut().zip(block) {
            column.append(values);
        }
        growing.has_unsealed |= block.first().is_some_and(|values| !values.is_empty());
        Ok(())
    }

    fn encode(&mut self, block: &[ColumnValues]) -> Result<(), RecordError> {
        let rows = block[0].len();
        let mut start = 0;
        while start < rows {
            let filled = self.group.fill(block, start);
            start = filled.map_err(|e| RecordError::new(self.folder.display(), error_cause(e)))?;
            if self.group.is_full() {
                self.write_row_group()?;
            }
        }
        Ok(())
    }

    fn write_row_group(&mut self) -> Result<(), RecordError> {
        if self.part.is_none() {
            self.part = Some(self.new_part()?);
        }
        let part = self.part.as_mut().expect("opened above");
        part.write_row_group(self.group.drain())
    }

    fn new_part(&self) -> Result<PartWriter, RecordError> {
        let path = disk::partial_path(&self.folder).join(part_name(self.part_cycle));
        if path.exists() {
            let cause = "sealed at this cycle already; a recorder is sealed at rising cycles";
            return Err(RecordError::new(path.display(), cause));
        }
        PartWriter::create(path, self.parquet_schema.clone(), self.key_values.clone())
    }

    /// Finishes the open part, if it has rows; later rows start at `next_cycle`.
    fn seal(&mut self, next_cycle: u64) -> Result<(), RecordError> {
        self.check_in_place()?;
        if self.growing.is_some() {
            return self.seal_growing(next_cycle);
        }
        self.end_part(Some(next_cycle))?;
        self.part_cycle = next_cycle;
        Ok(())
    }

    /// Seals the growing part; if it has grown enough, another one starts at `next_cycle`.
    fn seal_growing(&mut self, next_cycle: u64) -> Result<(), RecordError> {
        self.write_growing(Some(next_cycle))?;
        let Some(growing) = &self.growing else { return Ok(()) };
        let has_grown = growing.seals >= MAX_SEALS || growing.rows() >= MAX_GROWING_ROWS;
        let is_empty = growing.rows() == 0;
        if has_grown {
            self.let_parts_grow();
        }
        if has_grown || is_empty {
            self.part_cycle = next_cycle;
        }
        Ok(())
    }

    /// Replaces the growing part by one with all of its rows, if there are any since the last time.
    fn write_growing(&mut self, next_cycle: Option<u64>) -> Result<(), RecordError> {
        // Taken out, so that its rows are encoded and not kept a second time.
        let Some(mut growing) = self.growing.take() else { return Ok(()) };
        if growing.has_unsealed {
            let path = disk::partial_path(&self.folder).join(part_name(self.part_cycle));
            let schema = self.parquet_schema.clone();
            self.part = Some(PartWriter::create(path, schema, self.key_values.clone())?);
            self.encode(&growing.columns)?;
            self.end_part(next_cycle)?;
            growing.has_unsealed = false;
            growing.seals += 1;
        }
        self.growing = Some(growing);
        Ok(())
    }

    fn end_part(&mut self, next_cycle: Option<u64>) -> Result<(), RecordError> {
        if !self.group.is_empty() {
            self.write_row_group()?;
        }
        match self.part.take() {
            Some(part) => self.close_part(part, next_cycle),
            None => Ok(()),
        }
    }

    fn close_part(&self, part: PartWriter, next_cycle: Option<u64>) -> Result<(), RecordError> {
        let digest = part.close(next_cycle)?;
        let name = listed_name(&self.schema.name, &part_name(self.part_cycle));
        self.files.lock().insert(name, digest);
        Ok(())
    }

    /// Checks that the folder of the table is there: one without rows would miss it only at the end of the run.
    fn check_in_place(&self) -> Result<(), RecordError> {
        let partial = disk::partial_path(&self.folder);
        if self.finished || partial.is_dir() {
            return Ok(());
        }
        let cause = format!("the folder of this table {DELETED_TABLE}");
        Err(RecordError::new(partial.display(), cause))
    }

    /// Checks that no part was deleted or moved: rows would be missing in a table that is called complete.
    fn check_parts(&self) -> Result<(), RecordError> {
        let partial = disk::partial_path(&self.folder);
        let of_table = listed_name(&self.schema.name, "");
        let files = self.files.lock();
        let mut parts = files.iter().filter_map(|(name, _)| name.strip_prefix(&of_table));
        match parts.find(|part| !partial.join(part).is_file()) {
            None => Ok(()),
            Some(part) => {
                let cause = format!("this part of the table {DELETED_TABLE}");
                Err(RecordError::new(partial.join(part).display(), cause))
            }
        }
    }

    /// Finishes the table and gives its folder the final name. Later calls do nothing.
    fn finish(&mut self) -> Result<(), RecordError> {
        if self.finished {
            return Ok(());
        }
        self.check_in_place()?;
        self.check_parts()?;
        self.write_growing(None)?;
        self.end_part(None)?;
        let partial = disk::partial_path(&self.folder);
        if parts(&partial)?.is_empty() {
            // A table without rows still needs a file for its columns.
            self.close_part(self.new_part()?, None)?;
        }
        disk::rename(&partial, &self.folder)?;
        self.finished = true;
        Ok(())
    }
}

/// Returns the path of a part in the list of the run's files.
pub(crate) fn listed_name(table: &str, part: &str) -> String {
    format!("{table}/{part}")
}

/// Returns the error of a run whose folder with the tables is gone.
fn tables_deleted(parent: &Path) -> RecordError {
    RecordError::new(parent.display(), format!("the folder of the tables {DELETED_TABLE}"))
}

/// Returns the folder of a table to its state when the recorder was sealed at `cycle`, and the list of files with it.
fn rewind(
    parent: &Path,
    table: &str,
    cycle: u64,
    files: &SharedFileList,
) -> Result<(), RecordError> {
    let folder = parent.join(table);
    let partial = disk::partial_path(&folder);
    if folder.exists() {
        // The run was stopped after this table was finished, but before the last one was.
        disk::rename(&folder, &partial)?;
    }
    // Not its parent: a folder of a run that was deleted meanwhile stays deleted.
    if let Err(error) = fs::create_dir(&partial) {
        match error.kind() {
            io::ErrorKind::AlreadyExists => {}
            // The folder was there when the run was created: it is no mistake in the path that was given.
            io::ErrorKind::NotFound => return Err(tables_deleted(parent)),
            _ => return Err(RecordError::new(partial.display(), error)),
        }
    }
    // This check must come before anything is deleted.
    let found = check_sealed(&partial, cycle).and_then(|()| disk::list(&partial));
    // Its folder may be gone since it was made, a moment ago.
    let found =
        found.map_err(|error| if partial.exists() { error } else { tables_deleted(parent) })?;
    for path in found {
        if is_stale(&path, cycle) {
            fs::remove_file(&path).map_err(|e| RecordError::new(path.display(), e))?;
        }
    }
    let mut kept = BTreeMap::new();
    for path in parts(&partial)? {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        kept.insert(listed_name(table, name), path);
    }
    let mut files = files.lock();
    let of_table = format!("{table}/");
    files.retain(|name| !name.starts_with(&of_table) || kept.contains_key(name));
    for (name, path) in kept {
        if !files.contains(&name) {
            // A kill came between the checkpoint after this part and the manifest.
            check_part(&path, table).map_err(|e| RecordError::new(e.place(), e.cause()))?;
            let digest = hash_file(&path).map_err(|e| RecordError::new(path.display(), e))?;
            files.insert(name, digest);
        }
    }
    Ok(())
}

/// Checks that the remaining rows end before the new ones start.
fn check_sealed(partial: &Path, cycle: u64) -> Result<(), RecordError> {
    let kept = parts(partial)?.into_iter().rfind(|path| !is_stale(path, cycle));
    let Some(last) = kept else { return Ok(()) };
    if next_cycle(&last)?.is_some_and(|next| next <= cycle) {
        return Ok(());
    }
    let cause = format!("the table was not sealed at cycle {cycle}: resume at its checkpoint");
    Err(RecordError::new(last.display(), cause))
}

/// Returns whether a file is a part that is incomplete or starts at `cycle` or later. Other files are not
/// ours.
fn is_stale(path: &Path, cycle: u64) -> bool {
    let Some(name) = path.file_name().and_then(|n| n.to_str()) else { return false };
    match name.strip_suffix(".partial") {
        Some(partial) => first_cycle(partial).is_some(),
        None => first_cycle(name).is_some_and(|first| first >= cycle),
    }
}
