//! The leader's choice before any part is caught: to move as it wants, or to rest.
//!
//! A leader that takes its chain between obstacles that close on it cannot pull it out again in time, though
//! resting some seconds earlier would often have been enough. So the motion that the leader wants is rolled out at
//! intervals, and where that brings parts inside, resting is, too: it rests if the chain is then inside for less time. Other
//! headings in its place gain nothing: with seven of them chains are inside for longer (1.1 in place of 0.9 % of the
//! steps among 8 discs), because leaders that turn to and fro get nowhere.

use super::super::ObstacleEscapeRules;
use super::escape_plan::EscapePlan;
use super::rollout::{IMPROVEMENT_FACTOR, MIN_BENEFIT_TICKS, Rollout, RolloutOptions};
use super::solve_input::{EscapeSolveInput, LeadMotion};

/// Connectors to either side of the leader that rollouts include: many more than for an exit, because the leader pulls
/// those far behind it between obstacles, too.
const SIDE_CONNECTORS: usize = 48;
/// Least reserve of work with which a choice begins: that of a whole rollout of 97 connectors which are in contact half of
/// the time. With less, the last choice holds.
const CHOICE_WORK: u64 = 300_000;

/// Resting is rolled out only where moving brings parts inside, because rollouts are all the cost
/// of a choice.
pub(super) fn should_leader_rest<const D: usize>(
    rules: &ObstacleEscapeRules,
    input: &EscapeSolveInput<'_, D>,
    lead: &LeadMotion<D>,
    escape_plan: &mut EscapePlan,
) -> bool {
    let mut left = escape_plan.reserve.left();
    if left < CHOICE_WORK {
        return escape_plan.is_resting();
    }
    let from = lead.k.saturating_sub(SIDE_CONNECTORS);
    let to = (lead.k + SIDE_CONNECTORS).min(input.chain.points().len() - 1);
    let rollout =
        Rollout::from_connector_range(rules, input, from..=to).filter(Rollout::is_approached);
    let Some(rollout) = rollout else { return false };
    let wanted = LeadMotion { k: lead.k - from, displacement_m: lead.displacement_m };
    let rest = LeadMotion { displacement_m: [0.0; D], ..wanted };
    let wanted_cost = rollout.cost(&RolloutOptions::with_lead(wanted), f64::INFINITY, &mut left);
    let enough = IMPROVEMENT_FACTOR * wanted_cost - MIN_BENEFIT_TICKS;
    let rests =
        enough > 0.0 && rollout.cost(&RolloutOptions::with_lead(rest), enough, &mut left) < enough;
    escape_plan.reserve.set_left(left);
    rests
}
