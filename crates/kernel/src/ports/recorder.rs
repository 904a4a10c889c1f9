//! The destination of a run's rows: typed columns of named tables, in blocks.
//!
//! A recorder knows no world. A world declares its tables ([`TableSchema`]); the run hands over
//! blocks of rows, in an order that is a function of scenario and seed alone. A recorder may be
//! slow (the run waits) but never changes the run, and a recording that it has not finished is
//! never taken for complete.

use super::table::{Cells, ColumnSpec, ColumnType, ColumnValues, TableSchema};
use std::fmt;

/// Recording failed: a full disk, a file that cannot be created.
#[derive(Debug, thiserror::Error)]
#[error("cannot record to {place}: {cause}")]
pub struct RecordError {
    /// The file or table.
    pub place: String,
    /// The system's message.
    pub cause: String,
}

impl RecordError {
    /// Wraps the system's message about `place`.
    pub fn new(place: impl fmt::Display, cause: impl fmt::Display) -> Self {
        Self { place: place.to_string(), cause: cause.to_string() }
    }
}

/// Stores a run's rows.
///
/// A block that does not fit its schema is refused and leaves the recording as it was. When
/// rows cannot be stored, the recording is incomplete from then on: it stays marked so, and
/// every later call fails too.
pub trait Recorder: Send {
    /// Appends one block to the table with this index: one [`ColumnValues`] per column of its
    /// schema, in its order, all of one length.
    ///
    /// # Errors
    /// When the block does not fit the schema, or when rows cannot be stored.
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError>;

    /// Makes all rows so far durable, so that a checkpoint may rely on them: all of them belong to
    /// cycles before `next_cycle`, all later ones to `next_cycle` or after it. It must be called
    /// before the checkpoint at `next_cycle` is stored; `next_cycle` increases from call to call.
    /// It changes no row. Recorders that do not outlive the process have nothing to do.
    ///
    /// # Errors
    /// When rows cannot be stored.
    fn make_durable(&mut self, _next_cycle: u64) -> Result<(), RecordError> {
        Ok(())
    }

    /// Declares every table complete.
    ///
    /// # Errors
    /// When the last rows cannot be stored.
    fn finish(&mut self) -> Result<(), RecordError>;
}

/// Keeps everything in memory; a test double, and the source from which users of the library read.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryRecorder {
    schemas: Vec<TableSchema>,
    tables: Vec<Vec<ColumnValues>>,
    finished: bool,
}

impl MemoryRecorder {
    /// Creates an empty table for each schema; its index is the table's number for [`Recorder::append`].
    pub fn new(schemas: &[TableSchema]) -> Self {
        let tables = schemas
            .iter()
            .map(|schema| {
                schema.columns.iter().map(|column| ColumnValues::empty(column.ty)).collect()
            })
            .collect();
        Self { schemas: schemas.to_vec(), tables, finished: false }
    }

    /// Returns the schema and the columns of table `table`, if it exists.
    pub fn table(&self, table: &str) -> Option<(&TableSchema, &[ColumnValues])> {
        let t = self.schemas.iter().position(|s| s.name == table)?;
        Some((&self.schemas[t], &self.tables[t]))
    }

    /// Returns the schema and the columns of every table, in their order.
    pub fn tables(&self) -> impl Iterator<Item = (&TableSchema, &[ColumnValues])> {
        self.schemas.iter().zip(self.tables.iter().map(Vec::as_slice))
    }

    /// Returns the column `name` of table `table`, if both exist.
    pub fn column(&self, table: &str, name: &str) -> Option<&ColumnValues> {
        let (schema, columns) = self.table(table)?;
        columns.get(schema.columns.iter().position(|c| c.name == name)?)
    }

    /// Returns the number of rows of table `table`; 0 for one that does not exist.
    pub fn row_count(&self, table: &str) -> usize {
        let t = self.schemas.iter().position(|s| s.name == table);
        t.map_or(0, |t| self.tables[t].first().map_or(0, ColumnValues::len))
    }

    /// Moves all rows out, by table, without a copy; the tables are empty then.
    pub fn take(&mut self) -> Vec<(TableSchema, Vec<ColumnValues>)> {
        let empty = Self::new(&self.schemas);
        let tables = std::mem::replace(&mut self.tables, empty.tables);
        self.schemas.iter().cloned().zip(tables).collect()
    }

    /// Drops rows: `keep` returns for every row of a table whether it stays, or `None` where all do.
    pub fn retain_rows(
        &mut self,
        keep: impl Fn(&TableSchema, &[ColumnValues]) -> Option<Vec<bool>>,
    ) {
        for (schema, columns) in self.schemas.iter().zip(&mut self.tables) {
            if let Some(mask) = keep(schema, columns).filter(|mask| mask.contains(&false)) {
                columns.iter_mut().for_each(|column| column.retain_rows(&mask));
            }
        }
    }

    /// Returns whether [`Recorder::finish`] was called: until then the tables may lack rows.
    pub fn is_finished(&self) -> bool {
        self.finished
    }
}

/// Checks that `block` fits `schema`; recorders call it before they store anything.
///
/// # Errors
/// When a column does not fit; the error reports the first one.
pub fn check_block(schema: &TableSchema, block: &[ColumnValues]) -> Result<(), RecordError> {
    let given = block.len();
    let expected = schema.columns.len();
    if given != expected {
        let cause = format!("{given} columns given, {expected} expected");
        return Err(RecordError::new(&schema.name, cause));
    }
    for (column, values) in schema.columns.iter().zip(block) {
        if let Some(fault) = column_fault(column, values, block[0].len()) {
            let cause = format!("column `{}` {fault}", column.name);
            return Err(RecordError::new(&schema.name, cause));
        }
    }
    Ok(())
}

/// Returns the reason why values do not fit a column of a block with this number of rows.
fn column_fault(column: &ColumnSpec, values: &ColumnValues, rows: usize) -> Option<String> {
    if values.column_type() != column.ty {
        return Some(format!("is {:?}, not {:?}", column.ty, values.column_type()));
    }
    if values.len() != rows {
        return Some("differs in length from the first".into());
    }
    if !column.is_nullable && values.valid().is_some() {
        return Some("has missing values".into());
    }
    // The maximum, not the first wrong one: a loop without an exit is vectorized, and this one runs over every row
    // of a recorded run.
    if let ColumnValues::Label(indices) = values
        && let Some(index) =
            max_valid_value(indices).filter(|&&i| i as usize >= column.labels.len())
    {
        return Some(format!("has no label {index}"));
    }
    None
}

/// Returns the largest of the values that are not missing.
fn max_valid_value(indices: &Cells<u32>) -> Option<&u32> {
    match indices.valid() {
        None => indices.iter().max(),
        Some(_) => indices.iter_with_missing().flatten().max(),
    }
}

impl Recorder for MemoryRecorder {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        let schema =
            self.schemas.get(table).ok_or_else(|| RecordError::new(table, "no such table"))?;
        check_block(schema, block)?;
        for (column, values) in self.tables[table].iter_mut().zip(block) {
            column.append(values);
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.finished = true;
        Ok(())
    }
}

/// Returns the schemas that [`check_conformance`] writes to: create the recorder under test with them.
pub fn conformance_test_schemas() -> Vec<TableSchema> {
    let column = |name: &str, ty| ColumnSpec::new(name, ty, &format!("test column {name}"));
    // One table of plain numbers, and one with a label and a missing text: every way in which columns are encoded.
    let event = ColumnSpec::label("event", "test column event", ["contact", "trip"]);
    let note = ColumnSpec { is_nullable: true, ..column("note", ColumnType::Text) };
    vec![
        TableSchema::new(
            "first",
            vec![
                column("cycle", ColumnType::U64),
                column("entity", ColumnType::U32),
                column("x_m", ColumnType::F64),
            ],
        ),
        TableSchema::new("second", vec![column("delta", ColumnType::I32), event, note]),
    ]
}

/// A function that returns a table's column, both by index, after the recording is finished.
pub type ColumnReadBack = Box<dyn Fn(usize, usize) -> ColumnValues>;

/// Checks the guarantees of a [`Recorder`]. `recorder` is fresh, made with [`conformance_test_schemas`];
/// `read_back` opens the finished recording.
///
/// # Panics
/// When a guarantee is broken.
pub fn check_conformance<R: Recorder>(
    mut recorder: R,
    read_back: impl FnOnce(R) -> ColumnReadBack,
) {
    recorder.append(0, &first_conformance_block(10)).expect("a block that fits is stored");
    recorder.append(1, &second_conformance_block()).expect("tables are independent");
    recorder.append(1, &build_second_block(vec![], vec![])).expect("no rows are fine");
    refuses_what_does_not_fit(&mut recorder);
    recorder.make_durable(13).expect("sealing succeeds after a refused block");
    recorder
        .append(0, &first_conformance_block(u64::MAX - 3))
        .expect("blocks append after sealing");
    recorder.finish().expect("finishing succeeds");

    let column = read_back(recorder);
    let big = u64::MAX - 3;
    let cycles = ColumnValues::U64(vec![10, 11, 12, big, big + 1, big + 2].into());
    assert_eq!(column(0, 0), cycles, "rows keep their order, u64 its range");
    let entities = ColumnValues::U32(vec![0, 7, u32::MAX, 0, 7, u32::MAX].into());
    assert_eq!(column(0, 1), entities, "u32 keeps its range");
    let ColumnValues::F64(places_m) = column(0, 2) else { panic!("f64 stays f64") };
    let bits: Vec<_> = places_m.iter().map(|x| x.to_bits()).collect();
    let expected = [-0.5, -0.0, 1e300].map(f64::to_bits).repeat(2);
    assert_eq!(bits, expected, "f64 keeps its bits");
    let second = (0..3).map(|k| column(1, k)).collect::<Vec<_>>();
    assert_eq!(second, second_conformance_block(), "i32, labels and text with a gap come back");
}

/// Three rows of the first conformance table.
fn first_conformance_block(cycle: u64) -> Vec<ColumnValues> {
    vec![
        ColumnValues::U64((cycle..cycle + 3).collect()),
        ColumnValues::U32(vec![0, 7, u32::MAX].into()),
        ColumnValues::F64(vec![-0.5, -0.0, 1e300].into()),
    ]
}

/// Three rows of the second conformance table.
fn second_conformance_block() -> Vec<ColumnValues> {
    build_second_block(vec![i32::MIN, 0, i32::MAX], vec![1, 0, 1])
}

/// Rows of the second conformance table; the second of every two has no note.
fn build_second_block(delta: Vec<i32>, event: Vec<u32>) -> Vec<ColumnValues> {
    let note = |row| (row % 2 == 0).then(|| format!("row {row}"));
    let notes = ColumnValues::Text((0..delta.len()).map(note).collect());
    vec![ColumnValues::I32(delta.into()), ColumnValues::Label(event.into()), notes]
}

fn refuses_what_does_not_fit(recorder: &mut impl Recorder) {
    let mut refuses = |table: usize, block: &[ColumnValues], what: &str| {
        assert!(recorder.append(table, block).is_err(), "{what} is refused");
    };
    refuses(0, &second_conformance_block(), "a block of another table");
    refuses(0, &first_conformance_block(10)[..2], "a missing column");
    refuses(9, &second_conformance_block(), "a table that does not exist");
    refuses(1, &build_second_block(vec![1], vec![]), "a column of another length");
    refuses(1, &build_second_block(vec![1], vec![2]), "a label without a name");
    let mut missing = build_second_block(vec![1], vec![0]);
    missing[0] = ColumnValues::I32([None].into_iter().collect());
    refuses(1, &missing, "a missing value of a column that is declared without");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_label_needs_no_name() {
        let label = ColumnSpec::label("callsign", "", Vec::<String>::new());
        let schema = TableSchema::new("t", vec![ColumnSpec { is_nullable: true, ..label }]);
        let block = |label| [ColumnValues::Label([None, label].into_iter().collect())];
        check_block(&schema, &block(None)).expect("no label is named");
        assert!(check_block(&schema, &block(Some(0))).is_err());
    }

    #[test]
    fn the_memory_recorder_drops_rows_of_tables_for_which_that_is_told() {
        let mut recorder = MemoryRecorder::new(&conformance_test_schemas());
        recorder.append(0, &first_conformance_block(5)).expect("it fits");
        recorder.append(1, &second_conformance_block()).expect("it fits");
        recorder.retain_rows(|schema, columns| {
            let ColumnValues::U64(cycles) = &columns[0] else { return None };
            assert_eq!(schema.name, "first");
            Some(cycles.iter().map(|cycle| *cycle != 6).collect())
        });
        assert_eq!(
            recorder.column("first", "entity"),
            Some(&ColumnValues::U32(vec![0, u32::MAX].into()))
        );
        let tables: Vec<_> = recorder.tables().map(|(schema, _)| schema.name.as_str()).collect();
        assert_eq!((tables, recorder.row_count("second")), (vec!["first", "second"], 3));
    }

    #[test]
    fn the_memory_recorder_conforms() {
        check_conformance(MemoryRecorder::new(&conformance_test_schemas()), |r| {
            assert!(r.is_finished());
            Box::new(move |table, column| r.tables[table][column].clone())
        });
    }
}
