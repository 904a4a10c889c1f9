//! The choice of trails to show, their colors, and their lengths.

use std::collections::{BTreeMap, BTreeSet};

use crate::style::body_dashes;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{
    Body, COLORS, Color, Condition, Floor, Frame, Kind, Place, Scenery, Shape, Trail, Who, color_of,
};

/// Most lines in a picture: they are thin, so more of them than there are colors can be
/// distinguished.
const MOST_LINES: usize = 60;
/// Lengths of ribbons in cycles, the longest first: shorter ones are for crowds, where long ones
/// would cover each other.
const LENGTHS: [Cycle; 4] = [400, 200, 100, 50];
/// Largest share of the covered area that may be covered twice before ribbons are shortened.
const MOST_SHARED: f64 = 0.3;

/// A trail that is drawn.
#[derive(Debug, Clone)]
pub(crate) struct Shown<'a> {
    pub(crate) of: Who,
    pub(crate) way: &'a [(Cycle, Place)],
    pub(crate) color: Color,
    /// The body's width, if the trail is the area that it has swept on a floor.
    pub(crate) width_m: Option<f64>,
    /// First and last cycle of all trails.
    pub(crate) span: [Cycle; 2],
    /// Its dashes, which distinguish it from others of its color; of ribbons, which have a name beside them, none.
    pub(crate) dash: &'static str,
}

impl Shown<'_> {
    /// Returns the shade of a cycle, one of `shades`, 0 for the oldest.
    pub(super) fn shade(&self, cycle: Cycle, shades: usize) -> usize {
        let [from, to] = self.span;
        let (age, span) = (cycle.saturating_sub(from), to.saturating_sub(from).max(1));
        ((age as f64 / span as f64 * shades as f64) as usize).min(shades - 1)
    }
}

/// Returns agents with ways that can be distinguished in one picture: at most one of each
/// color, or sixty if ways are thin lines; for chains the leader and the other end.
pub fn worth_a_trail(scenery: &Scenery, frame: &Frame) -> Vec<Who> {
    let agents = agents(scenery, frame);
    let kind = agents.first().map(|&(kind, _)| kind);
    let numbers: Vec<u32> = agents.into_iter().map(|(_, number)| number).collect();
    match kind {
        None => Vec::new(),
        Some(Kind::Airplane) => {
            let first = numbers.into_iter().take(MOST_LINES);
            first.map(|number| Who::new(Kind::Airplane, number, None)).collect()
        }
        Some(Kind::Connector) => {
            numbers.into_iter().take(COLORS.len()).flat_map(|n| ends(frame, n)).collect()
        }
        Some(kind) => {
            of_each_color(&numbers).into_iter().map(|n| Who::new(kind, n, None)).collect()
        }
    }
}

/// Returns kinds and numbers of the agents, by number; everything with a start is an airplane, even
/// if it is not present.
pub(super) fn agents(scenery: &Scenery, frame: &Frame) -> BTreeSet<(Kind, u32)> {
    // Robots that are parts of a chain keep to its connectors.
    let acts = |body: &&Body| {
        body.kind.is_agent() && (body.kind == Kind::Connector || body.part.is_none())
    };
    let here = frame.bodies.iter().filter(acts).map(|body| (body.kind, body.number));
    let starts = scenery.bodies.iter().filter(|body| body.kind == Kind::Start);
    here.chain(starts.map(|start| (Kind::Airplane, start.number))).collect()
}

/// Returns the leader of a chain, or its first connector, and the other end.
fn ends(frame: &Frame, number: u32) -> Vec<Who> {
    let is_its = |body: &&Body| body.kind == Kind::Connector && body.number == number;
    let mut parts = frame.bodies.iter().filter(is_its).map(Body::who);
    let leader = frame.bodies.iter().filter(is_its).find(|body| body.state == Condition::Leading);
    let first = parts.next();
    let leader = leader.map(Body::who).or(first);
    let last = parts.next_back().filter(|last| Some(*last) != leader).or(first);
    let ends = [leader, last.filter(|last| Some(*last) != leader)];
    ends.into_iter().flatten().collect()
}

/// Returns at most one number of each color, at about equal steps, including the first.
fn of_each_color(numbers: &[u32]) -> Vec<u32> {
    let most = numbers.len().min(COLORS.len());
    let mut chosen: Vec<u32> = Vec::new();
    for k in 0..most {
        let from = k * numbers.len() / most;
        let is_new = |n: &&u32| chosen.iter().all(|c| color_of(*c) != color_of(**n));
        chosen.extend(numbers[from..].iter().chain(&numbers[..from]).find(is_new));
    }
    chosen.sort_unstable();
    chosen
}

/// Returns the trails that are drawn, and how much of them.
pub(super) fn shown<'a>(scenery: &Scenery, frame: &Frame, trails: &'a [Trail]) -> Vec<Shown<'a>> {
    let worth = worth_a_trail(scenery, frame);
    let sizes = sizes(scenery, frame);
    let drawn = |trail: &'a Trail| Shown {
        of: trail.of,
        way: &trail.way,
        color: color_of(trail.of.number),
        width_m: sizes.get(&trail.of).map(|size_m| size_m[0]),
        span: [0, 0],
        dash: "",
    };
    let is_shown = |trail: &&Trail| worth.contains(&trail.of) && !trail.way.is_empty();
    let mut shown: Vec<Shown<'_>> = trails.iter().filter(is_shown).map(drawn).collect();
    if let Some(floor) = scenery.floor.as_ref().filter(|_| !sizes.is_empty()) {
        shorten(&mut shown, floor, &sizes);
    }
    let cycles = || shown.iter().flat_map(|trail| trail.way).map(|(cycle, _)| *cycle);
    let span = [cycles().min().unwrap_or(0), cycles().max().unwrap_or(0)];
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
fn sizes(scenery: &Scenery, frame: &Frame) -> BTreeMap<Who, [f64; 2]> {
    if scenery.floor.is_none() {
        return BTreeMap::new();
    }
    let size = |body: &Body| match body.shape {
        // A body without extent leaves no ribbon.
        Shape::Cuboid { size_m: [x, y, _] } if x > 0.0 && y > 0.0 => Some((body.who(), [x, y])),
        _ => None,
    };
    frame.bodies.iter().filter(|body| body.kind.is_agent()).filter_map(size).collect()
}

/// Keeps the longest last part of the trails that leaves them distinguishable.
fn shorten(trails: &mut [Shown<'_>], floor: &Floor, sizes: &BTreeMap<Who, [f64; 2]>) {
    let now = trails.iter().filter_map(|trail| trail.way.last()).map(|(cycle, _)| *cycle).max();
    let now = now.unwrap_or(0);
    for length in LENGTHS {
        for trail in trails.iter_mut() {
            let is_before = |(cycle, _): &(Cycle, Place)| cycle + length < now;
            trail.way = &trail.way[trail.way.partition_point(is_before)..];
        }
        if shared(trails, floor, sizes) <= MOST_SHARED {
            return;
        }
    }
}

/// Returns the share of the covered boxes that two bodies or more have covered.
fn shared(trails: &[Shown<'_>], floor: &Floor, sizes: &BTreeMap<Who, [f64; 2]>) -> f64 {
    let mut covered_by = BTreeMap::<(i64, i64), u64>::new();
    for (index, trail) in trails.iter().enumerate() {
        let Some(size_m) = sizes.get(&trail.of) else { continue };
        // Bodies larger than the floor cover all of it.
        let boxes = |k: usize, most: u32| {
            ((size_m[k] / floor.box_m).round() as i64).clamp(1, i64::from(most))
        };
        let (width, height) = (boxes(0, floor.width), boxes(1, floor.height));
        let corner = |&(_, [x, y, _]): &(Cycle, Place)| {
            let middle_m = floor.plane.point([x, y]);
            let low = |k: usize| ((middle_m[k] - 0.5 * size_m[k]) / floor.box_m).round() as i64;
            (low(0), low(1))
        };
        let corners: BTreeSet<(i64, i64)> = trail.way.iter().map(corner).collect();
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
        let chosen = of_each_color(&numbers);
        assert_eq!(chosen, [0, 4, 8, 13, 17, 21]);
        let colors: BTreeSet<Color> = chosen.iter().map(|&n| color_of(n)).collect();
        assert_eq!(colors.len(), COLORS.len());
        assert_eq!(of_each_color(&numbers[..3]), [0, 1, 2]);
        assert!(of_each_color(&[]).is_empty());
        assert_eq!(of_each_color(&[0, 6, 12]), [0], "all of one color");
    }
}
