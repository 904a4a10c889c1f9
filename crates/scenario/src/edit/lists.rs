//! Elements of arrays in brackets.

use super::layout::{line_end, line_start};
use super::splice::{Splice, delete, insert, replace};
use std::ops::Range;
use toml_edit::Array;

/// An element that has lines of its own.
struct OwnLines {
    /// Its lines, with the end of the last.
    lines: Range<usize>,
    /// The comma after it.
    comma: Option<usize>,
}

/// Returns the places of the elements.
fn element_spans(array: &Array) -> Vec<Range<usize>> {
    array.iter().filter_map(toml_edit::Value::span).collect()
}

/// Inserts an element at a number, which is at most the number of elements.
pub(super) fn insert_element(text: &str, array: &Array, at: usize, value: &str) -> Vec<Splice> {
    let places = element_spans(array);
    let Some(last) = places.last() else {
        let open = array.span().map_or(0, |span| span.start + 1);
        return vec![insert(open, value)];
    };
    if let Some(next) = places.get(at) {
        return match own_lines(text, next) {
            Some(OwnLines { lines, .. }) => {
                let (indent, end) = (&text[lines.start..next.start], end_of_line(text, &lines));
                vec![insert(lines.start, format!("{indent}{value},{end}"))]
            }
            None => vec![insert(next.start, format!("{value}, "))],
        };
    }
    match own_lines(text, last) {
        Some(OwnLines { lines, comma }) => {
            let (indent, end) = (&text[lines.start..last.start], end_of_line(text, &lines));
            let after = if comma.is_some() { "," } else { "" };
            let line = insert(lines.end, format!("{indent}{value}{after}{end}"));
            let missing = comma.is_none().then(|| insert(last.end, ","));
            missing.into_iter().chain([line]).collect()
        }
        None => vec![insert(last.end, format!(", {value}"))],
    }
}

/// Removes an element.
pub(super) fn remove_element(text: &str, array: &Array, number: usize) -> Vec<Splice> {
    let places = element_spans(array);
    let Some(place) = places.get(number) else { return Vec::new() };
    let (before, next) = (number.checked_sub(1).map(|n| &places[n]), places.get(number + 1));
    if let Some(OwnLines { lines, comma }) = own_lines(text, place) {
        // The last one stays without a comma, if it had none.
        let is_last = next.is_none() && comma.is_none();
        let comma = before.filter(|_| is_last).and_then(|before| comma_after(text, before.end));
        let comma = comma.map(|comma| delete(comma..comma + 1));
        return comma.into_iter().chain([delete(lines)]).collect();
    }
    let range = match (before, next) {
        (_, Some(next)) => place.start..next.start,
        (Some(before), None) => before.end..place.end,
        (None, None) => place.start..comma_after(text, place.end).map_or(place.end, |at| at + 1),
    };
    vec![delete(range)]
}

/// Puts the elements into another order; comments on their lines go with them.
pub(super) fn reorder_elements(text: &str, array: &Array, order: &[usize]) -> Vec<Splice> {
    let places = element_spans(array);
    let own: Option<Vec<OwnLines>> = places.iter().map(|place| own_lines(text, place)).collect();
    let behind = |number: usize| {
        let OwnLines { lines, comma } = &own.as_ref()?[number];
        let start = comma.map_or(places[number].end, |comma| comma + 1);
        Some(start..lines.end - end_of_line(text, lines).len())
    };
    let mut splices = Vec::new();
    for (slot, &number) in order.iter().enumerate().filter(|(slot, number)| slot != *number) {
        splices.push(replace(places[slot].clone(), &text[places[number].clone()]));
        if let (Some(old), Some(new)) = (behind(slot), behind(number)) {
            splices.push(replace(old, &text[new]));
        }
    }
    splices
}

fn own_lines(text: &str, place: &Range<usize>) -> Option<OwnLines> {
    let start = line_start(text, place.start);
    let is_first = text[start..place.start].trim().is_empty();
    let end = line_end(text, place.end);
    let comma = comma_after(text, place.end);
    let rest = &text[comma.map_or(place.end, |comma| comma + 1).min(end)..end];
    let is_last = rest.ends_with('\n') && (rest.trim().is_empty() || rest.trim().starts_with('#'));
    let is_near = comma.is_none_or(|comma| comma < end);
    (is_first && is_last && is_near).then_some(OwnLines { lines: start..end, comma })
}

/// Returns the end of line of lines.
fn end_of_line<'t>(text: &'t str, lines: &Range<usize>) -> &'t str {
    match &text[lines.clone()] {
        lines if lines.ends_with("\r\n") => "\r\n",
        _ => "\n",
    }
}

/// Returns the place of the comma after a value, if there is one.
pub(super) fn comma_after(text: &str, at: usize) -> Option<usize> {
    let at = skip_space(text, at);
    text[at..].starts_with(',').then_some(at)
}

/// Returns the place after blanks, ends of lines and comments.
pub(super) fn skip_space(text: &str, mut at: usize) -> usize {
    loop {
        at = text.len() - text[at..].trim_start().len();
        match text[at..].starts_with('#') {
            true => at = line_end(text, at),
            false => return at,
        }
    }
}
