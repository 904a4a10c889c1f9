//! Choices and numbers that a scenario makes and that lower layers depend on.

mod abilities;
mod changes;
mod surveillance;
mod values;

pub(crate) use abilities::{
    AbilityKeys, AltitudeLimit, PositiveRate, PositiveTime, SpeedLimit, TypeSection, ability_keys,
};
pub(crate) use changes::ChangeList;
pub use changes::Combinations;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, OptimizerConfig, UpdateOrder, Utility};
pub use surveillance::SurveillanceSettings;
pub(crate) use values::{
    Bank, ChangeWeight, Cooling, Decision, Fading, Gibibytes, HeadingNoise, Held, Inflation,
    LevelGap, LookAhead, RoundCount, SeparationM, Speed, Step, SurveillanceCategory, Tolerance,
    TurnCount, TurnRate, VelocityCategory, Weight,
};

/// The methods by which airplanes choose their actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Method")]
pub enum BuiltInMethod {
    /// Probability collectives.
    #[default]
    Pc,
    /// Optimal reciprocal collision avoidance.
    Orca,
    /// Modified voltage potential.
    Mvp,
    /// Track bands, as DAIDALUS computes them.
    Bands,
    /// Straight to the way-point, without regard to others.
    None,
    /// Follows the orders of a caller of the library; without them, its flight plan.
    External,
}

impl BuiltInMethod {
    /// The methods by which airplanes decide themselves.
    pub const ALL: [Self; 5] = [Self::Pc, Self::Orca, Self::Mvp, Self::Bands, Self::None];

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pc => "pc",
            Self::Orca => "orca",
            Self::Mvp => "mvp",
            Self::Bands => "bands",
            Self::None => "none",
            Self::External => "external",
        }
    }
}

/// Random errors that the optimizer does not know of.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Disturbance {
    /// Standard deviation of known positions, per coordinate, in meters.
    pub position_m: f64,
    /// Standard deviation of the unwanted change of heading per `dt`, in radians.
    pub heading_rad: f64,
}

/// The way in which airplanes learn their groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Grouping {
    /// Groups are announced, by an observer that sees all.
    #[default]
    Announced,
    /// Airplanes find their groups from beacons of those near them.
    Heard,
}

/// A rule by which airplanes of one priority give way to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RightOfWayRule {
    /// All avoid each other.
    #[default]
    None,
    /// Of two that converge the one that has the other on its right gives way, and one that overtakes does.
    RulesOfTheAir,
    /// Who climbs or descends gives way to one that cruises (`PRIORULES ON FF2` of BlueSky).
    CruisingFirst,
    /// Who cruises gives way to one that climbs or descends, and keeps its level (FF3).
    ClimbingFirst,
    /// As cruising-first, and mvp resolves no conflict by levels (LAY1).
    CruisingFirstHorizontal,
    /// As climbing-first, and mvp resolves no conflict by levels (LAY2).
    ClimbingFirstHorizontal,
}

impl RightOfWayRule {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::RulesOfTheAir => "rules-of-the-air",
            Self::CruisingFirst => "cruising-first",
            Self::ClimbingFirst => "climbing-first",
            Self::CruisingFirstHorizontal => "cruising-first-horizontal",
            Self::ClimbingFirstHorizontal => "climbing-first-horizontal",
        }
    }

    /// Returns whether mvp resolves conflicts in the horizontal alone under it.
    pub(crate) fn is_horizontal(self) -> bool {
        matches!(self, Self::CruisingFirstHorizontal | Self::ClimbingFirstHorizontal)
    }
}

/// The settings of a method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReactiveSettings {
    /// Time in seconds within which losses of separation are avoided.
    pub look_ahead_s: f64,
    /// Factor on separations when avoiding.
    pub margin: f64,
    /// Further factor on the zone out of which a conflict is moved; only MVP has it.
    pub resolution_factor: f64,
}

/// The parts of its flight that an airplane changes to resolve a conflict by MVP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Resolution {
    /// The heading (RMETHH HDG of BlueSky).
    #[default]
    Heading,
    /// The speed (RMETHH SPD).
    Speed,
    /// Heading and speed (RMETHH BOTH).
    HeadingSpeed,
    /// The vertical speed (RMETHV V/S).
    Vertical,
    /// All of these (RMETHH OFF and RMETHV OFF).
    HeadingSpeedVertical,
}

impl Resolution {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Heading => "heading",
            Self::Speed => "speed",
            Self::HeadingSpeed => "heading-speed",
            Self::Vertical => "vertical",
            Self::HeadingSpeedVertical => "heading-speed-vertical",
        }
    }

    /// Returns whether it changes headings; else an airplane keeps the one that it has.
    pub(crate) fn changes_heading(self) -> bool {
        matches!(self, Self::Heading | Self::HeadingSpeed | Self::HeadingSpeedVertical)
    }

    /// Returns whether it changes speeds.
    pub(crate) fn changes_speed(self) -> bool {
        matches!(self, Self::Speed | Self::HeadingSpeed | Self::HeadingSpeedVertical)
    }

    /// Returns whether it changes levels.
    pub(crate) fn changes_level(self) -> bool {
        matches!(self, Self::Vertical | Self::HeadingSpeedVertical)
    }
}

/// A deployment of the optimizer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Deployment {
    /// One process decides for all.
    #[default]
    Direct,
    /// An agent per airplane, which sends its possible ways.
    Team,
    /// A coordinator that migrates.
    Pim,
    /// Coordinators that migrate, one above the others.
    HierarchicalPim,
    /// An agent per airplane, which sends its model.
    CompactTeam,
    /// An agent per airplane, which decides for all by the same computation as the others.
    ReplicaTeam,
}

impl Deployment {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Team => "team",
            Self::Pim => "pim",
            Self::HierarchicalPim => "hierarchical-pim",
            Self::CompactTeam => "compact-team",
            Self::ReplicaTeam => "replica-team",
        }
    }

    /// Returns the reason why it cannot run with some settings, if there is one.
    pub(crate) fn unsupported_reason(self, settings: &OptimizerConfig) -> Option<&'static str> {
        let sampled = matches!(settings.estimator, Estimator::Sampled { .. });
        let as_in_the_paper =
            settings.order == UpdateOrder::Parallel && settings.utility == Utility::Joint;
        // Where one computation decides for all, nobody waits for another one's update.
        let decides_at_once = matches!(self, Self::Direct | Self::ReplicaTeam);
        (!decides_at_once && sampled && !as_in_the_paper)
            .then_some("agents that sample update in parallel and learn from the joint cost")
    }

    /// Returns whether somebody knows the costs of all pairs of a group, and not each airplane those of its own alone.
    pub(crate) fn knows_all_costs(self) -> bool {
        !matches!(self, Self::Team | Self::CompactTeam)
    }
}

/// The tables that a run keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// A row per airplane and cycle.
    pub trajectories: bool,
    /// A row per event, see [`super::events`].
    pub events: bool,
    /// A row per optimization.
    pub optimizations: bool,
    /// A row per encounter of two airplanes, see [`super::encounters`].
    pub pairs: bool,
    /// The controls of airplanes with pilots outside of the run, so that it can be computed again.
    pub controls: bool,
    /// Number of cycles between two checkpoints; 0 for none.
    pub checkpoint_every: u64,
    /// Cycles between two rows of the metrics over time, 0 for none; if left out, one that gives a run a thousand rows.
    pub series_every: Option<u64>,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self {
            trajectories: true,
            events: true,
            optimizations: true,
            pairs: true,
            controls: false,
            checkpoint_every: 1000,
            series_every: None,
        }
    }
}
