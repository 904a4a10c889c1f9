//! JSON Schemas of scenarios: for editors, and for forms.
//!
//! ```text
//! the types that parse ──schemars──> sections      limits, names, which keys are needed
//! the head of all worlds ────────────┐   │
//! default.toml of the world ──shown──┴───┴──> schema of the world ──> schema of any scenario
//!              words, examples, defaults
//! ```
//! Beside the words of the standard, a schema has `x-unit` (the unit of a number), `x-names` (the key
//! of the table with the keys that can be named there) and `x-infinite` (whether `inf` is allowed, which JSON lacks).

mod describe;
mod documented;
mod numbers;
mod pointers;
mod widen;

#[doc(hidden)]
pub use schemars;
pub use widen::widened;

use crate::{FORMAT, Head, WorldType, Worlds};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// The version of JSON Schema.
const DRAFT: &str = "https://json-schema.org/draft/2020-12/schema";

/// Returns the schema of a type that is read from TOML, which has no null.
pub fn for_type<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.meta_schema = None);
    let mut schema = settings.into_generator().into_root_schema_for::<T>().to_value();
    without_null(&mut schema);
    schema
}

/// Removes the null of optional values from a schema.
fn without_null(schema: &mut Value) {
    match schema {
        Value::Array(many) => many.iter_mut().for_each(without_null),
        Value::Object(members) => {
            if members.get("default").is_some_and(Value::is_null) {
                members.remove("default");
            }
            if let Some(Value::Array(types)) = members.get_mut("type") {
                types.retain(|one| one != "null");
                if let [one] = &types[..] {
                    let one = one.clone();
                    members.insert("type".into(), one);
                }
            }
            if let Some(Value::Array(values)) = members.get_mut("enum") {
                values.retain(|one| !one.is_null());
            }
            members.values_mut().for_each(without_null);
            only_alternative(members);
        }
        _ => {}
    }
}

/// Replaces "a value or null" by the value's own schema.
fn only_alternative(members: &mut Map<String, Value>) {
    let Some(Value::Array(many)) = members.get_mut("anyOf") else { return };
    many.retain(|one| one.get("type") != Some(&json!("null")));
    if let [Value::Object(only)] = &mut many[..] {
        let only = std::mem::take(only);
        members.remove("anyOf");
        for (key, value) in only {
            members.entry(key).or_insert(value);
        }
    }
}

/// Returns the schema of a world's scenarios.
pub fn for_world(kind: &dyn WorldType) -> Value {
    let mut sections = kind.sections();
    let mut schema = for_type::<Head>();
    schema["properties"]["format"]["const"] = FORMAT.into();
    schema["properties"]["world"]["const"] = kind.name().into();
    if let Some(own) = sections.as_object_mut() {
        join(&mut schema, own);
    }
    describe::describe(&mut schema, kind.default_scenario());
    let title = format!("A scenario of the world {}", kind.name());
    let mut all = Map::new();
    all.insert("$schema".into(), DRAFT.into());
    all.insert("title".into(), title.into());
    all.insert("description".into(), kind.about().into());
    for (key, value) in schema.as_object().cloned().unwrap_or_default() {
        all.entry(key).or_insert(value);
    }
    Value::Object(all)
}

/// Returns the schema of a file with the keys in `own`, a title, and the words of a commented scenario for the keys
/// that both have.
pub fn for_file(title: &str, mut own: Value, scenario: &str) -> Value {
    describe::describe(&mut own, scenario);
    let mut all = Map::new();
    all.insert("$schema".into(), DRAFT.into());
    all.insert("title".into(), title.into());
    for (key, value) in own.as_object().cloned().unwrap_or_default() {
        all.entry(key).or_insert(value);
    }
    all.insert("title".into(), title.into());
    Value::Object(all)
}

/// Adds the sections of a world to the keys that all worlds share.
fn join(schema: &mut Value, own: &mut Map<String, Value>) {
    for (key, value) in std::mem::take(own) {
        match (schema.get_mut(&key), value) {
            (Some(Value::Object(all)), Value::Object(more)) => all.extend(more),
            (Some(Value::Array(all)), Value::Array(more)) => all.extend(more),
            (Some(all), value) => *all = value,
            (None, value) => schema[&key] = value,
        }
    }
}

impl Worlds {
    /// Returns the schema of scenarios of one world, or of any; `None` if there is no such world.
    pub fn schema(&self, world: Option<&str>) -> Option<Value> {
        match world {
            Some(name) => self.find(name).map(for_world),
            None => Some(self.for_any_world()),
        }
    }

    fn for_any_world(&self) -> Value {
        let mut definitions = Map::new();
        for kind in self.iter() {
            let mut schema = for_world(kind);
            rename(&mut schema, kind.name());
            if let Some(members) = schema.as_object_mut() {
                members.remove("$schema");
                if let Some(Value::Object(own)) = members.remove("$defs") {
                    let named = |(name, one)| (format!("{}.{name}", kind.name()), one);
                    definitions.extend(own.into_iter().map(named));
                }
            }
            definitions.insert(kind.name().into(), schema);
        }
        let named = |name| json!({ "$ref": format!("#/$defs/{name}") });
        json!({
            "$schema": DRAFT,
            "title": "A scenario of any world",
            "oneOf": self.names().into_iter().map(named).collect::<Vec<_>>(),
            "$defs": definitions,
        })
    }
}

/// Puts the name of a world before the names of definitions.
fn rename(schema: &mut Value, world: &str) {
    match schema {
        Value::Array(many) => many.iter_mut().for_each(|one| rename(one, world)),
        Value::Object(members) => {
            if let Some(Value::String(to)) = members.get_mut("$ref") {
                *to = to.replace("#/$defs/", &format!("#/$defs/{world}."));
            }
            members.values_mut().for_each(|one| rename(one, world));
        }
        _ => {}
    }
}

/// Returns limits that include infinity, which JSON lacks.
#[must_use]
pub fn with_infinity(mut limits: Value) -> Value {
    limits["x-infinite"] = true.into();
    limits
}

/// Marks a string of a schema, or the elements of an array of strings, as names of other things:
/// keys of the table `table`, or one of `built_in`.
///
/// # Panics
/// When the schema has no such key.
pub fn mark_as_names(schema: &mut Value, key: &str, table: &str, built_in: &[&str]) {
    let way: Vec<String> = key.split('.').map(String::from).collect();
    let found = pointers::pointers(schema, &way);
    assert!(!found.is_empty(), "the sections have no key `{key}`");
    for place in found {
        let part = schema.pointer_mut(&place).expect("found just now");
        let part = if part.get("items").is_some() { &mut part["items"] } else { part };
        part["x-names"] = table.into();
        if !built_in.is_empty() {
            part["examples"] = built_in.into();
        }
    }
}

/// Returns the keys that the commented scenario of a world shows, also commented out, and that its
/// schema does not know. There should be none.
pub fn unknown_keys(kind: &dyn WorldType) -> Vec<String> {
    let schema = for_world(kind);
    let shown = documented::documented_keys(kind.default_scenario()).into_iter();
    let unknown = shown.filter(|one| pointers::pointers(&schema, &one.way).is_empty());
    unknown.map(|one| one.way.join(".")).collect()
}

/// Returns the keys of a world's schema, as JSON pointers, that its commented scenario shows nowhere, neither as a
/// key nor in the words beside one.
pub fn undocumented_keys(kind: &dyn WorldType) -> Vec<String> {
    let schema = for_world(kind);
    let shown = documented::documented_keys(kind.default_scenario());
    let ways = shown.iter().flat_map(|one| (1..=one.way.len()).map(|n| &one.way[..n]));
    let told: BTreeSet<String> = ways.flat_map(|way| pointers::pointers(&schema, way)).collect();
    let is_named = |key: &str| shown.iter().any(|one| has_word(&one.words, key));
    let mut all = Vec::new();
    pointers::collect_properties(&schema, "", &mut all);
    all.retain(|(place, key)| !told.contains(place) && !is_named(key));
    all.into_iter().map(|(place, _)| place).collect()
}

/// Returns whether a text has a key as a word of its own.
fn has_word(text: &str, key: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == key)
}

/// Returns examples of a key's values, from the commented scenario of its world.
pub fn examples(schema: &Value, way: &[String]) -> Vec<Value> {
    let places = pointers::pointers(schema, way);
    let known = places.iter().filter_map(|place| schema.pointer(place)?.get("examples"));
    known.filter_map(Value::as_array).flatten().cloned().collect()
}

/// Returns a schema that was written by hand.
#[doc(hidden)]
pub fn written(schema: Value) -> Schema {
    Schema::try_from(schema).unwrap_or_default()
}

/// Gives a handwritten schema to a type with handwritten reading: a `serde_json::Value`, which
/// stands wherever the type does.
#[macro_export]
macro_rules! schema_by_hand {
    ($name:ident, $schema:expr) => {
        impl $crate::schema::schemars::JsonSchema for $name {
            fn inline_schema() -> bool {
                true
            }

            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn schema_id() -> std::borrow::Cow<'static, str> {
                concat!(module_path!(), "::", stringify!($name)).into()
            }

            fn json_schema(
                _: &mut $crate::schema::schemars::SchemaGenerator,
            ) -> $crate::schema::schemars::Schema {
                $crate::schema::written($schema)
            }
        }
    };
}
