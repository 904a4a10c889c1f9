//! Pictures of a run: scenery, a frame, and the trails that led to it.
//!
//! ```text
//! trails.rs       the choice of trails, and their lengths    canvas.rs  from meters to pixels
//! trail_lines.rs  a trail as a line that fades with age      sheet.rs   axes, scale bar, caption
//! floor.rs        walls as few rectangles                    space.rs   the edges of the shown box
//! bodies.rs       everything that has a shape                labels.rs  names that do not overlap
//! map_legend.rs   the legend, and the content in words       extent.rs  the extent of the content
//! ```

mod bodies;
pub(crate) mod canvas;
mod extent;
mod floor;
mod labels;
mod map_legend;
mod sheet;
mod space;
#[cfg(test)]
mod tests;
mod trail_lines;
mod trails;

pub use map_legend::describe;
pub use trails::bodies_with_trails;

pub(crate) use extent::{animation_bounds, check_content, projected_bounds};

use crate::error::DrawError;
use crate::style::{INK, Style};
use crate::svg::Svg;
use canvas::Canvas;
use sheet::{Sheet, SheetContent};
use sidestep_kernel::view::{Frame, Scenery, Trail};
use trails::DrawnTrail;

/// Largest side of a drawn box.
const MAX_BOX_PX: f64 = 28.0;

/// Options of a picture, and the words around it.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureOptions {
    /// Its largest size, and the size of its text.
    pub style: Style,
    /// Its heading; may be empty.
    pub title: String,
    /// Small print under it; may be empty.
    pub caption: String,
}

impl PictureOptions {
    /// Returns options for a picture as large as a page, under the scenario's name.
    pub fn page(scenery: &Scenery, caption: impl Into<String>) -> Self {
        Self { style: Style::MAP, title: scenery.name.clone(), caption: caption.into() }
    }
}

/// Draws a moment of a run, with the trails that led to it: from above if everything lies in a plane,
/// otherwise in parallel projection from a corner. The scale is the same in all directions.
///
/// Only trails that can be distinguished are drawn ([`bodies_with_trails`]): as wide as the body on a
/// floor, otherwise as lines; the older, the paler. Agents without a trail are dark if others have
/// one.
///
/// # Errors
/// [`DrawError::Length`] if a floor has not one entry per box; [`DrawError::TooLarge`] above 2^28
/// boxes or four million bodies and points; [`DrawError::Value`] if places or sizes are not finite,
/// sizes are below zero, a floor has no boxes, or the style is impossible.
pub fn draw(
    scenery: &Scenery,
    frame: &Frame,
    trails: &[Trail],
    options: &PictureOptions,
) -> Result<String, DrawError> {
    options.style.check()?;
    check_content(scenery, frame, trails)?;
    let scene = Scene::new(scenery, frame, trails);
    if scene.is_plane() { from_above(&scene, options) } else { space::draw(&scene, options) }
}

/// The content of a picture: a moment, and the trails that are shown.
pub(crate) struct Scene<'a> {
    pub(crate) scenery: &'a Scenery,
    pub(crate) frame: &'a Frame,
    trails: Vec<DrawnTrail<'a>>,
}

impl<'a> Scene<'a> {
    pub(crate) fn new(scenery: &'a Scenery, frame: &'a Frame, trails: &'a [Trail]) -> Self {
        Self { scenery, frame, trails: trails::drawn_trails(scenery, frame, trails) }
    }

    /// Returns the same scene with trails as thin lines, for bodies with steps that are far apart.
    pub(crate) fn with_thin_trails(mut self) -> Self {
        self.trails.iter_mut().for_each(|trail| trail.width_m = None);
        self
    }

    pub(crate) fn is_plane(&self) -> bool {
        self.scenery.dimensions == 2
    }

    /// Draws walls and everything else that stands still.
    pub(crate) fn draw_still(&self, svg: &mut Svg, canvas: &Canvas) {
        if !canvas.is_above() {
            return bodies::draw_by_depth(svg, self, canvas, self.scenery.bodies.iter());
        }
        if let Some(floor) = &self.scenery.floor {
            floor::draw(svg, floor, canvas);
        }
        bodies::draw_walls(svg, self.scenery, canvas);
        bodies::draw_layers(svg, self, canvas, &self.scenery.bodies, 0..=u8::MAX);
    }

    /// Draws everything that moves. Seen from above, trails lie over doors and under bodies.
    pub(crate) fn draw_moving(&self, svg: &mut Svg, canvas: &Canvas) {
        if !canvas.is_above() {
            bodies::draw_by_depth(svg, self, canvas, self.frame.bodies.iter());
            return self.draw_over(svg, canvas);
        }
        bodies::draw_layers(svg, self, canvas, &self.frame.bodies, 0..=3);
        self.trails.iter().for_each(|trail| trail_lines::draw(svg, trail, canvas));
        bodies::draw_layers(svg, self, canvas, &self.frame.bodies, 4..=u8::MAX);
        bodies::draw_marks(svg, self, canvas);
    }

    /// Draws everything in space, far things first, and trails over it.
    fn draw_space(&self, svg: &mut Svg, canvas: &Canvas) {
        let bodies = self.scenery.bodies.iter().chain(&self.frame.bodies);
        bodies::draw_by_depth(svg, self, canvas, bodies);
        self.draw_over(svg, canvas);
    }

    fn draw_over(&self, svg: &mut Svg, canvas: &Canvas) {
        self.trails.iter().for_each(|trail| trail_lines::draw(svg, trail, canvas));
        bodies::draw_marks(svg, self, canvas);
    }
}

fn from_above(scene: &Scene<'_>, options: &PictureOptions) -> Result<String, DrawError> {
    let [lo, hi] = extent::scene_bounds(scene)?;
    let size_m = [hi[0] - lo[0], hi[1] - lo[1]];
    let px = px_per_m(scene, size_m, &options.style);
    let area = SheetContent {
        origin_m: [lo[0], lo[1]],
        size_m,
        title: &options.title,
        caption: &options.caption,
    };
    let mut svg = Svg::default();
    let sheet = Sheet::open(&mut svg, &area, &options.style, px);
    let canvas = Canvas::above([lo[0], lo[1]], px, sheet.map);
    svg.open_clip(sheet.map);
    scene.draw_still(&mut svg, &canvas);
    scene.draw_moving(&mut svg, &canvas);
    svg.close_group();
    svg.rect(sheet.map, format_args!(r#"fill="none" stroke="{INK}""#));
    labels::draw(&mut svg, scene, &canvas, sheet.map, &options.style);
    Ok(sheet.close(svg, &area, map_legend::legend_entries(scene), &options.style))
}

/// Returns the scale at which everything fits the style's size; whole pixels per box if boxes are
/// large, so that walls have sharp edges.
fn px_per_m(scene: &Scene<'_>, size_m: [f64; 2], style: &Style) -> f64 {
    let px = (style.width_px / size_m[0]).min(style.height_px / size_m[1]);
    let Some(floor) = &scene.scenery.floor else { return px };
    let box_px = (px * floor.box_m).min(MAX_BOX_PX);
    (if box_px >= 2.0 { box_px.floor() } else { box_px }) / floor.box_m
}
