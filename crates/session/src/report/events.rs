//! Timeline of the events of a run, for every table that has the columns `cycle` and `event`.

use super::metrics::{format_digits, omitted_rows_note};
use super::tables::{format_cell, format_rows};
use sidestep_document::figure::{Figure, FigureKind, Point, Series, Table};
use sidestep_document::{Document, document::Text};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::Values;
use sidestep_kernel::ports::table::split_unit;
use sidestep_record::{Table as Recorded, read_table};
use std::path::Path;

/// Largest number of events that are listed one by one.
const MAX_ROWS: usize = 100;
/// Number of stretches of cycles over which events are counted.
const BINS: u64 = 50;
/// Largest number of kinds of events with a line of their own; palettes are limited to as many colors.
const MAX_KINDS: usize = 7;

/// Returns the name of a column as words, with its unit.
fn column_label(name: &str) -> String {
    let (words, unit) = split_unit(name);
    let words = words.replace('_', " ");
    unit.map_or_else(|| words.clone(), |unit| format!("{words} ({unit})"))
}

/// Appends the events of the table `name`, if it is a table of events.
///
/// # Errors
/// When the table is damaged.
pub(super) fn append(document: &mut Document, folder: &Path, name: &str) -> Result<(), InputError> {
    let first = read_table(folder, name, ..1);
    let is_of_events = |t: &Recorded| t.column("event").is_some() && t.column("cycle").is_some();
    if !first.is_ok_and(|table| is_of_events(&table)) {
        return Ok(());
    }
    let table = read_table(folder, name, ..)?;
    let Some(events) = Events::from_table(&table) else { return Ok(()) };
    let title =
        if name == "events" { "What happened".into() } else { format!("What happened: {name}") };
    document.section(title);
    if table.rows() == 0 {
        document.paragraph("Nothing that is recorded as an event.");
        return Ok(());
    }
    let partial = if table.complete { "" } else { ", of those cycles that are on the disk" };
    let words = Text::from(format!("{} of ", format_rows(table.rows())));
    document.paragraph(words.append(Text::code(name)).append(format!("{partial}.")));
    document.tables([events.counts_table()]).figures(events.timeline());
    document.tables([first_rows(&table)]);
    Ok(())
}

/// The columns that every table of events has.
struct Events<'a> {
    table: &'a Recorded,
    cycles: &'a [u64],
    kinds: &'a [u32],
    names: &'a [String],
}

impl<'a> Events<'a> {
    fn from_table(table: &'a Recorded) -> Option<Self> {
        let Some(Values::U64(cycles)) = table.column("cycle") else { return None };
        let Some(Values::Label(kinds)) = table.column("event") else { return None };
        let names = &table.schema.columns.iter().find(|c| c.name == "event")?.labels;
        Some(Self { table, cycles, kinds, names })
    }

    /// Returns the cycles of the events of a kind.
    fn cycles_of_kind(&self, kind: usize) -> impl Iterator<Item = u64> {
        let is_its = move |(_, k): &(&u64, &u32)| **k as usize == kind;
        self.cycles.iter().zip(self.kinds).filter(is_its).map(|(cycle, _)| *cycle)
    }

    /// Returns the kinds that occur and their numbers, most frequent first.
    fn kinds_by_count(&self) -> Vec<(usize, usize)> {
        let mut counts: Vec<(usize, usize)> = (0..self.names.len()).map(|k| (k, 0)).collect();
        for &kind in self.kinds {
            counts[kind as usize].1 += 1;
        }
        counts.retain(|(_, count)| *count > 0);
        counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        counts
    }

    fn counts_table(&self) -> Table {
        let values = self.table.columns.iter().zip(&self.table.schema.columns);
        let floats: Vec<(&str, &[f64])> = values
            .filter_map(|(values, column)| match values {
                Values::F64(v) => Some((column.name.as_str(), &v[..])),
                _ => None,
            })
            .collect();
        let mut table =
            Table::new("Events by kind", "", &["event", "count", "first cycle", "last cycle"]);
        for (name, _) in &floats {
            let head = column_label(name);
            table.columns.extend([format!("least {head}"), format!("greatest {head}")]);
        }
        for (kind, count) in self.kinds_by_count() {
            let end = |cycle: Option<u64>| cycle.map_or("-".into(), |c| c.to_string());
            let (first, last) = (self.cycles_of_kind(kind).min(), self.cycles_of_kind(kind).max());
            let head = [self.names[kind].clone(), count.to_string(), end(first), end(last)];
            let ends = floats.iter().flat_map(|(_, values)| self.value_range(kind, values));
            table.push_row(head.into_iter().chain(ends));
        }
        table
    }

    /// Returns the smallest and the largest value of a kind.
    fn value_range(&self, kind: usize, values: &[f64]) -> [String; 2] {
        let its = || {
            let all = values.iter().zip(self.kinds);
            all.filter(|(v, k)| **k as usize == kind && v.is_finite()).map(|(v, _)| *v)
        };
        [its().reduce(f64::min), its().reduce(f64::max)]
            .map(|end| end.map_or("-".into(), format_digits))
    }

    /// Returns the number of events of each kind in each stretch of cycles; `None` for one stretch.
    fn timeline(&self) -> Option<Figure> {
        let last = self.cycles.iter().max()? + 1;
        let length = last.div_ceil(BINS);
        let stretches = last.div_ceil(length);
        if stretches < 2 {
            return None;
        }
        let frequent = self.kinds_by_count();
        let mut series: Vec<Series> = frequent[..frequent.len().min(MAX_KINDS)]
            .iter()
            .map(|(kind, _)| Series { name: self.names[*kind].clone(), points: Vec::new() })
            .collect();
        for (line, (kind, _)) in series.iter_mut().zip(&frequent) {
            let mut counts = vec![0_u64; stretches as usize];
            self.cycles_of_kind(*kind).for_each(|cycle| counts[(cycle / length) as usize] += 1);
            let middle = |k: usize| (k as f64 + 0.5) * length as f64;
            let point = |(k, count): (usize, &u64)| Point::new(middle(k), *count as f64);
            line.points = counts.iter().enumerate().map(point).collect();
        }
        let left_out = match frequent.len().saturating_sub(MAX_KINDS) {
            0 => String::new(),
            n => format!(" {n} less frequent kinds are left out."),
        };
        Some(Figure {
            title: "Events over time".into(),
            note: format!(
                "Counts per stretch of {length} cycles, at its middle. One run: no interval.{left_out}"
            ),
            x_label: "cycle".into(),
            y_label: format!("events in {length} cycles"),
            kind: FigureKind::Lines,
            series,
            ..Figure::default()
        })
    }
}

fn first_rows(recorded: &Recorded) -> Table {
    let columns = &recorded.schema.columns;
    let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    let shown = recorded.rows().min(MAX_ROWS);
    let mut table =
        Table::new("Events one by one", omitted_rows_note(recorded.rows(), shown), &names).folded();
    for row in 0..shown {
        let cells = columns.iter().zip(&recorded.columns);
        table.push_row(cells.map(|(column, values)| format_cell(column, values, row)));
    }
    table
}
