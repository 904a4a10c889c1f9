//! Aircraft in a plan: symbols that point along their heading, velocity vectors, and zones.

use super::Plan;
use super::units::ground_speed_m_s;
use crate::picture::AgentEmphasis;
use crate::picture::canvas::Px;
use crate::picture::palette::pale;
use crate::style::hex;
use crate::svg::{Svg, SvgNumber};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::{
    ALERT_COLOR, Body, BodyCondition, BodyRole, Color, Frame, Shape, body_color,
};

/// Length of a symbol from tip to tail: the same at all scales, because a true length would vanish.
pub(super) const SYMBOL_PX: f64 = 11.0;
/// Least radius of a zone that is drawn around an aircraft with sufficient separation; smaller ones hide the symbol.
const MIN_ZONE_PX: f64 = 5.0;
/// Times that velocity vectors may reach ahead, in seconds.
const LOOKAHEADS_S: [f64; 11] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0];
/// Largest length of a velocity vector, as a fraction of the plan's longer side.
const MAX_VECTOR_FRACTION: f64 = 0.09;

/// Returns the aircraft of a frame.
pub(super) fn aircraft(frame: &Frame) -> impl Iterator<Item = &Body> {
    frame.bodies.iter().filter(|body| matches!(body.kind.role(), BodyRole::Agent(_)))
}

pub(super) fn is_in_conflict(body: &Body) -> bool {
    matches!(body.state, BodyCondition::Touching | BodyCondition::Failed)
}

impl Plan<'_> {
    /// Returns the color of an aircraft or its zone: pale where others were chosen.
    pub(super) fn color_of(&self, body: &Body) -> Color {
        let own = if is_in_conflict(body) { ALERT_COLOR } else { body_color(body.number) };
        if self.is_context(body) { pale(own) } else { own }
    }

    /// Returns whether an aircraft is not among those that were chosen.
    pub(super) fn is_context(&self, body: &Body) -> bool {
        self.scene.emphasis(body.number) == AgentEmphasis::Context
    }
}

/// Returns the longest round time for which velocity vectors stay short, for a plan of this extent; `None` where
/// nothing moves.
pub(super) fn lookahead_s(frame: &Frame, extent_m: f64) -> Option<f64> {
    let speeds_m_s = aircraft(frame).map(|body| ground_speed_m_s(body.velocity_m_s));
    let fastest_m_s = speeds_m_s.fold(0.0, f64::max);
    if fastest_m_s <= 0.0 {
        return None;
    }
    let max_s = MAX_VECTOR_FRACTION * extent_m / fastest_m_s;
    let short = LOOKAHEADS_S.into_iter().rev().find(|time_s| *time_s <= max_s);
    Some(short.unwrap_or(LOOKAHEADS_S[0]))
}

/// Draws the zones of all aircraft: thin circles, filled with red where separation is lost.
pub(super) fn draw_zones(svg: &mut Svg, plan: &Plan<'_>) {
    let canvas = &plan.window.canvas;
    for zone in &plan.scene.frame.bodies {
        let BodyRole::AroundAgent(_) = zone.kind.role() else { continue };
        let Some(radius_m) = flat_radius_m(zone) else { continue };
        let radius_px = radius_m * canvas.px_per_m;
        let center = canvas.px(zone.pose.at_m);
        let color = hex(plan.color_of(zone));
        if is_in_conflict(zone) {
            let fill = format!(r#"class="zone-lost" fill="{color}" fill-opacity="0.22""#);
            let rim = format!(r#"stroke="{color}" stroke-width="1.4""#);
            svg.circle(center, radius_px.max(MIN_ZONE_PX), format_args!("{fill} {rim}"));
        } else if radius_px >= MIN_ZONE_PX {
            let rim = format!(r#"stroke="{color}" stroke-width="0.8" stroke-opacity="0.55""#);
            svg.circle(center, radius_px, format_args!(r#"class="zone" fill="none" {rim}"#));
        }
    }
}

fn flat_radius_m(body: &Body) -> Option<f64> {
    match body.shape {
        Shape::Cylinder { radius_m, .. } | Shape::Sphere { radius_m } => Some(radius_m),
        _ => None,
    }
}

/// Draws the velocity vectors and the symbols of all aircraft, those in conflict last.
pub(super) fn draw_symbols(svg: &mut Svg, plan: &Plan<'_>) {
    let mut bodies: Vec<&Body> = aircraft(plan.scene.frame).collect();
    bodies.sort_by_key(|body| is_in_conflict(body));
    for body in &bodies {
        if let Some((from, to)) = vector_px(plan, body) {
            let color = hex(plan.color_of(body));
            svg.line(
                from,
                to,
                format_args!(r#"class="vector" stroke="{color}" stroke-width="1.6""#),
            );
        }
    }
    for body in bodies {
        let at = plan.window.canvas.px(body.pose.at_m);
        let [dx, dy, _] = body.pose.rotate([1.0, 0.0, 0.0]);
        symbol(svg, at, (dx, -dy), &hex(plan.color_of(body)));
    }
}

/// Returns the ends of a body's velocity vector; `None` if it is too short to be seen beside the symbol.
pub(super) fn vector_px(plan: &Plan<'_>, body: &Body) -> Option<(Px, Px)> {
    let lookahead_s = plan.lookahead_s?;
    let [east_m_s, north_m_s, _] = body.velocity_m_s;
    let px_per_m_s = lookahead_s * plan.window.canvas.px_per_m;
    let (x, y) = plan.window.canvas.px(body.pose.at_m);
    let end = (x + east_m_s * px_per_m_s, y - north_m_s * px_per_m_s);
    let length_px = hypot(end.0 - x, end.1 - y);
    (length_px > 0.5 * SYMBOL_PX).then_some(((x, y), end))
}

/// Draws an arrowhead around a point, which points along a direction in pixels.
pub(super) fn symbol(svg: &mut Svg, (x, y): Px, (dx, dy): Px, color: &str) {
    let length = hypot(dx, dy);
    // Without a direction it points up.
    let (ux, uy) = if length > 0.0 { (dx / length, dy / length) } else { (0.0, -1.0) };
    let half_px = 0.5 * SYMBOL_PX;
    // Tip, wing, notch and wing: along the heading, and across it.
    let corners = [(1.0, 0.0), (-1.0, 0.72), (-0.55, 0.0), (-1.0, -0.72)];
    let mut data = String::new();
    for (k, (along, across)) in corners.into_iter().enumerate() {
        let px = SvgNumber(x + half_px * (along * ux - across * uy));
        let py = SvgNumber(y + half_px * (along * uy + across * ux));
        data += &format!("{}{px} {py}", if k == 0 { 'M' } else { 'L' });
    }
    let rim = r##"stroke="#FFFFFF" stroke-width="0.7""##;
    svg.path(&format!("{data}Z"), format_args!(r#"class="aircraft" fill="{color}" {rim}"#));
}
