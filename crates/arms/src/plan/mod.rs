//! Ways of chains with a fixed base among obstacles: from the present posture to one that reaches a
//! target, where no local rule finds one.
//!
//! ```text
//! space.rs:  postures of rods, the straight way between two, and whether it is free
//! joints.rs: the same for the joints of an arm
//! tree.rs:   two trees of postures that grow toward each other (RRT-Connect), and shortcuts
//! ```
//!
//! Source: Kuffner and LaValle, "RRT-Connect: an efficient approach to single-query path planning",
//! ICRA 2000. A way of rods keeps rods, bend limits and mobilities; one of joints keeps their limits as well.

mod joints;
mod space;
#[cfg(test)]
mod tests;
mod tree;

use super::ik::{ChainIkGoal, IkSolver};
pub use joints::JointSpace;
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Draws;
use sidestep_rods::geometry::Point;
use sidestep_rods::{Chain, Obstacles, Rules};
pub use space::RodSpace;

/// Most postures at the target from which the second tree grows, and searches for them.
const MAX_GOALS: usize = 4;
const MAX_SEARCHES: usize = 12;
/// Restarts of the search for one of them.
const MAX_RESTARTS: usize = 25;

/// The target of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanningQuery<const D: usize> {
    /// The connector that is to move,
    pub k: usize,
    /// where to,
    pub target: Point<D>,
    /// and how near, meters.
    pub tolerance_m: f64,
}

/// A posture: the places of all connectors.
pub type ChainPosture<const D: usize> = Vec<Point<D>>;

/// The postures of a body that moves from one to another.
pub trait ConfigurationSpace {
    /// One posture.
    type Posture: Clone;

    /// Returns the present posture.
    fn present(&self) -> Self::Posture;

    /// Returns the length in which ways are measured, such as that of the stretched body, meters.
    fn length_m(&self) -> f64;

    /// Returns the longest way of a connector between two postures, or a bound on it, meters.
    fn distance_m(&self, a: &Self::Posture, b: &Self::Posture) -> f64;

    /// Returns a measure of nearness: the sum of the squared ways of all moving parts.
    fn squared_spread(&self, a: &Self::Posture, b: &Self::Posture) -> f64;

    /// Returns the posture at a part of the straight way from one to another: all parts turn and change their lengths
    /// evenly.
    fn interpolate(&self, a: &Self::Posture, b: &Self::Posture, part: f64) -> Self::Posture;

    /// Returns whether a posture is good in itself.
    fn is_free(&self, posture: &Self::Posture) -> bool;

    /// Returns whether the straight way from one good posture to another is free.
    fn is_path_free(&self, a: &Self::Posture, b: &Self::Posture) -> bool;

    /// Returns any posture, good or not.
    fn sample(&self, draws: &mut Draws) -> Self::Posture;
}

/// Finds a way of a chain to a target: the postures after the present one, between any two of which
/// the straight way is free; none if the search found none.
///
/// # Errors
/// As [`IkSolver::solve`]; also when no connector of the chain keeps its place.
pub fn plan<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    rules: Rules,
    errand: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Option<Vec<ChainPosture<D>>>, InputError> {
    let space = RodSpace::new(chain, obstacles, rules.self_collision, errand.k)?;
    let goals = goals(&space, rules, errand, draws)?;
    Ok(find_path(&space, goals, draws))
}

/// Finds a way of an arm to a target, as [`plan`] does: the joint values after the present ones.
///
/// # Errors
/// As [`SerialChain::solve`](crate::kinematics::SerialChain::solve).
pub fn plan_joints<const D: usize>(
    space: &JointSpace<'_, D>,
    errand: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Option<Vec<Vec<f64>>>, InputError> {
    let goals = space.goals(errand, draws)?;
    Ok(find_path(space, goals, draws))
}

fn find_path<S: ConfigurationSpace>(
    space: &S,
    goals: Vec<S::Posture>,
    draws: &mut Draws,
) -> Option<Vec<S::Posture>> {
    if goals.is_empty() {
        return None;
    }
    let way = tree::find_path(space, goals, draws)?;
    Some(tree::shorten(space, way, draws))
}

/// Returns good postures that reach the target: the first sought from the present posture, the others
/// from any, because those near the present one may be cut off from it by the chain's own body.
fn goals<const D: usize>(
    space: &RodSpace<'_, D>,
    rules: Rules,
    errand: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Vec<ChainPosture<D>>, InputError> {
    let mut solver = IkSolver::new(rules);
    let mut from = space.chain().clone();
    let mut goals: Vec<ChainPosture<D>> = Vec::new();
    for search in 1..=MAX_SEARCHES {
        let goal = ChainIkGoal {
            tolerance_m: errand.tolerance_m,
            restarts: MAX_RESTARTS,
            seed: draws.next_u64(),
            ..ChainIkGoal::new(errand.k, space.base(), errand.target)
        };
        let answer = solver.solve(&from, space.obstacles(), &goal)?;
        if answer.reached && space.is_free(&answer.points) && !goals.contains(&answer.points) {
            goals.push(answer.points);
        }
        // Where the first searches find nothing, further ones hardly would.
        if goals.len() == MAX_GOALS || goals.is_empty() && search == MAX_GOALS {
            break;
        }
        from.points_mut().copy_from_slice(&space.sample(draws));
    }
    Ok(goals)
}
