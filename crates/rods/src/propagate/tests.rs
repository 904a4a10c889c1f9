//! Tests of motions of whole chains. The invariants, and the tests that hold them:
//!
//! 1. rods keep their limits: [`laws`] `rods_bends_clearances_and_bases_keep_the_laws_in_any_world`
//! 2. no part comes nearer than 1e-9 m, or goes deeper: the same;
//!    `who_starts_inside_goes_no_deeper_in_any_world`
//! 3. fixed and failed connectors keep every bit: the same; `fixed_and_failed_connectors_object_and_stay`
//! 4. a veto leaves every bit: the same
//! 5. a rod that only changes its length leaves every bit beyond, and `touched` is the set of changes:
//!    `a_rod_that_only_changes_its_length_leaves_every_bit_beyond`
//! 6. bends keep their limits: as 1; `a_bend_limit_stops_what_would_fold`
//! 7. distant obstacles do not matter: [`symmetry`] `far_obstacles_change_no_bit`
//! 8. mirrored, turned, scaled: [`symmetry`] `a_chain_turned_round_moves_as_its_mirror`,
//!    `a_world_moved_rigidly_gives_the_same_motion`, `a_chain_twice_as_large_moves_twice_as_far`
//! 9. halves are independent: [`symmetry`] `the_two_halves_move_on_their_own`
//! 10. lanes are motions one by one: `wavefront.rs`, `lanes_are_motions_one_after_the_other`
//! 11. the same seed gives the same bytes on any number of threads: [`laws`]
//!     `the_same_seed_gives_the_same_bytes_on_any_number_of_threads`
//! 12. no part passes a wall of a millimeter: [`tunnel`]
//! 13. a pull and a base pass are a FABRIK iteration to 1e-15: [`symmetry`]
//!     `a_pull_and_a_base_pass_are_one_fabrik_iteration`
//! 14. blocked intervals agree with distances: `interval.rs`, a million cases on request
//! 15. a veto names the decisive constraint: [`laws`]
//!     `a_veto_names_a_constraint_without_which_it_is_gone_or_elsewhere`
//! 16. pushed, no chain runs into itself: [`laws`] `a_chain_that_is_pushed_never_runs_into_itself`; pulled through
//!     a corridor, none objects: `ground/corridor/pull_tests.rs` of `sidestep-chain`
//! 17. no two parts of a chain pass through each other, whatever their proportions: [`own_body`]
//! 18. joints to connectors and back: `kinematics/tests.rs` of `sidestep-arms`,
//!     `joint_values_come_back_from_connectors_where_they_are_determined`
//! 19. one connector, one rod, coincidence, no motion, NaN, a base inside: [`degenerate`]

use super::*;
use crate::chain::{Connector, Mobility, Rod};
use crate::fixtures::{TestRng, Wanderer, ball_field, clearance_m, own_clearance_m};
use crate::geometry::{add, norm, scaled, sub};
use crate::obstacle::Obstacle;
use crate::veto::RequestSource;
use proptest::prelude::*;

mod apart;
mod degenerate;
mod laws;
mod own_body;
mod reaction;
mod symmetry;
mod tunnel;

fn bits<const D: usize>(chain: &Chain<D>) -> Vec<[u64; D]> {
    chain.points().iter().map(|p| p.map(f64::to_bits)).collect()
}

fn go<const D: usize>(
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    k: usize,
    to: Point<D>,
) -> MotionOutcome<D> {
    Propagator::default().propagate(chain, obstacles, &MotionRequest::from_operator(k, to)).unwrap()
}

/// A random walk of rods within limits.
fn crooked<const D: usize>(seed: u64, n_rods: usize, rod: Rod, radius_m: f64) -> Chain<D> {
    let mut numbers = TestRng::new(seed);
    let mut walk = Wanderer::<D>::new(seed);
    let mut points = vec![[0.0; D]];
    for _ in 0..n_rods {
        let length_m = numbers.uniform(rod.min_m, rod.max_m);
        points.push(walk.next(points[points.len() - 1], length_m));
    }
    Chain::new(points, vec![Connector::free(radius_m); n_rods + 1], vec![rod; n_rods]).unwrap()
}

/// Wanders through a field of balls; the laws hold at every step.
fn wander<const D: usize>(seed: u64, rules: ReactionRules, steps: usize, max_bend_rad: f64) {
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
        match propagator
            .propagate(&mut chain, &obstacles, &MotionRequest::from_operator(0, to))
            .unwrap()
        {
            MotionOutcome::Vetoed(_) => {
                assert_eq!(bits(&chain), before, "a veto leaves every bit");
                vetoes += 1;
                walk.turn_anywhere();
            }
            MotionOutcome::Moved(moved) => {
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

fn own() -> ReactionRules {
    ReactionRules { self_collision: true, ..ReactionRules::default() }
}

#[test]
fn laws_hold_in_the_plane() {
    (0..6).for_each(|seed| wander::<2>(seed, ReactionRules::default(), 150, std::f64::consts::PI));
    (0..4).for_each(|seed| wander::<2>(seed, own(), 100, std::f64::consts::PI));
    (0..4).for_each(|seed| wander::<2>(seed, ReactionRules::default(), 100, 1.2));
}

#[test]
fn laws_hold_in_space() {
    (0..4).for_each(|seed| wander::<3>(seed, ReactionRules::default(), 100, std::f64::consts::PI));
    (0..3).for_each(|seed| wander::<3>(seed, own(), 60, std::f64::consts::PI));
    (0..3).for_each(|seed| wander::<3>(seed, own(), 60, 1.2));
}

#[test]
#[ignore = "a minute; fewer run every day"]
fn laws_hold_for_long() {
    for seed in 0..100 {
        wander::<2>(seed, own(), 1000, 1.2);
        wander::<2>(seed, ReactionRules::default(), 1000, std::f64::consts::PI);
        wander::<3>(seed, own(), 1000, 1.2);
        wander::<3>(seed, ReactionRules::default(), 1000, std::f64::consts::PI);
    }
}

#[test]
fn a_rod_within_its_limits_only_changes_its_length() {
    let rod = Rod { min_m: 0.5, max_m: 1.5, radius_m: 0.0 };
    let points = vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]];
    let mut chain = Chain::new(points, vec![Connector::free(0.0); 3], vec![rod; 2]).unwrap();
    let outcome = go(&mut chain, &Obstacles::default(), 0, [0.2, 0.1]);
    let moved = outcome.motion().unwrap();
    assert_eq!((moved.touched.clone(), moved.changed), (0..1, 1));
    assert_eq!(chain.points()[1..], [[1.0, 0.0], [2.0, 0.0]]);
}

#[test]
fn fixed_and_failed_connectors_object_and_stay() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
    for (fail, reason) in [(false, VetoReason::Fixed), (true, VetoReason::Failed)] {
        let mut chain =
            Chain::straight([0.0; 3], [1.0, 0.0, 0.0], 4, rod, Connector::free(0.0)).unwrap();
        if fail {
            chain.set_connector_failed(0, true);
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
        chain.set_connector_failed(0, false);
        chain.set_mobility(0, Mobility::Free).unwrap();
        assert!(go(&mut chain, &Obstacles::default(), 4, [4.5, 1.0, 0.0]).motion().is_some());
    }
}

#[test]
fn slaves_stay_on_their_line_and_plane() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
    let mut chain =
        Chain::straight([0.0; 3], [1.0, 0.0, 0.0], 1, rod, Connector::free(0.0)).unwrap();
    let line = Mobility::OnSegment([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    chain.set_mobility(1, line).unwrap();
    assert!(go(&mut chain, &Obstacles::default(), 0, [0.5, 0.6, 0.0]).motion().is_some());
    assert!(distance(chain.points()[1], [1.3, 0.0, 0.0]) < 1e-12);
    let veto = go(&mut chain, &Obstacles::default(), 0, [0.5, 3.0, 0.0]);
    assert_eq!(veto.veto().unwrap().reason, VetoReason::Mobility);
    let plane = Mobility::OnPlane { normal: [0.0, 0.0, 1.0], offset_m: 0.0 };
    chain.set_mobility(1, plane).unwrap();
    assert!(go(&mut chain, &Obstacles::default(), 0, [0.5, 0.6, 0.5]).motion().is_some());
    assert_eq!(chain.points()[1][2], 0.0);
    assert!(chain.max_rod_violation_m() < 1e-12);
}

#[test]
fn as_far_as_possible_stops_at_the_obstacle_and_says_why() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [-1.0, 0.0], 3, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(9, [2.0, 0.0], 0.5)], 1.0).unwrap();
    let exact = MotionRequest::from_operator(0, [2.0, 0.0]);
    let before = bits(&chain);
    let mut propagator = Propagator::default();
    let vetoed = propagator.propagate(&mut chain, &obstacles, &exact).unwrap();
    let veto = vetoed.veto().unwrap();
    assert_eq!((veto.reason, veto.obstacle), (VetoReason::TargetBlocked, Some(9)));
    assert!(veto.reached[0] > 1.3 && bits(&chain) == before);
    let far = MotionRequest { mode: VetoEffect::AsFarAsPossible, ..exact };
    let outcome = propagator.propagate(&mut chain, &obstacles, &far).unwrap();
    assert_eq!(outcome.motion().unwrap().cut_short, Some(*veto));
    assert_eq!(chain.points()[0], veto.reached);
}

#[test]
fn a_rod_as_initiator_moves_rigidly() {
    let rod = Rod { min_m: 0.8, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [1.0, 0.0], 5, rod, Connector::free(0.0)).unwrap();
    let motion = RequestedMotion::Rod { i: 2, to: [[2.0, 0.3], [3.0, 0.3]] };
    let request = MotionRequest { motion, source: RequestSource::Planner, mode: VetoEffect::Exact };
    let outcome = Propagator::default().propagate(&mut chain, &Obstacles::default(), &request);
    assert_eq!(outcome.unwrap().motion().unwrap().touched, 0..6);
    assert_eq!(chain.points()[2..4], [[2.0, 0.3], [3.0, 0.3]]);
    assert!(chain.max_rod_violation_m() < 1e-12);
    let stretched = RequestedMotion::Rod { i: 2, to: [[2.0, 0.3], [3.5, 0.3]] };
    let before = bits(&chain);
    let request = MotionRequest { motion: stretched, ..request };
    let outcome = Propagator::default().propagate(&mut chain, &Obstacles::default(), &request);
    assert_eq!(outcome.unwrap().veto().unwrap().reason, VetoReason::Mobility);
    assert_eq!(bits(&chain), before);
}

#[test]
fn a_bend_limit_stops_what_would_fold() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
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
