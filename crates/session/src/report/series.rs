//! The metrics of a run over time, as figures.

use super::metrics::capitalize;
use super::text::format_count;
use sidestep_document::Document;
use sidestep_document::figure::{Figure, FigureKind, Point, Series};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_record::{Table, read_table};
use sidestep_scenario::{MetricInfo, MetricLabel, metric_label};
use std::path::Path;

/// Name of the table.
pub(super) const TABLE: &str = "series";
/// Number of figures that are open; others are folded.
const MAX_OPEN: usize = 6;
/// Largest number of figures; more are not looked through, and all are in the table.
const MAX_FIGURES: usize = 24;
/// Largest number of points of a line: more are finer than a pixel.
const MAX_POINTS: usize = 400;

/// Appends a figure of each metric that changes, in the order of the world, if the run has a table of them.
///
/// # Errors
/// When the table is damaged.
pub(super) fn append(
    document: &mut Document,
    folder: &Path,
    meanings: &[MetricInfo],
) -> Result<(), InputError> {
    let table = read_table(folder, TABLE, ..)?;
    let Some(ColumnValues::U64(cycles)) = table.column("cycle") else { return Ok(()) };
    let mut figures = Vec::new();
    let columns = table.schema.columns.iter().zip(&table.columns);
    for (column, values) in columns.filter(|(column, _)| column.name != "cycle") {
        if changes(values) {
            figures.push(figure(&column.name, cycles, values, meanings));
        }
    }
    if figures.is_empty() {
        return Ok(());
    }
    document.section("Over time").paragraph(lead(&table, figures.len()));
    figures.truncate(MAX_FIGURES);
    let folded = figures.split_off(figures.len().min(MAX_OPEN));
    document.figures(figures).figures(folded.into_iter().map(Figure::folded));
    Ok(())
}

fn lead(table: &Table, figures: usize) -> String {
    let rows = format_count(table.rows() as u64);
    let beyond = match figures.saturating_sub(MAX_FIGURES) {
        0 => String::new(),
        n => format!(" {n} more metrics change, and are in the table alone."),
    };
    format!(
        "{rows} values of each metric, after cycles that follow from their numbers alone.{beyond}"
    )
}

/// Returns whether a column has numbers that differ.
fn changes(values: &ColumnValues) -> bool {
    let numbers = (0..values.len()).filter_map(|row| values.number(row)).filter(|v| v.is_finite());
    let mut numbers = numbers.peekable();
    let first = numbers.peek().copied();
    numbers.any(|value| Some(value) != first)
}

/// Returns a metric over the cycles; where it has no value, its line has a gap.
fn figure(name: &str, cycles: &[u64], values: &ColumnValues, meanings: &[MetricInfo]) -> Figure {
    let MetricLabel { words, unit, meaning } = metric_label(meanings, name);
    let label = unit.map_or_else(|| words.clone(), |unit| format!("{words} ({unit})"));
    let step = cycles.len().div_ceil(MAX_POINTS).max(1);
    let last = cycles.len().saturating_sub(1);
    let rows = (0..cycles.len()).filter(|row| row % step == 0 || *row == last);
    // The number of cycles done, as in charts and sweeps; the table has the number of the last cycle.
    let done = |row: usize| (cycles[row] + 1) as f64;
    let point = |row: usize| Point::new(done(row), values.number(row).unwrap_or(f64::NAN));
    // A meaning that only repeats the words says nothing more.
    let says_more = !meaning.is_empty() && meaning != words;
    let note = if says_more { format!("{meaning}.") } else { String::new() };
    Figure {
        title: capitalize(&words),
        note: capitalize(&note),
        x_label: "cycle".into(),
        y_label: label,
        kind: FigureKind::Bands,
        series: vec![Series { name: String::new(), points: rows.map(point).collect() }],
        ..Figure::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metric_over_time_ends_with_its_last_row_and_has_a_gap_where_it_has_no_value() {
        let cycles: Vec<u64> = (0..1001).collect();
        let values =
            ColumnValues::F64((0..1001).map(|k| (k != 500).then_some(f64::from(k))).collect());
        let figure = figure("gap_m", &cycles, &values, &[]);
        let points = &figure.series[0].points;
        assert!(points.len() <= MAX_POINTS + 1);
        assert_eq!(points.last().map(|p| (p.x, p.y)), Some((1001.0, 1000.0)));
        assert_eq!(figure.y_label, "gap (m)");
        assert!(
            changes(&values)
                && !changes(&ColumnValues::F64(vec![1.0, 1.0].into_iter().map(Some).collect()))
        );
    }
}
