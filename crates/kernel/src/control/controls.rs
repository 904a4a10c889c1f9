//! Controls of agents that decide outside of the run: recorded as rows of a table, and read back to be replayed.

use crate::ports::{ColumnValues, MemoryRecorder, Table, TableSchema};
use crate::units::{Cycle, EntityId};
use std::collections::BTreeMap;

const CONTROLS: &str = "controls";
/// Number of bytes in a row: tables have no type for bytes, and 64-bit integers are their widest.
const ROW_BYTES: usize = 8;

/// A part of a control, as recorded. A cycle that was decided externally begins with a row of no agent, so that one
/// without any control is distinguished from one in which the agents decided within the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ControlRow {
    cycle: Cycle,
    agent: Option<EntityId>,
    part: u32,
    bytes: u32,
    value: u64,
}

pub(crate) fn controls_table() -> Table<ControlRow> {
    Table::new(CONTROLS)
        .u64("cycle", "cycle for which the control was handed over", |c: &ControlRow| c.cycle)
        .u32("agent", "entity id of the agent; none in the row that begins a cycle", |c| c.agent)
        .u32("part", "place of these bytes in the control, from 0", |c| c.part)
        .u32("bytes", "number of bytes in this row", |c| c.bytes)
        .u64("value", "the bytes, the first one lowest", |c| c.value)
}

/// The first row belongs to no agent; see [`ControlRow`].
pub(crate) fn control_rows(
    cycle: Cycle,
    controls: &[(EntityId, Vec<u8>)],
) -> impl Iterator<Item = ControlRow> + '_ {
    let first = ControlRow { cycle, agent: None, part: 0, bytes: 0, value: 0 };
    let rows = controls.iter().flat_map(move |(agent, bytes)| {
        (0..).zip(bytes.chunks(ROW_BYTES)).map(move |(part, bytes)| ControlRow {
            cycle,
            agent: Some(*agent),
            part,
            bytes: bytes.len() as u32,
            value: pack_bytes(bytes),
        })
    });
    std::iter::once(first).chain(rows)
}

/// Returns up to [`ROW_BYTES`] bytes as one number, the first byte lowest.
fn pack_bytes(bytes: &[u8]) -> u64 {
    let mut value = [0; ROW_BYTES];
    value[..bytes.len()].copy_from_slice(bytes);
    u64::from_le_bytes(value)
}

/// Controls by the cycle for which they were handed over.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ControlLog {
    cycles: BTreeMap<Cycle, Vec<(EntityId, Vec<u8>)>>,
}

impl ControlLog {
    /// Adds the controls of agents in a cycle, after those that it has already.
    pub fn add(&mut self, cycle: Cycle, controls: impl IntoIterator<Item = (EntityId, Vec<u8>)>) {
        self.cycles.entry(cycle).or_default().extend(controls);
    }

    /// Returns whether no cycle was decided externally.
    pub fn is_empty(&self) -> bool {
        self.cycles.is_empty()
    }

    /// Returns the controls of agents in a cycle, if it was decided externally.
    pub fn get(&self, cycle: Cycle) -> Option<&[(EntityId, Vec<u8>)]> {
        self.cycles.get(&cycle).map(Vec::as_slice)
    }

    /// Returns the first cycle after `cycle` that was decided externally.
    pub(crate) fn next_after(&self, cycle: Cycle) -> Option<Cycle> {
        self.cycles.range(cycle.saturating_add(1)..).next().map(|(cycle, _)| *cycle)
    }

    /// Returns the controls that a run recorded; `None` if there is no table of them.
    pub fn from_recorder(recorder: &MemoryRecorder) -> Option<Self> {
        let (schema, columns) = recorder.table(CONTROLS)?;
        let mut reader = ControlTableReader::default();
        reader.read_block(schema, columns)?;
        Some(reader.into_log())
    }
}

/// Reads the controls of the table `controls`, block after block.
#[derive(Debug, Default)]
pub struct ControlTableReader {
    log: ControlLog,
}

impl ControlTableReader {
    /// Name of the table in a recording.
    pub const TABLE: &'static str = CONTROLS;

    /// Reads the next rows. `None` if they are not those of controls.
    pub fn read_block(&mut self, schema: &TableSchema, columns: &[ColumnValues]) -> Option<()> {
        let column =
            |name: &str| columns.get(schema.columns.iter().position(|column| column.name == name)?);
        let (ColumnValues::U64(cycles), ColumnValues::U32(agents)) =
            (column("cycle")?, column("agent")?)
        else {
            return None;
        };
        let (ColumnValues::U32(parts), ColumnValues::U32(bytes)) =
            (column("part")?, column("bytes")?)
        else {
            return None;
        };
        let ColumnValues::U64(values) = column("value")? else { return None };
        for row in 0..cycles.len() {
            let controls = self.log.cycles.entry(*cycles.get(row)?).or_default();
            // The row that only begins an externally decided cycle.
            let Some(&agent) = agents.get(row) else { continue };
            let value = values.get(row)?.to_le_bytes();
            let bytes = value.get(..*bytes.get(row)? as usize)?;
            if *parts.get(row)? == 0 {
                controls.push((agent, Vec::new()));
            }
            let (last_agent, control) = controls.last_mut()?;
            // The parts of a control lie in consecutive rows, the first with part 0.
            if *last_agent != agent {
                return None;
            }
            control.extend_from_slice(bytes);
        }
        Some(())
    }

    /// Returns the controls of all blocks so far.
    pub fn into_log(self) -> ControlLog {
        self.log
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::Recorder;

    #[test]
    fn controls_are_read_back_also_where_a_block_ends_within_one() {
        let controls = vec![(3, (0..19).collect()), (7, vec![255; 8]), (9, vec![1])];
        let mut book = ControlLog::default();
        book.add(4, controls.clone());
        book.add(6, Vec::new());
        let rows: Vec<ControlRow> =
            control_rows(4, &controls).chain(control_rows(6, &[])).collect();
        assert_eq!(rows.len(), 1 + 3 + 1 + 1 + 1);
        for cut in 0..=rows.len() {
            let mut reader = ControlTableReader::default();
            for part in [&rows[..cut], &rows[cut..]] {
                let mut recorder = MemoryRecorder::new(&[controls_table().schema()]);
                recorder.append(0, &controls_table().block_from_rows(part)).expect("it fits");
                let (schema, columns) = recorder.table(CONTROLS).expect("it is there");
                assert_eq!(reader.read_block(schema, columns), Some(()));
            }
            assert_eq!(reader.into_log(), book, "cut before row {cut}");
        }
        assert_eq!((book.get(6), book.get(5)), (Some(&[][..]), None), "nobody, and not at all");
        assert_eq!([3, 4, 5, 6].map(|now| book.next_after(now)), [Some(4), Some(6), Some(6), None]);
    }

    #[test]
    fn another_table_is_none_of_controls() {
        let schema = TableSchema::new(CONTROLS, Vec::new());
        assert_eq!(ControlTableReader::default().read_block(&schema, &[]), None);
        assert_eq!(ControlLog::from_recorder(&MemoryRecorder::new(&[])), None);
    }
}
