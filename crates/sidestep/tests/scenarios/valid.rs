//! A validator for the words of JSON Schema that ours use. A word that it does not know is an error.

use serde_json::Value;

type Words = serde_json::Map<String, Value>;

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

/// Returns the errors of a value, each with its place; none if the schema takes it.
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
            "oneOf" => fits(root, means, value) == 1,
            "anyOf" => fits(root, means, value) >= 1,
            "$ref" => {
                let target = means.as_str().expect("a place").trim_start_matches('#');
                check(root, root.pointer(target).expect(target), value, at, told);
                true
            }
            "required" => {
                let missing = list(means).iter().filter_map(Value::as_str);
                let missing = missing.filter(|key| value.is_object() && value.get(key).is_none());
                told.extend(missing.map(|key| format!("{at}: {key} is missing")));
                true
            }
            "items" | "prefixItems" => {
                elements(root, words, value, at, told);
                true
            }
            "properties" | "additionalProperties" => {
                members(root, words, value, at, told);
                true
            }
            _ => allows(word, means, value),
        };
        if !is_right {
            told.push(format!("{at}: {value} against {word} {means}"));
        }
    }
}

/// Checks the elements of an array: the first ones have schemas of their own.
fn elements(root: &Value, words: &Words, value: &Value, at: &str, told: &mut Vec<String>) {
    let first = words.get("prefixItems").map_or(&[][..], list);
    for (i, one) in value.as_array().into_iter().flatten().enumerate() {
        if let Some(schema) = first.get(i).or(words.get("items")) {
            check(root, schema, one, &format!("{at}/{i}"), told);
        }
    }
}

/// Checks the members of a table: those that have no schema of their own have a common one.
fn members(root: &Value, words: &Words, value: &Value, at: &str, told: &mut Vec<String>) {
    let own = words.get("properties").and_then(Value::as_object);
    for (key, one) in value.as_object().into_iter().flatten() {
        let schema = own.and_then(|own| own.get(key)).or(words.get("additionalProperties"));
        if let Some(schema) = schema {
            check(root, schema, one, &format!("{at}/{key}"), told);
        }
    }
}

/// Returns whether a word about the value itself allows it.
fn allows(word: &str, means: &Value, value: &Value) -> bool {
    let number = |holds: &dyn Fn(f64, f64) -> bool| {
        value.as_f64().is_none_or(|x| holds(x, means.as_f64().expect("a number")))
    };
    let count = |holds: &dyn Fn(usize, usize) -> bool| {
        let count = value.as_array().map(Vec::len).or(value.as_str().map(str::len));
        count.is_none_or(|n| holds(n, means.as_u64().expect("a count") as usize))
    };
    match word {
        "type" => is_of_type(means, value),
        "const" => means == value,
        "enum" => list(means).contains(value),
        "minimum" => number(&|x, least| x >= least),
        "maximum" => number(&|x, most| x <= most),
        "exclusiveMinimum" => number(&|x, least| x > least),
        "exclusiveMaximum" => number(&|x, most| x < most),
        "multipleOf" => number(&|x, unit| x % unit == 0.0),
        "minItems" => count(&|n, least| n >= least),
        "maxItems" | "maxLength" => count(&|n, most| n <= most),
        "pattern" => {
            assert_eq!(means, "^[FLBR]*$", "the only pattern");
            value.as_str().is_none_or(|s| s.chars().all(|c| "FLBR".contains(c)))
        }
        note => {
            assert!(NOTES.contains(&note), "the validator does not know `{note}`");
            true
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
