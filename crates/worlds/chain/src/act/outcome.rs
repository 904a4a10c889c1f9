//! The outcome of a motion of an initiator.

use super::tasks::give_up_if_stuck;
use super::{ChainCycleState, Initiator};
use crate::driver::TaskKind;
use crate::events::EventKind;
use crate::motion::recovery::RecoveryOutcome;
use crate::state::ChainBodyState;
use crate::world::purpose;
use sidestep_kernel::distr::normal;
use sidestep_rods::CompletedMotion;
use sidestep_rods::geometry::{Point, convert_dimensions, normalized, unit_x};

/// Whether an initiator moved where it wanted, or near it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MoveOutcome {
    Ahead,
    Nowhere,
}

/// Counts the result of a motion; returns whether the initiator moved.
pub(super) fn record_result<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    climbed: &RecoveryOutcome<D>,
    displacement: Point<D>,
) -> MoveOutcome {
    acting.body.tally.rungs.record(climbed);
    let agent = initiator.task.agent;
    let went = match climbed {
        RecoveryOutcome::Straight(moved) => {
            acting.body.driving.idle = 0;
            acting.body.driving.last_event = None;
            record_motion(acting.body, moved, displacement);
            return MoveOutcome::Ahead;
        }
        RecoveryOutcome::Shorter { moved, .. } => {
            record_motion(acting.body, moved, displacement);
            MoveOutcome::Ahead
        }
        RecoveryOutcome::Sideways { moved, turn_rad, .. } => {
            report_once(acting, EventKind::Sideways, agent, *turn_rad);
            record_motion(acting.body, moved, displacement);
            MoveOutcome::Ahead
        }
        RecoveryOutcome::PulledBack { by, moved } => {
            report_once(acting, EventKind::PulledBack, *by, 0.0);
            record_motion(acting.body, moved, [0.0; D]);
            MoveOutcome::Nowhere
        }
        RecoveryOutcome::Stuck { .. } => {
            report_once(acting, EventKind::Stuck, agent, 0.0);
            turn_to_random_heading(initiator, acting.body);
            MoveOutcome::Nowhere
        }
        RecoveryOutcome::TurnOnTheSpot { .. }
        | RecoveryOutcome::Waiting { .. }
        | RecoveryOutcome::Vetoed(_) => MoveOutcome::Nowhere,
    };
    acting.body.driving.idle = match went {
        MoveOutcome::Ahead => 0,
        MoveOutcome::Nowhere => acting.body.driving.idle.saturating_add(1),
    };
    give_up_if_stuck(initiator, acting.body, &mut acting.sink);
    went
}

/// Reports only the first of several events of one kind between two motions that succeeded at the first try.
fn report_once<const D: usize>(
    acting: &mut ChainCycleState<'_, D>,
    kind: EventKind,
    connector: usize,
    value: f64,
) {
    if acting.body.driving.last_event != Some(kind) {
        acting.body.driving.last_event = Some(kind);
        acting.sink.record(&acting.body.chain, kind, connector, value);
    }
}

/// Turns a wandering initiator that is stuck to a random direction.
fn turn_to_random_heading<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
) {
    if matches!(initiator.task.driver, TaskKind::Wander(_)) {
        let draws = &mut initiator.context.random_draws(purpose::TURN_AWAY);
        let any: Point<D> = std::array::from_fn(|_| normal(draws));
        let ahead: Point<D> = normalized(any).unwrap_or(unit_x());
        body.driving.ahead = convert_dimensions(ahead);
    }
}

fn record_motion<const D: usize>(
    body: &mut ChainBodyState<D>,
    moved: &CompletedMotion<D>,
    displacement: Point<D>,
) {
    if let Some(ahead) = normalized(displacement) {
        body.driving.ahead = convert_dimensions(ahead);
    }
    body.tally.add_motion(moved);
}
