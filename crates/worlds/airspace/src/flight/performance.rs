//! Performance: what an airplane of a type can fly.

use sidestep_kernel::math;

/// Acceleration of gravity in meters per second squared.
pub(crate) const GRAVITY_M_S2: f64 = 9.80665;
/// Rate at which levels are changed when an order does not give one, in meters per second: 1500 ft/min.
pub(crate) const CLIMB_M_S: f64 = 7.62;

/// The limits on an airplane's turn rate, of which the smaller one holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnLimit {
    /// Largest turn rate at any speed, in radians per second.
    pub omega_max_rad_s: f64,
    /// Largest acceleration to the side, in meters per second squared: that of a level turn at the largest bank.
    /// Infinite without a limit on the bank.
    pub lateral_m_s2: f64,
}

impl TurnLimit {
    /// Returns the acceleration to the side of a level turn at some degrees of bank: `g tan(bank)`.
    pub fn lateral_m_s2(bank_deg: f64) -> f64 {
        let bank_rad = bank_deg.to_radians();
        GRAVITY_M_S2 * math::sin(bank_rad) / math::cos(bank_rad)
    }

    /// Returns the largest turn rate at a speed, in radians per second: on a circle the acceleration to the side is
    /// speed times turn rate.
    pub fn omega_rad_s(&self, v_m_s: f64) -> f64 {
        self.omega_max_rad_s.min(self.lateral_m_s2 / v_m_s)
    }
}

/// What an airplane can fly. Infinite limits, and a smallest speed of 0, are none.
#[derive(Debug, Clone, PartialEq)]
pub struct Performance {
    /// The name of its type, if it has one.
    pub type_name: Option<String>,
    /// The limits on its turn rate.
    pub turn: TurnLimit,
    /// Smallest airspeed in meters per second: below it the airplane stalls.
    pub v_min_m_s: f64,
    /// Largest airspeed in meters per second.
    pub v_max_m_s: f64,
    /// Largest rate of climb in meters per second.
    pub climb_max_m_s: f64,
    /// Largest rate of descent in meters per second, positive.
    pub descent_max_m_s: f64,
    /// Lowest altitude in meters.
    pub floor_m: f64,
    /// Highest altitude in meters.
    pub ceiling_m: f64,
    /// Largest change of airspeed in meters per second squared; infinite where speeds change at once.
    pub acceleration_m_s2: f64,
    /// Time for which its fuel, or its battery, lasts, in seconds; infinite where nobody knows.
    pub endurance_s: f64,
}

impl Performance {
    /// Returns the performance of an airplane that only its turn rate limits.
    pub fn with_turn_rate(omega_max_rad_s: f64) -> Self {
        Self {
            type_name: None,
            turn: TurnLimit { omega_max_rad_s, lateral_m_s2: f64::INFINITY },
            v_min_m_s: 0.0,
            v_max_m_s: f64::INFINITY,
            climb_max_m_s: f64::INFINITY,
            descent_max_m_s: f64::INFINITY,
            floor_m: f64::NEG_INFINITY,
            ceiling_m: f64::INFINITY,
            acceleration_m_s2: f64::INFINITY,
            endurance_s: f64::INFINITY,
        }
    }

    /// Returns whether its speed changes over time, and not at once.
    pub fn accelerates(&self) -> bool {
        self.acceleration_m_s2 < f64::INFINITY
    }

    /// Returns whether it can fly with an airspeed in meters per second.
    pub fn allows_speed(&self, v_m_s: f64) -> bool {
        (self.v_min_m_s..=self.v_max_m_s).contains(&v_m_s)
    }

    /// Returns whether it can fly at an altitude in meters.
    pub fn allows_altitude(&self, altitude_m: f64) -> bool {
        (self.floor_m..=self.ceiling_m).contains(&altitude_m)
    }

    /// Returns its largest vertical speed in meters per second, upward or downward.
    pub fn vertical_max_m_s(&self, is_climb: bool) -> f64 {
        if is_climb { self.climb_max_m_s } else { self.descent_max_m_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bank_limits_the_turn_rate_by_the_speed_and_the_smaller_limit_holds() {
        let lateral_m_s2 = TurnLimit::lateral_m_s2(25.0);
        assert!((lateral_m_s2 - 4.5729).abs() < 1e-4, "{lateral_m_s2}");
        let limit = TurnLimit { omega_max_rad_s: 0.1, lateral_m_s2 };
        assert_eq!(limit.omega_rad_s(230.0), lateral_m_s2 / 230.0);
        assert_eq!(limit.omega_rad_s(10.0), 0.1);
        assert_eq!(Performance::with_turn_rate(0.1).turn.omega_rad_s(1e9), 0.1);
    }
}
