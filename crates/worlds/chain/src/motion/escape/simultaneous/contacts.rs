//! All bodies that the parts of a chain may touch in a tick.

use super::super::EscapeMargin;
use super::super::threat::{Threat, collect_threats};
use super::posture::ends;
use sidestep_rods::geometry::{
    Aabb, ConvexCore, NearestPoints, Point, are_segments_surely_apart, between_segments,
    bound_of_segments_m, distance, distance_of_segments_m,
};
use sidestep_rods::{Chain, ChainPart, Obstacles, RodBvh, part_pairs};

/// A part near an obstacle that stands still.
#[derive(Debug, Clone, Copy)]
pub(super) struct WallContact<const D: usize> {
    pub(super) part: ChainPart,
    pub(super) core: ConvexCore<D>,
    /// Distance from the core to be kept, meters: that of touching, or less if it was less.
    pub(super) keep_m: f64,
    /// The odometer's reading below which it surely keeps more, meters.
    pub(super) clear_until_m: f64,
}

/// Two parts of the chain near each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartPair {
    pub(super) parts: [ChainPart; 2],
    /// Distance to be kept, meters: that of touching, or less if it was less.
    pub(super) keep_m: f64,
    /// The odometer's reading below which they surely keep more, meters.
    pub(super) clear_until_m: f64,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Contacts<const D: usize> {
    /// Parts near an obstacle that moves.
    pub(super) threats: Vec<Threat>,
    pub(super) walls: Vec<WallContact<D>>,
    pub(super) pairs: Vec<PartPair>,
    body: RodBvh<D>,
}

impl PartPair {
    /// Returns whether the parts are surely farther from each other than `keep_m`. Most pairs are in most rounds, and this
    /// takes much less time than their distance.
    #[inline]
    pub(super) fn is_surely_apart<const D: usize>(&self, points: &[Point<D>], keep_m: f64) -> bool {
        let one = ends(points, self.parts[0]);
        let other = ends(points, self.parts[1]);
        are_segments_surely_apart(one, other, keep_m)
    }

    /// Returns a distance that the parts surely have at least, meters.
    #[inline]
    pub(super) fn bound_m<const D: usize>(&self, points: &[Point<D>]) -> f64 {
        bound_of_segments_m(ends(points, self.parts[0]), ends(points, self.parts[1]))
    }
}

impl<const D: usize> Contacts<D> {
    /// Collects the parts near obstacles that move. Connectors move by `move_m` at most.
    pub(super) fn collect_threats(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        margin: EscapeMargin,
        move_m: f64,
    ) {
        let reach_m = CONTACT_RANGE_FACTOR * move_m;
        collect_threats(
            chain,
            obstacles,
            &mut self.body,
            |mover| margin.required_gap_m(mover) + reach_m,
            &mut self.threats,
        );
    }

    /// Collects walls and own parts that connectors may reach with a displacement of `move_m`.
    pub(super) fn find_nearby(
        &mut self,
        chain: &Chain<D>,
        obstacles: &Obstacles<D>,
        own: bool,
        move_m: f64,
    ) {
        let reach_m = CONTACT_RANGE_FACTOR * move_m;
        self.walls.clear();
        self.pairs.clear();
        for part in parts(chain) {
            let ends = ends(chain.points(), part);
            let radius_m = chain.part_radius_m(part);
            obstacles.visit(&Aabb::from_points(&ends).grown(radius_m + reach_m), |o| {
                let apart_m = o.core.nearest_to_segment(ends).distance_m;
                let touch_m = radius_m + o.radius_m;
                if !o.is_moving() && apart_m < touch_m + reach_m {
                    self.walls.push(WallContact {
                        part,
                        core: o.core,
                        keep_m: touch_m.min(apart_m),
                        clear_until_m: f64::NEG_INFINITY,
                    });
                }
            });
        }
        if own {
            self.find_pairs(chain, reach_m);
        }
    }

    fn find_pairs(&mut self, chain: &Chain<D>, reach_m: f64) {
        let n = chain.rods().len();
        // Half of the reach around each of two rods.
        let by_m = 0.5 * reach_m;
        self.body.rebuild((0..n).map(|i| grown_rod_box(chain, i, by_m)));
        let Self { body, pairs, .. } = self;
        for rod in 0..n {
            body.visit(&grown_rod_box(chain, rod, by_m), |other| {
                if other > rod {
                    let candidates = part_pairs(rod, other, n);
                    pairs.extend(candidates.filter_map(|parts| near_pair(chain, parts, reach_m)));
                }
            });
        }
    }
}

/// Distance within which a body is a contact, as a multiple of a connector's longest displacement: two parts may each
/// go as far as from one side of their start to the other.
const CONTACT_RANGE_FACTOR: f64 = 4.0;

/// Returns the box around a rod and its connectors, grown by `by_m`.
#[inline]
fn grown_rod_box<const D: usize>(chain: &Chain<D>, i: usize, by_m: f64) -> Aabb<D> {
    let [a, b] = [i, i + 1].map(|k| chain.connectors()[k].radius_m);
    Aabb::from_points(&chain.points()[i..i + 2]).grown(a.max(b) + by_m)
}

fn parts<const D: usize>(chain: &Chain<D>) -> impl Iterator<Item = ChainPart> + use<D> {
    let n = chain.rods().len();
    (0..=n).map(ChainPart::Connector).chain((0..n).map(ChainPart::Rod))
}

/// Returns two parts as a contact if they are within reach of each other, and may not touch.
fn near_pair<const D: usize>(
    chain: &Chain<D>,
    parts: [ChainPart; 2],
    reach_m: f64,
) -> Option<PartPair> {
    let one = ends(chain.points(), parts[0]);
    let other = ends(chain.points(), parts[1]);
    let touch_m = chain.min_separation_m(parts[0], parts[1])?;
    if are_segments_surely_apart(one, other, touch_m + reach_m) {
        return None;
    }
    let apart_m = distance_of_segments_m(one, other);
    (apart_m < touch_m + reach_m).then(|| PartPair {
        parts,
        keep_m: touch_m.min(apart_m),
        clear_until_m: f64::NEG_INFINITY,
    })
}

pub(super) fn nearest_points<const D: usize>(
    points: &[Point<D>],
    parts: [ChainPart; 2],
) -> NearestPoints<D> {
    match parts {
        [ChainPart::Connector(a), ChainPart::Connector(b)] => {
            NearestPoints::from_points(points[a], points[b])
        }
        _ => between_segments(ends(points, parts[0]), ends(points, parts[1])),
    }
}

/// Returns the position of a point on a part: 0 at its first end, 1 at its second.
pub(super) fn fraction_along<const D: usize>(ends: [Point<D>; 2], at: Point<D>) -> f64 {
    let length_m = distance(ends[0], ends[1]);
    if length_m > 0.0 { (distance(ends[0], at) / length_m).min(1.0) } else { 0.0 }
}
