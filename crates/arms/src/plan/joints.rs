//! Postures of an arm's joints, inside their limits, and the straight path between two.

use super::{ConfigurationSpace, PlanningQuery};
use crate::arm::Arm;
use crate::ik::constraints::ConstraintChecker;
use crate::kinematics::{ArmBody, ArmGoal, BodyContact, BodyPathCheck, JointMotionKind};
use sidestep_kernel::stream::Draws;
use sidestep_kernel::{InputError, interrupt};
use sidestep_rods::geometry::Point;
use sidestep_rods::{Chain, Obstacles, Veto, VetoReason};
use std::cell::OnceCell;
use std::f64::consts::PI;

/// Largest number of distinct postures at a target that are sought: an arm of six joints with a spherical wrist has
/// up to eight, some of them in obstacles.
const MAX_SOLUTIONS: usize = 12;
/// Random postures from which that search starts: five for each posture sought.
const MAX_RESTARTS: usize = 60;
/// Largest number of those from which the second tree grows, the nearest first: some may be cut off from the present
/// one.
const MAX_GOALS: usize = 4;
/// Random postures that trees grow toward, at most: with a fifth of them OMPL found two paths of 67 that these trees
/// did not, with these none (`benches/planning`).
const MAX_JOINT_SAMPLES: usize = 10_000;
/// Least step between two postures that are checked, as a fraction of the arm's reach. The step is otherwise a quarter
/// of the least rod or radius, and tiny connectors would make checks of a path endless; thinner obstacles may then be
/// missed between two checks. With 1e-3 a stride of a tree takes about a thousand checks at most. The value trades
/// these off, and was not tuned.
const MIN_STEP: f64 = 1e-3;

/// Where paths of an arm start.
#[derive(Debug, Clone, Copy)]
pub struct JointPosture<'a> {
    /// The arm that the chain of the space stands for.
    pub arm: &'a Arm,
    /// A value for each of its joints, rad or m.
    pub joints: &'a [f64],
}

/// The postures of one arm among obstacles: a value for each of its joints.
pub struct JointSpace<'a, const D: usize> {
    arm: &'a Arm,
    present: &'a [f64],
    checker: ConstraintChecker<'a, D>,
    /// In place of the obstacles where its body is checked against them.
    no_obstacles: Obstacles<D>,
    k: usize,
    /// Longest move of a connector between two postures that are checked, meters.
    step_m: f64,
    /// The overlaps of its body at the present posture; found when first asked for.
    present_contacts: OnceCell<Vec<BodyContact>>,
}

impl<'a, const D: usize> JointSpace<'a, D> {
    /// Returns the postures that bring connector `k` to places. `chain` is the arm's chain at its present posture.
    pub fn new(
        present: JointPosture<'a>,
        chain: &'a Chain<D>,
        obstacles: &'a Obstacles<D>,
        self_collision: bool,
        k: usize,
    ) -> Self {
        let JointPosture { arm, joints } = present;
        let checker = ConstraintChecker { chain, obstacles, self_collision };
        let step_m = chain.step_m().max(MIN_STEP * arm.skeleton.reach_m);
        Self {
            arm,
            present: joints,
            checker,
            no_obstacles: Obstacles::default(),
            k,
            step_m,
            present_contacts: OnceCell::new(),
        }
    }

    pub(super) fn arm(&self) -> &'a Arm {
        self.arm
    }

    /// Returns a measure of a straight path in time: the root of the sum of the squared times that its joints take at
    /// their highest speeds, s.
    pub(super) fn duration_s(&self, a: &[f64], b: &[f64]) -> f64 {
        let moves = a.iter().zip(b).zip(self.arm.motion.reference_speeds());
        let times_s = moves.map(|((a, b), speed)| (b - a) / speed);
        times_s.map(|time_s| time_s * time_s).sum::<f64>().sqrt()
    }

    /// Returns the objection to a posture, if there is one; `points` are where it puts the connectors.
    pub fn find_veto(&self, posture: &[f64], points: &[Point<D>]) -> Option<Veto<D>> {
        let Some(body) = &self.arm.body else { return self.checker.find_veto(points, self.k) };
        self.find_guide_veto(points).or_else(|| self.find_body_veto(body, posture, points))
    }

    /// Returns the objection of the rods of an arm with a body: what the joints cannot break, but failed connectors and
    /// bends that a scenario limits can.
    fn find_guide_veto(&self, points: &[Point<D>]) -> Option<Veto<D>> {
        let alone = ConstraintChecker {
            obstacles: &self.no_obstacles,
            self_collision: false,
            ..self.checker
        };
        alone.find_veto(points, self.k)
    }

    /// Returns the objection of a link that would be in something, or deeper in it than it is now: an arm that starts
    /// inside must be able to get out.
    fn find_body_veto(
        &self,
        body: &ArmBody,
        posture: &[f64],
        points: &[Point<D>],
    ) -> Option<Veto<D>> {
        let ConstraintChecker { obstacles, self_collision, .. } = self.checker;
        let posture = self.arm.posture(posture);
        let allowed = self.present_contacts(body);
        let contact = body.find_deeper_contact(posture, obstacles, self_collision, allowed)?;
        let reason = match contact.obstacle {
            Some(_) => VetoReason::BothSidesBlocked,
            None => VetoReason::SelfCollision,
        };
        let by = self.arm.connector_of_link(contact.link);
        let reached = points[self.k];
        Some(Veto { by, from: self.k, reason, obstacle: contact.obstacle, reached })
    }

    /// Returns the overlaps at the present posture, which may stay as deep as they are.
    fn present_contacts(&self, body: &ArmBody) -> &[BodyContact] {
        let ConstraintChecker { obstacles, self_collision, .. } = self.checker;
        let present = self.arm.posture(self.present);
        self.present_contacts.get_or_init(|| body.contacts(present, obstacles, self_collision))
    }

    /// Returns whether some bends are limited or some connectors failed, which postures between two valid ones may
    /// break.
    fn has_guide_limits(&self) -> bool {
        let mut connectors = self.checker.chain.connectors().iter();
        connectors.any(|connector| connector.failed || connector.max_bend_rad < PI)
    }

    /// Returns the number of steps of a straight path of which none is longer than those that are checked.
    fn steps(&self, a: &Vec<f64>, b: &Vec<f64>) -> usize {
        (self.distance_m(a, b) / self.step_m).ceil().max(1.0) as usize
    }

    /// Returns whether all of the straight path of an arm with a body after `a` is free.
    fn is_body_path_free(&self, body: &ArmBody, a: &Vec<f64>, b: &Vec<f64>) -> bool {
        if !self.is_free(b) {
            return false;
        }
        let steps = self.steps(a, b);
        let is_guide_free = |step: usize| {
            let posture = self.interpolate(a, b, step as f64 / steps as f64);
            self.find_guide_veto(&self.arm.connector_positions(&posture)).is_none()
        };
        if steps > 1 && self.has_guide_limits() && !(1..steps).all(is_guide_free) {
            return false;
        }
        let ConstraintChecker { obstacles, self_collision, .. } = self.checker;
        let check = BodyPathCheck {
            body,
            travel: &self.arm.travel,
            start: self.arm.posture(a),
            obstacles,
            own: self_collision,
            allowed: self.present_contacts(body),
        };
        steps == 1 || check.is_free(b, steps)
    }

    /// Returns valid postures that reach the target, those nearest to the present one first.
    pub(super) fn goals(
        &self,
        query: &PlanningQuery<D>,
        draws: &mut Draws,
    ) -> Result<Vec<Vec<f64>>, InputError> {
        let (arm, goal) = self.arm.goal(query.k, query.target, query.tolerance_m);
        let seed = draws.next_u64();
        let goal = ArmGoal { solutions: MAX_SOLUTIONS, restarts: MAX_RESTARTS, seed, ..goal };
        let result = arm.solve(&goal, self.present)?;
        let others = result.others.into_iter().map(|posture| posture.values);
        let all = std::iter::once(result.values).filter(|_| result.reached).chain(others);
        Ok(all.filter(|values| self.is_free(values)).take(MAX_GOALS).collect())
    }
}

impl<const D: usize> ConfigurationSpace for JointSpace<'_, D> {
    type Posture = Vec<f64>;

    fn max_samples(&self) -> usize {
        MAX_JOINT_SAMPLES
    }

    fn present_posture(&self) -> Vec<f64> {
        self.present.to_vec()
    }

    /// The travel of half a turn of all joints at once.
    fn length_m(&self) -> f64 {
        PI * self.arm.follower.levers_m().iter().sum::<f64>()
    }

    /// A bound: the sum of the distances by which each joint alone may move a connector. So a full turn, which
    /// brings each part back to its place, counts with its whole travel.
    fn distance_m(&self, a: &Vec<f64>, b: &Vec<f64>) -> f64 {
        let moves = a.iter().zip(b).zip(self.arm.follower.levers_m());
        moves.map(|((a, b), lever_m)| (b - a).abs() * lever_m).sum()
    }

    fn squared_distance(&self, a: &Vec<f64>, b: &Vec<f64>) -> f64 {
        let moves = a.iter().zip(b).zip(self.arm.follower.levers_m());
        moves.map(|((a, b), lever_m)| (b - a) * (b - a) * lever_m * lever_m).sum()
    }

    fn interpolate(&self, a: &Vec<f64>, b: &Vec<f64>, fraction: f64) -> Vec<f64> {
        if fraction >= 1.0 {
            return b.clone();
        }
        a.iter().zip(b).map(|(a, b)| a + fraction * (b - a)).collect()
    }

    fn is_free(&self, posture: &Vec<f64>) -> bool {
        let points = self.arm.connector_positions(posture);
        let Some(body) = &self.arm.body else { return self.find_veto(posture, &points).is_none() };
        let ConstraintChecker { obstacles, self_collision, .. } = self.checker;
        let allowed = self.present_contacts(body);
        let placed = self.arm.posture(posture);
        self.find_guide_veto(&points).is_none()
            && !body.has_deeper_contact(placed, obstacles, self_collision, allowed)
    }

    fn is_path_free(&self, a: &Vec<f64>, b: &Vec<f64>) -> bool {
        if let Some(body) = &self.arm.body {
            return self.is_body_path_free(body, a, b);
        }
        let n = self.steps(a, b);
        (1..=n).all(|step| {
            interrupt::check();
            self.is_free(&self.interpolate(a, b, step as f64 / n as f64))
        })
    }

    fn sample(&self, draws: &mut Draws) -> Vec<f64> {
        let mut values = Vec::new();
        for (variable, [lower, upper]) in
            self.arm.serial.variables.iter().zip(self.arm.follower.limits())
        {
            // A joint that turns without limits gets everywhere within half a turn to either side; slides without
            // limits go as far as the arm is long.
            let max = match variable.motion {
                JointMotionKind::Turn if lower.is_finite() => f64::INFINITY,
                JointMotionKind::Turn => PI,
                JointMotionKind::Slide => self.arm.skeleton.reach_m.max(1.0),
            };
            let lower = lower.max(-max);
            let upper = upper.min(max);
            values.push(lower + draws.uniform() * (upper - lower));
        }
        values
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::kinematics::SerialChain;
    use crate::motion::{MotionFilter, joint_rates};
    use sidestep_import::urdf::Model;
    use sidestep_import::urdf::joint_limits::{GivenRates, JointRates};
    use sidestep_testing::root;

    /// The shipped arm of seven joints, whose elbow and wrist are bent.
    pub(crate) fn arm() -> Arm {
        let file = root().join("scenarios/chain/arm.urdf");
        let model = Model::load(&file).expect("a model");
        let serial = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        let rates = joint_rates(&serial, &JointRates::new(), GivenRates::default());
        let values = vec![0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0];
        let motion = MotionFilter::new(rates, 0.02).expect("windows of few cycles");
        Arm::new(serial, [0.0; 3], values, motion)
    }

    /// Calls a function with the space of an arm's tool.
    pub(crate) fn with_space<T>(
        arm: &Arm,
        obstacles: &Obstacles<3>,
        look: impl FnOnce(&JointSpace<'_, 3>) -> T,
    ) -> T {
        let chain = arm.chain(0.02, 0.01).expect("a chain");
        let start = JointPosture { arm, joints: &arm.values };
        look(&JointSpace::new(start, &chain, obstacles, true, 3))
    }
}
