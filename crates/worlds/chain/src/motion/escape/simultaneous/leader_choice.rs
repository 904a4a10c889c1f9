//! The leader's choice before any part is caught: to move as it wants, or to rest.
//!
//! A leader that takes its chain between obstacles that close on it cannot pull it out again in time, though
//! resting some seconds earlier would often have been enough. So the motion that the leader wants is rolled out at
//! intervals, and where that brings parts inside, resting is, too: it rests if the chain is then inside for less time. Other
//! headings in its place gain nothing: with seven of them chains are inside for longer (1.1 in place of 0.9 % of the
//! steps among 8 discs), because leaders that turn to and fro get nowhere.

use super::super::EscapeRules;
use super::rollout::{IMPROVEMENT_FACTOR, Rollout, RolloutOptions};
use super::solve_input::{LeadMotion, SolveInput};

/// Connectors to either side of the leader that rollouts include.
const SIDE_CONNECTORS: usize = 48;
/// Limit on the work of a choice: ticks of rollouts times connectors in them.
const MAX_WORK: usize = 40_000;
/// Ticks inside that resting must save.
const MIN_BENEFIT_TICKS: f64 = 0.5;

/// Returns whether a leader should rest.
pub(super) fn should_rest<const D: usize>(
    rules: &EscapeRules,
    input: &SolveInput<'_, D>,
    lead: &LeadMotion<D>,
) -> bool {
    let from = lead.k.saturating_sub(SIDE_CONNECTORS);
    let to = (lead.k + SIDE_CONNECTORS).min(input.chain.points().len() - 1);
    let rollout = Rollout::cut(rules, input, from..=to).filter(Rollout::is_approached);
    let Some(rollout) = rollout else { return false };
    let mut left = rollout.ticks_for(MAX_WORK);
    let tried = |way_m| RolloutOptions::with_lead(LeadMotion { k: lead.k - from, way_m });
    let as_wanted = rollout.cost(&tried(lead.way_m), f64::INFINITY, &mut left);
    let enough = IMPROVEMENT_FACTOR * as_wanted - MIN_BENEFIT_TICKS;
    enough > 0.0 && rollout.cost(&tried([0.0; D]), enough, &mut left) < enough
}
