//! The items of a JSON text, in a list or one after the other. What is no JSON between them is left out.

use serde_json::{Deserializer, Error, Value as Json};
use std::collections::BTreeSet;

/// The greatest number of bytes of a name.
const MAX_KEY_BYTES: usize = 64;
/// The greatest number of names with which items begin.
const MAX_KEYS: usize = 1000;
/// How often the bytes of a text may be read in vain. Each broken item is read once; items within one another are what a
/// text has that is made to take long.
const MAX_FAILED_READS: usize = 4;

/// What stands at a place of a text.
#[derive(Debug)]
pub(super) enum Item {
    /// A value, on its line.
    Value(Json, usize),
    /// Text that is no JSON.
    Broken(Broken),
}

/// Text that is no JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Broken {
    /// The line of its begin.
    pub(super) line: usize,
    /// The number of items that it takes the place of, by its lines.
    pub(super) count: usize,
}

/// Reads items one after the other.
///
/// After one that is broken it goes on at the next brace behind which the name stands with which a good item began: values
/// within an item begin otherwise.
#[derive(Debug)]
pub(super) struct JsonItems<'a> {
    text: &'a str,
    at: usize,
    /// Number of the line at `line_at`.
    line: usize,
    line_at: usize,
    is_in_list: bool,
    first_keys: BTreeSet<&'a str>,
    /// Number of lines of the last good item, where there was one.
    item_lines: Option<usize>,
    failed_bytes: usize,
    first_error: Option<String>,
}

impl<'a> JsonItems<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            text,
            at: 0,
            line: 1,
            line_at: 0,
            is_in_list: false,
            first_keys: BTreeSet::new(),
            item_lines: None,
            failed_bytes: 0,
            first_error: None,
        }
    }

    /// Returns the next item; `None` at the end.
    ///
    /// # Errors
    /// When a text takes long to read, with the cause.
    pub(super) fn next(&mut self) -> Result<Option<Item>, String> {
        self.skip_separators();
        let line = self.line();
        let rest = &self.text[self.at..];
        let mut values = Deserializer::from_str(rest).into_iter::<Json>();
        match values.next() {
            Some(Ok(value)) => {
                self.learn_key(rest);
                self.at += values.byte_offset();
                self.item_lines = Some(self.line() - line + 1);
                Ok(Some(Item::Value(value, line)))
            }
            Some(Err(error)) => self.broken(line, &error).map(Some),
            // The end is missing.
            None if std::mem::take(&mut self.is_in_list) => {
                Ok(Some(Item::Broken(Broken { line, count: 1 })))
            }
            None => Ok(None),
        }
    }

    /// Returns what was wrong at the first broken item.
    pub(super) fn first_error(self) -> Option<String> {
        self.first_error
    }

    fn skip_separators(&mut self) {
        for byte in self.text[self.at..].bytes() {
            match byte {
                b',' | b' ' | b'\t' | b'\r' | b'\n' => {}
                b'[' if !self.is_in_list => self.is_in_list = true,
                b']' => self.is_in_list = false,
                _ => return,
            }
            self.at += 1;
        }
    }

    /// Returns the line of the present place. Every line is counted once.
    fn line(&mut self) -> usize {
        self.line += self.text[self.line_at..self.at].matches('\n').count();
        self.line_at = self.at;
        self.line
    }

    fn learn_key(&mut self, item: &'a str) {
        if self.first_keys.len() < MAX_KEYS {
            self.first_keys.extend(first_key(item));
        }
    }

    /// Passes over a broken item.
    fn broken(&mut self, line: usize, error: &Error) -> Result<Item, String> {
        let rest = &self.text[self.at..];
        if self.first_keys.is_empty() {
            self.learn_key(rest);
        }
        self.first_error.get_or_insert_with(|| error.to_string());
        self.failed_bytes += error_offset(rest, error);
        if self.failed_bytes / MAX_FAILED_READS > self.text.len() {
            return Err("broken items lie within one another".to_string());
        }
        let length = self.next_begin(rest);
        self.at += length;
        if self.at == self.text.len() {
            self.is_in_list = false;
        }
        let is_end = |c: char| c == ',' || c == ']' || c.is_whitespace();
        let lines = rest[..length].trim_end_matches(is_end).lines();
        let line_count = lines.filter(|line| !line.trim().is_empty()).count();
        let count = self.item_lines.map_or(1, |lines| (line_count + lines / 2) / lines);
        Ok(Item::Broken(Broken { line, count: count.max(1) }))
    }

    /// Returns where the next item begins in a text that begins with another one.
    fn next_begin(&self, text: &str) -> usize {
        let begin = text.match_indices('{').map(|(at, _)| at).find(|&at| {
            let is_within = text[..at].trim_end().ends_with(':');
            let is_known = || first_key(&text[at..]).is_some_and(|k| self.first_keys.contains(k));
            at > 0 && !is_within && is_known()
        });
        begin.unwrap_or(text.len())
    }
}

/// Returns the first name in an object.
fn first_key(text: &str) -> Option<&str> {
    let text = text.strip_prefix('{')?.trim_start().strip_prefix('"')?;
    let length = text.bytes().take(MAX_KEY_BYTES).position(|byte| byte == b'"')?;
    Some(&text[..length])
}

/// Returns how many bytes were read before an error.
fn error_offset(text: &str, error: &Error) -> usize {
    let lines_before = text.split_inclusive('\n').take(error.line().saturating_sub(1));
    lines_before.map(str::len).sum::<usize>() + error.column()
}
