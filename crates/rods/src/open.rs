//! Motions without any possible objection: no obstacle, every connector free. They are written
//! straight into the chain.
//!
//! A sweep is a series of dependent roots and divisions, each of which the processor waits for. The
//! two sweeps of an initiator in the middle depend only on the initiator, so they take turns in one
//! loop and the processor computes both at once; every bit is the same as one after the other. So it is
//! with several motions of the same connector: each follows the one before it, two connectors behind.

use super::candidates::guide;
use super::chain::{Chain, Rod};
use super::geometry::{Point, distance, dot, sub};
use super::motion_context::is_length_allowed;
use super::pass::{Direction, MotionTally};

/// The rule by which a slave counts as staying in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StayRule {
    /// The new place is the old one, bit for bit.
    Exactly,
    /// The slave would move by no more than the least move: the rule of chains with something nearby.
    Nearly,
}

/// Moves connector `k`, and all connectors that must follow.
pub(super) fn pull<const D: usize>(
    chain: &mut Chain<D>,
    k: usize,
    to: Point<D>,
    stays: StayRule,
    tally: &mut MotionTally,
) {
    match stays {
        StayRule::Exactly => sweep::<D, false>(chain, k, to, tally),
        StayRule::Nearly => sweep::<D, true>(chain, k, to, tally),
    }
}

/// Makes both sweeps. A parameter of the type, because the loop is too short for a test that is
/// always the same.
#[inline]
fn sweep<const D: usize, const NEARLY: bool>(
    chain: &mut Chain<D>,
    k: usize,
    to: Point<D>,
    tally: &mut MotionTally,
) {
    let least_move_m = chain.min_move_m();
    let (points, rods) = chain.parts_mut();
    let from = std::mem::replace(&mut points[k], to);
    let mut sweeps = Direction::BOTH.map(|direction| OpenSweep::start(direction, k, from, to));
    let [up, down] = &mut sweeps;
    while up.advance::<NEARLY>(points, rods, least_move_m)
        && down.advance::<NEARLY>(points, rods, least_move_m)
    {}
    while up.advance::<NEARLY>(points, rods, least_move_m) {}
    while down.advance::<NEARLY>(points, rods, least_move_m) {}
    tally.record_run(down.master..up.master + 1);
    tally.changed += 1 + up.changed + down.changed;
    tally.record_slave_move(up.longest2.max(down.longest2).sqrt());
}

/// Most motions that are made in turn.
pub(super) const MAX_BATCH: usize = 8;
/// Connectors by which a motion is behind the one before it: it reads the slave and the next one, as that has left them.
const LANE_OFFSET: usize = 2;

/// Moves connector `k` to some places one after the other, at most [`MAX_BATCH`] of them, and all connectors that must
/// follow; slaves stay as by [`StayRule::Nearly`]. Returns a bound of any connector's way, meters.
pub(super) fn pull_batch<const D: usize>(
    chain: &mut Chain<D>,
    k: usize,
    to: &[Point<D>],
    tally: &mut MotionTally,
) -> f64 {
    let least_move_m = chain.min_move_m();
    let (points, rods) = chain.parts_mut();
    let from = |points: &[Point<D>], j: usize| if j == 0 { points[k] } else { to[j - 1] };
    let mut sweeps = Direction::BOTH.map(|direction| {
        let start = |j: usize| OpenSweep::start(direction, k, from(points, j), to[j]);
        std::array::from_fn::<_, MAX_BATCH, _>(|j| start(j.min(to.len() - 1)))
    });
    for sweeps in &mut sweeps {
        advance_batch(&mut sweeps[..to.len()], points, rods, least_move_m);
    }
    let [up, down] = sweeps;
    let mut way_m = 0.0;
    for (j, (up, down)) in up.iter().zip(&down).take(to.len()).enumerate() {
        let slave_m = up.longest2.max(down.longest2).sqrt();
        way_m += slave_m.max(distance(from(points, j), to[j]));
        tally.record_run(down.master..up.master + 1);
        tally.changed += 1 + up.changed + down.changed;
        tally.record_slave_move(slave_m);
    }
    points[k] = to[to.len() - 1];
    way_m
}

fn advance_batch<const D: usize>(
    sweeps: &mut [OpenSweep<D>],
    points: &mut [Point<D>],
    rods: &[Rod],
    least_move_m: f64,
) {
    let (mut round, mut goes_on) = (0, true);
    while goes_on || round <= LANE_OFFSET * sweeps.len() {
        goes_on = false;
        for (j, sweep) in sweeps.iter_mut().enumerate() {
            if round >= LANE_OFFSET * j {
                goes_on |= sweep.advance::<true>(points, rods, least_move_m);
            }
        }
        round += 1;
    }
}

/// One sweep on its way outward.
struct OpenSweep<const D: usize> {
    direction: Direction,
    /// The connector that moved last, with its old and new place.
    master: usize,
    was: Point<D>,
    is: Point<D>,
    changed: usize,
    /// Square of the longest distance that a slave moved.
    longest2: f64,
}

impl<const D: usize> OpenSweep<D> {
    /// Returns the sweep of connector `k` that moves.
    fn start(direction: Direction, k: usize, was: Point<D>, is: Point<D>) -> Self {
        Self { direction, master: k, was, is, changed: 0, longest2: 0.0 }
    }

    /// Moves the next slave; returns false, now and ever after, once the motion ends.
    #[inline(always)]
    fn advance<const NEARLY: bool>(
        &mut self,
        points: &mut [Point<D>],
        rods: &[Rod],
        least_move_m: f64,
    ) -> bool {
        let Some(slave) = self.direction.next(self.master, points.len()) else { return false };
        let so = points[slave];
        let rod = rods[slave.min(self.master)];
        let guided = guide([self.was, self.is, so], rod, least_move_m);
        let new = if NEARLY && distance(guided, so) <= least_move_m { so } else { guided };
        if new == so && self.may_end_at(slave, points, rods) {
            return false;
        }
        let way = sub(new, so);
        self.longest2 = self.longest2.max(dot(way, way));
        self.changed += usize::from(new != so);
        points[slave] = new;
        (self.master, self.was, self.is) = (slave, so, new);
        true
    }

    /// Returns whether the rod beyond a slave that stays is good as it is; in a broken chain it need not
    /// be.
    fn may_end_at(&self, slave: usize, points: &[Point<D>], rods: &[Rod]) -> bool {
        let Some(next) = self.direction.next(slave, points.len()) else { return true };
        is_length_allowed(rods[slave.min(next)], distance(points[slave], points[next]))
    }
}
