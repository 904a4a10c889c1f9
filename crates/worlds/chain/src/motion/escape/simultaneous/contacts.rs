//! All bodies that the parts of a chain may touch in a tick.

use super::super::threat::{Threat, collect_threats};
use super::super::{ChainPart, EscapeMargin};
use super::posture::ends;
use sidestep_rods::geometry::{Aabb, ConvexCore, NearestPoints, Point, between_segments, distance};
use sidestep_rods::{Chain, Obstacles, RodBvh};

/// A part near an obstacle that stands still.
#[derive(Debug, Clone, Copy)]
pub(super) struct WallContact<const D: usize> {
    pub(super) part: ChainPart,
    pub(super) core: ConvexCore<D>,
    /// Distance from the core to be kept, meters: that of touching, or less if it was less.
    pub(super) keep_m: f64,
}

/// Two parts of the chain near each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct PartPair {
    pub(super) parts: [ChainPart; 2],
    /// Distance to be kept, meters: that of touching, or less if it was less.
    pub(super) keep_m: f64,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Contacts<const D: usize> {
    /// Parts near an obstacle that moves.
    pub(super) threats: Vec<Threat>,
    pub(super) walls: Vec<WallContact<D>>,
    pub(super) pairs: Vec<PartPair>,
    body: RodBvh<D>,
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
            let radius_m = radius_m(chain, part);
            obstacles.visit(&Aabb::from_points(&ends).grown(radius_m + reach_m), |o| {
                let apart_m = o.core.nearest_to_segment(ends).distance_m;
                let touch_m = radius_m + o.radius_m;
                if !o.is_moving() && apart_m < touch_m + reach_m {
                    self.walls.push(WallContact {
                        part,
                        core: o.core,
                        keep_m: touch_m.min(apart_m),
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
                    let last = (other + 1 == n).then_some(other + 1);
                    for parts in candidate_pairs(rod, other, last).into_iter().flatten() {
                        pairs.extend(near_pair(chain, parts, reach_m));
                    }
                }
            });
        }
    }
}

/// Distance within which a body is a contact, as a multiple of a connector's longest displacement: two parts may each go
/// as far as from one side of their start to the other.
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

pub(super) fn radius_m<const D: usize>(chain: &Chain<D>, part: ChainPart) -> f64 {
    match part {
        ChainPart::Connector(k) => chain.connectors()[k].radius_m,
        ChainPart::Rod(i) => chain.rods()[i].radius_m,
    }
}

/// Returns the pairs that two rods and their connectors make. As in any motion, neighbors are
/// exempt: connectors one index apart, rods two.
fn candidate_pairs(rod: usize, other: usize, last: Option<usize>) -> [Option<[ChainPart; 2]>; 6] {
    [
        nonadjacent_connectors(rod, other),
        last.and_then(|last| nonadjacent_connectors(rod, last)),
        nonadjacent_rod_connector(rod, other),
        last.and_then(|last| nonadjacent_rod_connector(rod, last)),
        (rod + 1 < other).then_some([ChainPart::Connector(rod), ChainPart::Rod(other)]),
        (other > rod + 2).then_some([ChainPart::Rod(rod), ChainPart::Rod(other)]),
    ]
}

fn nonadjacent_connectors(one: usize, other: usize) -> Option<[ChainPart; 2]> {
    (other > one + 1).then_some([ChainPart::Connector(one), ChainPart::Connector(other)])
}

fn nonadjacent_rod_connector(rod: usize, connector: usize) -> Option<[ChainPart; 2]> {
    (connector > rod + 2).then_some([ChainPart::Rod(rod), ChainPart::Connector(connector)])
}

fn near_pair<const D: usize>(
    chain: &Chain<D>,
    parts: [ChainPart; 2],
    reach_m: f64,
) -> Option<PartPair> {
    let apart_m = nearest_points(chain.points(), parts).distance_m;
    let touch_m = parts.map(|part| radius_m(chain, part)).iter().sum::<f64>();
    (apart_m < touch_m + reach_m).then(|| PartPair { parts, keep_m: touch_m.min(apart_m) })
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
