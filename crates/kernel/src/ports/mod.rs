//! The kernel's interfaces to the outside, each with an in-memory version and a conformance suite
//! that every other version must pass too.

pub mod clock;
pub mod recorder;
pub mod table;
pub mod transport;

pub use clock::{Clock, ManualClock, SystemClock};
pub use recorder::{MemoryRecorder, RecordError, Recorder};
pub use table::{
    Cells, ColumnBlockBuffer, ColumnSpec, ColumnType, ColumnValues, ColumnWithRole, Table,
    TableBuffer, TableBuffers, TableRowsBuffer, TableSchema,
};
pub use transport::{Envelope, MemoryTransport, NetworkFaults, Transport};
