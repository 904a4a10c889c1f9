//! Chains: their shape, their limits, and their start.

use super::super::driver::{Task, TaskKind};
use super::super::formation::RobotSwarmConfig;
use super::super::ground::GroundMap;
use super::super::ground::route::{SpaceRequirement, find_placement};
use super::super::motion::escape::{EscapeMethod, ObstacleEscapeRules};
use super::super::world::{ChainChange, ChainChangeKind, ChainSpec};
use super::arms::ArmSection;
use super::changes::ChangeSection;
use super::mobility::MobilitySection;
use super::navigators::RobotsSection;
use super::obstacles::to_dimensions;
use super::tasks::TaskSection;
use super::{BoxSection, ChainScenarioCompiler, MIN_REACH_M, PointValue, PositiveNumber};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_arms::Arm;
use sidestep_kernel::{InputError, Seed, math};
use sidestep_rods::geometry::{Point, add_scaled, normalized, perpendicular, unit_x};
use sidestep_rods::{Chain, Connector, Mobility, Obstacles, Rod};
use sidestep_scenario::{NumberRange, Sections, Spanned};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Free distance around the parts of a chain that starts anywhere, as a multiple of its radius: at exactly one radius
/// its first motion would be vetoed. A larger factor refuses starts in narrow passages; how much larger than 1 it has
/// to be was chosen, not measured.
const ROOM_FACTOR: f64 = 1.2;
/// Margin of connectors around robots that follow them on wheels, which lag behind, meters. Without one, robots
/// hung on the walls that their connectors graze, with bumpers pressed 47 to 62 % of the time; 0.05 was enough where
/// wheels are a fifth faster than the leader, 0.1 where they are as fast.
const MARGIN_M: f64 = 0.08;
/// Radius of connectors, unless it is given, meters.
const DEFAULT_RADIUS_M: f64 = 0.05;
/// Radius of rods, unless it is given, as a multiple of that of their connectors: a master that touches a wall with a
/// thick rod blocks half a plane, and slaves jump 12 to 19 times as far as a step. The rods of a swarm are virtual
/// anyway.
const ROD_RADIUS_FACTOR: f64 = 0.2;
/// The same for the links of an arm: they are solid, and about as thick as its joints.
const LINK_RADIUS_FACTOR: f64 = 0.8;
/// Keys of which an arm allows none, and `arm` for faults that lie elsewhere; an error points at
/// one of them that is given.
const NON_ARM_KEYS: [&str; 11] = [
    "connectors",
    "points_m",
    "rod_m",
    "along",
    "heading_deg",
    "folded_m",
    "max_bend_deg",
    "within_m",
    "robots",
    "count",
    "arm",
];
/// Most sub-steps of an initiator in a cycle; more would take seconds.
const MAX_STEPS: f64 = 1e5;
/// Most connectors of all chains together: some 3 GB.
const MAX_CONNECTORS: usize = 10_000_000;

/// Everything already present when the chains of a section are placed.
#[derive(Clone, Copy)]
struct PlacementContext<'a, const D: usize> {
    site: Option<&'a GroundMap>,
    /// The number of the section.
    number: u32,
    /// The chains of the sections before.
    placed: &'a [ChainSpec<D>],
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ChainSection")]
pub(super) struct ChainSection<const D: usize> {
    /// A name for people.
    #[serde(default)]
    name: String,
    #[serde(default = "default_chain_count")]
    pub(super) count: usize,
    apart_m: Option<PointValue<D>>,
    connectors: Option<usize>,
    at_m: Option<PointValue<D>>,
    along: Option<Spanned<PointValue<D>>>,
    heading_deg: Option<f64>,
    /// Length of the legs in which it lies, and the distance from one to the next.
    folded_m: Option<[PositiveNumber; 2]>,
    points_m: Option<Vec<PointValue<D>>>,
    #[serde(default)]
    pub(super) anywhere: bool,
    within_m: Option<Spanned<BoxSection<D>>>,
    pub(super) arm: Option<Spanned<ArmSection>>,
    pub(super) robots: Option<Spanned<RobotsSection>>,
    rod_m: Option<NumberRange>,
    radius_m: Option<f64>,
    rod_radius_m: Option<f64>,
    max_bend_deg: Option<f64>,
    #[serde(default)]
    limits: Sections<LimitSection<D>>,
    #[serde(default)]
    tasks: Sections<TaskSection<D>>,
    #[serde(default)]
    pub(super) changes: Sections<ChangeSection<D>>,
}

fn default_chain_count() -> usize {
    1
}

/// Limits of one connector.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "LimitSection")]
pub(super) struct LimitSection<const D: usize> {
    /// Number of the connector, from 0.
    connector: usize,
    mobility: Option<MobilitySection<D>>,
    /// Greatest angle between its two rods.
    max_bend_deg: Option<f64>,
    /// Its radius.
    radius_m: Option<f64>,
    /// Whether it has failed and stands still.
    failed: Option<bool>,
}

impl<const D: usize> LimitSection<D> {
    /// Returns the keys of the limits that are given.
    fn given_keys(&self) -> Vec<&'static str> {
        let given = [
            ("mobility", self.mobility.is_some()),
            ("max_bend_deg", self.max_bend_deg.is_some()),
            ("radius_m", self.radius_m.is_some()),
            ("failed", self.failed.is_some()),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect()
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns the chains of all sections, `count` of each, in the order of the file, which gives
    /// their slots.
    pub(super) fn chains(
        &self,
        dt_s: f64,
        site: Option<&GroundMap>,
    ) -> Result<Vec<ChainSpec<D>>, InputError> {
        self.check_total()?;
        let mut all = Vec::new();
        for (number, section) in (0..).zip(&self.file.chains.0) {
            let around = PlacementContext { site, number, placed: &all };
            let spec = self.chain(section, dt_s, around)?;
            for copy in 0..section.get_ref().count {
                all.push(self.shifted_copy(&spec, section, copy)?);
            }
        }
        if all.is_empty() {
            let remedy = "add [[chains]] with connectors, rod_m and [[chains.tasks]]";
            return Err(self.source.error(None, "the scenario has no chains", remedy));
        }
        Ok(all)
    }

    /// Refuses more connectors than fit in memory, before any is made.
    fn check_total(&self) -> Result<(), InputError> {
        let mut total: usize = 0;
        for section in &self.file.chains.0 {
            let s = section.get_ref();
            let given = s.points_m.as_ref().map(Vec::len);
            let n = s.connectors.or(given).unwrap_or(1).max(1);
            total = total.saturating_add(n.saturating_mul(s.count));
            if total > MAX_CONNECTORS {
                let cause = format!("{total} connectors in all");
                let remedy = format!("give at most {MAX_CONNECTORS}: connectors times count");
                let at = self.source.key_span(section.span(), &["connectors", "points_m", "count"]);
                return Err(self.source.error(at, cause, remedy));
            }
        }
        Ok(())
    }

    /// Returns one more chain like `spec`, shifted by a multiple of `apart_m`.
    fn shifted_copy(
        &self,
        spec: &ChainSpec<D>,
        section: &Spanned<ChainSection<D>>,
        copy: usize,
    ) -> Result<ChainSpec<D>, InputError> {
        let s = section.get_ref();
        let apart_m: Point<D> = match &s.apart_m {
            Some(given) => given.get(),
            None if s.count > 1 => {
                let cause = format!("{} chains at one place", s.count);
                let remedy = "add apart_m = [...], the offset from one to the next";
                let at = self.source.key_span(section.span(), &["count"]);
                return Err(self.source.error(at, cause, remedy));
            }
            None => [0.0; D],
        };
        let by = apart_m.map(|x| x * copy as f64);
        let chain = &spec.start;
        let points = chain.points().iter().map(|p| add_scaled(*p, by, 1.0)).collect();
        let start = Chain::new(points, chain.connectors().to_vec(), chain.rods().to_vec())
            .map_err(|error| self.source.error_from(section.span(), &error))?;
        Ok(ChainSpec { start, ..spec.clone() })
    }

    fn chain(
        &self,
        section: &Spanned<ChainSection<D>>,
        dt_s: f64,
        around: PlacementContext<D>,
    ) -> Result<ChainSpec<D>, InputError> {
        let s = section.get_ref();
        let (start, arm) = self.compile_chain_shape(section, around)?;
        let tasks = self.tasks(section, &start, arm.as_deref())?;
        if let Some(arm) = &arm {
            for (section, task) in s.tasks.0.iter().zip(&tasks) {
                self.check_arm_targets_reachable(section, task, arm)?;
            }
        }
        let changes = self.compile_changes(section, &start, dt_s)?;
        let speed_m_s = tasks.iter().map(|task| task.speed_m_s).fold(0.0, f64::max);
        self.check_steps(section, &start, speed_m_s * dt_s)?;
        let robots =
            s.robots.as_ref().map(|robots| self.compile_robots(robots, speed_m_s)).transpose()?;
        if let Some(robots) = &robots {
            self.check_robot_spacing(section, robots, &start)?;
        }
        if D != 2 && robots.is_some() {
            let remedy = "set chain.dimensions = 2, or leave robots out";
            let at = self.source.key_span(section.span(), &["robots"]);
            return Err(self.source.error(at, "robots on wheels in space", remedy));
        }
        Ok(ChainSpec { name: s.name.clone(), start, tasks, changes, arm, robots })
    }

    /// Returns the tasks of a chain: at least one, and an endless one only at the end.
    fn tasks(
        &self,
        section: &Spanned<ChainSection<D>>,
        start: &Chain<D>,
        arm: Option<&Arm>,
    ) -> Result<Vec<Task<D>>, InputError> {
        let s = section.get_ref();
        let tasks = s.tasks.0.iter().map(|task| self.task(task, s.robots.is_some(), start, arm));
        let tasks = tasks.collect::<Result<Vec<_>, _>>()?;
        // Of several chains each starts elsewhere, and changes may let go of a connector.
        let is_held_for_good = s.count == 1 && !s.anywhere && s.changes.0.is_empty();
        for (section, task) in s.tasks.0.iter().zip(&tasks) {
            self.check_leader(s, section, task, start)?;
            // The joints of an arm have told already.
            if is_held_for_good && arm.is_none() {
                self.check_reach(start, task, section.span())?;
            }
        }
        if let Some(k) = tasks.iter().position(is_endless).filter(|k| k + 1 < tasks.len()) {
            let cause = "this task never ends, and others follow";
            return Err(self.source.error(s.tasks.0[k].span(), cause, "add lasts_s"));
        }
        if tasks.is_empty() {
            let remedy = "add [[chains.tasks]] with a kind: rest, wander, script, targets or \
                          external";
            return Err(self.source.error(section.span(), "a chain without a task", remedy));
        }
        Ok(tasks)
    }

    /// Returns the changes of a chain by their time.
    fn compile_changes(
        &self,
        section: &Spanned<ChainSection<D>>,
        start: &Chain<D>,
        dt_s: f64,
    ) -> Result<Vec<ChainChange<D>>, InputError> {
        let s = section.get_ref();
        let changes = s.changes.0.iter().map(|change| self.change(change, start, dt_s));
        let mut changes = changes.collect::<Result<Vec<_>, _>>()?;
        // A chain may break and be joined in the same cycle, in either order in the file.
        changes.sort_by_key(|change| {
            let joins = matches!(change.what, ChainChangeKind::Reform { .. });
            (change.cycle, joins)
        });
        let breaks =
            changes.iter().filter(|change| matches!(change.what, ChainChangeKind::Scatter { .. }));
        if breaks.count() > 1 {
            let cause = "a chain that breaks more than once";
            return Err(self.source.error(section.span(), cause, "break it once"));
        }
        self.check_break_before_reform(s, dt_s)?;
        Ok(changes)
    }

    /// Refuses to join a chain that has not been broken by then, by the cycles in which both take effect.
    fn check_break_before_reform(&self, s: &ChainSection<D>, dt_s: f64) -> Result<(), InputError> {
        let broken = s.changes.0.iter().find_map(|change| change.get_ref().cycle_of_break(dt_s));
        for change in &s.changes.0 {
            let Some(joined) = change.get_ref().cycle_of_reform(dt_s) else { continue };
            if broken.is_none_or(|broken| joined < broken) {
                let at = self.source.key_span(change.span(), &["reform"]);
                let remedy = "break the chain before: a change with scatter = [first, last]";
                return Err(self.source.error(at, "reform of a chain that is whole", remedy));
            }
        }
        Ok(())
    }

    /// Refuses a speed that would need too many sub-steps per cycle to be practical.
    fn check_steps(
        &self,
        section: &Spanned<ChainSection<D>>,
        chain: &Chain<D>,
        cycle_m: f64,
    ) -> Result<(), InputError> {
        let step_m = self.step_m(chain);
        if cycle_m <= MAX_STEPS * step_m {
            return Ok(());
        }
        let cause =
            format!("its initiator goes {cycle_m:e} m in a cycle, in steps of {step_m:e} m");
        let remedy = "give a shorter chain.dt_s, a lower speed_m_s, larger connectors and rods, \
                      or a longer chain.step_m";
        Err(self.source.error(section.span(), cause, remedy))
    }

    /// Returns the longest sub-step of an initiator of a chain: as given, or as the chain allows.
    fn step_m(&self, chain: &Chain<D>) -> f64 {
        self.file.chain.step_m.map_or(chain.step_m(), f64::from)
    }

    /// Refuses a speed of escapes that would need too many sub-steps: the literal escape moves step by step.
    pub(super) fn check_escapes(
        &self,
        chains: &[ChainSpec<D>],
        escape: Option<&ObstacleEscapeRules>,
    ) -> Result<(), InputError> {
        let Some(escape) = escape.filter(|escape| escape.method == EscapeMethod::Literal) else {
            return Ok(());
        };
        let cycle_m = escape.speed_max_m_s * escape.dt_s;
        for (slot, spec) in chains.iter().enumerate() {
            let step_m = self.step_m(&spec.start);
            if cycle_m > MAX_STEPS * step_m {
                let cause = format!(
                    "it may have to flee {cycle_m:e} m in a cycle, in steps of {step_m:e} m"
                );
                let remedy = "give a shorter chain.dt_s, a lower chain.escape_speed_m_s, slower \
                              obstacles, chain.escape_by = \"simultaneous\", or a longer chain.step_m";
                return Err(self.source.error(self.section_span(slot), cause, remedy));
            }
        }
        Ok(())
    }

    /// Refuses robots that overlap when their rods are shortest, and a margin below 0.
    fn check_robot_spacing(
        &self,
        section: &Spanned<ChainSection<D>>,
        robots: &RobotSwarmConfig,
        chain: &Chain<D>,
    ) -> Result<(), InputError> {
        let radius_m = robots.follower.ring.radius_m;
        let least_m = chain.rods().iter().map(|rod| rod.min_m).fold(f64::INFINITY, f64::min);
        if least_m < 2.0 * radius_m {
            let cause = format!("robots of radius {radius_m} m as near as {least_m} m");
            let at = self.source.key_span(section.span(), &["rod_m", "robots"]);
            return Err(self.source.error(at, cause, "give longer rods, or smaller robots"));
        }
        if chain.connectors().iter().any(|connector| connector.radius_m < radius_m) {
            let remedy = "give robots.margin_m of 0 or more";
            let at = self.source.key_span(section.span(), &["robots"]);
            return Err(self.source.error(at, "connectors smaller than their robots", remedy));
        }
        Ok(())
    }

    fn compile_chain_shape(
        &self,
        section: &Spanned<ChainSection<D>>,
        around: PlacementContext<D>,
    ) -> Result<(Chain<D>, Option<Arc<Arm>>), InputError> {
        let s = section.get_ref();
        let radius_m = self.radius_m(section)?;
        if let Some(arm) = &s.arm {
            let (chain, arm) = self.arm_and_chain(section, arm, radius_m)?;
            return Ok((chain, Some(arm)));
        }
        let rod = self.compile_rod(section, radius_m)?;
        if let Some(within) = s.within_m.as_ref().filter(|_| !s.anywhere) {
            let cause = "within_m of a chain that has its place";
            let remedy = "leave it out, or set anywhere = true";
            return Err(self.source.error(within.span(), cause, remedy));
        }
        let points = if s.anywhere {
            self.random_start(section, &rod, radius_m, around)?
        } else {
            self.points(section, rod.max_m)?
        };
        let mut connectors = vec![Connector::free(radius_m); points.len()];
        self.remove_leader_margins(s, &mut connectors);
        if let Some(deg) = s.max_bend_deg {
            for connector in &mut connectors {
                connector.max_bend_rad = deg.to_radians();
            }
        }
        self.check_limits(&s.limits)?;
        for limit in &s.limits.0 {
            self.apply_limit_section(&mut connectors, limit)?;
        }
        let rods = vec![rod; points.len() - 1];
        let chain = Chain::new(points, connectors, rods)
            .map_err(|error| self.source.error_from(section.span(), &error))?;
        Ok((chain, None))
    }

    /// Returns the radius of the connectors: that of the robots, with the margin that followers
    /// need.
    fn radius_m(&self, section: &Spanned<ChainSection<D>>) -> Result<f64, InputError> {
        let s = section.get_ref();
        match (&s.robots, s.radius_m) {
            (None, given) => Ok(given.unwrap_or(DEFAULT_RADIUS_M)),
            (Some(robots), None) => {
                let robots = robots.get_ref();
                Ok(robots.radius_m() + robots.margin_m.unwrap_or(MARGIN_M))
            }
            (Some(_), Some(_)) => {
                let remedy = "give robots.radius_m and robots.margin_m instead";
                let at = self.source.key_span(section.span(), &["radius_m"]);
                Err(self.source.error(at, "radius_m beside robots", remedy))
            }
        }
    }

    /// Refuses limits of which one replaces another one, or that limit nothing.
    fn check_limits(&self, limits: &Sections<LimitSection<D>>) -> Result<(), InputError> {
        let mut known = BTreeSet::new();
        for section in &limits.0 {
            let limit = section.get_ref();
            let keys = limit.given_keys();
            let twice = keys.iter().find(|key| !known.insert((limit.connector, **key)));
            if let Some(key) = twice {
                let cause = format!("connector {} has `{key}` twice", limit.connector);
                let at = self.source.key_span(section.span(), &[key]);
                return Err(self.source.error(at, cause, "give each limit of a connector once"));
            }
            if keys.is_empty() {
                let cause = format!("connector {} is given without a limit", limit.connector);
                let remedy = "give mobility, max_bend_deg, radius_m or failed, or leave it out";
                return Err(self.source.error(section.span(), cause, remedy));
            }
        }
        Ok(())
    }

    /// Removes the margin from leaders, because they are exactly where their connectors are.
    fn remove_leader_margins(&self, s: &ChainSection<D>, connectors: &mut [Connector<D>]) {
        let Some(robots) = &s.robots else { return };
        for task in s.tasks.0.iter().map(Spanned::get_ref).filter(|task| task.is_navigator()) {
            if let Some(connector) = connectors.get_mut(task.connector()) {
                connector.radius_m = robots.get_ref().radius_m();
            }
        }
    }

    /// Returns an arm, and the chain of its connectors that guides it.
    fn arm_and_chain(
        &self,
        section: &Spanned<ChainSection<D>>,
        arm_section: &Spanned<ArmSection>,
        radius_m: f64,
    ) -> Result<(Chain<D>, Arc<Arm>), InputError> {
        let s = section.get_ref();
        let at = section.span();
        let is_shaped = s.connectors.is_some() || s.points_m.is_some() || s.rod_m.is_some();
        let is_shaped = is_shaped || s.folded_m.is_some();
        let is_turned = s.along.is_some() || s.heading_deg.is_some() || s.max_bend_deg.is_some();
        let is_turned = is_turned || s.anywhere || s.within_m.is_some() || s.robots.is_some();
        if D != 3 || is_shaped || is_turned || s.count != 1 {
            let remedy = "set chain.dimensions = 3, and leave out connectors, points_m, rod_m, \
                          along, heading_deg, folded_m, max_bend_deg, anywhere, robots and count";
            let at = self.source.key_span(at, &NON_ARM_KEYS);
            return Err(self.source.error(at, "an arm has its shape from its URDF file", remedy));
        }
        let base_m = s.at_m.map_or([0.0; D], PointValue::get);
        let arm_span = arm_section.span();
        let arm = self.compile_arm(arm_section, to_dimensions(base_m))?;
        let solid = arm.chain(radius_m, s.rod_radius_m.unwrap_or(LINK_RADIUS_FACTOR * radius_m));
        let solid = solid.map_err(|error| self.source.error_from(arm_span, &error))?;
        // `D` is three here, which the compiler cannot know.
        let points = solid.points().iter().map(|p| to_dimensions(*p)).collect();
        let mut connectors: Vec<_> = solid.connectors().iter().map(convert_arm_connector).collect();
        let mut rods = solid.rods().to_vec();
        // Shapes are what an arm with them consists of: its tool and its load are among them.
        if arm.body.is_none() {
            self.apply_tool_radii(arm_section, &mut connectors, &mut rods)?;
        }
        self.check_limits(&s.limits)?;
        for limit in &s.limits.0 {
            self.apply_limit_section(&mut connectors, limit)?;
        }
        self.check_arm_whole(section, &connectors)?;
        let chain = Chain::new(points, connectors, rods)
            .map_err(|error| self.source.error_from(at, &error))?;
        Ok((chain, Arc::new(arm)))
    }

    /// Gives the last rod of an arm the radius of its tool, and the last connector that of its load.
    fn apply_tool_radii(
        &self,
        section: &Spanned<ArmSection>,
        connectors: &mut [Connector<D>],
        rods: &mut [Rod],
    ) -> Result<(), InputError> {
        let Some(tool) = &section.get_ref().tool else { return Ok(()) };
        let ([.., joint, tip], [.., rod]) = (connectors, rods) else { return Ok(()) };
        let load_m = tool.load_radius_m.map_or(tip.radius_m, f64::from);
        // A rod is at most as thick as both of its connectors. Round the end of a tool as thick as it is, a load that
        // is thinner makes no difference.
        let tool_m = tool.radius_m.map_or(rod.radius_m.min(load_m), f64::from);
        if tool_m > joint.radius_m {
            let at = self.source.key_span(section.span(), &["tool"]);
            let limit_m = joint.radius_m;
            let cause = format!(
                "tool.radius_m = {tool_m} is more than the {limit_m} m of the joint before it"
            );
            let remedy =
                format!("give tool.radius_m = {limit_m} or less, or the chain a higher radius_m");
            return Err(self.source.error(at, cause, remedy));
        }
        rod.radius_m = tool_m;
        tip.radius_m = load_m.max(tool_m);
        Ok(())
    }

    /// Refuses an arm with a base that may move, and changes that take it apart: its joints determine the places
    /// of its connectors.
    fn check_arm_whole(
        &self,
        section: &Spanned<ChainSection<D>>,
        connectors: &[Connector<D>],
    ) -> Result<(), InputError> {
        if connectors.first().is_some_and(|base| base.mobility != Mobility::Fixed) {
            let at = self.source.key_span(section.span(), &["limits"]);
            let remedy = "leave the mobility of connector 0 out; at_m says where the base stands";
            return Err(self.source.error(at, "an arm whose base may move", remedy));
        }
        let changes = &section.get_ref().changes.0;
        match changes.iter().find(|change| change.get_ref().takes_apart()) {
            None => Ok(()),
            Some(change) => {
                let remedy = "make a connector fail, or give a chain of rods in place of the arm";
                let cause =
                    "an arm is as its joints put it: it is never scattered, nor off its base";
                Err(self.source.error(change.span(), cause, remedy))
            }
        }
    }

    fn compile_rod(
        &self,
        section: &Spanned<ChainSection<D>>,
        connector_radius_m: f64,
    ) -> Result<Rod, InputError> {
        let s = section.get_ref();
        let radius_m = s.rod_radius_m.unwrap_or(ROD_RADIUS_FACTOR * connector_radius_m);
        match s.rod_m {
            Some(NumberRange { low: min_m, high: max_m }) => Ok(Rod { min_m, max_m, radius_m }),
            None => {
                let cause = "a chain without the length of its rods";
                let remedy = "add rod_m = 0.5, or rod_m = [least, greatest]";
                Err(self.source.error(section.span(), cause, remedy))
            }
        }
    }

    /// Returns a random place on the ground where the chain has room; it depends on the seed.
    fn random_start(
        &self,
        section: &Spanned<ChainSection<D>>,
        rod: &Rod,
        radius_m: f64,
        PlacementContext { site, number, placed }: PlacementContext<D>,
    ) -> Result<Vec<Point<D>>, InputError> {
        let s = section.get_ref();
        let at = section.span();
        let (Some(site), Some(connectors)) = (site, s.connectors) else {
            let remedy = "give a ground.map or a ground.stage, and give connectors";
            let at = self.source.key_span(at, &["anywhere"]);
            return Err(self.source.error(at, "a chain anywhere on no map", remedy));
        };
        let is_placed = s.at_m.is_some() || s.points_m.is_some() || s.folded_m.is_some();
        if is_placed || s.along.is_some() || s.heading_deg.is_some() {
            let remedy = "leave out at_m, points_m, along, heading_deg and folded_m";
            let keys = ["at_m", "points_m", "along", "heading_deg", "folded_m"];
            let at = self.source.key_span(at, &keys);
            return Err(self.source.error(at, "a chain placed twice", remedy));
        }
        let obstacles = self.placement_obstacles(Some(site), placed)?;
        let obstacles = Obstacles::new(obstacles, rod.max_m.max(MIN_REACH_M))
            .map_err(|error| self.source.error_from(at.clone(), &error))?;
        let obstacles = obstacles.as_planar().expect("only worlds in the plane have a ground");
        let wanted = SpaceRequirement {
            connectors,
            spacing_m: rod.max_m,
            clearance_m: ROOM_FACTOR * radius_m,
            rod_clearance_m: ROOM_FACTOR * rod.radius_m,
            ahead_m: rod.max_m,
            within: s.within_m.as_ref().map(|within| within.get_ref().footprint()),
        };
        let start = find_placement(site, obstacles, &wanted, Seed(self.head.seed), number)
            .map_err(|error| self.source.error_from(at, &error))?;
        Ok(start.points.iter().map(|p| std::array::from_fn(|i| p[i])).collect())
    }

    /// Returns the positions of the connectors: one by one, or on a line from the first one.
    fn points(
        &self,
        section: &Spanned<ChainSection<D>>,
        length_m: f64,
    ) -> Result<Vec<Point<D>>, InputError> {
        let s = section.get_ref();
        let at = section.span();
        if let Some(given) = &s.points_m {
            if s.connectors.is_some() || s.at_m.is_some() || s.folded_m.is_some() {
                let remedy = "give points_m alone, or connectors and at_m";
                let at = self.source.key_span(at, &["points_m"]);
                return Err(self.source.error(at, "a chain placed twice", remedy));
            }
            let keys = [
                ("along", s.along.is_some(), false),
                ("heading_deg", s.heading_deg.is_some(), false),
            ];
            self.source.refuse_unused_keys(at.clone(), &keys, "beside points_m")?;
            if given.is_empty() {
                let at = self.source.key_span(at, &["points_m"]);
                return Err(self.source.error(at, "points_m = []", "give one point or more"));
            }
            return Ok(given.iter().map(|place| place.get()).collect());
        }
        let n = match s.connectors {
            Some(n) if (1..=MAX_CONNECTORS).contains(&n) => n,
            given => {
                let cause =
                    format!("connectors = {}", given.map_or("nothing".into(), |n| n.to_string()));
                let remedy = "give a number from 1 to 10000000, or points_m";
                let at = self.source.key_span(at, &["connectors"]);
                return Err(self.source.error(at, cause, remedy));
            }
        };
        let start = s.at_m.map_or([0.0; D], PointValue::get);
        let u = self.direction(s)?;
        Ok(match s.folded_m {
            None => (0..n).map(|k| add_scaled(start, u, length_m * k as f64)).collect(),
            Some(folds_m) => folded(n, start, u, length_m, folds_m.map(f64::from)),
        })
    }

    /// Returns the direction from the first connector to the last; by default the chain looks along the first axis.
    fn direction(&self, s: &ChainSection<D>) -> Result<Point<D>, InputError> {
        match (&s.along, s.heading_deg) {
            (None, None) => Ok(unit_x().map(|x: f64| -x)),
            (None, Some(deg)) => {
                let rad = deg.to_radians();
                // The first connector leads, the others are behind it.
                let ahead = [math::cos(rad), math::sin(rad), 0.0];
                Ok(std::array::from_fn(|i| -ahead[i]))
            }
            (Some(given), None) => normalized(given.get_ref().get()).ok_or_else(|| {
                let remedy = "give a direction that is not zero";
                self.source.error(given.span(), "along has no length", remedy)
            }),
            (Some(given), Some(_)) => {
                let remedy = "give along, the direction from the first connector to the last, or heading_deg";
                Err(self.source.error(given.span(), "two directions", remedy))
            }
        }
    }

    fn apply_limit_section(
        &self,
        connectors: &mut [Connector<D>],
        limit: &Spanned<LimitSection<D>>,
    ) -> Result<(), InputError> {
        let s = limit.get_ref();
        let n = connectors.len();
        let Some(connector) = connectors.get_mut(s.connector) else {
            let cause = format!("connector = {} of a chain of {n}", s.connector);
            let remedy = format!("count from 0: the last connector is {}", n - 1);
            let at = self.source.key_span(limit.span(), &["connector"]);
            return Err(self.source.error(at, cause, remedy));
        };
        connector.failed = s.failed.unwrap_or(connector.failed);
        if let Some(given) = &s.mobility {
            connector.mobility = given.mobility();
        }
        if let Some(deg) = s.max_bend_deg {
            connector.max_bend_rad = deg.to_radians();
        }
        if let Some(radius_m) = s.radius_m {
            connector.radius_m = radius_m;
        }
        Ok(())
    }
}

fn is_endless<const D: usize>(task: &Task<D>) -> bool {
    let has_an_end = match &task.driver {
        TaskKind::Rest | TaskKind::Wander(_) | TaskKind::External => false,
        TaskKind::Navigate(navigator) => navigator.goal.is_some(),
        // A driver of the program's own may say that it is done.
        TaskKind::Script(_) | TaskKind::Targets(_) | TaskKind::Own(_) => true,
    };
    !has_an_end && task.lasts_s.is_infinite()
}

/// Returns the positions of connectors in legs there and back, each beside the one before: to the left in the plane.
/// The legs and the spans between them have as many rods as come nearest to their lengths, one at least.
fn folded<const D: usize>(
    n: usize,
    start: Point<D>,
    u: Point<D>,
    rod_m: f64,
    [leg_m, apart_m]: [f64; 2],
) -> Vec<Point<D>> {
    let leg = rod_count_for_length(leg_m, rod_m);
    let apart = rod_count_for_length(apart_m, rod_m);
    let aside = perpendicular(u);
    let mut points = Vec::with_capacity(n);
    for k in 0..n {
        let fold = k / (leg + apart);
        let rest = k % (leg + apart);
        let on = rest.min(leg);
        let aside_by = fold * apart + rest.saturating_sub(leg);
        // Every second leg comes back.
        let along_by = if fold.is_multiple_of(2) { on } else { leg - on };
        let at = add_scaled(start, u, rod_m * along_by as f64);
        points.push(add_scaled(at, aside, rod_m * aside_by as f64));
    }
    points
}

/// Returns the number of rods that come nearest to a length, one at least.
fn rod_count_for_length(length_m: f64, rod_m: f64) -> usize {
    (length_m / rod_m).round().max(1.0) as usize
}

/// Returns a connector of an arm in `D` dimensions, which are three: an arm holds connectors only by fixing them.
fn convert_arm_connector<const D: usize>(c: &Connector<3>) -> Connector<D> {
    Connector {
        mobility: if c.is_still() { Mobility::Fixed } else { Mobility::Free },
        max_bend_rad: c.max_bend_rad,
        ..Connector::free(c.radius_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::geometry::distance;

    #[test]
    fn a_folded_chain_has_rods_of_one_length_and_lies_in_its_room() {
        let places = folded(30, [1.0; 3], [0.0, 0.0, 1.0], 0.5, [2.1, 0.9]);
        assert!(places.windows(2).all(|p| (distance(p[0], p[1]) - 0.5).abs() < 1e-12));
        // Legs of 4 rods, 2 rods apart: the second leg comes back, 1 m beside the first.
        let [a, b] = [places[4], places[6]];
        assert!(distance(a, [1.0, 1.0, 3.0]) < 1e-12 && distance(a, b) < 1.0 + 1e-12);
        assert!(distance(places[10], [2.0, 1.0, 1.0]) < 1e-12, "{:?}", places[10]);
        assert!(places.iter().all(|p| (1.0 - 1e-12..=3.0 + 1e-12).contains(&p[2])));
    }
}
