//! Changes that must not matter: far obstacles, scale, side of counting, place of the world.

use super::*;
use crate::fixtures::apart_m;
use crate::geometry::unit_x;

/// Returns the places that a chain reaches among balls, with other balls far away and cells of any size.
fn wandered<const D: usize>(far: &[Obstacle<D>], reach_m: f64) -> Vec<[u64; D]> {
    let field = ball_field::<D>(5, 2.5, 0.15, 0.2, 0.06);
    let obstacles = Obstacles::new(field.iter().chain(far).copied().collect(), reach_m).unwrap();
    let rod = Rod { min_m: 0.25, max_m: 0.3, radius_m: 0.02 };
    let back = scaled(unit_x(), -1.0);
    let mut chain = Chain::straight([0.0; D], back, 12, rod, Connector::free(0.05)).unwrap();
    let mut walk = Wanderer::new(5);
    for _ in 0..100 {
        let to = walk.next(chain.points()[0], 0.03);
        if go(&mut chain, &obstacles, 0, to).veto().is_some() {
            walk.turn_anywhere();
        }
    }
    bits(&chain)
}

fn is_the_same_among_far_obstacles<const D: usize>() {
    let at = |k: u32| scaled(unit_x(), 50.0 + f64::from(k));
    let far: Vec<_> = (0..50).map(|k| Obstacle::<D>::ball(900 + k, at(k), 2.0)).collect();
    assert_eq!(wandered(&[], 0.4), wandered(&far, 0.4));
    assert_eq!(wandered::<D>(&[], 0.4), wandered(&[], 3.0));
}

#[test]
fn far_obstacles_change_no_bit() {
    is_the_same_among_far_obstacles::<2>();
    is_the_same_among_far_obstacles::<3>();
}

fn among_balls<const D: usize>(seed: u64, n_rods: usize) -> (Chain<D>, Obstacles<D>) {
    let rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 };
    let chain = crooked::<D>(seed, n_rods, rod, 0.1);
    let field = ball_field(seed, 8.0, 0.05, 0.3, 0.4);
    let field = field.into_iter().filter(|o| apart_m(&chain, o) > 0.0).collect();
    (chain, Obstacles::new(field, 1.3).unwrap())
}

fn moves_as_its_mirror<const D: usize>(seed: u64, k: usize) -> Result<(), TestCaseError> {
    let (mut forth, balls) = among_balls::<D>(seed, 8);
    let points = forth.points().iter().rev().copied().collect();
    let mut back = Chain::new(points, forth.connectors().to_vec(), forth.rods().to_vec()).unwrap();
    let to = add(forth.points()[k], TestRng::new(seed + 1).point(0.2));
    go(&mut forth, &balls, k, to);
    go(&mut back, &balls, 8 - k, to);
    let mirrored: Vec<_> = back.points().iter().rev().copied().collect();
    prop_assert_eq!(forth.points(), &mirrored[..]);
    Ok(())
}

/// A motion from the middle equals those of the two halves with the same head, if neither objects.
fn halves_move_on_their_own<const D: usize>(seed: u64, open: bool) -> Result<(), TestCaseError> {
    let (mut whole, balls) = among_balls::<D>(seed, 10);
    let balls = if open { Obstacles::default() } else { balls };
    let half = |range: std::ops::Range<usize>| {
        let rods = whole.rods()[range.start..range.end - 1].to_vec();
        let connectors = whole.connectors()[range.clone()].to_vec();
        Chain::new(whole.points()[range].to_vec(), connectors, rods).unwrap()
    };
    let (mut low, mut high) = (half(0..5), half(4..11));
    let to = add(whole.points()[4], TestRng::new(seed + 1).point(0.1));
    let whole_came = go(&mut whole, &balls, 4, to);
    let came = whole_came.motion().is_some();
    let halves = [go(&mut low, &balls, 4, to), go(&mut high, &balls, 0, to)];
    prop_assert_eq!(came, halves.iter().all(|h| h.motion().is_some()));
    if came {
        let changed =
            |outcome: &MotionOutcome<D>| outcome.motion().map_or(0, |moved| moved.changed);
        // The head counts once in the whole, and once in either half, if it was cut up.
        prop_assert!(
            !open || changed(&whole_came) + 1 == changed(&halves[0]) + changed(&halves[1])
        );
        prop_assert_eq!(&whole.points()[..=4], low.points());
        prop_assert_eq!(&whole.points()[4..], high.points());
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_chain_twice_as_large_moves_twice_as_far(seed in 0u64..1000, k in 0usize..9, to in prop::array::uniform3(-3.0..3.0f64)) {
        let chain = crooked::<3>(seed, 8, Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.0 }, 0.0);
        let points = chain.points().iter().map(|p| scaled(*p, 2.0)).collect();
        let rods = vec![Rod { min_m: 1.8, max_m: 2.2, radius_m: 0.0 }; 8];
        let mut double = Chain::new(points, chain.connectors().to_vec(), rods).unwrap();
        let mut single = chain;
        go(&mut single, &Obstacles::default(), k, to);
        go(&mut double, &Obstacles::default(), k, scaled(to, 2.0));
        let doubled: Vec<_> = single.points().iter().map(|p| scaled(*p, 2.0)).collect();
        prop_assert_eq!(double.points(), &doubled[..]);
    }

    #[test]
    fn a_chain_turned_round_moves_as_its_mirror(seed in 0u64..1000, k in 0usize..9) {
        moves_as_its_mirror::<2>(seed, k)?;
        moves_as_its_mirror::<3>(seed, k)?;
    }

    #[test]
    fn a_world_moved_rigidly_gives_the_same_motion(seed in 0u64..1000, angle in 0.0..6.2f64, by in prop::array::uniform2(-0.1..0.1f64)) {
        use sidestep_kernel::math::{cos, sin};
        let turn = |p: Point<2>| [
            p[0] * cos(angle) - p[1] * sin(angle) + 1.7,
            p[0] * sin(angle) + p[1] * cos(angle) - 0.4,
        ];
        let mut chain = crooked::<2>(seed, 8, Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 }, 0.1);
        let field = ball_field::<2>(seed, 8.0, 0.05, 0.3, 0.4);
        let turned_field = field.iter().map(|o| {
            let crate::geometry::ConvexCore::Point(c) = o.core else { unreachable!() };
            Obstacle::ball(o.id, turn(c), o.radius_m)
        }).collect();
        let (walls, turned_walls) = (Obstacles::new(field, 1.3).unwrap(), Obstacles::new(turned_field, 1.3).unwrap());
        prop_assume!(clearance_m(&chain, &walls) > 0.0);
        let points = chain.points().iter().map(|p| turn(*p)).collect();
        let mut turned = Chain::new(points, chain.connectors().to_vec(), chain.rods().to_vec()).unwrap();
        let to = add(chain.points()[0], by);
        go(&mut chain, &walls, 0, to);
        go(&mut turned, &turned_walls, 0, turn(to));
        for (a, b) in chain.points().iter().zip(turned.points()) {
            prop_assert!(distance(turn(*a), *b) < 1e-9);
        }
    }

    #[test]
    fn the_two_halves_move_on_their_own(seed in 0u64..1000, open in any::<bool>()) {
        halves_move_on_their_own::<2>(seed, open)?;
        halves_move_on_their_own::<3>(seed, open)?;
    }

    #[test]
    fn a_pull_and_a_base_pass_are_one_fabrik_iteration(seed in 0u64..1000, to in prop::array::uniform3(-3.0..3.0f64)) {
        let rod = Rod::with_fixed_length(1.0, 0.0);
        let mut chain = crooked::<3>(seed, 6, rod, 0.0);
        let mut fabrik = chain.points().to_vec();
        let base = fabrik[0];
        fabrik[6] = to;
        let inner = |m: Point<3>, s: Point<3>| add(m, scaled(sub(s, m), 1.0 / norm(sub(s, m))));
        for i in (0..6).rev() {
            fabrik[i] = inner(fabrik[i + 1], fabrik[i]);
        }
        fabrik[0] = base;
        for i in 1..7 {
            fabrik[i] = inner(fabrik[i - 1], fabrik[i]);
        }
        go(&mut chain, &Obstacles::default(), 6, to);
        go(&mut chain, &Obstacles::default(), 0, base);
        for (a, b) in chain.points().iter().zip(&fabrik) {
            prop_assert!(distance(*a, *b) <= 1e-15, "{a:?} {b:?}");
        }
    }
}
