//! Inverse kinematics: a posture of a chain with connector `k` at a target while its base keeps its
//! place.
//!
//! ```text
//! goal               a goal, and its result
//! limb               the rods from base to tip; their reach
//! dls                the nearest posture, by damped least squares in O(n)
//! alternate          the chain's own rule there and back (FABRIK)
//! direct             closed form: straight except for two bends
//! constraint_search  obstacles, bend limits, the chain's own body, connectors that are not free:
//!                    motion, then relax from several starts, checked by constraints
//! ```
//!
//! If nothing constrains the connectors every target within reach is reached: the remaining error
//! of an engine is removed in closed form. Constrained chains are first *moved* there by the rules of
//! propagation, with every state of the path checked; if that fails, valid postures are searched, and
//! [`MotionOrPosture`] says which of the two a result is.

mod alternate;
mod constraint_search;
pub(super) mod constraints;
mod direct;
mod dls;
mod goal;
mod limb;
mod motion;
mod relax;
mod starts;
#[cfg(test)]
mod tests;

pub use goal::{ChainIkFailure, ChainIkGoal, ChainIkResult, IkEngine, MotionOrPosture};
pub use limb::ReachShell;

use limb::{Limb, RodLengthRange};
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, add, add_scaled, distance, is_finite, norm, sub, unit_x};
use sidestep_rods::{Chain, Obstacles, Propagator, ReactionRules};

/// Number of rods up to which the chain's own rule is faster (bench `ik`, part `free`).
const MAX_CHAIN_RULE_RODS: usize = 10;

/// Solves goals. It owns the buffers, and remembers nothing from one goal to the next.
#[derive(Debug, Clone, Default)]
pub struct IkSolver<const D: usize> {
    propagator: Propagator<D>,
    limb: Limb<D>,
    points: Vec<Point<D>>,
}

struct EngineResult {
    iterations: usize,
    engine: IkEngine,
}

impl<const D: usize> IkSolver<D> {
    /// Returns a solver for chains that react by `rules`; of these only self-collision concerns
    /// postures, the others concern motions.
    pub fn new(rules: ReactionRules) -> Self {
        Self { propagator: Propagator::new(rules), ..Self::default() }
    }

    /// Returns a posture of `chain` that meets the goal, or the nearest one found. The chain itself
    /// is not changed. The connector nearest to the goal's that never moves is the effective base;
    /// connectors behind the base stay where they are, those beyond the goal's follow.
    ///
    /// # Errors
    /// When a target is not finite, a tolerance is not above zero, the chain does not have the
    /// connectors, or one of them may not move. A target that cannot be reached is no error.
    pub fn solve(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        goal: &ChainIkGoal<D>,
    ) -> Result<ChainIkResult<D>, InputError> {
        check(chain, goal)?;
        let base = limb::nearest_fixed_connector(chain, goal.base, goal.k);
        let goal = &ChainIkGoal { base, ..*goal };
        self.limb.read(chain, chain.points(), base, goal.k);
        let shell = ReachShell::from_length_ranges(&self.limb.spans);
        let home = chain.points()[base];
        // A target out of reach is replaced by the nearest one within it, so that every engine can converge.
        let reachable = add(home, shell.nearest(sub(goal.target, home)));
        let is_constrained = !obstacles.is_empty()
            || self.propagator.rules.self_collision
            || !limb::is_unconstrained(chain, base);
        let answer = if is_constrained {
            constraint_search::solve(
                self,
                chain,
                obstacles,
                &ChainIkGoal { target: reachable, ..*goal },
            )?
        } else {
            self.solve_unconstrained(chain, &ChainIkGoal { target: reachable, ..*goal })
        };
        Ok(answer.compared_with_goal(goal, &shell, home))
    }

    /// Solves a goal within reach, which always works where nothing constrains the chain.
    fn solve_unconstrained(&mut self, chain: &Chain<D>, goal: &ChainIkGoal<D>) -> ChainIkResult<D> {
        self.points.clear();
        self.points.extend_from_slice(chain.points());
        let EngineResult { iterations, engine } = self.unconstrained_posture(goal);
        self.update_points(goal);
        follow_beyond(&mut self.points, chain, goal);
        ChainIkResult {
            reached: true,
            error_m: 0.0,
            points: self.points.clone(),
            iterations,
            engine,
            kind: MotionOrPosture::Posture,
            reason: None,
        }
    }

    /// Brings `self.limb` to the target, which is within its reach.
    fn unconstrained_posture(&mut self, goal: &ChainIkGoal<D>) -> EngineResult {
        let Self { limb: Limb { spans, vectors }, points, .. } = self;
        let target = sub(goal.target, points[goal.base]);
        let engines: &[IkEngine] = match goal.engine {
            IkEngine::Auto if spans.len() <= MAX_CHAIN_RULE_RODS => {
                &[IkEngine::Chain, IkEngine::Dls]
            }
            IkEngine::Auto | IkEngine::Dls => &[IkEngine::Dls],
            IkEngine::Chain => &[IkEngine::Chain],
            IkEngine::Direct => &[],
        };
        let mut iterations = 0;
        for &engine in engines {
            let solve =
                if engine == IkEngine::Chain { alternate::solve_rod_vectors } else { dls::solve };
            let (used, left_m) = solve(vectors, spans, target, goal.tolerance_m);
            iterations += used;
            if left_m <= goal.tolerance_m {
                return EngineResult { iterations, engine };
            }
        }
        direct::solve(vectors, spans, target);
        EngineResult { iterations, engine: IkEngine::Direct }
    }

    /// Writes the limb's positions from the base on.
    fn update_points(&mut self, goal: &ChainIkGoal<D>) {
        let mut at = self.points[goal.base];
        for (i, v) in limb::connector_indices(goal.base, goal.k).skip(1).zip(&self.limb.vectors) {
            at = add(at, *v);
            self.points[i] = at;
        }
    }
}

/// Pushes and pulls the connectors beyond the goal's along with it.
fn follow_beyond<const D: usize>(points: &mut [Point<D>], chain: &Chain<D>, goal: &ChainIkGoal<D>) {
    let end = if goal.k > goal.base { points.len() - 1 } else { 0 };
    let mut master = goal.k;
    for slave in limb::connector_indices(goal.k, end).skip(1) {
        let span = RodLengthRange::from_rod(&chain.rod_between(master, slave));
        let g = sub(points[slave], points[master]);
        let d = norm(g);
        points[slave] = if d > 0.0 {
            add_scaled(points[master], g, span.clamp_m(d) / d)
        } else {
            add_scaled(points[master], unit_x(), span.min_m)
        };
        master = slave;
    }
}

fn check<const D: usize>(chain: &Chain<D>, goal: &ChainIkGoal<D>) -> Result<(), InputError> {
    let n = chain.points().len();
    if goal.k >= n {
        let cause = format!("is connector {}, of {n}", goal.k);
        return Err(InputError::new("tip", cause, "count from 0"));
    }
    if goal.base >= n || goal.base == goal.k {
        let cause = format!("is connector {}, of {n}", goal.base);
        let remedy = "give another connector than the tip, counted from 0";
        return Err(InputError::new("base", cause, remedy));
    }
    if chain.connectors()[goal.k].is_still() {
        let cause = format!("is connector {}, which never moves", goal.k);
        return Err(InputError::new("tip", cause, "give a connector that is free"));
    }
    if !is_finite(&goal.target) || goal.target.iter().any(|x| x.abs() > 1e7) {
        let cause = format!("is {:?}", goal.target);
        return Err(InputError::new("target", cause, "give finite coordinates up to 1e7 m"));
    }
    if !(goal.tolerance_m > 0.0 && goal.tolerance_m.is_finite()) {
        let cause = format!("is {} m", goal.tolerance_m);
        return Err(InputError::new("tolerance", cause, "give a length above 0"));
    }
    Ok(())
}

impl<const D: usize> ChainIkResult<D> {
    /// Returns the answer compared with the goal as it was given, which may be out of reach.
    fn compared_with_goal(
        mut self,
        goal: &ChainIkGoal<D>,
        shell: &ReachShell,
        home: Point<D>,
    ) -> Self {
        self.error_m = distance(self.points[goal.k], goal.target);
        self.reached = self.error_m <= goal.tolerance_m && self.reason.is_none();
        if !self.reached {
            let far_m = distance(goal.target, home);
            let ReachShell { hole_m, reach_m } = *shell;
            if far_m > reach_m + goal.tolerance_m {
                self.reason = Some(ChainIkFailure::TooFar { far_m, reach_m });
            } else if far_m < hole_m - goal.tolerance_m {
                self.reason = Some(ChainIkFailure::TooNear { far_m, hole_m });
            }
            self.reason = self.reason.or(Some(ChainIkFailure::NotFound { tries: 1 }));
        }
        self
    }
}
