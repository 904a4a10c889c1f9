//! Elements of arrays in brackets.

use super::layout::{line_end, line_start};
use super::splice::{Splice, delete, insert, replace};
use std::ops::Range;
use toml_edit::Array;

/// An element that shares its lines with no other, so that it can be moved or removed with its comment.
struct OwnLines {
    /// Its lines, with the end of the last.
    lines: Range<usize>,
    /// Offset of the comma after it, which the last element may lack.
    comma: Option<usize>,
}

fn element_spans(array: &Array) -> Vec<Range<usize>> {
    array.iter().filter_map(toml_edit::Value::span).collect()
}

/// Inserts an element at a number, which is at most the number of elements.
pub(super) fn insert_element(text: &str, array: &Array, at: usize, value: &str) -> Vec<Splice> {
    let spans = element_spans(array);
    let Some(last) = spans.last() else {
        let open = array.span().map_or(0, |span| span.start + 1);
        return vec![insert(open, value)];
    };
    if let Some(next) = spans.get(at) {
        return match own_lines(text, next) {
            Some(OwnLines { lines, .. }) => {
                let indent = &text[lines.start..next.start];
                let new_line = line_ending(text, &lines);
                vec![insert(lines.start, format!("{indent}{value},{new_line}"))]
            }
            None => vec![insert(next.start, format!("{value}, "))],
        };
    }
    match own_lines(text, last) {
        Some(OwnLines { lines, comma }) => {
            let indent = &text[lines.start..last.start];
            let new_line = line_ending(text, &lines);
            // The new last element has a comma after it if the old one had.
            if comma.is_some() {
                vec![insert(lines.end, format!("{indent}{value},{new_line}"))]
            } else {
                vec![insert(last.end, ","), insert(lines.end, format!("{indent}{value}{new_line}"))]
            }
        }
        None => vec![insert(last.end, format!(", {value}"))],
    }
}

/// Removes an element with its own lines, or else with the comma that no longer separates two.
pub(super) fn remove_element(text: &str, array: &Array, number: usize) -> Vec<Splice> {
    let spans = element_spans(array);
    let Some(span) = spans.get(number) else { return Vec::new() };
    let previous = number.checked_sub(1).map(|n| &spans[n]);
    let next = spans.get(number + 1);
    if let Some(OwnLines { lines, comma }) = own_lines(text, span) {
        let mut splices = Vec::new();
        // If the last element had no comma after it, the new last one shall have none either.
        if next.is_none()
            && comma.is_none()
            && let Some(previous) = previous
            && let Some(comma) = comma_after(text, previous.end)
        {
            splices.push(delete(comma..comma + 1));
        }
        splices.push(delete(lines));
        return splices;
    }
    let range = match (previous, next) {
        (_, Some(next)) => span.start..next.start,
        (Some(previous), None) => previous.end..span.end,
        (None, None) => span.start..comma_after(text, span.end).map_or(span.end, |comma| comma + 1),
    };
    vec![delete(range)]
}

/// Puts the elements into another order; comments on their lines go with them.
pub(super) fn reorder_elements(text: &str, array: &Array, order: &[usize]) -> Vec<Splice> {
    let spans = element_spans(array);
    let own: Option<Vec<OwnLines>> = spans.iter().map(|span| own_lines(text, span)).collect();
    let mut splices = Vec::new();
    for (slot, &number) in order.iter().enumerate().filter(|(slot, number)| slot != *number) {
        splices.push(replace(spans[slot].clone(), &text[spans[number].clone()]));
        if let Some(own) = &own {
            let old = rest_of_line(text, &spans[slot], &own[slot]);
            let new = rest_of_line(text, &spans[number], &own[number]);
            splices.push(replace(old, &text[new]));
        }
    }
    splices
}

/// Returns the range of an element's comment: from its comma to the end of its line.
fn rest_of_line(text: &str, span: &Range<usize>, own: &OwnLines) -> Range<usize> {
    let start = own.comma.map_or(span.end, |comma| comma + 1);
    start..own.lines.end - line_ending(text, &own.lines).len()
}

/// Returns the lines of an element if no other is on them.
fn own_lines(text: &str, span: &Range<usize>) -> Option<OwnLines> {
    let start = line_start(text, span.start);
    let is_first = text[start..span.start].trim().is_empty();
    let end = line_end(text, span.end);
    let comma = comma_after(text, span.end);
    let rest = &text[comma.map_or(span.end, |comma| comma + 1).min(end)..end];
    let is_last = rest.ends_with('\n') && (rest.trim().is_empty() || rest.trim().starts_with('#'));
    let is_comma_near = comma.is_none_or(|comma| comma < end);
    (is_first && is_last && is_comma_near).then_some(OwnLines { lines: start..end, comma })
}

/// The line break of an element decides that of its new neighbors, in texts that mix both kinds.
fn line_ending<'t>(text: &'t str, lines: &Range<usize>) -> &'t str {
    if text[lines.clone()].ends_with("\r\n") { "\r\n" } else { "\n" }
}

/// Looks past blanks, line breaks and comments.
pub(super) fn comma_after(text: &str, offset: usize) -> Option<usize> {
    let offset = skip_space(text, offset);
    text[offset..].starts_with(',').then_some(offset)
}

/// Returns the offset after blanks, line breaks and comments.
pub(super) fn skip_space(text: &str, mut offset: usize) -> usize {
    loop {
        offset = text.len() - text[offset..].trim_start().len();
        if !text[offset..].starts_with('#') {
            return offset;
        }
        offset = line_end(text, offset);
    }
}
