//! Pages assembled into a column chunk that the `parquet` crate can place in a file.

use std::io::Write;

use bytes::Bytes;
use parquet::basic::{Compression, Encoding};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::Result;
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::statistics::Statistics;
use parquet::file::writer::TrackedWrite;
use parquet::schema::types::ColumnDescPtr;

use super::page_header::{DATA_PAGE, DICTIONARY_PAGE, Field, page_header};

/// Appends a text as plain pages store it: its length, then its bytes.
pub(super) fn put_text(text: &str, page: &mut Vec<u8>) {
    page.extend_from_slice(&(text.len() as u32).to_le_bytes());
    page.extend_from_slice(text.as_bytes());
}

/// A chunk that is complete.
pub(crate) struct ClosedChunk {
    pub(crate) bytes: Bytes,
    /// CRC-32 of its bytes.
    pub(crate) checksum: crc32fast::Hasher,
    pub(crate) closed: ColumnCloseResult,
}

/// The encoded pages of one column in one row group.
pub(crate) struct ColumnChunk {
    descriptor: ColumnDescPtr,
    bytes: TrackedWrite<Vec<u8>>,
    /// CRC-32 of these bytes.
    checksum: crc32fast::Hasher,
    rows: u64,
    dictionary_bytes: usize,
    encodings: Vec<Encoding>,
}

impl ColumnChunk {
    pub(crate) fn new(descriptor: ColumnDescPtr) -> Self {
        let bytes = TrackedWrite::new(Vec::new());
        let checksum = crc32fast::Hasher::new();
        Self { descriptor, bytes, checksum, rows: 0, dictionary_bytes: 0, encodings: Vec::new() }
    }

    /// Returns the number of rows in the pages so far.
    pub(crate) fn rows(&self) -> u64 {
        self.rows
    }

    /// Adds the vocabulary; only once, before any data page.
    pub(crate) fn add_dictionary(&mut self, labels: &[String]) -> Result<()> {
        let mut page = Vec::new();
        labels.iter().for_each(|label| put_text(label, &mut page));
        let about = [
            Field::Number(1, labels.len() as i32),
            Field::Number(2, Encoding::PLAIN as i32),
            Field::Bool(3, false),
        ];
        let fields = [Field::Number(1, DICTIONARY_PAGE), Field::Struct(7, &about)];
        self.write(&page, Encoding::PLAIN, &fields)?;
        self.dictionary_bytes = self.bytes.bytes_written();
        Ok(())
    }

    /// Appends a page of `rows` values, those that are missing among them.
    pub(crate) fn add_page(&mut self, page: Vec<u8>, rows: u32, encoding: Encoding) -> Result<()> {
        self.rows += u64::from(rows);
        let about = [
            Field::Number(1, rows as i32),
            Field::Number(2, encoding as i32),
            // The encoding applies to nullable columns. Required ones have no levels, but readers
            // expect a name here too.
            Field::Number(3, Encoding::RLE as i32),
            Field::Number(4, Encoding::RLE as i32),
        ];
        let fields = [Field::Number(1, DATA_PAGE), Field::Struct(5, &about)];
        self.write(&page, encoding, &fields)
    }

    fn write(&mut self, page: &[u8], encoding: Encoding, fields: &[Field<'_>; 2]) -> Result<()> {
        if !self.encodings.contains(&encoding) {
            self.encodings.push(encoding);
        }
        let mut of_page = crc32fast::Hasher::new();
        of_page.update(page);
        let header = page_header(page, of_page.clone().finalize(), fields);
        self.checksum.update(&header);
        // Combined from both, no byte is hashed twice.
        self.checksum.combine(&of_page);
        self.bytes.write_all(&header)?;
        self.bytes.write_all(page)?;
        Ok(())
    }

    /// Returns the chunk's bytes, and the description that goes into the footer.
    pub(crate) fn close(self, statistics: Option<Statistics>) -> Result<ClosedChunk> {
        let size = self.bytes.bytes_written() as i64;
        let dictionary = (self.dictionary_bytes > 0).then_some(0);
        let mut metadata = ColumnChunkMetaData::builder(self.descriptor)
            .set_encodings(self.encodings)
            .set_compression(Compression::UNCOMPRESSED)
            .set_num_values(self.rows as i64)
            .set_total_compressed_size(size)
            .set_total_uncompressed_size(size)
            .set_dictionary_page_offset(dictionary)
            .set_data_page_offset(self.dictionary_bytes as i64);
        if let Some(statistics) = statistics {
            metadata = metadata.set_statistics(statistics);
        }
        let closed = ColumnCloseResult {
            bytes_written: size as u64,
            rows_written: self.rows,
            metadata: metadata.build()?,
            bloom_filter: None,
            column_index: None,
            offset_index: None,
        };
        Ok(ClosedChunk { bytes: self.bytes.into_inner()?.into(), checksum: self.checksum, closed })
    }
}
