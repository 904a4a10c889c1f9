//! Proof that a motion brings no two parts of a chain near each other, without a test of each pair.
//!
//! The idea is that of conservative advancement and of Verlet lists. The clearance of every rod from all
//! parts that may not touch it has been measured at some time. Since then none has come nearer by more
//! than twice the longest travel of any connector, which an odometer sums up. Only rods whose clearance
//! is used up are measured again; most need not be for many motions.

use super::chain::Chain;
use super::geometry::{Aabb, Point, add, between_segments, distance, dot, nearest_on_segment, sub};
use super::rod_bvh::RodBvh;

/// Index distance of rods between which no distance is measured: they touch by construction, or nearly
/// so.
const NEIGHBORS: usize = 2;
/// Distance that is kept beyond the one needed, meters: far more than rounding.
const MARGIN_M: f64 = 1e-8;
/// Distance up to which parts are searched, in lengths of the longest rod: a longer search finds more
/// parts, a shorter one is soon repeated. The value trades these off, and was not tuned.
const SEARCH_LENGTHS: f64 = 1.5;
/// Least number of rods for which it is worth the effort: a shorter chain has few pairs to test, and fewer than three
/// rods have none whose distance is measured. The value was not tuned.
const MIN_RODS: usize = 8;
/// Reading at which the odometer starts again, meters, long before rounding matters.
const MAX_ODOMETER_M: f64 = 1e5;
/// Travel after which the tree is built anew, as a fraction of the distance searched: queries grow by the
/// travel since.
const STALE_FRACTION: f64 = 0.25;

/// Distances of a chain's rods from all parts that can be in their way, with the travel since.
#[derive(Debug, Clone, Default)]
pub(super) struct SeparationBounds<const D: usize> {
    /// Positions to which the odometer has counted.
    points: Vec<Point<D>>,
    /// Twice the sum of the longest travel of each motion so far, meters: two parts approach each other at
    /// most by the travel of both.
    odometer_m: f64,
    /// The odometer's reading at which a part could touch each rod.
    until_m: Vec<f64>,
    /// Boxes of the rods without their thickness, and the odometer's reading when they were right.
    tree: RodBvh<D>,
    built_at_m: f64,
}

impl<const D: usize> SeparationBounds<D> {
    /// Returns whether a chain is long enough for this to be worth the effort.
    pub(super) fn has_enough_rods(chain: &Chain<D>) -> bool {
        chain.rods().len() >= MIN_RODS
    }

    /// Records the positions of a chain, which may be another one or have been changed from outside.
    pub(super) fn record(&mut self, chain: &Chain<D>) {
        if self.points.len() != chain.points().len() || self.odometer_m > MAX_ODOMETER_M {
            self.reset(chain);
        } else if self.points != chain.points() {
            let moves = self.points.iter().zip(chain.points()).map(|(old, new)| sub(*new, *old));
            let farthest2 = moves.map(|moved| dot(moved, moved)).fold(0.0, f64::max);
            self.add_travel(farthest2.sqrt());
            self.points.copy_from_slice(chain.points());
        }
    }

    /// Forgets all distances.
    fn reset(&mut self, chain: &Chain<D>) {
        self.points.clear();
        self.points.extend_from_slice(chain.points());
        self.until_m.clear();
        self.until_m.resize(chain.rods().len(), f64::NEG_INFINITY);
        self.odometer_m = 0.0;
        self.built_at_m = f64::NEG_INFINITY;
    }

    /// Records that the chain stays where an allowed motion has brought it.
    pub(super) fn accept(&mut self, chain: &Chain<D>) {
        self.points.copy_from_slice(chain.points());
    }

    /// Records that a motion of `travel_m` that was tested is taken back. Clearances measured at its end
    /// are off by its travel, so that counts a second time.
    pub(super) fn revert(&mut self, travel_m: f64) {
        self.add_travel(travel_m);
    }

    fn add_travel(&mut self, travel_m: f64) {
        self.odometer_m += 2.0 * travel_m;
    }

    /// Returns the recorded positions.
    pub(super) fn recorded_points(&self) -> &[Point<D>] {
        &self.points
    }

    /// Returns whether a motion from the recorded positions to where the chain is now, in which no connector
    /// moved by more than `travel_m`, brings no two parts near each other, neither at its end nor on its
    /// path.
    pub(super) fn allows(&mut self, chain: &Chain<D>, travel_m: f64) -> bool {
        self.add_travel(travel_m);
        // Two diameters at rest; on the path both parts were up to the travel from where they are, and
        // the test of paths adds it once more.
        let needed_m = 2.0 * chain.max_radius_m() + 3.0 * travel_m + MARGIN_M;
        for rod in 0..self.until_m.len() {
            if self.until_m[rod] - self.odometer_m >= needed_m {
                continue;
            }
            let clearance_m = self.measure_clearance_m(chain, rod, needed_m);
            self.until_m[rod] = self.odometer_m + clearance_m;
            if clearance_m < needed_m {
                return false;
            }
        }
        true
    }

    /// Returns the distance of a rod from all parts that can be in its way, up to the distance
    /// searched, meters.
    fn measure_clearance_m(&mut self, chain: &Chain<D>, rod: usize, needed_m: f64) -> f64 {
        let search_m = needed_m + SEARCH_LENGTHS * chain.max_rod_m();
        if self.odometer_m - self.built_at_m > STALE_FRACTION * search_m {
            let ends = chain.points().windows(2);
            self.tree.rebuild(ends.map(Aabb::from_points));
            self.built_at_m = self.odometer_m;
        }
        let points = chain.points();
        let ends = [points[rod], points[rod + 1]];
        let mut clearance_m = search_m.min(rod_connector_distance_m(points, rod));
        let near = Aabb::from_points(&ends).grown(search_m + self.odometer_m - self.built_at_m);
        self.tree.visit(&near, |other| {
            let other_ends = [points[other], points[other + 1]];
            if other.abs_diff(rod) > NEIGHBORS
                && !are_rods_surely_apart(ends, other_ends, clearance_m)
            {
                clearance_m = clearance_m.min(between_segments(ends, other_ends).distance_m);
            }
        });
        clearance_m
    }
}

/// Returns whether two rods are surely as far from each other as `clearance_m`, less half of the margin:
/// by the distance of their middles, which is much cheaper than that of the segments.
#[inline]
fn are_rods_surely_apart<const D: usize>(
    [a, b]: [Point<D>; 2],
    [c, d]: [Point<D>; 2],
    clearance_m: f64,
) -> bool {
    let middles_m = 0.5 * distance(add(a, b), add(c, d));
    middles_m - 0.5 * (distance(a, b) + distance(c, d)) >= clearance_m - 0.5 * MARGIN_M
}

/// Returns the distance of a rod from the connectors nearest to it that may not touch it: those
/// beyond its neighbors' far ends.
fn rod_connector_distance_m<const D: usize>(points: &[Point<D>], rod: usize) -> f64 {
    let before = rod.checked_sub(NEIGHBORS).and_then(|k| points.get(k));
    let after = points.get(rod + NEIGHBORS + 1);
    let mut least_m = f64::INFINITY;
    for p in [before, after].into_iter().flatten() {
        let nearest = nearest_on_segment(*p, points[rod], points[rod + 1]);
        least_m = least_m.min(distance(*p, nearest));
    }
    least_m
}
