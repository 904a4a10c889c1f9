//! Pictures of a run: scenery, a frame, and the trails that led to it.
//!
//! ```text
//! trails.rs       the choice of trails, and their lengths    canvas.rs  from meters to pixels
//! trail_lines.rs  a trail as a line that fades with age      sheet.rs   axes, scale bar, caption
//! floor.rs        walls as few rectangles                    space.rs   the edges of the shown box
//! bodies.rs       everything that has a shape                labels.rs  names that do not overlap
//! map_legend.rs   the legend, and the content in words       extent.rs  the extent of the content
//! palette.rs     the colors of agents, by group             view.rs    the direction of view
//! size.rs        a picture of exactly some size            surroundings.rs  balls around agents in space
//! shadows.rs     the floor in space, and shadows on it
//! plan/           traffic in plan view, with a vertical profile
//! ```

mod bodies;
pub(crate) mod canvas;
mod extent;
mod floor;
mod labels;
mod map_legend;
mod palette;
mod plan;
mod shadows;
mod sheet;
mod size;
mod space;
mod surroundings;
#[cfg(test)]
mod tests;
mod trail_lines;
mod trails;
mod view;

pub use map_legend::describe;
pub use trails::{TrailChoice, bodies_with_trails};
pub use view::PictureView;

pub(crate) use plan::{PlanAnimation, animation_altitudes_m};

pub(crate) use extent::{animation_bounds, check_content, projected_bounds};
pub(crate) use surroundings::best_camera;

use crate::error::DrawError;
use crate::style::{INK, Style};
use crate::svg::Svg;
use canvas::{Camera, Canvas};
use palette::Palette;
use sheet::{LegendPlace, Sheet, SheetContent};
use sidestep_kernel::view::{Body, Frame, Scenery, Trail};
use surroundings::Surroundings;
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
    /// The trails that it shows.
    pub trails: TrailChoice,
    /// The direction of view.
    pub view: PictureView,
    /// The width and height of all of it, with its words; without them it is as large as it needs.
    pub size_px: Option<[u32; 2]>,
    /// Whether a given height may grow, so that what is shown takes the whole width.
    pub may_grow: bool,
}

impl PictureOptions {
    /// Returns options for a picture as large as a page, under the scenario's name.
    pub fn page(scenery: &Scenery, caption: impl Into<String>) -> Self {
        Self {
            style: Style::MAP,
            title: scenery.name.clone(),
            caption: caption.into(),
            trails: TrailChoice::default(),
            view: PictureView::Usual,
            size_px: None,
            may_grow: false,
        }
    }
}

/// Draws a moment of a run, with the trails that led to it: from above if everything lies in a plane, traffic in plan
/// view with north up, and all else in parallel projection, each unless the options choose a side. The scale is the same
/// in all directions, but for the altitudes of a plan's profile.
///
/// Only trails that can be distinguished are drawn ([`bodies_with_trails`]), or those of the chosen agents: as wide as
/// the body on a floor, otherwise as lines; the older, the paler. Agents have the color of their group where a scenario
/// has several; otherwise those without a trail are dark if others have one. Where agents are chosen, the others are
/// pale.
///
/// # Errors
/// [`DrawError::Length`] if a floor has not one entry per box; [`DrawError::TooLarge`] above 2^28
/// boxes or four million bodies and points; [`DrawError::Value`] if places or sizes are not finite,
/// sizes are below zero, a floor has no boxes, the style is impossible, or the picture has no room in its size;
/// [`DrawError::FlatView`] if what lies in a plane is to be seen from elsewhere than above.
pub fn draw(
    scenery: &Scenery,
    frame: &Frame,
    trails: &[Trail],
    options: &PictureOptions,
) -> Result<String, DrawError> {
    options.style.check()?;
    check_content(scenery, frame, trails)?;
    check_view(scenery, options.view)?;
    let scene = Scene::new(scenery, frame, trails, &options.trails);
    match options.size_px {
        Some(size_px) => {
            size::fit(size_px, options, &|options, legend| draw_scene(&scene, options, legend))
        }
        None => draw_scene(&scene, options, LegendPlace::Below).map(|drawn| drawn.svg),
    }
}

/// Refuses views of a plane other than that from above: they would show a line.
pub(crate) fn check_view(scenery: &Scenery, view: PictureView) -> Result<(), DrawError> {
    if scenery.dimensions == 2 && !view.is_from_above() {
        return Err(DrawError::FlatView(view.to_string()));
    }
    Ok(())
}

/// A picture, and the scale of what it shows.
pub(crate) struct DrawnPicture {
    svg: String,
    px_per_m: f64,
}

fn draw_scene(
    scene: &Scene<'_>,
    options: &PictureOptions,
    legend: LegendPlace,
) -> Result<DrawnPicture, DrawError> {
    if let Some(traffic) = scene.scenery.traffic.as_ref().filter(|_| options.view.is_from_above()) {
        return plan::draw(scene, traffic, options, legend);
    }
    if scene.is_plane() {
        return on_sheet(scene, options, (["x", "y"], Camera::ABOVE), legend);
    }
    match options.view.two_axes() {
        Some(side) => on_sheet(scene, options, side, legend),
        None => space::draw(scene, options),
    }
}

/// The content of a picture: a moment, and the trails that are shown.
pub(crate) struct Scene<'a> {
    pub(crate) scenery: &'a Scenery,
    pub(crate) frame: &'a Frame,
    trails: Vec<DrawnTrail<'a>>,
    choice: &'a TrailChoice,
    palette: Palette<'a>,
    /// What is drawn in space; of a plane, everything is.
    surroundings: Surroundings<'a>,
}

/// How much an agent stands out from the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AgentEmphasis {
    /// Drawn in its color.
    Full,
    /// Drawn without a color, because others have a trail.
    Untraced,
    /// Drawn pale, because others were chosen.
    Context,
}

impl<'a> Scene<'a> {
    pub(crate) fn new(
        scenery: &'a Scenery,
        frame: &'a Frame,
        trails: &'a [Trail],
        choice: &'a TrailChoice,
    ) -> Self {
        let mut trails = trails::drawn_trails(scenery, frame, trails, choice);
        let mut palette = Palette::new(scenery);
        for trail in &mut trails {
            trail.color = palette.trail_color(trail.of);
        }
        let surroundings = match scenery.dimensions {
            2 => Surroundings::default(),
            _ => Surroundings::new(scenery, frame),
        };
        Self { scenery, frame, trails, choice, palette, surroundings }
    }

    /// Returns how much the agent with a number stands out.
    pub(crate) fn emphasis(&self, number: u32) -> AgentEmphasis {
        if !self.choice.agents.is_empty() {
            return if self.choice.has(number) {
                AgentEmphasis::Full
            } else {
                AgentEmphasis::Context
            };
        }
        let has_trail = self.trails.iter().any(|trail| trail.of.number == number);
        if self.trails.is_empty() || has_trail || self.palette.is_by_group() {
            AgentEmphasis::Full
        } else {
            AgentEmphasis::Untraced
        }
    }

    /// Returns the same scene with trails as thin lines, for bodies with steps that are far apart.
    pub(crate) fn with_thin_trails(mut self) -> Self {
        self.trails.iter_mut().for_each(|trail| trail.width_m = None);
        self
    }

    pub(crate) fn is_plane(&self) -> bool {
        self.scenery.dimensions == 2
    }

    /// Returns everything that is drawn.
    fn visible(&self) -> Vec<&'a Body> {
        if self.is_plane() {
            return self.scenery.bodies.iter().chain(&self.frame.bodies).collect();
        }
        self.surroundings.visible().to_vec()
    }

    /// Returns the camera that shows most of the agents.
    fn best_camera(&self) -> Camera {
        best_camera(&[self.frame], self.surroundings.balls())
    }

    /// Draws walls and everything else that stands still; nothing in space, where it may hide what moves.
    pub(crate) fn draw_still(&self, svg: &mut Svg, canvas: &Canvas) {
        if !canvas.is_above() {
            return;
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
            return self.draw_space(svg, canvas);
        }
        bodies::draw_layers(svg, self, canvas, &self.frame.bodies, 0..=3);
        self.trails.iter().for_each(|trail| trail_lines::draw(svg, trail, canvas));
        bodies::draw_layers(svg, self, canvas, &self.frame.bodies, 4..=u8::MAX);
        bodies::draw_marks(svg, self, canvas);
    }

    /// Draws everything in space, far things first, and trails over it.
    fn draw_space(&self, svg: &mut Svg, canvas: &Canvas) {
        bodies::draw_by_depth(svg, self, canvas);
        self.trails.iter().for_each(|trail| trail_lines::draw(svg, trail, canvas));
        bodies::draw_marks(svg, self, canvas);
    }
}

/// Draws what has two axes: a plane from above, or space along the third axis.
fn on_sheet(
    scene: &Scene<'_>,
    options: &PictureOptions,
    (axes, camera): ([&'static str; 2], Camera),
    legend: LegendPlace,
) -> Result<DrawnPicture, DrawError> {
    let box_m = extent::scene_bounds(scene)?;
    let [lo, hi] = projected_bounds(camera, box_m);
    let size_m = [hi[0] - lo[0], hi[1] - lo[1]];
    let px = px_per_m(scene, size_m, options);
    let caption = format!("{}{}", space::describe_cut(scene), options.caption);
    let area = SheetContent {
        origin_m: lo,
        size_m,
        axes,
        min_width_px: options.size_px.map_or(0.0, |[width, _]| f64::from(width)),
        legend,
        entries: map_legend::legend_entries(scene),
        title: &options.title,
        caption: &caption,
    };
    let mut svg = Svg::default();
    let sheet = Sheet::open(&mut svg, &area, &options.style, px);
    let above = Canvas::above(lo, px, sheet.map);
    let depths_m = Camera::range(camera.to_eye, box_m);
    let canvas = Canvas { camera, depths_m, is_plane: scene.is_plane(), ..above };
    svg.open_clip(sheet.map);
    if canvas.is_above() {
        scene.draw_still(&mut svg, &canvas);
        scene.draw_moving(&mut svg, &canvas);
    } else {
        scene.draw_space(&mut svg, &canvas);
    }
    svg.close_group();
    svg.rect(sheet.map, format_args!(r#"fill="none" stroke="{INK}""#));
    labels::draw(&mut svg, scene, &canvas, sheet.map, &options.style);
    Ok(DrawnPicture { svg: sheet.close(svg, area, &options.style), px_per_m: px })
}

/// Returns the scale at which everything fits the style's size; whole pixels per box if boxes are
/// large, so that walls have sharp edges.
fn px_per_m(scene: &Scene<'_>, size_m: [f64; 2], options: &PictureOptions) -> f64 {
    let style = &options.style;
    let px = (style.width_px / size_m[0]).min(style.height_px / size_m[1]);
    // A picture of a given size takes all of it.
    let is_free = options.size_px.is_none();
    let Some(floor) = scene.scenery.floor.as_ref().filter(|_| is_free) else { return px };
    let box_px = (px * floor.box_m).min(MAX_BOX_PX);
    (if box_px >= 2.0 { box_px.floor() } else { box_px }) / floor.box_m
}
