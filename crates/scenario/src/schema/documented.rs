//! The keys that a commented scenario shows, with its comments about them.
//!
//! ```text
//! [map]                        # its meaning       a section
//! box_size_m = 0.25            # side of a box     a key, its value and its words
//! # unknown = "wall"           # its effect        the same: a key that is commented out
//!                              # and why           goes on with the words
//! # Words above a key or a section that has none beside it.
//! ```

use toml_edit::{DocumentMut, Item, Table, Value};

/// A key or a section that a scenario shows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DocumentedKey {
    /// The names on the path to it, without the numbers of elements of arrays.
    pub(crate) way: Vec<String>,
    /// Its comments; may be empty.
    pub(crate) words: String,
    /// Its value; none for a section.
    pub(crate) value: Option<serde_json::Value>,
    /// Whether the key is commented out, in a section that is not commented out.
    pub(crate) is_left_out: bool,
}

/// Returns all keys and sections that a text shows, in its order.
pub(crate) fn documented_keys(text: &str) -> Vec<DocumentedKey> {
    let mut reader = DocumentReader::default();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let (content, is_comment) = match line.strip_prefix('#') {
            Some(rest) => (rest.strip_prefix(' ').unwrap_or(rest), true),
            None => (line, false),
        };
        match content.trim_start().strip_prefix('#').filter(|_| content.starts_with(' ')) {
            Some(more) => reader.continue_text(more),
            None if content.trim().is_empty() => reader.blank(),
            None if content.starts_with("      ") => reader.continue_text(content),
            None => match parse_piece(content, is_comment, &mut lines) {
                Some(document) => reader.add_document(&document, is_comment),
                None => reader.add_text(content),
            },
        }
    }
    reader.found
}

/// Returns the piece of TOML that begins with a line, if there is one; a value of several lines
/// takes all of them.
fn parse_piece<'t>(
    first: &str,
    is_comment: bool,
    lines: &mut (impl Iterator<Item = &'t str> + Clone),
) -> Option<DocumentMut> {
    let is_key = |c: char| c.is_ascii_alphanumeric() || "_-.\"".contains(c);
    let rest = first.trim_start_matches(is_key).trim_start();
    if !first.starts_with('[') && (first.len() == rest.len() || !rest.starts_with('=')) {
        return None;
    }
    let mut text = first.to_string();
    let mut after = lines.clone();
    loop {
        if let Ok(document) = text.parse::<DocumentMut>() {
            *lines = after;
            return Some(document);
        }
        let line = after.next()?;
        let line = if is_comment { line.strip_prefix('#')? } else { line };
        text.push('\n');
        text.push_str(line);
    }
}

#[derive(Default)]
struct DocumentReader {
    found: Vec<DocumentedKey>,
    section: Vec<String>,
    is_section_left_out: bool,
    /// Words above the next section or key.
    above: String,
    /// Whether these words stand directly above that.
    is_near: bool,
}

impl DocumentReader {
    fn continue_text(&mut self, more: &str) {
        if let Some(last) = self.found.last_mut().filter(|_| self.above.is_empty()) {
            add(&mut last.words, more.trim(), " ");
        } else {
            add(&mut self.above, more.trim(), "\n");
        }
    }

    fn blank(&mut self) {
        self.is_near = false;
    }

    fn add_text(&mut self, words: &str) {
        if !self.is_near && !self.above.starts_with("---") {
            self.above.clear();
        }
        let separator = if words.starts_with(' ') { "\n" } else { " " };
        let words = words.trim();
        match words.strip_prefix("---") {
            Some(title) => {
                let title = title.trim_matches(|c: char| c == '-' || c == ' ');
                self.above = format!("--- {title}.");
            }
            None => add(&mut self.above, words, separator),
        }
        self.is_near = true;
    }

    /// Takes a section or a key. The words above a section may be set apart from it, those above a
    /// key may not.
    fn add_document(&mut self, document: &DocumentMut, is_left_out: bool) {
        let above = std::mem::take(&mut self.above);
        let above = above.trim_start_matches("--- ").to_string();
        let mut way = Vec::new();
        if let Some((table, is_key)) = header(document.as_table(), &mut way)
            && !is_key
        {
            let beside = comment(table.decor().suffix());
            self.section.clone_from(&way);
            self.is_section_left_out = is_left_out;
            let words = if beside.is_empty() { above } else { beside };
            self.found.push(DocumentedKey { way, words, value: None, is_left_out: false });
            return;
        }
        let near = if self.is_near { above } else { String::new() };
        let is_left_out = is_left_out && !self.is_section_left_out;
        let mut own = self.section.clone();
        own.extend(way);
        collect_keys(document.as_table(), own, &near, is_left_out, &mut self.found);
    }
}

/// Returns the table of a header, following the path to it, with the mark of a dotted key.
fn header<'t>(table: &'t Table, way: &mut Vec<String>) -> Option<(&'t Table, bool)> {
    let (name, item) = table.iter().next()?;
    let inner = match item {
        Item::Table(inner) if inner.is_dotted() => return Some((inner, true)),
        Item::Table(inner) => inner,
        Item::ArrayOfTables(many) => many.get(0)?,
        _ => return None,
    };
    way.push(name.into());
    match inner.is_empty() {
        true => Some((inner, false)),
        false => header(inner, way),
    }
}

/// Gathers the keys of a piece, and those of the tables in their values.
fn collect_keys(
    table: &Table,
    way: Vec<String>,
    above: &str,
    is_left_out: bool,
    found: &mut Vec<DocumentedKey>,
) {
    for (name, item) in table.iter() {
        let mut way = way.clone();
        way.push(name.into());
        match item {
            Item::Table(inner) => collect_keys(inner, way, above, is_left_out, found),
            Item::Value(value) => {
                let beside = comment(value.decor().suffix());
                let words = if beside.is_empty() { above.to_string() } else { beside };
                collect_nested_keys(value, &way, found);
                // Last, so that continued words belong to the key itself.
                found.push(DocumentedKey { way, words, value: json(value), is_left_out });
            }
            _ => {}
        }
    }
}

/// Gathers the keys of tables within a value, which have no words of their own.
fn collect_nested_keys(value: &Value, way: &[String], found: &mut Vec<DocumentedKey>) {
    match value {
        Value::Array(many) => many.iter().for_each(|one| collect_nested_keys(one, way, found)),
        Value::InlineTable(table) => {
            for (name, value) in table.iter() {
                let way = [way, &[name.to_string()]].concat();
                collect_nested_keys(value, &way, found);
                let value = json(value);
                found.push(DocumentedKey { way, words: String::new(), value, is_left_out: false });
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
        Value::Boolean(is) => Json::from(*is.value()),
        Value::Datetime(time) => Json::from(time.value().to_string()),
        Value::Array(many) => Json::Array(many.iter().map(json).collect::<Option<_>>()?),
        Value::InlineTable(table) => {
            let members = table.iter().map(|(name, value)| Some((name.to_string(), json(value)?)));
            Json::Object(members.collect::<Option<_>>()?)
        }
    })
}

fn comment(raw: Option<&toml_edit::RawString>) -> String {
    let text = raw.and_then(toml_edit::RawString::as_str).unwrap_or_default();
    text.trim().trim_start_matches('#').trim().to_string()
}

fn add(words: &mut String, more: &str, separator: &str) {
    if !words.is_empty() {
        words.push_str(separator);
    }
    words.push_str(more);
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
            .map(|s| (s.way.join("."), s.words, s.value.map(|v| v.to_string()), s.is_left_out))
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
