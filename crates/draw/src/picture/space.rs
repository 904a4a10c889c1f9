//! Pictures in space: the edges of the shown box, and the words around it.

use super::canvas::{Camera, Canvas, corners};
use super::sheet::{EDGE_PX, unit};
use super::{PictureOptions, Scene, extent, labels, map_legend};
use crate::error::DrawError;
use crate::legend::{Legend, paragraph, small_print_style, title_style};
use crate::style::{FAINT_INK, GRID, Style};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::{self, Weight};
use crate::ticks::{Ticks, decimals, label, nice_step};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::Vec3;

/// Room along an edge for a number.
const NUMBER_ROOM_PX: f64 = 60.0;

pub(super) fn draw(scene: &Scene<'_>, options: &PictureOptions) -> Result<String, DrawError> {
    let style = &options.style;
    let box_m = extent::scene_bounds(scene)?;
    let mut svg = Svg::default();
    let room_px = style.width_px - 2.0 * EDGE_PX;
    let title = text::wrap(&options.title, style.title_px(), Weight::Bold, room_px);
    let top = paragraph(&mut svg, &title, (EDGE_PX, EDGE_PX), &title_style(style.title_px()));
    let (canvas, height_px) = canvas(box_m, style, top);
    let room = Rect { x: 0.0, y: top, width: style.width_px, height: height_px };
    draw_box(&mut svg, &canvas, box_m, style);
    svg.open_clip(room);
    scene.draw_space(&mut svg, &canvas);
    svg.close_group();
    labels::draw(&mut svg, scene, &canvas, room, style);
    let legend = Legend::new(map_legend::legend_entries(scene), style.small_px(), room_px);
    legend.draw(&mut svg, EDGE_PX, room.bottom());
    let top = room.bottom() + legend.height_px() + 4.0;
    let words = format!("{} {}", describe_box(box_m), options.caption);
    let lines = text::wrap(&words, style.small_px(), Weight::Regular, room_px);
    let end = paragraph(&mut svg, &lines, (EDGE_PX, top), &small_print_style(style.small_px()));
    Ok(svg.finish(style.width_px, end + EDGE_PX, &options.title))
}

/// Returns the canvas that shows a box as large as fits below `top`, and its height.
fn canvas(box_m: [Vec3; 2], style: &Style, top: f64) -> (Canvas, f64) {
    let camera = Camera::CORNER;
    let [lo, hi] = extent::projected_bounds(camera, box_m);
    // Room for the numbers at the axes.
    let margin = EDGE_PX + 3.2 * style.font_px;
    let (width, height) =
        ((style.width_px - 2.0 * margin).max(10.0), (style.height_px - 2.0 * margin).max(10.0));
    let px_per_m = (width / (hi[0] - lo[0])).min(height / (hi[1] - lo[1]));
    let spare = 0.5 * (width - px_per_m * (hi[0] - lo[0]));
    let canvas = Canvas {
        camera,
        px_per_m,
        zero: (margin + spare, top + margin + px_per_m * (hi[1] - lo[1])),
        origin_m: lo,
        depths_m: Camera::range(camera.to_eye, box_m),
    };
    (canvas, 2.0 * margin + px_per_m * (hi[1] - lo[1]))
}

/// Draws the edges of the shown box, and the names of the axes.
fn draw_box(svg: &mut Svg, canvas: &Canvas, box_m: [Vec3; 2], style: &Style) {
    let all = corners(box_m);
    for from in 0..8 {
        for k in (0..3).filter(|k| from >> k & 1 == 0) {
            let ends = [from, from | 1 << k].map(|c| canvas.px(all[c]));
            svg.line(ends[0], ends[1], format_args!(r#"stroke="{GRID}""#));
        }
    }
    let look = TextStyle { fill: FAINT_INK, ..TextStyle::new(style.small_px(), Anchor::Middle) };
    let mut taken = Vec::new();
    // Edges with nothing in front of them, as corners of the box.
    for (name, [from, to]) in [("x", [0, 1]), ("y", [1, 3]), ("z", [0, 4])] {
        let (from, to) = (canvas.px(all[from]), canvas.px(all[to]));
        svg.line(from, to, format_args!(r#"stroke="{FAINT_INK}" stroke-width="1.2""#));
        let length = hypot(to.0 - from.0, to.1 - from.1).max(1.0);
        let out = 1.6 * style.font_px / length;
        let at = (to.0 + out * (to.0 - from.0), to.1 + out * (to.1 - from.1));
        let longest_m = (0..3).map(|k| box_m[1][k] - box_m[0][k]).fold(0.0, f64::max);
        svg.text(at.0, at.1 + look.middle_px(), &format!("{name} ({})", unit(longest_m).0), &look);
        taken.push((at, 2.5 * style.font_px));
    }
    (0..3).for_each(|k| draw_numbers(svg, canvas, box_m, k, style, &mut taken));
}

/// Writes numbers along the edge `k` of the box, on the side where nothing is. Those that would lie on a place
/// that is `taken` already, in pixels, are left out.
fn draw_numbers(
    svg: &mut Svg,
    canvas: &Canvas,
    box_m: [Vec3; 2],
    k: usize,
    style: &Style,
    taken: &mut Vec<((f64, f64), f64)>,
) {
    let longest_m = (0..3).map(|k| box_m[1][k] - box_m[0][k]).fold(0.0, f64::max);
    let unit_m = unit(longest_m).1;
    // The edge of y begins where that of x ends.
    let mut place = box_m[0];
    if k == 1 {
        place[0] = box_m[1][0];
    }
    let at = |value: f64| {
        let mut on_edge = place;
        on_edge[k] = value * unit_m;
        canvas.px(on_edge)
    };
    let (low, high) = (box_m[0][k] / unit_m, box_m[1][k] / unit_m);
    let (from, to) = (at(low), at(high));
    let room_px = hypot(to.0 - from.0, to.1 - from.1);
    let ticks = Ticks::linear(low, high, ((room_px / NUMBER_ROOM_PX) as usize).clamp(1, 8));
    let (anchor, [dx, dy]) =
        [(Anchor::End, [-0.5, 0.9]), (Anchor::Start, [0.5, 0.9]), (Anchor::End, [-0.6, 0.0])][k];
    let look = TextStyle { fill: FAINT_INK, ..TextStyle::new(style.small_px(), anchor) };
    for (value, label) in &ticks.major {
        let (x, y) = at(*value);
        let (dx, dy) = (dx * style.small_px(), dy * style.small_px());
        let place = (x + dx, y + dy);
        if taken.iter().any(|(by, room_px)| hypot(by.0 - place.0, by.1 - place.1) < *room_px) {
            continue;
        }
        taken.push((place, 1.5 * style.font_px));
        svg.line((x, y), (x + 0.6 * dx, y + 0.6 * dy), format_args!(r#"stroke="{FAINT_INK}""#));
        svg.text(x + dx, y + dy + look.middle_px(), label, &look);
    }
}

/// Describes the extent of the shown box in words.
fn describe_box([lo, hi]: [Vec3; 2]) -> String {
    let longest_m = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f64::max);
    let (unit, unit_m) = unit(longest_m);
    let axis = |k: usize| {
        let (from, to) = (lo[k] / unit_m, hi[k] / unit_m);
        let digits = decimals(nice_step(to - from, 100));
        format!("{} {} to {} {unit}", ["x", "y", "z"][k], label(from, digits), label(to, digits))
    };
    format!("Shown: {}, {}, {}.", axis(0), axis(1), axis(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_fills_the_room_and_stays_inside() {
        let style = Style::MAP;
        let box_m = [[-3.0, 1.0, 0.0], [5.0, 2.0, 4.0]];
        let (canvas, height_px) = canvas(box_m, &style, 40.0);
        for (x, y) in corners(box_m).map(|p| canvas.px(p)) {
            assert!((EDGE_PX..=style.width_px - EDGE_PX).contains(&x), "{x}");
            assert!((40.0..=40.0 + height_px).contains(&y), "{y}");
        }
    }
}
