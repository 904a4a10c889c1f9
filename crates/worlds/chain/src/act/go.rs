//! One motion of an initiator, and the reaction to a veto.

use super::Acting;
use crate::driver::{Driver, Objection, Task};
use crate::events::{Event, EventKind};
use crate::metrics::GivenUp;
use crate::motion::replan::{Climbed, Ladder, Situation};
use crate::rods::geometry::{Point, distance, first_axis, in_dimensions, norm, sub, unit};
use crate::rods::obstacle::Obstacle;
use crate::rods::veto::{Mode, Motion, Moved, Reason, Request, Veto};
use crate::world::purpose;
use sidestep_kernel::distr::normal;

/// Extra distance, beyond a chain's own look, at which a moving obstacle may still come near,
/// meters.
const MOVER_NEAR_M: f64 = 1.0;

/// Whether an initiator went where it wanted, or near it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Went {
    Ahead,
    Nowhere,
}

impl<const D: usize> Acting<'_, D> {
    /// Moves the initiator, as it wants or as the ladder allows.
    pub(super) fn go(&mut self, task: &Task<D>, to: Point<D>) -> Went {
        let at = self.body.chain.points()[task.agent];
        let climbed = match self.puts_off {
            true => Some(self.lead(task, to)),
            false if self.is_team() => self.climb_as_team(task, to),
            false => Some(self.climb(task, to)),
        };
        let climbed = climbed.map(|climbed| self.joints_climb(task, to, climbed));
        self.note(|notes| notes.climbed.clone_from(&climbed));
        let way = sub(self.body.chain.points()[task.agent], at);
        self.body.driving.way_m.wanted += distance(at, to);
        self.body.driving.way_m.gone += norm(way);
        self.body.tally.way_m += norm(way);
        // A chain that stands because somebody is lost does not lose its patience.
        let Some(climbed) = climbed else { return Went::Nowhere };
        self.take_note(task, &climbed, way)
    }

    /// Requests a motion of the whole chain.
    fn climb(&mut self, task: &Task<D>, to: Point<D>) -> Climbed<D> {
        let motion = Motion::Connector { k: task.agent, to };
        let request = Request { motion, source: task.source(), mode: Mode::Exact };
        let situation = self.situation(task);
        let memory = std::mem::take(&mut self.body.driving.ladder);
        let mut ladder = Ladder { rungs: self.world.rungs, memory };
        let climbed = ladder.climb_told(
            &mut self.body.chain,
            &self.scratch.obstacles,
            &mut self.scratch.propagator,
            &request,
            &situation,
        );
        self.body.driving.ladder = ladder.memory;
        let beyond = self.beyond(task.agent);
        let (climbed, objection) = climbed.unwrap_or((Climbed::Vetoed(beyond), Some(beyond)));
        if let Some(veto) = &objection {
            self.vetoed(veto);
        }
        climbed
    }

    /// Returns the objection of an initiator that would leave the range of coordinates.
    pub(super) fn beyond(&self, by: usize) -> Veto<D> {
        let reached = self.body.chain.points()[by];
        Veto { by, from: by, reason: Reason::Limit, obstacle: None, reached }
    }

    /// Returns the distance of an initiator from its target, if it has one.
    pub(super) fn goal_distance_m(&self, task: &Task<D>) -> Option<f64> {
        let Driver::Targets(targets) = &task.driver else { return None };
        let place = targets.places.get(self.body.driving.next as usize);
        place.map(|place| distance(self.body.chain.points()[task.agent], *place))
    }

    /// Lets the initiator wait while the chain needs all its speed to get out of the way.
    pub(super) fn give_way(&mut self, task: &Task<D>) {
        let way_m = task.speed_m_s * self.world.dt_s;
        self.body.driving.way_m.wanted += way_m;
        let n = self.body.driving.idle.saturating_add(1);
        self.take_note(task, &Climbed::Waiting { n }, [0.0; D]);
    }

    /// Returns an initiator's knowledge beside its neighborhood.
    pub(super) fn situation(&self, task: &Task<D>) -> Situation {
        let at = self.body.chain.points()[task.agent];
        let near_m = self.world.look_m + MOVER_NEAR_M;
        let is_near =
            |o: &Obstacle<D>| o.core.nearest_to_point(at).distance_m - o.radius_m < near_m;
        let goal_distance_m = self.goal_distance_m(task);
        let (can_turn, keeps_heading) = match &task.driver {
            Driver::Navigate(navigator) => (navigator.can_turn_on_the_spot(), true),
            _ => (false, false),
        };
        let movers_near = self.scratch.obstacles.moving().iter().any(is_near);
        Situation { goal_distance_m, movers_near, can_turn, keeps_heading }
    }

    /// Counts the result of a motion; returns whether the initiator moved.
    fn take_note(&mut self, task: &Task<D>, climbed: &Climbed<D>, way: Point<D>) -> Went {
        self.body.tally.rungs.count(climbed);
        let went = match climbed {
            Climbed::Straight(moved) => {
                (self.body.driving.idle, self.body.driving.told) = (0, None);
                self.moved(moved, way);
                return Went::Ahead;
            }
            Climbed::Shorter { moved, .. } => {
                self.moved(moved, way);
                Went::Ahead
            }
            Climbed::Sideways { moved, turn_rad, .. } => {
                self.tell_once(EventKind::Sideways, task.agent, *turn_rad);
                self.moved(moved, way);
                Went::Ahead
            }
            Climbed::PulledBack { by, moved } => {
                self.tell_once(EventKind::PulledBack, *by, 0.0);
                self.moved(moved, [0.0; D]);
                Went::Nowhere
            }
            Climbed::Stuck { .. } => {
                self.tell_once(EventKind::Stuck, task.agent, 0.0);
                self.look_elsewhere(task);
                Went::Nowhere
            }
            Climbed::TurnOnTheSpot { .. } | Climbed::Waiting { .. } | Climbed::Vetoed(_) => {
                Went::Nowhere
            }
        };
        self.body.driving.idle = match went {
            Went::Ahead => 0,
            Went::Nowhere => self.body.driving.idle.saturating_add(1),
        };
        self.lose_patience(task);
        went
    }

    /// Reports only the first of several events of one kind between two motions that went as
    /// wanted.
    fn tell_once(&mut self, kind: EventKind, connector: usize, value: f64) {
        if self.body.driving.told != Some(kind) {
            self.body.driving.told = Some(kind);
            self.tell(kind, connector, value);
        }
    }

    /// Lets a wandering initiator that is stuck go on in any direction.
    fn look_elsewhere(&mut self, task: &Task<D>) {
        if matches!(task.driver, Driver::Wander(_)) {
            let draws = &mut self.world.streams.draws(self.slot, self.now, purpose::TURN_AWAY);
            let any: Point<D> = std::array::from_fn(|_| normal(draws));
            let ahead: Point<D> = unit(any).unwrap_or(first_axis());
            self.body.driving.ahead = in_dimensions(ahead);
        }
    }

    fn moved(&mut self, moved: &Moved<D>, way: Point<D>) {
        if let Some(ahead) = unit(way) {
            self.body.driving.ahead = in_dimensions(ahead);
        }
        self.body.tally.add_moved(moved);
    }

    /// Counts a veto; of several in a row by one connector for one reason only the first is an
    /// event.
    pub(super) fn vetoed(&mut self, veto: &Veto<D>) {
        self.body.tally.add_veto(veto.reason);
        self.note(|notes| notes.vetoes.push(*veto));
        let objection = Some(Objection { by: veto.by as u32, reason: veto.reason });
        let driving = &self.body.driving;
        if driving.told.is_none() || driving.objection != objection {
            let way_m = distance(veto.reached, self.scratch.before[veto.from]);
            let event = self.event(EventKind::Veto, veto.by, way_m);
            let (reason, obstacle) = (Some(veto.reason), veto.obstacle);
            self.scratch.events.push(Event { reason, obstacle, ..event });
            self.body.driving.told = self.body.driving.told.or(Some(EventKind::Veto));
        }
        self.body.driving.objection = objection;
        self.is_told(veto);
    }

    /// Gives up a task that made no progress for too long. Around a target there is always some way
    /// to go, so there the time counts in which none of them led nearer.
    fn lose_patience(&mut self, task: &Task<D>) {
        let tried = self.body.driving.idle.max(self.body.driving.late);
        if self.world.starts_s(u64::from(tried)) <= task.patience_s {
            return;
        }
        let objection = self.body.driving.objection;
        let reason = objection.map(|objection| objection.reason);
        let undone = match &task.driver {
            Driver::Targets(targets) => 1.0 / targets.places.len() as f64,
            _ => 1.0 - self.world.part_done(self.body, task),
        };
        self.body.tally.given_up.push(GivenUp {
            task: self.body.driving.task,
            part: self.body.driving.next,
            nearest_m: self.body.driving.nearest_m,
            undone,
            by: objection.map(|objection| objection.by),
            reason: reason.map(|reason| reason.name().into()),
        });
        match task.driver {
            Driver::Targets(_) => {
                let by = objection.map_or(task.agent, |objection| objection.by as usize);
                let target = f64::from(self.body.driving.next);
                let event = self.event(EventKind::TargetGivenUp, by, target);
                self.scratch.events.push(Event { reason, ..event });
                self.body.plan = None;
                self.body.driving.next_part();
            }
            _ => self.next_task(EventKind::GivenUp),
        }
    }
}
