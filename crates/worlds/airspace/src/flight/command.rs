//! Commands of a method: a level and a speed of an airplane that overlay its filed flight until the method gives them
//! back.
//!
//! A command is a wish. At the start of the next cycle it is cleared as an order is (`act/commands.rs`): what is cleared
//! is *in force*, and overlays the segment of the filed flight, so that all that is computed from the segment, from
//! predictions to fallbacks, is about the level and the speed that are really flown.

use super::levels::FlightLevelRange;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use std::ops::RangeInclusive;

/// What a method commands of an airplane beside where to turn; what is none is flown as filed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MethodCommand {
    /// The level to change to.
    pub level: Option<LevelCommand>,
    /// Airspeed in meters per second.
    pub v_m_s: Option<f64>,
}

/// A level that a method commands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LevelCommand {
    /// Its altitude in meters.
    pub altitude_m: f64,
    /// Rate of climb or descent to it in meters per second, positive.
    pub vertical_m_s: f64,
}

impl MethodCommand {
    /// All as filed.
    pub const NONE: Self = Self { level: None, v_m_s: None };

    /// Returns whether all is flown as filed.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns whether it consists of numbers that an airplane can be given.
    pub(crate) fn is_valid(&self) -> bool {
        let is_valid_level = |level: LevelCommand| {
            level.altitude_m.is_finite()
                && level.vertical_m_s.is_finite()
                && level.vertical_m_s >= 0.0
        };
        self.level.is_none_or(is_valid_level)
            && self.v_m_s.is_none_or(|v_m_s| v_m_s.is_finite() && v_m_s > 0.0)
    }
}

/// What a method may command at all. Worlds whose method commands nothing keep no commands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommandKinds {
    /// Whether it commands levels.
    pub levels: bool,
    /// The speeds that it commands; none if it leaves speeds as filed.
    pub speeds: Option<SpeedFactors>,
}

impl CommandKinds {
    /// Neither levels nor speeds.
    pub const NONE: Self = Self { levels: false, speeds: None };

    /// Returns whether it commands nothing.
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns whether a command is of these kinds, and consists of numbers that an airplane can be given.
    pub(crate) fn allows(&self, command: &MethodCommand) -> bool {
        let is_of_kind = (self.levels || command.level.is_none())
            && (self.speeds.is_some() || command.v_m_s.is_none());
        is_of_kind && command.is_valid()
    }

    /// Returns what one of two methods may command.
    #[must_use]
    pub(crate) fn or(self, other: Self) -> Self {
        let speeds = match (self.speeds, other.speeds) {
            (Some(one), Some(two)) => Some(SpeedFactors {
                least: one.least.min(two.least),
                largest: one.largest.max(two.largest),
            }),
            (one, two) => one.or(two),
        };
        Self { levels: self.levels || other.levels, speeds }
    }
}

/// The commands that may be in force for an airplane: those within its limits, and those that lead it back to what is
/// filed. Messages that say another one lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandLimits {
    /// What its method may command at all.
    pub(crate) kinds: CommandKinds,
    /// The levels.
    pub(crate) levels: FlightLevelRange,
    /// The smallest and the largest airspeed, in meters per second.
    pub(crate) speeds_m_s: [f64; 2],
}

impl CommandLimits {
    /// Returns whether a command may be in force for an airplane; `all` are the limits by id, none where no method
    /// commands anything.
    pub(crate) fn allow(all: &[Self], id: EntityId, command: &MethodCommand) -> bool {
        command.is_none() || all.get(id as usize).is_some_and(|limits| limits.allows(command))
    }

    /// Returns whether a command may be in force.
    fn allows(&self, command: &MethodCommand) -> bool {
        let FlightLevelRange { low_m, high_m } = self.levels;
        let [from_m_s, to_m_s] = self.speeds_m_s;
        // NaN is in no range.
        let is_level = |altitude_m: f64| (low_m..=high_m).contains(&altitude_m);
        self.kinds.allows(command)
            && command.level.is_none_or(|level| is_level(level.altitude_m))
            && command.v_m_s.is_none_or(|v_m_s| (from_m_s..=to_m_s).contains(&v_m_s))
    }
}

/// The speeds that a method may command, as factors of those that are filed. All plans of the shield reckon with them, so
/// narrow ones are cheaper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedFactors {
    /// Factor on the smallest filed speed, above 0 and at most 1.
    pub least: f64,
    /// Factor on the largest filed speed, at least 1.
    pub largest: f64,
}

impl SpeedFactors {
    /// Returns the speeds in meters per second that may be commanded of an airplane with some filed speeds that can fly
    /// some others.
    pub(crate) fn speeds_m_s(
        &self,
        filed_m_s: impl Iterator<Item = f64>,
        flyable_m_s: RangeInclusive<f64>,
    ) -> Option<RangeInclusive<f64>> {
        let mut least_m_s = f64::INFINITY;
        let mut largest_m_s: f64 = 0.0;
        for v_m_s in filed_m_s {
            least_m_s = least_m_s.min(v_m_s);
            largest_m_s = largest_m_s.max(v_m_s);
        }
        let from_m_s = (self.least * least_m_s).max(*flyable_m_s.start());
        let to_m_s = (self.largest * largest_m_s).min(*flyable_m_s.end());
        (from_m_s <= to_m_s).then_some(from_m_s..=to_m_s)
    }
}
