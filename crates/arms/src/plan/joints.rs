//! Postures of an arm's joints, inside their limits, and the straight way between two.

use super::{ConfigurationSpace, PlanningQuery};
use crate::arm::Arm;
use crate::ik::constraints::ConstraintChecker;
use crate::kinematics::{ArmGoal, Dof, JointMotion};
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{InputError, interrupt};
use sidestep_rods::geometry::Point;
use sidestep_rods::{Chain, Obstacles, Veto};
use std::f64::consts::PI;

/// Distinct postures at a target that are looked for, and random ones that the search starts from.
const MAX_SOLUTIONS: usize = 12;
const MAX_RESTARTS: usize = 60;
/// Most of those from which the second tree grows.
const MAX_GOALS: usize = 4;
/// Least step between two postures that are checked, in parts of the arm's reach.
const MIN_STEP: f64 = 1e-3;

/// The postures of one arm among obstacles: a value for each of its joints.
pub struct JointSpace<'a, const D: usize> {
    arm: &'a Arm,
    present: &'a [f64],
    checker: ConstraintChecker<'a, D>,
    k: usize,
    /// Longest way of a connector between two postures that are checked, meters.
    step_m: f64,
}

impl<'a, const D: usize> JointSpace<'a, D> {
    /// Returns the postures that bring connector `k` to places. `chain` is the arm's chain at its `present` joint
    /// values.
    pub fn new(
        arm: &'a Arm,
        present: &'a [f64],
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
        self_collision: bool,
        k: usize,
    ) -> Self {
        let checker = ConstraintChecker { chain, obstacles, self_collision };
        let step_m = chain.step_m().max(MIN_STEP * arm.skeleton.reach_m);
        Self { arm, present, checker, k, step_m }
    }

    /// Returns the objection to the places of an arm's connectors, if there is one.
    pub fn find_veto(&self, points: &[Point<D>]) -> Option<Veto<D>> {
        self.checker.find_veto(points, self.k)
    }

    /// Returns good postures that reach the target, those nearest to the present one first.
    pub(super) fn goals(
        &self,
        errand: &PlanningQuery<D>,
        draws: &mut Draws,
    ) -> Result<Vec<Vec<f64>>, InputError> {
        let (arm, goal) = self.arm.goal(errand.k, errand.target, errand.tolerance_m);
        let seed = draws.next_u64();
        let goal = ArmGoal { solutions: MAX_SOLUTIONS, restarts: MAX_RESTARTS, seed, ..goal };
        let answer = arm.solve(&goal, self.present)?;
        let others = answer.others.into_iter().map(|posture| posture.values);
        let all = std::iter::once(answer.values).filter(|_| answer.reached).chain(others);
        Ok(all.filter(|values| self.is_free(values)).take(MAX_GOALS).collect())
    }
}

impl<const D: usize> ConfigurationSpace for JointSpace<'_, D> {
    type Posture = Vec<f64>;

    fn present(&self) -> Vec<f64> {
        self.present.to_vec()
    }

    /// The way of half a turn of all joints at once.
    fn length_m(&self) -> f64 {
        PI * self.arm.follower.levers_m().iter().sum::<f64>()
    }

    /// A bound: the sum of the ways that each joint alone may move a connector. So a full turn, which brings each part
    /// back to its place, counts with its whole way.
    fn distance_m(&self, a: &Vec<f64>, b: &Vec<f64>) -> f64 {
        let ways = a.iter().zip(b).zip(self.arm.follower.levers_m());
        ways.map(|((a, b), lever_m)| (b - a).abs() * lever_m).sum()
    }

    fn squared_spread(&self, a: &Vec<f64>, b: &Vec<f64>) -> f64 {
        let ways = a.iter().zip(b).zip(self.arm.follower.levers_m());
        ways.map(|((a, b), lever_m)| (b - a) * (b - a) * lever_m * lever_m).sum()
    }

    fn interpolate(&self, a: &Vec<f64>, b: &Vec<f64>, part: f64) -> Vec<f64> {
        match part >= 1.0 {
            true => b.clone(),
            false => a.iter().zip(b).map(|(a, b)| a + part * (b - a)).collect(),
        }
    }

    fn is_free(&self, posture: &Vec<f64>) -> bool {
        self.find_veto(&self.arm.connector_positions(posture)).is_none()
    }

    fn is_path_free(&self, a: &Vec<f64>, b: &Vec<f64>) -> bool {
        let n = (self.distance_m(a, b) / self.step_m).ceil().max(1.0) as usize;
        (1..=n).all(|step| {
            interrupt::check();
            self.is_free(&self.interpolate(a, b, step as f64 / n as f64))
        })
    }

    fn sample(&self, draws: &mut Draws) -> Vec<f64> {
        let any = |(variable, [lower, upper]): (&Dof, &[f64; 2])| {
            // A joint that turns without limits gets everywhere within half a turn to either side; slides without
            // limits go as far as the arm is long.
            let far = match variable.motion {
                JointMotion::Turn if lower.is_finite() => f64::INFINITY,
                JointMotion::Turn => PI,
                JointMotion::Slide => self.arm.skeleton.reach_m.max(1.0),
            };
            let (lower, upper) = (lower.max(-far), upper.min(far));
            lower + draws.uniform() * (upper - lower)
        };
        let variables = self.arm.serial.variables.iter();
        variables.zip(self.arm.follower.limits()).map(any).collect()
    }
}
