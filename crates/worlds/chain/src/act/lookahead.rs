//! The choice of an autonomous initiator, while something approaches: to move as it wants, or to rest.

use super::Initiator;
use super::desired_move::DesiredMove;
use super::situation::has_held_connector;
use crate::driver::Task;
use crate::motion::escape::{LeadMotion, LeaderChoice, ObstacleEscaper};
use crate::state::ChainBodyState;
use sidestep_rods::geometry::{convert_dimensions, sub};
use sidestep_rods::{Chain, RequestSource};

/// Returns whether an initiator rests for what approaches, because rollouts show that the chain is then inside it
/// for less time.
pub(super) fn should_yield<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    escaper: Option<&ObstacleEscaper<D>>,
    desired: DesiredMove<D>,
) -> bool {
    let Some(escaper) = escaper else { return false };
    let Some(every) = escaper.choice_interval_ticks() else { return false };
    let context = initiator.context;
    match desired_lead(initiator.task, &body.chain, desired) {
        None => body.escape_plan.set_resting(false),
        // By slot, so that not all chains make their rollouts in the same cycle.
        Some(lead) if (context.now + u64::from(context.slot)).is_multiple_of(every) => {
            let choice = LeaderChoice {
                chain: &body.chain,
                obstacles: context.obstacles,
                rules: &context.world.rules,
                lead,
            };
            let rests = escaper.should_leader_rest(&choice, &mut body.escape_plan);
            body.escape_plan.set_resting(rests);
        }
        // Between two choices the last one holds.
        Some(_) => {}
    }
    body.escape_plan.is_resting()
}

/// Returns the motion that an initiator wants to lead; none if it wants none, or has no choice: operators are obeyed,
/// and chains that are held somewhere move by return passes, which cost too much to be rolled out.
fn desired_lead<const D: usize>(
    task: &Task<D>,
    chain: &Chain<D>,
    desired: DesiredMove<D>,
) -> Option<LeadMotion<D>> {
    if task.request_source() != RequestSource::Autonomous || has_held_connector(chain) {
        return None;
    }
    let to = match desired {
        DesiredMove::Go(to) => to,
        DesiredMove::Steer(steered) => convert_dimensions(steered.pose.at),
        _ => return None,
    };
    Some(LeadMotion { k: task.agent, displacement_m: sub(to, chain.points()[task.agent]) })
}
