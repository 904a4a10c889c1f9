//! Numbers of `summary.json` as tables.

use super::text::format_count;
use serde_json::{Map, Value};
use sidestep_document::Table;
use sidestep_kernel::ports::table::split_unit;
use sidestep_scenario::{MetricInfo, MetricLabel, metric_label};

/// Largest number of rows; the number of rows left out is shown.
const MAX_ROWS: usize = 200;
/// Largest number of values of a list that are shown; longer lists are only counted.
const MAX_VALUES: usize = 16;

/// Returns the unit that a name ends in, or nothing.
pub(super) fn unit_of(name: &str) -> String {
    split_unit(name).1.unwrap_or_default().into()
}

/// Returns a tree of values as one row for each leaf, in the words of its world: first the informative ones, then,
/// folded, those that stayed 0 or have no value.
pub(super) fn tree_tables(title: &str, tree: &Value, meanings: &[MetricInfo]) -> Vec<Table> {
    let columns = ["metric", "value", "unit", "meaning", "name in summary.json"];
    let note = "Counts that stayed 0, and what has no value.";
    let mut informative = Table::new(title, "", &columns);
    let mut zero = Table::new(format!("{title} that stayed 0"), note, &columns).folded();
    for (path, value) in leaves(tree) {
        let MetricLabel { words, unit, meaning } = metric_label(meanings, &path);
        let is_zero = ["0", "-", "none", "false"].contains(&value.as_str());
        let unit = unit.unwrap_or_default().to_string();
        let table = if is_zero { &mut zero } else { &mut informative };
        table.push_row([capitalize(&words), value, unit, meaning.to_string(), path]);
    }
    [informative, zero].into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// Returns words with a capital first letter, as at the beginning of a sentence.
pub(super) fn capitalize(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}

/// Returns a list of trees as one row for each of them, with a column for each of their leaves.
pub(super) fn list_table(title: &str, list: &Value, meanings: &[MetricInfo]) -> Option<Table> {
    let rows: Vec<Vec<(String, String)>> = list.as_array()?.iter().map(leaves).collect();
    let shown = &rows[..rows.len().min(MAX_ROWS)];
    let mut columns: Vec<&str> = Vec::new();
    for (path, _) in shown.iter().flatten() {
        if !columns.contains(&path.as_str()) {
            columns.push(path);
        }
    }
    if columns.is_empty() {
        return None;
    }
    let note = omitted_rows_note(rows.len(), shown.len());
    let heads: Vec<String> = columns.iter().map(|name| column_label(name, meanings)).collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new(title, note, &heads).folded();
    for row in shown {
        table.push_row(columns.iter().map(|column| value_at(row, column)));
    }
    Some(table)
}

/// Returns the value at a path among the leaves of a tree; a dash if there is none.
fn value_at(leaves: &[(String, String)], path: &str) -> String {
    let leaf = leaves.iter().find(|(own, _)| own == path);
    leaf.map_or("-".into(), |(_, value)| value.clone())
}

/// Returns the head of a column: the metric in words, with its unit.
fn column_label(name: &str, meanings: &[MetricInfo]) -> String {
    let MetricLabel { words, unit, .. } = metric_label(meanings, name);
    unit.map_or_else(|| words.clone(), |unit| format!("{words} ({unit})"))
}

/// Returns the number of rows not shown, as text; empty if all are shown.
pub(super) fn omitted_rows_note(all: usize, shown: usize) -> String {
    match all - shown {
        0 => String::new(),
        n => format!(
            "The first {} of {} rows; {} are left out.",
            format_count(shown as u64),
            format_count(all as u64),
            format_count(n as u64)
        ),
    }
}

/// Returns every leaf of a tree with its path, such as `contacts.wall`; null values are left out.
fn leaves(tree: &Value) -> Vec<(String, String)> {
    let mut found = Vec::new();
    match tree {
        Value::Object(map) => descend(map, "", &mut found),
        Value::Null => {}
        other => found.push(("value".into(), format_value(other))),
    }
    found
}

fn descend(map: &Map<String, Value>, above: &str, found: &mut Vec<(String, String)>) {
    for (key, value) in map {
        let path = if above.is_empty() { key.clone() } else { format!("{above}.{key}") };
        match value {
            Value::Object(inside) => descend(inside, &path, found),
            other => found.push((path, format_value(other))),
        }
    }
}

fn format_value(value: &Value) -> String {
    match value {
        Value::Null => "-".into(),
        Value::String(text) => text.clone(),
        Value::Number(number) => self::format_number(number),
        Value::Array(list) if list.is_empty() => "none".into(),
        Value::Array(list) if list.iter().any(|v| v.is_array() || v.is_object()) => {
            format!("{} entries", list.len())
        }
        Value::Array(list) if list.len() > MAX_VALUES => format!("{} values", list.len()),
        Value::Array(list) => list.iter().map(format_value).collect::<Vec<_>>().join(", "),
        other => other.to_string(),
    }
}

/// Formats whole numbers unchanged, and others with six digits.
fn format_number(number: &serde_json::Number) -> String {
    match (number.as_u64(), number.as_f64()) {
        (Some(whole), _) => whole.to_string(),
        (None, Some(value)) => format_digits(value),
        _ => number.to_string(),
    }
}

/// Formats a value with six digits, as short as possible.
pub(super) fn format_digits(value: f64) -> String {
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

    const MEANINGS: [MetricInfo; 2] = [
        MetricInfo { name: "gap_m", words: "least gap", unit: "", meaning: "between two" },
        MetricInfo { name: "hits.*", words: "hits of a *", unit: "", meaning: "times" },
    ];

    #[test]
    fn metrics_are_told_in_words_and_those_that_say_nothing_are_folded() {
        let tree = json!({"gap_m": 0.123456789, "hits": {"wall": 3, "door": 0}, "none": null});
        let [telling, silent] = &tree_tables("t", &tree, &MEANINGS)[..] else {
            panic!("two tables")
        };
        let rows = [
            ["Least gap", "0.123457", "m", "between two", "gap_m"],
            ["Hits of a wall", "3", "", "times", "hits.wall"],
        ];
        assert_eq!(telling.rows, rows.map(|row| row.map(String::from).to_vec()));
        let names: Vec<&str> = silent.rows.iter().map(|row| row[4].as_str()).collect();
        assert_eq!((names, silent.is_folded), (vec!["hits.door", "none"], true));
        assert!(tree_tables("t", &Value::Null, &MEANINGS).is_empty());
    }

    #[test]
    fn rows_that_differ_share_their_columns_and_what_is_left_out_is_told() {
        let list = json!([{"a": 1}, {"a": 2, "b": {"gap_m": true}}]);
        let table = list_table("t", &list, &MEANINGS).unwrap();
        assert_eq!(table.columns, ["a", "least gap (m)"]);
        assert_eq!(table.rows, [["1", "-"], ["2", "true"]]);
        let many = list_table("t", &json!(vec![json!({"a": 1}); 250]), &[]).unwrap();
        assert_eq!((many.rows.len(), many.note.contains("50 are left out")), (MAX_ROWS, true));
        assert_eq!(list_table("t", &json!([]), &[]), None);
    }

    #[test]
    fn numbers_of_every_size_stay_short() {
        let values = [0.0, 1.0, -2.5, 1.0 / 3.0, 1e-9, 2.5e12];
        assert_eq!(values.map(format_digits), ["0", "1", "-2.5", "0.333333", "1e-9", "2.5e12"]);
    }
}
