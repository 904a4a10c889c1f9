//! Tracks of the library `traffic`, and other tables with the same columns, as Parquet.

use super::columns::Layout;
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use bytes::Bytes;
use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::schema::types::ColumnDescriptor;
use sidestep_kernel::InputError;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The first and the last bytes of a Parquet file.
const MAGIC: &[u8] = b"PAR1";

/// The greatest number of rows: a small file can say that it repeats one any number of times.
const MAX_ROWS: usize = 20_000_000;

/// Number of values decoded at a time, because a damaged file may claim any size.
const BATCH: usize = 1 << 15;

/// Returns whether the content of a file is Parquet.
pub(super) fn is_parquet(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Reads the rows of a file.
///
/// # Errors
/// When the file is damaged, too large, or lacks a column that a track cannot be without.
pub(super) fn collect(collector: &mut RowCollector, bytes: Vec<u8>) -> Result<(), InputError> {
    let place = collector.place().to_string();
    let damaged = |cause: String| {
        let remedy = "copy the file again from its source; it may be compressed with Snappy, Zstandard or gzip, or plain";
        InputError::new(&place, format!("cannot be read as Parquet: {cause}"), remedy)
    };
    // Its decoders may panic on damaged pages.
    let table = catch_unwind(AssertUnwindSafe(|| Table::read(bytes)))
        .map_err(|_| damaged("a page is damaged".to_string()))?
        .map_err(|error| damaged(error.to_string()))?;
    let layout = Layout::find(&place, &table.names)?;
    collector.describe_source(&layout, "Parquet");
    for row in 0..table.row_count {
        collector.push(row + 1, &layout, &TableRow { table: &table, row });
    }
    Ok(())
}

/// The values of a column, one for each row.
enum Cells {
    Numbers(Vec<Option<f64>>),
    Flags(Vec<Option<bool>>),
    Texts(Vec<Option<ByteArray>>),
    /// Lists, and other types that a track has no use for.
    Other,
}

struct Table {
    names: Vec<String>,
    columns: Vec<Cells>,
    row_count: usize,
}

impl Table {
    fn read(bytes: Vec<u8>) -> ParquetResult<Self> {
        let file = SerializedFileReader::new(Bytes::from(bytes))?;
        let schema = file.metadata().file_metadata().schema_descr_ptr();
        let mut table = Self { names: Vec::new(), columns: Vec::new(), row_count: 0 };
        for column in schema.columns() {
            table.names.push(column.path().string());
            table.columns.push(empty_cells(column));
        }
        for index in 0..file.num_row_groups() {
            let group = file.get_row_group(index)?;
            let rows = usize::try_from(group.metadata().num_rows())
                .map_err(|_| ParquetError::General("a group has fewer than 0 rows".into()))?;
            table.row_count = table.row_count.saturating_add(rows);
            if table.row_count > MAX_ROWS {
                let cause = format!("it has more than {MAX_ROWS} rows");
                return Err(ParquetError::General(cause));
            }
            for (k, cells) in table.columns.iter_mut().enumerate() {
                let column = schema.column(k);
                if !matches!(cells, Cells::Other) {
                    cells.read(group.get_column_reader(k)?, &column, table.row_count)?;
                }
            }
        }
        Ok(table)
    }
}

struct TableRow<'a> {
    table: &'a Table,
    row: usize,
}

impl RowValues for TableRow<'_> {
    fn value(&self, column: usize) -> Value<'_> {
        match &self.table.columns[column] {
            Cells::Numbers(values) => values[self.row].map_or(Value::Missing, Value::Number),
            Cells::Flags(values) => values[self.row].map_or(Value::Missing, Value::Flag),
            Cells::Texts(values) => {
                let text = values[self.row].as_ref().and_then(|bytes| bytes.as_utf8().ok());
                text.map_or(Value::Missing, Value::from_text)
            }
            Cells::Other => Value::Missing,
        }
    }
}

fn empty_cells(column: &ColumnDescriptor) -> Cells {
    use parquet::basic::Type;
    let is_nested = column.max_rep_level() > 0 || column.path().parts().len() > 1;
    match column.physical_type() {
        _ if is_nested => Cells::Other,
        Type::BOOLEAN => Cells::Flags(Vec::new()),
        Type::BYTE_ARRAY => Cells::Texts(Vec::new()),
        Type::FIXED_LEN_BYTE_ARRAY => Cells::Other,
        _ => Cells::Numbers(Vec::new()),
    }
}

impl Cells {
    /// Appends the values of a row group, after which the column has `row_count` rows.
    fn read(
        &mut self,
        reader: ColumnReader,
        column: &ColumnDescriptor,
        row_count: usize,
    ) -> ParquetResult<()> {
        use ColumnReader as Reader;
        let is_nullable = column.max_def_level() > 0;
        let units_per_s = units_per_s(column);
        let whole = |value: i64| match units_per_s {
            // Whole seconds apart from the rest: nanoseconds of the present have more digits than a float.
            Some(units) => {
                value.div_euclid(units) as f64 + value.rem_euclid(units) as f64 / units as f64
            }
            None => value as f64,
        };
        match (&mut *self, reader) {
            (Self::Numbers(to), Reader::Int32ColumnReader(r)) => {
                read_values(r, is_nullable, to, |v| whole(v.into()))?;
            }
            (Self::Numbers(to), Reader::Int64ColumnReader(r)) => {
                read_values(r, is_nullable, to, whole)?;
            }
            (Self::Numbers(to), Reader::Int96ColumnReader(r)) => {
                read_values(r, is_nullable, to, |v| v.to_nanos() as f64 / 1e9)?;
            }
            (Self::Numbers(to), Reader::FloatColumnReader(r)) => {
                read_values(r, is_nullable, to, f64::from)?;
            }
            (Self::Numbers(to), Reader::DoubleColumnReader(r)) => {
                read_values(r, is_nullable, to, |v| v)?;
            }
            (Self::Flags(to), Reader::BoolColumnReader(r)) => {
                read_values(r, is_nullable, to, |v| v)?;
            }
            (Self::Texts(to), Reader::ByteArrayColumnReader(r)) => {
                read_values(r, is_nullable, to, |v| v)?;
            }
            _ => return Err(ParquetError::General("a column has two types".into())),
        }
        if self.len() == row_count {
            return Ok(());
        }
        let cause = format!("column `{:.40}` has not {row_count} rows", column.name());
        Err(ParquetError::General(cause))
    }

    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Flags(values) => values.len(),
            Self::Texts(values) => values.len(),
            Self::Other => 0,
        }
    }
}

/// Returns the number of units in a second of a column of times.
fn units_per_s(column: &ColumnDescriptor) -> Option<i64> {
    match column.logical_type_ref() {
        Some(LogicalType::Timestamp(time)) => Some(match time.unit {
            TimeUnit::MILLIS => 1_000,
            TimeUnit::MICROS => 1_000_000,
            TimeUnit::NANOS => 1_000_000_000,
        }),
        _ => match column.converted_type() {
            ConvertedType::TIMESTAMP_MILLIS => Some(1_000),
            ConvertedType::TIMESTAMP_MICROS => Some(1_000_000),
            _ => None,
        },
    }
}

/// Appends the values of a column, `None` for a missing one.
fn read_values<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    is_nullable: bool,
    to: &mut Vec<Option<V>>,
    convert: impl Fn(T::T) -> V,
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
        if to.len() + rows > MAX_ROWS {
            return Err(ParquetError::General(format!("it has more than {MAX_ROWS} rows")));
        }
        let mut present = batch.drain(..);
        if is_nullable {
            let values = levels
                .iter()
                .map(|level| if *level == 0 { None } else { present.next().map(&convert) });
            to.extend(values);
        } else {
            to.extend(present.map(|value| Some(convert(value))));
        }
    }
}
