//! Numbers of `summary.json` as tables.

use super::words::count;
use serde_json::{Map, Value};
use sidestep::kernel::ports::table::split_unit;
use sidestep::scenario::{Meaning, Told, told};
use sidestep_document::Table;

/// Largest number of rows; the number of rows left out is shown.
const MOST_ROWS: usize = 200;
/// Largest number of values of a list that are shown; longer lists are only counted.
const MOST_VALUES: usize = 16;

/// Returns the unit that a name ends in, or nothing.
pub(super) fn unit(name: &str) -> String {
    split_unit(name).1.unwrap_or_default().into()
}

/// Returns a tree of values as one row for each leaf, in the words of its world: first the informative ones, then,
/// folded, those that stayed 0 or have no value.
pub(super) fn flat(title: &str, tree: &Value, meanings: &[Meaning]) -> Vec<Table> {
    let columns = ["metric", "value", "unit", "meaning", "name in summary.json"];
    let note = "Counts that stayed 0, and what has no value.";
    let mut telling = Table::new(title, "", &columns);
    let mut silent = Table::new(format!("{title} that stayed 0"), note, &columns).folded();
    for (path, value) in leaves(tree) {
        let Told { words, unit, meaning } = told(meanings, &path);
        let is_silent = ["0", "-", "none", "false"].contains(&value.as_str());
        let unit = unit.unwrap_or_default().to_string();
        let table = if is_silent { &mut silent } else { &mut telling };
        table.row([capital(&words), value, unit, meaning.to_string(), path]);
    }
    [telling, silent].into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// Returns words with a capital first letter, as at the beginning of a sentence.
fn capital(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}

/// Returns a list of trees as one row for each of them, with a column for each of their leaves.
pub(super) fn listed(title: &str, list: &Value, meanings: &[Meaning]) -> Option<Table> {
    let rows: Vec<Vec<(String, String)>> = list.as_array()?.iter().map(leaves).collect();
    let shown = &rows[..rows.len().min(MOST_ROWS)];
    let mut columns: Vec<&str> = Vec::new();
    for (path, _) in shown.iter().flatten() {
        if !columns.contains(&path.as_str()) {
            columns.push(path);
        }
    }
    if columns.is_empty() {
        return None;
    }
    let note = left_out(rows.len(), shown.len());
    let heads: Vec<String> = columns.iter().map(|name| head(name, meanings)).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new(title, note, &heads).folded();
    for row in shown {
        let cell = |column: &&str| row.iter().find(|(path, _)| path == column);
        table.row(columns.iter().map(|c| cell(c).map_or("-".into(), |(_, value)| value.clone())));
    }
    Some(table)
}

/// Returns the head of a column: the metric in words, with its unit.
fn head(name: &str, meanings: &[Meaning]) -> String {
    let Told { words, unit, .. } = told(meanings, name);
    unit.map_or_else(|| words.clone(), |unit| format!("{words} ({unit})"))
}

/// Returns the number of rows not shown, as text; empty if all are shown.
pub(super) fn left_out(all: usize, shown: usize) -> String {
    match all - shown {
        0 => String::new(),
        n => format!(
            "The first {} of {} rows; {} are left out.",
            count(shown as u64),
            count(all as u64),
            count(n as u64)
        ),
    }
}

/// Returns every leaf of a tree with its path, such as `contacts.wall`; null values are left out.
fn leaves(tree: &Value) -> Vec<(String, String)> {
    let mut found = Vec::new();
    match tree {
        Value::Object(map) => descend(map, "", &mut found),
        Value::Null => {}
        other => found.push(("value".into(), word(other))),
    }
    found
}

fn descend(map: &Map<String, Value>, above: &str, found: &mut Vec<(String, String)>) {
    for (key, value) in map {
        let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        match value {
            Value::Object(inside) => descend(inside, &path, found),
            other => found.push((path, word(other))),
        }
    }
}

fn word(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) => text.clone(),
        Value::Number(number) => self::number(number),
        Value::Array(list) if list.is_empty() => "none".into(),
        Value::Array(list) if list.iter().any(|v| v.is_array() || v.is_object()) => {
            format!("{} entries", list.len())
        }
        Value::Array(list) if list.len() > MOST_VALUES => format!("{} values", list.len()),
        Value::Array(list) => list.iter().map(word).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

/// Formats whole numbers unchanged, and others with six digits.
fn number(number: &serde_json::Number) -> String {
    match (number.as_u64(), number.as_f64()) {
        (Some(whole), _) => whole.to_string(),
        (None, Some(value)) => digits(value),
        _ => number.to_string(),
    }
}

/// Formats a value with six digits, as short as possible.
pub(super) fn digits(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    match rounded.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e9).contains(&size) => rounded.to_string(),
        _ => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const MEANINGS: [Meaning; 2] = [
        Meaning { name: "gap_m", words: "least gap", unit: "", meaning: "between two" },
        Meaning { name: "hits.*", words: "hits of a *", unit: "", meaning: "times" },
    ];

    #[test]
    fn metrics_are_told_in_words_and_those_that_say_nothing_are_folded() {
        let tree = json!({"gap_m": 0.123456789, "hits": {"wall": 3, "door": 0}, "none": null});
        let [telling, silent] = &flat("t", &tree, &MEANINGS)[..] else { panic!("two tables") };
        let rows = [
            ["Least gap", "0.123457", "m", "between two", "gap_m"],
            ["Hits of a wall", "3", "", "times", "hits.wall"],
        ];
        assert_eq!(telling.rows, rows.map(|row| row.map(String::from).to_vec()));
        let names: Vec<&str> = silent.rows.iter().map(|row| row[4].as_str()).collect();
        assert_eq!((names, silent.is_folded), (vec!["hits.door", "none"], true));
        assert!(flat("t", &Value::Null, &MEANINGS).is_empty());
    }

    #[test]
    fn rows_that_differ_share_their_columns_and_what_is_left_out_is_told() {
        let list = json!([{"a": 1}, {"a": 2, "b": {"gap_m": true}}]);
        let table = listed("t", &list, &MEANINGS).unwrap();
        assert_eq!(table.columns, ["a", "least gap (m)"]);
        assert_eq!(table.rows, [["1", "-"], ["2", "true"]]);
        let many = listed("t", &json!(vec![json!({"a": 1}); 250]), &[]).unwrap();
        assert_eq!((many.rows.len(), many.note.contains("50 are left out")), (MOST_ROWS, true));
        assert_eq!(listed("t", &json!([]), &[]), None);
    }

    #[test]
    fn numbers_of_every_size_stay_short() {
        let values = [0.0, 1.0, -2.5, 1.0 / 3.0, 1e-9, 2.5e12];
        assert_eq!(values.map(digits), ["0", "1", "-2.5", "0.333333", "1e-9", "2.5e12"]);
    }
}
