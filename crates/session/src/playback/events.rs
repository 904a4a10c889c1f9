//! Events from their table, for any world.

use crate::run_tables::has_rows;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::ports::table::split_unit;
use sidestep_kernel::view::{
    Body, BodyId, BodyKind, BodyRole, LogEvent, LogEventKind, PositionTableColumns, Quantity,
    Severity,
};
use sidestep_record::{Table, read_table};
use std::ops::Range;

/// The name that all worlds give the table of events.
const EVENTS_TABLE: &str = "events";
/// The largest number of events; further ones are left out, because all are kept in memory.
const MAX_EVENTS: usize = 200_000;

/// Returns the recorded events by cycle, about bodies with the numbers that they have in the tables of places.
///
/// # Errors
/// When the table is damaged.
pub(super) fn read_events(
    folder: &std::path::Path,
    places: &[PositionTableColumns],
    first: &[Body],
) -> Result<Vec<LogEvent>, InputError> {
    let Some(place) = places.first() else { return Ok(Vec::new()) };
    if !has_rows(folder, EVENTS_TABLE) {
        return Ok(Vec::new());
    }
    let table = read_table(folder, EVENTS_TABLE, ..)?;
    let rows = 0..table.rows().min(MAX_EVENTS);
    let mut events = EventRows { table: &table, place, first }.events(rows).unwrap_or_default();
    events.sort_by_key(|event| event.cycle);
    Ok(events)
}

struct EventRows<'a> {
    table: &'a Table,
    place: &'a PositionTableColumns,
    first: &'a [Body],
}

impl EventRows<'_> {
    /// Returns the events; `None` for a table of another form.
    fn events(&self, rows: Range<usize>) -> Option<Vec<LogEvent>> {
        let ColumnValues::U64(cycles) = self.table.column("cycle")? else { return None };
        self.table.column("event")?;
        rows.map(|row| self.event(row, *cycles.get(row)?)).collect()
    }

    fn event(&self, row: usize, cycle: u64) -> Option<LogEvent> {
        let event = self.text("event", row)?.replace('_', "-");
        let known = LogEventKind::ALL.iter().find(|kind| kind.name() == event);
        let number = self.number(self.place.number, row)?;
        let part = self.place.part.and_then(|part| self.number(part, row));
        let is_contact = known == Some(&LogEventKind::Contact);
        Some(LogEvent {
            cycle,
            level: if is_contact { Severity::Warning } else { Severity::Info },
            // An event without a name here is shown with its own words.
            kind: known.copied().unwrap_or(LogEventKind::Changed),
            who: BodyId { kind: self.kind_of(number), number, part },
            with: self.number("other", row).map(|other| BodyId::new(self.place.kind, other, None)),
            at_m: None,
            value: self.quantity(row),
            words: self.words(row),
        })
    }

    /// Returns the kind of a body, by its number, which counts on through all kinds.
    fn kind_of(&self, number: u32) -> BodyKind {
        let agents = self.place.kind;
        let among = [BodyRole::MovesAmong(agents), BodyRole::StandsAmong(agents)];
        let other = self
            .first
            .iter()
            .find(|body| body.number == number && among.contains(&body.kind.role()));
        other.map_or(agents, |body| body.kind)
    }

    /// Returns all texts that the table has of an event.
    fn words(&self, row: usize) -> String {
        let columns = self.table.schema.columns.iter().map(|column| column.name.as_str());
        let texts = columns.filter_map(|name| self.text(name, row));
        texts.map(|text| text.replace('_', " ")).collect::<Vec<_>>().join(" ")
    }

    /// Returns the measure of an event: the first of its floats that is not missing.
    fn quantity(&self, row: usize) -> Option<Quantity> {
        let columns = self.table.schema.columns.iter().zip(&self.table.columns);
        let mut floats = columns.filter(|(_, values)| matches!(values, ColumnValues::F64(_)));
        floats.find_map(|(column, values)| {
            let (_, unit) = split_unit(&column.name);
            let unit = unit.unwrap_or_default();
            Some(Quantity::new(values.number(row).filter(|x| x.is_finite())?, unit))
        })
    }

    fn number(&self, column: &str, row: usize) -> Option<u32> {
        let number = self.table.column(column)?.number(row)?;
        (number >= 0.0).then_some(number as u32)
    }

    /// Returns a text that is not empty.
    fn text(&self, column: &str, row: usize) -> Option<String> {
        let at = self.table.schema.columns.iter().position(|own| own.name == column)?;
        let column = &self.table.schema.columns[at];
        let values = &self.table.columns[at];
        if !matches!(values, ColumnValues::Label(_)) {
            return None;
        }
        let mut text = String::new();
        values.write(row, &column.labels, &mut text).ok()?;
        (!text.is_empty()).then_some(text)
    }
}
