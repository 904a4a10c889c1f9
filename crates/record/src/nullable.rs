//! Small tables whose cells may be missing, whole in memory: one row a run, typed columns.
//!
//! [`write()`] makes one Parquet file that is there in full or not at all; [`read()`] reads it back
//! after comparing its checksums. Columns of runs are few and rows are some millions at most, so
//! nothing here is streamed: a value takes its 9 to 16 bytes.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::column::reader::ColumnReaderImpl;
use parquet::column::writer::ColumnWriterImpl;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, RowGroupReader};
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::disk;
use crate::format::{self, FormatVersion};
use crate::part::cause;
use crate::read::{check_bytes, damaged, text};
use crate::schema::{self, CHECKSUMS, COLUMNS, FORMAT, VERSION};

/// Rows of a row group.
const GROUP_ROWS: usize = 1 << 16;

/// A column whose cells may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct NullableColumn {
    /// Name, with its unit where the quantity has one.
    pub name: String,
    /// What it is to the table, e.g. `parameter` or `metric`.
    pub role: String,
    /// One entry a row.
    pub values: NullableValues,
}

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum NullableValues {
    /// Whole numbers.
    Int(Vec<Option<i64>>),
    /// Double precision floats.
    Float(Vec<Option<f64>>),
    /// Truth values.
    Bool(Vec<Option<bool>>),
    /// Text.
    Text(Vec<Option<String>>),
}

impl NullableValues {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Int(v) => v.len(),
            Self::Float(v) => v.len(),
            Self::Bool(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }

    /// True without cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn physical_type(&self) -> PhysicalType {
        match self {
            Self::Int(_) => PhysicalType::INT64,
            Self::Float(_) => PhysicalType::DOUBLE,
            Self::Bool(_) => PhysicalType::BOOLEAN,
            Self::Text(_) => PhysicalType::BYTE_ARRAY,
        }
    }
}

/// A column in the file's key-value pair [`COLUMNS`].
#[derive(Debug, Serialize, Deserialize)]
struct ColumnEntry {
    name: String,
    role: String,
}

/// A table that was read back.
#[derive(Debug, Clone, PartialEq)]
pub struct NullableTable {
    /// Its columns, all of one length.
    pub columns: Vec<NullableColumn>,
    /// Version of the program that wrote it.
    pub program_version: String,
}

/// Writes the columns (all of one length) to the file at `path`, and what `extra` adds to its
/// key-value pairs.
///
/// # Errors
/// What the system says; a file that was there stays then.
pub fn write(
    path: &Path,
    columns: &[NullableColumn],
    program_version: &str,
    extra: &[(&str, String)],
) -> Result<(), RecordError> {
    let growing = disk::partial(path);
    let written = File::create(&growing)
        .map_err(ParquetError::from)
        .and_then(|file| write_file(file, columns, program_version, extra));
    written.map_err(|e| {
        // On a full disk the half-written file must not keep its space.
        let _ = std::fs::remove_file(&growing);
        RecordError::new(path.display(), cause(e))
    })?;
    disk::rename(&growing, path)
}

fn write_file(
    file: File,
    columns: &[NullableColumn],
    program_version: &str,
    extra: &[(&str, String)],
) -> ParquetResult<()> {
    let hash = Hash::default();
    let sink = Hashed { file, hash: hash.clone() };
    let properties = WriterProperties::builder()
        .set_created_by(concat!("sidestep-record ", env!("CARGO_PKG_VERSION")).into())
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_key_value_metadata(Some(key_values(columns, program_version, extra)))
        .build();
    let mut writer =
        SerializedFileWriter::new(sink, parquet_schema(columns)?, Arc::new(properties))?;
    writer.flush()?;
    hash.take();
    let rows = columns.first().map_or(0, |c| c.values.len());
    let mut checksums = Vec::new();
    for start in (0..rows).step_by(GROUP_ROWS) {
        let mut group = writer.next_row_group()?;
        for column in columns {
            write_column(&mut group, &column.values, start..rows.min(start + GROUP_ROWS))?;
        }
        group.close()?;
        writer.flush()?;
        checksums.push(hash.take());
    }
    let checksums = schema::checksums_to_text(&checksums);
    writer.append_key_value_metadata(KeyValue::new(CHECKSUMS.to_string(), checksums));
    writer.into_inner()?.file.sync_all()?;
    Ok(())
}

fn key_values(
    columns: &[NullableColumn],
    program_version: &str,
    extra: &[(&str, String)],
) -> Vec<KeyValue> {
    let entry = |c: &NullableColumn| ColumnEntry { name: c.name.clone(), role: c.role.clone() };
    let entries: Vec<_> = columns.iter().map(entry).collect();
    let entries = serde_json::to_string(&entries).expect("texts always become JSON");
    let pair = |key: &str, value: String| KeyValue::new(key.to_string(), value);
    let mut pairs = vec![
        pair(FORMAT, format::CURRENT.to_string()),
        pair(VERSION, program_version.to_string()),
        pair(COLUMNS, entries),
    ];
    pairs.extend(extra.iter().map(|(key, value)| pair(key, value.clone())));
    pairs
}

fn parquet_schema(columns: &[NullableColumn]) -> ParquetResult<TypePtr> {
    let field = |column: &NullableColumn| {
        let physical = column.values.physical_type();
        let logical = (physical == PhysicalType::BYTE_ARRAY).then_some(LogicalType::String);
        let field = Type::primitive_type_builder(&column.name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(field))
    };
    let fields = columns.iter().map(field).collect::<ParquetResult<_>>()?;
    Ok(Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?))
}

fn write_column(
    group: &mut SerializedRowGroupWriter<'_, Hashed>,
    values: &NullableValues,
    rows: std::ops::Range<usize>,
) -> ParquetResult<()> {
    let too_few = || ParquetError::General("a column more than the schema has".into());
    let mut column = group.next_column()?.ok_or_else(too_few)?;
    match values {
        NullableValues::Int(v) => write_values::<Int64Type, _>(column.typed(), &v[rows], |v| *v),
        NullableValues::Float(v) => write_values::<DoubleType, _>(column.typed(), &v[rows], |v| *v),
        NullableValues::Bool(v) => write_values::<BoolType, _>(column.typed(), &v[rows], |v| *v),
        NullableValues::Text(v) => {
            write_values::<ByteArrayType, _>(column.typed(), &v[rows], |v| {
                ByteArray::from(v.as_str())
            })
        }
    }?;
    column.close()
}

fn write_values<T: DataType, V>(
    column: &mut ColumnWriterImpl<'_, T>,
    values: &[Option<V>],
    convert: impl Fn(&V) -> T::T,
) -> ParquetResult<()> {
    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let present: Vec<T::T> = values.iter().flatten().map(convert).collect();
    column.write_batch(&present, Some(&levels), None).map(drop)
}

/// A checksum that is shared with what writes through it.
#[derive(Debug, Clone, Default)]
struct Hash(Arc<Mutex<crc32fast::Hasher>>);

impl Hash {
    fn update(&self, bytes: &[u8]) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).update(bytes);
    }

    /// The checksum of all bytes since the last call.
    fn take(&self) -> u32 {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).finalize()
    }
}

/// A file whose bytes are hashed as they are written.
#[derive(Debug)]
struct Hashed {
    file: File,
    hash: Hash,
}

impl Write for Hashed {
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
/// When it is missing, damaged, no table of this kind, or of another major format.
pub fn read(path: &Path) -> Result<NullableTable, InputError> {
    let bytes = File::open(path).map_err(|e| {
        InputError::new(path.display(), e.to_string(), "name a table that a sweep wrote")
    })?;
    let failed = |e| damaged(path, cause(e));
    let copy = bytes.try_clone().map_err(|e| failed(e.into()))?;
    let file = SerializedFileReader::new(copy).map_err(failed)?;
    let text = |key| text(path, file.metadata(), key);
    let wrong = |e: &dyn std::fmt::Display| damaged(path, e.to_string());
    let format: FormatVersion = text(FORMAT)?.parse().map_err(|e| wrong(&e))?;
    format.check_readable(path.display())?;
    let program_version = text(VERSION)?;
    let entries: Vec<ColumnEntry> = serde_json::from_str(&text(COLUMNS)?).map_err(|e| wrong(&e))?;
    let checksums = schema::checksums_from_text(&text(CHECKSUMS)?).map_err(|e| wrong(&e))?;
    let mut columns = empty_columns(&file, entries).map_err(failed)?;
    for group in 0..file.num_row_groups() {
        check_bytes(&bytes, file.metadata(), group, &checksums).map_err(failed)?;
        read_group(file.get_row_group(group).map_err(failed)?.as_ref(), &mut columns)
            .map_err(failed)?;
    }
    Ok(NullableTable { columns, program_version })
}

/// Columns without rows, of the file's types.
fn empty_columns(
    file: &SerializedFileReader<File>,
    entries: Vec<ColumnEntry>,
) -> ParquetResult<Vec<NullableColumn>> {
    let stored = file.metadata().file_metadata().schema_descr();
    let wrong = || ParquetError::General(format!("its columns are not those of `{COLUMNS}`"));
    if stored.num_columns() != entries.len() {
        return Err(wrong());
    }
    let column = |(i, ColumnEntry { name, role }): (usize, ColumnEntry)| {
        let column = stored.column(i);
        if column.name() != name || column.max_def_level() != 1 || column.max_rep_level() != 0 {
            return Err(wrong());
        }
        let values = match column.physical_type() {
            PhysicalType::INT64 => NullableValues::Int(Vec::new()),
            PhysicalType::DOUBLE => NullableValues::Float(Vec::new()),
            PhysicalType::BOOLEAN => NullableValues::Bool(Vec::new()),
            PhysicalType::BYTE_ARRAY => NullableValues::Text(Vec::new()),
            _ => return Err(wrong()),
        };
        Ok(NullableColumn { name, role, values })
    };
    entries.into_iter().enumerate().map(column).collect()
}

fn read_group(group: &dyn RowGroupReader, columns: &mut [NullableColumn]) -> ParquetResult<()> {
    use parquet::column::reader::ColumnReader as Reader;
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    for (i, column) in columns.iter_mut().enumerate() {
        match (group.get_column_reader(i)?, &mut column.values) {
            (Reader::Int64ColumnReader(r), NullableValues::Int(v)) => read_values(r, rows, v, Ok),
            (Reader::DoubleColumnReader(r), NullableValues::Float(v)) => {
                read_values(r, rows, v, Ok)
            }
            (Reader::BoolColumnReader(r), NullableValues::Bool(v)) => read_values(r, rows, v, Ok),
            (Reader::ByteArrayColumnReader(r), NullableValues::Text(v)) => {
                read_values(r, rows, v, |bytes| Ok(bytes.as_utf8()?.to_string()))
            }
            _ => Err(ParquetError::General(format!("column `{}` has another type", column.name))),
        }?;
    }
    Ok(())
}

/// Appends the cells of a column of a row group.
fn read_values<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    into: &mut Vec<Option<V>>,
    convert: impl Fn(T::T) -> ParquetResult<V>,
) -> ParquetResult<()> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let mut done = 0;
    while done < rows {
        levels.clear();
        values.clear();
        let (read, ..) = reader.read_records(rows - done, Some(&mut levels), None, &mut values)?;
        if read == 0 {
            return Err(ParquetError::General("a column has too few rows".into()));
        }
        let mut present = values.drain(..);
        for level in &levels {
            into.push(match level {
                0 => None,
                _ => present.next().map(&convert).transpose()?,
            });
        }
        done += read;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn column(name: &str, values: NullableValues) -> NullableColumn {
        NullableColumn { name: name.into(), role: "metric".into(), values }
    }

    fn back(columns: &[NullableColumn]) -> Vec<NullableColumn> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        write(&path, columns, "0.1.0", &[("sidestep.plan", "{}".into())]).unwrap();
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
                column("a.b", NullableValues::Int(rows.iter().map(|r| r.0).collect())),
                column("b", NullableValues::Float(
                    rows.iter().map(|r| r.1.filter(|x| !x.is_nan())).collect(),
                )),
                column("c", NullableValues::Bool(rows.iter().map(|r| r.2).collect())),
                column("d", NullableValues::Text(rows.iter().map(|r| text(&r.3)).collect())),
            ];
            prop_assert_eq!(back(&columns), columns);
        }
    }

    #[test]
    fn a_table_of_several_row_groups_survives_its_file() {
        let n = GROUP_ROWS + 5;
        let odd = |k: usize| (k % 2 == 1).then_some(k as i64);
        let columns = [column("k", NullableValues::Int((0..n).map(odd).collect()))];
        assert_eq!(back(&columns), columns);
    }

    #[test]
    fn a_changed_byte_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        let columns = [column("k", NullableValues::Int((0..1000).map(Some).collect()))];
        write(&path, &columns, "0.1.0", &[]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for place in [10, whole.len() / 3] {
            let mut changed = whole.clone();
            changed[place] ^= 4;
            std::fs::write(&path, &changed).unwrap();
            assert!(read(&path).is_err(), "byte {place}");
        }
        std::fs::write(&path, &whole[..whole.len() - 9]).unwrap();
        assert!(read(&path).is_err());
    }
}
