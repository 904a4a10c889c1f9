//! Damped steps from one posture.

use super::super::serial::{Motion, SerialChain};
use super::goal::ArmGoal;
use super::rows::{Look, Scene};
use super::step::{Bounds, Stepper};
use sidestep_kernel::math::wrap_angle;

/// The first damping, in parts of the mean of the matrix's diagonal: measured, as all numbers here,
/// on 1,000 poses of each of eleven arms, with smaller ones it leaves the start's surroundings.
const FIRST_DAMPING: f64 = 0.1;
/// Factors of the damping after a step that helped, and after one that did not.
const RELAX: f64 = 0.3;
const STIFFEN: f64 = 5.0;

/// The effort of one descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    /// Most steps, including those that did not help.
    steps: usize,
    /// Steps without gain before it is given up.
    patience: usize,
    /// Least part of the squared errors whose removal counts as gain.
    least_gain: f64,
}

impl Effort {
    /// One start of many: where it goes slowly, another start is quicker (half of the time for all
    /// starts, measured).
    pub(super) const BRIEF: Self = Self { steps: 200, patience: 6, least_gain: 0.3 };
    /// Effort that comes as near as possible.
    pub(super) const PATIENT: Self = Self { steps: 400, patience: 24, least_gain: 1e-3 };
}

/// The end of a descent from one start.
#[derive(Debug, Clone)]
pub(super) struct Descent {
    pub(super) values: Vec<f64>,
    pub(super) look: Look,
    pub(super) steps: usize,
}

/// A scene with the memory that descents in it need.
pub(super) struct Descender<'a> {
    pub(super) chain: &'a SerialChain,
    pub(super) goal: &'a ArmGoal,
    pub(super) scene: Scene<'a>,
    pub(super) bounds: Bounds,
    pub(super) stepper: Stepper,
}

impl Descender<'_> {
    pub(super) fn is_met(&self, look: &Look) -> bool {
        // Forward kinematics in another order differs in the last digits.
        const SLACK: f64 = 1.0 - 1e-9;
        look.tip_m <= SLACK * self.goal.tolerance_m
            && look.turn_rad <= SLACK * self.goal.tolerance_rad
            && look.touched.hit.is_none()
    }

    /// Makes damped steps from a start, until the goal is met or there is no more gain.
    pub(super) fn descend(&mut self, mut values: Vec<f64>, effort: Effort) -> Descent {
        self.bounds.clamp(&mut values);
        let n = values.len();
        let mut look = Scene::blank(self.chain);
        self.scene.look(&values, &mut look);
        let (mut next, mut next_look) = (values.clone(), look.clone());
        let mut damping = FIRST_DAMPING;
        let (mut mark, mut since, mut steps) = (look.merit(), 0, 0);
        let mut is_new = true;
        let goes_on = |steps, since| n > 0 && steps < effort.steps && since < effort.patience;
        while goes_on(steps, since) && !self.is_met(&look) {
            steps += 1;
            if is_new {
                self.scene.slopes(&look, n, &mut self.stepper.rows);
            }
            self.stepper.step(&values, &look.wanted, damping, &self.bounds, &mut next);
            self.scene.look(&next, &mut next_look);
            is_new = next_look.merit() < look.merit();
            if is_new {
                std::mem::swap(&mut values, &mut next);
                std::mem::swap(&mut look, &mut next_look);
                damping *= RELAX;
            } else {
                damping *= STIFFEN;
            }
            since += 1;
            if look.merit() < (1.0 - effort.least_gain) * mark {
                (mark, since) = (look.merit(), 0);
            }
        }
        self.unwind(&mut values);
        Descent { values, look, steps }
    }

    /// Brings angles without limits to less than half a turn from zero.
    fn unwind(&self, values: &mut [f64]) {
        for (i, value) in values.iter_mut().enumerate() {
            if self.bounds.ranges[i] == Bounds::ANY && self.is_round(i) {
                *value = wrap_angle(*value);
            }
        }
    }

    /// Returns whether a variable that is a full turn larger is the same posture.
    pub(super) fn is_round(&self, variable: usize) -> bool {
        let mut driven = self.chain.joints.iter().filter(|j| j.drive.variable == variable);
        driven.all(|j| j.motion == Motion::Turn && j.drive.is_own())
    }
}
