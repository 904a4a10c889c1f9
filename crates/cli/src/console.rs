//! Output of the command: results on standard output, everything else on standard error.

use crate::exit::Failure;
use serde::Serialize;
use sidestep::kernel::terminal::{
    display_cols, escape_controls, escape_controls_in_json, escape_controls_in_lines, pad_end,
    pad_start,
};
use sidestep_document::Table;
use std::borrow::Cow;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::ops::Range;

pub(crate) use sidestep::kernel::text::{
    LINE_COLS, align_pairs, format_fixed, group_thousands, wrap_text,
};
pub(crate) use sidestep_session::report::format_duration;

/// Most columns of prose: longer lines are hard to read.
const MAX_PROSE_COLS: u16 = 100;

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

    /// Returns whether progress may be shown: not with `json` or `quiet`.
    pub(crate) fn shows_progress(self) -> bool {
        !self.quiet && std::io::stderr().is_terminal()
    }

    /// Prints a command's result: one JSON object, or the result of `text`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn print_result(
        self,
        json: &impl Serialize,
        text: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        if !self.json {
            return write_out(&escape_controls_in_lines(&text()));
        }
        let object = serde_json::to_string_pretty(json).expect("results are plain data");
        write_out(&format!("{}\n", escape_controls_in_json(&object)))
    }

    /// Prints a result like [`Console::print_result`], with a shorter text if the console is quiet.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn print_result_or_short(
        self,
        json: &impl Serialize,
        short: &str,
        text: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        self.print_result(json, || if self.quiet { short.to_string() } else { text() })
    }

    /// Prints a remark for people to standard error.
    pub(crate) fn note(self, text: impl Display) {
        if !self.quiet && !self.json {
            print_to_stderr(&text.to_string());
        }
    }

    /// Prints a warning: something is wrong, but the command continues.
    pub(crate) fn warn(self, text: impl Display) {
        let warning = format!("warning: {text}");
        let lines = wrap_text(&escape_controls_in_lines(&warning), usize::from(prose_columns()));
        print_to_stderr(&lines.join("\n"));
    }

    /// Prints the reason why the command failed.
    pub(crate) fn error(self, text: impl Display) {
        print_to_stderr(&format!("error: {text}"));
    }
}

/// Returns the number of columns that text may take: those of the terminal; without one, the value of the variable
/// `COLUMNS`, or [`LINE_COLS`].
pub(crate) fn terminal_columns() -> u16 {
    let terminal = terminal_size::terminal_size().map(|(width, _)| width.0);
    terminal.or_else(columns_variable).unwrap_or(LINE_COLS as u16)
}

/// Returns the value of the variable `COLUMNS`, if it is a positive number.
fn columns_variable() -> Option<u16> {
    std::env::var("COLUMNS").ok()?.parse().ok().filter(|columns| *columns > 0)
}

/// Returns the number of columns that prose may take.
pub(crate) fn prose_columns() -> u16 {
    terminal_columns().min(MAX_PROSE_COLS)
}

/// Prints lines to standard error, without what a terminal would execute: they may quote a file.
fn print_to_stderr(lines: &str) {
    let _ = writeln!(std::io::stderr(), "{}", escape_controls_in_lines(lines));
}

/// Writes to standard output.
fn write_out(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    check_write(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// Checks the result of writing to standard output. A reader that has closed the pipe (`| head`) is not an error.
///
/// # Errors
/// When writing failed in another way.
pub(crate) fn check_write(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            let remedy =
                "send it somewhere that takes it; files that the command has written are whole";
            Err(Failure::other(format!("cannot write to standard output: {e}"), remedy))
        }
        _ => Ok(()),
    }
}

/// Returns a table as text in columns, numbers aligned to the right: in several blocks, each with the
/// first column, where it is wider than a line.
pub(crate) fn format_columns(table: &Table) -> String {
    let head: Line<'_> = table.columns.iter().map(|column| escape_controls(column)).collect();
    let rows = table.rows.iter().map(|row| table.cells(row).map(escape_controls).collect());
    let lines: Vec<Line<'_>> = std::iter::once(head).chain(rows).collect();
    let blocks = blocks(&widths(&lines));
    let texts: Vec<String> = blocks.iter().map(|block| block_text(&lines, block)).collect();
    texts.join("\n")
}

/// The cells of a line of a table, as a terminal can show them.
type Line<'a> = Vec<Cow<'a, str>>;

/// Columns before each line of a table.
const INDENT: usize = 2;

/// Columns between two columns of a table.
const COLUMN_GAP: usize = 3;

/// Largest width of a first column that stands beside the others: half a line, so that each block holds some of them.
const MAX_FIRST_COLUMN_COLS: usize = 40;

fn widths(lines: &[Line<'_>]) -> Vec<usize> {
    let mut widths = vec![0; lines.first().map_or(0, Vec::len)];
    for line in lines {
        for (width, cell) in widths.iter_mut().zip(line) {
            *width = display_cols(cell).max(*width);
        }
    }
    widths
}

/// Returns the columns beside the first of each block: as many as a line has room for.
fn blocks(widths: &[usize]) -> Vec<Range<usize>> {
    let first = widths.first().copied().filter(|w| *w <= MAX_FIRST_COLUMN_COLS).unwrap_or(0);
    let mut blocks: Vec<Range<usize>> = Vec::new();
    let mut used = usize::MAX;
    for (k, width) in widths.iter().enumerate().skip(1) {
        let added = COLUMN_GAP + width;
        match blocks.last_mut() {
            Some(block) if used.saturating_add(added) <= LINE_COLS => {
                block.end = k + 1;
                used += added;
            }
            _ => {
                blocks.push(k..k + 1);
                used = INDENT + first + added;
            }
        }
    }
    if blocks.is_empty() {
        // A table of one column.
        blocks.push(1..1);
    }
    blocks
}

/// Returns the first column and those of a block; a first column that is too wide stands on lines of
/// its own.
fn block_text(lines: &[Line<'_>], block: &Range<usize>) -> String {
    let widths = widths(lines);
    let first = widths.first().copied().unwrap_or(0);
    let mut text = String::new();
    for line in lines {
        let mut cells = String::new();
        for k in block.clone() {
            cells.push_str(&format!("{:COLUMN_GAP$}{}", "", pad_start(&line[k], widths[k])));
        }
        if first <= MAX_FIRST_COLUMN_COLS {
            let joined = pad_end(&line[0], first) + &cells;
            text.push_str(&format!("  {}\n", joined.trim_end()));
        } else {
            text.push_str(&format!("  {}\n  {}\n", line[0], cells.trim_end()));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(first: &str, columns: usize) -> Table {
        let heads: Vec<String> = (0..columns).map(|k| format!("heading {k}")).collect();
        let heads: Vec<&str> =
            std::iter::once("what").chain(heads.iter().map(String::as_str)).collect();
        let mut table = Table::new("t", "", &heads);
        let cells = (0..columns).map(|k| format!("{k}.5 [{k}.25, {k}.75]"));
        table.push_row(std::iter::once(first.to_string()).chain(cells));
        table
    }

    #[test]
    fn a_table_that_fits_is_one_block() {
        assert_eq!(
            format_columns(&table("pc", 2)),
            "  what          heading 0          heading 1\n  pc     0.5 [0.25, 0.75]   1.5 [1.25, \
             1.75]\n"
        );
    }

    #[test]
    fn no_line_of_a_wide_table_is_longer_than_80_columns_and_no_cell_is_lost() {
        for first in ["pc", &"a long name of a variant".repeat(3)] {
            let text = format_columns(&table(first, 9));
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
            assert!((0..9).all(|k| text.contains(&format!("{k}.5 [{k}.25"))), "{text}");
            assert_eq!(text.matches(first).count(), text.matches("what").count(), "{text}");
        }
    }
}
