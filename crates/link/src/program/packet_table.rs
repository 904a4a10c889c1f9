//! The table `packets`: every packet that a node has sent.

use crate::protocol::{ClockMode, PacketRecord};
use sidestep::VERSION;
use sidestep::kernel::ports::{RecordError, Recorder, Table};
use sidestep::kernel::{Cycle, EntityId};
use sidestep_record::{ParquetRecorder, Provenance};
use sidestep_session::FlightRecorder;
use std::path::Path;

/// Number of rows that are written at once: a block of some megabytes, so that Parquet compresses well and the memory of
/// the server stays small.
const BLOCK_ROWS: usize = 1 << 16;

/// A row: the sender and its packet.
type PacketRow = (EntityId, PacketRecord);

/// The table `packets` of a run folder. Until it is finished it is called `packets.partial`.
pub(super) struct PacketTable {
    writer: PacketWriter,
    table: Table<PacketRow>,
    /// Rows that are not written yet.
    rows: Vec<PacketRow>,
    /// The cycle after the last one of a row.
    next_cycle: Cycle,
}

/// The writer of the rows.
enum PacketWriter {
    /// In large blocks; a run that was killed is simulated again.
    Lockstep(ParquetRecorder),
    /// Within a second, by a thread of its own.
    Realtime(FlightRecorder),
}

impl PacketWriter {
    fn recorder(&mut self) -> &mut dyn Recorder {
        match self {
            Self::Lockstep(recorder) => recorder,
            Self::Realtime(recorder) => recorder,
        }
    }
}

fn packets_table() -> Table<PacketRow> {
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
    /// Creates the table in a run folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn create(
        folder: &Path,
        scenario: &str,
        seed: u64,
        clock: ClockMode,
    ) -> Result<Self, RecordError> {
        let table = packets_table();
        let provenance =
            Provenance { program_version: VERSION.into(), scenario: scenario.into(), seed };
        let recorder = ParquetRecorder::create(folder, &[table.schema()], &provenance)?;
        let writer = match clock {
            ClockMode::Lockstep => PacketWriter::Lockstep(recorder),
            ClockMode::Realtime { .. } => {
                PacketWriter::Realtime(FlightRecorder::start(recorder, None))
            }
        };
        Ok(Self { writer, table, rows: Vec::new(), next_cycle: 0 })
    }

    /// Adds packets of cycles that will get no further ones.
    ///
    /// # Errors
    /// When they cannot be written.
    pub(super) fn add(&mut self, mut rows: Vec<PacketRow>) -> Result<(), RecordError> {
        // Nodes report in any order; the file of two equal runs is the same.
        rows.sort_unstable_by_key(|(sender, packet)| (packet.cycle, *sender, *packet));
        let last_cycle = rows.last().map_or(0, |(_, packet)| packet.cycle);
        self.next_cycle = self.next_cycle.max(last_cycle + 1);
        self.rows.append(&mut rows);
        let is_flown = matches!(self.writer, PacketWriter::Realtime(_));
        if is_flown || self.rows.len() >= BLOCK_ROWS {
            self.write_block()?;
        }
        match &mut self.writer {
            PacketWriter::Lockstep(_) => Ok(()),
            PacketWriter::Realtime(recorder) => recorder.seal_if_due(self.next_cycle, false),
        }
    }

    fn write_block(&mut self) -> Result<(), RecordError> {
        let block = self.table.block_from_rows(&self.rows);
        self.rows.clear();
        self.writer.recorder().append(0, &block)
    }

    /// Completes the table.
    ///
    /// # Errors
    /// When the last rows cannot be written.
    pub(super) fn finish(mut self) -> Result<(), RecordError> {
        self.write_block()?;
        self.writer.recorder().finish()
    }
}
