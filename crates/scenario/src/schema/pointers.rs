//! The places of a schema that are about a key.

use serde_json::Value;

/// Returns the places (JSON pointers) of the parts of a schema that are about a key. There may be
/// several, where a section stands alone or in an array; none if the schema does not know the key.
pub(crate) fn pointers(schema: &Value, way: &[String]) -> Vec<String> {
    let mut found = vec![String::new()];
    for name in way {
        found = found.iter().flat_map(|place| pointers_below(schema, place, name)).collect();
        found.sort();
        found.dedup();
    }
    found
}

/// Returns the places of a key of the tables at a place, or in the arrays there.
fn pointers_below(schema: &Value, place: &str, name: &str) -> Vec<String> {
    let Some(part) = schema.pointer(place) else { return Vec::new() };
    let mut found = Vec::new();
    if let Some(target) = part.get("$ref").and_then(Value::as_str) {
        found.extend(pointers_below(schema, target.trim_start_matches('#'), name));
    }
    for word in ["oneOf", "anyOf", "allOf"] {
        let count = part.get(word).and_then(Value::as_array).map_or(0, Vec::len);
        let inner =
            (0..count).flat_map(|i| pointers_below(schema, &format!("{place}/{word}/{i}"), name));
        found.extend(inner);
    }
    if part.get("items").is_some_and(Value::is_object) {
        found.extend(pointers_below(schema, &format!("{place}/items"), name));
    }
    if part.get("properties").is_some_and(|own| own.get(name).is_some()) {
        let name = name.replace('~', "~0").replace('/', "~1");
        found.push(format!("{place}/properties/{name}"));
    } else if part.get("additionalProperties").is_some_and(Value::is_object) {
        found.push(format!("{place}/additionalProperties"));
    }
    found
}

/// Gathers the places of all keys of the tables within a part of a schema, each with its name.
pub(crate) fn collect_properties(part: &Value, place: &str, found: &mut Vec<(String, String)>) {
    match part {
        Value::Array(many) => {
            for (i, one) in many.iter().enumerate() {
                collect_properties(one, &format!("{place}/{i}"), found);
            }
        }
        Value::Object(members) => {
            for (word, inner) in members {
                let place = format!("{place}/{word}");
                let keys = inner.as_object().filter(|_| word == "properties");
                for (name, inner) in keys.into_iter().flatten() {
                    let place = format!("{place}/{}", name.replace('~', "~0").replace('/', "~1"));
                    collect_properties(inner, &place, found);
                    found.push((place, name.clone()));
                }
                if keys.is_none() && !matches!(&word[..], "default" | "examples" | "enum") {
                    collect_properties(inner, &place, found);
                }
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn keys_are_found_in_tables_in_arrays_by_reference_and_by_any_name() {
        let schema = json!({
            "properties": {
                "robots": { "oneOf": [
                    { "$ref": "#/$defs/Robot" },
                    { "type": "array", "items": { "$ref": "#/$defs/Robot" } },
                ] },
                "sensors": { "additionalProperties": { "properties": { "a/b": {} } } },
            },
            "$defs": { "Robot": { "properties": { "at": {} } } },
        });
        let of = |way: &[&str]| {
            pointers(&schema, &way.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        assert_eq!(of(&["robots"]), ["/properties/robots"]);
        assert_eq!(of(&["robots", "at"]), ["/$defs/Robot/properties/at"]);
        assert_eq!(of(&["sensors", "x"]), ["/properties/sensors/additionalProperties"]);
        assert_eq!(
            of(&["sensors", "x", "a/b"]),
            ["/properties/sensors/additionalProperties/properties/a~1b"]
        );
        assert!(of(&["robots", "to"]).is_empty() && of(&["x"]).is_empty());
        let mut all = Vec::new();
        collect_properties(&schema, "", &mut all);
        let names: Vec<&str> = all.iter().map(|(_, name)| &name[..]).collect();
        assert_eq!(names, ["robots", "a/b", "sensors", "at"]);
        assert!(all.iter().all(|(place, _)| schema.pointer(place).is_some()), "{all:?}");
    }
}
