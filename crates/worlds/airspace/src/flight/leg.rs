//! Legs: stretches of flight at one turn rate, airspeed and rate of climb, and how near two of them
//! come.
//!
//! The square of the distance of two legs is a smooth function of time, with bounds on how fast its
//! second derivative changes. Where these show that the first derivative only rises or only falls,
//! it has at most one zero, which is found to rounding; else the interval is halved. So no approach
//! is missed, however short. Two straight legs take one Newton step: the first derivative is linear.
//! Two legs of one turn rate have a closed form, and need it: the distance in a formation never
//! changes, so that halving would not end.

use super::motion::{Point, Pose2, sinc};
use super::pair_plane::RigidMotion;
use sidestep_kernel::geometry::{dot, sub};
use sidestep_kernel::math;

/// Turn rate in radians per second below which a leg counts as straight: in a whole day it would
/// turn by less than a tenth of a microradian.
const MIN_TURN_RAD_S: f64 = 1e-12;
/// Difference of headings in radians below which they count as the same: headings at the start of a step are rounded
/// anew in each step.
const HEADING_TOLERANCE_RAD: f64 = 1e-9;
/// Length in seconds below which an interval is no longer halved: at 1000 m/s no distance changes by more than 0.2 mm
/// in it.
const MIN_INTERVAL_S: f64 = 1e-7;
/// Length in seconds below which an interval may be given up because the distance hardly varies in it: the time of a
/// loss is no less exact than that, even if the distance is just at the separation.
const MAX_FLAT_INTERVAL_S: f64 = 0.05;
/// Meters by which the distance may vary in such an interval.
const FLAT_TOLERANCE_M: f64 = 1e-7;
/// Difference in seconds between two Newton steps at which a zero counts as found.
const ROOT_TOLERANCE_S: f64 = 1e-11;
/// Meters by which two airplanes may seem too near because of rounding: the shield keeps pairs apart by exactly their
/// separation.
pub(crate) const ROUNDING_M: f64 = 1e-6;
/// Largest turn in radians in an interval of Simpson's rule: in a wind of nine tenths of the airspeed its error is below
/// a millionth.
const MAX_SIMPSON_TURN_RAD: f64 = 0.1;

/// A stretch of flight at one turn rate, airspeed and rate of climb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantRateLeg {
    /// Its start, in seconds.
    pub from_s: f64,
    /// Its end, in seconds.
    pub until_s: f64,
    /// The pose at its start.
    pub pose: Pose2,
    /// Cosine and sine of the heading at its start.
    along: Point,
    /// Altitude at its start, in meters.
    pub altitude_m: f64,
    /// Airspeed in meters per second.
    pub v_m_s: f64,
    /// Turn rate in radians per second, positive to the left.
    pub omega_rad_s: f64,
    /// Rate of climb in meters per second.
    pub climb_m_s: f64,
    /// Velocity of the air, in meters per second.
    pub drift_m_s: Point,
}

/// A stretch of time.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimeSpan {
    pub(super) from_s: f64,
    pub(super) until_s: f64,
}

/// Place, velocity over the ground and acceleration at one moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KinematicState {
    pub(crate) at: Point,
    pub(crate) velocity: Point,
    acceleration: Point,
}

impl ConstantRateLeg {
    /// Returns a level leg in still air.
    pub fn new(from_s: f64, until_s: f64, pose: Pose2, v_m_s: f64, omega_rad_s: f64) -> Self {
        let omega_rad_s = if omega_rad_s.abs() < MIN_TURN_RAD_S { 0.0 } else { omega_rad_s };
        let along = [math::cos(pose.heading_rad), math::sin(pose.heading_rad)];
        Self {
            from_s,
            until_s,
            pose,
            along,
            altitude_m: 0.0,
            v_m_s,
            omega_rad_s,
            climb_m_s: 0.0,
            drift_m_s: [0.0; 2],
        }
    }

    /// Returns the leg with another altitude and rate of climb.
    #[must_use]
    pub fn with_climb(self, altitude_m: f64, climb_m_s: f64) -> Self {
        Self { altitude_m, climb_m_s, ..self }
    }

    /// Returns the leg in moving air.
    #[must_use]
    pub fn in_wind(self, drift_m_s: Point) -> Self {
        Self { drift_m_s, ..self }
    }

    /// Returns the unit vector along its heading at its start.
    pub(crate) fn direction(&self) -> Point {
        self.along
    }

    /// Returns the altitude at a time, in meters.
    pub fn altitude_at_m(&self, t_s: f64) -> f64 {
        self.altitude_m + self.climb_m_s * (t_s - self.from_s)
    }

    /// Returns the same motion from its start, with other times.
    #[must_use]
    pub fn with_times(self, from_s: f64, until_s: f64) -> Self {
        Self { from_s, until_s, ..self }
    }

    /// Returns the leg in another plane.
    #[must_use]
    pub(crate) fn moved(&self, motion: &RigidMotion) -> Self {
        Self {
            pose: motion.pose(self.pose),
            along: motion.direction(self.along),
            drift_m_s: motion.direction(self.drift_m_s),
            ..*self
        }
    }

    /// Returns whether a leg that starts at the end of this one continues it without any change.
    pub fn is_continued_by(&self, next: &Self) -> bool {
        let has_same_rates = self.v_m_s == next.v_m_s
            && self.omega_rad_s == next.omega_rad_s
            && self.climb_m_s == next.climb_m_s
            && self.drift_m_s == next.drift_m_s;
        let turned_rad = self.omega_rad_s * (next.from_s - self.from_s);
        let difference_rad = next.pose.heading_rad - self.pose.heading_rad - turned_rad;
        has_same_rates && math::wrap_angle(difference_rad).abs() < HEADING_TOLERANCE_RAD
    }

    /// Returns the part of the leg from a time on.
    #[must_use]
    pub fn remainder(&self, from_s: f64) -> Self {
        let turned_rad = self.omega_rad_s * (from_s - self.from_s);
        let heading_rad = self.pose.heading_rad + turned_rad;
        let pose = Pose2 { at: self.motion(from_s).at, heading_rad };
        Self::new(from_s, self.until_s.max(from_s), pose, self.v_m_s, self.omega_rad_s)
            .with_climb(self.altitude_at_m(from_s), self.climb_m_s)
            .in_wind(self.drift_m_s)
    }

    /// Returns the position at a time.
    pub(crate) fn position_at(&self, t_s: f64) -> Point {
        self.motion(t_s).at
    }

    /// Returns the length of the leg's path over the ground, in meters.
    pub(crate) fn ground_length_m(&self) -> f64 {
        let duration_s = self.until_s - self.from_s;
        if self.drift_m_s == [0.0; 2] {
            return self.v_m_s * duration_s;
        }
        if self.omega_rad_s == 0.0 {
            return self.ground_speed_m_s(self.from_s) * duration_s;
        }
        // Simpson's rule: while it turns in a wind, its speed over the ground has no integral in closed form.
        let intervals = (self.omega_rad_s.abs() * duration_s / MAX_SIMPSON_TURN_RAD).ceil();
        let width_s = duration_s / intervals;
        let mut sum_m_s = 0.0;
        for k in 0..intervals as usize {
            let from_s = self.from_s + k as f64 * width_s;
            let [first, middle, last] =
                [0.0, 0.5, 1.0].map(|part| self.ground_speed_m_s(from_s + part * width_s));
            sum_m_s += (first + 4.0 * middle + last) / 6.0;
        }
        sum_m_s * width_s
    }

    fn ground_speed_m_s(&self, t_s: f64) -> f64 {
        let [vx, vy] = self.motion(t_s).velocity;
        math::hypot(vx, vy)
    }

    /// Returns its motion at a time.
    pub(crate) fn motion(&self, t_s: f64) -> KinematicState {
        let flown_s = t_s - self.from_s;
        let half_turn_rad = 0.5 * self.omega_rad_s * flown_s;
        // Most legs are straight, and the approach of a pair takes dozens of motions.
        let half_turn = if self.omega_rad_s == 0.0 {
            [1.0, 0.0]
        } else {
            [math::cos(half_turn_rad), math::sin(half_turn_rad)]
        };
        // The chord of an arc points along the heading in its middle.
        let middle = rotate(self.along, half_turn);
        let ahead = rotate(middle, half_turn);
        let chord_m = self.v_m_s * flown_s * sinc(half_turn_rad);
        let centripetal_m_s2 = self.v_m_s * self.omega_rad_s;
        let [wx, wy] = self.drift_m_s;
        let [x, y] = self.pose.at;
        KinematicState {
            at: [x + wx * flown_s + chord_m * middle[0], y + wy * flown_s + chord_m * middle[1]],
            velocity: [wx + self.v_m_s * ahead[0], wy + self.v_m_s * ahead[1]],
            acceleration: [-centripetal_m_s2 * ahead[1], centripetal_m_s2 * ahead[0]],
        }
    }
}

/// Returns a vector rotated by an angle of this cosine and sine.
fn rotate([x, y]: Point, [cos, sin]: [f64; 2]) -> Point {
    [x * cos - y * sin, x * sin + y * cos]
}

/// The approach of two airplanes on their legs, up to some moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairApproach {
    /// Closest approach in meters; infinite if they were never on one level.
    pub nearest_m: f64,
    /// Seconds that they were nearer than their separation.
    pub lost_s: f64,
    /// Number of times that they came nearer than their separation.
    pub losses: u32,
    /// End of the last time that they were nearer than their separation.
    lost_until_s: f64,
}

/// The limits within which two airplanes are too near each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationMinima {
    /// Separation in meters.
    pub gap_m: f64,
    /// Difference of altitude in meters from which on they need not avoid each other.
    pub vertical_m: f64,
}

impl PairApproach {
    /// Returns an approach without any leg. `since_s` is a time up to which two airplanes are known to have been too
    /// near each other, so that a loss from then on is no new one.
    pub fn new(since_s: Option<f64>) -> Self {
        let lost_until_s = since_s.unwrap_or(f64::NEG_INFINITY);
        Self { nearest_m: f64::INFINITY, lost_s: 0.0, losses: 0, lost_until_s }
    }

    /// Adds the time that two legs have in common; it must not lie before times that were added already.
    pub fn add(&mut self, a: &ConstantRateLeg, b: &ConstantRateLeg, zone: SeparationMinima) {
        let common = TimeSpan { from_s: a.from_s.max(b.from_s), until_s: a.until_s.min(b.until_s) };
        let Some(level) = common_level_span(a, b, common, zone.vertical_m) else { return };
        let pair = LegPair { a, b };
        // Between two of these moments the distance only grows or only shrinks.
        let mut moments = vec![level.from_s];
        pair.find_extrema(level, &mut moments);
        moments.push(level.until_s);
        for ends in moments.windows(2) {
            self.add_monotonic_interval(pair, TimeSpan { from_s: ends[0], until_s: ends[1] }, zone);
        }
    }

    /// Adds an interval in which the distance only grows or only shrinks.
    fn add_monotonic_interval(
        &mut self,
        pair: LegPair<'_>,
        span: TimeSpan,
        zone: SeparationMinima,
    ) {
        let TimeSpan { from_s, until_s } = span;
        let gap_m = zone.gap_m - ROUNDING_M;
        let start_m = pair.distance_m(from_s);
        let end_m = pair.distance_m(until_s);
        self.nearest_m = self.nearest_m.min(start_m).min(end_m);
        let starts_lost = start_m < gap_m;
        let ends_lost = end_m < gap_m;
        if starts_lost && ends_lost {
            self.add_loss(from_s, until_s);
        } else if starts_lost {
            self.add_loss(from_s, pair.crossing_s(span, start_m < end_m, gap_m));
        } else if ends_lost {
            self.add_loss(pair.crossing_s(span, start_m < end_m, gap_m), until_s);
        }
    }

    fn add_loss(&mut self, from_s: f64, until_s: f64) {
        self.losses += u32::from(from_s > self.lost_until_s);
        self.lost_s += until_s - from_s;
        self.lost_until_s = until_s;
    }
}

/// Returns whether two airplanes are too near each other at a time.
pub fn is_separation_lost(
    a: &ConstantRateLeg,
    b: &ConstantRateLeg,
    t_s: f64,
    zone: SeparationMinima,
) -> bool {
    (a.altitude_at_m(t_s) - b.altitude_at_m(t_s)).abs() < zone.vertical_m
        && (LegPair { a, b }).distance_m(t_s) < zone.gap_m - ROUNDING_M
}

/// Returns the part of an interval in which two legs are on one level.
fn common_level_span(
    a: &ConstantRateLeg,
    b: &ConstantRateLeg,
    within: TimeSpan,
    vertical_m: f64,
) -> Option<TimeSpan> {
    let TimeSpan { from_s, until_s } = within;
    let above_m = a.altitude_at_m(from_s) - b.altitude_at_m(from_s);
    let climb_m_s = a.climb_m_s - b.climb_m_s;
    let mut first_s = from_s;
    let mut last_s = until_s;
    if climb_m_s != 0.0 {
        let [low_s, high_s] =
            [-vertical_m, vertical_m].map(|above| from_s + (above - above_m) / climb_m_s);
        first_s = first_s.max(low_s.min(high_s));
        last_s = last_s.min(low_s.max(high_s));
    } else if above_m.abs() >= vertical_m {
        return None;
    }
    let part = TimeSpan { from_s: first_s, until_s: last_s };
    (first_s <= last_s && from_s <= until_s).then_some(part)
}

/// Two legs, seen from the first.
#[derive(Clone, Copy)]
pub(super) struct LegPair<'a> {
    pub(super) a: &'a ConstantRateLeg,
    pub(super) b: &'a ConstantRateLeg,
}

impl LegPair<'_> {
    fn motion(&self, t_s: f64) -> KinematicState {
        let a = self.a.motion(t_s);
        let b = self.b.motion(t_s);
        KinematicState {
            at: sub(b.at, a.at),
            velocity: sub(b.velocity, a.velocity),
            acceleration: sub(b.acceleration, a.acceleration),
        }
    }

    pub(super) fn distance_m(&self, t_s: f64) -> f64 {
        let [x, y] = self.motion(t_s).at;
        math::hypot(x, y)
    }

    /// Returns half of the first and half of the second derivative of the squared distance. The square has no root,
    /// whose derivative jumps where two airplanes meet in a point.
    fn half_square_derivatives(&self, t_s: f64) -> (f64, f64) {
        let KinematicState { at, velocity, acceleration } = self.motion(t_s);
        (dot(at, velocity), dot(velocity, velocity) + dot(at, acceleration))
    }

    /// Adds the moments within an interval at which the distance turns from shrinking to growing or
    /// back, in order. Returns the number of intervals that it took.
    pub(super) fn find_extrema(&self, within: TimeSpan, found: &mut Vec<f64>) -> u64 {
        if self.is_corotating() {
            self.find_alignments(within, found);
            return 1;
        }
        let ends = [
            self.half_square_derivatives(within.from_s).0,
            self.half_square_derivatives(within.until_s).0,
        ];
        self.find_zeros(within, ends, self.max_third_derivative(within), found)
    }

    /// Returns whether both turn at one rate in the same air, so that one is on a circle as the other sees it.
    fn is_corotating(&self) -> bool {
        let LegPair { a, b } = self;
        a.omega_rad_s == b.omega_rad_s && a.drift_m_s == b.drift_m_s && a.omega_rad_s != 0.0
    }

    /// Adds the moments at which one, on its circle about the other, is on the line through the other and the
    /// circle's center: there the distance turns.
    ///
    /// The relative velocity `w` turns as both do, so that half of the first derivative of the squared distance
    /// from `d` is `d·w cos(ωs) + (d×w + w²/ω) sin(ωs)` (`d×w` with the normal that `w` turns to). Its zeros are
    /// computed without the center, which is far away where both fly almost straight.
    fn find_alignments(&self, TimeSpan { from_s, until_s }: TimeSpan, found: &mut Vec<f64>) {
        let omega_rad_s = self.a.omega_rad_s;
        let duration_s = until_s - from_s;
        let KinematicState { at, velocity: [vx, vy], .. } = self.motion(from_s);
        let cos_part = -omega_rad_s * dot(at, [vx, vy]);
        let sin_part = omega_rad_s * dot(at, [-vy, vx]) + dot([vx, vy], [vx, vy]);
        let half_turn_s = std::f64::consts::PI / omega_rad_s.abs();
        // Half the squared distance varies by no more than this: in a formation only by rounding.
        let steepest_m2_s = math::hypot(cos_part, sin_part) / omega_rad_s.abs();
        if is_nearly_constant(
            steepest_m2_s * duration_s.min(half_turn_s),
            math::hypot(at[0], at[1]),
        ) {
            return;
        }
        let first_s = math::atan2(cos_part * sin_part.signum(), sin_part.abs()) / omega_rad_s;
        let mut after_s = if first_s < 0.0 { first_s + half_turn_s } else { first_s };
        while after_s < duration_s {
            found.push(from_s + after_s);
            after_s += half_turn_s;
        }
    }

    /// Returns a bound on how fast half of the second derivative changes in an interval.
    fn max_third_derivative(&self, within: TimeSpan) -> f64 {
        let TimeSpan { from_s, until_s } = within;
        let duration_s = until_s - from_s;
        let [speed_m_s, acceleration_m_s2, jerk_m_s3] = self.relative_motion_bounds(within);
        let start = self.motion(from_s);
        let start_speed_m_s = math::hypot(start.velocity[0], start.velocity[1]);
        let speed_m_s = speed_m_s.min(start_speed_m_s + acceleration_m_s2 * duration_s);
        let distance_m = math::hypot(start.at[0], start.at[1]) + speed_m_s * duration_s;
        // The derivative of v·v + d·a is 3 v·a + d·j.
        3.0 * speed_m_s * acceleration_m_s2 + distance_m * jerk_m_s3
    }

    /// Returns bounds on the relative velocity, acceleration and jerk in an interval. These are differences of
    /// two turning vectors, which are small where the vectors have almost one length and direction, as those of
    /// airplanes that fly almost in formation.
    fn relative_motion_bounds(&self, TimeSpan { from_s, until_s }: TimeSpan) -> [f64; 3] {
        let LegPair { a, b } = self;
        let heading_a_rad = a.pose.heading_rad + a.omega_rad_s * (from_s - a.from_s);
        let heading_b_rad = b.pose.heading_rad + b.omega_rad_s * (from_s - b.from_s);
        let angle_rad = math::wrap_angle(heading_b_rad - heading_a_rad).abs()
            + (b.omega_rad_s - a.omega_rad_s).abs() * (until_s - from_s);
        let wind_m_s =
            math::hypot(b.drift_m_s[0] - a.drift_m_s[0], b.drift_m_s[1] - a.drift_m_s[1]);
        let speeds = [a.v_m_s, b.v_m_s];
        let accelerations = [a.v_m_s * a.omega_rad_s, b.v_m_s * b.omega_rad_s];
        let jerks =
            [a.v_m_s * a.omega_rad_s * a.omega_rad_s, b.v_m_s * b.omega_rad_s * b.omega_rad_s];
        [
            wind_m_s + vector_difference_bound(speeds, angle_rad),
            vector_difference_bound(accelerations, angle_rad),
            vector_difference_bound(jerks, angle_rad),
        ]
    }

    /// Adds the zeros of the slope. Returns the number of intervals that it took.
    fn find_zeros(&self, within: TimeSpan, ends: [f64; 2], bend: f64, found: &mut Vec<f64>) -> u64 {
        let TimeSpan { from_s, until_s } = within;
        let half_s = 0.5 * (until_s - from_s);
        if half_s < MIN_INTERVAL_S {
            return 1;
        }
        let middle_s = from_s + half_s;
        let (at_middle, change) = self.half_square_derivatives(middle_s);
        if change.abs() >= bend * half_s {
            // The slope only rises or only falls, so it has at most one zero.
            if (ends[0] < 0.0) != (ends[1] < 0.0) {
                found.push(zero_s(within, ends[0] < 0.0, |t_s| self.half_square_derivatives(t_s)));
            }
            return 1;
        }
        // Half the squared distance varies by no more than this. In a formation that is next to nothing long
        // before the interval is as short as can be.
        let variation_m2 =
            2.0 * half_s * (at_middle.abs() + half_s * (change.abs() + bend * half_s));
        if half_s < MAX_FLAT_INTERVAL_S
            && is_nearly_constant(variation_m2, self.distance_m(middle_s))
        {
            return 1;
        }
        let halves =
            [TimeSpan { from_s, until_s: middle_s }, TimeSpan { from_s: middle_s, until_s }];
        let before = self.find_zeros(halves[0], [ends[0], at_middle], bend, found);
        before + self.find_zeros(halves[1], [at_middle, ends[1]], bend, found)
    }

    /// Returns when the distance passes `gap_m` in an interval in which it only grows or only
    /// shrinks.
    fn crossing_s(&self, within: TimeSpan, grows: bool, gap_m: f64) -> f64 {
        zero_s(within, grows, |t_s| {
            let KinematicState { at, velocity, .. } = self.motion(t_s);
            (0.5 * (dot(at, at) - gap_m * gap_m), dot(at, velocity))
        })
    }
}

/// Returns a bound on the length of the difference of two vectors of these lengths, with at most this angle between
/// them.
fn vector_difference_bound([a, b]: [f64; 2], angle_rad: f64) -> f64 {
    let shorter = a.abs().min(b.abs());
    (a.abs() + b.abs()).min((a - b).abs() + shorter * angle_rad)
}

/// Returns whether a distance is next to constant, by how much half its square varies.
fn is_nearly_constant(variation_m2: f64, distance_m: f64) -> bool {
    // d²/2 varies by d times the variation of d.
    variation_m2 < FLAT_TOLERANCE_M * distance_m.max(0.5 * FLAT_TOLERANCE_M)
}

/// Returns the zero of a function that only rises, or only falls, from its values and slopes: by
/// Newton's steps, and by halving where these lead out of the interval.
fn zero_s(within: TimeSpan, rises: bool, value_and_slope: impl Fn(f64) -> (f64, f64)) -> f64 {
    let TimeSpan { mut from_s, mut until_s } = within;
    let mut t_s = 0.5 * (from_s + until_s);
    // 53 halvings of a day reach the tolerance.
    for _ in 0..100 {
        let (value, slope) = value_and_slope(t_s);
        if (value < 0.0) == rises {
            from_s = t_s;
        } else {
            until_s = t_s;
        }
        let newton_s = t_s - value / slope;
        let is_inside = from_s <= newton_s && newton_s <= until_s;
        let next_s = if is_inside { newton_s } else { 0.5 * (from_s + until_s) };
        if (next_s - t_s).abs() <= ROOT_TOLERANCE_S {
            return next_s;
        }
        t_s = next_s;
    }
    t_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ZONE: SeparationMinima = SeparationMinima { gap_m: 500.0, vertical_m: 300.0 };

    fn leg(at: Point, heading_rad: f64, v_m_s: f64, omega_rad_s: f64) -> ConstantRateLeg {
        ConstantRateLeg::new(0.0, 60.0, Pose2 { at, heading_rad }, v_m_s, omega_rad_s)
    }

    fn approach(a: &ConstantRateLeg, b: &ConstantRateLeg, zone: SeparationMinima) -> PairApproach {
        let mut approach = PairApproach::new(None);
        approach.add(a, b, zone);
        approach
    }

    #[test]
    fn a_head_on_pass_through_one_point_is_found_with_its_time() {
        let (a, b) =
            (leg([0.0, 0.0], 0.0, 35.0, 0.0), leg([1007.0, 0.0], std::f64::consts::PI, 35.0, 0.0));
        let zone = SeparationMinima { gap_m: 5.0, ..ZONE };
        let found = approach(&a, &b, zone);
        assert!(found.nearest_m < 1e-9 && found.losses == 1, "{found:?}");
        assert!((found.lost_s - 10.0 / 70.0).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn a_loss_lasts_from_leg_to_leg_and_ends_with_the_level() {
        let still = leg([0.0, 0.0], 0.0, 35.0, 0.0);
        let beside = leg([0.0, 100.0], 0.0, 35.0, 0.0);
        let mut found = PairApproach::new(None);
        let climbs = beside.with_climb(0.0, 10.0);
        for (from_s, until_s) in [(0.0, 10.0), (10.0, 60.0)] {
            let part = |leg: &ConstantRateLeg| ConstantRateLeg { until_s, ..leg.remainder(from_s) };
            found.add(&part(&still), &part(&climbs), ZONE);
        }
        assert_eq!((found.losses, found.nearest_m), (1, 100.0));
        assert!((found.lost_s - 30.0).abs() < 1e-9, "{found:?}");
        let mut goes_on = PairApproach::new(Some(0.0));
        goes_on.add(&still, &beside, ZONE);
        assert_eq!((goes_on.losses, goes_on.lost_s), (0, 60.0));
        assert_eq!(approach(&still, &beside.with_climb(300.0, 0.0), ZONE).nearest_m, f64::INFINITY);
    }

    #[test]
    fn a_formation_keeps_its_distance_in_every_turn() {
        for (omega_rad_s, apart_m) in
            [(0.05, 0.0), (-0.1, 40.0), (1e-7, 0.0), (-1e-7, 700.0), (1e-11, 40.0)]
        {
            let a = leg([0.0, 0.0], 0.3, 250.0, omega_rad_s);
            let b = leg([apart_m, 0.0], 0.3, 250.0, omega_rad_s);
            let found = approach(&a, &b, ZONE);
            assert!((found.nearest_m - apart_m).abs() < 1e-6, "{omega_rad_s}: {found:?}");
            assert_eq!(found.losses, u32::from(apart_m < ZONE.gap_m));
        }
    }

    #[test]
    fn next_to_a_formation_few_intervals_are_looked_at() {
        for omega_rad_s in [0.05, -0.1, 1e-7] {
            for off in [1e-3, 1e-6, 1e-9, 1e-12] {
                for apart_m in [0.0, 1e-3, 40.0] {
                    let a = leg([0.0, 0.0], 0.3, 250.0, omega_rad_s);
                    let b = leg([apart_m, 0.0], 0.3 + off, 250.0, omega_rad_s * (1.0 + off));
                    let pair = LegPair { a: &a, b: &b };
                    let looks =
                        pair.find_extrema(TimeSpan { from_s: 0.0, until_s: 60.0 }, &mut Vec::new());
                    assert!(looks < 20_000, "{omega_rad_s} {off} {apart_m}: {looks} intervals");
                }
            }
        }
    }

    #[test]
    fn almost_straight_airplanes_of_one_turn_rate_pass_as_straight_ones() {
        for omega_rad_s in [1e-5, 1e-7, -1e-9, 1e-11] {
            let a = leg([0.0, 0.0], 0.0, 35.0, omega_rad_s);
            let b = leg([1007.0, 30.0], 3.0, 30.0, omega_rad_s);
            let straight = approach(
                &leg([0.0, 0.0], 0.0, 35.0, 0.0),
                &leg([1007.0, 30.0], 3.0, 30.0, 0.0),
                ZONE,
            );
            let found = approach(&a, &b, ZONE);
            let off_m = 1e4 * omega_rad_s.abs() * 60.0 + 1e-9;
            assert!(
                (found.nearest_m - straight.nearest_m).abs() < off_m,
                "{omega_rad_s}: {found:?}, {straight:?}"
            );
        }
    }

    proptest! {
        /// However two airplanes turn, dense sampling finds no nearer moment, and as much time below
        /// the separation.
        #[test]
        fn no_approach_of_turning_airplanes_is_missed(
            x in -2000.0f64..2000.0, y in -2000.0f64..2000.0, heading_rad in -3.2f64..3.2,
            v in prop::array::uniform2(5.0f64..120.0), omega in prop::array::uniform2(-0.2f64..0.2),
            wind in prop::array::uniform2(-9.0f64..9.0), gap_m in 1.0f64..900.0,
            as_one in any::<bool>(),
        ) {
            let (omega, wind) = if as_one { ([omega[0]; 2], [0.0; 2]) } else { (omega, wind) };
            let a = leg([0.0, 0.0], 0.0, v[0], omega[0]);
            let b = leg([x, y], heading_rad, v[1], omega[1]).in_wind(wind);
            let found = approach(&a, &b, SeparationMinima { gap_m, ..ZONE });
            let looks = 6_000;
            let apart_m = |k: u32| {
                let t_s = f64::from(k) * 60.0 / f64::from(looks);
                let p = a.pose.step(a.v_m_s, omega[0], t_s).at;
                let q = b.pose.step(b.v_m_s, omega[1], t_s).at;
                math::hypot(q[0] + wind[0] * t_s - p[0], q[1] + wind[1] * t_s - p[1])
            };
            let all: Vec<f64> = (0..=looks).map(apart_m).collect();
            let nearest = all.iter().copied().fold(f64::INFINITY, f64::min);
            prop_assert!(found.nearest_m <= nearest + 1e-6, "{} > {nearest}", found.nearest_m);
            prop_assert!(found.nearest_m >= nearest - 3.0);
            let below_s = all.iter().filter(|d| **d < gap_m).count() as f64 * 60.0 / f64::from(looks);
            prop_assert!((found.lost_s - below_s).abs() < 0.06, "{} s, {below_s}", found.lost_s);
        }
    }
}
