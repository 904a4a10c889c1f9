//! Timeline of the events of a run, for every table that has the columns `cycle` and `event`.

use super::metrics::{format_digits, omitted_rows_note};
use super::tables::{format_cell, format_rows};
use sidestep_document::figure::{Figure, FigureKind, Point, RunMoment, Series, Table};
use sidestep_document::{Document, document::Text};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::ports::table::split_unit;
use sidestep_record::{Table as Recorded, read_table};
use sidestep_scenario::facts::RecordedPositions;
use std::path::Path;

/// Largest number of events that are listed one by one.
const MAX_ROWS: usize = 100;
/// Number of intervals of cycles over which events are counted: as many points as a line of the figure shows apart.
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
pub(super) fn append(
    document: &mut Document,
    folder: &Path,
    name: &str,
    agents: Option<&RecordedPositions>,
) -> Result<(), InputError> {
    // The rows of the first cycle are enough to see the columns; the whole table may be large.
    let Ok(first) = read_table(folder, name, ..1) else { return Ok(()) };
    if first.column("event").is_none() || first.column("cycle").is_none() {
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
    document.tables([first_rows(&table, events.cycles, agents)]);
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
        let Some(ColumnValues::U64(cycles)) = table.column("cycle") else { return None };
        let Some(ColumnValues::Label(kinds)) = table.column("event") else { return None };
        let names = &table.schema.columns.iter().find(|c| c.name == "event")?.labels;
        Some(Self { table, cycles, kinds, names })
    }

    fn cycles_of_kind(&self, kind: usize) -> impl Iterator<Item = u64> {
        let events = self.cycles.iter().zip(self.kinds);
        events.filter(move |(_, k)| **k as usize == kind).map(|(cycle, _)| *cycle)
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
                ColumnValues::F64(v) => Some((column.name.as_str(), &v[..])),
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
            let first = self.cycles_of_kind(kind).min().unwrap_or_default();
            let last = self.cycles_of_kind(kind).max().unwrap_or_default();
            let mut row = vec![
                self.names[kind].clone(),
                count.to_string(),
                first.to_string(),
                last.to_string(),
            ];
            for (_, values) in &floats {
                row.extend(self.value_range(kind, values));
            }
            table.push_row(row);
        }
        table
    }

    /// Returns the smallest and the largest finite value of a kind, as cells; dashes if there is none.
    fn value_range(&self, kind: usize, values: &[f64]) -> [String; 2] {
        let values = values.iter().zip(self.kinds);
        let of_kind =
            values.filter(|(v, k)| **k as usize == kind && v.is_finite()).map(|(v, _)| *v);
        let min = of_kind.clone().reduce(f64::min);
        let max = of_kind.reduce(f64::max);
        [min, max].map(|value| value.map_or("-".into(), format_digits))
    }

    /// Returns the number of events of each kind in each interval of cycles; `None` for one interval.
    fn timeline(&self) -> Option<Figure> {
        let cycles = self.cycles.iter().max()? + 1;
        let length = cycles.div_ceil(BINS);
        let intervals = cycles.div_ceil(length);
        if intervals < 2 {
            return None;
        }
        let frequent = self.kinds_by_count();
        let mut series = Vec::new();
        for (kind, _) in frequent.iter().take(MAX_KINDS) {
            let mut counts = vec![0_u64; intervals as usize];
            for cycle in self.cycles_of_kind(*kind) {
                counts[(cycle / length) as usize] += 1;
            }
            let mut points = Vec::new();
            for (k, count) in counts.into_iter().enumerate() {
                let middle = (k as f64 + 0.5) * length as f64;
                points.push(Point::new(middle, count as f64));
            }
            series.push(Series { name: self.names[*kind].clone(), points });
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

/// Returns the first events, each with its moment; `agents` names the columns with the number of an agent.
fn first_rows(recorded: &Recorded, cycles: &[u64], agents: Option<&RecordedPositions>) -> Table {
    let columns = &recorded.schema.columns;
    let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    let shown = recorded.rows().min(MAX_ROWS);
    let mut table =
        Table::new("Events one by one", omitted_rows_note(recorded.rows(), shown), &names).folded();
    for (row, &cycle) in cycles.iter().enumerate().take(shown) {
        let cells = columns.iter().zip(&recorded.columns);
        table.push_row(cells.map(|(column, values)| format_cell(column, values, row)));
        let agent = agents.and_then(|agents| agent_name(recorded, agents, row));
        table.moments.push(RunMoment { cycle, agent });
    }
    table
}

/// Returns the agent that a row is about, as a replay names it; none if it is about another body.
fn agent_name(recorded: &Recorded, agents: &RecordedPositions, row: usize) -> Option<String> {
    let number = |column: &str| recorded.column(column)?.number(row).map(|number| number as u64);
    let agent = number(agents.agent)?;
    let kinds = agents.kinds;
    if !kinds.is_empty() && !kinds.iter().any(|kind| is_of_kind(recorded, kind, agent)) {
        return None;
    }
    match agents.part {
        Some(part) => Some(format!("{agent}/{}", number(part)?)),
        None => Some(agent.to_string()),
    }
}

/// Returns whether a body is of a kind, by the ids of the kind in the facts of its table: `0-7`.
fn is_of_kind(recorded: &Recorded, kind: &str, body: u64) -> bool {
    let fact = format!("ids_{kind}");
    let Some((_, ids)) = recorded.schema.about.iter().find(|(name, _)| *name == fact) else {
        return false;
    };
    let range = ids
        .split_once('-')
        .and_then(|(first, last)| Some(first.parse::<u64>().ok()?..=last.parse::<u64>().ok()?));
    range.is_some_and(|range| range.contains(&body))
}
