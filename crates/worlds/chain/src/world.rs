//! A compiled world of chains: everything that never changes during a run.

use super::act::Step;
use super::arms::arm::Arm;
use super::driver::{Driver, Driving, Task};
use super::events::Event;
use super::formation::{Robot, Robots};
use super::ground::Movers;
use super::motion::escape::{Escape, Escaper};
use super::motion::replan::Rungs;
use super::navigate::{Solid, lifted, plane_point};
use super::rods::chain::{Chain, Mobility};
use super::rods::geometry::{Bounds, Point, norm};
use super::rods::obstacle::{Obstacle, Obstacles};
use super::rods::propagate::Propagator;
use super::rods::rebuild::MayCome;
use super::rods::rules::Rules;
use super::script::Motion;
use super::state::{Body, ChainState};
use super::swarm::drive::Pose;
use super::swarm::laser::{Body as Seen, Scan};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::math::atan2;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::world::Decides;
use sidestep_kernel::{Cycle, InputError, Phases, Slot, Turn};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// What random draws of this world are for.
pub mod purpose {
    use sidestep_kernel::stream::Purpose;

    /// How a wandering initiator turns.
    pub const WANDER: Purpose = Purpose(2);
    /// Where the parts of a broken chain lie.
    pub const SCATTER: Purpose = Purpose(3);
    /// Where a wandering initiator goes that is stuck.
    pub const TURN_AWAY: Purpose = Purpose(5);
    /// Errors of a laser.
    pub const LASER: Purpose = Purpose(4);
}

/// Nothing is thrown further than so many standard deviations.
pub(super) const FARTHEST_THROW: f64 = 8.0;

/// From this id on, obstacles are parts of other chains: its number is added.
pub const OTHER_CHAIN: u32 = 1 << 31;

/// The immutable world that runs share.
#[derive(Debug, Clone)]
pub struct ChainWorld<const D: usize> {
    /// The chains by id.
    pub chains: Vec<ChainSpec<D>>,
    /// Obstacles that stand still.
    pub obstacles: Obstacles<D>,
    /// Obstacles that move.
    pub movers: Movers<D>,
    /// What a cycle takes.
    pub dt_s: f64,
    /// Cycles that a run has: what an endless task is measured by.
    pub cycles: Cycle,
    /// How chains react.
    pub rules: Rules,
    /// How they get out of the way of what moves, if they do.
    pub escape: Option<Escape>,
    /// How long initiators try on each rung of the ladder after a veto.
    pub rungs: Rungs,
    /// How far around its parts a chain looks for its least distance from obstacles.
    pub look_m: f64,
    pub(super) streams: Streams,
}

/// One chain, and what it is to do.
#[derive(Debug, Clone)]
pub struct ChainSpec<const D: usize> {
    /// Its name, may be empty.
    pub name: String,
    /// The chain at the start.
    pub start: Chain<D>,
    /// What its initiators do, one task after the other; at least one.
    pub tasks: Vec<Task<D>>,
    /// What happens to it, by cycle.
    pub changes: Vec<Change<D>>,
    /// The arm that it stands for, if it stands for one.
    pub arm: Option<Arc<Arm>>,
    /// How the robots behave that keep to its connectors, if it is a swarm on wheels.
    pub robots: Option<Robots>,
}

/// Something that happens to a chain at the begin of a cycle (slides R8, R10, F3).
#[derive(Debug, Clone, PartialEq)]
pub struct Change<const D: usize> {
    /// The cycle.
    pub cycle: Cycle,
    /// What happens.
    pub what: What<D>,
}

/// What happens to a chain.
#[derive(Debug, Clone, PartialEq)]
pub enum What<const D: usize> {
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
    fn throws_m(&self, now: Cycle) -> f64 {
        match &self.what {
            What::Scatter { by_m, apart_m, .. } if self.cycle == now => {
                FARTHEST_THROW * by_m + norm(*apart_m)
            }
            _ => 0.0,
        }
    }

    /// Applies what is a constraint.
    pub(super) fn constrain(&self, chain: &mut Chain<D>) {
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
    pub(super) fn robots_at(&self, points: &[Point<D>], driving: &Driving) -> Vec<Robot> {
        let [x, y, _] = driving.ahead;
        let heading_rad = atan2(y, x);
        let robot = |p: &Point<D>| Robot {
            pose: Pose { at: plane_point(*p), heading_rad },
            is_bumped: false,
        };
        self.robots.iter().flat_map(|_| points.iter().map(robot)).collect()
    }

    pub(super) fn robot_radius_m(&self) -> f64 {
        self.robots.as_ref().map_or(0.0, |robots| robots.follower.ring.radius_m)
    }

    /// The motions of the script that a driver is in; none where it is in no script.
    pub(super) fn motions(&self, driving: &Driving) -> Result<Vec<Motion>, InputError> {
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

    /// The box in which a chain may come to be during one cycle: nobody of it leaves that box.
    fn reach(&self, spec: &ChainSpec<D>, body: &Body<D>, now: Cycle) -> Bounds<D> {
        let chain = &body.chain;
        let radius_m = chain.connectors().iter().map(|c| c.radius_m).fold(0.0, f64::max);
        let longest_m = chain.rods().iter().map(|r| r.max_m).fold(0.0, f64::max);
        let fastest_m_s = spec.tasks.iter().map(|t| t.speed_m_s).fold(0.0, f64::max);
        let way_m = match &self.escape {
            Some(escape) => escape.speed_max_m_s * self.dt_s,
            // Who turns round what is in its way goes as far as its rod reaches to both sides.
            None => 2.0 * longest_m.min(self.rules.slave_step_max_m) + fastest_m_s * self.dt_s,
        };
        let thrown_m = spec.changes.iter().map(|change| change.throws_m(now)).fold(0.0, f64::max);
        let back_m = body.scattered.as_ref().map_or(0.0, |s| s.speed_m_s * self.dt_s);
        Bounds::of(chain.points()).grown(radius_m + way_m + thrown_m + back_m)
    }

    /// The part of its tasks that a chain has done, from 0 to 1. Several tasks count alike; what
    /// was given up is not done.
    pub fn progress(&self, slot: usize, body: &Body<D>) -> f64 {
        let tasks = &self.chains[slot].tasks;
        let part = tasks.get(body.driving.task as usize).map(|task| self.part_done(body, task));
        let undone: f64 = body.tally.given_up.iter().map(|what| what.undone).sum();
        let done = f64::from(body.driving.task) + part.unwrap_or(0.0) - undone;
        (done / tasks.len() as f64).clamp(0.0, 1.0)
    }

    /// The part of its present task that an initiator is through with: of scripts by motions, of
    /// targets by targets, of tasks that take a time by time; of going anywhere the part that was
    /// gone of the way that its speed allows in the whole run; of resting the part of the run.
    pub(super) fn part_done(&self, body: &Body<D>, task: &Task<D>) -> f64 {
        let part = match &task.driver {
            _ if task.lasts_s.is_finite() => self.starts_s(body.driving.cycles) / task.lasts_s,
            Driver::Rest => body.driving.cycles as f64 / self.cycles.max(1) as f64,
            Driver::Wander(_) => self.way_part(body, task),
            Driver::Script(_) => f64::from(body.driving.next) / body.motions.len().max(1) as f64,
            Driver::Targets(targets) => {
                f64::from(body.driving.next) / targets.places.len().max(1) as f64
            }
            Driver::Navigate(navigator) => match &navigator.goal {
                Some(goal) => {
                    let start = plane_point(body.driving.start[0]);
                    goal.progress(body.driving.next as usize, start, body.driving.nearest_m)
                }
                None => self.way_part(body, task),
            },
        };
        part.clamp(0.0, 1.0)
    }

    fn way_part(&self, body: &Body<D>, task: &Task<D>) -> f64 {
        body.driving.way_m[1] / (task.speed_m_s * self.starts_s(self.cycles.max(1)))
    }

    /// Whether all tasks of all chains are done and everything is whole.
    pub(super) fn all_is_done(&self, state: &ChainState<D>) -> bool {
        self.chains.iter().enumerate().all(|(slot, spec)| {
            let body = state.body(slot);
            let is_done = body.driving.task as usize >= spec.tasks.len();
            is_done && body.scattered.is_none()
        })
    }
}

/// What a worker keeps between tasks.
#[derive(Debug, Clone)]
pub struct Scratch<const D: usize> {
    pub(super) propagator: Propagator<D>,
    pub(super) escaper: Option<Escaper<D>>,
    /// The world's obstacles, with those that move where they are at the begin of `moment`, and
    /// the parts of other chains.
    pub(super) obstacles: Obstacles<D>,
    /// The same without other chains, where there are any.
    solid: Obstacles<D>,
    moment: Option<Cycle>,
    /// Obstacles that move, and parts of other chains.
    guests: Vec<Obstacle<D>>,
    has_others: bool,
    /// Robots around a robot.
    pub(super) seen: Vec<Seen>,
    pub(super) scan: Scan,
    /// Positions before a cycle.
    pub(super) before: Vec<Point<D>>,
    /// The least air around a robot in this cycle.
    pub(super) robots_gap_m: f64,
    /// Positions after parts got out of the way.
    pub(super) escaped: Vec<Point<D>>,
    /// What happened.
    pub(super) events: Vec<Event>,
}

impl<const D: usize> Scratch<D> {
    /// Puts the movers where they are at the begin of cycle `moment`, and other chains where they
    /// are now.
    pub(super) fn gather(
        &mut self,
        world: &ChainWorld<D>,
        state: &ChainState<D>,
        moment: Cycle,
        others: impl Iterator<Item = Slot>,
    ) {
        const CHECKED: &str = "movers and chains were checked when the scenario was compiled";
        let mut others = others.peekable();
        let has_others = others.peek().is_some();
        if self.moment == Some(moment) && !self.has_others && !has_others {
            return;
        }
        self.guests.clear();
        let movers = world.movers.at(world.starts_s(moment));
        self.guests.extend(movers.filter(Obstacle::is_in_range));
        let movers = self.guests.len();
        let others: Vec<Slot> = others.collect();
        if has_others {
            others.iter().for_each(|&slot| push_robots(&mut self.guests, slot, state));
            self.solid.set_moving(&self.guests).expect(CHECKED);
            self.guests.truncate(movers);
        }
        for slot in others {
            push_parts(&mut self.guests, slot, &state.body(slot as usize).chain);
        }
        self.obstacles.set_moving(&self.guests).expect(CHECKED);
        (self.moment, self.has_others) = (Some(moment), has_others);
    }

    /// What is solid to robots: other chains are their robots, not their rods.
    pub(super) fn solid(&self) -> &Obstacles<D> {
        if self.has_others { &self.solid } else { &self.obstacles }
    }
}

/// What of a chain robots can touch: its robots, or its parts where it has none.
fn push_robots<const D: usize>(parts: &mut Vec<Obstacle<D>>, slot: Slot, state: &ChainState<D>) {
    let body = state.body(slot as usize);
    if body.robots.is_empty() {
        return push_parts(parts, slot, &body.chain);
    }
    let solid = |solid: Solid| Obstacle::ball(OTHER_CHAIN + slot, lifted(solid.at), solid.radius_m);
    parts.extend(body.solids().map(|(_, robot)| solid(robot)));
}

/// The parts of a chain as obstacles to others.
pub(super) fn push_parts<const D: usize>(
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

impl<const D: usize> Phases for ChainWorld<D> {
    const DECIDES: Decides = Decides::Together;

    type State = ChainState<D>;
    type Scratch = Scratch<D>;

    fn scratch(&self) -> Scratch<D> {
        Scratch {
            propagator: Propagator::new(self.rules),
            escaper: self.escape.map(Escaper::new),
            obstacles: self.obstacles.clone(),
            solid: self.obstacles.clone(),
            moment: None,
            guests: Vec::new(),
            has_others: false,
            seen: Vec::new(),
            scan: Scan::default(),
            before: Vec::new(),
            robots_gap_m: f64::INFINITY,
            escaped: Vec::new(),
            events: Vec::new(),
        }
    }

    fn bodies(&self, state: &ChainState<D>) -> usize {
        state.len()
    }

    fn claim(turn: &mut Turn<'_, Self>, bodies: std::ops::Range<usize>) {
        let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
        for slot in bodies {
            let claim = world.reach(&world.chains[slot], &state.body(slot), now);
            state.set_claim(slot, claim);
            let decision = world.look_around(state, (slot as Slot, now), scratch);
            state.set_decision(slot, decision);
        }
    }

    fn join(turn: &mut Turn<'_, Self>, bodies: std::ops::Range<usize>, groups: &Groups) {
        let state = turn.state;
        for slot in bodies {
            let claim = state.claim(slot);
            for other in (0..slot).filter(|&other| state.claim(other).meets(&claim)) {
                groups.join(slot as Slot, other as Slot);
            }
        }
    }

    fn act(turn: &mut Turn<'_, Self>, group: &mut [Slot]) {
        let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
        group.sort_unstable();
        for &slot in &*group {
            let claim = state.claim(slot as usize);
            let meets = |s: &Slot| *s != slot && state.claim(*s as usize).meets(&claim);
            scratch.gather(world, state, now + 1, group.iter().copied().filter(meets));
            let decision = state.decision(slot as usize);
            let step = Step { spec: &world.chains[slot as usize], slot, now, decision };
            let mut body = state.body_mut(slot as usize);
            world.act(&mut body, step, &claim, scratch);
        }
    }
}
