//! Characters of drawings.

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
        return Err(edit_error("it is no drawing", "give a string of characters, e.g. map.ascii"));
    };
    let text = &layout.text[span.clone()];
    let inside = quoted(text);
    if text[inside.clone()] == *value || text[inside.clone()].replace("\r\n", "\n") == *value {
        let painted = paint_cells(&text[inside.clone()], cells)?;
        return Ok(vec![replace(span.start + inside.start..span.start + inside.end, painted)]);
    }
    // It is written with escapes, which hide the places of its characters.
    Ok(vec![replace(span, text_of(&Json::String(paint_cells(value, cells)?), false)?)])
}

/// Returns the range between the quotes of a string; a line break after the opening quotes does not belong to it.
fn quoted(text: &str) -> Range<usize> {
    let quotes = if text.starts_with("\"\"\"") || text.starts_with("'''") { 3 } else { 1 };
    let first = match &text[quotes..] {
        rest if quotes == 3 && rest.starts_with("\r\n") => 2,
        rest if quotes == 3 && rest.starts_with('\n') => 1,
        _ => 0,
    };
    quotes + first..text.len() - quotes
}

fn paint_cells(drawing: &str, cells: &[CharEdit]) -> Result<String, EditError> {
    let mut rows: Vec<Vec<char>> =
        drawing.split_inclusive('\n').map(|row| row.chars().collect()).collect();
    let first = usize::from(matches!(rows.first().map(Vec::as_slice), Some(['\n'] | ['\r', '\n'])));
    for &CharEdit { row, column, mark } in cells {
        if mark.is_control() || "\"'\\".contains(mark) {
            let cause = format!("{mark:?} is no character of a drawing");
            return Err(edit_error(cause, "draw with letters and signs other than quotes"));
        }
        let place = rows.get_mut(row.saturating_add(first)).and_then(|row| row.get_mut(column));
        match place.filter(|old| !old.is_control()) {
            Some(old) => *old = mark,
            None => {
                let cause = format!("row {row}, column {column} is outside of the drawing");
                return Err(edit_error(cause, "count from 0; a drawing does not grow"));
            }
        }
    }
    Ok(rows.into_iter().flatten().collect())
}
