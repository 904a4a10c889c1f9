//! Tables: columns that are declared once, and their values in memory.
//!
//! ```text
//! schema.rs   ColumnSpec, TableSchema: name, type, unit and meaning of a column
//! unit.rs     the unit that a name ends in
//! cells.rs    Cells, Texts: values side by side, and which of them are missing
//! values.rs   ColumnValues: the cells of one column, of any type; RoleColumn: with a name and a role
//! declare.rs  Table: columns with their getters; rows -> a block of values
//! buffer.rs   rows that wait to be recorded
//! ```
//!
//! The values of a column lie as Arrow requires: one after the other, with a mask beside them
//! only where some are missing; text as offsets into one string.

mod buffer;
mod cells;
mod column_type;
mod declare;
mod schema;
mod unit;
mod values;

pub use buffer::{ColumnBlockBuffer, TableBuffer, TableBuffers, TableRowsBuffer};
pub use cells::{Cells, TextCells};
pub use column_type::ColumnType;
pub use declare::{Table, label_index};
pub use schema::{ColumnSpec, TableSchema};
pub use unit::split_unit;
pub use values::{ColumnValues, ColumnWithRole};
