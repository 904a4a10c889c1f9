//! Motion of an arm to a target by the chain's rules: in one request if possible, otherwise step by step,
//! with other headings if one is blocked. The result is a motion: every state was checked.

use super::ChainIkGoal;
use sidestep_kernel::{InputError, math};
use sidestep_rods::geometry::{
    Point, add, add_scaled, distance, normalized, perpendicular, scaled, sub, unit_x,
};
use sidestep_rods::{Chain, Obstacles, Propagator, ReachOutcome, ReachRequest, Veto, reach_target};

/// Headings to either side of the target's, in rad: a fan of the directions from ahead to somewhat back, in steps of 23
/// degrees, because an obstacle in the way is mostly passed on one of its sides.
const FAN_RAD: [f64; 5] = [0.4, 0.8, 1.2, 1.6, 2.0];
/// Steps without approach of the tip before the motion is given up: a detour leads away from the target for a few steps.
const MAX_IDLE_STEPS: usize = 10;
/// Largest number of attempts to move, over all steps; each is a whole reach, and a posture found by search is then
/// quicker.
const MAX_ATTEMPTS: usize = 120;
/// Length of a step of the tip, as a fraction of the shortest rod: from there on a return pass nearly always succeeds.
const STEP_FRACTION: f64 = 0.5;
/// Fraction of a step by which the tip may miss its place, and by which it must come nearer to count as an approach.
const STEP_TOLERANCE: f64 = 0.01;

/// Result of a motion; the chain is where it ended.
pub(super) struct MotionResult<const D: usize> {
    pub(super) arrived: bool,
    pub(super) attempts: usize,
    /// The last objection to the straight path.
    pub(super) veto: Option<Veto<D>>,
}

/// Moves connector `goal.k` of `chain` toward the target.
pub(super) fn move_to_goal<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    goal: &ChainIkGoal<D>,
) -> Result<MotionResult<D>, InputError> {
    let mut motion =
        StepwiseMotion { propagator, obstacles, goal, attempts: 0, veto: None, side: 1.0 };
    if motion.step(chain, goal.target, goal.tolerance_m)? {
        return Ok(motion.result(true));
    }
    let step_m = STEP_FRACTION * chain.rods().iter().map(|r| r.min_m).fold(f64::INFINITY, f64::min);
    let mut best = chain.clone();
    let mut best_m = distance_left_m(chain, goal);
    let mut idle = 0;
    while idle < MAX_IDLE_STEPS && motion.attempts < MAX_ATTEMPTS {
        let left_m = distance_left_m(chain, goal);
        if left_m <= step_m && motion.step(chain, goal.target, goal.tolerance_m)? {
            return Ok(motion.result(true));
        }
        if !motion.try_fan(chain, step_m.min(left_m))? {
            break;
        }
        idle += 1;
        let left_m = distance_left_m(chain, goal);
        if left_m < best_m - STEP_TOLERANCE * step_m {
            best = chain.clone();
            best_m = left_m;
            idle = 0;
        }
    }
    *chain = best;
    Ok(motion.result(false))
}

/// Returns the distance of the tip from its target, meters.
fn distance_left_m<const D: usize>(chain: &Chain<D>, goal: &ChainIkGoal<D>) -> f64 {
    distance(chain.points()[goal.k], goal.target)
}

struct StepwiseMotion<'a, const D: usize> {
    propagator: &'a mut Propagator<D>,
    obstacles: &'a Obstacles<D>,
    goal: &'a ChainIkGoal<D>,
    attempts: usize,
    veto: Option<Veto<D>>,
    /// The side that worked last, which is tried first.
    side: f64,
}

impl<const D: usize> StepwiseMotion<'_, D> {
    fn result(self, arrived: bool) -> MotionResult<D> {
        MotionResult { arrived, attempts: self.attempts, veto: self.veto }
    }

    fn step(
        &mut self,
        chain: &mut Chain<D>,
        target: Point<D>,
        tolerance_m: f64,
    ) -> Result<bool, InputError> {
        self.attempts += 1;
        let ChainIkGoal { k, base, .. } = *self.goal;
        let request = ReachRequest { k, target, base, tolerance_m };
        match reach_target(self.propagator, chain, self.obstacles, &request)? {
            ReachOutcome::There { .. } => Ok(true),
            ReachOutcome::Short { veto, .. } => {
                self.veto = veto.or(self.veto);
                Ok(false)
            }
        }
    }

    /// Makes one step toward the target, or along the first heading of the fan that works.
    fn try_fan(&mut self, chain: &mut Chain<D>, step_m: f64) -> Result<bool, InputError> {
        let from = chain.points()[self.goal.k];
        let ahead = normalized(sub(self.goal.target, from)).unwrap_or(unit_x());
        let tolerance_m = (STEP_TOLERANCE * step_m).max(self.goal.tolerance_m);
        if self.step(chain, add_scaled(from, ahead, step_m), tolerance_m)? {
            return Ok(true);
        }
        let sides = sideways_directions(ahead, self.side);
        for turn_rad in FAN_RAD {
            for (i, side) in sides.iter().flatten().enumerate() {
                let [c, s] = [math::cos(turn_rad), math::sin(turn_rad)];
                let u = add(scaled(ahead, c), scaled(*side, s));
                if self.step(chain, add_scaled(from, u, step_m), tolerance_m)? {
                    self.side *= if i % 2 == 0 { 1.0 } else { -1.0 };
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }
}

/// Returns directions across `u`: two in the plane, four in space; the one on the side of `sign` first.
fn sideways_directions<const D: usize>(u: Point<D>, sign: f64) -> [Option<Point<D>>; 4] {
    let e = scaled(perpendicular(u), sign);
    let other = (D == 3).then(|| -> Point<D> {
        std::array::from_fn(|i| {
            let j = (i + 1) % D;
            let k = (i + 2) % D;
            u[j] * e[k] - u[k] * e[j]
        })
    });
    [Some(e), Some(scaled(e, -1.0)), other, other.map(|o| scaled(o, -1.0))]
}
