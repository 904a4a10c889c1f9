//! Keys and the parts of a text that they take.

use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A key of a text, or an element of an array.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct KeyNode {
    /// Place of its name; none of an element.
    pub(super) name: Option<Range<usize>>,
    /// Place of its value; none of tables that have headers.
    pub(super) value: Option<Range<usize>>,
    /// The place behind which a table takes a further key.
    pub(super) inside: Option<Range<usize>>,
    /// All parts of the text that belong to it.
    pub(super) parts: Vec<Range<usize>>,
    /// Texts of the lists beside it, or in it.
    pub(super) lists: Vec<String>,
    /// Names of the keys in it, at any depth.
    pub(super) inner_names: Vec<String>,
}

/// Returns the parts of a key as overrides name it.
pub(super) fn key_path(key: &str) -> Vec<String> {
    let parts = toml_edit::Key::parse(key).unwrap_or_default();
    parts.iter().map(|part| part.get().to_string()).collect()
}

/// Returns the parts of the text at a key; none if it is not there. The empty path is the whole text.
pub(super) fn find(text: &str, path: &[String]) -> Option<KeyNode> {
    let root = DeTable::parse(text).ok()?;
    let root = Spanned::new(0..0, DeValue::Table(root.into_inner()));
    let tree = Tree { text, headers: headers(text, &root) };
    let mut step = PathStep { name: None, value: &root, parent: None };
    for part in path {
        step = child(step, part)?;
    }
    Some(tree.node(&step))
}

/// A value on the path to a key, with the table or array that holds it; elements have no name.
#[derive(Clone, Copy)]
struct PathStep<'t, 'i> {
    name: Option<&'t Spanned<std::borrow::Cow<'i, str>>>,
    value: &'t Spanned<DeValue<'i>>,
    parent: Option<&'t Spanned<DeValue<'i>>>,
}

fn child<'t, 'i>(place: PathStep<'t, 'i>, part: &str) -> Option<PathStep<'t, 'i>> {
    let parent = Some(place.value);
    match (place.value.get_ref(), part.parse::<usize>()) {
        (DeValue::Array(many), Ok(index)) => {
            many.get(index).map(|value| PathStep { name: None, value, parent })
        }
        // Overrides may leave out the index of a section that stands alone.
        (DeValue::Array(many), Err(_)) if many.len() == 1 => {
            child(PathStep { name: None, value: many.first()?, parent }, part)
        }
        (DeValue::Table(table), number) => {
            match table.iter().find(|(key, _)| key.get_ref() == part) {
                Some((name, value)) => Some(PathStep { name: Some(name), value, parent }),
                // A section that stands alone is its own element 0.
                None => (number == Ok(0)).then_some(place),
            }
        }
        _ => None,
    }
}

/// The form of a value in the text.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ValueStyle {
    /// A value in a line, also a table in braces.
    Inline,
    /// A table with a header, or several with the same.
    Header,
    /// A table that is only there because of its keys.
    Implied,
}

fn value_style(text: &str, value: &Spanned<DeValue<'_>>) -> ValueStyle {
    match value.get_ref() {
        DeValue::Table(_) => match text.as_bytes().get(value.span().start) {
            Some(b'{') => ValueStyle::Inline,
            Some(b'[') => ValueStyle::Header,
            _ => ValueStyle::Implied,
        },
        DeValue::Array(many) => match many.first() {
            Some(first) if matches!(first.get_ref(), DeValue::Table(_)) => value_style(text, first),
            _ => ValueStyle::Inline,
        },
        _ => ValueStyle::Inline,
    }
}

/// Returns the starts of all headers, in order.
fn headers(text: &str, value: &Spanned<DeValue<'_>>) -> Vec<usize> {
    let mut found = Vec::new();
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value.get_ref() {
            DeValue::Table(table) => {
                if value_style(text, value) == ValueStyle::Header {
                    found.push(value.span().start);
                }
                open.extend(table.iter().map(|(_, value)| value));
            }
            DeValue::Array(many) => open.extend(many.iter()),
            _ => {}
        }
    }
    found.sort_unstable();
    found
}

struct Tree<'a> {
    text: &'a str,
    headers: Vec<usize>,
}

impl Tree<'_> {
    fn node(&self, place: &PathStep<'_, '_>) -> KeyNode {
        let PathStep { name, value, parent } = *place;
        let is_listed =
            parent.is_some_and(|parent| value_style(self.text, parent) == ValueStyle::Inline);
        let mut parts = Vec::new();
        self.collect_parts(name.map(Spanned::span), value, is_listed, &mut parts);
        let span = value.span();
        let inside = match (value.get_ref(), value_style(self.text, value), parent) {
            (DeValue::Table(_), _, None) => Some(0..0),
            (DeValue::Table(_), ValueStyle::Header, _) => Some(span.clone()),
            (DeValue::Table(_), ValueStyle::Inline, _) => Some(span.start..span.start + 1),
            _ => None,
        };
        KeyNode {
            name: name.map(Spanned::span),
            value: (value_style(self.text, value) == ValueStyle::Inline).then_some(span),
            inside,
            parts: merge_ranges(parts),
            lists: self.lists(value, parent),
            inner_names: inner_names(value),
        }
    }

    /// Gathers the parts of the text that a value takes, with its name.
    fn collect_parts(
        &self,
        name: Option<Range<usize>>,
        value: &Spanned<DeValue<'_>>,
        is_listed: bool,
        parts: &mut Vec<Range<usize>>,
    ) {
        let span = value.span();
        match value_style(self.text, value) {
            ValueStyle::Inline => {
                let start = name.map_or(span.start, |name| self.start_of_line(name.start));
                let end = if is_listed { self.after_comma(span.end) } else { span.end };
                parts.push(start..end);
                return;
            }
            ValueStyle::Header if matches!(value.get_ref(), DeValue::Table(_)) => {
                let next = self.headers.iter().copied().find(|start| *start > span.start);
                parts.push(span.start..next.unwrap_or(self.text.len()));
            }
            ValueStyle::Header | ValueStyle::Implied => {}
        }
        match value.get_ref() {
            DeValue::Table(table) => {
                for (key, value) in table.iter() {
                    self.collect_parts(Some(key.span()), value, false, parts);
                }
            }
            DeValue::Array(many) => {
                for value in many.iter() {
                    self.collect_parts(None, value, false, parts);
                }
            }
            _ => {}
        }
    }

    /// Returns the start of a dotted key, of which `start` is the start of the last part.
    fn start_of_line(&self, start: usize) -> usize {
        let line = self.text[..start].rfind(['\n', '{', ',']).map_or(0, |i| i + 1);
        let before = self.text[line..start].trim_end();
        if before.ends_with('.') {
            start - self.text[line..start].trim_start().len()
        } else {
            start
        }
    }

    fn after_comma(&self, end: usize) -> usize {
        let rest = &self.text[end..];
        let gap = rest.len() - rest.trim_start().len();
        if rest[gap..].starts_with(',') { end + gap + 1 } else { end }
    }

    /// Returns the texts of lists that may stand in for each other.
    fn lists(
        &self,
        value: &Spanned<DeValue<'_>>,
        parent: Option<&Spanned<DeValue<'_>>>,
    ) -> Vec<String> {
        let table = match (value.get_ref(), parent.map(Spanned::get_ref)) {
            (DeValue::Table(table), _) | (DeValue::Array(_), Some(DeValue::Table(table))) => table,
            _ => return Vec::new(),
        };
        let mut lists = Vec::new();
        for (_, other) in table.iter() {
            let is_list = matches!(other.get_ref(), DeValue::Array(_))
                && value_style(self.text, other) == ValueStyle::Inline;
            if is_list && other.span() != value.span() {
                lists.push(self.text[other.span()].to_string());
            }
        }
        lists
    }
}

/// Returns the names of all keys in a value.
fn inner_names(value: &Spanned<DeValue<'_>>) -> Vec<String> {
    let mut names = Vec::new();
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value.get_ref() {
            DeValue::Table(table) => {
                for (name, value) in table.iter() {
                    names.push(name.get_ref().to_string());
                    open.push(value);
                }
            }
            DeValue::Array(many) => open.extend(many.iter()),
            _ => {}
        }
    }
    names
}

/// Joins parts that overlap or touch.
fn merge_ranges(mut parts: Vec<Range<usize>>) -> Vec<Range<usize>> {
    parts.sort_by_key(|part| part.start);
    let mut joined: Vec<Range<usize>> = Vec::new();
    for part in parts {
        match joined.last_mut() {
            Some(last) if part.start <= last.end => last.end = last.end.max(part.end),
            _ => joined.push(part),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "a = 1 # one\nx.y = 2\nx.z = 3\n[s.one]\nb = { c = 3, d = [4, 5] }\n\
                        [[m]]\nn = 1\n[[m.t]]\nk = 2\n[other]\no = 1\n[[m]]\nn = 2\n[s.one.rows]\n\
                        p = [1]\nq = [2]\n";

    fn without(key: &str) -> String {
        let found = find(TEXT, &key_path(key)).expect(key);
        let mut text = TEXT.to_string();
        found.parts.iter().rev().for_each(|part| text.replace_range(part.clone(), ""));
        assert!(DeTable::parse(&text).is_ok(), "{key}: {text}");
        assert!(
            find(&text, &key_path(key)).is_none() || key == "m.0" || key.ends_with("d.0"),
            "{text}"
        );
        text
    }

    #[test]
    fn keys_take_all_their_parts_with_them() {
        assert!(without("a").starts_with(" # one\nx.y"));
        assert!(without("x.y").contains("\n\nx.z = 3\n"));
        assert!(without("x").contains("\n\n\n[s.one]"));
        assert!(without("s.one.b.c").contains("{  d = [4, 5] }"));
        assert!(without("s.one.b.d").contains("{ c = 3,  }"));
        assert!(without("s.one.b.d.0").contains("[ 5]"));
        assert_eq!(without("m.0").matches("[[m").count(), 1);
        assert!(!without("m").contains("n =") && without("m").contains("[other]\no = 1"));
        let rest = without("s");
        assert!(!rest.contains("rows") && !rest.contains("b =") && rest.contains("[[m.t]]"));
    }

    #[test]
    fn lists_beside_a_list_and_places_for_keys_are_known() {
        let of = |key: &str| find(TEXT, &key_path(key)).expect(key);
        assert_eq!(of("s.one.rows.p").lists, ["[2]"]);
        assert_eq!(of("s.one.rows").lists, ["[1]", "[2]"]);
        assert_eq!(of("m.0").inner_names, ["n", "t", "k"]);
        assert_eq!(of("").inside, Some(0..0));
        assert_eq!(of("other").inside.map(|at| &TEXT[at]), Some("[other]"));
        assert_eq!(of("s.one.b").inside.map(|at| &TEXT[at]), Some("{"));
        assert_eq!(of("other.0.o").value.map(|at| &TEXT[at]), Some("1"));
        assert_eq!((find(TEXT, &key_path("m.7")), find(TEXT, &key_path("a.b"))), (None, None));
    }
}
