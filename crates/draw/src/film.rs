//! Pictures of a film: the same view again and again, with things in it that move.
//!
//! What stays is drawn once; each picture is a copy of it with the moving things on top. Without
//! axes and legend, and by the rasterizer itself: a film has hundreds of pictures.

use resvg::tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, PixmapPaint, Rect, Stroke,
    Transform,
};

use crate::bodies::{RIGHT, TO_EYE, UP};
use crate::error::DrawError;
use crate::raster::parse;
use crate::svg::{Anchor, Svg, TextLook};

/// A place in meters.
type Place = [f64; 3];

/// The longest side that a picture may have.
const MOST_PX: u32 = 4096;
/// Height of the line of text under the picture, pixels.
const CAPTION_PX: u32 = 24;
/// Thinner lines would be hard to see.
const LEAST_LINE_PX: f64 = 1.0;
/// The layer of the ground.
const GROUND: u8 = 0;
/// Smaller things are drawn this large.
const LEAST_RADIUS_PX: f64 = 1.5;

/// From where one looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    right: Place,
    up: Place,
    to_eye: Place,
}

impl Camera {
    /// From above: x to the right, y up.
    pub const ABOVE: Self =
        Self { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], to_eye: [0.0, 0.0, 1.0] };
    /// In parallel projection from a corner, as pictures of bodies in space are.
    pub const CORNER: Self = Self { right: RIGHT, up: UP, to_eye: TO_EYE };

    /// Where a place is seen: meters to the right and up.
    pub fn seen(&self, at: Place) -> [f64; 2] {
        [dot(self.right, at), dot(self.up, at)]
    }

    fn depth_m(&self, at: Place) -> f64 {
        dot(self.to_eye, at)
    }
}

fn dot(a: Place, b: Place) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Something that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Its form.
    pub form: Form,
    /// Red, green, blue.
    pub color: [u8; 3],
    /// 0 to be seen through entirely, 1 for not at all.
    pub opacity: f64,
    /// Things of a higher layer cover those of a lower one, however far they are. Layer 0 is the
    /// ground: its edges are hard, so that tiles join.
    pub layer: u8,
}

/// Forms of figures, in meters.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A ball.
    Ball {
        /// Its middle.
        at: Place,
        /// Its radius.
        radius_m: f64,
    },
    /// A flat area within its corners.
    Area(Vec<Place>),
    /// A line, rounded at its ends.
    Line {
        /// Its points.
        points: Vec<Place>,
        /// How wide it is; 0 for as thin as can be seen.
        width_m: f64,
    },
}

impl Form {
    fn points(&self) -> &[Place] {
        match self {
            Self::Ball { at, .. } => std::slice::from_ref(at),
            Self::Area(points) | Self::Line { points, .. } => points,
        }
    }

    fn middle(&self) -> Place {
        let points = self.points();
        let n = points.len().max(1) as f64;
        std::array::from_fn(|i| points.iter().map(|p| p[i]).sum::<f64>() / n)
    }
}

/// A rectangle of what is seen, and what never moves in it.
pub struct Stage {
    camera: Camera,
    /// Meters to the right and up of the lower left corner.
    corner_m: [f64; 2],
    px_per_m: f64,
    /// Height without the line of text.
    height_px: u32,
    still: Pixmap,
}

impl Stage {
    /// A stage that shows the rectangle from `lo_m` to `hi_m` (as [`Camera::seen`]) so that it is
    /// `width_px` wide, or less where it would be higher than that. Width and height in pixels are
    /// even, which films ask for.
    ///
    /// # Errors
    /// A rectangle without area; a width of 0 or above 4096.
    pub fn new(
        camera: Camera,
        [lo_m, hi_m]: [[f64; 2]; 2],
        width_px: u32,
        still: &[Figure],
    ) -> Result<Self, DrawError> {
        if width_px > MOST_PX {
            let (found, limit) = (u64::from(width_px), u64::from(MOST_PX));
            return Err(DrawError::TooLarge { what: "film width in px", found, limit });
        }
        DrawError::positive("film width in px", f64::from(width_px))?;
        let size_m = [hi_m[0] - lo_m[0], hi_m[1] - lo_m[1]];
        DrawError::positive("film width in m", size_m[0])?;
        DrawError::positive("film height in m", size_m[1])?;
        let px_per_m = f64::from(width_px) / size_m[0].max(size_m[1]);
        let even =
            |length_m: f64| ((length_m * px_per_m / 2.0).round() as u32).clamp(16, MOST_PX / 2) * 2;
        let (width_px, height_px) = (even(size_m[0]), even(size_m[1]));
        let no_area = || DrawError::Svg("the picture has no area".into());
        let mut pixmap = Pixmap::new(width_px, height_px + CAPTION_PX).ok_or_else(no_area)?;
        pixmap.fill(Color::WHITE);
        let mut stage = Self { camera, corner_m: lo_m, px_per_m, height_px, still: pixmap };
        let mut drawn = stage.still.clone();
        stage.draw_all(still, &mut drawn);
        stage.still = drawn;
        Ok(stage)
    }

    /// Width and height of its pictures in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.still.width(), self.still.height())
    }

    /// A picture with these figures, and a line of text under it.
    ///
    /// # Errors
    /// A text that cannot be drawn.
    pub fn picture(&self, figures: &[Figure], caption: &str) -> Result<Picture, DrawError> {
        let mut picture = self.still.clone();
        self.draw_all(figures, &mut picture);
        self.write_caption(caption, &mut picture)?;
        Ok(Picture(picture))
    }

    fn draw_all(&self, figures: &[Figure], onto: &mut Pixmap) {
        let depth_m = |figure: &Figure| self.camera.depth_m(figure.form.middle());
        let mut order: Vec<(u8, f64, usize)> =
            figures.iter().enumerate().map(|(k, f)| (f.layer, depth_m(f), k)).collect();
        order.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        order.iter().for_each(|&(_, _, k)| self.draw(&figures[k], onto));
    }

    fn at(&self, place: Place) -> (f32, f32) {
        let [right_m, up_m] = self.camera.seen(place);
        let x = (right_m - self.corner_m[0]) * self.px_per_m;
        let y = f64::from(self.height_px) - (up_m - self.corner_m[1]) * self.px_per_m;
        (x as f32, y as f32)
    }

    fn draw(&self, figure: &Figure, onto: &mut Pixmap) {
        let ([r, g, b], alpha) = (figure.color, (255.0 * figure.opacity.clamp(0.0, 1.0)) as u8);
        // Tiles of the ground meet without a seam only where their edges are hard.
        let mut paint = Paint { anti_alias: figure.layer > GROUND, ..Paint::default() };
        paint.set_color_rgba8(r, g, b, alpha);
        let mut path = PathBuilder::new();
        match &figure.form {
            Form::Ball { at, radius_m } => {
                let (x, y) = self.at(*at);
                path.push_circle(x, y, (radius_m * self.px_per_m).max(LEAST_RADIUS_PX) as f32);
            }
            Form::Area(points) | Form::Line { points, .. } => {
                for (k, &point) in points.iter().enumerate() {
                    let (x, y) = self.at(point);
                    if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
                }
                if matches!(figure.form, Form::Area(_)) {
                    path.close();
                }
            }
        }
        // What is not finite, or has no extent, has no path.
        let Some(path) = path.finish() else { return };
        match &figure.form {
            Form::Line { width_m, .. } => {
                let width = (width_m * self.px_per_m).max(LEAST_LINE_PX) as f32;
                let (line_cap, line_join) = (LineCap::Round, LineJoin::Round);
                let stroke = Stroke { width, line_cap, line_join, ..Stroke::default() };
                onto.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
            }
            _ => onto.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None),
        }
    }

    fn write_caption(&self, caption: &str, onto: &mut Pixmap) -> Result<(), DrawError> {
        let (width, top) = (onto.width(), self.height_px);
        let mut white = Paint::default();
        white.set_color(Color::WHITE);
        if let Some(strip) = Rect::from_xywh(0.0, top as f32, width as f32, CAPTION_PX as f32) {
            onto.fill_rect(strip, &white, Transform::identity(), None);
        }
        let mut svg = Svg::default();
        svg.text(8.0, 17.0, caption, &TextLook::new(13.0, Anchor::Start));
        let tree = parse(&svg.finish(f64::from(width), f64::from(CAPTION_PX), ""))?;
        let Some(mut text) = Pixmap::new(width, CAPTION_PX) else { return Ok(()) };
        resvg::render(&tree, Transform::identity(), &mut text.as_mut());
        let paint = PixmapPaint::default();
        onto.draw_pixmap(0, top as i32, text.as_ref(), &paint, Transform::identity(), None);
        Ok(())
    }
}

/// One picture of a film: opaque, from the upper left pixel on.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture(Pixmap);

impl Picture {
    /// Four bytes per pixel: red, green, blue, and 255.
    pub fn rgba(&self) -> &[u8] {
        self.0.data()
    }

    /// As PNG.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn to_png(&self) -> Result<Vec<u8>, DrawError> {
        self.0.encode_png().map_err(|error| DrawError::Png(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [u8; 3] = [255, 0, 0];

    fn ball(at: Place, color: [u8; 3], layer: u8) -> Figure {
        Figure { form: Form::Ball { at, radius_m: 1.0 }, color, opacity: 1.0, layer }
    }

    fn stage(still: &[Figure]) -> Stage {
        Stage::new(Camera::ABOVE, [[0.0, 0.0], [20.0, 10.0]], 200, still).unwrap()
    }

    fn pixel(picture: &Picture, x: usize, y: usize) -> [u8; 3] {
        let at = 4 * (200 * y + x);
        picture.rgba()[at..at + 3].try_into().unwrap()
    }

    #[test]
    fn north_is_up_and_a_meter_is_as_long_both_ways() {
        let stage = stage(&[ball([2.0, 9.0, 0.0], RED, 0)]);
        assert_eq!(stage.size_px(), (200, 124));
        let picture = stage.picture(&[], "").unwrap();
        assert_eq!(pixel(&picture, 20, 10), RED);
        assert_eq!(pixel(&picture, 20, 25), [255; 3]);
    }

    #[test]
    fn what_moves_is_on_top_of_one_picture_only() {
        let stage = stage(&[ball([5.0, 5.0, 0.0], RED, 9)]);
        let moved = stage.picture(&[ball([5.0, 5.0, 0.0], [0, 0, 255], 0)], "").unwrap();
        assert_eq!(pixel(&moved, 50, 50), [0, 0, 255]);
        assert_eq!(pixel(&stage.picture(&[], "").unwrap(), 50, 50), RED);
    }

    #[test]
    fn higher_and_nearer_things_cover_others() {
        let blue = [0, 0, 255];
        let near = [ball([5.0, 5.0, 3.0], RED, 0), ball([5.0, 5.0, 1.0], blue, 0)];
        assert_eq!(pixel(&stage(&[]).picture(&near, "").unwrap(), 50, 50), RED);
        let layered = [ball([5.0, 5.0, 3.0], RED, 0), ball([5.0, 5.0, 1.0], blue, 1)];
        assert_eq!(pixel(&stage(&[]).picture(&layered, "").unwrap(), 50, 50), blue);
    }

    #[test]
    fn the_caption_is_written_and_absurd_sizes_are_refused() {
        let picture = stage(&[]).picture(&[], "cycle 7").unwrap();
        let inked = (100..124).flat_map(|y| (0..200).map(move |x| (x, y)));
        assert!(inked.filter(|&(x, y)| pixel(&picture, x, y)[0] < 128).count() > 20);
        for (view, width) in
            [([[0.0; 2], [0.0, 1.0]], 100), ([[0.0; 2], [1.0; 2]], 0), ([[0.0; 2], [1.0; 2]], 9000)]
        {
            assert!(Stage::new(Camera::ABOVE, view, width, &[]).is_err());
        }
        let lost = [ball([f64::NAN, 0.0, 0.0], RED, 0), ball([1e300, 0.0, 0.0], RED, 0)];
        assert!(stage(&lost).picture(&lost, "").is_ok());
    }
}
