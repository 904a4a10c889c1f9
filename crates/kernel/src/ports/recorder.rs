//! Where a run's rows go: typed columns of named tables, in blocks.
//!
//! A recorder knows no world. A world says which tables it has ([`TableSchema`]); the run
//! hands over blocks of rows, in an order that is a function of scenario and seed alone.
//! A recorder may be slow (the run waits) but never changes the run, and what it has not
//! finished is never taken for whole.

use std::fmt;

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnType {
    /// Unsigned 32-bit integers.
    U32,
    /// Unsigned 64-bit integers.
    U64,
    /// Signed 32-bit integers.
    I32,
    /// Double precision floats.
    F64,
    /// Short text from a small vocabulary, stored as an index into `labels`.
    Label,
}

/// One column: name with its unit (`distance_m`), type and meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnSpec {
    /// Name; ends in the unit where the quantity has one.
    pub name: String,
    /// Type of its values.
    pub ty: ColumnType,
    /// One sentence for the reader of the file.
    pub meaning: String,
    /// The vocabulary of a [`ColumnType::Label`] column, empty for others.
    pub labels: Vec<String>,
}

/// One table: name and columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableSchema {
    /// File stem, e.g. `trajectories`.
    pub name: String,
    /// The columns in order.
    pub columns: Vec<ColumnSpec>,
}

/// The values of one column in one block.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// See [`ColumnType::U32`].
    U32(Vec<u32>),
    /// See [`ColumnType::U64`].
    U64(Vec<u64>),
    /// See [`ColumnType::I32`].
    I32(Vec<i32>),
    /// See [`ColumnType::F64`].
    F64(Vec<f64>),
    /// See [`ColumnType::Label`]; indices into the column's labels.
    Label(Vec<u32>),
}

impl Values {
    /// No values of this type.
    pub fn empty(ty: ColumnType) -> Self {
        match ty {
            ColumnType::U32 => Self::U32(Vec::new()),
            ColumnType::U64 => Self::U64(Vec::new()),
            ColumnType::I32 => Self::I32(Vec::new()),
            ColumnType::F64 => Self::F64(Vec::new()),
            ColumnType::Label => Self::Label(Vec::new()),
        }
    }

    /// Appends the values of `more`.
    ///
    /// # Panics
    /// When the types differ; [`check_block`] compares them for a whole block.
    pub fn append(&mut self, more: &Self) {
        match (self, more) {
            (Self::U32(a), Self::U32(b)) | (Self::Label(a), Self::Label(b)) => {
                a.extend_from_slice(b);
            }
            (Self::U64(a), Self::U64(b)) => a.extend_from_slice(b),
            (Self::I32(a), Self::I32(b)) => a.extend_from_slice(b),
            (Self::F64(a), Self::F64(b)) => a.extend_from_slice(b),
            (a, b) => panic!("{:?} values appended to {:?} ones", b.ty(), a.ty()),
        }
    }

    /// Keeps the values at which `keep` (of the same length) is true.
    pub fn retain_rows(&mut self, keep: &[bool]) {
        fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
            let mut keep = keep.iter();
            values.retain(|_| keep.next().copied().unwrap_or(false));
        }
        match self {
            Self::U32(v) | Self::Label(v) => retain(v, keep),
            Self::U64(v) => retain(v, keep),
            Self::I32(v) => retain(v, keep),
            Self::F64(v) => retain(v, keep),
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::U32(v) | Self::Label(v) => v.len(),
            Self::U64(v) => v.len(),
            Self::I32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// True without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The column type these values belong to.
    pub fn ty(&self) -> ColumnType {
        match self {
            Self::U32(_) => ColumnType::U32,
            Self::U64(_) => ColumnType::U64,
            Self::I32(_) => ColumnType::I32,
            Self::F64(_) => ColumnType::F64,
            Self::Label(_) => ColumnType::Label,
        }
    }
}

/// Recording failed: a full disk, a file that cannot be created.
#[derive(Debug, thiserror::Error)]
#[error("cannot record to {place}: {cause}")]
pub struct RecordError {
    /// The file or table.
    pub place: String,
    /// What the system said.
    pub cause: String,
}

impl RecordError {
    /// Wraps what the system said about `place`.
    pub fn new(place: impl fmt::Display, cause: impl fmt::Display) -> Self {
        Self { place: place.to_string(), cause: cause.to_string() }
    }
}

/// Takes a run's rows.
///
/// A block that does not fit its schema is refused and leaves the recording as it was. When
/// rows cannot be stored, the recording is incomplete from then on: it stays marked so, and
/// every later call fails too.
pub trait Recorder: Send {
    /// Appends one block to the table with this index: one [`Values`] per column of its
    /// schema, in its order, all of one length.
    ///
    /// # Errors
    /// When the block does not fit the schema, or when rows cannot be stored.
    fn append(&mut self, table: usize, block: &[Values]) -> Result<(), RecordError>;

    /// Makes all rows so far durable, so that a checkpoint may rely on them: all of them
    /// belong to cycles before `next_cycle`, all later ones to `next_cycle` or after it. To
    /// be called before the checkpoint at `next_cycle` is stored; `next_cycle` rises from
    /// call to call. It changes no row. Recorders that outlive no process have nothing to do.
    ///
    /// # Errors
    /// When rows cannot be stored.
    fn seal(&mut self, _next_cycle: u64) -> Result<(), RecordError> {
        Ok(())
    }

    /// Declares every table whole.
    ///
    /// # Errors
    /// When the last rows cannot be stored.
    fn finish(&mut self) -> Result<(), RecordError>;
}

/// Keeps everything in memory; the test double and what the library's users read from.
#[derive(Debug, Clone, PartialEq)]
pub struct MemoryRecorder {
    schemas: Vec<TableSchema>,
    tables: Vec<Vec<Values>>,
    finished: bool,
}

impl MemoryRecorder {
    /// Empty tables of these schemas.
    pub fn new(schemas: &[TableSchema]) -> Self {
        let empty = |s: &TableSchema| s.columns.iter().map(|c| Values::empty(c.ty)).collect();
        let tables = schemas.iter().map(empty).collect();
        Self { schemas: schemas.to_vec(), tables, finished: false }
    }

    /// The column `name` of table `table`, if both exist.
    pub fn column(&self, table: &str, name: &str) -> Option<&Values> {
        let t = self.schemas.iter().position(|s| s.name == table)?;
        let c = self.schemas[t].columns.iter().position(|c| c.name == name)?;
        Some(&self.tables[t][c])
    }

    /// Number of rows of table `table`; 0 for one that does not exist.
    pub fn rows(&self, table: &str) -> usize {
        let t = self.schemas.iter().position(|s| s.name == table);
        t.map_or(0, |t| self.tables[t].first().map_or(0, Values::len))
    }

    /// True after [`Recorder::finish`].
    pub fn is_finished(&self) -> bool {
        self.finished
    }
}

/// Checks that `block` fits `schema`.
///
/// # Errors
/// Names the first column that does not fit.
pub fn check_block(schema: &TableSchema, block: &[Values]) -> Result<(), RecordError> {
    let wrong = |cause: String| Err(RecordError::new(&schema.name, cause));
    if block.len() != schema.columns.len() {
        return wrong(format!("{} columns given, {} expected", block.len(), schema.columns.len()));
    }
    for (spec, values) in schema.columns.iter().zip(block) {
        if values.ty() != spec.ty {
            return wrong(format!(
                "column `{}` is {:?}, not {:?}",
                spec.name,
                spec.ty,
                values.ty()
            ));
        }
        if values.len() != block[0].len() {
            return wrong(format!("column `{}` differs in length from the first", spec.name));
        }
        // The maximum, not the first wrong one: this runs for every row of a recorded run.
        if let Values::Label(indices) = values
            && let Some(bad) = indices.iter().max().filter(|&&i| i as usize >= spec.labels.len())
        {
            return wrong(format!("column `{}` has no label {bad}", spec.name));
        }
    }
    Ok(())
}

impl Recorder for MemoryRecorder {
    fn append(&mut self, table: usize, block: &[Values]) -> Result<(), RecordError> {
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

/// The schema that [`conformance`] writes to: create the recorder under test with it.
pub fn conformance_schemas() -> Vec<TableSchema> {
    let column = |name: &str, ty, labels: &[&str]| ColumnSpec {
        name: name.into(),
        ty,
        meaning: format!("test column {name}"),
        labels: labels.iter().map(ToString::to_string).collect(),
    };
    vec![
        TableSchema {
            name: "first".into(),
            columns: vec![
                column("cycle", ColumnType::U64, &[]),
                column("entity", ColumnType::U32, &[]),
                column("x_m", ColumnType::F64, &[]),
            ],
        },
        TableSchema {
            name: "second".into(),
            columns: vec![
                column("delta", ColumnType::I32, &[]),
                column("event", ColumnType::Label, &["contact", "trip"]),
            ],
        },
    ]
}

/// A table's column, both by index, after the recording is finished.
pub type ReadBack = Box<dyn Fn(usize, usize) -> Values>;

/// What every [`Recorder`] must hold to. `recorder` is fresh, made with
/// [`conformance_schemas`]; `read_back` opens what the finished recorder has stored.
///
/// # Panics
/// When a promise is broken.
pub fn conformance<R: Recorder>(mut recorder: R, read_back: impl FnOnce(R) -> ReadBack) {
    recorder.append(0, &first_block(10)).expect("a block that fits is stored");
    recorder.append(1, &second_block()).expect("tables are independent");
    recorder.append(1, &[Values::I32(vec![]), Values::Label(vec![])]).expect("no rows are fine");
    refuses_what_does_not_fit(&mut recorder);
    recorder.seal(13).expect("sealing succeeds after a refused block");
    recorder.append(0, &first_block(u64::MAX - 3)).expect("blocks append after sealing");
    recorder.finish().expect("finishing succeeds");

    let column = read_back(recorder);
    let big = u64::MAX - 3;
    let cycles = Values::U64(vec![10, 11, 12, big, big + 1, big + 2]);
    assert_eq!(column(0, 0), cycles, "rows keep their order, u64 its range");
    let entities = Values::U32(vec![0, 7, u32::MAX, 0, 7, u32::MAX]);
    assert_eq!(column(0, 1), entities, "u32 keeps its range");
    let Values::F64(places_m) = column(0, 2) else { panic!("f64 stays f64") };
    let bits: Vec<_> = places_m.iter().map(|x| x.to_bits()).collect();
    let expected = [-0.5, -0.0, 1e300].map(f64::to_bits).repeat(2);
    assert_eq!(bits, expected, "f64 keeps its bits");
    assert_eq!(vec![column(1, 0), column(1, 1)], second_block(), "i32 and labels come back");
}

/// Three rows of the first conformance table.
fn first_block(cycle: u64) -> Vec<Values> {
    vec![
        Values::U64((cycle..cycle + 3).collect()),
        Values::U32(vec![0, 7, u32::MAX]),
        Values::F64(vec![-0.5, -0.0, 1e300]),
    ]
}

/// Three rows of the second conformance table.
fn second_block() -> Vec<Values> {
    vec![Values::I32(vec![i32::MIN, 0, i32::MAX]), Values::Label(vec![1, 0, 1])]
}

fn refuses_what_does_not_fit(recorder: &mut impl Recorder) {
    let mut refuses = |table: usize, block: &[Values], what: &str| {
        assert!(recorder.append(table, block).is_err(), "{what} is refused");
    };
    refuses(0, &second_block(), "a block of another table");
    refuses(0, &first_block(10)[..2], "a missing column");
    refuses(9, &second_block(), "a table that does not exist");
    refuses(1, &[Values::I32(vec![1]), Values::Label(vec![])], "a column of another length");
    refuses(1, &[Values::I32(vec![1]), Values::Label(vec![2])], "a label without a name");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_recorder_conforms() {
        conformance(MemoryRecorder::new(&conformance_schemas()), |r| {
            assert!(r.is_finished());
            Box::new(move |table, column| r.tables[table][column].clone())
        });
    }
}
