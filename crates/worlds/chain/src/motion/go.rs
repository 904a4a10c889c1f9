//! One motion of a chain: by propagation, or by a reach if a fixed base objects.

use crate::arms::ik::{Engine, Goal, Solver};
use crate::rods::chain::Chain;
use crate::rods::geometry::{Point, between, distance};
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
pub(crate) fn go<const D: usize>(
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
    held(propagator, chain, obstacles, &order, veto)
}

/// Moves a chain whose base objects as far as the limit of its joints allows. Near a singular
/// posture they go much farther than the initiator, which therefore goes less far.
fn held<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &Reach<D>,
    objection: &Veto<D>,
) -> Result<Outcome<D>, InputError> {
    // A connector that has failed is no base of an arm: what hangs on it swings as it did.
    let joints_m = match objection.reason {
        Reason::Fixed => propagator.rules.joint_step_max_m,
        _ => f64::INFINITY,
    };
    let before = chain.points().to_vec();
    let from = before[order.k];
    let (mut part, mut fastest) = (1.0, order.k);
    for _ in 0..MOST_SLOWED {
        let target = if part < 1.0 { between(from, order.target, part) } else { order.target };
        let order = Reach { target, ..*order };
        let (outcome, jump_m) =
            reached(propagator, (chain, &before), obstacles, &order, objection)?;
        let moved = match outcome {
            Outcome::Moved(moved) => moved,
            vetoed @ Outcome::Vetoed(_) => return Ok(vetoed),
        };
        let most_m = joints_m.min(jump_m);
        let (by, longest_m) = longest(&before, chain.points());
        let slowed =
            Veto { by, reason: Reason::StepLimit, reached: chain.points()[order.k], ..*objection };
        if longest_m <= most_m {
            let cut_short = (part < 1.0).then_some(slowed);
            return Ok(Outcome::Moved(Moved { cut_short, ..moved }));
        }
        chain.points_mut().copy_from_slice(&before);
        (part, fastest) = (part * SLOWED * most_m / longest_m, by);
    }
    let reason = Reason::StepLimit;
    Ok(Outcome::Vetoed(Veto { by: fastest, reason, reached: from, ..*objection }))
}

/// Returns the connector that has moved farthest, and its way, meters.
fn longest<const D: usize>(before: &[Point<D>], points: &[Point<D>]) -> (usize, f64) {
    let ways_m = before.iter().zip(points).map(|(a, b)| distance(*a, *b)).enumerate();
    ways_m.fold((0, 0.0), |most, way| if way.1 > most.1 { way } else { most })
}

/// Moves a chain whose base objects by passes there and back, or straight to a posture; returns also
/// the longest way of a connector for which the outcome counts as a motion, meters.
fn reached<const D: usize>(
    propagator: &mut Propagator<D>,
    (chain, before): (&mut Chain<D>, &[Point<D>]),
    obstacles: &Obstacles<D>,
    order: &Reach<D>,
    objection: &Veto<D>,
) -> Result<(Outcome<D>, f64), InputError> {
    Ok(match reach(propagator, chain, obstacles, order)? {
        Reached::There { .. } => {
            (Outcome::Moved(moved_since(before, chain, order.k)), f64::INFINITY)
        }
        Reached::Short { veto: Some(veto), .. } => (Outcome::Vetoed(veto), f64::INFINITY),
        Reached::Short { nearest, veto: None } => {
            let objection = Veto { reached: nearest, ..*objection };
            let rules = propagator.rules;
            let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
            let jump_m = rules.slave_step_max_m.min(LONGEST_JUMP * longest_m);
            (by_posture(rules, (chain, before), obstacles, order, objection)?, jump_m)
        }
    })
}

/// Most attempts to find how far an initiator may go.
const MOST_SLOWED: usize = 16;
/// Part of the limit that an attempt aims at, because near singular postures joints slow down less
/// than the initiator.
const SLOWED: f64 = 0.9;

/// Finds a posture, or reports that the target is out of reach. Passes converge slowly if a chain
/// is nearly straight, and not at all along a straight line, so damped least squares find the nearest
/// posture that gets there, and the chain goes straight to it if neither the posture nor the way to it
/// is blocked.
fn by_posture<const D: usize>(
    rules: Rules,
    (chain, before): (&mut Chain<D>, &[Point<D>]),
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
    let goal = Goal { engine: Engine::Dls, restarts: 0, tolerance_m, ..Goal::new(k, base, target) };
    let answer = Solver::new(rules).solve(chain, obstacles, &goal)?;
    if !answer.reached {
        return Ok(Outcome::Vetoed(objection));
    }
    chain.points_mut().copy_from_slice(&answer.points);
    if let Some(passed) = passed(chain, before, obstacles, 0.0) {
        chain.points_mut().copy_from_slice(before);
        let (by, obstacle) = (passed.rod, Some(passed.obstacle));
        return Ok(Outcome::Vetoed(Veto {
            by,
            obstacle,
            reason: Reason::WouldTunnel,
            ..objection
        }));
    }
    Ok(Outcome::Moved(moved_since(before, chain, k)))
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rods::chain::{Connector, Mobility, Rod};
    use crate::rods::veto::{Mode, Source};

    /// An arm of two rods, bent a little; the base is fixed.
    fn arm() -> Chain<2> {
        let points = vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let mut arm =
            Chain::new(points, vec![Connector::free(0.05); 3], vec![Rod::fixed(1.0, 0.02); 2])
                .unwrap();
        arm.set_mobility(0, Mobility::Fixed).unwrap();
        arm
    }

    /// Drags the tool out to 0.1 mm less than the reach; returns the longest way of any connector in a
    /// request, and how far from the base the tool comes.
    fn dragged_out(joint_step_max_m: f64) -> (f64, f64) {
        let (mut chain, step_m) = (arm(), 0.01);
        let mut propagator = Propagator::new(Rules { joint_step_max_m, ..Rules::default() });
        let mut most_m = 0.0;
        for _ in 0..400 {
            let (before, at) = (chain.points().to_vec(), chain.points()[2]);
            let to = crate::rods::geometry::towards(at, [1.199_94, 1.599_92], step_m);
            let motion = Motion::Connector { k: 2, to };
            let request = Request { motion, source: Source::Autonomous, mode: Mode::Exact };
            go(&mut propagator, &mut chain, &Obstacles::default(), &request).unwrap();
            most_m = f64::max(most_m, longest(&before, chain.points()).1);
        }
        (most_m, distance(chain.points()[2], [0.0; 2]))
    }

    #[test]
    fn a_straight_arm_is_drawn_inward_and_no_joint_is_faster_than_it_may_be() {
        let joint_step_max_m = 0.08;
        let rules = Rules { joint_step_max_m, ..Rules::default() };
        for n_rods in [3, 7, 11, 25] {
            let rod = Rod::fixed(1.0, 0.03);
            let mut arm =
                Chain::straight([0.0; 2], [1.0, 0.0], n_rods, rod, Connector::free(0.05)).unwrap();
            arm.set_mobility(0, Mobility::Fixed).unwrap();
            let target = [0.5 * n_rods as f64, 0.0];
            for _ in 0..4000 {
                let before = arm.points().to_vec();
                let to = crate::rods::geometry::towards(before[n_rods], target, 0.04);
                let request = Request::exact(n_rods, to);
                go(&mut Propagator::new(rules), &mut arm, &Obstacles::default(), &request).unwrap();
                assert!(longest(&before, arm.points()).1 <= joint_step_max_m);
            }
            let left_m = distance(arm.points()[n_rods], target);
            assert!(left_m < 1e-6, "{n_rods} rods: {left_m} m are left");
        }
    }

    #[test]
    fn joints_keep_their_limit_near_a_singular_posture_and_the_tool_still_gets_there() {
        let (free_m, _) = dragged_out(f64::INFINITY);
        assert!(free_m > 0.04, "without a limit the elbow goes {free_m} m for 0.01 m of the tool");
        let (limited_m, reached_m) = dragged_out(0.02);
        assert!(limited_m <= 0.02, "{limited_m}");
        assert!(reached_m > 1.9998, "{reached_m} of 2 m");
    }
}
