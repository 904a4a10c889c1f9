//! Invariants of motions of whole chains.

use super::*;
use crate::worlds::chain::chain::{Connector, Mobility, Rod};
use crate::worlds::chain::geometry::{add, cross_each_other, norm, scaled, sub};
use crate::worlds::chain::obstacle::Obstacle;
use crate::worlds::chain::scenes::{Numbers, Wanderer, ball_field, clearance_m};
use proptest::prelude::*;

mod corridor;

fn bits<const D: usize>(chain: &Chain<D>) -> Vec<[u64; D]> {
    chain.points().iter().map(|p| p.map(f64::to_bits)).collect()
}

fn go<const D: usize>(
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    k: usize,
    to: Point<D>,
) -> Outcome<D> {
    Propagator::default().propagate(chain, obstacles, &Request::exact(k, to)).unwrap()
}

/// A random walk of rods within limits.
fn crooked<const D: usize>(seed: u64, n_rods: usize, rod: Rod, radius_m: f64) -> Chain<D> {
    let mut numbers = Numbers::new(seed);
    let mut walk = Wanderer::<D>::new(seed);
    let mut points = vec![[0.0; D]];
    for _ in 0..n_rods {
        let length_m = numbers.within(rod.min_m, rod.max_m);
        points.push(walk.next(points[points.len() - 1], length_m));
    }
    Chain::new(points, vec![Connector::free(radius_m); n_rods + 1], vec![rod; n_rods]).unwrap()
}

/// Wanders through a field of balls; the laws hold at every step.
fn wander<const D: usize>(seed: u64, rules: Rules, steps: usize, max_bend_rad: f64) {
    let rod = Rod { min_m: 0.25, max_m: 0.3, radius_m: 0.02 };
    let mut connector = Connector::free(0.05);
    connector.max_bend_rad = max_bend_rad;
    let mut back = [0.0; D];
    back[0] = -1.0;
    let mut chain = Chain::straight([0.0; D], back, 12, rod, connector).unwrap();
    let field = ball_field::<D>(seed, 2.5, 0.15, 0.2, 0.06);
    let obstacles = Obstacles::new(field, 0.4).unwrap();
    let mut propagator = Propagator::new(rules);
    let mut walk = Wanderer::new(seed);
    let (mut vetoes, mut moves) = (0, 0);
    for _ in 0..steps {
        let before = bits(&chain);
        let to = walk.next(chain.points()[0], 0.03);
        match propagator.propagate(&mut chain, &obstacles, &Request::exact(0, to)).unwrap() {
            Outcome::Vetoed(_) => {
                assert_eq!(bits(&chain), before, "a veto leaves every bit");
                vetoes += 1;
                walk.turn();
            }
            Outcome::Moved(moved) => {
                moves += 1;
                let after = bits(&chain);
                let changed: Vec<_> = (0..after.len()).filter(|&i| after[i] != before[i]).collect();
                assert!(changed.iter().all(|i| moved.touched.contains(i)));
            }
        }
        assert!(chain.max_rod_violation_m() <= 1e-9);
        assert!(clearance_m(&chain, &obstacles) >= -1.1e-9, "{}", clearance_m(&chain, &obstacles));
        for i in 1..12 {
            assert!(chain.bend_rad(i).unwrap() <= max_bend_rad + BEND_TOLERANCE);
        }
        if rules.self_collision {
            assert!(own_clearance_m(&chain) >= -1.1e-9);
        }
    }
    assert!(moves > steps / 4, "{moves} moves, {vetoes} vetoes");
}

const BEND_TOLERANCE: f64 = 1.1e-9;

/// The least clearance of discs further apart than one index and rods further than two.
fn own_clearance_m<const D: usize>(chain: &Chain<D>) -> f64 {
    use crate::worlds::chain::geometry::between_segments;
    let (points, rods, connectors) = (chain.points(), chain.rods(), chain.connectors());
    let mut least_m = f64::INFINITY;
    for i in 0..points.len() {
        for j in i + 2..points.len() {
            let apart_m = distance(points[i], points[j]);
            least_m = least_m.min(apart_m - connectors[i].radius_m - connectors[j].radius_m);
        }
    }
    for i in 0..rods.len() {
        for j in i + 3..rods.len() {
            let nearest = between_segments([points[i], points[i + 1]], [points[j], points[j + 1]]);
            least_m = least_m.min(nearest.distance_m - rods[i].radius_m - rods[j].radius_m);
        }
    }
    least_m
}

fn own() -> Rules {
    Rules { self_collision: true, ..Rules::default() }
}

#[test]
fn laws_hold_in_the_plane() {
    (0..6).for_each(|seed| wander::<2>(seed, Rules::default(), 150, std::f64::consts::PI));
    (0..4).for_each(|seed| wander::<2>(seed, own(), 100, std::f64::consts::PI));
    (0..4).for_each(|seed| wander::<2>(seed, Rules::default(), 100, 1.2));
}

#[test]
fn laws_hold_in_space() {
    (0..4).for_each(|seed| wander::<3>(seed, Rules::default(), 100, std::f64::consts::PI));
    (0..3).for_each(|seed| wander::<3>(seed, own(), 60, std::f64::consts::PI));
    (0..3).for_each(|seed| wander::<3>(seed, own(), 60, 1.2));
}

#[test]
#[ignore = "a minute; fewer run every day"]
fn laws_hold_for_long() {
    for seed in 0..100 {
        wander::<2>(seed, own(), 1000, 1.2);
        wander::<2>(seed, Rules::default(), 1000, std::f64::consts::PI);
        wander::<3>(seed, own(), 1000, 1.2);
        wander::<3>(seed, Rules::default(), 1000, std::f64::consts::PI);
    }
}

#[test]
fn nobody_passes_a_thin_wall() {
    for seed in 0..20 {
        let mut numbers = Numbers::new(seed);
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
        let mut propagator = Propagator::new(Rules { step_m: Some(0.12), ..Rules::default() });
        let mut walk = Wanderer::new(seed);
        for _ in 0..200 {
            let before = chain.points().to_vec();
            let to = walk.next(before[0], 0.119);
            let outcome =
                propagator.propagate(&mut chain, &obstacles, &Request::exact(0, to)).unwrap();
            if outcome.veto().is_some() {
                walk.turn();
            }
            for wall in &walls {
                let crate::worlds::chain::geometry::Core::Segment(core) = wall.core else {
                    continue;
                };
                for (old, new) in before.iter().zip(chain.points()) {
                    assert!(!cross_each_other([*old, *new], core), "seed {seed}");
                }
                for rod in chain.points().windows(2) {
                    assert!(!cross_each_other([rod[0], rod[1]], core), "seed {seed}");
                }
            }
        }
    }
}

#[test]
fn a_rod_within_its_limits_only_changes_its_length() {
    let rod = Rod { min_m: 0.5, max_m: 1.5, radius_m: 0.0 };
    let points = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
    let mut chain = Chain::new(points, vec![Connector::free(0.0); 3], vec![rod; 2]).unwrap();
    let outcome = go(&mut chain, &Obstacles::default(), 0, [0.2, 0.1]);
    let moved = outcome.moved().unwrap();
    assert_eq!((moved.touched.clone(), moved.changed), (0..1, 1));
    assert_eq!(chain.points()[1..], [[1.0, 0.0], [2.0, 0.0]]);
}

#[test]
fn fixed_and_failed_connectors_object_and_stay() {
    let rod = Rod::fixed(1.0, 0.0);
    for (fail, reason) in [(false, Reason::Fixed), (true, Reason::Failed)] {
        let mut chain =
            Chain::straight([0.0; 3], [1.0, 0.0, 0.0], 4, rod, Connector::free(0.0)).unwrap();
        if fail {
            chain.set_failed(0, true);
        } else {
            chain.set_mobility(0, Mobility::Fixed).unwrap();
        }
        let before = bits(&chain);
        let outcome = go(&mut chain, &Obstacles::default(), 4, [4.5, 1.0, 0.0]);
        let veto = outcome.veto().unwrap();
        assert_eq!(
            (veto.by, veto.from, veto.reason, veto.reached),
            (0, 4, reason, [4.0, 0.0, 0.0])
        );
        assert_eq!(bits(&chain), before);
        let own = go(&mut chain, &Obstacles::default(), 0, [0.0, 1.0, 0.0]);
        assert_eq!(own.veto().unwrap().reason, reason);
        // The constraint that was named is the one that mattered.
        chain.set_failed(0, false);
        chain.set_mobility(0, Mobility::Free).unwrap();
        assert!(go(&mut chain, &Obstacles::default(), 4, [4.5, 1.0, 0.0]).moved().is_some());
    }
}

#[test]
fn slaves_stay_on_their_line_and_plane() {
    let rod = Rod::fixed(1.0, 0.0);
    let mut chain =
        Chain::straight([0.0; 3], [1.0, 0.0, 0.0], 1, rod, Connector::free(0.0)).unwrap();
    let line = Mobility::OnSegment([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    chain.set_mobility(1, line).unwrap();
    assert!(go(&mut chain, &Obstacles::default(), 0, [0.5, 0.6, 0.0]).moved().is_some());
    assert!(distance(chain.points()[1], [1.3, 0.0, 0.0]) < 1e-12);
    let veto = go(&mut chain, &Obstacles::default(), 0, [0.5, 3.0, 0.0]);
    assert_eq!(veto.veto().unwrap().reason, Reason::Mobility);
    let plane = Mobility::OnPlane { normal: [0.0, 0.0, 1.0], offset_m: 0.0 };
    chain.set_mobility(1, plane).unwrap();
    assert!(go(&mut chain, &Obstacles::default(), 0, [0.5, 0.6, 0.5]).moved().is_some());
    assert_eq!(chain.points()[1][2], 0.0);
    assert!(chain.max_rod_violation_m() < 1e-12);
}

#[test]
fn as_far_as_possible_stops_at_the_obstacle_and_says_why() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [-1.0, 0.0], 3, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(9, [2.0, 0.0], 0.5)], 1.0).unwrap();
    let exact = Request::exact(0, [2.0, 0.0]);
    let before = bits(&chain);
    let mut propagator = Propagator::default();
    let vetoed = propagator.propagate(&mut chain, &obstacles, &exact).unwrap();
    let veto = vetoed.veto().unwrap();
    assert_eq!((veto.reason, veto.obstacle), (Reason::TargetBlocked, Some(9)));
    assert!(veto.reached[0] > 1.3 && bits(&chain) == before);
    let far = Request { mode: Mode::AsFarAsPossible, ..exact };
    let outcome = propagator.propagate(&mut chain, &obstacles, &far).unwrap();
    assert_eq!(outcome.moved().unwrap().cut_short, Some(*veto));
    assert_eq!(chain.points()[0], veto.reached);
}

#[test]
fn a_rod_as_initiator_moves_rigidly() {
    let rod = Rod { min_m: 0.8, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [1.0, 0.0], 5, rod, Connector::free(0.0)).unwrap();
    let motion = Motion::Rod { i: 2, to: [[2.0, 0.3], [3.0, 0.3]] };
    let request = Request { motion, source: Source::Planner, mode: Mode::Exact };
    let outcome = Propagator::default().propagate(&mut chain, &Obstacles::default(), &request);
    assert_eq!(outcome.unwrap().moved().unwrap().touched, 0..6);
    assert_eq!(chain.points()[2..4], [[2.0, 0.3], [3.0, 0.3]]);
    assert!(chain.max_rod_violation_m() < 1e-12);
    let stretched = Motion::Rod { i: 2, to: [[2.0, 0.3], [3.5, 0.3]] };
    let before = bits(&chain);
    let request = Request { motion: stretched, ..request };
    let outcome = Propagator::default().propagate(&mut chain, &Obstacles::default(), &request);
    assert_eq!(outcome.unwrap().veto().unwrap().reason, Reason::Mobility);
    assert_eq!(bits(&chain), before);
}

use crate::worlds::chain::veto::Source;

#[test]
fn wrong_requests_are_errors_and_a_target_reached_is_no_motion() {
    let rod = Rod::fixed(1.0, 0.0);
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 1, rod, Connector::free(0.0)).unwrap();
    let mut propagator = Propagator::default();
    let mut ask =
        |k, to| propagator.propagate(&mut chain, &Obstacles::default(), &Request::exact(k, to));
    assert!(ask(0, [f64::NAN, 0.0]).is_err());
    assert!(ask(2, [0.0, 0.0]).is_err());
    let still = ask(0, [0.0, 0.0]).unwrap();
    assert_eq!(still.moved().unwrap().touched, 0..0);
    // Onto the slave: the rod goes where it was.
    assert!(ask(0, [1.0, 0.0]).unwrap().moved().is_some());
    assert_eq!(chain.points()[1], [2.0, 0.0]);
}

#[test]
fn who_starts_inside_may_leave_but_not_go_deeper() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [-1.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(1, [0.05, 0.3], 0.3)], 1.0).unwrap();
    let deeper = go(&mut chain, &obstacles, 0, [0.02, 0.05]);
    assert_eq!(deeper.veto().unwrap().reason, Reason::Inside);
    assert!(go(&mut chain, &obstacles, 0, [0.0, -0.2]).moved().is_some());
}

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

#[test]
fn a_veto_names_the_obstacle_that_matters() {
    let mut checked = 0;
    for seed in 0..30 {
        let field = ball_field::<2>(seed, 2.5, 0.25, 0.2, 0.06);
        let obstacles = Obstacles::new(field.clone(), 0.4).unwrap();
        let rod = Rod { min_m: 0.25, max_m: 0.3, radius_m: 0.02 };
        let mut chain =
            Chain::straight([0.0; 2], [-1.0, 0.0], 12, rod, Connector::free(0.05)).unwrap();
        let mut walk = Wanderer::new(seed);
        for _ in 0..60 {
            let to = walk.next(chain.points()[0], 0.03);
            let outcome = go(&mut chain, &obstacles, 0, to);
            let Some(veto) = outcome.veto() else { continue };
            let id = veto.obstacle.expect("nothing but obstacles is in the way");
            let rest = field.iter().filter(|o| o.id != id).copied().collect();
            let without = Obstacles::new(rest, 0.4).unwrap();
            let again = go(&mut chain.clone(), &without, 0, to);
            assert_ne!(again.veto().map(|v| (v.by, v.obstacle)), Some((veto.by, Some(id))));
            checked += 1;
            walk.turn();
        }
    }
    assert!(checked > 20, "{checked}");
}

#[test]
fn a_bend_limit_stops_what_would_fold() {
    let rod = Rod::fixed(1.0, 0.0);
    let mut connector = Connector::free(0.0);
    connector.max_bend_rad = 1.0;
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 6, rod, connector).unwrap();
    for k in 0..200 {
        let [x, y] = chain.points()[0];
        go(&mut chain, &Obstacles::default(), 0, [x + 0.01 * f64::from(k % 3), y + 0.02]);
        for i in 1..6 {
            assert!(chain.bend_rad(i).unwrap() <= 1.0 + 1e-9);
        }
    }
    assert!(chain.points()[0][1] > 1.0);
}
