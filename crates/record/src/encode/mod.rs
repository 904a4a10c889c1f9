//! Column encoders for a simulator's rows: many, long, and sorted or slowly changing.
//!
//! The `parquet` crate's own encoders take 30 to 40 ns for a row of five columns; these take 8 to
//! 12 and write the same standard pages. Only the two hot encodings are ours, and the headers of
//! pages, because those of the crate have no checksums; the crate writes files and footers, and
//! does all reading.

mod chunk;
mod column;
mod delta;
mod labels;
mod packing;
mod page_header;

pub(crate) use chunk::ColumnChunk;
pub(crate) use column::ColumnEncoder;

/// Rows in one data page: small enough to decode in cache, large enough that page headers cost
/// little.
const PAGE_ROWS: usize = 1 << 15;
