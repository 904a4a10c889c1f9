//! Rows of a run that are kept in memory: of all tables, or of some.

use sidestep::kernel::ports::recorder::check_block;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema, Values};
use sidestep::kernel::{Cycle, Digest, InputError};
use std::collections::BTreeMap;

/// The rows that are kept in memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Names of tables; all where `None`.
    pub tables: Option<Vec<String>>,
    /// Cycles between two frames, whose bodies are kept as the table `frames`; no frames where `None`.
    pub frames: Option<Cycle>,
}

/// A table with its columns.
type Kept = (TableSchema, Vec<Values>);

/// Rows of tables that are wanted; those of others are dropped as they come.
pub(crate) struct Rows {
    tables: Vec<Kept>,
    /// The place of each of the run's tables among those that are kept.
    places: Vec<Option<usize>>,
    /// By the digest of a checkpoint, the rows of the cycle that it begins with: of orders that waited then.
    marks: BTreeMap<[u8; 16], Vec<Kept>>,
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
        let (mut tables, mut places) = (Vec::new(), Vec::new());
        for schema in schemas {
            places.push(is_wanted(schema).then_some(tables.len()));
            if is_wanted(schema) {
                tables.push((schema.clone(), empty(schema)));
            }
        }
        Ok(Self { tables, places, marks: BTreeMap::new() })
    }

    /// Takes all rows out, by table.
    pub(crate) fn take(&mut self) -> Vec<Kept> {
        let take = |(schema, columns): &mut Kept| {
            (schema.clone(), std::mem::replace(columns, empty(schema)))
        };
        self.tables.iter_mut().map(take).collect()
    }

    /// Notes the rows of cycle `now`, before which a checkpoint was made: they come back with it.
    pub(crate) fn mark(&mut self, checkpoint: &[u8], now: Cycle) {
        let ahead = |(schema, columns): &Kept| {
            let rows = rows_where(schema, columns, |cycle| cycle >= now)?;
            let columns = columns.iter().map(|column| column.pick(&rows)).collect();
            (!rows.is_empty()).then(|| (schema.clone(), columns))
        };
        let ahead: Vec<_> = self.tables.iter().filter_map(ahead).collect();
        if !ahead.is_empty() {
            self.marks.insert(*Digest::of(checkpoint).as_bytes(), ahead);
        }
    }

    /// Drops the rows of cycle `now` and of later ones, but for those that came before this checkpoint of `now`; returns
    /// whether there are such rows.
    pub(crate) fn rewind(&mut self, checkpoint: &[u8], now: Cycle) -> bool {
        for (schema, columns) in &mut self.tables {
            let rows = rows_where(schema, columns, |cycle| cycle < now);
            let count = columns.first().map_or(0, Values::len);
            if let Some(rows) = rows.filter(|rows| rows.len() < count) {
                columns.iter_mut().for_each(|column| *column = column.pick(&rows));
            }
        }
        let marked = self.marks.get(Digest::of(checkpoint).as_bytes());
        for (schema, more) in marked.into_iter().flatten() {
            let table = self.tables.iter_mut().find(|(own, _)| own.name == schema.name);
            let columns = table.map(|(_, columns)| columns).into_iter().flatten();
            columns.zip(more).for_each(|(column, more)| column.append(more));
        }
        marked.is_some()
    }
}

/// Returns the columns of a table without rows.
fn empty(schema: &TableSchema) -> Vec<Values> {
    schema.columns.iter().map(|column| Values::empty(column.ty)).collect()
}

/// Returns the numbers of the rows of such cycles; `None` for a table without cycles.
fn rows_where(
    schema: &TableSchema,
    columns: &[Values],
    is_such: impl Fn(Cycle) -> bool,
) -> Option<Vec<usize>> {
    let place = schema.columns.iter().position(|column| column.name == "cycle")?;
    let Some(Values::U64(cycles)) = columns.get(place) else { return None };
    let rows = cycles.iter().enumerate().filter(|(_, cycle)| is_such(**cycle));
    Some(rows.map(|(row, _)| row).collect())
}

impl Recorder for Rows {
    fn append(&mut self, table: usize, block: &[Values]) -> Result<(), RecordError> {
        let place =
            self.places.get(table).ok_or_else(|| RecordError::new(table, "no such table"))?;
        let Some((schema, columns)) = place.and_then(|place| self.tables.get_mut(place)) else {
            return Ok(());
        };
        check_block(schema, block)?;
        columns.iter_mut().zip(block).for_each(|(column, values)| column.append(values));
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        Ok(())
    }
}
