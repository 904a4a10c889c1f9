//! Inverse kinematics of real arms: joint values that bring the tip to a target.
//!
//! Damped least squares on the joints themselves, inside their limits: points leave twist open and
//! couple the joints of some arms, joints do not. The engine [`Engine::Chain`] solves for the
//! connectors first, with joint limits as bend limits, reads the joints off them, and leaves to the
//! joints only what that does not decide.
//!
//! ```text
//! goal   a goal, its answer, and the reason for a failure
//! rows   errors of a posture and their Jacobian: the tip, and spheres that rods are in
//! step   a damped step inside limits
//! guide  the connectors' solution as a posture to start from
//! ```
//!
//! Every answer's error is that of forward kinematics at its values.

mod goal;
mod guide;
mod rows;
mod step;
#[cfg(test)]
mod tests;

pub use goal::{ArmAnswer, ArmGoal, ArmReason, Hit, Sphere};

use super::pose::Vector;
use super::serial::{Motion, SerialChain};
use super::skeleton::Skeleton;
use crate::arms::ik::Engine;
use rows::{Errors, Scene};
use sidestep_kernel::geometry::{norm, sub};
use sidestep_kernel::math::wrap_angle;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_kernel::{InputError, Seed};
use std::f64::consts::PI;
use step::Bounds;

/// Random draws for postures to start from.
const START: Purpose = Purpose(0x1D);
/// Most steps from one start, including those that did not help.
const STEPS: usize = 200;
/// Restarts if no answer can be expected, to come near or to find the reason.
const FEW: usize = 8;
/// Least part of the errors that a step must remove to count as gain.
const LEAST_GAIN: f64 = 1e-3;
/// Steps without gain before the next start.
const PATIENCE: usize = 16;
/// The first damping, in parts of the mean of the matrix's diagonal.
const FIRST_DAMPING: f64 = 1e-3;

/// The end of a descent from one start.
struct Descent {
    values: Vec<f64>,
    errors: Errors,
    steps: usize,
}

impl SerialChain {
    /// Returns joint values that bring the tip to the goal's target, starting from the posture
    /// `start`, which has a value for each variable; if that does not lead there, from random ones.
    ///
    /// # Errors
    /// When a target, tolerance, sphere or start is not in range. A target that cannot be reached
    /// is no error.
    pub fn solve(&self, goal: &ArmGoal, start: &[f64]) -> Result<ArmAnswer, InputError> {
        goal.check()?;
        self.check_count("start", start)?;
        let skeleton = self.skeleton();
        let search = Search {
            chain: self,
            goal,
            scene: Scene::new(self, &skeleton, goal),
            bounds: if goal.ignore_limits { Bounds::none(self) } else { Bounds::of(self) },
            reach_m: skeleton.reach_m.max(f64::MIN_POSITIVE),
        };
        Ok(search.run(&skeleton, start))
    }
}

struct Search<'a> {
    chain: &'a SerialChain,
    goal: &'a ArmGoal,
    scene: Scene<'a>,
    bounds: Bounds,
    reach_m: f64,
}

impl Search<'_> {
    fn run(&self, skeleton: &Skeleton, start: &[f64]) -> ArmAnswer {
        let mut best: Option<Descent> = None;
        let guided = (self.goal.engine == Engine::Chain)
            .then(|| guide::posture(self.chain, skeleton, self.goal, start))
            .flatten();
        let engine = if guided.is_some() { Engine::Chain } else { Engine::Dls };
        let (first, mut steps) = guided.unwrap_or_else(|| (start.to_vec(), 0));
        let out_of_reach = self.out_of_reach(skeleton, start);
        let most = if out_of_reach.is_some() { FEW } else { usize::MAX };
        let restarts = self.goal.restarts.min(most);
        for k in 0..=restarts {
            let values = if k == 0 { first.clone() } else { self.random(k) };
            let came = self.descend(values, steps);
            steps = came.steps;
            let engine = if k == 0 { engine } else { Engine::Dls };
            if self.is_met(&came.errors) {
                return self.answer(came, engine, k + 1, None);
            }
            if best.as_ref().is_none_or(|b| came.errors.merit() < b.errors.merit()) {
                best = Some(came);
            }
        }
        let best = Descent { steps, ..best.expect("there is a first start") };
        let reason = out_of_reach.unwrap_or_else(|| self.why_not(skeleton, &best, restarts + 1));
        self.answer(best, Engine::Dls, restarts + 1, Some(reason))
    }

    fn answer(
        &self,
        came: Descent,
        engine: Engine,
        starts: usize,
        reason: Option<ArmReason>,
    ) -> ArmAnswer {
        ArmAnswer {
            reached: reason.is_none(),
            error_m: came.errors.tip_m,
            values: came.values,
            engine,
            iterations: came.steps,
            starts,
            reason,
        }
    }

    fn is_met(&self, errors: &Errors) -> bool {
        errors.tip_m <= self.goal.tolerance_m && errors.hit.is_none()
    }

    /// Makes damped steps from a start, until the goal is met or there is no more gain.
    fn descend(&self, mut values: Vec<f64>, steps_before: usize) -> Descent {
        self.bounds.clamp(&mut values);
        let mut errors = self.scene.errors(&values);
        let mut damping = FIRST_DAMPING;
        let (mut mark, mut since) = (errors.merit(), 0);
        let mut steps = steps_before;
        while steps < steps_before + STEPS && since < PATIENCE && !self.is_met(&errors) {
            steps += 1;
            let next = self.bounds.step(&values, &errors, damping);
            let next_errors = self.scene.errors(&next);
            if next_errors.merit() < errors.merit() {
                (values, errors, damping) = (next, next_errors, 0.3 * damping);
            } else {
                damping *= 4.0;
            }
            since += 1;
            if errors.merit() < (1.0 - LEAST_GAIN) * mark {
                (mark, since) = (errors.merit(), 0);
            }
        }
        self.unwind(&mut values);
        Descent { values, errors, steps }
    }

    /// Brings angles without limits to less than half a turn from zero.
    fn unwind(&self, values: &mut [f64]) {
        let is_whole = |i: usize| {
            let mut driven = self.chain.joints.iter().filter(|j| j.drive.variable == i);
            driven.all(|j| j.motion == Motion::Turn && j.drive.is_own())
        };
        for (i, value) in values.iter_mut().enumerate() {
            if self.bounds.ranges[i] == Bounds::ANY && is_whole(i) {
                *value = wrap_angle(*value);
            }
        }
    }

    /// Returns a random posture inside the limits.
    fn random(&self, index: usize) -> Vec<f64> {
        let mut draws = Streams::new(Seed(self.goal.seed)).draws(0, index as u64, START);
        let variables = self.chain.variables.iter().zip(&self.bounds.ranges);
        variables.map(|(v, &range)| self.draw(v.motion, range, &mut draws)).collect()
    }

    fn draw(&self, motion: Motion, [lower, upper]: [f64; 2], draws: &mut Draws) -> f64 {
        let half = if motion == Motion::Turn { PI } else { self.reach_m };
        let (lower, upper) = match (lower.is_finite(), upper.is_finite()) {
            (true, true) => (lower, upper),
            (true, false) => (lower, lower + 2.0 * half),
            (false, true) => (upper - 2.0 * half, upper),
            (false, false) => (-half, half),
        };
        lower + draws.uniform() * (upper - lower)
    }

    /// Returns a reason that follows from the rods alone, if they rule the target out.
    fn out_of_reach(&self, skeleton: &Skeleton, start: &[f64]) -> Option<ArmReason> {
        let connectors = self.chain.connectors(skeleton, &self.chain.forward(start));
        let far_m = norm(sub(self.goal.target_m, connectors[0]));
        let reach_m: f64 = skeleton.rods.iter().map(|rod| rod.max_m).sum();
        let longest_m = skeleton.rods.iter().map(|rod| rod.min_m + rod.max_m).fold(0.0, f64::max);
        let hole_m = longest_m - reach_m;
        // The distance means something only if the first connector is fixed in the base.
        let is_still = skeleton.connectors[0].first == 0;
        if is_still && far_m > reach_m + self.goal.tolerance_m {
            return Some(ArmReason::TooFar { far_m, reach_m });
        }
        (is_still && far_m < hole_m - self.goal.tolerance_m)
            .then_some(ArmReason::TooNear { far_m, hole_m })
    }

    /// Returns the constraint without which there would be an answer.
    fn why_not(&self, skeleton: &Skeleton, best: &Descent, starts: usize) -> ArmReason {
        let without = |ignore_limits: bool, spheres: Vec<Sphere>| {
            let restarts = self.goal.restarts.min(FEW);
            let ignore_limits = ignore_limits || self.goal.ignore_limits;
            ArmGoal { ignore_limits, spheres, restarts, engine: Engine::Dls, ..self.goal.clone() }
        };
        let values_for = |goal: &ArmGoal| {
            let free = Search {
                chain: self.chain,
                goal,
                scene: Scene::new(self.chain, skeleton, goal),
                bounds: if goal.ignore_limits {
                    Bounds::none(self.chain)
                } else {
                    Bounds::of(self.chain)
                },
                reach_m: self.reach_m,
            };
            let starts = (0..=goal.restarts)
                .map(|k| if k == 0 { best.values.clone() } else { free.random(k) });
            starts.map(|values| free.descend(values, 0)).find(|came| free.is_met(&came.errors))
        };
        if let Some(hit) =
            best.errors.hit.clone().filter(|_| best.errors.tip_m <= self.goal.tolerance_m)
        {
            return ArmReason::Blocked(hit);
        }
        let spheres = self.goal.spheres.clone();
        let outside = (!self.goal.ignore_limits)
            .then(|| values_for(&without(true, spheres)))
            .flatten()
            .and_then(|came| self.bounds.first_outside(self.chain, &came.values));
        if let Some((joint, value, lower, upper)) = outside {
            return ArmReason::OutsideLimits { joint, value, lower, upper };
        }
        let hit = (!self.goal.spheres.is_empty())
            .then(|| values_for(&without(false, Vec::new())))
            .flatten()
            .and_then(|came| self.scene.errors(&came.values).hit);
        hit.map_or(ArmReason::NotFound { starts, error_m: best.errors.tip_m }, ArmReason::Blocked)
    }
}

/// Returns the distance of two points.
fn apart_m(a: Vector, b: Vector) -> f64 {
    norm(sub(a, b))
}
