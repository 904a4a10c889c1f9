//! A map of pixels, and the rule that turns pixels into boxes.

use std::ops::Range;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;

use sidestep_map::{Cell, CellCounts, GridMap, UnknownPolicy, check_box_count, check_box_size};

use super::report::ImportReport;

pub use super::image::MAX_PIXELS;

/// An occupancy grid from a mapping robot: square pixels, free, occupied or unknown.
///
/// Pixel (0, 0) is the lower-left one: rows count from the bottom, unlike those of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelMap {
    width: u32,
    height: u32,
    resolution_m: f64,
    plane: Isometry2,
    /// Row by row from the bottom; length `width * height`.
    pixels: Vec<Cell>,
    report: ImportReport,
}

impl PixelMap {
    /// Creates a map of `width` x `height` pixels with a side of `resolution_m` meters and its
    /// lower-left corner at the origin of `plane`; `pixels` holds them row by row from the bottom.
    ///
    /// # Panics
    /// When `pixels` has another length than `width * height`, or `resolution_m` is not a
    /// positive number.
    pub fn new(
        width: u32,
        height: u32,
        resolution_m: f64,
        plane: Isometry2,
        pixels: Vec<Cell>,
    ) -> Self {
        assert_eq!(pixels.len(), width as usize * height as usize, "one cell per pixel");
        assert!(resolution_m.is_finite() && resolution_m > 0.0, "a pixel has a positive side");
        let report = ImportReport::default();
        Self { width, height, resolution_m, plane, pixels, report }
    }

    /// Returns the same map with the report of its file.
    #[must_use]
    pub fn with_report(mut self, report: ImportReport) -> Self {
        self.report = report;
        self
    }

    /// Returns what became of the file of the map; empty where it is from no file.
    pub fn report(&self) -> &ImportReport {
        &self.report
    }

    /// Returns what became of the file of the map, without the map.
    pub fn into_report(self) -> ImportReport {
        self.report
    }

    /// Number of pixels from west to east.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of pixels from south to north.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Side of a pixel in meters.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// The position of the lower-left corner in the world, and the rotation of the image about it.
    pub fn plane(&self) -> Isometry2 {
        self.plane
    }

    /// Returns all pixels, row by row from the bottom.
    pub fn pixels(&self) -> &[Cell] {
        &self.pixels
    }

    /// Returns the number of pixels of each type, before any conversion into boxes.
    pub fn counts(&self) -> CellCounts {
        CellCounts::from_cells(&self.pixels)
    }

    /// Returns the map in boxes with a side of `box_size_m` meters, counted from the lower-left
    /// corner.
    ///
    /// A pixel belongs to the box that holds its center. A box is a wall when any of its pixels is
    /// occupied, else unknown when any is unknown, else free; `unknown` then decides on the unknown
    /// boxes. Where boxes are smaller than pixels, a box that holds no center of a pixel gets the
    /// value of the pixel around its own center. The last column and row may extend past the edge
    /// of the map; there is one for every pixel's center and for every box with its center on the
    /// map.
    ///
    /// # Errors
    /// When `box_size_m` is not a positive number or makes more boxes than
    /// [`MAX_BOXES`](sidestep_map::MAX_BOXES).
    pub fn to_boxes(&self, box_size_m: f64, unknown: UnknownPolicy) -> Result<GridMap, InputError> {
        let resolution_m = self.resolution_m;
        let x = AxisAlignment { pixels: self.width, resolution_m, box_size_m };
        let y = AxisAlignment { pixels: self.height, resolution_m, box_size_m };
        check_box_size(box_size_m)?;
        let (width, height) = check_box_count("box_size_m", x.boxes(), y.boxes())?;
        let columns: Vec<_> = (0..width).map(|col| x.pixels_of(col)).collect();
        let mut cells = Vec::with_capacity(width as usize * height as usize);
        for row in 0..height {
            let rows = y.pixels_of(row);
            cells.extend(columns.iter().map(|cols| unknown.apply(self.merged_cell(cols, &rows))));
        }
        Ok(GridMap::new(width, height, box_size_m, cells).with_plane(self.plane))
    }

    /// Returns the cell of a box: a single wall makes it one, because a robot must not drive into it.
    fn merged_cell(&self, cols: &Range<usize>, rows: &Range<usize>) -> Cell {
        let mut merged = Cell::Free;
        for row in rows.clone() {
            let start = row * self.width as usize;
            for pixel in &self.pixels[start + cols.start..start + cols.end] {
                match pixel {
                    Cell::Wall => return Cell::Wall,
                    Cell::Unknown => merged = Cell::Unknown,
                    Cell::Free => {}
                }
            }
        }
        merged
    }
}

/// The alignment of boxes with pixels, along one axis.
#[derive(Clone, Copy)]
struct AxisAlignment {
    /// Number of pixels, at least 1 where a method is called.
    pixels: u32,
    resolution_m: f64,
    box_size_m: f64,
}

impl AxisAlignment {
    /// Returns the box that holds the center of a pixel. Saturates far above any allowed size.
    fn box_at(self, pixel: u32) -> u64 {
        ((f64::from(pixel) + 0.5) * self.resolution_m / self.box_size_m).floor() as u64
    }

    /// Returns the pixel around the center of a box.
    fn center_pixel(self, index: u32) -> u32 {
        let pixel = ((f64::from(index) + 0.5) * self.box_size_m / self.resolution_m).floor();
        (pixel as u32).min(self.pixels - 1)
    }

    /// Returns the number of boxes, so that every pixel's center and every box with its center on the map is in one.
    fn boxes(self) -> u64 {
        let Some(last) = self.pixels.checked_sub(1) else { return 0 };
        let length = f64::from(self.pixels) * self.resolution_m / self.box_size_m;
        let with_center_on_map = (length - 0.5).ceil() as u64;
        with_center_on_map.max(self.box_at(last).saturating_add(1))
    }

    /// Returns the pixels that make up a box; at least one.
    fn pixels_of(self, index: u32) -> Range<usize> {
        let first = self.first_at_or_after(u64::from(index));
        let end = self.first_at_or_after(u64::from(index) + 1);
        if first < end {
            return first as usize..end as usize;
        }
        let pixel = self.center_pixel(index) as usize;
        pixel..pixel + 1
    }

    /// Returns the first pixel with its center in the box `index` or after it.
    fn first_at_or_after(self, index: u64) -> u32 {
        // `box_at` never decreases, so bisection finds the edge with the very formula that defines
        // it; its inverse could round to another pixel.
        let mut low = 0;
        let mut high = self.pixels;
        while low < high {
            let middle = low + (high - low) / 2;
            if self.box_at(middle) < index {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Cell::{Free, Unknown, Wall};
    use proptest::{num, prelude::*};

    fn at(origin_m: [f64; 2]) -> Isometry2 {
        Isometry2 { origin_m, yaw_rad: 0.0 }
    }

    fn row(pixels: &[Cell], resolution_m: f64) -> PixelMap {
        PixelMap::new(pixels.len() as u32, 1, resolution_m, at([1.0, 2.0]), pixels.to_vec())
    }

    /// The lowest row of boxes.
    fn boxes(map: &PixelMap, box_size_m: f64) -> Vec<Cell> {
        let boxes = map.to_boxes(box_size_m, UnknownPolicy::Keep).expect("boxes");
        (0..boxes.width()).map(|col| boxes.cell(col, 0)).collect()
    }

    #[test]
    fn any_occupied_pixel_makes_a_wall_and_else_any_unknown_one_an_unknown_box() {
        let pixels = [Free, Wall, Unknown, Free, Free, Unknown, Free, Free, Free];
        assert_eq!(boxes(&row(&pixels, 0.1), 0.3), [Wall, Unknown, Free]);
    }

    #[test]
    fn a_pixel_belongs_to_the_box_that_holds_its_center() {
        let pixels = [Free, Free, Wall, Free];
        assert_eq!(boxes(&row(&pixels, 0.38), 1.0), [Wall, Free], "center at 0.95");
        assert_eq!(boxes(&row(&pixels, 0.45), 1.0), [Free, Wall], "center at 1.125");
    }

    #[test]
    fn a_box_smaller_than_a_pixel_is_what_the_pixel_around_its_center_is() {
        let map = row(&[Free, Wall], 0.5);
        assert_eq!(boxes(&map, 0.25), [Free, Free, Wall, Wall]);
        assert_eq!(boxes(&map, 0.2), [Free, Free, Wall, Wall, Wall], "0.4..0.6: center 0.5");
        assert_eq!(boxes(&row(&[Wall], 1.0), 0.3), [Wall; 3]);
    }

    #[test]
    fn boxes_keep_the_plane_the_size_and_the_rows_from_the_bottom() {
        let plane = Isometry2 { origin_m: [-3.0, 4.0], yaw_rad: 3.0 };
        let map = PixelMap::new(1, 2, 0.5, plane, vec![Wall, Free]);
        let boxes = map.to_boxes(0.5, UnknownPolicy::Wall).expect("boxes");
        assert_eq!((boxes.plane, boxes.box_size_m), (plane, 0.5));
        assert_eq!(boxes.cells(), [Wall, Free]);
    }

    #[test]
    fn the_policy_says_what_unknown_boxes_become() {
        let map = row(&[Unknown], 0.5);
        for (policy, cell) in [
            (UnknownPolicy::Wall, Wall),
            (UnknownPolicy::Free, Free),
            (UnknownPolicy::Keep, Unknown),
        ] {
            assert_eq!(map.to_boxes(0.5, policy).expect("boxes").cells(), [cell]);
        }
    }

    #[test]
    fn wrong_and_absurdly_small_boxes_are_refused() {
        let map = row(&[Free; 4], 0.5);
        for wrong in [0.0, -0.5, f64::NAN, f64::INFINITY, 1e-9, f64::MIN_POSITIVE] {
            assert!(map.to_boxes(wrong, UnknownPolicy::Wall).is_err(), "{wrong}");
        }
        let empty = PixelMap::new(0, 0, 0.5, Isometry2::default(), Vec::new());
        assert!(empty.to_boxes(0.5, UnknownPolicy::Wall).is_err());
    }

    proptest! {
        #[test]
        fn boxes_of_any_size_are_made_or_refused_and_lose_no_wall(
            width in 1u32..20,
            height in 1u32..20,
            resolution_m in prop_oneof![0.001..10.0, num::f64::POSITIVE],
            box_size_m in prop_oneof![0.001..10.0f64, any::<f64>()],
            seed in any::<u64>(),
        ) {
            let cell = |i: u32| [Free, Wall, Unknown][(seed.rotate_right(i) % 3) as usize];
            let pixels: Vec<_> = (0..width * height).map(cell).collect();
            let map = PixelMap::new(width, height, resolution_m, Isometry2::default(), pixels);
            if let Ok(boxes) = map.to_boxes(box_size_m, UnknownPolicy::Keep) {
                prop_assert_eq!(map.counts().wall > 0, boxes.count(Wall) > 0);
                prop_assert!(map.counts().free > 0 || boxes.count(Free) == 0);
            }
        }
    }
}
