//! The choice of trails to show, their colors, and their lengths.

use std::collections::{BTreeMap, BTreeSet};

use super::palette::{self, MAX_SHADES};
use crate::style::body_dashes;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{
    AgentGroup, AgentNumber, BODY_COLORS, Body, BodyCondition, BodyId, BodyKind, BodyRole, Color,
    Frame, OccupancyGrid, Scenery, Shape, Trail, TrailStyle, Vec3, body_color,
};

/// Largest number of lines in a picture: they are thin, so more of them than there are colors can be
/// distinguished.
const MAX_LINES: usize = 60;
/// Lengths of ribbons in cycles, the longest first: shorter ones are for crowds, where long ones
/// would cover each other.
const RIBBON_LENGTHS_CYCLES: [Cycle; 4] = [400, 200, 100, 50];
/// Largest fraction of the covered area that may be covered twice before ribbons are shortened.
const MAX_OVERLAP_FRACTION: f64 = 0.3;

/// The trails that a picture shows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrailChoice {
    /// The agents with trails and names; the others are pale. Without any, those whose trails can be distinguished.
    pub agents: Vec<AgentNumber>,
    /// The first cycle of the trails; without it, they are as long as they can be distinguished.
    pub from: Option<Cycle>,
}

impl TrailChoice {
    /// Returns whether an agent is chosen, or a part of it.
    pub(super) fn has(&self, number: u32) -> bool {
        self.agents.iter().any(|agent| agent.number == number)
    }
}

/// A trail that is drawn, as far as it is, with its style.
#[derive(Debug, Clone)]
pub(crate) struct DrawnTrail<'a> {
    pub(crate) of: BodyId,
    /// The shown part of the trail: its last places.
    pub(crate) points: &'a [(Cycle, Vec3)],
    pub(crate) color: Color,
    /// The body's width, if the trail is the area that it has swept on a floor.
    pub(crate) width_m: Option<f64>,
    /// First and last cycle of all trails.
    pub(crate) span: [Cycle; 2],
    /// Its dashes, which distinguish it from others of its color; of ribbons, which have a name beside them, none.
    pub(crate) dash: &'static str,
}

impl DrawnTrail<'_> {
    /// Returns the shade of a cycle, one of `shades`, 0 for the oldest.
    pub(super) fn shade(&self, cycle: Cycle, shades: usize) -> usize {
        let [from, to] = self.span;
        let elapsed = cycle.saturating_sub(from);
        let span = to.saturating_sub(from).max(1);
        ((elapsed as f64 / span as f64 * shades as f64) as usize).min(shades - 1)
    }
}

/// Returns the chosen agents; without a choice, those with trails that can be distinguished in one picture: at most one
/// of each color, or a few of each group, or sixty if trails are thin lines. Of chains the leader and the other end.
pub fn bodies_with_trails(scenery: &Scenery, frame: &Frame, choice: &TrailChoice) -> Vec<BodyId> {
    let agents = agents(scenery, frame);
    let kind = agents.first().map(|&(kind, _)| kind);
    let numbers: Vec<u32> = agents.into_iter().map(|(_, number)| number).collect();
    let Some(kind) = kind else { return Vec::new() };
    if !choice.agents.is_empty() {
        return chosen_bodies(frame, kind, &choice.agents);
    }
    let groups = palette::groups(scenery);
    let chosen = match kind.role() {
        BodyRole::PartOfBody => {
            let first = numbers.into_iter().take(BODY_COLORS.len());
            return first.flat_map(|number| ends(frame, kind, number)).collect();
        }
        BodyRole::Agent(TrailStyle::Lines) => numbers.into_iter().take(MAX_LINES).collect(),
        _ if !groups.is_empty() => some_per_group(&numbers, groups),
        _ => one_per_color(&numbers),
    };
    chosen.into_iter().map(|number| BodyId::new(kind, number, None)).collect()
}

/// Returns kinds and numbers of the agents, by number; everything with a start is an agent, even
/// if it is not present.
pub(super) fn agents(scenery: &Scenery, frame: &Frame) -> BTreeSet<(BodyKind, u32)> {
    // Robots that are parts of a chain keep to its connectors.
    let acting = frame.bodies.iter().filter(|body| match body.kind.role() {
        BodyRole::Agent(_) => body.part.is_none(),
        role => role == BodyRole::PartOfBody,
    });
    let here = acting.map(|body| (body.kind, body.number));
    let starting = scenery.bodies.iter().filter_map(|body| match body.kind.role() {
        BodyRole::StartOf(agent) => Some((agent, body.number)),
        _ => None,
    });
    here.chain(starting).collect()
}

/// Returns the bodies of the agents with some numbers: of an agent of parts its ends, or the part that is meant.
fn chosen_bodies(frame: &Frame, kind: BodyKind, agents: &[AgentNumber]) -> Vec<BodyId> {
    let mut bodies: Vec<BodyId> = Vec::new();
    for agent in agents {
        let own = match (kind.role(), agent.part) {
            (BodyRole::PartOfBody, None) => ends(frame, kind, agent.number),
            _ => vec![BodyId::new(kind, agent.number, agent.part)],
        };
        bodies.extend(own.into_iter().filter(|body| !bodies.contains(body)).collect::<Vec<_>>());
    }
    bodies
}

/// Returns the leader of a body of parts, or its first part, and the other end.
fn ends(frame: &Frame, kind: BodyKind, number: u32) -> Vec<BodyId> {
    let all = frame.bodies.iter();
    let own = all.filter(|body| body.kind == kind && body.number == number);
    let leader = own.clone().find(|body| body.state == BodyCondition::Leading);
    let mut parts = own.map(Body::id);
    let first = parts.next();
    let leader = leader.map(Body::id).or(first);
    let last = parts.next_back().filter(|last| Some(*last) != leader).or(first);
    let ends = [leader, last.filter(|last| Some(*last) != leader)];
    ends.into_iter().flatten().collect()
}

/// Returns at most one number of each color, at about equal steps, including the first.
fn one_per_color(numbers: &[u32]) -> Vec<u32> {
    let most = numbers.len().min(BODY_COLORS.len());
    let mut chosen: Vec<u32> = Vec::new();
    for k in 0..most {
        let from = k * numbers.len() / most;
        let mut candidates = numbers[from..].iter().chain(&numbers[..from]);
        let new = candidates.find(|n| chosen.iter().all(|c| body_color(*c) != body_color(**n)));
        chosen.extend(new);
    }
    chosen.sort_unstable();
    chosen
}

/// Returns a few agents of each group, at about equal steps, the first of each before the second of any.
fn some_per_group(numbers: &[u32], groups: &[AgentGroup]) -> Vec<u32> {
    let of_group = |group: &AgentGroup| -> Vec<u32> {
        numbers.iter().copied().filter(|number| group.numbers.contains(number)).collect()
    };
    // Further groups have the colors of these.
    let members: Vec<Vec<u32>> = groups.iter().take(BODY_COLORS.len()).map(of_group).collect();
    let mut counts = vec![0; members.len()];
    for _ in 0..MAX_SHADES {
        for (count, members) in counts.iter_mut().zip(&members) {
            *count += usize::from(*count < members.len());
        }
    }
    while counts.iter().sum::<usize>() > BODY_COLORS.len() {
        let most = counts.iter().copied().max().unwrap_or(0);
        // From the last one, so that the first groups keep theirs.
        match counts.iter_mut().rev().find(|count| **count == most) {
            Some(count) => *count -= 1,
            None => break,
        }
    }
    let mut chosen = Vec::new();
    for (count, members) in counts.iter().zip(&members) {
        chosen.extend((0..*count).map(|k| members[k * members.len() / count]));
    }
    chosen.sort_unstable();
    chosen
}

/// Returns the trails that are drawn, and how much of them; their colors are those of their numbers.
pub(super) fn drawn_trails<'a>(
    scenery: &Scenery,
    frame: &Frame,
    trails: &'a [Trail],
    choice: &TrailChoice,
) -> Vec<DrawnTrail<'a>> {
    let chosen = bodies_with_trails(scenery, frame, choice);
    let sizes = sizes(scenery, frame);
    let mut shown = Vec::new();
    for trail in trails {
        let from = choice.from.unwrap_or(0);
        let first = trail.points.partition_point(|(cycle, _)| *cycle < from);
        let points = &trail.points[first..];
        if chosen.contains(&trail.of) && !points.is_empty() {
            shown.push(DrawnTrail {
                of: trail.of,
                points,
                color: body_color(trail.of.number),
                width_m: sizes.get(&trail.of).map(|size_m| size_m[0]),
                // Both follow from all shown trails, below.
                span: [0, 0],
                dash: "",
            });
        }
    }
    let is_free = choice.from.is_none() && !sizes.is_empty();
    if let Some(floor) = scenery.floor.as_ref().filter(|_| is_free) {
        shorten_ribbons(&mut shown, floor, &sizes);
    }
    let cycles = shown.iter().flat_map(|trail| trail.points).map(|(cycle, _)| *cycle);
    let span = [cycles.clone().min().unwrap_or(0), cycles.max().unwrap_or(0)];
    let dashes = body_dashes(&shown.iter().map(|trail| trail.of.number).collect());
    for trail in &mut shown {
        trail.span = span;
        if trail.width_m.is_none() {
            trail.dash = dashes[&trail.of.number];
        }
    }
    shown
}

/// Returns the width and height of the bodies that sweep a floor.
fn sizes(scenery: &Scenery, frame: &Frame) -> BTreeMap<BodyId, [f64; 2]> {
    if scenery.floor.is_none() {
        return BTreeMap::new();
    }
    let mut sizes = BTreeMap::new();
    for body in frame.bodies.iter().filter(|body| body.kind.is_agent()) {
        // A body without extent leaves no ribbon.
        if let Shape::Cuboid { size_m: [x, y, _] } = body.shape
            && x > 0.0
            && y > 0.0
        {
            sizes.insert(body.id(), [x, y]);
        }
    }
    sizes
}

/// Keeps the longest last part of the trails that leaves them distinguishable.
fn shorten_ribbons(
    trails: &mut [DrawnTrail<'_>],
    floor: &OccupancyGrid,
    sizes: &BTreeMap<BodyId, [f64; 2]>,
) {
    let now = trails.iter().filter_map(|trail| trail.points.last()).map(|(cycle, _)| *cycle).max();
    let now = now.unwrap_or(0);
    for length in RIBBON_LENGTHS_CYCLES {
        for trail in trails.iter_mut() {
            let first = trail.points.partition_point(|(cycle, _)| cycle + length < now);
            trail.points = &trail.points[first..];
        }
        if overlap_fraction(trails, floor, sizes) <= MAX_OVERLAP_FRACTION {
            return;
        }
    }
}

/// Returns the number of boxes along a side of a body. Bodies larger than the floor cover all of it.
fn side_boxes(side_m: f64, box_m: f64, floor_boxes: u32) -> i64 {
    ((side_m / box_m).round() as i64).clamp(1, i64::from(floor_boxes))
}

/// Returns the box at the lower corner of a body whose middle is at a place.
fn lower_corner([x, y, _]: Vec3, size_m: [f64; 2], floor: &OccupancyGrid) -> (i64, i64) {
    let middle_m = floor.plane.inverse_transform_point([x, y]);
    let col = (middle_m[0] - 0.5 * size_m[0]) / floor.box_m;
    let row = (middle_m[1] - 0.5 * size_m[1]) / floor.box_m;
    (col.round() as i64, row.round() as i64)
}

/// Returns the fraction of the covered boxes that two bodies or more have covered.
fn overlap_fraction(
    trails: &[DrawnTrail<'_>],
    floor: &OccupancyGrid,
    sizes: &BTreeMap<BodyId, [f64; 2]>,
) -> f64 {
    // One bit for each trail. Ribbons are at most as many as there are colors, far below 64.
    let mut covered_by = BTreeMap::<(i64, i64), u64>::new();
    for (index, trail) in trails.iter().enumerate() {
        let Some(size_m) = sizes.get(&trail.of) else { continue };
        let width = side_boxes(size_m[0], floor.box_m, floor.width);
        let height = side_boxes(size_m[1], floor.box_m, floor.height);
        let corners: BTreeSet<(i64, i64)> =
            trail.points.iter().map(|&(_, at)| lower_corner(at, *size_m, floor)).collect();
        for (col, row) in corners {
            let boxes = (0..height).flat_map(|y| (0..width).map(move |x| (col + x, row + y)));
            boxes.for_each(|at| *covered_by.entry(at).or_default() |= 1 << (index % 64));
        }
    }
    let twice = covered_by.values().filter(|bodies| bodies.count_ones() > 1).count();
    twice as f64 / covered_by.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_are_chosen_evenly_and_differ_in_color() {
        let numbers: Vec<u32> = (0..24).collect();
        let chosen = one_per_color(&numbers);
        assert_eq!(chosen, [0, 4, 8, 13, 17, 21]);
        let colors: BTreeSet<Color> = chosen.iter().map(|&n| body_color(n)).collect();
        assert_eq!(colors.len(), BODY_COLORS.len());
        assert_eq!(one_per_color(&numbers[..3]), [0, 1, 2]);
        assert!(one_per_color(&[]).is_empty());
        assert_eq!(one_per_color(&[0, 6, 12]), [0], "all of one color");
    }
}
