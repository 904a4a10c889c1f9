//! The encoder of one column: values in, pages out.

use std::ops::Range;

use parquet::basic::Encoding;
use parquet::errors::Result;
use parquet::file::statistics::Statistics;
use parquet::schema::types::ColumnDescPtr;
use sidestep_kernel::ports::{ColumnSpec, ColumnType, ColumnValues};

use super::chunk::{ClosedChunk, put_text};
use super::delta::DeltaEncoder;
use super::labels::LabelEncoder;
use super::{ColumnChunk, PAGE_ROWS};

/// Encodes a column's values, one row group after another.
pub(crate) struct ColumnEncoder {
    descriptor: ColumnDescPtr,
    labels: Vec<String>,
    encoder: Encoder,
    /// Whether each value of the page is present (1) or missing (0); only for a nullable column.
    levels: Option<LabelEncoder>,
    rows_in_page: usize,
    chunk: ColumnChunk,
}

/// The encoder of the values of a page; labels and integers compress, other types are stored as they are.
enum Encoder {
    U32(DeltaEncoder<u32>),
    I32(DeltaEncoder<i32>),
    U64(DeltaEncoder<u64>, Bounds),
    I64(DeltaEncoder<i64>),
    /// Little-endian doubles.
    F64(Vec<u8>),
    /// One bit per value.
    Bool(Vec<bool>),
    Label(LabelEncoder),
    /// Length and bytes of each text.
    Text(Vec<u8>),
}

/// The smallest and the largest counter of the row group. Only counters have bounds: rows are
/// nearly sorted by cycle, so bounds let a reader skip row groups. For other columns they would not
/// help, and would cost as much as the encoding itself.
#[derive(Default)]
struct Bounds(Option<(u64, u64)>);

impl Bounds {
    fn extend(&mut self, values: &[u64]) {
        let Some(&first) = values.first() else { return };
        let (mut least, mut most) = self.0.unwrap_or((first, first));
        for &v in values {
            least = least.min(v);
            most = most.max(v);
        }
        self.0 = Some((least, most));
    }

    /// Unsigned values are stored by their bits and compared by the column's logical type.
    fn take(&mut self) -> Option<Statistics> {
        let (least, most) = self.0.take()?;
        Some(Statistics::int64(Some(least as i64), Some(most as i64), None, Some(0), false))
    }
}

impl ColumnEncoder {
    /// Returns an encoder for the column `spec`, at the place `descriptor` in the file.
    pub(crate) fn new(spec: &ColumnSpec, descriptor: ColumnDescPtr) -> Self {
        let encoder = match spec.ty {
            ColumnType::U32 => Encoder::U32(DeltaEncoder::new()),
            ColumnType::I32 => Encoder::I32(DeltaEncoder::new()),
            ColumnType::U64 => Encoder::U64(DeltaEncoder::new(), Bounds::default()),
            ColumnType::I64 => Encoder::I64(DeltaEncoder::new()),
            ColumnType::F64 => Encoder::F64(Vec::new()),
            ColumnType::Bool => Encoder::Bool(Vec::new()),
            ColumnType::Label => Encoder::Label(LabelEncoder::new(spec.labels.len())),
            ColumnType::Text => Encoder::Text(Vec::new()),
        };
        let chunk = ColumnChunk::new(descriptor.clone());
        let levels = spec.is_nullable.then(|| LabelEncoder::new(2));
        Self { descriptor, labels: spec.labels.clone(), encoder, levels, rows_in_page: 0, chunk }
    }

    /// Appends the values at `range`, and ends pages that become full.
    pub(crate) fn append(&mut self, values: &ColumnValues, mut range: Range<usize>) -> Result<()> {
        while !range.is_empty() {
            let n = (PAGE_ROWS - self.rows_in_page).min(range.len());
            self.extend(values, range.start..range.start + n);
            self.rows_in_page += n;
            range.start += n;
            if self.rows_in_page == PAGE_ROWS {
                self.end_page()?;
            }
        }
        Ok(())
    }

    /// Appends values that fit into the page.
    fn extend(&mut self, values: &ColumnValues, range: Range<usize>) {
        let Some(levels) = &mut self.levels else { return self.encoder.extend(values, range) };
        // Most columns that may lack values lack none: these are encoded where they lie.
        let Some(valid) = values.valid() else {
            levels.extend(&vec![1; range.len()]);
            return self.encoder.extend(values, range);
        };
        let flags: Vec<u32> =
            valid[range.clone()].iter().map(|&is_valid| is_valid.into()).collect();
        levels.extend(&flags);
        let present: Vec<usize> = range.filter(|&row| valid[row]).collect();
        self.encoder.extend(&values.gather_rows(&present), 0..present.len());
    }

    fn end_page(&mut self) -> Result<()> {
        if matches!(self.encoder, Encoder::Label(_)) && self.chunk.rows() == 0 {
            self.chunk.add_dictionary(&self.labels)?;
        }
        let (mut page, encoding) = self.encoder.take_page();
        if let Some(levels) = &mut self.levels {
            // A page of labels starts with their width, a page of levels with its length.
            let levels = &levels.take_page()[1..];
            page = [&(levels.len() as u32).to_le_bytes(), levels, &page].concat();
        }
        self.chunk.add_page(page, self.rows_in_page as u32, encoding)?;
        self.rows_in_page = 0;
        Ok(())
    }

    /// Ends the row group's chunk and returns it; the next one starts empty.
    pub(crate) fn take_chunk(&mut self) -> Result<ClosedChunk> {
        if self.rows_in_page > 0 {
            self.end_page()?;
        }
        let empty = ColumnChunk::new(self.descriptor.clone());
        // Bounds declare that no value is missing, so nullable columns have none.
        let statistics = self.encoder.take_statistics().filter(|_| self.levels.is_none());
        std::mem::replace(&mut self.chunk, empty).close(statistics)
    }
}

impl Encoder {
    fn extend(&mut self, values: &ColumnValues, range: Range<usize>) {
        match (self, values) {
            (Self::U32(encoder), ColumnValues::U32(v)) => encoder.extend(&v[range]),
            (Self::I32(encoder), ColumnValues::I32(v)) => encoder.extend(&v[range]),
            (Self::U64(encoder, bounds), ColumnValues::U64(v)) => {
                bounds.extend(&v[range.clone()]);
                encoder.extend(&v[range]);
            }
            (Self::I64(encoder), ColumnValues::I64(v)) => encoder.extend(&v[range]),
            (Self::F64(page), ColumnValues::F64(v)) => put_doubles(&v[range], page),
            (Self::Bool(page), ColumnValues::Bool(v)) => page.extend_from_slice(&v[range]),
            (Self::Label(encoder), ColumnValues::Label(v)) => encoder.extend(&v[range]),
            (Self::Text(page), ColumnValues::Text(v)) => {
                range.filter_map(|row| v.get(row)).for_each(|text| put_text(text, page));
            }
            _ => unreachable!("`check_block` compared the types"),
        }
    }

    fn take_page(&mut self) -> (Vec<u8>, Encoding) {
        match self {
            Self::U32(encoder) => (encoder.take_page(), Encoding::DELTA_BINARY_PACKED),
            Self::I32(encoder) => (encoder.take_page(), Encoding::DELTA_BINARY_PACKED),
            Self::U64(encoder, _) => (encoder.take_page(), Encoding::DELTA_BINARY_PACKED),
            Self::I64(encoder) => (encoder.take_page(), Encoding::DELTA_BINARY_PACKED),
            Self::F64(page) | Self::Text(page) => (std::mem::take(page), Encoding::PLAIN),
            Self::Bool(page) => (pack_bools(&std::mem::take(page)), Encoding::PLAIN),
            Self::Label(encoder) => (encoder.take_page(), Encoding::RLE_DICTIONARY),
        }
    }

    fn take_statistics(&mut self) -> Option<Statistics> {
        match self {
            Self::U64(_, bounds) => bounds.take(),
            _ => None,
        }
    }
}

fn put_doubles(values: &[f64], page: &mut Vec<u8>) {
    let start = page.len();
    page.resize(start + size_of_val(values), 0);
    let (cells, _) = page[start..].as_chunks_mut::<8>();
    for (cell, v) in cells.iter_mut().zip(values) {
        *cell = v.to_le_bytes();
    }
}

/// Packs eight values per byte, the first in the lowest bit.
fn pack_bools(values: &[bool]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(values.len().div_ceil(8));
    for eight in values.chunks(8) {
        bytes.push((0..).zip(eight).fold(0, |byte, (bit, &value)| byte | u8::from(value) << bit));
    }
    bytes
}
