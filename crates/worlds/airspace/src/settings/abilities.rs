//! The abilities of an airplane, as keys of a scenario or of a table of types give them.

use super::values::{Bank, Speed, TurnRate};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_scenario::{Closed, LeftOpen, Number};

/// A speed limit; 0 is none.
pub(crate) type SpeedLimit = Number<Closed<0, 1_000_000>>;
/// A vertical speed, or an acceleration, which is none at 0.
pub(crate) type PositiveRate = Number<LeftOpen<0, 1_000_000_000>>;
/// A time that is none at 0, in seconds.
pub(crate) type PositiveTime = Number<LeftOpen<0, 1_000_000_000>>;
/// An altitude within reasonable bounds.
pub(crate) type AltitudeLimit = Number<Closed<-1_000_000_000, 1_000_000_000>>;

/// The abilities that keys give; those that are left out are `None`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct AbilityKeys {
    pub(crate) v_m_s: Option<f64>,
    pub(crate) omega_max_deg_s: Option<f64>,
    pub(crate) bank_max_deg: Option<f64>,
    pub(crate) v_min_m_s: Option<f64>,
    pub(crate) v_max_m_s: Option<f64>,
    pub(crate) climb_max_m_s: Option<f64>,
    pub(crate) descent_max_m_s: Option<f64>,
    pub(crate) floor_m: Option<f64>,
    pub(crate) ceiling_m: Option<f64>,
    pub(crate) acceleration_m_s2: Option<f64>,
    pub(crate) endurance_s: Option<f64>,
}

/// Returns the abilities that the keys of a section give.
macro_rules! ability_keys {
    ($section:expr) => {
        $crate::settings::AbilityKeys {
            v_m_s: $section.v_m_s.map(f64::from),
            omega_max_deg_s: $section.omega_max_deg_s.map(f64::from),
            bank_max_deg: $section.bank_max_deg.map(f64::from),
            v_min_m_s: $section.v_min_m_s.map(f64::from),
            v_max_m_s: $section.v_max_m_s.map(f64::from),
            climb_max_m_s: $section.climb_max_m_s.map(f64::from),
            descent_max_m_s: $section.descent_max_m_s.map(f64::from),
            floor_m: $section.floor_m.map(f64::from),
            ceiling_m: $section.ceiling_m.map(f64::from),
            acceleration_m_s2: $section.acceleration_m_s2.map(f64::from),
            endurance_s: $section.endurance_s.map(f64::from),
        }
    };
}
pub(crate) use ability_keys;

/// One type of a table: all its keys may be left out.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TypeSection {
    /// Airspeed of an airplane that is given none.
    v_m_s: Option<Number<Speed>>,
    /// Greatest turn rate at any speed.
    omega_max_deg_s: Option<Number<TurnRate>>,
    /// Greatest bank in turns.
    bank_max_deg: Option<Number<Bank>>,
    /// Smallest airspeed.
    v_min_m_s: Option<SpeedLimit>,
    /// Greatest airspeed.
    v_max_m_s: Option<SpeedLimit>,
    /// Greatest rate of climb.
    climb_max_m_s: Option<PositiveRate>,
    /// Greatest rate of descent.
    descent_max_m_s: Option<PositiveRate>,
    /// Lowest altitude.
    floor_m: Option<AltitudeLimit>,
    /// Highest altitude.
    ceiling_m: Option<AltitudeLimit>,
    /// Greatest change of airspeed.
    acceleration_m_s2: Option<PositiveRate>,
    /// Time for which its fuel, or its battery, lasts.
    endurance_s: Option<PositiveTime>,
}

impl TypeSection {
    /// Returns the abilities that it gives.
    pub(crate) fn abilities(&self) -> AbilityKeys {
        ability_keys!(self)
    }
}

impl AbilityKeys {
    /// Returns these abilities, completed by others.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            v_m_s: self.v_m_s.or(other.v_m_s),
            omega_max_deg_s: self.omega_max_deg_s.or(other.omega_max_deg_s),
            bank_max_deg: self.bank_max_deg.or(other.bank_max_deg),
            v_min_m_s: self.v_min_m_s.or(other.v_min_m_s),
            v_max_m_s: self.v_max_m_s.or(other.v_max_m_s),
            climb_max_m_s: self.climb_max_m_s.or(other.climb_max_m_s),
            descent_max_m_s: self.descent_max_m_s.or(other.descent_max_m_s),
            floor_m: self.floor_m.or(other.floor_m),
            ceiling_m: self.ceiling_m.or(other.ceiling_m),
            acceleration_m_s2: self.acceleration_m_s2.or(other.acceleration_m_s2),
            endurance_s: self.endurance_s.or(other.endurance_s),
        }
    }

    /// Returns the keys that are given and their values, in the order of the documentation.
    pub(crate) fn given(&self) -> Vec<(&'static str, f64)> {
        let all = [
            ("v_m_s", self.v_m_s),
            ("omega_max_deg_s", self.omega_max_deg_s),
            ("bank_max_deg", self.bank_max_deg),
            ("v_min_m_s", self.v_min_m_s),
            ("v_max_m_s", self.v_max_m_s),
            ("climb_max_m_s", self.climb_max_m_s),
            ("descent_max_m_s", self.descent_max_m_s),
            ("floor_m", self.floor_m),
            ("ceiling_m", self.ceiling_m),
            ("acceleration_m_s2", self.acceleration_m_s2),
            ("endurance_s", self.endurance_s),
        ];
        all.into_iter().filter_map(|(key, value)| Some((key, value?))).collect()
    }
}
