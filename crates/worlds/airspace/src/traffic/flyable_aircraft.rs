//! Aircraft of a BlueSky file from the time when they move, and the commands to them.

use super::MIN_SPEED_M_S;
use super::scn_flight::{FlightCommand, ScnFlight};
use sidestep_import::bluesky::{AircraftCommand, Airspeed, ScnAircraft};

/// The largest time of a file in seconds; no climb is followed beyond it.
const MAX_TIME_S: f64 = 1000.0 * 3600.0;

/// An aircraft from the time when it starts to move.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlyableScnAircraft(pub(super) ScnAircraft);

impl FlyableScnAircraft {
    /// The aircraft.
    pub(super) fn scn(&self) -> &ScnAircraft {
        &self.0
    }

    /// Returns the smallest speed that it has or is given.
    pub(super) fn min_speed_m_s(&self) -> f64 {
        let mut min_m_s = self.0.speed.true_airspeed_mps(self.0.altitude_ft);
        for (_, command) in commands_from_changes(&self.0, false) {
            if let FlightCommand::Speed(v_m_s) = command {
                min_m_s = min_m_s.min(v_m_s);
            }
        }
        min_m_s
    }
}

/// Returns an aircraft as it is when it gets a speed: at its creation, or later, then with the
/// heading and level that it was given until then. `None` for one that never gets a speed.
pub(super) fn aircraft_at_flying_speed(aircraft: &ScnAircraft) -> Option<FlyableScnAircraft> {
    let mut one = aircraft.clone();
    if is_flying_speed(one.speed, one.altitude_ft) {
        return Some(FlyableScnAircraft(one));
    }
    for (k, &(at_s, change)) in aircraft.changes.iter().enumerate() {
        match change {
            AircraftCommand::HeadingDeg(deg) => one.heading_deg = deg,
            AircraftCommand::AltitudeFt(ft) => one.altitude_ft = ft,
            AircraftCommand::Speed(speed) if is_flying_speed(speed, one.altitude_ft) => {
                one.speed = speed;
                one.created_s = at_s;
                one.changes.drain(..=k);
                return one
                    .deleted_s
                    .is_none_or(|end_s| end_s > at_s)
                    .then_some(FlyableScnAircraft(one));
            }
            _ => {}
        }
    }
    None
}

fn is_flying_speed(speed: Airspeed, altitude_ft: f64) -> bool {
    speed.true_airspeed_mps(altitude_ft) >= MIN_SPEED_M_S
}

/// Returns the commands that an aircraft is given on the way, with their times, and the true airspeeds that its
/// calibrated one or its Mach number means on the levels that it climbs through.
pub(super) fn commands_from_changes(
    aircraft: &ScnAircraft,
    has_route: bool,
) -> Vec<(f64, FlightCommand)> {
    let mut flight = ScnFlight::new(aircraft);
    for &(at_s, change) in &aircraft.changes {
        flight.climb_until(at_s);
        match change {
            AircraftCommand::HeadingDeg(deg) => {
                flight.commands.push((at_s, FlightCommand::Heading(90.0 - deg)))
            }
            AircraftCommand::Speed(speed) => flight.take_speed(speed),
            AircraftCommand::AltitudeFt(to_ft) => flight.take_level(to_ft),
            AircraftCommand::VerticalSpeedFpm(fpm) => flight.take_vertical_speed(fpm),
            AircraftCommand::LateralNavigation(true) if has_route => {
                flight.commands.push((at_s, FlightCommand::Proceed))
            }
            _ => {}
        }
    }
    flight.climb_until(aircraft.deleted_s.unwrap_or(MAX_TIME_S));
    flight.commands
}

#[cfg(test)]
mod tests {
    use super::super::FOOT_M;
    use super::*;
    use sidestep_import::bluesky::parse;

    fn commands(text: &str) -> Vec<(f64, FlightCommand)> {
        let file = parse(&"c.scn", &format!("00:00:00>CRE A1,B744,52,4,90,FL100,250\n{text}"));
        commands_from_changes(&file.traffic.aircraft[0], false)
    }

    #[test]
    fn a_calibrated_airspeed_stays_in_a_climb_and_a_mach_number_too() {
        let all = commands("00:01:00>ALT A1 FL200 2000\n");
        let level = Airspeed::CasKt(250.0);
        let (last_s, FlightCommand::Speed(top_m_s)) = all[all.len() - 1] else { panic!("{all:?}") };
        assert!((last_s - 360.0).abs() < 1e-6, "five minutes of climb: {last_s}");
        assert_eq!(top_m_s, level.true_airspeed_mps(20_000.0));
        for &(at_s, command) in &all[1..] {
            let FlightCommand::Speed(v_m_s) = command else { panic!("{all:?}") };
            let altitude_ft = 10_000.0 + (at_s - 60.0) * 2000.0 / 60.0;
            let off_m_s = v_m_s - level.true_airspeed_mps(altitude_ft);
            assert!(off_m_s.abs() < 0.51, "{at_s} s: {off_m_s}");
        }
        let mach = commands("00:00:00>SPD A1 M0.5\n00:00:00>ALT A1 FL200\n");
        let (_, FlightCommand::Speed(slower_m_s)) = mach[mach.len() - 1] else {
            panic!("{mach:?}")
        };
        assert_eq!(slower_m_s, Airspeed::Mach(0.5).true_airspeed_mps(20_000.0));
    }

    #[test]
    fn a_speed_in_a_climb_is_that_of_the_level_reached_by_then() {
        let all = commands("00:00:00>ALT A1 FL200 2000\n00:02:30>SPD A1 300\n");
        let ordered = all.iter().find(|(at_s, _)| *at_s == 150.0);
        let halfway_m_s = Airspeed::CasKt(300.0).true_airspeed_mps(15_000.0);
        let Some((_, FlightCommand::Speed(v_m_s))) = ordered else { panic!("{all:?}") };
        assert!((v_m_s - halfway_m_s).abs() < 1e-9, "{v_m_s} {halfway_m_s}");
    }

    #[test]
    fn no_climb_leads_beyond_the_speed_of_sound() {
        let speeds = |text: &str| -> Vec<f64> {
            let speed = |(_, command)| match command {
                FlightCommand::Speed(m_s) => Some(m_s),
                _ => None,
            };
            commands(text).into_iter().filter_map(speed).collect()
        };
        let sound_m_s = Airspeed::Mach(1.0).true_airspeed_mps(97_500.0);
        let fastest = speeds("00:00:00>ALT A1 97500\n").into_iter().fold(0.0, f64::max);
        assert!(fastest < sound_m_s + 1.0, "{fastest} {sound_m_s}");
        // One that is faster already keeps its speed.
        let given = speeds("00:00:00>SPD A1 M1.2\n00:00:00>ALT A1 FL110\n");
        let kept_m_s = Airspeed::Mach(1.2).true_airspeed_mps(11_000.0);
        assert!((given[given.len() - 1] - kept_m_s).abs() < 1e-9, "{given:?} {kept_m_s}");
    }

    #[test]
    fn a_vertical_speed_in_a_climb_holds_for_the_rest_of_it() {
        let climbs = |text: &str| -> Vec<(f64, f64)> {
            let climb = |(at_s, command)| match command {
                FlightCommand::Altitude(_, m_s) => Some((at_s, f64::round(m_s / FOOT_M * 60.0))),
                _ => None,
            };
            commands(text).into_iter().filter_map(climb).collect()
        };
        let changed = climbs("00:00:00>ALT A1 FL200\n00:01:00>VS A1 500\n");
        assert_eq!(changed, [(0.0, 1500.0), (60.0, 500.0)]);
        assert_eq!(climbs("00:00:00>VS A1 500\n00:00:00>ALT A1 FL200\n"), [(0.0, 500.0)]);
        // One that leads away from the level is not taken, and 0 stands for BlueSky's own.
        assert_eq!(climbs("00:00:00>VS A1 500\n00:00:00>ALT A1 FL050\n"), [(0.0, 1500.0)]);
        let own = climbs("00:00:00>ALT A1 FL200 500\n00:01:00>VS A1 0\n");
        assert_eq!(own, [(0.0, 500.0), (60.0, 1500.0)]);
    }
}
