//! The wish of a chain's driver in a cycle.

use super::bounds::Escaping;
use super::joints::there_m;
use super::obey::ordered;
use super::plan::plan_if_late;
use super::wheels::{Steered, Wheeled};
use super::{Acting, Follows, Initiator};
use crate::driver::errand::Errand;
use crate::driver::external::Orders;
use crate::driver::{Driver, Targets, Wander, wander};
use crate::events::EventKind;
use crate::rods::geometry::{Point, along, distance, in_dimensions, toward};
use crate::script::Motion;
use crate::state::Body;
use crate::swarm::leader::Decision;
use crate::world::purpose;

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
    Steer(Steered),
    /// The connector of a robot on wheels back toward its robot.
    Return(Point<D>),
    /// A robot on wheels with another heading, where it is.
    Face(f64),
    /// The order of a caller.
    Obey(Errand<D>),
    /// Its task is done.
    Done,
}

/// The decisions on a chain that are made before it acts.
#[derive(Clone, Copy)]
pub(super) struct Heard {
    /// Decision of its navigator.
    pub(super) decision: Option<Decision>,
    /// Orders from outside.
    pub(super) orders: Orders,
}

/// The circumstances of an initiator, beside its task.
#[derive(Clone, Copy)]
pub(super) struct Guide<'a, const D: usize> {
    pub(super) heard: Heard,
    pub(super) follows: Follows,
    pub(super) escaping: &'a Escaping<'a, D>,
    /// Whether it gives way to parts that get out of something's way.
    pub(super) is_pressed: bool,
}

/// Returns where the initiator wants to be at the end of the cycle.
pub(super) fn wish<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    guide: &Guide<'_, D>,
) -> Wish<D> {
    let Heard { decision, orders } = guide.heard;
    match &who.task.driver {
        Driver::Rest => Wish::Rest,
        Driver::External => ordered(who, &acting.body.chain, orders).map_or(Wish::Rest, Wish::Obey),
        Driver::Navigate(navigator) => {
            let has_fled = guide.escaping.has_fled(who.task.agent, acting.before);
            let wheeled = Wheeled { who, navigator, body: acting.body };
            navigating(wheeled, decision, has_fled)
        }
        Driver::Wander(rule) => wandering(who, acting.body, rule),
        Driver::Script(_) => by_script(who, acting.body),
        Driver::Targets(targets) => next_target(who, acting, targets),
    }
}

/// Returns the wish of a navigator that has made its decision.
fn navigating<const D: usize>(
    mut wheeled: Wheeled<'_, D>,
    decision: Option<Decision>,
    has_fled: bool,
) -> Wish<D> {
    if wheeled.has_arrived() {
        return Wish::Done;
    }
    if let Some(to) = wheeled.back_at_its_robot(has_fled) {
        return Wish::Return(to);
    }
    if let Some(heading_rad) = wheeled.faces_elsewhere() {
        return Wish::Face(heading_rad);
    }
    decision.map_or(Wish::Rest, |decision| Wish::Steer(wheeled.steered(decision)))
}

fn wandering<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    rule: &Wander<D>,
) -> Wish<D> {
    let (at, step_m) = (who.at(body), who.step_m());
    let draws = &mut who.setting.draws(purpose::WANDER);
    let was = in_dimensions(body.driving.ahead);
    let ahead = wander(rule, at, was, step_m, draws);
    body.driving.ahead = in_dimensions(ahead);
    Wish::Go(along(at, ahead, step_m))
}

/// Returns a step to the next target. In the cycle in which a target is reached, the initiator
/// rests.
fn next_target<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    targets: &Targets<D>,
) -> Wish<D> {
    let at = who.at(acting.body);
    let driving = &mut acting.body.driving;
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
        plan_if_late(who, acting, targets);
        return match acting.body.plan {
            Some(_) => Wish::Follow,
            None => Wish::Go(toward(at, target, who.step_m())),
        };
    }
    let body = &mut *acting.body;
    body.plan = None;
    let number = f64::from(body.driving.next);
    acting.told.tell(&body.chain, EventKind::Target, who.task.agent, number);
    body.tally.done += 1;
    body.driving.next_part();
    Wish::Rest
}

/// Returns the wish of a script. Turning takes no time.
fn by_script<const D: usize>(who: Initiator<'_, D>, body: &mut Body<D>) -> Wish<D> {
    let at = who.at(body);
    let there_m = there_m(who.setting, &body.chain);
    let driving = &mut body.driving;
    loop {
        match body.motions.get(driving.next as usize) {
            None => return Wish::Done,
            Some(Motion::Face { ahead }) => driving.ahead = *ahead,
            Some(Motion::Wait { duration_s }) => {
                if who.setting.world.starts_s(u64::from(driving.rested)) < *duration_s {
                    driving.rested += 1;
                    return Wish::Rest;
                }
            }
            Some(Motion::MoveTo { position_m }) => {
                let to = in_dimensions(*position_m);
                let left_m = distance(at, to);
                driving.nearest_m = driving.nearest_m.min(left_m);
                if left_m > there_m {
                    return Wish::Go(toward(at, to, who.step_m()));
                }
            }
        }
        driving.next_part();
    }
}
