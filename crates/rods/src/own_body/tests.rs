use super::*;
use crate::chain::{Connector, Rod};
use crate::fixtures::own_clearance_m;
use crate::geometry::lerp;
use proptest::prelude::*;

fn zigzag(length_m: f64, radius_m: f64, rod_radius_m: f64) -> Chain<2> {
    let rod = Rod::with_fixed_length(length_m, rod_radius_m);
    Chain::straight([0.0; 2], [1.0, 0.0], 5, rod, Connector::free(radius_m)).unwrap()
}

#[test]
fn parts_of_one_joint_are_exempt_and_all_others_keep_their_thickness() {
    let chain = zigzag(1.0, 0.1, 0.02);
    let separation_m = |one, other| chain.min_separation_m(one, other);
    use ChainPart::{Connector as C, Rod as R};
    for (one, other) in [(C(1), C(2)), (R(1), R(2)), (R(1), C(1)), (R(1), C(2)), (R(2), R(2))] {
        assert_eq!(separation_m(one, other), None, "{one} and {other}");
        assert_eq!(separation_m(other, one), None, "{other} and {one}");
    }
    for (one, other, least_m) in [
        (C(1), C(3), 0.2),
        (R(1), C(3), 0.12),
        (C(1), R(2), 0.12),
        (R(1), R(3), 0.04),
        (C(0), R(4), 0.12),
    ] {
        for separation_m in [separation_m(one, other), separation_m(other, one)] {
            assert!((separation_m.unwrap() - least_m).abs() < 1e-15, "{one} and {other}");
        }
    }
}

#[test]
fn parts_too_thick_for_the_rods_between_them_keep_what_the_straight_chain_gives_them() {
    let chain = zigzag(0.1, 0.3, 0.08);
    let straight_m = |n: f64| n * 0.1 - TURN_ROOM_M;
    use ChainPart::{Connector as C, Rod as R};
    for (one, other, least_m) in [
        (R(0), R(2), straight_m(1.0)),
        (R(0), R(3), 0.16),
        (C(0), R(1), straight_m(1.0)),
        (C(0), C(4), straight_m(4.0)),
    ] {
        let separation_m = chain.min_separation_m(one, other).unwrap();
        assert!((separation_m - least_m).abs() < 1e-15, "{one} and {other}: {separation_m}");
    }
    assert!(nearest_own_parts(&chain, &mut RodBvh::default(), 0.0).is_none(), "no overlap");
}

#[test]
fn rods_that_close_leave_no_room_between_their_neighbors() {
    let rod = Rod { min_m: 1e-9, max_m: 1.0, radius_m: 0.1 };
    let chain = Chain::straight([0.0; 2], [1.0, 0.0], 3, rod, Connector::free(0.1)).unwrap();
    assert_eq!(chain.min_separation_m(ChainPart::Rod(0), ChainPart::Rod(2)), None);
}

#[test]
fn rods_that_cross_overlap_by_their_thickness() {
    let rod = Rod { min_m: 0.5, max_m: 2.0, radius_m: 0.02 };
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, -0.5]];
    let chain = Chain::new(points, vec![Connector::free(0.05); 4], vec![rod; 3]).unwrap();
    let nearest = nearest_own_parts(&chain, &mut RodBvh::default(), 1.0).unwrap();
    assert_eq!(nearest.parts, [ChainPart::Rod(0), ChainPart::Rod(2)]);
    assert!((nearest.gap_m + 0.04).abs() < 1e-12, "{nearest:?}");
}

fn any_chain<const D: usize>(points: Vec<Point<D>>, radius_m: f64, min_m: f64) -> Option<Chain<D>> {
    let n = points.len();
    let rod = Rod { min_m, max_m: 9.0, radius_m: 0.2 * radius_m };
    Chain::new_broken(points, vec![Connector::free(radius_m); n], vec![rod; n - 1]).ok()
}

proptest! {
    #[test]
    fn the_nearest_parts_are_those_of_every_pair_with_the_least_gap(
        plane in prop::collection::vec(prop::array::uniform2(-2.0..2.0f64), 2..14),
        space in prop::collection::vec(prop::array::uniform3(-2.0..2.0f64), 2..14),
        radius_m in 0.01..0.3f64, within_m in -0.1..1.0f64, min_m in 1e-9..0.5f64,
    ) {
        if let Some(chain) = any_chain(plane, radius_m, min_m) {
            let nearest = nearest_own_parts(&chain, &mut RodBvh::default(), within_m);
            let gap_m = nearest.map_or(within_m, |nearest| nearest.gap_m);
            prop_assert!((gap_m - own_clearance_m(&chain).min(within_m)).abs() < 1e-12);
        }
        if let Some(chain) = any_chain(space, radius_m, min_m) {
            let nearest = nearest_own_parts(&chain, &mut RodBvh::default(), within_m);
            let gap_m = nearest.map_or(within_m, |nearest| nearest.gap_m);
            prop_assert!((gap_m - own_clearance_m(&chain).min(within_m)).abs() < 1e-12);
        }
    }

    #[test]
    fn parts_that_cross_on_their_way_are_found(
        before in prop::collection::vec(prop::array::uniform2(-1.0..1.0f64), 5),
        by in prop::collection::vec(prop::array::uniform2(-0.3..0.3f64), 5),
    ) {
        let after: Vec<Point<2>> = before.iter().zip(&by).map(|(p, v)| [p[0] + v[0], p[1] + v[1]]).collect();
        let Some(chain) = any_chain(after.clone(), 0.01, 0.1) else { return Ok(()) };
        let crosses = |points: &[Point<2>], [i, j]: [usize; 2]| {
            crate::geometry::segments_cross([points[i], points[i + 1]], [points[j], points[j + 1]])
        };
        let found = find_own_passage(&chain, &before, &mut RodBvh::default());
        for pair in [[0, 2], [0, 3], [1, 3]] {
            let at = |k: i32| -> Vec<Point<2>> {
                let time = f64::from(k) / 500.0;
                before.iter().zip(&after).map(|(p, q)| lerp(*p, *q, time)).collect()
            };
            let is_crossed = (1..=500).any(|k| crosses(&at(k), pair));
            prop_assert!(!is_crossed || crosses(&before, pair) || found.is_some(), "{pair:?}");
        }
    }
}
