//! Numbers of `summary.json` as tables.

use super::words::count;
use serde_json::{Map, Value};
use sidestep_document::Table;

/// Largest number of rows; the number of rows left out is shown.
const MOST_ROWS: usize = 200;
/// Largest number of values of a list that are shown; longer lists are only counted.
const MOST_VALUES: usize = 16;

/// Endings of names that stand for a unit; longer ones first.
const UNITS: [(&str, &str); 18] = [
    ("_m_s", "m/s"),
    ("_percent", "%"),
    ("_boxes", "boxes"),
    ("_cycles", "cycles"),
    ("_bytes", "bytes"),
    ("_deg", "\u{b0}"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_mm", "mm"),
    ("_km", "km"),
    ("_ms", "ms"),
    ("_us", "us"),
    ("_ns", "ns"),
    ("_kn", "kn"),
    ("_ft", "ft"),
    ("_nm", "NM"),
    ("_m", "m"),
    ("_s", "s"),
];

/// Returns the unit that a name ends in, or nothing: `steps_per_cpu_s` is a number per second.
pub(super) fn unit(name: &str) -> String {
    let unit = UNITS.iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit);
    let is_rate = name.contains("_per_") && !unit.is_empty();
    if is_rate { format!("1/{unit}") } else { unit.into() }
}

/// Returns a tree of values as one row for each leaf, with its path; `None` without any.
pub(super) fn flat(title: &str, tree: &Value) -> Option<Table> {
    let mut table = Table::new(title, "", &["metric", "value", "unit"]);
    for (path, value) in leaves(tree) {
        let unit = unit(&path);
        table.row([path, value, unit]);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// Returns a list of trees as one row for each of them, with a column for each of their leaves.
pub(super) fn listed(title: &str, list: &Value) -> Option<Table> {
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
    let mut table = Table::new(title, note, &without_shared_head(&columns));
    for row in shown {
        let cell = |column: &&str| row.iter().find(|(path, _)| path == column);
        table.row(columns.iter().map(|c| cell(c).map_or("-".into(), |(_, value)| value.clone())));
    }
    Some(table)
}

/// Returns paths without the first step that all longer ones share, if they stay distinct without
/// it.
fn without_shared_head<'a>(paths: &[&'a str]) -> Vec<&'a str> {
    let head = |path: &&'a str| path.split_once('.').map(|(head, _)| head);
    let mut heads: Vec<&str> = paths.iter().filter_map(head).collect();
    heads.dedup();
    let tail = |path: &&'a str| path.split_once('.').map_or(*path, |(_, tail)| tail);
    let tails: Vec<&str> = paths.iter().map(tail).collect();
    let mut apart = tails.clone();
    apart.sort_unstable();
    apart.dedup();
    if heads.len() == 1 && apart.len() == paths.len() { tails } else { paths.to_vec() }
}

/// Returns how many rows are not shown, as text; empty if all are.
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

/// Formats whole numbers as they are, and others with six digits.
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

    #[test]
    fn leaves_are_named_by_their_path_and_units_follow_from_names() {
        let tree = json!({"a": {"gap_m": 0.123456789, "n": 3}, "list": [1, 2], "none": null});
        let table = flat("t", &tree).unwrap();
        let rows = [
            ["a.gap_m", "0.123457", "m"],
            ["a.n", "3", ""],
            ["list", "1, 2", ""],
            ["none", "-", ""],
        ];
        assert_eq!(table.rows, rows.map(|row| row.map(String::from).to_vec()));
        let names =
            ["speed_m_s", "min_separation_m", "losses", "steps_per_cpu_s", "contacts_per_action"];
        assert_eq!(names.map(unit), ["m/s", "m", "", "1/s", ""]);
        assert_eq!(flat("t", &Value::Null), None);
    }

    #[test]
    fn rows_that_differ_share_their_columns_and_what_is_left_out_is_told() {
        let table = listed("t", &json!([{"a": 1}, {"a": 2, "b": {"c": true}}])).unwrap();
        assert_eq!(table.columns, ["a", "c"]);
        assert_eq!(table.rows, [["1", "-"], ["2", "true"]]);
        assert_eq!(without_shared_head(&["id", "n.a", "n.b.c"]), ["id", "a", "b.c"]);
        assert_eq!(without_shared_head(&["a", "n.a"]), ["a", "n.a"]);
        assert_eq!(without_shared_head(&["m.a", "n.b"]), ["m.a", "n.b"]);
        let many = listed("t", &json!(vec![json!({"a": 1}); 250])).unwrap();
        assert_eq!((many.rows.len(), many.note.contains("50 are left out")), (MOST_ROWS, true));
        assert_eq!(listed("t", &json!([])), None);
    }

    #[test]
    fn numbers_of_every_size_stay_short() {
        let values = [0.0, 1.0, -2.5, 1.0 / 3.0, 1e-9, 2.5e12];
        assert_eq!(values.map(digits), ["0", "1", "-2.5", "0.333333", "1e-9", "2.5e12"]);
    }
}
