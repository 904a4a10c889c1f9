//! Ray casting on a map of pixels: the obstacle that a beam should hit.

use sidestep_kernel::math::{cos, sin};
use sidestep_map::Cell;

use super::PixelMap;

/// The first obstacle that a beam hits on a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RayHit {
    /// A wall, at a range in meters.
    Wall(f64),
    /// An unmapped pixel, or the edge of the map.
    Unknown,
    /// Nothing within the range.
    Nothing,
}

impl PixelMap {
    /// Returns the first obstacle on a beam of `range_m` meters that starts at a position in the world, in a
    /// direction in radians, counterclockwise from x.
    ///
    /// The beam goes from pixel to pixel (Amanatides and Woo, "A fast voxel traversal algorithm for ray tracing", 1987),
    /// so it misses no pixel, however thin a wall is.
    pub fn cast_ray(&self, from_m: [f64; 2], direction_rad: f64, range_m: f64) -> RayHit {
        let side_m = self.resolution_m();
        let [x, y] = self.plane().inverse_transform_point(from_m).map(|along_m| along_m / side_m);
        let angle_rad = direction_rad - self.plane().yaw_rad;
        let mut column = RayAxis::new(x, cos(angle_rad));
        let mut row = RayAxis::new(y, sin(angle_rad));
        let mut length = 0.0;
        loop {
            match self.pixel(column.index, row.index) {
                Some(Cell::Wall) => return RayHit::Wall(length * side_m),
                Some(Cell::Free) => {}
                Some(Cell::Unknown) | None => return RayHit::Unknown,
            }
            let nearer =
                if column.border_length <= row.border_length { &mut column } else { &mut row };
            length = nearer.border_length;
            if length * side_m > range_m {
                return RayHit::Nothing;
            }
            nearer.cross();
        }
    }

    fn pixel(&self, column: f64, row: f64) -> Option<Cell> {
        let is_on_map = (0.0..f64::from(self.width())).contains(&column)
            && (0.0..f64::from(self.height())).contains(&row);
        if !is_on_map {
            return None;
        }
        Some(self.pixels()[row as usize * self.width() as usize + column as usize])
    }
}

/// A beam along one axis; lengths are in pixels along the beam.
struct RayAxis {
    /// The column or row of the present pixel; a whole number, which may be outside of the map.
    index: f64,
    /// The length at which the beam leaves the pixel along this axis.
    border_length: f64,
    /// The length between two borders; infinite where the beam never crosses one.
    length_per_pixel: f64,
    /// 1 or -1: the change of the index at a border.
    step: f64,
}

impl RayAxis {
    /// `component` is the beam's unit vector along the axis.
    fn new(start: f64, component: f64) -> Self {
        let index = start.floor();
        let step = component.signum();
        let to_border = if step > 0.0 { index + 1.0 - start } else { start - index };
        let length_per_pixel = 1.0 / component.abs();
        // 0 times infinity would be NaN.
        let border_length =
            if component == 0.0 { f64::INFINITY } else { to_border * length_per_pixel };
        Self { index, border_length, length_per_pixel, step }
    }

    /// Goes to the next pixel along this axis.
    fn cross(&mut self) {
        self.index += self.step;
        self.border_length += self.length_per_pixel;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::view::Isometry2;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    /// Six by four pixels of half a meter; the lower-left corner is at (1, 2).
    fn map(yaw_rad: f64) -> PixelMap {
        let rows = ["######", "#...?#", "#....#", "######"];
        let cell = |letter: char| match letter {
            '#' => Cell::Wall,
            '?' => Cell::Unknown,
            _ => Cell::Free,
        };
        let pixels = rows.iter().rev().flat_map(|row| row.chars().map(cell)).collect();
        PixelMap::new(6, 4, 0.5, Isometry2 { origin_m: [1.0, 2.0], yaw_rad }, pixels)
    }

    fn wall_m(found: RayHit) -> f64 {
        match found {
            RayHit::Wall(range_m) => range_m,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_beam_ends_at_the_first_wall_in_its_direction() {
        let (map, from_m) = (map(0.0), [2.25, 2.75]);
        for (direction_rad, expected_m) in [(0.0, 1.25), (PI, 0.75), (-FRAC_PI_2, 0.25)] {
            let found_m = wall_m(map.cast_ray(from_m, direction_rad, 9.0));
            assert!((found_m - expected_m).abs() < 1e-9, "{direction_rad}: {found_m}");
        }
        let found_m = wall_m(map.cast_ray([1.75, 2.75], FRAC_PI_4, 9.0));
        assert!((found_m - 0.75 * 2f64.sqrt()).abs() < 1e-9, "{found_m}");
    }

    #[test]
    fn a_beam_that_is_too_short_meets_nothing_and_one_that_starts_in_a_wall_meets_it_at_once() {
        assert_eq!(map(0.0).cast_ray([2.25, 2.75], 0.0, 1.2), RayHit::Nothing);
        assert_eq!(map(0.0).cast_ray([1.25, 2.25], 0.0, 9.0), RayHit::Wall(0.0));
    }

    #[test]
    fn what_nobody_has_mapped_hides_what_is_behind() {
        assert_eq!(map(0.0).cast_ray([2.25, 3.25], 0.0, 9.0), RayHit::Unknown);
        assert_eq!(map(0.0).cast_ray([0.0, 0.0], 0.0, 9.0), RayHit::Unknown);
        assert_eq!(map(0.0).cast_ray([f64::NAN, 0.0], 0.0, 9.0), RayHit::Unknown);
    }

    #[test]
    fn a_turned_map_turns_its_walls() {
        let found_m = wall_m(map(FRAC_PI_2).cast_ray([0.25, 3.25], FRAC_PI_2, 9.0));
        assert!((found_m - 1.25).abs() < 1e-9, "{found_m}");
    }
}
