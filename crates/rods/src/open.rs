//! Motions that cannot be vetoed: no obstacle, every connector free. They are written straight into
//! the chain.
//!
//! A sweep is a series of dependent square roots and divisions, and its speed is their latency. The
//! two sweeps of an initiator in the middle depend only on the initiator, so they take turns in one
//! loop and the processor overlaps them; every bit is the same as one after the other.

use super::candidates::guide_line_slave_position;
use super::chain::{Chain, Rod};
use super::geometry::{Point, distance, dot, sub};
use super::motion_bounds::ROUNDING_M;
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

/// Moves connector 0, and of the first `connectors` all that must follow. The rest of the chain follows later, from
/// where the last of them goes. Returns the last connector that its master pushed away by more than rounding.
pub(super) fn pull_first_connectors<const D: usize>(
    chain: &mut Chain<D>,
    connectors: usize,
    to: Point<D>,
    tally: &mut MotionEffects,
) -> Option<usize> {
    let min_move_m = chain.min_move_m();
    let (points, rods) = chain.parts_mut();
    let mut sweep = ObstacleFreePropagation::start(ChainDirection::Up, 0, points[0], to);
    points[0] = to;
    let mut last_pushed = None;
    while sweep.master + 1 < connectors {
        let slave = sweep.master + 1;
        if distance(sweep.mn, points[slave]) < rods[sweep.master].min_m - ROUNDING_M {
            last_pushed = Some(slave);
        }
        if !sweep.advance::<false>(points, rods, min_move_m) {
            break;
        }
    }
    tally.record_touched_range(0..sweep.master + 1);
    tally.changed += 1 + sweep.changed;
    tally.record_slave_move(sweep.longest2.sqrt());
    last_pushed
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
