//! Rows of a run that are kept in memory: of all tables, or of some.

use sidestep::kernel::ports::{MemoryRecorder, RecordError, Recorder, TableSchema, Values};
use sidestep::kernel::{Cycle, InputError};

/// The rows that are kept in memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Names of tables; all where `None`.
    pub tables: Option<Vec<String>>,
    /// Cycles between two frames, whose bodies are kept as the table `frames`; no frames where `None`.
    pub frames: Option<Cycle>,
}

/// Rows of tables that are wanted; those of others are dropped as they come.
pub(crate) struct Rows {
    memory: MemoryRecorder,
    /// The place of each of the run's tables among those that are kept.
    places: Vec<Option<usize>>,
}

impl Rows {
    /// Returns the place for rows of a run with these tables.
    ///
    /// # Errors
    /// When one that is wanted is none of them.
    pub(crate) fn new(
        schemas: &[TableSchema],
        wanted: Option<&[String]>,
    ) -> Result<Self, InputError> {
        let is_known = |name: &&String| schemas.iter().any(|schema| schema.name == **name);
        if let Some(unknown) = wanted.into_iter().flatten().find(|name| !is_known(name)) {
            let names: Vec<_> = schemas.iter().map(|schema| schema.name.as_str()).collect();
            let cause = format!("there is no table `{unknown}`");
            let remedy = match names.is_empty() {
                true => "the scenario records none: see its section [record]".to_string(),
                false => format!("name some of {}", names.join(", ")),
            };
            return Err(InputError::new("record", cause, remedy));
        }
        let is_wanted = |schema: &TableSchema| wanted.is_none_or(|all| all.contains(&schema.name));
        let (mut kept, mut places) = (Vec::new(), Vec::new());
        for schema in schemas {
            places.push(is_wanted(schema).then_some(kept.len()));
            if is_wanted(schema) {
                kept.push(schema.clone());
            }
        }
        Ok(Self { memory: MemoryRecorder::new(&kept), places })
    }

    /// Takes all rows out, by table.
    pub(crate) fn take(&mut self) -> Vec<(TableSchema, Vec<Values>)> {
        self.memory.take()
    }
}

impl Recorder for Rows {
    fn append(&mut self, table: usize, block: &[Values]) -> Result<(), RecordError> {
        match self.places.get(table) {
            Some(Some(place)) => self.memory.append(*place, block),
            Some(None) => Ok(()),
            None => Err(RecordError::new(table, "no such table")),
        }
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.memory.finish()
    }
}
