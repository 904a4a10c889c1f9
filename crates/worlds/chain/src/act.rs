//! Pool two: what one chain does in a cycle.

use super::driver::{Driver, Task, in_space, out_of_space, towards, wander};
use super::events::{Event, EventKind};
use super::metrics::GivenUp;
use super::motion::replan::{Climbed, Ladder, Situation};
use super::navigate::plane_point;
use super::rods::geometry::{Bounds, distance, first_axis, norm, sub, unit};
use super::rods::obstacle::Obstacle;
use super::rods::veto::{Mode, Motion, Moved, Reason, Request, Veto};
use super::script::Motion as ScriptMotion;
use super::state::Body;
use super::swarm::drive::Pose;
use super::swarm::leader::Decision;
use super::world::{ChainWorld, Scratch, purpose};
use super::{geometry::Point, world::ChainSpec};
use sidestep_kernel::distr::normal;
use sidestep_kernel::{Cycle, Slot};

/// What a driver wants in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wish<const D: usize> {
    /// Nothing.
    Rest,
    /// The initiator elsewhere.
    Go(Point<D>),
    /// The same of a robot on wheels.
    Steer(Pose),
    /// Its task is done.
    Done,
}

/// Whether an initiator went where it wanted, or near it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Went {
    Ahead,
    Nowhere,
}

/// Ways of exactly the greatest speed may seem longer by this part.
const ROUNDING: f64 = 1e-9;
/// What moves so much further away than a chain looks may still come near.
const MOVER_NEAR_M: f64 = 1.0;

/// A chain in a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step<'a, const D: usize> {
    pub(super) spec: &'a ChainSpec<D>,
    pub(super) slot: Slot,
    pub(super) now: Cycle,
    /// What its navigator has decided.
    pub(super) decision: Option<Decision>,
}

impl<const D: usize> Step<'_, D> {
    /// An event of this chain.
    pub(super) fn event(&self, kind: EventKind, connector: usize, value: f64) -> Event {
        let (cycle, chain, connector) = (self.now, self.slot, connector as u32);
        Event { cycle, chain, kind, connector, reason: None, obstacle: None, value }
    }
}

impl<const D: usize> ChainWorld<D> {
    /// One cycle of one chain, which stays in its claim.
    pub(super) fn act(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        claim: &Bounds<D>,
        scratch: &mut Scratch<D>,
    ) {
        self.change(body, turn, scratch);
        scratch.before.clear();
        scratch.before.extend_from_slice(body.chain.points());
        scratch.escaped.clone_from(&scratch.before);
        if body.scattered.is_some() {
            self.come_together(body, turn, scratch);
        } else {
            self.get_out_of_the_way(body, turn, scratch);
            self.drive(body, turn, scratch);
            self.keep_to_bounds(body, turn, claim, scratch);
        }
        scratch.robots_gap_m = f64::INFINITY;
        self.follow(body, turn, scratch);
        self.measure(body, turn, scratch);
    }

    /// Parts that something comes too near to move away, whoever leads.
    fn get_out_of_the_way(&self, body: &mut Body<D>, turn: Step<'_, D>, scratch: &mut Scratch<D>) {
        let Some(escaper) = &mut scratch.escaper else { return };
        let escaped = escaper.escape(
            &mut body.chain,
            &scratch.obstacles,
            &mut scratch.propagator,
            &scratch.before,
        );
        // Out of the world nobody escapes.
        let Ok(escaped) = escaped else { return };
        body.tally.escapes.add(&escaped);
        scratch.escaped.copy_from_slice(body.chain.points());
        self.take_leader_along(body, turn);
        if let Some((connector, obstacle)) = escaped.first.filter(|_| !body.tally.is_escaping) {
            let event = turn.event(EventKind::Escape, connector, escaped.moves as f64);
            scratch.events.push(Event { obstacle: Some(obstacle), ..event });
        }
        body.tally.is_escaping = escaped.moves > 0;
    }

    /// What would leave the claim is taken back, for nobody else counts on the chain there; and so
    /// is what would be faster than escapes may be, together with them.
    fn keep_to_bounds(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        claim: &Bounds<D>,
        scratch: &mut Scratch<D>,
    ) {
        let most_m = match &self.escape {
            Some(escape) => escape.speed_max_m_s * self.dt_s * (1.0 + ROUNDING),
            None if self.chains.len() == 1 => return,
            None => f64::INFINITY,
        };
        let is_beyond = |(p, was): (&Point<D>, &Point<D>)| {
            distance(*p, *was) > most_m || !claim.meets(&Bounds::of(&[*p]))
        };
        let mut ways = body.chain.points().iter().zip(&scratch.before);
        let Some(by) = ways.position(is_beyond) else { return };
        body.chain.points_mut().copy_from_slice(&scratch.escaped);
        let from = turn.spec.tasks.get(body.driving.task as usize).map_or(0, |task| task.agent);
        let reached = body.chain.points()[from];
        self.take_leader_along(body, turn);
        let veto = Veto { by, from, reason: Reason::StepLimit, obstacle: None, reached };
        self.vetoed(body, turn, &veto, scratch);
    }

    /// A leader on wheels is where its connector is, wherever that was moved to.
    fn take_leader_along(&self, body: &mut Body<D>, turn: Step<'_, D>) {
        let agent = turn.spec.tasks.get(body.driving.task as usize).map(|task| task.agent);
        if let (Some(leader), Some(agent)) = (&mut body.driving.leader, agent) {
            leader.pose.at = plane_point(body.chain.points()[agent]);
        }
    }

    /// The present task, for one cycle.
    fn drive(&self, body: &mut Body<D>, turn: Step<'_, D>, scratch: &mut Scratch<D>) {
        let Some(task) = turn.spec.tasks.get(body.driving.task as usize) else { return };
        let is_late = self.starts_s(body.driving.cycles + 1) >= task.lasts_s;
        body.driving.cycles += 1;
        match self.wish(body, task, turn, scratch) {
            Wish::Rest => {}
            Wish::Go(to) => {
                self.go(body, (task, to), turn, scratch);
            }
            Wish::Steer(pose) => self.go_on_wheels(body, (task, pose), turn, scratch),
            Wish::Done => return self.next_task(body, turn, EventKind::Done, scratch),
        }
        if is_late {
            self.next_task(body, turn, EventKind::Done, scratch);
        }
    }

    /// Where the initiator wants to be at the end of the cycle.
    fn wish(
        &self,
        body: &mut Body<D>,
        task: &Task<D>,
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) -> Wish<D> {
        let at = body.chain.points()[task.agent];
        let step_m = task.speed_m_s * self.dt_s;
        match &task.driver {
            Driver::Rest => Wish::Rest,
            Driver::Navigate(navigator) => {
                if Self::has_arrived(body, task, navigator) {
                    return Wish::Done;
                }
                self.steered(body, task, navigator, turn).map_or(Wish::Rest, Wish::Steer)
            }
            Driver::Wander(rule) => {
                let draws = &mut self.streams.draws(turn.slot, turn.now, purpose::WANDER);
                let ahead = wander(rule, at, out_of_space(body.driving.ahead), step_m, draws);
                body.driving.ahead = in_space(ahead);
                Wish::Go(super::rods::geometry::along(at, ahead, step_m))
            }
            Driver::Script(_) => self.by_script(body, at, step_m),
            Driver::Targets(targets) => {
                let Some(&target) = targets.places.get(body.driving.next as usize) else {
                    return Wish::Done;
                };
                let left_m = distance(at, target);
                body.driving.late = match left_m < body.driving.nearest_m {
                    true => 0,
                    false => body.driving.late.saturating_add(1),
                };
                body.driving.nearest_m = body.driving.nearest_m.min(left_m);
                if left_m > targets.tolerance_m {
                    return Wish::Go(towards(at, target, step_m));
                }
                scratch.events.push(turn.event(
                    EventKind::Target,
                    task.agent,
                    f64::from(body.driving.next),
                ));
                body.tally.done += 1;
                self.next_part(body);
                Wish::Rest
            }
        }
    }

    /// What the script says. Turning takes no time.
    fn by_script(&self, body: &mut Body<D>, at: Point<D>, step_m: f64) -> Wish<D> {
        loop {
            match body.motions.get(body.driving.next as usize) {
                None => return Wish::Done,
                Some(ScriptMotion::Face { ahead }) => body.driving.ahead = *ahead,
                Some(ScriptMotion::Wait { duration_s }) => {
                    if self.starts_s(u64::from(body.driving.rested)) < *duration_s {
                        body.driving.rested += 1;
                        return Wish::Rest;
                    }
                }
                Some(ScriptMotion::MoveTo { position_m }) => {
                    let to = out_of_space(*position_m);
                    let left_m = distance(at, to);
                    body.driving.nearest_m = body.driving.nearest_m.min(left_m);
                    if left_m > body.chain.least_move_m() {
                        return Wish::Go(towards(at, to, step_m));
                    }
                }
            }
            self.next_part(body);
        }
    }

    /// On to the next motion or target.
    fn next_part(&self, body: &mut Body<D>) {
        body.driving.next += 1;
        (body.driving.rested, body.driving.idle) = (0, 0);
        (body.driving.told, body.driving.objection) = (None, None);
        (body.driving.nearest_m, body.driving.late) = (f64::INFINITY, 0);
    }

    /// Moves an initiator on wheels; one whose way is blocked may turn where it stands.
    fn go_on_wheels(
        &self,
        body: &mut Body<D>,
        (task, pose): (&Task<D>, Pose),
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) {
        let Driver::Navigate(navigator) = &task.driver else { return };
        match self.go(body, (task, Self::place(pose.at)), turn, scratch) {
            Went::Ahead => self.has_steered(body, task, navigator, pose.heading_rad),
            Went::Nowhere => self.turn_where_blocked(body, task, navigator, turn),
        }
    }

    /// Moves the initiator, as it wants or as the ladder allows.
    fn go(
        &self,
        body: &mut Body<D>,
        (task, to): (&Task<D>, Point<D>),
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) -> Went {
        let at = body.chain.points()[task.agent];
        let motion = Motion::Connector { k: task.agent, to };
        let request = Request { motion, source: task.source(), mode: Mode::Exact };
        let situation = self.situation(body, task, scratch);
        let mut ladder =
            Ladder { rungs: self.rungs, memory: std::mem::take(&mut body.driving.ladder) };
        let climbed = ladder.climb_told(
            &mut body.chain,
            &scratch.obstacles,
            &mut scratch.propagator,
            &request,
            &situation,
        );
        body.driving.ladder = ladder.memory;
        // Out of the world there is no way.
        let beyond = Veto {
            by: task.agent,
            from: task.agent,
            reason: Reason::Limit,
            obstacle: None,
            reached: at,
        };
        let (climbed, objection) = climbed.unwrap_or((Climbed::Vetoed(beyond), Some(beyond)));
        if let Some(veto) = &objection {
            self.vetoed(body, turn, veto, scratch);
        }
        let way = sub(body.chain.points()[task.agent], at);
        body.driving.way_m[0] += distance(at, to);
        body.driving.way_m[1] += norm(way);
        body.tally.way_m += norm(way);
        self.take_note(body, (task, &climbed, way), turn, scratch)
    }

    /// What an initiator knows beside its neighborhood.
    fn situation(&self, body: &Body<D>, task: &Task<D>, scratch: &Scratch<D>) -> Situation {
        let at = body.chain.points()[task.agent];
        let is_near = |o: &Obstacle<D>| {
            o.core.nearest_to_point(at).distance_m - o.radius_m < self.look_m + MOVER_NEAR_M
        };
        let goal_distance_m = match &task.driver {
            Driver::Targets(targets) => {
                targets.places.get(body.driving.next as usize).map(|place| distance(at, *place))
            }
            _ => None,
        };
        let (can_turn, keeps_heading) = match &task.driver {
            Driver::Navigate(navigator) => (navigator.can_turn_on_the_spot(), true),
            _ => (false, false),
        };
        let movers_near = scratch.obstacles.moving().iter().any(is_near);
        Situation { goal_distance_m, movers_near, can_turn, keeps_heading }
    }

    /// Books what came of a motion; whether the initiator moved.
    fn take_note(
        &self,
        body: &mut Body<D>,
        (task, climbed, way): (&Task<D>, &Climbed<D>, Point<D>),
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) -> Went {
        body.tally.rungs.count(climbed);
        let went = match climbed {
            Climbed::Straight(moved) => {
                (body.driving.idle, body.driving.told) = (0, None);
                self.moved(body, moved, way);
                return Went::Ahead;
            }
            Climbed::Shorter { moved, .. } => {
                self.moved(body, moved, way);
                Went::Ahead
            }
            Climbed::Sideways { moved, turn_rad, .. } => {
                let event = turn.event(EventKind::Sideways, task.agent, *turn_rad);
                self.tell_once(body, event, scratch);
                self.moved(body, moved, way);
                Went::Ahead
            }
            Climbed::PulledBack { by, moved } => {
                self.tell_once(body, turn.event(EventKind::PulledBack, *by, 0.0), scratch);
                self.moved(body, moved, [0.0; D]);
                Went::Nowhere
            }
            Climbed::Stuck { .. } => {
                self.tell_once(body, turn.event(EventKind::Stuck, task.agent, 0.0), scratch);
                self.look_elsewhere(body, task, turn);
                Went::Nowhere
            }
            Climbed::TurnOnTheSpot { .. } | Climbed::Waiting { .. } | Climbed::Vetoed(_) => {
                Went::Nowhere
            }
        };
        body.driving.idle = match went {
            Went::Ahead => 0,
            Went::Nowhere => body.driving.idle.saturating_add(1),
        };
        self.lose_patience(body, task, turn, scratch);
        went
    }

    /// Of events of a kind in a row, between two motions as wanted, only the first is told.
    fn tell_once(&self, body: &mut Body<D>, event: Event, scratch: &mut Scratch<D>) {
        if body.driving.told != Some(event.kind) {
            body.driving.told = Some(event.kind);
            scratch.events.push(event);
        }
    }

    /// Who wanders and is stuck goes on in any direction.
    fn look_elsewhere(&self, body: &mut Body<D>, task: &Task<D>, turn: Step<'_, D>) {
        if matches!(task.driver, Driver::Wander(_)) {
            let draws = &mut self.streams.draws(turn.slot, turn.now, purpose::TURN_AWAY);
            let any: Point<D> = std::array::from_fn(|_| normal(draws));
            body.driving.ahead = in_space(unit(any).unwrap_or(first_axis()));
        }
    }

    fn moved(&self, body: &mut Body<D>, moved: &Moved<D>, way: Point<D>) {
        if let Some(ahead) = unit(way) {
            body.driving.ahead = in_space(ahead);
        }
        body.tally.add_moved(moved);
    }

    /// Counts a veto; of those of one connector and reason in a row only the first is an event.
    fn vetoed(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        veto: &Veto<D>,
        scratch: &mut Scratch<D>,
    ) {
        body.tally.add_veto(veto.reason);
        let objection = Some((veto.by as u32, veto.reason));
        if body.driving.told.is_none() || body.driving.objection != objection {
            let way_m = distance(veto.reached, scratch.before[veto.from]);
            let event = turn.event(EventKind::Veto, veto.by, way_m);
            let (reason, obstacle) = (Some(veto.reason), veto.obstacle);
            scratch.events.push(Event { reason, obstacle, ..event });
            body.driving.told = body.driving.told.or(Some(EventKind::Veto));
        }
        body.driving.objection = objection;
    }

    /// A task that came no further for too long is given up. Around a target there is always some
    /// way to go: there it counts for how long none of them led nearer.
    fn lose_patience(
        &self,
        body: &mut Body<D>,
        task: &Task<D>,
        turn: Step<'_, D>,
        scratch: &mut Scratch<D>,
    ) {
        let tried = body.driving.idle.max(body.driving.late);
        if self.starts_s(u64::from(tried)) <= task.patience_s {
            return;
        }
        let objection = body.driving.objection;
        let reason = objection.map(|(_, reason)| reason);
        let undone = match &task.driver {
            Driver::Targets(targets) => 1.0 / targets.places.len() as f64,
            _ => 1.0 - self.part_done(body, task),
        };
        body.tally.given_up.push(GivenUp {
            task: body.driving.task,
            part: body.driving.next,
            nearest_m: body.driving.nearest_m,
            undone,
            by: objection.map(|(by, _)| by),
            reason: reason.map(|reason| reason.name().into()),
        });
        match task.driver {
            Driver::Targets(_) => {
                let by = objection.map_or(task.agent, |(by, _)| by as usize);
                let event = turn.event(EventKind::GivenUp, by, f64::from(body.driving.task));
                scratch.events.push(Event { reason, ..event });
                self.next_part(body);
            }
            _ => self.next_task(body, turn, EventKind::GivenUp, scratch),
        }
    }

    fn next_task(
        &self,
        body: &mut Body<D>,
        turn: Step<'_, D>,
        how: EventKind,
        scratch: &mut Scratch<D>,
    ) {
        let Some(task) = turn.spec.tasks.get(body.driving.task as usize) else { return };
        scratch.events.push(turn.event(how, task.agent, f64::from(body.driving.task)));
        body.tally.done += u64::from(how == EventKind::Done);
        let next = turn.spec.tasks.get(body.driving.task as usize + 1).unwrap_or(task);
        body.driving.next_task(next.agent, body.chain.points());
        body.motions =
            turn.spec.motions(&body.driving).expect("scripts are tried when they are compiled");
    }
}
