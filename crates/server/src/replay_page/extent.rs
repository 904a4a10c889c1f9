//! The size of what a run shows, which decides how exact places have to be.

use sidestep_kernel::view::{Body, Frame, Scenery, Shape};

/// Steps of places in the size of the scene, as a power of two. The page draws `f32`, which has 24 bits; two more keep
/// those that are small beside the scene. Fewer bits change single pixels, because edges are sharp.
const STEPS_EXPONENT: i32 = 26;

/// Returns the exponent of the finest step of places that matters, as a power of two in meters.
pub(super) fn finest_step_exponent(scenery: &Scenery, first: &Frame) -> i8 {
    let mut extent = Extent::default();
    scenery.bodies.iter().chain(&first.bodies).for_each(|body| extent.add_body(body));
    if let Some(floor) = &scenery.floor {
        let [width_m, height_m] = [floor.width, floor.height].map(|n| f64::from(n) * floor.box_m);
        for corner in [[0.0, 0.0], [width_m, 0.0], [0.0, height_m], [width_m, height_m]] {
            let [x_m, y_m] = floor.plane.transform_point(corner);
            extent.add([x_m, y_m, 0.0]);
        }
    }
    // Whole meters are enough for any scene: `exact` places are found by multiples of at most one.
    (exponent(extent.size_m()) - STEPS_EXPONENT).clamp(-60, 0) as i8
}

/// Returns the exponent of the largest power of two that is not above a number.
fn exponent(number: f64) -> i32 {
    (number.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

/// A box around places.
struct Extent {
    low_m: [f64; 3],
    high_m: [f64; 3],
}

impl Default for Extent {
    fn default() -> Self {
        Self { low_m: [f64::INFINITY; 3], high_m: [f64::NEG_INFINITY; 3] }
    }
}

impl Extent {
    fn add(&mut self, at_m: [f64; 3]) {
        for (axis, place_m) in at_m.into_iter().enumerate() {
            self.low_m[axis] = self.low_m[axis].min(place_m);
            self.high_m[axis] = self.high_m[axis].max(place_m);
        }
    }

    fn add_body(&mut self, body: &Body) {
        match &body.shape {
            Shape::Line { points_m, .. } => points_m.iter().for_each(|at_m| self.add(*at_m)),
            _ => self.add(body.pose.at_m),
        }
    }

    /// Returns the longest side; a meter where nothing has a size.
    fn size_m(&self) -> f64 {
        let sides = (0..3).map(|axis| self.high_m[axis] - self.low_m[axis]);
        let longest_m = sides.filter(|side| side.is_finite()).fold(0.0, f64::max);
        if longest_m > 0.0 { longest_m } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::robots::kinds::ROBOT;
    use sidestep_kernel::view::{EarthReference, Pose};

    fn exponent_of_scene(size_m: f64) -> i8 {
        let body = |x_m: f64| {
            let shape = Shape::Sphere { radius_m: 0.1 };
            Body::new(ROBOT, 0, Pose::from_position([x_m, 0.0, 0.0]), shape)
        };
        let frame = Frame { bodies: vec![body(-3.0), body(size_m - 3.0)], ..Frame::default() };
        let scenery = Scenery {
            name: String::new(),
            dimensions: 3,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: Vec::new(),
            groups: Vec::new(),
            earth: EarthReference::default(),
            traffic: None,
        };
        finest_step_exponent(&scenery, &frame)
    }

    #[test]
    fn steps_are_finer_than_what_is_drawn() {
        assert_eq!([24.0, 40.0, 26_000.0].map(exponent_of_scene), [-22, -21, -12]);
        assert_eq!([0.0, 1e9].map(exponent_of_scene), [-26, 0]);
    }
}
