//! Escape by a simultaneous solve of all constraints of a tick.
//!
//! ```text
//! solve.rs          new positions of all parts: contacts.rs, lengths.rs, odometer.rs, and the hard constraints.rs
//! escape_plan.rs    exits for parts that are caught (at_risk.rs), of which exit_search.rs finds the shortest
//! work.rs           the work that rollouts may take
//! leader_choice.rs  the leader's choice before any part is caught: rollouts of its motion and of resting
//! rollout.rs        copies of a part of the chain on which motions are tried
//! posture.rs        positions under trial
//! ```
//!
//! One part that escapes alone is held by its neighbors, which are not asked to move. Here all of them
//! move, parts of the chain push each other, and approaching obstacles are avoided by a margin as wide as the
//! distance that they travel in the look-ahead. If a part is caught all the same, because obstacles close like tongs
//! or the chain is taut, it leaves through one of them, by the exit that rollouts find shortest.

mod at_risk;
mod constraints;
mod contacts;
mod escape_plan;
mod exit_search;
mod leader_choice;
mod lengths;
mod odometer;
#[cfg(test)]
mod pinch;
mod posture;
mod rollout;
mod solve;
mod solve_input;
#[cfg(test)]
mod tests;
mod work;

use super::threat::Threat;
use super::{EscapeMargin, EscapeReport, ObstacleEscapeInput, ObstacleEscapeRules, TrappedPart};
pub use escape_plan::EscapePlan;
use leader_choice::should_leader_rest;
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Veto, VetoReason};
use solve::EscapeSolver;
use solve_input::{EscapeSolveInput, ExitDirection, SoftConstraints};
pub(crate) use solve_input::{LeadMotion, LeaderChoice};

/// Escapes of all parts of a chain at once. It owns its buffers.
#[derive(Debug, Clone)]
pub(super) struct SimultaneousEscape<const D: usize> {
    rules: ObstacleEscapeRules,
    solver: EscapeSolver<D>,
    best: Vec<Point<D>>,
    start: Vec<Point<D>>,
}

/// Most steps of a tick, each at most as long as the thinnest part, so that no obstacle is tunneled through.
const MAX_STEPS: f64 = 8.0;
/// Rounds of a solve with margins, and rounds without: twice as many as in rollouts, because a solve of the tick itself is
/// made once. Most end earlier, as soon as corrections are small.
const ROUNDS: [usize; 2] = [24, 40];
/// Fraction of its maximum speed from which on a chain counts as pressed: below all of it, because a solve leaves a reserve
/// and corrections of rods take some of the way back.
const PRESSED_SPEED_FRACTION: f64 = 0.9;
/// Penetration that counts as contact, meters.
const TOUCH_M: f64 = 1e-9;

impl<const D: usize> SimultaneousEscape<D> {
    pub(super) fn new(rules: ObstacleEscapeRules) -> Self {
        Self { rules, solver: EscapeSolver::default(), best: Vec::new(), start: Vec::new() }
    }

    pub(super) fn escape(
        &mut self,
        tick: &mut ObstacleEscapeInput<'_, D>,
        escape_plan: &mut EscapePlan,
    ) -> EscapeReport<D> {
        let ObstacleEscapeInput { chain, obstacles, start, .. } = tick;
        let rules = &tick.propagator.rules;
        // A step of the chain is a quarter of its thinnest part.
        let thinnest_m = 4.0 * chain.step_m();
        let max_step_m = self.rules.max_step_m().min(MAX_STEPS * thinnest_m);
        let steps = (max_step_m / thinnest_m).ceil().max(1.0);
        let mut report = EscapeReport::default();
        escape_plan.start_tick(self.rules.dt_s);
        for step in 1..=steps as usize {
            let max_step_m = max_step_m * step as f64 / steps;
            // Taken out, because the solve borrows the start and changes everything else.
            let mut at = std::mem::take(&mut self.start);
            at.clear();
            at.extend_from_slice(start);
            let input = EscapeSolveInput { chain, obstacles, rules, start: &at, max_step_m };
            let has_moved = self.find_step_positions(&input, escape_plan, &mut report);
            if has_moved {
                chain.points_mut().copy_from_slice(&self.best);
            }
            self.start = at;
            // Further steps are for parts that are still inside.
            if !has_moved || report.left.is_none() {
                break;
            }
        }
        let moves_m = start.iter().zip(chain.points()).map(|(a, b)| distance(*a, *b));
        let longest_m = moves_m.fold(0.0, f64::max);
        report.is_pressed = report.left.is_some()
            || escape_plan.is_exiting()
            || longest_m > PRESSED_SPEED_FRACTION * max_step_m;
        report
    }

    /// Tries both on copies; the chain stays as it is.
    pub(super) fn should_leader_rest(
        &self,
        choice: &LeaderChoice<'_, D>,
        escape_plan: &mut EscapePlan,
    ) -> bool {
        let LeaderChoice { chain, obstacles, rules, lead } = *choice;
        let max_step_m = self.rules.max_step_m();
        let input = EscapeSolveInput { chain, obstacles, rules, start: chain.points(), max_step_m };
        should_leader_rest(&self.rules, &input, &lead, escape_plan)
    }

    /// Finds the positions of one step, in `best`; returns whether any part moves.
    fn find_step_positions(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        escape_plan: &mut EscapePlan,
        report: &mut EscapeReport<D>,
    ) -> bool {
        let margin = self.rules.look_ahead_margin();
        if !self.solver.find_contacts(input, margin) {
            escape_plan.reset_exit();
            return false;
        }
        escape_plan.clear_if_passed(input, &self.solver);
        let (before_m, nearest) = self.solver.min_gap(input, input.chain.points());
        if before_m >= margin_around(input, margin, nearest) && !escape_plan.is_exiting() {
            escape_plan.reset_search();
            return false;
        }
        let mut gap_m = self.attempt(input, escape_plan.exit_direction(), before_m);
        // An exit is searched for only where the plain escape has left the chain in danger.
        if escape_plan.plan_exit(&self.rules, input, &self.solver, gap_m) {
            gap_m = self.attempt(input, escape_plan.exit_direction(), before_m);
        }
        self.fill_report(input, gap_m, nearest, report)
    }

    /// Solves with the margins of the look-ahead and, if that leaves a part inside, without; the
    /// better one is in `best`. Returns its least gap, meters; the present one if nothing is better.
    fn attempt(
        &mut self,
        input: &EscapeSolveInput<'_, D>,
        through: Option<ExitDirection<D>>,
        before_m: f64,
    ) -> f64 {
        self.best.clear();
        self.best.extend_from_slice(input.chain.points());
        // On the way out through an obstacle a part gets deeper first, so depth is no measure.
        let mut best_m = if through.is_some() { f64::NEG_INFINITY } else { before_m };
        for margin in [self.rules.look_ahead_margin(), EscapeMargin::NONE] {
            if !self.solver.solve(input, &SoftConstraints { margin, through, rounds: ROUNDS }) {
                continue;
            }
            let (gap_m, _) = self.solver.min_gap(input, &self.solver.points);
            if gap_m > best_m || gap_m >= -TOUCH_M {
                best_m = gap_m;
                self.best.copy_from_slice(&self.solver.points);
            }
            if gap_m >= -TOUCH_M {
                break;
            }
        }
        if best_m == f64::NEG_INFINITY { before_m } else { best_m }
    }

    fn fill_report(
        &self,
        input: &EscapeSolveInput<'_, D>,
        gap_m: f64,
        nearest: Option<Threat>,
        report: &mut EscapeReport<D>,
    ) -> bool {
        let moved = self.best != input.chain.points();
        if let Some(threat) = nearest.filter(|_| moved) {
            report.moves = 1;
            let obstacle = input.obstacles.moving()[threat.mover].id;
            report.first = report.first.or(Some((threat.part.connector(), obstacle)));
        }
        report.deepest_m = 0.0;
        report.left = None;
        let deepest = self.solver.min_gap(input, &self.best).1;
        if let Some(threat) = deepest.filter(|_| gap_m < -TOUCH_M) {
            let k = threat.part.connector();
            let goes_m = distance(input.start[k], self.best[k]);
            let is_capped = goes_m > PRESSED_SPEED_FRACTION * input.max_step_m;
            report.vetoes = 1;
            report.capped = usize::from(is_capped);
            let reason = if is_capped { VetoReason::StepLimit } else { VetoReason::Inside };
            let obstacle = input.obstacles.moving()[threat.mover].id;
            let reached = self.best[k];
            let veto = Veto { by: k, from: k, reason, obstacle: Some(obstacle), reached };
            report.deepest_m = -gap_m;
            report.left = Some(TrappedPart { part: threat.part, obstacle, veto: Some(veto) });
        }
        moved
    }
}

/// Returns the margin around the obstacle of a threat, meters.
fn margin_around<const D: usize>(
    input: &EscapeSolveInput<'_, D>,
    margin: EscapeMargin,
    threat: Option<Threat>,
) -> f64 {
    let mover = threat.map(|threat| &input.obstacles.moving()[threat.mover]);
    mover.map_or(0.0, |mover| margin.required_gap_m(mover))
}
