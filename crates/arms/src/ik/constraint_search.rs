//! Goals of constrained chains.
//!
//! First the chain is moved there from its present posture. If that fails, postures are relaxed from
//! the present one, its mirror image, and random ones, until one is good.

use super::constraints::ConstraintChecker;
use super::goal::{ChainIkFailure, ChainIkGoal, ChainIkResult, IkEngine, MotionOrPosture};
use super::motion::{self, MotionResult};
use super::relax::{self, RelaxResult};
use super::{IkSolver, direct, limb, starts};
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, add, distance, sub};
use sidestep_rods::{Chain, Obstacles, Veto};

/// Meets `goal`, with a target within the shell that the rods reach.
pub(super) fn solve<const D: usize>(
    solver: &mut IkSolver<D>,
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    goal: &ChainIkGoal<D>,
) -> Result<ChainIkResult<D>, InputError> {
    let self_collision = solver.propagator.rules.self_collision;
    let mut search = ConstraintSearch {
        checker: ConstraintChecker { chain, obstacles, self_collision },
        goal,
        best: chain.points().to_vec(),
        engine: IkEngine::Chain,
        iterations: 0,
        veto: None,
    };
    if matches!(goal.engine, IkEngine::Auto | IkEngine::Chain) && search.search_by_motion(solver)? {
        return Ok(search.success(MotionOrPosture::Motion));
    }
    if goal.motion_only || goal.engine == IkEngine::Chain {
        return Ok(search.failure(1));
    }
    if goal.engine == IkEngine::Direct {
        return Ok(search.search_by_closed_form(solver));
    }
    for start in 0..=goal.restarts {
        if search.search_by_relaxation(solver, start) {
            return Ok(search.success(MotionOrPosture::Posture));
        }
    }
    Ok(search.failure(goal.restarts + 1))
}

struct ConstraintSearch<'a, const D: usize> {
    checker: ConstraintChecker<'a, D>,
    goal: &'a ChainIkGoal<D>,
    /// The valid posture whose tip is nearest to the target so far.
    best: Vec<Point<D>>,
    engine: IkEngine,
    iterations: usize,
    /// The first objection: the one to the motion from the present posture, which tells a user more than
    /// those to random starts.
    veto: Option<Veto<D>>,
}

impl<const D: usize> ConstraintSearch<'_, D> {
    fn search_by_motion(&mut self, solver: &mut IkSolver<D>) -> Result<bool, InputError> {
        let mut moved = self.checker.chain.clone();
        let MotionResult { arrived, attempts, veto } = motion::move_to_goal(
            &mut solver.propagator,
            &mut moved,
            self.checker.obstacles,
            self.goal,
        )?;
        self.iterations += attempts;
        self.best.copy_from_slice(moved.points());
        self.veto = veto;
        Ok(arrived)
    }

    fn search_by_relaxation(&mut self, solver: &mut IkSolver<D>, start: usize) -> bool {
        let mut points = starts::start(self.checker.chain, self.goal, start);
        let RelaxResult { rounds, veto } =
            relax::relax(&self.checker, &mut solver.limb, &mut points, self.goal);
        self.iterations += rounds;
        self.veto = self.veto.or(veto);
        let tip_m = distance(points[self.goal.k], self.goal.target);
        let is_good = veto.is_none() && tip_m <= self.goal.tolerance_m;
        if is_good {
            self.best = points;
            self.engine = IkEngine::Dls;
        }
        is_good
    }

    fn search_by_closed_form(mut self, solver: &mut IkSolver<D>) -> ChainIkResult<D> {
        let mut points = self.checker.chain.points().to_vec();
        let ChainIkGoal { base, k, target, .. } = *self.goal;
        let limb = &mut solver.limb;
        direct::solve(&mut limb.vectors, &limb.spans, sub(target, points[base]));
        let mut at = points[base];
        for (i, v) in limb::connector_indices(base, k).skip(1).zip(&limb.vectors) {
            at = add(at, *v);
            points[i] = at;
        }
        super::follow_beyond(&mut points, self.checker.chain, self.goal);
        self.veto = self.checker.find_veto(&points, k);
        self.engine = IkEngine::Direct;
        if self.veto.is_some() {
            return self.failure(1);
        }
        self.best = points;
        self.success(MotionOrPosture::Posture)
    }

    fn success(self, kind: MotionOrPosture) -> ChainIkResult<D> {
        self.result(true, kind, None)
    }

    fn failure(self, tries: usize) -> ChainIkResult<D> {
        let reason = match self.veto {
            Some(veto) => ChainIkFailure::Blocked { veto },
            None => ChainIkFailure::NotFound { tries },
        };
        // The best posture is then one that the motion came to: relaxed ones are kept only if they
        // meet the goal.
        self.result(false, MotionOrPosture::Motion, Some(reason))
    }

    fn result(
        self,
        reached: bool,
        kind: MotionOrPosture,
        reason: Option<ChainIkFailure<D>>,
    ) -> ChainIkResult<D> {
        ChainIkResult {
            reached,
            error_m: distance(self.best[self.goal.k], self.goal.target),
            points: self.best,
            iterations: self.iterations,
            engine: self.engine,
            kind,
            reason,
        }
    }
}
