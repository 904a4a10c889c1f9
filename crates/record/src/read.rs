//! Reading tables back from disk.

use std::collections::BTreeMap;
use std::fs::File;
use std::ops::{Bound, RangeBounds};
use std::path::{Path, PathBuf};

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{ChunkReader, FileReader, Length};
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::file::statistics::Statistics;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::table::TextCells;
use sidestep_kernel::ports::{
    Cells, ColumnSpec, ColumnType, ColumnValues, RecordError, TableSchema,
};

use crate::disk;
use crate::format::FormatVersion;
use crate::part::{error_cause, parts};
use crate::schema::{self, Provenance};

/// The column by which rows are chosen.
const CYCLE: &str = "cycle";
/// Number of values decoded at a time, because a damaged file may claim any size: memory is never
/// allocated for its claim at once.
const BATCH: usize = 1 << 15;

/// A table read back, in the order in which its rows were recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name and columns, as declared.
    pub schema: TableSchema,
    /// The values, one entry for each column of the schema, all of one length.
    pub columns: Vec<ColumnValues>,
    /// Scenario, seed and version of the run.
    pub origin: Provenance,
    /// Whether the run has ended; otherwise the rows reach to its last checkpoint.
    pub complete: bool,
}

impl Table {
    /// Returns the number of rows, which all columns have.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, ColumnValues::len)
    }

    /// Returns the values of the column `name`; `None` if the table has no such column.
    pub fn column(&self, name: &str) -> Option<&ColumnValues> {
        Some(&self.columns[position(&self.schema, name)?])
    }
}

fn position(schema: &TableSchema, name: &str) -> Option<usize> {
    schema.columns.iter().position(|c| c.name == name)
}

/// Reads the rows of the table `name` in the run folder `folder` with a `cycle` in `cycles`; `..`
/// reads all rows, also of a table without cycles. Parts of the files without such a cycle are not
/// read.
///
/// # Errors
/// No such table, or nothing of it is complete; a damaged file; a format that this version cannot
/// read; a range of cycles for a table without the column `cycle`.
pub fn read_table(
    folder: &Path,
    name: &str,
    cycles: impl RangeBounds<u64>,
) -> Result<Table, InputError> {
    let cycles =
        CycleRange { from: cycles.start_bound().cloned(), to: cycles.end_bound().cloned() };
    let (paths, complete) = find_parts(folder, name)?;
    let mut table: Option<Table> = None;
    for path in &paths {
        let part = PartReader::open(path, name)?;
        let table = table.get_or_insert_with(|| part.empty_table(complete));
        if table.schema != part.schema {
            return Err(damaged(path, "its columns differ from those of the part before it"));
        }
        part.read_into(&mut table.columns, cycles)?;
    }
    table.ok_or_else(|| no_complete_part(folder, name))
}

/// Reads a table like [`read_table`], but one block of rows at a time, in order: for tables that
/// are larger than memory. A table without such rows gives one block without rows.
///
/// # Errors
/// Those of [`read_table`], and the errors that `each` returns.
pub fn for_each_block<E: From<InputError>>(
    folder: &Path,
    name: &str,
    cycles: impl RangeBounds<u64>,
    mut each: impl FnMut(Table) -> Result<(), E>,
) -> Result<(), E> {
    let cycles =
        CycleRange { from: cycles.start_bound().cloned(), to: cycles.end_bound().cloned() };
    let (paths, complete) = find_parts(folder, name)?;
    let mut empty: Option<Table> = None;
    let mut has_rows = false;
    for path in &paths {
        let part = PartReader::open(path, name)?;
        let empty = &*empty.get_or_insert_with(|| part.empty_table(complete));
        if empty.schema != part.schema {
            let cause = "its columns differ from those of the part before it";
            return Err(damaged(path, cause).into());
        }
        for group in 0..part.file.num_row_groups() {
            let mut block = empty.clone();
            part.read_group_into(group, &mut block.columns, cycles)?;
            if block.rows() > 0 {
                has_rows = true;
                each(block)?;
            }
        }
    }
    match empty {
        Some(empty) if !has_rows => each(empty),
        Some(_) => Ok(()),
        None => Err(no_complete_part(folder, name).into()),
    }
}

/// Returns the rows of one file of the table `name` with a cycle before `end`; all rows of a table without cycles.
///
/// # Errors
/// A damaged file.
pub(crate) fn read_part(path: &Path, name: &str, end: u64) -> Result<Table, InputError> {
    let part = PartReader::open(path, name)?;
    let mut table = part.empty_table(false);
    let to = match position(&part.schema, CYCLE) {
        Some(_) => Bound::Excluded(end),
        None => Bound::Unbounded,
    };
    part.read_into(&mut table.columns, CycleRange { from: Bound::Unbounded, to })?;
    Ok(table)
}

/// Returns the number of rows of a table that are complete, from the ends of its files: the rows are not read.
///
/// # Errors
/// Those of [`read_table`].
pub fn row_count(folder: &Path, name: &str) -> Result<u64, InputError> {
    let (paths, _) = find_parts(folder, name)?;
    let mut rows = 0;
    for path in &paths {
        let part = PartReader::open(path, name)?;
        rows += part.file.metadata().file_metadata().num_rows().max(0) as u64;
    }
    Ok(rows)
}

/// Returns the names of the tables in a run folder that have a complete part, sorted.
///
/// # Errors
/// When the folder cannot be read.
pub fn tables(folder: &Path) -> Result<Vec<String>, InputError> {
    let mut names = Vec::new();
    for path in disk::list(folder).map_err(|e| unreadable(folder, &e))? {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { continue };
        if path.is_dir() && parts(&path).is_ok_and(|parts| !parts.is_empty()) {
            names.push(name.strip_suffix(".partial").unwrap_or(name).to_string());
        }
    }
    names.sort();
    names.dedup();
    Ok(names)
}

fn no_complete_part(folder: &Path, name: &str) -> InputError {
    let remedy = "resume the run, or wait for its first checkpoint";
    InputError::new(folder.join(name).display(), "no part of the table is whole yet", remedy)
}

/// Returns the complete parts of a table, and whether these are all.
fn find_parts(folder: &Path, name: &str) -> Result<(Vec<PathBuf>, bool), InputError> {
    let table = folder.join(name);
    let partial = disk::partial_path(&table);
    let complete = table.is_dir();
    if !complete && !partial.is_dir() {
        let remedy = "give a run folder and one of the tables in it";
        return Err(InputError::new(table.display(), "there is no such table", remedy));
    }
    let found = parts(if complete { &table } else { &partial })
        .map_err(|e| InputError::new(e.place, e.cause, "make the folder readable"))?;
    Ok((found, complete))
}

pub(crate) fn unreadable(folder: &Path, error: &RecordError) -> InputError {
    InputError::new(folder.display(), error.cause.clone(), "make the folder readable")
}

pub(crate) fn damaged(path: &Path, cause: impl Into<String>) -> InputError {
    let remedy = "the file is damaged: copy it again from its source, or run the scenario again";
    InputError::new(path.display(), cause, remedy)
}

/// The requested range of cycles; all rows if it has no bounds, also those of tables without cycles.
#[derive(Debug, Clone, Copy)]
struct CycleRange {
    from: Bound<u64>,
    to: Bound<u64>,
}

impl CycleRange {
    fn is_all(self) -> bool {
        (self.from, self.to) == (Bound::Unbounded, Bound::Unbounded)
    }

    fn contains(self, cycle: u64) -> bool {
        (self.from, self.to).contains(&cycle)
    }

    /// Returns whether a cycle from `least` to `most` is in the range.
    fn overlaps(self, least: u64, most: u64) -> bool {
        let starts_in_time = match self.from {
            Bound::Included(from) => most >= from,
            Bound::Excluded(from) => most > from,
            Bound::Unbounded => true,
        };
        let ends_late_enough = match self.to {
            Bound::Included(to) => least <= to,
            Bound::Excluded(to) => least < to,
            Bound::Unbounded => true,
        };
        starts_in_time && ends_late_enough
    }
}

/// One open file, of which one row group at a time is in memory.
struct PartReader<'a> {
    path: &'a Path,
    bytes: File,
    file: SerializedFileReader<File>,
    checksums: Vec<u32>,
    schema: TableSchema,
    origin: Provenance,
}

impl<'a> PartReader<'a> {
    fn open(path: &'a Path, name: &str) -> Result<Self, InputError> {
        let bytes = File::open(path).map_err(|e| decode_error(path, e))?;
        let file = bytes.try_clone().map_err(|e| decode_error(path, e))?;
        let file = SerializedFileReader::new(file).map_err(|e| damaged(path, error_cause(e)))?;
        // The format first: a file of another major version may have other keys.
        let format = required_value(path, file.metadata(), schema::FORMAT)?;
        let format: FormatVersion = format.parse().map_err(|e| decode_error(path, e))?;
        format.check_readable(path.display())?;
        let columns = required_value(path, file.metadata(), schema::COLUMNS)?;
        let columns = schema::columns_from_json(&columns).map_err(|e| decode_error(path, e))?;
        let seed = required_value(path, file.metadata(), schema::SEED)?;
        let origin = Provenance {
            program_version: required_value(path, file.metadata(), schema::VERSION)?,
            scenario: required_value(path, file.metadata(), schema::SCENARIO)?,
            seed: seed.parse().map_err(|e| decode_error(path, e))?,
        };
        let checksums = required_value(path, file.metadata(), schema::CHECKSUMS)?;
        let checksums =
            schema::checksums_from_text(&checksums).map_err(|e| decode_error(path, e))?;
        let about = match schema::key_value(file.metadata(), schema::ABOUT) {
            Some(json) => schema::about_from_json(json).map_err(|e| decode_error(path, e))?,
            // Files of earlier versions have none.
            None => Vec::new(),
        };
        let schema = TableSchema { about, ..TableSchema::new(name, columns) };
        let part = Self { path, bytes, file, checksums, schema, origin };
        part.check_types()?;
        Ok(part)
    }

    /// Checks that the columns have the types that the key-value pairs declare.
    fn check_types(&self) -> Result<(), InputError> {
        let stored = self.file.metadata().file_metadata().schema_descr();
        let columns = &self.schema.columns;
        let all_fit = stored.num_columns() == columns.len()
            && columns.iter().zip(stored.columns()).all(|(spec, column)| {
                column.name() == spec.name
                    && column.physical_type() == schema::physical_type(spec.ty)
                    && column.max_def_level() == i16::from(spec.is_nullable)
                    && column.max_rep_level() == 0
            });
        if all_fit {
            return Ok(());
        }
        Err(damaged(self.path, format!("its columns are not those of `{}`", schema::COLUMNS)))
    }

    fn empty_table(&self, complete: bool) -> Table {
        let columns = self.schema.columns.iter().map(|c| ColumnValues::empty(c.ty)).collect();
        Table { schema: self.schema.clone(), columns, origin: self.origin.clone(), complete }
    }

    fn read_into(
        &self,
        columns: &mut [ColumnValues],
        cycles: CycleRange,
    ) -> Result<(), InputError> {
        (0..self.file.num_row_groups())
            .try_for_each(|group| self.read_group_into(group, columns, cycles))
    }

    /// Appends the requested rows of a row group.
    fn read_group_into(
        &self,
        group: usize,
        columns: &mut [ColumnValues],
        cycles: CycleRange,
    ) -> Result<(), InputError> {
        let cycle_column = position(&self.schema, CYCLE);
        if cycle_column.is_none() && !cycles.is_all() {
            let cause = format!("table `{}` has no column `{CYCLE}`", self.schema.name);
            return Err(InputError::new(self.path.display(), cause, "read the whole table"));
        }
        let bounds = cycle_column.and_then(|c| bounds(self.file.metadata().row_group(group), c));
        if bounds.is_none_or(|(least, most)| cycles.overlaps(least, most)) {
            let rows = self.read_group(group).map_err(|e| damaged(self.path, error_cause(e)))?;
            append(columns, rows, cycle_column, cycles);
        }
        Ok(())
    }

    /// Returns all rows of one row group.
    fn read_group(&self, group: usize) -> ParquetResult<Vec<ColumnValues>> {
        check_bytes(&self.bytes, self.file.metadata(), group, &self.checksums)?;
        let group = self.file.get_row_group(group)?;
        let rows = group.metadata().num_rows();
        let mut columns = Vec::with_capacity(self.schema.columns.len());
        for (i, spec) in self.schema.columns.iter().enumerate() {
            let values = read_column(group.get_column_reader(i)?, spec)?;
            if i64::try_from(values.len()) != Ok(rows) {
                let cause = format!("column `{}` has not {rows} rows", spec.name);
                return Err(ParquetError::General(cause));
            }
            columns.push(values);
        }
        Ok(columns)
    }
}

/// Checks the rows of a part against their checksums.
///
/// # Errors
/// A damaged part.
pub(crate) fn check_part(path: &Path, table: &str) -> Result<(), InputError> {
    let part = PartReader::open(path, table)?;
    for group in 0..part.file.num_row_groups() {
        check_bytes(&part.bytes, part.file.metadata(), group, &part.checksums)
            .map_err(|e| damaged(path, error_cause(e)))?;
    }
    Ok(())
}

fn decode_error(path: &Path, cause: impl std::fmt::Display) -> InputError {
    damaged(path, cause.to_string())
}

/// Returns the value of the key `key` of a file.
pub(crate) fn required_value(
    path: &Path,
    metadata: &ParquetMetaData,
    key: &str,
) -> Result<String, InputError> {
    schema::key_value(metadata, key).map(str::to_string).ok_or_else(|| {
        let remedy = "give a file that a recording wrote";
        InputError::new(path.display(), format!("the file has no key `{key}`"), remedy)
    })
}

/// Compares a row group's bytes with their checksum, because decoders may panic on damaged pages or
/// return other rows.
pub(crate) fn check_bytes(
    bytes: &File,
    metadata: &ParquetMetaData,
    group: usize,
    checksums: &[u32],
) -> ParquetResult<()> {
    let Some((start, length)) = extent(metadata.row_group(group)) else {
        return Err(group_error(group, "has no place in the file"));
    };
    // Checked before that much memory is allocated.
    if start + length > Length::len(bytes) {
        return Err(group_error(group, "reaches beyond the end of the file"));
    }
    let bytes = bytes.get_bytes(start, length as usize)?;
    if checksums.get(group) != Some(&crc32fast::hash(&bytes)) {
        return Err(group_error(group, "does not match its checksum"));
    }
    Ok(())
}

fn group_error(group: usize, cause: &str) -> ParquetError {
    ParquetError::General(format!("row group {group} {cause}"))
}

/// Returns the start of a column's bytes: the dictionary comes first, if there is one.
fn chunk_start(column: &ColumnChunkMetaData) -> Option<u64> {
    u64::try_from(column.dictionary_page_offset().unwrap_or(column.data_page_offset())).ok()
}

/// Returns start and length of a row group's bytes; `None` unless its columns are contiguous, as
/// they were written.
fn extent(group: &RowGroupMetaData) -> Option<(u64, u64)> {
    let start = chunk_start(group.columns().first()?)?;
    let mut end = start;
    for column in group.columns() {
        if chunk_start(column)? != end {
            return None;
        }
        end = end.checked_add(column.compressed_size().try_into().ok()?)?;
    }
    Some((start, end - start))
}

/// Returns the smallest and largest cycle of a row group, if they are stored.
fn bounds(group: &RowGroupMetaData, column: usize) -> Option<(u64, u64)> {
    match group.column(column).statistics()? {
        Statistics::Int64(s) => Some((*s.min_opt()? as u64, *s.max_opt()? as u64)),
        _ => None,
    }
}

/// Appends the rows with a cycle in the range; without a column of cycles all of them.
fn append(
    columns: &mut [ColumnValues],
    rows: Vec<ColumnValues>,
    cycle: Option<usize>,
    cycles: CycleRange,
) {
    let keep: Option<Vec<bool>> = match cycle.map(|c| &rows[c]) {
        _ if cycles.is_all() => None,
        Some(ColumnValues::U64(v)) => Some(v.iter().map(|&c| cycles.contains(c)).collect()),
        Some(ColumnValues::U32(v)) => Some(v.iter().map(|&c| cycles.contains(c.into())).collect()),
        _ => None,
    };
    for (column, mut values) in columns.iter_mut().zip(rows) {
        if let Some(keep) = &keep {
            values.retain_rows(keep);
        }
        column.append(&values);
    }
}

fn read_column(reader: ColumnReader, spec: &ColumnSpec) -> ParquetResult<ColumnValues> {
    use ColumnReader::{
        BoolColumnReader, ByteArrayColumnReader, DoubleColumnReader, Int32ColumnReader,
        Int64ColumnReader,
    };
    let nullable = spec.is_nullable;
    Ok(match (reader, spec.ty) {
        (Int32ColumnReader(r), ColumnType::U32) => {
            ColumnValues::U32(read_cells(r, nullable, |v| Ok(v as u32))?)
        }
        (Int32ColumnReader(r), ColumnType::I32) => ColumnValues::I32(read_cells(r, nullable, Ok)?),
        (Int64ColumnReader(r), ColumnType::U64) => {
            ColumnValues::U64(read_cells(r, nullable, |v| Ok(v as u64))?)
        }
        (Int64ColumnReader(r), ColumnType::I64) => ColumnValues::I64(read_cells(r, nullable, Ok)?),
        (DoubleColumnReader(r), ColumnType::F64) => ColumnValues::F64(read_cells(r, nullable, Ok)?),
        (BoolColumnReader(r), ColumnType::Bool) => ColumnValues::Bool(read_cells(r, nullable, Ok)?),
        (ByteArrayColumnReader(r), ColumnType::Label) => {
            let mut index = LabelIndex::new(spec);
            ColumnValues::Label(read_cells(r, nullable, |label| index.index_of(&label))?)
        }
        (ByteArrayColumnReader(r), ColumnType::Text) => {
            ColumnValues::Text(read_texts(r, nullable)?)
        }
        _ => return Err(ParquetError::General(format!("column `{}` has another type", spec.name))),
    })
}

/// Reads a column of numbers, truth values or labels to its end.
pub(crate) fn read_cells<T: DataType, V: Clone + Default>(
    reader: ColumnReaderImpl<T>,
    is_nullable: bool,
    mut convert: impl FnMut(T::T) -> ParquetResult<V>,
) -> ParquetResult<Cells<V>> {
    if is_nullable {
        let mut cells = Cells::default();
        read_values(reader, true, |v| {
            cells.push(v.map(&mut convert).transpose()?);
            Ok(())
        })?;
        return Ok(cells);
    }
    let mut values = Vec::new();
    read_values(reader, false, |v| {
        if let Some(v) = v {
            values.push(convert(v)?);
        }
        Ok(())
    })?;
    Ok(values.into())
}

/// Reads a column of text to its end; apart from numbers, because texts are decoded into one buffer.
pub(crate) fn read_texts(
    reader: ColumnReaderImpl<ByteArrayType>,
    is_nullable: bool,
) -> ParquetResult<TextCells> {
    let mut texts = TextCells::default();
    read_values(reader, is_nullable, |bytes| {
        texts.push(bytes.as_ref().map(ByteArray::as_utf8).transpose()?);
        Ok(())
    })?;
    Ok(texts)
}

/// Hands over the values of a column, `None` for a missing one.
fn read_values<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    is_nullable: bool,
    mut each: impl FnMut(Option<T::T>) -> ParquetResult<()>,
) -> ParquetResult<()> {
    let mut levels = Vec::new();
    let mut batch = Vec::new();
    loop {
        levels.clear();
        let wanted = is_nullable.then_some(&mut levels);
        let (rows, ..) = reader.read_records(BATCH, wanted, None, &mut batch)?;
        if rows == 0 {
            return Ok(());
        }
        let mut present = batch.drain(..);
        if is_nullable {
            for level in &levels {
                each(if *level == 0 { None } else { present.next() })?;
            }
        } else {
            present.try_for_each(|value| each(Some(value)))?;
        }
    }
}

/// Finds a label's index; neighboring rows mostly have the same one.
struct LabelIndex<'a> {
    name: &'a str,
    indices: BTreeMap<&'a [u8], u32>,
    last: Option<(ByteArray, u32)>,
}

impl<'a> LabelIndex<'a> {
    fn new(spec: &'a ColumnSpec) -> Self {
        let labels = spec.labels.iter().map(|label| label.as_bytes());
        Self { name: &spec.name, indices: labels.zip(0..).collect(), last: None }
    }

    fn index_of(&mut self, label: &ByteArray) -> ParquetResult<u32> {
        if let Some((last, index)) = &self.last
            && last == label
        {
            return Ok(*index);
        }
        let index = self.indices.get(label.data()).copied().ok_or_else(|| {
            ParquetError::General(format!("column `{}` has a label without a name", self.name))
        })?;
        self.last = Some((label.clone(), index));
        Ok(index)
    }
}
