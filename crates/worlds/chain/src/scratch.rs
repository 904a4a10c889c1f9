//! A worker's buffers, kept between tasks, and the obstacles at a given moment.

use super::agents::percept::ChainPercepts;
use super::events::Event;
use super::motion::escape::ObstacleEscaper;
use super::state::{ChainBodyState, ChainWorldState};
use super::swarm::laser::{LaserScan, RobotBody};
use super::trace::InspectionTrace;
use super::world::{ChainWorld, OTHER_CHAIN, push_part_obstacles};
use sidestep_kernel::{Cycle, EntitySlot};
use sidestep_rods::geometry::{Point, convert_dimensions};
use sidestep_rods::{Obstacle, Obstacles, Propagator, RodBvh};

/// A worker's buffers, kept between tasks.
#[derive(Debug, Clone)]
pub struct Scratch<const D: usize> {
    pub(crate) propagator: Propagator<D>,
    pub(crate) escaper: Option<ObstacleEscaper<D>>,
    /// The obstacles around a chain.
    pub(crate) nearby: NearbyObstacles<D>,
    /// Robots that another robot can perceive.
    pub(crate) robot_bodies: Vec<RobotBody>,
    /// Chains near a robot.
    pub(crate) near: Vec<EntitySlot>,
    pub(crate) scan: LaserScan,
    /// Boxes around a chain's rods.
    pub(crate) own_rods: RodBvh<D>,
    /// Positions of a chain before a cycle.
    pub(crate) before: PositionBuffer<D>,
    /// Where the chain that acts was before the cycle, also if it is an arm that follows a reference.
    pub(crate) actual: PositionBuffer<D>,
    /// Positions of a chain after parts of it escaped.
    pub(crate) escaped: PositionBuffer<D>,
    /// Events of this task.
    pub(crate) events: Vec<Event>,
    /// Record of an inspection of a chain; none in a run.
    pub(crate) trace: Option<Box<InspectionTrace<D>>>,
    /// Percepts of connectors, for a caller that runs their agents elsewhere; none in a run.
    pub(crate) percept_log: Option<Vec<ChainPercepts<D>>>,
}

/// The obstacles around a chain at a given moment.
#[derive(Debug, Clone)]
pub(crate) struct NearbyObstacles<const D: usize> {
    /// The world's obstacles, the moving ones where they are at the start of `moment`, and the
    /// parts of other chains.
    pub(crate) all: Obstacles<D>,
    /// The same without other chains, if there are any.
    solid: Obstacles<D>,
    moment: Option<Cycle>,
    /// Moving obstacles, and parts of other chains.
    movers: Vec<Obstacle<D>>,
    has_others: bool,
}

/// The positions of a chain's connectors at some moment of its cycle.
#[derive(Debug, Clone, Default)]
pub(crate) struct PositionBuffer<const D: usize> {
    pub(crate) points: Vec<Point<D>>,
    /// Joint values of an arm.
    pub(crate) joints: Vec<f64>,
}

impl<const D: usize> Scratch<D> {
    pub(crate) fn new(world: &ChainWorld<D>) -> Self {
        Self {
            propagator: Propagator::new(world.rules).with_reaction(world.reaction.clone()),
            escaper: world.escape.map(ObstacleEscaper::new),
            nearby: NearbyObstacles::new(world),
            robot_bodies: Vec::new(),
            near: Vec::new(),
            scan: LaserScan::default(),
            own_rods: RodBvh::default(),
            before: PositionBuffer::default(),
            actual: PositionBuffer::default(),
            escaped: PositionBuffer::default(),
            events: Vec::new(),
            trace: None,
            percept_log: None,
        }
    }
}

impl<const D: usize> NearbyObstacles<D> {
    fn new(world: &ChainWorld<D>) -> Self {
        Self {
            all: (*world.obstacles).clone(),
            solid: (*world.obstacles).clone(),
            moment: None,
            movers: Vec::new(),
            has_others: false,
        }
    }

    /// Puts moving obstacles where they are at the start of cycle `moment`, and other chains where
    /// they are now.
    pub(crate) fn gather(
        &mut self,
        world: &ChainWorld<D>,
        state: &ChainWorldState<D>,
        moment: Cycle,
        others: impl Iterator<Item = EntitySlot>,
    ) {
        const CHECKED: &str = "movers and chains were checked when the scenario was compiled";
        let mut others = others.peekable();
        let has_others = others.peek().is_some();
        // Most chains of a worker meet no other one, so the obstacles of the last chain serve the next, too.
        if self.moment == Some(moment) && !self.has_others && !has_others {
            return;
        }
        self.movers.clear();
        let movers = world.movers.at(world.cycle_start_time_s(moment));
        self.movers.extend(movers.filter(Obstacle::is_in_range));
        let mover_count = self.movers.len();
        let others: Vec<EntitySlot> = others.collect();
        if has_others {
            others.iter().for_each(|&slot| push_solid_parts(&mut self.movers, slot, world, state));
            self.solid.replace_moving(&self.movers).expect(CHECKED);
            self.movers.truncate(mover_count);
        }
        for slot in others {
            let body = state.body(slot as usize);
            let spec = &world.chains[slot as usize];
            push_part_obstacles(&mut self.movers, slot, spec, body.parts());
        }
        self.all.replace_moving(&self.movers).expect(CHECKED);
        self.moment = Some(moment);
        self.has_others = has_others;
    }

    /// Returns the obstacles that are solid to robots: of other chains the robots, not the rods.
    pub(crate) fn obstacles_solid_to_robots(&self) -> &Obstacles<D> {
        if self.has_others { &self.solid } else { &self.all }
    }
}

impl<const D: usize> PositionBuffer<D> {
    pub(crate) fn record(&mut self, body: &ChainBodyState<D>) {
        self.points.clear();
        self.points.extend_from_slice(body.chain.points());
        self.joints.clear();
        self.joints.extend_from_slice(body.joints.as_deref().unwrap_or_default());
    }

    /// Moves a chain back to these positions.
    pub(crate) fn restore(&self, body: &mut ChainBodyState<D>) {
        body.chain.points_mut().copy_from_slice(&self.points);
        if let Some(joints) = &mut body.joints {
            joints.clone_from(&self.joints);
        }
    }
}

/// Adds the parts of a chain that robots can touch: its robots, or its connectors and rods if it
/// has none.
fn push_solid_parts<const D: usize>(
    parts: &mut Vec<Obstacle<D>>,
    slot: EntitySlot,
    world: &ChainWorld<D>,
    state: &ChainWorldState<D>,
) {
    let body = state.body(slot as usize);
    if body.robots.is_empty() {
        return push_part_obstacles(parts, slot, &world.chains[slot as usize], body.parts());
    }
    parts.extend(body.solids().map(|(_, robot)| {
        Obstacle::ball(OTHER_CHAIN + slot, convert_dimensions(robot.at), robot.radius_m)
    }));
}
