//! Distances of a chain's parts from the obstacles around them.

use sidestep_rods::geometry::{Aabb, Point, scaled, sub};
use sidestep_rods::{Chain, Obstacles};

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::{Connector, Obstacle, Rod};

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
