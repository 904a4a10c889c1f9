//! Values with their position in the text.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer};
use std::borrow::{Borrow, Cow};
use std::ops::Range;

/// A value and its position in the text, in bytes. It counts as the value alone in comparisons, as a
/// key of a map and in a JSON Schema.
///
/// The reader's own type does the work; this one exists because a schema can be derived for it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Spanned<T>(toml::Spanned<T>);

impl<T> Spanned<T> {
    /// Creates a value at a position; a default has the empty one, `0..0`.
    pub fn new(span: Range<usize>, value: T) -> Self {
        Self(toml::Spanned::new(span, value))
    }

    /// Returns its position in the text.
    pub fn span(&self) -> Range<usize> {
        self.0.span()
    }

    /// Returns the value, while the position stays with it.
    pub fn get_ref(&self) -> &T {
        self.0.get_ref()
    }

    /// Returns the value without its position.
    pub fn into_inner(self) -> T {
        self.0.into_inner()
    }
}

impl Borrow<str> for Spanned<String> {
    fn borrow(&self) -> &str {
        self.get_ref()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        toml::Spanned::deserialize(deserializer).map(Self)
    }
}

impl<T: JsonSchema> JsonSchema for Spanned<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn values_and_keys_of_maps_know_their_places() {
        #[derive(Deserialize, JsonSchema)]
        struct File {
            rows: BTreeMap<Spanned<String>, Spanned<Vec<Spanned<f64>>>>,
        }
        let text = "[rows]\nnear = [0.25, 0.75]\n";
        let file: File = toml::from_str(text).expect("right");
        let (name, row) = file.rows.first_key_value().expect("one row");
        assert_eq!((&text[name.span()], &text[row.span()]), ("near", "[0.25, 0.75]"));
        assert_eq!(&text[row.get_ref()[1].span()], "0.75");
        assert!(file.rows.contains_key("near"));
    }

    #[test]
    fn a_schema_shows_the_value_alone() {
        let of = |schema: Schema| schema.to_value();
        let plain = of(schemars::schema_for!(BTreeMap<String, Vec<u32>>));
        let spanned =
            of(schemars::schema_for!(BTreeMap<Spanned<String>, Spanned<Vec<Spanned<u32>>>>));
        assert_eq!(spanned, plain);
    }
}
