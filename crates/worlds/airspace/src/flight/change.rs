//! Changes of level and speed as parts of actions, and where they lead.

use super::command::{LevelCommand, MethodCommand};
use super::levels::FlightLevelRange;
use super::performance::{CLIMB_M_S, Performance};
use serde::{Deserialize, Serialize};

/// A change of level and speed beside the filed flight, kept for the whole horizon: the parts of an action beside its
/// turn.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FlightChange {
    /// Meters above the level of the filed flight; negative below it.
    pub level_m: f64,
    /// Meters per second above the speed of the filed flight; negative below it.
    pub speed_m_s: f64,
}

impl FlightChange {
    /// The level and the speed of the filed flight.
    pub const NONE: Self = Self { level_m: 0.0, speed_m_s: 0.0 };
}

/// The changes of level and speed among which an airplane may choose.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChangeAlternatives {
    /// Meters against the level of the filed flight, none of them 0.
    pub levels_m: Vec<f64>,
    /// Meters per second against the speed of the filed flight, none of them 0.
    pub speeds_m_s: Vec<f64>,
    /// Whether every turn, change of level and change of speed is combined with all others; else an action has only one of
    /// the three.
    pub is_product: bool,
}

impl ChangeAlternatives {
    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.levels_m.is_empty() && self.speeds_m_s.is_empty()
    }

    /// Returns all changes, without that to the filed flight.
    pub(crate) fn all(&self) -> Vec<FlightChange> {
        let level = |&level_m: &f64| FlightChange { level_m, ..FlightChange::NONE };
        let speed = |&speed_m_s: &f64| FlightChange { speed_m_s, ..FlightChange::NONE };
        let mut all: Vec<FlightChange> = self.levels_m.iter().map(level).collect();
        all.extend(self.speeds_m_s.iter().map(speed));
        if self.is_product {
            for &level_m in &self.levels_m {
                for &speed_m_s in &self.speeds_m_s {
                    all.push(FlightChange { level_m, speed_m_s });
                }
            }
        }
        all
    }
}

/// A steady change from one value to another, and then that one: of an altitude in meters, or of a speed in meters per
/// second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyChange {
    /// The value at the start.
    pub from: f64,
    /// The value at the end.
    pub to: f64,
    /// Change in a second at most.
    pub rate_s: f64,
}

impl SteadyChange {
    /// Returns the value that stays as it is.
    pub fn constant(value: f64) -> Self {
        Self { from: value, to: value, rate_s: f64::INFINITY }
    }

    /// Returns the value after some seconds.
    pub fn after(&self, seconds: f64) -> f64 {
        // A rate without a bound times 0 is no number.
        if seconds <= 0.0 {
            return self.from;
        }
        let change = self.to - self.from;
        let most = self.rate_s * seconds;
        if change.abs() <= most { self.to } else { self.from + most * change.signum() }
    }

    /// Returns the range of values between two times in seconds.
    pub fn range(&self, from_s: f64, until_s: f64) -> FlightLevelRange {
        FlightLevelRange::between(self.after(from_s), self.after(until_s))
    }
}

/// The level and the speed of a filed flight after some orders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FiledLevelSpeed {
    /// Altitude of the level in meters.
    pub altitude_m: f64,
    /// Rate of climb to it in meters per second, 0 if it is not climbed to.
    pub climb_m_s: f64,
    /// Rate of descent to it in meters per second, 0 if it is not descended to.
    pub descent_m_s: f64,
    /// Airspeed in meters per second.
    pub v_m_s: f64,
}

/// What an airplane flies now, and would fly by its filed flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChangeableFlight<'a> {
    /// Its altitude in meters.
    pub(crate) altitude_m: f64,
    /// The level of its filed flight in meters.
    pub(crate) filed_altitude_m: f64,
    /// Its rate of climb in meters per second, and that by its filed flight, 0 if that does not climb.
    pub(crate) climb_m_s: f64,
    pub(crate) filed_climb_m_s: f64,
    /// The same for descents.
    pub(crate) descent_m_s: f64,
    pub(crate) filed_descent_m_s: f64,
    /// Its airspeed in meters per second.
    pub(crate) v_m_s: f64,
    /// The airspeed of its filed flight in meters per second.
    pub(crate) filed_v_m_s: f64,
    /// The limits that it keeps to.
    pub(crate) performance: &'a Performance,
}

impl<'a> ChangeableFlight<'a> {
    /// Returns the flight of an airplane that is at an altitude in meters.
    pub(crate) fn new(
        filed: FiledLevelSpeed,
        performance: &'a Performance,
        altitude_m: f64,
        v_m_s: f64,
    ) -> Self {
        Self {
            altitude_m,
            filed_altitude_m: filed.altitude_m,
            climb_m_s: CLIMB_M_S.min(performance.climb_max_m_s),
            filed_climb_m_s: filed.climb_m_s,
            descent_m_s: CLIMB_M_S.min(performance.descent_max_m_s),
            filed_descent_m_s: filed.descent_m_s,
            v_m_s,
            filed_v_m_s: filed.v_m_s,
            performance,
        }
    }
}

impl ChangeableFlight<'_> {
    /// Returns the altitudes that it has with a change, within its limits.
    pub(crate) fn altitudes(&self, change: FlightChange) -> SteadyChange {
        let Performance { floor_m, ceiling_m, .. } = *self.performance;
        let to = (self.filed_altitude_m + change.level_m).max(floor_m).min(ceiling_m);
        // The filed flight stays as it is, also beyond the limits.
        let to = if change.level_m == 0.0 { self.filed_altitude_m } else { to };
        let [rate_s, filed_rate_s] = if to > self.altitude_m {
            [self.climb_m_s, self.filed_climb_m_s]
        } else {
            [self.descent_m_s, self.filed_descent_m_s]
        };
        // Back to a filed level that its flight plan does not lead to it goes as fast as it left it.
        let is_filed = change.level_m == 0.0 && filed_rate_s > 0.0;
        let rate_s = if is_filed { filed_rate_s } else { rate_s };
        SteadyChange { from: self.altitude_m, to, rate_s }
    }

    /// Returns the command that a change is.
    pub(crate) fn command(&self, change: FlightChange) -> MethodCommand {
        let altitudes = self.altitudes(change);
        let level = LevelCommand { altitude_m: altitudes.to, vertical_m_s: altitudes.rate_s };
        MethodCommand {
            level: (change.level_m != 0.0).then_some(level),
            v_m_s: (change.speed_m_s != 0.0).then(|| self.speeds(change).to),
        }
    }

    /// Returns the airspeeds that it has with a change, within its limits.
    pub(crate) fn speeds(&self, change: FlightChange) -> SteadyChange {
        let Performance { v_min_m_s, v_max_m_s, acceleration_m_s2, .. } = *self.performance;
        let to = (self.filed_v_m_s + change.speed_m_s).max(v_min_m_s).min(v_max_m_s);
        let to = if change.speed_m_s == 0.0 { self.filed_v_m_s } else { to };
        SteadyChange { from: self.v_m_s, to, rate_s: acceleration_m_s2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_changes_at_its_rate_and_then_stays() {
        let climb = SteadyChange { from: 1000.0, to: 1300.0, rate_s: 10.0 };
        assert_eq!(
            [0.0, 10.0, 30.0, 90.0].map(|t| climb.after(t)),
            [1000.0, 1100.0, 1300.0, 1300.0]
        );
        let at_once = SteadyChange { from: 40.0, to: 35.0, rate_s: f64::INFINITY };
        assert_eq!([0.0, 1.0].map(|t| at_once.after(t)), [40.0, 35.0]);
        assert_eq!(SteadyChange::constant(7.0).after(0.0), 7.0);
        assert_eq!(climb.range(5.0, 6.0), FlightLevelRange::between(1050.0, 1060.0));
    }

    #[test]
    fn changes_stand_alone_or_are_all_combined() {
        let alone = ChangeAlternatives {
            levels_m: vec![-300.0, 300.0],
            speeds_m_s: vec![-5.0],
            is_product: false,
        };
        assert_eq!(alone.all().len(), 3);
        let all = ChangeAlternatives { is_product: true, ..alone }.all();
        assert_eq!(all.len(), 5);
        assert_eq!(all[4], FlightChange { level_m: 300.0, speed_m_s: -5.0 });
    }

    #[test]
    fn changes_keep_within_what_the_airplane_can_fly() {
        let performance = Performance {
            ceiling_m: 1200.0,
            v_min_m_s: 33.0,
            acceleration_m_s2: 0.5,
            ..Performance::with_turn_rate(0.1)
        };
        let flight = ChangeableFlight {
            altitude_m: 1000.0,
            filed_altitude_m: 1000.0,
            climb_m_s: 5.0,
            filed_climb_m_s: 0.0,
            descent_m_s: 4.0,
            filed_descent_m_s: 3.0,
            v_m_s: 35.0,
            filed_v_m_s: 35.0,
            performance: &performance,
        };
        let up = flight.altitudes(FlightChange { level_m: 300.0, speed_m_s: 0.0 });
        assert_eq!((up.to, up.rate_s), (1200.0, 5.0));
        let slower = flight.speeds(FlightChange { level_m: 0.0, speed_m_s: -10.0 });
        assert_eq!((slower.to, slower.rate_s), (33.0, 0.5));
        assert_eq!(flight.altitudes(FlightChange::NONE).to, 1000.0);
        let above = ChangeableFlight { altitude_m: 1100.0, ..flight };
        assert_eq!(above.altitudes(FlightChange::NONE).rate_s, 3.0, "as the flight plan descends");
        let below = ChangeableFlight { altitude_m: 900.0, ..flight };
        assert_eq!(below.altitudes(FlightChange::NONE).rate_s, 5.0);
        let command = flight.command(FlightChange { level_m: 100.0, speed_m_s: 0.0 });
        assert_eq!(command.level.map(|level| level.altitude_m), Some(1100.0));
        assert_eq!(command.v_m_s, None);
    }
}
