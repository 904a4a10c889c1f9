//! Events from their table, for any world.

use crate::recorded::has_rows;
use sidestep::kernel::InputError;
use sidestep::kernel::ports::Values;
use sidestep::kernel::ports::table::split_unit;
use sidestep::kernel::view::{Amount, Body, Entry, Happening, Kind, Level, PlaceRows, Who};
use sidestep_record::{Table, read_table};
use std::ops::Range;

/// The table of events.
const TABLE: &str = "events";
/// The largest number of events; further ones are left out.
const MOST_EVENTS: usize = 200_000;

/// Returns the recorded events by cycle, about bodies with the numbers that they have in the tables of places.
///
/// # Errors
/// When the table is damaged.
pub(super) fn read(
    folder: &std::path::Path,
    places: &[PlaceRows],
    first: &[Body],
) -> Result<Vec<Entry>, InputError> {
    let (Some(place), true) = (places.first(), has_rows(folder, TABLE)) else {
        return Ok(Vec::new());
    };
    let table = read_table(folder, TABLE, ..)?;
    let rows = 0..table.rows().min(MOST_EVENTS);
    let mut events = Rows { table: &table, place, first }.entries(rows).unwrap_or_default();
    events.sort_by_key(|event| event.cycle);
    Ok(events)
}

struct Rows<'a> {
    table: &'a Table,
    place: &'a PlaceRows,
    first: &'a [Body],
}

impl Rows<'_> {
    /// Returns the events; `None` for a table of another form.
    fn entries(&self, rows: Range<usize>) -> Option<Vec<Entry>> {
        let Values::U64(cycles) = self.table.column("cycle")? else { return None };
        self.table.column("event")?;
        rows.map(|row| self.entry(row, *cycles.get(row)?)).collect()
    }

    fn entry(&self, row: usize, cycle: u64) -> Option<Entry> {
        let event = self.text("event", row)?.replace('_', "-");
        let known = Happening::ALL.iter().find(|kind| kind.name() == event);
        let number = self.number(self.place.number, row)?;
        let part = self.place.part.and_then(|part| self.number(part, row));
        let kind = self.kind_of(number);
        let words = self.words(row);
        let value = self.amount(row);
        Some(Entry {
            cycle,
            level: if known == Some(&Happening::Contact) { Level::Warning } else { Level::Info },
            // An event without a name here is shown with its own words.
            kind: known.copied().unwrap_or(Happening::Changed),
            who: Who { kind, number, part },
            with: self.number("other", row).map(|other| Who::new(self.place.kind, other, None)),
            at_m: None,
            value,
            words,
        })
    }

    /// Returns the kind of a body, by a number that counts on through all kinds.
    fn kind_of(&self, number: u32) -> Kind {
        let is_one = |kind: Kind| self.first.iter().any(|b| (b.kind, b.number) == (kind, number));
        let others = [Kind::Person, Kind::Door].into_iter().find(|kind| is_one(*kind));
        if is_one(self.place.kind) { self.place.kind } else { others.unwrap_or(self.place.kind) }
    }

    /// Returns everything that the table says of an event, in words.
    fn words(&self, row: usize) -> String {
        let columns = self.table.schema.columns.iter().map(|column| column.name.as_str());
        let told = columns.filter_map(|name| self.text(name, row));
        told.map(|text| text.replace('_', " ")).collect::<Vec<_>>().join(" ")
    }

    /// Returns the measure of an event: the first of its floats that is not missing.
    fn amount(&self, row: usize) -> Option<Amount> {
        let columns = self.table.schema.columns.iter().zip(&self.table.columns);
        let mut floats = columns.filter(|(_, values)| matches!(values, Values::F64(_)));
        floats.find_map(|(column, values)| {
            let (_, unit) = split_unit(&column.name);
            let unit = unit.unwrap_or_default();
            Some(Amount::new(values.number(row).filter(|x| x.is_finite())?, unit))
        })
    }

    fn number(&self, column: &str, row: usize) -> Option<u32> {
        let number = self.table.column(column)?.number(row)?;
        (number >= 0.0).then_some(number as u32)
    }

    /// Returns a text that is not empty.
    fn text(&self, column: &str, row: usize) -> Option<String> {
        let at = self.table.schema.columns.iter().position(|own| own.name == column)?;
        let (column, values) = (&self.table.schema.columns[at], &self.table.columns[at]);
        if !matches!(values, Values::Label(_)) {
            return None;
        }
        let mut text = String::new();
        values.write(row, &column.labels, &mut text).ok()?;
        (!text.is_empty()).then_some(text)
    }
}
