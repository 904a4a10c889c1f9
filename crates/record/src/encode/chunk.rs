//! Pages assembled into a column chunk that the `parquet` crate can place in a file.

use bytes::Bytes;
use parquet::basic::{Compression, Encoding};
use parquet::column::page::{CompressedPage, Page, PageWriter};
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::Result;
use parquet::file::metadata::ColumnChunkMetaData;
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedPageWriter, TrackedWrite};
use parquet::schema::types::ColumnDescPtr;

/// Appends a text as plain pages store it: its length, then its bytes.
pub(super) fn put_text(text: &str, page: &mut Vec<u8>) {
    page.extend_from_slice(&(text.len() as u32).to_le_bytes());
    page.extend_from_slice(text.as_bytes());
}

/// The encoded pages of one column in one row group.
pub(crate) struct ColumnChunk {
    descriptor: ColumnDescPtr,
    bytes: TrackedWrite<Vec<u8>>,
    rows: u64,
    dictionary_bytes: usize,
    encodings: Vec<Encoding>,
}

impl ColumnChunk {
    pub(crate) fn new(descriptor: ColumnDescPtr) -> Self {
        let bytes = TrackedWrite::new(Vec::new());
        Self { descriptor, bytes, rows: 0, dictionary_bytes: 0, encodings: Vec::new() }
    }

    /// Returns the number of rows in the pages so far.
    pub(crate) fn rows(&self) -> u64 {
        self.rows
    }

    /// Adds the vocabulary; only once, before any data page.
    pub(crate) fn add_dictionary(&mut self, labels: &[String]) -> Result<()> {
        let mut page = Vec::new();
        labels.iter().for_each(|label| put_text(label, &mut page));
        self.write(Page::DictionaryPage {
            buf: page.into(),
            num_values: labels.len() as u32,
            encoding: Encoding::PLAIN,
            is_sorted: false,
        })?;
        self.dictionary_bytes = self.bytes.bytes_written();
        Ok(())
    }

    /// Appends a page of `rows` values, those that are missing among them.
    pub(crate) fn add_page(&mut self, page: Vec<u8>, rows: u32, encoding: Encoding) -> Result<()> {
        self.rows += u64::from(rows);
        self.write(Page::DataPage {
            buf: page.into(),
            num_values: rows,
            encoding,
            // The encoding applies to nullable columns. Required ones have no levels, but readers
            // expect a name here too.
            def_level_encoding: Encoding::RLE,
            rep_level_encoding: Encoding::RLE,
            statistics: None,
        })
    }

    fn write(&mut self, page: Page) -> Result<()> {
        if !self.encodings.contains(&page.encoding()) {
            self.encodings.push(page.encoding());
        }
        let size = page.buffer().len();
        let mut writer = SerializedPageWriter::new(&mut self.bytes);
        writer.write_page(CompressedPage::new(page, size))?;
        Ok(())
    }

    /// Returns the chunk's bytes and the description that goes into the footer.
    pub(crate) fn close(
        self,
        statistics: Option<Statistics>,
    ) -> Result<(Bytes, ColumnCloseResult)> {
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
        Ok((self.bytes.into_inner()?.into(), closed))
    }
}
