//! A validator for the words of JSON Schema that ours use. A word that it does not know is an error.

use serde_json::Value;

/// Words without a condition.
const NOTES: [&str; 10] = [
    "$schema",
    "$defs",
    "title",
    "description",
    "default",
    "examples",
    "format",
    "x-unit",
    "x-names",
    "x-infinite",
];

/// Returns what is wrong with a value, each with its place; nothing if the schema takes it.
pub(crate) fn wrong(root: &Value, value: &Value) -> Vec<String> {
    let mut told = Vec::new();
    check(root, root, value, "", &mut told);
    told
}

fn check(root: &Value, schema: &Value, value: &Value, at: &str, told: &mut Vec<String>) {
    let Value::Object(words) = schema else {
        if *schema == Value::Bool(false) {
            told.push(format!("{at}: nothing is allowed"));
        }
        return;
    };
    for (word, means) in words {
        let is_right = match word.as_str() {
            "type" => is_of_type(means, value),
            "const" => means == value,
            "enum" => list(means).contains(value),
            "minimum" => number(value).is_none_or(|x| x >= number(means).expect("a number")),
            "maximum" => number(value).is_none_or(|x| x <= number(means).expect("a number")),
            "exclusiveMinimum" => {
                number(value).is_none_or(|x| x > number(means).expect("a number"))
            }
            "exclusiveMaximum" => {
                number(value).is_none_or(|x| x < number(means).expect("a number"))
            }
            "multipleOf" => number(value).is_none_or(|x| x % number(means).expect("one") == 0.0),
            "minItems" => {
                value.as_array().is_none_or(|a| a.len() as u64 >= means.as_u64().unwrap())
            }
            "maxItems" => {
                value.as_array().is_none_or(|a| a.len() as u64 <= means.as_u64().unwrap())
            }
            "maxLength" => value.as_str().is_none_or(|s| s.len() as u64 <= means.as_u64().unwrap()),
            "pattern" => {
                assert_eq!(means, "^[FLBR]*$", "the only pattern");
                value.as_str().is_none_or(|s| s.chars().all(|c| "FLBR".contains(c)))
            }
            "required" => {
                let missing = list(means).iter().filter_map(Value::as_str);
                let missing = missing.filter(|key| value.is_object() && value.get(key).is_none());
                told.extend(missing.map(|key| format!("{at}: {key} is missing")));
                true
            }
            "oneOf" => fits(root, means, value) == 1,
            "anyOf" => fits(root, means, value) >= 1,
            "$ref" => {
                let target = means.as_str().expect("a place").trim_start_matches('#');
                check(root, root.pointer(target).expect(target), value, at, told);
                true
            }
            "items" => {
                let first = words.get("prefixItems").map_or(0, |own| list(own).len());
                for (i, one) in value.as_array().into_iter().flatten().enumerate().skip(first) {
                    check(root, means, one, &format!("{at}/{i}"), told);
                }
                true
            }
            "prefixItems" => {
                let each = list(means).iter().zip(value.as_array().into_iter().flatten());
                each.for_each(|(schema, one)| check(root, schema, one, at, told));
                true
            }
            "properties" => {
                for (key, schema) in means.as_object().expect("keys") {
                    if let Some(one) = value.get(key) {
                        check(root, schema, one, &format!("{at}/{key}"), told);
                    }
                }
                true
            }
            "additionalProperties" => {
                let own = words.get("properties").and_then(Value::as_object);
                for (key, one) in value.as_object().into_iter().flatten() {
                    if own.is_none_or(|own| !own.contains_key(key)) {
                        check(root, means, one, &format!("{at}/{key}"), told);
                    }
                }
                true
            }
            note => {
                assert!(NOTES.contains(&note), "the validator does not know `{note}`");
                true
            }
        };
        if !is_right {
            told.push(format!("{at}: {value} against {word} {means}"));
        }
    }
}

fn fits(root: &Value, alternatives: &Value, value: &Value) -> usize {
    let fits = |schema: &&Value| {
        let mut told = Vec::new();
        check(root, schema, value, "", &mut told);
        told.is_empty()
    };
    list(alternatives).iter().filter(fits).count()
}

fn is_of_type(types: &Value, value: &Value) -> bool {
    let is_of = |name: &Value| match name.as_str().expect("a name") {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        other => panic!("no type of TOML: {other}"),
    };
    match types {
        Value::Array(many) => many.iter().any(is_of),
        one => is_of(one),
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn number(value: &Value) -> Option<f64> {
    value.as_f64()
}
