//! Pictures of an animation: the plan and its profile, without axes and legend.

use super::aircraft::lookahead_s;
use super::areas::areas;
use super::graticule::{Graticule, PlanWindow};
use super::profile::ProfileWindow;
use super::sheet::{PROFILE_HEIGHT_PX, draw_lines, draw_north_arrow};
use super::units::Units;
use super::{Plan, Scene};
use crate::picture::canvas::Canvas;
use crate::style::{GRID, Style};
use crate::svg::{Rect, Svg};
use sidestep_kernel::view::{Frame, Scenery, TrafficPlan, Vec3};

/// Height of a profile as a fraction of the plan's.
const PROFILE_FRACTION: f64 = 0.22;
/// Space between plan and profile.
const GAP_PX: f64 = 2.0;
/// Size of letters as a fraction of the width, and its limits.
const LETTER_FRACTION: f64 = 0.017;
const LETTER_PX: [f64; 2] = [9.0, 15.0];

/// The places of plan and profile in all pictures of an animation.
pub(crate) struct PlanAnimation {
    window: PlanWindow,
    profile: Option<ProfileWindow>,
    style: Style,
    lookahead_s: Option<f64>,
}

impl PlanAnimation {
    /// Returns the view for a canvas that shows all that the frames have in `map`, and for their altitudes.
    pub(crate) fn new(frames: &[Frame], canvas: Canvas, map: Rect, altitudes_m: [f64; 2]) -> Self {
        let window = PlanWindow { canvas, map };
        let [least_px, most_px] = LETTER_PX;
        let font_px = (LETTER_FRACTION * map.width.max(map.height)).clamp(least_px, most_px);
        let style = Style { width_px: map.width, height_px: map.height, font_px };
        let times = frames.iter().filter_map(|frame| lookahead_s(frame, Plan::extent_m(&window)));
        let shortest_s = times.fold(f64::INFINITY, f64::min);
        let mut animation = Self {
            window,
            profile: None,
            style,
            // The same in all pictures, or vectors would change their length from one to the next.
            lookahead_s: shortest_s.is_finite().then_some(shortest_s),
        };
        if altitudes_m[0] < altitudes_m[1] {
            animation.add_profile(altitudes_m);
        }
        animation
    }

    /// Returns the room below the plan that a profile takes at most in a picture of this height; where the height is
    /// free, the picture grows by what it takes.
    pub(crate) fn profile_room_px(height_px: u32, altitudes_m: [f64; 2]) -> f64 {
        if altitudes_m[0] >= altitudes_m[1] {
            return 0.0;
        }
        let part = PROFILE_FRACTION / (1.0 + PROFILE_FRACTION);
        let [least_px, most_px] = PROFILE_HEIGHT_PX;
        // Its height is rounded to an even number.
        (part * f64::from(height_px)).clamp(least_px, most_px) + GAP_PX + 1.0
    }

    fn add_profile(&mut self, altitudes_m: [f64; 2]) {
        let map = self.window.map;
        let [least_px, most_px] = PROFILE_HEIGHT_PX;
        // Even, because video formats require it.
        let height = 2.0 * (0.5 * (PROFILE_FRACTION * map.height).clamp(least_px, most_px)).round();
        let area = Rect { y: map.bottom() + GAP_PX, height, ..map };
        self.profile = Some(ProfileWindow::new(area, altitudes_m, &self.window.canvas));
    }

    /// Returns where the picture ends.
    pub(crate) fn bottom_px(&self) -> f64 {
        self.profile.as_ref().map_or(self.window.map.bottom(), |profile| profile.area.bottom())
    }

    /// Draws what never moves.
    pub(crate) fn draw_still(&self, svg: &mut Svg, scenery: &Scenery) {
        let graticule = Graticule::new(scenery, &self.window, self.style.small_px());
        draw_lines(svg, &graticule, self.window.map);
        draw_north_arrow(svg, self.window.map, &self.style);
        if let Some(profile) = &self.profile {
            let y = self.window.map.bottom() + 0.5 * GAP_PX;
            let ends = ((profile.area.x, y), (profile.area.right(), y));
            svg.line(ends.0, ends.1, format_args!(r#"stroke="{GRID}" stroke-width="{GAP_PX}""#));
        }
    }

    /// Draws a moment.
    pub(crate) fn draw_moving(&self, svg: &mut Svg, scene: &Scene<'_>, traffic: &TrafficPlan) {
        let plan = Plan {
            scene,
            traffic,
            units: Units::of_scenery(scene.scenery),
            window: self.window,
            style: &self.style,
            lookahead_s: self.lookahead_s,
            name_x_px: 0.0,
        };
        let areas = areas(scene, traffic);
        plan.draw_content(svg, &areas);
        plan.draw_words(svg, &areas, Vec::new());
        if let Some(profile) = &self.profile {
            svg.open_clip(profile.area);
            profile.draw_levels(svg, &plan);
            profile.draw_content(svg, &plan, &areas);
            svg.close_group();
        }
    }
}

/// Returns the altitudes of an animation's profile from its extent; the same number twice where all is on one level.
pub(crate) fn animation_altitudes_m(scenery: &Scenery, [low_m, high_m]: [Vec3; 2]) -> [f64; 2] {
    if scenery.dimensions == 2 { [0.0; 2] } else { [low_m[2], high_m[2]] }
}
