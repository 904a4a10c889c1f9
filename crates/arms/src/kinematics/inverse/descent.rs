//! Damped steps from one posture.

use super::super::serial::{JointMotionKind, SerialChain};
use super::criteria::{PostureEvaluation, PostureEvaluator};
use super::goal::ArmGoal;
use super::step::{IkStepInput, IkStepper, JointRanges};
use sidestep_kernel::math::wrap_angle;

/// The first damping, in parts of the mean of the matrix's diagonal: measured, as all numbers here,
/// on 1,000 poses of each of eleven arms, with smaller ones it leaves the start's surroundings.
const INITIAL_DAMPING: f64 = 0.1;
/// Factors of the damping after a step that helped, and after one that did not.
const DAMPING_DECREASE: f64 = 0.3;
const DAMPING_INCREASE: f64 = 5.0;

/// The effort of one descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescentLimits {
    /// Largest number of steps, including those that did not help.
    steps: usize,
    /// Steps without gain before it is given up.
    patience: usize,
    /// Least part of the squared errors whose removal counts as gain.
    min_gain: f64,
}

impl DescentLimits {
    /// One start of many: where it goes slowly, another start is quicker (half of the time for all
    /// starts, measured).
    pub(super) const BRIEF: Self = Self { steps: 200, patience: 6, min_gain: 0.3 };
    /// Effort that comes as near as possible.
    pub(super) const PATIENT: Self = Self { steps: 400, patience: 24, min_gain: 1e-3 };
}

/// The end of a descent from one start.
#[derive(Debug, Clone)]
pub(super) struct DescentResult {
    pub(super) values: Vec<f64>,
    pub(super) evaluation: PostureEvaluation,
    pub(super) steps: usize,
}

/// Criteria, with the buffers that descents need.
pub(super) struct Descender<'a> {
    pub(super) chain: &'a SerialChain,
    pub(super) goal: &'a ArmGoal,
    pub(super) criteria: PostureEvaluator<'a>,
    pub(super) bounds: JointRanges,
    pub(super) stepper: IkStepper,
}

impl Descender<'_> {
    pub(super) fn is_met(&self, evaluation: &PostureEvaluation) -> bool {
        // Forward kinematics in another order differs in the last digits.
        const SLACK: f64 = 1.0 - 1e-9;
        evaluation.tip_m <= SLACK * self.goal.tolerance_m
            && evaluation.turn_rad <= SLACK * self.goal.tolerance_rad
            && evaluation.touched.hit.is_none()
    }

    /// Makes damped steps from a start, until the goal is met or there is no more gain.
    pub(super) fn descend(&mut self, mut values: Vec<f64>, limits: DescentLimits) -> DescentResult {
        self.bounds.clamp(&mut values);
        let n = values.len();
        let mut evaluation = PostureEvaluator::empty_evaluation(self.chain);
        self.criteria.evaluate(&values, &mut evaluation);
        let mut next = values.clone();
        let mut next_evaluation = evaluation.clone();
        let mut damping = INITIAL_DAMPING;
        // The merit at the last gain, and the steps since.
        let mut mark = evaluation.merit();
        let mut since = 0;
        let mut steps = 0;
        let mut is_new = true;
        while n > 0 && steps < limits.steps && since < limits.patience && !self.is_met(&evaluation)
        {
            steps += 1;
            // After a step that did not help the Jacobian is still that of the best posture.
            if is_new {
                self.criteria.jacobian(&evaluation, n, &mut self.stepper.rows);
            }
            let wanted = &evaluation.wanted;
            let input = IkStepInput { values: &values, wanted, damping, bounds: &self.bounds };
            self.stepper.step(input, &mut next);
            self.criteria.evaluate(&next, &mut next_evaluation);
            is_new = next_evaluation.merit() < evaluation.merit();
            if is_new {
                std::mem::swap(&mut values, &mut next);
                std::mem::swap(&mut evaluation, &mut next_evaluation);
                damping *= DAMPING_DECREASE;
            } else {
                damping *= DAMPING_INCREASE;
            }
            since += 1;
            if evaluation.merit() < (1.0 - limits.min_gain) * mark {
                mark = evaluation.merit();
                since = 0;
            }
        }
        self.unwind(&mut values);
        DescentResult { values, evaluation, steps }
    }

    /// Brings angles without limits to less than half a turn from zero.
    fn unwind(&self, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            if self.bounds.ranges[i] == JointRanges::UNLIMITED && self.is_periodic(i) {
                *value = wrap_angle(*value);
            }
        }
    }

    /// Returns whether a variable that is a full turn larger is the same posture.
    pub(super) fn is_periodic(&self, variable: usize) -> bool {
        let mut driven = self.chain.joints.iter().filter(|j| j.drive.variable == variable);
        driven.all(|j| j.motion == JointMotionKind::Turn && j.drive.is_identity())
    }
}
