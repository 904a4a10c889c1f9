//! Proof that a motion brings no two parts of a chain near each other, without a test of each pair.
//!
//! Parts near each other along the chain are never far apart, so no distance proves anything about them; but as long as
//! all rods of a stretch point forward along one direction, its parts follow each other in that direction and cannot
//! meet, however far they move ([`is_monotone`]). That takes a few products per rod.
//!
//! For parts farther along, the idea is that of conservative advancement and of Verlet lists. The gap between a part
//! and all others has been measured at some time. Since then none has come nearer by more than twice the longest
//! travel of any connector, which an odometer sums up. Only parts whose gap is used up are measured again; most need
//! not be for many motions. Blocks of rods are measured by their boxes, and single rods only where those do not
//! suffice.
//!
//! Whether a proof succeeds follows from the motion alone, never from what was measured before: a gap that is not used
//! up would suffice if it were measured again.

use super::chain::Chain;
use super::geometry::{
    Aabb, Point, are_segments_surely_apart, distance_of_segments_m, dot, norm, sub,
};
use super::motion_context::contact_distance_m;
use super::own_body::{ChainPart, part_pairs};
use super::rod_bvh::RodBvh;
use super::sweep::{RodPairSweep, RodSweep};
use std::ops::Range;

mod foresight;

pub(super) use foresight::{NextMotions, ROUNDING_M, first_cone_rod};

/// Distance that is kept beyond the one needed, meters: far more than rounding.
const MARGIN_M: f64 = 1e-8;
/// Part of it that a gap measured earlier must have left, meters: far more than rounding, so that it would also
/// suffice if it were measured now.
const SLACK_M: f64 = 1e-9;
/// Distance up to which other parts are searched, in lengths of the longest rod or block: a longer search finds more
/// parts, a shorter one is soon repeated. The value trades these off, and was not tuned.
const SEARCH_LENGTHS: f64 = 1.5;
/// Reading at which the odometer starts again, meters, long before rounding matters.
const MAX_ODOMETER_M: f64 = 1e5;
/// Travel after which a tree is built anew, as a fraction of the distance searched: queries grow by the
/// travel since.
const STALE_FRACTION: f64 = 0.25;
/// Rods of a block. Larger blocks make fewer, but their boxes meet others sooner where the chain bends. Not tuned.
const BLOCK: usize = 16;
/// Rods of a stretch whose parts are proven apart by one direction, a number of blocks.
const STRETCH: usize = 4 * BLOCK;
/// Rods from the start of a stretch to that of the next: they share a block, so that each block and the next one belong
/// to a common stretch.
const STRIDE: usize = STRETCH - BLOCK;

/// A motion that was made and is to be proven.
#[derive(Debug, Clone)]
pub(super) struct ProvenMotion {
    /// The connectors that moved.
    pub(super) moved: Range<usize>,
    /// Longest travel of any of them, meters.
    pub(super) travel_m: f64,
    /// Whether the proof is to hold for parts that move one after the other as well, as reactions are checked: only
    /// then would these checks have made the same motion.
    pub(super) in_turn: bool,
    /// Whether it is a whole request, which is proven also where parts are near and each pair keeps its distance; a
    /// sub-step is to be what reactions would make of it, and they look at one part after the other.
    pub(super) is_whole: bool,
}

/// The gap that rods are to have from parts that are not near them along the chain.
#[derive(Debug, Clone, Copy)]
struct NeededGap {
    needed_m: f64,
    /// Whether nearer parts may be looked at pair by pair, see [`ProvenMotion::is_whole`].
    by_pairs: bool,
}

/// Gaps of elements (rods, or blocks of them) from all others, with the travel since.
#[derive(Debug, Clone, Default)]
struct GapBudget<const D: usize> {
    /// The odometer's reading at which another element could touch each one.
    until_m: Vec<f64>,
    /// Boxes of the elements without thickness, and the odometer's reading when they were right.
    tree: RodBvh<D>,
    built_at_m: f64,
}

impl<const D: usize> GapBudget<D> {
    fn reset(&mut self, elements: usize) {
        self.until_m.clear();
        self.until_m.resize(elements, f64::NEG_INFINITY);
        self.built_at_m = f64::NEG_INFINITY;
    }

    /// Brings the boxes up to date, unless they are right enough to look for elements within `search_m`; up to date they
    /// are right for the reading `now_m` of the odometer.
    fn refresh(&mut self, search_m: f64, now_m: f64, bounds: impl Iterator<Item = Aabb<D>>) {
        if now_m - self.built_at_m > STALE_FRACTION * search_m {
            self.tree.rebuild(bounds);
            self.built_at_m = now_m;
        }
    }

    /// Visits the elements within `search_m` of a box, and perhaps some others.
    fn visit_near(
        &self,
        near: &Aabb<D>,
        search_m: f64,
        odometer_m: f64,
        visit_one: impl FnMut(usize),
    ) {
        self.tree.visit(&near.grown(search_m + odometer_m - self.built_at_m), visit_one);
    }
}

/// The sizes of a connector and of the rod behind it, if there is one, on which gaps depend, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PartSizes {
    connector_radius_m: f64,
    rod_radius_m: f64,
    rod_min_m: f64,
    rod_max_m: f64,
}

fn part_sizes<const D: usize>(chain: &Chain<D>) -> impl Iterator<Item = PartSizes> {
    chain.connectors().iter().enumerate().map(|(i, connector)| {
        let rod = chain.rods().get(i);
        PartSizes {
            connector_radius_m: connector.radius_m,
            rod_radius_m: rod.map_or(0.0, |rod| rod.radius_m),
            rod_min_m: rod.map_or(0.0, |rod| rod.min_m),
            rod_max_m: rod.map_or(0.0, |rod| rod.max_m),
        }
    })
}

/// Distances of a chain's parts from all others that can be in their way, with the travel since.
#[derive(Debug, Clone, Default)]
pub(super) struct SeparationBounds<const D: usize> {
    /// Positions to which the odometer has counted.
    points: Vec<Point<D>>,
    /// The sizes of the parts whose gaps were measured.
    sizes: Vec<PartSizes>,
    /// Twice the sum of the longest travel of each motion so far, meters: two parts approach each other at
    /// most by the travel of both.
    odometer_m: f64,
    /// Distance that connectors may be from where the chain has them, because they have yet to follow, meters.
    lag_m: f64,
    /// The first rod with such a connector, if there are any.
    first_lagging_rod: usize,
    rods: GapBudget<D>,
    blocks: GapBudget<D>,
}

impl<const D: usize> SeparationBounds<D> {
    /// Records the positions of a chain, which may be another one or have been changed from outside.
    pub(super) fn record(&mut self, chain: &Chain<D>) {
        // Of another chain neither the number of parts nor their sizes have to be the same.
        let is_same_chain = self.sizes.iter().copied().eq(part_sizes(chain));
        if !is_same_chain || self.odometer_m > MAX_ODOMETER_M {
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
        self.lag_m = 0.0;
        self.points.clear();
        self.points.extend_from_slice(chain.points());
        self.sizes.clear();
        self.sizes.extend(part_sizes(chain));
        self.odometer_m = 0.0;
        let rods = chain.rods().len();
        self.rods.reset(rods);
        self.blocks.reset(rods.div_ceil(BLOCK));
    }

    /// Records that the chain stays where an allowed motion has brought some of its connectors.
    pub(super) fn accept(&mut self, chain: &Chain<D>, moved: Range<usize>) {
        self.points[moved.clone()].copy_from_slice(&chain.points()[moved]);
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

    /// Returns whether a motion from the recorded positions to where the chain is now brings no two parts too near each
    /// other, neither at its end nor on its path.
    pub(super) fn allows(&mut self, chain: &Chain<D>, motion: &ProvenMotion) -> bool {
        self.allows_first(chain, motion, chain.rods().len())
    }

    /// Returns the same of a motion whose first rods, up to `end`, have made it, where nothing can object to what the
    /// others do. `end` is where a stretch ends.
    pub(super) fn allows_first(
        &mut self,
        chain: &Chain<D>,
        motion: &ProvenMotion,
        end: usize,
    ) -> bool {
        self.add_travel(motion.travel_m);
        let needed_m = needed_gap_m(motion.travel_m);
        let needs = NeededGap { needed_m, by_pairs: motion.is_whole };
        let rods = chain.rods().len();
        for stretch in stretches(rods).take_while(|stretch| stretch.end <= end) {
            let has_moved = motion.moved.start <= stretch.end && stretch.start < motion.moved.end;
            if has_moved
                && (motion.in_turn || !self.is_monotone(chain, stretch.clone()))
                && !(self.are_neighbors_apart(chain, stretch.clone())
                    && self.are_rods_apart(chain, stretch, needs))
            {
                return false;
            }
        }
        // In a single stretch all pairs have been seen.
        rods <= STRETCH
            || (0..end.div_ceil(BLOCK)).all(|block| {
                self.is_block_apart(chain, block, needed_m)
                    || self.are_rods_apart(chain, block_rods(block, rods), needs)
            })
    }

    /// Returns whether all rods of a stretch point forward along one direction, before the motion and after it, each by
    /// more than the thickness of its parts. Then no two parts of the stretch meet: of any two, the later one is
    /// farther along by at least one such distance. As the ends of the rods move straight, that holds on the whole way.
    fn is_monotone(&self, chain: &Chain<D>, stretch: Range<usize>) -> bool {
        let connectors = stretch.start..stretch.end + 1;
        let before = &self.points[connectors.clone()];
        let after = &chain.points()[connectors];
        let along = sub(after[after.len() - 1], after[0]);
        let advance = |points: &[Point<D>]| {
            let advances = points.windows(2).map(|ends| dot(sub(ends[1], ends[0]), along));
            advances
                .fold(f64::INFINITY, |least, advance| if advance < least { advance } else { least })
        };
        let least = advance(after).min(advance(before));
        // A stretch that closes to a ring has no direction.
        let length_m = norm(along);
        length_m > 0.0 && least >= (chain.neighbor_separation_m() + MARGIN_M) * length_m
    }

    /// Returns whether the parts of a stretch that are near each other along the chain keep their distances, at the
    /// end of the motion and on its path.
    fn are_neighbors_apart(&self, chain: &Chain<D>, stretch: Range<usize>) -> bool {
        let is_apart = |one: ChainPart, other: ChainPart| self.is_pair_apart(chain, [one, other]);
        let clears_right_angles = chain.clears_right_angles();
        let mut was_open = false;
        for k in stretch.start + 2..stretch.end + 1 {
            let is_open = clears_right_angles && self.stays_open(chain, k - 1);
            let are_open = is_open && (was_open || k == stretch.start + 2);
            was_open = is_open;
            if are_open {
                continue;
            }
            let connector = ChainPart::Connector(k);
            let rod = ChainPart::Rod(k - 1);
            let is_clear = is_apart(ChainPart::Rod(k - 2), connector)
                && is_apart(ChainPart::Connector(k - 2), rod)
                && is_apart(ChainPart::Connector(k - 2), connector)
                && (k < stretch.start + 3 || is_apart(ChainPart::Rod(k - 3), rod));
            if !is_clear {
                return false;
            }
        }
        true
    }

    /// Returns whether two parts keep their distance at the end of the motion and on its path.
    fn is_pair_apart(&self, chain: &Chain<D>, [one, other]: [ChainPart; 2]) -> bool {
        let Some(separation_m) = chain.min_separation_m(one, other) else { return true };
        let part_sweep = |part: ChainPart| RodSweep {
            from: part.ends(&self.points),
            to: part.ends(chain.points()),
        };
        let pair = RodPairSweep { one: part_sweep(one), other: part_sweep(other) };
        let contact_m = contact_distance_m(separation_m);
        let is_apart_at_end = are_segments_surely_apart(pair.one.to, pair.other.to, contact_m)
            || distance_of_segments_m(pair.one.to, pair.other.to) >= contact_m;
        is_apart_at_end && pair.is_clear(separation_m)
    }

    /// Returns whether the bend at a connector is a right angle at most, all the way: the product of the rods'
    /// directions, a parabola of the time, lies within its Bezier coefficients.
    fn stays_open(&self, chain: &Chain<D>, k: usize) -> bool {
        let rods =
            |points: &[Point<D>]| [sub(points[k], points[k - 1]), sub(points[k + 1], points[k])];
        let [into_was, out_was] = rods(&self.points);
        let [into, out] = rods(chain.points());
        let least = dot(into_was, out_was).min(dot(into, out));
        least.min(dot(into_was, out) + dot(into, out_was)) >= 0.0
    }

    /// Returns whether some rods and their connectors have the gap that is needed to all parts that are not near them
    /// along the chain, or keep their distances from each of these.
    fn are_rods_apart(&mut self, chain: &Chain<D>, rods: Range<usize>, needs: NeededGap) -> bool {
        let NeededGap { needed_m, by_pairs } = needs;
        for rod in rods {
            if self.rods.until_m[rod] - self.odometer_m >= needed_m + SLACK_M {
                continue;
            }
            let gap_m = self.measure_rod_gap_m(chain, rod, needed_m);
            self.rods.until_m[rod] = self.odometer_m + gap_m;
            let is_near = gap_m < needed_m;
            if is_near && !(by_pairs && self.is_rod_apart(chain, rod, needed_m)) {
                return false;
            }
        }
        true
    }

    /// Returns whether a rod and its connectors keep their distances from all parts within `needed_m` that are not near
    /// them along the chain, at the end of the motion and on its path.
    fn is_rod_apart(&self, chain: &Chain<D>, rod: usize, needed_m: f64) -> bool {
        let points = chain.points();
        let ends = |rod: usize| [points[rod], points[rod + 1]];
        let near = Aabb::from_points(&ends(rod));
        let rods = chain.rods().len();
        let reach_m = needed_m + self.lag_m + 2.0 * chain.max_radius_m();
        let mut is_apart = true;
        self.rods.visit_near(&near, reach_m, self.odometer_m, |other| {
            if !is_apart
                || other == rod
                || are_segments_surely_apart(ends(rod), ends(other), reach_m)
            {
                return;
            }
            // Nobody knows the path of a rod that has yet to follow.
            is_apart = self.rod_lag_m(rod.max(other)) == 0.0
                && part_pairs(rod.min(other), rod.max(other), rods).all(|[one, other]| {
                    one.is_near_along_chain(other) || self.is_pair_apart(chain, [one, other])
                });
        });
        is_apart
    }

    /// Returns the gap between a rod with its connectors and all parts that can be in their way, up to the distance
    /// searched, meters.
    fn measure_rod_gap_m(&mut self, chain: &Chain<D>, rod: usize, needed_m: f64) -> f64 {
        let thickness_m = 2.0 * chain.max_radius_m();
        let search_m = needed_m + SEARCH_LENGTHS * chain.max_rod_m();
        let points = chain.points();
        let ends = |rod: usize| [points[rod], points[rod + 1]];
        let near = Aabb::from_points(&ends(rod));
        let bounds = points.windows(2).map(Aabb::from_points);
        let rods = chain.rods().len();
        let mut gap_m = search_m - self.lag_m;
        let up_to_date_m = self.odometer_m - 2.0 * self.lag_m;
        self.rods.refresh(search_m + thickness_m, up_to_date_m, bounds);
        self.rods.visit_near(&near, search_m + thickness_m, self.odometer_m, |other| {
            let lag_m = self.rod_lag_m(rod.max(other));
            if other == rod
                || are_segments_surely_apart(ends(rod), ends(other), gap_m + lag_m + thickness_m)
            {
                return;
            }
            for [one, other] in part_pairs(rod.min(other), rod.max(other), rods) {
                if !one.is_near_along_chain(other) {
                    let pair_m = chain.own_gap_m(points, [one, other]);
                    gap_m = gap_m.min(pair_m.unwrap_or(f64::INFINITY) - lag_m);
                }
            }
        });
        gap_m
    }

    /// Returns the distance that a rod may be from where the chain has it, meters.
    fn rod_lag_m(&self, rod: usize) -> f64 {
        if rod >= self.first_lagging_rod { self.lag_m } else { 0.0 }
    }

    /// Returns whether a block is at least `needed_m` from all blocks that are not beside it along the chain, by their
    /// boxes.
    fn is_block_apart(&mut self, chain: &Chain<D>, block: usize, needed_m: f64) -> bool {
        // The distance of two boxes falls by more than that of their parts, because a different part may move along each
        // axis. All of that is counted: else a gap that was measured before would allow a motion that one measured now
        // does not, and the bits would depend on what else the worker has done.
        let odometer_m = self.odometer_m * (D as f64).sqrt();
        if self.blocks.until_m[block] - odometer_m < needed_m + SLACK_M {
            let gap_m = self.measure_block_gap_m(chain, block, needed_m);
            self.blocks.until_m[block] = odometer_m + gap_m;
            return gap_m >= needed_m;
        }
        true
    }

    fn measure_block_gap_m(&mut self, chain: &Chain<D>, block: usize, needed_m: f64) -> f64 {
        let thickness_m = 2.0 * chain.max_radius_m();
        let search_m = needed_m + SEARCH_LENGTHS * BLOCK as f64 * chain.max_rod_m();
        let rods = chain.rods().len();
        let bounds_of = |block: usize| {
            let rods = block_rods(block, rods);
            Aabb::from_points(&chain.points()[rods.start..rods.end + 1])
        };
        let own = bounds_of(block);
        let bounds = (0..rods.div_ceil(BLOCK)).map(bounds_of);
        // Boxes may be off by that along every axis.
        let axes = (D as f64).sqrt();
        let mut gap_m = search_m - axes * self.lag_m;
        let up_to_date_m = self.odometer_m - 2.0 * self.lag_m;
        self.blocks.refresh(search_m + thickness_m, up_to_date_m, bounds);
        self.blocks.visit_near(&own, search_m + thickness_m, self.odometer_m, |other| {
            if other.abs_diff(block) > 1 {
                let last_rod = block_rods(block.max(other), rods).end - 1;
                let lag_m = axes * self.rod_lag_m(last_rod);
                gap_m = gap_m.min(own.distance_m(&bounds_of(other)) - thickness_m - lag_m);
            }
        });
        gap_m
    }
}

/// Returns the gap that two parts must have after a motion in which none moved by more than `travel_m`: on the path both
/// were up to the travel from where they are at its end, and the test of paths adds it once more.
fn needed_gap_m(travel_m: f64) -> f64 {
    3.0 * travel_m + MARGIN_M
}

fn block_rods(block: usize, rods: usize) -> Range<usize> {
    BLOCK * block..(BLOCK * (block + 1)).min(rods)
}

/// Returns stretches of rods, of which each shares a block with the next.
fn stretches(rods: usize) -> impl Iterator<Item = Range<usize>> {
    let last = rods.saturating_sub(BLOCK).div_ceil(STRIDE).max(1);
    (0..last).map(move |k| STRIDE * k..(STRIDE * k + STRETCH).min(rods))
}
