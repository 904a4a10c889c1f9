//! Films: the same view again and again, with moving things in it, without axes and legend.
//!
//! The static part is drawn once, and each picture is a copy of it with the moving things on top,
//! because a film has hundreds of pictures.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use sidestep_kernel::view::{Frame, Scenery, Trail, Vec3};

use crate::error::DrawError;
use crate::picture::canvas::{Camera, Canvas};
use crate::picture::{
    PictureView, PlanAnimation, Scene, TrailChoice, animation_altitudes_m, animation_bounds,
    best_camera, check_content, check_view, projected_bounds,
};
use crate::raster::parse;
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::Fonts;

/// Shortest side of a picture, pixels: below it a long and narrow world would leave nothing to see.
const MIN_FRAME_PX: u32 = 32;
/// Longest side of a picture, pixels: four bytes a pixel are then 64 MiB a frame.
const MAX_FRAME_PX: u32 = 4096;
/// Height of the line of text under the picture, pixels.
const CAPTION_HEIGHT_PX: u32 = 24;

/// The size of the pictures of an animation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnimationSize {
    /// The longer side of what is shown, in pixels: the other one follows from it, and the line of text is added.
    LongerSide(u32),
    /// Width and height of all of it, in pixels: what is shown is as large as it can be, in the middle.
    Exact([u32; 2]),
}

/// What the pictures of an animation show, and how large.
#[derive(Debug, Clone, PartialEq)]
pub struct AnimationLook {
    /// Their size.
    pub size: AnimationSize,
    /// The trails that they show.
    pub trails: TrailChoice,
    /// The direction of view.
    pub view: PictureView,
}

impl AnimationLook {
    /// Returns the usual look of pictures with a longer side of so many pixels.
    pub fn longer_side(longer_side_px: u32) -> Self {
        let size = AnimationSize::LongerSide(longer_side_px);
        Self { size, trails: TrailChoice::default(), view: PictureView::Usual }
    }
}

/// A view of a run, with the parts of it that never move.
pub struct AnimationRenderer {
    scenery: Scenery,
    trails: TrailChoice,
    canvas: Canvas,
    window: Rect,
    /// The plan view of traffic.
    plan: Option<PlanAnimation>,
    background: Pixmap,
}

impl AnimationRenderer {
    /// Returns a film that shows the content of all frames. With a longer side, width and height in pixels are even,
    /// because video formats require it.
    ///
    /// # Errors
    /// When a side is 0 or above 4096, or leaves no room, places are not finite, or the view is none of a plane.
    pub fn new(
        scenery: Scenery,
        frames: &[Frame],
        look: &AnimationLook,
    ) -> Result<Self, DrawError> {
        check_size(look.size)?;
        check_view(&scenery, look.view)?;
        check_content(&scenery, &Frame::default(), &[])?;
        let box_m = animation_bounds(&scenery, frames)?;
        let is_plan = scenery.traffic.is_some() && look.view.is_from_above();
        let usual = || if is_plan { Camera::ABOVE } else { usual_camera(&scenery, frames) };
        let camera = look.view.camera().unwrap_or_else(usual);
        let altitudes_m = animation_altitudes_m(&scenery, box_m);
        let below_px = match look.size {
            AnimationSize::Exact([_, height]) if is_plan => {
                PlanAnimation::profile_room_px(height, altitudes_m)
            }
            _ => 0.0,
        };
        let (canvas, window) = canvas(camera, box_m, look.size, below_px);
        let canvas = Canvas { is_plane: scenery.dimensions == 2 || is_plan, ..canvas };
        let plan = is_plan.then(|| PlanAnimation::new(frames, canvas, window, altitudes_m));
        let (width, height) = match look.size {
            AnimationSize::LongerSide(_) => {
                let bottom_px = plan.as_ref().map_or(window.bottom(), PlanAnimation::bottom_px);
                (window.width as u32, bottom_px as u32 + CAPTION_HEIGHT_PX)
            }
            AnimationSize::Exact([width, height]) => (width, height),
        };
        let mut still = Pixmap::new(width, height).ok_or_else(no_area)?;
        still.fill(Color::WHITE);
        let trails = look.trails.clone();
        let mut film = Self { scenery, trails, canvas, window, plan, background: still };
        let mut svg = Svg::default();
        let nothing = Frame::default();
        let scene = Scene::new(&film.scenery, &nothing, &[], &film.trails);
        if let Some(plan) = &film.plan {
            plan.draw_still(&mut svg, &film.scenery);
        } else {
            svg.open_clip(window);
            scene.draw_still(&mut svg, &film.canvas);
            svg.close_group();
        }
        film.background = film.composite(svg)?;
        Ok(film)
    }

    /// Returns the width and height of its pictures in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.background.width(), self.background.height())
    }

    /// Draws a moment with the trails that led to it, and a line of text under it.
    ///
    /// # Errors
    /// When places are not finite.
    pub fn render(
        &self,
        frame: &Frame,
        trails: &[Trail],
        caption: &str,
    ) -> Result<AnimationFrame, DrawError> {
        check_content(&self.scenery, frame, trails)?;
        let scene = Scene::new(&self.scenery, frame, trails, &self.trails).with_thin_trails();
        let mut svg = Svg::default();
        if let (Some(plan), Some(traffic)) = (&self.plan, &self.scenery.traffic) {
            plan.draw_moving(&mut svg, &scene, traffic);
        } else {
            svg.open_clip(self.window);
            scene.draw_moving(&mut svg, &self.canvas);
            svg.close_group();
        }
        let baseline = f64::from(self.background.height() - CAPTION_HEIGHT_PX) + 17.0;
        svg.text(8.0, baseline, caption, &TextStyle::new(13.0, Anchor::Start));
        Ok(AnimationFrame(self.composite(svg)?))
    }

    /// Returns the static part with more on top.
    fn composite(&self, svg: Svg) -> Result<Pixmap, DrawError> {
        let mut picture = self.background.clone();
        let (width, height) = self.size_px();
        let svg = svg.finish_transparent(f64::from(width), f64::from(height));
        let tree = parse(&svg, &Fonts::default())?;
        resvg::render(&tree, Transform::identity(), &mut picture.as_mut());
        Ok(picture)
    }
}

fn no_area() -> DrawError {
    DrawError::Svg("the picture has no area".into())
}

fn check_size(size: AnimationSize) -> Result<(), DrawError> {
    let (sides, least_px) = match size {
        AnimationSize::LongerSide(px) => ([px, px], 1),
        AnimationSize::Exact([width, height]) => {
            ([width, height.saturating_sub(CAPTION_HEIGHT_PX)], MIN_FRAME_PX)
        }
    };
    for px in sides {
        if px > MAX_FRAME_PX {
            return Err(DrawError::TooLarge {
                what: "animation width in px",
                found: u64::from(px),
                limit: u64::from(MAX_FRAME_PX),
            });
        }
        if px < least_px {
            let must = "at least 32, and 24 more for the line of text";
            return Err(DrawError::Value { what: "animation size in px", value: px.into(), must });
        }
    }
    Ok(())
}

/// Returns the camera for some frames if no view is chosen.
fn usual_camera(scenery: &Scenery, frames: &[Frame]) -> Camera {
    if scenery.dimensions == 2 {
        return Camera::ABOVE;
    }
    // The same view for all of them, whatever balls hide in some.
    best_camera(&frames.iter().collect::<Vec<_>>(), &[])
}

/// Returns the canvas that shows a box in a picture of some size, and the part of the picture that it takes; of an exact
/// size `below_px` are left free below it.
fn canvas(camera: Camera, box_m: [Vec3; 2], size: AnimationSize, below_px: f64) -> (Canvas, Rect) {
    let [lo, hi] = projected_bounds(camera, box_m);
    let size_m = [hi[0] - lo[0], hi[1] - lo[1]];
    let (px_per_m, window) = match size {
        AnimationSize::LongerSide(longer_px) => {
            let px_per_m = f64::from(longer_px) / size_m[0].max(size_m[1]);
            let [width, height] = size_m.map(|length_m| even_px(length_m * px_per_m));
            (px_per_m, Rect { x: 0.0, y: 0.0, width, height })
        }
        AnimationSize::Exact([width, height]) => {
            let height_px = f64::from(height - CAPTION_HEIGHT_PX) - below_px;
            let room_px = [f64::from(width), height_px.max(1.0)];
            let px_per_m = (room_px[0] / size_m[0]).min(room_px[1] / size_m[1]);
            let [width, height] = size_m.map(|length_m| length_m * px_per_m);
            let x = 0.5 * (room_px[0] - width);
            let y = 0.5 * (room_px[1] - height);
            (px_per_m, Rect { x, y, width, height })
        }
    };
    let depths_m = Camera::range(camera.to_eye, box_m);
    let zero = (window.x, window.bottom());
    (Canvas { camera, px_per_m, zero, origin_m: lo, depths_m, is_plane: false }, window)
}

/// Returns the nearest even number of pixels within the limits, because video encoders take no odd sizes.
fn even_px(length_px: f64) -> f64 {
    f64::from(((length_px / 2.0).round() as u32).clamp(MIN_FRAME_PX / 2, MAX_FRAME_PX / 2) * 2)
}

/// One picture of an animation: opaque, from the upper left pixel on.
#[derive(Debug, Clone, PartialEq)]
pub struct AnimationFrame(Pixmap);

impl AnimationFrame {
    /// Returns four bytes per pixel: red, green, blue, and 255.
    pub fn rgba(&self) -> &[u8] {
        self.0.data()
    }

    /// Encodes the picture as PNG.
    ///
    /// # Errors
    /// When the encoder fails.
    pub fn to_png(&self) -> Result<Vec<u8>, DrawError> {
        self.0.encode_png().map_err(|error| DrawError::Png(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{ball, plane};
    use sidestep_chain::kinds::CONNECTOR;
    use sidestep_kernel::view::{ALERT_COLOR, BODY_COLORS, Body, BodyCondition, BodyKind};

    /// A film of 20 by 10 meters, 200 pixels wide.
    fn film(bodies: Vec<Body>) -> AnimationRenderer {
        AnimationRenderer::new(
            Scenery { bodies, ..plane(20, 10) },
            &[],
            &AnimationLook::longer_side(200),
        )
        .unwrap()
    }

    fn still(film: &AnimationRenderer, bodies: Vec<Body>, caption: &str) -> AnimationFrame {
        film.render(&Frame { bodies, ..Frame::default() }, &[], caption).unwrap()
    }

    fn pixel(picture: &AnimationFrame, x: usize, y: usize) -> [u8; 3] {
        let at = 4 * (200 * y + x);
        picture.rgba()[at..at + 3].try_into().unwrap()
    }

    #[test]
    fn north_is_up_and_a_meter_is_as_long_both_ways() {
        let film = film(vec![ball(CONNECTOR, 0, [2.0, 9.0, 0.0], 1.0)]);
        assert_eq!(film.size_px(), (200, 124));
        let picture = still(&film, vec![], "");
        assert_eq!(pixel(&picture, 20, 10), BODY_COLORS[0]);
        assert_eq!(pixel(&picture, 20, 25), [255; 3]);
    }

    #[test]
    fn what_moves_is_on_top_of_one_picture_only() {
        let place = [5.0, 5.0, 0.0];
        let film = film(vec![ball(CONNECTOR, 1, place, 1.0)]);
        let moved = still(&film, vec![ball(CONNECTOR, 2, place, 1.0)], "");
        assert_eq!(pixel(&moved, 50, 50), BODY_COLORS[2]);
        assert_eq!(pixel(&still(&film, vec![], ""), 50, 50), BODY_COLORS[1]);
    }

    #[test]
    fn agents_cover_what_is_in_the_way() {
        let place = [5.0, 5.0, 0.0];
        let bodies = vec![
            ball(CONNECTOR, 0, place, 1.0).with_condition_if(true, BodyCondition::Failed),
            ball(BodyKind::OBSTACLE, 0, place, 2.0),
        ];
        assert_eq!(pixel(&still(&film(vec![]), bodies, ""), 50, 50), ALERT_COLOR);
    }

    #[test]
    fn the_caption_is_written_and_absurd_sizes_are_refused() {
        let picture = still(&film(vec![]), vec![], "cycle 7");
        let inked = (100..124).flat_map(|y| (0..200).map(move |x| (x, y)));
        assert!(inked.filter(|&(x, y)| pixel(&picture, x, y)[0] < 128).count() > 20);
        for width_px in [0, 9000] {
            let look = AnimationLook::longer_side(width_px);
            assert!(AnimationRenderer::new(plane(20, 10), &[], &look).is_err());
        }
        for at in [f64::NAN, 1e300] {
            let lost = vec![ball(CONNECTOR, 0, [at, 0.0, 0.0], 1.0)];
            let frame = Frame { bodies: lost, ..Frame::default() };
            assert!(film(vec![]).render(&frame, &[], "").is_err());
        }
    }
}
