//! The reason why no posture meets a goal: of the constraints without which one would, the nearest to being kept.
//!
//! The goal is solved again without each constraint. What then has to give way is a distance: of a joint beyond its
//! limit, of a part in another body, or of the tip's orientation, angles as the length on which the search weighs them.
//! The least one is the reason. A posture far beyond the limits of three joints says little; so the limits are widened
//! as little as possible, by bisection, and the joint that is then the farthest outside is reported.

use super::super::serial::JointMotionKind;
use super::criteria::PostureEvaluator;
use super::goal::{ArmGoal, OrientationMask, PoseMask};
use super::result::IkFailure;
use super::search::{BestDescent, FEW_RESTARTS, IkSearch};

/// Bisections of the distance by which limits are widened: to 1/64 of it.
const BISECTIONS: usize = 6;
/// Restarts for each of them, after a start from the posture before, which is nearly always enough.
const WIDENED_RESTARTS: usize = 2;

/// A constraint, and by how much it would have to give way, in m.
struct Cause {
    distance_m: f64,
    reason: IkFailure,
}

impl IkSearch<'_> {
    /// Returns the nearest cause for which the best posture is not at its goal.
    pub(super) fn find_failure_reason(&self, best: &BestDescent) -> IkFailure {
        let goal = self.by.goal;
        let evaluation = &best.descent.evaluation;
        let is_there =
            evaluation.tip_m <= goal.tolerance_m && evaluation.turn_rad <= goal.tolerance_rad;
        if let Some(hit) = evaluation.touched.hit.clone().filter(|_| is_there) {
            return IkFailure::Blocked(hit);
        }
        let few = ArmGoal { restarts: goal.restarts.min(FEW_RESTARTS), ..goal.clone() };
        let causes = [
            self.find_limit_cause(&few, best),
            self.find_collision_cause(&few, best),
            self.find_turn_cause(&few, best),
        ];
        let nearest =
            causes.into_iter().flatten().min_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        let not_found = IkFailure::NotFound { starts: best.starts, error_m: evaluation.tip_m };
        nearest.map_or(not_found, |cause| cause.reason)
    }

    /// Returns the joint that has to be outside its limits, by how much at least.
    fn find_limit_cause(&self, few: &ArmGoal, best: &BestDescent) -> Option<Cause> {
        if few.ignore_limits {
            return None;
        }
        let unlimited = ArmGoal { ignore_limits: true, ..few.clone() };
        let mut values = self.solve_other_goal(&unlimited, best.descent.values.clone())?;
        let mut far_m = self.largest_excess(&values)?.1;
        let mut near_m = 0.0;
        for _ in 0..BISECTIONS {
            let widened_m = 0.5 * (near_m + far_m);
            match self.solve_within(few, values.clone(), widened_m) {
                Some(nearer) => {
                    values = nearer;
                    far_m = widened_m;
                }
                None => near_m = widened_m,
            }
        }
        let (variable, distance_m) = self.largest_excess(&values)?;
        let [lower, upper] = self.by.bounds.ranges[variable];
        let reason = IkFailure::OutsideLimits {
            joint: self.by.chain.variables[variable].name.clone(),
            value: values[variable],
            lower,
            upper,
            error_m: best.descent.evaluation.tip_m,
            error_rad: best.descent.evaluation.turn_rad,
        };
        Some(Cause { distance_m, reason })
    }

    /// Returns the hit in a posture that would meet the goal if there were no contacts.
    fn find_collision_cause(&self, few: &ArmGoal, best: &BestDescent) -> Option<Cause> {
        if few.spheres.is_empty() && !few.own_body {
            return None;
        }
        let bare = ArmGoal { spheres: Vec::new(), body: None, own_body: false, ..few.clone() };
        let values = self.solve_other_goal(&bare, best.descent.values.clone())?;
        let mut evaluation = PostureEvaluator::empty_evaluation(self.by.chain);
        self.by.criteria.evaluate(&values, &mut evaluation);
        let hit = evaluation.touched.hit?;
        Some(Cause { distance_m: hit.depth_m, reason: IkFailure::Blocked(hit) })
    }

    /// Returns by how much the tip is turned otherwise than asked where it gets to the target.
    fn find_turn_cause(&self, few: &ArmGoal, best: &BestDescent) -> Option<Cause> {
        let goal = self.by.goal;
        let unturned = PoseMask { turn: OrientationMask::Free, ..goal.asked };
        if goal.asked.turn == OrientationMask::Free || unturned.along == [false; 3] {
            return None;
        }
        let free = ArmGoal { asked: unturned, ..few.clone() };
        let mut error_rad = f64::INFINITY;
        // Where the best posture is turned, and where others are: the start decides which posture is found.
        for index in 0..=few.restarts {
            let start = match index {
                0 => best.descent.values.clone(),
                _ => self.random_posture(index),
            };
            if let Some(values) =
                self.solve_other_goal(&ArmGoal { restarts: 0, ..free.clone() }, start)
            {
                let tip = self.by.chain.forward_kinematics(&values).tip;
                error_rad = error_rad.min(self.by.criteria.tip_errors(&tip).1);
            }
        }
        let reason = IkFailure::NotTurned { starts: best.starts, error_rad };
        let distance_m = error_rad * self.by.criteria.radian_m();
        error_rad.is_finite().then_some(Cause { distance_m, reason })
    }

    /// Returns values that meet another goal, starting from a posture.
    fn solve_other_goal(&self, goal: &ArmGoal, start: Vec<f64>) -> Option<Vec<f64>> {
        let mut search = IkSearch::new(self.by.chain, self.skeleton, goal);
        let found = search.find_best(start, goal.restarts);
        found.is_met.then_some(found.descent.values)
    }

    /// Returns values that meet a goal with every limit widened by a distance.
    fn solve_within(&self, goal: &ArmGoal, start: Vec<f64>, by_m: f64) -> Option<Vec<f64>> {
        let mut search = IkSearch::new(self.by.chain, self.skeleton, goal);
        for (i, [lower, upper]) in search.by.bounds.ranges.iter_mut().enumerate() {
            let by = by_m / self.length_of_unit_m(i);
            *lower -= by;
            *upper += by;
        }
        let found = search.find_best(start, WIDENED_RESTARTS.min(goal.restarts));
        found.is_met.then_some(found.descent.values)
    }

    /// Returns the variable that is farthest outside its limits, and how far; none if all are inside.
    fn largest_excess(&self, values: &[f64]) -> Option<(usize, f64)> {
        let mut largest: Option<(usize, f64)> = None;
        for (i, (value, [lower, upper])) in values.iter().zip(&self.by.bounds.ranges).enumerate() {
            let outside = (lower - value).max(value - upper);
            let outside_m = outside * self.length_of_unit_m(i);
            if outside > 0.0 && largest.is_none_or(|(_, most_m)| outside_m > most_m) {
                largest = Some((i, outside_m));
            }
        }
        largest
    }

    /// Returns the distance as which a change of a variable by 1 counts.
    fn length_of_unit_m(&self, variable: usize) -> f64 {
        match self.by.chain.variables[variable].motion {
            JointMotionKind::Turn => self.by.criteria.radian_m(),
            JointMotionKind::Slide => 1.0,
        }
    }
}
