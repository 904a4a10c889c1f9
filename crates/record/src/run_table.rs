//! Tables of which cells may be missing: one row per run.
//!
//! [`write()`] creates one Parquet file, completely or not at all; [`read()`] reads it back after
//! comparing its checksums. Tables that do not fit are written by [`TableStream`] and read by
//! [`read_blocks()`]. Every column is optional in the file; its type is a 64-bit integer, a float, a
//! truth value or text.

use std::fs::File;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::column::writer::ColumnWriterImpl;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, RowGroupReader};
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnDescriptor, Type, TypePtr};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{Cells, ColumnType, ColumnValues, ColumnWithRole, RecordError};

use crate::disk;
use crate::file_list::HashedFile;
use crate::format::{self, FormatVersion};
use crate::part::error_cause;
use crate::read::{check_bytes, damaged, read_cells, read_texts, required_value};
use crate::schema::{self, CHECKSUMS, COLUMNS, FORMAT, VERSION};
use crate::sealed_json::FileDigest;

/// Number of rows in a row group: a row may have hundreds of metrics, all of which are in memory until it is written.
const GROUP_ROWS: usize = 1 << 16;

/// One column in the key-value pair [`COLUMNS`] of the file.
#[derive(Debug, Serialize, Deserialize)]
struct RoleColumnEntry {
    name: String,
    role: Value,
}

/// A table that was read back, in the order of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedTable<R> {
    /// Its columns, all of the same length; those with a role that this version does not know are
    /// left out.
    pub columns: Vec<ColumnWithRole<R>>,
    /// Version of the program that wrote it.
    pub program_version: String,
}

/// Writes the columns (all of the same length) to the file at `path`, and adds `extra` to its
/// key-value pairs.
///
/// # Errors
/// A column of a type that such files do not support; an I/O error. An earlier file stays then.
pub fn write<R: Serialize>(
    path: &Path,
    columns: &[&ColumnWithRole<R>],
    program_version: &str,
    extra: &[(&str, String)],
) -> Result<(), RecordError> {
    stream(path, columns, program_version, extra)?.finish()
}

/// Returns a table with the columns, which still has to be finished.
pub(crate) fn stream<R: Serialize>(
    path: &Path,
    columns: &[&ColumnWithRole<R>],
    program_version: &str,
    extra: &[(&str, String)],
) -> Result<TableStream, RecordError> {
    let mut table = TableStream::create(path, columns, program_version, extra)?;
    table.append(columns)?;
    Ok(table)
}

/// A table that is written block by block, and appears once it is whole; dropped before, it leaves nothing.
pub struct TableStream {
    path: PathBuf,
    partial: PathBuf,
    hash: SharedChecksum,
    checksums: Vec<u32>,
    /// `None` once the table is complete.
    writer: Option<SerializedFileWriter<HashingWriter>>,
    /// Of all bytes, once the table is complete.
    digest: Option<FileDigest>,
}

impl TableStream {
    /// Creates a table with columns of these names, roles and types.
    ///
    /// # Errors
    /// A column of a type that such files do not support; an I/O error.
    pub fn create<R: Serialize>(
        path: &Path,
        columns: &[&ColumnWithRole<R>],
        program_version: &str,
        extra: &[(&str, String)],
    ) -> Result<Self, RecordError> {
        let mut table = Self {
            path: path.into(),
            partial: disk::partial_path(path),
            hash: SharedChecksum::default(),
            checksums: Vec::new(),
            writer: None,
            digest: None,
        };
        let pairs = key_values(columns, program_version, extra);
        let writer = pairs.and_then(|pairs| table.start(columns, pairs));
        table.writer = Some(writer.map_err(|e| table.write_error(e))?);
        // The checksum of a group is that of its own bytes, without those before the first one.
        table.hash.take();
        Ok(table)
    }

    fn start<R>(
        &self,
        columns: &[&ColumnWithRole<R>],
        pairs: Vec<KeyValue>,
    ) -> ParquetResult<SerializedFileWriter<HashingWriter>> {
        let file = HashedFile::new(File::create(&self.partial)?);
        let sink = HashingWriter { file, hash: self.hash.clone() };
        let schema = parquet_schema(columns)?;
        let mut writer = SerializedFileWriter::new(sink, schema, Arc::new(properties(pairs)))?;
        writer.flush()?;
        Ok(writer)
    }

    /// Appends rows, in the columns with which it was created.
    ///
    /// # Errors
    /// Another number or type of columns; an I/O error.
    pub fn append<R>(&mut self, columns: &[&ColumnWithRole<R>]) -> Result<(), RecordError> {
        self.append_groups(columns).map_err(|e| self.write_error(e))
    }

    fn append_groups<R>(&mut self, columns: &[&ColumnWithRole<R>]) -> ParquetResult<()> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let rows = columns.first().map_or(0, |c| c.values.len());
        for start in (0..rows).step_by(GROUP_ROWS) {
            let mut group = writer.next_row_group()?;
            for column in columns {
                write_column(&mut group, column, start..rows.min(start + GROUP_ROWS))?;
            }
            group.close()?;
            writer.flush()?;
            self.checksums.push(self.hash.take());
        }
        Ok(())
    }

    /// Completes the table under its temporary name; [`finish`](Self::finish) then gives it its name. Returns the digest of
    /// its bytes, for a manifest that has to be there before the table is.
    ///
    /// # Errors
    /// An I/O error.
    pub fn close(&mut self) -> Result<FileDigest, RecordError> {
        if let Some(digest) = &self.digest {
            return Ok(digest.clone());
        }
        let Some(mut writer) = self.writer.take() else {
            return Err(RecordError::new(self.path.display(), "the table is over"));
        };
        let checksums = schema::checksums_to_text(&self.checksums);
        writer.append_key_value_metadata(KeyValue::new(CHECKSUMS.to_string(), checksums));
        let digest = writer.into_inner().and_then(|sink| Ok(sink.file.close()?));
        let digest = digest.map_err(|e| self.write_error(e))?;
        self.digest = Some(digest.clone());
        Ok(digest)
    }

    /// Completes the table, and gives it its name.
    ///
    /// # Errors
    /// An I/O error. An earlier file stays then.
    pub fn finish(mut self) -> Result<(), RecordError> {
        self.close()?;
        disk::rename(&self.partial, &self.path)
    }

    fn write_error(&self, error: ParquetError) -> RecordError {
        RecordError::new(self.path.display(), error_cause(error))
    }
}

impl Drop for TableStream {
    fn drop(&mut self) {
        // On a full disk a half-written file must not keep its space; one that was finished has its name.
        let _ = std::fs::remove_file(&self.partial);
    }
}

fn properties(pairs: Vec<KeyValue>) -> WriterProperties {
    WriterProperties::builder()
        .set_created_by(concat!("sidestep-record ", env!("CARGO_PKG_VERSION")).into())
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(pairs))
        .build()
}

fn key_values<R: Serialize>(
    columns: &[&ColumnWithRole<R>],
    program_version: &str,
    extra: &[(&str, String)],
) -> ParquetResult<Vec<KeyValue>> {
    let entries = entries_json(columns).map_err(|e| ParquetError::External(Box::new(e)))?;
    let mut pairs = vec![
        KeyValue::new(FORMAT.to_string(), format::CURRENT.to_string()),
        KeyValue::new(VERSION.to_string(), program_version.to_string()),
        KeyValue::new(COLUMNS.to_string(), entries),
    ];
    pairs.extend(extra.iter().map(|(key, value)| KeyValue::new(key.to_string(), value.clone())));
    Ok(pairs)
}

fn entries_json<R: Serialize>(columns: &[&ColumnWithRole<R>]) -> serde_json::Result<String> {
    let mut entries = Vec::with_capacity(columns.len());
    for column in columns {
        let role = serde_json::to_value(&column.role)?;
        entries.push(RoleColumnEntry { name: column.name.clone(), role });
    }
    serde_json::to_string(&entries)
}

fn parquet_schema<R>(columns: &[&ColumnWithRole<R>]) -> ParquetResult<TypePtr> {
    let fields = columns.iter().map(|column| field(column)).collect::<ParquetResult<_>>()?;
    Ok(Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?))
}

fn field<R>(column: &ColumnWithRole<R>) -> ParquetResult<TypePtr> {
    let (physical, logical) = match column.values.column_type() {
        ColumnType::I64 => (PhysicalType::INT64, None),
        ColumnType::F64 => (PhysicalType::DOUBLE, None),
        ColumnType::Bool => (PhysicalType::BOOLEAN, None),
        ColumnType::Text => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        other => return Err(wrong_type(&column.name, other)),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

fn wrong_type(column: &str, ty: ColumnType) -> ParquetError {
    let ty = ty.name();
    ParquetError::General(format!("column `{column}` is {ty}, not i64, f64, bool or text"))
}

fn write_column<R>(
    group: &mut SerializedRowGroupWriter<'_, HashingWriter>,
    ColumnWithRole { name, values, .. }: &ColumnWithRole<R>,
    rows: Range<usize>,
) -> ParquetResult<()> {
    let Some(mut column) = group.next_column()? else {
        return Err(ParquetError::General("a column more than the schema has".into()));
    };
    let levels: Vec<i16> = match values.valid() {
        None => vec![1; rows.len()],
        Some(valid) => valid[rows.clone()].iter().map(|valid| i16::from(*valid)).collect(),
    };
    match values {
        ColumnValues::I64(v) => {
            write_values::<Int64Type>(column.typed(), &levels, present(v, rows))
        }
        ColumnValues::F64(v) => {
            write_values::<DoubleType>(column.typed(), &levels, present(v, rows))
        }
        ColumnValues::Bool(v) => {
            write_values::<BoolType>(column.typed(), &levels, present(v, rows))
        }
        ColumnValues::Text(v) => {
            let texts = rows.filter_map(|row| v.get(row)).map(ByteArray::from).collect();
            write_values::<ByteArrayType>(column.typed(), &levels, texts)
        }
        other => Err(wrong_type(name, other.column_type())),
    }?;
    column.close()
}

/// Returns the values in `rows` that are not missing.
fn present<T: Copy>(cells: &Cells<T>, rows: Range<usize>) -> Vec<T> {
    rows.filter_map(|row| cells.get(row).copied()).collect()
}

fn write_values<T: DataType>(
    column: &mut ColumnWriterImpl<'_, T>,
    levels: &[i16],
    present: Vec<T::T>,
) -> ParquetResult<()> {
    column.write_batch(&present, Some(levels), None).map(drop)
}

/// A checksum that is shared with the writer that updates it.
#[derive(Debug, Clone, Default)]
struct SharedChecksum(Arc<Mutex<crc32fast::Hasher>>);

impl SharedChecksum {
    fn update(&self, bytes: &[u8]) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).update(bytes);
    }

    /// Returns the checksum of all bytes since the last call.
    fn take(&self) -> u32 {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).finalize()
    }
}

/// A file with bytes that are hashed while they are written.
struct HashingWriter {
    file: HashedFile,
    hash: SharedChecksum,
}

impl Write for HashingWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.hash.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Reads the table in the file at `path`.
///
/// # Errors
/// A file that is missing, damaged, not a table of this kind, or of another major format.
pub fn read<R: DeserializeOwned + Clone>(path: &Path) -> Result<LoadedTable<R>, InputError> {
    let mut whole: Option<LoadedTable<R>> = None;
    read_blocks(path, |block| match &mut whole {
        None => whole = Some(block),
        Some(table) => {
            for (column, more) in table.columns.iter_mut().zip(&block.columns) {
                column.values.append(&more.values);
            }
        }
    })?;
    whole.ok_or_else(|| damaged(path, "it has no columns".to_string()))
}

/// Reads the table in the file at `path` block by block; a table without rows has one block without rows.
///
/// # Errors
/// See [`read`]; blocks before a damaged one have been passed on.
pub fn read_blocks<R: DeserializeOwned + Clone>(
    path: &Path,
    mut each: impl FnMut(LoadedTable<R>),
) -> Result<(), InputError> {
    let reader = TableReader::open(path)?;
    if reader.file.num_row_groups() == 0 {
        each(reader.table(reader.empty.clone()));
    }
    for group in 0..reader.file.num_row_groups() {
        let values = reader.read_group(group).map_err(|e| damaged(path, error_cause(e)))?;
        each(reader.table(values));
    }
    Ok(())
}

/// An open table, of which one row group at a time is in memory.
struct TableReader<R> {
    bytes: File,
    file: SerializedFileReader<File>,
    program_version: String,
    checksums: Vec<u32>,
    names: Vec<String>,
    /// The role of each column; `None` for those that this version does not have, which are left out.
    roles: Vec<Option<R>>,
    /// A column without rows for each of the file.
    empty: Vec<ColumnValues>,
}

impl<R: DeserializeOwned + Clone> TableReader<R> {
    fn open(path: &Path) -> Result<Self, InputError> {
        let bytes = File::open(path).map_err(|e| cannot_open(path, &e))?;
        let copy = bytes.try_clone().map_err(|e| damaged(path, e.to_string()))?;
        let file = SerializedFileReader::new(copy).map_err(|e| damaged(path, error_cause(e)))?;
        let format = required_value(path, file.metadata(), FORMAT)?;
        let format: FormatVersion = format.parse().map_err(|e| wrong_value(path, e))?;
        format.check_readable(path.display())?;
        let program_version = required_value(path, file.metadata(), VERSION)?;
        let entries = required_value(path, file.metadata(), COLUMNS)?;
        let entries: Vec<RoleColumnEntry> =
            serde_json::from_str(&entries).map_err(|e| wrong_value(path, e))?;
        let checksums = required_value(path, file.metadata(), CHECKSUMS)?;
        let checksums =
            schema::checksums_from_text(&checksums).map_err(|e| wrong_value(path, e))?;
        let empty = empty_values(&file, &entries).map_err(|e| damaged(path, error_cause(e)))?;
        let roles =
            entries.iter().map(|entry| serde_json::from_value(entry.role.clone()).ok()).collect();
        let names = entries.into_iter().map(|entry| entry.name).collect();
        Ok(Self { bytes, file, program_version, checksums, names, roles, empty })
    }

    fn read_group(&self, group: usize) -> ParquetResult<Vec<ColumnValues>> {
        check_bytes(&self.bytes, self.file.metadata(), group, &self.checksums)?;
        let mut values = self.empty.clone();
        read_group(self.file.get_row_group(group)?.as_ref(), &mut values)?;
        Ok(values)
    }

    fn table(&self, values: Vec<ColumnValues>) -> LoadedTable<R> {
        let mut columns = Vec::new();
        for ((name, role), values) in self.names.iter().zip(&self.roles).zip(values) {
            if let Some(role) = role.clone() {
                columns.push(ColumnWithRole { name: name.clone(), role, values });
            }
        }
        LoadedTable { columns, program_version: self.program_version.clone() }
    }
}

fn wrong_value(path: &Path, error: impl std::fmt::Display) -> InputError {
    damaged(path, error.to_string())
}

/// Returns the values of key-value pairs of the table in the file at `path`, as far as it has them.
///
/// # Errors
/// A file that is missing, or no Parquet file.
pub(crate) fn read_key_values<const N: usize>(
    path: &Path,
    keys: [&str; N],
) -> Result<[Option<String>; N], InputError> {
    let bytes = File::open(path).map_err(|e| cannot_open(path, &e))?;
    let file = SerializedFileReader::new(bytes).map_err(|e| damaged(path, error_cause(e)))?;
    let pairs = file.metadata().file_metadata().key_value_metadata();
    Ok(keys.map(|key| pairs?.iter().find(|pair| pair.key == key)?.value.clone()))
}

fn cannot_open(path: &Path, e: &io::Error) -> InputError {
    InputError::new(path.display(), e.to_string(), "give a table that a sweep wrote")
}

/// Returns columns without rows, of the file's types.
fn empty_values(
    file: &SerializedFileReader<File>,
    entries: &[RoleColumnEntry],
) -> ParquetResult<Vec<ColumnValues>> {
    let stored = file.metadata().file_metadata().schema_descr();
    if stored.num_columns() != entries.len() {
        return Err(columns_differ());
    }
    let columns = entries.iter().zip(stored.columns());
    columns.map(|(entry, column)| empty_column(entry, column)).collect()
}

fn empty_column(entry: &RoleColumnEntry, column: &ColumnDescriptor) -> ParquetResult<ColumnValues> {
    if column.name() != entry.name || column.max_def_level() != 1 || column.max_rep_level() != 0 {
        return Err(columns_differ());
    }
    match column.physical_type() {
        PhysicalType::INT64 => Ok(ColumnValues::empty(ColumnType::I64)),
        PhysicalType::DOUBLE => Ok(ColumnValues::empty(ColumnType::F64)),
        PhysicalType::BOOLEAN => Ok(ColumnValues::empty(ColumnType::Bool)),
        PhysicalType::BYTE_ARRAY => Ok(ColumnValues::empty(ColumnType::Text)),
        _ => Err(columns_differ()),
    }
}

fn columns_differ() -> ParquetError {
    ParquetError::General(format!("its columns are not those of `{COLUMNS}`"))
}

fn read_group(group: &dyn RowGroupReader, columns: &mut [ColumnValues]) -> ParquetResult<()> {
    use parquet::column::reader::ColumnReader as Reader;
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    for (i, values) in columns.iter_mut().enumerate() {
        let read = match group.get_column_reader(i)? {
            Reader::Int64ColumnReader(r) => ColumnValues::I64(read_cells(r, true, Ok)?),
            Reader::DoubleColumnReader(r) => ColumnValues::F64(read_cells(r, true, Ok)?),
            Reader::BoolColumnReader(r) => ColumnValues::Bool(read_cells(r, true, Ok)?),
            Reader::ByteArrayColumnReader(r) => ColumnValues::Text(read_texts(r, true)?),
            _ => return Err(ParquetError::General(format!("column {i} has another type"))),
        };
        if read.len() != rows {
            return Err(ParquetError::General(format!("column {i} has not {rows} rows")));
        }
        values.append(&read);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn column(name: &str, values: ColumnValues) -> ColumnWithRole<String> {
        ColumnWithRole { name: name.into(), role: "metric".into(), values }
    }

    fn back(columns: &[ColumnWithRole<String>]) -> Vec<ColumnWithRole<String>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        write(
            &path,
            &columns.iter().collect::<Vec<_>>(),
            "0.1.0",
            &[("sidestep.plan", "{}".into())],
        )
        .unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        read(&path).unwrap().columns
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn a_table_survives_its_file(
            rows in proptest::collection::vec(
                (any::<Option<i64>>(), any::<Option<f64>>(), any::<Option<bool>>(), ".{0,5}"), 0..50,
            ),
        ) {
            let text = |s: &String| (!s.is_empty()).then(|| s.clone());
            let columns = [
                column("a.b", ColumnValues::I64(rows.iter().map(|r| r.0).collect())),
                column("b", ColumnValues::F64(
                    rows.iter().map(|r| r.1.filter(|x| !x.is_nan())).collect(),
                )),
                column("c", ColumnValues::Bool(rows.iter().map(|r| r.2).collect())),
                column("d", ColumnValues::Text(rows.iter().map(|r| text(&r.3)).collect())),
            ];
            prop_assert_eq!(back(&columns), columns);
        }
    }

    #[test]
    fn a_table_of_several_row_groups_survives_its_file() {
        let n = GROUP_ROWS + 5;
        let odd = |k: usize| (k % 2 == 1).then_some(k as i64);
        let columns = [column("k", ColumnValues::I64((0..n).map(odd).collect()))];
        assert_eq!(back(&columns), columns);
    }

    #[test]
    fn a_changed_byte_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        let columns = [column("k", ColumnValues::I64((0..1000).map(Some).collect()))];
        write(&path, &columns.iter().collect::<Vec<_>>(), "0.1.0", &[]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for place in [10, whole.len() / 3] {
            let mut changed = whole.clone();
            changed[place] ^= 4;
            std::fs::write(&path, &changed).unwrap();
            assert!(read::<String>(&path).is_err(), "byte {place}");
        }
        std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        assert!(read::<String>(&path).is_err());
    }
}
