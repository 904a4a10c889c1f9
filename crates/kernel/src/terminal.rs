//! Text of unknown origin on a terminal: names, lines and messages of files must not act there as commands.
//!
//! Control characters move the cursor, change colors and titles; marks of direction reorder what is read; characters
//! without width hide. All are shown as escapes (CWE-150; for marks of direction Boucher and Anderson, "Trojan Source",
//! USENIX Security 2023).

use std::borrow::Cow;
use std::fmt::Write;
use unicode_width::UnicodeWidthStr;

/// Mark of a part of a text that is not shown.
pub const ELLIPSIS: &str = "...";

/// Returns a text of one line that a terminal shows as it is: line feeds and all other [controls](is_invisible) become
/// escapes, `\n`, `\u{1b}`.
pub fn escape_controls(text: &str) -> Cow<'_, str> {
    escape(text, is_invisible)
}

/// Returns a text of several lines that a terminal shows as it is: like [`escape_controls`], but line feeds stay.
pub fn escape_controls_in_lines(text: &str) -> Cow<'_, str> {
    escape(text, |c| c != '\n' && is_invisible(c))
}

fn escape(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(&is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_escaped(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Returns the same JSON with the controls in its strings as escapes of JSON, so that a terminal can show it and a reader
/// finds the same values. Line feeds, which JSON has only between values, stay.
pub fn escape_controls_in_json(json: &str) -> Cow<'_, str> {
    let is_escaped = |c: char| c != '\n' && is_invisible(c);
    if !json.chars().any(is_escaped) {
        return Cow::Borrowed(json);
    }
    let mut shown = String::with_capacity(json.len() + 8);
    for c in json.chars() {
        if !is_escaped(c) {
            shown.push(c);
            continue;
        }
        for unit in c.encode_utf16(&mut [0; 2]) {
            let _ = write!(shown, "\\u{unit:04x}");
        }
    }
    Cow::Owned(shown)
}

/// Returns whether a character acts on a terminal or cannot be seen there: controls (C0, DEL, C1), separators of lines,
/// marks of direction, characters without width, tags.
pub fn is_invisible(c: char) -> bool {
    let is_format = matches!(
        c,
        '\u{ad}'
            | '\u{61c}'
            | '\u{180e}'
            | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2060}'..='\u{206f}'
            | '\u{feff}'
            | '\u{fff9}'..='\u{fffb}'
            | '\u{e0000}'..='\u{e007f}'
    );
    c.is_control() || is_format
}

/// Returns the number of columns of a terminal that a text without controls takes: two for wide characters, none for
/// accents that combine.
pub fn display_cols(text: &str) -> usize {
    text.width()
}

/// Returns a text with spaces behind it up to `cols` columns.
pub fn pad_end(text: &str, cols: usize) -> String {
    let missing = cols.saturating_sub(display_cols(text));
    format!("{text}{:missing$}", "")
}

/// Returns a text with spaces before it up to `cols` columns.
pub fn pad_start(text: &str, cols: usize) -> String {
    let missing = cols.saturating_sub(display_cols(text));
    format!("{:missing$}{text}", "")
}

/// Returns at most `max_chars` characters of a text, and a mark where more were there: a name in a hostile file may fill
/// a disk.
pub fn shorten(text: &str, max_chars: usize) -> Cow<'_, str> {
    match text.char_indices().nth(max_chars) {
        Some((end, _)) => Cow::Owned(format!("{}{ELLIPSIS}", &text[..end])),
        None => Cow::Borrowed(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_acts_on_a_terminal_is_shown_and_all_else_stays() {
        assert_eq!(
            escape_controls("a\x1b[31mb\u{9b}2J\x07\x7f"),
            "a\\u{1b}[31mb\\u{9b}2J\\u{7}\\u{7f}"
        );
        assert_eq!(escape_controls("a\r\n\tb"), "a\\r\\n\\tb");
        assert_eq!(escape_controls_in_lines("a\r\nb"), "a\\r\nb");
        for hidden in ["\u{202e}", "\u{2066}", "\u{2069}", "\u{200b}", "\u{feff}", "\u{e0041}"] {
            assert!(escape_controls(hidden).starts_with("\\u{"), "{hidden:?}");
        }
        for plain in ["Zürich", "東京", "\u{1f600}", "a \\ b", "e\u{301}"] {
            assert!(matches!(escape_controls(plain), Cow::Borrowed(same) if same == plain));
        }
    }

    #[test]
    fn json_has_the_same_values_with_its_controls_escaped() {
        let value = serde_json::json!({ "a\u{202e}": ["\x1b[31m\u{9b}", "\u{e0041}\n", "東"] });
        let plain = serde_json::to_string_pretty(&value).expect("plain data");
        let escaped = escape_controls_in_json(&plain);
        assert!(!escaped.chars().any(|c| c != '\n' && is_invisible(c)), "{escaped}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&escaped).expect("JSON"), value);
    }

    #[test]
    fn wide_characters_take_two_columns() {
        assert_eq!(["ab", "東京", "e\u{301}", ""].map(display_cols), [2, 4, 1, 0]);
        assert_eq!((pad_end("東", 4), pad_start("東", 4)), ("東  ".into(), "  東".into()));
    }

    #[test]
    fn a_text_beyond_all_measure_is_cut() {
        assert_eq!((shorten("äöü", 3), shorten("äöü", 2)), ("äöü".into(), "äö...".into()));
    }
}
