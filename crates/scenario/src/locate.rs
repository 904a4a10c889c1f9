//! The key at a position of a text: from spans of bytes to keys in the notation of `--set`.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A part of the path to a key.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PathStep {
    /// The name of a key in a table.
    Name(String),
    /// The number of an element of an array, from 0.
    Index(usize),
}

/// Returns a path in the notation of `--set`: `robots.1.at.0`. Names that are no bare keys are
/// quoted as in TOML.
pub(crate) fn dotted_path(path: &[PathStep]) -> String {
    let parts: Vec<String> = path
        .iter()
        .map(|step| match step {
            // Without quotes it would be the number of an element.
            PathStep::Name(name) if name.bytes().all(|b| b.is_ascii_digit()) => format!("{name:?}"),
            PathStep::Name(name) => toml_edit::Key::new(name).display_repr().into_owned(),
            PathStep::Index(index) => index.to_string(),
        })
        .collect();
    parts.join(".")
}

/// Returns the path to the innermost key (or element of an array) that contains a span of a text,
/// in its name or value; `None` for a span in no key. A text with syntax errors is read as far as
/// possible.
pub(crate) fn locate(text: &str, span: &Range<usize>) -> Option<Vec<PathStep>> {
    let (root, _) = DeTable::parse_recoverable(text);
    let mut search = KeySearch { span, path: Vec::new(), best: None };
    search.table(root.get_ref());
    search.best.map(|best| best.path)
}

/// The smallest key or value found so far that contains the span.
struct BestMatch {
    bytes: usize,
    path: Vec<PathStep>,
}

struct KeySearch<'a> {
    span: &'a Range<usize>,
    path: Vec<PathStep>,
    best: Option<BestMatch>,
}

impl KeySearch<'_> {
    fn table(&mut self, table: &DeTable<'_>) {
        for (key, value) in table.iter() {
            self.path.push(PathStep::Name(key.get_ref().to_string()));
            self.offer(&key.span());
            self.value(value);
            self.path.pop();
        }
    }

    /// Searches a value, even one that does not contain the span: a table with a header has the
    /// span of the header alone.
    fn value(&mut self, value: &Spanned<DeValue<'_>>) {
        self.offer(&value.span());
        match value.get_ref() {
            DeValue::Table(table) => self.table(table),
            DeValue::Array(elements) => {
                for (index, element) in elements.iter().enumerate() {
                    self.path.push(PathStep::Index(index));
                    self.value(element);
                    self.path.pop();
                }
            }
            _ => {}
        }
    }

    /// Keeps the present path if its key or value has the smallest range so far that contains the span; of two ranges
    /// of the same size the later, which is the inner one.
    fn offer(&mut self, range: &Range<usize>) {
        let contains = range.start <= self.span.start && self.span.end <= range.end;
        let bytes = range.len();
        if contains && bytes > 0 && self.best.as_ref().is_none_or(|best| bytes <= best.bytes) {
            self.best = Some(BestMatch { bytes, path: self.path.clone() });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1\nx.y = 2\n[one]\nb = { c = 3, \"d.e\" = [[4], [5, 6]] }\n\
                        [[many]]\nn = 1\n[[many.tasks]]\nkind = \"rest\"\n[[many]]\n";

    fn key_of(part: &str) -> Option<String> {
        let start = TEXT.find(part).expect(part);
        locate(TEXT, &(start..start + part.len())).map(|path| dotted_path(&path))
    }

    #[test]
    fn the_innermost_key_is_found_by_its_name_or_in_its_value() {
        for (part, key) in [
            ("a", "a"),
            ("1", "a"),
            ("2", "x.y"),
            ("[one]", "one"),
            ("c = 3,", "one.b"),
            ("3", "one.b.c"),
            ("\"d.e\"", "one.b.\"d.e\""),
            ("[5, 6]", "one.b.\"d.e\".1"),
            ("5", "one.b.\"d.e\".1.0"),
            ("[[many]]", "many.0"),
            ("[[many.tasks]]", "many.0.tasks.0"),
            ("\"rest\"", "many.0.tasks.0.kind"),
        ] {
            assert_eq!(key_of(part).as_deref(), Some(key), "{part}");
        }
        let last = TEXT.rfind("[[many]]").expect("the second");
        assert_eq!(
            locate(TEXT, &(last..last + 8)).map(|path| dotted_path(&path)),
            Some("many.1".into())
        );
    }

    #[test]
    fn what_stands_in_no_key_has_none() {
        assert_eq!(locate(TEXT, &(0..TEXT.len())), None);
        assert_eq!(locate("# a = 1\n", &(2..3)), None);
        assert_eq!(locate("", &(0..0)), None);
    }
}
