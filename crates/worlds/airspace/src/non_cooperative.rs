//! Non-cooperative aircraft: airplanes that avoid nobody, recorded or silent, and that all others must avoid.
//!
//! Others see where such an airplane is, how it moves now, and how fast its kind can fly; not where it
//! is bound for. Methods assume that it flies straight on. The shield knows where it can be within `dt`:
//! anywhere in a circle that grows at its greatest speed.

use crate::flight::{FlightLevelRange, Frame, Point};
use serde::{Deserialize, Serialize};
use sidestep_import::traffic::MAX_SPEED_M_S;
use sidestep_kernel::EntitySlot;

/// Meters beyond which squares of distances lose all sense.
const MAX_COORDINATE_M: f64 = 1e15;
/// Recorded speeds are over the ground, and no wind is as fast as an airplane.
const MAX_GROUND_SPEED_M_S: f64 = 2.0 * MAX_SPEED_M_S;
/// Longest `dt` that is accepted from a network: the search for a closest approach takes longer the longer it is.
const MAX_DT_S: f64 = 1e4;

/// A non-cooperative airplane as all of a group see it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NonCooperativeAircraft {
    pub(crate) slot: EntitySlot,
    /// Its position as all see it, with the error of the cycle: coordinates of the scenario, or a place in a frame, see
    /// [`Self::in_frame`].
    pub(crate) at: Point,
    /// Its velocity through the common air, see [`FlightConditions`](crate::flight::FlightConditions), in meters per second
    /// east and north.
    pub(crate) velocity_m_s: Point,
    /// Its greatest speed through that air, in meters per second.
    pub(crate) top_m_s: f64,
    pub(crate) separation_m: f64,
    /// Bound in meters on how far it may be from where it is seen.
    pub(crate) error_m: f64,
    /// Altitude in meters.
    pub(crate) altitude_m: f64,
    /// Its rate of climb in meters per second, negative downward.
    pub(crate) climb_m_s: f64,
    /// The levels that it can be on within `dt`.
    pub(crate) levels: FlightLevelRange,
    /// Seconds of a `dt`.
    pub(crate) dt_s: f64,
}

impl NonCooperativeAircraft {
    /// Returns the distance in meters to keep from where it would be if it flew straight on: the
    /// separation, and as far as it gets within `dt`.
    pub(crate) fn required_clearance_m(&self, separation_m: f64) -> f64 {
        self.separation_m.max(separation_m) + self.top_m_s * self.dt_s
    }

    /// Returns it with its position and its velocity in a frame.
    pub(crate) fn in_frame(&self, frame: Frame) -> Self {
        Self {
            at: frame.to_local(self.at),
            velocity_m_s: frame.velocity_to_local(self.at, self.velocity_m_s),
            ..self.clone()
        }
    }

    /// Returns whether its numbers can be computed with.
    pub(crate) fn is_valid(&self) -> bool {
        let Self { velocity_m_s, top_m_s, separation_m, error_m, levels, dt_s, .. } = *self;
        let Self { altitude_m, climb_m_s, .. } = *self;
        let [x_m, y_m] = self.at;
        let [vx, vy] = velocity_m_s;
        are_bounded_by([x_m, y_m, separation_m, error_m, altitude_m], MAX_COORDINATE_M)
            && are_bounded_by([vx, vy, top_m_s], MAX_GROUND_SPEED_M_S)
            && climb_m_s.is_finite()
            && are_bounded_by([dt_s], MAX_DT_S)
            && [top_m_s, separation_m, error_m, dt_s].iter().all(|size| *size >= 0.0)
            // Those of a recorded airplane are infinite.
            && levels.low_m <= levels.high_m
    }

    /// Returns its position in the moving air of a frame after some seconds, if it flies straight on.
    pub(crate) fn position_after(&self, seconds: f64) -> Point {
        let [x, y] = self.at;
        let [vx, vy] = self.velocity_m_s;
        [x + vx * seconds, y + vy * seconds]
    }
}

/// Returns whether numbers are at most so large; comparisons with NaN are false.
fn are_bounded_by<const N: usize>(numbers: [f64; N], max: f64) -> bool {
    numbers.iter().all(|number| number.abs() <= max)
}
