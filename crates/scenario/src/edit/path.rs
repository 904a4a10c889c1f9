//! Keys in the notation of overrides: `robots.1.at`, `kinds."a.b".observation`.

use super::{EditError, edit_error};
use toml_edit::Key;

/// The maximum number of parts of a key: several times as many as any scenario has.
const MAX_PARTS: usize = 64;

/// A name in a table, or the number of an element of an array: which of them, the text decides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct KeyPart {
    /// The name, without quotes.
    pub(crate) name: String,
    /// Whether it is quoted, and so is a name even if it consists of digits.
    is_quoted: bool,
}

impl KeyPart {
    /// Returns the number of an element, if it is one.
    pub(crate) fn number(&self) -> Option<usize> {
        let is_number = !self.is_quoted && self.name.bytes().all(|b| b.is_ascii_digit());
        if is_number { self.name.parse().ok() } else { None }
    }
}

/// Splits a key into its parts, at least one.
pub(crate) fn parse_key(key: &str) -> Result<Vec<KeyPart>, EditError> {
    let mut parts = Vec::new();
    let mut rest = key.trim();
    loop {
        let end = end_of_part(rest);
        parts.push(parse_part(&rest[..end])?);
        match rest[end..].strip_prefix('.') {
            Some(next) => rest = next,
            None if end == rest.len() => return Ok(parts),
            None => return Err(edit_error("a dot is missing after a quote", "write a.\"b.c\".d")),
        }
        if parts.len() > MAX_PARTS {
            return Err(edit_error("the key has too many parts", "give a key of the text"));
        }
    }
}

fn parse_part(text: &str) -> Result<KeyPart, EditError> {
    if text.is_empty() {
        return Err(edit_error("a part of the key is empty", "write a.b.c"));
    }
    if !text.starts_with(['"', '\'']) {
        return Ok(KeyPart { name: text.to_string(), is_quoted: false });
    }
    match Key::parse(text).as_deref() {
        Ok([key]) => Ok(KeyPart { name: key.get().to_string(), is_quoted: true }),
        _ => Err(edit_error("a quoted part of the key is not TOML", "write a.\"b.c\".d")),
    }
}

fn end_of_part(text: &str) -> usize {
    match text.bytes().next() {
        Some(quote @ (b'"' | b'\'')) => end_of_quoted(text, quote),
        _ => text.find('.').unwrap_or(text.len()),
    }
}

/// Returns the offset after the closing quote, or the end of a text that lacks it.
fn end_of_quoted(text: &str, quote: u8) -> usize {
    let mut bytes = text.bytes().enumerate().skip(1);
    while let Some((k, byte)) = bytes.next() {
        // Only strings in double quotes have escapes.
        if byte == b'\\' && quote == b'"' {
            bytes.next();
        } else if byte == quote {
            return k + 1;
        }
    }
    text.len()
}

/// Returns the positions of the parts of the key at an offset of a text, which must be TOML.
pub(super) fn keys_at(text: &str, offset: usize) -> Vec<std::ops::Range<usize>> {
    let mut parts = Vec::new();
    let mut start = skip_blanks(text, offset);
    loop {
        let end = start + end_of_key(&text[start..]);
        parts.push(start..end);
        let dot = skip_blanks(text, end);
        if !text[dot..].starts_with('.') {
            return parts;
        }
        start = skip_blanks(text, dot + 1);
    }
}

fn end_of_key(text: &str) -> usize {
    match text.bytes().next() {
        Some(quote @ (b'"' | b'\'')) => end_of_quoted(text, quote),
        _ => text.bytes().position(|b| b" \t.=]".contains(&b)).unwrap_or(text.len()),
    }
}

fn skip_blanks(text: &str, offset: usize) -> usize {
    offset + text[offset..].bytes().take_while(|b| b" \t".contains(b)).count()
}

/// Returns a name as TOML writes it.
pub(super) fn quoted_name(name: &str) -> String {
    Key::new(name)
        .default_repr()
        .as_raw()
        .as_str()
        .map_or_else(|| format!("{name:?}"), String::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_split_at_dots_outside_of_quotes() {
        let names =
            |key| parse_key(key).map(|all| all.into_iter().map(|p| p.name).collect::<Vec<_>>());
        assert_eq!(names("robots.1.at"), Ok(vec!["robots".into(), "1".into(), "at".into()]));
        assert_eq!(names(r#"kinds."a.b".c"#), Ok(vec!["kinds".into(), "a.b".into(), "c".into()]));
        assert_eq!(names(r#""a\"b".'c.d'"#), Ok(vec!["a\"b".into(), "c.d".into()]));
        for wrong in ["", "a..b", ".a", "a.", "\"a", "\"a\"b", "\"\\q\"", &"a.".repeat(100)] {
            assert!(names(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_in_quotes_are_names() {
        let number = |key| parse_key(key).expect("a key")[0].number();
        assert_eq!((number("12"), number("\"12\""), number("+1")), (Some(12), None, None));
        assert_eq!(number("99999999999999999999999"), None);
    }

    #[test]
    fn the_parts_of_a_written_key_are_found() {
        let text = "[ a . \"b.]\".c ]";
        let found: Vec<&str> = keys_at(text, 1).into_iter().map(|range| &text[range]).collect();
        assert_eq!(found, ["a", "\"b.]\"", "c"]);
        assert_eq!((quoted_name("a-b"), quoted_name("a b")), ("a-b".into(), "\"a b\"".into()));
    }
}
