//! Tracks of the library `traffic`, and other tables with the same columns, as Parquet.

use super::columns::Layout;
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use crate::report::Treatment;
use bytes::Bytes;
use parquet::basic::{Compression, ConvertedType, LogicalType, TimeUnit};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType, FixedLenByteArray};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::reader::FileReader;
use parquet::file::serialized_reader::SerializedFileReader;
use parquet::schema::types::ColumnDescriptor;
use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_path;
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
        let remedy = "copy the file again from its source";
        InputError::new(&place, format!("cannot be read as Parquet: {cause}"), remedy)
    };
    // Its clones share one memory.
    let bytes = Bytes::from(bytes);
    if let Some(codec) = unknown_codec(bytes.clone()) {
        let cause = format!("is Parquet compressed with {codec}, which is not read");
        return Err(InputError::new(&place, cause, recompression(&place, &codec)));
    }
    // Its decoders may panic on damaged pages.
    let table = catch_unwind(AssertUnwindSafe(|| Table::read(bytes)))
        .map_err(|_| damaged("a page is damaged".to_string()))?
        .map_err(|error| damaged(error.to_string()))?;
    let layout = Layout::find(&place, &table.names)?;
    collector.describe_source(&layout, "Parquet");
    for (name, cells) in table.names.iter().zip(&table.columns) {
        if matches!(cells, Cells::Other) && !layout.unused.contains(name) {
            let rule = "columns of a type that is not read";
            collector.report.record(Treatment::NotUsed, rule, format!("`{name:.40}`"), "");
        }
    }
    for row in 0..table.row_count {
        collector.push(row + 1, &layout, &TableRow { table: &table, row });
    }
    Ok(())
}

/// Returns the name of a compression of a column that is not read here.
fn unknown_codec(bytes: Bytes) -> Option<String> {
    // Damage of the file is found, and told, where it is read.
    let file = catch_unwind(|| SerializedFileReader::new(bytes).ok()).ok().flatten()?;
    let groups = file.metadata().row_groups().iter();
    let mut codecs = groups.flat_map(|group| group.columns()).map(|column| column.compression());
    let unknown = codecs.find(|codec| {
        let is_read = matches!(
            codec,
            Compression::UNCOMPRESSED
                | Compression::SNAPPY
                | Compression::GZIP(_)
                | Compression::ZSTD(_)
        );
        !is_read
    })?;
    let name = unknown.to_string();
    Some(name.split('(').next().unwrap_or(&name).to_string())
}

/// Returns what to do with a file that is compressed with a codec that is not read.
fn recompression(place: &str, codec: &str) -> String {
    // No library for people's scripts reads this one.
    if codec == "LZO" {
        return "write it again with Zstandard, by the program that wrote it".to_string();
    }
    let path = shell_path(place);
    format!(
        "compress it with Zstandard: python3 -c 'import sys, pyarrow.parquet as p; \
         p.write_table(p.read_table(sys.argv[1]), \"zstd.parquet\", compression=\"zstd\")' {path}"
    )
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
    fn read(bytes: Bytes) -> ParquetResult<Self> {
        let file = SerializedFileReader::new(bytes)?;
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
        Type::FIXED_LEN_BYTE_ARRAY => match FixedNumber::of_column(column) {
            Some(_) => Cells::Numbers(Vec::new()),
            None => Cells::Other,
        },
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
        let decimal_factor = decimal_scale(column).map_or(1.0, decimal_factor);
        let whole = |value: i64| match units_per_s {
            // Whole seconds apart from the rest: nanoseconds of the present have more digits than a float.
            Some(units) => {
                value.div_euclid(units) as f64 + value.rem_euclid(units) as f64 / units as f64
            }
            None => value as f64 / decimal_factor,
        };
        match (&mut *self, reader) {
            (Self::Numbers(to), Reader::FixedLenByteArrayColumnReader(r)) => {
                let number = FixedNumber::of_column(column);
                let decode = |v: FixedLenByteArray| {
                    number.map_or(f64::NAN, |number| number.decode(v.data()))
                };
                read_values(r, is_nullable, to, decode)?;
            }
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

/// A number in a fixed number of bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum FixedNumber {
    /// A float of 16 bits.
    Half,
    /// A whole number of units of `10^-scale`, the first byte the greatest.
    Decimal { scale: i32 },
}

impl FixedNumber {
    fn of_column(column: &ColumnDescriptor) -> Option<Self> {
        if matches!(column.logical_type_ref(), Some(LogicalType::Float16)) {
            return Some(Self::Half);
        }
        decimal_scale(column).map(|scale| Self::Decimal { scale })
    }

    fn decode(self, bytes: &[u8]) -> f64 {
        match self {
            Self::Half => match bytes {
                [low, high] => half_to_f64(u16::from_le_bytes([*low, *high])),
                _ => f64::NAN,
            },
            Self::Decimal { scale } => {
                let is_negative = bytes.first().is_some_and(|byte| byte & 0x80 != 0);
                let start = if is_negative { -1_i128 } else { 0 };
                let whole = bytes.iter().fold(start, |whole, byte| whole << 8 | i128::from(*byte));
                if bytes.len() > 16 { f64::NAN } else { whole as f64 / decimal_factor(scale) }
            }
        }
    }
}

fn half_to_f64(bits: u16) -> f64 {
    /// The smallest step of this type: 2 to the power of -24.
    const STEP: f64 = 1.0 / 16_777_216.0;
    let sign = bits & 0x8000;
    let exponent = bits >> 10 & 0x1f;
    let fraction = bits & 0x3ff;
    let size = match exponent {
        0 => f64::from(fraction) * STEP,
        31 => f64::NAN,
        // The exponents of 32 bits begin 112 lower, and the fraction has 13 more digits.
        _ => {
            f64::from(f32::from_bits((u32::from(exponent) + 112) << 23 | u32::from(fraction) << 13))
        }
    };
    if sign == 0 { size } else { -size }
}

/// Returns the number of digits after the point of a column of decimals.
fn decimal_scale(column: &ColumnDescriptor) -> Option<i32> {
    match column.logical_type_ref() {
        Some(LogicalType::Decimal(decimal)) => Some(decimal.scale),
        _ if column.converted_type() == ConvertedType::DECIMAL => Some(column.type_scale()),
        _ => None,
    }
}

fn decimal_factor(scale: i32) -> f64 {
    /// Decimals have at most so many digits.
    const MAX_SCALE: i32 = 38;
    (0..scale.clamp(0, MAX_SCALE)).fold(1.0, |factor, _| factor * 10.0)
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
