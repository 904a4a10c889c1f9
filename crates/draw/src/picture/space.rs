//! Pictures in space: the edges of the shown box, and the words around it.

use super::canvas::{Camera, Canvas, corners};
use super::sheet::{EDGE_PX, unit};
use super::{DrawnPicture, PictureOptions, Scene, extent, labels, map_legend, shadows};
use crate::error::DrawError;
use crate::legend::{Legend, paragraph, small_print_style, title_style};
use crate::style::{FAINT_INK, GRID, Style};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::{self, Weight};
use crate::ticks::{Ticks, decimals, group_thousands, label, nice_step};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::Vec3;

/// Length of an edge per number: the widest labels do not overlap.
const NUMBER_SPACING_PX: f64 = 60.0;

pub(super) fn draw(scene: &Scene<'_>, options: &PictureOptions) -> Result<DrawnPicture, DrawError> {
    let style = &options.style;
    let box_m = extent::scene_bounds(scene)?;
    let mut svg = Svg::default();
    let text_width_px = style.width_px - 2.0 * EDGE_PX;
    let title = text::wrap(&options.title, style.title_px(), Weight::Bold, text_width_px);
    let top = paragraph(&mut svg, &title, (EDGE_PX, EDGE_PX), &title_style(style.title_px()));
    let camera = options.view.camera().unwrap_or_else(|| scene.best_camera());
    let (canvas, height_px) = canvas(camera, box_m, style, top);
    let area = Rect { x: 0.0, y: top, width: style.width_px, height: height_px };
    AxesBox { canvas: &canvas, box_m, style, taken: Vec::new() }.draw(&mut svg);
    svg.open_clip(area);
    shadows::draw_shadows(&mut svg, scene, &canvas, box_m[0][2]);
    scene.draw_space(&mut svg, &canvas);
    svg.close_group();
    labels::draw(&mut svg, scene, &canvas, area, style);
    let legend = Legend::new(map_legend::legend_entries(scene), style.small_px(), text_width_px);
    legend.draw(&mut svg, EDGE_PX, area.bottom());
    let top = area.bottom() + legend.height_px() + 4.0;
    let words = format!("{} {}{}", describe_box(box_m), describe_cut(scene), options.caption);
    let lines = text::wrap(&words, style.small_px(), Weight::Regular, text_width_px);
    let end = paragraph(&mut svg, &lines, (EDGE_PX, top), &small_print_style(style.small_px()));
    let svg = svg.finish(style.width_px, end + EDGE_PX, &options.title);
    Ok(DrawnPicture { svg, px_per_m: canvas.px_per_m })
}

/// Returns the canvas that shows a box as large as fits below `top`, and its height.
fn canvas(camera: Camera, box_m: [Vec3; 2], style: &Style, top: f64) -> (Canvas, f64) {
    let [lo, hi] = extent::projected_bounds(camera, box_m);
    // Space for the numbers at the axes.
    let margin = EDGE_PX + 3.2 * style.font_px;
    let width = (style.width_px - 2.0 * margin).max(10.0);
    let height = (style.height_px - 2.0 * margin).max(10.0);
    let px_per_m = (width / (hi[0] - lo[0])).min(height / (hi[1] - lo[1]));
    let spare = 0.5 * (width - px_per_m * (hi[0] - lo[0]));
    let canvas = Canvas {
        camera,
        px_per_m,
        zero: (margin + spare, top + margin + px_per_m * (hi[1] - lo[1])),
        origin_m: lo,
        depths_m: Camera::range(camera.to_eye, box_m),
        is_plane: false,
    };
    (canvas, 2.0 * margin + px_per_m * (hi[1] - lo[1]))
}

/// The edges of the shown box, with the names of its axes and their numbers.
struct AxesBox<'a> {
    canvas: &'a Canvas,
    box_m: [Vec3; 2],
    style: &'a Style,
    /// The places of names and numbers so far, which later ones must not cover.
    taken: Vec<TakenPlace>,
}

/// A place of a text: no other may lie closer to its center, in pixels.
struct TakenPlace {
    center: (f64, f64),
    radius_px: f64,
}

impl AxesBox<'_> {
    fn draw(mut self, svg: &mut Svg) {
        let canvas = self.canvas;
        shadows::draw_floor(svg, canvas, self.box_m);
        // Bit k of a corner's number is set at the upper end of axis k.
        let all = corners(self.box_m);
        for from in 0..8 {
            for k in (0..3).filter(|k| from >> k & 1 == 0) {
                let ends = [from, from | 1 << k].map(|c| canvas.px(all[c]));
                svg.line(ends[0], ends[1], format_args!(r#"stroke="{GRID}""#));
            }
        }
        let edges = axis_edges(canvas.camera);
        for (name, edge) in ["x", "y", "z"].into_iter().zip(&edges) {
            self.draw_axis(svg, name, edge.named.map(|corner| canvas.px(all[corner])));
        }
        // Names come first: a number can be left out, a name cannot.
        (0..3).for_each(|k| self.draw_numbers(svg, k, &edges[k]));
    }

    /// Draws an axis, and its name beyond its end.
    fn draw_axis(&mut self, svg: &mut Svg, name: &str, [from, to]: [(f64, f64); 2]) {
        svg.line(from, to, format_args!(r#"stroke="{FAINT_INK}" stroke-width="1.2""#));
        let length = hypot(to.0 - from.0, to.1 - from.1).max(1.0);
        let out = 1.6 * self.style.font_px / length;
        let at = (to.0 + out * (to.0 - from.0), to.1 + out * (to.1 - from.1));
        let text_style = self.text_style(Anchor::Middle);
        let words = format!("{name} ({})", unit(longest_side_m(self.box_m)).0);
        svg.text(at.0, at.1 + text_style.middle_px(), &words, &text_style);
        self.taken.push(TakenPlace { center: at, radius_px: 2.5 * self.style.font_px });
    }

    /// Writes numbers along the edge `k` of the box, on the side where nothing is. Those that would
    /// cover another text are left out.
    fn draw_numbers(&mut self, svg: &mut Svg, k: usize, edge: &AxisEdge) {
        let [lo, hi] = self.box_m;
        let unit_m = unit(longest_side_m(self.box_m)).1;
        let place = corners(self.box_m)[edge.named[0]];
        let canvas = self.canvas;
        let at = |value: f64| {
            let mut on_edge = place;
            on_edge[k] = value * unit_m;
            canvas.px(on_edge)
        };
        let low = lo[k] / unit_m;
        let high = hi[k] / unit_m;
        let from = at(low);
        let to = at(high);
        let edge_px = hypot(to.0 - from.0, to.1 - from.1);
        let ticks = Ticks::linear(low, high, ((edge_px / NUMBER_SPACING_PX) as usize).clamp(1, 8));
        // Below the edges of x and y, to the left of that of z.
        let [right, down] = if k == 2 {
            [-0.6, 0.0]
        } else if edge.is_left {
            [-0.5, 0.9]
        } else {
            [0.5, 0.9]
        };
        let anchor = if right < 0.0 { Anchor::End } else { Anchor::Start };
        let text_style = self.text_style(anchor);
        let dx = right * self.style.small_px();
        let dy = down * self.style.small_px();
        for (value, label) in &ticks.major {
            let (x, y) = at(*value);
            let center = (x + dx, y + dy);
            if self.taken.iter().any(|taken| taken.covers(center)) {
                continue;
            }
            self.taken.push(TakenPlace { center, radius_px: 1.5 * self.style.font_px });
            svg.line((x, y), (x + 0.6 * dx, y + 0.6 * dy), format_args!(r#"stroke="{FAINT_INK}""#));
            svg.text(x + dx, y + dy + text_style.middle_px(), label, &text_style);
        }
    }

    fn text_style(&self, anchor: Anchor) -> TextStyle<'static> {
        TextStyle { fill: FAINT_INK, ..TextStyle::new(self.style.small_px(), anchor) }
    }
}

/// An edge of the box with nothing in front of it.
#[derive(Debug, PartialEq)]
struct AxisEdge {
    /// Its corners: the name of the axis stands beyond the second one.
    named: [usize; 2],
    /// Whether it is on the left of the picture.
    is_left: bool,
}

/// Returns the edges along x, y and z that are lowest in the picture, or on its left. Bit k of a corner's number is set
/// at the upper end of axis k.
fn axis_edges(camera: Camera) -> [AxisEdge; 3] {
    let [x, y, z] = camera.to_eye;
    // From below, what is far is lowest.
    let is_upper = |toward_eye: f64| usize::from((toward_eye > 0.0) == (z >= 0.0));
    let near_x = is_upper(x);
    let near_y = is_upper(y) << 1;
    // Both edges meet in the corner that is lowest; the other end of each is outside.
    let lowest = near_x | near_y;
    let across_x = [lowest, lowest ^ 1];
    let across_y = [lowest, lowest ^ 2];
    let right = |corner: usize| {
        camera.right[0] * (corner & 1) as f64 + camera.right[1] * (corner >> 1 & 1) as f64
    };
    let x_is_left = right(across_x[1]) <= right(across_y[1]);
    let leftmost = if x_is_left { across_x[1] } else { across_y[1] };
    // Names stand where values are greatest, unless that is where the edges meet.
    [
        AxisEdge { named: across_x, is_left: x_is_left },
        AxisEdge { named: across_y, is_left: !x_is_left },
        AxisEdge { named: [leftmost, leftmost | 4], is_left: true },
    ]
}

impl TakenPlace {
    fn covers(&self, place: (f64, f64)) -> bool {
        hypot(self.center.0 - place.0, self.center.1 - place.1) < self.radius_px
    }
}

fn longest_side_m([lo, hi]: [Vec3; 2]) -> f64 {
    (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f64::max)
}

/// Describes the extent of the shown box in words.
fn describe_box([lo, hi]: [Vec3; 2]) -> String {
    let (unit, unit_m) = unit(longest_side_m([lo, hi]));
    let mut axes = Vec::new();
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let from = lo[k] / unit_m;
        let to = hi[k] / unit_m;
        let digits = decimals(nice_step(to - from, 100));
        axes.push(format!("{name} {} to {} {unit}", label(from, digits), label(to, digits)));
    }
    format!("Shown: {}.", axes.join(", "))
}

/// Describes what of the balls is shown, before other words; empty if all are.
pub(super) fn describe_cut(scene: &Scene<'_>) -> String {
    let Some((near_m, shown, all)) = scene.surroundings.cut() else { return String::new() };
    let digits = decimals(nice_step(near_m, 100));
    let shown = group_thousands(&shown.to_string());
    let all = group_thousands(&all.to_string());
    let near = label(near_m, digits);
    format!(
        "Of {all} balls, the {shown} within {near} m of an agent are drawn; those before one let it show through. "
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_where_nothing_is_before_them() {
        let edges = axis_edges(Camera::CORNER);
        // The eye is where x is high and y is low: that corner is the lowest.
        assert_eq!(edges[0], AxisEdge { named: [1, 0], is_left: true });
        assert_eq!(edges[1], AxisEdge { named: [1, 3], is_left: false });
        assert_eq!(edges[2], AxisEdge { named: [0, 4], is_left: true });
        let behind = axis_edges(Camera::from_angles(2.2, 0.6));
        assert_eq!(behind[0].named[0], 2, "seen from where x is low and y is high");
    }

    #[test]
    fn what_is_shown_fills_the_room_and_stays_inside() {
        let style = Style::MAP;
        let box_m = [[-3.0, 1.0, 0.0], [5.0, 2.0, 4.0]];
        let (canvas, height_px) = canvas(Camera::CORNER, box_m, &style, 40.0);
        for (x, y) in corners(box_m).map(|p| canvas.px(p)) {
            assert!((EDGE_PX..=style.width_px - EDGE_PX).contains(&x), "{x}");
            assert!((40.0..=40.0 + height_px).contains(&y), "{y}");
        }
    }
}
