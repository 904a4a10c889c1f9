//! The surface that airplanes fly over: a plane, or the earth; and the flat pieces of it in which motion is computed.
//!
//! A scenario is planar or geographic. Its *coordinates* are meters east and north on a plane, or longitude and latitude
//! in radians on the WGS84 ellipsoid. Everything that outlasts a decision is kept in them: positions, way-points,
//! tracks, stored orbits, messages. A heading is counterclockwise from east, on the earth from the true east where the
//! airplane is.
//!
//! Motion is flat. Whatever an airplane does within a decision is computed in its own [`Frame`]: the plane that touches
//! the earth where the airplane is at the start of the interval, with x east and y north there. In it a place lies as
//! far and in the direction in which the shortest path to it leads (azimuthal equidistant), so that a straight flight
//! is a geodesic and a way-point is flown to on one. At the end of the interval the position goes back to coordinates,
//! and the heading turns with the meridians. A plane is its own frame everywhere: no number changes.
//!
//! The frames of two airplanes are compared in a third one, see [`PairPlane`](super::PairPlane).

use super::autopilot::{leg_direction, leg_ends};
use super::motion::{AircraftModel, Point, Pose2, distance_m};
use sidestep_kernel::geodesy::{GeoPosition, MIN_CURVATURE_RADIUS_M, TangentPlane, turn_rad};
use sidestep_kernel::geometry::{dot, norm_squared, sub};
use sidestep_kernel::math;
use std::borrow::Cow;

/// Distance of a way-point that stands for a heading: so far ahead that its bearing equals the heading wherever the
/// airplane is. On the earth, too, it means a direction and no place.
pub(crate) const FAR_AHEAD_M: f64 = 1e12;
/// Size of a coordinate beyond which a way-point on the earth is a direction.
const MAX_COORDINATE: f64 = 1e9;

/// The surface that the positions of a scenario lie on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Surface {
    /// A plane: coordinates are meters east and north.
    #[default]
    Plane,
    /// The WGS84 ellipsoid: coordinates are longitude and latitude in radians.
    Earth,
}

/// A flat piece of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame(pub(super) Option<TangentPlane>);

/// Returns the position on the earth that coordinates stand for.
fn geo_position([longitude_rad, latitude_rad]: Point) -> GeoPosition {
    GeoPosition { latitude_rad, longitude_rad }
}

/// Returns coordinates from latitude and longitude in degrees.
pub fn coordinates_from_degrees([latitude_deg, longitude_deg]: [f64; 2]) -> Point {
    let GeoPosition { latitude_rad, longitude_rad } =
        GeoPosition::from_degrees(latitude_deg, longitude_deg);
    [longitude_rad, latitude_rad]
}

fn is_direction(at: Point) -> bool {
    at.iter().any(|value| value.abs() > MAX_COORDINATE)
}

impl Surface {
    /// Returns the length in meters of the shortest path between two places.
    #[inline]
    pub fn distance_m(self, a: Point, b: Point) -> f64 {
        match self {
            Self::Plane => distance_m(a, b),
            Self::Earth if is_direction(a) || is_direction(b) => FAR_AHEAD_M,
            Self::Earth => geo_position(a).geodesic_to(geo_position(b)).length_m,
        }
    }

    /// Returns whether two places are at most so far apart.
    #[inline]
    pub fn is_within(self, a: Point, b: Point, limit_m: f64) -> bool {
        !self.is_surely_beyond(a, b, limit_m) && self.distance_m(a, b) <= limit_m
    }

    /// Returns whether two places on the earth are farther apart than a limit, as far as that is cheap to find out; no
    /// for others.
    #[inline]
    pub fn is_surely_beyond(self, a: Point, b: Point, limit_m: f64) -> bool {
        match self {
            Self::Plane => false,
            Self::Earth => is_chord_longer(a, b, limit_m),
        }
    }

    /// Returns a number in meters by which no two places differ more than by their distance. Sorted by it, only
    /// neighbors have to be compared.
    #[inline]
    pub fn sweep_m(self, at: Point) -> f64 {
        match self {
            Self::Plane => at[0],
            Self::Earth => at[1] * MIN_CURVATURE_RADIUS_M,
        }
    }

    /// Returns the position in space by which places near each other can be found; in a plane its third coordinate is 0.
    #[inline]
    pub fn in_space_m(self, at: Point) -> [f64; 3] {
        match self {
            Self::Plane => [at[0], at[1], 0.0],
            Self::Earth => geo_position(at).in_space_m(),
        }
    }

    /// Returns the frame that touches the surface in a place.
    #[inline]
    pub fn frame_at(self, at: Point) -> Frame {
        match self {
            Self::Plane => Frame::PLANE,
            Self::Earth => Frame(Some(geo_position(at).tangent_plane())),
        }
    }

    /// Returns the frame in which an airplane flies a fallback: the plane itself; the frame at the center of an orbit, in
    /// which the orbit is a circle about the origin; or, if it does not turn, the frame where it is, in which a geodesic
    /// is straight. So the path is one and the same on the earth, however long it is flown.
    pub(crate) fn fallback_frame(self, pose: Pose2, v_m_s: f64, omega_rad_s: f64) -> Frame {
        match self {
            Self::Plane => Frame::PLANE,
            Self::Earth if omega_rad_s == 0.0 => self.frame_at(pose.at),
            Self::Earth => {
                let frame = self.frame_at(pose.at);
                let radius_m = v_m_s / omega_rad_s;
                let Pose2 { at: [x, y], heading_rad } = frame.pose_to_local(pose);
                let center =
                    [x - radius_m * math::sin(heading_rad), y + radius_m * math::cos(heading_rad)];
                self.frame_at(frame.to_world(center))
            }
        }
    }

    /// Returns how far to the north and to the east another place lies as seen from one, in meters: the offset in the
    /// frame there.
    #[inline]
    pub fn offset_m(self, from: Point, to: Point) -> Point {
        match self {
            Self::Plane => sub(to, from),
            Self::Earth => self.frame_at(from).to_local(to),
        }
    }
}

/// Returns whether even the straight line through the earth between two places is longer than a limit.
fn is_chord_longer(a: Point, b: Point, limit_m: f64) -> bool {
    // Most pairs of a wide group are told apart by their latitudes.
    if (a[1] - b[1]).abs() * MIN_CURVATURE_RADIUS_M > limit_m {
        return true;
    }
    let apart = sub(geo_position(a).in_space_m(), geo_position(b).in_space_m());
    norm_squared(apart) > limit_m * limit_m
}

impl Frame {
    /// The one frame of a plane.
    pub const PLANE: Self = Self(None);

    /// Returns a place in the frame.
    #[inline]
    pub fn to_local(self, at: Point) -> Point {
        match self.0 {
            Some(plane) if !is_direction(at) => {
                let path = plane.origin.geodesic_to(geo_position(at));
                path.start.map(|part| part * path.length_m)
            }
            _ => at,
        }
    }

    /// Returns a pose in the frame.
    #[inline]
    pub fn pose_to_local(self, pose: Pose2) -> Pose2 {
        let Some(TangentPlane { origin, .. }) = self.0 else { return pose };
        // The frame of an airplane touches the earth where that is.
        if pose.at == [origin.longitude_rad, origin.latitude_rad] {
            return Pose2 { at: [0.0; 2], ..pose };
        }
        let path = origin.geodesic_to(geo_position(pose.at));
        Pose2 {
            at: path.start.map(|part| part * path.length_m),
            heading_rad: pose.heading_rad + turn_rad(path.end, path.start),
        }
    }

    /// Returns the coordinates of a place in the frame.
    #[inline]
    pub fn to_world(self, at: Point) -> Point {
        self.pose_to_world(Pose2 { at, heading_rad: 0.0 }).at
    }

    /// Returns a pose in the frame in coordinates.
    #[inline]
    pub fn pose_to_world(self, pose: Pose2) -> Pose2 {
        let Some(TangentPlane { origin, .. }) = self.0 else { return pose };
        let Pose2 { at: [x, y], heading_rad } = pose;
        let length_m = math::hypot(x, y);
        if length_m == 0.0 {
            return Pose2 { at: [origin.longitude_rad, origin.latitude_rad], heading_rad };
        }
        let start = [x / length_m, y / length_m];
        let (there, end) = origin.destination(start, length_m);
        Pose2 {
            at: [there.longitude_rad, there.latitude_rad],
            heading_rad: heading_rad + turn_rad(start, end),
        }
    }

    /// Returns the surface that it touches.
    pub fn surface(&self) -> Surface {
        if self.0.is_some() { Surface::Earth } else { Surface::Plane }
    }

    /// Returns whether another frame touches the earth farther away than a limit, as far as that is cheap to find out; no
    /// in a plane.
    #[inline]
    pub(crate) fn is_surely_beyond(&self, other: &Self, limit_m: f64) -> bool {
        self.0.as_ref().zip(other.0.as_ref()).is_some_and(|(a, b)| a.is_surely_beyond(b, limit_m))
    }

    /// Returns the origin of another frame in this one, and the angle by which directions there turn on the way here; in
    /// a plane the origin itself.
    #[inline]
    pub(crate) fn origin_of(&self, other: &Self) -> Pose2 {
        let Some((plane, other)) = self.0.as_ref().zip(other.0.as_ref()) else {
            return Pose2 { at: [0.0; 2], heading_rad: 0.0 };
        };
        let path = plane.path_to(other);
        Pose2 {
            at: path.start.map(|part| part * path.length_m),
            heading_rad: turn_rad(path.end, path.start),
        }
    }

    /// Returns a velocity at a place, which is east and north there, in the frame.
    pub fn velocity_to_local(self, at: Point, velocity: Point) -> Point {
        let Some(TangentPlane { origin, .. }) = self.0 else { return velocity };
        let path = origin.geodesic_to(geo_position(at));
        let (sin, cos) = math::sin_cos(turn_rad(path.end, path.start));
        let [x, y] = velocity;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Returns way-points in the frame, from number `next` on as far as an airplane can get that is at the frame's
    /// origin and gets `reach_m` meters from there, and where it passes them abeam, those between which the leg to the
    /// next one lies. The others have no meaning.
    pub(crate) fn local_mission(
        self,
        (mission, next): (&[Point], usize),
        reach_m: f64,
        passes_abeam: bool,
    ) -> Cow<'_, [Point]> {
        if self.0.is_none() {
            return Cow::Borrowed(mission);
        }
        let mut local = vec![[FAR_AHEAD_M; 2]; mission.len()];
        let leg = leg_ends(mission, next);
        let first = if passes_abeam { *leg.start() } else { next };
        for k in first..mission.len() {
            local[k] = self.to_local(mission[k]);
            let is_leg_known = !passes_abeam || k >= *leg.end();
            // One that is not reached blocks all after it.
            let mut latest = k.saturating_sub(1).max(next)..=k;
            if is_leg_known && latest.any(|w| is_out_of_reach(&local, w, reach_m, passes_abeam)) {
                break;
            }
        }
        Cow::Owned(local)
    }
}

/// Returns whether an airplane that gets `reach_m` meters from the origin is not done with a way-point in that time.
fn is_out_of_reach(mission: &[Point], next: usize, reach_m: f64, passes_abeam: bool) -> bool {
    let way_point = mission[next];
    let is_ahead = |leg: Point| dot(way_point, leg) > reach_m;
    norm_squared(way_point) > reach_m * reach_m
        && !(passes_abeam && leg_direction(mission, next).is_some_and(|leg| !is_ahead(leg)))
}

/// Returns the distance from where it is within which an airplane may be done with way-points in some seconds, in still
/// air.
pub(crate) fn way_point_reach_m(model: &AircraftModel, seconds: f64, tolerance_m: f64) -> f64 {
    // Nearer than a turning circle's diameter, a way-point may count as passed.
    1.01 * model.v_m_s * seconds + tolerance_m.max(2.0 * model.turn_radius_m())
}
