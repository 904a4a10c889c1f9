//! The ends of tasks: done, over in time, or given up.

use super::event_sink::EventSink;
use super::{ChainContext, ChainCycleState, Initiator};
use crate::driver::own_driver::DriverMemory;
use crate::driver::{Targets, Task, TaskKind};
use crate::events::{Event, EventKind};
use crate::metrics::AbandonedSubtask;
use crate::state::{ChainBodyState, Standstill};

/// Returns how a task ends: a list of targets none of which was reached is not done.
pub(super) fn task_end_event<const D: usize>(
    task: &Task<D>,
    body: &ChainBodyState<D>,
) -> EventKind {
    if !matches!(task.driver, TaskKind::Targets(_)) {
        return EventKind::Done;
    }
    let driving = &body.driving;
    let given_up = body.tally.given_up.iter().filter(|part| part.task == driving.task).count();
    // Targets that the time limit cut off are neither.
    if driving.next as usize > given_up { EventKind::Done } else { EventKind::GivenUp }
}

/// Returns whether the present target is the last one of all tasks, at which an arm comes to rest.
pub(super) fn is_last_target<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
    targets: &Targets<D>,
) -> bool {
    let driving = &body.driving;
    driving.task as usize + 1 == initiator.context.spec.tasks.len()
        && driving.next as usize + 1 == targets.places.len()
}

/// Counts the present target as reached, and goes on to the next.
pub(super) fn complete_target<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
) {
    let body = &mut *acting.body;
    let number = f64::from(body.driving.next);
    acting.sink.record(&body.chain, EventKind::Target, initiator.task.agent, number);
    body.tally.done += 1;
    body.driving.start_next_subtask();
}

/// Ends the present task, done or given up, and starts the next.
pub(super) fn start_next_task<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
    how: EventKind,
) {
    let Some(task) = context.task(body) else { return };
    body.apply_deferred_motions();
    body.plan = None;
    body.standstill = Standstill::default();
    body.driver_memory = DriverMemory::default();
    let driving = &mut body.driving;
    let next = context.spec.tasks.get(driving.task as usize + 1).unwrap_or(task);
    let ended = f64::from(driving.task);
    driving.start_next_task(next.agent, body.chain.points());
    body.tally.done += u64::from(how == EventKind::Done);
    body.motions = context
        .spec
        .script_motions(&body.driving)
        .expect("scripts are tried when they are compiled");
    sink.record(&body.chain, how, task.agent, ended);
}

/// Gives up a task that made no progress for too long. Around a target the initiator can always move somewhere, so
/// there the time without coming nearer counts, too.
pub(super) fn give_up_if_stuck<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    sink: &mut EventSink<'_, D>,
) {
    let Initiator { context, task, .. } = initiator;
    let cycles_tried = body.driving.idle.max(body.driving.late);
    if context.world.cycle_start_time_s(u64::from(cycles_tried)) <= task.patience_s {
        return;
    }
    let objection = body.driving.objection;
    let reason = objection.map(|objection| objection.reason);
    let undone = match &task.driver {
        TaskKind::Targets(targets) => 1.0 / targets.places.len() as f64,
        _ => 1.0 - context.world.fraction_done(body, task),
    };
    body.tally.given_up.push(AbandonedSubtask {
        task: body.driving.task,
        part: body.driving.next,
        nearest_m: body.driving.nearest_m,
        undone,
        by: objection.map(|objection| objection.by),
        reason: reason.map(|reason| reason.name().into()),
    });
    match task.driver {
        // Only this target: the next one may be reachable.
        TaskKind::Targets(_) => {
            let by = objection.map_or(task.agent, |objection| objection.by as usize);
            let target = f64::from(body.driving.next);
            let event = sink.new_event(&body.chain, EventKind::TargetGivenUp, by, target);
            sink.events.push(Event { reason, ..event });
            body.plan = None;
            body.driving.start_next_subtask();
        }
        _ => start_next_task(context, body, sink, EventKind::GivenUp),
    }
}
