//! The legend, and a picture's content in words.

use std::collections::{BTreeMap, BTreeSet};

use super::palette::pale;
use super::trails::{TrailChoice, agents};
use super::{AgentEmphasis, Scene, bodies};
use crate::legend::{LegendEntry, LegendSymbol};
use crate::style::{body_dashes, hex};
use crate::ticks::group_thousands;
use sidestep_kernel::view::{
    BodyKind, BodyRole, Color, Frame, Occupancy, Scenery, Trail, UNKNOWN_COLOR, WALL_COLOR,
    body_color,
};

/// Largest number of things with a color of their own in the legend; more share one line.
const MAX_NAMED: usize = 10;
/// Color of a symbol that stands for things of all colors.
const ANY_COLOR: [u8; 3] = [0x70, 0x70, 0x70];
/// Opacity of a trail on a floor in the legend.
const RIBBON_OPACITY: f64 = 0.5;

/// Describes the content of a picture in a sentence; empty if there are no agents.
pub fn describe(
    scenery: &Scenery,
    frame: &Frame,
    trails: &[Trail],
    choice: &TrailChoice,
) -> String {
    let agents = agents(scenery, frame);
    let Some((kind, _)) = agents.first() else { return String::new() };
    let scene = Scene::new(scenery, frame, trails, choice);
    let with_trail: BTreeSet<u32> = scene.trails.iter().map(|trail| trail.of.number).collect();
    let first_cycle = scene.trails.first().map_or(0, |trail| trail.span[0]);
    let all = agents.len();
    let plural = plural(*kind, all);
    let from = group_thousands(&first_cycle.to_string());
    let to = group_thousands(&frame.cycle.to_string());
    let others = if !choice.agents.is_empty() {
        " (the others pale)"
    } else if scene.palette.is_by_group() {
        ""
    } else {
        " (the others without color)"
    };
    match with_trail.len() {
        0 => format!("{} {plural} before cycle {to}.", group_thousands(&all.to_string())),
        1 if all == 1 => format!("Track of one {plural}, cycles {from} to {to}."),
        n if n == all => format!("Tracks of all {n} {plural}, cycles {from} to {to}."),
        n => format!("Tracks of {n} of {all} {plural}{others}, cycles {from} to {to}."),
    }
}

fn plural(kind: BodyKind, n: usize) -> String {
    let one = kind.spec().noun;
    if n == 1 { one.into() } else { format!("{one}s") }
}

/// Returns the legend: only entries for things in the picture.
pub(super) fn legend_entries(scene: &Scene<'_>) -> Vec<LegendEntry> {
    let boxes = scene.scenery.floor.as_ref().map_or(&[][..], |floor| &floor.boxes);
    let mut entries = Vec::new();
    if boxes.contains(&Occupancy::Wall) {
        entries.push(LegendEntry::new(swatch(WALL_COLOR, 1.0), "wall"));
    }
    if boxes.contains(&Occupancy::Unknown) {
        // Unknown ground is nearly white: without a rim its swatch would not be visible.
        let swatch = LegendSymbol::Swatch {
            fill: hex(UNKNOWN_COLOR).into(),
            rim: "#CCCCCC".into(),
            opacity: 1.0,
        };
        entries.push(LegendEntry::new(swatch, "unknown"));
    }
    // By layer, then alphabetically.
    let mut kinds = BTreeMap::new();
    let visible = scene.visible();
    for body in &visible {
        let appearance = body.appearance(scene.scenery.dimensions);
        // Targets have a mark of their own: a patch of color would look like an area.
        if !bodies::is_target(body) && !appearance.legend.is_empty() {
            let is_own = appearance.color == body_color(body.number);
            let color = if is_own { ANY_COLOR } else { appearance.color };
            let key = (appearance.layer, appearance.legend);
            kinds.entry(key).or_insert((color, appearance.opacity));
        }
    }
    for ((_, words), (color, opacity)) in kinds {
        entries.push(LegendEntry::new(swatch(color, opacity), words));
    }
    if visible.iter().any(|body| bodies::is_target(body)) {
        entries.push(LegendEntry::new(LegendSymbol::Target, BodyKind::GOAL.spec().noun));
    }
    if scene.frame.bodies.iter().any(bodies::is_leader) {
        entries.push(LegendEntry::new(LegendSymbol::Leader, "leader"));
    }
    if !scene.trails.is_empty() {
        entries.push(LegendEntry::new(LegendSymbol::Ring, "beginning of a track"));
    }
    if scene.palette.is_by_group() {
        entries.extend(group_entries(scene));
    } else {
        entries.extend(named_entries(scene));
    }
    entries.extend(context_entry(scene));
    entries
}

/// Returns an entry for each group of which the picture shows agents: their number, or the numbers of those that were
/// chosen.
fn group_entries(scene: &Scene<'_>) -> Vec<LegendEntry> {
    let mut numbers: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
    for body in scene.frame.bodies.iter().filter(|body| body.kind.is_agent()) {
        if scene.emphasis(body.number) == AgentEmphasis::Full
            && let Some(group) = scene.palette.group_index(body.id())
        {
            numbers.entry(group).or_default().insert(body.number);
        }
    }
    let mut entries = Vec::new();
    for (&index, of_group) in numbers.iter().take(MAX_NAMED) {
        let group = &scene.palette.groups()[index];
        let words = if scene.choice.agents.is_empty() {
            let count = group_thousands(&of_group.len().to_string());
            format!("{} ({count} {})", group.name, plural(group.kind, of_group.len()))
        } else {
            let chosen: Vec<String> = of_group.iter().map(u32::to_string).collect();
            format!("{}: {} {}", group.name, plural(group.kind, chosen.len()), chosen.join(", "))
        };
        entries.push(LegendEntry::new(swatch(scene.palette.group_color(index), 1.0), words));
    }
    if numbers.len() > MAX_NAMED {
        let words = format!("and {} more groups", numbers.len() - MAX_NAMED);
        entries.push(LegendEntry::new(swatch(ANY_COLOR, 1.0), words));
    }
    entries
}

/// Returns an entry for the agents that are pale because others were chosen.
fn context_entry(scene: &Scene<'_>) -> Option<LegendEntry> {
    let all = agents(scene.scenery, scene.frame);
    let (kind, _) = *all.first()?;
    let others = all.iter().filter(|(_, n)| scene.emphasis(*n) == AgentEmphasis::Context).count();
    if others == 0 {
        return None;
    }
    let count = group_thousands(&others.to_string());
    let words = format!("other {} ({count})", plural(kind, others));
    Some(LegendEntry::new(swatch(pale(ANY_COLOR), 1.0), words))
}

/// Returns a filled square; a pale one has a rim, without which it would not be visible.
fn swatch(color: Color, opacity: f64) -> LegendSymbol {
    LegendSymbol::Swatch {
        fill: hex(color).into(),
        rim: if opacity < 0.5 { hex(color).into() } else { "none".into() },
        opacity,
    }
}

/// Returns an entry for everything with a color of its own: agents with a trail, and chains.
fn named_entries(scene: &Scene<'_>) -> Vec<LegendEntry> {
    let trails = scene.trails.iter().map(|trail| (trail.of.number, (trail.of.kind, trail.width_m)));
    // Each body of parts once, by its first part.
    let chains = scene
        .frame
        .bodies
        .iter()
        .filter(|body| body.kind.role() == BodyRole::PartOfBody && body.part == Some(0))
        .filter(|body| scene.emphasis(body.number) == AgentEmphasis::Full)
        .map(|body| (body.number, (body.kind, None)));
    let all: BTreeMap<u32, (BodyKind, Option<f64>)> = chains.chain(trails).collect();
    let dashes = body_dashes(&all.keys().copied().collect());
    let mut entries = Vec::new();
    for (&number, &(kind, width_m)) in all.iter().take(MAX_NAMED) {
        let color = hex(body_color(number)).into();
        let symbol = match width_m {
            Some(_) => {
                LegendSymbol::Swatch { fill: color, rim: "none".into(), opacity: RIBBON_OPACITY }
            }
            None => LegendSymbol::Line { color, marker: None, dash: dashes[&number] },
        };
        entries.push(LegendEntry::new(symbol, display_name(scene, kind, number)));
    }
    if all.len() > MAX_NAMED {
        let symbol = LegendSymbol::Line { color: hex(ANY_COLOR).into(), marker: None, dash: "" };
        entries.push(LegendEntry::new(symbol, format!("and {} more", all.len() - MAX_NAMED)));
    }
    entries
}

/// Returns the name of a thing: its own, or its kind and number.
pub(super) fn display_name(scene: &Scene<'_>, kind: BodyKind, number: u32) -> String {
    let own = scene.scenery.names.iter().find(|(k, n, _)| (*k, *n) == (kind, number));
    match own {
        Some((_, _, name)) => name.clone(),
        None => format!("{} {number}", plural(kind, 1)),
    }
}
