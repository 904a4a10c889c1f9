//! The one error for wrong input, from any file or option.
//!
//! Promise E1: no input panics the program. Every error gives the place, the cause and the remedy;
//! the command then ends with exit code 2 and has written nothing.

use std::fmt;
use std::ops::Range;

/// Wrong input: a file, an option, a table that does not sum to 1.
///
/// Displayed as `place:line:column: cause`, the offending line with a caret under it where
/// the text is known, and `help: remedy`. The key is for programs that edit the text by its keys.
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
        write!(f, "{}", self.place)?;
        if let Some(p) = &self.position {
            write!(f, ":{}:{}", p.line, p.column)?;
        }
        write!(f, ": {}", self.cause)?;
        if let Some(TextPosition { line, column, text: Some(text), .. }) = self.position.as_deref()
        {
            let number = line.to_string();
            // A tab is one character for the column, but several on the screen: the caret would point elsewhere.
            let quoted = text.replace('\t', " ");
            write!(
                f,
                "\n  {number} | {quoted}\n  {:w$} | {:c$}^",
                "",
                "",
                w = number.len(),
                c = column - 1
            )?;
        }
        write!(f, "\n  help: {}", self.remedy)
    }
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
