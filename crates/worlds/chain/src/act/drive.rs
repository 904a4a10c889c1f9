//! The present task of a chain, for one cycle: the wish of its driver.

use super::Acting;
use crate::driver::errand::Errand;
use crate::driver::{Driver, Targets, Task, Wander, wander};
use crate::events::EventKind;
use crate::metrics::GivenUp;
use crate::notes::Wanted;
use crate::rods::geometry::{Point, along, distance, in_dimensions, toward};
use crate::script::Motion;
use crate::state::Plan;
use crate::swarm::drive::Pose;
use crate::world::purpose;

/// The words for a wish that is put off.
const WAIT: &str = "wait for what moves";

/// A driver's wish in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Wish<const D: usize> {
    /// Nothing.
    Rest,
    /// The initiator at another place.
    Go(Point<D>),
    /// The whole chain farther along its plan.
    Follow,
    /// A robot on wheels at another pose.
    Steer(Pose),
    /// The connector of a robot on wheels back toward its robot.
    Return(Point<D>),
    /// A robot on wheels with another heading, where it is.
    Face(f64),
    /// The order of a caller.
    Obey(Errand<D>),
    /// Its task is done.
    Done,
}

impl<const D: usize> Acting<'_, D> {
    /// Carries out the present task.
    pub(super) fn drive(&mut self) {
        let Some(task) = self.task() else { return };
        let is_late = self.world.starts_s(self.body.driving.cycles + 1) >= task.lasts_s;
        self.body.driving.cycles += 1;
        let present = self.body.driving.task;
        let wish = self.wish(task);
        self.look_ahead(task, wish);
        let wanted = self.wanted(task, wish);
        self.note(|notes| notes.wish = Some(wanted));
        match wish {
            Wish::Rest => {}
            Wish::Go(_) | Wish::Return(_) | Wish::Steer(_) if self.gives_way => self.give_way(task),
            Wish::Return(to) => {
                let ahead = self.body.driving.ahead;
                self.go(task, to);
                self.body.driving.ahead = ahead;
            }
            Wish::Face(heading_rad) => self.face(heading_rad),
            Wish::Go(to) => {
                self.go(task, to);
            }
            Wish::Follow => self.follow_plan(task),
            Wish::Steer(pose) => self.go_on_wheels(task, pose),
            Wish::Obey(errand) => self.obey(task, errand),
            Wish::Done => return self.next_task(self.ending(task)),
        }
        // One that was given up in this cycle has ended already, and the next one has just begun.
        if is_late && self.body.driving.task == present {
            self.next_task(self.ending(task));
        }
    }

    /// Returns how a task ends that has come to its end: a list of targets none of which was reached is not done.
    fn ending(&self, task: &Task<D>) -> EventKind {
        if !matches!(task.driver, Driver::Targets(_)) {
            return EventKind::Done;
        }
        let driving = &self.body.driving;
        let is_of_now = |what: &&GivenUp| what.task == driving.task;
        let given_up = self.body.tally.given_up.iter().filter(is_of_now).count();
        // Targets that time has cut off are neither.
        if driving.next as usize > given_up { EventKind::Done } else { EventKind::GivenUp }
    }

    /// Returns a wish in words.
    fn wanted(&self, task: &Task<D>, wish: Wish<D>) -> Wanted<D> {
        let mut of = task.agent;
        let (words, to) = match wish {
            Wish::Rest => ("rest", None),
            Wish::Go(to) if self.gives_way => (WAIT, Some(to)),
            Wish::Go(to) => ("go", Some(to)),
            Wish::Return(to) => ("go back to its robot", Some(to)),
            Wish::Face(_) => ("turn to where it faced", None),
            Wish::Obey(errand) => {
                of = errand.first;
                (if self.gives_way { WAIT } else { "go, as ordered" }, Some(errand.to[0]))
            }
            Wish::Follow => ("follow its plan", self.planned_place(task)),
            Wish::Steer(pose) => ("steer", Some(in_dimensions(pose.at))),
            Wish::Done => ("its task is done", None),
        };
        Wanted { of, words, to }
    }

    /// Returns the next place of the initiator on its planned way.
    fn planned_place(&self, task: &Task<D>) -> Option<Point<D>> {
        match self.body.plan.as_ref()? {
            Plan::Rods(way) => Some(way.front()?[task.agent]),
            Plan::Joints(way) => {
                let places = self.spec.arm.as_ref()?.places(way.front()?);
                places.get(task.agent).copied()
            }
        }
    }

    /// Returns where the initiator wants to be at the end of the cycle.
    fn wish(&mut self, task: &Task<D>) -> Wish<D> {
        let at = self.body.chain.points()[task.agent];
        let step_m = task.speed_m_s * self.world.dt_s;
        match &task.driver {
            Driver::Rest => Wish::Rest,
            Driver::External => self.ordered(task, step_m).map_or(Wish::Rest, Wish::Obey),
            Driver::Navigate(navigator) => {
                if self.has_arrived(task, navigator) {
                    return Wish::Done;
                }
                if let Some(to) = self.back_at_its_robot(task, step_m) {
                    return Wish::Return(to);
                }
                if let Some(heading_rad) = self.faces_elsewhere(navigator) {
                    return Wish::Face(heading_rad);
                }
                self.steered(task, navigator).map_or(Wish::Rest, Wish::Steer)
            }
            Driver::Wander(rule) => self.wandering(rule, at, step_m),
            Driver::Script(_) => self.by_script(at, step_m),
            Driver::Targets(targets) => self.next_target(task, targets, at, step_m),
        }
    }

    fn wandering(&mut self, rule: &Wander<D>, at: Point<D>, step_m: f64) -> Wish<D> {
        let draws = &mut self.world.streams.draws(self.slot, self.now, purpose::WANDER);
        let was = in_dimensions(self.body.driving.ahead);
        let ahead = wander(rule, at, was, step_m, draws);
        self.body.driving.ahead = in_dimensions(ahead);
        Wish::Go(along(at, ahead, step_m))
    }

    /// Returns a step to the next target. In the cycle in which a target is reached, the initiator
    /// rests.
    fn next_target(
        &mut self,
        task: &Task<D>,
        targets: &Targets<D>,
        at: Point<D>,
        step_m: f64,
    ) -> Wish<D> {
        let driving = &mut self.body.driving;
        let Some(&target) = targets.places.get(driving.next as usize) else {
            return Wish::Done;
        };
        let left_m = distance(at, target);
        driving.late = match left_m < driving.nearest_m {
            true => 0,
            false => driving.late.saturating_add(1),
        };
        driving.nearest_m = driving.nearest_m.min(left_m);
        if left_m > targets.tolerance_m {
            self.plan_if_late(task, targets);
            return match self.body.plan {
                Some(_) => Wish::Follow,
                None => Wish::Go(toward(at, target, step_m)),
            };
        }
        self.body.plan = None;
        self.tell(EventKind::Target, task.agent, f64::from(self.body.driving.next));
        self.body.tally.done += 1;
        self.body.driving.next_part();
        Wish::Rest
    }

    /// Returns the wish of a script. Turning takes no time.
    fn by_script(&mut self, at: Point<D>, step_m: f64) -> Wish<D> {
        let there_m = self.there_m();
        let driving = &mut self.body.driving;
        loop {
            match self.body.motions.get(driving.next as usize) {
                None => return Wish::Done,
                Some(Motion::Face { ahead }) => driving.ahead = *ahead,
                Some(Motion::Wait { duration_s }) => {
                    if self.world.starts_s(u64::from(driving.rested)) < *duration_s {
                        driving.rested += 1;
                        return Wish::Rest;
                    }
                }
                Some(Motion::MoveTo { position_m }) => {
                    let to = in_dimensions(*position_m);
                    let left_m = distance(at, to);
                    driving.nearest_m = driving.nearest_m.min(left_m);
                    if left_m > there_m {
                        return Wish::Go(toward(at, to, step_m));
                    }
                }
            }
            driving.next_part();
        }
    }

    /// Ends the present task, done or given up, and starts the next.
    pub(super) fn next_task(&mut self, how: EventKind) {
        let Some(task) = self.task() else { return };
        self.body.catch_up();
        (self.body.plan, self.body.stood) = (None, 0);
        let driving = &mut self.body.driving;
        let next = self.spec.tasks.get(driving.task as usize + 1).unwrap_or(task);
        let ended = f64::from(driving.task);
        driving.next_task(next.agent, self.body.chain.points());
        self.body.tally.done += u64::from(how == EventKind::Done);
        self.body.motions = self
            .spec
            .motions(&self.body.driving)
            .expect("scripts are tried when they are compiled");
        self.tell(how, task.agent, ended);
    }
}
