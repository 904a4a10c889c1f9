//! Rows of a run kept in memory: of all tables, or of some.

use sidestep_kernel::ports::{ColumnValues, MemoryRecorder, RecordError, Recorder, TableSchema};
use sidestep_kernel::{Cycle, Digest, InputError};
use std::collections::BTreeMap;

/// The rows to keep in memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RowSelection {
    /// Names of tables; all if `None`.
    pub tables: Option<Vec<String>>,
    /// Cycles between two frames, with bodies kept as the table `frames`; no frames if `None`.
    pub frames: Option<Cycle>,
}

/// The mark of a checkpoint that identifies rows: its cycle and its digest.
type CheckpointKey = (Cycle, [u8; 16]);

/// Rows that come with a checkpoint, each block with the number of its table.
type PendingRows = Vec<(usize, Vec<ColumnValues>)>;

/// Rows of the wanted tables, of one past; those of other tables are dropped as they come.
pub(crate) struct RowStore {
    tables: MemoryRecorder,
    /// The place of each of the run's tables among the kept ones.
    places: Vec<Option<usize>>,
    /// The cycle from which on rows are kept: earlier rows were taken, or never existed.
    begin: Cycle,
    /// The checkpoints of this past, with the rows of the cycle that each begins with: those of orders that were
    /// waiting then.
    known: BTreeMap<CheckpointKey, PendingRows>,
}

impl RowStore {
    /// Returns the place for rows of a run with these tables, from cycle `begin` on.
    ///
    /// # Errors
    /// When a wanted table is not among them.
    pub(crate) fn new(
        schemas: &[TableSchema],
        wanted: Option<&[String]>,
        begin: Cycle,
    ) -> Result<Self, InputError> {
        for name in wanted.into_iter().flatten() {
            if !schemas.iter().any(|schema| schema.name == *name) {
                return Err(unknown_table(name, schemas));
            }
        }
        let mut tables = Vec::new();
        let mut places = Vec::new();
        for schema in schemas {
            if wanted.is_none_or(|wanted| wanted.contains(&schema.name)) {
                places.push(Some(tables.len()));
                tables.push(schema.clone());
            } else {
                places.push(None);
            }
        }
        let tables = MemoryRecorder::new(&tables);
        Ok(Self { tables, places, begin, known: BTreeMap::new() })
    }

    pub(crate) fn first_cycle(&self) -> Cycle {
        self.begin
    }

    /// Takes out all rows, by table, of a run that is at cycle `now`. Later rows may have another past, and rows of
    /// orders that were handed over do not come again: checkpoints need not be known any longer.
    pub(crate) fn take(&mut self, now: Cycle) -> Vec<(TableSchema, Vec<ColumnValues>)> {
        self.begin = now;
        self.known.clear();
        self.tables.take()
    }

    /// Remembers a checkpoint of cycle `now`, the present one. Existing rows of this cycle come back with it.
    pub(crate) fn add_checkpoint(&mut self, checkpoint: &[u8], now: Cycle) {
        let mut pending = Vec::new();
        for (table, (schema, columns)) in self.tables.tables().enumerate() {
            let Some(cycles) = cycle_column(schema, columns) else { continue };
            // Rows of the present cycle come after all others, in whichever order those are.
            let count = cycles.iter().rev().take_while(|&&cycle| cycle >= now).count();
            if count > 0 {
                let rows: Vec<_> = (cycles.len() - count..cycles.len()).collect();
                let block = columns.iter().map(|column| column.gather_rows(&rows)).collect();
                pending.push((table, block));
            }
        }
        self.known.insert(checkpoint_key(checkpoint, now), pending);
    }

    /// Returns whether all remaining rows belong to the past of this checkpoint of cycle `of`, for a run at
    /// cycle `now`.
    pub(crate) fn is_consistent_with(&self, checkpoint: &[u8], of: Cycle, now: Cycle) -> bool {
        let none_stay = of <= self.begin || now == self.begin;
        none_stay || self.known.contains_key(&checkpoint_key(checkpoint, of))
    }

    /// Drops the rows of cycle `now` and of later ones, except those that came before this checkpoint of `now`, which
    /// is [consistent](Self::is_consistent_with) with the kept rows; returns whether there are such rows.
    ///
    /// # Errors
    /// None: rows go back to the tables that they are from.
    pub(crate) fn rewind(&mut self, checkpoint: &[u8], now: Cycle) -> Result<bool, RecordError> {
        let key = checkpoint_key(checkpoint, now);
        // Rows before an unknown checkpoint may be of another past, so none are kept then.
        self.begin = if self.known.contains_key(&key) { self.begin.min(now) } else { now };
        let kept = self.begin..now;
        self.tables.retain_rows(|schema, columns| {
            let cycles = cycle_column(schema, columns)?;
            Some(cycles.iter().map(|cycle| kept.contains(cycle)).collect())
        });
        // Later ones belong to an abandoned past.
        self.known.retain(|(cycle, _), _| *cycle <= now);
        let pending = self.known.get(&key).map(Vec::as_slice).unwrap_or_default();
        for (table, block) in pending {
            self.tables.append(*table, block)?;
        }
        Ok(!pending.is_empty())
    }
}

fn unknown_table(name: &str, schemas: &[TableSchema]) -> InputError {
    let names: Vec<_> = schemas.iter().map(|schema| schema.name.as_str()).collect();
    let cause = format!("there is no table `{name}`");
    let remedy = if names.is_empty() {
        "the scenario records none: see its section [record]".to_string()
    } else {
        format!("give some of {}", names.join(", "))
    };
    InputError::new("record", cause, remedy)
}

fn checkpoint_key(checkpoint: &[u8], cycle: Cycle) -> CheckpointKey {
    (cycle, *Digest::hash_bytes(checkpoint).as_bytes())
}

/// Returns the cycles of the rows of a table; `None` for a table without cycles.
fn cycle_column<'a>(schema: &TableSchema, columns: &'a [ColumnValues]) -> Option<&'a [Cycle]> {
    let place = schema.columns.iter().position(|column| column.name == "cycle")?;
    let Some(ColumnValues::U64(cycles)) = columns.get(place) else { return None };
    Some(cycles)
}

impl Recorder for RowStore {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        match self.places.get(table) {
            Some(Some(place)) => self.tables.append(*place, block),
            // A table that is not wanted.
            Some(None) => Ok(()),
            None => Err(RecordError::new(table, "no such table")),
        }
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::{ColumnSpec, ColumnType};

    /// Rows of three tables of cycles, the second of which is not wanted.
    fn rows() -> RowStore {
        let cycle = || ColumnSpec::new("cycle", ColumnType::U64, "its cycle");
        let schemas = ["a", "b", "c"].map(|name| TableSchema::new(name, vec![cycle()]));
        RowStore::new(&schemas, Some(&["a".into(), "c".into()]), 0).expect("they are there")
    }

    fn append(rows: &mut RowStore, table: usize, cycles: &[Cycle]) {
        rows.append(table, &[ColumnValues::U64(cycles.to_vec().into())]).expect("it fits");
    }

    /// The cycles of the rows of both tables.
    fn cycles(rows: &RowStore) -> [Vec<Cycle>; 2] {
        let cycles = |table| match rows.tables.column(table, "cycle") {
            Some(ColumnValues::U64(cycles)) => cycles.to_vec(),
            other => panic!("{other:?}"),
        };
        ["a", "c"].map(cycles)
    }

    #[test]
    fn rows_of_a_cycle_come_back_with_the_checkpoint_that_they_were_there_for() {
        let mut rows = rows();
        // Poses come by body within a block.
        append(&mut rows, 0, &[0, 1, 2, 0, 1, 2]);
        append(&mut rows, 1, &[7]);
        append(&mut rows, 2, &[1, 3]);
        rows.add_checkpoint(b"ordered", 3);
        append(&mut rows, 2, &[3]);
        rows.add_checkpoint(b"ordered twice", 3);
        append(&mut rows, 0, &[3, 4, 3, 4]);
        assert!(rows.rewind(b"ordered", 3).expect("they fit"));
        assert_eq!(cycles(&rows), [vec![0, 1, 2, 0, 1, 2], vec![1, 3]]);
        assert!(rows.rewind(b"ordered twice", 3).expect("they fit"));
        assert_eq!(cycles(&rows), [vec![0, 1, 2, 0, 1, 2], vec![1, 3, 3]]);
        assert!(rows.append(3, &[]).is_err(), "a table that does not exist");
    }

    #[test]
    fn checkpoints_are_known_while_rows_of_their_past_are_kept() {
        let mut rows = rows();
        for number in 0..100_u8 {
            let now = Cycle::from(number);
            append(&mut rows, 2, &[now]);
            // A state that is saved twice has one checkpoint.
            (0..2).for_each(|_| rows.add_checkpoint(&[number], now));
        }
        assert_eq!(rows.known.len(), 100);
        assert!(
            rows.is_consistent_with(&[60], 60, 100) && !rows.is_consistent_with(&[61], 60, 100)
        );
        assert!(rows.rewind(&[60], 60).expect("they fit"));
        assert_eq!(rows.known.len(), 61, "those of later cycles are of a past that was left");
        assert!(!rows.is_consistent_with(&[61], 61, 62));
        assert_eq!(rows.take(60).len(), 2);
        assert!(rows.known.is_empty(), "nothing is left that could have two pasts");
        assert!(!rows.rewind(&[60], 60).expect("it fits"), "its rows were handed over");
        assert!(
            rows.is_consistent_with(&[7], 7, 80)
                && rows.is_consistent_with(&[99], 99, 60)
                && !rows.is_consistent_with(&[99], 99, 80)
        );
        assert!(!rows.rewind(&[99], 99).expect("they fit"));
        assert_eq!((rows.first_cycle(), cycles(&rows)), (99, [vec![], vec![]]));
    }
}
