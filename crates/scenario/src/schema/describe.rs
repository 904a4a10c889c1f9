//! Comments and values of a world's commented scenario, put into its schema.

use super::documented::{DocumentedKey, documented_keys};
use super::pointers::pointers;
use serde_json::{Map, Value};
use sidestep_kernel::ports::table::split_unit;

/// Adds to each key the statements of the commented scenario about it: words, examples, and its default; and those of
/// its name: a title and a unit.
pub(crate) fn describe(schema: &mut Value, scenario: &str) {
    let mut told: Vec<String> = Vec::new();
    for one in documented_keys(scenario) {
        for place in pointers(schema, &one.way) {
            let is_new = !told.contains(&place);
            let Some(Value::Object(part)) = schema.pointer_mut(&place) else { continue };
            add(part, &one, is_new);
            // Tables of names get the statements about the first name that is shown.
            let table = place.strip_suffix("/additionalProperties");
            if let Some(Value::Object(table)) = table.and_then(|table| schema.pointer_mut(table))
                && !one.words.is_empty()
            {
                table.entry("description").or_insert(one.words.clone().into());
            }
            told.push(place);
        }
    }
    add_titles(schema);
}

/// Adds the statements about a key. Of several alternatives the first has the words, and all are examples.
fn add(part: &mut Map<String, Value>, one: &DocumentedKey, is_new: bool) {
    if !one.words.is_empty() && (is_new || !part.contains_key("description")) {
        part.insert("description".into(), one.words.clone().into());
    }
    let Some(value) = &one.value else { return };
    if is_new && let Some(default) = default_of(one, part).filter(|own| is_like(own, value)) {
        part.insert("default".into(), default);
    }
    let examples = part.entry("examples").or_insert_with(|| Value::Array(Vec::new()));
    if let Some(examples) = examples.as_array_mut().filter(|all| !all.contains(value)) {
        examples.push(value.clone());
    }
}

/// Returns the default of a key: `[value]` at the end of its words, `default value` in them, or the
/// value of a key that is left out, if it can have no other meaning.
fn default_of(one: &DocumentedKey, part: &Map<String, Value>) -> Option<Value> {
    let bracket = one.words.strip_suffix(']').and_then(|words| words.rsplit_once('['));
    if let Some((_, told)) = bracket {
        return value_of(told);
    }
    if let Some((_, told)) = one.words.rsplit_once("default ") {
        let told = told.split([';', ',']).next().unwrap_or(told);
        let told = if told.starts_with('[') { one.words.rsplit_once("default ")?.1 } else { told };
        return value_of(told);
    }
    let is_alternative = ["e.g.", "instead", "or as ", "part of"].iter();
    let is_alternative = is_alternative.clone().any(|word| one.words.contains(word));
    let value = one.value.as_ref().filter(|_| one.is_left_out && !is_alternative)?;
    let is_plain = value.is_boolean() || value.is_number() || part.contains_key("enum");
    let is_plain = is_plain || part.contains_key("oneOf") || part.contains_key("$ref");
    is_plain.then(|| value.clone())
}

/// Returns whether both are arrays, or neither is.
fn is_like(one: &Value, other: &Value) -> bool {
    one.is_array() == other.is_array()
}

fn value_of(toml: &str) -> Option<Value> {
    let table: toml::Table = format!("x = {toml}").parse().ok()?;
    let value = serde_json::to_value(table.get("x")?).ok()?;
    (!value.is_null()).then_some(value)
}

/// Adds the words of keys as their titles, and the units that they end in.
fn add_titles(schema: &mut Value) {
    match schema {
        Value::Array(many) => many.iter_mut().for_each(add_titles),
        Value::Object(members) => {
            let own = members.get("description").cloned();
            if let Some(Value::Object(keys)) = members.get_mut("properties") {
                let is_alone = keys.len() == 1;
                for (key, part) in keys.iter_mut() {
                    let (quantity, unit) = split_unit(key);
                    let Some(part) = part.as_object_mut() else { continue };
                    part.insert("title".into(), quantity.replace('_', " ").into());
                    // Names of alternatives mean the same as the alternatives.
                    if let Some(own) =
                        own.clone().filter(|_| is_alone || part.contains_key("const"))
                    {
                        part.entry("description").or_insert(own);
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
