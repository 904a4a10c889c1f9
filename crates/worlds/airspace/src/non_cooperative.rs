//! Intruders: airplanes that mind no other, recorded or silent, which all others must avoid.
//!
//! Others see where an intruder is, how it moves now, and how fast its kind can fly; not where it
//! wants to go. Methods take it to fly straight on. The shield knows where it can be within `dt`:
//! anywhere in a circle that grows at its greatest speed.

use crate::flight::{Levels, Point};
use serde::{Deserialize, Serialize};
use sidestep_import::traffic::MAX_SPEED_M_S;
use sidestep_kernel::Slot;

/// Bounds on reports of an intruder: meters, meters per second and seconds beyond which nothing makes sense, or takes
/// forever to look at. Recorded speeds are over the ground, and no wind is as fast as an airplane.
const MAX_COORDINATE_M: f64 = 1e15;
const MAX_GROUND_SPEED_M_S: f64 = 2.0 * MAX_SPEED_M_S;
const MAX_AGE_S: f64 = 1e4;

/// An intruder as all of a group see it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NonCooperative {
    /// The airplane.
    pub(crate) slot: Slot,
    /// Its place.
    pub(crate) at: Point,
    /// Its velocity through the air, in meters per second.
    pub(crate) velocity_m_s: Point,
    /// Its greatest speed through the air, in meters per second.
    pub(crate) top_m_s: f64,
    pub(crate) separation_m: f64,
    /// Bound in meters on how far it may be from where it is seen.
    pub(crate) error_m: f64,
    /// The levels that it can be on within `dt`.
    pub(crate) levels: Levels,
    /// Seconds of a `dt`.
    pub(crate) dt_s: f64,
}

impl NonCooperative {
    /// Returns the distance in meters to keep from where it would be if it flew straight on: the
    /// separation, and as far as it gets within `dt`.
    pub(crate) fn clearance_m(&self, separation_m: f64) -> f64 {
        self.separation_m.max(separation_m) + self.top_m_s * self.dt_s
    }

    /// Returns whether its numbers can be computed with.
    pub(crate) fn is_valid(&self) -> bool {
        let Self { at, velocity_m_s, top_m_s, separation_m, error_m, levels, dt_s, .. } = self;
        // Comparisons with NaN are false; levels may be all that there are.
        let is_within = |most: f64| move |v: &f64| v.abs() <= most;
        at.iter().all(is_within(MAX_COORDINATE_M))
            && velocity_m_s.iter().chain([top_m_s]).all(is_within(MAX_GROUND_SPEED_M_S))
            && [separation_m, error_m].into_iter().all(is_within(MAX_COORDINATE_M))
            && is_within(MAX_AGE_S)(dt_s)
            && [top_m_s, separation_m, error_m, dt_s].into_iter().all(|size| *size >= 0.0)
            && levels.low_m <= levels.high_m
    }

    /// Returns its place in the moving air after some seconds, if it flies straight on.
    pub(crate) fn position_after(&self, seconds: f64) -> Point {
        let ([x, y], [vx, vy]) = (self.at, self.velocity_m_s);
        [x + vx * seconds, y + vy * seconds]
    }
}
