//! Distances of a chain's parts from the obstacles around them, and from each other.

use sidestep_rods::geometry::{
    Aabb, Point, between_segments, distance, nearest_on_segment, scaled, sub,
};
use sidestep_rods::{Chain, Obstacles, RodBvh};

/// Distance by which searches go beyond the one that counts, meters: far more than rounding.
const MARGIN_M: f64 = 1e-9;

/// The surroundings of a connector and of the rod behind it, as far as a search looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PartClearance<const D: usize> {
    /// Gap between the connector and the nearest obstacle, meters; negative inside it.
    pub(crate) gap_m: f64,
    /// The vector from the connector's middle to that obstacle's surface; zero if nothing is near.
    pub(crate) to_surface: Point<D>,
    /// Gap between the rod and the obstacle nearest to it, meters.
    pub(crate) rod_gap_m: f64,
}

/// Returns the surroundings nearer than `look_m` to connector `k`, and to the rod behind it if rods count.
pub(crate) fn part_clearance<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    k: usize,
    look_m: f64,
    with_rods: bool,
) -> PartClearance<D> {
    let points = chain.points();
    let connectors = chain.connectors();
    let mut near = PartClearance { gap_m: look_m, to_surface: [0.0; D], rod_gap_m: look_m };
    // One query serves a rod and its ends, because obstacles near one of them are mostly near all.
    let end = if with_rods { (k + 1).min(points.len() - 1) } else { k };
    let at = points[k];
    let radius_m = connectors[k].radius_m;
    let rod_radius_m = chain.rods().get(k).map_or(0.0, |rod| rod.radius_m);
    // Below 0 if a part is inside by `look_m` already: then only obstacles count that it is deeper in.
    let room_m = (radius_m.max(connectors[end].radius_m) + look_m).max(0.0) + MARGIN_M;
    let room = Aabb::from_points(&[at, points[end]]).grown(room_m);
    obstacles.visit(&room, |o| {
        let nearest = o.core.nearest_to_point(at);
        let gap_m = nearest.distance_m - radius_m - o.radius_m;
        if gap_m < near.gap_m {
            near.gap_m = gap_m;
            // From the core back to the surface; without a direction if the connector's middle lies on the core.
            let part = 1.0 - o.radius_m / nearest.distance_m;
            near.to_surface =
                if part.is_finite() { scaled(sub(nearest.on_core, at), part) } else { [0.0; D] };
        }
        let rod_gap_m = o.core.nearest_to_segment([at, points[end]]).distance_m - rod_radius_m;
        near.rod_gap_m = near.rod_gap_m.min(rod_gap_m - o.radius_m);
    });
    near
}

/// Returns the least distance of any connector, and of any rod if rods count, from obstacles, up to
/// `look_m`, and the connector at or before that part.
pub(crate) fn min_clearance<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    look_m: f64,
    with_rods: bool,
) -> (f64, usize) {
    if obstacles.is_empty() {
        return (look_m, 0);
    }
    let mut least = (look_m, 0);
    for k in 0..chain.points().len() {
        // Obstacles farther away than the nearest so far change nothing.
        let near = part_clearance(chain, obstacles, k, least.0, with_rods);
        let apart_m = near.gap_m.min(near.rod_gap_m);
        if apart_m < least.0 {
            least = (apart_m, k);
        }
    }
    least
}

/// Returns the least gap between two parts of a chain that are no neighbors, up to `within_m`; negative
/// where they overlap. Neighbors are connectors of one rod, rods of one connector, and a connector and the
/// two rods to each of its sides. `tree` is a buffer.
pub(crate) fn self_gap_m<const D: usize>(
    chain: &Chain<D>,
    tree: &mut RodBvh<D>,
    within_m: f64,
) -> f64 {
    let points = chain.points();
    let connectors = chain.connectors();
    let rods = chain.rods();
    tree.refit((0..rods.len()).map(|rod| part_bounds(chain, rod, 0.0)));
    let mut least_m = within_m;
    for rod in 0..rods.len() {
        let near = part_bounds(chain, rod, least_m);
        tree.visit(&near, |other| {
            // Each pair of rods is visited twice, and measured once.
            if other >= rod + 2 {
                let apart_m = between_segments(rod_ends(chain, rod), rod_ends(chain, other));
                let apart_m = apart_m.distance_m;
                least_m = least_m.min(apart_m - rods[rod].radius_m - rods[other].radius_m);
            }
            // The tree holds rods: each stands for the connector at its start, and the last one for its end as well.
            let is_last = other + 1 == rods.len();
            for k in other..other + 1 + usize::from(is_last) {
                let at = points[k];
                let radius_m = connectors[k].radius_m;
                if k + 1 < rod || k > rod + 2 {
                    let [a, b] = rod_ends(chain, rod);
                    let apart_m = distance(at, nearest_on_segment(at, a, b));
                    least_m = least_m.min(apart_m - radius_m - rods[rod].radius_m);
                }
                if k >= rod + 2 {
                    let apart_m = distance(at, points[rod]);
                    least_m = least_m.min(apart_m - radius_m - connectors[rod].radius_m);
                }
            }
        });
    }
    least_m
}

#[inline]
fn rod_ends<const D: usize>(chain: &Chain<D>, rod: usize) -> [Point<D>; 2] {
    [chain.points()[rod], chain.points()[rod + 1]]
}

/// Returns the box around a rod and the connectors at its ends, grown by `by_m`: rods are no thicker than their
/// connectors.
#[inline]
fn part_bounds<const D: usize>(chain: &Chain<D>, rod: usize, by_m: f64) -> Aabb<D> {
    let connectors = chain.connectors();
    let radius_m = connectors[rod].radius_m.max(connectors[rod + 1].radius_m);
    Aabb::from_points(&rod_ends(chain, rod)).grown((radius_m + by_m).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::{Connector, Obstacle, Rod};

    /// The same by looking at every pair.
    fn every_pair_m(chain: &Chain<2>) -> f64 {
        let (points, connectors, rods) = (chain.points(), chain.connectors(), chain.rods());
        let ends = |rod: usize| [points[rod], points[rod + 1]];
        let mut least_m = f64::INFINITY;
        for i in 0..rods.len() {
            for j in i + 2..rods.len() {
                let apart_m = between_segments(ends(i), ends(j)).distance_m;
                least_m = least_m.min(apart_m - rods[i].radius_m - rods[j].radius_m);
            }
            for k in (0..points.len()).filter(|k| k + 1 < i || *k > i + 2) {
                let [a, b] = ends(i);
                let apart_m = distance(points[k], nearest_on_segment(points[k], a, b));
                least_m = least_m.min(apart_m - connectors[k].radius_m - rods[i].radius_m);
            }
        }
        for i in 0..points.len() {
            for j in i + 2..points.len() {
                let apart_m = distance(points[i], points[j]);
                least_m = least_m.min(apart_m - connectors[i].radius_m - connectors[j].radius_m);
            }
        }
        least_m
    }

    #[test]
    fn parts_that_cross_overlap_by_their_thickness() {
        let rod = Rod { min_m: 0.5, max_m: 2.0, radius_m: 0.02 };
        let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, -0.5]];
        let chain = Chain::new(points, vec![Connector::free(0.05); 4], vec![rod; 3]).unwrap();
        let gap_m = self_gap_m(&chain, &mut RodBvh::default(), 1.0);
        assert!((gap_m + 0.04).abs() < 1e-12, "{gap_m}");
    }

    proptest! {
        #[test]
        fn the_least_clearance_is_that_of_the_part_with_the_least_and_the_first_of_those(
            points in prop::collection::vec(prop::array::uniform2(-2.0..2.0f64), 2..9),
            discs in prop::collection::vec((prop::array::uniform2(-3.0..3.0f64), 0.05..1.5f64), 1..20),
            look_m in 0.01..2.0f64, with_rods in any::<bool>(),
        ) {
            let n = points.len();
            let rod = Rod { min_m: 1e-9, max_m: 9.0, radius_m: 0.02 };
            let chain = Chain::new(points, vec![Connector::free(0.1); n], vec![rod; n - 1]);
            let Ok(chain) = chain else { return Ok(()) };
            let discs = (0..).zip(discs).map(|(id, (at, radius_m))| Obstacle::ball(id, at, radius_m));
            let obstacles = Obstacles::new(discs.collect(), 1.0).unwrap();
            let mut least = (look_m, 0);
            for k in 0..n {
                let near = part_clearance(&chain, &obstacles, k, look_m, with_rods);
                let apart_m = near.gap_m.min(near.rod_gap_m);
                least = if apart_m < least.0 { (apart_m, k) } else { least };
            }
            prop_assert_eq!(min_clearance(&chain, &obstacles, look_m, with_rods), least);
        }

        #[test]
        fn the_least_gap_of_a_chain_is_that_of_its_nearest_pair(
            points in prop::collection::vec(prop::array::uniform2(-2.0..2.0f64), 3..14),
            radius_m in 0.01..0.3f64, within_m in 0.01..1.0f64,
        ) {
            let n = points.len();
            let rod = Rod { min_m: 1e-9, max_m: 9.0, radius_m: 0.2 * radius_m };
            let chain = Chain::new(points, vec![Connector::free(radius_m); n], vec![rod; n - 1]);
            let Ok(chain) = chain else { return Ok(()) };
            let gap_m = self_gap_m(&chain, &mut RodBvh::default(), within_m);
            prop_assert!((gap_m - every_pair_m(&chain).min(within_m)).abs() < 1e-12);
        }
    }

    #[test]
    fn gaps_are_told_of_each_connector_and_each_rod_with_the_way_to_what_is_there() {
        let rod = Rod::with_fixed_length(2.0, 0.05);
        let chain = Chain::straight([0.0, 0.0], [1.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
        let disc = Obstacle::ball(0, [1.0, 0.5], 0.2);
        let wall = Obstacle::capsule(1, [[-0.5, -1.0], [-0.5, 1.0]], 0.0);
        let obstacles = Obstacles::new(vec![disc, wall], 1.0).unwrap();
        let told = |k| part_clearance(&chain, &obstacles, k, 0.6, true);
        assert!((told(0).gap_m - 0.4).abs() < 1e-12);
        assert_eq!(told(0).to_surface, [-0.5, 0.0]);
        assert!((told(0).rod_gap_m - 0.25).abs() < 1e-12, "half way along it");
        assert_eq!((told(1).gap_m, told(1).to_surface), (0.6, [0.0, 0.0]), "nothing is near");
        let (least_m, part) = min_clearance(&chain, &obstacles, 0.6, true);
        assert!((least_m - 0.25).abs() < 1e-12 && part == 0);
        assert!((min_clearance(&chain, &obstacles, 0.6, false).0 - 0.4).abs() < 1e-12);
    }
}
