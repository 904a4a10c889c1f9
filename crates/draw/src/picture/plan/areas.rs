//! Areas in a plan: filled and hatched, with their limits in words.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::Plan;
use crate::picture::Scene;
use crate::picture::canvas::Px;
use crate::picture::map_legend::display_name;
use crate::svg::{Anchor, Rect, Svg, SvgNumber, TextStyle};
use crate::text::{self, Weight};
use sidestep_kernel::view::{AreaLevels, Body, Shape, TrafficPlan, Vec3};

/// Color of areas: none of the colors of aircraft, and not that of conflicts.
pub(super) const AREA_COLOR: &str = "#6A5ACD";
/// Attributes of the lines around areas, of those to stay out of and of those to stay inside of.
pub(super) const BORDERS: [&str; 2] = [
    r##"stroke="#6A5ACD" stroke-width="1.3""##,
    r##"stroke="#6A5ACD" stroke-width="1.6" stroke-dasharray="8 4""##,
];
/// The pattern of hatches, in pixels.
const HATCH: &str = concat!(
    r#"<pattern id="area-hatch" width="7" height="7" patternUnits="userSpaceOnUse" "#,
    r##"patternTransform="rotate(45)"><line x1="0" y1="0" x2="0" y2="7" stroke="#6A5ACD" "##,
    r#"stroke-width="1" stroke-opacity="0.5"/></pattern>"#
);

/// An area, with its borders at this moment.
pub(super) struct DrawnArea<'a> {
    pub(super) levels: &'a AreaLevels,
    /// Its closed borders, on one level.
    pub(super) rings_m: Vec<&'a [Vec3]>,
    pub(super) name: String,
}

/// Returns the areas that are there now, by number.
pub(super) fn areas<'a>(scene: &Scene<'a>, traffic: &'a TrafficPlan) -> Vec<DrawnArea<'a>> {
    let bodies = scene.scenery.bodies.iter().chain(&scene.frame.bodies);
    let mut borders: BTreeMap<u32, Vec<&Body>> = BTreeMap::new();
    let levels = &traffic.areas;
    for body in bodies {
        let is_area =
            |area: &&AreaLevels| area.area.kind == body.kind && area.area.number == body.number;
        if levels.iter().any(|area| is_area(&area)) {
            borders.entry(body.number).or_default().push(body);
        }
    }
    let mut drawn = Vec::new();
    for area in levels {
        let Some(lines) = borders.get(&area.area.number) else { continue };
        let rings_m = rings_on_one_level(lines);
        if !rings_m.is_empty() {
            drawn.push(DrawnArea {
                levels: area,
                rings_m,
                name: display_name(scene, area.area.kind, area.area.number),
            });
        }
    }
    drawn
}

/// Returns the borders on the level of the first one: others are the same, seen from above.
fn rings_on_one_level<'a>(lines: &[&'a Body]) -> Vec<&'a [Vec3]> {
    let mut rings: Vec<&[Vec3]> = Vec::new();
    for body in lines {
        let Shape::Line { points_m, .. } = &body.shape else { continue };
        if points_m.len() < 3 {
            continue;
        }
        if rings.first().is_none_or(|first| first[0][2] == points_m[0][2]) {
            rings.push(points_m);
        }
    }
    rings
}

/// Draws the areas of a plan.
pub(super) fn draw(svg: &mut Svg, plan: &Plan<'_>, areas: &[DrawnArea<'_>]) {
    if areas.iter().any(|area| !area.levels.is_fence) {
        svg.push_raw(HATCH);
    }
    for area in areas {
        let mut data = String::new();
        for ring in &area.rings_m {
            for (k, &at_m) in ring.iter().enumerate() {
                let (x, y) = plan.window.canvas.px(at_m);
                let command = if k == 0 { 'M' } else { 'L' };
                // Writing into a String cannot fail.
                let _ = write!(data, "{command}{} {}", SvgNumber(x), SvgNumber(y));
            }
            data.push('Z');
        }
        let border = BORDERS[usize::from(area.levels.is_fence)];
        if area.levels.is_fence {
            svg.path(&data, format_args!(r#"class="area" fill="none" {border}"#));
            continue;
        }
        let fill = format!(r#"fill="{AREA_COLOR}" fill-opacity="0.1" fill-rule="evenodd""#);
        svg.path(&data, format_args!(r#"class="area" {fill} {border}"#));
        svg.path(&data, r#"fill="url(#area-hatch)" fill-rule="evenodd""#);
    }
}

/// Writes the name and the limits of each area into its middle; returns the rectangles of the texts.
pub(super) fn draw_labels(svg: &mut Svg, plan: &Plan<'_>, areas: &[DrawnArea<'_>]) -> Vec<Rect> {
    let size_px = plan.style.small_px();
    let mut taken: Vec<Rect> = Vec::new();
    for area in areas {
        let [(left, top), (right, bottom)] = bounds_px(plan, area);
        // In the middle of a fence is what it encloses: its words stand below its upper edge.
        let middle_y =
            if area.levels.is_fence { top + 2.0 * size_px } else { 0.5 * (top + bottom) };
        let middle = (0.5 * (left + right), middle_y);
        let limits = plan.units.level_range(area.levels.low_m, area.levels.high_m);
        let lines = [area.name.as_str(), limits.as_str()];
        let widths = lines.map(|line| text::width(line, size_px, Weight::Bold));
        let width = widths[0].max(widths[1]);
        let height = 2.5 * size_px;
        // Inside of what is shown, though the middle of a large area may be outside.
        let map = plan.window.map;
        let x = clamp_inside(middle.0, map.x + 0.5 * width, map.right() - 0.5 * width);
        let y = clamp_inside(middle.1, map.y + 0.5 * height, map.bottom() - 0.5 * height);
        let rect = Rect { x: x - 0.5 * width, y: y - 0.5 * height, width, height };
        for (row, line) in lines.into_iter().enumerate() {
            let weight = if row == 0 { Weight::Bold } else { Weight::Regular };
            let style = TextStyle {
                weight,
                fill: AREA_COLOR,
                halo: true,
                ..TextStyle::new(size_px, Anchor::Middle)
            };
            let baseline = rect.y + (row as f64 + 0.85) * 1.2 * size_px;
            svg.text(x, baseline, line, &style);
        }
        taken.push(rect);
    }
    taken
}

/// Returns the nearest place between two; the low one if words are larger than the map, and the two change places.
fn clamp_inside(place: f64, low: f64, high: f64) -> f64 {
    place.clamp(low, high.max(low))
}

/// Returns the least and the largest pixel of an area.
pub(super) fn bounds_px(plan: &Plan<'_>, area: &DrawnArea<'_>) -> [Px; 2] {
    let mut low = (f64::INFINITY, f64::INFINITY);
    let mut high = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for &at_m in area.rings_m.iter().copied().flatten() {
        let (x, y) = plan.window.canvas.px(at_m);
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    [low, high]
}
