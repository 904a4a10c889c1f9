//! Texts for people: a scenario's contents, a run's outcome, and the place of every body.

use super::effector::{EffectorModel, HEADING_NAMES};
use super::metrics::Metrics;
use super::scenario::Compiled;
use super::sensor::SensorModel;
use super::state::{BodyRecord, Snapshot};
use super::world::{RobotsWorld, Role};
use serde_json::{Value, json};
use sidestep_kernel::text::{Description, KeyValues, align_pairs, group_thousands, key_value};
use sidestep_scenario::Source;
use std::collections::BTreeMap;

/// Returns the outcome of a run.
pub(super) fn summary_lines(metrics: &Metrics) -> KeyValues {
    let total = &metrics.total;
    let mut lines = vec![
        key_value("contacts", contacts(metrics)),
        key_value("trips", trips(total.trips, total.trip_cycles_mean)),
        key_value("distance", distance(total.distance_m)),
        key_value("coverage", format!("{:.1} % of the free boxes", 100.0 * metrics.coverage)),
    ];
    // Nothing to report where no two bodies ever met.
    if metrics.largest_group > 0 {
        lines.push(key_value("conflict groups", groups(metrics)));
    }
    lines
}

fn distance(meters: f64) -> String {
    match meters < 1000.0 {
        true => format!("{meters:.1} m"),
        false => format!("{:.1} km", meters / 1000.0),
    }
}

fn contacts(metrics: &Metrics) -> String {
    let total = &metrics.total;
    let touched = total.contacts_by_kind.iter().filter(|(_, n)| **n > 0);
    let by_kind: Vec<String> =
        touched.map(|(kind, n)| format!("{kind} {}", group_thousands(*n))).collect();
    let share = 1000.0 * metrics.contacts_per_action;
    match by_kind.is_empty() {
        true => "none".into(),
        false => format!(
            "{} ({share:.1} in 1000 actions): {}",
            group_thousands(total.contacts),
            by_kind.join(", ")
        ),
    }
}

fn trips(trips: u64, mean_cycles: Option<f64>) -> String {
    match mean_cycles {
        Some(mean) => format!("{}, {mean:.1} cycles on average", group_thousands(trips)),
        None => "none".into(),
    }
}

/// Returns the number of conflict groups by size: index k counts those of `2^k .. 2^(k+1)` bodies.
fn groups(metrics: &Metrics) -> String {
    let sizes = metrics.group_sizes.iter().enumerate().filter(|(_, n)| **n > 0);
    let bins = sizes.map(|(k, n)| match k {
        0 => format!("alone {}", group_thousands(*n)),
        _ => format!("{}-{}: {}", 1u64 << k, (2u64 << k) - 1, group_thousands(*n)),
    });
    format!("{}; largest {}", bins.collect::<Vec<_>>().join(", "), metrics.largest_group)
}

/// Returns every body by entity id.
pub(super) fn poses(world: &RobotsWorld, snapshot: &Snapshot) -> Description {
    let bodies: Vec<BodyText<'_>> = snapshot
        .bodies
        .iter()
        .enumerate()
        .map(|(id, record)| BodyText { world, id: id as u32, record })
        .collect();
    let heading = "  body  kind        col_boxes  row_boxes  heading\n".to_string();
    let text = bodies.iter().fold(heading, |text, body| text + &body.row());
    Description { json: bodies.iter().map(BodyText::json).collect(), text }
}

struct BodyText<'a> {
    world: &'a RobotsWorld,
    id: u32,
    record: &'a BodyRecord,
}

impl BodyText<'_> {
    fn kind(&self) -> &str {
        let world = self.world;
        &world.kinds[usize::from(world.type_of(self.id).kind)]
    }

    fn is_door(&self) -> bool {
        let world = self.world;
        world.is_door(self.id)
    }

    fn heading(&self) -> &'static str {
        HEADING_NAMES[usize::from(self.record.facing.heading() % 4)]
    }

    fn json(&self) -> Value {
        let (col, row) = self.record.at;
        let [x_m, y_m] = self.world.middle_m(self.id, self.record.at);
        let place = json!({
            "body": self.id, "kind": self.kind(), "col_boxes": col, "row_boxes": row,
            "x_m": x_m, "y_m": y_m,
        });
        let Value::Object(mut place) = place else { return place };
        match self.is_door() {
            true => place.insert("open".into(), self.record.facing.is_open().into()),
            false => {
                let heading_rad = self.world.heading_rad(self.record.facing.heading());
                place.insert("heading_deg".into(), heading_rad.to_degrees().into());
                place.insert("heading".into(), self.heading().into())
            }
        };
        Value::Object(place)
    }

    fn row(&self) -> String {
        let (col, row) = self.record.at;
        let look = match (self.is_door(), self.record.facing.is_open()) {
            (true, true) => "open",
            (true, false) => "closed",
            (false, _) => self.heading(),
        };
        format!("  {:<4}  {:<10}  {col:>9}  {row:>9}  {look}\n", self.id, self.kind())
    }
}

/// Returns map, bodies, sensors and effectors of a scenario.
pub(super) fn contents(compiled: &Compiled, source: &Source) -> Description {
    let file: Value = source.parse().unwrap_or_default();
    let world = &*compiled.world;
    let json = json!({
        "world": "robots",
        "name": compiled.name,
        "seed": compiled.seed,
        "cycles": compiled.cycles,
        "regime": world.regime,
        "obstacle_rule": world.obstacle_rule,
        "conflict_policy": world.policy,
        "map": map(world),
        "bodies": bodies(world),
        "robots": robots(&file),
        "sensors": sensors(world),
        "effectors": effectors(world),
    });
    let text = text(&json);
    Description { json, text }
}

fn map(world: &RobotsWorld) -> Value {
    let map = &world.map;
    let counts = map.counts();
    json!({
        "width_boxes": map.width(),
        "height_boxes": map.height(),
        "box_size_m": map.box_size_m,
        "origin_m": map.plane.origin_m,
        "yaw_rad": map.plane.yaw_rad,
        "free": counts.free,
        "wall": counts.wall,
        "unknown": counts.unknown,
    })
}

/// Returns the number of bodies of each kind.
fn bodies(world: &RobotsWorld) -> BTreeMap<&str, u64> {
    let mut count = BTreeMap::new();
    for id in 0..world.bodies.len() as u32 {
        let kind = &world.kinds[usize::from(world.type_of(id).kind)];
        *count.entry(kind.as_str()).or_default() += 1;
    }
    count
}

/// Returns one entry per `[[robots]]` section.
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

/// Returns the sensors in use, each once.
fn sensors(world: &RobotsWorld) -> Vec<Value> {
    let by_name: BTreeMap<&str, &SensorModel> =
        world.sensors().map(|s| (s.name.as_str(), s)).collect();
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

/// Returns the effectors in use, each once, with the chance that an action ends as intended.
fn effectors(world: &RobotsWorld) -> Vec<Value> {
    let robots = world.types.iter().filter_map(|ty| match &ty.role {
        Role::Robot(model) => Some(&model.body.effector),
        _ => None,
    });
    let by_name: BTreeMap<&str, &EffectorModel> = robots.map(|e| (e.name.as_str(), e)).collect();
    let one = |e: &EffectorModel| {
        let as_meant = e.transitions.iter().map(|transitions| transitions[0].p);
        let actions: Vec<_> = e.actions.iter().zip(as_meant).collect();
        json!({ "name": e.name, "as_meant": actions })
    };
    by_name.into_values().map(one).collect()
}

fn text(found: &Value) -> String {
    let mut lines = vec![
        key_value("map", map_text(&found["map"])),
        key_value("bodies", bodies_text(&found["bodies"])),
    ];
    lines.extend(items(found, "robots").map(|r| key_value(&unquoted(&r["name"]), robots_text(r))));
    lines.extend(items(found, "sensors").map(|s| key_value("sensor", sensor_text(s))));
    lines.extend(items(found, "effectors").map(|e| key_value("effector", effector_text(e))));
    let plain = |key: &str| unquoted(&found[key]);
    lines.extend([
        key_value("regime", plain("regime")),
        key_value(
            "laws",
            format!("obstacles {}, conflicts {}", plain("obstacle_rule"), plain("conflict_policy")),
        ),
        key_value("run", format!("{} cycles, seed {}", number(&found["cycles"]), plain("seed"))),
    ]);
    align_pairs(&lines)
}

fn items<'a>(found: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    found[key].as_array().into_iter().flatten()
}

fn map_text(map: &Value) -> String {
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

fn bodies_text(bodies: &Value) -> String {
    let kinds = bodies.as_object().into_iter().flatten();
    let words: Vec<String> = kinds.map(|(kind, n)| format!("{} {kind}", number(n))).collect();
    words.join(", ")
}

fn robots_text(robots: &Value) -> String {
    let names: Vec<String> = items(robots, "sensors").map(unquoted).collect();
    let sensors = if names.is_empty() { "no sensor".into() } else { names.join(" + ") };
    let count =
        if robots["count"].is_null() { "as listed".into() } else { number(&robots["count"]) };
    format!(
        "{count} of {size} x {size} boxes: {sensors}, effector {}, {}, every {}",
        unquoted(&robots["effector"]),
        unquoted(&robots["behaviour"]),
        match &robots["period"] {
            Value::Number(n) if n.as_u64() == Some(1) => "cycle".into(),
            n => format!("{n} cycles"),
        },
        size = robots["size_boxes"],
    )
}

fn sensor_text(sensor: &Value) -> String {
    let observations: Vec<String> = items(sensor, "observations").map(unquoted).collect();
    let edges: Vec<String> = items(sensor, "distance_edges_m").map(unquoted).collect();
    let classes = if edges.is_empty() { "none".into() } else { edges.join(", ") };
    format!(
        "{}: {} beams of {} m, sees {}; distance edges in m: {classes}",
        unquoted(&sensor["name"]),
        sensor["beams"],
        sensor["range_m"],
        observations.join("/"),
    )
}

fn effector_text(effector: &Value) -> String {
    let as_meant = |action: &Value| {
        format!("{} {:.0} %", unquoted(&action[0]), 100.0 * action[1].as_f64().unwrap_or(0.0))
    };
    let actions: Vec<String> = items(effector, "as_meant").map(as_meant).collect();
    format!("{}: as meant {}", unquoted(&effector["name"]), actions.join(", "))
}

/// Returns a JSON value without quotes.
fn unquoted(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

fn number(value: &Value) -> String {
    value.as_u64().map_or_else(|| value.to_string(), group_thousands)
}
