//! The sections of a robots scenario, in the form of the file. Unknown keys are errors.

mod compile;
mod inspect_profile;
mod kinds;
mod located_section;
mod placement_grid;
mod random;
mod schema;
mod tables;
mod values;

pub use crate::world::StorageOrder;
pub use compile::{Behaviours, Compiled, presets};
pub(super) use inspect_profile::inspect_profile;
pub(super) use schema::{profile as profile_schema, sections};

use super::effector::ObstacleRule;
use super::policy::ConflictPolicy;
use super::world::Regime;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use sidestep_error_models::delay::DelayEvent;
use sidestep_map::UnknownPolicy;
use sidestep_map::office::OfficeSpec;
use sidestep_scenario::{
    FixedList, Fraction, LeftOpen, NonNegative, Number, Open, Positive, Sections, Spanned,
};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;
use values::{
    ActionCycles, BoxSide, Budget, DelayCycles, PathSteps, Period, QuarterTurns, SideBoxes,
    StartPose, Steps,
};

/// A whole robots scenario. Every key is described in `scenarios/robots/default.toml`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotsFile {
    /// A sentence about the scenario.
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
    /// Kinds of bodies beside wall, door, person and robot.
    #[serde(default)]
    pub(super) kinds: BTreeMap<Spanned<String>, KindSection>,
    /// Sensors by name.
    #[serde(default)]
    pub(super) sensors: BTreeMap<String, Spanned<SensorSection>>,
    /// Effectors by name.
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
    #[serde(default)]
    pub(super) stop: StopSection,
}

/// A file with sensors and effectors only: a learned profile, or the presets.
#[derive(Debug, Deserialize, JsonSchema)]
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

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MapSection {
    pub(super) file: Option<Spanned<PathBuf>>,
    pub(super) ascii: Option<String>,
    pub(super) office: Option<Spanned<OfficeSpec>>,
    pub(super) box_size_m: Option<Number<BoxSide>>,
    pub(super) resolution_m: Option<Positive>,
    #[serde(default)]
    pub(super) unknown: UnknownPolicy,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct KindSection {
    /// Name of the thing that sensors take it for; its own name by default.
    pub(super) observation: Option<Spanned<String>>,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorSection {
    pub(super) bearings_deg: Spanned<Vec<f64>>,
    /// Length of the beams.
    pub(super) range_m: Number<LeftOpen<0, 10_000>>,
    pub(super) observations: Spanned<Vec<String>>,
    #[serde(default)]
    pub(super) designates: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Probability of each report, one row for each true observation; needed unless `beam` is given.
    #[serde(default)]
    pub(super) confusion: Option<Spanned<MatrixRows>>,
    #[serde(default)]
    pub(super) confusion_by_class: BTreeMap<Spanned<String>, Spanned<MatrixRows>>,
    #[serde(default)]
    pub(super) distance_edges_m: Option<Spanned<Vec<f64>>>,
    /// Names of the distance classes, one more than there are edges.
    #[serde(default)]
    pub(super) distance_classes: Option<Spanned<Vec<String>>>,
    #[serde(default)]
    pub(super) distance_confusion: Option<Spanned<MatrixRows>>,
    /// The beam model of a sensor that measures ranges, in place of the three kinds of rows.
    pub(super) beam: Option<Spanned<BeamSection>>,
    /// Counts and sources of a learned table; nothing depends on them.
    #[serde(default, rename = "evidence")]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    _evidence: toml::Table,
}

/// The four-part beam model; the weights of its parts sum to 1.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BeamSection {
    /// Weight of ranges of what is there.
    pub(super) hit: Fraction,
    /// Weight of ranges of something unexpected before it.
    pub(super) short: Fraction,
    /// Weight of no echo.
    pub(super) max: Fraction,
    /// Weight of ranges that are random.
    pub(super) random: Fraction,
    /// Standard deviation of the Gaussian noise of hits.
    pub(super) sigma_hit_m: Positive,
    /// Rate of the exponential density of short ranges, in 1/m.
    pub(super) lambda_short_per_m: Positive,
}

/// Probabilities of all reports, by the name of what is truly there.
pub(super) type MatrixRows = BTreeMap<Spanned<String>, Spanned<Vec<f64>>>;

/// Actions by name; `box_m` and `evidence` name the data on which they rest.
#[derive(Debug, Clone, Default)]
pub(super) struct EffectorSection {
    pub(super) box_m: Option<Positive>,
    pub(super) delays: Option<Spanned<DelaySection>>,
    pub(super) actions: BTreeMap<String, Spanned<Vec<TransitionSection>>>,
}

/// How often a robot is delayed, and for how long: `min` and `max`, or `durations`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DelaySection {
    /// Chance that a delay starts.
    pub(super) p: Fraction,
    /// What may start one.
    #[serde(default)]
    pub(super) per: DelayEvent,
    /// Shortest delay in cycles.
    pub(super) min: Option<DelayCycles>,
    /// Longest delay in cycles.
    pub(super) max: Option<DelayCycles>,
    /// The distribution of durations between `min` and `max`.
    pub(super) distribution: Option<Spanned<DelayDistribution>>,
    /// Mean of a Gaussian, as a share of the way from `min` to `max`.
    pub(super) mean_ratio: Option<Fraction>,
    /// Standard deviation of a Gaussian, as a share of `max - min`.
    pub(super) sd_ratio: Option<NonNegative>,
    /// Durations with their probabilities.
    pub(super) durations: Option<Spanned<Vec<DurationSection>>>,
}

/// A distribution of durations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum DelayDistribution {
    /// All durations alike.
    #[default]
    Uniform,
    /// A normal distribution, cut off at `min` and `max`.
    Gaussian,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DurationSection {
    /// Length of the delay.
    pub(super) cycles: DelayCycles,
    /// Its probability among all delays.
    pub(super) p: Fraction,
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
                        "delays" => section.delays = Some(map.next_value()?),
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

impl JsonSchema for EffectorSection {
    fn schema_name() -> Cow<'static, str> {
        "EffectorSection".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let action = generator.subschema_for::<Vec<TransitionSection>>();
        let delays = generator.subschema_for::<DelaySection>();
        let mut box_m = Positive::json_schema(generator);
        let words = "Side of the boxes that its tables were learned for.";
        box_m.insert("description".into(), words.into());
        let words = "Counts and sources of learned tables; nothing depends on them.";
        json_schema!({
            "type": "object",
            "properties": {
                "box_m": box_m,
                "delays": delays,
                "evidence": { "type": "object", "description": words },
            },
            "additionalProperties": action,
            "required": ["forward"],
        })
    }
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TransitionSection {
    /// Probability of this end of the action.
    pub(super) p: f64,
    /// Steps: F ahead, L to the left, B back, R to the right.
    #[serde(default)]
    pub(super) path: PathSteps,
    /// Turn after the steps, in degrees, positive to the left.
    #[serde(default)]
    pub(super) turn: QuarterTurns,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotSection {
    /// A name for people, and for the sections of its team.
    #[serde(default)]
    pub(super) name: String,
    /// Kind of the robots.
    #[serde(default = "robot_kind")]
    pub(super) kind: Spanned<String>,
    pub(super) count: Option<Spanned<u32>>,
    /// Places: [column, row] or [column, row, heading].
    #[serde(default)]
    pub(super) at: Vec<Spanned<StartPose>>,
    /// Rectangle in which places are drawn.
    pub(super) region: Option<Spanned<FixedList<u32, 4>>>,
    pub(super) scen: Option<Spanned<PathBuf>>,
    pub(super) size: Option<SideBoxes>,
    pub(super) period: Option<Period>,
    pub(super) phase: Option<u32>,
    pub(super) action_cycles: Option<ActionCycles>,
    #[serde(default)]
    pub(super) sensors: Vec<Spanned<String>>,
    pub(super) effector: Option<Spanned<String>>,
    pub(super) behaviour: Option<Spanned<BehaviourSection>>,
    pub(super) planner: Option<Spanned<PlannerSection>>,
    /// Name of the section whose planner leads these robots, too.
    pub(super) team: Option<Spanned<String>>,
    pub(super) tasks: Option<Spanned<TaskSection>>,
}

/// Tasks that robots with a planner carry out, without end: the list begins again where it ends.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TaskSection {
    /// The errands of each task, one after the other: [[[column, row], ...], ...].
    pub(super) list: Option<Vec<Spanned<Errands>>>,
    /// A list of tasks of the League of Robot Runners.
    pub(super) file: Option<Spanned<PathBuf>>,
    /// Tasks that are known and not finished at any time, for each robot.
    pub(super) reveal: Option<Positive>,
    /// How tasks are given to robots.
    #[serde(default)]
    pub(super) policy: TaskPolicyName,
}

/// Columns and rows of the places of one task.
type Errands = Vec<(u32, u32)>;

/// How tasks are given to robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum TaskPolicyName {
    /// The nearest pair of a robot and a task first.
    #[default]
    Nearest,
    /// The task that was known first, to the nearest robot.
    Fifo,
    /// The least sum of ways.
    Optimal,
}

/// The planner of a team with common knowledge: it chooses the actions of all robots of the section, and of those whose
/// `team` is its name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PlannerSection {
    /// The algorithm.
    pub(super) method: PlannerMethod,
    /// How a plan is carried out.
    pub(super) executor: Option<Spanned<PlanExecutor>>,
    /// Actions for which a plan is used, whatever becomes of goals meanwhile.
    pub(super) window: Option<Spanned<Steps>>,
    /// Actions for which a plan is used by `replan`.
    pub(super) replan_every: Option<Spanned<Steps>>,
    /// Boxes and quarter turns by which a robot may be off its plan by `replan`.
    pub(super) max_deviation: Option<Spanned<u32>>,
    /// Most expansions of a search.
    pub(super) budget_expansions: Option<Spanned<Budget>>,
    /// The plan of `file`.
    pub(super) file: Option<Spanned<PathBuf>>,
    /// The places of its robots that the planner knows.
    #[serde(default)]
    pub(super) places: KnownPlaces,
    /// Actions from one report of a robot to the next one.
    pub(super) report_every: Option<Spanned<Steps>>,
    /// The chance that a report is lost.
    pub(super) report_loss: Option<Spanned<Fraction>>,
}

/// The places of its robots that a planner knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum KnownPlaces {
    /// Those where they truly are: the planner is privileged.
    #[default]
    True,
    /// Those that they report; in between, those where its orders should have led them.
    Believed,
}

/// An algorithm of multi-agent path finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum PlannerMethod {
    /// Priority inheritance with backtracking: plans one step in each cycle.
    Pibt,
    /// LaCAM*: a first plan at once, then better ones within a budget.
    Lacam,
    /// Prioritized planning with safe intervals: one robot after the other.
    Prioritized,
    /// Conflict-based search: the lowest sum of costs.
    Cbs,
    /// A plan that was made elsewhere.
    File,
    /// A program that uses the library orders the actions, cycle by cycle.
    External,
}

/// How a plan is carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum PlanExecutor {
    /// By the clock, whatever comes of it.
    Blind,
    /// In the order in which the plan's robots pass each box: an action dependency graph.
    Adg,
    /// By the clock, and anew when a robot is off its plan.
    Replan,
}

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BehaviourSection {
    /// Name of the behavior.
    pub(super) kind: Spanned<String>,
    /// Mean number of actions between turns while wandering.
    pub(super) turn_every: Option<u32>,
    /// One end of a shuttle: [column, row, width, height].
    pub(super) a: Option<[u32; 4]>,
    /// The other end of a shuttle: [column, row, width, height].
    pub(super) b: Option<[u32; 4]>,
    /// Boxes to go to, one after the other: [[column, row], ...].
    pub(super) goals: Option<Vec<(u32, u32)>>,
    /// Actions to replay, by name.
    pub(super) actions: Option<Vec<String>>,
    /// Whether goals or actions start again at their end.
    pub(super) repeat: Option<bool>,
    /// Way past obstacles.
    pub(super) avoidance: Option<AvoidanceSection>,
    /// Weight of each action, by name.
    pub(super) weights: Option<BTreeMap<String, f64>>,
    /// Weight of each action after a contact, by name.
    pub(super) weights_after_contact: Option<BTreeMap<String, f64>>,
}

/// The way of robots that go somewhere past obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum AvoidanceSection {
    /// Plans a way around the things that are sensed, and makes room for others.
    #[default]
    Plan,
    /// Sidesteps from near things.
    Avoid,
    /// Sidesteps from things that were reported twice.
    Filter,
    /// Turns after contacts.
    Touch,
}

impl BehaviourSection {
    /// Returns every key but `kind`, and whether it is given.
    fn given_keys(&self) -> [(&'static str, bool); 9] {
        // Without `..`, so that a new key cannot be forgotten here.
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

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MoverSection {
    /// A name for people.
    #[serde(default, rename = "name")]
    _name: String,
    /// Kind of the bodies.
    #[serde(default = "person_kind")]
    pub(super) kind: Spanned<String>,
    pub(super) count: Option<Spanned<u32>>,
    /// Places: [column, row].
    #[serde(default)]
    pub(super) at: Vec<Spanned<StartPose>>,
    /// Rectangle in which places are drawn.
    pub(super) region: Option<Spanned<FixedList<u32, 4>>>,
    pub(super) size: Option<[SideBoxes; 2]>,
    pub(super) period: Option<Period>,
    /// Cycle of the period in which they act.
    pub(super) phase: Option<u32>,
    pub(super) p_straight: Option<Fraction>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DoorSection {
    /// Kind of the doors.
    #[serde(default = "door_kind")]
    pub(super) kind: Spanned<String>,
    #[serde(default)]
    pub(super) at: Vec<Spanned<StartPose>>,
    pub(super) size: Option<[SideBoxes; 2]>,
    #[serde(default)]
    pub(super) office: bool,
    pub(super) periodic: Option<Spanned<PeriodicSection>>,
    pub(super) random: Option<RandomSection>,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PeriodicSection {
    /// Cycles in which it is open.
    pub(super) open: u64,
    /// Cycles in which it is closed.
    pub(super) closed: u64,
    /// Cycles of the period that are over at the start.
    pub(super) phase: Option<u64>,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RandomSection {
    /// Chance per cycle that a closed door opens.
    pub(super) p_open: Fraction,
    /// Chance per cycle that an open door closes.
    pub(super) p_close: Fraction,
}

#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RadioSection {
    pub(super) range_m: Number<Open<0, 1_000_000>>,
    pub(super) loss: Option<Fraction>,
}

/// What ends a run before its number of cycles.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct StopSection {
    /// The first gridlock.
    pub(super) gridlock: bool,
}

/// The tables that a run keeps in addition to its summary.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// Pose of every body at every cycle.
    pub trajectories: bool,
    /// Contacts and doors.
    pub events: bool,
    /// True and reported reading of every beam, and the result of every action: logs to learn from.
    pub calibration: bool,
    /// Controls of robots whose agents are processes of their own.
    pub controls: bool,
    /// Number of cycles between two checkpoints.
    pub checkpoint_every: u64,
    /// Cycles between two rows of the metrics over time, 0 for none; if left out, one that gives a run a thousand rows.
    pub series_every: Option<u64>,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self {
            trajectories: true,
            events: true,
            calibration: false,
            controls: false,
            checkpoint_every: 10_000,
            series_every: None,
        }
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
