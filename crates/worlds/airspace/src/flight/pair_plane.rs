//! The plane in which two airplanes are compared.
//!
//! On the earth each of the two flies in a frame of its own. Both are carried by rigid motions into the plane at the
//! middle of the shortest path between the origins of the frames, with x along that path: turned by the direction of
//! the path at either end, and moved by half of its length. So the comparison depends on these two airplanes alone,
//! whatever others are in their group, and has the same bits whichever of the two comes first.
//!
//! The plane is not the earth. `shield/curvature.rs` says how much a distance in it may be wrong.

use super::motion::{Point, Pose2, distance_m};
use super::surface::Frame;
use sidestep_kernel::geometry::dot;
use sidestep_kernel::math;

/// A rotation and then a translation of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RigidMotion {
    /// The direction that becomes that of x.
    along: Point,
    to_x_m: f64,
    /// Angle of the rotation.
    turn_rad: f64,
}

impl RigidMotion {
    fn new(along: Point, to_x_m: f64) -> Self {
        Self { along, to_x_m, turn_rad: -math::atan2(along[1], along[0]) }
    }

    /// Returns where a point goes.
    #[inline]
    pub(crate) fn point(&self, at: Point) -> Point {
        let [x, y] = self.direction(at);
        [x + self.to_x_m, y]
    }

    /// Returns where a vector points.
    #[inline]
    pub(crate) fn direction(&self, vector: Point) -> Point {
        let [east, north] = self.along;
        [dot(vector, self.along), east * vector[1] - north * vector[0]]
    }

    /// Returns what becomes of an angle.
    pub(crate) fn angle_rad(&self, rad: f64) -> f64 {
        rad + self.turn_rad
    }

    /// Returns where a pose goes.
    pub(crate) fn pose(&self, pose: Pose2) -> Pose2 {
        Pose2 { at: self.point(pose.at), heading_rad: self.angle_rad(pose.heading_rad) }
    }
}

/// The plane of a pair: that of the scenario, or motions from two frames into the plane in the middle between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairPlane(Option<[RigidMotion; 2]>);

impl PairPlane {
    /// The plane of two airplanes whose motions are in one frame.
    pub const ONE_FRAME: Self = Self(None);

    /// Returns the plane of two airplanes in these frames.
    pub fn between(a: Frame, b: Frame) -> Self {
        let Some((a, b)) = a.0.zip(b.0) else { return Self(None) };
        let path = a.path_to(&b);
        let half_m = 0.5 * path.length_m;
        Self(Some([RigidMotion::new(path.start, -half_m), RigidMotion::new(path.end, half_m)]))
    }

    /// Returns the motions of the two frames into the plane; none where both lie in it.
    pub(crate) fn motions(&self) -> Option<&[RigidMotion; 2]> {
        self.0.as_ref()
    }

    /// Returns a point of the first frame and one of the second in the plane.
    #[inline]
    pub(crate) fn points(&self, p: Point, q: Point) -> [Point; 2] {
        match &self.0 {
            None => [p, q],
            Some([first, second]) => [first.point(p), second.point(q)],
        }
    }

    /// Returns the squares of the distances in square meters between at most `N` points of the first frame and as many of
    /// the second; infinite beyond the last of either.
    #[inline]
    pub(crate) fn squared_distances_m2<const N: usize>(
        &self,
        a: &[Point],
        b: &[Point],
    ) -> [f64; N] {
        let mut squares_m2 = [f64::INFINITY; N];
        let pairs = squares_m2.iter_mut().zip(a.iter().zip(b));
        let square_m2 = |p: Point, q: Point| {
            let dx = p[0] - q[0];
            let dy = p[1] - q[1];
            dx * dx + dy * dy
        };
        // One decision for all points, so that the loops are vectorized.
        match &self.0 {
            None => pairs.for_each(|(square, (p, q))| *square = square_m2(*p, *q)),
            Some([first, second]) => {
                pairs.for_each(|(square, (p, q))| {
                    *square = square_m2(first.point(*p), second.point(*q))
                });
            }
        }
        squares_m2
    }

    /// Returns the distance between a point of the first frame and one of the second.
    #[inline]
    pub fn distance_m(&self, p: Point, q: Point) -> f64 {
        let [p, q] = self.points(p, q);
        distance_m(p, q)
    }
}
