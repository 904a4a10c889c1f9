//! Positions of all keys and sections in a text.

use super::path::{KeyPart, keys_at};
use super::{EditError, edit_error};
pub(super) use crate::locate::PathStep as Step;
use std::ops::Range;
use toml_edit::{Document, Item, Table, TomlError};

/// A header of a section, or a key with its value, on lines of its own.
#[derive(Debug)]
pub(super) struct Statement {
    /// The path from the root; sections of a list end in their number.
    pub(super) path: Vec<Step>,
    pub(super) is_header: bool,
    /// The parts of the key as written: those of the last names of the path.
    pub(super) keys: Vec<Range<usize>>,
    /// Its lines, with the end of the last.
    pub(super) lines: Range<usize>,
}

/// A text, and the positions of all items in it.
pub(super) struct Layout<'t> {
    pub(super) text: &'t str,
    document: Document<&'t str>,
    /// Statements in the order of the text.
    pub(super) statements: Vec<Statement>,
}

/// The result of looking a key up in a text: the part of its path that exists, and the rest.
pub(super) struct KeyLookup<'l> {
    /// The path to the last existing item, with every number.
    pub(super) path: Vec<Step>,
    /// The last existing item.
    pub(super) item: &'l Item,
    /// The remaining names, which do not exist.
    pub(super) rest: Vec<String>,
}

impl<'t> Layout<'t> {
    /// Fails if the text is not TOML.
    pub(super) fn parse(text: &'t str) -> Result<Self, TomlError> {
        let document = Document::parse(text)?;
        let mut statements = Vec::new();
        collect_statements(text, document.as_table(), &mut Vec::new(), &mut statements);
        statements.sort_by_key(|statement| statement.lines.start);
        Ok(Self { text, document, statements })
    }

    /// Follows a key as far as it exists.
    pub(super) fn look_up(&self, key: &[KeyPart]) -> Result<KeyLookup<'_>, EditError> {
        let mut lookup =
            KeyLookup { path: Vec::new(), item: self.document.as_item(), rest: Vec::new() };
        for part in key {
            follow_part(&mut lookup, part)?;
        }
        Ok(lookup)
    }

    /// Follows a key to its end; a key that does not exist is an error with a suggestion.
    pub(super) fn find(&self, key: &[KeyPart]) -> Result<KeyLookup<'_>, EditError> {
        let lookup = self.look_up(key)?;
        match lookup.rest.first() {
            None => Ok(lookup),
            Some(name) => {
                let known = names_of(lookup.item);
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                let remedy = crate::suggestion(name, &known);
                Err(edit_error(format!("there is no key `{name}`"), remedy))
            }
        }
    }

    /// A step that does not exist is skipped; paths come from the text itself.
    pub(super) fn item(&self, path: &[Step]) -> &Item {
        path.iter().fold(self.document.as_item(), |item, step| {
            let child = match step {
                Step::Name(name) => item.get(name.as_str()),
                Step::Index(number) => item.get(*number),
            };
            child.unwrap_or(item)
        })
    }

    /// Returns the numbers of the statements at a path or below, in runs without others between them.
    pub(super) fn statement_runs(&self, path: &[Step]) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (k, statement) in self.statements.iter().enumerate() {
            if !statement.path.starts_with(path) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.end == k => run.end += 1,
                _ => runs.push(k..k + 1),
            }
        }
        runs
    }

    /// Returns the lines of statements, with the comment directly above them if they begin with a header.
    pub(super) fn lines(&self, run: &Range<usize>) -> Range<usize> {
        let first = &self.statements[run.start];
        let last = &self.statements[run.end - 1];
        let mut start = first.lines.start;
        if first.is_header {
            start = above_comments(self.text, start);
        }
        start..last.lines.end
    }

    /// Returns the end of line that the text uses.
    pub(super) fn new_line(&self) -> &'static str {
        let first = self.text.find('\n').unwrap_or(0);
        if self.text[..first].ends_with('\r') { "\r\n" } else { "\n" }
    }
}

fn names_of(item: &Item) -> Vec<String> {
    let table = item.as_table_like();
    table.map(|t| t.iter().map(|(key, _)| key.to_string()).collect()).unwrap_or_default()
}

/// A name that does not exist goes to `rest`, as it may be created; a number that does not exist is an error.
fn follow_part(lookup: &mut KeyLookup<'_>, part: &KeyPart) -> Result<(), EditError> {
    if !lookup.rest.is_empty() {
        return push_missing(lookup, part);
    }
    if let Some(count) = count(lookup.item) {
        let number = match part.number() {
            Some(number) => number,
            None if count == 1 => 0,
            None => return Err(not_a_table(&part.name)),
        };
        let element = lookup.item.get(number).ok_or_else(|| {
            let cause = format!("there is no element {number}, as there are {count}");
            edit_error(cause, "count from 0")
        })?;
        lookup.path.push(Step::Index(number));
        lookup.item = element;
        if part.number().is_some() {
            return Ok(());
        }
    }
    let table = lookup.item.as_table_like().ok_or_else(|| not_a_table(&part.name))?;
    match table.get(&part.name) {
        Some(item) => {
            lookup.path.push(Step::Name(part.name.clone()));
            lookup.item = item;
        }
        // A single section may have the number 0, as in a list of one.
        None if part.number() == Some(0) => {}
        None => push_missing(lookup, part)?,
    }
    Ok(())
}

fn push_missing(lookup: &mut KeyLookup<'_>, part: &KeyPart) -> Result<(), EditError> {
    match part.number() {
        None => lookup.rest.push(part.name.clone()),
        // The new section will be a single one, which may have the number 0.
        Some(0) if !lookup.rest.is_empty() => {}
        Some(number) => {
            return Err(edit_error(format!("there is no element {number}"), "count from 0"));
        }
    }
    Ok(())
}

/// Returns the number of elements; `None` for what is neither an array nor a list of sections.
pub(super) fn count(item: &Item) -> Option<usize> {
    let sections = item.as_array_of_tables().map(toml_edit::ArrayOfTables::len);
    sections.or_else(|| item.as_array().map(toml_edit::Array::len))
}

fn not_a_table(name: &str) -> EditError {
    edit_error(
        format!("`{name}` is not in a table"),
        "give the number of an element of an array, e.g. robots.0.count",
    )
}

/// The order is that of the tables, not of the text: [`Layout::parse`] sorts.
fn collect_statements(
    text: &str,
    table: &Table,
    path: &mut Vec<Step>,
    statements: &mut Vec<Statement>,
) {
    for (name, item) in table.iter() {
        path.push(Step::Name(name.to_string()));
        match item {
            Item::None => {}
            Item::Value(value) => {
                let key = table.key(name).and_then(toml_edit::Key::span);
                if let (Some(key), Some(value)) = (key, value.span()) {
                    statements.push(key_value(text, path, key.start, value.end));
                }
            }
            Item::Table(inner) => push_section(text, inner, path, statements),
            Item::ArrayOfTables(many) => {
                for (number, inner) in many.iter().enumerate() {
                    path.push(Step::Index(number));
                    push_section(text, inner, path, statements);
                    path.pop();
                }
            }
        }
        path.pop();
    }
}

fn push_section(text: &str, table: &Table, path: &mut Vec<Step>, statements: &mut Vec<Statement>) {
    // A table without a position exists only by dotted keys, or by the headers of tables in it.
    if let (Some(_), Some(span)) = (table.position(), table.span()) {
        let brackets = text[span.start..].bytes().take_while(|b| *b == b'[').count();
        statements.push(Statement {
            path: path.clone(),
            is_header: true,
            keys: keys_at(text, span.start + brackets),
            lines: line_start(text, span.start)..line_end(text, span.end),
        });
    }
    collect_statements(text, table, path, statements);
}

/// Returns the statement of a key that starts, and whose value ends, at these offsets.
fn key_value(text: &str, path: &[Step], start: usize, end: usize) -> Statement {
    let start = line_start(text, start);
    Statement {
        path: path.to_vec(),
        is_header: false,
        keys: keys_at(text, start),
        lines: start..line_end(text, end),
    }
}

/// Offset after the last line break before `offset`.
pub(super) fn line_start(text: &str, offset: usize) -> usize {
    text[..offset].rfind('\n').map_or(0, |end| end + 1)
}

/// Returns the end of the line at an offset, after its line break.
pub(super) fn line_end(text: &str, offset: usize) -> usize {
    text[offset..].find('\n').map_or(text.len(), |end| offset + end + 1)
}

/// Returns the start of the comment that ends where a line begins, or the start of that line.
pub(super) fn above_comments(text: &str, mut start: usize) -> usize {
    while start > 0 {
        let previous = line_start(text, start - 1);
        if !text[previous..start].trim_start().starts_with('#') {
            break;
        }
        start = previous;
    }
    start
}
