//! Pool two: what one chain does in a cycle.

use super::driver::{Driver, Task, in_space, out_of_space, towards, wander};
use super::events::{Event, EventKind};
use super::geometry::{Bounds, distance, sub, unit};
use super::metrics::GivenUp;
use super::reach;
use super::script::Motion as ScriptMotion;
use super::state::Body;
use super::swarm::drive::Pose;
use super::swarm::leader::Decision;
use super::veto::{Mode, Motion, Moved, Outcome, Reason, Request, Veto};
use super::world::{ChainWorld, Scratch, purpose};
use super::{geometry::Point, world::ChainSpec};
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

/// A chain in a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn<'a, const D: usize> {
    pub(super) spec: &'a ChainSpec<D>,
    pub(super) slot: Slot,
    pub(super) now: Cycle,
    /// What its navigator has decided.
    pub(super) decision: Option<Decision>,
}

impl<const D: usize> Turn<'_, D> {
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
        turn: Turn<'_, D>,
        claim: &Bounds<D>,
        scratch: &mut Scratch<D>,
    ) {
        self.change(body, turn, scratch);
        scratch.before.clear();
        scratch.before.extend_from_slice(body.chain.points());
        if body.scattered.is_some() {
            self.come_together(body, turn, scratch);
        } else {
            self.drive(body, turn, scratch);
            self.keep_to_claim(body, turn, claim, scratch);
        }
        self.follow(body, turn, scratch);
        self.measure(body, turn, scratch);
    }

    /// What would leave the claim is taken back: nobody else counts on the chain there.
    fn keep_to_claim(
        &self,
        body: &mut Body<D>,
        turn: Turn<'_, D>,
        claim: &Bounds<D>,
        scratch: &mut Scratch<D>,
    ) {
        if self.chains.len() == 1 {
            return;
        }
        let is_outside = |p: &Point<D>| !claim.meets(&Bounds::of(&[*p]));
        let Some(by) = body.chain.points().iter().position(is_outside) else { return };
        body.chain.points_mut().copy_from_slice(&scratch.before);
        let from = turn.spec.tasks.get(body.driving.task as usize).map_or(0, |task| task.agent);
        let reached = body.chain.points()[from];
        let veto = Veto { by, from, reason: Reason::StepLimit, obstacle: None, reached };
        self.vetoed(body, turn, &veto, scratch);
    }

    /// The present task, for one cycle.
    fn drive(&self, body: &mut Body<D>, turn: Turn<'_, D>, scratch: &mut Scratch<D>) {
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
        turn: Turn<'_, D>,
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
                Wish::Go(super::geometry::along(at, ahead, step_m))
            }
            Driver::Script(_) => self.by_script(body, at, step_m),
            Driver::Targets(targets) => {
                let Some(&target) = targets.places.get(body.driving.next as usize) else {
                    return Wish::Done;
                };
                let left_m = distance(at, target);
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
        body.driving.nearest_m = f64::INFINITY;
    }

    /// Moves an initiator on wheels; one whose way is blocked may turn where it stands.
    fn go_on_wheels(
        &self,
        body: &mut Body<D>,
        (task, pose): (&Task<D>, Pose),
        turn: Turn<'_, D>,
        scratch: &mut Scratch<D>,
    ) {
        let Driver::Navigate(navigator) = &task.driver else { return };
        if self.go(body, (task, Self::place(pose.at)), turn, scratch) {
            self.has_steered(body, task, navigator, pose.heading_rad);
        } else {
            self.turn_where_blocked(body, task, navigator, turn);
        }
    }

    /// Moves the initiator, or meets with a veto; whether it moved.
    fn go(
        &self,
        body: &mut Body<D>,
        (task, to): (&Task<D>, Point<D>),
        turn: Turn<'_, D>,
        scratch: &mut Scratch<D>,
    ) -> bool {
        let at = body.chain.points()[task.agent];
        let motion = Motion::Connector { k: task.agent, to };
        let request = Request { motion, source: task.source(), mode: Mode::Exact };
        let outcome =
            reach::go(&mut scratch.propagator, &mut body.chain, &scratch.obstacles, &request);
        let outcome = outcome.expect("targets are finite and near");
        body.driving.way_m[0] += distance(at, to);
        body.driving.way_m[1] += distance(at, body.chain.points()[task.agent]);
        match outcome {
            Outcome::Moved(moved) => {
                self.moved(body, &moved, sub(to, at));
                true
            }
            Outcome::Vetoed(veto) => {
                self.vetoed(body, turn, &veto, scratch);
                self.lose_patience(body, (task, &veto), turn, scratch);
                false
            }
        }
    }

    fn moved(&self, body: &mut Body<D>, moved: &Moved<D>, way: Point<D>) {
        body.driving.idle = 0;
        if let Some(ahead) = unit(way) {
            body.driving.ahead = in_space(ahead);
        }
        body.tally.add_moved(moved);
    }

    /// Counts a veto; of those in a row only the first is an event.
    fn vetoed(
        &self,
        body: &mut Body<D>,
        turn: Turn<'_, D>,
        veto: &Veto<D>,
        scratch: &mut Scratch<D>,
    ) {
        body.tally.add_veto(veto.reason);
        if body.driving.idle == 0 {
            let way_m = distance(veto.reached, scratch.before[veto.from]);
            let event = turn.event(EventKind::Veto, veto.by, way_m);
            scratch.events.push(Event {
                reason: Some(veto.reason),
                obstacle: veto.obstacle,
                ..event
            });
        }
        body.driving.idle = body.driving.idle.saturating_add(1);
    }

    /// A task that met with vetoes for too long is given up.
    fn lose_patience(
        &self,
        body: &mut Body<D>,
        (task, veto): (&Task<D>, &Veto<D>),
        turn: Turn<'_, D>,
        scratch: &mut Scratch<D>,
    ) {
        if self.starts_s(u64::from(body.driving.idle)) <= task.patience_s {
            return;
        }
        body.tally.given_up.push(GivenUp {
            task: body.driving.task,
            part: body.driving.next,
            nearest_m: body.driving.nearest_m,
            by: Some(veto.by as u32),
            reason: Some(veto.reason.name().into()),
        });
        match task.driver {
            Driver::Targets(_) => {
                let event = turn.event(EventKind::GivenUp, veto.by, f64::from(body.driving.task));
                scratch.events.push(Event { reason: Some(veto.reason), ..event });
                self.next_part(body);
            }
            _ => self.next_task(body, turn, EventKind::GivenUp, scratch),
        }
    }

    fn next_task(
        &self,
        body: &mut Body<D>,
        turn: Turn<'_, D>,
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
