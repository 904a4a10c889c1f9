//! Orders from outside, for one cycle, and the answer to them.

use super::Acting;
use crate::driver::Task;
use crate::driver::errand::Errand;
use crate::driver::external::{Came, Orders, Target};
use crate::motion::go::go;
use crate::motion::replan::Climbed;
use crate::rods::geometry::{Point, in_dimensions, norm, sub, unit};
use crate::rods::veto::{Mode, Motion, Outcome, Request, Source, Veto};

/// Number of times that the way is halved to find how far it goes: to 1/256 of it.
const HALVINGS: usize = 8;

impl<const D: usize> Acting<'_, D> {
    /// Takes the orders for this cycle. They are gone after it, whether anybody heeds them or not.
    pub(super) fn take_orders(&mut self) {
        self.orders = std::mem::take(&mut self.body.external).orders;
        if self.orders.target.is_some() {
            self.body.external.answer.came = Came::Unheard;
        }
    }

    /// Returns the errand on which the orders send the chain in this cycle, if they have a target.
    pub(super) fn ordered(&self, task: &Task<D>, step_m: f64) -> Option<Errand<D>> {
        let Orders { connector, rod, target, goes_far } = self.orders;
        let chain = &self.body.chain;
        let motion = match target? {
            Target::Connector(to) => {
                let k = connector.map_or(task.agent, |k| k as usize);
                let (to, at) = (in_dimensions(to), chain.points()[k]);
                let connector = &chain.connectors()[k];
                let mobility = &connector.mobility;
                let is_there = !goes_far || connector.is_still() || mobility.allows(to, at);
                Motion::Connector { k, to: if is_there { to } else { mobility.project(to, at) } }
            }
            Target::Rod(to) => {
                let last = chain.rods().len().checked_sub(1)?;
                let i = rod.map_or(task.agent.min(last), |i| i as usize);
                Motion::Rod { i, to: to.map(in_dimensions) }
            }
        };
        Some(Errand::new(chain, &motion, step_m))
    }

    /// Goes on an errand, unless parts have to get out of the way.
    pub(super) fn obey(&mut self, task: &Task<D>, errand: Errand<D>) {
        self.errand = Some(errand);
        let at = self.place_of(&errand);
        self.body.driving.way_m.wanted += norm(sub(errand.to[0], at));
        let climbed = match self.gives_way {
            true => Climbed::Waiting { n: self.body.driving.idle.saturating_add(1) },
            false => self.carried_out(&errand),
        };
        self.body.tally.rungs.count(&climbed);
        self.note(|notes| notes.climbed = Some(climbed));
        let way = sub(self.place_of(&errand), at);
        let driving = &mut self.body.driving;
        driving.way_m.gone += norm(way);
        driving.idle = if way == [0.0; D] { driving.idle.saturating_add(1) } else { 0 };
        if let Some(ahead) = unit(way).filter(|_| errand.first == task.agent) {
            driving.ahead = in_dimensions(ahead);
        }
        self.body.tally.way_m += norm(way);
    }

    fn place_of(&self, errand: &Errand<D>) -> Point<D> {
        self.body.chain.points()[errand.first]
    }

    /// Requests all of the way and, where that is vetoed and as much as goes is wanted, halves of what is
    /// left; tells the objection to the rest.
    fn carried_out(&mut self, errand: &Errand<D>) -> Climbed<D> {
        let mut veto = match self.request(errand, 1.0) {
            Outcome::Moved(moved) => {
                match &moved.cut_short {
                    Some(veto) => self.vetoed(veto),
                    None => self.body.driving.told = None,
                }
                return Climbed::Straight(moved);
            }
            Outcome::Vetoed(veto) => veto,
        };
        let (mut done, mut half, mut last) = (0.0, 0.5, None);
        for _ in 0..if self.orders.goes_far { HALVINGS } else { 0 } {
            match self.request(errand, done + half) {
                Outcome::Moved(moved) => {
                    done += half;
                    last = Some(moved);
                }
                Outcome::Vetoed(nearer) => veto = nearer,
            }
            half *= 0.5;
        }
        self.vetoed(&veto);
        match last {
            Some(moved) => Climbed::Shorter { part: done, moved },
            None => Climbed::Vetoed(veto),
        }
    }

    /// Requests a part of an errand's way, counted from its start: all of that part, or nothing.
    fn request(&mut self, errand: &Errand<D>, part: f64) -> Outcome<D> {
        let motion = errand.motion(part);
        let request = Request { motion, source: Source::Planner, mode: Mode::Exact };
        let scratch = &mut *self.scratch;
        let chain = &mut self.body.chain;
        let outcome = go(&mut scratch.propagator, chain, &scratch.obstacles, &request);
        let outcome = outcome.unwrap_or_else(|_| Outcome::Vetoed(self.beyond(errand.first)));
        let outcome = self.joints_obey(errand, part, outcome);
        if let Outcome::Moved(moved) = &outcome {
            self.body.tally.add_moved(moved);
        }
        outcome
    }

    /// Notes in the answer who objects.
    pub(super) fn is_told(&mut self, veto: &Veto<D>) {
        if self.errand.is_some() {
            let answer = &mut self.body.external.answer;
            (answer.veto, answer.obstacle) = (self.body.driving.objection, veto.obstacle);
            answer.reached_m = in_dimensions(veto.reached);
        }
    }

    /// Completes the answer at the end of the chain's motions.
    pub(super) fn answer(&mut self) {
        let Some(errand) = &self.errand else { return };
        let chain = &self.body.chain;
        let done_share = errand.done_share(chain);
        let reached = chain.points()[errand.first];
        let answer = &mut self.body.external.answer;
        answer.wish_m = errand.to.map(in_dimensions);
        answer.came = match answer.veto {
            None if self.gives_way => Came::Waited,
            None => Came::Moved,
            Some(_) if done_share > 0.0 => Came::CutShort,
            Some(_) => Came::Vetoed,
        };
        answer.done_share = if answer.came == Came::Moved { 1.0 } else { done_share };
        if answer.came != Came::Vetoed {
            answer.reached_m = in_dimensions(reached);
        }
    }
}
