//! Orbits, which are the shield's fallbacks, and a test of whether motions stay apart.
//!
//! Paths are compared with a safe bound on how fast two airplanes can close in, halving intervals
//! until the bound decides ([`stays_apart_for`]); orbits of one turn rate have a closed form, of
//! opposite ones a common period that is searched the same way, and of any others are kept apart
//! as whole circles.

use crate::flight::{Point, Pose2, RigidMotion, distance_m};
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;
use sidestep_kernel::math;

/// Length in seconds below which an interval is no longer halved: undecided counts as too near. Two airplanes that
/// close in at 500 m/s are then within 5 cm of the gap.
const MIN_INTERVAL_S: f64 = 1e-4;
/// The same as a fraction of the whole interval, so that slow orbits, with periods of days, take no
/// longer to compare: the number of distances computed is at most twice its inverse.
const MIN_INTERVAL_FRACTION: f64 = 1e-6;

/// The direction of an orbit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrbitSide {
    /// Counter-clockwise.
    #[default]
    Left,
    /// Clockwise.
    Right,
}

impl OrbitSide {
    /// Both sides, in the order in which plans are tried.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// Returns the other side.
    pub fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Returns +1 for left, -1 for right.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

impl Packed for OrbitSide {
    type Bits = u8;

    #[inline(always)]
    fn to_bits(self) -> u8 {
        self as u8
    }

    #[inline(always)]
    fn from_bits(code: u8) -> Self {
        Self::BOTH[usize::from(code & 1)]
    }
}

/// A circle that is flown forever.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Orbit {
    center: Point,
    pub(crate) radius_m: f64,
    /// Turn rate in radians per second, positive to the left.
    omega_rad_s: f64,
    /// Direction from the center at time 0, in radians.
    phase_rad: f64,
}

impl Orbit {
    /// Returns the orbit that an airplane enters at `pose`.
    pub(crate) fn from_pose(pose: Pose2, v_m_s: f64, omega_rad_s: f64) -> Self {
        let radius_m = v_m_s / omega_rad_s.abs();
        // The center is at a right angle to the heading, on the side of the turn.
        let to_center_rad = pose.heading_rad + omega_rad_s.signum() * std::f64::consts::FRAC_PI_2;
        let center = [
            pose.at[0] + radius_m * math::cos(to_center_rad),
            pose.at[1] + radius_m * math::sin(to_center_rad),
        ];
        Self { center, radius_m, omega_rad_s, phase_rad: to_center_rad + std::f64::consts::PI }
    }

    /// Returns what becomes of it in a motion of the plane.
    pub(super) fn moved(&self, motion: &RigidMotion) -> Self {
        let center = motion.point(self.center);
        Self { center, phase_rad: motion.angle_rad(self.phase_rad), ..*self }
    }

    /// Returns the same orbit about another center.
    pub(super) fn displaced(&self, offset_m: Point) -> Self {
        Self { center: [self.center[0] + offset_m[0], self.center[1] + offset_m[1]], ..*self }
    }

    /// Returns the same orbit with times that start some seconds later.
    pub(super) fn after(&self, t_s: f64) -> Self {
        Self { phase_rad: self.phase_rad + self.omega_rad_s * t_s, ..*self }
    }

    /// Returns the airplane's position on it.
    pub(crate) fn at(&self, t_s: f64) -> Point {
        let angle_rad = self.phase_rad + self.omega_rad_s * t_s;
        [
            self.center[0] + self.radius_m * math::cos(angle_rad),
            self.center[1] + self.radius_m * math::sin(angle_rad),
        ]
    }

    /// Returns the center of the circle.
    pub(crate) fn center(&self) -> Point {
        self.center
    }

    /// Returns its turn rate in radians per second, positive to the left.
    pub(super) fn omega_rad_s(&self) -> f64 {
        self.omega_rad_s
    }

    fn speed_m_s(&self) -> f64 {
        self.radius_m * self.omega_rad_s.abs()
    }

    /// Returns whether two orbits stay `gap_m` meters apart for all time.
    pub(crate) fn stays_apart(&self, other: &Self, gap_m: f64) -> bool {
        let between_m = distance_m(self.center, other.center);
        let ra = self.radius_m;
        let rb = other.radius_m;
        // Apart as whole circles: side by side, or one inside the other.
        if between_m - ra - rb >= gap_m || (ra - rb).abs() - between_m >= gap_m {
            return true;
        }
        if is_same_rate(self.omega_rad_s, other.omega_rad_s) {
            // The offset within the circles is a vector of constant length that rotates.
            let offset_m = math::hypot(
                ra * math::cos(self.phase_rad) - rb * math::cos(other.phase_rad),
                ra * math::sin(self.phase_rad) - rb * math::sin(other.phase_rad),
            );
            return (between_m - offset_m).abs() >= gap_m;
        }
        if is_same_rate(self.omega_rad_s, -other.omega_rad_s) {
            let period_s = std::f64::consts::TAU / self.omega_rad_s.abs();
            let closing_m_s = self.speed_m_s() + other.speed_m_s();
            let apart_m = |t_s: f64| distance_m(self.at(t_s), other.at(t_s));
            return stays_apart_for(&apart_m, period_s, closing_m_s, gap_m);
        }
        // Orbits of two rates sooner or later come as near as their circles do.
        false
    }
}

/// Returns whether two turn rates are the same except for rounding.
fn is_same_rate(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs()
}

/// Returns whether a distance that changes by at most `closing_m_s` per second stays at least
/// `gap_m` for some seconds. Found by halving; the answer is never wrongly yes.
pub(crate) fn stays_apart_for(
    distance_m: &impl Fn(f64) -> f64,
    seconds: f64,
    closing_m_s: f64,
    gap_m: f64,
) -> bool {
    let min_interval_s = MIN_INTERVAL_S.max(MIN_INTERVAL_FRACTION * seconds);
    let bisection = Bisection { distance_m, closing_m_s, min_interval_s, gap_m };
    let from = bisection.sample(0.0);
    let to = bisection.sample(seconds);
    from.distance_m >= gap_m && to.distance_m >= gap_m && bisection.stays_apart(from, to)
}

/// A search for a moment at which a distance is less than `gap_m`.
struct Bisection<'a, F> {
    distance_m: &'a F,
    closing_m_s: f64,
    /// Length in seconds below which an interval is no longer halved.
    min_interval_s: f64,
    gap_m: f64,
}

/// A distance at a moment.
#[derive(Clone, Copy)]
struct DistanceSample {
    t_s: f64,
    distance_m: f64,
}

impl<F: Fn(f64) -> f64> Bisection<'_, F> {
    fn sample(&self, t_s: f64) -> DistanceSample {
        DistanceSample { t_s, distance_m: (self.distance_m)(t_s) }
    }

    /// Returns whether the distance is large enough between two samples, at which it is.
    fn stays_apart(&self, from: DistanceSample, to: DistanceSample) -> bool {
        let duration_s = to.t_s - from.t_s;
        // The smallest distance possible between the two: closing in all the time, and then drawing away.
        let min_m = 0.5 * (from.distance_m + to.distance_m - self.closing_m_s * duration_s);
        if min_m >= self.gap_m {
            return true;
        }
        if duration_s < self.min_interval_s {
            return false;
        }
        let middle = self.sample(0.5 * (from.t_s + to.t_s));
        middle.distance_m >= self.gap_m
            && self.stays_apart(from, middle)
            && self.stays_apart(middle, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The distance stays just far enough that the bound decides nothing for long.
    #[test]
    fn no_two_orbits_take_longer_to_compare_than_a_bounded_number_of_looks() {
        for period_s in [1.0, 90.0, 1e4, 360_000.0, 1e9] {
            for above_m in [0.0, 1e-9, 1e-6, 1e-3, 1.0] {
                let looks = std::cell::Cell::new(0_u64);
                let distance = |_: f64| {
                    looks.set(looks.get() + 1);
                    500.0 + above_m
                };
                let _ = stays_apart_for(&distance, period_s, 70.0, 500.0);
                assert!(looks.get() <= 2_200_000, "{period_s} s, {above_m} m: {}", looks.get());
            }
        }
    }

    proptest! {
        /// An orbit is the place where the airplane flies with that turn rate.
        #[test]
        fn an_orbit_is_the_motion_it_stands_for(
            x in -1e3f64..1e3, psi in -3.1f64..3.1, left in any::<bool>(), t_s in 0.0f64..300.0,
        ) {
            let pose = Pose2 { at: [x, 0.0], heading_rad: psi };
            let omega = OrbitSide::BOTH[usize::from(left)].sign() * 4f64.to_radians();
            let flown = pose.step(35.0, omega, t_s).at;
            prop_assert!(distance_m(flown, Orbit::from_pose(pose, 35.0, omega).at(t_s)) < 1e-6);
        }

        /// The search never wrongly says yes: dense sampling finds no nearer moment.
        #[test]
        fn what_is_found_apart_is_apart(
            base in 300.0f64..800.0, swing in 0.0f64..300.0, rate in 0.01f64..0.2, gap_m in 200.0f64..600.0,
        ) {
            let distance = |t_s: f64| base + swing * math::cos(rate * t_s);
            let found = stays_apart_for(&distance, 60.0, swing * rate + 1e-9, gap_m);
            let nearest = (0..6000).map(|k| distance(f64::from(k) / 100.0)).fold(f64::INFINITY, f64::min);
            if found {
                prop_assert!(nearest >= gap_m - 1e-6);
            } else {
                prop_assert!(nearest < gap_m + 0.1, "{nearest} is far above {gap_m}");
            }
        }
    }
}
