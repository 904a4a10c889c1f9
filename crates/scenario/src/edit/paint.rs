//! Characters of maps that are drawn in text.

use super::layout::Layout;
use super::path::KeyPart;
use super::splice::{Splice, replace};
use super::value::text_of;
use super::{CharEdit, EditError, edit_error};
use serde_json::Value as Json;
use std::ops::Range;

/// Changes characters of a string; its quotes and its lines stay.
pub(super) fn paint(
    layout: &Layout<'_>,
    key: &[KeyPart],
    cells: &[CharEdit],
) -> Result<Vec<Splice>, EditError> {
    let item = layout.find(key)?.item;
    let (Some(value), Some(span)) = (item.as_str(), item.span()) else {
        return Err(edit_error(
            "it is no map drawn in text",
            "give the key of a string, e.g. map.ascii",
        ));
    };
    let text = &layout.text[span.clone()];
    let inside = range_in_quotes(text);
    let raw = &text[inside.clone()];
    if raw == value || raw.replace("\r\n", "\n") == value {
        let new = paint_cells(raw, cells)?;
        return Ok(vec![replace(span.start + inside.start..span.start + inside.end, new)]);
    }
    // The text has escapes, so the columns of its characters are not those of the map: it is written anew.
    let new = paint_cells(value, cells)?;
    Ok(vec![replace(span, text_of(&Json::String(new), false)?)])
}

/// Returns the range between the quotes of a string; a line break after the opening quotes does not belong to it.
fn range_in_quotes(text: &str) -> Range<usize> {
    if !text.starts_with("\"\"\"") && !text.starts_with("'''") {
        return 1..text.len() - 1;
    }
    let rest = &text[3..];
    let line_break = if rest.starts_with("\r\n") {
        2
    } else if rest.starts_with('\n') {
        1
    } else {
        0
    };
    3 + line_break..text.len() - 3
}

/// Returns a map with some of its characters replaced.
fn paint_cells(map: &str, cells: &[CharEdit]) -> Result<String, EditError> {
    let mut rows: Vec<Vec<char>> =
        map.split_inclusive('\n').map(|row| row.chars().collect()).collect();
    // An empty first row is no row of the map: it is the rest of the line with the quotes.
    let has_empty_first = matches!(rows.first().map(Vec::as_slice), Some(['\n'] | ['\r', '\n']));
    let first = usize::from(has_empty_first);
    for &CharEdit { row, column, mark } in cells {
        // These would have to be escaped, or would end the string.
        if mark.is_control() || "\"'\\".contains(mark) {
            let cause = format!("{mark:?} is no character of a map");
            return Err(edit_error(cause, "draw with letters and signs other than quotes"));
        }
        let cell = rows.get_mut(row.saturating_add(first)).and_then(|row| row.get_mut(column));
        match cell.filter(|old| !old.is_control()) {
            Some(old) => *old = mark,
            None => {
                let cause = format!("row {row}, column {column} is outside of the map");
                return Err(edit_error(cause, "count from 0; a map does not grow"));
            }
        }
    }
    Ok(rows.into_iter().flatten().collect())
}
