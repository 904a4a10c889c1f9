//! What a robots scenario holds, as `sidestep check` says it.

use super::{Said, line};
use crate::console::{aligned, grouped};
use serde_json::{Value, json};
use sidestep::worlds::robots::sensor::SensorModel;
use sidestep::worlds::robots::simulation::RobotsSimulation;
use std::collections::BTreeMap;

/// Map, bodies, sensors, effectors and memory.
pub(super) fn contents(simulation: &RobotsSimulation, file: &Value) -> Said {
    let (boxes_bytes, bodies_bytes) = simulation.heap_bytes();
    let json = json!({
        "world": "robots",
        "name": simulation.compiled().name,
        "seed": simulation.compiled().seed,
        "cycles": simulation.compiled().cycles,
        "regime": simulation.world().regime,
        "obstacle_rule": simulation.world().obstacle_rule,
        "conflict_policy": simulation.world().policy,
        "map": map(simulation),
        "bodies": bodies(simulation),
        "robots": robots(file),
        "sensors": sensors(simulation),
        "memory_bytes": boxes_bytes + bodies_bytes,
    });
    let text = text(&json);
    Said { json, text }
}

fn map(simulation: &RobotsSimulation) -> Value {
    let map = &simulation.world().map;
    let counts = map.counts();
    json!({
        "width_boxes": map.width(),
        "height_boxes": map.height(),
        "box_size_m": map.box_size_m,
        "free": counts.free,
        "wall": counts.wall,
        "unknown": counts.unknown,
    })
}

/// Number of bodies of each kind.
fn bodies(simulation: &RobotsSimulation) -> BTreeMap<&str, u64> {
    let world = simulation.world();
    let mut count = BTreeMap::new();
    for id in 0..world.bodies.len() as u32 {
        let kind = &world.kinds[usize::from(world.type_of(id).kind)];
        *count.entry(kind.as_str()).or_default() += 1;
    }
    count
}

/// One entry per `[[robots]]` section.
fn robots(file: &Value) -> Vec<Value> {
    let sections = match &file["robots"] {
        Value::Array(many) => many.as_slice(),
        Value::Null => &[],
        one => std::slice::from_ref(one),
    };
    sections.iter().map(robot_section).collect()
}

fn robot_section(section: &Value) -> Value {
    let places = section["at"].as_array().map(|at| at.len().into());
    let or = |value: &Value, default: Value| if value.is_null() { default } else { value.clone() };
    json!({
        "name": or(&section["name"], "robots".into()),
        "count": or(&section["count"], places.unwrap_or(Value::Null)),
        "size_boxes": or(&section["size"], 1.into()),
        "period": or(&section["period"], 1.into()),
        "sensors": or(&section["sensors"], json!([])),
        "effector": or(&section["effector"], "perfect".into()),
        "behaviour": or(&section["behaviour"]["kind"], "wander".into()),
    })
}

/// The sensors in use, each once.
fn sensors(simulation: &RobotsSimulation) -> Vec<Value> {
    let by_name: BTreeMap<&str, &SensorModel> =
        simulation.compiled().sensors().map(|s| (s.name.as_str(), s)).collect();
    let one = |s: &SensorModel| {
        json!({
            "name": s.name,
            "beams": s.bearings_deg.len(),
            "range_m": s.range_m,
            "observations": s.observations,
            "distance_edges_m": s.distance_edges_m,
        })
    };
    by_name.into_values().map(one).collect()
}

fn text(found: &Value) -> String {
    let mut lines =
        vec![line("map", map_words(&found["map"])), line("bodies", bodies_words(&found["bodies"]))];
    lines.extend(items(found, "robots").map(|r| line(&plain(&r["name"]), robots_words(r))));
    lines.extend(items(found, "sensors").map(|s| line("sensor", sensor_words(s))));
    let plain = |key: &str| plain(&found[key]);
    lines.extend([
        line("regime", plain("regime")),
        line(
            "laws",
            format!("obstacles {}, conflicts {}", plain("obstacle_rule"), plain("conflict_policy")),
        ),
        line("run", format!("{} cycles, seed {}", number(&found["cycles"]), plain("seed"))),
        line("memory", memory(found["memory_bytes"].as_u64().unwrap_or(0))),
    ]);
    aligned(&lines)
}

fn items<'a>(found: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    found[key].as_array().into_iter().flatten()
}

fn map_words(map: &Value) -> String {
    let meters =
        |key: &str| map[key].as_f64().unwrap_or(0.0) * map["box_size_m"].as_f64().unwrap_or(0.0);
    format!(
        "{} x {} boxes of {} m ({:.1} x {:.1} m), {} of them free",
        map["width_boxes"],
        map["height_boxes"],
        map["box_size_m"],
        meters("width_boxes"),
        meters("height_boxes"),
        number(&map["free"]),
    )
}

fn bodies_words(bodies: &Value) -> String {
    let kinds = bodies.as_object().into_iter().flatten();
    let words: Vec<String> = kinds.map(|(kind, n)| format!("{} {kind}", number(n))).collect();
    words.join(", ")
}

fn robots_words(robots: &Value) -> String {
    let names: Vec<String> = items(robots, "sensors").map(plain).collect();
    let sensors = if names.is_empty() { "no sensor".into() } else { names.join(" + ") };
    let count =
        if robots["count"].is_null() { "as listed".into() } else { number(&robots["count"]) };
    format!(
        "{count} of {size} x {size} boxes: {sensors}, effector {}, {}, every {}",
        plain(&robots["effector"]),
        plain(&robots["behaviour"]),
        match &robots["period"] {
            Value::Number(n) if n.as_u64() == Some(1) => "cycle".into(),
            n => format!("{n} cycles"),
        },
        size = robots["size_boxes"],
    )
}

fn sensor_words(sensor: &Value) -> String {
    let observations: Vec<String> = items(sensor, "observations").map(plain).collect();
    let edges: Vec<String> = items(sensor, "distance_edges_m").map(plain).collect();
    let classes = if edges.is_empty() { "none".into() } else { edges.join(", ") };
    format!(
        "{}: {} beams of {} m, sees {}; distance edges in m: {classes}",
        plain(&sensor["name"]),
        sensor["beams"],
        sensor["range_m"],
        observations.join("/"),
    )
}

/// A JSON value without quotes.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

fn number(value: &Value) -> String {
    value.as_u64().map_or_else(|| value.to_string(), grouped)
}

fn memory(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("about {} kB", bytes.div_ceil(1000)),
        _ => format!("about {:.1} MB", bytes as f64 / 1e6),
    }
}
