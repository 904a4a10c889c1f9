//! Replaced values, and removed keys.

use super::blocks::remove_lines;
use super::create::{create, insert_header_before};
use super::layout::{KeyLookup, Layout, Step};
use super::lists::remove_element;
use super::members::{enclosing_table, remove_members, replace_members};
use super::path::KeyPart;
use super::splice::{Splice, replace};
use super::value::{NewValue, is_same};
use super::{EditError, edit_error};
use serde_json::{Map, Value as Json};
use toml_edit::{Item, Value};

/// The size of the largest table that is set key by key: each key searches the whole text.
const MAX_KEYS: usize = 1000;

/// Sets a value in place of the old one, or creates the key.
pub(super) fn set(
    layout: &Layout<'_>,
    key: &[KeyPart],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let KeyLookup { path, item, rest } = layout.look_up(key)?;
    if rest.is_empty() {
        set_item(layout, &path, item, new)
    } else {
        create(layout, &path, item, &rest, new)
    }
}

/// Returns the path of a key, and the pieces that set its value if it has one written as a value, not by dotted keys.
/// Replacing a value leaves the text valid TOML, and everything else in its place.
pub(super) fn replacement(
    layout: &Layout<'_>,
    key: &[KeyPart],
    text: &str,
) -> Option<(Vec<Step>, Option<Splice>)> {
    let KeyLookup { mut path, item, rest } = layout.look_up(key).ok()?;
    let span = match item {
        Item::Value(old) if rest.is_empty() && !is_dotted(old) => old.span(),
        _ => None,
    };
    path.extend(rest.into_iter().map(Step::Name));
    Some((path, span.map(|span| replace(span, text))))
}

/// Returns the pieces that give a header to a table that has none and gets keys of its own.
pub(super) fn add_header(
    layout: &Layout<'_>,
    key: &[KeyPart],
    value: &Json,
) -> Result<Vec<Splice>, EditError> {
    let KeyLookup { path, item, rest } = layout.look_up(key)?;
    let table = item.as_table().filter(|t| t.position().is_none() && !t.is_dotted());
    let (Some(table), Json::Object(members)) = (table, value) else { return Ok(Vec::new()) };
    let has_new_keys = members.keys().any(|name| !table.contains_key(name));
    if rest.is_empty() && !path.is_empty() && has_new_keys {
        Ok(vec![insert_header_before(layout, &path, "")])
    } else {
        Ok(Vec::new())
    }
}

/// Removes a key, an element or a section.
pub(super) fn remove(layout: &Layout<'_>, key: &[KeyPart]) -> Result<Vec<Splice>, EditError> {
    let path = layout.find(key)?.path;
    if path.is_empty() {
        return Err(edit_error("this is the whole text", "give a key of it"));
    }
    Ok(removal_splices(layout, &path))
}

/// Returns the pieces that remove the item at a path.
pub(super) fn removal_splices(layout: &Layout<'_>, path: &[Step]) -> Vec<Splice> {
    let Some((last, parent)) = path.split_last() else { return Vec::new() };
    match (layout.item(parent), last) {
        (Item::Value(Value::Array(array)), Step::Index(number)) => {
            remove_element(layout.text, array, *number)
        }
        (Item::Value(Value::InlineTable(_)), _) => match enclosing_table(layout, parent) {
            Some((table, depth)) => remove_members(layout.text, table, &path[depth..]),
            None => Vec::new(),
        },
        _ => remove_lines(layout, path),
    }
}

fn set_item(
    layout: &Layout<'_>,
    path: &[Step],
    item: &Item,
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    match (item, new) {
        (Item::Value(old), _) if is_dotted(old) => set_dotted(layout, path, old, new),
        (Item::Value(old), _) => set_value(old, new),
        (_, NewValue::Json(Json::Object(members))) if item.is_table_like() => {
            set_members(layout, path, item, members)
        }
        (Item::ArrayOfTables(_), NewValue::Json(Json::Array(elements)))
            if elements.iter().all(Json::is_object) && !elements.is_empty() =>
        {
            set_sections(layout, path, item, elements)
        }
        _ => replace_sections(layout, path, new),
    }
}

fn is_dotted(value: &Value) -> bool {
    value.as_inline_table().is_some_and(toml_edit::InlineTable::is_dotted)
}

/// Sets a value in place of dotted keys in an inline table.
fn set_dotted(
    layout: &Layout<'_>,
    path: &[Step],
    old: &Value,
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    if let NewValue::Json(json) = new
        && is_same(old, json)
    {
        return Ok(Vec::new());
    }
    let Some((table, depth)) = enclosing_table(layout, path) else { return Ok(Vec::new()) };
    let value = new.to_toml(None)?;
    Ok(replace_members(layout.text, table, &path[depth..], &value))
}

/// Replaces a value that is written as a value; parts that stay the same keep their text.
fn set_value(old: &Value, new: NewValue<'_>) -> Result<Vec<Splice>, EditError> {
    match (old, new) {
        (_, NewValue::Json(json)) if is_same(old, json) => Ok(Vec::new()),
        (Value::Array(old), NewValue::Json(Json::Array(new))) if old.len() == new.len() => {
            set_each(old.iter().zip(new))
        }
        (Value::InlineTable(table), NewValue::Json(Json::Object(new)))
            if table.len() == new.len() && new.keys().all(|key| table.contains_key(key)) =>
        {
            set_each(table.iter().filter_map(|(key, old)| Some((old, new.get(key)?))))
        }
        _ => {
            let text = new.to_toml(Some(old))?;
            Ok(old.span().map(|span| replace(span, text)).into_iter().collect())
        }
    }
}

fn set_each<'v>(
    pairs: impl Iterator<Item = (&'v Value, &'v Json)>,
) -> Result<Vec<Splice>, EditError> {
    let mut splices = Vec::new();
    for (old, new) in pairs {
        splices.extend(set_value(old, NewValue::Json(new))?);
    }
    Ok(splices)
}

/// Sets the keys of a section one by one, so that those that stay the same keep their text.
fn set_members(
    layout: &Layout<'_>,
    path: &[Step],
    item: &Item,
    members: &Map<String, Json>,
) -> Result<Vec<Splice>, EditError> {
    let table = item.as_table_like();
    let old: Vec<&str> = table.iter().flat_map(|table| table.iter()).map(|(key, _)| key).collect();
    if members.len() + old.len() > MAX_KEYS {
        return Err(edit_error("the table has too many keys", "set them one by one"));
    }
    let member_path = |name: &str| [path, &[Step::Name(name.into())]].concat();
    let mut splices: Vec<Splice> = Vec::new();
    for key in old.iter().filter(|key| !members.contains_key(**key)) {
        splices.extend(removal_splices(layout, &member_path(key)));
    }
    // Lines come before sections: after the header of one they would belong to it.
    let (sections, lines): (Vec<_>, Vec<_>) = members.iter().partition(|(_, v)| may_be_section(v));
    for (name, value) in lines.into_iter().chain(sections) {
        let new = NewValue::Json(value);
        splices.extend(match table.and_then(|table| table.get(name)) {
            Some(member) => set_item(layout, &member_path(name), member, new)?,
            None => create(layout, path, item, std::slice::from_ref(name), new)?,
        });
    }
    Ok(splices)
}

fn may_be_section(value: &Json) -> bool {
    match value {
        Json::Object(_) => true,
        Json::Array(items) => items.iter().any(Json::is_object),
        _ => false,
    }
}

/// Sets the sections of a list one by one, so that those that stay the same keep their text.
fn set_sections(
    layout: &Layout<'_>,
    path: &[Step],
    item: &Item,
    elements: &[Json],
) -> Result<Vec<Splice>, EditError> {
    let count = super::layout::count(item).unwrap_or(0);
    if elements.len() + count > MAX_KEYS {
        return Err(edit_error("the list has too many sections", "set them one by one"));
    }
    let element_path = |number| [path, &[Step::Index(number)]].concat();
    let mut splices = Vec::new();
    for (number, element) in elements.iter().enumerate() {
        splices.extend(match item.get(number) {
            Some(old) => set_item(layout, &element_path(number), old, NewValue::Json(element))?,
            None => super::blocks::insert_section(layout, path, count, element)?,
        });
    }
    for number in elements.len()..count {
        splices.extend(removal_splices(layout, &element_path(number)));
    }
    Ok(splices)
}

/// Sets a value in place of sections, which have no span of their own: they are removed, and the key is created.
fn replace_sections(
    layout: &Layout<'_>,
    path: &[Step],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let Some((Step::Name(name), parent)) = path.split_last() else {
        return Err(edit_error("a section of a list is a table", "give a table"));
    };
    let created = create(layout, parent, layout.item(parent), std::slice::from_ref(name), new)?;
    Ok([removal_splices(layout, path), created].concat())
}
