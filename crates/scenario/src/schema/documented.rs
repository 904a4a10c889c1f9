//! The keys of a commented scenario, with its comments about them.
//!
//! ```text
//! [map]                        # its meaning       a section
//! box_size_m = 0.25            # side of a box     a key, its value and its comment
//! # unknown = "wall"           # its effect        the same: a key that is commented out
//!                              # and why           continues the comment
//! # A comment above a key or a section that has none beside it.
//! ```

use toml_edit::{DocumentMut, Item, Table, Value};

/// A key or a section of a commented scenario.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DocumentedKey {
    /// The names on the path to it, without the numbers of elements of arrays.
    pub(crate) path: Vec<String>,
    /// Its comment; may be empty.
    pub(crate) words: String,
    /// Its value; none for a section.
    pub(crate) value: Option<serde_json::Value>,
    /// Whether the key is commented out, in a section that is not commented out.
    pub(crate) is_left_out: bool,
}

/// A line that starts with these blanks continues the comment of the key above it.
const CONTINUATION_INDENT: &str = "      ";

/// Returns all keys and sections of a text, also those that are commented out, in its order.
pub(crate) fn documented_keys(text: &str) -> Vec<DocumentedKey> {
    let mut reader = DocumentReader::default();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let rest = line.strip_prefix('#');
        let is_comment = rest.is_some();
        let content = rest.map_or(line, |rest| rest.strip_prefix(' ').unwrap_or(rest));
        // A comment that stands far to the right, below that of the line above.
        let indented_comment =
            content.trim_start().strip_prefix('#').filter(|_| content.starts_with(' '));
        if let Some(more) = indented_comment {
            reader.continue_comment(more);
        } else if content.trim().is_empty() {
            reader.add_blank();
        } else if content.starts_with(CONTINUATION_INDENT) {
            reader.continue_comment(content);
        } else if let Some(piece) = parse_piece(content, is_comment, &mut lines) {
            reader.add_piece(&piece, is_comment);
        } else {
            reader.add_comment(content);
        }
    }
    reader.keys
}

/// Returns the piece of TOML that begins with a line, if there is one; a value of several lines
/// takes all of them.
fn parse_piece<'t>(
    first: &str,
    is_comment: bool,
    lines: &mut (impl Iterator<Item = &'t str> + Clone),
) -> Option<DocumentMut> {
    let is_key_char = |c: char| c.is_ascii_alphanumeric() || "_-.\"".contains(c);
    let rest = first.trim_start_matches(is_key_char).trim_start();
    if !first.starts_with('[') && (first.len() == rest.len() || !rest.starts_with('=')) {
        return None;
    }
    let mut text = first.to_string();
    let mut rest = lines.clone();
    // Line by line, until the value is complete; the lines are consumed only if it is.
    loop {
        if let Ok(document) = text.parse::<DocumentMut>() {
            *lines = rest;
            return Some(document);
        }
        let line = rest.next()?;
        let line = if is_comment { line.strip_prefix('#')? } else { line };
        text.push('\n');
        text.push_str(line);
    }
}

#[derive(Default)]
struct DocumentReader {
    keys: Vec<DocumentedKey>,
    section: Vec<String>,
    /// Whether the present section is commented out with all of its keys, which then are no defaults.
    is_section_left_out: bool,
    /// The comment above the next section or key.
    comment_above: String,
    /// Whether no blank line separates it from the next line.
    is_adjacent: bool,
}

/// The start of a comment that is the title of a group of sections: `# --- Map ---`.
const TITLE_MARK: &str = "---";

impl DocumentReader {
    fn continue_comment(&mut self, more: &str) {
        if let Some(last) = self.keys.last_mut().filter(|_| self.comment_above.is_empty()) {
            append(&mut last.words, more.trim(), " ");
        } else {
            append(&mut self.comment_above, more.trim(), "\n");
        }
    }

    fn add_blank(&mut self) {
        self.is_adjacent = false;
    }

    fn add_comment(&mut self, text: &str) {
        // A comment after a blank line is about something else, except that a title stays.
        if !self.is_adjacent && !self.comment_above.starts_with(TITLE_MARK) {
            self.comment_above.clear();
        }
        // An indented line is one of a list, which keeps its lines.
        let separator = if text.starts_with(' ') { "\n" } else { " " };
        let text = text.trim();
        match text.strip_prefix(TITLE_MARK) {
            Some(title) => {
                let title = title.trim_matches(|c: char| c == '-' || c == ' ');
                self.comment_above = format!("{TITLE_MARK} {title}.");
            }
            None => append(&mut self.comment_above, text, separator),
        }
        self.is_adjacent = true;
    }

    /// Adds the section or the key of a piece of TOML. Between a section and the comment above it there may be a blank
    /// line, between a key and its comment not.
    fn add_piece(&mut self, piece: &DocumentMut, is_left_out: bool) {
        let above = std::mem::take(&mut self.comment_above);
        let above = above.trim_start_matches("--- ").to_string();
        let mut path = Vec::new();
        if let Some(table) = header_table(piece.as_table(), &mut path) {
            let beside = comment_text(table.decor().suffix());
            self.section.clone_from(&path);
            self.is_section_left_out = is_left_out;
            let words = if beside.is_empty() { above } else { beside };
            self.keys.push(DocumentedKey { path, words, value: None, is_left_out: false });
            return;
        }
        let defaults = KeyDefaults {
            comment: if self.is_adjacent { above } else { String::new() },
            is_left_out: is_left_out && !self.is_section_left_out,
        };
        collect_keys(piece.as_table(), &self.section, &defaults, &mut self.keys);
    }
}

/// Returns the table of a header, and adds its names to `path`; `None` for a key.
fn header_table<'t>(table: &'t Table, path: &mut Vec<String>) -> Option<&'t Table> {
    let (name, item) = table.iter().next()?;
    let inner = match item {
        // A dotted key.
        Item::Table(inner) if inner.is_dotted() => return None,
        Item::Table(inner) => inner,
        Item::ArrayOfTables(tables) => tables.get(0)?,
        _ => return None,
    };
    path.push(name.into());
    if inner.is_empty() { Some(inner) } else { header_table(inner, path) }
}

/// The properties of the keys of a piece that have no comment beside them.
struct KeyDefaults {
    comment: String,
    is_left_out: bool,
}

/// Collects the keys of a piece, and those of the tables in their values.
fn collect_keys(
    table: &Table,
    path: &[String],
    defaults: &KeyDefaults,
    keys: &mut Vec<DocumentedKey>,
) {
    for (name, item) in table.iter() {
        let path = [path, &[name.to_string()]].concat();
        match item {
            Item::Table(inner) => collect_keys(inner, &path, defaults, keys),
            Item::Value(value) => {
                let beside = comment_text(value.decor().suffix());
                let words = if beside.is_empty() { defaults.comment.clone() } else { beside };
                collect_nested_keys(value, &path, keys);
                // Last, so that a continued comment belongs to the key itself.
                let is_left_out = defaults.is_left_out;
                keys.push(DocumentedKey { path, words, value: json(value), is_left_out });
            }
            _ => {}
        }
    }
}

/// Collects the keys of tables within a value, which have no comments of their own.
fn collect_nested_keys(value: &Value, path: &[String], keys: &mut Vec<DocumentedKey>) {
    match value {
        Value::Array(elements) => {
            elements.iter().for_each(|element| collect_nested_keys(element, path, keys));
        }
        Value::InlineTable(table) => {
            for (name, value) in table.iter() {
                let path = [path, &[name.to_string()]].concat();
                collect_nested_keys(value, &path, keys);
                let value = json(value);
                keys.push(DocumentedKey { path, words: String::new(), value, is_left_out: false });
            }
        }
        _ => {}
    }
}

/// Returns a value as JSON; none where JSON has no such value, like infinity.
fn json(value: &Value) -> Option<serde_json::Value> {
    use serde_json::Value as Json;
    Some(match value {
        Value::String(text) => Json::from(text.value().as_str()),
        Value::Integer(number) => Json::from(*number.value()),
        Value::Float(number) => Json::Number(serde_json::Number::from_f64(*number.value())?),
        Value::Boolean(boolean) => Json::from(*boolean.value()),
        Value::Datetime(time) => Json::from(time.value().to_string()),
        Value::Array(elements) => Json::Array(elements.iter().map(json).collect::<Option<_>>()?),
        Value::InlineTable(table) => {
            let members = table.iter().map(|(name, value)| Some((name.to_string(), json(value)?)));
            Json::Object(members.collect::<Option<_>>()?)
        }
    })
}

/// Returns the text of a comment beside a value or a header.
fn comment_text(raw: Option<&toml_edit::RawString>) -> String {
    let text = raw.and_then(toml_edit::RawString::as_str).unwrap_or_default();
    text.trim().trim_start_matches('#').trim().to_string()
}

fn append(text: &mut String, more: &str, separator: &str) {
    if !text.is_empty() {
        text.push_str(separator);
    }
    text.push_str(more);
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# What the file is about.

seed = 1   # of chance

# --- The map: one of these ------------

[map]      # where they are
size = 2.5 # in meters,
           # or so
# unknown = \"wall\"   # what it is
# ascii = \"\"\"
# ##
# \"\"\"              # walls

# Rules of the house.
#   one line
# legs = { a = [inf], b = 2 }
#             also: c = 3,
#             d = 4, e = 5

# One for each.
# [[robots.at]]
# n = 1
x.y = 3
";

    #[test]
    fn keys_are_found_with_their_words_whether_they_are_commented_out_or_not() {
        let told: Vec<_> = documented_keys(TEXT)
            .into_iter()
            .map(|s| (s.path.join("."), s.words, s.value.map(|v| v.to_string()), s.is_left_out))
            .collect();
        let told: Vec<(&str, &str, Option<&str>, bool)> =
            told.iter().map(|(w, s, v, l)| (&w[..], &s[..], v.as_deref(), *l)).collect();
        assert_eq!(
            told,
            [
                ("seed", "of chance", Some("1"), false),
                ("map", "where they are", None, false),
                ("map.size", "in meters, or so", Some("2.5"), false),
                ("map.unknown", "what it is", Some("\"wall\""), true),
                ("map.ascii", "walls", Some("\" ##\\n \""), true),
                ("map.legs.a", "", None, false),
                ("map.legs.b", "", Some("2"), false),
                ("map.legs", "Rules of the house.\none line also: c = 3, d = 4, e = 5", None, true),
                ("robots.at", "One for each.", None, false),
                ("robots.at.n", "", Some("1"), false),
                ("robots.at.x.y", "", Some("3"), false),
            ]
        );
    }
}
