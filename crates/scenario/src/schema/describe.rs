//! Comments and values of a world's commented scenario, added to its schema.

use super::documented::{DocumentedKey, documented_keys};
use super::pointers::pointers;
use serde_json::{Map, Value};
use sidestep_kernel::ports::table::split_unit;

/// Adds to each key its description, examples and default from the commented scenario, and a title and a unit from its
/// name.
pub(crate) fn describe(schema: &mut Value, scenario: &str) {
    let mut described: Vec<String> = Vec::new();
    for key in documented_keys(scenario) {
        for pointer in pointers(schema, &key.path) {
            let is_new = !described.contains(&pointer);
            let Some(Value::Object(part)) = schema.pointer_mut(&pointer) else { continue };
            add(part, &key, is_new);
            // A table of names gets the description of the first name that the scenario shows.
            let table = pointer.strip_suffix("/additionalProperties");
            if let Some(Value::Object(table)) = table.and_then(|table| schema.pointer_mut(table))
                && !key.words.is_empty()
            {
                table.entry("description").or_insert(key.words.clone().into());
            }
            described.push(pointer);
        }
    }
    add_titles(schema);
}

/// Adds the description, the default and the example of a key. Of several alternatives the first gives the
/// description, and all are examples.
fn add(part: &mut Map<String, Value>, key: &DocumentedKey, is_new: bool) {
    if !key.words.is_empty() && (is_new || !part.contains_key("description")) {
        part.insert("description".into(), key.words.clone().into());
    }
    let Some(value) = &key.value else { return };
    // A default of another shape is that of an alternative notation.
    if is_new
        && let Some(default) = default_of(key, part)
        && default.is_array() == value.is_array()
    {
        part.insert("default".into(), default);
    }
    let examples = part.entry("examples").or_insert_with(|| Value::Array(Vec::new()));
    if let Some(examples) = examples.as_array_mut().filter(|all| !all.contains(value)) {
        examples.push(value.clone());
    }
}

/// Words of comments that say that a value is one of several, and so not the default.
const ALTERNATIVE_WORDS: [&str; 4] = ["e.g.", "instead", "or as ", "part of"];

/// Returns the default of a key: `[value]` at the end of its words, `default value` in them, or the
/// value of a key that is commented out, if it can have no other meaning.
fn default_of(key: &DocumentedKey, part: &Map<String, Value>) -> Option<Value> {
    let bracket = key.words.strip_suffix(']').and_then(|words| words.rsplit_once('['));
    if let Some((_, text)) = bracket {
        return parse_value(text);
    }
    if let Some((_, text)) = key.words.rsplit_once("default ") {
        // The value ends at a comma, except within an array.
        let end = if text.starts_with('[') { None } else { text.find([';', ',']) };
        return parse_value(&text[..end.unwrap_or(text.len())]);
    }
    let is_alternative = ALTERNATIVE_WORDS.iter().any(|word| key.words.contains(word));
    let value = key.value.as_ref().filter(|_| key.is_left_out && !is_alternative)?;
    let is_plain = value.is_boolean()
        || value.is_number()
        || ["enum", "oneOf", "$ref"].iter().any(|word| part.contains_key(*word));
    is_plain.then(|| value.clone())
}

fn parse_value(toml: &str) -> Option<Value> {
    let table: toml::Table = format!("x = {toml}").parse().ok()?;
    let value = serde_json::to_value(table.get("x")?).ok()?;
    (!value.is_null()).then_some(value)
}

/// Adds the words of keys as their titles, and the units that they end in.
fn add_titles(schema: &mut Value) {
    match schema {
        Value::Array(elements) => elements.iter_mut().for_each(add_titles),
        Value::Object(members) => {
            let description = members.get("description").cloned();
            if let Some(Value::Object(keys)) = members.get_mut("properties") {
                let is_only_key = keys.len() == 1;
                for (key, part) in keys.iter_mut() {
                    let (quantity, unit) = split_unit(key);
                    let Some(part) = part.as_object_mut() else { continue };
                    part.insert("title".into(), quantity.replace('_', " ").into());
                    // The key that selects an alternative means the same as the alternative.
                    if let Some(description) =
                        description.clone().filter(|_| is_only_key || part.contains_key("const"))
                    {
                        part.entry("description").or_insert(description);
                    }
                    if let Some(unit) = unit {
                        part.insert("x-unit".into(), unit.into());
                    }
                }
            }
            members.values_mut().for_each(add_titles);
        }
        _ => {}
    }
}
