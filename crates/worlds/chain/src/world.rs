//! A compiled world of chains: everything that never changes during a run.

use super::deploy::deployment::Deployment;
use super::driver::{Task, TaskKind, TaskProgress};
use super::formation::{Robot, RobotSwarmConfig};
use super::ground::MovingObstacles;
use super::motion::escape::ObstacleEscapeRules;
use super::motion::recovery::RecoveryLimits;
use super::script::ScriptMotion;
use super::swarm::drive::Pose2;
use sidestep_arms::Arm;
use sidestep_kernel::control::AgentTeams;
use sidestep_kernel::math::atan2;
use sidestep_kernel::network::Network;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntitySlot, InputError};
use sidestep_rods::geometry::{Point, convert_dimensions, norm};
use sidestep_rods::rebuild::MovableEnd;
use sidestep_rods::{Chain, Mobility, Obstacle, Obstacles, Reaction, ReactionRules};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Purposes of this world's random draws. Their numbers are part of every result: another number, other draws.
pub(crate) mod purpose {
    use sidestep_kernel::stream::Purpose;

    /// Turns of a wandering initiator.
    pub(crate) const WANDER: Purpose = Purpose(2);
    /// Places of the parts of a broken chain.
    pub(crate) const SCATTER: Purpose = Purpose(3);
    /// Direction of a wandering initiator that is stuck.
    pub(crate) const TURN_AWAY: Purpose = Purpose(5);
    /// Random postures of a planner.
    pub(crate) const PLAN: Purpose = Purpose(6);
    /// Errors of a laser.
    pub(crate) const LASER: Purpose = Purpose(4);
    /// Faults of messages.
    pub(crate) const NETWORK: Purpose = Purpose(7);
    /// States of links: in a burst of losses or not.
    pub(crate) const BURST: Purpose = Purpose(8);
    /// Messages lost in a burst.
    pub(crate) const BURST_LOSS: Purpose = Purpose(9);
    /// Drivers of a program's own.
    pub(crate) const DRIVER: Purpose = Purpose(10);
    /// Places where the parts of a broken chain are joined again, and their ways there.
    pub(crate) const GATHER: Purpose = Purpose(11);
}

/// Cutoff of a random throw, in standard deviations, so that the claim of a chain that breaks can hold all its parts.
pub(crate) const MAX_THROW_SIGMAS: f64 = 8.0;

/// Ids from here on stand for parts of other chains: the chain's number is added. It is far above the ids
/// of obstacles, of which a field has ten million at most.
pub(crate) const OTHER_CHAIN: u32 = 1 << 31;

/// The immutable world that runs share.
#[derive(Debug, Clone)]
pub struct ChainWorld<const D: usize> {
    /// The chains by id.
    pub(crate) chains: Arc<Vec<ChainSpec<D>>>,
    /// Obstacles that stand still.
    pub obstacles: Arc<Obstacles<D>>,
    /// Obstacles that move.
    pub movers: Arc<MovingObstacles<D>>,
    /// Duration of a cycle, s.
    pub dt_s: f64,
    /// Cycles of the run, by which the progress of an endless task is measured.
    pub(crate) cycles: Cycle,
    /// Rules of all chains; limits that a scenario leaves out follow from its speeds.
    pub(crate) rules: ReactionRules,
    /// The reaction of free connectors, unless it is the built-in one.
    pub(crate) reaction: Option<Arc<dyn Reaction>>,
    /// Rule for getting out of the way of moving obstacles, if they do.
    pub(crate) escape: Option<ObstacleEscapeRules>,
    /// Time that initiators spend on each rung of the ladder after a veto.
    pub(crate) rungs: RecoveryLimits,
    /// Distance up to which the clearance of a chain's parts is measured, meters.
    pub look_m: f64,
    pub(crate) streams: Streams,
    /// Chains that observe, and may be ordered, alike.
    pub(crate) teams: Arc<AgentTeams>,
    /// Where the rules run: in one process, or in an agent for each connector.
    pub deployment: Deployment,
    /// The network that carries the agents' messages, if it is unreliable.
    pub network: Option<Network>,
    /// Digest of the scenario's text and seed, by which agents know each other's packets.
    pub fingerprint: u64,
}

/// One chain and its tasks.
#[derive(Debug, Clone)]
pub(crate) struct ChainSpec<const D: usize> {
    /// Its name; may be empty.
    pub(crate) name: String,
    /// The chain before any change.
    pub(crate) start: Chain<D>,
    /// Tasks of its initiators, one after the other; at least one.
    pub(crate) tasks: Vec<Task<D>>,
    /// Changes to it, by cycle.
    pub(crate) changes: Vec<ChainChange<D>>,
    /// The arm that it represents, if any.
    pub(crate) arm: Option<Arc<Arm>>,
    /// Behavior of the robots that keep to its connectors, if it is a swarm on wheels.
    pub(crate) robots: Option<RobotSwarmConfig>,
}

/// A change to a chain at the start of a cycle (slides R8, R10, F3).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChainChange<const D: usize> {
    /// The cycle at whose start it takes effect.
    pub(crate) cycle: Cycle,
    /// What changes, and to what.
    pub(crate) what: ChainChangeKind<D>,
}

/// What a scenario may change in the course of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ChainChangeKind<const D: usize> {
    /// A connector breaks down, or works again.
    Failed {
        connector: usize,
        /// False if it works again.
        failed: bool,
    },
    /// A connector gets a new mobility.
    Mobility {
        connector: usize,
        /// Where it may be from then on.
        mobility: Mobility<D>,
    },
    /// A connector gets a new bend limit.
    MaxBend {
        connector: usize,
        /// The greatest angle, rad.
        max_bend_rad: f64,
    },
    /// The chain breaks: connectors are thrown about at random.
    Scatter {
        connectors: RangeInclusive<usize>,
        /// Standard deviation of each coordinate, meters.
        by_m: f64,
        /// Shift of the whole end behind them: a gap that the parts may be too short for.
        apart_m: Point<D>,
    },
    /// The scattered connectors come back.
    Reform {
        /// The whole end that may come along.
        may_come: MovableEnd,
        /// Speed limit of each part, m/s.
        speed_m_s: f64,
    },
}

impl<const D: usize> ChainChange<D> {
    /// Returns how far the change may throw parts in a cycle, meters.
    pub(crate) fn max_scatter_m(&self, now: Cycle) -> f64 {
        match &self.what {
            ChainChangeKind::Scatter { by_m, apart_m, .. } if self.cycle == now => {
                MAX_THROW_SIGMAS * by_m + norm(*apart_m)
            }
            _ => 0.0,
        }
    }

    /// Returns the speed at which scattered parts set out in a cycle because of the change, m/s.
    pub(crate) fn gather_speed_m_s(&self, now: Cycle) -> f64 {
        match &self.what {
            ChainChangeKind::Reform { speed_m_s, .. } if self.cycle == now => *speed_m_s,
            _ => 0.0,
        }
    }

    /// Puts new limits into the chain; breaking and joining change places, not limits.
    pub(crate) fn apply_limit_change(&self, chain: &mut Chain<D>) {
        let done = match &self.what {
            ChainChangeKind::Failed { connector, failed } => {
                chain.set_connector_failed(*connector, *failed);
                Ok(())
            }
            ChainChangeKind::Mobility { connector, mobility } => {
                chain.set_mobility(*connector, *mobility)
            }
            ChainChangeKind::MaxBend { connector, max_bend_rad } => {
                chain.set_max_bend_rad(*connector, *max_bend_rad)
            }
            ChainChangeKind::Scatter { .. } | ChainChangeKind::Reform { .. } => Ok(()),
        };
        done.expect("a change was checked when the scenario was compiled");
    }
}

impl<const D: usize> ChainSpec<D> {
    /// Returns what it is at the start, as [`push_part_obstacles`] takes it.
    pub(crate) fn start_parts(&self) -> (&Chain<D>, Option<&[f64]>) {
        (&self.start, self.arm.as_deref().map(|arm| &arm.values[..]))
    }

    /// Returns the robots of a swarm at their connectors, all facing ahead along their chain.
    pub(crate) fn place_robots_at_connectors(
        &self,
        points: &[Point<D>],
        driving: &TaskProgress,
    ) -> Vec<Robot> {
        let [x, y, _] = driving.ahead;
        let heading_rad = atan2(y, x);
        if self.robots.is_none() {
            return Vec::new();
        }
        let poses = points.iter().map(|p| Pose2 { at: convert_dimensions(*p), heading_rad });
        poses.map(|pose| Robot { pose, is_bumped: false }).collect()
    }

    pub(crate) fn robot_radius_m(&self) -> f64 {
        self.robots.as_ref().map_or(0.0, |robots| robots.follower.ring.radius_m)
    }

    /// Returns the motions of the script that a driver is carrying out; empty if there is none.
    pub(crate) fn script_motions(
        &self,
        driving: &TaskProgress,
    ) -> Result<Vec<ScriptMotion>, InputError> {
        match self.tasks.get(driving.task as usize).map(|task| &task.driver) {
            Some(TaskKind::Script(script)) => driving.script_motions(script),
            _ => Ok(Vec::new()),
        }
    }
}

impl<const D: usize> ChainWorld<D> {
    /// Returns whether some chain has robots on wheels.
    pub(crate) fn has_robots(&self) -> bool {
        self.chains.iter().any(|spec| spec.robots.is_some())
    }

    /// Returns whether a chain is alone, so that it can collide with nothing but itself.
    pub(crate) fn has_lone_chain(&self) -> bool {
        self.obstacles.is_empty() && self.movers.is_empty() && self.chains.len() == 1
    }

    /// Returns the seconds from the start of the run to the start of a cycle.
    pub fn cycle_start_time_s(&self, now: Cycle) -> f64 {
        now as f64 * self.dt_s
    }
}

/// Adds the parts of a chain as obstacles to others: of an arm with shapes what encloses its links, of other chains
/// their connectors and rods. `joints` are those of an arm.
pub(crate) fn push_part_obstacles<const D: usize>(
    parts: &mut Vec<Obstacle<D>>,
    slot: EntitySlot,
    spec: &ChainSpec<D>,
    (chain, joints): (&Chain<D>, Option<&[f64]>),
) {
    let id = OTHER_CHAIN + slot;
    let arm = spec.arm.as_deref().zip(joints);
    if let Some(links) = arm.and_then(|(arm, joints)| arm.enclosures(joints, id)) {
        return parts.extend(links);
    }
    let points = chain.points();
    let connectors = points.iter().zip(chain.connectors());
    parts.extend(connectors.map(|(at, connector)| Obstacle::ball(id, *at, connector.radius_m)));
    let rods = points.windows(2).zip(chain.rods());
    parts.extend(rods.map(|(ends, rod)| Obstacle::capsule(id, [ends[0], ends[1]], rod.radius_m)));
}
