//! Motion: place, heading and speed of an airplane.
//!
//! Plane meters, x east and y north (a scenario on the earth keeps poses in other coordinates, see `surface.rs`, and
//! computes motion in planes); headings in radians, counterclockwise from east; a
//! positive turn rate turns left. Source: section 3 of the paper; the step is exact.

use serde::{Deserialize, Serialize};
use sidestep_kernel::math;

/// A point of the plane, meters.
pub type Point = [f64; 2];

/// Returns the distance of two points in meters.
#[inline]
pub fn distance_m(a: Point, b: Point) -> f64 {
    math::hypot(a[0] - b[0], a[1] - b[1])
}

/// Returns a vector turned by an angle; the same bits for none.
pub(crate) fn rotated([x, y]: Point, rad: f64) -> Point {
    if rad == 0.0 {
        return [x, y];
    }
    let (sin, cos) = math::sin_cos(rad);
    [cos * x - sin * y, sin * x + cos * y]
}

/// Abilities and separation of an airplane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AircraftModel {
    /// Airspeed in meters per second, constant.
    pub v_m_s: f64,
    /// Largest rate of turn in radians per second.
    pub omega_max_rad_s: f64,
    /// Distance in meters within which no other airplane should come.
    pub separation_m: f64,
    /// Number of evenly spaced turn rates, odd and at least 3.
    pub turns: usize,
}

impl AircraftModel {
    /// Returns the radius of the tightest turn in meters.
    pub fn turn_radius_m(&self) -> f64 {
        self.v_m_s / self.omega_max_rad_s
    }
}

/// Place and heading of an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose2 {
    /// Position in meters, x east and y north.
    pub at: Point,
    /// Heading in radians, counterclockwise from east.
    #[serde(rename = "psi_rad")]
    pub heading_rad: f64,
}

impl Pose2 {
    /// Returns the pose after `dtau_s` seconds at the turn rate `omega_rad_s`: exactly, in chord
    /// form, because that form stays exact as the turn rate goes to 0.
    #[inline]
    pub fn step(self, v_m_s: f64, omega_rad_s: f64, dtau_s: f64) -> Self {
        let half_turn_rad = 0.5 * omega_rad_s * dtau_s;
        let chord_m = v_m_s * dtau_s * sinc(half_turn_rad);
        let chord_rad = self.heading_rad + half_turn_rad;
        Self {
            at: [
                self.at[0] + chord_m * math::cos(chord_rad),
                self.at[1] + chord_m * math::sin(chord_rad),
            ],
            heading_rad: self.heading_rad + omega_rad_s * dtau_s,
        }
    }

    /// Returns the turn rate that would head for `goal` after `dtau_s` seconds, within the limits.
    #[inline]
    pub fn steer(self, goal: Point, omega_max_rad_s: f64, dtau_s: f64) -> f64 {
        let bearing_rad = math::atan2(goal[1] - self.at[1], goal[0] - self.at[0]);
        let desired_rad_s = math::wrap_angle(bearing_rad - self.heading_rad) / dtau_s;
        desired_rad_s.clamp(-omega_max_rad_s, omega_max_rad_s)
    }
}

/// Returns sin(a) / a. For small angles the next term of the series is below rounding.
#[inline]
pub(super) fn sinc(a: f64) -> f64 {
    if a.abs() < 1e-4 { 1.0 - a * a / 6.0 } else { math::sin(a) / a }
}

/// Largest number of steps of a `dt`: each is flown, and its approaches are recorded, by itself.
pub(crate) const MAX_STEPS_PER_DT: u64 = 1000;

/// The times in which airplanes decide, fly a step, and look ahead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TimeDiscretization {
    /// Seconds between two optimizations.
    pub dt_s: f64,
    /// Seconds between two points of a prediction; divides `dt_s`.
    pub dtau_s: f64,
    /// Number of points of a prediction.
    pub horizon: usize,
}

impl TimeDiscretization {
    /// Returns the time that a prediction covers, in seconds.
    pub fn horizon_s(&self) -> f64 {
        self.horizon as f64 * self.dtau_s
    }

    /// Returns the number of points of a prediction within one `dt_s`.
    pub fn points_per_dt(&self) -> usize {
        (self.dt_s / self.dtau_s).round() as usize
    }
}
