//! The legend, and a picture's content in words.

use std::collections::{BTreeMap, BTreeSet};

use super::trails::agents;
use super::{Scene, bodies};
use crate::legend::{Entry, Symbol};
use crate::style::{body_dashes, hex};
use crate::ticks::grouped;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{
    Body, Frame, Kind, Occupancy, Scenery, Trail, UNKNOWN, WALL, color_of,
};

/// Most things with a color of their own in the legend; more share one line.
const MOST_NAMED: usize = 10;
/// Color of a symbol that stands for things of all colors.
const ANY: [u8; 3] = [0x70, 0x70, 0x70];
/// Opacity of a trail on a floor in the legend.
const RIBBON: f64 = 0.5;

/// Describes the content of a picture in a sentence; empty if there are no agents.
pub fn describe(scenery: &Scenery, frame: &Frame, trails: &[Trail]) -> String {
    let agents = agents(scenery, frame);
    let Some((kind, _)) = agents.first() else { return String::new() };
    let (scene, all, to) = (Scene::new(scenery, frame, trails), agents.len(), frame.cycle);
    let of: BTreeSet<u32> = scene.trails.iter().map(|trail| trail.of.number).collect();
    let from = scene.trails.first().map_or(0, |trail| trail.span[0]);
    let said = |cycle: Cycle| grouped(&cycle.to_string());
    let (plural, to, from) = (plural(*kind, all), said(to), said(from));
    match of.len() {
        0 => format!("{} {plural} before cycle {to}.", grouped(&all.to_string())),
        1 if all == 1 => format!("Track of one {plural}, cycles {from} to {to}."),
        n if n == all => format!("Tracks of all {n} {plural}, cycles {from} to {to}."),
        n => format!(
            "Tracks of {n} of {all} {plural} (the others without color), cycles {from} to {to}."
        ),
    }
}

fn plural(kind: Kind, n: usize) -> String {
    let one = if kind == Kind::Connector { "chain" } else { kind.name() };
    if n == 1 { one.into() } else { format!("{one}s") }
}

/// Returns the legend: only entries for things in the picture.
pub(super) fn entries(scene: &Scene<'_>) -> Vec<Entry> {
    let swatch = |color, opacity| Symbol::Swatch {
        fill: hex(color).into(),
        rim: if opacity < 0.5 { hex(color).into() } else { "none".into() },
        opacity,
    };
    let floor = scene.scenery.floor.as_ref();
    let has = |occupancy| floor.is_some_and(|floor| floor.boxes.contains(&occupancy));
    let mut entries = Vec::new();
    if has(Occupancy::Wall) {
        entries.push(Entry::new(swatch(WALL, 1.0), "wall"));
    }
    if has(Occupancy::Unknown) {
        let (fill, rim) = (hex(UNKNOWN).into(), "#CCCCCC".into());
        entries.push(Entry::new(Symbol::Swatch { fill, rim, opacity: 1.0 }, "unknown"));
    }
    // By layer, then alphabetically.
    let mut kinds = BTreeMap::new();
    for body in scene.scenery.bodies.iter().chain(&scene.frame.bodies) {
        let look = body.appearance(scene.scenery.dimensions);
        if !look.words.is_empty() {
            let is_own = look.color == color_of(body.number);
            let color = if is_own { ANY } else { look.color };
            kinds.entry((look.layer, look.words)).or_insert((color, look.opacity));
        }
    }
    let words = kinds.into_iter().map(|((_, words), (color, opacity))| (words, color, opacity));
    entries.extend(words.map(|(words, color, opacity)| Entry::new(swatch(color, opacity), words)));
    if scene.frame.bodies.iter().any(bodies::leads) {
        entries.push(Entry::new(Symbol::Leader, "leader"));
    }
    if !scene.trails.is_empty() {
        entries.push(Entry::new(Symbol::Ring, "beginning of a track"));
    }
    entries.extend(named(scene));
    entries
}

/// Returns an entry for everything with a color of its own: agents with a trail, and chains.
fn named(scene: &Scene<'_>) -> Vec<Entry> {
    let trails = scene.trails.iter().map(|trail| (trail.of.number, (trail.of.kind, trail.width_m)));
    let is_first = |body: &&Body| body.kind == Kind::Connector && body.part == Some(0);
    let chains = scene.frame.bodies.iter().filter(is_first);
    let chains = chains
        .filter(|body| {
            scene.trails.is_empty() || scene.trails.iter().any(|t| t.of.number == body.number)
        })
        .map(|body| (body.number, (body.kind, None)));
    let all: BTreeMap<u32, (Kind, Option<f64>)> = chains.chain(trails).collect();
    let dashes = body_dashes(&all.keys().copied().collect());
    let entry = |(&number, &(kind, width_m)): (&u32, &(Kind, Option<f64>))| {
        let color = hex(color_of(number)).into();
        let symbol = match width_m {
            Some(_) => Symbol::Swatch { fill: color, rim: "none".into(), opacity: RIBBON },
            None => Symbol::Line { color, marker: None, dash: dashes[&number] },
        };
        Entry::new(symbol, name(scene, kind, number))
    };
    let mut entries: Vec<Entry> = all.iter().take(MOST_NAMED).map(entry).collect();
    if all.len() > MOST_NAMED {
        let symbol = Symbol::Line { color: hex(ANY).into(), marker: None, dash: "" };
        entries.push(Entry::new(symbol, format!("and {} more", all.len() - MOST_NAMED)));
    }
    entries
}

/// Returns the name of a thing.
pub(super) fn name(scene: &Scene<'_>, kind: Kind, number: u32) -> String {
    let own = scene.scenery.names.iter().find(|(k, n, _)| (*k, *n) == (kind, number));
    match own {
        Some((_, _, name)) => name.clone(),
        None => format!("{} {number}", plural(kind, 1)),
    }
}
