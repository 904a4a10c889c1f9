//! Names beside the bodies with trails, placed where they cover neither each other nor any body.

use super::canvas::{Canvas, Px};
use super::trails::DrawnTrail;
use super::{Scene, map_legend};
use crate::legend::{arrowhead, end_mark, start_mark};
use crate::style::{Style, hex};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::{self, Weight};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::{Body, BodyKind, BodyRole, Shape};

/// Largest number of trails in a picture with names: with more there is no space.
const MAX_LABELS: usize = 12;
/// Distance between a name and its body.
const GAP_PX: f64 = 4.0;
/// Radius of the mark at the start of a line, and length of the head that shows its direction.
const LINE_START_PX: f64 = 2.6;
const HEAD_PX: f64 = 8.0;
/// Distances at which space is searched for, in gaps.
const LABEL_DISTANCES_GAPS: [f64; 4] = [1.0, 3.0, 6.0, 10.0];

/// Marks where a trail starts and ends, and writes the name of its body if there is space.
pub(super) fn draw(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas, area: Rect, style: &Style) {
    let mut taken: Vec<Rect> = Vec::new();
    let mut wanted = Vec::new();
    for trail in &scene.trails {
        let Some((&(_, start), &(_, end))) = trail.points.first().zip(trail.points.last()) else {
            continue;
        };
        let start = canvas.px(start);
        let end = canvas.px(end);
        let color = hex(trail.color);
        let body = scene.frame.bodies.iter().find(|body| body.id() == trail.of);
        let radius_px = body.map_or(0.0, |body| radius_m(body) * canvas.px_per_m);
        let mark_px = (0.56 * radius_px).clamp(3.0, 6.0);
        // If the body itself is drawn there, it needs no mark.
        if contains(area, start) {
            let start_px = if trail.width_m.is_some() { mark_px } else { LINE_START_PX };
            start_mark(svg, start, start_px, &color);
        }
        if trail.width_m.is_none() {
            draw_direction(svg, trail, canvas, &color);
        }
        if body.is_none() && contains(area, end) {
            end_mark(svg, end, 3.0, &color);
        }
        let clear_px = if body.is_some() { radius_px.max(mark_px) } else { mark_px };
        taken.push(square_around(end, clear_px));
        // Parts of a body have no name of their own.
        if trail.of.part.is_none() && contains(area, end) {
            wanted.push((
                end,
                clear_px,
                map_legend::display_name(scene, trail.of.kind, trail.of.number),
            ));
        }
    }
    if wanted.len() > MAX_LABELS {
        return;
    }
    taken.extend(body_rects(scene, canvas));
    for (at, clear_px, words) in wanted {
        let label = Label { at, clear_px, words: &words };
        write_label(svg, label, area, &mut taken, style);
    }
}

/// Returns the rectangles of bodies that no name may cover.
fn body_rects<'a>(scene: &Scene<'a>, canvas: &'a Canvas) -> impl Iterator<Item = Rect> + use<'a> {
    let kept_free = scene.visible().into_iter().filter(|body| {
        body.kind.is_agent()
            || matches!(body.kind.role(), BodyRole::MovesAmong(_) | BodyRole::StartOf(_))
            || body.kind == BodyKind::GOAL
    });
    kept_free.map(|body| square_around(canvas.px(body.pose.at_m), radius_m(body) * canvas.px_per_m))
}

/// Draws an arrowhead in the middle of a line, which shows where it goes.
pub(super) fn draw_direction(svg: &mut Svg, trail: &DrawnTrail<'_>, canvas: &Canvas, color: &str) {
    let points: Vec<Px> = trail.points.iter().map(|&(_, at)| canvas.px(at)).collect();
    let half = 0.5 * points.windows(2).map(length_px).sum::<f64>();
    // A short line has no space for a head.
    if half < 3.0 * HEAD_PX {
        return;
    }
    let mut passed = 0.0;
    let middle = points.windows(2).find(|pair| {
        passed += length_px(pair);
        passed >= half && length_px(pair) > 0.0
    });
    let Some(&[(x0, y0), (x, y)]) = middle else { return };
    arrowhead(svg, (x0, y0), (x, y), HEAD_PX, color);
}

fn radius_m(body: &Body) -> f64 {
    match body.shape {
        Shape::Cuboid { size_m: [x, y, _] } => 0.5 * x.max(y),
        Shape::Cylinder { radius_m, .. } | Shape::Sphere { radius_m } => radius_m,
        Shape::Dart { length_m, .. } => 0.5 * length_m,
        Shape::Line { .. } => 0.0,
    }
}

fn square_around((x, y): Px, radius: f64) -> Rect {
    Rect { x: x - radius, y: y - radius, width: 2.0 * radius, height: 2.0 * radius }
}

fn contains(area: Rect, (x, y): Px) -> bool {
    (area.x..=area.right()).contains(&x) && (area.y..=area.bottom()).contains(&y)
}

/// Words for a point.
struct Label<'a> {
    at: Px,
    /// The distance from the point that stays clear.
    clear_px: f64,
    words: &'a str,
}

/// Writes words beside a point if there is space; otherwise nothing.
fn write_label(svg: &mut Svg, label: Label<'_>, area: Rect, taken: &mut Vec<Rect>, style: &Style) {
    let Label { at: (x, y), clear_px, words } = label;
    let size = style.small_px();
    let text_style =
        TextStyle { halo: true, weight: Weight::Bold, ..TextStyle::new(size, Anchor::Start) };
    let width = text::width(words, size, Weight::Bold);
    // Letters reach slightly beyond their font size.
    let height = 1.3 * size;
    let places = LABEL_DISTANCES_GAPS.iter().flat_map(|&gaps| {
        let out = clear_px + gaps * GAP_PX;
        let left = x - out - width;
        let middle = x - 0.5 * width;
        let up = y - out - height;
        // Readers look for a name to the right first, and beside or above a point rather than at its corners.
        [
            (x + out, y - 0.5 * height),
            (left, y - 0.5 * height),
            (middle, up),
            (middle, y + out),
            (x + out, up),
            (x + out, y + out),
            (left, up),
            (left, y + out),
        ]
    });
    let mut rects = places.map(|(x, y)| Rect { x, y, width, height });
    let free = rects.find(|rect| {
        is_within(*rect, area) && taken.iter().all(|other| is_disjoint(*other, *rect))
    });
    if let Some(rect) = free {
        svg.text(rect.x, rect.y + 0.5 * height + text_style.middle_px(), words, &text_style);
        taken.push(rect);
    }
}

/// Returns the length of a segment between two points.
fn length_px(pair: &[Px]) -> f64 {
    hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1)
}

fn is_within(rect: Rect, area: Rect) -> bool {
    contains(area, (rect.x, rect.y)) && contains(area, (rect.right(), rect.bottom()))
}

fn is_disjoint(a: Rect, b: Rect) -> bool {
    a.right() <= b.x || b.right() <= a.x || a.bottom() <= b.y || b.bottom() <= a.y
}
