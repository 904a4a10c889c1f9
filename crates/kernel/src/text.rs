//! Texts of a world for people, as data: the caller that prints them decides on the layout.

use crate::terminal::{display_cols, escape_controls_in_lines, pad_end};
use serde_json::Value;
use std::ops::Range;

/// Names and values, one per line.
pub type KeyValues = Vec<(String, String)>;

/// A statement about a state: as JSON, and in words.
#[derive(Debug, Clone, PartialEq)]
pub struct JsonTextReport {
    /// The form for machines, which `--json` prints.
    pub json: Value,
    /// The form for people; every line ends in a line feed.
    pub text: String,
}

/// Returns a line of a name and a value.
pub fn key_value_pair(name: &str, value: impl Into<String>) -> (String, String) {
    (name.into(), value.into())
}

/// Returns a number with its thousands set apart by spaces: `1 234 567`.
pub fn group_thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(digits.len() * 4 / 3);
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Returns a number with the given number of decimals; a value that rounds to 0 has no sign.
pub fn format_fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.chars().all(|c| matches!(c, '0' | '.')) => size.into(),
        _ => text,
    }
}

/// The first characters of a value that is a command to copy.
const COMMAND_PREFIX: &str = "sidestep ";

/// Columns of a line of text: the traditional width of a terminal.
pub const LINE_COLS: usize = 80;

/// Returns lines of names and values, the values below each other and broken into lines of
/// [`LINE_COLS`] columns where they have spaces. A command, which people copy, stays whole.
pub fn align_pairs(rows: &[(String, String)]) -> String {
    let rows: Vec<(String, String)> = rows.iter().map(printable_pair).collect();
    let width = rows.iter().map(|(name, _)| display_cols(name)).max().unwrap_or(0);
    // Two spaces before the name, and two before the value.
    let indent = width + 4;
    let line_break = format!("\n{:indent$}", "");
    let mut text = String::new();
    for (name, value) in &rows {
        let is_command = value.starts_with(COMMAND_PREFIX);
        let cols = if is_command { usize::MAX } else { LINE_COLS.saturating_sub(indent) };
        let value = wrap_text(value, cols).join(&line_break);
        text.push_str(&format!("  {}  {value}\n", pad_end(name, width)));
    }
    text
}

/// Returns a line with its controls as escapes: names and values may come from a file.
fn printable_pair((name, value): &(String, String)) -> (String, String) {
    (escape_controls_in_lines(name).into_owned(), escape_controls_in_lines(value).into_owned())
}

/// Returns text in lines of at most `cols` columns, broken at spaces; a longer word is a line. Text
/// that fits, and each line feed in it, stays unchanged.
pub fn wrap_text(text: &str, cols: usize) -> Vec<String> {
    text.split('\n').flat_map(|line| wrap_line(line, cols)).collect()
}

fn wrap_line(text: &str, cols: usize) -> Vec<String> {
    if display_cols(text) <= cols {
        return vec![text.into()];
    }
    let mut lines: Vec<String> = Vec::new();
    for word in split_at_spaces(text) {
        match lines.last_mut() {
            Some(line) if display_cols(line) + 1 + display_cols(word) <= cols => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

/// Splits text at its spaces, except one before a percent sign, because a number keeps its unit, and those of a command in
/// backticks, which people copy.
fn split_at_spaces(text: &str) -> Vec<&str> {
    let commands = quoted_commands(text);
    let mut words = Vec::new();
    let mut start = 0;
    for (space, _) in text.match_indices(' ') {
        let is_in_command = commands.iter().any(|command| command.contains(&space));
        if !is_in_command && !text[space + 1..].starts_with('%') {
            words.push(&text[start..space]);
            start = space + 1;
        }
    }
    words.push(&text[start..]);
    words
}

/// Returns the ranges of the commands in backticks.
fn quoted_commands(text: &str) -> Vec<Range<usize>> {
    let ticks: Vec<usize> = text.match_indices('`').map(|(at, _)| at).collect();
    let pairs = ticks.chunks_exact(2).map(|pair| pair[0] + 1..pair[1]);
    pairs.filter(|quoted| text[quoted.clone()].starts_with(COMMAND_PREFIX)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_not_parted_from_its_percent_sign() {
        assert_eq!(wrap_text("claim 93 %, record 0 %", 20), ["claim 93 %, record", "0 %"]);
        assert_eq!(wrap_text("a b  c", 3), ["a b", " c"]);
    }

    #[test]
    fn values_stand_below_each_other() {
        let rows = [key_value_pair("a", "1"), key_value_pair("long", "2")];
        assert_eq!(align_pairs(&rows), "  a     1\n  long  2\n");
    }

    #[test]
    fn long_values_are_broken_at_spaces_and_stand_below_their_first_line() {
        let words = ["seventeen_columns"; 6].join(" ");
        let told = align_pairs(&[key_value_pair("name", words)]);
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(lines.len(), 2, "{told}");
        assert!(lines[1].starts_with("        seventeen") && lines.iter().all(|l| l.len() <= 80));
        let command = format!("sidestep report {}", "x".repeat(99));
        assert_eq!(
            align_pairs(&[key_value_pair("look", &command)]),
            format!("  look  {command}\n")
        );
        assert_eq!(wrap_text(&"x".repeat(99), 80), ["x".repeat(99)], "a word is never broken");
        assert_eq!(wrap_text("a  b\nc", 80), ["a  b", "c"]);
    }

    #[test]
    fn a_command_in_backticks_stays_on_one_line() {
        let lines = wrap_text("it ended; `sidestep resume 'a b'` goes on with `a b`", 16);
        assert_eq!(lines, ["it ended;", "`sidestep resume 'a b'`", "goes on with `a", "b`"]);
    }

    #[test]
    fn names_of_a_file_stand_in_line_and_do_not_act_on_a_terminal() {
        let rows = [key_value_pair("東", "\x1b[31m1"), key_value_pair("long", "2\n3")];
        assert_eq!(align_pairs(&rows), "  東    \\u{1b}[31m1\n  long  2\n        3\n");
    }

    #[test]
    fn what_rounds_to_nothing_has_no_sign() {
        assert_eq!(
            [-1e-9, -0.0, 3.364e-13, -0.0005, -2.5].map(|x| format_fixed(x, 3)),
            ["0.000", "0.000", "0.000", "-0.001", "-2.500"]
        );
        assert_eq!((format_fixed(-0.4, 0), format_fixed(f64::NAN, 2)), ("0".into(), "NaN".into()));
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000].map(group_thousands), ["0", "999", "1 000"]);
        assert_eq!(group_thousands(1_234_567), "1 234 567");
    }
}
