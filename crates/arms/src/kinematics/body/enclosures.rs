//! An arm's body as others see it: obstacles that enclose its parts, and the box that these may enter.

use super::super::transform::Vector;
use super::surroundings::BodyPosture;
use super::travel::BodyTravel;
use super::{ArmBody, PlacedShape, ShapeCore, point, vector};
use sidestep_rods::Obstacle;
use sidestep_rods::geometry::{Aabb, ConvexCore, Cuboid, convert_dimensions};

/// Half length of a cylinder, in radii, above which a rod with round ends encloses it more closely than a box: their
/// volumes are 2 pi r^2 h + 4/3 pi r^3 and 8 r^2 h.
const LONG_CYLINDER: f64 = 2.44;

impl ArmBody {
    /// Returns obstacles of one id that enclose its parts at a posture. Boxes, balls and rods stand as they are, a long
    /// cylinder as a rod with round ends, a short one and the hull of a mesh as the box around it.
    pub fn enclosures<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        id: u32,
    ) -> Vec<Obstacle<D>> {
        let shapes = self.shapes_at(posture);
        let parts = self.parts.iter().zip(&shapes);
        parts.map(|(part, shape)| enclosure(&part.core, shape, id)).collect()
    }

    /// Returns the box that its parts may enter if the joints change from a posture by up to `changes`.
    pub fn reach_box(
        &self,
        travel: &BodyTravel,
        posture: BodyPosture<'_>,
        changes: &[f64],
    ) -> Aabb<3> {
        let shapes = self.shapes_at(posture);
        let mut reach = Aabb::empty();
        for (index, (part, shape)) in self.parts.iter().zip(&shapes).enumerate() {
            let ball = Aabb::from_points(&[shape.center_m]);
            reach = reach.joined(&ball.grown(part.radius_m + travel.part_m(index, changes)));
        }
        reach
    }
}

/// Returns an obstacle that encloses a part.
fn enclosure<const D: usize>(core: &ShapeCore, placed: &PlacedShape, id: u32) -> Obstacle<D> {
    let place = |at: Vector| convert_dimensions(point(placed.pose * vector(at)));
    let capsule = |ends: [Vector; 2], radius_m| Obstacle::capsule(id, ends.map(place), radius_m);
    match core {
        ShapeCore::Ball(ball) => {
            Obstacle::ball(id, convert_dimensions(placed.center_m), ball.radius)
        }
        ShapeCore::Rod(rod) => {
            capsule([point(rod.0.segment.a), point(rod.0.segment.b)], rod.0.radius)
        }
        ShapeCore::Cylinder(cylinder) if cylinder.half_height > LONG_CYLINDER * cylinder.radius => {
            // Those of parry are along y.
            let end = |sign: f64| [0.0, sign * cylinder.half_height, 0.0];
            capsule([end(-1.0), end(1.0)], cylinder.radius)
        }
        ShapeCore::Cylinder(_) | ShapeCore::Box(_) | ShapeCore::Hull(_) => {
            let around = core.shape().compute_local_aabb();
            let axis = |i: usize| {
                let mut unit = [0.0; 3];
                unit[i] = 1.0;
                convert_dimensions(point(placed.pose.rotation * vector(unit)))
            };
            let cuboid = Cuboid {
                center: place(point(around.center())),
                axes: std::array::from_fn(axis),
                half_m: convert_dimensions(point(around.half_extents())),
            };
            Obstacle::new_static(id, ConvexCore::Cuboid(cuboid), 0.0)
        }
    }
}
