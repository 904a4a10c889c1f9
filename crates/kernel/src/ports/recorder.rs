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
pub trait Recorder: Send {
    /// Appends one block to the table with this index: one [`Values`] per column of its
    /// schema, in its order, all of one length.
    ///
    /// # Errors
    /// When the block does not fit the schema or cannot be stored. The recording is then
    /// incomplete and stays marked so.
    fn append(&mut self, table: usize, block: &[Values]) -> Result<(), RecordError>;

    /// Declares every table whole.
    ///
    /// # Errors
    /// When the last rows cannot be stored; the recording stays marked incomplete.
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
        let empty = |c: &ColumnSpec| match c.ty {
            ColumnType::U32 => Values::U32(Vec::new()),
            ColumnType::U64 => Values::U64(Vec::new()),
            ColumnType::I32 => Values::I32(Vec::new()),
            ColumnType::F64 => Values::F64(Vec::new()),
            ColumnType::Label => Values::Label(Vec::new()),
        };
        let tables = schemas.iter().map(|s| s.columns.iter().map(empty).collect()).collect();
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
        if let Values::Label(indices) = values
            && let Some(bad) = indices.iter().find(|&&i| i as usize >= spec.labels.len())
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
            match (column, values) {
                (Values::U32(a), Values::U32(b)) | (Values::Label(a), Values::Label(b)) => {
                    a.extend_from_slice(b);
                }
                (Values::U64(a), Values::U64(b)) => a.extend_from_slice(b),
                (Values::I32(a), Values::I32(b)) => a.extend_from_slice(b),
                (Values::F64(a), Values::F64(b)) => a.extend_from_slice(b),
                _ => unreachable!("check_block compared the types"),
            }
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

/// What every [`Recorder`] must hold to. `recorder` is fresh, made with
/// [`conformance_schemas`]; `read_back` returns all values of (table, column) after `finish`.
///
/// # Panics
/// When a promise is broken.
pub fn conformance<R: Recorder + Clone>(
    mut recorder: R,
    read_back: impl Fn(R, usize, usize) -> Values,
) {
    let first = |from: u64| {
        vec![
            Values::U64((from..from + 3).collect()),
            Values::U32(vec![0, 7, u32::MAX]),
            Values::F64(vec![-0.5, 0.0, 1e300]),
        ]
    };
    let second = vec![Values::I32(vec![i32::MIN, 0, i32::MAX]), Values::Label(vec![1, 0, 1])];
    recorder.append(0, &first(10)).expect("a block that fits is stored");
    recorder.append(1, &second).expect("tables are independent");
    recorder.append(0, &first(u64::MAX - 3)).expect("blocks append");

    assert!(recorder.append(0, &second).is_err(), "a block of another table is refused");
    assert!(recorder.append(9, &second).is_err(), "a table that does not exist is refused");
    let uneven = vec![Values::I32(vec![1]), Values::Label(vec![])];
    assert!(recorder.append(1, &uneven).is_err(), "columns of unequal length are refused");
    let unknown = vec![Values::I32(vec![1]), Values::Label(vec![2])];
    assert!(recorder.append(1, &unknown).is_err(), "a label outside the vocabulary is refused");
    recorder.finish().expect("finishing succeeds");

    let big = u64::MAX - 3;
    let cycles = Values::U64(vec![10, 11, 12, big, big + 1, big + 2]);
    assert_eq!(read_back(recorder.clone(), 0, 0), cycles, "rows keep their order");
    let entities = Values::U32(vec![0, 7, u32::MAX, 0, 7, u32::MAX]);
    assert_eq!(read_back(recorder.clone(), 0, 1), entities, "u32 keeps its range");
    assert_eq!(read_back(recorder.clone(), 1, 0), second[0], "i32 keeps its range");
    assert_eq!(read_back(recorder, 1, 1), second[1], "labels come back as written");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_memory_recorder_conforms() {
        conformance(MemoryRecorder::new(&conformance_schemas()), |r, t, c| r.tables[t][c].clone());
    }
}
