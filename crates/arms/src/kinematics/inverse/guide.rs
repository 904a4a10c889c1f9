//! The connectors' solution as a posture of the joints.

use super::super::serial::SerialChain;
use super::super::skeleton::Skeleton;
use super::super::transform::Vector;
use super::goal::ArmGoal;
use crate::ik::{ChainIkGoal, IkSolver};
use sidestep_kernel::InputError;
use sidestep_kernel::geometry::{add, scaled};
use sidestep_rods::{Chain, Connector, Mobility, Obstacle, Obstacles, ReactionRules, Rod};

/// Least length, in m, of rods that a prismatic joint can close altogether.
const MIN_ROD_M: f64 = 1e-6;
/// Longest length of rods without a limit, as a multiple of the target's distance and the reach.
const MAX_LENGTH_FACTOR: f64 = 4.0;
/// Least bend limit of a connector, rad: a joint whose limits meet would give 0, which a chain refuses.
const MIN_BEND_RAD: f64 = 1e-9;
/// Postures of the connectors that are tried: only a guide, because descents from random joint values follow.
const RESTARTS: usize = 20;

/// Returns joint values inside the limits at which the connectors are at the places found by the chain
/// engine; none if it does not reach the target, or points do not determine the joints. Also returns
/// the number of iterations.
pub(super) fn find_posture(
    arm: &SerialChain,
    skeleton: &Skeleton,
    goal: &ArmGoal,
    start: &[f64],
) -> Option<(Vec<f64>, usize)> {
    let connectors = arm.connector_positions(skeleton, &arm.forward_kinematics(start));
    let (chain, before) = arm_chain(arm, skeleton, goal, &connectors).ok()?;
    let balls =
        goal.spheres.iter().zip(0..).map(|(s, id)| Obstacle::ball(id, s.center_m, s.radius_m));
    let obstacles = Obstacles::new(balls.collect(), skeleton.reach_m).ok()?;
    let tip = chain.points().len() - 1;
    let wanted = ChainIkGoal {
        // Half of it: the rest is for the joints that are read off the points.
        tolerance_m: 0.5 * goal.tolerance_m,
        restarts: RESTARTS,
        seed: goal.seed,
        ..ChainIkGoal::new(tip, before, goal.target.origin_m)
    };
    let answer = IkSolver::new(ReactionRules::default()).solve(&chain, &obstacles, &wanted).ok()?;
    if !answer.reached {
        return None;
    }
    let recovered = arm.recover_joint_values(skeleton, &answer.points[before..], start).ok()?;
    Some((recovered.values, answer.iterations))
}

/// Returns the arm as a chain: its connectors, with a fixed one before the first from which the
/// bend there is measured, if there is a direction for it. Also returns the index of the base.
fn arm_chain(
    arm: &SerialChain,
    skeleton: &Skeleton,
    goal: &ArmGoal,
    connectors: &[Vector],
) -> Result<(Chain<3>, usize), InputError> {
    let mut points = connectors.to_vec();
    let longest_m = MAX_LENGTH_FACTOR
        * (skeleton.reach_m + goal.target.origin_m.iter().map(|x| x.abs()).sum::<f64>());
    let mut rods: Vec<Rod> = skeleton
        .rods
        .iter()
        .map(|rod| Rod {
            min_m: rod.min_m.max(MIN_ROD_M),
            max_m: rod.max_m.min(longest_m).max(MIN_ROD_M),
            radius_m: 0.0,
        })
        .collect();
    let mut joints = vec![Connector::free(0.0); points.len()];
    if !goal.ignore_limits {
        for (connector, limit) in joints.iter_mut().zip(arm.bend_limits(skeleton)) {
            let max_bend_rad = limit.map_or(std::f64::consts::PI, |l| l.max_bend_rad);
            connector.max_bend_rad = max_bend_rad.max(MIN_BEND_RAD);
        }
    }
    joints[0].mobility = Mobility::Fixed;
    let before = usize::from(skeleton.base_direction.is_some());
    if let Some(direction) = skeleton.base_direction {
        points.insert(0, add(points[0], scaled(direction, -1.0)));
        rods.insert(0, Rod::with_fixed_length(1.0, 0.0));
        joints.insert(0, Connector { mobility: Mobility::Fixed, ..Connector::free(0.0) });
    }
    Ok((Chain::new(points, joints, rods)?, before))
}
