//! Sections that occur once or several times.

use crate::Spanned;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use std::borrow::Cow;

/// One table or an array of tables under one key, `[robots]` or `[[robots]]`; each keeps its
/// position in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Sections<T>(pub Vec<Spanned<T>>);

impl<T> Default for Sections<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Sections<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<OneOrMany<T, Spanned<T>>>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(Self(match spanned.into_inner() {
            OneOrMany::One(table) => vec![Spanned::new(span, table)],
            OneOrMany::Many(tables) => tables,
        }))
    }
}

impl<T: JsonSchema> JsonSchema for Sections<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Sections_of_{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<T>();
        json_schema!({ "oneOf": [one, { "type": "array", "items": one }] })
    }
}

/// The content of a key: one table, or an array of them. Read by hand, because an untagged enum of serde buffers the
/// content and loses the positions in it.
enum OneOrMany<One, Each> {
    One(One),
    Many(Vec<Each>),
}

impl<'de, One: Deserialize<'de>, Each: Deserialize<'de>> Deserialize<'de> for OneOrMany<One, Each> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<One, Each>(std::marker::PhantomData<(One, Each)>);

        impl<'de, One: Deserialize<'de>, Each: Deserialize<'de>> serde::de::Visitor<'de>
            for Visitor<One, Each>
        {
            type Value = OneOrMany<One, Each>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table or an array of tables")
            }

            fn visit_map<A: serde::de::MapAccess<'de>>(
                self,
                map: A,
            ) -> Result<Self::Value, A::Error> {
                One::deserialize(serde::de::value::MapAccessDeserializer::new(map))
                    .map(OneOrMany::One)
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                mut seq: A,
            ) -> Result<Self::Value, A::Error> {
                let mut tables = Vec::new();
                while let Some(table) = seq.next_element()? {
                    tables.push(table);
                }
                Ok(OneOrMany::Many(tables))
            }
        }
        deserializer.deserialize_any(Visitor(std::marker::PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;

    #[test]
    fn sections_stand_alone_or_in_an_array_and_know_where() {
        #[derive(Debug, Deserialize)]
        struct File {
            #[serde(default)]
            a: Sections<Section>,
        }
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Section {
            n: u32,
        }
        let read = |text: &str| Source::new("s.toml", text, "").parse::<File>();
        for (text, starts) in [
            ("[a]\nn = 1\n", vec![(1, 0)]),
            ("[[a]]\nn = 1\n[[a]]\nn = 2\n", vec![(1, 0), (2, 12)]),
            ("a = [{ n = 1 }, { n = 2 }]", vec![(1, 5), (2, 16)]),
            ("", vec![]),
        ] {
            let file = read(text).expect(text);
            let told: Vec<_> = file.a.0.iter().map(|s| (s.get_ref().n, s.span().start)).collect();
            assert_eq!(told, starts, "{text}");
        }
        for text in ["[a]\nm = 1\n", "[[a]]\nn = 1\n[[a]]\nm = 1\n"] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains("unknown key `m`"), "{error}");
        }
    }
}
