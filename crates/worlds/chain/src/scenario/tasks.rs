//! Tasks of initiators.

use super::super::deploy::deployment::Deployment;
use super::super::driver::own_driver::OwnDriver;
use super::super::driver::{MAX_MOTIONS, Targets, Task, TaskKind, Wander};
use super::super::script::{Script, ScriptMotion, Turtle};

use super::navigators::NavigatorSection;
use super::tool_keys::{FreeAxis, PathWord, ToolContext};
use super::{BoxSection, ChainScenarioCompiler, MAX_VALUE, PointValue, PositiveNumber};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_arms::Arm;
use sidestep_arms::plan::{ChainBases, chain_bases};
use sidestep_kernel::InputError;
use sidestep_rods::{Chain, Mobility};
use sidestep_scenario::{ByName, Spanned};
use std::ops::Range;
use std::sync::Arc;

/// Speed of initiators, and of connectors that come back, unless it is given: that of the measured leader.
pub(super) const DEFAULT_SPEED_M_S: f64 = 0.5;
/// Distance at which a target counts as reached, meters.
pub(super) const DEFAULT_TOLERANCE_M: f64 = 1e-3;
/// Time of vetoes after which a task is given up, unless it is given, s: a planner makes four
/// attempts in it.
const DEFAULT_PATIENCE_S: f64 = 5.0;
/// Standard deviation of the heading of an initiator that wanders, per square root of a meter, unless it is given,
/// degrees.
const DEFAULT_TURN_DEG: f64 = 30.0;
/// Time without coming nearer to a target after which a path is planned, unless it is given, s: long enough for the
/// recovery after a veto to be tried first, which costs far less than a plan.
const DEFAULT_PLAN_DELAY_S: f64 = 0.5;

/// Rods up to which a chain without a fixed base plans by default: the effort grows with the square of their number.
const MAX_PLANNED_RODS: usize = 64;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Kind")]
enum TaskKindWord {
    /// Rests, but gets out of the way.
    Rest,
    /// Wanders anywhere, at random.
    Wander,
    /// Follows an operator's orders, one after the other.
    Script,
    /// Goes to places, one after the other.
    Targets,
    /// Drives on wheels, with a laser, along walls.
    Navigate,
    /// Goes where a caller orders, cycle by cycle.
    External,
}

/// The planner of ways among obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum PlannerWord {
    /// Local rules only.
    None,
    /// Two trees of postures that grow toward each other.
    RrtConnect,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "TaskSection")]
pub(super) struct TaskSection<const D: usize> {
    kind: ByName<TaskKindWord>,
    #[serde(default)]
    connector: usize,
    speed_m_s: Option<PositiveNumber>,
    lasts_s: Option<PositiveNumber>,
    patience_s: Option<PositiveNumber>,
    turn_deg: Option<PositiveNumber>,
    /// Box to stay in: its lower and its upper corner.
    within_m: Option<BoxSection<D>>,
    /// An operator's orders.
    script: Option<String>,
    script_file: Option<String>,
    /// Places to go to, one after the other.
    pub(super) targets_m: Option<Vec<PointValue<D>>>,
    pub(super) tolerance_m: Option<PositiveNumber>,
    /// Orientation of an arm's tool at each target: roll, pitch and yaw, as in URDF; or one for all.
    pub(super) rpy_rad: Option<Vec<[f64; 3]>>,
    /// The same as quaternions x, y, z, w.
    pub(super) quaternions: Option<Vec<[f64; 4]>>,
    /// Parts of the targets' poses that do not count.
    pub(super) free: Option<Vec<FreeAxis>>,
    /// Angle at which an orientation counts as reached.
    pub(super) tolerance_rad: Option<PositiveNumber>,
    /// Values of all joints at each target, in place of places.
    pub(super) joints: Option<Vec<Vec<f64>>>,
    /// The way from one target to the next.
    pub(super) path: Option<PathWord>,
    /// Distance within which the tool of an arm passes the targets before the last one without coming to rest.
    pub(super) blend_m: Option<PositiveNumber>,
    navigator: Option<Spanned<NavigatorSection>>,
    planner: Option<PlannerWord>,
    plans_after_s: Option<PositiveNumber>,
}

impl<const D: usize> TaskSection<D> {
    pub(super) fn connector(&self) -> usize {
        self.connector
    }

    /// Returns its kind if that is a built-in one.
    fn built_in_kind(&self) -> Option<TaskKindWord> {
        match self.kind {
            ByName::BuiltIn(word) => Some(word),
            ByName::Own(_) => None,
        }
    }

    /// Returns its kind as a scenario writes it.
    fn kind_name(&self) -> String {
        match &self.kind {
            ByName::BuiltIn(word) => format!("{word:?}").to_lowercase(),
            ByName::Own(name) => name.get_ref().clone(),
        }
    }

    fn speed_m_s(&self) -> f64 {
        self.speed_m_s.map_or(DEFAULT_SPEED_M_S, f64::from)
    }

    /// Returns whether it plans paths; by default where `plans_usually`, because a chain soon meets itself, or
    /// obstacles, in ways that local rules do not solve.
    fn has_planner(&self, plans_usually: bool) -> bool {
        match self.planner {
            Some(planner) => planner == PlannerWord::RrtConnect,
            None => plans_usually && self.built_in_kind() == Some(TaskKindWord::Targets),
        }
    }

    pub(super) fn is_navigator(&self) -> bool {
        self.built_in_kind() == Some(TaskKindWord::Navigate)
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    pub(super) fn task(
        &self,
        section: &Spanned<TaskSection<D>>,
        is_swarm: bool,
        chain: &Chain<D>,
        arm: Option<&Arm>,
    ) -> Result<Task<D>, InputError> {
        let s = section.get_ref();
        let at = section.span();
        let n = chain.points().len();
        if s.connector >= n {
            let cause = format!("connector = {} of a chain of {n}", s.connector);
            let remedy = format!("count from 0: the last connector is {}", n - 1);
            let at = self.source.key_span(at, &["connector"]);
            return Err(self.source.error(at, cause, remedy));
        }
        let plans = s.has_planner(self.plans_usually(is_swarm, chain, s.connector));
        if plans {
            self.check_planner(section, chain)?;
        }
        let driver = match &s.kind {
            ByName::BuiltIn(word) => {
                self.check_keys(s, plans, at.clone())?;
                let tool = ToolContext { arm, connector: s.connector };
                self.driver(*word, s, tool, at)?
            }
            ByName::Own(name) => {
                // Where its kind is unknown, that is the error to report, and not that keys have no effect in it.
                let drivers = &self.own.drivers;
                let driver = ByName::<TaskKindWord>::find_own(self.source, name, drivers)?;
                self.check_keys(s, plans, at)?;
                TaskKind::Own(OwnDriver::new(name.get_ref(), driver))
            }
        };
        Ok(Task {
            agent: s.connector,
            speed_m_s: s.speed_m_s(),
            lasts_s: s.lasts_s.map_or(f64::INFINITY, f64::from),
            patience_s: s.patience_s.map_or(DEFAULT_PATIENCE_S, f64::from),
            plans_after_s: plans.then(|| s.plans_after_s.map_or(DEFAULT_PLAN_DELAY_S, f64::from)),
            driver,
        })
    }

    /// Returns whether tasks of a chain whose connector `k` is led plan paths unless they say otherwise: with one fixed base
    /// always, and otherwise where its own body can be in its way and plans are cheap and stay right, because the chain is
    /// short, moved as a whole, and nothing moves around it.
    fn plans_usually(&self, is_swarm: bool, chain: &Chain<D>, k: usize) -> bool {
        let ends = chain_bases(chain, k);
        let has_base = match ends {
            Ok(ChainBases::One(base)) => chain.connectors()[base].mobility == Mobility::Fixed,
            _ => false,
        };
        let is_alone = self.file.chain.deployment == Deployment::Direct
            && self.file.chain.self_collision != Some(false)
            && !is_swarm
            && !self.has_movers()
            && self.file.chains.0.iter().map(|section| section.get_ref().count).sum::<usize>() == 1;
        // A single connector has no posture to plan.
        !chain.rods().is_empty()
            && ends.is_ok()
            && (has_base || is_alone && chain.rods().len() <= MAX_PLANNED_RODS)
    }

    /// Refuses a planner for a chain whose postures it does not know.
    fn check_planner(
        &self,
        section: &Spanned<TaskSection<D>>,
        chain: &Chain<D>,
    ) -> Result<(), InputError> {
        let planner_span = || self.source.key_span(section.span(), &["planner"]);
        if chain.rods().is_empty() {
            let cause = "a planner for a chain of one connector";
            let remedy = "leave it out: there are no rods whose posture it could plan";
            return Err(self.source.error(planner_span(), cause, remedy));
        }
        let Err([low, high]) = chain_bases(chain, section.get_ref().connector) else {
            return Ok(());
        };
        let cause = format!(
            "a planner for a chain that is held at connectors {low} and {high}, and not both are fixed"
        );
        let remedy = "leave it out, fix both connectors, or hold the chain at one at most";
        Err(self.source.error(planner_span(), cause, remedy))
    }

    fn driver(
        &self,
        word: TaskKindWord,
        s: &TaskSection<D>,
        tool: ToolContext<'_>,
        at: Range<usize>,
    ) -> Result<TaskKind<D>, InputError> {
        Ok(match word {
            TaskKindWord::Rest => TaskKind::Rest,
            TaskKindWord::Wander => TaskKind::Wander(Wander {
                turn_rad: s.turn_deg.map_or(DEFAULT_TURN_DEG, f64::from).to_radians(),
                within: s.within_m.map(|room| room.0),
            }),
            TaskKindWord::Script => {
                let script = self.script(s, at.clone())?;
                self.check_script(&script, at)?;
                TaskKind::Script(Arc::new(script))
            }
            TaskKindWord::Targets => TaskKind::Targets(self.targets(s, tool, at)?),
            TaskKindWord::External => TaskKind::External,
            TaskKindWord::Navigate if D != 2 => {
                let remedy = "set chain.dimensions = 2, or give another kind";
                let at = self.source.key_span(at, &["kind"]);
                return Err(self.source.error(at, "navigators drive in the plane", remedy));
            }
            TaskKindWord::Navigate => {
                TaskKind::Navigate(Arc::new(self.navigator(s.navigator.as_ref(), s.speed_m_s())?))
            }
        })
    }

    fn script(&self, s: &TaskSection<D>, at: Range<usize>) -> Result<Script, InputError> {
        match (&s.script, &s.script_file) {
            (Some(text), None) => {
                let place = format!("{}, script", self.source.place);
                Script::parse(&place, text)
            }
            (None, Some(file)) => {
                let path = self.source.path(file.as_ref());
                let max_bytes = crate::script::MAX_BYTES as u64;
                let text = sidestep_scenario::file::read_text(&path, max_bytes);
                let place = path.display().to_string();
                let script = text.and_then(|text| Script::parse(&place, &text));
                self.source.with_file_key(at, "script_file", script)
            }
            _ => {
                let remedy = "give script = \"\"\"...\"\"\" or script_file = \"...\"";
                let at = self.source.key_span(at, &["script_file", "kind"]);
                Err(self.source.error(at, "a task of kind script needs one script", remedy))
            }
        }
    }

    /// Runs a script once, so that it cannot fail during a run: whether it yields motions does not
    /// depend on where it starts, except for places beyond all numbers.
    fn check_script(&self, script: &Script, at: Range<usize>) -> Result<(), InputError> {
        for (n, motion) in script.motions(Turtle::default()).enumerate() {
            let is_far = match motion? {
                ScriptMotion::MoveTo { position_m } => {
                    position_m.iter().any(|x| x.abs() > MAX_VALUE)
                }
                _ => false,
            };
            if is_far || n >= MAX_MOTIONS {
                let cause = if is_far {
                    "the script leads further than 1e6 m".into()
                } else {
                    format!("the script makes more than {MAX_MOTIONS} motions")
                };
                let at = self.source.key_span(at, &["script", "script_file"]);
                return Err(self.source.error(at, cause, "go less far, or repeat less often"));
            }
        }
        Ok(())
    }

    fn targets(
        &self,
        s: &TaskSection<D>,
        tool: ToolContext<'_>,
        at: Range<usize>,
    ) -> Result<Targets<D>, InputError> {
        let given = s.targets_m.as_deref().unwrap_or_default();
        if given.is_empty() && s.joints.is_none() {
            let remedy = "add targets_m = [[x, y], ...]";
            let at = self.source.key_span(at, &["targets_m", "kind"]);
            return Err(self.source.error(at, "a task of kind targets needs targets", remedy));
        }
        let places = given.iter().map(|place| place.get()).collect();
        self.add_joint_goals(s, tool, self.plain_targets(s, places), at)
    }

    /// Refuses keys that have no effect in a task of this kind.
    fn check_keys(
        &self,
        s: &TaskSection<D>,
        plans: bool,
        at: Range<usize>,
    ) -> Result<(), InputError> {
        let keys_of_kinds = [
            ("turn_deg", s.turn_deg.is_some(), TaskKindWord::Wander),
            ("within_m", s.within_m.is_some(), TaskKindWord::Wander),
            ("script", s.script.is_some(), TaskKindWord::Script),
            ("script_file", s.script_file.is_some(), TaskKindWord::Script),
            ("targets_m", s.targets_m.is_some(), TaskKindWord::Targets),
            ("tolerance_m", s.tolerance_m.is_some(), TaskKindWord::Targets),
            ("rpy_rad", s.rpy_rad.is_some(), TaskKindWord::Targets),
            ("quaternions", s.quaternions.is_some(), TaskKindWord::Targets),
            ("free", s.free.is_some(), TaskKindWord::Targets),
            ("tolerance_rad", s.tolerance_rad.is_some(), TaskKindWord::Targets),
            ("joints", s.joints.is_some(), TaskKindWord::Targets),
            ("path", s.path.is_some(), TaskKindWord::Targets),
            ("blend_m", s.blend_m.is_some(), TaskKindWord::Targets),
            ("navigator", s.navigator.is_some(), TaskKindWord::Navigate),
            ("planner", s.planner.is_some(), TaskKindWord::Targets),
        ];
        let keys = keys_of_kinds
            .map(|(key, is_given, kind)| (key, is_given, Some(kind) == s.built_in_kind()));
        let context = format!("in a task of kind {}", s.kind_name());
        self.source.refuse_unused_keys(at.clone(), &keys, &context)?;
        // A caller sees each veto, and decides itself when to give up; a resting chain wants nothing.
        let is_patient =
            !matches!(s.built_in_kind(), Some(TaskKindWord::External | TaskKindWord::Rest));
        let patience = ("patience_s", s.patience_s.is_some(), is_patient);
        self.source.refuse_unused_keys(at.clone(), &[patience], &context)?;
        if s.needs_plan() && !plans {
            let at = self.source.key_span(at, &["planner", "kind"]);
            let cause = "orientations, lines and joint values of an arm's tool are always planned";
            return Err(self.source.error(at, cause, "leave planner = \"none\" out"));
        }
        let delay = ("plans_after_s", s.plans_after_s.is_some(), plans);
        self.source.refuse_unused_keys(at, &[delay], "without a planner")
    }
}
