//! Choices by name, to which a program may add its own.

use crate::explain::{quoted, suggestion};
use crate::{Source, Spanned};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::{Error as NameError, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sidestep_kernel::InputError;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A choice by name: one of the built-in ones, or one that a program has added. In a JSON Schema it is the built-in
/// choice; [`crate::schema::add_names`] adds the others.
#[derive(Debug, Clone, PartialEq)]
pub enum ByName<T> {
    /// A built-in choice.
    BuiltIn(T),
    /// Any other name; [`Self::find_own`] returns the choice that it stands for.
    Own(Spanned<String>),
}

impl<T: DeserializeOwned> ByName<T> {
    /// Returns the choice that a name stands for among those of a program.
    ///
    /// # Errors
    /// When there is none of that name; the remedy lists the built-in ones as well.
    pub fn find_own<'a, V>(
        source: &Source,
        name: &Spanned<String>,
        own: &'a BTreeMap<String, V>,
    ) -> Result<&'a V, InputError> {
        let text = name.get_ref().as_str();
        own.get(text).ok_or_else(|| {
            // Serde lists the built-in names only in its error.
            let error = read_built_in::<T>(text).err().map(|error| error.to_string());
            let error = error.unwrap_or_default();
            // The first name in backticks is the unknown one.
            let built_in = quoted(&error).into_iter().skip(1);
            let known: Vec<&str> = built_in.chain(own.keys().map(String::as_str)).collect();
            let cause = format!("unknown value `{text}`");
            source.error(Some(name.span()), cause, suggestion(text, &known))
        })
    }
}

fn read_built_in<T: DeserializeOwned>(name: &str) -> Result<T, NameError> {
    let deserializer: StrDeserializer<'_, NameError> = name.into_deserializer();
    T::deserialize(deserializer)
}

impl<T: Default> Default for ByName<T> {
    fn default() -> Self {
        Self::BuiltIn(T::default())
    }
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for ByName<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = Spanned::<String>::deserialize(deserializer)?;
        let built_in = read_built_in(name.get_ref());
        Ok(built_in.map_or(Self::Own(name), Self::BuiltIn))
    }
}

/// For the default values of JSON Schemas.
impl<T: Serialize> Serialize for ByName<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::BuiltIn(choice) => choice.serialize(serializer),
            Self::Own(name) => serializer.serialize_str(name.get_ref()),
        }
    }
}

impl<T: JsonSchema> JsonSchema for ByName<T> {
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
    use crate::schema::{add_names, for_type};

    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    enum Color {
        /// As the sea.
        Blue,
        DarkRed,
    }

    #[derive(Deserialize, JsonSchema)]
    struct File {
        color: ByName<Color>,
    }

    fn find(name: &str) -> Result<i32, InputError> {
        let source = Source::new("s.toml", format!("color = \"{name}\""), "");
        let own = BTreeMap::from([("amber".to_string(), 7)]);
        match source.parse::<File>()?.color {
            ByName::BuiltIn(_) => Ok(0),
            ByName::Own(name) => ByName::<Color>::find_own(&source, &name, &own).copied(),
        }
    }

    #[test]
    fn a_name_is_that_of_a_built_in_choice_or_of_an_own_one() {
        assert_eq!(find("dark-red"), Ok(0));
        assert_eq!(find("amber"), Ok(7));
        let error = find("ambre").expect_err("unknown");
        assert_eq!(error.cause(), "unknown value `ambre`");
        assert_eq!(error.remedy(), "did you mean `amber`?");
        assert_eq!(error.line_and_column(), Some((1, 9)));
        let error = find("something else").expect_err("unknown");
        assert_eq!(error.remedy(), "known are: blue, dark-red, amber");
    }

    #[test]
    fn a_schema_has_the_built_in_names_and_those_that_are_added() {
        #[derive(Deserialize, JsonSchema)]
        #[schemars(rename = "File")]
        struct BuiltIn {
            #[serde(rename = "color")]
            _color: Color,
        }
        let mut schema = for_type::<File>();
        assert_eq!(schema, for_type::<BuiltIn>());
        add_names(&mut schema, "Color", ["amber"].into_iter());
        let names: Vec<&serde_json::Value> = schema["$defs"]["Color"]["oneOf"]
            .as_array()
            .expect("alternatives")
            .iter()
            .filter_map(|one| one.get("const"))
            .collect();
        assert_eq!(names.last(), Some(&&serde_json::json!("amber")), "{schema}");
    }
}
