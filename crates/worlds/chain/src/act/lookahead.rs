//! The choice of an initiator that decides for itself, while something approaches: to go as it wants, or to rest.

use super::Initiator;
use super::desired_move::DesiredMove;
use super::situation::is_held;
use crate::driver::Task;
use crate::motion::escape::{Escaper, LeadMotion};
use crate::state::Body;
use sidestep_rods::geometry::{sub, with_dimensions};
use sidestep_rods::{Chain, RequestSource};

/// Returns whether an initiator gives way to what approaches, because roll-outs tell that the chain is then inside
/// for less time.
pub(super) fn should_yield<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    escaper: Option<&Escaper<D>>,
    wish: DesiredMove<D>,
) -> bool {
    let Some(escaper) = escaper else { return false };
    let Some(every) = escaper.choice_interval_ticks() else { return false };
    let setting = who.setting;
    match desired_lead(who.task, &body.chain, wish) {
        None => body.way_out.set_resting(false),
        Some(lead) if (setting.now + u64::from(setting.slot)).is_multiple_of(every) => {
            let (rules, way_out) = (&setting.world.rules, &mut body.way_out);
            escaper.choose_leader_action(&body.chain, setting.obstacles, rules, &lead, way_out);
        }
        Some(_) => {}
    }
    body.way_out.is_resting()
}

/// Returns an initiator's wish to lead; none if it has none, or no choice: operators are obeyed, and chains that are
/// held somewhere move by return passes, which cost too much to be rolled out.
fn desired_lead<const D: usize>(
    task: &Task<D>,
    chain: &Chain<D>,
    wish: DesiredMove<D>,
) -> Option<LeadMotion<D>> {
    if task.source() != RequestSource::Autonomous || is_held(chain) {
        return None;
    }
    let to = match wish {
        DesiredMove::Go(to) => to,
        DesiredMove::Steer(steered) => with_dimensions(steered.pose.at),
        _ => return None,
    };
    Some(LeadMotion { k: task.agent, way_m: sub(to, chain.points()[task.agent]) })
}
