//! The text of a chain scenario, and the world that it compiles to.

mod arms;
mod chains;
mod changes;
mod deployment;
mod joint_goals;
mod leader;
mod mobility;
mod navigators;
mod network;
mod obstacles;
mod reach;
mod spec;
mod starts;
mod tasks;
#[cfg(test)]
mod tests;
mod tool_keys;

use super::deploy::deployment::Deployment;
use super::ground::{GroundMap, MovingObstacles};
use super::motion::escape::{EscapeMethod, ObstacleEscapeRules};
use super::motion::recovery::RecoveryLimits;
use super::own_parts::CustomBehaviors;
use super::world::{ChainSpec, ChainWorld};
use chains::ChainSection;
use network::NetworkSection;
use obstacles::{FieldSection, GroundSection, ObstacleSection, ScenarioObstacles, to_dimensions};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_kernel::network::fingerprint;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_rods::geometry::{Aabb, norm};
use sidestep_rods::{Reaction, ReactionRules, RotationRule};
use sidestep_scenario::{
    ByName, Head, Integer, LeftOpen, Number, Rule, Sections, Source, Spanned, invalid_value, schema,
};
pub(crate) use spec::ScenarioSpec;
pub(super) use starts::own_overlap_text;
use std::borrow::Cow;
use std::sync::Arc;

/// Largest length, time or coordinate of a scenario, the largest that rods take: beyond it,
/// rounding is no longer small.
const MAX_VALUE: f64 = 1e6;
/// Cycles of a run whose scenario does not set them: 40 s of the usual ones.
const DEFAULT_CYCLES: u64 = 2000;
/// Duration of a cycle, unless it is given, s: that of the measurements on which the defaults of the rules rest.
const DEFAULT_DT_S: f64 = 0.02;

/// Largest displacement of a slave in a sub-step, unless it is given, as a multiple of the initiator's longest. Where
/// motion is smooth, slaves go up to 2.2 times as far; thick rods that turn aside throw them 12 to 19 times as far.
const MAX_SLAVE_STEP_FACTOR: f64 = 4.0;

/// Distance up to which clearance is measured, unless it is given, as a multiple of the largest
/// connector's radius. A part is measured against all obstacles within it in each cycle, so that a
/// longer one costs time; within two diameters an obstacle is seen many cycles before it is
/// touched, at the usual speed. The value was chosen, not measured.
const LOOK_FACTOR: f64 = 4.0;
/// Radius, in meters, that stands for smaller ones when that distance is chosen: chains of points look around, too.
const MIN_LOOK_RADIUS_M: f64 = 0.05;

/// Least length, in meters, for which a grid of obstacles is laid out: a chain of one connector has no rod.
const MIN_REACH_M: f64 = 1e-3;

/// Default limits of speed, of joints and of parts that escape, as a multiple of the speed at which chains are led:
/// joints near singular postures, and parts that give way, move faster than the initiator.
const FAST_FACTOR: f64 = 2.0;

/// A length, time or speed.
type PositiveNumber = Number<LeftOpen<0, 1_000_000>>;
/// A place or a direction.
type PointValue<const D: usize> = sidestep_scenario::Point<D, CoordinateRangeRule>;

/// Coordinates that a world accepts.
#[derive(Debug, Clone, Copy)]
struct CoordinateRangeRule;

impl Rule for CoordinateRangeRule {
    fn allows(number: f64) -> bool {
        number.abs() <= MAX_VALUE
    }

    fn description() -> String {
        "-1e6 to 1e6".into()
    }

    fn limits() -> Value {
        json!({ "minimum": -MAX_VALUE, "maximum": MAX_VALUE })
    }

    fn point_description(dimensions: usize) -> String {
        format!("{dimensions} finite numbers, up to 1e6; chain.dimensions is {dimensions}")
    }
}

/// Numbers above 0; infinity means no bound.
#[derive(Debug, Clone, Copy)]
struct PositiveRule;

impl Rule for PositiveRule {
    fn allows(number: f64) -> bool {
        number > 0.0
    }

    fn description() -> String {
        "a number above 0, or inf".into()
    }

    fn limits() -> Value {
        schema::with_infinity(json!({ "exclusiveMinimum": 0 }))
    }
}

/// Numbers above 0 up to 1e6.
#[derive(Debug, Clone, Copy)]
struct PositiveOrInfiniteRule;

impl Rule for PositiveOrInfiniteRule {
    fn allows(number: f64) -> bool {
        number > 0.0 && (number <= MAX_VALUE || number == f64::INFINITY)
    }

    fn description() -> String {
        "a number above 0 and at most 1e6, or inf".into()
    }

    fn limits() -> Value {
        schema::with_infinity(json!({ "exclusiveMinimum": 0, "maximum": MAX_VALUE }))
    }
}

/// A box given by its lower and its upper corner.
#[derive(Debug, Clone, Copy)]
struct BoxSection<const D: usize>(Aabb<D>);

impl<'de, const D: usize> Deserialize<'de> for BoxSection<D> {
    fn deserialize<S: serde::Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        let [lo, hi] = <[PointValue<D>; 2]>::deserialize(deserializer)?.map(PointValue::get);
        if (0..D).all(|i| lo[i] < hi[i]) {
            return Ok(Self(Aabb { lo, hi }));
        }
        let remedy = "give the lower corner first, then the upper";
        Err(invalid_value(format_args!("[{lo:?}, {hi:?}]"), remedy))
    }
}

impl<const D: usize> JsonSchema for BoxSection<D> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Room".into()
    }

    fn schema_id() -> Cow<'static, str> {
        format!("Room_{D}").into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        <[PointValue<D>; 2]>::json_schema(generator)
    }
}

impl<const D: usize> BoxSection<D> {
    /// Returns the floor of the box.
    fn footprint(&self) -> Aabb<2> {
        Aabb { lo: to_dimensions(self.0.lo), hi: to_dimensions(self.0.hi) }
    }
}

/// The part of a scenario by which its points are to be read.
#[derive(Debug, Deserialize, JsonSchema)]
struct Shape {
    #[serde(default)]
    chain: ShapeSection,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
struct ShapeSection {
    dimensions: Option<Spanned<usize>>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ChainFile")]
struct ChainScenarioFile<const D: usize> {
    #[serde(default)]
    chain: RulesSection,
    #[serde(default)]
    ground: Option<Spanned<GroundSection>>,
    #[serde(default)]
    obstacles: Sections<ObstacleSection<D>>,
    #[serde(default)]
    fields: Sections<FieldSection<D>>,
    #[serde(default)]
    chains: Sections<ChainSection<D>>,
    /// Tables that a run keeps.
    #[serde(default)]
    record: RecordSection,
}

/// Returns the JSON Schema of a scenario's sections, with places in the plane and in space; `own` are drivers and
/// reactions beside the built-in ones.
pub(super) fn sections_schema(own: &CustomBehaviors) -> Value {
    let plane = schema::for_type::<ChainScenarioFile<2>>();
    let mut sections = schema::widened(&plane, &schema::for_type::<ChainScenarioFile<3>>());
    schema::add_names(&mut sections, "Kind", own.drivers.keys().map(String::as_str));
    schema::add_names(&mut sections, "RotationWord", own.reactions.keys().map(String::as_str));
    sections
}

/// The behavior of a rod that hits an obstacle, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum RotationWord {
    #[default]
    Union,
    Literal,
    Never,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct RulesSection {
    #[serde(rename = "dimensions")]
    #[schemars(range(min = 2, max = 3))]
    _dimensions: Option<usize>,
    dt_s: Option<PositiveNumber>,
    rotation: ByName<RotationWord>,
    self_collision: Option<bool>,
    slave_step_max_m: Option<Number<PositiveOrInfiniteRule>>,
    joint_speed_m_s: Option<Number<PositiveRule>>,
    step_m: Option<PositiveNumber>,
    backtracks: Option<usize>,
    look_m: Option<PositiveNumber>,
    escape: EscapeWord,
    escape_by: Option<EscapeMethod>,
    escape_speed_m_s: Option<PositiveNumber>,
    escape_ahead_s: Option<PositiveNumber>,
    may_start_inside: bool,
    deployment: Deployment,
    network: Option<Spanned<NetworkSection>>,
}

/// The time at which chains get out of the way of moving obstacles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum EscapeWord {
    /// Before they are touched.
    #[default]
    LookAhead,
    /// Not before they are touched.
    Touch,
    /// Not at all.
    Off,
}

/// The tables that a run records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RecordSection {
    /// One row per connector and recorded cycle.
    pub trajectories: bool,
    /// One row per joint of an arm and recorded cycle.
    pub joints: bool,
    /// One row per robot of a swarm and recorded cycle.
    pub robots: bool,
    /// One row per moving obstacle and recorded cycle.
    pub movers: bool,
    /// One row per event.
    pub events: bool,
    /// Decisions of connectors whose agents are processes of their own.
    pub controls: bool,
    /// One cycle in this many is recorded; events are recorded in all.
    #[serde(deserialize_with = "Integer::<1>::read")]
    #[schemars(with = "Integer<1>")]
    pub every: u64,
    /// Cycles between two checkpoints; 0 for none.
    pub checkpoint_every: u64,
    /// Cycles between two rows of the metrics over time, 0 for none; if left out, one that gives a run a thousand rows.
    pub series_every: Option<u64>,
}

impl Default for RecordSection {
    fn default() -> Self {
        Self {
            trajectories: true,
            joints: true,
            robots: true,
            movers: true,
            events: true,
            controls: false,
            every: 1,
            checkpoint_every: 1000,
            series_every: None,
        }
    }
}

/// A scenario that was checked, ready to start any number of runs.
#[derive(Debug, Clone)]
pub struct ChainScenario<const D: usize> {
    /// What never changes during a run; runs share it.
    pub world: Arc<ChainWorld<D>>,
    /// Name of the scenario, may be empty.
    pub name: String,
    /// Seed of all random draws; [`Self::reseeded`] returns the scenario with another.
    pub seed: u64,
    /// Most cycles of a run; it ends earlier when all tasks are done.
    pub cycles: u64,
    /// The tables that its runs keep.
    pub record: RecordSection,
    /// The sections that it was compiled from; none where no scenario was read.
    pub(crate) recipe: Option<Arc<ScenarioSpec<D>>>,
}

/// A compiled scenario in two or three dimensions.
#[derive(Debug, Clone)]
pub enum AnyChainScenario {
    /// A world in the plane.
    Plane(ChainScenario<2>),
    /// A world in space.
    Space(ChainScenario<3>),
}

impl AnyChainScenario {
    /// Compiles a scenario.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in the scenario.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        Self::with_custom_behaviors(source, &CustomBehaviors::default())
    }

    /// Compiles a scenario that may name drivers and reactions beside the built-in ones.
    ///
    /// # Errors
    /// The same.
    pub fn with_custom_behaviors(
        source: &Source,
        own: &CustomBehaviors,
    ) -> Result<Self, InputError> {
        let dimensions = source.parse::<Shape>()?.chain.dimensions;
        match dimensions.as_ref().map_or(2, |n| *n.get_ref()) {
            2 => compile_scenario(source, own).map(Self::Plane),
            3 => compile_scenario(source, own).map(Self::Space),
            n => {
                let span = dimensions.map(|n| n.span());
                Err(source.error(span, format!("dimensions = {n}"), "give 2 or 3"))
            }
        }
    }
}

fn compile_scenario<const D: usize>(
    source: &Source,
    own: &CustomBehaviors,
) -> Result<ChainScenario<D>, InputError> {
    let (head, file) = source.parse_world()?;
    ScenarioSpec::new(source, head, file, own)?.compile()
}

impl<const D: usize> ChainScenario<D> {
    /// Compiles a scenario that is known to have `D` dimensions.
    ///
    /// # Errors
    /// As [`AnyChainScenario::new`]; also when the scenario has another number of dimensions.
    pub fn new(source: &Source) -> Result<Self, InputError> {
        let shape = source.parse::<Shape>()?.chain;
        let dimensions = shape.dimensions.map_or(2, Spanned::into_inner);
        if dimensions != D {
            let cause = format!("the scenario has {dimensions} dimensions");
            return Err(source.error(None, cause, format!("set chain.dimensions to {D}")));
        }
        compile_scenario(source, &CustomBehaviors::default())
    }
}

struct ChainScenarioCompiler<'a, const D: usize> {
    source: &'a Source,
    head: &'a Head,
    file: &'a ChainScenarioFile<D>,
    site: Option<&'a GroundMap>,
    /// The same world with another seed, if there is one already.
    known: Option<&'a ChainWorld<D>>,
    /// Drivers and reactions beside the built-in ones.
    own: &'a CustomBehaviors,
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    fn compile(&self) -> Result<ChainScenario<D>, InputError> {
        self.check_escape_keys()?;
        let cycles = self.head.cycles.unwrap_or(DEFAULT_CYCLES);
        let compiled = ChainScenario {
            world: Arc::new(self.world(cycles)?),
            name: self.head.name.clone(),
            seed: self.head.seed,
            cycles,
            record: self.file.record,
            recipe: None,
        };
        self.check_scripts(&compiled)?;
        Ok(compiled)
    }

    /// Returns the duration of a cycle, s.
    fn dt_s(&self) -> f64 {
        self.file.chain.dt_s.map_or(DEFAULT_DT_S, f64::from)
    }

    fn world(&self, cycles: u64) -> Result<ChainWorld<D>, InputError> {
        let section = &self.file.chain;
        let reaction = self.reaction()?;
        let dt_s = self.dt_s();
        let chains = match self.known.filter(|_| !self.file.has_random_start()) {
            Some(known) => Arc::clone(&known.chains),
            None => Arc::new(self.chains(dt_s, self.site)?),
        };
        let ground = self.compile_ground(self.site, &chains)?;
        self.check_starts(&chains, &ground)?;
        let connectors = chains.iter().flat_map(|spec| spec.start.connectors());
        let largest_m = connectors.map(|c| c.radius_m).fold(MIN_LOOK_RADIUS_M, f64::max);
        let escape = self.escape(&chains, &ground.movers, dt_s);
        self.check_escapes(&chains, escape.as_ref())?;
        let joint_speed_m_s = self.joint_speed_m_s(&chains);
        let slave_step_max_m = self.slave_step_max_m(&chains, &ground, escape.as_ref(), dt_s);
        let joint_step_max_m = joint_speed_m_s * dt_s;
        let usual = self.rules(joint_step_max_m);
        // Among obstacles that move the limit of escapes holds for all motions of a cycle. Where the own body is not solid,
        // agents of connectors may move a chain, which know the steps of their neighbors alone; one process must not move
        // it otherwise.
        let is_limited = usual.self_collision && escape.is_none();
        let free_step_max_m = if is_limited { joint_step_max_m } else { f64::INFINITY };
        let rules = ReactionRules { slave_step_max_m, free_step_max_m, ..usual };
        let network = self.network(dt_s, &chains)?;
        self.check_local_knowledge(&chains, &rules, escape.is_some())?;
        let world = ChainWorld {
            chains,
            cycles,
            escape,
            rungs: RecoveryLimits::default(),
            obstacles: Arc::new(ground.obstacles),
            movers: Arc::new(ground.movers),
            dt_s,
            rules,
            reaction,
            look_m: section.look_m.map_or(LOOK_FACTOR * largest_m, f64::from),
            streams: Streams::new(Seed(self.head.seed)),
            teams: Arc::default(),
            deployment: section.deployment,
            network,
            fingerprint: fingerprint(&self.source.text, self.head.seed),
        };
        let teams = match self.known {
            Some(known) => Arc::clone(&known.teams),
            None => Arc::new(world.find_teams()),
        };
        Ok(ChainWorld { teams, ..world })
    }

    /// Runs the scripts once, so that they cannot fail during a run.
    fn check_scripts(&self, compiled: &ChainScenario<D>) -> Result<(), InputError> {
        super::state::ChainWorldState::new(&compiled.world).map(drop)
    }

    /// Returns the rule by which chains escape; none if nothing moves. By default chains escape at
    /// twice the speed at which they are led, or twice that of the fastest moving obstacle.
    fn escape(
        &self,
        chains: &[ChainSpec<D>],
        movers: &MovingObstacles<D>,
        dt_s: f64,
    ) -> Option<ObstacleEscapeRules> {
        let section = &self.file.chain;
        if section.escape == EscapeWord::Off || movers.is_empty() {
            return None;
        }
        let led = chains.iter().flat_map(|spec| &spec.tasks).map(|task| task.speed_m_s);
        // Every course keeps its speed, so the start shows how fast movers ever are.
        let fastest = movers.at(0.0).map(|mover| norm(mover.velocity_m_s)).fold(0.0, f64::max);
        let usual_m_s = FAST_FACTOR * led.fold(fastest, f64::max);
        let usual =
            ObstacleEscapeRules::new(dt_s, section.escape_speed_m_s.map_or(usual_m_s, f64::from));
        let ahead_s = section.escape_ahead_s.map_or(usual.ticks_ahead * dt_s, f64::from);
        let looks_ahead = section.escape == EscapeWord::LookAhead;
        let ticks_ahead = if looks_ahead { ahead_s / dt_s } else { 0.0 };
        Some(ObstacleEscapeRules {
            ticks_ahead,
            method: section.escape_by.unwrap_or_default(),
            ..usual
        })
    }

    /// Refuses keys of escapes that the kind of escape leaves without effect.
    fn check_escape_keys(&self) -> Result<(), InputError> {
        let RulesSection { escape, escape_speed_m_s, escape_ahead_s, .. } = &self.file.chain;
        let (key, because) = match escape {
            EscapeWord::Off if escape_speed_m_s.is_some() => ("escape_speed_m_s", "\"off\""),
            EscapeWord::Off if escape_ahead_s.is_some() => ("escape_ahead_s", "\"off\""),
            EscapeWord::Touch if escape_ahead_s.is_some() => ("escape_ahead_s", "\"touch\""),
            _ => return Ok(()),
        };
        Err(self.source.unused_key(&format!("chain.{key}"), &format!("with escape = {because}")))
    }

    /// Returns the greatest speed of any connector of a chain that is held, or whose own body is solid and where no part
    /// escapes, m/s; by default twice that at which one is led.
    fn joint_speed_m_s(&self, chains: &[ChainSpec<D>]) -> f64 {
        let led = chains.iter().flat_map(|spec| &spec.tasks).map(|task| task.speed_m_s);
        let usual_m_s = FAST_FACTOR * led.fold(0.0, f64::max);
        self.file.chain.joint_speed_m_s.map_or(usual_m_s, f64::from)
    }

    /// Returns the largest displacement of a slave in a sub-step, meters. The limit of escaping chains holds for led
    /// ones too; where nothing escapes, the usual one is a multiple of the longest sub-step of an initiator,
    /// because rods that turn aside throw the parts that hang on them much farther.
    fn slave_step_max_m(
        &self,
        chains: &[ChainSpec<D>],
        ground: &ScenarioObstacles<D>,
        escape: Option<&ObstacleEscapeRules>,
        dt_s: f64,
    ) -> f64 {
        let given_m = self.file.chain.slave_step_max_m.map(f64::from);
        if let Some(escape) = escape {
            return given_m.unwrap_or(f64::INFINITY).min(escape.speed_max_m_s * escape.dt_s);
        }
        if let Some(given_m) = given_m {
            return given_m;
        }
        // A chain alone takes a cycle in one sub-step where nothing is in the way; several that have the floor for
        // themselves are given as much.
        let is_open = self.file.chain.self_collision == Some(false)
            && ground.obstacles.is_empty()
            && ground.movers.is_empty();
        let step_m = self.file.chain.step_m.map(f64::from).or(is_open.then_some(f64::INFINITY));
        let mut longest_m: f64 = 0.0;
        for spec in chains {
            let led_m_s = spec.tasks.iter().map(|task| task.speed_m_s).fold(0.0, f64::max);
            let sub_step_m = (led_m_s * dt_s).min(step_m.unwrap_or(spec.start.step_m()));
            longest_m = longest_m.max(sub_step_m);
        }
        MAX_SLAVE_STEP_FACTOR * longest_m
    }

    fn rules(&self, joint_step_max_m: f64) -> ReactionRules {
        let section = &self.file.chain;
        ReactionRules {
            rotation: match section.rotation {
                // Predictions of leaders among obstacles that move are made by the default, for a reaction of the
                // program's own as well.
                ByName::BuiltIn(RotationWord::Union) | ByName::Own(_) => RotationRule::Union,
                ByName::BuiltIn(RotationWord::Literal) => RotationRule::Literal,
                ByName::BuiltIn(RotationWord::Never) => RotationRule::Never,
            },
            self_collision: section.self_collision.unwrap_or(true),
            // These two are chosen by the caller, who knows all chains and the ground.
            slave_step_max_m: f64::INFINITY,
            free_step_max_m: f64::INFINITY,
            joint_step_max_m,
            backtracks: section.backtracks.unwrap_or(ReactionRules::default().backtracks),
            step_m: section.step_m.map(f64::from),
        }
    }

    /// Returns the reaction of the program's own that the scenario names, if it names one.
    fn reaction(&self) -> Result<Option<Arc<dyn Reaction>>, InputError> {
        let ByName::Own(name) = &self.file.chain.rotation else { return Ok(None) };
        let reactions = &self.own.reactions;
        let reaction = ByName::<RotationWord>::find_own(self.source, name, reactions)?;
        Ok(Some(Arc::clone(reaction)))
    }
}
