//! Data blocks: call sign, level and speed beside each aircraft, where they cover nothing, with leader lines.

use super::Plan;
use super::aircraft::{SYMBOL_PX, aircraft, is_in_conflict, vector_px};
use super::units::{ground_speed_m_s, vertical_symbol};
use crate::picture::canvas::Px;
use crate::picture::map_legend::display_name;
use crate::picture::trails::DrawnTrail;
use crate::style::{INK, hex};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::{self, Weight};
use sidestep_kernel::math::{cos, hypot, sin};
use sidestep_kernel::view::{Body, BodyId};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_4, FRAC_PI_6, TAU};

/// Largest number of aircraft with data blocks in a picture: beyond it there is no space, and the search would be slow.
pub(super) const MAX_BLOCKS: usize = 150;
/// Distances of a block from its aircraft that are tried, in heights of a line.
const DISTANCES_LINES: [f64; 6] = [1.3, 2.2, 3.4, 5.0, 7.0, 9.5];
/// Directions that are tried at each distance.
const DIRECTIONS: usize = 12;
/// Radius around an aircraft within which others push its block away, in heights of a line.
const CROWD_LINES: f64 = 9.0;
/// Cost of a line of distance, of half a turn from the free side, and of a velocity vector that is covered.
const DISTANCE_COST: f64 = 1.0;
const DIRECTION_COST: f64 = 2.5;
const VECTOR_COST: f64 = 4.0;

/// The text of an aircraft.
struct DataBlock {
    at: Px,
    lines: Vec<String>,
    width: f64,
    height: f64,
    text_color: String,
    color: String,
}

/// A straight line in pixels.
type Segment = (Px, Px);

/// Where blocks are placed, and what they must not cover.
struct Placement {
    map: Rect,
    line_px: f64,
    /// Rectangles that no block may cover: symbols, other texts, and blocks so far.
    taken: Vec<Rect>,
    /// Leader lines so far, which no block may cover.
    leaders: Vec<Segment>,
    /// Velocity vectors, which blocks cover only if there is no other place.
    vectors: Vec<Segment>,
    /// The positions of all aircraft.
    aircraft: Vec<Px>,
}

/// The number of blocks that were drawn, and of those that had no space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct BlockCount {
    pub(super) drawn: usize,
    pub(super) left_out: usize,
}

/// Draws the data blocks of the aircraft in the plan, and the names of those that are gone; `taken` are the rectangles
/// of other texts.
pub(super) fn draw(svg: &mut Svg, plan: &Plan<'_>, taken: Vec<Rect>) -> BlockCount {
    let blocks = blocks(plan);
    let mut placement = Placement::new(plan, &blocks, taken);
    let mut count = BlockCount::default();
    for (k, block) in blocks.iter().enumerate() {
        let place = if k < MAX_BLOCKS { placement.place(block) } else { None };
        match place {
            Some(rect) => {
                placement.add(block, rect);
                draw_block(svg, plan, block, rect);
                count.drawn += 1;
            }
            None => count.left_out += 1,
        }
    }
    count
}

/// Returns the blocks of all that the plan shows, in the order in which they choose their places.
fn blocks(plan: &Plan<'_>) -> Vec<DataBlock> {
    let mut bodies: Vec<&Body> = aircraft(plan.scene.frame).collect();
    // Those in conflict choose first. The sort is stable, so others come by number.
    bodies.sort_by_key(|body| !is_in_conflict(body));
    let present: BTreeSet<BodyId> = bodies.iter().map(|body| body.id()).collect();
    let gone = plan.scene.trails.iter().filter(|trail| !present.contains(&trail.of));
    let names = gone.filter_map(|trail| DataBlock::of_trail(plan, trail));
    let chosen = bodies.iter().filter(|body| !plan.is_context(body));
    let blocks = chosen.map(|body| DataBlock::new(plan, body)).chain(names);
    blocks.filter(|block| contains(plan.window.map, block.at)).collect()
}

impl DataBlock {
    fn new(plan: &Plan<'_>, body: &Body) -> Self {
        let size_px = plan.style.small_px();
        let name = display_name(plan.scene, body.kind, body.number);
        let level = plan.units.level(body.pose.at_m[2]);
        let symbol = vertical_symbol(body.velocity_m_s[2]);
        let mut words = format!("{level}{symbol}");
        // A recording may have no velocities.
        if body.is_moving() {
            let speed = plan.units.speed(ground_speed_m_s(body.velocity_m_s));
            words = format!("{words} {speed}");
        }
        let first_px = text::width(&name, size_px, Weight::Bold);
        let second_px = text::width(&words, size_px, Weight::Regular);
        Self {
            at: plan.window.canvas.px(body.pose.at_m),
            lines: vec![name, words],
            width: first_px.max(second_px),
            height: 2.0 * line_px(size_px),
            text_color: if is_in_conflict(body) { hex(plan.color_of(body)) } else { INK.into() },
            color: hex(plan.color_of(body)),
        }
    }

    /// Returns the name at the end of the trail of an aircraft that is gone.
    fn of_trail(plan: &Plan<'_>, trail: &DrawnTrail<'_>) -> Option<Self> {
        let (_, at_m) = trail.points.last()?;
        let size_px = plan.style.small_px();
        let name = display_name(plan.scene, trail.of.kind, trail.of.number);
        let color = hex(trail.color);
        Some(Self {
            at: plan.window.canvas.px(*at_m),
            width: text::width(&name, size_px, Weight::Bold),
            height: line_px(size_px),
            lines: vec![name],
            text_color: color.clone(),
            color,
        })
    }
}

/// Returns the height of a line of text.
fn line_px(size_px: f64) -> f64 {
    1.18 * size_px
}

impl Placement {
    fn new(plan: &Plan<'_>, blocks: &[DataBlock], mut taken: Vec<Rect>) -> Self {
        let positions: Vec<Px> = blocks.iter().map(|block| block.at).collect();
        let bodies = aircraft(plan.scene.frame);
        taken.extend(positions.iter().map(|&at| square_around(at, 0.5 * SYMBOL_PX)));
        Self {
            map: plan.window.map,
            line_px: line_px(plan.style.small_px()),
            taken,
            leaders: Vec::new(),
            vectors: bodies.filter_map(|body| vector_px(plan, body)).collect(),
            aircraft: positions,
        }
    }

    /// Returns the best free place of a block.
    fn place(&self, block: &DataBlock) -> Option<Rect> {
        let free_rad = self.free_direction_rad(block.at);
        let mut best: Option<(f64, Rect)> = None;
        for lines in DISTANCES_LINES {
            for k in 0..DIRECTIONS {
                let turn_rad = k as f64 * FRAC_PI_6;
                let off_rad = turn_rad.min(TAU - turn_rad);
                let cost = DISTANCE_COST * lines + DIRECTION_COST * off_rad / std::f64::consts::PI;
                if best.is_some_and(|(least, _)| least <= cost) {
                    continue;
                }
                let rect = block_rect(block, free_rad + turn_rad, lines * self.line_px);
                if !self.is_free(block, rect) {
                    continue;
                }
                let cost = cost + VECTOR_COST * self.covered_vectors(rect) as f64;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, rect));
                }
            }
        }
        best.map(|(_, rect)| rect)
    }

    /// Returns the direction away from the other aircraft near a place; up and to the right where there are none.
    fn free_direction_rad(&self, (x, y): Px) -> f64 {
        let range_px = CROWD_LINES * self.line_px;
        let mut push = (0.0, 0.0);
        for &(other_x, other_y) in &self.aircraft {
            let dx = x - other_x;
            let dy = y - other_y;
            let distance = hypot(dx, dy);
            if distance > 0.0 && distance < range_px {
                let weight = (1.0 - distance / range_px) / distance;
                push = (push.0 + weight * dx, push.1 + weight * dy);
            }
        }
        if push == (0.0, 0.0) {
            return -FRAC_PI_4;
        }
        sidestep_kernel::math::atan2(push.1, push.0)
    }

    fn is_free(&self, block: &DataBlock, rect: Rect) -> bool {
        let leader = (block.at, nearest_point(rect, block.at));
        let is_within = contains(self.map, (rect.x, rect.y))
            && contains(self.map, (rect.right(), rect.bottom()));
        let covers = |other: &Rect| !is_disjoint(*other, rect);
        let own = |other: &Rect| contains(*other, block.at);
        is_within
            && !self.taken.iter().any(covers)
            && !self.leaders.iter().any(|line| crosses(*line, rect))
            && !self.taken.iter().any(|other| !own(other) && crosses(leader, *other))
    }

    fn covered_vectors(&self, rect: Rect) -> usize {
        self.vectors.iter().filter(|vector| crosses(**vector, rect)).count()
    }

    fn add(&mut self, block: &DataBlock, rect: Rect) {
        self.taken.push(rect.grown(1.0));
        self.leaders.push((block.at, nearest_point(rect, block.at)));
    }
}

/// Returns the rectangle of a block whose nearest point lies in a direction, at a distance from the aircraft.
fn block_rect(block: &DataBlock, direction_rad: f64, distance_px: f64) -> Rect {
    let ux = cos(direction_rad);
    let uy = sin(direction_rad);
    let near = (block.at.0 + distance_px * ux, block.at.1 + distance_px * uy);
    Rect {
        x: near.0 - 0.5 * block.width * (1.0 - ux),
        y: near.1 - 0.5 * block.height * (1.0 - uy),
        width: block.width,
        height: block.height,
    }
}

fn draw_block(svg: &mut Svg, plan: &Plan<'_>, block: &DataBlock, rect: Rect) {
    let end = nearest_point(rect.grown(1.5), block.at);
    let length_px = hypot(end.0 - block.at.0, end.1 - block.at.1);
    let gap_px = 0.6 * SYMBOL_PX;
    if length_px > gap_px + 2.0 {
        let part = gap_px / length_px;
        let from =
            (block.at.0 + part * (end.0 - block.at.0), block.at.1 + part * (end.1 - block.at.1));
        let color = &block.color;
        let attributes = format!(r#"stroke="{color}" stroke-width="0.8" stroke-opacity="0.8""#);
        svg.line(from, end, format_args!(r#"class="leader-line" {attributes}"#));
    }
    let size_px = plan.style.small_px();
    let fill = block.text_color.as_str();
    for (row, line) in block.lines.iter().enumerate() {
        let weight = if row == 0 { Weight::Bold } else { Weight::Regular };
        let style =
            TextStyle { weight, fill, halo: true, ..TextStyle::new(size_px, Anchor::Start) };
        let baseline = rect.y + (row as f64 + 0.8) * line_px(size_px);
        svg.text(rect.x, baseline, line, &style);
    }
}

fn square_around((x, y): Px, half_px: f64) -> Rect {
    Rect { x: x - half_px, y: y - half_px, width: 2.0 * half_px, height: 2.0 * half_px }
}

fn contains(area: Rect, (x, y): Px) -> bool {
    (area.x..=area.right()).contains(&x) && (area.y..=area.bottom()).contains(&y)
}

fn is_disjoint(a: Rect, b: Rect) -> bool {
    a.right() <= b.x || b.right() <= a.x || a.bottom() <= b.y || b.bottom() <= a.y
}

fn nearest_point(rect: Rect, (x, y): Px) -> Px {
    (x.clamp(rect.x, rect.right()), y.clamp(rect.y, rect.bottom()))
}

/// Returns whether a segment has a point inside of a rectangle: it is clipped at each pair of edges in turn.
fn crosses((from, to): Segment, rect: Rect) -> bool {
    let mut enter = 0.0_f64;
    let mut leave = 1.0_f64;
    let sides = [
        (from.0, to.0 - from.0, rect.x, rect.right()),
        (from.1, to.1 - from.1, rect.y, rect.bottom()),
    ];
    for (start, step, low, high) in sides {
        if step == 0.0 {
            if start <= low || start >= high {
                return false;
            }
            continue;
        }
        let one = (low - start) / step;
        let other = (high - start) / step;
        enter = enter.max(one.min(other));
        leave = leave.min(one.max(other));
    }
    enter < leave
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECT: Rect = Rect { x: 10.0, y: 10.0, width: 20.0, height: 10.0 };

    #[test]
    fn a_line_crosses_what_it_passes_through_and_not_what_it_touches() {
        assert!(crosses(((0.0, 0.0), (40.0, 30.0)), RECT));
        assert!(crosses(((20.0, 15.0), (21.0, 15.0)), RECT), "inside");
        assert!(!crosses(((0.0, 0.0), (9.0, 40.0)), RECT));
        assert!(!crosses(((0.0, 10.0), (40.0, 10.0)), RECT), "along an edge");
        assert!(!crosses(((0.0, 0.0), (5.0, 4.0)), RECT), "it ends before");
    }
}
