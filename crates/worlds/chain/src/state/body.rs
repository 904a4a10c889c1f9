//! One chain as it is now.

use crate::agents::chain_controls::ChainCycleControls;
use crate::deferred::DeferredMotions;
use crate::driver::external::ExternalControlState;
use crate::driver::own_driver::DriverMemory;
use crate::driver::{Task, TaskProgress};
use crate::formation::{Robot, SolidDisc};
use crate::metrics::ChainTally;
use crate::motion::escape::EscapePlan;
use crate::script::ScriptMotion;
use crate::swarm::drive::Pose2;
use crate::swarm::leader::LeaderState;
use crate::world::ChainSpec;
use serde::{Deserialize, Serialize};
use sidestep_arms::motion::MotionState;
use sidestep_kernel::math::atan2;
use sidestep_kernel::{Cycle, InputError};
use sidestep_rods::Chain;
use sidestep_rods::geometry::{Aabb, Point, convert_dimensions, normalized};
use std::collections::VecDeque;

/// One chain as it is now.
#[derive(Debug, Clone)]
pub struct ChainBodyState<const D: usize> {
    /// Its connectors and rods; with deferred motions only connector 0 is where it should be.
    pub chain: Chain<D>,
    /// Progress of its initiator through its tasks.
    pub driving: TaskProgress,
    /// Scattered connectors, and the places where they will be joined again; none while the chain
    /// is whole.
    pub scattered: Option<ScatteredPartState>,
    /// The robots that keep to its connectors; empty if nothing is on wheels.
    pub robots: Vec<Robot>,
    /// Radius of their bodies, meters.
    pub(crate) robot_radius_m: f64,
    /// Counts so far.
    pub tally: ChainTally,
    /// Cycles for which its navigator stands because something moves ahead.
    pub(crate) standstill: Standstill,
    /// Memory of a driver of the program's own.
    pub(crate) driver_memory: DriverMemory,
    /// Its plan to leave the obstacle that caught a part of it.
    pub(crate) escape_plan: EscapePlan,
    /// The motions of the present script, derived from the position at which it started; so a snapshot does not
    /// hold them.
    pub(crate) motions: Vec<ScriptMotion>,
    /// Orders from an external caller, and the result of the last ones.
    pub(crate) external: ExternalControlState,
    /// Joint values of an arm, in rad or m: its connectors are where forward kinematics puts them.
    pub joints: Option<Vec<f64>>,
    /// The recent motion of these joints, and the reference that they follow.
    pub(crate) motion: MotionState,
    /// The planned path that it follows after local rules came no nearer to the target.
    pub(crate) plan: Option<MotionPlan<D>>,
    /// The nearest lost connectors below and above each connector, as its agent knows; empty while none is lost.
    pub(crate) missing: Vec<MissingNeighbors>,
    /// Decisions that agents in other processes have submitted for a cycle.
    pub(crate) submitted: Option<ChainCycleControls<D>>,
    /// Motions that the chain has yet to follow; none in a body that [`ChainState::body`](super::ChainState::body)
    /// returns.
    pub(crate) deferred: DeferredMotions<D>,
}

/// The scattered part of a broken chain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScatteredPartState {
    /// The first scattered connector.
    pub first: u32,
    /// The last scattered connector.
    pub last: u32,
    /// Speed at which each part returns, m/s; 0 while they lie where they fell.
    pub speed_m_s: f64,
    /// Positions at which all connectors will be joined again, coordinate after coordinate; empty
    /// while the parts lie where they fell.
    pub goals_m: Vec<f64>,
    /// Cycles in a row in which something kept the parts from being joined. It is a list of its own in a
    /// snapshot, so that chains whose parts are never blocked keep their digests.
    #[serde(skip)]
    pub(crate) waited: Cycle,
    /// Way points of each scattered connector, and of the whole one on either side, around what stands between it and its
    /// goal, coordinate after coordinate; the way from the last one to the goal is straight. Empty where no way had to be planned. In the same list of a snapshot.
    #[serde(skip)]
    pub(crate) way_points_m: Vec<Vec<f64>>,
}

impl ScatteredPartState {
    /// Returns the number of connectors that have ways: the scattered ones, and the whole one on either side.
    pub(crate) fn way_count(&self) -> usize {
        (self.last - self.first) as usize + 3
    }
}

/// A planned path to a target: the postures still to be reached, each in a straight line from the one before; at least
/// one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MotionPlan<const D: usize> {
    /// Places of all connectors.
    Rods(VecDeque<Vec<Point<D>>>),
    /// Values of an arm's joints.
    Joints(VecDeque<Vec<f64>>),
}

/// The nearest lost connectors below and above a connector, as its agent knows.
pub(crate) type MissingNeighbors = [Option<u32>; 2];

/// A navigator that stands because something moves ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Standstill {
    /// Cycles in a row.
    pub(crate) cycles: u32,
}

impl<const D: usize> ChainBodyState<D> {
    /// Returns where it is, as [`push_part_obstacles`](crate::world::push_part_obstacles) takes it.
    pub(crate) fn parts(&self) -> (&Chain<D>, Option<&[f64]>) {
        (&self.chain, self.joints.as_deref())
    }

    pub(crate) fn new(spec: &ChainSpec<D>) -> Result<Self, InputError> {
        let chain = spec.start.clone();
        let driving = TaskProgress::new(spec.tasks[0].agent, chain.points());
        let mut body = Self {
            robots: spec.place_robots_at_connectors(chain.points(), &driving),
            robot_radius_m: spec.robot_radius_m(),
            driving,
            chain,
            scattered: None,
            tally: ChainTally::default(),
            standstill: Standstill::default(),
            driver_memory: DriverMemory::default(),
            escape_plan: EscapePlan::default(),
            motions: Vec::new(),
            external: ExternalControlState::default(),
            joints: spec.arm.as_ref().map(|arm| arm.values.clone()),
            motion: MotionState::default(),
            plan: None,
            missing: Vec::new(),
            submitted: None,
            deferred: DeferredMotions::default(),
        };
        body.motions = spec.script_motions(&body.driving)?;
        Ok(body)
    }

    /// Lets the chain follow deferred motions, if there are any.
    pub(crate) fn apply_deferred_motions(&mut self) {
        self.deferred.apply_to_chain(&mut self.chain, &mut self.tally);
    }

    /// Returns the solid parts that other chains perceive: its robots, or its connectors if it has none.
    pub(crate) fn solids(&self) -> impl Iterator<Item = (usize, SolidDisc)> + '_ {
        (0..self.chain.points().len()).map(|k| (k, self.solid(k)))
    }

    fn solid(&self, k: usize) -> SolidDisc {
        if let Some(robot) = self.robots.get(k) {
            return SolidDisc { at: robot.pose.at, radius_m: self.robot_radius_m };
        }
        let radius_m = self.chain.connectors()[k].radius_m;
        SolidDisc { at: convert_dimensions(self.chain.points()[k]), radius_m }
    }

    /// Returns the box around its solid parts in the plane.
    pub(super) fn solid_bounds(&self) -> Aabb<2> {
        let boxes =
            self.solids().map(|(_, solid)| Aabb::from_points(&[solid.at]).grown(solid.radius_m));
        boxes.fold(Aabb::empty(), |all, one| all.joined(&one))
    }

    /// Returns a navigator's memory; at the start of its task it stands at its connector and faces the direction
    /// ahead.
    pub(crate) fn leader_state(&self, task: &Task<D>) -> LeaderState {
        self.driving.leader.unwrap_or_else(|| {
            let [x, y, _] = self.driving.ahead;
            let [x, y] = normalized([x, y]).unwrap_or([1.0, 0.0]);
            let at = convert_dimensions(self.chain.points()[task.agent]);
            LeaderState::new(Pose2 { at, heading_rad: atan2(y, x) })
        })
    }
}

pub(crate) fn flatten<const D: usize>(points: &[Point<D>]) -> Vec<f64> {
    points.iter().flatten().copied().collect()
}

/// Returns the points of [`flatten`].
pub(crate) fn unflatten<const D: usize>(coordinates: &[f64]) -> Vec<Point<D>> {
    coordinates.chunks_exact(D).map(|at| std::array::from_fn(|i| at[i])).collect()
}

impl<const D: usize> MotionPlan<D> {
    /// Returns the number of postures still to be reached.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Rods(path) => path.len(),
            Self::Joints(path) => path.len(),
        }
    }
}
