//! Orders from outside, for one cycle, and the answer to them.

use super::joints::Jointed;
use super::situation::beyond;
use super::{Acting, Initiator, Setting};
use crate::driver::errand::Errand;
use crate::driver::external::{Came, Orders, Target};
use crate::motion::go::go;
use crate::motion::replan::Climbed;
use crate::rods::chain::Chain;
use crate::rods::geometry::{in_dimensions, norm, sub, unit};
use crate::rods::veto::{Mode, Motion, Outcome, Request, Source, Veto};
use crate::state::Body;

/// Number of times that the way is halved to find how far it goes: to 1/256 of it.
const HALVINGS: usize = 8;

/// Takes the orders for this cycle. They are gone after it, whether anybody heeds them or not.
pub(super) fn taken<const D: usize>(body: &mut Body<D>) -> Orders {
    let orders = std::mem::take(&mut body.external).orders;
    if orders.target.is_some() {
        body.external.answer.came = Came::Unheard;
    }
    orders
}

/// Returns the errand on which orders send a chain in this cycle, if they have a target.
pub(super) fn ordered<const D: usize>(
    who: Initiator<'_, D>,
    chain: &Chain<D>,
    orders: Orders,
) -> Option<Errand<D>> {
    let Orders { connector, rod, target, goes_far } = orders;
    let agent = who.task.agent;
    let motion = match target? {
        Target::Connector(to) => {
            let k = connector.map_or(agent, |k| k as usize);
            let (to, at) = (in_dimensions(to), chain.points()[k]);
            let connector = &chain.connectors()[k];
            let mobility = &connector.mobility;
            let is_there = !goes_far || connector.is_still() || mobility.allows(to, at);
            Motion::Connector { k, to: if is_there { to } else { mobility.project(to, at) } }
        }
        Target::Rod(to) => {
            let last = chain.rods().len().checked_sub(1)?;
            let i = rod.map_or(agent.min(last), |i| i as usize);
            Motion::Rod { i, to: to.map(in_dimensions) }
        }
    };
    Some(Errand::new(chain, &motion, who.step_m()))
}

/// The manner of going on an errand.
#[derive(Clone, Copy)]
pub(super) struct Manner {
    /// Whether the chain waits, because parts have to get out of the way.
    pub(super) gives_way: bool,
    /// Whether it goes as far as it can where it cannot go all the way.
    pub(super) goes_far: bool,
}

/// Goes on an errand, unless parts have to get out of the way.
pub(super) fn obey<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    errand: &Errand<D>,
    manner: Manner,
) {
    let at = acting.body.chain.points()[errand.first];
    acting.body.driving.way_m.wanted += norm(sub(errand.to[0], at));
    let climbed = match manner.gives_way {
        true => Climbed::Waiting { n: acting.body.driving.idle.saturating_add(1) },
        false => carried_out(who.setting, acting, errand, manner.goes_far),
    };
    let body = &mut *acting.body;
    body.tally.rungs.count(&climbed);
    acting.told.note(|notes| notes.climbed = Some(climbed));
    let way = sub(body.chain.points()[errand.first], at);
    let driving = &mut body.driving;
    driving.way_m.gone += norm(way);
    driving.idle = if way == [0.0; D] { driving.idle.saturating_add(1) } else { 0 };
    if let Some(ahead) = unit(way).filter(|_| errand.first == who.task.agent) {
        driving.ahead = in_dimensions(ahead);
    }
    body.tally.way_m += norm(way);
}

/// Requests all of the way and, where that is vetoed and as much as goes is wanted, halves of what is
/// left; tells the objection to the rest.
fn carried_out<const D: usize>(
    setting: Setting<'_, D>,
    acting: &mut Acting<'_, D>,
    errand: &Errand<D>,
    goes_far: bool,
) -> Climbed<D> {
    let mut veto = match requested(setting, acting, errand, 1.0) {
        Outcome::Moved(moved) => {
            match &moved.cut_short {
                Some(veto) => vetoed(acting, veto),
                None => acting.body.driving.told = None,
            }
            return Climbed::Straight(moved);
        }
        Outcome::Vetoed(veto) => veto,
    };
    let (mut done, mut half, mut last) = (0.0, 0.5, None);
    for _ in 0..if goes_far { HALVINGS } else { 0 } {
        match requested(setting, acting, errand, done + half) {
            Outcome::Moved(moved) => {
                done += half;
                last = Some(moved);
            }
            Outcome::Vetoed(nearer) => veto = nearer,
        }
        half *= 0.5;
    }
    vetoed(acting, &veto);
    match last {
        Some(moved) => Climbed::Shorter { part: done, moved },
        None => Climbed::Vetoed(veto),
    }
}

/// Requests a part of an errand's way, counted from its start: all of that part, or nothing.
fn requested<const D: usize>(
    setting: Setting<'_, D>,
    acting: &mut Acting<'_, D>,
    errand: &Errand<D>,
    part: f64,
) -> Outcome<D> {
    let motion = errand.motion(part);
    let request = Request { motion, source: Source::Planner, mode: Mode::Exact };
    let Acting { body, before, propagator, .. } = acting;
    let outcome = go(propagator, &mut body.chain, setting.obstacles, &request);
    let outcome = outcome.unwrap_or_else(|_| Outcome::Vetoed(beyond(&body.chain, errand.first)));
    let outcome = match Jointed::of(setting, before, body) {
        Some(mut arm) => arm.obey(errand, part, outcome),
        None => outcome,
    };
    if let Outcome::Moved(moved) = &outcome {
        body.tally.add_moved(moved);
    }
    outcome
}

/// Counts a veto to an errand, and notes it in the answer.
fn vetoed<const D: usize>(acting: &mut Acting<'_, D>, veto: &Veto<D>) {
    acting.vetoed(veto);
    is_told(acting.body, veto);
}

/// Notes in the answer who objects.
pub(super) fn is_told<const D: usize>(body: &mut Body<D>, veto: &Veto<D>) {
    let answer = &mut body.external.answer;
    (answer.veto, answer.obstacle) = (body.driving.objection, veto.obstacle);
    answer.reached_m = in_dimensions(veto.reached);
}

/// Completes the answer at the end of the chain's motions.
pub(super) fn answer<const D: usize>(body: &mut Body<D>, errand: &Errand<D>, gives_way: bool) {
    let chain = &body.chain;
    let done_share = errand.done_share(chain);
    let reached = chain.points()[errand.first];
    let answer = &mut body.external.answer;
    answer.wish_m = errand.to.map(in_dimensions);
    answer.came = match answer.veto {
        None if gives_way => Came::Waited,
        None => Came::Moved,
        Some(_) if done_share > 0.0 => Came::CutShort,
        Some(_) => Came::Vetoed,
    };
    answer.done_share = if answer.came == Came::Moved { 1.0 } else { done_share };
    if answer.came != Came::Vetoed {
        answer.reached_m = in_dimensions(reached);
    }
}
