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

/// Creates a key with a value in the item at a path, and its parent tables.
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
            format!("`{}` is not in a table", dotted(names)),
            "give the key of a table",
        )),
    }
}

/// Adds a line after those of a table of dotted keys, with the same prefix.
fn add_dotted(
    layout: &Layout<'_>,
    path: &[Step],
    names: &[String],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let runs = layout.statement_runs(path);
    // Number of names in a statement's path that follow the table's.
    let names_below = |s: &Statement| names_of(&s.path[path.len()..]).len();
    let mut statements = runs.iter().flat_map(|run| &layout.statements[run.clone()]);
    // Keys below a header of their own are no pattern for the new line.
    let Some(last) = statements.rfind(|s| !s.is_header && s.keys.len() > names_below(s)) else {
        return Ok(Vec::new());
    };
    let prefix_parts = last.keys.len() - names_below(last);
    let (Some(first), Some(prefix_end)) =
        (last.keys.first(), last.keys.get(prefix_parts.saturating_sub(1)))
    else {
        return Ok(Vec::new());
    };
    let prefix = &layout.text[line_start(layout.text, first.start)..prefix_end.end];
    let line = format!("{prefix}.{} = {}{}", dotted(names), new.to_toml(None)?, layout.new_line());
    Ok(vec![insert(last.lines.end, line)])
}

fn add_to_table(
    layout: &Layout<'_>,
    path: &[Step],
    table: &Table,
    names: &[String],
    new: NewValue<'_>,
) -> Result<Vec<Splice>, EditError> {
    let Some((last, parents)) = names.split_last() else { return Ok(Vec::new()) };
    match new {
        NewValue::Json(Json::Object(members)) if is_section(path, table, parents, members) => {
            let block = section_text(layout, &path_below(path, names), members, false)?;
            Ok(vec![insert_block_after(layout, path, &block)])
        }
        NewValue::Json(Json::Array(items)) if are_sections(items) => {
            let list = path_below(path, names);
            let mut blocks: Vec<String> = Vec::with_capacity(items.len());
            for members in items.iter().filter_map(Json::as_object) {
                blocks.push(section_text(layout, &list, members, true)?);
            }
            Ok(vec![insert_block_after(layout, path, &blocks.join(layout.new_line()))])
        }
        _ => {
            let line =
                format!("{} = {}{}", quoted_name(last), new.to_toml(None)?, layout.new_line());
            if parents.is_empty() {
                return Ok(vec![insert_line(layout, path, &line)]);
            }
            let header = header(layout, &path_below(path, parents), false);
            Ok(vec![insert_block_after(layout, path, &format!("{header}{line}"))])
        }
    }
}

fn path_below(path: &[Step], names: &[String]) -> Vec<Step> {
    path.iter().cloned().chain(names.iter().cloned().map(Step::Name)).collect()
}

/// Returns whether a new table becomes a section rather than an inline table: at the top, among other sections, and if
/// it is large.
fn is_section(
    path: &[Step],
    table: &Table,
    parents: &[String],
    members: &Map<String, Json>,
) -> bool {
    let has_sections =
        table.iter().any(|(_, item)| item.as_table().is_some_and(|t| !t.is_dotted()));
    path.is_empty() || !parents.is_empty() || has_sections || is_large(members)
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
        // The table exists only by the headers of sections in it, so it gets a header of its own.
        None => return insert_header_before(layout, path, line),
    };
    let lines = layout.statements[first..].iter().take_while(|s| !s.is_header);
    match (lines.last(), header) {
        (Some(last), _) => insert(last.lines.end, line),
        (None, Some(header)) => insert(layout.statements[header].lines.end, line),
        (None, None) => insert(end_of_head_comment(layout), line),
    }
}

/// Inserts a header, and a line below it, before the first section below `path`: after its header, the line would
/// belong to that section.
pub(super) fn insert_header_before(layout: &Layout<'_>, path: &[Step], line: &str) -> Splice {
    let block = format!("{}{line}", header(layout, path, false));
    match layout.statement_runs(path).first() {
        Some(run) => insert_section_before(layout, layout.lines(run).start, &block),
        None => insert_block_after(layout, &[], &block),
    }
}

/// Returns the offset after a comment at the start of the text, and the empty lines after it; 0 if no empty line
/// follows, because the comment is then about the first key or section.
fn end_of_head_comment(layout: &Layout<'_>) -> usize {
    let lines = layout.text.split_inclusive('\n');
    let comments = lines.take_while(|line| line.trim_start().starts_with('#'));
    let comment_bytes: usize = comments.map(str::len).sum();
    let rest = layout.text[comment_bytes..].split_inclusive('\n');
    let blanks = rest.take_while(|line| line.trim().is_empty());
    let blank_bytes: usize = blanks.map(str::len).sum();
    if blank_bytes == 0 { 0 } else { comment_bytes + blank_bytes }
}
