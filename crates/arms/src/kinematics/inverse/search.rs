//! Descents from many postures, and the reason if none leads to the target.

use super::super::serial::{JointMotionKind, SerialChain};
use super::super::skeleton::Skeleton;
use super::criteria::PostureEvaluator;
use super::descent::{Descender, DescentLimits, DescentResult};
use super::goal::ArmGoal;
use super::guide;
use super::result::{IkFailure, IkResult, IkSolution};
use super::step::{IkStepper, JointRanges};
use crate::ik::IkEngine;
use sidestep_kernel::Seed;
use sidestep_kernel::geometry::{norm, sub};
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use std::f64::consts::PI;

/// A stream of its own, so that no other draw shifts these.
const START: Purpose = Purpose(0x1D);
/// Restarts if no answer can be expected, to come near or to find the reason.
pub(super) const FEW_RESTARTS: usize = 8;

pub(super) struct IkSearch<'a> {
    pub(super) skeleton: &'a Skeleton,
    pub(super) by: Descender<'a>,
}

/// The best of several descents.
pub(super) struct BestDescent {
    pub(super) descent: DescentResult,
    /// Steps of all descents, also of those that were not kept.
    steps: usize,
    pub(super) starts: usize,
    pub(super) is_met: bool,
}

/// The postures that were found, the nearest to the start first, and the effort.
pub(super) struct SolutionSet {
    pub(super) postures: Vec<IkSolution>,
    pub(super) steps: usize,
    pub(super) starts: usize,
}

impl<'a> IkSearch<'a> {
    pub(super) fn new(chain: &'a SerialChain, skeleton: &'a Skeleton, goal: &'a ArmGoal) -> Self {
        let bounds = if goal.ignore_limits {
            JointRanges::unlimited(chain)
        } else {
            JointRanges::from_chain(chain)
        };
        let criteria = PostureEvaluator::new(chain, skeleton, goal);
        let by = Descender { chain, goal, criteria, bounds, stepper: IkStepper::default() };
        Self { skeleton, by }
    }

    pub(super) fn run(mut self, start: &[f64]) -> IkResult {
        let guided = self.solve_by_guide(start);
        let engine = if guided.is_some() { IkEngine::Chain } else { IkEngine::Dls };
        let (first, steps) = guided.unwrap_or_else(|| (start.to_vec(), 0));
        let out_of_reach = self.out_of_reach(start);
        if self.by.goal.is_multi_solution() && out_of_reach.is_none() {
            let found = self.find_solutions(&first, start);
            if let Some(answer) = result_from_solutions(found, steps) {
                return answer;
            }
        }
        let max_restarts = if out_of_reach.is_some() { FEW_RESTARTS } else { usize::MAX };
        let mut best = self.find_best(first, self.by.goal.restarts.min(max_restarts));
        best.steps += steps;
        // The connectors' solution was only the first of the starts.
        let engine = if best.starts == 1 { engine } else { IkEngine::Dls };
        let reason =
            (!best.is_met).then(|| out_of_reach.unwrap_or_else(|| self.find_failure_reason(&best)));
        self.result(best, engine, reason)
    }

    /// Returns the connectors' solution and its steps, if that engine is asked for and finds one.
    fn solve_by_guide(&self, start: &[f64]) -> Option<(Vec<f64>, usize)> {
        let Descender { chain, goal, .. } = &self.by;
        let is_asked = goal.engine == IkEngine::Chain && goal.asked.has_whole_position();
        is_asked.then(|| guide::find_posture(chain, self.skeleton, goal, start)).flatten()
    }

    /// Descends from `first` and then from random postures, until the goal is met; in the end from
    /// the best of all, patiently.
    pub(super) fn find_best(&mut self, first: Vec<f64>, restarts: usize) -> BestDescent {
        let mut descent = self.by.descend(first, DescentLimits::BRIEF);
        let mut steps = descent.steps;
        for k in 1..=restarts {
            if self.by.is_met(&descent.evaluation) {
                return BestDescent { descent, steps, starts: k, is_met: true };
            }
            let result = self.by.descend(self.random_posture(k), DescentLimits::BRIEF);
            steps += result.steps;
            if self.by.is_met(&result.evaluation)
                || result.evaluation.merit() < descent.evaluation.merit()
            {
                descent = result;
            }
        }
        if !self.by.is_met(&descent.evaluation) {
            descent = self.by.descend(descent.values, DescentLimits::PATIENT);
            steps += descent.steps;
        }
        let is_met = self.by.is_met(&descent.evaluation);
        BestDescent { descent, steps, starts: restarts + 1, is_met }
    }

    fn result(&self, best: BestDescent, engine: IkEngine, reason: Option<IkFailure>) -> IkResult {
        let BestDescent { descent, steps, starts, is_met } = best;
        let IkSolution { values, error_m, error_rad } = self.solution(descent.values);
        IkResult {
            reached: is_met,
            error_m,
            error_rad,
            values,
            others: Vec::new(),
            engine,
            iterations: steps,
            starts,
            reason,
        }
    }

    /// Returns random posture number `index` inside the limits: the same one for the same seed.
    pub(super) fn random_posture(&self, index: usize) -> Vec<f64> {
        let Descender { chain, goal, bounds, .. } = &self.by;
        let mut draws = Streams::new(Seed(goal.seed)).draws(0, index as u64, START);
        let variables = chain.variables.iter().zip(&bounds.ranges);
        variables.map(|(v, &range)| self.draw_value(v.motion, range, &mut draws)).collect()
    }

    fn draw_value(
        &self,
        motion: JointMotionKind,
        [lower, upper]: [f64; 2],
        draws: &mut Draws,
    ) -> f64 {
        let reach_m = self.skeleton.reach_m.max(f64::MIN_POSITIVE);
        // A range without ends becomes a full turn, or what the arm reaches to either side.
        let half = if motion == JointMotionKind::Turn { PI } else { reach_m };
        let (lower, upper) = match (lower.is_finite(), upper.is_finite()) {
            (true, true) => (lower, upper),
            (true, false) => (lower, lower + 2.0 * half),
            (false, true) => (upper - 2.0 * half, upper),
            (false, false) => (-half, half),
        };
        lower + draws.uniform() * (upper - lower)
    }

    /// Returns a reason that follows from the rods alone, if they rule the target out.
    fn out_of_reach(&self, start: &[f64]) -> Option<IkFailure> {
        let Descender { chain, goal, .. } = &self.by;
        let rods = &self.skeleton.rods;
        let connectors = chain.connector_positions(self.skeleton, &chain.forward_kinematics(start));
        let far_m = norm(sub(goal.target.origin_m, connectors[0]));
        let reach_m: f64 = rods.iter().map(|rod| rod.max_m).sum();
        let longest_m = rods.iter().map(|rod| rod.min_m + rod.max_m).fold(0.0, f64::max);
        let hole_m = longest_m - reach_m;
        // The distance means something only if all of it counts, and the first connector is fixed in
        // the base.
        if !goal.asked.has_whole_position() || self.skeleton.connectors[0].first != 0 {
            return None;
        }
        if far_m > reach_m + goal.tolerance_m {
            return Some(IkFailure::TooFar { far_m, reach_m });
        }
        (far_m < hole_m - goal.tolerance_m).then_some(IkFailure::TooNear { far_m, hole_m })
    }
}

/// Returns the answer of several postures, if there is one; `steps` are those made before.
fn result_from_solutions(found: SolutionSet, steps: usize) -> Option<IkResult> {
    let mut postures = found.postures.into_iter();
    let IkSolution { values, error_m, error_rad } = postures.next()?;
    Some(IkResult {
        reached: true,
        error_m,
        error_rad,
        values,
        others: postures.collect(),
        engine: IkEngine::Dls,
        iterations: steps + found.steps,
        starts: found.starts,
        reason: None,
    })
}
