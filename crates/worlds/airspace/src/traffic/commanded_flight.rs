//! The level and the airspeed of an aircraft of a BlueSky file from command to command.

use super::flyable_aircraft::FlightCommand;
use super::{FOOT_M, MIN_SPEED_M_S};
use crate::flight_plan::CLIMB_M_S;
use sidestep_import::bluesky::{Airspeed, ScnAircraft};

/// Feet between two levels at which the true airspeed of a climb is computed.
const LEVEL_STEP_FT: f64 = 100.0;
/// Largest difference in meters per second between the true airspeed that is flown in a climb and the one that would be
/// right.
const MAX_SPEED_ERROR_M_S: f64 = 0.5;
/// Smallest vertical speed in ft/min that BlueSky takes for one; for others it takes its own.
const MIN_VERTICAL_SPEED_FPM: f64 = 0.01;

/// An aircraft on its way through its commands.
pub(super) struct CommandedFlight {
    pub(super) commands: Vec<(f64, FlightCommand)>,
    now_s: f64,
    altitude_ft: f64,
    /// The level that it keeps or climbs to.
    level_ft: f64,
    /// The vertical speed that it was given last, up or down; 0 for BlueSky's own.
    vertical_fpm: f64,
    speed: Airspeed,
    /// True airspeed that it flies with.
    flown_m_s: f64,
}

impl CommandedFlight {
    /// Returns an aircraft at its creation.
    pub(super) fn new(aircraft: &ScnAircraft) -> Self {
        let ScnAircraft { created_s, altitude_ft, speed, .. } = *aircraft;
        Self {
            commands: Vec::new(),
            now_s: created_s,
            altitude_ft,
            level_ft: altitude_ft,
            vertical_fpm: 0.0,
            speed,
            flown_m_s: speed.true_airspeed_mps(altitude_ft),
        }
    }

    fn climb_m_s(&self) -> f64 {
        if self.vertical_fpm == 0.0 { CLIMB_M_S } else { self.vertical_fpm.abs() * FOOT_M / 60.0 }
    }

    /// Goes on to a time, and adds the true airspeeds that change with the level.
    pub(super) fn climb_until(&mut self, until_s: f64) {
        let climb_ft_s = self.climb_m_s() / FOOT_M;
        while self.altitude_ft != self.level_ft && self.now_s < until_s {
            let left_ft = self.level_ft - self.altitude_ft;
            let step_ft = left_ft.clamp(-LEVEL_STEP_FT, LEVEL_STEP_FT);
            let step_s = step_ft.abs() / climb_ft_s;
            if self.now_s + step_s > until_s {
                self.altitude_ft += (until_s - self.now_s) * climb_ft_s * left_ft.signum();
                break;
            }
            self.now_s += step_s;
            let is_reached = step_ft == left_ft;
            self.altitude_ft = if is_reached { self.level_ft } else { self.altitude_ft + step_ft };
            self.fly_at_level(is_reached);
        }
        self.now_s = self.now_s.max(until_s);
    }

    /// Adds the true airspeed at the present level if it differs; in a climb as far beyond it as the last one fell behind.
    fn fly_at_level(&mut self, is_reached: bool) {
        let right_m_s = self.speed.true_airspeed_mps(self.altitude_ft).max(MIN_SPEED_M_S);
        let behind_m_s = right_m_s - self.flown_m_s;
        if is_reached && behind_m_s != 0.0 {
            self.fly_with(right_m_s);
        } else if behind_m_s.abs() >= MAX_SPEED_ERROR_M_S {
            let beyond_m_s = right_m_s + MAX_SPEED_ERROR_M_S.copysign(behind_m_s);
            self.fly_with(beyond_m_s.max(MIN_SPEED_M_S));
        }
    }

    fn fly_with(&mut self, v_m_s: f64) {
        self.flown_m_s = v_m_s;
        self.commands.push((self.now_s, FlightCommand::Speed(v_m_s)));
    }

    pub(super) fn take_speed(&mut self, speed: Airspeed) {
        self.speed = speed;
        self.fly_with(speed.true_airspeed_mps(self.altitude_ft).max(MIN_SPEED_M_S));
    }

    /// Climbs to a level, with BlueSky's own vertical speed where the one that was given leads away from it.
    pub(super) fn take_level(&mut self, level_ft: f64) {
        self.level_ft = level_ft;
        if self.vertical_fpm * (level_ft - self.altitude_ft) < 0.0 {
            self.vertical_fpm = 0.0;
        }
        self.command_climb();
    }

    /// Takes a vertical speed for the climb that is flown, and for later ones.
    pub(super) fn take_vertical_speed(&mut self, fpm: f64) {
        self.vertical_fpm = if fpm.abs() < MIN_VERTICAL_SPEED_FPM { 0.0 } else { fpm };
        let climb_m_s = self.climb_m_s();
        if let Some((last_s, FlightCommand::Altitude(_, rate_m_s))) = self.commands.last_mut()
            && *last_s == self.now_s
        {
            *rate_m_s = climb_m_s;
        } else if self.altitude_ft != self.level_ft {
            self.command_climb();
        }
    }

    fn command_climb(&mut self) {
        let climb = FlightCommand::Altitude(self.level_ft * FOOT_M, self.climb_m_s());
        self.commands.push((self.now_s, climb));
    }
}

#[cfg(test)]
mod tests {
    use super::super::flyable_aircraft::commands_from_changes;
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
