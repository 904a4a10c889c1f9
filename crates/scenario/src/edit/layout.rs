//! Places of all keys and sections in a text.

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
    /// Whether it is a header.
    pub(super) is_header: bool,
    /// The parts of the key as written: those of the last names of the path.
    pub(super) keys: Vec<Range<usize>>,
    /// Its lines, with the end of the last.
    pub(super) lines: Range<usize>,
}

/// A text, and the places of all items in it.
pub(super) struct Layout<'t> {
    pub(super) text: &'t str,
    document: Document<&'t str>,
    /// Statements in the order of the text.
    pub(super) statements: Vec<Statement>,
}

/// The end of a key's path in a text.
pub(super) struct KeyLookup<'l> {
    /// The path to the last existing item, with every number.
    pub(super) path: Vec<Step>,
    /// The last existing item.
    pub(super) item: &'l Item,
    /// The remaining names, which do not exist.
    pub(super) rest: Vec<String>,
}

impl<'t> Layout<'t> {
    /// Reads a text.
    pub(super) fn parse(text: &'t str) -> Result<Self, TomlError> {
        let document = Document::parse(text)?;
        let mut statements = Vec::new();
        collect_statements(text, document.as_table(), &mut Vec::new(), &mut statements);
        statements.sort_by_key(|statement| statement.lines.start);
        Ok(Self { text, document, statements })
    }

    /// Follows a key as far as it leads.
    pub(super) fn look_up(&self, key: &[KeyPart]) -> Result<KeyLookup<'_>, EditError> {
        let mut reach =
            KeyLookup { path: Vec::new(), item: self.document.as_item(), rest: Vec::new() };
        for part in key {
            follow_part(&mut reach, part)?;
        }
        Ok(reach)
    }

    /// Follows a key to its end.
    pub(super) fn find(&self, key: &[KeyPart]) -> Result<KeyLookup<'_>, EditError> {
        let reach = self.look_up(key)?;
        match reach.rest.first() {
            None => Ok(reach),
            Some(name) => {
                let known = names_of(reach.item);
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                let remedy = crate::suggestion(name, &known);
                Err(edit_error(format!("there is no key `{name}`"), remedy))
            }
        }
    }

    /// Returns the item at the end of a path.
    pub(super) fn item(&self, path: &[Step]) -> &Item {
        path.iter().fold(self.document.as_item(), |item, step| {
            let found = match step {
                Step::Name(name) => item.get(name.as_str()),
                Step::Index(number) => item.get(*number),
            };
            found.unwrap_or(item)
        })
    }

    /// Returns the numbers of the statements at a path or below, in runs without others between them.
    pub(super) fn statement_runs(&self, path: &[Step]) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        let below = |s: &Statement| s.path.starts_with(path);
        for (at, _) in self.statements.iter().enumerate().filter(|(_, s)| below(s)) {
            match runs.last_mut() {
                Some(run) if run.end == at => run.end += 1,
                _ => runs.push(at..at + 1),
            }
        }
        runs
    }

    /// Returns the lines of statements, with the comment directly above them if they begin with a header.
    pub(super) fn lines(&self, run: &Range<usize>) -> Range<usize> {
        let (first, last) = (&self.statements[run.start], &self.statements[run.end - 1]);
        let start = first.lines.start;
        let start = if first.is_header { above_comments(self.text, start) } else { start };
        start..last.lines.end
    }

    /// Returns the end of line that the text uses.
    pub(super) fn new_line(&self) -> &'static str {
        let first = self.text.find('\n').unwrap_or(0);
        if self.text[..first].ends_with('\r') { "\r\n" } else { "\n" }
    }
}

/// Returns the names in a table.
fn names_of(item: &Item) -> Vec<String> {
    let table = item.as_table_like();
    table.map(|t| t.iter().map(|(key, _)| key.to_string()).collect()).unwrap_or_default()
}

/// Takes one part of a key.
fn follow_part(reach: &mut KeyLookup<'_>, part: &KeyPart) -> Result<(), EditError> {
    if !reach.rest.is_empty() {
        return push_missing(reach, part);
    }
    if let Some(count) = count(reach.item) {
        let number = match part.number() {
            Some(number) => number,
            None if count == 1 => 0,
            None => return Err(not_a_table(&part.name)),
        };
        let element = reach.item.get(number).ok_or_else(|| {
            let cause = format!("there is no element {number}, as there are {count}");
            edit_error(cause, "count from 0")
        })?;
        reach.path.push(Step::Index(number));
        reach.item = element;
        if part.number().is_some() {
            return Ok(());
        }
    }
    let table = reach.item.as_table_like().ok_or_else(|| not_a_table(&part.name))?;
    match table.get(&part.name) {
        Some(item) => {
            reach.path.push(Step::Name(part.name.clone()));
            reach.item = item;
        }
        // A section that stands alone.
        None if part.number() == Some(0) => {}
        None => push_missing(reach, part)?,
    }
    Ok(())
}

fn push_missing(reach: &mut KeyLookup<'_>, part: &KeyPart) -> Result<(), EditError> {
    match part.number() {
        None => reach.rest.push(part.name.clone()),
        // The new section will stand alone.
        Some(0) if !reach.rest.is_empty() => {}
        Some(number) => {
            return Err(edit_error(format!("there is no element {number}"), "count from 0"));
        }
    }
    Ok(())
}

/// Returns the number of elements of an array.
pub(super) fn count(item: &Item) -> Option<usize> {
    let sections = item.as_array_of_tables().map(toml_edit::ArrayOfTables::len);
    sections.or_else(|| item.as_array().map(toml_edit::Array::len))
}

fn not_a_table(name: &str) -> EditError {
    edit_error(
        format!("`{name}` does not stand in a table"),
        "give the element of an array by its number, e.g. robots.0.count",
    )
}

/// Collects the statements of a table and of the tables in it.
fn collect_statements(text: &str, table: &Table, path: &mut Vec<Step>, found: &mut Vec<Statement>) {
    for (name, item) in table.iter() {
        path.push(Step::Name(name.to_string()));
        match item {
            Item::None => {}
            Item::Value(value) => {
                let key = table.key(name).and_then(toml_edit::Key::span);
                if let (Some(key), Some(value)) = (key, value.span()) {
                    found.push(pair(text, path, key.start, value.end));
                }
            }
            Item::Table(inner) => push_section(text, inner, path, found),
            Item::ArrayOfTables(many) => {
                for (number, inner) in many.iter().enumerate() {
                    path.push(Step::Index(number));
                    push_section(text, inner, path, found);
                    path.pop();
                }
            }
        }
        path.pop();
    }
}

fn push_section(text: &str, table: &Table, path: &mut Vec<Step>, found: &mut Vec<Statement>) {
    if let (Some(_), Some(span)) = (table.position(), table.span()) {
        let brackets = text[span.start..].bytes().take_while(|b| *b == b'[').count();
        found.push(Statement {
            path: path.clone(),
            is_header: true,
            keys: keys_at(text, span.start + brackets),
            lines: line_start(text, span.start)..line_end(text, span.end),
        });
    }
    collect_statements(text, table, path, found);
}

fn pair(text: &str, path: &[Step], key: usize, end: usize) -> Statement {
    let start = line_start(text, key);
    Statement {
        path: path.to_vec(),
        is_header: false,
        keys: keys_at(text, start),
        lines: start..line_end(text, end),
    }
}

/// Returns the start of the line of a place.
pub(super) fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |end| end + 1)
}

/// Returns the end of the line of a place, after its line break.
pub(super) fn line_end(text: &str, at: usize) -> usize {
    text[at..].find('\n').map_or(text.len(), |end| at + end + 1)
}

/// Returns the start of the comment that ends where a line begins, or the start of that line.
pub(super) fn above_comments(text: &str, mut start: usize) -> usize {
    while start > 0 {
        let before = line_start(text, start - 1);
        if !text[before..start].trim_start().starts_with('#') {
            break;
        }
        start = before;
    }
    start
}
