//! New keys and sections.

use super::blocks::insert_section_before;
use super::layout::{Layout, Statement, Step, line_start};
use super::members::{enclosing_table, insert_member};
use super::path::quoted_name;
use super::section::{are_sections, dotted, header, is_large, names_of, section_text};
use super::splice::{Splice, insert};
use super::value::NewValue;
use super::{EditError, edit_error};
use serde_json::{Map, Value as Json};
use toml_edit::{Item, Table, Value};

/// Makes a key with a value in the item at a path, and the tables on the way to it.
pub(super) fn create(
    layout: &Layout<'_>,
    path: &[Step],
    item: &Item,
    names: &[String],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    match item {
        Item::Value(Value::InlineTable(_)) => {
            let Some((table, depth)) = enclosing_table(layout, path) else { return Ok(Vec::new()) };
            let all = [&names_of(&path[depth..])[..], names].concat();
            let member = format!("{} = {}", dotted(&all), new.to_toml(None)?);
            Ok(insert_member(layout.text, table, &member))
        }
        Item::Table(table) if table.is_dotted() => add_dotted(layout, path, names, new),
        Item::Table(table) => add_to_table(layout, path, table, names, new),
        _ => Err(edit_error(
            format!("`{}` does not stand in a table", dotted(names)),
            "give a table",
        )),
    }
}

/// Makes a line after those of a table of dotted keys.
fn add_dotted(
    layout: &Layout<'_>,
    path: &[Step],
    names: &[String],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let runs = layout.statement_runs(path);
    let below = |s: &Statement| names_of(&s.path[path.len()..]).len();
    let mut own = runs.iter().flat_map(|run| &layout.statements[run.clone()]);
    // Keys below a header of their own are no pattern for the new line.
    let Some(last) = own.rfind(|s| !s.is_header && s.keys.len() > below(s)) else {
        return Ok(Vec::new());
    };
    let shown = last.keys.len() - below(last);
    let (Some(first), Some(end)) = (last.keys.first(), last.keys.get(shown.saturating_sub(1)))
    else {
        return Ok(Vec::new());
    };
    let head = &layout.text[line_start(layout.text, first.start)..end.end];
    let line = format!("{head}.{} = {}{}", dotted(names), new.to_toml(None)?, layout.new_line());
    Ok(vec![insert(last.lines.end, line)])
}

fn add_to_table(
    layout: &Layout<'_>,
    path: &[Step],
    table: &Table,
    names: &[String],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let Some((last, on_the_way)) = names.split_last() else { return Ok(Vec::new()) };
    let step = |name: &String| Step::Name(name.clone());
    let way = |names: &[String]| [path, &names.iter().map(step).collect::<Vec<_>>()].concat();
    match new {
        NewValue::Json(Json::Object(members)) if is_section(path, table, on_the_way, members) => {
            let block = section_text(layout, &way(names), members, false)?;
            Ok(vec![insert_block_after(layout, path, &block)])
        }
        NewValue::Json(Json::Array(items)) if are_sections(items) => {
            let list = way(names);
            let blocks = items.iter().filter_map(Json::as_object);
            let blocks: Result<Vec<String>, EditError> =
                blocks.map(|members| section_text(layout, &list, members, true)).collect();
            Ok(vec![insert_block_after(layout, path, &blocks?.join(layout.new_line()))])
        }
        _ => {
            let line =
                format!("{} = {}{}", quoted_name(last), new.to_toml(None)?, layout.new_line());
            Ok(vec![match on_the_way.is_empty() {
                true => insert_line(layout, path, &line),
                false => {
                    let head = header(layout, &way(on_the_way), false);
                    insert_block_after(layout, path, &format!("{head}{line}"))
                }
            }])
        }
    }
}

/// Returns whether a new table becomes a section rather than one in braces: at the top, among other sections, and if
/// it is large.
fn is_section(
    path: &[Step],
    table: &Table,
    on_the_way: &[String],
    members: &Map<String, Json>,
) -> bool {
    let is_among = table.iter().any(|(_, item)| item.as_table().is_some_and(|t| !t.is_dotted()));
    path.is_empty() || !on_the_way.is_empty() || is_among || is_large(members)
}

/// Inserts a section after everything at a path.
fn insert_block_after(layout: &Layout<'_>, path: &[Step], block: &str) -> Splice {
    let new_line = layout.new_line();
    match layout.statement_runs(path).last().filter(|_| !path.is_empty()) {
        Some(run) => insert(layout.lines(run).end, format!("{new_line}{block}")),
        None if layout.text.is_empty() => insert(0, block),
        None => insert(layout.text.len(), format!("{new_line}{block}")),
    }
}

/// Inserts a line into a section, after the section's own lines.
fn insert_line(layout: &Layout<'_>, path: &[Step], line: &str) -> Splice {
    let is_own = |s: &&Statement| s.is_header && s.path == path;
    let header = layout.statements.iter().position(|s| is_own(&s));
    let first = match header {
        Some(header) => header + 1,
        None if path.is_empty() => 0,
        // The only headers are those of sections in it.
        None => return insert_header_before(layout, path, line),
    };
    let lines = layout.statements[first..].iter().take_while(|s| !s.is_header);
    match (lines.last(), header) {
        (Some(last), _) => insert(last.lines.end, line),
        (None, Some(header)) => insert(layout.statements[header].lines.end, line),
        (None, None) => insert(end_of_head_comment(layout), line),
    }
}

/// Inserts a header, and a line, before the sections in it.
pub(super) fn insert_header_before(layout: &Layout<'_>, path: &[Step], line: &str) -> Splice {
    let block = format!("{}{line}", header(layout, path, false));
    match layout.statement_runs(path).first() {
        Some(run) => insert_section_before(layout, layout.lines(run).start, &block),
        None => insert_block_after(layout, &[], &block),
    }
}

/// Returns the place after a comment that heads the text, and the empty lines after it.
fn end_of_head_comment(layout: &Layout<'_>) -> usize {
    let mut at = 0;
    let lines = layout.text.split_inclusive('\n');
    let comments = lines.clone().take_while(|line| line.trim_start().starts_with('#'));
    at += comments.map(str::len).sum::<usize>();
    let empty = layout.text[at..].split_inclusive('\n').take_while(|line| line.trim().is_empty());
    match empty.map(str::len).sum::<usize>() {
        0 => 0,
        empty => at + empty,
    }
}
