//! JSON Schemas of scenarios: for editors, and for forms.
//!
//! ```text
//! the types that parse ──schemars──> sections      limits, names, required keys
//! the head of all worlds ─────────────┐   │
//! default.toml of the world ──────────┴───┴──> schema of the world ──> schema of any scenario
//!              descriptions, examples, defaults
//! ```
//! Beside the keywords of the standard, a schema has `x-unit` (the unit of a number), `x-names` (the key
//! of the table whose keys are valid values) and `x-infinite` (whether `inf` is allowed, which JSON lacks).

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

/// The dialect of JSON Schema: that in which [`for_type`] has schemars write.
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
        Value::Array(elements) => elements.iter_mut().for_each(without_null),
        Value::Object(members) => {
            if members.get("default").is_some_and(Value::is_null) {
                members.remove("default");
            }
            if let Some(Value::Array(types)) = members.get_mut("type") {
                types.retain(|name| name != "null");
                if let [only] = &types[..] {
                    let only = only.clone();
                    members.insert("type".into(), only);
                }
            }
            if let Some(Value::Array(values)) = members.get_mut("enum") {
                values.retain(|value| !value.is_null());
            }
            members.values_mut().for_each(without_null);
            inline_only_alternative(members);
        }
        _ => {}
    }
}

/// Replaces "a value or null" by the value's own schema.
fn inline_only_alternative(members: &mut Map<String, Value>) {
    let Some(Value::Array(alternatives)) = members.get_mut("anyOf") else { return };
    alternatives.retain(|schema| schema.get("type") != Some(&json!("null")));
    if let [Value::Object(only)] = &mut alternatives[..] {
        let only = std::mem::take(only);
        members.remove("anyOf");
        for (key, value) in only {
            members.entry(key).or_insert(value);
        }
    }
}

/// Returns the schema of a world's scenarios.
pub fn for_world(world: &dyn WorldType) -> Value {
    let mut schema = for_type::<Head>();
    schema["properties"]["format"]["const"] = FORMAT.into();
    schema["properties"]["world"]["const"] = world.name().into();
    if let Value::Object(sections) = world.sections() {
        merge(&mut schema, sections);
    }
    describe::describe(&mut schema, world.default_scenario());
    let title = format!("A scenario of the world {}", world.name());
    // Readers look for these first, so they come before the keywords of the type.
    let mut members = Map::new();
    members.insert("$schema".into(), DRAFT.into());
    members.insert("title".into(), title.into());
    members.insert("description".into(), world.about().into());
    for (key, value) in schema.as_object().cloned().unwrap_or_default() {
        members.entry(key).or_insert(value);
    }
    Value::Object(members)
}

/// Adds names to a definition of a schema that lists built-in names: those of choices that a program adds.
pub fn add_names<'a>(schema: &mut Value, definition: &str, names: impl Iterator<Item = &'a str>) {
    let list = &mut schema["$defs"][definition];
    for name in names {
        // Where a name has a description, each is an alternative of its own.
        if let Some(Value::Array(alternatives)) = list.get_mut("oneOf") {
            alternatives.push(json!({ "type": "string", "const": name }));
        } else if let Some(Value::Array(values)) = list.get_mut("enum") {
            values.push(name.into());
        }
    }
}

/// Returns the schema of a file with the keys of `schema`, a title, and the descriptions of a commented scenario for
/// the keys that both have.
pub fn for_file(title: &str, mut schema: Value, scenario: &str) -> Value {
    describe::describe(&mut schema, scenario);
    let mut members = Map::new();
    members.insert("$schema".into(), DRAFT.into());
    members.insert("title".into(), title.into());
    for (key, value) in schema.as_object().cloned().unwrap_or_default() {
        members.entry(key).or_insert(value);
    }
    Value::Object(members)
}

/// Adds the sections of a world to the keys that all worlds share.
fn merge(schema: &mut Value, sections: Map<String, Value>) {
    for (key, value) in sections {
        match (schema.get_mut(&key), value) {
            (Some(Value::Object(members)), Value::Object(more)) => members.extend(more),
            (Some(Value::Array(elements)), Value::Array(more)) => elements.extend(more),
            (Some(old), value) => *old = value,
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
        for world in self.iter() {
            let mut schema = for_world(world);
            prefix_references(&mut schema, world.name());
            if let Some(members) = schema.as_object_mut() {
                members.remove("$schema");
                // Worlds may have definitions of the same name, so each gets its world's name as a prefix.
                if let Some(Value::Object(own)) = members.remove("$defs") {
                    for (name, definition) in own {
                        definitions.insert(format!("{}.{name}", world.name()), definition);
                    }
                }
            }
            definitions.insert(world.name().into(), schema);
        }
        let references: Vec<Value> = self
            .names()
            .into_iter()
            .map(|name| json!({ "$ref": format!("#/$defs/{name}") }))
            .collect();
        json!({
            "$schema": DRAFT,
            "title": "A scenario of any world",
            "oneOf": references,
            "$defs": definitions,
        })
    }
}

/// Adds the name of a world to references to definitions.
fn prefix_references(schema: &mut Value, world: &str) {
    match schema {
        Value::Array(elements) => {
            elements.iter_mut().for_each(|element| prefix_references(element, world));
        }
        Value::Object(members) => {
            if let Some(Value::String(reference)) = members.get_mut("$ref") {
                *reference = reference.replace("#/$defs/", &format!("#/$defs/{world}."));
            }
            members.values_mut().for_each(|member| prefix_references(member, world));
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

/// Marks a string of a schema, or the elements of an array of strings, as names:
/// keys of the table `table`, or one of `built_in`.
///
/// # Panics
/// When the schema has no such key.
pub fn mark_as_names(schema: &mut Value, key: &str, table: &str, built_in: &[&str]) {
    let path: Vec<String> = key.split('.').map(String::from).collect();
    let pointers = pointers::pointers(schema, &path);
    assert!(!pointers.is_empty(), "the sections have no key `{key}`");
    for pointer in pointers {
        let part = schema.pointer_mut(&pointer).expect("found just now");
        let part = if part.get("items").is_some() { &mut part["items"] } else { part };
        part["x-names"] = table.into();
        if !built_in.is_empty() {
            part["examples"] = built_in.into();
        }
    }
}

/// Returns the keys of the commented scenario of a world, also those that are commented out, that its
/// schema does not have. There should be none.
pub fn unknown_keys(world: &dyn WorldType) -> Vec<String> {
    let schema = for_world(world);
    let mut unknown = Vec::new();
    for key in documented::documented_keys(world.default_scenario()) {
        if pointers::pointers(&schema, &key.path).is_empty() {
            unknown.push(key.path.join("."));
        }
    }
    unknown
}

/// Returns the keys of a world's schema, as JSON pointers, that are nowhere in its commented scenario, neither as a
/// key nor in the comment of one.
pub fn undocumented_keys(world: &dyn WorldType) -> Vec<String> {
    let schema = for_world(world);
    let documented_keys = documented::documented_keys(world.default_scenario());
    let mut documented = BTreeSet::new();
    for key in &documented_keys {
        // A key documents its parents too.
        for depth in 1..=key.path.len() {
            documented.extend(pointers::pointers(&schema, &key.path[..depth]));
        }
    }
    let is_mentioned = |name: &str| documented_keys.iter().any(|key| has_word(&key.words, name));
    let mut properties = Vec::new();
    pointers::collect_properties(&schema, "", &mut properties);
    properties.retain(|(pointer, name)| !documented.contains(pointer) && !is_mentioned(name));
    properties.into_iter().map(|(pointer, _)| pointer).collect()
}

/// Words are divided by anything but letters, digits and `_`, so that `seed` is not found in `seed_of`.
fn has_word(text: &str, key: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == key)
}

/// Returns examples of a key's values, from the commented scenario of its world.
pub fn examples(schema: &Value, path: &[String]) -> Vec<Value> {
    let pointers = pointers::pointers(schema, path);
    let examples = pointers.iter().filter_map(|pointer| schema.pointer(pointer)?.get("examples"));
    examples.filter_map(Value::as_array).flatten().cloned().collect()
}

/// Returns a schema that was written by hand; one that accepts everything if it is neither an object nor a truth value.
#[doc(hidden)]
pub fn written(schema: Value) -> Schema {
    Schema::try_from(schema).unwrap_or_default()
}

/// Gives a handwritten schema, a `serde_json::Value`, to a type with a handwritten `Deserialize`. It
/// is inlined wherever the type is used.
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
