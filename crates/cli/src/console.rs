//! What the command prints: results on standard output, everything else on standard error.

use serde::Serialize;
use sidestep_document::Table;
use std::fmt::Display;
use std::io::{IsTerminal, Write};

/// Columns of text where the terminal does not say how many it has.
const DEFAULT_COLS: u16 = 100;

/// Where a command's words go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    json: bool,
    quiet: bool,
}

impl Console {
    /// A console for people, or for machines with `json`; `quiet` keeps to the result.
    pub(crate) fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet }
    }

    /// A console for nobody: what is part of something larger.
    pub(crate) fn silent() -> Self {
        Self { json: false, quiet: true }
    }

    /// Whether progress may be shown: to a person who has not asked for silence.
    pub(crate) fn shows_progress(self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }

    /// Prints a command's result: one JSON object, or the words of `text`.
    pub(crate) fn result(self, json: &impl Serialize, text: impl FnOnce() -> String) {
        if self.json {
            let object = serde_json::to_string_pretty(json).expect("results are plain data");
            write_out(&format!("{object}\n"));
        } else {
            write_out(&text());
        }
    }

    /// As [`Console::result`], with a shorter text for the quiet.
    pub(crate) fn result_or_short(
        self,
        json: &impl Serialize,
        short: impl FnOnce() -> String,
        text: impl FnOnce() -> String,
    ) {
        self.result(json, || if self.quiet { short() } else { text() });
    }

    /// A remark for people, on standard error.
    pub(crate) fn note(self, text: impl Display) {
        if !self.quiet && !self.json {
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }

    /// Something that is wrong but stops nothing.
    pub(crate) fn warn(self, text: impl Display) {
        let _ = writeln!(std::io::stderr(), "warning: {text}");
    }

    /// Why the command ends before its goal.
    pub(crate) fn error(self, text: impl Display) {
        let _ = writeln!(std::io::stderr(), "error: {text}");
    }
}

/// Columns that text may take.
pub(crate) fn columns() -> u16 {
    terminal_size::terminal_size().map_or(DEFAULT_COLS, |(width, _)| width.0)
}

/// A reader that has gone (`| head`) is no error: it has seen what it wanted.
fn write_out(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// A number with its thousands set apart by spaces: `1 234 567`.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let first = digits.len() % 3;
    let (head, tail) = digits.split_at(first);
    let groups = tail.as_bytes().chunks(3).map(|c| std::str::from_utf8(c).unwrap_or_default());
    let head = (!head.is_empty()).then_some(head);
    head.into_iter().chain(groups).collect::<Vec<_>>().join(" ")
}

/// Lines of names and values, the values below each other.
pub(crate) fn aligned(rows: &[(String, String)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, value)| format!("  {name:<width$}  {value}\n")).collect()
}

/// A table in columns, numbers to the right; what its cells say is left as it is.
pub(crate) fn in_columns(table: &Table) -> String {
    let rows: Vec<Vec<&str>> = table.rows.iter().map(|row| table.cells(row).collect()).collect();
    let head: Vec<&str> = table.columns.iter().map(String::as_str).collect();
    let width = |k: usize| {
        let all = std::iter::once(&head).chain(&rows);
        all.map(|row| row[k].chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |row: &Vec<&str>| {
        let cell = |(k, text): (usize, &&str)| match k {
            0 => format!("{text:<width$}", width = widths[k]),
            _ => format!("{text:>width$}", width = widths[k]),
        };
        let cells: Vec<String> = row.iter().enumerate().map(cell).collect();
        format!("  {}\n", cells.join("   ").trim_end())
    };
    std::iter::once(&head).chain(&rows).map(line).collect()
}

/// Seconds as people say them: `0.83 s`, `4 min 12 s`, `2 h 05 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.2} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000].map(grouped), ["0", "999", "1 000"]);
        assert_eq!(grouped(1_234_567), "1 234 567");
    }

    #[test]
    fn durations_are_said_in_fitting_units() {
        assert_eq!(duration(0.834), "0.83 s");
        assert_eq!(duration(252.4), "4 min 12 s");
        assert_eq!(duration(7500.0), "2 h 05 min");
    }

    #[test]
    fn values_stand_below_each_other() {
        let rows = [("a".into(), "1".into()), ("long".into(), "2".into())];
        assert_eq!(aligned(&rows), "  a     1\n  long  2\n");
    }
}
