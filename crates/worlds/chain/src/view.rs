//! The visible parts of chains: connectors and rods, robots on wheels, and obstacles.

use super::driver::{Task, TaskKind, TaskProgress};
use super::events::{Event, EventKind};
use super::navigate::NavigationGoal;
use super::perceive::Perceiver;
use super::scratch::Scratch;
use super::state::{ChainBodyState as ChainBody, ChainWorldState};
use super::world::{ChainSpec, ChainWorld, OTHER_CHAIN};
use crate::kinds;
use sidestep_kernel::math::wrap_angle;
use sidestep_kernel::view::{
    Body, BodyCondition, BodyId, BodyKind, CoordinateColumn, Isometry2, JointValues, LogEvent,
    Pose, PositionTableColumns, Quantity, Scan, ScanSelection, Scenery, Severity, Shape, Vec3,
};
use sidestep_kernel::{Cycle, EntityId, EntitySlot};
use sidestep_rods::geometry::{ConvexCore, Cuboid, convert_dimensions, cross};
use sidestep_rods::{Chain, Obstacle};
use std::ops::RangeInclusive;

/// Drawn radius of connectors without a body, as a fraction of the longest rod.
const POINT_RADIUS_FRACTION: f64 = 0.05;
/// Drawn height of bodies in the plane, meters.
const HEIGHT_M: f64 = 0.1;
/// The name of a leader's laser.
const LASER: &str = "laser";

impl<const D: usize> ChainWorld<D> {
    /// Returns the static obstacles, and the targets.
    pub(crate) fn scenery(&self, name: &str) -> Scenery {
        // Walls of one room share their number.
        let still = (0..).zip(self.obstacles.still());
        let still = still.map(|(part, obstacle)| obstacle_body(obstacle).with_part(part));
        let goals = (0..).zip(self.chains.iter()).flat_map(|(id, spec)| goals(id, spec));
        Scenery {
            name: name.into(),
            dimensions: D as u8,
            cycle_s: self.dt_s,
            floor: None,
            bodies: still.chain(goals).collect(),
            names: (0..)
                .zip(self.chains.iter())
                // Those without a name are known by their number.
                .filter(|(_, spec)| !spec.name.is_empty())
                .map(|(id, spec)| (kinds::CONNECTOR, id, spec.name.clone()))
                .collect(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        }
    }

    /// Describes recorded positions as places of connectors, one row interval `interval` cycles.
    pub(crate) fn position_columns(interval: Cycle) -> Vec<PositionTableColumns> {
        vec![PositionTableColumns {
            table: "trajectories",
            kind: kinds::CONNECTOR,
            number: "chain",
            part: Some("connector"),
            axes: ["x_m", "y_m", "z_m"][..D]
                .iter()
                .map(|axis| CoordinateColumn::meters(axis))
                .collect(),
            plane: None,
            is_corner: false,
            heading: None,
            interval,
            history: Cycle::MAX,
        }]
    }

    /// Returns all chains by id, then the moving obstacles.
    pub(crate) fn view_bodies(&self, state: &ChainWorldState<D>, now: Cycle) -> Vec<Body> {
        let mut bodies = Vec::new();
        for (id, spec) in (0..).zip(self.chains.iter()) {
            push_chain_bodies(&mut bodies, id, spec, &state.body(id as usize));
        }
        bodies.extend(
            self.movers.at(self.cycle_start_time_s(now)).map(|mover| obstacle_body(&mover)),
        );
        bodies
    }

    /// Returns the poses of robots relative to those at the start of the run, if they are asked for: wheels here do not
    /// slip, so odometry is exact.
    pub(crate) fn odometry_poses(
        &self,
        state: &ChainWorldState<D>,
        is_enabled: bool,
    ) -> Vec<(BodyId, Pose)> {
        let mut poses = Vec::new();
        if !is_enabled {
            return poses;
        }
        for (id, spec) in (0..).zip(self.chains.iter()) {
            let start = TaskProgress::new(spec.tasks[0].agent, spec.start.points());
            let starts = spec.place_robots_at_connectors(spec.start.points(), &start);
            let body = state.body(id as usize);
            for ((part, robot), start) in (0..).zip(&body.robots).zip(&starts) {
                let origin = Isometry2 { origin_m: start.pose.at, yaw_rad: start.pose.heading_rad };
                let [x_m, y_m] = origin.inverse_transform_point(robot.pose.at);
                let turn_rad = wrap_angle(robot.pose.heading_rad - start.pose.heading_rad);
                let pose = Pose::from_heading([x_m, y_m, 0.0], turn_rad);
                poses.push((BodyId::new(kinds::ROBOT, id, Some(part)), pose));
            }
        }
        poses
    }

    /// Returns the values of the joints of all arms, if they are asked for.
    pub(crate) fn joint_values(
        &self,
        state: &ChainWorldState<D>,
        is_enabled: bool,
    ) -> Vec<JointValues> {
        let mut arms = Vec::new();
        if !is_enabled {
            return arms;
        }
        for (number, spec) in (0..).zip(self.chains.iter()) {
            let Some(arm) = &spec.arm else { continue };
            let Some(values) = state.body(number as usize).joints.clone() else { continue };
            let names = arm.serial.variables.iter().map(|variable| variable.name.clone());
            arms.push(JointValues { number, names: names.collect(), values });
        }
        arms
    }

    /// Returns the laser scans that leaders on wheels are about to take.
    pub(crate) fn scans(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
        of: &ScanSelection,
    ) -> Vec<Scan> {
        let scratch = &mut Scratch::new(self);
        scratch.scan.keeps_truth = true;
        let mut perceiver = Perceiver { world: self, state, now, scratch };
        let slots = 0..state.len() as EntitySlot;
        match of {
            ScanSelection::First(leaders) => {
                let scans = slots.filter_map(|slot| leader_scan(&mut perceiver, slot));
                scans.take(*leaders).collect()
            }
            ScanSelection::Of(bodies) => {
                let exist = bodies.iter().filter(|of| slots.contains(&of.number));
                let scans = exist.filter_map(|of| {
                    let scan = leader_scan(&mut perceiver, of.number)?;
                    (scan.of.part == of.part).then_some(scan)
                });
                scans.collect()
            }
        }
    }
}

/// Returns the scan that a leader on wheels is about to take; none for other chains.
fn leader_scan<const D: usize>(perceiver: &mut Perceiver<'_, D>, slot: EntitySlot) -> Option<Scan> {
    let percept = perceiver.percept(slot)?;
    let laser = &percept.navigator.leader.laser;
    let most_m = laser.range_m();
    let [x_m, y_m] = percept.leader.pose.at;
    let beams = laser.readings(&perceiver.scratch.scan);
    let (bearings_rad, ranges_m) =
        beams.map(|(bearing_rad, range_m)| (bearing_rad, hit_range_m(range_m, most_m))).unzip();
    let true_m = laser.true_ranges(&perceiver.scratch.scan);
    let true_m = true_m.map(|range_m| hit_range_m(range_m, most_m)).collect();
    Some(Scan {
        of: BodyId::new(kinds::CONNECTOR, slot, Some(percept.agent as u32)),
        sensor: LASER.into(),
        pose: Pose::from_heading([x_m, y_m, 0.0], percept.leader.pose.heading_rad),
        bearings_rad,
        ranges_m,
        true_m,
        range_m: laser.range_m(),
    })
}

/// Returns the range of a beam; infinite where it meets nothing, as frames have it.
fn hit_range_m(range_m: f64, most_m: f64) -> f64 {
    if range_m < most_m { range_m } else { f64::INFINITY }
}

fn goals<const D: usize>(id: EntityId, spec: &ChainSpec<D>) -> Vec<Body> {
    let least_m = drawn_point_radius_m(&spec.start);
    let mut goals = Vec::new();
    for (part, (at_m, tolerance_m)) in (0..).zip(spec.tasks.iter().flat_map(task_goals)) {
        let ball = Shape::Sphere { radius_m: tolerance_m.max(least_m) };
        let goal = Body::new(BodyKind::GOAL, id, Pose::from_position(at_m), ball);
        goals.push(goal.with_part(part));
    }
    goals
}

/// Returns the places to which a task goes, and the distances at which they count as reached, meters.
fn task_goals<const D: usize>(task: &Task<D>) -> Vec<(Vec3, f64)> {
    match &task.driver {
        TaskKind::Targets(targets) => {
            let places = targets.places.iter();
            places.map(|at| (convert_dimensions(*at), targets.tolerance_m)).collect()
        }
        TaskKind::Navigate(navigator) => match &navigator.goal {
            Some(NavigationGoal::Target { at, tolerance_m }) => {
                vec![([at[0], at[1], 0.0], *tolerance_m)]
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

/// Returns the drawn radius of a chain's points, meters.
fn drawn_point_radius_m<const D: usize>(chain: &Chain<D>) -> f64 {
    POINT_RADIUS_FRACTION * chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max)
}

/// Adds a chain: its rods, its connectors, and the robots that keep to them.
fn push_chain_bodies<const D: usize>(
    bodies: &mut Vec<Body>,
    id: EntityId,
    spec: &ChainSpec<D>,
    body: &ChainBody<D>,
) {
    let chain = &body.chain;
    let least_m = drawn_point_radius_m(&spec.start);
    let points_m: Vec<Vec3> = chain.points().iter().map(|p| convert_dimensions(*p)).collect();
    let radius_m = chain.rods().iter().map(|rod| rod.radius_m).fold(0.0, f64::max);
    for (part, whole) in (0..).zip(whole_parts(chain)) {
        let points_m = points_m[whole].to_vec();
        let line = Shape::Line { points_m, thickness_m: 2.0 * radius_m };
        bodies
            .push(Body::new(kinds::RODS, id, Pose::from_position([0.0; 3]), line).with_part(part));
    }
    let leader = leading_connector(spec, body);
    let connectors = (0_u32..).zip(chain.connectors()).zip(&points_m);
    bodies.extend(connectors.map(|((part, connector), at_m)| {
        let radius_m = if connector.radius_m > 0.0 { connector.radius_m } else { least_m };
        Body::new(kinds::CONNECTOR, id, Pose::from_position(*at_m), Shape::Sphere { radius_m })
            .with_part(part)
            .with_condition_if(leader == Some(part as usize), BodyCondition::Leading)
            .with_condition_if(connector.failed, BodyCondition::Failed)
    }));
    bodies.extend((0..).zip(&body.robots).map(|(part, robot)| {
        let [x_m, y_m] = robot.pose.at;
        let pose = Pose::from_heading([x_m, y_m, 0.0], robot.pose.heading_rad);
        let disc = Shape::Cylinder { radius_m: body.robot_radius_m, height_m: HEIGHT_M };
        Body::new(kinds::ROBOT, id, pose, disc)
            .with_part(part)
            .with_condition_if(robot.is_bumped, BodyCondition::Touching)
    }));
}

/// Returns the connector that the present task moves, or moved if all are done; none where no connector leads.
fn leading_connector<const D: usize>(spec: &ChainSpec<D>, body: &ChainBody<D>) -> Option<usize> {
    let present = spec.tasks.get(body.driving.task as usize).or(spec.tasks.last())?;
    (!matches!(present.driver, TaskKind::Rest)).then_some(present.agent)
}

/// Returns runs of connectors that are joined, because a broken chain's rods hold nothing.
fn whole_parts<const D: usize>(chain: &Chain<D>) -> Vec<RangeInclusive<usize>> {
    let mut parts = Vec::new();
    let mut first = 0;
    for rod in 0..chain.rods().len() {
        if !chain.is_rod_within_limits(rod) {
            parts.push(first..=rod);
            first = rod + 1;
        }
    }
    parts.push(first..=chain.rods().len());
    parts.retain(|part| part.end() > part.start());
    parts
}

/// Returns what viewers draw of an obstacle; in the plane it gets a height.
fn obstacle_body<const D: usize>(obstacle: &Obstacle<D>) -> Body {
    let radius_m = obstacle.radius_m;
    let (pose, shape) = match &obstacle.core {
        ConvexCore::Point(at) if D == 2 => (
            Pose::from_position(convert_dimensions(*at)),
            Shape::Cylinder { radius_m, height_m: HEIGHT_M },
        ),
        ConvexCore::Point(at) => {
            (Pose::from_position(convert_dimensions(*at)), Shape::Sphere { radius_m })
        }
        ConvexCore::Segment(ends) => {
            let points_m = ends.iter().map(|p| convert_dimensions(*p)).collect();
            let line = Shape::Line { points_m, thickness_m: 2.0 * radius_m };
            (Pose::from_position([0.0; 3]), line)
        }
        ConvexCore::Cuboid(cuboid) => (cuboid_pose(cuboid), cuboid_shape(cuboid, radius_m)),
    };
    Body::new(BodyKind::OBSTACLE, obstacle.id, pose, shape)
        .with_velocity(convert_dimensions(obstacle.velocity_m_s))
}

fn cuboid_shape<const D: usize>(cuboid: &Cuboid<D>, radius_m: f64) -> Shape {
    let mut size_m = [HEIGHT_M; 3];
    for (side_m, half_m) in size_m.iter_mut().zip(cuboid.half_m) {
        *side_m = 2.0 * (half_m + radius_m);
    }
    Shape::Cuboid { size_m }
}

fn cuboid_pose<const D: usize>(cuboid: &Cuboid<D>) -> Pose {
    let x = convert_dimensions(cuboid.axes[0]);
    let y = convert_dimensions(cuboid.axes[1]);
    // Two axes determine the third up to its sign, and a box is symmetric.
    Pose::from_axes(convert_dimensions(cuboid.center), [x, y, cross(x, y)])
}

/// Stands for the unit of events without a value.
const NO_VALUE: &str = "none";

/// Describes an event in words.
pub(crate) fn view_event(event: &Event) -> LogEvent {
    let (level, unit, words) = describe(event);
    LogEvent {
        cycle: event.cycle,
        level,
        kind: event.kind.view_kind(),
        who: BodyId::new(kinds::CONNECTOR, event.chain, Some(event.connector)),
        with: event.obstacle.map(obstacle_body_id),
        at_m: Some(event.at_m),
        value: (unit != NO_VALUE).then(|| Quantity::new(event.value, unit)),
        words,
    }
}

/// Returns the severity of an event, the unit of its value, and its words.
fn describe(event: &Event) -> (Severity, &'static str, String) {
    let value = event.value;
    let what = event.obstacle.map(obstacle_text);
    let because = what.as_ref().map_or(String::new(), |what| format!(", because of {what}"));
    let reason = event.reason.map_or("", |reason| reason.name());
    match event.kind {
        EventKind::Veto => (Severity::Warning, "m", format!("objects: {reason}{because}")),
        EventKind::Penetration => {
            let what = what.unwrap_or_else(|| "an obstacle or its own body".into());
            (Severity::Error, "m", format!("is {value:.4} m inside {what}"))
        }
        EventKind::Clear => (Severity::Info, NO_VALUE, "is clear of obstacles again".into()),
        EventKind::Escape => (Severity::Info, "", format!("gets out of the way{because}")),
        EventKind::Bumper => (Severity::Warning, "m", "touches something with its bumper".into()),
        EventKind::Sideways => {
            (Severity::Info, "rad", format!("goes on {value:.2} rad to the side"))
        }
        EventKind::PulledBack => {
            (Severity::Info, NO_VALUE, "is pulled back by the other end".into())
        }
        EventKind::Stuck => (Severity::Warning, NO_VALUE, "is stuck".into()),
        EventKind::Changed => (Severity::Info, NO_VALUE, "has changed".into()),
        EventKind::Broken => (Severity::Error, "", format!("breaks, {value} parts are scattered")),
        EventKind::Reforming => (Severity::Info, "", "sets out to be joined again".into()),
        EventKind::Reformed => (Severity::Info, NO_VALUE, "is joined again".into()),
        EventKind::GapTooLong => (Severity::Warning, "m", gap_text(value, event.missing)),
        EventKind::NotReformed => {
            (Severity::Warning, "m", format!("cannot be joined, off by {value:.3} m{because}"))
        }
        EventKind::Target => (Severity::Info, "", format!("has reached target {value}")),
        EventKind::Done => (Severity::Info, "", format!("has done task {value}")),
        EventKind::GivenUp => (Severity::Warning, "", format!("has given up task {value}")),
        EventKind::TargetGivenUp => (Severity::Warning, "", format!("has given up target {value}")),
        EventKind::Planned => (Severity::Info, "", format!("follows a plan of {value} pieces")),
        EventKind::NotPlanned => (Severity::Warning, "", format!("has no plan to target {value}")),
        EventKind::Unheard => {
            (Severity::Warning, "", format!("is not heard by connector {value}: the chain stands"))
        }
        EventKind::Heard => (Severity::Info, "", format!("is heard by connector {value} again")),
        EventKind::Deadline => (Severity::Warning, NO_VALUE, "is out of time".into()),
    }
}

/// Returns the body of an obstacle: another chain stands for all of its parts.
pub(crate) fn obstacle_body_id(id: u32) -> BodyId {
    match id.checked_sub(OTHER_CHAIN) {
        Some(chain) => BodyId::new(kinds::RODS, chain, None),
        None => BodyId::new(BodyKind::OBSTACLE, id, None),
    }
}

fn gap_text(wanting_m: f64, missing: u32) -> String {
    let parts = if missing == 1 { "part is" } else { "parts are" };
    format!("has a gap that is {wanting_m:.3} m too long: {missing} {parts} missing")
}

fn obstacle_text(id: u32) -> String {
    match id.checked_sub(OTHER_CHAIN) {
        Some(chain) => format!("chain {chain}"),
        None => format!("obstacle/{id}"),
    }
}
