//! Several postures that reach a target, and the nearest of them to the start.

use super::super::serial::JointMotionKind;
use super::descent::{DescentLimits, DescentResult};
use super::result::IkSolution;
use super::search::{IkSearch, SolutionSet};
use sidestep_kernel::math::wrap_angle;
use std::f64::consts::TAU;

/// Largest number of steps toward the start. Each halves the distance while that works, so that few are used.
const MAX_STEPS: usize = 30;
/// Length of the first step, as a fraction of the distance to the start.
const FIRST_FRACTION: f64 = 0.5;
/// Fraction of the distance below which no further step is tried.
const MIN_FRACTION: f64 = 0.02;
/// Least relative reduction of the squared distance that counts as a gain.
const MIN_GAIN: f64 = 1e-4;

impl IkSearch<'_> {
    /// Descends from `first` and from random postures, and keeps the postures that meet the goal and
    /// are distinct from all before.
    pub(super) fn find_solutions(&mut self, first: &[f64], start: &[f64]) -> SolutionSet {
        let wanted = self.by.goal.solutions;
        let nearest = self.by.goal.nearest;
        let mut found: Vec<Vec<f64>> = Vec::new();
        let mut steps = 0;
        let mut starts = 0;
        for k in 0..=self.by.goal.restarts {
            let from = if k == 0 { first.to_vec() } else { self.random_posture(k) };
            let mut result = self.by.descend(from, DescentLimits::BRIEF);
            steps += result.steps;
            starts = k + 1;
            if !self.by.is_met(&result.evaluation) {
                continue;
            }
            self.unwind_toward(&mut result.values, start);
            if nearest {
                result = self.move_toward_start_posture(result, start, &mut steps);
            }
            match found.iter().position(|other| !self.is_distinct(other, &result.values)) {
                None => found.push(result.values),
                Some(same)
                    if self.squared_distance(&result.values, start)
                        < self.squared_distance(&found[same], start) =>
                {
                    found[same] = result.values;
                }
                Some(_) => {}
            }
            if found.len() == wanted && !nearest {
                break;
            }
        }
        found.sort_by(|a, b| {
            self.squared_distance(a, start).total_cmp(&self.squared_distance(b, start))
        });
        found.truncate(wanted);
        let postures = found.into_iter().map(|values| self.solution(values)).collect();
        SolutionSet { postures, steps, starts }
    }

    /// Returns a posture with its errors by forward kinematics.
    pub(super) fn solution(&self, values: Vec<f64>) -> IkSolution {
        let tip = self.by.chain.forward_kinematics(&values).tip;
        let (error_m, error_rad) = self.by.criteria.tip_errors(&tip);
        IkSolution { values, error_m, error_rad }
    }

    /// Moves a posture toward the start, as far as the goal allows: each step goes a fraction of the
    /// distance, and then descends to the nearest posture that meets the goal.
    fn move_toward_start_posture(
        &mut self,
        mut at: DescentResult,
        start: &[f64],
        steps: &mut usize,
    ) -> DescentResult {
        let mut fraction = FIRST_FRACTION;
        let mut away2 = self.squared_distance(&at.values, start);
        for _ in 0..MAX_STEPS {
            if fraction < MIN_FRACTION {
                break;
            }
            let toward =
                at.values.iter().zip(start).map(|(from, to)| from + fraction * (to - from));
            let mut result = self.by.descend(toward.collect(), DescentLimits::BRIEF);
            *steps += result.steps;
            self.unwind_toward(&mut result.values, start);
            let result_away2 = self.squared_distance(&result.values, start);
            if self.by.is_met(&result.evaluation) && result_away2 < (1.0 - MIN_GAIN) * away2 {
                at = result;
                away2 = result_away2;
            } else {
                fraction *= 0.5;
            }
        }
        at
    }

    /// Turns joints by full turns to be nearest to the start, inside their limits.
    fn unwind_toward(&self, values: &mut [f64], start: &[f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            let [lower, upper] = self.by.bounds.ranges[i];
            if !self.by.is_periodic(i) {
                continue;
            }
            let nearest = start[i] + wrap_angle(*value - start[i]);
            let choices = [nearest, nearest - TAU, nearest + TAU];
            let inside = choices.into_iter().find(|x| (lower..=upper).contains(x));
            *value = inside.unwrap_or(*value);
        }
    }

    fn is_distinct(&self, a: &[f64], b: &[f64]) -> bool {
        self.differences(a, b, wrap_angle).any(|by| by.abs() >= self.by.goal.apart)
    }

    /// Returns the square of the distance of two postures: of all joints' differences.
    fn squared_distance(&self, a: &[f64], b: &[f64]) -> f64 {
        self.differences(a, b, |by| by).map(|by| by * by).sum()
    }

    /// Returns the differences of two postures: angles through `turned` if they are round, and
    /// slides as the angle that moves the tip as far at the arm's full reach.
    fn differences<'a>(
        &'a self,
        a: &'a [f64],
        b: &'a [f64],
        turned: impl Fn(f64) -> f64 + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let reach_m = self.skeleton.reach_m.max(f64::MIN_POSITIVE);
        let variables = self.by.chain.variables.iter().enumerate();
        variables.map(move |(i, variable)| match variable.motion {
            JointMotionKind::Turn if self.by.is_periodic(i) => turned(a[i] - b[i]),
            JointMotionKind::Turn => a[i] - b[i],
            JointMotionKind::Slide => (a[i] - b[i]) / reach_m,
        })
    }
}
