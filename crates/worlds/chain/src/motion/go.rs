//! One motion of a chain: by propagation, or by a reach if a fixed base objects.

use crate::arms::ik::{Engine, Goal, Solver};
use crate::rods::chain::Chain;
use crate::rods::geometry::{Point, distance};
use crate::rods::obstacle::Obstacles;
use crate::rods::passage::passed;
use crate::rods::propagate::Propagator;
use crate::rods::reach::{Reach, Reached, reach};
use crate::rods::rules::Rules;
use crate::rods::veto::{Motion, Moved, Outcome, Reason, Request, Veto};
use sidestep_kernel::InputError;

/// Moves a chain as requested; if a fixed base objects, by [`reach`].
///
/// # Errors
/// As [`Propagator::propagate`].
pub(super) fn go<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    request: &Request<D>,
) -> Result<Outcome<D>, InputError> {
    let outcome = propagator.propagate(chain, obstacles, request)?;
    let (Outcome::Vetoed(veto), Motion::Connector { k, to }) = (&outcome, request.motion) else {
        return Ok(outcome);
    };
    let is_base = matches!(veto.reason, Reason::Fixed | Reason::Failed) && veto.by != k;
    if !is_base {
        return Ok(outcome);
    }
    let order = Reach { k, target: to, base: veto.by, tolerance_m: TOLERANCE_M };
    let before = chain.points().to_vec();
    Ok(match reach(propagator, chain, obstacles, &order)? {
        Reached::There { .. } => Outcome::Moved(moved_since(&before, chain, k)),
        Reached::Short { veto: Some(veto), .. } => Outcome::Vetoed(veto),
        Reached::Short { nearest, veto: None } => {
            let objection = Veto { reached: nearest, ..*veto };
            by_posture(propagator.rules, chain, obstacles, &order, objection)?
        }
    })
}

/// Finds a posture, or reports that the target is out of reach. Passes converge slowly if a chain
/// is nearly straight, so damped least squares find the nearest posture that gets there, and the
/// chain goes straight to it if neither the posture nor the way to it is blocked.
fn by_posture<const D: usize>(
    rules: Rules,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &Reach<D>,
    objection: Veto<D>,
) -> Result<Outcome<D>, InputError> {
    let Reach { k, target, base, tolerance_m } = *order;
    let [from, to] = [base.min(k), base.max(k)];
    let reach_m: f64 = chain.rods()[from..to].iter().map(|rod| rod.max_m).sum();
    let far_m = |p: Point<D>| distance(chain.points()[base], p);
    if far_m(target) > reach_m + tolerance_m && objection.reason == Reason::Fixed {
        return Ok(Outcome::Vetoed(Veto { reason: Reason::OutOfReach, ..objection }));
    }
    if far_m(chain.points()[k]) <= STRETCHED * reach_m {
        return Ok(Outcome::Vetoed(objection));
    }
    let goal = Goal { engine: Engine::Dls, restarts: 0, tolerance_m, ..Goal::new(k, base, target) };
    let answer = Solver::new(rules).solve(chain, obstacles, &goal)?;
    let before = chain.points().to_vec();
    let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
    let most_m = rules.slave_step_max_m.min(LONGEST_JUMP * longest_m);
    let is_near = |(a, b): (&Point<D>, &Point<D>)| distance(*a, *b) <= most_m;
    if !answer.reached || !before.iter().zip(&answer.points).all(is_near) {
        return Ok(Outcome::Vetoed(objection));
    }
    chain.points_mut().copy_from_slice(&answer.points);
    if let Some(passed) = passed(chain, &before, obstacles, 0.0) {
        chain.points_mut().copy_from_slice(&before);
        let (by, obstacle) = (passed.rod, Some(passed.obstacle));
        return Ok(Outcome::Vetoed(Veto {
            by,
            obstacle,
            reason: Reason::WouldTunnel,
            ..objection
        }));
    }
    Ok(Outcome::Moved(moved_since(&before, chain, k)))
}

/// Part of its reach from which on a chain counts as nearly straight.
const STRETCHED: f64 = 0.95;

/// Longest move of a connector, as a part of the longest rod, for which a posture is accepted as a
/// motion.
const LONGEST_JUMP: f64 = 0.5;

/// Distance at which a connector's step counts as complete, meters.
const TOLERANCE_M: f64 = 1e-7;

/// Returns what has moved, by comparison.
fn moved_since<const D: usize>(before: &[Point<D>], chain: &Chain<D>, k: usize) -> Moved<D> {
    let ways_m = before.iter().zip(chain.points()).map(|(a, b)| distance(*a, *b));
    let slaves = ways_m.enumerate().filter(|(i, _)| *i != k);
    Moved {
        touched: 0..before.len(),
        changed: before.iter().zip(chain.points()).filter(|(a, b)| a != b).count(),
        rotated: 0,
        max_slave_step_m: slaves.map(|(_, way_m)| way_m).fold(0.0, f64::max),
        cut_short: None,
    }
}
