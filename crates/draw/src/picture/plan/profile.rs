//! The vertical profile below a plan: altitudes over the same distances east, seen from the south.

use super::Plan;
use super::aircraft::{aircraft, is_in_conflict};
use super::areas::{AREA_COLOR, BORDERS, DrawnArea, bounds_px};
use crate::picture::canvas::{Camera, Canvas, Px};
use crate::picture::{Scene, trail_lines};
use crate::style::{FAINT_INK, GRID, INK, hex};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::ticks::{LabelSpacing, Ticks};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::{Body, BodyRole};

/// Least range of altitudes that has a profile, in meters: below it all fly on one level.
const MIN_RANGE_M: f64 = 30.0;
/// Margin above and below, as a fraction of the range.
const MARGIN_FRACTION: f64 = 0.12;
/// Radius of an aircraft.
const DOT_PX: f64 = 3.6;
/// Least height per label of the axis, in sizes of letters.
const LABEL_SPACING_LETTERS: f64 = 2.2;

/// The part of the picture with the profile.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProfileWindow {
    pub(super) area: Rect,
    /// Altitudes at the lower and the upper edge, in meters.
    pub(super) range_m: [f64; 2],
    canvas: Canvas,
}

/// Returns the altitudes that are shown, with a margin; `None` where all is on one level.
pub(super) fn altitude_range_m(scene: &Scene<'_>, areas: &[DrawnArea<'_>]) -> Option<[f64; 2]> {
    let flying = aircraft(scene.frame).map(|body| body.pose.at_m[2]);
    let trails = scene.trails.iter().flat_map(|trail| trail.points).map(|(_, at_m)| at_m[2]);
    let starts = scene.scenery.bodies.iter();
    let starts = starts.filter(|body| matches!(body.kind.role(), BodyRole::StartOf(_)));
    let starts = starts.map(|body| body.pose.at_m[2]);
    let [low_m, high_m] = range(flying.chain(trails).chain(starts));
    let is_single_level = high_m - low_m < MIN_RANGE_M;
    if scene.is_plane() || is_single_level {
        return None;
    }
    let limits = areas.iter().flat_map(|area| [area.levels.low_m, area.levels.high_m]);
    let [low_m, high_m] = range([low_m, high_m].into_iter().chain(limits.flatten()));
    let margin_m = MARGIN_FRACTION * (high_m - low_m);
    // Nothing is below the ground unless traffic is there.
    let floor_m = if low_m >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
    Some([(low_m - margin_m).max(floor_m), high_m + margin_m])
}

/// Returns the lowest and the highest of some altitudes.
fn range(altitudes_m: impl Iterator<Item = f64>) -> [f64; 2] {
    altitudes_m.fold([f64::INFINITY, f64::NEG_INFINITY], |[low_m, high_m], altitude_m| {
        [low_m.min(altitude_m), high_m.max(altitude_m)]
    })
}

impl ProfileWindow {
    /// Returns a profile on the scale of a plan's canvas from west to east.
    pub(super) fn new(area: Rect, range_m: [f64; 2], plan: &Canvas) -> Self {
        let exaggeration = area.height / ((range_m[1] - range_m[0]) * plan.px_per_m);
        let camera = Camera {
            right: [1.0, 0.0, 0.0],
            up: [0.0, 0.0, exaggeration],
            to_eye: [0.0, -1.0, 0.0],
        };
        let canvas = Canvas {
            camera,
            zero: (plan.zero.0, area.bottom()),
            origin_m: [plan.origin_m[0], exaggeration * range_m[0]],
            ..*plan
        };
        Self { area, range_m, canvas }
    }

    pub(super) fn y_px(&self, altitude_m: f64) -> f64 {
        let [low_m, high_m] = self.range_m;
        self.area.bottom() - (altitude_m - low_m) / (high_m - low_m) * self.area.height
    }

    /// Returns how many times longer a height is drawn than a distance.
    pub(super) fn exaggeration(&self) -> f64 {
        self.canvas.camera.up[2]
    }

    /// Draws the lines of round altitudes, with their labels inside of the profile.
    pub(super) fn draw_levels(&self, svg: &mut Svg, plan: &Plan<'_>) {
        let size_px = plan.style.small_px();
        let (_, unit_m) = plan.units.altitude();
        let text_style =
            TextStyle { fill: FAINT_INK, halo: true, ..TextStyle::new(size_px, Anchor::Start) };
        for (value, _) in &self.altitude_ticks(plan, 1.6 * size_px).major {
            let y = self.y_px(value * unit_m);
            svg.line((self.area.x, y), (self.area.right(), y), format_args!(r#"stroke="{GRID}""#));
            let words = plan.units.level(value * unit_m);
            svg.text(self.area.x + 4.0, y + text_style.middle_px(), &words, &text_style);
        }
    }

    /// Draws the axis, and its name at the left.
    pub(super) fn draw_axis(&self, svg: &mut Svg, plan: &Plan<'_>) {
        let size_px = plan.style.small_px();
        let ticks = self.altitude_ticks(plan, size_px);
        let text_style = TextStyle::new(size_px, Anchor::End);
        let mut spacing = LabelSpacing::new();
        let (unit, unit_m) = plan.units.altitude();
        for (value, label) in &ticks.major {
            let y = self.y_px(value * unit_m);
            svg.line((self.area.x, y), (self.area.right(), y), format_args!(r#"stroke="{GRID}""#));
            if spacing.try_place(-y, size_px) {
                let is_level = unit == "FL" && *value > 0.0;
                let words = if is_level { format!("FL{label:0>3}") } else { label.clone() };
                svg.text(self.area.x - 6.0, y + text_style.middle_px(), &words, &text_style);
            }
        }
        let name = if unit == "FL" { "level".to_string() } else { format!("altitude ({unit})") };
        let upward =
            TextStyle { upward: true, ..TextStyle::new(plan.style.font_px, Anchor::Middle) };
        let middle = self.area.y + 0.5 * self.area.height;
        svg.text(plan.name_x_px, middle, &name, &upward);
    }

    fn altitude_ticks(&self, plan: &Plan<'_>, size_px: f64) -> Ticks {
        let (_, unit_m) = plan.units.altitude();
        let [low_m, high_m] = self.range_m;
        let most = (self.area.height / (LABEL_SPACING_LETTERS * size_px)) as usize;
        Ticks::linear(low_m / unit_m, high_m / unit_m, most.clamp(1, 8))
    }

    /// Draws areas, trails and aircraft.
    pub(super) fn draw_content(&self, svg: &mut Svg, plan: &Plan<'_>, areas: &[DrawnArea<'_>]) {
        draw_bands(svg, plan, self, areas);
        for trail in &plan.scene.trails {
            trail_lines::draw(svg, trail, &self.canvas);
        }
        let mut bodies: Vec<&Body> = aircraft(plan.scene.frame).collect();
        bodies.sort_by_key(|body| is_in_conflict(body));
        for body in bodies {
            let at = self.canvas.px(body.pose.at_m);
            let ahead = self.ahead_px(plan, body);
            let color = hex(plan.color_of(body));
            let length_px = hypot(ahead.0, ahead.1);
            if length_px > DOT_PX {
                let to = (at.0 + ahead.0, at.1 + ahead.1);
                svg.line(at, to, format_args!(r#"stroke="{color}" stroke-width="1.4""#));
            }
            // A dot, because an aircraft that comes or goes has no heading from here.
            let rim = r##"stroke="#FFFFFF" stroke-width="0.7""##;
            svg.circle(at, DOT_PX, format_args!(r#"class="aircraft-level" fill="{color}" {rim}"#));
        }
    }

    /// Returns the movement during the lookahead time, in pixels.
    fn ahead_px(&self, plan: &Plan<'_>, body: &Body) -> Px {
        let ahead_s = plan.lookahead_s.unwrap_or(0.0);
        let [x, y, z] = body.pose.at_m;
        let [east, north, up] = body.velocity_m_s.map(|speed| speed * ahead_s);
        let from = self.canvas.px([x, y, z]);
        let to = self.canvas.px([x + east, y + north, z + up]);
        (to.0 - from.0, to.1 - from.1)
    }

    pub(super) fn draw_frame(&self, svg: &mut Svg) {
        svg.rect(self.area, format_args!(r#"class="profile" fill="none" stroke="{INK}""#));
    }
}

/// Draws the areas of a profile, as bands between their limits over their extent east.
fn draw_bands(svg: &mut Svg, plan: &Plan<'_>, profile: &ProfileWindow, areas: &[DrawnArea<'_>]) {
    let frame = profile.area;
    for area in areas {
        let [(left, _), (right, _)] = bounds_px(plan, area);
        let top = area.levels.high_m.map_or(frame.y, |high_m| profile.y_px(high_m).max(frame.y));
        let bottom = area
            .levels
            .low_m
            .map_or(frame.bottom(), |low_m| profile.y_px(low_m).min(frame.bottom()));
        let band = Rect { x: left, y: top, width: right - left, height: (bottom - top).max(0.0) };
        let border = BORDERS[usize::from(area.levels.is_fence)];
        let fill = if area.levels.is_fence {
            r#"fill="none""#.to_string()
        } else {
            format!(r#"fill="{AREA_COLOR}" fill-opacity="0.12""#)
        };
        svg.rect(band, format_args!(r#"class="area-band" {fill} {border}"#));
    }
}
