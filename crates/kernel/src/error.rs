//! The one error for wrong input, from any file or option.
//!
//! Promise E1: no input panics the program. Every error gives the place, the cause and the remedy;
//! the command then ends with exit code 2 and has written nothing.

use crate::terminal::{ELLIPSIS, display_cols, escape_controls, shorten};
use std::fmt;
use std::ops::Range;

/// Most columns of a line of the text that an error quotes.
const MAX_QUOTE_COLS: usize = 160;

/// Columns of a line that is too long, shown before the wrong part.
const QUOTE_COLS_BEFORE: usize = 60;

/// Most characters of a cause and of a remedy.
const MAX_SENTENCE_CHARS: usize = 4000;

/// Wrong input: a file, an option, a table that does not sum to 1.
///
/// Displayed as `place:line:column: cause`, the offending line with a caret under it where
/// the text is known, and `help: remedy`, with controls as escapes: all of it may quote a file. The key is for programs
/// that edit the text by its keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputError {
    place: String,
    /// The position, boxed like the key, because results carry errors by value and are as large as these.
    position: Option<Box<TextPosition>>,
    key: Option<Box<str>>,
    cause: String,
    remedy: String,
}

/// A place in a text file; lines and columns count from 1, columns in characters.
#[derive(Debug, Clone, PartialEq, Eq)]
struct TextPosition {
    line: usize,
    column: usize,
    /// Line and column after the wrong part, where it is known.
    end: Option<(usize, usize)>,
    /// The line itself, where the text is known.
    text: Option<String>,
}

impl InputError {
    /// Creates an error in `place` (a file's path, or an option's name as the user typed it).
    pub fn new(
        place: impl fmt::Display,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            place: place.to_string(),
            position: None,
            key: None,
            cause: cause.into(),
            remedy: remedy.into(),
        }
    }

    /// Adds line and column (both from 1).
    #[must_use]
    pub fn with_position(mut self, line: usize, column: usize) -> Self {
        self.position = Some(Box::new(TextPosition { line, column, end: None, text: None }));
        self
    }

    /// Adds line and column of the byte at `offset` in `text`, and quotes that line.
    #[must_use]
    pub fn with_byte_offset(mut self, text: &str, offset: usize) -> Self {
        let offset = floor_char_boundary(text, offset);
        let (line, column) = line_and_column(text, offset);
        let line_start = text[..offset].rfind('\n').map_or(0, |i| i + 1);
        let quoted = text[line_start..].lines().next().unwrap_or("").to_string();
        self.position =
            Some(Box::new(TextPosition { line, column, end: None, text: Some(quoted) }));
        self
    }

    /// Adds line and column of the bytes `span` of `text` and of their end, and quotes the first
    /// line.
    #[must_use]
    pub fn with_byte_span(self, text: &str, span: Range<usize>) -> Self {
        let end = line_and_column(text, floor_char_boundary(text, span.end.max(span.start)));
        let mut error = self.with_byte_offset(text, span.start);
        if let Some(position) = &mut error.position {
            position.end = Some(end);
        }
        error
    }

    /// Adds the key that is wrong, as `--set` names it: `robots.1.at.0`.
    #[must_use]
    pub fn with_key(mut self, key: impl Into<String>) -> Self {
        self.key = Some(key.into().into());
        self
    }

    /// The file or option that is wrong.
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Line and column, from 1, where known.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        self.position.as_ref().map(|p| (p.line, p.column))
    }

    /// Line and column after the wrong part, from 1, where known.
    pub fn end_line_and_column(&self) -> Option<(usize, usize)> {
        self.position.as_ref()?.end
    }

    /// The key that is wrong, as `--set` names it, where known: `robots.1.at.0`.
    pub fn key(&self) -> Option<&str> {
        self.key.as_deref()
    }

    /// The cause, in a sentence.
    pub fn cause(&self) -> &str {
        &self.cause
    }

    /// The remedy, in a sentence.
    pub fn remedy(&self) -> &str {
        &self.remedy
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", escape_controls(&self.place))?;
        if let Some(p) = &self.position {
            write!(f, ":{}:{}", p.line, p.column)?;
        }
        write!(f, ": {}", sentence(&self.cause))?;
        if let Some(TextPosition { line, column, text: Some(text), .. }) = self.position.as_deref()
        {
            let number = line.to_string();
            let (quoted, caret_cols) = quote(text, column - 1);
            let indent = number.len();
            write!(f, "\n  {number} | {quoted}\n  {:indent$} | {:caret_cols$}^", "", "")?;
        }
        write!(f, "\n  help: {}", sentence(&self.remedy))
    }
}

/// Returns a cause or a remedy as one line that a terminal can show.
fn sentence(text: &str) -> String {
    escape_controls(&shorten(text, MAX_SENTENCE_CHARS)).into_owned()
}

/// Returns a line of a file as a terminal can show it, at most [`MAX_QUOTE_COLS`] columns of it, and the columns before
/// the character at an index in it.
fn quote(line: &str, index: usize) -> (String, usize) {
    let split = line.char_indices().nth(index).map_or(line.len(), |(at, _)| at);
    let [mut before, mut after] = [&line[..split], &line[split..]].map(visible);
    if display_cols(&before) + display_cols(&after) > MAX_QUOTE_COLS {
        before = last_cols(&before, QUOTE_COLS_BEFORE);
        after = first_cols(&after, MAX_QUOTE_COLS - QUOTE_COLS_BEFORE);
    }
    let caret_cols = display_cols(&before);
    (before + &after, caret_cols)
}

/// Returns a part of a line as a terminal can show it. A tab becomes one blank: its width depends on what is before it,
/// and a caret below would point elsewhere.
fn visible(part: &str) -> String {
    escape_controls(&part.replace('\t', " ")).into_owned()
}

/// Returns the start of a text, at most `cols` columns, and a mark if there is more.
fn first_cols(text: &str, cols: usize) -> String {
    let (start, is_whole) = take_cols(text.chars(), cols);
    if is_whole { start } else { start + ELLIPSIS }
}

/// Returns the end of a text, at most `cols` columns, after a mark if there is more.
fn last_cols(text: &str, cols: usize) -> String {
    let (reversed, is_whole) = take_cols(text.chars().rev(), cols);
    let end: String = reversed.chars().rev().collect();
    if is_whole { end } else { format!("{ELLIPSIS}{end}") }
}

/// Returns the first characters that fit into `cols` columns, and whether these are all.
fn take_cols(mut chars: impl Iterator<Item = char>, cols: usize) -> (String, bool) {
    let mut taken = String::new();
    let mut used = 0;
    for c in chars.by_ref() {
        used += display_cols(c.encode_utf8(&mut [0; 4]));
        if used > cols {
            return (taken, false);
        }
        taken.push(c);
    }
    (taken, true)
}

impl std::error::Error for InputError {}

/// Returns the last start of a character at or before `offset`.
fn floor_char_boundary(text: &str, offset: usize) -> usize {
    let mut offset = offset.min(text.len());
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    offset
}

/// Returns line and column of the byte at `offset`, the start of a character.
fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..offset];
    let start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_quotes_the_line_and_points_at_the_column() {
        let text = "a = 1\nbb = 2\n";
        let error = InputError::new("x.toml", "bad value", "write 3").with_byte_offset(text, 11);
        assert_eq!(error.line_and_column(), Some((2, 6)));
        assert_eq!(
            error.to_string(),
            "x.toml:2:6: bad value\n  2 | bb = 2\n    |      ^\n  help: write 3"
        );
    }

    #[test]
    fn a_span_adds_the_end_and_a_key_the_key_and_neither_changes_what_is_displayed() {
        let text = "a = [\n  1,\n]\n";
        let plain = InputError::new("x.toml", "c", "r").with_byte_offset(text, 4);
        let spanned = InputError::new("x.toml", "c", "r").with_byte_span(text, 4..12).with_key("a");
        assert_eq!(
            (spanned.line_and_column(), spanned.end_line_and_column()),
            (Some((1, 5)), Some((3, 2)))
        );
        assert_eq!(
            (spanned.key(), plain.key(), plain.end_line_and_column()),
            (Some("a"), None, None)
        );
        assert_eq!(spanned.to_string(), plain.to_string());
    }

    #[test]
    fn what_an_error_quotes_does_not_act_on_a_terminal_and_the_caret_stays_below_its_character() {
        let text = "a\x1b[31mRED\x1b]0;pwned\x07 = ";
        let error = InputError::new("e\x1b[2J.toml", "unknown key `\x1b[31m`", "no\r\u{202e}")
            .with_byte_offset(text, text.find('=').expect("it is there"));
        assert_eq!(
            error.to_string(),
            "e\\u{1b}[2J.toml:1:21: unknown key `\\u{1b}[31m`\n  \
             1 | a\\u{1b}[31mRED\\u{1b}]0;pwned\\u{7} = \n    \
             |                                   ^\n  help: no\\r\\u{202e}"
        );
        let lines: Vec<String> = error.to_string().lines().map(String::from).collect();
        assert_eq!(lines[1].find('='), lines[2].find('^'));
        let wide = InputError::new("x", "c", "r").with_byte_offset("東京 = 1", 7);
        assert_eq!(wide.to_string(), "x:1:4: c\n  1 | 東京 = 1\n    |      ^\n  help: r");
    }

    #[test]
    fn of_a_line_without_end_only_the_part_around_the_column_is_quoted() {
        let text = format!("{}!{}", "a".repeat(5000), "b".repeat(5000));
        let error = InputError::new("x", "c", "r").with_byte_offset(&text, 5000);
        let shown = error.to_string();
        let lines: Vec<&str> = shown.lines().collect();
        assert!(lines[1].starts_with("  1 | ...aaa") && lines[1].ends_with("bbb..."), "{shown}");
        assert_eq!(lines[1].find('!'), lines[2].find('^'));
        assert!(shown.len() < 500, "{shown}");
        let long = InputError::new("x", "k".repeat(1 << 20), "r").to_string();
        assert!(long.len() < 5000);
    }

    #[test]
    fn an_offset_behind_the_end_or_inside_a_character_is_no_panic() {
        let text = "é";
        assert_eq!(
            InputError::new("f", "c", "r").with_byte_offset(text, 1).line_and_column(),
            Some((1, 1))
        );
        assert_eq!(
            InputError::new("f", "c", "r").with_byte_offset(text, 99).line_and_column(),
            Some((1, 2))
        );
        assert_eq!(
            InputError::new("f", "c", "r").with_byte_span(text, 1..99).end_line_and_column(),
            Some((1, 2))
        );
    }
}
