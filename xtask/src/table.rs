//! Figures as a table, as JSON, and beside earlier ones.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use crate::counts::{FIGURES, Figure, Row, TOTAL};

const LEGEND: &str = "
Lines are neither blank nor comments. `tests` are those beside the code and those in tests/; all other
columns but benches and examples look at the code without them.
pub/1000: public items of libraries (functions, types, fields, constants, modules,
re-exports) per 1,000 lines of code; circling: files in circles of imports;
fn>40: functions over 40 lines; tuples: parameters that are tuples, fn(tuple): functions with such;
clones: pairs of places with six or more equal lines, cloned: lines in such places;
why/code: lines of comments in functions per line of code. xtask is not counted.
";

/// Returns the figures as JSON, by crate and name.
pub(crate) fn json(rows: &[Row]) -> String {
    let mut crates = Map::new();
    for row in rows {
        let figures = FIGURES.iter().zip(&row.values);
        let figures = figures.map(|(figure, value)| (figure.key.to_string(), number(*value)));
        crates.insert(row.name.clone(), figures.collect());
    }
    format!("{:#}\n", Value::Object(crates))
}

/// A whole number where it is one.
fn number(value: Option<f64>) -> Value {
    match value {
        Some(value) if value.fract() == 0.0 => json!(value as u64),
        other => json!(other),
    }
}

/// Reads the output of [`json()`]. A figure that it lacks is none.
pub(crate) fn read(path: &Path) -> Result<Vec<Row>, String> {
    let text = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    parse(&text)
        .map_err(|e| format!("{}: {e}; expected what `shape --json` prints", path.display()))
}

fn parse(text: &str) -> Result<Vec<Row>, serde_json::Error> {
    let crates: Map<String, Value> = serde_json::from_str(text)?;
    let row = |(name, figures): (String, Value)| Row {
        name,
        values: FIGURES.iter().map(|figure| figures.get(figure.key)?.as_f64()).collect(),
    };
    Ok(crates.into_iter().map(row).collect())
}

/// Returns a table with one line per crate.
pub(crate) fn plain(rows: &[Row]) -> String {
    let mut lines = vec![headings("crate", FIGURES.iter().map(|figure| figure.heading))];
    for row in rows {
        let cells = FIGURES.iter().zip(&row.values).map(|(figure, value)| cell(figure, *value));
        lines.push([row.name.clone()].into_iter().chain(cells).collect());
    }
    aligned(&lines) + LEGEND
}

/// Returns a table for all crates, then one per crate: before, now, and the difference.
pub(crate) fn compared(before: &[Row], now: &[Row]) -> String {
    let named = |rows: &[Row], name: &str| rows.iter().find(|row| row.name == name).cloned();
    let mut names = vec![TOTAL.to_string()];
    let others: BTreeSet<&String> = before.iter().chain(now).map(|row| &row.name).collect();
    names.extend(others.into_iter().filter(|name| *name != TOTAL).cloned());
    let mut text = String::new();
    for name in names {
        let (before, now) = (named(before, &name), named(now, &name));
        let _ = writeln!(text, "{}", aligned(&comparison(&name, before.as_ref(), now.as_ref())));
    }
    text + LEGEND.trim_start()
}

fn comparison(name: &str, before: Option<&Row>, now: Option<&Row>) -> Vec<Vec<String>> {
    let mut lines = vec![headings(name, ["before", "now", "difference"].into_iter())];
    for (at, figure) in FIGURES.iter().enumerate() {
        let value = |row: Option<&Row>| row.and_then(|row| row.values[at]);
        let (before, now) = (value(before), value(now));
        let difference = before.zip(now).map(|(before, now)| now - before);
        let sign = if difference.is_some_and(|d| d > 0.0) { "+" } else { "" };
        let difference = format!("{sign}{}", cell(figure, difference));
        lines.push(vec![
            figure.heading.to_string(),
            cell(figure, before),
            cell(figure, now),
            difference,
        ]);
    }
    lines
}

fn headings<'a>(first: &'a str, others: impl Iterator<Item = &'a str>) -> Vec<String> {
    [first].into_iter().chain(others).map(String::from).collect()
}

fn cell(figure: &Figure, value: Option<f64>) -> String {
    value.map_or("-".into(), |value| format!("{value:.*}", figure.decimals))
}

/// Returns lines with columns of one width each: the first to the left, others to the right.
fn aligned(lines: &[Vec<String>]) -> String {
    let columns = lines.first().map_or(0, Vec::len);
    let width = |at: usize| lines.iter().map(|line| line[at].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for line in lines {
        let cells = line.iter().zip(&widths).enumerate().map(|(at, (cell, &width))| {
            if at == 0 { format!("{cell:width$}") } else { format!("{cell:>width$}") }
        });
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, value: f64) -> Row {
        let mut values = vec![Some(value); FIGURES.len()];
        values[6] = None;
        values[14] = Some(value / 1000.0);
        Row { name: name.into(), values }
    }

    #[test]
    fn json_is_read_back() {
        let rows = [row("kernel", 7.0), row(TOTAL, 12.0)];
        assert_eq!(parse(&json(&rows)).unwrap(), rows);
        assert!(json(&rows).contains("\"code\": 7,"));
        assert!(parse("[]").is_err());
    }

    #[test]
    fn tables_are_aligned_and_differences_signed() {
        let (before, now) = (row("kernel", 7.0), row("kernel", 12.0));
        assert!(plain(std::slice::from_ref(&now)).starts_with("crate   code  tests"));
        let text = compared(&[before, row("old", 5.0)], &[now]);
        assert!(text.contains("kernel     before     now  difference\n"), "{text}");
        assert!(text.contains("\ncode            7      12          +5\n"), "{text}");
        assert!(text.contains("\nwhy/code   0.0070  0.0120     +0.0050\n"), "{text}");
        assert!(text.contains("\ncode            5    -           -\n"), "{text}");
    }
}
