//! The table `packets`: every packet that a node has sent.

use crate::protocol::PacketRecord;
use sidestep::VERSION;
use sidestep::kernel::EntityId;
use sidestep::kernel::ports::{RecordError, Recorder, Table};
use sidestep_record::{ParquetRecorder, Provenance};
use std::path::Path;

/// Rows that are stored at once.
const BLOCK_ROWS: usize = 1 << 16;

/// A row: the sender and its packet.
type PacketRow = (EntityId, PacketRecord);

/// A packet's table in a run folder. Until it is finished it is called `packets.partial`.
pub(super) struct PacketTable {
    recorder: ParquetRecorder,
    table: Table<PacketRow>,
    waiting: Vec<PacketRow>,
}

fn table() -> Table<PacketRow> {
    Table::new("packets")
        .u64("cycle", "cycle of the talk", |(_, packet): &PacketRow| packet.cycle)
        .u64("sent", "tick in which it was sent", |(_, packet)| packet.sent)
        .u32("sender", "id on the network of the agent that sent it", |(sender, _)| *sender)
        .u32("receiver", "id on the network of the agent to which it was sent", |(_, packet)| {
            packet.to
        })
        .u32(
            "sequence",
            "number among the sender's, in the talk or, in real time, in the cycle",
            |(_, packet)| packet.sequence,
        )
        .u32("bytes", "size in bytes", |(_, packet)| packet.bytes)
        .u32(
            "copies",
            "times that it arrived: 0 if it was lost, 2 if it was doubled",
            |(_, packet)| packet.copies,
        )
        .u64("arrives", "tick in which it first arrived; 0 if it was lost", |(_, packet)| {
            packet.arrives
        })
}

impl PacketTable {
    /// Begins the table in a run folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn create(folder: &Path, scenario: &str, seed: u64) -> Result<Self, RecordError> {
        let (program_version, scenario) = (VERSION.into(), scenario.into());
        let table = table();
        let origin = Provenance { program_version, scenario, seed };
        let recorder = ParquetRecorder::create(folder, &[table.schema()], &origin)?;
        Ok(Self { recorder, table, waiting: Vec::new() })
    }

    /// Adds packets of cycles that will get no further ones.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(super) fn add(&mut self, mut rows: Vec<PacketRow>) -> Result<(), RecordError> {
        // Nodes may have reported them in any order.
        rows.sort_unstable_by_key(|(sender, packet)| (packet.cycle, *sender, *packet));
        self.waiting.append(&mut rows);
        if self.waiting.len() < BLOCK_ROWS {
            return Ok(());
        }
        self.write_block()
    }

    fn write_block(&mut self) -> Result<(), RecordError> {
        let block = self.table.block(&self.waiting);
        self.waiting.clear();
        self.recorder.append(0, &block)
    }

    /// Completes the table.
    ///
    /// # Errors
    /// When the last rows cannot be written.
    pub(super) fn finish(mut self) -> Result<(), RecordError> {
        self.write_block()?;
        self.recorder.finish()
    }
}
