//! The colors of agents: by number, or by group where a scenario has several.

use sidestep_kernel::view::{AgentGroup, Body, BodyId, BodyRole, Color, Scenery, body_color};

/// Shades of a group's color for agents with a trail, as parts of black (below zero) or of white that are mixed in: as
/// many as can be distinguished.
const SHADES: [f64; MAX_SHADES] = [0.0, -0.38, 0.4];
/// Most agents of a group with a trail as wide as they are.
pub(super) const MAX_SHADES: usize = 3;
/// Part of white in the color of agents that are shown as context only.
const PALE: f64 = 0.72;

/// The colors of the agents of a picture.
#[derive(Debug, Default)]
pub(super) struct Palette<'a> {
    groups: &'a [AgentGroup],
    /// Agents with a trail whose color is not that of their group, but a shade of it.
    shades: Vec<(BodyId, Color)>,
}

impl<'a> Palette<'a> {
    pub(super) fn new(scenery: &'a Scenery) -> Self {
        Self { groups: groups(scenery), shades: Vec::new() }
    }

    /// Returns the color of the trail of an agent; those of a group get shades of its color, one after the other.
    pub(super) fn trail_color(&mut self, of: BodyId) -> Color {
        let plain = self.plain_color(of);
        let Some(group) = self.group_index(of) else { return plain };
        let is_of_group = |(body, _): &&(BodyId, Color)| self.group_index(*body) == Some(group);
        let earlier = self.shades.iter().filter(is_of_group).count();
        let color = shade(plain, SHADES[earlier % MAX_SHADES]);
        self.shades.push((of, color));
        color
    }

    /// Returns whether agents have the colors of their groups.
    pub(super) fn is_by_group(&self) -> bool {
        !self.groups.is_empty()
    }

    pub(super) fn groups(&self) -> &'a [AgentGroup] {
        self.groups
    }

    /// Returns the color of a group in the list.
    pub(super) fn group_color(&self, index: usize) -> Color {
        body_color(index as u32)
    }

    /// Returns the color of an agent, or of what belongs to it.
    pub(super) fn color(&self, body: &Body) -> Color {
        let id = BodyId { part: None, kind: agent_kind(body), ..body.id() };
        let shade = self.shades.iter().find(|(of, _)| *of == id);
        shade.map_or_else(|| self.plain_color(id), |(_, color)| *color)
    }

    fn plain_color(&self, id: BodyId) -> Color {
        match self.group_index(id) {
            Some(index) => self.group_color(index),
            None => body_color(id.number),
        }
    }

    pub(super) fn group_index(&self, id: BodyId) -> Option<usize> {
        self.groups.iter().position(|group| group.contains(id))
    }
}

/// Returns the kind of the agent that a body is, or to which it belongs.
fn agent_kind(body: &Body) -> sidestep_kernel::view::BodyKind {
    match body.kind.role() {
        BodyRole::LineThroughParts(kind)
        | BodyRole::AroundAgent(kind)
        | BodyRole::StartOf(kind) => kind,
        _ => body.kind,
    }
}

/// Returns the groups after which agents are colored: a single one would give all of them one color.
pub(super) fn groups(scenery: &Scenery) -> &[AgentGroup] {
    if scenery.groups.len() > 1 { &scenery.groups } else { &[] }
}

/// Mixes a color with white, or below zero with black.
fn shade(color: Color, part: f64) -> Color {
    let target = if part < 0.0 { 0.0 } else { 255.0 };
    color.map(|byte| mix(f64::from(byte), target, part.abs()))
}

/// Returns the color of an agent that is shown as context only.
pub(super) fn pale(color: Color) -> Color {
    shade(color, PALE)
}

fn mix(from: f64, to: f64, part: f64) -> u8 {
    (from + part * (to - from)).round() as u8
}
