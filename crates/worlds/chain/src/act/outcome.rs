//! The outcome of a motion of an initiator.

use super::tasks::lose_patience;
use super::{Acting, Initiator};
use crate::driver::Driver;
use crate::events::EventKind;
use crate::motion::replan::Climbed;
use crate::rods::geometry::{Point, first_axis, in_dimensions, unit};
use crate::rods::veto::Moved;
use crate::state::Body;
use crate::world::purpose;
use sidestep_kernel::distr::normal;

/// Whether an initiator went where it wanted, or near it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Went {
    Ahead,
    Nowhere,
}

/// Counts the result of a motion; returns whether the initiator moved.
pub(super) fn take_note<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    climbed: &Climbed<D>,
    way: Point<D>,
) -> Went {
    acting.body.tally.rungs.count(climbed);
    let agent = who.task.agent;
    let went = match climbed {
        Climbed::Straight(moved) => {
            (acting.body.driving.idle, acting.body.driving.told) = (0, None);
            has_moved(acting.body, moved, way);
            return Went::Ahead;
        }
        Climbed::Shorter { moved, .. } => {
            has_moved(acting.body, moved, way);
            Went::Ahead
        }
        Climbed::Sideways { moved, turn_rad, .. } => {
            tell_once(acting, EventKind::Sideways, agent, *turn_rad);
            has_moved(acting.body, moved, way);
            Went::Ahead
        }
        Climbed::PulledBack { by, moved } => {
            tell_once(acting, EventKind::PulledBack, *by, 0.0);
            has_moved(acting.body, moved, [0.0; D]);
            Went::Nowhere
        }
        Climbed::Stuck { .. } => {
            tell_once(acting, EventKind::Stuck, agent, 0.0);
            look_elsewhere(who, acting.body);
            Went::Nowhere
        }
        Climbed::TurnOnTheSpot { .. } | Climbed::Waiting { .. } | Climbed::Vetoed(_) => {
            Went::Nowhere
        }
    };
    acting.body.driving.idle = match went {
        Went::Ahead => 0,
        Went::Nowhere => acting.body.driving.idle.saturating_add(1),
    };
    lose_patience(who, acting.body, &mut acting.told);
    went
}

/// Reports only the first of several events of one kind between two motions that went as
/// wanted.
fn tell_once<const D: usize>(
    acting: &mut Acting<'_, D>,
    kind: EventKind,
    connector: usize,
    value: f64,
) {
    if acting.body.driving.told != Some(kind) {
        acting.body.driving.told = Some(kind);
        acting.told.tell(&acting.body.chain, kind, connector, value);
    }
}

/// Lets a wandering initiator that is stuck go on in any direction.
fn look_elsewhere<const D: usize>(who: Initiator<'_, D>, body: &mut Body<D>) {
    if matches!(who.task.driver, Driver::Wander(_)) {
        let draws = &mut who.setting.draws(purpose::TURN_AWAY);
        let any: Point<D> = std::array::from_fn(|_| normal(draws));
        let ahead: Point<D> = unit(any).unwrap_or(first_axis());
        body.driving.ahead = in_dimensions(ahead);
    }
}

fn has_moved<const D: usize>(body: &mut Body<D>, moved: &Moved<D>, way: Point<D>) {
    if let Some(ahead) = unit(way) {
        body.driving.ahead = in_dimensions(ahead);
    }
    body.tally.add_moved(moved);
}
