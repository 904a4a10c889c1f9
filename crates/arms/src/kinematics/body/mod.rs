//! The body of an arm: the collision shapes of a model's links, and which of them may touch.
//!
//! ```text
//! hull   the convex hulls of meshes
//! mount  where a link of the model is, at a posture of the arm
//! pairs  the pairs of parts that must not touch
//! contacts  overlaps with obstacles in the world, and of own parts
//! surroundings  distances from them
//! travel  bounds on the travel of parts
//! enclosures  the body as an obstacle to others
//! path   the check of a straight path of the joints
//! ```
//!
//! All links of the model count, those beside the arm as well (a second finger, the column that an
//! arm stands on): they stay where their joints are at rest, unless these follow joints of the arm.
//! Distances are those of the crate `parry3d-f64`.

mod contacts;
mod enclosures;
mod hull;
mod mount;
mod pairs;
mod path;
mod surroundings;
#[cfg(test)]
mod tests;
mod travel;

pub use contacts::BodyContact;
pub use path::BodyPathCheck;
pub use surroundings::BodyPosture;
pub use travel::BodyTravel;

use super::serial::{LinkFrames, SerialChain};
use super::transform::{Transform, Vector};
use mount::LinkMountsOnArm;
use parry3d_f64::math::{Pose as ParryPose, Rotation, Vector as ParryVector};
use parry3d_f64::query::{self, Contact};
use parry3d_f64::shape::{Ball, Capsule, ConvexPolyhedron, Cuboid, Cylinder, Shape as ParryShape};
use sidestep_import::urdf::{Model, Shape, Solid};
use sidestep_kernel::geometry::norm;

/// The shapes of an arm's links, and of all links that hang on them or carry the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmBody {
    parts: Vec<LinkShape>,
    /// Parts that must not touch, each pair once, the lesser index first.
    pairs: Vec<(usize, usize)>,
}

/// A shape that is fixed in a link.
#[derive(Debug, Clone, PartialEq)]
struct LinkShape {
    /// Name of its link, for reports.
    link: String,
    /// Where its center is, at any posture.
    mount: mount::LinkMount,
    core: ShapeCore,
    /// Radius of a ball about its center that holds it, in m.
    radius_m: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum ShapeCore {
    Ball(Ball),
    Cylinder(Cylinder),
    Box(Cuboid),
    Hull(ConvexPolyhedron),
    Rod(RodShape),
}

/// A rod with round ends. The library's own type has no equality.
#[derive(Debug, Clone)]
struct RodShape(Capsule);

impl PartialEq for RodShape {
    fn eq(&self, other: &Self) -> bool {
        let ends = |rod: &Self| [rod.0.segment.a, rod.0.segment.b].map(point);
        ends(self) == ends(other) && self.0.radius == other.0.radius
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedShape {
    pose: ParryPose,
    center_m: Vector,
}

/// Two bodies that are nearer to each other than a distance.
pub(super) struct Proximity {
    /// The point of the first that is nearest to the second, or deepest in it.
    pub(super) first_m: Vector,
    /// The point of the second.
    pub(super) second_m: Vector,
    /// The unit vector in which the first gets away.
    pub(super) away: Vector,
    /// Their distance in m; negative if they overlap.
    pub(super) apart_m: f64,
}

impl ArmBody {
    /// Returns the body of an arm between two links of `model`. `solids` are the model's shapes, and
    /// `may_touch` pairs of its links, by index, that need no check beside those that a joint
    /// connects, as SRDF names them.
    pub fn new(
        model: &Model,
        chain: &SerialChain,
        solids: &[Solid],
        may_touch: &[(usize, usize)],
    ) -> Self {
        let mounts = LinkMountsOnArm::new(model, chain);
        let mut parts = Vec::new();
        let mut links = Vec::new();
        for solid in solids {
            if let Some(part) = LinkShape::new(model, &mounts, solid) {
                parts.push(part);
                links.push(solid.link);
            }
        }
        let pairs = pairs::collision_candidate_pairs(model, &mounts, &links, may_touch);
        Self { parts, pairs }
    }

    /// Returns whether it has no shapes at all.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Returns whether a link that the joints move has a shape.
    pub fn has_moving_shape(&self) -> bool {
        self.parts.iter().any(|part| part.mount.link > 0)
    }

    /// Returns the number of its parts that are convex hulls of meshes.
    pub fn hulls(&self) -> usize {
        self.parts.iter().filter(|part| matches!(part.core, ShapeCore::Hull(_))).count()
    }

    /// Returns the pairs of links that must not touch, by name, each once.
    pub fn pairs(&self) -> Vec<(&str, &str)> {
        let mut names: Vec<(&str, &str)> =
            self.pairs.iter().map(|&(a, b)| (self.name(a), self.name(b))).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Returns the depth in m of each pair of links that must not touch and overlaps at these joint
    /// values.
    pub fn link_overlaps(&self, chain: &SerialChain, values: &[f64]) -> Vec<(&str, &str, f64)> {
        let mut shapes = Vec::new();
        self.place_shapes(&chain.forward_kinematics(values), values, &mut shapes);
        let placed = PlacedBody { body: self, shapes: &shapes };
        let mut overlaps = Vec::new();
        for &(a, b) in &self.pairs {
            if let Some(near) = placed.proximity(a, b, 0.0).filter(|near| near.apart_m < 0.0) {
                overlaps.push((self.name(a), self.name(b), -near.apart_m));
            }
        }
        overlaps
    }

    /// Returns whether a link of the arm, counted as [`LinkFrames::links`] are, has a shape.
    pub(super) fn has_shape(&self, link: usize) -> bool {
        self.parts.iter().any(|part| part.mount.link == link)
    }

    pub(super) fn name(&self, part: usize) -> &str {
        &self.parts[part].link
    }

    /// Returns the link of the arm that a part moves with.
    pub(super) fn link(&self, part: usize) -> usize {
        self.parts[part].mount.link
    }

    pub(super) fn len(&self) -> usize {
        self.parts.len()
    }

    pub(super) fn own_pairs(&self) -> &[(usize, usize)] {
        &self.pairs
    }

    /// Computes the places of all parts; `values` move those beside the arm that follow its joints.
    pub(super) fn place_shapes(
        &self,
        frames: &LinkFrames,
        values: &[f64],
        placed: &mut Vec<PlacedShape>,
    ) {
        self.place_shapes_on(&frames.links, values, placed);
    }

    /// The same from the poses of the links alone, for those that forward kinematics put into a
    /// buffer.
    pub(super) fn place_shapes_on(
        &self,
        links: &[Transform],
        values: &[f64],
        placed: &mut Vec<PlacedShape>,
    ) {
        placed.clear();
        placed.extend(self.parts.iter().map(|part| {
            let pose = part.mount.transform(links, values);
            let upright = part.core.parry3d_pose(&pose);
            PlacedShape { pose: upright, center_m: pose.origin_m }
        }));
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct PlacedBody<'a> {
    pub(super) body: &'a ArmBody,
    /// By the index of the part.
    pub(super) shapes: &'a [PlacedShape],
}

impl PlacedBody<'_> {
    /// Returns the relation of two parts, if they are nearer than `within_m`.
    pub(super) fn proximity(&self, a: usize, b: usize, within_m: f64) -> Option<Proximity> {
        let Self { body: ArmBody { parts, .. }, shapes } = self;
        let far_m = parts[a].radius_m + parts[b].radius_m + within_m;
        // The balls around both are apart: far cheaper than a query of parry, and true of most pairs.
        if apart_m(shapes[a].center_m, shapes[b].center_m) > far_m {
            return None;
        }
        let cores = [a, b].map(|part| parts[part].core.shape());
        proximity_within(&shapes[a].pose, cores[0], &shapes[b].pose, cores[1], within_m)
    }

    /// Returns the relation of a part to a ball, if they are nearer than `within_m`.
    pub(super) fn ball_proximity(
        &self,
        part: usize,
        center_m: Vector,
        radius_m: f64,
        within_m: f64,
    ) -> Option<Proximity> {
        let LinkShape { core, radius_m: part_radius_m, .. } = &self.body.parts[part];
        let shape = &self.shapes[part];
        let far_m = part_radius_m + radius_m + within_m;
        if apart_m(shape.center_m, center_m) > far_m {
            return None;
        }
        let at = ParryPose::from_parts(vector(center_m), Rotation::IDENTITY);
        proximity_within(&shape.pose, core.shape(), &at, &Ball::new(radius_m), within_m)
    }
}

impl LinkShape {
    /// Returns a solid of a model as a part of an arm's body; `None` for shapes that are not among those of bodies.
    fn new(model: &Model, mounts: &LinkMountsOnArm, solid: &Solid) -> Option<Self> {
        let own = Transform::from_urdf_origin(&solid.origin);
        let center = Transform { origin_m: solid.center_m, ..Transform::IDENTITY };
        let core = core(&solid.shape)?;
        Some(Self {
            link: model.links[solid.link].clone(),
            mount: mounts.mount_in_link(solid.link, own.compose(&center)),
            radius_m: core.radius_m(),
            core,
        })
    }
}

impl ShapeCore {
    fn shape(&self) -> &dyn ParryShape {
        match self {
            Self::Ball(ball) => ball,
            Self::Cylinder(cylinder) => cylinder,
            Self::Box(cuboid) => cuboid,
            Self::Hull(hull) => hull,
            Self::Rod(rod) => &rod.0,
        }
    }

    fn radius_m(&self) -> f64 {
        match self {
            Self::Ball(ball) => ball.radius,
            Self::Cylinder(c) => norm([c.half_height, c.radius]),
            Self::Box(cuboid) => norm(point(cuboid.half_extents)),
            Self::Hull(hull) => hull.points().iter().map(|p| norm(point(*p))).fold(0.0, f64::max),
            Self::Rod(rod) => norm(point(rod.0.segment.a)) + rod.0.radius,
        }
    }

    /// Returns the pose in which parry draws it: cylinders of models are along z, those of parry
    /// along y.
    fn parry3d_pose(&self, pose: &Transform) -> ParryPose {
        const UP: Transform = Transform {
            rotation: [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            origin_m: [0.0; 3],
        };
        let pose = if matches!(self, Self::Cylinder(_)) { pose.compose(&UP) } else { *pose };
        let [x, y, z, w] = pose.quaternion();
        ParryPose::from_parts(vector(pose.origin_m), Rotation::from_xyzw(x, y, z, w))
    }
}

fn core(shape: &Shape) -> Option<ShapeCore> {
    match shape {
        Shape::Sphere { radius_m } => Some(ShapeCore::Ball(Ball::new(*radius_m))),
        Shape::Cylinder { radius_m, length_m } => {
            Some(ShapeCore::Cylinder(Cylinder::new(0.5 * length_m, *radius_m)))
        }
        Shape::Box { size_m } => Some(ShapeCore::Box(Cuboid::new(vector(size_m.map(|x| 0.5 * x))))),
        Shape::Hull { points_m } => Some(match hull::of_points(points_m) {
            Some(hull) => ShapeCore::Hull(hull),
            // Nothing has thickness, or numbers are too near to each other.
            None => ShapeCore::Box(Cuboid::new(vector(hull::half_extents_m(points_m)))),
        }),
        // Solids are none of these.
        Shape::Mesh { .. } | Shape::Other { .. } => None,
    }
}

fn proximity_within(
    at: &ParryPose,
    shape: &dyn ParryShape,
    other_at: &ParryPose,
    other: &dyn ParryShape,
    within_m: f64,
) -> Option<Proximity> {
    let found = query::contact(at, shape, other_at, other, within_m);
    let Contact { point1, point2, normal2, dist, .. } = found.expect("convex shapes")?;
    Some(Proximity {
        first_m: point(point1),
        second_m: point(point2),
        away: point(normal2),
        apart_m: dist,
    })
}

fn vector(p: Vector) -> ParryVector {
    ParryVector::new(p[0], p[1], p[2])
}

fn point(v: ParryVector) -> Vector {
    [v.x, v.y, v.z]
}

fn apart_m(a: Vector, b: Vector) -> f64 {
    norm([a[0] - b[0], a[1] - b[1], a[2] - b[2]])
}
