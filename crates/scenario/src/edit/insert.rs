//! Inserted and moved elements.

use super::blocks::{inserted, moved, set_before};
use super::create::create;
use super::layout::{Layout, Reach, Step, count};
use super::lists::{ordered, with};
use super::path::Part;
use super::splice::{Splice, insert as insert_text};
use super::value::{has_floats, text_of};
use super::{Refusal, refusal};
use serde_json::Value as Json;
use toml_edit::{Item, Table, Value};

/// Inserts an element into an array, or a section into a list.
pub(super) fn insert(
    layout: &Layout<'_>,
    key: &[Part],
    at: Option<usize>,
    value: &Json,
) -> Result<Vec<Splice>, Refusal> {
    let Reach { path, item, rest } = layout.reach(key)?;
    if rest.is_empty() && matches!(path.last(), Some(Step::Index(_))) && item.is_table_like() {
        return Err(refusal("it is an element of an array itself", "name the array"));
    }
    let is_there = rest.is_empty() && !path.is_empty();
    let count = match item {
        _ if !is_there => 0,
        item if item.is_table_like() => 1,
        item => count(item).ok_or_else(|| {
            refusal("it is neither an array nor a list of sections", "set it, or name an array")
        })?,
    };
    let at = at.unwrap_or(count);
    if at > count {
        let cause = format!("there is no place {at}, as there are {count} elements");
        return Err(refusal(cause, "count from 0, or leave the place out"));
    }
    match item {
        _ if path.is_empty() && rest.is_empty() => Err(refusal("this is no array", "name a key")),
        _ if !is_there => {
            let list = Json::Array(vec![value.clone()]);
            create(layout, &path, item, &rest, super::value::New::Json(&list))
        }
        Item::Value(Value::Array(array)) => {
            let floats = !array.is_empty() && array.iter().all(has_floats);
            Ok(with(layout.text, array, at, &text_of(value, floats)?))
        }
        Item::ArrayOfTables(_) => inserted(layout, &path, at, value),
        Item::Table(table) if !table.is_dotted() => beside(layout, &path, table, at, value),
        item => in_brackets(item, at, value),
    }
}

/// Inserts a section beside one that stands alone, which becomes one of a list.
fn beside(
    layout: &Layout<'_>,
    path: &[Step],
    table: &Table,
    at: usize,
    value: &Json,
) -> Result<Vec<Splice>, Refusal> {
    let runs = layout.runs(path);
    let first = runs.first().map(|run| &layout.statements[run.start]);
    let is_first = first.is_some_and(|s| s.path == path);
    let (true, Some(span)) = (is_first, table.span()) else {
        let remedy = "write it as a list of sections, [[...]], in the text";
        return Err(refusal("it has no header of its own before its parts", remedy));
    };
    let mut splices = inserted(layout, path, usize::MAX, value)?;
    if at == 0 {
        let start = runs.first().map_or(0, |run| layout.lines(run).start);
        let block = |s: &Splice| s.text.trim_start_matches(['\r', '\n']).to_string();
        splices = splices.iter().map(|s| set_before(layout, start, &block(s))).collect();
    }
    splices.extend([insert_text(span.start, "["), insert_text(span.end, "]")]);
    Ok(splices)
}

/// Inserts a table in braces beside one that stands alone.
fn in_brackets(item: &Item, at: usize, value: &Json) -> Result<Vec<Splice>, Refusal> {
    let span = item.as_inline_table().filter(|table| !table.is_dotted()).and_then(|t| t.span());
    let Some(span) = span else {
        return Err(refusal("it is written by dotted keys", "write it as a section [...] first"));
    };
    let text = text_of(value, false)?;
    let (before, behind) = match at {
        0 => (format!("[{text}, "), "]".into()),
        _ => ("[".into(), format!(", {text}]")),
    };
    Ok(vec![insert_text(span.start, before), insert_text(span.end, behind)])
}

/// Moves an element to another number.
pub(super) fn relocate(
    layout: &Layout<'_>,
    key: &[Part],
    to: usize,
) -> Result<Vec<Splice>, Refusal> {
    let path = layout.find(key)?.path;
    let Some((Step::Index(from), list)) = path.split_last() else {
        let remedy = "name an element by its number, e.g. robots.1";
        return Err(refusal("it is no element of an array", remedy));
    };
    let item = layout.item(list);
    let count = count(item).unwrap_or(0);
    if to >= count {
        let cause = format!("there is no place {to}, as there are {count} elements");
        return Err(refusal(cause, "count from 0"));
    }
    let mut order: Vec<usize> = (0..count).filter(|number| number != from).collect();
    order.insert(to, *from);
    Ok(match item.as_array() {
        Some(array) => ordered(layout.text, array, &order),
        None => moved(layout, list, &order),
    })
}
