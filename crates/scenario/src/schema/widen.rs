//! One schema for two shapes of the same sections.

use serde_json::Value;

/// Returns a schema that accepts everything that either of two accepts, which differ only in the
/// number of elements of arrays: places in the plane, and places in space.
pub fn widened(plane: &Value, space: &Value) -> Value {
    match (plane, space) {
        (Value::Object(a), Value::Object(b)) => {
            let merged = a.iter().map(|(key, value)| {
                let other = b.get(key).unwrap_or(value);
                let value = match key.as_str() {
                    "maxItems" if other.as_u64() > value.as_u64() => other.clone(),
                    "minItems" if other.as_u64() < value.as_u64() => other.clone(),
                    "maxItems" | "minItems" => value.clone(),
                    _ => widened(value, other),
                };
                (key.clone(), value)
            });
            Value::Object(merged.collect())
        }
        (Value::Array(a), Value::Array(b)) => {
            Value::Array(a.iter().zip(b).map(|(a, b)| widened(a, b)).collect())
        }
        _ => plane.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn points_may_have_as_many_numbers_as_either_shape_has() {
        let of = |n: usize| json!({ "a": [{ "minItems": n, "maxItems": n, "items": { "x": 1 } }] });
        let expected = json!({ "a": [{ "minItems": 2, "maxItems": 3, "items": { "x": 1 } }] });
        assert_eq!(widened(&of(2), &of(3)), expected);
    }
}
