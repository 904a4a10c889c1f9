//! Bodies: everything that has a shape.

use std::fmt::Write as _;

use super::canvas::{Canvas, Px, corners};
use super::palette::pale;
use super::surroundings::AgentProjections;
use super::{AgentEmphasis, Scene};
use crate::legend::{leader_mark, target_mark};
use crate::style::{INK, hex};
use crate::svg::{Anchor, Svg, SvgNumber, TextStyle};
use sidestep_kernel::geometry::dot;
use sidestep_kernel::view::{
    Body, BodyCondition, BodyKind, BodyRole, Color, Outline, Paint, Pose, Scenery, Shape, Vec3,
    WALL_COLOR,
};

/// Least width of a line, because thinner ones would vanish.
const MIN_LINE_PX: f64 = 1.4;
/// Least radius of a body, because smaller ones would vanish.
const MIN_RADIUS_PX: f64 = 1.2;
/// Least length of an arrowhead, because its direction would not be visible in a shorter one.
const MIN_DART_PX: f64 = 9.0;
/// Least radius of a leader's mark, from above and in space.
const MIN_LEADER_PX: [f64; 2] = [3.0, 5.0];
/// Least radius of a goal.
const MIN_GOAL_PX: f64 = 3.5;
/// Length of a target's cross beyond its ring, and the size of its number.
const TARGET_PX: f64 = 3.0;
const TARGET_LETTERS_PX: f64 = 11.0;
/// Most targets with numbers: with more there is no room.
const MAX_NUMBERED_TARGETS: usize = 12;
/// Width of the seam around the parts of agents in space, and the least thickness of parts that have one: those that
/// lie over each other would be one blot without it.
const SEAM_PX: f64 = 1.0;
const MIN_SEAMED_PX: f64 = 8.0;
/// Number of balls in space above which those of one size and about one depth are one path, without rims.
const MAX_SEPARATE_BALLS: usize = 400;
/// Shades of such balls: with one path for each, their number decides the bytes.
const SHADES: f64 = 16.0;
/// The light on a ball: discs, by their distance aside and their radius in radii of the ball.
const LIGHTS: [[f64; 2]; 3] = [[0.16, 0.72], [0.25, 0.46], [0.33, 0.2]];
/// Round, because the segments of a line are drawn one by one in space and must join without a notch.
const LINE_ATTRIBUTES: &str = r#"fill="none" stroke-linecap="round" stroke-linejoin="round""#;
/// Duration of the movement that a body's arrow shows, in seconds.
const ARROW_TIME_S: f64 = 1.0;
/// Corners of a circle that is seen from the side.
const CORNERS: usize = 32;
/// Color of agents without a trail, if others have one and agents have colors of their own.
const UNTRACED_COLOR: Color = [0x22, 0x22, 0x22];
/// Gray level toward which distant things in space fade.
const FAR_GRAY: f64 = 215.0;

/// Draws static walls without thickness, seen from above, as one path.
pub(super) fn draw_walls(svg: &mut Svg, scenery: &Scenery, canvas: &Canvas) {
    let mut data = String::new();
    for body in scenery.bodies.iter().filter(|body| is_wall(body)) {
        if let Shape::Line { points_m, .. } = &body.shape {
            data += &path_data(points_m.iter().map(|&p| canvas.px(p)));
        }
    }
    if !data.is_empty() {
        let (wall, attributes) =
            (hex(WALL_COLOR), r#"fill="none" stroke-width="1.5" stroke-linecap="round""#);
        svg.path(&data, format_args!(r#"class="walls" stroke="{wall}" {attributes}"#));
    }
}

fn is_wall(body: &Body) -> bool {
    let is_thin = matches!(body.shape, Shape::Line { thickness_m: 0.0, .. });
    body.kind == BodyKind::OBSTACLE && is_thin && !body.is_moving()
}

/// Draws bodies seen from above, those of lower layers first.
pub(super) fn draw_layers(
    svg: &mut Svg,
    scene: &Scene<'_>,
    canvas: &Canvas,
    bodies: &[Body],
    layers: std::ops::RangeInclusive<u8>,
) {
    let mut shown: Vec<(u8, &Body)> = bodies
        .iter()
        .map(|body| (body.appearance(scene.scenery.dimensions).layer, body))
        .filter(|(layer, body)| layers.contains(layer) && !is_wall(body))
        .collect();
    // The sort is stable: in a layer, the body that comes first is drawn first.
    shown.sort_by_key(|(layer, _)| *layer);
    shown.into_iter().for_each(|(_, body)| draw_body(svg, scene, canvas, body));
}

/// A body in space, or one segment of a line with many points.
struct DepthItem<'a> {
    depth_m: f64,
    body: &'a Body,
    /// The first point of the segment.
    from: Option<usize>,
}

/// Draws bodies in space, far ones first; a line with many points is drawn part by part.
pub(super) fn draw_by_depth(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas) {
    let mut parts: Vec<DepthItem<'_>> = Vec::new();
    for body in scene.visible() {
        match &body.shape {
            Shape::Line { points_m, .. } => {
                for (k, pair) in points_m.windows(2).enumerate() {
                    let depth_m = 0.5 * (depth(canvas, pair[0]) + depth(canvas, pair[1]));
                    parts.push(DepthItem { depth_m, body, from: Some(k) });
                }
            }
            _ => parts.push(DepthItem { depth_m: depth(canvas, body.pose.at_m), body, from: None }),
        }
    }
    // The sort is stable: of bodies at the same depth, the one that comes first is drawn first.
    parts.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    let balls = scene.surroundings.balls();
    let are_many = balls.len() > MAX_SEPARATE_BALLS;
    let agents = AgentProjections::new(scene.frame, canvas);
    svg.push_raw(format_args!(r#"<g class="parts" {LINE_ATTRIBUTES}>"#));
    for alike in parts.chunk_by(|a, b| are_many && are_like_balls(canvas, a.body, b.body)) {
        match alike {
            [first, ..] if are_many && is_ball(first.body) => draw_dots(svg, canvas, alike),
            [first, ..] if is_ball(first.body) => {
                let hides = agents.are_behind(first.body, canvas);
                draw_ball(svg, canvas, first.body, hides);
            }
            _ => alike.iter().for_each(|part| draw_part(svg, scene, canvas, part)),
        }
    }
    svg.close_group();
}

fn draw_part(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas, part: &DepthItem<'_>) {
    match (&part.body.shape, part.from) {
        (Shape::Line { points_m, .. }, Some(k)) => {
            draw_line(svg, scene, canvas, part.body, &points_m[k..k + 2]);
        }
        _ => draw_body(svg, scene, canvas, part.body),
    }
}

/// Returns whether a body is an obstacle of which there may be thousands.
fn is_ball(body: &Body) -> bool {
    body.kind == BodyKind::OBSTACLE && matches!(body.shape, Shape::Sphere { .. })
}

/// Returns the color of a ball: paler with distance, in few shades.
fn ball_color(canvas: &Canvas, body: &Body) -> Color {
    let shade = (canvas.nearness(body.pose.at_m) * SHADES).round() / SHADES;
    paler(body.appearance(3).color, shade)
}

/// Draws a ball with light on it; one that hides an agent lets it show through.
fn draw_ball(svg: &mut Svg, canvas: &Canvas, body: &Body, hides: bool) {
    let Shape::Sphere { radius_m } = body.shape else { return };
    let color = ball_color(canvas, body);
    let rim = format!(r#"stroke="{}""#, hex(darker(color)));
    let fill = hex(color);
    let (x, y) = canvas.px(body.pose.at_m);
    let radius_px = (radius_m * canvas.px_per_m).max(MIN_RADIUS_PX);
    if hides {
        let faint = r#"fill-opacity="0.08" stroke-opacity="0.5" stroke-width="0.7""#;
        return svg.circle(
            (x, y),
            radius_px,
            format_args!(r#"class="hides" fill="{fill}" {rim} {faint}"#),
        );
    }
    let thin = r#"stroke-opacity="0.6" stroke-width="0.6""#;
    svg.circle((x, y), radius_px, format_args!(r#"class="ball" fill="{fill}" {rim} {thin}"#));
    // Discs rather than a gradient, which PDF files of ours do not have.
    for [aside, size] in LIGHTS {
        let center = (x - aside * radius_px, y - aside * radius_px);
        svg.circle(center, size * radius_px, r##"fill="#FFFFFF" fill-opacity="0.22""##);
    }
}

/// Returns the attributes of a ball among many.
fn dot_attributes(canvas: &Canvas, body: &Body) -> String {
    let radius_m = if let Shape::Sphere { radius_m } = body.shape { radius_m } else { 0.0 };
    let appearance = body.appearance(3);
    let color = hex(ball_color(canvas, body));
    let opacity = appearance.opacity;
    let width = SvgNumber(2.0 * (radius_m * canvas.px_per_m).max(MIN_RADIUS_PX));
    format!(r#"stroke="{color}" stroke-opacity="{opacity}" stroke-width="{width}""#)
}

/// Draws balls with the same attributes as one path: thousands of circles would be most of a picture's bytes.
fn draw_dots(svg: &mut Svg, canvas: &Canvas, balls: &[DepthItem<'_>]) {
    let mut data = String::new();
    for ball in balls {
        let (x, y) = canvas.px(ball.body.pose.at_m);
        // A stroke of no length is not drawn. Writing into a String cannot fail.
        let _ = write!(
            data,
            "M{} {}h.01",
            SvgNumber((x * 10.0).round() / 10.0),
            SvgNumber((y * 10.0).round() / 10.0)
        );
    }
    svg.path(&data, dot_attributes(canvas, balls[0].body));
}

fn depth(canvas: &Canvas, at: Vec3) -> f64 {
    canvas.camera.depth_m(at)
}

/// Returns the color of a body, paler with distance in space, and its opacity.
fn fill(scene: &Scene<'_>, canvas: &Canvas, body: &Body) -> (Color, f64) {
    let appearance = body.appearance(scene.scenery.dimensions);
    let is_plain = matches!(body.state, BodyCondition::Plain | BodyCondition::Leading);
    if is_plain && let Some(color) = agent_color(scene, body) {
        return (color, appearance.opacity);
    }
    if body.kind == BodyKind::OBSTACLE && !canvas.is_above() {
        let color = paler(appearance.color, canvas.nearness(body.pose.at_m));
        return (color, appearance.opacity);
    }
    (appearance.color, appearance.opacity)
}

/// Returns the color of an agent in plain condition, or of what belongs to it; none for what has a color by its kind.
fn agent_color(scene: &Scene<'_>, body: &Body) -> Option<Color> {
    let own = match body.kind.spec().paint {
        Paint::ByNumber { .. } | Paint::Veil => scene.palette.color(body),
        _ => return None,
    };
    let color = match scene.emphasis(body.number) {
        AgentEmphasis::Full => own,
        AgentEmphasis::Context => pale(own),
        AgentEmphasis::Untraced if body.kind.is_of_agent() => UNTRACED_COLOR,
        AgentEmphasis::Untraced => own,
    };
    Some(color)
}

fn paler(color: Color, nearness: f64) -> Color {
    color.map(|byte| {
        (f64::from(byte) + (FAR_GRAY - f64::from(byte)) * (1.0 - nearness)).round() as u8
    })
}

fn darker(color: Color) -> Color {
    color.map(|byte| (0.66 * f64::from(byte)) as u8)
}

/// Returns the attributes of a line around a body.
fn outline_attributes(color: Color, width: f64) -> String {
    format!(r#"stroke="{}" stroke-width="{width}""#, hex(color))
}

/// Returns whether two bodies are balls that look the same.
fn are_like_balls(canvas: &Canvas, a: &Body, b: &Body) -> bool {
    is_ball(a) && is_ball(b) && dot_attributes(canvas, a) == dot_attributes(canvas, b)
}

fn rim(scene: &Scene<'_>, canvas: &Canvas, body: &Body, color: Color) -> String {
    let white = [0xFF; 3];
    match body.kind.spec().outline {
        Outline::Shade if body.state == BodyCondition::Open => {
            format!(r#"{} stroke-dasharray="3 2""#, outline_attributes(color, 1.0))
        }
        Outline::Shade => outline_attributes(darker(color), 1.0),
        Outline::ThinShade if canvas.is_above() => outline_attributes(darker(color), 0.8),
        Outline::ThinShade => {
            format!(r#"{} stroke-opacity="0.5""#, outline_attributes(darker(color), 0.6))
        }
        Outline::Pale => format!(r#"{} stroke-opacity="0.6""#, outline_attributes(color, 0.8)),
        Outline::Dashed => format!(r#"{} stroke-dasharray="5 3""#, outline_attributes(color, 1.0)),
        Outline::Dark if scene.emphasis(body.number) == AgentEmphasis::Context => {
            outline_attributes(darker(color), 0.5)
        }
        Outline::Dark => outline_attributes(UNTRACED_COLOR, 0.8),
        Outline::White => outline_attributes(white, 0.6),
        Outline::Seam if canvas.is_above() => outline_attributes(white, 0.6),
        Outline::Seam if is_seamed(canvas, body) => outline_attributes(white, SEAM_PX),
        Outline::Seam | Outline::None => String::new(),
    }
}

/// Returns whether a part of an agent in space is thick enough for a seam.
fn is_seamed(canvas: &Canvas, body: &Body) -> bool {
    let thickness_m = match body.shape {
        Shape::Sphere { radius_m } => 2.0 * radius_m,
        Shape::Line { thickness_m, .. } => thickness_m,
        _ => 0.0,
    };
    let is_part = matches!(body.kind.role(), BodyRole::PartOfBody | BodyRole::LineThroughParts(_));
    is_part && !canvas.is_above() && thickness_m * canvas.px_per_m >= MIN_SEAMED_PX
}

fn draw_body(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas, body: &Body) {
    let (color, opacity) = fill(scene, canvas, body);
    let hides = if opacity < 1.0 { format!(r#" fill-opacity="{opacity}""#) } else { String::new() };
    let attributes = format!(r#"fill="{}"{hides} {}"#, hex(color), rim(scene, canvas, body, color));
    match &body.shape {
        Shape::Line { points_m, .. } => draw_line(svg, scene, canvas, body, points_m),
        Shape::Cuboid { size_m } => {
            for face in faces(&body.pose, *size_m, canvas) {
                svg.path(&outline(face.map(|p| canvas.px(p))), &attributes);
            }
        }
        Shape::Cylinder { radius_m, .. } if !canvas.is_above() => {
            svg.path(&outline(circle(&body.pose, *radius_m).map(|p| canvas.px(p))), attributes);
        }
        Shape::Cylinder { radius_m, .. } | Shape::Sphere { radius_m } => {
            let least_px = if body.kind == BodyKind::GOAL { MIN_GOAL_PX } else { MIN_RADIUS_PX };
            let radius_px = (radius_m * canvas.px_per_m).max(least_px);
            svg.circle(canvas.px(body.pose.at_m), radius_px, attributes);
        }
        Shape::Dart { length_m, width_m } => {
            let grown = (MIN_DART_PX / (length_m * canvas.px_per_m)).max(1.0);
            let corners = dart(&body.pose, length_m * grown, width_m * grown);
            svg.path(&outline(corners.map(|p| canvas.px(p))), attributes);
        }
    }
    draw_heading(svg, canvas, body);
}

/// Draws a line with its thickness, round at its ends.
fn draw_line(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas, body: &Body, points_m: &[Vec3]) {
    let Shape::Line { thickness_m, .. } = body.shape else { return };
    let (color, opacity) = fill(scene, canvas, body);
    let width_px = (thickness_m * canvas.px_per_m).max(MIN_LINE_PX);
    let width = SvgNumber(width_px);
    let hides = if opacity < 1.0 { r#" stroke-opacity="0.45""# } else { "" };
    let data = path_data(points_m.iter().map(|&p| canvas.px(p)));
    // In space the group around all parts sets the rest.
    let ends = if canvas.is_above() { format!(" {LINE_ATTRIBUTES}") } else { String::new() };
    if is_seamed(canvas, body) {
        let around = SvgNumber(width_px + 2.0 * SEAM_PX);
        svg.path(&data, format_args!(r##"stroke="#FFFFFF" stroke-width="{around}""##));
    }
    let attributes = format!(r#"stroke="{}" stroke-width="{width}"{hides}{ends}"#, hex(color));
    svg.path(&data, attributes);
}

/// Draws an arrowhead on a body whose kind shows its heading.
fn draw_heading(svg: &mut Svg, canvas: &Canvas, body: &Body) {
    let (side_m, top_m) = match body.shape {
        Shape::Cuboid { size_m: [x, y, z] } => (x.min(y), 0.5 * z),
        Shape::Cylinder { radius_m, height_m } => (1.6 * radius_m, 0.5 * height_m),
        _ => return,
    };
    if body.kind.spec().shows_heading {
        let size_m = 0.34 * side_m;
        let corners =
            [[size_m, 0.0], [-0.7 * size_m, 0.6 * size_m], [-0.7 * size_m, -0.6 * size_m]];
        let corners = corners.map(|[x, y]| canvas.px(body.pose.transform_point([x, y, top_m])));
        svg.path(&outline(corners), r##"fill="#FFFFFF""##);
    }
}

/// Draws marks over everything: the targets of moving things, and the leaders.
pub(super) fn draw_marks(svg: &mut Svg, scene: &Scene<'_>, canvas: &Canvas) {
    let bodies = scene.visible();
    let bodies = bodies.iter().copied();
    for body in bodies.clone().filter(|body| body.kind == BodyKind::OBSTACLE && body.is_moving()) {
        let from = middle(body);
        let to = std::array::from_fn(|k| from[k] + ARROW_TIME_S * body.velocity_m_s[k]);
        arrow(svg, canvas.px(from), canvas.px(to));
    }
    let goals: Vec<&Body> = bodies.clone().filter(|body| is_target(body)).collect();
    let are_few = goals.len() <= MAX_NUMBERED_TARGETS;
    for goal in goals {
        draw_target(svg, scene, canvas, goal, goal.part.filter(|_| are_few).map(|part| part + 1));
    }
    for body in bodies.filter(|body| is_leader(body)) {
        if let Shape::Sphere { radius_m } = body.shape {
            let least_px = MIN_LEADER_PX[usize::from(!canvas.is_above())];
            let radius_px = (0.7 * radius_m * canvas.px_per_m).max(least_px);
            let (color, _) = fill(scene, canvas, body);
            leader_mark(svg, canvas.px(body.pose.at_m), radius_px, &hex(color));
        }
    }
}

/// Returns whether a goal is one of the targets of a part, which are drawn with a cross.
pub(super) fn is_target(body: &Body) -> bool {
    body.kind == BodyKind::GOAL && body.part.is_some()
}

pub(super) fn is_leader(body: &Body) -> bool {
    body.state == BodyCondition::Leading
}

/// Draws a target over everything that hides it: a ring with a cross, and its number if there are few.
fn draw_target(
    svg: &mut Svg,
    scene: &Scene<'_>,
    canvas: &Canvas,
    goal: &Body,
    number: Option<u32>,
) {
    let Shape::Sphere { radius_m } = goal.shape else { return };
    let (x, y) = canvas.px(goal.pose.at_m);
    let radius_px = (radius_m * canvas.px_per_m).max(MIN_GOAL_PX);
    let reach = radius_px + TARGET_PX;
    target_mark(svg, (x, y), [radius_px, reach], &hex(darker(scene.palette.color(goal))));
    if let Some(number) = number {
        let words = TextStyle { halo: true, ..TextStyle::new(TARGET_LETTERS_PX, Anchor::Start) };
        svg.text(x + reach, y - radius_px, &number.to_string(), &words);
    }
}

/// Returns the middle of a body, wherever its pose is.
fn middle(body: &Body) -> Vec3 {
    match &body.shape {
        Shape::Line { points_m, .. } => {
            let n = points_m.len().max(1) as f64;
            std::array::from_fn(|k| points_m.iter().map(|p| p[k]).sum::<f64>() / n)
        }
        _ => body.pose.at_m,
    }
}

/// Returns the faces of a box that face the viewer.
fn faces(pose: &Pose, size_m: Vec3, canvas: &Canvas) -> Vec<[Vec3; 4]> {
    let half = size_m.map(|side_m| 0.5 * side_m);
    let corners = corners([half.map(|m| -m), half]).map(|corner| pose.transform_point(corner));
    let mut faces = Vec::new();
    for k in 0..3 {
        let mut axis = [0.0; 3];
        axis[k] = 1.0;
        let toward_eye = dot(pose.rotate(axis), canvas.camera.to_eye);
        // A face that is seen edge-on has no extent.
        if toward_eye.abs() <= 1e-9 {
            continue;
        }
        let i = (k + 1) % 3;
        let j = (k + 2) % 3;
        // Bit k of a corner's number says on which side of the box it is along axis k.
        let side = usize::from(toward_eye > 0.0) << k;
        faces.push([0, 1 << i, 1 << i | 1 << j, 1 << j].map(|bits: usize| corners[side | bits]));
    }
    faces
}

/// Returns a circle that lies flat, as a polygon, because in space it is seen as an ellipse.
fn circle(pose: &Pose, radius_m: f64) -> [Vec3; CORNERS] {
    std::array::from_fn(|k| {
        let angle = k as f64 * std::f64::consts::TAU / CORNERS as f64;
        pose.transform_point([radius_m * libm::cos(angle), radius_m * libm::sin(angle), 0.0])
    })
}

/// Returns an arrowhead with its middle at the pose, notched at the back by a quarter of its length.
fn dart(pose: &Pose, length_m: f64, width_m: f64) -> [Vec3; 4] {
    let half_m = 0.5 * length_m;
    let wing_m = 0.5 * width_m;
    let corners = [[half_m, 0.0], [-half_m, wing_m], [-0.5 * half_m, 0.0], [-half_m, -wing_m]];
    corners.map(|[x, y]| pose.transform_point([x, y, 0.0]))
}

/// Draws an arrow, unless it is shorter than its head.
fn arrow(svg: &mut Svg, from: Px, to: Px) {
    const HEAD_PX: f64 = 6.0;
    let dx = to.0 - from.0;
    let dy = to.1 - from.1;
    let length = (dx * dx + dy * dy).sqrt();
    if length <= HEAD_PX {
        return;
    }
    let ux = HEAD_PX * dx / length;
    let uy = HEAD_PX * dy / length;
    let neck = (to.0 - ux, to.1 - uy);
    svg.line(from, neck, format_args!(r#"class="arrow" stroke="{INK}" stroke-width="1.3""#));
    let wings =
        [(neck.0 - 0.5 * uy, neck.1 + 0.5 * ux), to, (neck.0 + 0.5 * uy, neck.1 - 0.5 * ux)];
    svg.path(&outline(wings), format_args!(r#"fill="{INK}""#));
}

fn outline(points: impl IntoIterator<Item = Px>) -> String {
    path_data(points) + "Z"
}

/// Returns path data of a line through points.
fn path_data(points: impl IntoIterator<Item = Px>) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.into_iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        // Writing into a String cannot fail.
        let _ = write!(data, "{command}{} {}", SvgNumber(x), SvgNumber(y));
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::canvas::Camera;
    use crate::svg::Rect;

    #[test]
    fn a_box_shows_the_faces_before_its_middle() {
        let map = Rect { x: 0.0, y: 0.0, width: 1.0, height: 1.0 };
        let above = Canvas::above([0.0; 2], 1.0, map);
        let corner = Canvas { camera: Camera::CORNER, ..above };
        let pose = Pose::from_position([0.0; 3]);
        assert_eq!(faces(&pose, [2.0, 4.0, 6.0], &above).len(), 1);
        let faces = faces(&pose, [2.0, 4.0, 6.0], &corner);
        assert_eq!(faces.len(), 3);
        for face in faces {
            let middle = std::array::from_fn(|k| face.iter().map(|p| 0.25 * p[k]).sum());
            assert!(dot(middle, corner.camera.to_eye) > 0.0, "{middle:?}");
        }
    }
}
