//! Motions that cannot be vetoed: no obstacle, every connector free. They are written straight into
//! the chain.
//!
//! A sweep is a series of dependent square roots and divisions, and its speed is their latency. The
//! two sweeps of an initiator in the middle depend only on the initiator, so they take turns in one
//! loop and the processor overlaps them; every bit is the same as one after the other. Several
//! motions of the same connector overlap likewise: each follows the one before it, two connectors
//! behind.

use super::candidates::guide_line_slave_position;
use super::chain::{Chain, Rod};
use super::geometry::{Point, distance, dot, sub};
use super::motion_context::is_length_allowed;
use super::pass::{ChainDirection, MotionEffects};

/// The rule by which a slave counts as staying in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StayRule {
    /// The new place is the old one, bit for bit.
    Exactly,
    /// The slave would move by no more than the least move: the rule of chains with something nearby.
    Nearly,
}

/// Moves connector `k`, and all connectors that must follow.
pub(super) fn pull_chain_by_connector<const D: usize>(
    chain: &mut Chain<D>,
    k: usize,
    to: Point<D>,
    stays: StayRule,
    tally: &mut MotionEffects,
) {
    match stays {
        StayRule::Exactly => sweep::<D, false>(chain, k, to, tally),
        StayRule::Nearly => sweep::<D, true>(chain, k, to, tally),
    }
}

/// Makes both sweeps. `NEARLY` is a parameter of the type because the loop is too short to test the
/// rule at every slave.
#[inline]
fn sweep<const D: usize, const NEARLY: bool>(
    chain: &mut Chain<D>,
    k: usize,
    to: Point<D>,
    tally: &mut MotionEffects,
) {
    let min_move_m = chain.min_move_m();
    let (points, rods) = chain.parts_mut();
    let from = std::mem::replace(&mut points[k], to);
    let mut sweeps = ChainDirection::BOTH
        .map(|direction| ObstacleFreePropagation::start(direction, k, from, to));
    let [up, down] = &mut sweeps;
    // In turn until one has ended, then the rest of the other one.
    while up.advance::<NEARLY>(points, rods, min_move_m)
        && down.advance::<NEARLY>(points, rods, min_move_m)
    {}
    while up.advance::<NEARLY>(points, rods, min_move_m) {}
    while down.advance::<NEARLY>(points, rods, min_move_m) {}
    tally.record_touched_range(down.master..up.master + 1);
    tally.changed += 1 + up.changed + down.changed;
    tally.record_slave_move(up.longest2.max(down.longest2).sqrt());
}

/// Largest number of motions in one batch; a request of more sub-steps is made one by one. One motion after the other
/// takes 19 ns a connector, eight at once about 4 ns.
pub(super) const MAX_BATCH: usize = 8;
/// Connectors by which a motion is behind the one before it: it reads its slave and the connector
/// beyond, and both must be final.
const LANE_OFFSET: usize = 2;

/// Moves connector `k` through at most [`MAX_BATCH`] places, and all connectors that must follow; slaves stay
/// as by [`StayRule::Nearly`]. Returns a bound on the travel of any connector, meters.
pub(super) fn pull_through_targets<const D: usize>(
    chain: &mut Chain<D>,
    k: usize,
    to: &[Point<D>],
    tally: &mut MotionEffects,
) -> f64 {
    let min_move_m = chain.min_move_m();
    let (points, rods) = chain.parts_mut();
    let at = points[k];
    let mut sweeps = ChainDirection::BOTH.map(|direction| {
        std::array::from_fn::<_, MAX_BATCH, _>(|j| {
            // Sweeps beyond the last motion fill the array and are never advanced.
            let j = j.min(to.len() - 1);
            ObstacleFreePropagation::start(direction, k, motion_start_point(at, to, j), to[j])
        })
    });
    for sweeps in &mut sweeps {
        run_staggered_sweeps(&mut sweeps[..to.len()], points, rods, min_move_m);
    }
    let [up, down] = sweeps;
    let mut travel_m = 0.0;
    for (j, (up, down)) in up.iter().zip(&down).take(to.len()).enumerate() {
        let slave_m = up.longest2.max(down.longest2).sqrt();
        travel_m += slave_m.max(distance(motion_start_point(at, to, j), to[j]));
        tally.record_touched_range(down.master..up.master + 1);
        tally.changed += 1 + up.changed + down.changed;
        tally.record_slave_move(slave_m);
    }
    points[k] = to[to.len() - 1];
    travel_m
}

/// Returns where the initiator is before motion `j`: at `at` before the first, then at the target of the one before.
#[inline]
fn motion_start_point<const D: usize>(at: Point<D>, to: &[Point<D>], j: usize) -> Point<D> {
    if j == 0 { at } else { to[j - 1] }
}

fn run_staggered_sweeps<const D: usize>(
    sweeps: &mut [ObstacleFreePropagation<D>],
    points: &mut [Point<D>],
    rods: &[Rod],
    min_move_m: f64,
) {
    let mut round = 0;
    let mut is_moving = true;
    // A sweep that has yet to start does not move, so rounds continue at least until the last one has started.
    while is_moving || round <= LANE_OFFSET * sweeps.len() {
        is_moving = false;
        for (j, sweep) in sweeps.iter_mut().enumerate() {
            if round >= LANE_OFFSET * j {
                is_moving |= sweep.advance::<true>(points, rods, min_move_m);
            }
        }
        round += 1;
    }
}

/// One sweep, outward from the initiator.
struct ObstacleFreePropagation<const D: usize> {
    direction: ChainDirection,
    /// The connector that moved last, and its position before and after.
    master: usize,
    mo: Point<D>,
    mn: Point<D>,
    changed: usize,
    /// Square of the longest distance that a slave moved.
    longest2: f64,
}

impl<const D: usize> ObstacleFreePropagation<D> {
    /// Returns the sweep of connector `k` that moves.
    fn start(direction: ChainDirection, k: usize, mo: Point<D>, mn: Point<D>) -> Self {
        Self { direction, master: k, mo, mn, changed: 0, longest2: 0.0 }
    }

    /// Moves the next slave; returns false, now and on every later call, once the motion has ended.
    #[inline(always)]
    fn advance<const NEARLY: bool>(
        &mut self,
        points: &mut [Point<D>],
        rods: &[Rod],
        min_move_m: f64,
    ) -> bool {
        let Some(slave) = self.direction.next(self.master, points.len()) else { return false };
        let so = points[slave];
        let rod = rods[slave.min(self.master)];
        let guided = guide_line_slave_position([self.mo, self.mn, so], rod, min_move_m);
        let new = if NEARLY && distance(guided, so) <= min_move_m { so } else { guided };
        if new == so && self.may_end_at(slave, points, rods) {
            return false;
        }
        let moved = sub(new, so);
        self.longest2 = self.longest2.max(dot(moved, moved));
        self.changed += usize::from(new != so);
        points[slave] = new;
        self.master = slave;
        self.mo = so;
        self.mn = new;
        true
    }

    /// Returns whether the rod beyond a slave that stays is within its limits; in a broken chain it need
    /// not be.
    fn may_end_at(&self, slave: usize, points: &[Point<D>], rods: &[Rod]) -> bool {
        let Some(next) = self.direction.next(slave, points.len()) else { return true };
        is_length_allowed(rods[slave.min(next)], distance(points[slave], points[next]))
    }
}
