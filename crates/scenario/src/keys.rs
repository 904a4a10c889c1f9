//! Places of the keys of a scenario in its text, for errors about keys that were read much earlier.
//!
//! A key is named as in overrides, `robots.1.count`: elements of arrays by their number, and
//! a section that stands alone by 0 or without a number; names with dots stand in quotes.

use crate::Source;
use crate::edit::{KeyPart, parse_key};
use crate::locate::{locate, path};
use sidestep_kernel::InputError;
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Value};

/// A key of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The key itself.
    pub name: String,
    /// Its place in the text.
    pub span: Range<usize>,
}

impl Source {
    /// Returns the keys of a table, in the order of the text; none where there is no such table.
    pub fn keys(&self, path: &str) -> Vec<Key> {
        let Ok(root) = DeTable::parse(&self.text) else { return Vec::new() };
        let (span, root) = (root.span(), DeValue::Table(root.into_inner()));
        let found = find(&Spanned::new(span, root), path).map(|found| keys_of(found.value));
        let mut keys = found.unwrap_or_default();
        keys.sort_by_key(|key| key.span.start);
        keys
    }

    /// Returns the value of a key, if the text has it.
    pub fn value(&self, path: &str) -> Option<Value> {
        let mut found = Value::Table(self.text.parse().ok()?);
        for part in parse_key(path).ok()? {
            if let Value::Array(many) = &mut found
                && part.number().is_none()
                && many.len() == 1
            {
                found = many.remove(0);
            }
            found = match (found, part.number()) {
                (Value::Array(many), Some(index)) => many.into_iter().nth(index)?,
                (found @ Value::Table(_), Some(0)) => found,
                (Value::Table(mut table), _) => table.remove(&part.name)?,
                _ => return None,
            };
        }
        Some(found)
    }

    /// Creates an error at a key; with the key alone where it is not in the text.
    pub fn error_at(
        &self,
        path: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        match self.span_of(path) {
            Some(span) => self.error(span, cause, remedy),
            None => self.error(None, cause, remedy).with_key(path),
        }
    }

    /// Returns the place of the first of `keys` that the section at a span has, for errors about keys
    /// with values that do not know their places; the place of the section if it has none of them.
    pub fn key_span(&self, section: Range<usize>, keys: &[&str]) -> Range<usize> {
        let way = locate(&self.text, &section).map(|way| path(&way));
        let place = |key: &&str| self.span_of(&format!("{}.{key}", way.as_ref()?));
        keys.iter().find_map(place).unwrap_or(section)
    }

    /// Returns the place of a key, if the text has it.
    fn span_of(&self, path: &str) -> Option<Range<usize>> {
        let root = DeTable::parse(&self.text).ok()?;
        let (span, root) = (root.span(), DeValue::Table(root.into_inner()));
        find(&Spanned::new(span, root), path).map(|found| found.span)
    }

    /// Creates the error for a key that has no effect; `because` completes the
    /// sentence "`key` does nothing ...".
    pub fn unused_key(&self, path: &str, because: &str) -> InputError {
        let last = parse_key(path).ok().and_then(|mut parts| parts.pop());
        let key = last.map_or_else(|| path.to_string(), |part| part.name);
        self.error_at(path, format!("`{key}` does nothing {because}"), "leave it out")
    }
}

fn keys_of(value: &Spanned<DeValue<'_>>) -> Vec<Key> {
    let keys = value.get_ref().as_table().into_iter().flat_map(|table| table.keys());
    keys.map(|key| Key { name: key.get_ref().to_string(), span: key.span() }).collect()
}

/// A value, and the place of its key; that of an element of an array is its own.
struct LocatedValue<'t, 'i> {
    span: Range<usize>,
    value: &'t Spanned<DeValue<'i>>,
}

impl<'t, 'i> LocatedValue<'t, 'i> {
    fn without_key(value: &'t Spanned<DeValue<'i>>) -> Self {
        Self { span: value.span(), value }
    }
}

/// Returns the value at a path.
fn find<'t, 'i>(root: &'t Spanned<DeValue<'i>>, path: &str) -> Option<LocatedValue<'t, 'i>> {
    let mut found = LocatedValue::without_key(root);
    for part in parse_key(path).ok()? {
        found = step(found, &part)?;
    }
    Some(found)
}

fn step<'t, 'i>(found: LocatedValue<'t, 'i>, part: &KeyPart) -> Option<LocatedValue<'t, 'i>> {
    match (found.value.get_ref(), part.number()) {
        (DeValue::Array(many), Some(index)) => many.get(index).map(LocatedValue::without_key),
        // An array of one may be passed without a number, as in overrides.
        (DeValue::Array(many), None) if many.len() == 1 => {
            step(LocatedValue::without_key(many.first()?), part)
        }
        (DeValue::Table(_), Some(0)) => Some(found),
        (DeValue::Table(table), _) => {
            let (key, value) = table.iter().find(|(key, _)| *key.get_ref() == part.name)?;
            Some(LocatedValue { span: key.span(), value })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "a = 1\n[[robots]]\ncount = 2\n[[robots]]\nat = [[1, 2]]\nb = { c = 3 }\n[people]\nn = 1\n";

    fn position(path: &str) -> Option<(usize, usize)> {
        Source::new("s.toml", TEXT, "").error_at(path, "c", "r").position()
    }

    #[test]
    fn keys_are_found_as_overrides_name_them() {
        assert_eq!(position("a"), Some((1, 1)));
        assert_eq!(position("robots.1.at"), Some((5, 1)));
        assert_eq!(position("robots.1.b.c"), Some((6, 7)));
        assert_eq!((position("people.n"), position("people.0.n")), (Some((8, 1)), Some((8, 1))));
        assert_eq!(
            (position("robots.2.at"), position("robots.at"), position("z")),
            (None, None, None)
        );
    }

    #[test]
    fn the_keys_of_a_table_are_told_in_the_order_of_the_text() {
        let source = Source::new("s.toml", "[t]\nz = 1\nb = 2\n", "");
        let names: Vec<String> = source.keys("t").into_iter().map(|key| key.name).collect();
        assert_eq!(names, ["z", "b"]);
        assert_eq!((source.keys("t.z"), source.keys("u")), (vec![], vec![]));
    }

    #[test]
    fn values_are_found_as_overrides_name_them() {
        let source = Source::new("s.toml", TEXT, "");
        let of = |path| source.value(path).map(|value| value.to_string());
        assert_eq!((of("a"), of("robots.0.count")), (Some("1".into()), Some("2".into())));
        assert_eq!((of("people.n"), of("people.0.n")), (Some("1".into()), Some("1".into())));
        assert_eq!((of("robots.count"), of("robots.2.count"), of("a.b")), (None, None, None));
        let single = Source::new("s.toml", "[[robots]]\ncount = 2\n", "");
        assert_eq!(single.value("robots.count"), Some(Value::Integer(2)));
    }

    #[test]
    fn the_keys_of_a_section_are_found_by_its_span() {
        let source = Source::new("s.toml", TEXT, "");
        let section = |header: &str| {
            let start = TEXT.rfind(header).expect(header);
            start..start + header.len()
        };
        let found = |header, keys: &[&str]| &TEXT[source.key_span(section(header), keys)];
        assert_eq!(found("[[robots]]", &["count", "b"]), "b", "the second has no count");
        assert_eq!(found("{ c = 3 }", &["c"]), "c");
        assert_eq!(found("[people]", &["n"]), "n");
        assert_eq!(found("[people]", &["at"]), "[people]");
    }

    #[test]
    fn the_keys_that_errors_name_lead_back_to_their_places() {
        let text =
            "[kinds.\"a.b\"]\nn = 1\n[kinds.\"0\"]\nn = 2\n[[many]]\n[many.x]\n\"c d\" = [1, 7]\n";
        let source = Source::new("s.toml", text, "");
        for part in ["n = 1", "n = 2", "\"c d\"", "7"] {
            let start = text.find(part).expect(part);
            let told = source.error(start..start + 1, "c", "r");
            let key = told.key().expect("a key").to_string();
            let again = source.error_at(&key, "c", "r");
            assert_eq!((again.position(), again.key()), (told.position(), told.key()), "{key}");
        }
        let value = |key| source.value(key).and_then(|value| value.as_integer());
        assert_eq!((value("kinds.\"a.b\".n"), value("kinds.'0'.n")), (Some(1), Some(2)));
        assert_eq!(value("many.0.x.\"c d\".1"), Some(7));
        assert_eq!((value("kinds.a.b.n"), value("kinds..n"), value("\"")), (None, None, None));
        assert_eq!(source.unused_key("kinds.\"a.b\"", "here").cause(), "`a.b` does nothing here");
    }

    #[test]
    fn an_idle_key_is_refused_where_it_stands() {
        let error = Source::new("s.toml", TEXT, "").unused_key("robots.1.at", "beside `scen`");
        assert_eq!(
            (error.position(), error.cause()),
            (Some((5, 1)), "`at` does nothing beside `scen`")
        );
    }
}
