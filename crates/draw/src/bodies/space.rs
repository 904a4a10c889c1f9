//! Bodies in space, in parallel projection.

use super::plane::{arrow, path_data};
use super::{BodyScene, Obstacle, Shape, thinned};
use crate::error::DrawError;
use crate::legend::{Legend, Symbol, paragraph, start_mark, title_look};
use crate::style::{FAINT_INK, GRID, Style, series_color};
use crate::svg::{Anchor, Num, Rect, Svg, TextLook};
use crate::text::{self, Weight};
use crate::ticks::{decimals, label, nice_step};

/// Directions of the picture in space: to the right, up, and toward the eye. 37 degrees about the
/// vertical and 37 degrees above the horizon, in numbers that doubles nearly hold.
pub(crate) const RIGHT: [f64; 3] = [0.8, 0.6, 0.0];
pub(crate) const UP: [f64; 3] = [-0.36, 0.48, 0.8];
pub(crate) const TO_EYE: [f64; 3] = [0.48, -0.64, 0.6];

const EDGE_PX: f64 = 10.0;
const LEAST_LINE_PX: f64 = 1.6;
const LEADER_PX: f64 = 5.0;

/// Legend symbols of what stands still, and of what moves.
const LOOKS: [Symbol; 2] = [
    Symbol::Swatch { fill: "#6E6E6E", rim: "#6E6E6E", opacity: 0.4 },
    Symbol::Swatch { fill: "#B4B4B4", rim: "#6E6E6E", opacity: 0.4 },
];

type Px = (f64, f64);

pub(super) fn draw(scene: &BodyScene<3>, style: &Style) -> Result<String, DrawError> {
    style.check()?;
    scene.check()?;
    let box_m = scene.shown()?;
    let mut svg = Svg::default();
    let room_px = style.width_px - 2.0 * EDGE_PX;
    let title = text::wrap(&scene.title, style.title_px(), Weight::Bold, room_px);
    let top = paragraph(&mut svg, &title, (EDGE_PX, EDGE_PX), &title_look(style.title_px()));
    let view = View::new(box_m, style, top);
    view.draw_box(&mut svg, box_m, style);
    svg.open_clip(Rect { x: 0.0, y: top, width: style.width_px, height: view.bottom_px - top });
    let mut parts = view.parts(scene);
    // Stable: of things equally far the one named first is drawn first.
    parts.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    for part in &parts {
        view.draw_part(&mut svg, part);
    }
    view.draw_marks(&mut svg, scene);
    svg.close_group();
    Ok(view.close(svg, scene, box_m, style))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn corners([lo, hi]: [[f64; 3]; 2]) -> [[f64; 3]; 8] {
    std::array::from_fn(|bits| {
        std::array::from_fn(|k| if bits >> k & 1 == 1 { hi[k] } else { lo[k] })
    })
}

/// What is drawn at once.
struct Part<'a> {
    depth_m: f64,
    what: What<'a>,
}

enum What<'a> {
    Obstacle(&'a Obstacle<3>),
    Rod { ends: [[f64; 3]; 2], width_px: f64, color: &'static str },
    Connector { at: [f64; 3], radius_px: f64, color: &'static str },
}

/// From meters to pixels.
struct View {
    px: f64,
    /// Where the origin of space is in the picture.
    left: f64,
    top: f64,
    bottom_px: f64,
    /// The nearest and the furthest depth.
    depths_m: [f64; 2],
}

impl View {
    /// The view that shows a box as large as there is room, below `top`.
    fn new(box_m: [[f64; 3]; 2], style: &Style, top: f64) -> Self {
        let range = |u: [f64; 3]| {
            let along = corners(box_m).map(|p| dot(p, u));
            let low = along.into_iter().fold(f64::INFINITY, f64::min);
            [low, along.into_iter().fold(f64::NEG_INFINITY, f64::max)]
        };
        let (across, upward) = (range(RIGHT), range(UP));
        // Room for the letters at the axes.
        let margin = EDGE_PX + 1.5 * style.font_px;
        let (width, height) =
            ((style.width_px - 2.0 * margin).max(10.0), (style.height_px - 2.0 * margin).max(10.0));
        let px = (width / (across[1] - across[0])).min(height / (upward[1] - upward[0]));
        let spare = 0.5 * (width - px * (across[1] - across[0]));
        Self {
            px,
            left: margin + spare - px * across[0],
            top: top + margin + px * upward[1],
            bottom_px: top + 2.0 * margin + px * (upward[1] - upward[0]),
            depths_m: range(TO_EYE),
        }
    }

    fn at(&self, p: [f64; 3]) -> Px {
        (self.left + self.px * dot(p, RIGHT), self.top - self.px * dot(p, UP))
    }

    /// 0 for the furthest, 1 for the nearest.
    fn nearness(&self, depth_m: f64) -> f64 {
        let [far_m, near_m] = self.depths_m;
        ((depth_m - far_m) / (near_m - far_m)).clamp(0.0, 1.0)
    }

    /// The edges of what is shown, and the names of the axes.
    fn draw_box(&self, svg: &mut Svg, box_m: [[f64; 3]; 2], style: &Style) {
        let all = corners(box_m);
        for from in 0..8 {
            for k in (0..3).filter(|k| from >> k & 1 == 0) {
                let ends = [from, from | 1 << k].map(|c| self.at(all[c]));
                svg.line(ends[0], ends[1], format_args!(r#"stroke="{GRID}""#));
            }
        }
        let look = TextLook { fill: FAINT_INK, ..TextLook::new(style.small_px(), Anchor::Middle) };
        // Edges with nothing in front of them, as corners of the box.
        for (name, [from, to]) in [("x", [0, 1]), ("y", [1, 3]), ("z", [0, 4])] {
            let (from, to) = (self.at(all[from]), self.at(all[to]));
            svg.line(from, to, format_args!(r#"stroke="{FAINT_INK}" stroke-width="1.2""#));
            let length = ((to.0 - from.0).powi(2) + (to.1 - from.1).powi(2)).sqrt().max(1.0);
            let out = style.font_px / length;
            let at = (to.0 + out * (to.0 - from.0), to.1 + out * (to.1 - from.1));
            svg.text(at.0, at.1 + look.middle_px(), name, &look);
        }
    }

    /// Everything that has a depth.
    fn parts<'a>(&self, scene: &'a BodyScene<3>) -> Vec<Part<'a>> {
        let mut parts = Vec::new();
        let mut add = |at: [f64; 3], what| parts.push(Part { depth_m: dot(at, TO_EYE), what });
        for obstacle in &scene.obstacles {
            add(obstacle.shape.middle(), What::Obstacle(obstacle));
        }
        for (index, strand) in scene.strands.iter().enumerate() {
            let color = series_color(index);
            let width_px = (2.0 * strand.rod_radius_m * self.px).max(LEAST_LINE_PX);
            for rod in strand.points.windows(2) {
                let middle = std::array::from_fn(|k| 0.5 * (rod[0][k] + rod[1][k]));
                let ends = [rod[0], rod[1]];
                add(middle, What::Rod { ends, width_px, color });
            }
            let radius_px = (strand.connector_radius_m * self.px).max(0.6 * LEAST_LINE_PX);
            for &at in &strand.points {
                add(at, What::Connector { at, radius_px, color });
            }
        }
        parts
    }

    fn draw_part(&self, svg: &mut Svg, part: &Part<'_>) {
        let nearness = self.nearness(part.depth_m);
        match &part.what {
            What::Obstacle(obstacle) => self.draw_obstacle(svg, obstacle, nearness),
            What::Rod { ends: [a, b], width_px, color } => {
                let width = Num(*width_px);
                let look = format_args!(
                    r#"stroke="{color}" stroke-width="{width}" stroke-linecap="round""#
                );
                svg.line(self.at(*a), self.at(*b), look);
            }
            What::Connector { at, radius_px, color } => {
                svg.circle(self.at(*at), *radius_px, format_args!(r#"fill="{color}""#));
            }
        }
    }

    fn draw_obstacle(&self, svg: &mut Svg, obstacle: &Obstacle<3>, nearness: f64) {
        let gray = shade(if obstacle.moves() { 0.35 } else { 0.0 }, nearness);
        let rim = shade(0.0, 0.5 + 0.5 * nearness);
        let look = format!(
            r#"fill="{gray}" fill-opacity="0.22" stroke="{rim}" stroke-opacity="0.5" stroke-width="0.6""#
        );
        match obstacle.shape {
            Shape::Ball { center, radius_m } => {
                svg.circle(self.at(center), radius_m * self.px, look)
            }
            Shape::Capsule { ends: [a, b], radius_m } => {
                let width = Num((2.0 * radius_m * self.px).max(LEAST_LINE_PX));
                let look = format_args!(
                    r#"stroke="{gray}" stroke-opacity="0.45" stroke-width="{width}" stroke-linecap="round""#
                );
                svg.line(self.at(a), self.at(b), look);
            }
            Shape::Cuboid { axes, .. } => {
                for face in faces(&obstacle.shape.corners(), &axes) {
                    let around = face.map(|p| self.at(p));
                    svg.path(&format!("{}Z", path_data(&around)), &look);
                }
            }
        }
    }

    /// What is drawn over everything: trails, arrows, leaders.
    fn draw_marks(&self, svg: &mut Svg, scene: &BodyScene<3>) {
        for trail in &scene.trails {
            let points = thinned(trail.points.iter().map(|p| self.at(*p)));
            let color = series_color(trail.color);
            let look =
                format!(r#"fill="none" stroke="{color}" stroke-opacity="0.5" stroke-width="1.2""#);
            svg.path(&path_data(&points), look);
        }
        for obstacle in scene.obstacles.iter().filter(|o| o.moves()) {
            let [from, to] = obstacle.arrow().map(|p| self.at(p));
            arrow(svg, from, to);
        }
        for (index, strand) in scene.strands.iter().enumerate() {
            if let Some(&leader) = strand.points.first() {
                let radius = (strand.connector_radius_m * self.px).max(LEADER_PX);
                start_mark(svg, self.at(leader), radius, series_color(index));
            }
        }
    }

    /// Legend and small print.
    fn close(
        &self,
        mut svg: Svg,
        scene: &BodyScene<3>,
        box_m: [[f64; 3]; 2],
        style: &Style,
    ) -> String {
        let room_px = style.width_px - 2.0 * EDGE_PX;
        let legend = Legend::lay_out(scene.entries(LOOKS), style.small_px(), room_px);
        legend.draw(&mut svg, EDGE_PX, self.bottom_px);
        let top = self.bottom_px + legend.height_px() + 4.0;
        let words = format!("{} {}", box_words(box_m), scene.caption);
        let lines = text::wrap(&words, style.small_px(), Weight::Regular, room_px);
        let look = TextLook { fill: FAINT_INK, ..TextLook::new(style.small_px(), Anchor::Start) };
        let end = paragraph(&mut svg, &lines, (EDGE_PX, top), &look);
        svg.finish(style.width_px, end + EDGE_PX, &scene.title)
    }
}

/// The extent of what is shown, in words.
fn box_words([lo, hi]: [[f64; 3]; 2]) -> String {
    let axis = |k: usize| {
        let digits = decimals(nice_step(hi[k] - lo[k], 100));
        format!("{} {} to {} m", ["x", "y", "z"][k], label(lo[k], digits), label(hi[k], digits))
    };
    format!("Shown: {}, {}, {}.", axis(0), axis(1), axis(2))
}

/// A gray: dark where near, pale where far; `lighter` (0 to 1) makes it lighter.
fn shade(lighter: f64, nearness: f64) -> String {
    let darkest = 60.0 + 120.0 * lighter;
    let value = (darkest + (215.0 - darkest) * (1.0 - nearness)).round() as u8;
    format!("#{value:02X}{value:02X}{value:02X}")
}

/// The faces of a box that look toward the eye, each counter-clockwise or clockwise around.
fn faces(corners: &[[f64; 3]], axes: &[[f64; 3]; 3]) -> Vec<[[f64; 3]; 4]> {
    let facing = (0..3).map(|k| (k, dot(axes[k], TO_EYE))).filter(|(_, turn)| *turn != 0.0);
    let face = |(k, turn): (usize, f64)| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let side = usize::from(turn > 0.0) << k;
        [0, 1 << i, 1 << i | 1 << j, 1 << j].map(|bits: usize| corners[side | bits])
    };
    facing.map(face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::Strand;

    #[test]
    fn the_directions_are_perpendicular_and_one_long() {
        for (a, b, expected) in [
            (RIGHT, RIGHT, 1.0),
            (UP, UP, 1.0),
            (TO_EYE, TO_EYE, 1.0),
            (RIGHT, UP, 0.0),
            (UP, TO_EYE, 0.0),
            (TO_EYE, RIGHT, 0.0),
        ] {
            assert!((dot(a, b) - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn what_is_shown_fills_the_room_and_stays_inside() {
        let style = Style::MAP;
        let box_m = [[-3.0, 1.0, 0.0], [5.0, 2.0, 4.0]];
        let view = View::new(box_m, &style, 40.0);
        for (x, y) in corners(box_m).map(|p| view.at(p)) {
            assert!((EDGE_PX..=style.width_px - EDGE_PX).contains(&x), "{x}");
            assert!((40.0..=view.bottom_px).contains(&y), "{y}");
        }
    }

    #[test]
    fn near_things_are_drawn_over_far_ones() {
        // From near to far; the view looks along -TO_EYE.
        let points: Vec<_> = (0..4).map(|k| TO_EYE.map(|x| x * -f64::from(k))).collect();
        let strand = |at: [f64; 3]| Strand {
            points: vec![at],
            connector_radius_m: 1.0,
            rod_radius_m: 0.5,
            label: String::new(),
        };
        let strands = points.iter().map(|&p| strand(p)).collect();
        let scene = BodyScene { strands, ..BodyScene::default() };
        let svg = scene.to_svg(&Style::MAP).unwrap();
        let place = |color: usize| {
            svg.find(&format!(r#"fill="{}"/>"#, series_color(color))).expect("a connector")
        };
        assert!((0..3).all(|color| place(color) > place(color + 1)), "{svg}");
    }

    #[test]
    fn a_box_shows_the_faces_before_its_middle() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let shape = Shape::Cuboid { center: [0.0; 3], axes, half_m: [1.0, 2.0, 3.0] };
        let faces = faces(&shape.corners(), &axes);
        assert_eq!(faces.len(), 3);
        for face in faces {
            let middle = std::array::from_fn(|k| face.iter().map(|p| 0.25 * p[k]).sum());
            assert!(dot(middle, TO_EYE) > 0.0, "{middle:?}");
        }
    }
}
