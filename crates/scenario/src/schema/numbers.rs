//! Numbers that check themselves, in terms of JSON Schema.

use crate::{FixedList, Integer, Number, NumberRange, Point, Rule};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::{Value, json};
use std::borrow::Cow;

fn numbers(conditions: Value) -> Schema {
    let mut schema = json_schema!({ "type": "number" });
    if let Value::Object(conditions) = conditions {
        schema.ensure_object().extend(conditions);
    }
    schema
}

/// Implements the common part of all: they are inlined, because a definition of a few words would only be a detour for
/// the reader.
macro_rules! inline {
    ($name:literal) => {
        fn inline_schema() -> bool {
            true
        }

        fn schema_name() -> Cow<'static, str> {
            $name.into()
        }
    };
}

impl<R: Rule> JsonSchema for Number<R> {
    inline!("Number");

    fn schema_id() -> Cow<'static, str> {
        std::any::type_name::<Self>().into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        numbers(R::limits())
    }
}

impl<const MIN: u64, const MAX: u64> JsonSchema for Integer<MIN, MAX> {
    inline!("Whole");

    fn schema_id() -> Cow<'static, str> {
        format!("Whole_{MIN}_{MAX}").into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let mut schema = json_schema!({ "type": "integer", "minimum": MIN });
        // TOML has no larger integers.
        if MAX < i64::MAX as u64 {
            schema.insert("maximum".into(), MAX.into());
        }
        schema
    }
}

impl<const D: usize, R: Rule> JsonSchema for Point<D, R> {
    inline!("Point");

    fn schema_id() -> Cow<'static, str> {
        std::any::type_name::<Self>().into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let items = numbers(R::limits());
        json_schema!({ "type": "array", "items": items, "minItems": D, "maxItems": D })
    }
}

impl<T: JsonSchema, const N: usize> JsonSchema for FixedList<T, N> {
    inline!("FixedList");

    fn schema_id() -> Cow<'static, str> {
        std::any::type_name::<Self>().into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let items = generator.subschema_for::<T>();
        json_schema!({ "type": "array", "items": items, "minItems": N, "maxItems": N })
    }
}

impl JsonSchema for NumberRange {
    inline!("Limits");

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json!({ "type": "number" });
        json_schema!({
            "oneOf": [number, { "type": "array", "items": number, "minItems": 2, "maxItems": 2 }]
        })
    }
}
