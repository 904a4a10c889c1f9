//! Renamed keys.

use super::layout::{Layout, Step};
use super::members::{enclosing_table, members};
use super::path::{KeyPart, quoted_name};
use super::splice::{Splice, replace};
use super::{EditError, edit_error};
use std::ops::Range;
use toml_edit::{Item, Value};

/// Gives the last part of a key another name, everywhere it is written.
pub(super) fn rename(
    layout: &Layout<'_>,
    key: &[KeyPart],
    to: &str,
) -> Result<Vec<Splice>, EditError> {
    let path = layout.find(key)?.path;
    let Some((Step::Name(from), parent)) = path.split_last() else {
        return Err(edit_error("an element of an array has no name", "give a key"));
    };
    if to.is_empty() {
        return Err(edit_error("the new name is empty", "give a name"));
    }
    if from == to {
        return Ok(Vec::new());
    }
    let parent_item = layout.item(parent);
    if parent_item.get(to).is_some() {
        return Err(edit_error(format!("there is a key `{to}` already"), "give another name"));
    }
    let spans = match parent_item {
        Item::Value(Value::InlineTable(_)) => spans_in_table(layout, &path, parent),
        _ => spans_in_lines(layout, &path),
    };
    Ok(spans.into_iter().map(|span| replace(span, quoted_name(to))).collect())
}

/// Returns the positions of the last name of a path in an inline table: dotted keys repeat it.
fn spans_in_table(layout: &Layout<'_>, path: &[Step], parent: &[Step]) -> Vec<Range<usize>> {
    let Some((table, depth)) = enclosing_table(layout, parent) else { return Vec::new() };
    let all = members(layout.text, table);
    let own = all.iter().filter(|member| member.is_below(&path[depth..]));
    own.filter_map(|member| member.keys.get(path.len() - depth - 1).cloned()).collect()
}

/// Returns the positions of the last name of a path in keys and headers.
fn spans_in_lines(layout: &Layout<'_>, path: &[Step]) -> Vec<Range<usize>> {
    let mut spans = Vec::new();
    for statement in layout.statements.iter().filter(|s| s.path.starts_with(path)) {
        // The first names of a key's path are in the header above it.
        let in_header = count_names(&statement.path) - statement.keys.len();
        let key = (count_names(path) - 1).checked_sub(in_header);
        spans.extend(key.and_then(|key| statement.keys.get(key).cloned()));
    }
    spans
}

fn count_names(path: &[Step]) -> usize {
    path.iter().filter(|step| matches!(step, Step::Name(_))).count()
}
