//! A compiled world of chains: everything that never changes during a run.

use super::arms::arm::Arm;
use super::driver::{Driver, Driving, Task};
use super::formation::{Robot, Robots};
use super::ground::Movers;
use super::motion::escape::Escape;
use super::motion::replan::Rungs;
use super::rods::chain::{Chain, Mobility};
use super::rods::geometry::{Point, in_dimensions, norm};
use super::rods::obstacle::{Obstacle, Obstacles};
use super::rods::rebuild::MayCome;
use super::rods::rules::Rules;
use super::script::Motion;
use super::swarm::drive::Pose;
use sidestep_kernel::math::atan2;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, InputError, Slot};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// What random draws of this world are for.
pub(crate) mod purpose {
    use sidestep_kernel::stream::Purpose;

    /// How a wandering initiator turns.
    pub(crate) const WANDER: Purpose = Purpose(2);
    /// Where the parts of a broken chain lie.
    pub(crate) const SCATTER: Purpose = Purpose(3);
    /// Where a wandering initiator goes that is stuck.
    pub(crate) const TURN_AWAY: Purpose = Purpose(5);
    /// Errors of a laser.
    pub(crate) const LASER: Purpose = Purpose(4);
}

/// Nothing is thrown further than so many standard deviations.
pub(crate) const FARTHEST_THROW: f64 = 8.0;

/// From this id on, obstacles are parts of other chains: its number is added.
pub(crate) const OTHER_CHAIN: u32 = 1 << 31;

/// The immutable world that runs share.
#[derive(Debug, Clone)]
pub struct ChainWorld<const D: usize> {
    /// The chains by id.
    pub(crate) chains: Vec<ChainSpec<D>>,
    /// Obstacles that stand still.
    pub obstacles: Obstacles<D>,
    /// Obstacles that move.
    pub movers: Movers<D>,
    /// What a cycle takes.
    pub(crate) dt_s: f64,
    /// Cycles that a run has: what an endless task is measured by.
    pub(crate) cycles: Cycle,
    /// How chains react.
    pub(crate) rules: Rules,
    /// How they get out of the way of what moves, if they do.
    pub(crate) escape: Option<Escape>,
    /// How long initiators try on each rung of the ladder after a veto.
    pub(crate) rungs: Rungs,
    /// How far around its parts a chain looks for its least distance from obstacles.
    pub look_m: f64,
    pub(crate) streams: Streams,
}

/// One chain, and what it is to do.
#[derive(Debug, Clone)]
pub(crate) struct ChainSpec<const D: usize> {
    /// Its name, may be empty.
    pub(crate) name: String,
    /// The chain at the start.
    pub(crate) start: Chain<D>,
    /// What its initiators do, one task after the other; at least one.
    pub(crate) tasks: Vec<Task<D>>,
    /// What happens to it, by cycle.
    pub(crate) changes: Vec<Change<D>>,
    /// The arm that it stands for, if it stands for one.
    pub(crate) arm: Option<Arc<Arm>>,
    /// How the robots behave that keep to its connectors, if it is a swarm on wheels.
    pub(crate) robots: Option<Robots>,
}

/// Something that happens to a chain at the begin of a cycle (slides R8, R10, F3).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change<const D: usize> {
    /// The cycle.
    pub(crate) cycle: Cycle,
    /// What happens.
    pub(crate) what: What<D>,
}

/// What happens to a chain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum What<const D: usize> {
    /// A connector breaks down, or works again.
    Failed {
        /// Which one.
        connector: usize,
        /// Whether it has failed.
        failed: bool,
    },
    /// A connector gets another mobility.
    Mobility {
        /// Which one.
        connector: usize,
        /// Where it may be.
        mobility: Mobility<D>,
    },
    /// A connector gets another bend limit.
    MaxBend {
        /// Which one.
        connector: usize,
        /// The greatest angle.
        max_bend_rad: f64,
    },
    /// The chain breaks: connectors are thrown about.
    Scatter {
        /// Which ones.
        connectors: RangeInclusive<usize>,
        /// Standard deviation of each coordinate.
        by_m: f64,
        /// The whole end behind them is moved by this: then parts are wanting.
        apart_m: Point<D>,
    },
    /// The scattered connectors come back, at most so fast.
    Reform {
        /// Which whole end may come along.
        may_come: MayCome,
        /// Speed of each part.
        speed_m_s: f64,
    },
}

impl<const D: usize> Change<D> {
    /// How far it may throw parts in a cycle.
    pub(crate) fn throws_m(&self, now: Cycle) -> f64 {
        match &self.what {
            What::Scatter { by_m, apart_m, .. } if self.cycle == now => {
                FARTHEST_THROW * by_m + norm(*apart_m)
            }
            _ => 0.0,
        }
    }

    /// Applies what is a constraint.
    pub(crate) fn constrain(&self, chain: &mut Chain<D>) {
        let done = match &self.what {
            What::Failed { connector, failed } => {
                chain.set_failed(*connector, *failed);
                Ok(())
            }
            What::Mobility { connector, mobility } => chain.set_mobility(*connector, *mobility),
            What::MaxBend { connector, max_bend_rad } => {
                chain.set_max_bend_rad(*connector, *max_bend_rad)
            }
            What::Scatter { .. } | What::Reform { .. } => Ok(()),
        };
        done.expect("a change was checked when the scenario was compiled");
    }
}

impl<const D: usize> ChainSpec<D> {
    /// The robots of a swarm at their connectors, all looking ahead of their chain.
    pub(crate) fn robots_at(&self, points: &[Point<D>], driving: &Driving) -> Vec<Robot> {
        let [x, y, _] = driving.ahead;
        let heading_rad = atan2(y, x);
        let robot = |p: &Point<D>| Robot {
            pose: Pose { at: in_dimensions(*p), heading_rad },
            is_bumped: false,
        };
        self.robots.iter().flat_map(|_| points.iter().map(robot)).collect()
    }

    pub(crate) fn robot_radius_m(&self) -> f64 {
        self.robots.as_ref().map_or(0.0, |robots| robots.follower.ring.radius_m)
    }

    /// The motions of the script that a driver is in; none where it is in no script.
    pub(crate) fn motions(&self, driving: &Driving) -> Result<Vec<Motion>, InputError> {
        match self.tasks.get(driving.task as usize).map(|task| &task.driver) {
            Some(Driver::Script(script)) => driving.motions(script),
            _ => Ok(Vec::new()),
        }
    }
}

impl<const D: usize> ChainWorld<D> {
    /// Seconds from the start to the begin of a cycle.
    pub fn starts_s(&self, now: Cycle) -> f64 {
        now as f64 * self.dt_s
    }
}

/// The parts of a chain as obstacles to others.
pub(crate) fn push_parts<const D: usize>(
    parts: &mut Vec<Obstacle<D>>,
    slot: Slot,
    chain: &Chain<D>,
) {
    let (id, points) = (OTHER_CHAIN + slot, chain.points());
    let connectors = points.iter().zip(chain.connectors());
    parts.extend(connectors.map(|(at, connector)| Obstacle::ball(id, *at, connector.radius_m)));
    let rods = points.windows(2).zip(chain.rods());
    parts.extend(rods.map(|(ends, rod)| Obstacle::capsule(id, [ends[0], ends[1]], rod.radius_m)));
}
