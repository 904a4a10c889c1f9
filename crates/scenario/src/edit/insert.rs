//! Inserted and moved elements.

use super::blocks::{insert_section, insert_section_before, reorder_sections};
use super::create::create;
use super::layout::{KeyLookup, Layout, Step, count};
use super::lists::{insert_element, reorder_elements};
use super::path::KeyPart;
use super::splice::{Splice, insert as insert_text};
use super::value::{NewValue, has_floats, text_of};
use super::{EditError, edit_error};
use serde_json::Value as Json;
use toml_edit::{Item, Table, Value};

/// Inserts an element into an array, or a section into a list.
pub(super) fn insert(
    layout: &Layout<'_>,
    key: &[KeyPart],
    at: Option<usize>,
    value: &Json,
) -> Result<Vec<Splice>, EditError> {
    let KeyLookup { path, item, rest } = layout.look_up(key)?;
    if rest.is_empty() && matches!(path.last(), Some(Step::Index(_))) && item.is_table_like() {
        return Err(edit_error("it is an element of an array itself", "give the key of the array"));
    }
    let exists = rest.is_empty() && !path.is_empty();
    let count = match item {
        _ if !exists => 0,
        item if item.is_table_like() => 1,
        item => count(item).ok_or_else(|| {
            edit_error(
                "it is neither an array nor a list of sections",
                "set it, or give the key of an array",
            )
        })?,
    };
    let at = at.unwrap_or(count);
    if at > count {
        let cause = format!("there is no position {at}, as there are {count} elements");
        return Err(edit_error(cause, "count from 0, or leave the position out"));
    }
    match item {
        _ if path.is_empty() && rest.is_empty() => {
            Err(edit_error("this is no array", "give a key"))
        }
        _ if !exists => {
            let list = Json::Array(vec![value.clone()]);
            create(layout, &path, item, &rest, NewValue::Json(&list))
        }
        Item::Value(Value::Array(array)) => {
            let floats = !array.is_empty() && array.iter().all(has_floats);
            Ok(insert_element(layout.text, array, at, &text_of(value, floats)?))
        }
        Item::ArrayOfTables(_) => insert_section(layout, &path, at, value),
        Item::Table(table) if !table.is_dotted() => {
            promote_to_list(layout, &path, table, at, value)
        }
        item => promote_to_array(item, at, value),
    }
}

/// Inserts a section beside one that stands alone, which becomes one of a list.
fn promote_to_list(
    layout: &Layout<'_>,
    path: &[Step],
    table: &Table,
    at: usize,
    value: &Json,
) -> Result<Vec<Splice>, EditError> {
    let runs = layout.statement_runs(path);
    let first = runs.first().map(|run| &layout.statements[run.start]);
    let own_header = table.span().filter(|_| first.is_some_and(|s| s.path == path));
    let Some(span) = own_header else {
        let remedy = "write it as a list of sections, [[...]], in the text";
        return Err(edit_error("it has no header of its own before its parts", remedy));
    };
    let mut splices = insert_section(layout, path, usize::MAX, value)?;
    if at == 0 {
        let start = runs.first().map_or(0, |run| layout.lines(run).start);
        for splice in &mut splices {
            let block = splice.text.trim_start_matches(['\r', '\n']);
            *splice = insert_section_before(layout, start, block);
        }
    }
    // [section] becomes [[section]].
    splices.extend([insert_text(span.start, "["), insert_text(span.end, "]")]);
    Ok(splices)
}

/// Inserts an inline table beside one that stands alone.
fn promote_to_array(item: &Item, at: usize, value: &Json) -> Result<Vec<Splice>, EditError> {
    let span = item.as_inline_table().filter(|table| !table.is_dotted()).and_then(|t| t.span());
    let Some(span) = span else {
        return Err(edit_error(
            "it is written by dotted keys",
            "write it as a section [...] first",
        ));
    };
    let text = text_of(value, false)?;
    Ok(if at == 0 {
        vec![insert_text(span.start, format!("[{text}, ")), insert_text(span.end, "]")]
    } else {
        vec![insert_text(span.start, "["), insert_text(span.end, format!(", {text}]"))]
    })
}

/// Moves an element; the others keep their order.
pub(super) fn relocate(
    layout: &Layout<'_>,
    key: &[KeyPart],
    to: usize,
) -> Result<Vec<Splice>, EditError> {
    let path = layout.find(key)?.path;
    let Some((Step::Index(from), list)) = path.split_last() else {
        let remedy = "give the number of an element, e.g. robots.1";
        return Err(edit_error("it is no element of an array", remedy));
    };
    let item = layout.item(list);
    let count = count(item).unwrap_or(0);
    if to >= count {
        let cause = format!("there is no position {to}, as there are {count} elements");
        return Err(edit_error(cause, "count from 0"));
    }
    let mut order: Vec<usize> = (0..count).filter(|number| number != from).collect();
    order.insert(to, *from);
    Ok(match item.as_array() {
        Some(array) => reorder_elements(layout.text, array, &order),
        None => reorder_sections(layout, list, &order),
    })
}
