//! Texts for people: a scenario's contents, a run's outcome, and the place of every body.

use super::effector::{EffectorModel, HEADING_NAMES};
use super::metrics::{Counters, Metrics};
use super::scenario::Compiled;
use super::sensor::SensorModel;
use super::state::{BodyRecord, Snapshot};
use super::world::{RobotsWorld, Role};
use serde_json::{Value, json};
use sidestep_kernel::text::{
    JsonTextReport, KeyValues, align_pairs, group_thousands, key_value_pair,
};
use sidestep_scenario::Source;
use std::collections::BTreeMap;

pub(super) fn summary_lines(metrics: &Metrics) -> KeyValues {
    let total = &metrics.total;
    let mut lines = vec![
        key_value_pair("contacts", contacts(metrics)),
        key_value_pair("trips", trips(total)),
        key_value_pair("distance", distance(total.distance_m)),
        key_value_pair("coverage", format!("{:.1} % of the free boxes", 100.0 * metrics.coverage)),
    ];
    if metrics.plans > 0 {
        lines.push(key_value_pair("plans", plans(metrics)));
    }
    // A team with tasks always knows some.
    if metrics.tasks_open > 0 {
        let open = group_thousands(metrics.tasks_open);
        let finished = group_thousands(metrics.tasks_finished);
        lines.push(key_value_pair("tasks finished", format!("{finished}, {open} open")));
    }
    // Nothing to report where no two bodies ever met.
    if metrics.largest_group > 0 {
        lines.push(key_value_pair("conflict groups", groups(metrics)));
    }
    if let Some(share) = total.waiting_share {
        let waited = format!("{:.1} % of the turns of robots with a goal", 100.0 * share);
        lines.push(key_value_pair("waiting", waited));
    }
    if metrics.gridlocks > 0 {
        lines.push(key_value_pair("gridlocks", gridlocks(metrics)));
    }
    lines
}

/// Returns what became of plans. The time is that of a search: it differs from run to run.
fn plans(metrics: &Metrics) -> String {
    let count = group_thousands(metrics.plans);
    let each_ms = 1e3 * metrics.plan_cpu_s / metrics.plans as f64;
    let failures = match metrics.plan_failures {
        0 => String::new(),
        n => format!(", {} of them without a plan", group_thousands(n)),
    };
    let gap = metrics
        .plan_cost_gap
        .map_or(String::new(), |gap| format!(", {:.1} % above shortest paths", 100.0 * gap));
    format!(
        "{count} of {each_ms:.2} ms each{failures}{gap}; robots off them {} times",
        group_thousands(metrics.total.off_plan)
    )
}

/// Says how many there were, since when, and whether some stand.
fn gridlocks(metrics: &Metrics) -> String {
    let count = group_thousands(metrics.gridlocks);
    let first = group_thousands(metrics.first_gridlock_cycle.unwrap_or(0));
    let standing = group_thousands(metrics.robots_in_gridlock);
    format!("{count}, the first one found after cycle {first}; {standing} robots in one at the end")
}

fn distance(meters: f64) -> String {
    if meters < 1000.0 { format!("{meters:.1} m") } else { format!("{:.1} km", meters / 1000.0) }
}

fn contacts(metrics: &Metrics) -> String {
    let total = &metrics.total;
    let touched = total.contacts_by_kind.iter().filter(|(_, n)| **n > 0);
    let by_kind: Vec<String> =
        touched.map(|(kind, n)| format!("{kind} {}", group_thousands(*n))).collect();
    if by_kind.is_empty() {
        return "none".into();
    }
    let in_1000 = 1000.0 * metrics.contacts_per_action;
    let count = group_thousands(total.contacts);
    format!("{count} ({in_1000:.1} in 1000 actions): {}", by_kind.join(", "))
}

fn trips(total: &Counters) -> String {
    let under_way = match total.trips_under_way {
        0 => String::new(),
        n => format!(", without {} under way", group_thousands(n)),
    };
    let estimate = match total.trip_cycles_estimate {
        Some(estimate) if total.trips_under_way > 0 => format!(" ({estimate:.1} with them)"),
        _ => String::new(),
    };
    match total.trip_cycles_mean {
        Some(mean) => {
            let trips = group_thousands(total.trips);
            format!("{trips}, {mean:.1} cycles on average{under_way}{estimate}")
        }
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
pub(super) fn poses(world: &RobotsWorld, snapshot: &Snapshot) -> JsonTextReport {
    let bodies: Vec<BodyText<'_>> = snapshot
        .bodies
        .iter()
        .enumerate()
        .map(|(id, record)| BodyText { world, id: id as u32, record })
        .collect();
    let heading = "  body  kind        col_boxes  row_boxes  heading\n".to_string();
    let text = bodies.iter().fold(heading, |text, body| text + &body.row());
    JsonTextReport { json: bodies.iter().map(BodyText::json).collect(), text }
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
        if self.is_door() {
            place.insert("open".into(), self.record.facing.is_open().into());
        } else {
            let heading_rad = self.world.heading_rad(self.record.facing.heading());
            place.insert("heading_deg".into(), heading_rad.to_degrees().into());
            place.insert("heading".into(), self.heading().into());
        }
        Value::Object(place)
    }

    fn row(&self) -> String {
        let (col, row) = self.record.at;
        let facing = if !self.is_door() {
            self.heading()
        } else if self.record.facing.is_open() {
            "open"
        } else {
            "closed"
        };
        format!("  {:<4}  {:<10}  {col:>9}  {row:>9}  {facing}\n", self.id, self.kind())
    }
}

/// Returns map, bodies, sensors and effectors of a scenario.
pub(super) fn contents(compiled: &Compiled, source: &Source) -> JsonTextReport {
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
    JsonTextReport { json, text }
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

/// Kinds without bodies are left out.
fn bodies(world: &RobotsWorld) -> BTreeMap<&str, u64> {
    let mut count = BTreeMap::new();
    for id in 0..world.bodies.len() as u32 {
        let kind = &world.kinds[usize::from(world.type_of(id).kind)];
        *count.entry(kind.as_str()).or_default() += 1;
    }
    count
}

/// Returns one entry per `[[robots]]` section, by its text, because compiled bodies do not know their section.
fn robots(file: &Value) -> Vec<Value> {
    let sections = match &file["robots"] {
        Value::Array(many) => many.as_slice(),
        Value::Null => &[],
        one => std::slice::from_ref(one),
    };
    sections.iter().map(|section| robot_section(section, sections)).collect()
}

/// Returns the entry of one of several sections.
fn robot_section(section: &Value, sections: &[Value]) -> Value {
    let has_planner = |one: &&Value| one["planner"].is_object();
    let of_team = sections.iter().filter(has_planner).find(|one| one["name"] == section["team"]);
    let leading =
        if section["team"].is_null() { Some(section).filter(has_planner) } else { of_team };
    let places = section["at"].as_array().map(|at| at.len().into());
    let default_behaviour = if section["tasks"].is_null() { "wander" } else { "tasks" };
    json!({
        "name": value_or(&section["name"], "robots".into()),
        "count": value_or(&section["count"], places.unwrap_or(Value::Null)),
        "size_boxes": value_or(&section["size"], 1.into()),
        "period": value_or(&section["period"], 1.into()),
        "action_cycles": value_or(&section["action_cycles"], 1.into()),
        "sensors": value_or(&section["sensors"], json!([])),
        "effector": value_or(&section["effector"], "perfect".into()),
        "behaviour": value_or(&section["behaviour"]["kind"], default_behaviour.into()),
        "team": section["team"],
        "planner": leading.map(|leading| planner_entry(&leading["planner"])),
    })
}

/// Returns who leads robots. A planner that knows the true places is privileged.
fn planner_entry(planner: &Value) -> Value {
    let places = value_or(&planner["places"], "true".into());
    let is_privileged = places == "true";
    let reports = (!is_privileged).then(|| {
        let every = value_or(&planner["report_every"], 1.into());
        (every, value_or(&planner["report_loss"], 0.0.into()))
    });
    let (report_every, report_loss) = reports.unwrap_or_default();
    json!({
        "method": planner["method"],
        "places": places,
        "is_privileged": is_privileged,
        "report_every": report_every,
        "report_loss": report_loss,
    })
}

fn value_or(value: &Value, default: Value) -> Value {
    if value.is_null() { default } else { value.clone() }
}

/// Returns the sensors in use, each once.
fn sensors(world: &RobotsWorld) -> Vec<Value> {
    let by_name: BTreeMap<&str, &SensorModel> =
        world.sensors().map(|sensor| (sensor.name.as_str(), sensor)).collect();
    by_name.into_values().map(sensor_entry).collect()
}

fn sensor_entry(sensor: &SensorModel) -> Value {
    json!({
        "name": sensor.name,
        "beams": sensor.bearings_deg.len(),
        "range_m": sensor.range_m,
        "observations": sensor.observations,
        "distance_edges_m": sensor.distance_edges_m,
    })
}

/// Returns the effectors in use, each once, with the chance that an action ends as intended.
fn effectors(world: &RobotsWorld) -> Vec<Value> {
    let robots = world.types.iter().filter_map(|ty| match &ty.role {
        Role::Robot(model) => Some(&model.body.effector),
        _ => None,
    });
    let by_name: BTreeMap<&str, &EffectorModel> = robots.map(|e| (e.name.as_str(), e)).collect();
    by_name.into_values().map(effector_entry).collect()
}

fn effector_entry(effector: &EffectorModel) -> Value {
    let as_intended = effector.transitions.iter().map(|transitions| transitions[0].p);
    let actions: Vec<_> = effector.actions.iter().zip(as_intended).collect();
    json!({ "name": effector.name, "as_meant": actions })
}

/// Returns the contents in words; made of their JSON, so that both say the same.
fn text(contents: &Value) -> String {
    let mut lines = vec![
        key_value_pair("map", map_text(&contents["map"])),
        key_value_pair("bodies", bodies_text(&contents["bodies"])),
    ];
    for robots in items(contents, "robots") {
        lines.push(key_value_pair(&unquoted(&robots["name"]), robots_text(robots)));
    }
    for sensor in items(contents, "sensors") {
        lines.push(key_value_pair("sensor", sensor_text(sensor)));
    }
    for effector in items(contents, "effectors") {
        lines.push(key_value_pair("effector", effector_text(effector)));
    }
    let obstacle_rule = unquoted(&contents["obstacle_rule"]);
    let conflict_policy = unquoted(&contents["conflict_policy"]);
    let cycles = number(&contents["cycles"]);
    let seed = unquoted(&contents["seed"]);
    lines.extend([
        key_value_pair("regime", unquoted(&contents["regime"])),
        key_value_pair("laws", format!("obstacles {obstacle_rule}, conflicts {conflict_policy}")),
        key_value_pair("run", format!("{cycles} cycles, seed {seed}")),
    ]);
    align_pairs(&lines)
}

fn items<'a>(contents: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    contents[key].as_array().into_iter().flatten()
}

fn map_text(map: &Value) -> String {
    let box_size_m = map["box_size_m"].as_f64().unwrap_or(0.0);
    let [width_m, height_m] =
        ["width_boxes", "height_boxes"].map(|key| map[key].as_f64().unwrap_or(0.0) * box_size_m);
    format!(
        "{} x {} boxes of {} m ({width_m:.1} x {height_m:.1} m), {} of them free",
        map["width_boxes"],
        map["height_boxes"],
        map["box_size_m"],
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
    let actions = match &robots["action_cycles"] {
        Value::Number(n) if n.as_u64() == Some(1) => String::new(),
        n => format!(", {n} cycles an action"),
    };
    format!(
        "{count} of {size} x {size} boxes: {sensors}, effector {}, {}, every {}{actions}{planner}",
        unquoted(&robots["effector"]),
        unquoted(&robots["behaviour"]),
        match &robots["period"] {
            Value::Number(n) if n.as_u64() == Some(1) => "cycle".into(),
            n => format!("{n} cycles"),
        },
        size = robots["size_boxes"],
        planner = planner_text(&robots["planner"]) + &team_text(&robots["team"]),
    )
}

/// Returns in words that robots belong to the team of another section; nothing for those that do not.
fn team_text(team: &Value) -> String {
    team.as_str().map_or(String::new(), |team| format!(", in the team of `{team}`"))
}

/// Returns who leads robots in words, after a comma; nothing for those that decide alone.
fn planner_text(planner: &Value) -> String {
    if planner.is_null() {
        return String::new();
    }
    let method = unquoted(&planner["method"]);
    if planner["is_privileged"] == true {
        return format!(", led by {method}, which knows all true places (privileged)");
    }
    let loss_percent = 100.0 * planner["report_loss"].as_f64().unwrap_or(0.0);
    let every = match planner["report_every"].as_u64() {
        Some(1) => "at each action".into(),
        _ => format!("one in {} actions", planner["report_every"]),
    };
    format!(
        ", led by {method}, which knows what they report, {every}, {loss_percent:.1} % of it lost"
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
    let mut actions = Vec::new();
    for action in items(effector, "as_meant") {
        let percent = 100.0 * action[1].as_f64().unwrap_or(0.0);
        actions.push(format!("{} {percent:.0} %", unquoted(&action[0])));
    }
    format!("{}: as meant {}", unquoted(&effector["name"]), actions.join(", "))
}

/// Returns a JSON value without quotes.
fn unquoted(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_string)
}

fn number(value: &Value) -> String {
    value.as_u64().map_or_else(|| value.to_string(), group_thousands)
}
