//! The level and the airspeed of an aircraft of a BlueSky file from command to command.

use super::{FOOT_M, MIN_SPEED_M_S};
use crate::flight::CLIMB_M_S;
use sidestep_import::bluesky::{Airspeed, ScnAircraft};

/// Feet between two levels at which the true airspeed of a climb is computed.
const LEVEL_STEP_FT: f64 = 100.0;
/// Largest difference in meters per second between the true airspeed that is flown in a climb and the one that would be
/// right.
const MAX_SPEED_ERROR_M_S: f64 = 0.5;
/// Smallest vertical speed in ft/min that BlueSky takes for one; for others it takes its own.
const MIN_VERTICAL_SPEED_FPM: f64 = 0.01;

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

/// An aircraft on its way through its commands.
pub(super) struct ScnFlight {
    pub(super) commands: Vec<(f64, FlightCommand)>,
    now_s: f64,
    altitude_ft: f64,
    /// The level that it keeps or climbs to.
    level_ft: f64,
    /// The vertical speed that it was given last, up or down; 0 for BlueSky's own.
    vertical_fpm: f64,
    speed: Airspeed,
    /// The true airspeed that this was when it was given, in m/s.
    given_m_s: f64,
    /// True airspeed that it flies with.
    flown_m_s: f64,
}

impl ScnFlight {
    /// Returns an aircraft at its creation.
    pub(super) fn new(aircraft: &ScnAircraft) -> Self {
        let ScnAircraft { created_s, altitude_ft, speed, .. } = *aircraft;
        let given_m_s = speed.true_airspeed_mps(altitude_ft);
        Self {
            commands: Vec::new(),
            now_s: created_s,
            altitude_ft,
            level_ft: altitude_ft,
            vertical_fpm: 0.0,
            speed,
            given_m_s,
            flown_m_s: given_m_s,
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

    /// Returns the true airspeed at the present level. No climb leads beyond the speed of sound: a calibrated airspeed means
    /// more and more on higher levels, and an aircraft so fast would turn in circles as wide as a country.
    fn airspeed_m_s(&self) -> f64 {
        let kept_m_s = self.speed.true_airspeed_mps(self.altitude_ft);
        let sound_m_s = Airspeed::Mach(1.0).true_airspeed_mps(self.altitude_ft);
        kept_m_s.min(sound_m_s.max(self.given_m_s)).max(MIN_SPEED_M_S)
    }

    /// Adds the true airspeed at the present level if it differs; in a climb as far beyond it as the last one fell behind.
    fn fly_at_level(&mut self, is_reached: bool) {
        let right_m_s = self.airspeed_m_s();
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
        self.given_m_s = speed.true_airspeed_mps(self.altitude_ft).max(MIN_SPEED_M_S);
        self.fly_with(self.given_m_s);
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
