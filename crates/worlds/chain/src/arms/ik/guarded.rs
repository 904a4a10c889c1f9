//! Goals of constrained chains.
//!
//! First the chain is moved there from its present posture. If that fails, postures are relaxed from
//! the present one, its mirror image, and random ones, until one is good.

use super::goal::{Answer, Engine, Goal, Kind, Unreached};
use super::legal::Judge;
use super::motion::{self, Went};
use super::relax::{self, Relaxed};
use super::{Solver, direct, limb, starts};
use crate::rods::chain::Chain;
use crate::rods::geometry::{Point, add, distance, sub};
use crate::rods::obstacle::Obstacles;
use crate::rods::veto::Veto;
use sidestep_kernel::InputError;

/// Meets `goal`, with a target within the shell that the rods reach.
pub(super) fn solve<const D: usize>(
    solver: &mut Solver<D>,
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    goal: &Goal<D>,
) -> Result<Answer<D>, InputError> {
    let self_collision = solver.propagator.rules.self_collision;
    let mut search = Search {
        judge: Judge { chain, obstacles, self_collision },
        goal,
        best: chain.points().to_vec(),
        engine: Engine::Chain,
        iterations: 0,
        veto: None,
    };
    if matches!(goal.engine, Engine::Auto | Engine::Chain) && search.by_motion(solver)? {
        return Ok(search.reached(Kind::Motion));
    }
    if goal.motion_only || goal.engine == Engine::Chain {
        return Ok(search.given_up(1));
    }
    if goal.engine == Engine::Direct {
        return Ok(search.by_closed_form(solver));
    }
    for start in 0..=goal.restarts {
        if search.by_relaxation(solver, start) {
            return Ok(search.reached(Kind::Posture));
        }
    }
    Ok(search.given_up(goal.restarts + 1))
}

struct Search<'a, const D: usize> {
    judge: Judge<'a, D>,
    goal: &'a Goal<D>,
    /// The good posture whose tip is nearest to the target so far.
    best: Vec<Point<D>>,
    engine: Engine,
    iterations: usize,
    /// The first objection, which is the one on the present posture's way.
    veto: Option<Veto<D>>,
}

impl<const D: usize> Search<'_, D> {
    fn by_motion(&mut self, solver: &mut Solver<D>) -> Result<bool, InputError> {
        let mut moved = self.judge.chain.clone();
        let Went { arrived, attempts, veto } =
            motion::go(&mut solver.propagator, &mut moved, self.judge.obstacles, self.goal)?;
        self.iterations += attempts;
        self.best.copy_from_slice(moved.points());
        self.veto = veto;
        Ok(arrived)
    }

    fn by_relaxation(&mut self, solver: &mut Solver<D>, start: usize) -> bool {
        let mut points = starts::start(self.judge.chain, self.goal, start);
        let Relaxed { rounds, veto } =
            relax::relax(&self.judge, &mut solver.limb, &mut points, self.goal);
        self.iterations += rounds;
        self.veto = self.veto.or(veto);
        let tip_m = distance(points[self.goal.k], self.goal.target);
        let is_good = veto.is_none() && tip_m <= self.goal.tolerance_m;
        if is_good {
            (self.best, self.engine) = (points, Engine::Dls);
        }
        is_good
    }

    fn by_closed_form(mut self, solver: &mut Solver<D>) -> Answer<D> {
        let mut points = self.judge.chain.points().to_vec();
        let Goal { base, k, target, .. } = *self.goal;
        let limb = &mut solver.limb;
        direct::solve(&mut limb.vectors, &limb.spans, sub(target, points[base]));
        let mut at = points[base];
        for (i, v) in limb::path(base, k).skip(1).zip(&limb.vectors) {
            at = add(at, *v);
            points[i] = at;
        }
        super::follow_beyond(&mut points, self.judge.chain, self.goal);
        self.veto = self.judge.objection(&points, k);
        self.engine = Engine::Direct;
        if self.veto.is_some() {
            return self.given_up(1);
        }
        self.best = points;
        self.reached(Kind::Posture)
    }

    fn reached(self, kind: Kind) -> Answer<D> {
        self.answer(true, kind, None)
    }

    fn given_up(self, tries: usize) -> Answer<D> {
        let reason = match self.veto {
            Some(veto) => Unreached::Blocked { veto },
            None => Unreached::NotFound { tries },
        };
        self.answer(false, Kind::Motion, Some(reason))
    }

    fn answer(self, reached: bool, kind: Kind, reason: Option<Unreached<D>>) -> Answer<D> {
        Answer {
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
