//! Errors of position and heading, as far as the shield allows for them.
//!
//! All see an airplane up to `position_m` from its position, and at the end of each `dt` a gust turns
//! it by up to `heading_rad`; no airplane knows the error, all know these bounds. Airplanes that
//! exceed them are reported (`act/errors.rs`).
//!
//! **Positions.** Let all be seen within `E` of their positions. A plan is computed from where the
//! airplane is seen, so the motion flown is the plan, moved by at most `E`. Plans that keep
//! `R + 2 E` as they are seen keep `R` as they are flown. The invariant of the shield speaks of
//! orbits as they are flown: two airplanes that stay on theirs need not be seen apart anew, and the
//! search never asks it of them. So the induction holds with this wider gap on new plans.
//!
//! **Headings.** A turn profile is flown for one `dt` from a heading that is seen, so no gust disturbs it.
//! A fallback is flown forever. Airplanes orbit, and turn before it, at less than their largest turn rate and have the
//! rest, `a`, to correct, straight on even more ([`OrbitTracker::turn_rates_rad_s`]). Let `D` be the bound, `v` the speed, and let `held` be the pose
//! on the orbit that was stored, moved along it. At the start of each `dt` on it
//!
//! - the airplane heads within `2 D` of `held`: at the end of a profile by at most one gust of `D`;
//!   later because the tracker steers for headings within `D`, never away from them, and has
//!   `a dt >= 2 D` to get there, and then comes one gust;
//! - it is within `4 v dt D` of `held`. At the end of a profile it is at `held`. Later the tracker leads it
//!   back; that is checked in each `dt`, and an airplane that is farther away is reported.
//!
//! During `dt` it heads within `2 D` of `held` all the time, so its position relative to `held`
//! changes by at most `2 v sin(D) dt <= 2 v dt D`. So it is within `W = 6 v dt D` of its orbit, and
//! gaps wider by `W` on either side keep `R`.

use crate::flight::{AircraftModel, Pose2};
use serde::{Deserialize, Serialize};
use sidestep_kernel::math;

/// Fraction of the largest turn rate below which no airplane orbits: the orbit would be more than twice as wide as the
/// tightest one.
const MIN_RATE_FRACTION: f64 = 0.45;
/// Airplanes orbit at one rate if none of them could turn this many times as fast as another. Were
/// there no limit, a single airplane that hardly turns would put all others on circles that fill
/// the sky.
const MAX_RATE_RATIO: f64 = 10.0;
/// Fraction of its lateral offset that an airplane aims to correct within a step: with all of it, it would cross the
/// orbit before its heading is back.
const GAIN: f64 = 0.5;

/// Bounds on errors for which the shield allows; 0 where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ErrorBounds {
    /// Distance in meters within which an airplane is of where all see it.
    pub position_m: f64,
    /// Largest unwanted change of heading per `dt`, in radians.
    pub heading_rad: f64,
}

impl ErrorBounds {
    /// Returns the distance in meters within which an airplane is of where it should be at the
    /// start of a `dt` on its fallback.
    pub(crate) fn max_deviation_m(&self, v_m_s: f64, dt_s: f64) -> f64 {
        4.0 * v_m_s * dt_s * self.heading_rad
    }

    /// Returns how far an airplane may be from where its plans are seen.
    pub(crate) fn error_m(&self, v_m_s: f64, dt_s: f64) -> f64 {
        self.position_m + self.max_deviation_m(v_m_s, dt_s) + 2.0 * v_m_s * dt_s * self.heading_rad
    }

    /// Returns the largest turn rate at which an airplane can hold an orbit, if there is one.
    pub(crate) fn max_orbit_rate_rad_s(&self, model: &AircraftModel, dt_s: f64) -> Option<f64> {
        // The rest of the turn rate has to correct two gusts within a `dt`: `a dt >= 2 D`.
        let fraction = 1.0 - 2.0 * self.heading_rad / (model.omega_max_rad_s * dt_s);
        (fraction >= MIN_RATE_FRACTION).then_some(fraction * model.omega_max_rad_s)
    }
}

/// Returns the rates at which airplanes orbit, of the largest ones at which they could. On orbits
/// of one rate the distance of two airplanes has a closed form, and those that fly side by side stay
/// so; on orbits of other rates they sooner or later come to be wherever their circles come
/// nearest. So airplanes share the rate of the slowest of them, which all can fly.
pub(crate) fn common_orbit_rates(max_rates_rad_s: &[f64]) -> Vec<f64> {
    let mut rising = max_rates_rad_s.to_vec();
    rising.sort_unstable_by(f64::total_cmp);
    let mut shared: Vec<f64> = Vec::new();
    for rate in rising {
        if shared.last().is_none_or(|slowest| rate >= MAX_RATE_RATIO * slowest) {
            shared.push(rate);
        }
    }
    max_rates_rad_s
        .iter()
        .map(|rate| shared[shared.partition_point(|slowest| slowest <= rate) - 1])
        .collect()
}

/// An airplane on its fallback.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OrbitTracker {
    pub(crate) pose: Pose2,
    /// Its pose on the orbit, if it had made no errors.
    pub(crate) orbit_pose: Pose2,
    pub(crate) v_m_s: f64,
    pub(crate) omega_max_rad_s: f64,
    /// Turn rate of the orbit, positive to the left.
    pub(crate) orbit_rad_s: f64,
}

impl OrbitTracker {
    /// Returns the airplane that flies with these abilities at a turn rate.
    pub(crate) fn new(
        pose: Pose2,
        orbit_pose: Pose2,
        model: &AircraftModel,
        orbit_rad_s: f64,
    ) -> Self {
        let AircraftModel { v_m_s, omega_max_rad_s, .. } = *model;
        Self { pose, orbit_pose, v_m_s, omega_max_rad_s, orbit_rad_s }
    }

    /// Returns the turn rates by which it keeps to its orbit for some steps, in spite of gusts that
    /// turn it by up to `gust_rad`.
    pub(crate) fn turn_rates_rad_s(mut self, steps: usize, dtau_s: f64, gust_rad: f64) -> Vec<f64> {
        let mut rates_rad_s = Vec::with_capacity(steps);
        for _ in 0..steps {
            let error_rad = math::wrap_angle(self.pose.heading_rad - self.orbit_pose.heading_rad);
            let left = GAIN * self.lateral_offset_m() / (self.v_m_s * dtau_s);
            let desired_rad = (-left).clamp(-gust_rad, gust_rad);
            let omega = self.orbit_rad_s + (desired_rad - error_rad) / dtau_s;
            let omega = omega.clamp(-self.omega_max_rad_s, self.omega_max_rad_s);
            self.pose = self.pose.step(self.v_m_s, omega, dtau_s);
            self.orbit_pose = self.orbit_pose.step(self.v_m_s, self.orbit_rad_s, dtau_s);
            rates_rad_s.push(omega);
        }
        rates_rad_s
    }

    /// Returns how far to the left of its orbit it is, in meters.
    fn lateral_offset_m(&self) -> f64 {
        let x = self.pose.at[0] - self.orbit_pose.at[0];
        let y = self.pose.at[1] - self.orbit_pose.at[1];
        let heading_rad = self.orbit_pose.heading_rad;
        y * math::cos(heading_rad) - x * math::sin(heading_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::distance_m;
    use crate::shield::OrbitSide;
    use proptest::prelude::*;

    #[test]
    fn airplanes_that_turn_alike_share_the_rate_of_the_slowest() {
        let rates = common_orbit_rates(&[1.0, 70.0, 1.3, 10.0, 2.0, 9.9]);
        assert_eq!(rates, [1.0, 10.0, 1.0, 10.0, 1.0, 1.0]);
        assert_eq!(common_orbit_rates(&[0.3; 4]), [0.3; 4]);
    }

    proptest! {
        /// Under any gusts within the bound, also the worst at any time, an airplane stays so near its orbit that it
        /// need not be named.
        #[test]
        fn whoever_holds_an_orbit_strays_no_farther_than_the_bound(
            part in 0.01f64..0.275, left in any::<bool>(), dtau in prop::sample::select(vec![1.0, 2.5, 5.0]),
            gusts in prop::collection::vec(-1.0f64..1.0, 300), worst in 0u8..4,
        ) {
            let (dt_s, v_m_s, omega_max_rad_s) = (5.0, 35.0, 4f64.to_radians());
            let model = AircraftModel { v_m_s, omega_max_rad_s, separation_m: 500.0, turns: 5 };
            let gust_rad = part * omega_max_rad_s * dt_s;
            let bounds = ErrorBounds { position_m: 0.0, heading_rad: gust_rad };
            let rate = bounds.max_orbit_rate_rad_s(&model, dt_s).expect("within what can be held");
            let start = Pose2 { at: [0.0, 0.0], heading_rad: 1.0 };
            let mut now = OrbitTracker::new(start, start, &model, rate * OrbitSide::BOTH[usize::from(left)].sign());
            let steps = (dt_s / dtau) as usize;
            for (k, gust) in gusts.iter().enumerate() {
                // Outward, by turns, always to one side, or by chance.
                let gust = match worst {
                    0 => now.lateral_offset_m().signum(),
                    1 => if k / 9 % 2 == 0 { 1.0 } else { -1.0 },
                    2 => 1.0,
                    _ => *gust,
                };
                now.pose.heading_rad += gust_rad * gust;
                let off_rad = math::wrap_angle(now.pose.heading_rad - now.orbit_pose.heading_rad);
                prop_assert!(off_rad.abs() <= 2.0 * gust_rad + 1e-9, "{off_rad}");
                let strays_m = distance_m(now.pose.at, now.orbit_pose.at);
                prop_assert!(strays_m <= bounds.max_deviation_m(v_m_s, dt_s), "{strays_m} after {k}");
                for omega in now.turn_rates_rad_s(steps, dtau, gust_rad) {
                    prop_assert!(omega.abs() <= omega_max_rad_s);
                    now.pose = now.pose.step(v_m_s, omega, dtau);
                    now.orbit_pose = now.orbit_pose.step(v_m_s, now.orbit_rad_s, dtau);
                    let strays_m = distance_m(now.pose.at, now.orbit_pose.at);
                    prop_assert!(strays_m <= bounds.error_m(v_m_s, dt_s), "{strays_m} in {k}");
                }
            }
        }
    }
}
