//! Traffic in plan view: from above, north up, with a vertical profile below where altitudes differ.
//!
//! ```text
//! sheet.rs      the places of plan, profile, axes and words   units.rs        levels, speeds, distances
//! graticule.rs  latitudes and longitudes, or distances        aircraft.rs     symbols, velocity vectors, zones
//! areas.rs      areas with their limits                       data_blocks.rs  call sign, level, speed
//! routes.rs     routes, and the ends of trails                profile.rs      altitudes over distances east
//! animation.rs  the same without axes, for animations
//! ```

mod aircraft;
mod animation;
mod areas;
mod data_blocks;
mod graticule;
mod profile;
mod routes;
mod sheet;
#[cfg(test)]
mod tests;
mod units;

pub(crate) use animation::{PlanAnimation, animation_altitudes_m};
pub(super) use sheet::draw;

use super::{Scene, trail_lines};
use crate::style::Style;
use crate::svg::{Rect, Svg};
use areas::DrawnArea;
use data_blocks::BlockCount;
use graticule::PlanWindow;
use sidestep_kernel::view::TrafficPlan;
use units::Units;

/// Traffic, and the window in which it is drawn.
struct Plan<'a> {
    scene: &'a Scene<'a>,
    traffic: &'a TrafficPlan,
    units: Units,
    window: PlanWindow,
    style: &'a Style,
    /// The time that velocity vectors reach ahead; none where nothing moves.
    lookahead_s: Option<f64>,
    /// Horizontal place of the names of upright axes.
    name_x_px: f64,
}

impl Plan<'_> {
    /// Returns the longer side of the shown part of the world.
    fn extent_m(window: &PlanWindow) -> f64 {
        window.map.width.max(window.map.height) / window.canvas.px_per_m
    }

    /// Draws everything but axes and words, within the window.
    fn draw_content(&self, svg: &mut Svg, areas: &[DrawnArea<'_>]) {
        svg.open_clip(self.window.map);
        areas::draw(svg, self, areas);
        routes::draw(svg, self);
        for trail in &self.scene.trails {
            trail_lines::draw(svg, trail, &self.window.canvas);
        }
        aircraft::draw_zones(svg, self);
        aircraft::draw_symbols(svg, self);
        svg.close_group();
    }

    /// Writes names, limits and data blocks; `taken` are places of other words.
    fn draw_words(
        &self,
        svg: &mut Svg,
        areas: &[DrawnArea<'_>],
        mut taken: Vec<Rect>,
    ) -> BlockCount {
        taken.extend(areas::draw_labels(svg, self, areas));
        taken.extend(routes::draw_trail_ends(svg, self));
        data_blocks::draw(svg, self, taken)
    }
}
