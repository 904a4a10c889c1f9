//! The sections of a robots scenario, in the form of the file. Unknown keys are errors.

mod compile;
mod kinds;
mod located;
mod parts;
mod placing;
mod random;
mod tables;

pub use crate::world::StorageOrder;
pub use compile::{Behaviours, Compiled, presets};

use super::effector::ObstacleRule;
use super::policy::ConflictPolicy;
use super::world::Regime;
use parts::{BoxSide, Period, Placing, QuarterTurns, Side, Steps};
use serde::Deserialize;
use sidestep_map::UnknownPolicy;
use sidestep_map::office::OfficeSpec;
use sidestep_scenario::{AboveBelow, AboveTo, Number, Positive, Sections, Share};
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;

/// A whole robots scenario. Every key is described in `scenarios/robots/default.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotsFile {
    #[serde(default, rename = "description")]
    _description: String,
    #[serde(default)]
    pub(super) regime: Regime,
    #[serde(default)]
    pub(super) obstacle_rule: ObstacleRule,
    #[serde(default)]
    pub(super) conflict_policy: ConflictPolicy,
    #[serde(default)]
    pub(super) kind_order: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) profiles: Vec<Spanned<PathBuf>>,
    pub(super) map: Spanned<MapSection>,
    #[serde(default)]
    pub(super) kinds: BTreeMap<Spanned<String>, KindSection>,
    #[serde(default)]
    pub(super) sensors: BTreeMap<String, Spanned<SensorSection>>,
    #[serde(default)]
    pub(super) effectors: BTreeMap<String, Spanned<EffectorSection>>,
    #[serde(default)]
    pub(super) robots: Sections<RobotSection>,
    #[serde(default)]
    pub(super) people: Sections<MoverSection>,
    #[serde(default)]
    pub(super) doors: Sections<DoorSection>,
    pub(super) radio: Option<RadioSection>,
    #[serde(default)]
    pub(super) record: RecordSection,
}

/// A file with sensors and effectors only: a learned profile, or the presets.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProfileFile {
    pub(super) format: Spanned<u32>,
    #[serde(rename = "profile")]
    _profile: String,
    #[serde(default)]
    pub(super) sensors: BTreeMap<String, Spanned<SensorSection>>,
    #[serde(default)]
    pub(super) effectors: BTreeMap<String, Spanned<EffectorSection>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MapSection {
    pub(super) file: Option<PathBuf>,
    pub(super) ascii: Option<String>,
    pub(super) office: Option<Spanned<OfficeSpec>>,
    pub(super) box_size_m: Option<Number<BoxSide>>,
    pub(super) resolution_m: Option<Positive>,
    #[serde(default)]
    pub(super) unknown: UnknownPolicy,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KindSection {
    pub(super) observation: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorSection {
    pub(super) bearings_deg: Spanned<Vec<f64>>,
    pub(super) range_m: Number<AboveTo<0, 10_000>>,
    pub(super) observations: Spanned<Vec<String>>,
    #[serde(default)]
    pub(super) designates: BTreeMap<Spanned<String>, Spanned<String>>,
    pub(super) confusion: Spanned<Rows>,
    #[serde(default)]
    pub(super) confusion_by_class: BTreeMap<Spanned<String>, Spanned<Rows>>,
    #[serde(default)]
    pub(super) distance_edges_m: Option<Spanned<Vec<f64>>>,
    #[serde(default)]
    pub(super) distance_classes: Option<Spanned<Vec<String>>>,
    #[serde(default)]
    pub(super) distance_confusion: Option<Spanned<Rows>>,
    #[serde(default, rename = "evidence")]
    _evidence: toml::Table,
}

/// Rows of a matrix by name.
pub(super) type Rows = BTreeMap<Spanned<String>, Spanned<Vec<f64>>>;

/// Actions by name; `box_m` and `evidence` say on what data they rest.
#[derive(Debug, Clone, Default)]
pub(super) struct EffectorSection {
    pub(super) box_m: Option<Positive>,
    pub(super) actions: BTreeMap<String, Spanned<Vec<TransitionSection>>>,
}

/// Written by hand, because flattened maps lose the positions of their entries.
impl<'de> Deserialize<'de> for EffectorSection {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;

        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = EffectorSection;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table of actions")
            }

            fn visit_map<A: serde::de::MapAccess<'de>>(
                self,
                mut map: A,
            ) -> Result<EffectorSection, A::Error> {
                let mut section = EffectorSection::default();
                while let Some(key) = map.next_key::<String>()? {
                    match key.as_str() {
                        "box_m" => section.box_m = Some(map.next_value()?),
                        "evidence" => drop(map.next_value::<toml::Table>()?),
                        _ => drop(section.actions.insert(key, map.next_value()?)),
                    }
                }
                Ok(section)
            }
        }
        deserializer.deserialize_map(Visitor)
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TransitionSection {
    pub(super) p: f64,
    #[serde(default)]
    pub(super) path: Steps,
    #[serde(default)]
    pub(super) turn: QuarterTurns,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotSection {
    #[serde(default, rename = "name")]
    _name: String,
    #[serde(default = "robot_kind")]
    pub(super) kind: Spanned<String>,
    pub(super) count: Option<Spanned<u32>>,
    #[serde(default)]
    pub(super) at: Vec<Spanned<Placing>>,
    pub(super) region: Option<Spanned<[u32; 4]>>,
    pub(super) scen: Option<Spanned<PathBuf>>,
    pub(super) size: Option<Side>,
    pub(super) period: Option<Period>,
    pub(super) phase: Option<u32>,
    #[serde(default)]
    pub(super) sensors: Vec<Spanned<String>>,
    pub(super) effector: Option<Spanned<String>>,
    pub(super) behaviour: Option<Spanned<BehaviourSection>>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BehaviourSection {
    pub(super) kind: String,
    pub(super) turn_every: Option<u32>,
    pub(super) a: Option<[u32; 4]>,
    pub(super) b: Option<[u32; 4]>,
    pub(super) goals: Option<Vec<(u32, u32)>>,
    pub(super) actions: Option<Vec<String>>,
    pub(super) repeat: Option<bool>,
    pub(super) avoidance: Option<AvoidanceSection>,
    pub(super) weights: Option<BTreeMap<String, f64>>,
    pub(super) weights_after_contact: Option<BTreeMap<String, f64>>,
}

/// The way of robots that go somewhere past obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum AvoidanceSection {
    #[default]
    Plan,
    Avoid,
    Filter,
    Touch,
}

impl BehaviourSection {
    /// Returns every key but `kind`, and whether it is given.
    fn given(&self) -> [(&'static str, bool); 9] {
        // Without `..`, so that nobody adds a key and forgets it here.
        let Self {
            kind: _,
            turn_every,
            a,
            b,
            goals,
            actions,
            repeat,
            avoidance,
            weights,
            weights_after_contact,
        } = self;
        [
            ("turn_every", turn_every.is_some()),
            ("a", a.is_some()),
            ("b", b.is_some()),
            ("goals", goals.is_some()),
            ("actions", actions.is_some()),
            ("repeat", repeat.is_some()),
            ("avoidance", avoidance.is_some()),
            ("weights", weights.is_some()),
            ("weights_after_contact", weights_after_contact.is_some()),
        ]
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MoverSection {
    #[serde(default, rename = "name")]
    _name: String,
    #[serde(default = "person_kind")]
    pub(super) kind: Spanned<String>,
    pub(super) count: Option<Spanned<u32>>,
    #[serde(default)]
    pub(super) at: Vec<Spanned<Placing>>,
    pub(super) region: Option<Spanned<[u32; 4]>>,
    pub(super) size: Option<[Side; 2]>,
    pub(super) period: Option<Period>,
    pub(super) phase: Option<u32>,
    pub(super) p_straight: Option<Share>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DoorSection {
    #[serde(default = "door_kind")]
    pub(super) kind: Spanned<String>,
    #[serde(default)]
    pub(super) at: Vec<Spanned<Placing>>,
    pub(super) size: Option<[Side; 2]>,
    #[serde(default)]
    pub(super) office: bool,
    pub(super) periodic: Option<Spanned<PeriodicSection>>,
    pub(super) random: Option<RandomSection>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PeriodicSection {
    pub(super) open: u64,
    pub(super) closed: u64,
    pub(super) phase: Option<u64>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RandomSection {
    pub(super) p_open: Share,
    pub(super) p_close: Share,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RadioSection {
    pub(super) range_m: Number<AboveBelow<0, 1_000_000>>,
    pub(super) loss: Option<Share>,
}

/// The tables that a run keeps in addition to its summary.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// Pose of every body at every cycle.
    pub trajectories: bool,
    /// Contacts and doors.
    pub events: bool,
    /// True and reported reading of every beam, and the result of every action: logs to learn from.
    pub calibration: bool,
    /// Number of cycles between two checkpoints.
    pub checkpoint_every: u64,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self { trajectories: true, events: true, calibration: false, checkpoint_every: 10_000 }
    }
}

fn spanned<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}
fn robot_kind() -> Spanned<String> {
    spanned("robot".into())
}
fn person_kind() -> Spanned<String> {
    spanned("person".into())
}
fn door_kind() -> Spanned<String> {
    spanned("door".into())
}

#[cfg(test)]
mod tests;
