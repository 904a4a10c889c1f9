//! Distances of an arm's body from obstacles around it, and between its own parts.

use super::super::serial::SerialChain;
use super::super::skeleton::Skeleton;
use super::super::transform::{Transform, Vector};
use super::mount::LinkMount;
use super::{
    ArmBody, LinkShape, PlacedBody, PlacedShape, RodShape, ShapeCore, proximity_within, vector,
};
use parry3d_f64::math::{Pose as ParryPose, Rotation};
use parry3d_f64::shape::{Ball, Capsule, Cuboid, Shape as ParryShape};
use sidestep_kernel::geometry::{cross, scaled, sub};
use sidestep_rods::geometry::{Aabb, ConvexCore, convert_dimensions};
use sidestep_rods::{Obstacle, Obstacles};

/// A posture of an arm in the world.
#[derive(Clone, Copy)]
pub struct BodyPosture<'a> {
    /// The joints.
    pub chain: &'a SerialChain,
    /// Position of the base's frame; its axes are those of the world.
    pub at_m: Vector,
    /// A value for each variable.
    pub values: &'a [f64],
}

/// The nearest body to one that moves.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NearestBody {
    link: usize,
    obstacle: Option<u32>,
    /// Distance in m, negative where they overlap.
    apart_m: f64,
}

impl ArmBody {
    /// Returns the body with a capsule for each rod of a skeleton (`chain`'s) none of whose links has a shape, as thick
    /// as `radius_m`. Rods that change their length have none.
    #[must_use]
    pub fn with_rods(mut self, chain: &SerialChain, skeleton: &Skeleton, radius_m: f64) -> Self {
        for rod in 0..skeleton.rods.len() {
            let [inner, outer] = [skeleton.connectors[rod], skeleton.connectors[rod + 1]];
            let is_rigid = outer.first <= inner.last;
            let mut links = inner.first.max(outer.first)..=inner.last.min(outer.last);
            if is_rigid && !links.any(|link| self.has_shape(link)) {
                self.add_rod(chain, skeleton, rod, radius_m);
            }
        }
        self
    }

    /// Returns the body with a tool: the last rod of the skeleton (`chain`'s) as a capsule, and a ball around its end.
    /// It may touch the link that carries it.
    #[must_use]
    pub fn with_tool(
        mut self,
        chain: &SerialChain,
        skeleton: &Skeleton,
        [tool_m, load_m]: [Option<f64>; 2],
    ) -> Self {
        let Some(last) = skeleton.rods.len().checked_sub(1) else { return self };
        if let Some(radius_m) = tool_m {
            self.add_rod(chain, skeleton, last, radius_m);
        }
        if let Some(radius_m) = load_m {
            let link = chain.joints.len();
            let end = Transform::from_translation(chain.to_tip.origin_m);
            self.add_part(
                "load",
                LinkMount::rigid(link, end),
                ShapeCore::Ball(Ball::new(radius_m)),
            );
        }
        self
    }

    fn add_rod(&mut self, chain: &SerialChain, skeleton: &Skeleton, rod: usize, radius_m: f64) {
        let frames = chain.forward_kinematics(&vec![0.0; chain.variables.len()]);
        let ends = [skeleton.connectors[rod], skeleton.connectors[rod + 1]];
        let link = ends[0].first.max(ends[1].first);
        let [a, b] =
            ends.map(|end| frames.links[link].inverse_transform_point(end.position_m(&frames)));
        let middle = scaled([0, 1, 2].map(|i| a[i] + b[i]), 0.5);
        let capsule = Capsule::new(vector(sub(a, middle)), vector(sub(b, middle)), radius_m);
        let mount = LinkMount::rigid(link, Transform::from_translation(middle));
        self.add_part(&format!("rod {rod}"), mount, ShapeCore::Rod(RodShape(capsule)));
    }

    /// Adds a part that must not touch any other one but those of its own link and of its neighbors.
    fn add_part(&mut self, name: &str, mount: LinkMount, core: ShapeCore) {
        let new = self.parts.len();
        let link = mount.link;
        self.parts.push(LinkShape { link: name.into(), mount, radius_m: core.radius_m(), core });
        for part in 0..new {
            if self.link(part).abs_diff(link) > 1 {
                self.pairs.push((part, new));
            }
        }
    }

    /// Leaves the pairs out that overlap at a posture, because a body that touches itself there may do so; returns
    /// their names and depths in m.
    pub fn exempt_overlaps(&mut self, posture: BodyPosture<'_>) -> Vec<(String, String, f64)> {
        let shapes = self.shapes_at(posture);
        let mut exempt = Vec::new();
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.retain(|&(a, b)| {
            let placed = PlacedBody { body: self, shapes: &shapes };
            let overlap = placed.proximity(a, b, 0.0).filter(|near| near.apart_m < 0.0);
            if let Some(near) = &overlap {
                exempt.push((self.name(a).into(), self.name(b).into(), -near.apart_m));
            }
            overlap.is_none()
        });
        self.pairs = pairs;
        exempt
    }

    /// Returns the least distance of a part from an obstacle up to `look_m`, and the link of that part; negative where
    /// they overlap.
    pub fn clearance_m<const D: usize>(
        &self,
        posture: BodyPosture<'_>,
        obstacles: &Obstacles<D>,
        look_m: f64,
    ) -> (f64, usize) {
        let nearest = self.nearest_obstacle(&self.shapes_at(posture), obstacles, look_m);
        nearest.map_or((look_m, 0), |near| (near.apart_m, near.link))
    }

    /// Returns the least distance of two parts that must not touch; negative where they overlap, infinite if it is more
    /// than `within_m`.
    pub fn own_gap_m(&self, posture: BodyPosture<'_>, within_m: f64) -> f64 {
        let nearest = self.nearest_own_part(&self.shapes_at(posture), within_m);
        nearest.map_or(f64::INFINITY, |near| near.apart_m)
    }

    /// Returns where all parts are in the world.
    pub(super) fn shapes_at(&self, posture: BodyPosture<'_>) -> Vec<PlacedShape> {
        let mut shapes = Vec::with_capacity(self.parts.len());
        self.place_shapes_at(posture, &mut shapes);
        shapes
    }

    /// Computes where all parts are in the world.
    pub(super) fn place_shapes_at(&self, posture: BodyPosture<'_>, shapes: &mut Vec<PlacedShape>) {
        let BodyPosture { chain, at_m, values } = posture;
        let mut frames = chain.forward_kinematics(values);
        let base = Transform::from_translation(at_m);
        frames.links.iter_mut().for_each(|link| *link = base.compose(link));
        self.place_shapes(&frames, values, shapes);
    }

    fn nearest_own_part(&self, shapes: &[PlacedShape], within_m: f64) -> Option<NearestBody> {
        let placed = PlacedBody { body: self, shapes };
        let mut nearest: Option<NearestBody> = None;
        for &(a, b) in &self.pairs {
            let reach_m = nearest.map_or(within_m, |near| near.apart_m.max(0.0));
            let Some(near) = placed.proximity(a, b, reach_m) else { continue };
            if nearest.is_none_or(|other| near.apart_m < other.apart_m) {
                let link = self.link(a).max(self.link(b));
                nearest = Some(NearestBody { link, obstacle: None, apart_m: near.apart_m });
            }
        }
        nearest
    }

    /// Returns the obstacle nearest to any part that moves, up to `within_m`; of equally near ones that of the least
    /// id.
    fn nearest_obstacle<const D: usize>(
        &self,
        shapes: &[PlacedShape],
        obstacles: &Obstacles<D>,
        within_m: f64,
    ) -> Option<NearestBody> {
        let mut nearest: Option<NearestBody> = None;
        for (part, shape) in self.parts.iter().zip(shapes) {
            if part.is_fixed_in_base() {
                continue;
            }
            let center = convert_dimensions(shape.center_m);
            let room = Aabb::from_points(&[center]).grown(part.radius_m + within_m);
            obstacles.visit(&room, |obstacle| {
                let Some(apart_m) = part.distance_m(shape, obstacle, within_m) else { return };
                let order = |near: &NearestBody| (near.apart_m, near.obstacle);
                let found =
                    NearestBody { link: part.mount.link, obstacle: Some(obstacle.id), apart_m };
                if nearest.is_none_or(|other| order(&found) < order(&other)) {
                    nearest = Some(found);
                }
            });
        }
        nearest
    }
}

impl LinkShape {
    /// Returns whether it never moves.
    pub(super) fn is_fixed_in_base(&self) -> bool {
        self.mount.link == 0 && self.mount.is_rigid()
    }

    /// Returns the distance of the part from an obstacle in m, if it is at most `within_m`.
    pub(super) fn distance_m<const D: usize>(
        &self,
        placed: &PlacedShape,
        obstacle: &Obstacle<D>,
        within_m: f64,
    ) -> Option<f64> {
        let center = convert_dimensions(placed.center_m);
        let gap_m = obstacle.core.nearest_to_point(center).distance_m - obstacle.radius_m;
        // The ball around the part is apart from it: far cheaper than a query of parry.
        if gap_m > self.radius_m + within_m {
            return None;
        }
        let upright = |at_m: Vector| ParryPose::from_parts(vector(at_m), Rotation::IDENTITY);
        let apart_m = |at: &ParryPose, other: &dyn ParryShape, within_m: f64| {
            let near = proximity_within(&placed.pose, self.core.shape(), at, other, within_m)?;
            Some(near.apart_m)
        };
        match &obstacle.core {
            ConvexCore::Point(at) => {
                let ball = Ball::new(obstacle.radius_m);
                apart_m(&upright(convert_dimensions(*at)), &ball, within_m)
            }
            ConvexCore::Segment(ends) => {
                let [a, b]: [Vector; 2] = ends.map(convert_dimensions);
                let middle = scaled([0, 1, 2].map(|i| a[i] + b[i]), 0.5);
                let ends = [a, b].map(|end| vector(sub(end, middle)));
                let capsule = Capsule::new(ends[0], ends[1], obstacle.radius_m);
                apart_m(&upright(middle), &capsule, within_m)
            }
            ConvexCore::Cuboid(cuboid) => {
                let [x, y]: [Vector; 2] = [0, 1].map(|i| convert_dimensions(cuboid.axes[i]));
                let z = cross(x, y);
                let turned = Transform {
                    rotation: [0, 1, 2].map(|i| [x[i], y[i], z[i]]),
                    origin_m: convert_dimensions(cuboid.center),
                };
                let [qx, qy, qz, qw] = turned.quaternion();
                let rotation = Rotation::from_xyzw(qx, qy, qz, qw);
                let at = ParryPose::from_parts(vector(turned.origin_m), rotation);
                let solid = Cuboid::new(vector(convert_dimensions(cuboid.half_m)));
                // Its edges are round: it is grown by its radius on all sides.
                let core_m = apart_m(&at, &solid, within_m + obstacle.radius_m)?;
                Some(core_m - obstacle.radius_m)
            }
        }
    }
}
