//! Bitmaps of models, as Stage reads them.
//!
//! Stage draws polygons around the solid pixels and stretches *their* bounding box to the size of the model: blank
//! margins of an image take no room.

use super::{FloorPlan, Pose2};
use crate::image::{Bitmap, Shade};
use crate::{ImportReport, Treatment};

/// Half-way between the last solid value of the first channel and the first blank one, 127 and 128 of 255.
const SOLID_BELOW: f64 = 127.5;

/// The largest ratio of the sides of a pixel that still counts as a square one.
const MAX_SQUARE_RATIO: f64 = 1.01;

/// What a floor plan has besides its pixels.
pub(super) struct PlanFrame {
    pub(super) name: String,
    pub(super) size_m: [f64; 2],
    /// The pose of its center.
    pub(super) pose: Pose2,
    pub(super) has_boundary: bool,
    /// Where the bitmap is named, for reports.
    pub(super) place: String,
}

/// Returns the part of an image that its solid pixels span, rows from the bottom. Stage looks at the first channel
/// only: gray, or red.
pub(super) fn floor_plan(image: &Bitmap, frame: PlanFrame, report: &mut ImportReport) -> FloorPlan {
    let width = image.width() as usize;
    let mut is_transparent = false;
    let from_top = image.map_shades(|shade: Shade| {
        let is_solid = shade.first_channel < SOLID_BELOW;
        is_transparent |= is_solid && shade.opacity < 1.0;
        is_solid
    });
    if is_transparent {
        let rule = "the transparency of dark pixels, which are solid as in Stage";
        let remedy = "save the bitmap without transparency, on a white ground";
        report.record(Treatment::NotUsed, rule, frame.place.clone(), remedy);
    }
    let solid_part = SolidPart::of(&from_top, width);
    if solid_part.is_none() {
        let rule = "bitmaps without a solid pixel, which are no obstacles";
        let remedy = "obstacles have to be darker than a medium gray (128 of 255)";
        report.record(Treatment::Suspicious, rule, frame.place.clone(), remedy);
    }
    let part = solid_part.unwrap_or(SolidPart { columns: [0, 0], rows: [0, 0] });
    part.record_stretch(image, &frame, report);
    let [first, last] = part.columns;
    let rows_from_bottom = from_top.chunks(width).take(part.rows[1] + 1).skip(part.rows[0]).rev();
    let solid: Vec<bool> = rows_from_bottom.flat_map(|row| &row[first..=last]).copied().collect();
    let [width, height] = part.size();
    let PlanFrame { name, size_m, pose, has_boundary, .. } = frame;
    FloorPlan { name, width, height, solid, size_m, pose, has_boundary }
}

/// The part of an image that its solid pixels span: first and last columns and rows, from the top.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SolidPart {
    columns: [usize; 2],
    rows: [usize; 2],
}

impl SolidPart {
    fn of(from_top: &[bool], width: usize) -> Option<Self> {
        let mut part: Option<Self> = None;
        for (y, row) in from_top.chunks(width).enumerate() {
            let Some(first) = row.iter().position(|solid| *solid) else { continue };
            let last = row.iter().rposition(|solid| *solid).unwrap_or(first);
            let so_far = part.unwrap_or(Self { columns: [first, last], rows: [y, y] });
            let columns = [so_far.columns[0].min(first), so_far.columns[1].max(last)];
            part = Some(Self { columns, rows: [so_far.rows[0], y] });
        }
        part
    }

    fn size(&self) -> [u32; 2] {
        [self.columns, self.rows].map(|[first, last]| (last - first + 1) as u32)
    }

    /// Records a stretch that the author of a world can hardly have meant: one of a size that fits the whole image.
    fn record_stretch(&self, image: &Bitmap, frame: &PlanFrame, report: &mut ImportReport) {
        let whole = pixel_m([image.width(), image.height()], frame.size_m);
        let stretched = pixel_m(self.size(), frame.size_m);
        if self.size() == [image.width(), image.height()] || !is_square(whole) {
            return;
        }
        let rule = format!(
            "the solid pixels of a bitmap do not reach its edges, and Stage stretches them to `size`: a pixel is \
             {:.4} x {:.4} m, not {:.4} m as if the whole image had that size",
            stretched[0], stretched[1], whole[0]
        );
        let [width, height] = self.size().map(f64::from);
        let remedy = format!(
            "for pixels of {:.4} m set `size [{:.3} {:.3} 1]`, and move `pose` to the middle of the solid pixels",
            whole[0],
            whole[0] * width,
            whole[1] * height
        );
        report.record(Treatment::Suspicious, rule, frame.place.clone(), &remedy);
    }
}

fn pixel_m(pixels: [u32; 2], size_m: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| size_m[i] / f64::from(pixels[i]))
}

fn is_square([x_m, y_m]: [f64; 2]) -> bool {
    x_m.max(y_m) <= MAX_SQUARE_RATIO * x_m.min(y_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
    use std::io::Cursor;

    fn plan(image: impl Into<DynamicImage>, size_m: [f64; 2]) -> (FloorPlan, Vec<String>) {
        let mut bytes = Cursor::new(Vec::new());
        image.into().write_to(&mut bytes, ImageFormat::Png).expect("memory takes all");
        let image = Bitmap::decode("f.png", bytes.into_inner()).expect("an image");
        let frame = PlanFrame {
            name: String::new(),
            size_m,
            pose: Pose2::default(),
            has_boundary: false,
            place: "line 7".to_owned(),
        };
        let mut report = ImportReport::new("Stage");
        let plan = floor_plan(&image, frame, &mut report);
        (plan, report.findings.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn solid_pixels_span_the_plan_and_blank_margins_take_no_room() {
        // Solid: (1, 1) and (3, 2), from the upper left of 6 x 4 pixels.
        let image = ImageBuffer::from_fn(6, 4, |x, y| {
            Luma([255 * u8::from((x, y) != (1, 1) && (x, y) != (3, 2))])
        });
        let (plan, said) = plan(image, [6.0, 4.0]);
        assert_eq!((plan.width, plan.height, plan.size_m), (3, 2, [6.0, 4.0]));
        assert_eq!(plan.solid, [false, false, true, true, false, false]);
        assert_eq!(said.len(), 1);
        assert!(said[0].contains("2.0000 x 2.0000 m, not 1.0000 m"), "{said:?}");
        assert!(said[0].contains("size [3.000 2.000 1]"), "{said:?}");
    }

    #[test]
    fn the_first_channel_decides_at_128_whatever_the_others_and_the_opacity_are() {
        let colors = ImageBuffer::from_fn(4, 1, |x, _| {
            [Rgb([127u8, 255, 255]), Rgb([128, 0, 0])][x as usize % 2]
        });
        assert_eq!(plan(colors, [1.0; 2]).0.solid, [true, false, true]);
        let clear = ImageBuffer::from_fn(3, 1, |x, _| Rgba([0u8, 0, 0, 255 * u8::from(x == 1)]));
        let (clear, said) = plan(clear, [1.0; 2]);
        assert_eq!(clear.solid, [true; 3]);
        assert!(said[0].contains("transparency"), "{said:?}");
        let deep = ImageBuffer::from_fn(2, 1, |x, _| Luma([32767u16 + x as u16]));
        assert_eq!(plan(deep, [1.0; 2]).0.solid, [true]);
    }

    #[test]
    fn a_bitmap_without_solid_pixels_is_said_and_a_whole_one_is_no_news() {
        let (blank, said) = plan(ImageBuffer::from_pixel(9, 9, Luma([255u8])), [3.0; 2]);
        assert_eq!(blank.solid, [false]);
        assert!(said[0].contains("without a solid pixel"), "{said:?}");
        let (whole, said) = plan(ImageBuffer::from_pixel(9, 9, Luma([0u8])), [3.0; 2]);
        assert_eq!((whole.width, whole.height, said), (9, 9, Vec::new()));
    }
}
