//! Aircraft of a BlueSky file from the time when they move, and the commands to them.

use super::MIN_SPEED_M_S;
use super::commanded_flight::CommandedFlight;
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

/// A command to an airplane, in the scenario's terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FlightCommand {
    /// Degrees counterclockwise from east.
    Heading(f64),
    Speed(f64),
    /// Meters, and meters per second.
    Altitude(f64, f64),
    Proceed,
    Leave,
}

impl FlightCommand {
    pub(super) fn text(self) -> String {
        match self {
            Self::Heading(deg) => format!("heading_deg = {deg:?}"),
            Self::Speed(v_m_s) => format!("speed_m_s = {v_m_s:?}"),
            Self::Altitude(altitude_m, climb_m_s) => {
                format!("altitude_m = {altitude_m:?}, climb_m_s = {climb_m_s:?}")
            }
            Self::Proceed => "proceeds = true".into(),
            Self::Leave => "leaves = true".into(),
        }
    }
}

/// Returns the commands that an aircraft is given on the way, with their times, and the true airspeeds that its
/// calibrated one or its Mach number means on the levels that it climbs through.
pub(super) fn commands_from_changes(
    aircraft: &ScnAircraft,
    has_route: bool,
) -> Vec<(f64, FlightCommand)> {
    let mut flight = CommandedFlight::new(aircraft);
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
