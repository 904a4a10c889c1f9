//! The present task of a chain, for one cycle: the wish of its driver, and what comes of it.

use super::desired_move::{DesiredMove, InitiatorContext, desired_move};
use super::initiator::{move_initiator, wait_for_escape};
use super::lookahead;
use super::orders::{StepOptions, execute_step};
use super::plan::{follow_plan, next_waypoint};
use super::tasks::{end_event, start_next_task};
use super::wheels::{drive_on_wheels, turn_robot};
use super::{ActState, ChainContext, Initiator};
use crate::driver::step_motion::StepMotion;
use crate::state::Body;
use crate::trace::IntendedMove;
use sidestep_rods::geometry::with_dimensions;

/// The words for a wish that is put off.
const WAIT: &str = "wait for what moves";

/// The outcome of a chain's task in a cycle.
pub(super) struct TaskOutcome<const D: usize> {
    /// The errand on which orders from outside have sent it.
    pub(super) errand: Option<StepMotion<D>>,
    /// Whether its initiator gave way to what comes near.
    pub(super) gives_way: bool,
}

/// Carries out the present task.
pub(super) fn run_task<const D: usize>(
    setting: ChainContext<'_, D>,
    acting: &mut ActState<'_, D>,
    guide: &InitiatorContext<'_, D>,
) -> TaskOutcome<D> {
    let mut driven = TaskOutcome { errand: None, gives_way: guide.is_pressed };
    let Some(task) = setting.task(acting.body) else { return driven };
    let who = Initiator { setting, task, follows: guide.follows };
    let is_late = setting.world.start_time_s(acting.body.driving.cycles + 1) >= task.lasts_s;
    acting.body.driving.cycles += 1;
    let present = acting.body.driving.task;
    let wish = desired_move(who, acting, guide);
    let escaper = guide.escaping.escaper.as_deref();
    driven.gives_way |= lookahead::should_yield(who, acting.body, escaper, wish);
    let wanted = intended_move(who, acting.body, wish, driven.gives_way);
    acting.told.trace(|notes| notes.wish = Some(wanted));
    let manner = StepOptions { gives_way: driven.gives_way, goes_far: guide.heard.orders.goes_far };
    execute(who, acting, wish, manner);
    if let DesiredMove::Obey(errand) = wish {
        driven.errand = Some(errand);
    }
    // One that was given up in this cycle has ended already, and the next one has just begun.
    let is_over = is_late && acting.body.driving.task == present;
    if is_over || matches!(wish, DesiredMove::Done) {
        let how = end_event(task, acting.body);
        start_next_task(setting, acting.body, &mut acting.told, how);
    }
    driven
}

/// Lets the initiator do as it wishes.
fn execute<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut ActState<'_, D>,
    wish: DesiredMove<D>,
    manner: StepOptions,
) {
    match wish {
        DesiredMove::Rest | DesiredMove::Done => {}
        DesiredMove::Go(_) | DesiredMove::Return(_) | DesiredMove::Steer(_) if manner.gives_way => {
            wait_for_escape(who, acting)
        }
        DesiredMove::Return(to) => {
            let ahead = acting.body.driving.ahead;
            move_initiator(who, acting, to);
            acting.body.driving.ahead = ahead;
        }
        DesiredMove::Face(heading_rad) => turn_robot(acting.body, heading_rad),
        DesiredMove::Go(to) => {
            move_initiator(who, acting, to);
        }
        DesiredMove::Follow => follow_plan(who, acting.body, acting.before),
        DesiredMove::Steer(steered) => drive_on_wheels(who, acting, steered),
        DesiredMove::Obey(errand) => execute_step(who, acting, &errand, manner),
    }
}

/// Returns a wish in words.
fn intended_move<const D: usize>(
    who: Initiator<'_, D>,
    body: &Body<D>,
    wish: DesiredMove<D>,
    gives_way: bool,
) -> IntendedMove<D> {
    let mut of = who.task.agent;
    let (words, to) = match wish {
        DesiredMove::Rest => ("rest", None),
        DesiredMove::Go(to) if gives_way => (WAIT, Some(to)),
        DesiredMove::Go(to) => ("go", Some(to)),
        DesiredMove::Return(to) => ("go back to its robot", Some(to)),
        DesiredMove::Face(_) => ("turn to where it faced", None),
        DesiredMove::Obey(errand) => {
            of = errand.first;
            (if gives_way { WAIT } else { "go, as ordered" }, Some(errand.to[0]))
        }
        DesiredMove::Follow => ("follow its plan", next_waypoint(who, body)),
        DesiredMove::Steer(steered) => ("steer", Some(with_dimensions(steered.pose.at))),
        DesiredMove::Done => ("its task is done", None),
    };
    IntendedMove { of, words, to }
}
