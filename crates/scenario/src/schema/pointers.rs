//! JSON pointers to the parts of a schema that are about a key.

use serde_json::Value;

/// Returns JSON pointers to the parts of a schema that are about a key. There may be
/// several, where a section may be a table or an array of tables; none if the schema does not have the key.
pub(crate) fn pointers(schema: &Value, path: &[String]) -> Vec<String> {
    let mut pointers = vec![String::new()];
    for name in path {
        pointers =
            pointers.iter().flat_map(|pointer| pointers_below(schema, pointer, name)).collect();
        pointers.sort();
        pointers.dedup();
    }
    pointers
}

/// Returns pointers to a key of the tables at a pointer, or in the arrays there.
fn pointers_below(schema: &Value, pointer: &str, name: &str) -> Vec<String> {
    let Some(part) = schema.pointer(pointer) else { return Vec::new() };
    let mut pointers = Vec::new();
    if let Some(target) = part.get("$ref").and_then(Value::as_str) {
        pointers.extend(pointers_below(schema, target.trim_start_matches('#'), name));
    }
    for word in ["oneOf", "anyOf", "allOf"] {
        let count = part.get(word).and_then(Value::as_array).map_or(0, Vec::len);
        let inner =
            (0..count).flat_map(|i| pointers_below(schema, &format!("{pointer}/{word}/{i}"), name));
        pointers.extend(inner);
    }
    if part.get("items").is_some_and(Value::is_object) {
        pointers.extend(pointers_below(schema, &format!("{pointer}/items"), name));
    }
    if part.get("properties").is_some_and(|own| own.get(name).is_some()) {
        pointers.push(format!("{pointer}/properties/{}", escape(name)));
    } else if part.get("additionalProperties").is_some_and(Value::is_object) {
        pointers.push(format!("{pointer}/additionalProperties"));
    }
    pointers
}

/// Escapes a name for a JSON pointer (RFC 6901).
fn escape(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// Collects pointers to all keys of the tables within a part of a schema, each with its name.
pub(crate) fn collect_properties(
    part: &Value,
    pointer: &str,
    properties: &mut Vec<(String, String)>,
) {
    match part {
        Value::Array(elements) => {
            for (i, element) in elements.iter().enumerate() {
                collect_properties(element, &format!("{pointer}/{i}"), properties);
            }
        }
        Value::Object(members) => {
            for (keyword, inner) in members {
                let pointer = format!("{pointer}/{keyword}");
                let keys = inner.as_object().filter(|_| keyword == "properties");
                for (name, inner) in keys.into_iter().flatten() {
                    let pointer = format!("{pointer}/{}", escape(name));
                    collect_properties(inner, &pointer, properties);
                    properties.push((pointer, name.clone()));
                }
                // Values, not schemas, follow these keywords.
                let has_values = matches!(&keyword[..], "default" | "examples" | "enum");
                if keys.is_none() && !has_values {
                    collect_properties(inner, &pointer, properties);
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
        let of = |path: &[&str]| {
            pointers(&schema, &path.iter().map(ToString::to_string).collect::<Vec<_>>())
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
        assert!(all.iter().all(|(pointer, _)| schema.pointer(pointer).is_some()), "{all:?}");
    }
}
