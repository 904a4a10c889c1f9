//! TypeScript's types of an inspection, which the server sends as the kernel has it.
//!
//! The kernel derives no types for the page, as it would compile `ts-rs` for every user. They are written by hand in
//! `inspection.ts` instead, and checked here against what the kernel serializes.

use serde_json::json;
use sidestep::worlds::chain::kinds::CONNECTOR;
use sidestep_kernel::view::{
    BodyId, FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape,
};

/// The declarations.
pub(super) const TYPES: &str = include_str!("inspection.ts");

/// Returns the declaration of a variant; a variant that is new in the kernel does not compile without one.
fn declared_value(value: &FactValue) -> &'static str {
    match value {
        FactValue::Number { .. } => r#"{ "number": { value: number, unit: string, } }"#,
        FactValue::Share(_) => r#"{ "share": number }"#,
        FactValue::Text(_) => r#"{ "text": string }"#,
        FactValue::Body(_) => r#"{ "body": BodyId }"#,
        FactValue::Place(_) => r#"{ "place": [number, number, number] }"#,
        FactValue::Flag(_) => r#"{ "flag": boolean }"#,
        FactValue::None => r#""none""#,
    }
}

/// Returns the declaration of a variant.
fn declared_shape(shape: &MarkShape) -> &'static str {
    match shape {
        MarkShape::Line { .. } => r#""type": "line", points_m: Array<[number, number, number]>"#,
        MarkShape::Area { .. } => r#""type": "area", corners_m: Array<[number, number, number]>"#,
        MarkShape::Point { .. } => r#""type": "point", at_m: [number, number, number]"#,
        MarkShape::Circle { .. } => {
            r#""type": "circle", at_m: [number, number, number], radius_m: number"#
        }
    }
}

fn example_body_id() -> BodyId {
    BodyId::new(CONNECTOR, 3, Some(1))
}

#[test]
fn every_value_is_declared_as_it_is_serialized() {
    for (value, expected) in [
        (FactValue::number(1.5, "m"), json!({ "number": { "value": 1.5, "unit": "m" } })),
        (FactValue::Share(0.5), json!({ "share": 0.5 })),
        (FactValue::text("left"), json!({ "text": "left" })),
        (
            example_body_id().into(),
            json!({ "body": { "kind": "connector", "number": 3, "part": 1 } }),
        ),
        (FactValue::Place([1.0, 2.0, 3.0]), json!({ "place": [1.0, 2.0, 3.0] })),
        (FactValue::Flag(true), json!({ "flag": true })),
        (FactValue::None, json!("none")),
    ] {
        assert!(TYPES.contains(declared_value(&value)), "{value:?}");
        assert_eq!(serde_json::to_value(&value).expect("JSON"), expected);
    }
}

#[test]
fn every_shape_and_role_of_a_mark_is_declared_as_it_is_serialized() {
    let at_m = [1.0, 2.0, 3.0];
    for (shape, expected) in [
        (MarkShape::Line { points_m: vec![at_m] }, json!({ "type": "line", "points_m": [at_m] })),
        (MarkShape::Area { corners_m: vec![at_m] }, json!({ "type": "area", "corners_m": [at_m] })),
        (MarkShape::Point { at_m }, json!({ "type": "point", "at_m": at_m })),
        (
            MarkShape::Circle { at_m, radius_m: 4.0 },
            json!({ "type": "circle", "at_m": at_m, "radius_m": 4.0 }),
        ),
    ] {
        assert!(TYPES.contains(declared_shape(&shape)), "{shape:?}");
        assert_eq!(serde_json::to_value(&shape).expect("JSON"), expected);
    }
    for role in MarkRole::ALL {
        let name = serde_json::to_value(role).expect("JSON").to_string();
        assert!(TYPES.contains(&format!("{name} |")) || TYPES.contains(&format!("| {name};")));
    }
}

#[test]
fn an_inspection_has_the_declared_fields() {
    let mut table = FactTable::new(["other"]);
    table.push_row([example_body_id().into()]);
    let mut inspection = Inspection::new(example_body_id(), 7, "head");
    inspection.add_section(FactSection::new("sees").fact("near", true).table(table));
    inspection.add_mark(MarkRole::Wish, "ahead", MarkShape::Point { at_m: [0.0; 3] });
    let id = json!({ "kind": "connector", "number": 3, "part": 1 });
    let expected = json!({
        "body": id,
        "cycle": 7,
        "title": "head",
        "sections": [{
            "title": "sees",
            "facts": [{ "label": "near", "value": { "flag": true } }],
            "table": { "columns": ["other"], "rows": [[{ "body": id }]] },
        }],
        "marks": [{
            "role": "wish",
            "label": "ahead",
            "weight": 1.0,
            "shape": { "type": "point", "at_m": [0.0, 0.0, 0.0] },
        }],
    });
    assert_eq!(serde_json::to_value(&inspection).expect("JSON"), expected);
}
