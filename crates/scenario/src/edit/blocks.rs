//! Lines and sections of a text: removed, inserted, moved.

use super::layout::{Layout, Step, above_comments, line_start};
use super::section::section_text;
use super::splice::{Splice, delete, insert, replace};
use super::{EditError, edit_error};
use serde_json::Value as Json;
use std::ops::Range;

/// Removes all lines of the item at a path, which may be spread over the text.
pub(super) fn remove_lines(layout: &Layout<'_>, path: &[Step]) -> Vec<Splice> {
    layout.statement_runs(path).iter().map(|run| delete(removable_lines(layout, run))).collect()
}

/// Returns the lines that go with removed statements: their comment, and a blank line.
fn removable_lines(layout: &Layout<'_>, run: &Range<usize>) -> Range<usize> {
    let text = layout.text;
    let mut lines = layout.lines(run);
    let is_section = layout.statements[run.start].is_header;
    let blank_after = blank_after(text, lines.end);
    let ends_block = blank_after.is_some() || lines.end == text.len();
    // Before further keys the comment stays, because it may be about these too.
    if !is_section && ends_block {
        lines.start = above_comments(text, lines.start);
    }
    // A section, or the last key of a block, takes one of the blank lines around it along, so that two do not meet.
    match (blank_before(text, lines.start), blank_after) {
        (Some(blank), _) if is_section || ends_block => blank..lines.end,
        // At the start of the text there is only the blank line after it.
        (None, Some(blank)) if is_section && lines.start == 0 => lines.start..blank,
        _ => lines,
    }
}

/// Returns the start of the empty line before a line.
fn blank_before(text: &str, start: usize) -> Option<usize> {
    let previous = line_start(text, start.checked_sub(1)?);
    matches!(&text[previous..start], "\n" | "\r\n").then_some(previous)
}

/// Returns the end of the empty line after a line.
fn blank_after(text: &str, end: usize) -> Option<usize> {
    let rest = &text[end..];
    let new_line = ["\n", "\r\n"].into_iter().find(|new_line| rest.starts_with(new_line))?;
    Some(end + new_line.len())
}

/// Inserts a section into a list at a number, which is at most the number of sections.
pub(super) fn insert_section(
    layout: &Layout<'_>,
    list: &[Step],
    at: usize,
    value: &Json,
) -> Result<Vec<Splice>, EditError> {
    let Json::Object(members) = value else {
        return Err(edit_error("a section of a list is a table", "give a table"));
    };
    let block = section_text(layout, list, members, true)?;
    if let Some(run) = layout.statement_runs(&element_path(list, at)).first() {
        return Ok(vec![insert_section_before(layout, layout.lines(run).start, &block)]);
    }
    let runs = layout.statement_runs(list);
    let end = runs.last().map_or(layout.text.len(), |run| layout.lines(run).end);
    Ok(vec![insert(end, format!("{}{block}", layout.new_line()))])
}

fn element_path(list: &[Step], number: usize) -> Vec<Step> {
    [list, &[Step::Index(number)]].concat()
}

/// Inserts a section before the lines of another: with an empty line between them if the text separates its sections
/// so.
pub(super) fn insert_section_before(layout: &Layout<'_>, start: usize, block: &str) -> Splice {
    let is_spaced = start == 0 || blank_before(layout.text, start).is_some();
    insert(start, format!("{block}{}", if is_spaced { layout.new_line() } else { "" }))
}

/// Moves the sections of a list into another order.
pub(super) fn reorder_sections(layout: &Layout<'_>, list: &[Step], order: &[usize]) -> Vec<Splice> {
    let mut splices = Vec::new();
    for (slot, &number) in order.iter().enumerate().filter(|(slot, number)| slot != *number) {
        let runs = layout.statement_runs(&element_path(list, slot));
        let mut ranges = runs.iter().map(|run| layout.lines(run));
        // The first lines of the old section get all of the new one; a section may be spread over the text.
        if let Some(first) = ranges.next() {
            splices.push(replace(first, element_text(layout, &element_path(list, number))));
        }
        splices.extend(ranges.map(delete));
    }
    splices
}

/// Returns all lines of a section of a list, in one piece even where they are spread over the text.
fn element_text(layout: &Layout<'_>, path: &[Step]) -> String {
    let runs = layout.statement_runs(path);
    let texts: Vec<&str> = runs.iter().map(|run| &layout.text[layout.lines(run)]).collect();
    texts.join(layout.new_line())
}
