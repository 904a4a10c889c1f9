//! The schemas are those of the very scenarios that compile.

use crate::shipped;
use crate::valid::wrong;
use serde_json::Value;
use sidestep::scenario::{Source, schema};
use sidestep::worlds::WORLDS;
use std::str::FromStr;

/// Returns a text as JSON. Infinity, which JSON has not, is the greatest number there.
fn json(text: &str) -> Value {
    let table: toml::Table = text.parse().expect("TOML");
    of_toml(toml::Value::Table(table))
}

fn of_toml(value: toml::Value) -> Value {
    match value {
        toml::Value::Float(x) if x.is_infinite() => f64::MAX.copysign(x).into(),
        toml::Value::Array(many) => many.into_iter().map(of_toml).collect(),
        toml::Value::Table(table) => {
            table.into_iter().map(|(key, value)| (key, of_toml(value))).collect()
        }
        other => serde_json::to_value(other).expect("JSON has it"),
    }
}

fn schema_of(world: &str) -> Value {
    WORLDS.schema(Some(world)).expect("a world")
}

#[test]
fn schemas_take_all_scenarios_of_their_world_and_of_no_other() {
    let any = WORLDS.schema(None).expect("one for all");
    for (world, source) in shipped::all() {
        let scenario = json(&source.text);
        assert_eq!(wrong(&schema_of(&world), &scenario), [""; 0], "{}", source.place);
        assert_eq!(wrong(&any, &scenario), [""; 0], "{}", source.place);
        let other = if world == "chain" { "robots" } else { "chain" };
        assert!(!wrong(&schema_of(other), &scenario).is_empty(), "{}", source.place);
    }
}

/// Adds a misspelled key to every table of a value, one at a time.
fn misspelled(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Array(many) => {
            for (i, one) in many.iter().enumerate() {
                misspelled(one, &format!("{at}/{i}"), found);
            }
        }
        Value::Object(members) => {
            found.push(at.into());
            for (key, one) in members {
                misspelled(
                    one,
                    &format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")),
                    found,
                );
            }
        }
        _ => {}
    }
}

/// Tables with keys that are names given by a scenario.
fn has_names(at: &str) -> bool {
    let parts: Vec<&str> = at.split('/').skip(1).collect();
    matches!(
        parts[..],
        ["kinds" | "sensors" | "effectors"]
            | ["effectors", _]
            | ["sensors" | "effectors", _, "evidence", ..]
            | [.., "designates" | "confusion" | "confusion_by_class" | "distance_confusion"]
            | [.., "confusion_by_class", _]
            | [.., "weights" | "weights_after_contact"]
    )
}

#[test]
fn schemas_refuse_a_misspelled_key_in_every_table_of_every_scenario() {
    for (world, source) in shipped::all() {
        let (schema, scenario) = (schema_of(&world), json(&source.text));
        let mut tables = Vec::new();
        misspelled(&scenario, "", &mut tables);
        for at in tables.iter().filter(|at| !has_names(at)) {
            let mut wrong_one = scenario.clone();
            wrong_one.pointer_mut(at).expect("a table")["mispelled"] = 1.into();
            assert!(!wrong(&schema, &wrong_one).is_empty(), "{} at {at:?}", source.place);
        }
    }
}

#[test]
fn a_default_scenario_shows_every_key_of_its_schema_and_no_other() {
    let unshown = WORLDS.iter().map(|kind| (kind.name(), schema::undocumented_keys(kind)));
    let unshown: Vec<_> = unshown.filter(|(_, keys)| !keys.is_empty()).collect();
    assert!(unshown.is_empty(), "{unshown:#?}");
    for kind in WORLDS.iter() {
        assert_eq!(schema::unknown_keys(kind), [""; 0], "{}", kind.name());
        let keys = toml_edit::DocumentMut::from_str(kind.default_scenario()).expect("TOML");
        assert!(keys.len() >= 5 && kind.default_scenario().contains("\n# "), "{}", kind.name());
    }
}

#[test]
fn a_new_drawing_of_a_world_runs_and_begins_with_one_of_its_tools() {
    let mut drawings = 0;
    for kind in WORLDS.iter() {
        let editing = kind.editing();
        let Some(drawing) = editing.drawing else { continue };
        drawings += 1;
        assert!(editing.tools.iter().any(|tool| tool.id == drawing.tool), "{}", drawing.tool);
        let wall = "#".repeat(8);
        let free = format!("#{}#", ".".repeat(6));
        let map = [&*wall, &free, &free, &free, &free, &wall].join("\n");
        let values = [
            ("{name}", "\"A hall\""),
            ("{box_size_m}", "0.25"),
            ("{map}", &map),
            ("{column}", "3"),
            ("{row}", "2"),
        ];
        let mut text = drawing.text.to_string();
        for (place, value) in values {
            assert!(text.contains(place), "{place}");
            text = text.replace(place, value);
        }
        let mut run = sidestep::parse(text).start().expect("a valid scenario");
        assert_eq!(run.advance(10).expect("it runs"), 10);
    }
    assert_eq!(drawings, 1, "robots have drawn maps");
}

/// Gathers the keys of a schema, with their own schemas.
fn keys(root: &Value, part: &Value, way: &str, found: &mut Vec<(String, Value)>) {
    if let Some(target) = part.get("$ref").and_then(Value::as_str) {
        return keys(root, &root[&target[2..7]][&target[8..]], way, found);
    }
    for word in ["oneOf", "anyOf"] {
        // Alternatives have the same keys, alone and in an array.
        if let Some(first) = part.get(word).and_then(|all| all.get(0)) {
            keys(root, first, way, found);
        }
    }
    for (name, inner) in part.get("properties").and_then(Value::as_object).into_iter().flatten() {
        let way = format!("{way}.{name}").trim_start_matches('.').to_string();
        found.push((way.clone(), inner.clone()));
        keys(root, inner, &way, found);
    }
    if let Some(inner) = part.get("additionalProperties") {
        keys(root, inner, &format!("{way}.*"), found);
    }
}

#[test]
fn every_key_says_what_it_is() {
    let mut silent: Vec<String> = Vec::new();
    for world in WORLDS.names() {
        let schema = schema_of(world);
        let mut all = Vec::new();
        keys(&schema, &schema, "", &mut all);
        assert!(all.len() > 80, "{world}: {}", all.len());
        let without = all.iter().filter(|(_, part)| part.get("description").is_none());
        silent.extend(without.map(|(way, _)| format!("{world}: {way}")));
    }
    assert!(silent.is_empty(), "{silent:#?}");
}

/// Returns the digest of a run after some cycles; none of a scenario that is wrong.
fn digest(text: &str) -> Option<String> {
    let source = Source::new("s.toml", text, "");
    let mut run = WORLDS.compile(&source).ok()?.start(&source, 1);
    run.advance(20);
    Some(run.digest().to_string())
}

#[test]
fn defaults_of_schemas_are_those_of_the_program() {
    for kind in WORLDS.iter() {
        let schema = schema_of(kind.name());
        let (mut all, mut compared) = (Vec::new(), 0);
        keys(&schema, &schema, "", &mut all);
        for (way, part) in all.iter().filter(|(way, _)| !way.contains('*')) {
            let Some(default) = part.get("default") else { continue };
            let default = toml::Value::try_from(default).expect("TOML has it");
            let without = without(kind.default_scenario(), way);
            let given =
                Source::new("s.toml", &without, "").with_overrides(&[format!("{way}={default}")]);
            let (Ok(given), Some(left_out)) = (given, digest(&without)) else { continue };
            // A key that belongs to another one may not stand alone.
            if let Some(given) = digest(&given.text) {
                assert_eq!(given, left_out, "{}: {way} = {default}", kind.name());
                compared += 1;
            }
        }
        assert!(compared >= 15, "{}: {compared} defaults were compared", kind.name());
    }
}

/// Returns a text without a key, if it has it.
fn without(text: &str, way: &str) -> String {
    let mut document = toml_edit::DocumentMut::from_str(text).expect("TOML");
    let mut table: Option<&mut dyn toml_edit::TableLike> = Some(document.as_table_mut());
    let (path, last) = way.rsplit_once('.').unwrap_or(("", way));
    for part in path.split('.').filter(|part| !part.is_empty()) {
        table = table.and_then(|table| table.get_mut(part)?.as_table_like_mut());
    }
    table.and_then(|table| table.remove(last));
    document.to_string()
}
