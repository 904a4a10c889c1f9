//! Remarks on valid scenarios.

use super::CompiledAirspace;
use super::effectless::effectless_remarks;
use sidestep_scenario::Remark;

/// Acceleration of gravity in meters per second squared.
const GRAVITY_M_S2: f64 = 9.80665;
/// Largest acceleration to the side of a turn without a warning, in gravities: 80 degrees of bank. Aerobatic and combat
/// aircraft pull more for seconds, and not in every turn.
const MAX_TURN_GRAVITIES: f64 = 5.67;

/// Tangent of 30 degrees of bank, a turn that airplanes fly all the time.
const USUAL_BANK_TANGENT: f64 = 0.577_350_269_189_625_8;

/// Returns the remarks on a scenario, warnings first.
pub(crate) fn scenario_remarks(compiled: &CompiledAirspace) -> Vec<Remark> {
    let mut remarks: Vec<Remark> = turn_remark(compiled).into_iter().collect();
    remarks.extend(effectless_remarks(compiled));
    remarks
}

/// Returns a warning of the hardest turn, if hardly any aircraft could fly it.
fn turn_remark(compiled: &CompiledAirspace) -> Option<Remark> {
    let turns = compiled.world.airplanes.iter().map(|airplane| {
        let model = &airplane.model;
        (model.v_m_s * model.omega_max_rad_s / GRAVITY_M_S2, model)
    });
    let (gravities, model) = turns.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    if gravities <= MAX_TURN_GRAVITIES {
        return None;
    }
    let usual_deg_s = (GRAVITY_M_S2 * USUAL_BANK_TANGENT / model.v_m_s).to_degrees();
    let words = format!(
        "turns of {} deg/s at {} m/s need {gravities:.0} times the acceleration of gravity, which hardly any aircraft flies: \
         at 30 degrees of bank it turns by {usual_deg_s:.2} deg/s",
        round_to_hundredths(model.omega_max_rad_s.to_degrees()),
        round_to_hundredths(model.v_m_s),
    );
    Some(Remark::warning("airplane.omega_max_deg_s", words))
}

/// Returns a number as it is shown: without the digits that a change of units leaves.
fn round_to_hundredths(number: f64) -> f64 {
    (100.0 * number).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_scenario::{Severity, Source};

    fn remarks(airplane: &str) -> Vec<Remark> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airplane]\n{airplane}\n[[airplanes]]\nat_m = [0, 0]\n\
             heading_deg = 0\nway_points_m = [[90000, 0]]\n"
        );
        scenario_remarks(
            &CompiledAirspace::new(&Source::new("test", text, "")).expect("a scenario"),
        )
    }

    #[test]
    fn turns_that_hardly_any_aircraft_flies_are_named_with_a_rate_that_most_do() {
        assert_eq!(remarks(""), []);
        assert_eq!(remarks("v_m_s = 12.0\nomega_max_deg_s = 90.0"), [], "a multirotor");
        let [warning] = &remarks("v_m_s = 300.0\nomega_max_deg_s = 75.0")[..] else {
            panic!("one")
        };
        assert_eq!(warning.severity, Severity::Warning);
        for words in ["75 deg/s at 300 m/s", "40 times", "turns by 1.08 deg/s"] {
            assert!(warning.words.contains(words), "{}", warning.words);
        }
    }
}
