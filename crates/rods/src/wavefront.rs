//! Several motions of one end of a chain at once, where nothing can object: a time-skewed (wavefront)
//! sweep.
//!
//! One motion is a series of dependent square roots and divisions, and its speed is their latency.
//! Motion `w` can be at connector `j - w` while motion 0 is at connector `j`: all lanes are
//! independent, so the compiler vectorizes them, and each computes the same bits as the motions one
//! after the other.
//!
//! [`DeferredMotions`] collects motions of a chain until they fill the lanes or its points are read.

#![expect(
    clippy::needless_range_loop,
    reason = "an index is a lane or a coordinate of several arrays"
)]

use super::candidates::{clamped, guide_line_slave_position};
use super::chain::{Chain, MAX_COORDINATE_M, Rod, is_in_range, out_of_range};
use super::geometry::{Point, distance, dot, sub};
use super::motion_context::is_length_allowed;
use super::propagate::Propagator;
use super::veto::MotionRequest;
use super::{Obstacles, ReactionRules};
use sidestep_kernel::InputError;

/// Motions at once: enough to keep the units for roots and divisions busy. A connector takes 19 ns one motion at a time,
/// 6 ns with 4 lanes and 3.8 ns with 8; twelve are a multiple of the 4 numbers of a vector register.
pub const LANES: usize = 12;

/// Length in meters above which no move is lost to rounding: coordinates of up to 1e6 m are sums of numbers with
/// errors below 2^-51 of that, and of three coordinates one has more than half of a move.
const ROUNDING_LENGTH_M: f64 = MAX_COORDINATE_M * 3.6e-15;

/// Number of motions below which one after the other is faster: lanes without a motion cost as much as
/// those with one.
const MIN_MOTIONS: usize = 3;

/// Moves the first connector through `heads`, one after the other, like the same number of
/// requests.
///
/// # Errors
/// When a target is not finite, or the chain has a connector that is not free or has a bend limit:
/// then a connector might object, and the motions must be made one by one.
pub fn pull_first<const D: usize>(
    chain: &mut Chain<D>,
    heads: &[Point<D>],
) -> Result<(), InputError> {
    if !chain.is_plain() {
        return Err(InputError::new(
            "chain",
            "has a connector that may object",
            "move it by single requests",
        ));
    }
    if let Some(head) = heads.iter().find(|head| !is_in_range(head)) {
        return Err(out_of_range(head));
    }
    let mut propagator = Propagator::new(ReactionRules::default());
    for group in heads.chunks(LANES) {
        if group.len() >= MIN_MOTIONS {
            pull_lanes::<D, false>(chain, 0, group);
            continue;
        }
        for head in group {
            propagator.propagate(
                chain,
                &Obstacles::default(),
                &MotionRequest::from_operator(0, *head),
            )?;
        }
    }
    Ok(())
}

/// Measures of several motions, equal to those of a chain measured after each of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionBatchMeasures {
    /// Connectors that have changed, the initiator included, summed over the motions.
    pub changed: u64,
    /// Longest move of a connector other than the initiator in one motion, meters.
    pub longest_m: f64,
    /// Greatest amount by which a rod that moved was outside its limits, meters.
    pub max_rod_violation_m: f64,
}

/// Motions of connector 0 of a plain chain that the other connectors have yet to follow.
///
/// Where nothing can object, the motion of a chain follows from that of its initiator, so it does not matter when
/// it moves: to follow several motions at once gives the same bits, and is much faster. Until then only the connectors up
/// to the head are where they should be: connector 0 alone, or those of a chain with a solid body that could object
/// ([`DeferredSolidMotions`](super::DeferredSolidMotions)).
#[derive(Debug, Clone, Default)]
pub struct DeferredMotions<const D: usize> {
    /// The connector that the rest of the chain follows.
    head: usize,
    /// Its position before the first deferred motion.
    start: Option<Point<D>>,
    /// Its positions after each of them.
    heads: Vec<Point<D>>,
}

impl<const D: usize> DeferredMotions<D> {
    /// Returns whether no motion is deferred: all connectors are where they should be.
    pub fn is_empty(&self) -> bool {
        self.heads.is_empty()
    }

    /// Returns the number of deferred motions.
    pub(super) fn len(&self) -> usize {
        self.heads.len()
    }

    /// Returns whether as many motions are deferred as are made at once: then the chain is to follow.
    pub fn is_full(&self) -> bool {
        self.heads.len() == LANES
    }

    /// Moves connector 0 of a plain chain alone, by more than the chain's least move.
    ///
    /// # Panics
    /// If [`Self::is_full`].
    pub fn move_first(&mut self, chain: &mut Chain<D>, to: Point<D>) {
        let was = std::mem::replace(&mut chain.points_mut()[0], to);
        self.defer_rest(0, [was, to]);
    }

    /// Defers what follows connector `head`, which has moved from the first position to the second.
    ///
    /// # Panics
    /// If [`Self::is_full`], or if motions of another head are deferred.
    pub(super) fn defer_rest(&mut self, head: usize, [was, now]: [Point<D>; 2]) {
        assert!(!self.is_full(), "the chain has to follow first");
        assert!(self.is_empty() || self.head == head, "the chain has to follow first");
        self.head = head;
        self.start.get_or_insert(was);
        self.heads.push(now);
    }

    /// Lets the connectors beyond the head follow all deferred motions; returns their measures, with those of the head, if
    /// there were any.
    pub fn apply_to_chain(&mut self, chain: &mut Chain<D>) -> Option<MotionBatchMeasures> {
        chain.points_mut()[self.head] = self.start.take()?;
        let measures = pull_lanes::<D, true>(chain, self.head, &self.heads);
        self.heads.clear();
        Some(measures)
    }
}

/// One coordinate of the connectors that lanes are at: lane `w` has its slave at `w` and its
/// master at `w + 1`, which is where lane `w + 1` has its slave.
type LaneRow = [f64; LANES + 1];

/// Positions of the connectors that lanes are at, lane 0 farthest along the chain.
#[derive(Clone, Copy)]
struct SimdLanePositions<const D: usize> {
    rows: [LaneRow; D],
}

impl<const D: usize> SimdLanePositions<D> {
    /// Returns positions apart from each other, which are never read.
    fn far_apart() -> Self {
        Self { rows: [std::array::from_fn(|w| -4.0 * w as f64); D] }
    }

    fn get(&self, k: usize) -> Point<D> {
        std::array::from_fn(|i| self.rows[i][k])
    }

    fn set(&mut self, k: usize, p: Point<D>) {
        for i in 0..D {
            self.rows[i][k] = p[i];
        }
    }
}

/// Of the rods between slaves and masters, by lane.
struct LaneRodLimits {
    min_m: [f64; LANES],
    max_m: [f64; LANES],
    /// Number of rods in a row that equal the last. Once all lanes have the same limits, they need not be
    /// shifted: most chains have equal rods.
    equal_rods: usize,
}

impl LaneRodLimits {
    /// Passes every lane's rod on to the next lane, and a new one to the first.
    #[inline]
    fn shift(&mut self, next: Rod) {
        let is_equal = next.min_m == self.min_m[0] && next.max_m == self.max_m[0];
        self.equal_rods = if is_equal { self.equal_rods + 1 } else { 0 };
        if self.equal_rods < LANES {
            self.min_m.copy_within(..LANES - 1, 1);
            self.max_m.copy_within(..LANES - 1, 1);
            self.min_m[0] = next.min_m;
            self.max_m[0] = next.max_m;
        }
    }
}

/// The motions of a group: lane `w` makes motion `w`.
struct LaneMotions<const D: usize, const MEASURES: bool> {
    /// Number of motions, at most [`LANES`].
    n: usize,
    connectors: usize,
    limits: LaneRodLimits,
    min_move_m: f64,
    /// Length of a move above which a slave surely moves; -1 in lanes without a motion, where it is never read.
    sure_move_m: [f64; LANES],
    /// Whether a lane's last slave stayed.
    rests: [bool; LANES],
    /// Whether a lane's motion has ended.
    ended: [bool; LANES],
    /// Whether some lane rests or has ended.
    is_mixed: bool,
    /// Square of the longest move, by lane.
    longest2: [f64; LANES],
    /// Greatest violation of a rod's limits, by lane, meters.
    violation_m: [f64; LANES],
    changed: u64,
}

impl<const D: usize, const MEASURES: bool> LaneMotions<D, MEASURES> {
    fn new(chain: &Chain<D>, first: usize, n: usize) -> Self {
        let sure_move_m = chain.min_move_m().max(ROUNDING_LENGTH_M);
        Self {
            n,
            connectors: chain.points().len() - first,
            limits: LaneRodLimits { min_m: [1.0; LANES], max_m: [1.0; LANES], equal_rods: LANES },
            min_move_m: chain.min_move_m(),
            sure_move_m: std::array::from_fn(|w| if w < n { sure_move_m } else { -1.0 }),
            rests: [false; LANES],
            ended: [false; LANES],
            is_mixed: false,
            longest2: [0.0; LANES],
            violation_m: [0.0; LANES],
            changed: n as u64,
        }
    }

    /// Returns whether a lane is at a slave when lane 0 is at connector `j`.
    fn is_lane_at_slave(&self, w: usize, j: usize) -> bool {
        w < self.n && w < j && j - w < self.connectors
    }

    /// Computes the reaction of every lane's slave when lane 0 is at connector `j`: [`guide_line_slave_position`], lane
    /// by lane. Before the call, `next` holds the positions of one connector ago; after it, those of
    /// the slaves that now become masters.
    #[inline]
    fn react(&mut self, now: &SimdLanePositions<D>, next: &mut SimdLanePositions<D>, j: usize) {
        let mut g = [[0.0; LANES]; D];
        let mut square = [0.0; LANES];
        for i in 0..D {
            for w in 0..LANES {
                g[i][w] = now.rows[i][w] - now.rows[i][w + 1];
                square[w] += g[i][w] * g[i][w];
            }
        }
        let d = square.map(f64::sqrt);
        // Whether some lane is not at a slave that surely moves. All lanes are tested, because a search that
        // stops early would branch at each and not be vectorized.
        let mut one_by_one = self.is_mixed || j < self.n || j >= self.connectors;
        let mut scale = [0.0; LANES];
        for w in 0..LANES {
            let t = clamped(d[w], self.limits.min_m[w], self.limits.max_m[w]);
            one_by_one |= (t - d[w]).abs().min(d[w]) <= self.sure_move_m[w];
            scale[w] = t / d[w];
        }
        if one_by_one {
            return self.react_scalar(now, next, j);
        }
        for i in 0..D {
            for w in 0..LANES {
                next.rows[i][w + 1] = now.rows[i][w + 1] + g[i][w] * scale[w];
            }
        }
        if MEASURES {
            self.measure(now, next);
        }
    }

    /// Measures all lanes at once, each of which has a slave that moves.
    #[inline]
    fn measure(&mut self, now: &SimdLanePositions<D>, next: &SimdLanePositions<D>) {
        let mut move2 = [0.0; LANES];
        let mut length2 = [0.0; LANES];
        for i in 0..D {
            for w in 0..LANES {
                let new = next.rows[i][w + 1];
                let moved = new - now.rows[i][w];
                let rod = now.rows[i][w + 1] - new;
                move2[w] += moved * moved;
                length2[w] += rod * rod;
            }
        }
        for w in 0..LANES {
            let length_m = length2[w].sqrt();
            let outside_m = (length_m - self.limits.max_m[w]).max(self.limits.min_m[w] - length_m);
            self.violation_m[w] = self.violation_m[w].max(outside_m);
            self.longest2[w] = self.longest2[w].max(move2[w]);
        }
        self.changed += self.n as u64;
    }

    /// The same as [`LaneMotions::react`] by single lanes, some of which rest, have ended, or are at no slave.
    #[cold]
    fn react_scalar(
        &mut self,
        now: &SimdLanePositions<D>,
        next: &mut SimdLanePositions<D>,
        j: usize,
    ) {
        // Downward, because lane w - 1 still needs its master's old position, at w - 1.
        for w in (0..LANES).rev() {
            if !self.is_lane_at_slave(w, j) {
                next.set(w + 1, now.get(w));
                continue;
            }
            let [mo, mn, so] = [next.get(w), now.get(w + 1), now.get(w)];
            let rod =
                Rod { min_m: self.limits.min_m[w], max_m: self.limits.max_m[w], radius_m: 0.0 };
            // A sweep ends at a slave that stays, if the rod beyond it is within its limits.
            self.ended[w] |= self.rests[w] && is_length_allowed(rod, distance(mn, so));
            if self.ended[w] {
                next.set(w + 1, so);
                continue;
            }
            let new = guide_line_slave_position([mo, mn, so], rod, self.min_move_m);
            self.rests[w] = new == so;
            next.set(w + 1, new);
            if MEASURES {
                self.measure_lane_motion(w, [mn, so, new], rod);
            }
        }
        self.is_mixed = (0..self.n).any(|w| self.rests[w] || self.ended[w]);
    }

    fn measure_lane_motion(&mut self, w: usize, [mn, so, new]: [Point<D>; 3], rod: Rod) {
        let moved = sub(new, so);
        let length_m = distance(mn, new);
        let outside_m = (length_m - rod.max_m).max(rod.min_m - length_m);
        self.violation_m[w] = self.violation_m[w].max(outside_m);
        self.longest2[w] = self.longest2[w].max(dot(moved, moved));
        self.changed += u64::from(new != so);
    }

    /// Returns whether nothing is left to do before the end of the chain.
    fn have_ended(&self) -> bool {
        self.is_mixed && self.ended[..self.n].iter().all(|&ended| ended)
    }

    fn measures(&self) -> MotionBatchMeasures {
        MotionBatchMeasures {
            changed: self.changed,
            longest_m: max_of(&self.longest2[..self.n]).sqrt(),
            max_rod_violation_m: max_of(&self.violation_m[..self.n]),
        }
    }
}

fn max_of(by_lane: &[f64]) -> f64 {
    by_lane.iter().copied().fold(0.0, f64::max)
}

/// Returns a position for step `j`, past the last connector: it differs from the one before, so that no rod of an unused
/// lane has length zero.
fn beyond_last<const D: usize>(j: usize) -> Point<D> {
    super::geometry::scaled(super::geometry::unit_x(), 4.0 * j as f64)
}

/// Makes as many motions of connector `first` as there are heads, at most one per lane; those beyond it follow. Lanes
/// without a head, not yet at a connector, or past the last one hold values that are never read.
fn pull_lanes<const D: usize, const MEASURES: bool>(
    chain: &mut Chain<D>,
    first: usize,
    heads: &[Point<D>],
) -> MotionBatchMeasures {
    let n = heads.len();
    let mut motions = LaneMotions::<D, MEASURES>::new(chain, first, n);
    let (points, rods) = chain.parts_mut();
    let points = &mut points[first..];
    let rods = &rods[first..];
    let unused = Rod { min_m: 1.0, max_m: 1.0, radius_m: 0.0 };
    let mut now = SimdLanePositions::far_apart();
    let mut next = SimdLanePositions::far_apart();
    for j in 0..points.len() + n - 1 {
        now.set(0, points.get(j).copied().unwrap_or_else(|| beyond_last(j)));
        motions.limits.shift(rods.get(j.wrapping_sub(1)).copied().unwrap_or(unused));
        motions.react(&now, &mut next, j);
        if let Some(head) = heads.get(j) {
            // Lane j is at connector 0, which goes to its head.
            next.set(j + 1, *head);
        }
        if j + 1 >= n {
            points[j + 1 - n] = next.get(n);
            if motions.have_ended() {
                // The connectors that the lanes are at no longer change.
                let count = points.len();
                for w in (0..n - 1).filter(|&w| j - w < count) {
                    points[j - w] = next.get(w + 1);
                }
                break;
            }
        }
        std::mem::swap(&mut now, &mut next);
    }
    motions.measures()
}

#[cfg(test)]
mod tests {
    use super::super::chain::Connector;
    use super::*;
    use crate::fixtures::Wanderer;
    use proptest::prelude::*;

    fn same_bits<const D: usize>(n_rods: usize, rod: Rod, n_heads: usize, step_m: f64, seed: u64) {
        let axis = super::super::geometry::unit_x();
        let mut one_by_one =
            Chain::<D>::straight([0.0; D], axis, n_rods, rod, Connector::free(0.0)).unwrap();
        let mut walk = Wanderer::new(seed);
        let mut heads: Vec<Point<D>> = Vec::new();
        let mut at = [0.0; D];
        for _ in 0..n_heads {
            at = walk.next(at, step_m);
            heads.push(at);
        }
        let mut at_once = one_by_one.clone();
        let mut propagator = Propagator::default();
        for head in &heads {
            let request = MotionRequest::from_operator(0, *head);
            propagator.propagate(&mut one_by_one, &Obstacles::default(), &request).unwrap();
        }
        let start = at_once.clone();
        pull_first(&mut at_once, &heads).unwrap();
        assert_eq!(at_once.points(), one_by_one.points());
        measures_as_single_motions_do(start, &heads);
    }

    /// Lanes measure the same as single motions do.
    fn measures_as_single_motions_do<const D: usize>(start: Chain<D>, heads: &[Point<D>]) {
        for group in heads.chunks(LANES) {
            let (mut at_once, mut single) = (start.clone(), start.clone());
            let mut expected = MotionBatchMeasures::default();
            for head in group {
                let request = MotionRequest::from_operator(0, *head);
                let mut propagator = Propagator::default();
                let outcome =
                    propagator.propagate(&mut single, &Obstacles::default(), &request).unwrap();
                let moved = outcome.motion().unwrap();
                expected.changed += moved.changed as u64;
                expected.longest_m = expected.longest_m.max(moved.max_slave_step_m);
                expected.max_rod_violation_m =
                    expected.max_rod_violation_m.max(single.max_rod_violation_m());
            }
            let measured = pull_lanes::<D, true>(&mut at_once, 0, group);
            assert_eq!(at_once.points(), single.points());
            assert_eq!(measured.changed, expected.changed);
            assert_eq!(measured.longest_m.to_bits(), expected.longest_m.to_bits());
            // Rods that did not move are measured once, before.
            let most_m = measured.max_rod_violation_m.max(start.max_rod_violation_m());
            let expected_m = expected.max_rod_violation_m.max(start.max_rod_violation_m());
            assert_eq!(most_m.to_bits(), expected_m.to_bits());
        }
    }

    /// A motion ends at the first slave that need not move, though rods beyond it may be off by less
    /// than the tolerance.
    #[test]
    fn lanes_end_where_single_motions_end() {
        let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
        let points: Vec<_> = (0..40).map(|i| [-(1.0 + 1e-11) * f64::from(i), 0.0]).collect();
        let mut points_slack = points.clone();
        points_slack[..20].iter_mut().for_each(|p| p[0] *= 0.8);
        points_slack[20..].iter_mut().for_each(|p| p[0] += 4.0);
        let connectors = vec![Connector::free(0.0); 40];
        let start = Chain::new(points_slack, connectors, vec![rod; 39]).unwrap();
        let heads: Vec<_> = (1..=9).map(|k| [0.05 * f64::from(k), 0.0]).collect();
        let (mut at_once, mut single) = (start.clone(), start.clone());
        pull_first(&mut at_once, &heads).unwrap();
        for head in &heads {
            let request = MotionRequest::from_operator(0, *head);
            Propagator::default().propagate(&mut single, &Obstacles::default(), &request).unwrap();
        }
        assert_eq!(at_once.points(), single.points());
        assert_eq!(at_once.points()[30..], start.points()[30..]);
    }

    proptest! {
        #[test]
        fn lanes_are_motions_one_after_the_other(
            n_rods in 0usize..40, slack in 0.0..0.5f64, n_heads in 0usize..30,
            step_m in 0.01..2.0f64, seed in 0u64..100,
        ) {
            let rod = Rod { min_m: 1.0 - slack, max_m: 1.0, radius_m: 0.0 };
            same_bits::<2>(n_rods, rod, n_heads, step_m, seed);
            same_bits::<3>(n_rods, rod, n_heads, step_m, seed);
        }
    }

    #[test]
    fn a_head_on_its_slave_is_no_trouble() {
        let rod = Rod::with_fixed_length(1.0, 0.0);
        let mut chain =
            Chain::straight([0.0; 2], [1.0, 0.0], 3, rod, Connector::free(0.0)).unwrap();
        let mut single = chain.clone();
        pull_first(&mut chain, &[[1.0, 0.0]; LANES]).unwrap();
        let request = MotionRequest::from_operator(0, [1.0, 0.0]);
        Propagator::default().propagate(&mut single, &Obstacles::default(), &request).unwrap();
        assert_eq!(chain.points(), single.points());
    }
}
