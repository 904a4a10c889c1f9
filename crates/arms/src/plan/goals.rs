//! Goals of an arm beyond a place of a connector: a pose of its tool, or values of its joints; and straight lines of
//! the tool.

use super::joints::JointSpace;
use super::shortcuts::shorten_joint_path;
use super::{ConfigurationSpace, find_path};
use crate::arm::Arm;
use crate::kinematics::{ArmGoal, FrameAxis, OrientationMask, Transform, rotation_vector};
use sidestep_kernel::InputError;
use sidestep_kernel::geometry::{add_scaled, cross, dot, norm, normalized, scaled, sub};
use sidestep_kernel::math::atan2;
use sidestep_kernel::stream::Draws;

/// Largest number of distinct postures at a pose that are sought, and random postures from which that search starts.
const MAX_SOLUTIONS: usize = 12;
const MAX_RESTARTS: usize = 60;
/// Largest number of those from which the second tree grows, the nearest first.
const MAX_GOALS: usize = 4;
/// Fraction of its tolerances to which a pose is solved, so that the end of a path counts as the goal though rounding
/// moves it.
const SOLVED_FRACTION: f64 = 0.5;
/// Difference at which a joint counts as at its value, rad or m: far more than rounding.
const JOINT_TOLERANCE: f64 = 1e-9;
/// Longest step between two postures of a straight line, m and rad: the joints move evenly in between, and the tool
/// leaves the line by less than 5 um on an arm of 1 m.
const LINE_STEP_M: f64 = 5e-3;
const LINE_STEP_RAD: f64 = 0.02;
/// Tolerance of each of these postures, m and rad: all of what a task allows is left for the smoothing of the motion.
const LINE_TOLERANCE: f64 = 1e-6;
/// Largest change of a joint in such a step, rad or m: beyond it the line passes a singular posture, where a joint has
/// to turn on the spot.
const MAX_JOINT_STEP: f64 = 0.2;

/// A goal of an arm's joints.
#[derive(Debug, Clone, PartialEq)]
pub enum JointGoal {
    /// A pose of the tip in the frame of the base, or a part of it.
    Pose(ArmGoal),
    /// A value for each joint, rad or m.
    Values(Vec<f64>),
}

impl JointGoal {
    /// Returns whether joints are at the goal.
    pub fn is_reached(&self, arm: &Arm, joints: &[f64]) -> bool {
        match self {
            Self::Pose(goal) => {
                let (error_m, error_rad) = arm.serial.pose_error(goal, joints);
                error_m <= goal.tolerance_m && error_rad <= goal.tolerance_rad
            }
            Self::Values(values) => {
                joints.iter().zip(values).all(|(a, b)| (a - b).abs() <= JOINT_TOLERANCE)
            }
        }
    }
}

/// Plans a path of an arm to a goal: the joint values after the present ones; none if the search found none.
///
/// # Errors
/// As [`SerialChain::solve`](crate::kinematics::SerialChain::solve).
pub fn plan_to_goal<const D: usize>(
    space: &JointSpace<'_, D>,
    goal: &JointGoal,
    draws: &mut Draws,
) -> Result<Option<Vec<Vec<f64>>>, InputError> {
    let postures = match goal {
        JointGoal::Values(values) => vec![values.clone()],
        JointGoal::Pose(pose) => {
            let pose = ArmGoal {
                solutions: MAX_SOLUTIONS,
                restarts: MAX_RESTARTS,
                seed: draws.next_u64(),
                ..solved_goal(pose)
            };
            let result = space.arm().serial.solve(&pose, &space.present_posture())?;
            let others = result.others.into_iter().map(|posture| posture.values);
            std::iter::once(result.values).filter(|_| result.reached).chain(others).collect()
        }
    };
    let free = postures.into_iter().filter(|posture| space.is_free(posture));
    let path = find_path(space, Vec::new(), free.take(MAX_GOALS).collect(), draws);
    Ok(path.map(|path| shorten_joint_path(space, path, draws)))
}

/// Plans the straight line of the tip from where it is to a pose, turning evenly: the joint values after the present
/// ones, none if joints cannot follow it, or something is in the way. Axes of the target's position that are free keep
/// to the line as well.
///
/// # Errors
/// As [`SerialChain::solve`](crate::kinematics::SerialChain::solve).
pub fn plan_line<const D: usize>(
    space: &JointSpace<'_, D>,
    goal: &ArmGoal,
) -> Result<Option<Vec<Vec<f64>>>, InputError> {
    let arm = space.arm();
    let mut at = space.present_posture();
    let start = arm.serial.forward_kinematics(&at).tip;
    let way = sub(goal.target.origin_m, start.origin_m);
    let turn = turn_to(&start, goal);
    let steps = (norm(way) / LINE_STEP_M).max(norm(turn) / LINE_STEP_RAD).ceil().max(1.0) as usize;
    let mut path = Vec::with_capacity(steps);
    for step in 1..=steps {
        let fraction = step as f64 / steps as f64;
        let turned = Transform::from_rotation_vector(scaled(turn, fraction))
            .compose(&Transform { origin_m: [0.0; 3], ..start });
        let target = Transform { origin_m: add_scaled(start.origin_m, way, fraction), ..turned };
        let goal = ArmGoal {
            target,
            restarts: 0,
            tolerance_m: LINE_TOLERANCE.min(goal.tolerance_m),
            tolerance_rad: LINE_TOLERANCE.min(goal.tolerance_rad),
            ..goal.clone()
        };
        let answer = arm.serial.solve(&goal, &at)?;
        let mut changes = answer.values.iter().zip(&at).map(|(to, from)| (to - from).abs());
        let is_steady = changes.all(|change| change <= MAX_JOINT_STEP);
        if !answer.reached || !is_steady || !space.is_path_free(&at, &answer.values) {
            return Ok(None);
        }
        path.push(answer.values.clone());
        at = answer.values;
    }
    Ok(Some(path))
}

/// Returns a goal with half of its tolerances.
fn solved_goal(goal: &ArmGoal) -> ArmGoal {
    ArmGoal {
        tolerance_m: SOLVED_FRACTION * goal.tolerance_m,
        tolerance_rad: SOLVED_FRACTION * goal.tolerance_rad,
        ..goal.clone()
    }
}

/// Returns the turn from a frame to the orientation of a goal as an axis times an angle in rad: of an axis that counts
/// alone the shortest one.
fn turn_to(start: &Transform, goal: &ArmGoal) -> [f64; 3] {
    match goal.asked.turn {
        OrientationMask::Free => [0.0; 3],
        OrientationMask::Whole => rotation_vector(&start.rotation, &goal.target.rotation),
        OrientationMask::Axis(axis) => {
            let column = |frame: &Transform| frame.transform_direction(unit_axis(axis));
            let [own, wanted] = [column(start), column(&goal.target)];
            let normal = cross(own, wanted);
            let angle_rad = atan2(norm(normal), dot(own, wanted));
            // Opposite axes: about any normal, here about another axis of the frame.
            let other = start.transform_direction(unit_axis(next_axis(axis)));
            scaled(normalized(normal).unwrap_or(other), angle_rad)
        }
    }
}

fn unit_axis(axis: FrameAxis) -> [f64; 3] {
    let mut unit = [0.0; 3];
    unit[axis as usize] = 1.0;
    unit
}

fn next_axis(axis: FrameAxis) -> FrameAxis {
    FrameAxis::ALL[(axis as usize + 1) % 3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::JointPosture;
    use crate::plan::joints::tests::arm;
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};
    use sidestep_rods::Obstacles;

    #[test]
    fn a_planned_path_ends_in_the_pose_and_in_the_joint_values_that_are_asked_for() {
        let arm = arm();
        let chain = arm.chain(0.02, 0.01).expect("a chain");
        let obstacles = Obstacles::default();
        let start = JointPosture { arm: &arm, joints: &arm.values };
        let space = JointSpace::new(start, &chain, &obstacles, true, 3);
        let values = vec![0.6, 0.4, -0.3, 1.2, 0.2, 0.4, 0.5];
        let pose = arm.serial.forward_kinematics(&values).tip;
        for goal in [JointGoal::Values(values), JointGoal::Pose(ArmGoal::from_pose(pose))] {
            let mut draws = Streams::new(Seed(2)).draws(0, 0, Purpose(9));
            let path = plan_to_goal(&space, &goal, &mut draws).expect("right").expect("a path");
            assert!(goal.is_reached(&arm, path.last().expect("a posture")));
            assert!(!goal.is_reached(&arm, &arm.values));
        }
    }

    #[test]
    fn a_line_is_straight_and_turns_evenly() {
        let arm = arm();
        let chain = arm.chain(0.02, 0.01).expect("a chain");
        let obstacles = Obstacles::default();
        let start = JointPosture { arm: &arm, joints: &arm.values };
        let space = JointSpace::new(start, &chain, &obstacles, true, 3);
        let from = arm.serial.forward_kinematics(&arm.values).tip;
        let turned = Transform::from_rotation_vector([0.0, 0.0, 0.4]).compose(&from);
        let to_m = [from.origin_m[0] - 0.1, from.origin_m[1] + 0.2, from.origin_m[2] + 0.05];
        let goal = ArmGoal::from_pose(Transform { origin_m: to_m, ..turned });
        let path = plan_line(&space, &goal).expect("right").expect("a line");
        let way = normalized(sub(to_m, from.origin_m)).expect("a length");
        let mut before = arm.values.clone();
        for posture in &path {
            // Also half-way between two postures.
            let middle: Vec<f64> = before.iter().zip(posture).map(|(a, b)| 0.5 * (a + b)).collect();
            let at = arm.serial.forward_kinematics(&middle).tip.origin_m;
            let off_m = norm(cross(way, sub(at, from.origin_m)));
            assert!(off_m < 1e-5, "{off_m}");
            before.clone_from(posture);
        }
        assert!(JointGoal::Pose(goal).is_reached(&arm, &before));
        // Beyond the arm's reach there is no line.
        let far = ArmGoal::from_pose(Transform { origin_m: [3.0, 0.0, 0.5], ..from });
        assert_eq!(plan_line(&space, &far).expect("right"), None);
    }
}
