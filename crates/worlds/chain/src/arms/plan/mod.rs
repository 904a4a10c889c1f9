//! Ways of chains with a fixed base among obstacles: from the present posture to one that reaches a
//! target, where no local rule finds one.
//!
//! ```text
//! space.rs: postures, the straight way between two, and whether it is free
//! tree.rs:  two trees of postures that grow toward each other (RRT-Connect), and shortcuts
//! ```
//!
//! Source: Kuffner and LaValle, "RRT-Connect: an efficient approach to single-query path planning",
//! ICRA 2000. Postures are those of the rods, so a way keeps rods, bend limits and mobilities; the
//! joint limits of arms hold as far as they are bend limits, as for every motion of a chain.

mod space;
#[cfg(test)]
mod tests;
mod tree;

use super::ik::{Goal, Solver};
use crate::rods::chain::Chain;
use crate::rods::geometry::Point;
use crate::rods::obstacle::Obstacles;
use crate::rods::rules::Rules;
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Draws;
pub(crate) use space::Space;

/// Most postures at the target from which the second tree grows, and searches for them.
const GOALS: usize = 4;
const SEARCHES: usize = 12;
/// Restarts of the search for one of them.
const RESTARTS: usize = 25;

/// The target of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Errand<const D: usize> {
    /// The connector that is to move,
    pub(crate) k: usize,
    /// where to,
    pub(crate) target: Point<D>,
    /// and how near, meters.
    pub(crate) tolerance_m: f64,
}

/// A posture: the places of all connectors.
pub(crate) type Posture<const D: usize> = Vec<Point<D>>;

/// Finds a way of a chain to a target: the postures after the present one, between any two of which
/// the straight way is free; none if the search found none.
///
/// # Errors
/// As [`Solver::solve`]; also when no connector of the chain keeps its place.
pub(crate) fn plan<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    rules: Rules,
    errand: &Errand<D>,
    draws: &mut Draws,
) -> Result<Option<Vec<Posture<D>>>, InputError> {
    let space = Space::new(chain, obstacles, rules.self_collision, errand.k)?;
    let goals = goals(&space, rules, errand, draws)?;
    if goals.is_empty() {
        return Ok(None);
    }
    Ok(tree::way(&space, goals, draws).map(|way| tree::shortened(&space, way, draws)))
}

/// Returns good postures that reach the target: the first sought from the present posture, the others
/// from any, because those near the present one may be cut off from it by the chain's own body.
fn goals<const D: usize>(
    space: &Space<'_, D>,
    rules: Rules,
    errand: &Errand<D>,
    draws: &mut Draws,
) -> Result<Vec<Posture<D>>, InputError> {
    let mut solver = Solver::new(rules);
    let mut from = space.chain().clone();
    let mut goals: Vec<Posture<D>> = Vec::new();
    for search in 1..=SEARCHES {
        let goal = Goal {
            tolerance_m: errand.tolerance_m,
            restarts: RESTARTS,
            seed: draws.next_u64(),
            ..Goal::new(errand.k, space.base(), errand.target)
        };
        let answer = solver.solve(&from, space.obstacles(), &goal)?;
        if answer.reached && space.is_free(&answer.points) && !goals.contains(&answer.points) {
            goals.push(answer.points);
        }
        // Where the first searches find nothing there is hardly anything to be found.
        if goals.len() == GOALS || goals.is_empty() && search == GOALS {
            break;
        }
        from.points_mut().copy_from_slice(&space.any(draws));
    }
    Ok(goals)
}
