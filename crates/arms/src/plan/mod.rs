//! Motion planning for chains that are free, held at one connector, or led between two fixed ones: a path among
//! obstacles, and out of the chain's own way, from the present posture to one that reaches a target, where no local rule
//! finds one.
//!
//! ```text
//! space.rs:    postures of rods, the straight path between two, and whether it is free
//! own_path.rs: whether the parts of a chain stay apart on it
//! arc.rs:      straight postures and arcs
//! unfold.rs:   how a chain gets out of its own body
//! retract.rs:  ways that unfold, turn, and curl up at the target; most paths are such
//! joints.rs:   postures of the joints of an arm
//! goals.rs:    poses of its tool, values of its joints, and straight lines of its tool
//! shortcuts.rs: shorter paths of joints
//! tree.rs:     two trees of postures that grow toward each other (RRT-Connect), and shortcuts
//! ```
//!
//! Source: Kuffner and LaValle, "RRT-Connect: an efficient approach to single-query path planning",
//! ICRA 2000. A path of rods keeps rods, bend limits and mobilities; one of joints keeps their limits as well.

mod arc;
mod goals;
mod joints;
mod own_path;
mod retract;
mod shortcuts;
mod space;
#[cfg(test)]
mod tests;
mod tree;
mod unfold;

use super::ik::{ChainIkGoal, IkEngine, IkSolver};
pub use goals::{JointGoal, plan_line, plan_to_goal};
pub use joints::{JointPosture, JointSpace};
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Draws;
use sidestep_rods::geometry::Point;
use sidestep_rods::{Chain, Obstacles, ReactionRules};
pub use space::{ChainBases, ChainConfigurationSpace, chain_bases};

/// Largest number of postures at the target from which the second tree grows: some may be cut off from the present
/// one, and all of them cost searches.
const MAX_GOALS: usize = 4;
/// Largest number of searches for them, three for each: those from random postures may end at a
/// posture known already, or at one that touches something.
const MAX_SEARCHES: usize = 12;
/// Random postures that trees grow toward, at most.
const MAX_SAMPLES: usize = 2_000;
/// How much longer than others a piece of a path that is followed may be, as a factor.
const MAX_REFINED_STEPS: f64 = 2.0;
/// Pieces of a straight path at most.
const MAX_PIECES: usize = 10_000;
/// Restarts of one search; few, because the next search from another posture is worth more.
const MAX_RESTARTS: usize = 25;

/// A planning query: the goal of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanningQuery<const D: usize> {
    /// The connector that is to move.
    pub k: usize,
    /// Where it is to be, in m.
    pub target: Point<D>,
    /// Distance at which the target counts as reached, meters.
    pub tolerance_m: f64,
}

/// A posture: the places of all connectors.
pub type ChainPosture<const D: usize> = Vec<Point<D>>;

/// A configuration space: the postures of a body, and the straight paths between them.
pub trait ConfigurationSpace {
    /// A node of a tree.
    type Posture: Clone;

    /// Returns the largest number of random postures that trees grow toward, so that the search for a target that is
    /// cut off ends.
    fn max_samples(&self) -> usize {
        MAX_SAMPLES
    }

    /// Returns the posture that paths start from.
    fn present_posture(&self) -> Self::Posture;

    /// Returns the length by which strides are scaled, such as that of the stretched body, meters.
    fn length_m(&self) -> f64;

    /// Returns the longest move of a connector between two postures, or a bound on it, meters.
    fn distance_m(&self, a: &Self::Posture, b: &Self::Posture) -> f64;

    /// Returns a measure of nearness: the sum of the squared moves of all moving parts.
    fn squared_distance(&self, a: &Self::Posture, b: &Self::Posture) -> f64;

    /// Returns the posture at a fraction of the straight path from one to another: all parts turn and change
    /// their lengths evenly. From 1 on it is the other posture.
    fn interpolate(&self, a: &Self::Posture, b: &Self::Posture, fraction: f64) -> Self::Posture;

    /// Returns whether a posture keeps all constraints and touches nothing.
    fn is_free(&self, posture: &Self::Posture) -> bool;

    /// Returns whether all of the straight path after `a`, itself valid, is free, `b` included.
    fn is_path_free(&self, a: &Self::Posture, b: &Self::Posture) -> bool;

    /// Returns a random posture, valid or not.
    fn sample(&self, draws: &mut Draws) -> Self::Posture;
}

/// Plans a path of a chain to a target: the postures after the present one, between any two of which the
/// straight path is free; none if the search found none.
///
/// # Errors
/// As [`IkSolver::solve`]; also when several connectors of the chain are held.
pub fn plan<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    rules: ReactionRules,
    query: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Option<Vec<ChainPosture<D>>>, InputError> {
    let space = ChainConfigurationSpace::new(chain, obstacles, rules.self_collision, query.k)?;
    let goals = goals(&space, rules, query, draws)?;
    // A chain between two ends is led to a target, where no arcs lead.
    if goals.is_empty() && space.far_end().is_none() {
        return Ok(None);
    }
    let present = space.present_posture();
    let path = match goals.iter().find(|goal| space.is_path_free(&present, goal)) {
        Some(goal) => Some(vec![goal.clone()]),
        None => {
            let trail = space.retraction(&present);
            let simple_path = retract::find_simple_path(&space, &trail, &goals, query.target);
            let path = simple_path.map(|path| shorten_from_present(&space, path, draws));
            path.or_else(|| find_path(&space, trail, goals, draws))
        }
    };
    Ok(path.and_then(|path| refined_path(&space, path)))
}

/// Returns a path without what shortcuts leave out.
fn shorten_from_present<const D: usize>(
    space: &ChainConfigurationSpace<'_, D>,
    path: Vec<ChainPosture<D>>,
    draws: &mut Draws,
) -> Vec<ChainPosture<D>> {
    let mut whole = vec![space.present_posture()];
    whole.extend(path);
    tree::shorten_path(space, whole, draws)
}

/// Returns a path with postures so near each other that it does not matter from which of them the rest is followed:
/// on a long piece some rods turn before others, and a chain that starts in its middle would turn them in another
/// order than the one that was checked.
fn refined_path<const D: usize>(
    space: &ChainConfigurationSpace<'_, D>,
    path: Vec<ChainPosture<D>>,
) -> Option<Vec<ChainPosture<D>>> {
    let mut refined = Vec::new();
    let mut from = space.present_posture();
    for to in path {
        refined.extend(refined_piece(space, &from, &to)?);
        from = to;
    }
    Some(refined)
}

/// Returns postures on the straight path after one posture up to another, each near the one before; none if they would be
/// too many to keep, because the path is so long.
fn refined_piece<const D: usize>(
    space: &ChainConfigurationSpace<'_, D>,
    from: &ChainPosture<D>,
    to: &ChainPosture<D>,
) -> Option<Vec<ChainPosture<D>>> {
    let step_m = space.refined_step_m();
    let mut n = (space.distance_m(from, to) / step_m).ceil().max(1.0) as usize;
    if n > MAX_PIECES {
        return None;
    }
    loop {
        // Where the projection onto two ends finds no posture, the path goes on straight to the next one.
        let posture_at = |step| space.posture_between(from, to, step as f64 / n as f64);
        let pieces: Vec<_> = (1..=n).filter_map(posture_at).collect();
        let starts = std::iter::once(from).chain(&pieces);
        let longest_m =
            starts.zip(&pieces).map(|(a, b)| space.distance_m(a, b)).fold(0.0, f64::max);
        // A chain that swings out and back goes farther than its ends tell.
        if longest_m <= MAX_REFINED_STEPS * step_m || n > MAX_PIECES {
            return Some(pieces);
        }
        n *= 2;
    }
}

/// Plans a path of an arm to a target, as [`plan`] does: the joint values after the present ones.
///
/// # Errors
/// As [`SerialChain::solve`](crate::kinematics::SerialChain::solve).
pub fn plan_joints<const D: usize>(
    space: &JointSpace<'_, D>,
    query: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Option<Vec<Vec<f64>>>, InputError> {
    let goals = space.goals(query, draws)?;
    let path = find_path(space, Vec::new(), goals, draws);
    Ok(path.map(|path| shortcuts::shorten_joint_path(space, path, draws)))
}

/// Plans a path in a space of a caller's own: the postures after the present one, the goal at the end; none if the search
/// found none.
pub fn plan_path<S: ConfigurationSpace>(
    space: &S,
    goal: S::Posture,
    draws: &mut Draws,
) -> Option<Vec<S::Posture>> {
    find_path(space, Vec::new(), vec![goal], draws)
}

/// Returns the shortened path to one of the goals, if there is any. `trail` is a path from the present posture to begin
/// with.
fn find_path<S: ConfigurationSpace>(
    space: &S,
    trail: Vec<S::Posture>,
    goals: Vec<S::Posture>,
    draws: &mut Draws,
) -> Option<Vec<S::Posture>> {
    if goals.is_empty() {
        return None;
    }
    let path = tree::find_path(space, trail, goals, draws)?;
    Some(tree::shorten_path(space, path, draws))
}

/// Returns valid postures that reach the target: arcs, and others that are sought, the first from the present posture
/// and the rest from any, because those near the present one may be cut off from it by the chain's own body.
fn goals<const D: usize>(
    space: &ChainConfigurationSpace<'_, D>,
    rules: ReactionRules,
    query: &PlanningQuery<D>,
    draws: &mut Draws,
) -> Result<Vec<ChainPosture<D>>, InputError> {
    let mut goals = space.arc_postures(query);
    goals.retain(|posture| space.is_free(posture));
    goals.truncate(MAX_GOALS);
    // A root that may move finds a place from which an arc leads to the target, and the search knows of no second base.
    if !space.is_root_still() && !goals.is_empty() || space.far_end().is_some() {
        return Ok(goals);
    }
    let mut solver = IkSolver::new(rules);
    let mut from = space.chain().clone();
    let most = goals.len() + MAX_GOALS;
    let known = goals.len();
    for search in 1..=MAX_SEARCHES {
        let goal = ChainIkGoal {
            // Postures alone: a motion there would be a path, and local rules have found none.
            engine: IkEngine::Dls,
            tolerance_m: query.tolerance_m,
            restarts: MAX_RESTARTS,
            seed: draws.next_u64(),
            ..ChainIkGoal::new(query.k, space.root(), query.target)
        };
        let result = solver.solve(&from, space.obstacles(), &goal)?;
        if result.reached && space.is_free(&result.points) && !goals.contains(&result.points) {
            goals.push(result.points);
        }
        // Where the first searches find nothing, further ones hardly would.
        if goals.len() == most || goals.len() == known && search == MAX_GOALS {
            break;
        }
        from.points_mut().copy_from_slice(&space.sample(draws));
    }
    Ok(goals)
}
