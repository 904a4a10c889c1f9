//! Filed routes as thin lines with their way-points, and the ends of trails.

use super::Plan;
use super::aircraft::aircraft;
use crate::legend::{end_mark, start_mark};
use crate::picture::labels::draw_direction;
use crate::style::hex;
use crate::svg::{Rect, Svg, SvgNumber};
use sidestep_kernel::view::{BodyId, Route, body_color};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Largest number of routes in a picture: with more, no single one can be followed.
const MAX_ROUTES: usize = 40;
/// Half the width of a way-point.
const WAY_POINT_PX: f64 = 3.2;
/// Radius of the mark at the start of a trail, and of that at the end of one whose aircraft is gone.
const START_PX: f64 = 2.6;
const END_PX: f64 = 2.4;

/// Returns the routes of aircraft that are shown, if they can be told apart.
pub(super) fn shown_routes<'a>(plan: &Plan<'a>) -> Vec<&'a Route> {
    let here = aircraft(plan.scene.frame).filter(|body| !plan.is_context(body));
    let here = here.map(|body| body.id());
    let shown: BTreeSet<BodyId> =
        here.chain(plan.scene.trails.iter().map(|trail| trail.of)).collect();
    let routes = plan.traffic.routes.iter().filter(|route| shown.contains(&route.agent));
    let routes: Vec<&Route> = routes.collect();
    if routes.len() > MAX_ROUTES { Vec::new() } else { routes }
}

/// Draws the routes: thin dashed lines, with a triangle at each way-point.
pub(super) fn draw(svg: &mut Svg, plan: &Plan<'_>) {
    for route in shown_routes(plan) {
        let color = hex(body_color(route.agent.number));
        let points: Vec<_> = route.points_m.iter().map(|&at| plan.window.canvas.px(at)).collect();
        let mut line = String::new();
        let mut marks = String::new();
        for (k, &(x, y)) in points.iter().enumerate() {
            // Writing into a String cannot fail.
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(line, "{command}{} {}", SvgNumber(x), SvgNumber(y));
            if k > 0 {
                let [left, right] = [-1.0, 1.0].map(|side| SvgNumber(x + side * WAY_POINT_PX));
                let top = SvgNumber(y - 1.1 * WAY_POINT_PX);
                let base = SvgNumber(y + 0.7 * WAY_POINT_PX);
                let _ = write!(marks, "M{left} {base}L{} {top}L{right} {base}Z", SvgNumber(x));
            }
        }
        let thin = format!(r#"fill="none" stroke="{color}" stroke-opacity="0.35""#);
        svg.path(
            &line,
            format_args!(r#"class="route" {thin} stroke-width="0.8" stroke-dasharray="5 4""#),
        );
        let rim = format!(r##"fill="#FFFFFF" stroke="{color}" stroke-opacity="0.6""##);
        svg.path(&marks, format_args!(r#"class="way-point" {rim} stroke-width="0.9""#));
    }
}

/// Marks where trails begin, and where those of aircraft end that are gone; returns the places of the latter.
pub(super) fn draw_trail_ends(svg: &mut Svg, plan: &Plan<'_>) -> Vec<Rect> {
    let present: BTreeSet<BodyId> = aircraft(plan.scene.frame).map(|body| body.id()).collect();
    let mut taken = Vec::new();
    for trail in &plan.scene.trails {
        let Some((&(_, first), &(_, last))) = trail.points.first().zip(trail.points.last()) else {
            continue;
        };
        let color = hex(trail.color);
        start_mark(svg, plan.window.canvas.px(first), START_PX, &color);
        if !present.contains(&trail.of) {
            let (x, y) = plan.window.canvas.px(last);
            // No symbol shows where it went.
            draw_direction(svg, trail, &plan.window.canvas, &color);
            end_mark(svg, (x, y), END_PX, &color);
            let side_px = 2.0 * END_PX;
            taken.push(Rect { x: x - END_PX, y: y - END_PX, width: side_px, height: side_px });
        }
    }
    taken
}
