//! Recorded tracks: the position of an airplane at any time, and the rest of its route. On the earth it flies on the
//! shortest path from each point to the next.

use super::leg::ConstantRateLeg;
use super::motion::{Point, Pose2, distance_m};
use super::surface::{Frame, Surface};
use sidestep_kernel::math;

/// Seconds between two way-points along the rest of a track: far enough apart to leave room for avoiding others.
const WAY_POINT_INTERVAL_S: f64 = 120.0;

/// Position of an airplane at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// Time in seconds after the start of the scenario.
    pub t_s: f64,
    /// Position: meters east and north, or longitude and latitude in radians.
    pub at: Point,
    /// Altitude in meters.
    pub altitude_m: f64,
}

/// A recorded track: straight and at constant speed between its points.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    surface: Surface,
    points: Vec<TrackPoint>,
    /// Meters east and north from each point to the next one, as seen from there.
    offsets_m: Vec<Point>,
    /// Heading from each point to the next one elsewhere.
    headings_rad: Vec<f64>,
}

impl Track {
    /// Returns a track of at least two points with finite numbers and rising times; `None`
    /// otherwise.
    pub fn new(surface: Surface, points: Vec<TrackPoint>) -> Option<Self> {
        let is_rising = points.windows(2).all(|pair| pair[0].t_s < pair[1].t_s);
        if points.len() < 2 || !is_rising || !points.iter().all(TrackPoint::is_valid) {
            return None;
        }
        let offset_m = |pair: &[TrackPoint]| surface.offset_m(pair[0].at, pair[1].at);
        let offsets_m: Vec<Point> = points.windows(2).map(offset_m).collect();
        Some(Self { surface, headings_rad: headings_rad(&offsets_m), offsets_m, points })
    }

    /// Returns the time of its first point, in seconds after the start.
    pub fn start_s(&self) -> f64 {
        self.points[0].t_s
    }

    /// Returns the time of its last point, in seconds after the start.
    pub fn end_s(&self) -> f64 {
        self.points[self.points.len() - 1].t_s
    }

    /// Returns whether the airplane was there at a time.
    pub fn has_position_at(&self, t_s: f64) -> bool {
        (self.start_s()..=self.end_s()).contains(&t_s)
    }

    /// Returns its pose at a time; before the first point and after the last one, the pose there.
    pub fn pose_at(&self, t_s: f64) -> Pose2 {
        let (k, fraction) = self.locate(t_s);
        let [x, y] = self.points[k].at;
        let [dx, dy] = self.offsets_m[k].map(|part| fraction * part);
        let heading_rad = self.headings_rad[k];
        match self.surface {
            Surface::Plane => Pose2 { at: [x + dx, y + dy], heading_rad },
            Surface::Earth => {
                self.surface.frame_at([x, y]).pose_to_world(Pose2 { at: [dx, dy], heading_rad })
            }
        }
    }

    /// Returns its altitude in meters.
    pub fn altitude_at_m(&self, t_s: f64) -> f64 {
        let (k, fraction) = self.locate(t_s);
        let from_m = self.points[k].altitude_m;
        let to_m = self.points[k + 1].altitude_m;
        from_m + fraction * (to_m - from_m)
    }

    /// Adds the legs flown in an interval in a frame, with times after the interval's start.
    pub(crate) fn add_legs_in_interval(
        &self,
        frame: Frame,
        [from_s, until_s]: [f64; 2],
        legs: &mut Vec<ConstantRateLeg>,
    ) {
        let first = self.points.partition_point(|p| p.t_s <= from_s).max(1) - 1;
        for (k, pair) in self.points.windows(2).enumerate().skip(first) {
            if pair[0].t_s >= until_s {
                break;
            }
            let start_s = pair[0].t_s.max(from_s);
            let end_s = pair[1].t_s.min(until_s);
            if start_s >= end_s {
                continue;
            }
            let duration_s = pair[1].t_s - pair[0].t_s;
            let climb_m_s = (pair[1].altitude_m - pair[0].altitude_m) / duration_s;
            let (pose, v_m_s) = self.leg_start(frame, k, [start_s, end_s]);
            let leg = ConstantRateLeg::new(start_s - from_s, end_s - from_s, pose, v_m_s, 0.0);
            legs.push(leg.with_climb(self.altitude_at_m(start_s), climb_m_s));
        }
    }

    /// Returns the pose in a frame with which an airplane starts a leg between point `k` and the next one, and its speed
    /// on that leg.
    fn leg_start(&self, frame: Frame, k: usize, [start_s, end_s]: [f64; 2]) -> (Pose2, f64) {
        if self.surface == Surface::Plane {
            let pose = Pose2 { heading_rad: self.headings_rad[k], ..self.pose_at(start_s) };
            return (pose, self.leg_speed_m_s(k));
        }
        // In a frame that touches the earth elsewhere, a leg is straight only so nearly that it has to be drawn between
        // its ends for the next one to start where it ends.
        let pose = frame.pose_to_local(self.pose_at(start_s));
        let next = if end_s < self.points[k + 1].t_s {
            self.pose_at(end_s).at
        } else {
            self.points[k + 1].at
        };
        let next = frame.to_local(next);
        let length_m = distance_m(pose.at, next);
        if length_m == 0.0 {
            return (pose, 0.0);
        }
        let heading_rad = math::atan2(next[1] - pose.at[1], next[0] - pose.at[0]);
        (Pose2 { heading_rad, ..pose }, length_m / (end_s - start_s))
    }

    /// Returns the speed between point `k` and the next one.
    fn leg_speed_m_s(&self, k: usize) -> f64 {
        let [dx, dy] = self.offsets_m[k];
        math::hypot(dx, dy) / (self.points[k + 1].t_s - self.points[k].t_s)
    }

    /// Returns the last point before a time that has a next one, and the fraction of the time to that.
    fn locate(&self, t_s: f64) -> (usize, f64) {
        let after = self.points.partition_point(|p| p.t_s <= t_s);
        let k = after.clamp(1, self.points.len() - 1) - 1;
        let from_s = self.points[k].t_s;
        let to_s = self.points[k + 1].t_s;
        (k, ((t_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0))
    }

    /// Returns the way-points for flying on from its position at a time: one every two minutes, and
    /// the last point.
    pub fn remaining_way_points(&self, from_s: f64) -> Vec<Point> {
        let mut due_s = from_s + WAY_POINT_INTERVAL_S;
        let mut way_points: Vec<Point> = Vec::new();
        for (k, point) in self.points.iter().enumerate() {
            if k + 1 == self.points.len() || point.t_s >= due_s {
                way_points.push(point.at);
                due_s = point.t_s + WAY_POINT_INTERVAL_S;
            }
        }
        way_points
    }

    /// Returns the mean speed over the ground from a time to the end; over the whole track after
    /// that.
    pub fn mean_speed_m_s(&self, from_s: f64) -> f64 {
        let from_s =
            if from_s < self.end_s() { from_s.max(self.start_s()) } else { self.start_s() };
        let mut at = self.pose_at(from_s).at;
        let mut length_m = 0.0;
        for point in self.points.iter().filter(|p| p.t_s > from_s) {
            length_m += self.surface.distance_m(at, point.at);
            at = point.at;
        }
        length_m / (self.end_s() - from_s)
    }

    /// Returns its speed over the ground at a time, in meters per second.
    pub fn speed_m_s(&self, t_s: f64) -> f64 {
        let (k, _) = self.locate(t_s);
        self.leg_speed_m_s(k)
    }

    /// Returns its greatest rate of climb or descent, in meters per second.
    pub fn max_climb_m_s(&self) -> f64 {
        let climbs_m_s = self.points.windows(2).map(|pair| {
            (pair[1].altitude_m - pair[0].altitude_m).abs() / (pair[1].t_s - pair[0].t_s)
        });
        climbs_m_s.fold(0.0, f64::max)
    }

    /// Returns the greatest speed over the ground, in meters per second.
    pub fn max_speed_m_s(&self) -> f64 {
        (0..self.offsets_m.len()).map(|k| self.leg_speed_m_s(k)).fold(0.0, f64::max)
    }
}

impl TrackPoint {
    /// Returns whether its numbers can be computed with; comparisons with NaN are false.
    fn is_valid(&self) -> bool {
        let [x_m, y_m] = self.at;
        // The bound on all places and times of a scenario.
        [self.t_s, x_m, y_m, self.altitude_m].iter().all(|value| value.abs() <= 1e9)
    }
}

/// Returns the headings. An airplane that is recorded at one place twice keeps the heading in which
/// it flies on, and one that ends at rest the last heading.
fn headings_rad(offsets_m: &[Point]) -> Vec<f64> {
    let mut known: Vec<Option<f64>> = offsets_m.iter().map(bearing_rad).collect();
    for k in (1..known.len()).rev() {
        known[k - 1] = known[k - 1].or(known[k]);
    }
    let mut headings_rad = Vec::with_capacity(known.len());
    let mut last_rad = 0.0;
    for heading_rad in known {
        last_rad = heading_rad.unwrap_or(last_rad);
        headings_rad.push(last_rad);
    }
    headings_rad
}

/// Returns the direction from one point to another; none if they are at one place.
fn bearing_rad(&[dx, dy]: &Point) -> Option<f64> {
    (dx != 0.0 || dy != 0.0).then(|| math::atan2(dy, dx))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(points: &[[f64; 4]]) -> Option<Track> {
        let point =
            |&[t_s, x, y, altitude_m]: &[f64; 4]| TrackPoint { t_s, at: [x, y], altitude_m };
        Track::new(Surface::Plane, points.iter().map(point).collect())
    }

    #[test]
    fn between_two_points_all_is_linear_in_time() {
        let track = track(&[[10.0, 0.0, 0.0, 900.0], [20.0, 0.0, 1000.0, 1100.0]]).expect("valid");
        assert_eq!(track.pose_at(13.0).at, [0.0, 300.0]);
        assert_eq!(track.altitude_at_m(15.0), 1000.0);
        assert_eq!(track.pose_at(13.0).heading_rad, std::f64::consts::FRAC_PI_2);
        assert_eq!((track.pose_at(0.0).at, track.pose_at(99.0).at), ([0.0, 0.0], [0.0, 1000.0]));
        assert!(
            track.has_position_at(10.0)
                && track.has_position_at(20.0)
                && !track.has_position_at(20.1)
        );
        assert_eq!((track.max_speed_m_s(), track.mean_speed_m_s(15.0)), (100.0, 100.0));
    }

    #[test]
    fn the_rest_of_a_way_ends_where_the_track_does() {
        let points: Vec<[f64; 4]> =
            (0..40).map(|k| [f64::from(k) * 10.0, f64::from(k), 0.0, 0.0]).collect();
        let track = track(&points).expect("valid");
        assert_eq!(
            track.remaining_way_points(0.0),
            [[12.0, 0.0], [24.0, 0.0], [36.0, 0.0], [39.0, 0.0]]
        );
        assert_eq!(track.remaining_way_points(385.0), [[39.0, 0.0]]);
    }

    #[test]
    fn who_stands_keeps_the_heading_in_which_it_goes_on() {
        let still = [
            [0.0, 5.0, 0.0, 0.0],
            [1.0, 5.0, 0.0, 0.0],
            [2.0, 4.0, 0.0, 0.0],
            [3.0, 4.0, 0.0, 0.0],
        ];
        let track = track(&still).expect("valid");
        let west = std::f64::consts::PI;
        assert_eq!([0.5, 1.5, 2.5].map(|t_s| track.pose_at(t_s).heading_rad), [west; 3]);
    }

    #[test]
    fn what_is_no_track_is_refused() {
        assert_eq!(track(&[[0.0; 4]]), None);
        assert_eq!(track(&[[0.0; 4], [0.0; 4]]), None);
        assert_eq!(track(&[[0.0; 4], [1.0, f64::NAN, 0.0, 0.0]]), None);
    }
}
