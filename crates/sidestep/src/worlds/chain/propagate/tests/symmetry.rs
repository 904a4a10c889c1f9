//! What must not matter: far obstacles, the scale, the side one counts from, the place of the world.

use super::*;

#[test]
fn far_obstacles_change_no_bit() {
    let field = ball_field::<2>(5, 2.5, 0.15, 0.2, 0.06);
    let run = |far: &[Obstacle<2>], reach_m: f64| {
        let all = field.iter().chain(far).copied().collect();
        let obstacles = Obstacles::new(all, reach_m).unwrap();
        let rod = Rod { min_m: 0.25, max_m: 0.3, radius_m: 0.02 };
        let mut chain =
            Chain::straight([0.0; 2], [-1.0, 0.0], 12, rod, Connector::free(0.05)).unwrap();
        let mut walk = Wanderer::new(5);
        for _ in 0..100 {
            let to = walk.next(chain.points()[0], 0.03);
            if go(&mut chain, &obstacles, 0, to).veto().is_some() {
                walk.turn();
            }
        }
        bits(&chain)
    };
    let far: Vec<_> =
        (0..50).map(|k| Obstacle::ball(900 + k, [50.0 + f64::from(k), 9.0], 2.0)).collect();
    assert_eq!(run(&[], 0.4), run(&far, 0.4));
    assert_eq!(run(&[], 0.4), run(&[], 3.0));
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
    fn a_chain_turned_round_moves_as_its_mirror(seed in 0u64..1000, k in 0usize..9, by in prop::array::uniform2(-0.2..0.2f64)) {
        let chain = crooked::<2>(seed, 8, Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.02 }, 0.1);
        let walls = Obstacles::new(ball_field(seed, 8.0, 0.05, 0.3, 0.4), 1.3).unwrap();
        prop_assume!(clearance_m(&chain, &walls) > 0.0);
        let points = chain.points().iter().rev().copied().collect();
        let mut back = Chain::new(points, chain.connectors().to_vec(), chain.rods().to_vec()).unwrap();
        let mut forth = chain;
        let to = add(forth.points()[k], by);
        go(&mut forth, &walls, k, to);
        go(&mut back, &walls, 8 - k, to);
        let mirrored: Vec<_> = back.points().iter().rev().copied().collect();
        prop_assert_eq!(forth.points(), &mirrored[..]);
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
            let crate::worlds::chain::geometry::Core::Point(c) = o.core else { unreachable!() };
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
    fn the_two_halves_move_on_their_own(seed in 0u64..1000, by in prop::array::uniform3(-0.5..0.5f64)) {
        let rod = Rod { min_m: 0.9, max_m: 1.1, radius_m: 0.0 };
        let mut whole = crooked::<3>(seed, 10, rod, 0.0);
        let half = |points: &[Point<3>]| {
            Chain::new(points.to_vec(), vec![Connector::free(0.0); points.len()], vec![rod; points.len() - 1]).unwrap()
        };
        let (mut low, mut high) = (half(&whole.points()[..=4]), half(&whole.points()[4..]));
        let to = add(whole.points()[4], by);
        go(&mut whole, &Obstacles::default(), 4, to);
        go(&mut low, &Obstacles::default(), 4, to);
        go(&mut high, &Obstacles::default(), 0, to);
        prop_assert_eq!(&whole.points()[..=4], low.points());
        prop_assert_eq!(&whole.points()[4..], high.points());
    }

    #[test]
    fn a_pull_and_a_base_pass_are_one_fabrik_iteration(seed in 0u64..1000, to in prop::array::uniform3(-3.0..3.0f64)) {
        let rod = Rod::fixed(1.0, 0.0);
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
            prop_assert!(distance(*a, *b) <= 1e-12, "{a:?} {b:?}");
        }
    }
}
