//! Checks of what airplanes are to do against what they can fly.

use super::compile::Compiler;
use crate::flight::{AirplaneStart, Performance, TurnLimit};
use crate::flight_plan::AirplaneSection;
use crate::flight_plan::limits::{Mistake, altitude_range, of_type, speed_range};
use crate::settings::AbilityKeys;
use sidestep_kernel::InputError;
use sidestep_scenario::Spanned;

/// Smallest turn rate in radians per second that an airplane may be left with: that of the keys, 0.001 degrees per
/// second.
const MIN_TURN_RAD_S: f64 = 1e-3 * std::f64::consts::PI / 180.0;

/// Largest turn rate that a scenario may give, in degrees per second.
const MAX_TURN_DEG_S: f64 = 360.0;

/// Returns the performance that keys describe. The turn rate that airplanes have without any key, `usual_rad_s`, is no
/// limit beside a bank.
pub(super) fn performance_from_keys(
    keys: &AbilityKeys,
    type_name: Option<String>,
    usual_rad_s: f64,
) -> Performance {
    let usual_rad_s =
        if keys.bank_max_deg.is_some() { MAX_TURN_DEG_S.to_radians() } else { usual_rad_s };
    let omega_max_rad_s = keys.omega_max_deg_s.map_or(usual_rad_s, f64::to_radians);
    let lateral_m_s2 = keys.bank_max_deg.map_or(f64::INFINITY, TurnLimit::lateral_m_s2);
    Performance {
        type_name,
        turn: TurnLimit { omega_max_rad_s, lateral_m_s2 },
        v_min_m_s: keys.v_min_m_s.unwrap_or(0.0),
        v_max_m_s: keys.v_max_m_s.unwrap_or(f64::INFINITY),
        climb_max_m_s: keys.climb_max_m_s.unwrap_or(f64::INFINITY),
        descent_max_m_s: keys.descent_max_m_s.unwrap_or(f64::INFINITY),
        floor_m: keys.floor_m.unwrap_or(f64::NEG_INFINITY),
        ceiling_m: keys.ceiling_m.unwrap_or(f64::INFINITY),
        acceleration_m_s2: keys.acceleration_m_s2.unwrap_or(f64::INFINITY),
        endurance_s: keys.endurance_s.unwrap_or(f64::INFINITY),
    }
}

impl Compiler<'_> {
    /// Refuses an airplane that cannot fly as it starts, by its own section, or by that of all.
    ///
    /// # Errors
    /// When its limits leave nothing, or its speed or its level is beyond them.
    pub(super) fn check_performance(
        &self,
        airplane: &AirplaneStart,
        section: Option<&Spanned<AirplaneSection>>,
    ) -> Result<(), InputError> {
        let mistake = limits_mistake(&airplane.performance)
            .or_else(|| speed_mistake(airplane))
            .or_else(|| altitude_mistake(airplane));
        let Some((cause, remedy)) = mistake else { return Ok(()) };
        Err(match section {
            Some(section) => self.source.error(section.span(), cause, remedy),
            None => self.source.error_at("airplane", cause, remedy),
        })
    }
}

fn limits_mistake(performance: &Performance) -> Option<Mistake> {
    let Performance { v_min_m_s, v_max_m_s, floor_m, ceiling_m, .. } = performance;
    let of_type = of_type(performance);
    if v_min_m_s > v_max_m_s {
        let cause = format!(
            "an airplane{of_type} with v_min_m_s = {v_min_m_s} above v_max_m_s = {v_max_m_s}"
        );
        return Some((cause, "give a v_max_m_s that is not below v_min_m_s".into()));
    }
    if floor_m > ceiling_m {
        let cause =
            format!("an airplane{of_type} with floor_m = {floor_m} above ceiling_m = {ceiling_m}");
        return Some((cause, "give a ceiling_m that is not below floor_m".into()));
    }
    None
}

fn speed_mistake(airplane: &AirplaneStart) -> Option<Mistake> {
    let performance = &airplane.performance;
    let of_type = of_type(performance);
    let v_m_s = airplane.model.v_m_s;
    if !performance.allows_speed(v_m_s) {
        let cause = if airplane.track.is_some() {
            format!("an airplane{of_type} that is to fly on at {v_m_s} m/s, the mean of its track")
        } else {
            format!("an airplane{of_type} that flies at {v_m_s} m/s")
        };
        return Some((cause, format!("give a v_m_s {}", speed_range(performance))));
    }
    for change_m_s in &airplane.changes.speeds_m_s {
        let changed = airplane.filed_speeds_m_s().map(|v_m_s| (v_m_s + change_m_s, v_m_s));
        if let Some((_, v_m_s)) = changed.into_iter().find(|(changed_m_s, _)| *changed_m_s <= 0.0) {
            let cause = format!(
                "an airplane{of_type} that flies at {v_m_s} m/s, with a change of {change_m_s} m/s in speed_changes_m_s"
            );
            let remedy =
                format!("give changes above {} m/s: no airplane stands still in the air", -v_m_s);
            return Some((cause, remedy));
        }
    }
    let omega_rad_s = airplane.least_turning_model().omega_max_rad_s;
    if omega_rad_s < MIN_TURN_RAD_S {
        let cause = format!(
            "an airplane{of_type} that is left with a turn rate of {:e} deg/s at its greatest speed",
            omega_rad_s.to_degrees()
        );
        return Some((cause, "give a larger bank_max_deg or smaller speeds".into()));
    }
    None
}

fn altitude_mistake(airplane: &AirplaneStart) -> Option<Mistake> {
    let performance = &airplane.performance;
    // A track is flown as it was recorded.
    if airplane.track.is_some() || performance.allows_altitude(airplane.altitude_m) {
        return None;
    }
    let cause =
        format!("an airplane{} at an altitude of {} m", of_type(performance), airplane.altitude_m);
    Some((cause, format!("give an altitude_m {}", altitude_range(performance))))
}

#[cfg(test)]
mod tests {
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    fn compiled(keys: &str) -> Result<CompiledAirspace, String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\n\
             way_points_m = [[9000, 0]]\n{keys}\n"
        );
        CompiledAirspace::new(&Source::new("p", text, "")).map_err(|error| error.to_string())
    }

    #[test]
    fn what_an_airplane_cannot_fly_is_an_error_with_what_it_can() {
        for (keys, cause, remedy) in [
            (
                "type = \"airliner\"\nv_m_s = 300.0",
                "of type airliner that flies at 300 m/s",
                "from 70 to 243 m/s",
            ),
            ("v_m_s = 10.0\nv_min_m_s = 12.0", "flies at 10 m/s", "from 12 m/s on"),
            ("v_min_m_s = 50.0\nv_max_m_s = 40.0", "above v_max_m_s = 40", "not below v_min_m_s"),
            ("floor_m = 50.0\nceiling_m = 40.0", "above ceiling_m = 40", "not below floor_m"),
            (
                "ceiling_m = 100.0\naltitude_m = 200.0",
                "at an altitude of 200 m",
                "altitude_m up to 100 m",
            ),
            (
                "v_max_m_s = 40.0\norders = [{ at_s = 5.0, speed_m_s = 41.0 }]",
                "ordered to 41 m/s",
                "speed_m_s from 0 to 40 m/s",
            ),
            (
                "ceiling_m = 900.0\norders = [{ at_s = 5.0, altitude_m = 950.0 }]",
                "ordered to an altitude of 950 m",
                "altitude_m up to 900 m",
            ),
            (
                "climb_max_m_s = 3.0\norders = [{ at_s = 5.0, altitude_m = 950.0, climb_m_s = 4.0 }]",
                "ordered to climb at 4 m/s",
                "climb_m_s up to 3, or leave it out",
            ),
            (
                "altitude_m = 990.0\ndescent_max_m_s = 3.0\norders = [{ altitude_m = 950.0, climb_m_s = 4.0 }]",
                "ordered to descend at 4 m/s",
                "climb_m_s up to 3",
            ),
            (
                "acceleration_m_s2 = 0.00001\norders = [{ at_s = 5.0, speed_m_s = 41.0 }]",
                "more than 60000 cycles",
                "larger acceleration_m_s2",
            ),
            (
                "v_m_s = 1000.0\nbank_max_deg = 1.0\nv_max_m_s = 1e6\norders = [{ at_s = 1, speed_m_s = 1e6 }]",
                "left with a turn rate",
                "larger bank_max_deg",
            ),
        ] {
            let error = compiled(keys).expect_err(keys);
            assert!(error.contains(cause) && error.contains(remedy), "{keys}: {error}");
        }
    }

    #[test]
    fn a_change_of_level_without_a_rate_is_as_fast_as_the_airplane_can_up_to_the_usual_rate() {
        let orders =
            "orders = [{ at_s = 5.0, altitude_m = 90.0 }, { at_s = 50.0, altitude_m = 0.0 }]";
        let rates = |keys: &str| {
            let world = compiled(&format!("{keys}\n{orders}")).expect("right").world;
            [1, 2].map(|done| {
                let segment = world.segment(0, done);
                segment.vertical_m_s(if done == 1 { 0.0 } else { 90.0 })
            })
        };
        assert_eq!(rates(""), [7.62; 2]);
        assert_eq!(rates("climb_max_m_s = 3.0\ndescent_max_m_s = 90.0"), [3.0, 7.62]);
    }

    #[test]
    fn without_limits_an_airplane_is_as_ever() {
        let [plain, limited] = ["", "bank_max_deg = 80.0\nomega_max_deg_s = 4.0"]
            .map(|keys| compiled(keys).expect("right").world.airplanes[0].model.clone());
        assert_eq!(plain, limited);
        let banked = compiled("bank_max_deg = 30.0").expect("right");
        let omega_rad_s = banked.world.airplanes[0].model.omega_max_rad_s;
        assert!(
            (omega_rad_s.to_degrees() - 9.268).abs() < 1e-3,
            "bank alone counts: {omega_rad_s}"
        );
    }
}
