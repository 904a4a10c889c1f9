//! No part passes through anything, however thin.

use super::*;
use crate::geometry::{ConvexCore, Cuboid, segments_cross};

#[test]
fn nobody_passes_a_thin_wall() {
    for seed in 0..20 {
        let mut numbers = TestRng::new(seed);
        let mut walls = Vec::new();
        for id in 0..40 {
            let a: Point<2> = numbers.point(3.0);
            let ends = [a, add(a, numbers.point(0.7))];
            // Nothing near where the chain starts.
            if ends.iter().all(|p| p[1].abs() > 0.75 || p[0] > 0.4) && ends[0][1] * ends[1][1] > 0.0
            {
                walls.push(Obstacle::capsule(id, ends, 0.0005));
            }
        }
        let obstacles = Obstacles::new(walls.clone(), 0.8).unwrap();
        let rod = Rod { min_m: 0.5, max_m: 0.6, radius_m: 0.002 };
        let mut chain =
            Chain::straight([0.0, 0.0], [-1.0, 0.0], 8, rod, Connector::free(0.01)).unwrap();
        let mut propagator =
            Propagator::new(ReactionRules { step_m: Some(0.12), ..ReactionRules::default() });
        let mut walk = Wanderer::new(seed);
        for _ in 0..200 {
            let before = chain.points().to_vec();
            let to = walk.next(before[0], 0.119);
            let outcome = propagator
                .propagate(&mut chain, &obstacles, &MotionRequest::from_operator(0, to))
                .unwrap();
            if outcome.veto().is_some() {
                walk.turn_anywhere();
            }
            for wall in &walls {
                let ConvexCore::Segment(core) = wall.core else {
                    continue;
                };
                for (old, new) in before.iter().zip(chain.points()) {
                    assert!(!segments_cross([*old, *new], core), "seed {seed}");
                }
                for rod in chain.points().windows(2) {
                    assert!(!segments_cross([rod[0], rod[1]], core), "seed {seed}");
                }
            }
        }
    }
}

/// Plates of a millimeter, and a chain that wanders between them in steps as long as its rods.
#[test]
fn nobody_passes_a_thin_plate() {
    let mut jams = 0;
    for seed in 0..12 {
        let mut numbers = TestRng::new(seed);
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let plates: Vec<Cuboid<3>> = (0..60)
            .map(|k| {
                let half_m = std::array::from_fn(|i| {
                    if i == k % 3 { 0.0005 } else { numbers.uniform(0.2, 0.7) }
                });
                Cuboid { center: numbers.point(2.5), axes, half_m }
            })
            // Nothing near where the chain starts.
            .filter(|p| {
                let start = [[0.0; 3], [-2.5, 0.0, 0.0]];
                ConvexCore::Cuboid(*p).nearest_to_segment(start).distance_m > 0.1
            })
            .collect();
        let all =
            (0..).zip(&plates).map(|(id, p)| Obstacle::new_static(id, ConvexCore::Cuboid(*p), 0.0));
        let obstacles = Obstacles::new(all.collect(), 0.8).unwrap();
        let rod = Rod { min_m: 0.4, max_m: 0.5, radius_m: 0.002 };
        let mut chain =
            Chain::straight([0.0; 3], [-1.0, 0.0, 0.0], 5, rod, Connector::free(0.01)).unwrap();
        let mut propagator =
            Propagator::new(ReactionRules { step_m: Some(0.12), ..ReactionRules::default() });
        let mut walk = Wanderer::new(seed);
        for _ in 0..150 {
            let before = chain.points().to_vec();
            let to = walk.next(before[0], 0.119);
            let request = MotionRequest::from_operator(0, to);
            let outcome = propagator.propagate(&mut chain, &obstacles, &request).unwrap();
            if outcome.veto().is_some() {
                jams += 1;
                walk.turn_anywhere();
            }
            let ways = before.iter().zip(chain.points()).map(|(old, new)| [*old, *new]);
            let rods = chain.points().windows(2).map(|rod| [rod[0], rod[1]]);
            for line in ways.chain(rods) {
                for plate in &plates {
                    let apart_m = plate.nearest_to_segment(line).distance_m;
                    assert!(apart_m > 0.0, "seed {seed}");
                }
            }
        }
    }
    assert!(jams > 20, "{jams}: plates must be in the way");
}
