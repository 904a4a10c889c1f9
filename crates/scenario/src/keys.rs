//! Positions of the keys of a scenario in its text, for errors about keys that were read much earlier.
//!
//! Keys are in the notation of overrides, `robots.1.count`: elements of arrays by their number, and
//! a single section by 0 or without a number; names with dots are quoted.

use crate::Source;
use crate::edit::{KeyPart, parse_key};
use crate::locate::{dotted_path, locate};
use sidestep_kernel::InputError;
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Value};

/// A key of a table, with its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    /// The key without quotes.
    pub name: String,
    /// Its position in the text, in bytes, without its value.
    pub span: Range<usize>,
}

impl Source {
    /// Returns the keys of a table, in the order of the text; none where there is no such table.
    pub fn keys(&self, path: &str) -> Vec<Key> {
        let Some(root) = self.root() else { return Vec::new() };
        let Some(table) = find(&root, path) else { return Vec::new() };
        let mut keys = keys_of(table.value);
        keys.sort_by_key(|key| key.span.start);
        keys
    }

    /// Returns the root table with the positions of everything in it.
    fn root(&self) -> Option<Spanned<DeValue<'_>>> {
        let root = DeTable::parse(&self.text).ok()?;
        Some(Spanned::new(root.span(), DeValue::Table(root.into_inner())))
    }

    /// Returns the value of a key, if the text has it.
    pub fn value(&self, path: &str) -> Option<Value> {
        let mut value = Value::Table(self.text.parse().ok()?);
        for part in parse_key(path).ok()? {
            // An array of one needs no number, as in overrides.
            if let Value::Array(elements) = &mut value
                && part.number().is_none()
                && elements.len() == 1
            {
                value = elements.remove(0);
            }
            value = match (value, part.number()) {
                (Value::Array(elements), Some(index)) => elements.into_iter().nth(index)?,
                (table @ Value::Table(_), Some(0)) => table,
                (Value::Table(mut table), _) => table.remove(&part.name)?,
                _ => return None,
            };
        }
        Some(value)
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

    /// Returns the position of the first of `keys` that the section at a span has, for errors about keys
    /// whose values have no position; the position of the section if it has none of them.
    pub fn key_span(&self, section: Range<usize>, keys: &[&str]) -> Range<usize> {
        let Some(steps) = locate(&self.text, &section) else { return section };
        let path = dotted_path(&steps);
        keys.iter().find_map(|key| self.span_of(&format!("{path}.{key}"))).unwrap_or(section)
    }

    /// Returns the position of a key, if the text has it.
    fn span_of(&self, path: &str) -> Option<Range<usize>> {
        find(&self.root()?, path).map(|located| located.span)
    }

    /// Creates the error for a key that has no effect; `because` completes the
    /// sentence "`key` does nothing ...".
    pub fn unused_key(&self, path: &str, because: &str) -> InputError {
        let last = parse_key(path).ok().and_then(|mut parts| parts.pop());
        let key = last.map_or_else(|| path.to_string(), |part| part.name);
        self.error_at(path, format!("`{key}` does nothing {because}"), "leave it out")
    }

    /// Refuses keys that have no effect in the section at a span, because their author expects something of
    /// them. Each comes with whether it is given, and whether it has an effect there; `because` is that of
    /// [`Self::unused_key`].
    ///
    /// # Errors
    /// At the first such key.
    pub fn refuse_unused_keys(
        &self,
        section: Range<usize>,
        keys: &[(&str, bool, bool)],
        because: &str,
    ) -> Result<(), InputError> {
        for &(key, is_given, has_effect) in keys {
            if is_given && !has_effect {
                let span = self.key_span(section, &[key]);
                let cause = format!("`{key}` does nothing {because}");
                return Err(self.error(span, cause, "leave it out"));
            }
        }
        Ok(())
    }
}

fn keys_of(value: &Spanned<DeValue<'_>>) -> Vec<Key> {
    let keys = value.get_ref().as_table().into_iter().flat_map(|table| table.keys());
    keys.map(|key| Key { name: key.get_ref().to_string(), span: key.span() }).collect()
}

/// A value, and the position of its key; for an element of an array, its own position.
struct LocatedValue<'t, 'i> {
    span: Range<usize>,
    value: &'t Spanned<DeValue<'i>>,
}

impl<'t, 'i> LocatedValue<'t, 'i> {
    fn without_key(value: &'t Spanned<DeValue<'i>>) -> Self {
        Self { span: value.span(), value }
    }
}

/// `None` if a part of the path does not exist.
fn find<'t, 'i>(root: &'t Spanned<DeValue<'i>>, path: &str) -> Option<LocatedValue<'t, 'i>> {
    let mut located = LocatedValue::without_key(root);
    for part in parse_key(path).ok()? {
        located = step(located, &part)?;
    }
    Some(located)
}

fn step<'t, 'i>(parent: LocatedValue<'t, 'i>, part: &KeyPart) -> Option<LocatedValue<'t, 'i>> {
    match (parent.value.get_ref(), part.number()) {
        (DeValue::Array(elements), Some(index)) => {
            elements.get(index).map(LocatedValue::without_key)
        }
        // An array of one needs no number, as in overrides.
        (DeValue::Array(elements), None) if elements.len() == 1 => {
            step(LocatedValue::without_key(elements.first()?), part)
        }
        (DeValue::Table(_), Some(0)) => Some(parent),
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
        Source::new("s.toml", TEXT, "").error_at(path, "c", "r").line_and_column()
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
            assert_eq!(
                (again.line_and_column(), again.key()),
                (told.line_and_column(), told.key()),
                "{key}"
            );
        }
        let value = |key| source.value(key).and_then(|value| value.as_integer());
        assert_eq!((value("kinds.\"a.b\".n"), value("kinds.'0'.n")), (Some(1), Some(2)));
        assert_eq!(value("many.0.x.\"c d\".1"), Some(7));
        assert_eq!((value("kinds.a.b.n"), value("kinds..n"), value("\"")), (None, None, None));
        assert_eq!(source.unused_key("kinds.\"a.b\"", "here").cause(), "`a.b` does nothing here");
    }

    #[test]
    fn the_first_key_without_effect_is_refused_where_it_stands_in_its_section() {
        let source = Source::new("s.toml", TEXT, "");
        let start = TEXT.rfind("[[robots]]").expect("a section");
        let second = start..start + "[[robots]]".len();
        let keys = [("count", true, true), ("at", true, false), ("b", true, false)];
        let refused = source.refuse_unused_keys(second.clone(), &keys, "beside `scen`");
        let error = refused.expect_err("`at` is unused");
        assert_eq!(
            (error.line_and_column(), error.cause()),
            (Some((5, 1)), "`at` does nothing beside `scen`")
        );
        assert!(source.refuse_unused_keys(second, &keys[..1], "beside `scen`").is_ok());
    }

    #[test]
    fn an_idle_key_is_refused_where_it_stands() {
        let error = Source::new("s.toml", TEXT, "").unused_key("robots.1.at", "beside `scen`");
        assert_eq!(
            (error.line_and_column(), error.cause()),
            (Some((5, 1)), "`at` does nothing beside `scen`")
        );
    }
}
