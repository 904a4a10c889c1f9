//! Remarks on valid scenarios.

use super::CompiledAirspace;
use super::effectless::effectless_remarks;
use crate::flight::{AirplaneStart, FlightLevelRange, GRAVITY_M_S2, Point};
use sidestep_scenario::{Remark, Severity};

/// Largest acceleration to the side of a turn without a warning, in gravities: 80 degrees of bank. Aerobatic and combat
/// aircraft pull more for seconds, and not in every turn.
const MAX_TURN_GRAVITIES: f64 = 5.67;

/// Tangent of 30 degrees of bank, a turn that airplanes fly all the time.
const USUAL_BANK_TANGENT: f64 = 0.577_350_269_189_625_8;

/// Returns the remarks on a scenario, warnings first.
pub(crate) fn scenario_remarks(compiled: &CompiledAirspace) -> Vec<Remark> {
    let mut remarks: Vec<Remark> = turn_remark(compiled).into_iter().collect();
    remarks.extend(missing_type_remarks(compiled));
    remarks.extend(area_remarks(compiled));
    remarks.extend(endurance_remark(compiled));
    remarks.extend(effectless_remarks(compiled));
    // A stable sort, warnings first.
    remarks.sort_by_key(|remark| remark.severity != Severity::Warning);
    remarks
}

/// Returns notes on the limits that types of another program's tables leave out, so that nothing limits them.
fn missing_type_remarks(compiled: &CompiledAirspace) -> Vec<Remark> {
    let missing = compiled.recipe.types.missing.iter().filter(|(_, keys)| !keys.is_empty());
    let note = |(name, keys): (&String, &Vec<String>)| {
        let words = format!(
            "OpenAP gives no {} of type {name}: what [airplane] or the airplane gives counts, or else nothing limits it",
            keys.join(", ")
        );
        Remark::note("airspace.openap_folder", words)
    };
    missing.map(note).collect()
}

/// The fastest turn of an airplane at one of its speeds.
struct FastTurn {
    /// Acceleration to the side, in gravities.
    gravities: f64,
    v_m_s: f64,
    omega_rad_s: f64,
}

/// Returns a warning of the hardest turn, if hardly any aircraft could fly it.
fn turn_remark(compiled: &CompiledAirspace) -> Option<Remark> {
    let turns = compiled.world.airplanes.iter().flat_map(|airplane| {
        airplane.planned_speeds_m_s().map(|v_m_s| {
            let omega_rad_s = airplane.performance.turn.omega_rad_s(v_m_s);
            FastTurn { gravities: v_m_s * omega_rad_s / GRAVITY_M_S2, v_m_s, omega_rad_s }
        })
    });
    let FastTurn { gravities, v_m_s, omega_rad_s } =
        turns.max_by(|a, b| a.gravities.total_cmp(&b.gravities))?;
    if gravities <= MAX_TURN_GRAVITIES {
        return None;
    }
    let usual_deg_s = (GRAVITY_M_S2 * USUAL_BANK_TANGENT / v_m_s).to_degrees();
    let words = format!(
        "turns of {} deg/s at {} m/s need {gravities:.0} times the acceleration of gravity, which hardly any aircraft flies: \
         at 30 degrees of bank it turns by {usual_deg_s:.2} deg/s",
        round_to_hundredths(omega_rad_s.to_degrees()),
        round_to_hundredths(v_m_s),
    );
    Some(Remark::warning("airplane.omega_max_deg_s", words))
}

/// Returns a warning of airplanes whose flight takes longer than their endurance even if nobody delays it.
fn endurance_remark(compiled: &CompiledAirspace) -> Option<Remark> {
    let world = &*compiled.world;
    let is_short = |id: &u32| {
        let i = *id as usize;
        world.alone_s[i] > world.airplanes[i].performance.endurance_s
    };
    let short: Vec<u32> = (0..world.airplanes.len() as u32).filter(is_short).collect();
    let first = *short.first()?;
    let others = match short.len() {
        1 => String::new(),
        many => format!("; so do {} more", many - 1),
    };
    let endurance_s = world.airplanes[first as usize].performance.endurance_s;
    let words = format!(
        "the flight of airplane {} alone takes {:.0} s, longer than the {endurance_s} s for which its fuel lasts{others}",
        world.display_name(first),
        world.alone_s[first as usize],
    );
    Some(Remark::warning("airplane.endurance_s", words))
}

/// Returns what an author may not expect of areas: airplanes that start, or have way-points, where an area does not permit
/// them to be; and what was not taken of a file as it stood.
fn area_remarks(compiled: &CompiledAirspace) -> Vec<Remark> {
    let world = &*compiled.world;
    let given = compiled.recipe.file.airspace.areas.len();
    let mut remarks = Vec::new();
    for (number, area) in world.areas.iter().enumerate() {
        let key = if number < given {
            format!("airspace.areas.{number}")
        } else {
            "airspace.areas_file".to_string()
        };
        let forbids = |at: Point, airplane: &AirplaneStart| {
            area.is_on_levels(&FlightLevelRange::from_level(airplane.altitude_m))
                && area.forbids(area.plane_at(world.surface, area.from_s).to_area(at))
        };
        let mut add = |ids: Vec<u32>, words: &str| {
            let Some(&first) = ids.first() else { return };
            let name = world.display_name(first);
            let others = match ids.len() {
                1 => String::new(),
                many => format!(" and {} more", many - 1),
            };
            let area = area.display_name(number);
            remarks.push(Remark::warning(
                key.clone(),
                format!("{area}: airplane {name}{others} {words}"),
            ));
        };
        let find = |is: &dyn Fn(&AirplaneStart) -> bool| -> Vec<u32> {
            let cooperative =
                |airplane: &AirplaneStart| !airplane.is_non_cooperative && is(airplane);
            (0..)
                .zip(world.airplanes.iter())
                .filter(|(_, one)| cooperative(one))
                .map(|(id, _)| id)
                .collect()
        };
        if area.is_permanent() {
            let starts = find(&|airplane| forbids(airplane.start.at, airplane));
            add(
                starts,
                "begins where it does not permit it to be, and is exempt until it is clear of it",
            );
            let ends = find(&|airplane| airplane.mission.iter().any(|&at| forbids(at, airplane)));
            add(ends, "has a way-point where it does not permit it to be, and will not get there");
        }
    }
    if let Some(found) = &compiled.recipe.areas_file {
        remarks.extend(found.report.remarks("airspace.areas_file"));
    }
    remarks
}

/// Returns a number as it is shown: without the digits that a change of units leaves.
fn round_to_hundredths(number: f64) -> f64 {
    (100.0 * number).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_scenario::Source;

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
    fn a_flight_that_is_longer_than_its_fuel_lasts_is_named() {
        assert_eq!(remarks("endurance_s = 3000.0"), []);
        let [warning] = &remarks("endurance_s = 2000.0")[..] else { panic!("one") };
        assert_eq!(warning.severity, Severity::Warning);
        assert!(warning.words.contains("2569 s, longer than the 2000 s"), "{}", warning.words);
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
