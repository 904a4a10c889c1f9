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
    let places = match parent_item {
        Item::Value(Value::InlineTable(_)) => in_braces(layout, &path, parent),
        _ => in_lines(layout, &path),
    };
    Ok(places.into_iter().map(|place| replace(place, quoted_name(to))).collect())
}

fn in_braces(layout: &Layout<'_>, path: &[Step], parent: &[Step]) -> Vec<Range<usize>> {
    let Some((table, depth)) = enclosing_table(layout, parent) else { return Vec::new() };
    let all = members(layout.text, table);
    let own = all.iter().filter(|member| member.is_below(&path[depth..]));
    own.filter_map(|member| member.keys.get(path.len() - depth - 1).cloned()).collect()
}

fn in_lines(layout: &Layout<'_>, path: &[Step]) -> Vec<Range<usize>> {
    let names = |path: &[Step]| path.iter().filter(|s| matches!(s, Step::Name(_))).count();
    let own = names(path) - 1;
    let statements = layout.statements.iter().filter(|s| s.path.starts_with(path));
    let place = |s: &super::layout::Statement| {
        // The names before stand in the header.
        let hidden = names(&s.path) - s.keys.len();
        s.keys.get(own.checked_sub(hidden)?).cloned()
    };
    statements.filter_map(place).collect()
}
