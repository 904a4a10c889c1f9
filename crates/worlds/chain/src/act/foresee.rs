//! The choice of an initiator that decides for itself, while something approaches: to go as it wants, or to rest.

use super::Initiator;
use super::situation::is_held;
use super::wish::Wish;
use crate::driver::Task;
use crate::motion::escape::{Escaper, Lead};
use crate::rods::chain::Chain;
use crate::rods::geometry::{in_dimensions, sub};
use crate::rods::veto::Source;
use crate::state::Body;

/// Returns whether an initiator gives way to what approaches, because roll-outs tell that the chain is then inside
/// for less time.
pub(super) fn gives_way<const D: usize>(
    who: Initiator<'_, D>,
    body: &mut Body<D>,
    escaper: Option<&Escaper<D>>,
    wish: Wish<D>,
) -> bool {
    let Some(escaper) = escaper else { return false };
    let Some(every) = escaper.chooses_every() else { return false };
    let setting = who.setting;
    match lead_by(who.task, &body.chain, wish) {
        None => body.way_out.set_rests(false),
        Some(lead) if (setting.now + u64::from(setting.slot)).is_multiple_of(every) => {
            let (rules, way_out) = (&setting.world.rules, &mut body.way_out);
            escaper.choose(&body.chain, setting.obstacles, rules, &lead, way_out);
        }
        Some(_) => {}
    }
    body.way_out.rests()
}

/// Returns an initiator's wish to lead; none if it has none, or no choice: operators are obeyed, and chains that are
/// held somewhere move by return passes, which cost too much to be rolled out.
fn lead_by<const D: usize>(task: &Task<D>, chain: &Chain<D>, wish: Wish<D>) -> Option<Lead<D>> {
    if task.source() != Source::Autonomous || is_held(chain) {
        return None;
    }
    let to = match wish {
        Wish::Go(to) => to,
        Wish::Steer(steered) => in_dimensions(steered.pose.at),
        _ => return None,
    };
    Some(Lead { k: task.agent, way_m: sub(to, chain.points()[task.agent]) })
}
