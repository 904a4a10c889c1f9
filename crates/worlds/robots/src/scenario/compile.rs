//! Compilation of a scenario's text to an immutable world and the start of every body.

mod agent_groups;
mod bodies;
mod effectless;
mod known_tables;
mod map;
mod people_and_doors;
mod placer;
mod planner;
mod remarks;
mod robots;
mod tasks;
pub(super) mod unused_keys;

use self::agent_groups::agent_groups;
use self::effectless::{Given, effectless_remarks};
use self::known_tables::{KnownTables, known_tables};
use self::map::{LoadedMap, load_map, padded};
use self::placer::Placement;
pub(super) use self::placer::Placer;
use self::planner::JoinableTeam;
use super::kinds::Kinds;
use super::located_section::LocatedSection;
use super::placement_grid::{PlacementError, PlacementGrid};
use super::random;
use super::tables;
use super::{
    BehaviourSection, DoorSection, EffectorSection, MapSection, MoverSection, ProfileFile,
    RecordSection, RobotSection, RobotsFile, SensorSection,
};
use crate::action::{Action, own_boxes};
use crate::decide::{
    Announce, Avoidance, Behaviour, Errands, External, Goto, Memory, Replay, Sector, SensorTrust,
    Shuttle, StallDetector, Wander,
};
use crate::effector::{ActionId, EffectorModel, FORWARD, MAX_PATH_STEPS, ObstacleRule, Transition};
use crate::errand_fields::MAX_WATCHED_BOXES;
use crate::policy::ConflictPolicy;
use crate::purpose;
use crate::sensor::SensorModel;
use crate::team::Team;
use crate::world::{
    BEAM_CHUNK_BOXES, Body, BodyType, Door, MountedSensor, Mover, Radio, Regime, RobotBody,
    RobotModel, RobotsWorld, Role, StorageOrder,
};
use sidestep_kernel::distr::Bernoulli;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{EntityId, InputError, Seed};
use sidestep_map::planning::{FlowField, FreeSpace};
use sidestep_map::{Cell, GridMap, Rect};
use sidestep_scenario::{FixedList, Head, Remark, Source, Spanned, suggestion};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// Largest number of bodies of a scenario, which finds a slip in `count` before it fills the
/// memory.
const MAX_BODIES: u64 = 10_000_000;
/// Number of cycles of a run where the scenario does not give it.
const DEFAULT_CYCLES: u64 = 10_000;
/// Longest beam in boxes, because all of its boxes are tabulated, for four headings.
const MAX_RANGE_BOXES: f64 = 4096.0;
/// Largest number of boxes along all beams of a sensor; the tables number them, four at a time, with 16 bits.
const MAX_BEAM_BOXES: f64 = 60_000.0;

/// Behaviors that the library's user adds, by the name that a scenario gives them.
pub type Behaviours = BTreeMap<String, Arc<dyn Behaviour>>;

/// A scenario that is checked and tabulated, ready for any number of runs.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// The world, shared by all runs of the scenario.
    pub world: Arc<RobotsWorld>,
    /// Place and facing of each entity at the start, by id.
    pub start: Arc<[((u32, u32), u8)]>,
    /// Name of the scenario; may be empty.
    pub name: String,
    /// Seed of all draws of a run; [`Self::reseeded`] changes it.
    pub seed: u64,
    /// Number of cycles that the scenario asks for.
    pub cycles: u64,
    /// The tables that a run keeps where it is recorded.
    pub record: RecordSection,
    /// Surprises found by compiling.
    pub remarks: Vec<Remark>,
    pub(crate) placer: Arc<Placer>,
}

impl Compiled {
    /// Compiles a scenario; `own` behaviors come beside the built-in ones, `order` changes no
    /// result.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    pub fn new(source: &Source, own: &Behaviours, order: StorageOrder) -> Result<Self, InputError> {
        Compiler::new(source, own)?.compile(order)
    }

    /// Returns the same scenario with another seed, without reading or tabulating anything again: the
    /// result of compiling it with that seed, except for the remarks, which stay those of the first
    /// seed.
    ///
    /// # Errors
    /// When this seed finds no free place for some body.
    pub fn reseeded(&self, seed: u64) -> Result<Self, InputError> {
        let streams = Streams::new(Seed(seed));
        let placed = self.placer.place(&streams)?;
        let world = RobotsWorld { streams, bodies: placed.bodies, ..(*self.world).clone() };
        Ok(Self { world: Arc::new(world), start: placed.start.into(), seed, ..self.clone() })
    }
}

impl Compiled {
    /// Returns whether every run draws: errors of sensors and effectors, people, doors, a radio, or places at the
    /// start, as far as another seed gives others.
    pub(crate) fn is_always_random(&self) -> bool {
        let RobotsWorld { regime, types, radio, .. } = &*self.world;
        let has_errors = *regime != Regime::Reliable;
        let are_all_robots = types.iter().all(|ty| matches!(ty.role, Role::Robot(_)));
        if has_errors || radio.is_some() || !are_all_robots {
            return true;
        }
        // The start is drawn if another seed, any one, gives another.
        let Ok(other) = self.placer.place(&Streams::new(Seed(self.seed ^ 1))) else { return true };
        let phases = self.world.bodies.iter().map(|body| body.phase);
        let other_phases = other.bodies.iter().map(|body| body.phase);
        other.start[..] != self.start[..] || !phases.eq(other_phases)
    }
}

struct Compiler<'a> {
    source: Arc<Source>,
    own: &'a Behaviours,
    head: Head,
    file: RobotsFile,
    map: Arc<GridMap>,
    office_doors: Vec<Rect>,
    kinds: Kinds,
    sensors: Sensors,
    effectors: Effectors,
    streams: Streams,
    types: Vec<BodyType>,
    /// Number of rings of wall to put around the map.
    border: u32,
    /// Largest distance in boxes from a body to a box that it claims.
    reach: u32,
    remarks: Vec<Remark>,
    /// The teams of the sections with a planner so far.
    teams: Vec<JoinableTeam>,
    /// The team of the section before, by its place in that list; none where no planner leads it.
    last_team: Option<usize>,
}

impl<'a> Compiler<'a> {
    fn new(source: &Source, own: &'a Behaviours) -> Result<Self, InputError> {
        let source = Arc::new(source.clone());
        let (head, file) = source.parse_world::<RobotsFile>()?;
        let KnownTables { sensors, effectors, shadowed } = known_tables(&source, &file)?;
        // Where the map is wrong as well, this is the error that is reported.
        check_names(&source, &file, &sensors, &effectors)?;
        let LoadedMap { map, doors: office_doors, remarks: map_remarks } =
            load_map(&source, &file.map)?;
        unused_keys::refuse_unused(&source, &file, own, !office_doors.is_empty())?;
        let kinds = Kinds::new(&source, &file)?;
        check_tables(&kinds, &sensors, &effectors)?;
        remarks::refuse_other_boxes(&source, &file, map.box_size_m, &effectors)?;
        let mut remarks = map_remarks;
        remarks.extend(remarks::effector_remarks(&file, &effectors));
        remarks.extend(remarks::radio_remark(&file));
        remarks.extend(effectless_remarks(&Given {
            source: &source,
            file: &file,
            sensors: &sensors,
            effectors: &effectors,
            shadowed: &shadowed,
            own,
        }));
        let streams = Streams::new(Seed(head.seed));
        let border = border(&file, &effectors);
        Ok(Self {
            source,
            own,
            kinds,
            sensors,
            effectors,
            streams,
            types: Vec::new(),
            border,
            reach: 0,
            remarks,
            teams: Vec::new(),
            last_team: None,
            map,
            office_doors,
            head,
            file,
        })
    }

    fn compile(mut self, order: StorageOrder) -> Result<Compiled, InputError> {
        let robots = self.file.robots.0.len();
        let groups = self.groups()?;
        let sizes = self.types.iter().map(|ty| ty.size).collect();
        let placer =
            Placer { source: Arc::clone(&self.source), map: Arc::clone(&self.map), groups, sizes };
        let placed = placer.place(&self.streams)?;
        let firsts = placer.first_ids();
        let sections = placer.groups.iter().zip(firsts).take(robots);
        self.warn_of_unreachable_goals(sections.clone(), &placed);
        self.warn_of_unwatched_tasks(sections.clone());
        self.warn_of_unreachable_tasks(sections, &placed);
        self.finish(order, placer, placed)
    }

    fn finish(
        self,
        order: StorageOrder,
        placer: Placer,
        placed: Placement,
    ) -> Result<Compiled, InputError> {
        let robots = self.robot_ids(&placed.bodies);
        let stride = self.stride();
        let rows = self.map.height() + 2 * self.border;
        let goal_robots = self.goal_robots(&placed.bodies);
        let radio = self.radio();
        let has_requests = self.has_requests();
        let has_delays = self.has_delays();
        let delay_teams = self.delay_teams(&placer);
        let agent_groups = agent_groups(&placer, &self.types, &self.kinds.names());
        let has_long_actions = placer.groups.iter().any(|group| group.action_cycles > 1);
        let kind_rank = self.kind_rank()?;
        let planner_teams = placer.planner_teams();
        let watched = watched_robots(&goal_robots, &planner_teams, &self.map);
        let mut world = RobotsWorld {
            walls: padded(&self.map, self.border, stride, rows),
            regime: self.file.regime,
            obstacle_rule: self.file.obstacle_rule,
            policy: self.file.conflict_policy,
            kinds: self.kinds.names(),
            free_boxes: self.map.count(Cell::Free),
            map: self.map,
            types: self.types,
            bodies: placed.bodies,
            kind_rank,
            radio,
            teams: Arc::default(),
            robots,
            agent_groups,
            watched_robots: watched,
            planner_teams,
            goal_robots,
            stops_at_gridlock: self.file.stop.gridlock,
            has_requests,
            has_delays,
            delay_teams,
            has_long_actions,
            storage: order,
            streams: self.streams,
            border: self.border,
            stride,
            reach: self.reach,
        };
        // Teams are found in the finished world, of whose types and robots they are made.
        world.teams = Arc::new(world.find_teams());
        world.remember_goal_distances();
        let mut remarks = self.remarks;
        remarks.extend(crate::contact_remarks::no_contact_remarks(&world));
        Ok(Compiled {
            world: Arc::new(world),
            start: placed.start.into(),
            name: self.head.name,
            seed: self.head.seed,
            cycles: self.head.cycles.unwrap_or(DEFAULT_CYCLES),
            record: self.file.record,
            remarks,
            placer: Arc::new(placer),
        })
    }

    fn robot_ids(&self, bodies: &[Body]) -> Vec<EntityId> {
        let mut ids = Vec::new();
        for body in bodies {
            if matches!(self.types[usize::from(body.ty)].role, Role::Robot(_)) {
                ids.push(body.id);
            }
        }
        ids
    }

    fn goal_robots(&self, bodies: &[Body]) -> Vec<EntityId> {
        let has_goals = |body: &&Body| match &self.types[usize::from(body.ty)].role {
            Role::Robot(model) => model.behaviour.goal(&Memory::default()).is_some(),
            _ => false,
        };
        bodies.iter().filter(has_goals).map(|body| body.id).collect()
    }

    fn stride(&self) -> u32 {
        self.map.width() + 2 * self.border
    }

    fn has_delays(&self) -> bool {
        self.types.iter().any(|ty| match &ty.role {
            Role::Robot(model) => model.body.delays.is_some(),
            Role::Mover(_) | Role::Door(_) => false,
        })
    }

    /// Returns the sections of robots whose delays are drawn together.
    fn delay_teams(&self, placer: &Placer) -> Vec<Range<EntityId>> {
        let mut teams = Vec::new();
        for (group, first) in placer.groups.iter().zip(placer.first_ids()) {
            let Some(ty) = group.first_type().filter(|_| group.count > 0) else { continue };
            let Role::Robot(model) = &self.types[usize::from(ty)].role else { continue };
            if model.body.delays.as_ref().is_some_and(|delays| delays.team_chance().is_some()) {
                teams.push(first..first + group.count as EntityId);
            }
        }
        teams
    }

    /// Returns whether some robots ask each other to make room.
    fn has_requests(&self) -> bool {
        self.types.iter().any(|ty| match &ty.role {
            Role::Robot(model) => model.behaviour.has_requests(),
            _ => false,
        })
    }

    fn radio(&self) -> Option<Radio> {
        let radio = self.file.radio?;
        let loss = radio.loss.map_or(0.0, f64::from);
        Some(Radio::new(radio.range_m.get(), self.map.box_size_m, loss))
    }

    /// Returns the rank of each kind in `kind_order`; kinds that are not named come last.
    fn kind_rank(&self) -> Result<Vec<u8>, InputError> {
        let mut rank = vec![self.file.kind_order.len() as u8; self.kinds.names().len()];
        for (k, kind) in self.file.kind_order.iter().enumerate() {
            rank[usize::from(self.kinds.number(kind)?)] = k as u8;
        }
        if self.file.conflict_policy == ConflictPolicy::ByKind && self.file.kind_order.is_empty() {
            let remedy = "add kind_order = [\"person\", \"robot\"], first the kind that goes first";
            let cause = "conflict_policy \"by_kind\" needs kind_order";
            return Err(self.source.error_at("conflict_policy", cause, remedy));
        }
        Ok(rank)
    }
}

/// Returns the robots that are watched for gridlocks, by rising id.
fn watched_robots(goal_robots: &[EntityId], teams: &[Team], map: &GridMap) -> Vec<EntityId> {
    let is_watched = map.cells().len() <= MAX_WATCHED_BOXES;
    let with_tasks = teams.iter().filter(|team| is_watched && team.tasks.is_some());
    let mut all = goal_robots.to_vec();
    all.extend(with_tasks.flat_map(|team| team.robots.clone()));
    all.sort_unstable();
    all
}

/// Returns as many rings of wall as the longest path has steps, and as a beam may be read past a
/// wall, so that neither is checked against the map's edge.
fn border(file: &RobotsFile, effectors: &Effectors) -> u32 {
    let named = file.robots.0.iter().filter_map(|robots| robots.get_ref().effector.as_ref());
    let known = named.filter_map(|name| effectors.get(name.get_ref()));
    let mut max_steps = 1;
    for actions in known.map(|effector| &effector.section.get_ref().actions) {
        for transition in actions.values().flat_map(|transitions| transitions.get_ref()) {
            max_steps = max_steps.max(transition.path.0.len());
        }
    }
    max_steps.clamp(BEAM_CHUNK_BOXES, MAX_PATH_STEPS) as u32
}

/// Returns every action at every heading, see `BodyType::actions`.
fn actions_at_headings(
    actions: &[Vec<Transition>],
    size: (u32, u32),
    stride: u32,
) -> Arc<[Action]> {
    let mut all = Vec::with_capacity(4 * actions.len());
    for heading in 0..4 {
        for transitions in actions {
            let action = Action::new(transitions, heading, size, stride);
            all.push(action.expect("the rows were checked"));
        }
    }
    all.into()
}

/// Checks every table, whether or not a robot uses it.
fn check_tables(kinds: &Kinds, sensors: &Sensors, effectors: &Effectors) -> Result<(), InputError> {
    for (name, at) in sensors {
        tables::sensor(name, at, kinds, false)?;
    }
    for (name, at) in effectors {
        tables::effector(name, at)?;
    }
    Ok(())
}

type Sensors = BTreeMap<String, LocatedSection<SensorSection>>;
type Effectors = BTreeMap<String, LocatedSection<EffectorSection>>;

/// Refuses robots with unknown sensors or effectors.
fn check_names(
    source: &Source,
    file: &RobotsFile,
    sensors: &Sensors,
    effectors: &Effectors,
) -> Result<(), InputError> {
    for robots in file.robots.0.iter().map(Spanned::get_ref) {
        for name in &robots.sensors {
            find_named(source, sensors, name, "sensor")?;
        }
        if let Some(name) = &robots.effector {
            find_named(source, effectors, name, "effector")?;
        }
    }
    Ok(())
}

fn find_named<'m, T>(
    source: &Source,
    all: &'m BTreeMap<String, LocatedSection<T>>,
    name: &Spanned<String>,
    what: &str,
) -> Result<&'m LocatedSection<T>, InputError> {
    all.get(name.get_ref()).ok_or_else(|| {
        let known: Vec<&str> = all.keys().map(String::as_str).collect();
        let cause = format!("unknown {what} `{}`", name.get_ref());
        source.error(name.span(), cause, suggestion(name.get_ref(), &known))
    })
}

/// The presets as text, for `sidestep new` and the documentation.
pub fn presets() -> &'static str {
    include_str!("../presets.toml")
}
