//! What a flight costs: its distance, a proxy of its fuel, and its maneuvers.

use super::FlightMeasures;
use crate::flight::{ConstantRateLeg, Point};
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{dot, norm_squared};

/// Gravity in meters per second squared (standard gravity).
const GRAVITY_M_S2: f64 = 9.806_65;
/// Fraction of the greatest turn rate by which a turn rate may differ from that of the flight plan before it is a
/// maneuver: errors of places make every method steer a little beside the direct course.
const MANEUVER_FRACTION: f64 = 0.1;
/// Largest angle in radians that may stand for its sine where it is compared with a tolerance.
const MAX_SMALL_ANGLE_RAD: f64 = 0.3;

/// Distance, fuel and maneuvers of a flight, since the method flies it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FlightEffort {
    /// Seconds flown.
    pub flown_s: f64,
    /// Path over the ground, in meters.
    pub ground_m: f64,
    /// Proxy of fuel: the level, straight path through the air with the same work, in meters.
    pub fuel_m: f64,
    /// Number of maneuvers.
    pub maneuvers: u32,
    /// Number of maneuvers that went over into one to the other side.
    pub reversals: u32,
    /// The side of the present maneuver.
    side: ManeuverSide,
}

/// The side to which an airplane turns away from its flight plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
enum ManeuverSide {
    /// It follows its flight plan.
    #[default]
    None,
    Left,
    Right,
}

/// The turn of an airplane in a step, beside that of its flight plan.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Maneuvering {
    /// The turn rate that it flies, in radians per second.
    pub(crate) omega_rad_s: f64,
    /// The turn rate with which it would fly to its way-point.
    pub(crate) planned_rad_s: f64,
    /// Its greatest turn rate.
    pub(crate) omega_max_rad_s: f64,
}

/// A step beside the direct course to the way-point, in still air.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CourseStep {
    /// Unit vector along the heading.
    pub(crate) along: Point,
    /// The way-point as seen from the airplane, in meters.
    pub(crate) offset_m: Point,
    /// The turn rate that it flies, in radians per second.
    pub(crate) omega_rad_s: f64,
    /// Its greatest turn rate.
    pub(crate) omega_max_rad_s: f64,
    /// Length of the step in seconds.
    pub(crate) dtau_s: f64,
}

impl CourseStep {
    /// Returns whether it surely is no part of a maneuver: the airplane flies almost straight, and almost to its
    /// way-point. Most steps of most flights are such, and this takes no arc tangent.
    pub(crate) fn is_surely_on_course(&self) -> bool {
        let tolerance_rad_s = MANEUVER_FRACTION * self.omega_max_rad_s;
        // A tenth of the tolerance is for the turn rate and more than enough for the sine, which is up to 2 % below its
        // angle; the rest is for the course.
        let max_sine = (0.9 * tolerance_rad_s * self.dtau_s).min(MAX_SMALL_ANGLE_RAD);
        let Self { along, offset_m, .. } = *self;
        let aside_m = along[0] * offset_m[1] - along[1] * offset_m[0];
        self.omega_rad_s.abs() <= 0.05 * tolerance_rad_s
            && dot(along, offset_m) > 0.0
            && aside_m * aside_m <= max_sine * max_sine * norm_squared(offset_m)
    }
}

impl Maneuvering {
    fn side(&self) -> ManeuverSide {
        let aside_rad_s = self.omega_rad_s - self.planned_rad_s;
        if aside_rad_s.abs() <= MANEUVER_FRACTION * self.omega_max_rad_s {
            ManeuverSide::None
        } else if aside_rad_s > 0.0 {
            ManeuverSide::Left
        } else {
            ManeuverSide::Right
        }
    }
}

impl FlightEffort {
    /// Adds a leg.
    pub(crate) fn add_leg(&mut self, leg: &ConstantRateLeg, measures: FlightMeasures) {
        self.add_leg_of_length(leg, leg.ground_length_m(), measures);
    }

    /// Adds a leg whose path over the ground is known.
    pub(crate) fn add_leg_of_length(
        &mut self,
        leg: &ConstantRateLeg,
        ground_m: f64,
        measures: FlightMeasures,
    ) {
        self.flown_s += leg.until_s - leg.from_s;
        self.ground_m += ground_m;
        self.fuel_m += fuel_m(leg, measures);
    }

    /// Counts a step on the flight plan.
    pub(crate) fn add_planned_step(&mut self) {
        self.side = ManeuverSide::None;
    }

    /// Counts the maneuver that a step begins, if it begins one.
    pub(crate) fn add_maneuver_step(&mut self, step: &Maneuvering) {
        let side = step.side();
        let before = std::mem::replace(&mut self.side, side);
        if side == ManeuverSide::None || side == before {
            return;
        }
        self.maneuvers += 1;
        self.reversals += u32::from(before != ManeuverSide::None);
    }
}

/// Returns the level, straight path through the air, in meters, on which an airplane of constant mass does the same work
/// against drag and gravity as on a leg.
///
/// Anderson, "Aircraft Performance and Design" (1999), chapters 5 and 6: fuel goes with thrust times airspeed, drag in
/// level flight is weight over `L/D`, and a climb by `h` takes weight times `h`, which is `L/D · h` of level flight. In a
/// level turn the load factor is `n² = 1 + (v ω / g)²`; at the greatest `L/D` half of the drag is induced and grows by `n²`.
fn fuel_m(leg: &ConstantRateLeg, measures: FlightMeasures) -> f64 {
    let duration_s = leg.until_s - leg.from_s;
    let centripetal = leg.v_m_s * leg.omega_rad_s / GRAVITY_M_S2;
    let drag_factor = 1.0 + 0.5 * centripetal * centripetal;
    let climbed_m = (leg.climb_m_s * duration_s).max(0.0);
    leg.v_m_s * duration_s * drag_factor + measures.lift_to_drag * climbed_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Pose2;
    use proptest::prelude::*;
    use sidestep_kernel::math;

    const MEASURES: FlightMeasures = FlightMeasures { lift_to_drag: 15.0 };

    fn leg(v_m_s: f64, omega_rad_s: f64) -> ConstantRateLeg {
        let pose = Pose2 { at: [0.0; 2], heading_rad: 0.0 };
        ConstantRateLeg::new(0.0, 10.0, pose, v_m_s, omega_rad_s)
    }

    fn effort(leg: &ConstantRateLeg) -> FlightEffort {
        let mut effort = FlightEffort::default();
        effort.add_leg(leg, MEASURES);
        effort
    }

    #[test]
    fn straight_level_flight_costs_its_path_through_the_air() {
        let found = effort(&leg(35.0, 0.0).in_wind([-5.0, 0.0]));
        assert_eq!((found.flown_s, found.ground_m, found.fuel_m), (10.0, 300.0, 350.0));
    }

    #[test]
    fn a_climb_costs_its_height_times_the_lift_to_drag_ratio_and_a_descent_gives_nothing_back() {
        assert_eq!(effort(&leg(35.0, 0.0).with_climb(0.0, 2.0)).fuel_m, 350.0 + 15.0 * 20.0);
        assert_eq!(effort(&leg(35.0, 0.0).with_climb(0.0, -2.0)).fuel_m, 350.0);
    }

    #[test]
    fn a_turn_costs_half_of_the_square_of_its_load_factor_more() {
        // 35 m/s at 4 deg/s are 2.4435 m/s², 0.24916 g: n² - 1 = 0.062083, half of it 3.104 %.
        let found = effort(&leg(35.0, 4f64.to_radians()));
        assert!((found.fuel_m / 350.0 - 1.031_04).abs() < 1e-5, "{found:?}");
        assert!((found.ground_m - 350.0).abs() < 1e-9);
    }

    #[test]
    fn the_path_over_the_ground_in_a_turn_in_a_wind_is_that_of_many_short_chords() {
        let turn = leg(35.0, -0.3).in_wind([20.0, -9.0]);
        let at = |k: u32| turn.motion(f64::from(k) * 1e-4).at;
        let chords = (0..100_000).map(|k| crate::flight::distance_m(at(k), at(k + 1)));
        let sum_m: f64 = chords.sum();
        assert!((turn.ground_length_m() - sum_m).abs() < 1e-4, "{sum_m}");
    }

    proptest! {
        /// The quick look never passes over a step that the exact one finds to be a maneuver.
        #[test]
        fn what_is_surely_on_course_is_no_maneuver(
            heading_rad in -3.2f64..3.2, aside_rad in -0.4f64..0.4, omega in -0.02f64..0.02,
            omega_max_rad_s in 0.01f64..6.0, dtau_s in 0.1f64..20.0, distance_m in 1.0f64..1e5,
        ) {
            let unit = |rad: f64| [math::cos(rad), math::sin(rad)];
            let offset_m = unit(heading_rad + aside_rad).map(|part| part * distance_m);
            let omega_rad_s = omega * omega_max_rad_s;
            let step =
                CourseStep { along: unit(heading_rad), offset_m, omega_rad_s, omega_max_rad_s, dtau_s };
            let pose = Pose2 { at: [0.0; 2], heading_rad };
            let planned_rad_s = pose.steer(offset_m, omega_max_rad_s, dtau_s);
            let exact = Maneuvering { omega_rad_s, planned_rad_s, omega_max_rad_s }.side();
            prop_assert!(!step.is_surely_on_course() || exact == ManeuverSide::None, "{step:?}");
        }
    }

    #[test]
    fn a_maneuver_lasts_until_the_flight_plan_is_flown_again_and_a_change_of_side_is_a_reversal() {
        let mut effort = FlightEffort::default();
        // Away to the left, beside the course, back as planned, twice to the right, and over to the left.
        for (omega, planned) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, -1.0),
            (-1.0, -1.0),
            (-1.0, 0.0),
            (-1.0, 0.05),
            (1.0, 0.0),
        ] {
            effort.add_maneuver_step(&Maneuvering {
                omega_rad_s: omega,
                planned_rad_s: planned,
                omega_max_rad_s: 1.0,
            });
        }
        assert_eq!((effort.maneuvers, effort.reversals), (3, 1));
    }
}
