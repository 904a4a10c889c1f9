//! The map from places in meters to pixels, with the same scale in all directions.

use crate::svg::Rect;
use sidestep_kernel::geometry::dot;
use sidestep_kernel::view::Vec3;

/// A point in pixels, y downward.
pub(crate) type Px = (f64, f64);

/// Limit of drawing outside a picture, pixels: renderers work in single precision, which would lose the digits of places
/// farther away.
const MAX_OFFSET_PX: f64 = 1e5;

/// The direction of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Camera {
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    pub(crate) to_eye: Vec3,
}

impl Camera {
    /// View from above: x to the right, y up.
    pub(crate) const ABOVE: Self =
        Self { right: [1.0, 0.0, 0.0], up: [0.0, 1.0, 0.0], to_eye: [0.0, 0.0, 1.0] };
    /// View from the end of the x axis: y to the right, z up.
    pub(crate) const SIDE: Self =
        Self { right: [0.0, 1.0, 0.0], up: [0.0, 0.0, 1.0], to_eye: [1.0, 0.0, 0.0] };
    /// View from the beginning of the y axis: x to the right, z up.
    pub(crate) const FRONT: Self =
        Self { right: [1.0, 0.0, 0.0], up: [0.0, 0.0, 1.0], to_eye: [0.0, -1.0, 0.0] };
    /// View from a corner: 37 degrees about the vertical and 37 degrees above the horizon, in
    /// numbers that doubles hold almost exactly.
    pub(crate) const CORNER: Self =
        Self { right: [0.8, 0.6, 0.0], up: [-0.36, 0.48, 0.8], to_eye: [0.48, -0.64, 0.6] };

    /// Returns where a place is seen: meters to the right and up.
    pub(crate) fn project(&self, at: Vec3) -> [f64; 2] {
        [dot(self.right, at), dot(self.up, at)]
    }

    pub(crate) fn depth_m(&self, at: Vec3) -> f64 {
        dot(self.to_eye, at)
    }

    /// Returns the least and the greatest coordinate of a box's corners in some direction.
    pub(crate) fn range(direction: Vec3, box_m: [Vec3; 2]) -> [f64; 2] {
        let along = corners(box_m).map(|corner| dot(corner, direction));
        let least = along.into_iter().fold(f64::INFINITY, f64::min);
        [least, along.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    }
}

/// Returns the corners of a box; bit k of a corner's number says at which end of axis k it is.
pub(crate) fn corners([lo, hi]: [Vec3; 2]) -> [Vec3; 8] {
    std::array::from_fn(|bits| {
        std::array::from_fn(|k| if bits >> k & 1 == 1 { hi[k] } else { lo[k] })
    })
}

/// The map from places to a picture's pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Canvas {
    pub(crate) camera: Camera,
    pub(crate) px_per_m: f64,
    /// The pixel of the point seen at `seen_m`.
    pub(crate) zero: Px,
    pub(crate) origin_m: [f64; 2],
    /// The nearest and the farthest depth.
    pub(crate) depths_m: [f64; 2],
    /// Whether it shows things that all lie in a plane.
    pub(crate) is_plane: bool,
}

impl Canvas {
    /// Returns a view from above; `lo_m` is in the lower left corner of `map`.
    pub(crate) fn above(lo_m: [f64; 2], px_per_m: f64, map: Rect) -> Self {
        let zero = (map.x, map.bottom());
        Self {
            camera: Camera::ABOVE,
            px_per_m,
            zero,
            origin_m: lo_m,
            depths_m: [0.0, 1.0],
            is_plane: true,
        }
    }

    pub(crate) fn px(&self, place: Vec3) -> Px {
        let [right_m, up_m] = self.camera.project(place);
        let right_px = self.offset_px(right_m - self.origin_m[0]);
        let up_px = self.offset_px(up_m - self.origin_m[1]);
        (self.zero.0 + right_px, self.zero.1 - up_px)
    }

    fn offset_px(&self, length_m: f64) -> f64 {
        (length_m * self.px_per_m).clamp(-MAX_OFFSET_PX, MAX_OFFSET_PX)
    }

    /// Returns whether things that lie in a plane are seen from above, each on top of those of lower layers.
    pub(crate) fn is_above(&self) -> bool {
        self.is_plane
    }

    pub(crate) fn nearness(&self, place: Vec3) -> f64 {
        let [far_m, near_m] = self.depths_m;
        ((self.camera.depth_m(place) - far_m) / (near_m - far_m)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_directions_are_perpendicular_and_one_long() {
        let turned = Camera::from_angles(2.5, -0.7);
        let all = [Camera::ABOVE, Camera::SIDE, Camera::FRONT, Camera::CORNER, turned];
        for Camera { right, up, to_eye } in all {
            for (a, b, expected) in [
                (right, right, 1.0),
                (up, up, 1.0),
                (to_eye, to_eye, 1.0),
                (right, up, 0.0),
                (up, to_eye, 0.0),
                (to_eye, right, 0.0),
            ] {
                assert!((dot(a, b) - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn a_meter_is_as_long_in_both_directions() {
        let map = Rect { x: 40.0, y: 10.0, width: 300.0, height: 100.0 };
        let canvas = Canvas::above([1.0, 2.0], 7.0, map);
        assert_eq!(canvas.px([1.0, 2.0, 9.0]), (40.0, 110.0));
        assert_eq!(canvas.px([11.0, 2.0, 0.0]), (110.0, 110.0));
        assert_eq!(canvas.px([1.0, 12.0, 0.0]), (40.0, 40.0));
    }
}
