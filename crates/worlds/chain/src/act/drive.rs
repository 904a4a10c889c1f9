//! One cycle of a chain's present task: the move that its driver wants, and its outcome.

use super::desired_move::DesiredMove;
use super::initiator::{move_initiator, wait_for_escape};
use super::lookahead;
use super::orders::{StepOptions, complete_joint_result, execute_ordered_motion, find_joint_order};
use super::plan::{follow_plan, next_waypoint};
use super::task_moves::{InitiatorContext, desired_move};
use super::tasks::{start_next_task, task_end_event};
use super::wheels::{drive_on_wheels, turn_robot};
use super::{ChainContext, ChainCycleState, Initiator};
use crate::driver::TaskKind;
use crate::driver::step_motion::StepMotion;
use crate::state::ChainBodyState;
use crate::trace::IntendedMove;
use sidestep_rods::geometry::convert_dimensions;

/// What inspections show of a move that gives way to an escape.
const WAIT: &str = "wait for what moves";

/// The outcome of a chain's task in a cycle.
pub(super) struct TaskCycleOutcome<const D: usize> {
    /// The motion that external orders asked for.
    pub(super) step: Option<StepMotion<D>>,
    /// Whether its initiator gave way to what comes near.
    pub(super) gives_way: bool,
}

pub(super) fn run_task_cycle<const D: usize>(
    context: ChainContext<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    lead_context: &InitiatorContext<'_, D>,
) -> TaskCycleOutcome<D> {
    let mut outcome = TaskCycleOutcome { step: None, gives_way: lead_context.is_pressed };
    let Some(task) = context.task(acting.body) else { return outcome };
    let initiator = Initiator { context, task };
    // Whether this cycle uses up the time of the task.
    let is_late = context.world.cycle_start_time_s(acting.body.driving.cycles + 1) >= task.lasts_s;
    acting.body.driving.cycles += 1;
    let present = acting.body.driving.task;
    let desired = desired_move(initiator, acting, lead_context);
    let escaper = lead_context.escaping.escaper.as_deref();
    outcome.gives_way |= lookahead::should_yield(initiator, acting.body, escaper, desired);
    let wanted = intended_move(initiator, acting.body, desired, outcome.gives_way);
    acting.sink.record_in_trace(|trace| trace.intended = Some(wanted));
    let options =
        StepOptions { gives_way: outcome.gives_way, goes_far: lead_context.inputs.orders.goes_far };
    let joint_order = find_joint_order(initiator, acting.body, lead_context.inputs.orders);
    execute(initiator, acting, desired, options);
    if let Some(order) = &joint_order {
        complete_joint_result(initiator, acting.body, order);
    } else if matches!(task.driver, TaskKind::External) {
        // Of an order to joints in the place of which another one came.
        acting.body.plan = None;
    }
    if let DesiredMove::Obey(step) = desired {
        outcome.step = Some(step);
    }
    // A task that was given up in this cycle has ended already, and the next one has just begun.
    let is_over = is_late && acting.body.driving.task == present;
    if is_over || matches!(desired, DesiredMove::Done) {
        let how = task_end_event(task, acting.body);
        start_next_task(context, acting.body, &mut acting.sink, how);
    }
    outcome
}

/// Carries out the move that the initiator wants.
fn execute<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    desired: DesiredMove<D>,
    options: StepOptions,
) {
    match desired {
        DesiredMove::Rest | DesiredMove::Done => {}
        DesiredMove::Go(_) | DesiredMove::Return(_) | DesiredMove::Steer(_)
            if options.gives_way =>
        {
            wait_for_escape(initiator, acting)
        }
        DesiredMove::Return(to) => {
            // On the way back to its robot the connector must not turn the heading that the robot will resume.
            let ahead = acting.body.driving.ahead;
            move_initiator(initiator, acting, to);
            acting.body.driving.ahead = ahead;
        }
        DesiredMove::Face(heading_rad) => turn_robot(acting.body, heading_rad),
        DesiredMove::Go(to) => {
            move_initiator(initiator, acting, to);
        }
        DesiredMove::Follow => follow_plan(initiator, acting.body, acting.before),
        DesiredMove::Steer(steered) => drive_on_wheels(initiator, acting, steered),
        DesiredMove::Obey(step) => execute_ordered_motion(initiator, acting, &step, options),
    }
}

/// Describes a move for an inspection.
fn intended_move<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &ChainBodyState<D>,
    desired: DesiredMove<D>,
    gives_way: bool,
) -> IntendedMove<D> {
    let mut connector = initiator.task.agent;
    let (words, to) = match desired {
        DesiredMove::Rest => ("rest", None),
        DesiredMove::Go(to) if gives_way => (WAIT, Some(to)),
        DesiredMove::Go(to) => ("go", Some(to)),
        DesiredMove::Return(to) => ("go back to its robot", Some(to)),
        DesiredMove::Face(_) => ("turn to where it faced", None),
        DesiredMove::Obey(step) => {
            connector = step.first;
            (if gives_way { WAIT } else { "go, as ordered" }, Some(step.to[0]))
        }
        DesiredMove::Follow => ("follow its plan", next_waypoint(initiator, body)),
        DesiredMove::Steer(steered) => ("steer", Some(convert_dimensions(steered.pose.at))),
        DesiredMove::Done => ("its task is done", None),
    };
    IntendedMove { connector, words, to }
}
