//! An initiator on wheels that finds its way with a laser: where the swarm's leader meets this
//! world (slides N1 to N6).

use super::act::Step;
use super::driver::{Driver, Task};
use super::rods::geometry::{Point, distance, unit};
use super::rods::obstacle::Obstacles;
use super::state::{Body, ChainState};
use super::swarm::drive::{Drive, Pose};
use super::swarm::laser::Body as Seen;
use super::swarm::leader::{Decision, Leader, LeaderState, Percept, Surroundings, Turning};
use super::world::{ChainWorld, Scratch, purpose};
use sidestep_kernel::math::{atan2, cos, sin};
use sidestep_kernel::{Cycle, Slot};
use std::any::Any;

/// The end of a line counts as reached so far before it, meters.
const BEFORE_THE_END_M: f64 = 0.5;

/// An initiator that navigates.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigator {
    /// How it behaves.
    pub leader: Leader,
    /// Its wheels.
    pub drive: Drive,
    /// Where it is to come; without a goal it goes on and on.
    pub goal: Option<Goal>,
}

/// Where a navigator is to come.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// To a place that it can detect.
    Target {
        /// The place.
        at: Point<2>,
        /// How near counts as there.
        tolerance_m: f64,
    },
    /// To the end of a line, such as the middle of a corridor, which it does not know of.
    EndOf(Vec<Point<2>>),
}

impl Navigator {
    /// Whether it may turn without going.
    pub(super) fn can_turn_on_the_spot(&self) -> bool {
        self.leader.turning == Turning::OnTheSpotWhereBlocked
    }
}

impl Goal {
    /// What the leader can detect.
    fn target(&self) -> Option<Point<2>> {
        match self {
            Self::Target { at, .. } => Some(*at),
            Self::EndOf(_) => None,
        }
    }

    /// The point of the line that a navigator at `at` has come to, if it was at `index`.
    fn passed(&self, at: Point<2>, index: usize) -> usize {
        let Self::EndOf(line) = self else { return index };
        let nearer = |i: usize| distance(line[i + 1], at) <= distance(line[i], at);
        (index..line.len() - 1).find(|&i| !nearer(i)).unwrap_or(line.len() - 1)
    }

    fn is_reached(&self, at: Point<2>, index: usize) -> bool {
        match self {
            Self::Target { at: target, tolerance_m } => distance(at, *target) <= *tolerance_m,
            Self::EndOf(line) => distance(line[index], line[line.len() - 1]) <= BEFORE_THE_END_M,
        }
    }

    /// The part of the way that is done: by the points of a line, or by what is left to a target
    /// compared with what was left at the start.
    pub(super) fn progress(&self, index: usize, start: Point<2>, nearest_m: f64) -> f64 {
        match self {
            Self::Target { at, .. } if nearest_m.is_finite() => {
                1.0 - nearest_m / distance(start, *at).max(nearest_m).max(1e-9)
            }
            Self::Target { .. } => 0.0,
            Self::EndOf(line) => index as f64 / (line.len() - 1).max(1) as f64,
        }
    }
}

/// What a navigator perceives at the begin of a cycle.
pub(super) struct Sight<'a> {
    pub(super) navigator: &'a Navigator,
    /// The connector that it is.
    pub(super) agent: usize,
    pub(super) leader: LeaderState,
    pub(super) percept: Percept,
}

/// The obstacles of a plane world; none where `D` is not 2.
pub(super) fn in_plane<const D: usize>(obstacles: &Obstacles<D>) -> Option<&Obstacles<2>> {
    (obstacles as &dyn Any).downcast_ref()
}

/// The first two coordinates.
pub(super) fn plane_point<const D: usize>(p: Point<D>) -> Point<2> {
    [p[0], p[1]]
}

/// The other way round.
pub(super) fn lifted<const D: usize>(p: Point<2>) -> Point<D> {
    std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0))
}

impl<const D: usize> ChainWorld<D> {
    /// What a navigator perceives and decides; none of other drivers.
    pub(super) fn look_around(
        &self,
        state: &ChainState<D>,
        (slot, now): (Slot, Cycle),
        scratch: &mut Scratch<D>,
    ) -> Option<Decision> {
        let sight = self.sight(state, (slot, now), scratch)?;
        Some(sight.navigator.leader.decide(sight.leader.followed, &sight.percept))
    }

    /// What a navigator perceives; its laser's ranges are in the scratch. Everybody else is where
    /// they are at the begin of the cycle.
    pub(super) fn sight(
        &self,
        state: &ChainState<D>,
        (slot, now): (Slot, Cycle),
        scratch: &mut Scratch<D>,
    ) -> Option<Sight<'_>> {
        let body = state.body(slot as usize);
        let task = self.chains[slot as usize].tasks.get(body.driving.task as usize)?;
        let Driver::Navigate(navigator) = &task.driver else { return None };
        let leader = body.driving.leader.unwrap_or_else(|| leader_state(&body, task));
        drop(body);
        let range_m = navigator.leader.laser.range_m();
        let mut seen = std::mem::take(&mut scratch.seen);
        seen.clear();
        for other in 0..state.len() {
            let body = state.body(other);
            let is_own = other == slot as usize;
            body.solids().filter(|(k, _)| !(is_own && *k == task.agent)).for_each(|(_, solid)| {
                if distance(leader.pose.at, solid.at) - solid.radius_m <= range_m {
                    seen.push(solid.as_seen());
                }
            });
        }
        scratch.gather(self, state, now, std::iter::empty());
        let noise = &mut self.streams.draws(slot, now, purpose::LASER);
        let Scratch { obstacles, scan, .. } = scratch;
        let target = navigator.goal.as_ref().and_then(Goal::target);
        let around = Surroundings { obstacles: in_plane(obstacles)?, bodies: &seen, target };
        let percept = navigator.leader.perceive(&leader.pose, &around, noise, scan);
        scratch.seen = seen;
        Some(Sight { navigator, agent: task.agent, leader, percept })
    }

    /// Where its wheels would take a navigator.
    pub(super) fn steered(
        &self,
        body: &mut Body<D>,
        task: &Task<D>,
        navigator: &Navigator,
        turn: Step<'_, D>,
    ) -> Option<Pose> {
        let decision = turn.decision?;
        let mut leader = body.driving.leader.unwrap_or_else(|| leader_state(body, task));
        leader.followed = decision.followed;
        body.driving.leader = Some(leader);
        body.tally.layers[decision.layer as usize - 1] += 1;
        let wheels = decision.wheels.slowed(self.pace(body, turn));
        Some(navigator.drive.step(leader.pose, wheels, self.dt_s))
    }

    /// A navigator that has moved, by a heading that the chain did not object to.
    pub(super) fn has_steered(
        &self,
        body: &mut Body<D>,
        task: &Task<D>,
        navigator: &Navigator,
        heading_rad: f64,
    ) {
        let at = plane_point(body.chain.points()[task.agent]);
        let Some(leader) = &mut body.driving.leader else { return };
        leader.pose = Pose { at, heading_rad };
        body.driving.ahead = [cos(heading_rad), sin(heading_rad), 0.0];
        if let Some(goal) = &navigator.goal {
            body.driving.next = goal.passed(at, body.driving.next as usize) as u32;
            if let Goal::Target { at: target, .. } = goal {
                body.driving.nearest_m = body.driving.nearest_m.min(distance(at, *target));
            }
        }
    }

    /// A navigator whose way is blocked turns, if it can, where it stands.
    pub(super) fn turn_where_blocked(
        &self,
        body: &mut Body<D>,
        task: &Task<D>,
        navigator: &Navigator,
        turn: Step<'_, D>,
    ) {
        let (Some(leader), Some(decision)) = (body.driving.leader, turn.decision) else { return };
        let wheels = navigator.leader.when_blocked(decision.wheels);
        let turned = navigator.drive.step(leader.pose, wheels, self.dt_s);
        self.has_steered(body, task, navigator, turned.heading_rad);
    }

    /// Whether a navigator has come where it is to come.
    pub(super) fn has_arrived(body: &Body<D>, task: &Task<D>, navigator: &Navigator) -> bool {
        let at = plane_point(body.chain.points()[task.agent]);
        let index = body.driving.next as usize;
        navigator.goal.as_ref().is_some_and(|goal| goal.is_reached(at, index))
    }

    /// A place in the plane, in as many dimensions as there are.
    pub(super) fn place(at: Point<2>) -> Point<D> {
        lifted(at)
    }
}

/// A leader at its connector that looks ahead.
fn leader_state<const D: usize>(body: &Body<D>, task: &Task<D>) -> LeaderState {
    let [x, y, _] = body.driving.ahead;
    let [x, y] = unit([x, y]).unwrap_or([1.0, 0.0]);
    let at = plane_point(body.chain.points()[task.agent]);
    LeaderState::at(Pose { at, heading_rad: atan2(y, x) })
}

/// A round solid thing in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solid {
    pub(super) at: Point<2>,
    pub(super) radius_m: f64,
}

impl Solid {
    pub(super) fn as_seen(&self) -> Seen {
        Seen::disc(self.at, self.radius_m)
    }
}
