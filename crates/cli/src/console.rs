//! Output of the command: results on standard output, everything else on standard error.

use serde::Serialize;
use sidestep_document::Table;
use std::fmt::Display;
use std::io::{IsTerminal, Write};

pub(crate) use sidestep::kernel::words::{aligned, grouped};
pub(crate) use sidestep_session::report::duration;

/// Columns of text if the terminal does not report its width.
const DEFAULT_COLS: u16 = 100;

/// The destination of a command's output.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    json: bool,
    quiet: bool,
}

impl Console {
    /// Returns a console for people, or with `json` for programs; `quiet` prints results alone.
    pub(crate) fn new(json: bool, quiet: bool) -> Self {
        Self { json, quiet }
    }

    /// Whether progress may be shown: not with `json` or `quiet`.
    pub(crate) fn shows_progress(self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }

    /// Prints a command's result: one JSON object, or the result of `text`.
    pub(crate) fn result(self, json: &impl Serialize, text: impl FnOnce() -> String) {
        if self.json {
            let object = serde_json::to_string_pretty(json).expect("results are plain data");
            write_out(&format!("{object}\n"));
        } else {
            write_out(&text());
        }
    }

    /// Prints a result like [`Console::result`], with a shorter text if the console is quiet.
    pub(crate) fn result_or_short(
        self,
        json: &impl Serialize,
        short: impl FnOnce() -> String,
        text: impl FnOnce() -> String,
    ) {
        self.result(json, || if self.quiet { short() } else { text() });
    }

    /// Prints a remark for people to standard error.
    pub(crate) fn note(self, text: impl Display) {
        if !self.quiet && !self.json {
            let _ = writeln!(std::io::stderr(), "{text}");
        }
    }

    /// Prints a warning: something is wrong, but the command goes on.
    pub(crate) fn warn(self, text: impl Display) {
        let _ = writeln!(std::io::stderr(), "warning: {text}");
    }

    /// Prints the reason why the command failed.
    pub(crate) fn error(self, text: impl Display) {
        let _ = writeln!(std::io::stderr(), "error: {text}");
    }
}

/// Returns the number of columns that text may take.
pub(crate) fn columns() -> u16 {
    terminal_size::terminal_size().map_or(DEFAULT_COLS, |(width, _)| width.0)
}

/// Writes to standard output. A reader that has closed the pipe (`| head`) is not an error.
fn write_out(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Returns a table as text in columns, with numbers aligned to the right.
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
