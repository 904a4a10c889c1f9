//! Ways among obstacles, each checked posture by posture by another measure than the planner's.

mod own_body;

use super::*;
use sidestep_kernel::Seed;
use sidestep_kernel::interrupt::Interrupt;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_rods::{Connector, Mobility, Obstacle, Rod};
use std::panic::{AssertUnwindSafe, catch_unwind};

fn draws(seed: u64) -> Draws {
    Streams::new(Seed(seed)).draws(0, 0, Purpose(9))
}

/// Returns the least clearance of any connector and any rod from obstacles, up to 1 m.
fn clearance_m<const D: usize>(chain: &Chain<D>, obstacles: &Obstacles<D>) -> f64 {
    let points = chain.points();
    let tip = |i: usize| obstacles.clearance_m([points[i]; 2], chain.connectors()[i].radius_m, 1.0);
    let rod =
        |i: usize| obstacles.clearance_m([points[i], points[i + 1]], chain.rods()[i].radius_m, 1.0);
    let tips = (0..points.len()).map(tip).fold(1.0, f64::min);
    (0..chain.rods().len()).map(rod).fold(tips, f64::min)
}

/// An arm of five rods along the first axis.
fn arm() -> Chain<2> {
    let rod = Rod::with_fixed_length(0.4, 0.02);
    let mut arm = Chain::straight([0.0; 2], [1.0, 0.0], 5, rod, Connector::free(0.03)).unwrap();
    arm.set_mobility(0, Mobility::Fixed).unwrap();
    arm
}

/// A wall beside the arm, with a hole near the base: the tool must be drawn back to come behind it.
fn wall() -> Obstacles<2> {
    let wall = Obstacle::capsule(0, [[0.5, 0.35], [2.5, 0.35]], 0.05);
    Obstacles::new(vec![wall], 1.0).unwrap()
}

const BEHIND: PlanningQuery<2> = PlanningQuery { k: 5, target: [1.0, 0.9], tolerance_m: 1e-3 };

#[test]
fn a_way_round_a_wall_is_found_and_free_all_along() {
    let (chain, obstacles) = (arm(), wall());
    for seed in 0..20 {
        let way =
            plan(&chain, &obstacles, ReactionRules::default(), &BEHIND, &mut draws(seed)).unwrap();
        let way = way.unwrap_or_else(|| panic!("{seed}: no way"));
        let space = ChainConfigurationSpace::new(&chain, &obstacles, false, 5).unwrap();
        let mut at = chain.clone();
        for next in &way {
            let from = at.points().to_vec();
            for part in 1..=200 {
                at.points_mut().copy_from_slice(&space.interpolate(
                    &from,
                    next,
                    f64::from(part) / 200.0,
                ));
                assert!(clearance_m(&at, &obstacles) > -5e-3, "{seed}");
                assert!(at.max_rod_violation_m() < 1e-9 && at.points()[0] == [0.0; 2], "{seed}");
            }
        }
        let left_m = sidestep_rods::geometry::distance(at.points()[5], BEHIND.target);
        assert!(left_m <= BEHIND.tolerance_m, "{seed}: {left_m}");
    }
}

/// Three rods folded like a Z beside the target: the postures near the present one are cut off from it
/// by the chain's own body.
#[test]
fn a_folded_arm_finds_a_posture_that_it_can_get_to() {
    let points = vec![[0.0, 0.0], [0.69383, 0.72014], [-0.29946, 0.83574], [0.70042, 0.82014]];
    let rods: Vec<_> = points
        .windows(2)
        .map(|w| Rod::with_fixed_length(sidestep_rods::geometry::distance(w[0], w[1]), 0.03))
        .collect();
    let mut arm = Chain::new(points, vec![Connector::free(0.05); 4], rods).unwrap();
    arm.set_mobility(0, Mobility::Fixed).unwrap();
    let rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    let errand = PlanningQuery { k: 3, target: [0.630_251_8, 0.731_368_6], tolerance_m: 5e-4 };
    for seed in 0..10 {
        let way = plan(&arm, &Obstacles::default(), rules, &errand, &mut draws(seed)).unwrap();
        assert!(way.is_some(), "{seed}: no way");
    }
}

#[test]
fn the_same_draws_give_the_same_way() {
    let once =
        |seed| plan(&arm(), &wall(), ReactionRules::default(), &BEHIND, &mut draws(seed)).unwrap();
    assert_eq!(once(3), once(3));
    assert_ne!(once(3), once(4));
}

#[test]
fn no_way_leads_into_an_obstacle_or_out_of_reach() {
    for target in [[1.0, 0.35], [0.0, 3.0]] {
        let errand = PlanningQuery { target, ..BEHIND };
        let way = plan(&arm(), &wall(), ReactionRules::default(), &errand, &mut draws(1)).unwrap();
        assert_eq!(way, None);
    }
}

#[test]
fn a_chain_that_is_held_on_both_sides_has_a_plan_only_if_both_are_fixed() {
    let mut chain = arm();
    chain.set_mobility(5, Mobility::OnSegment([[2.0, 0.0], [3.0, 0.0]])).unwrap();
    let between = PlanningQuery { k: 3, ..BEHIND };
    let plan =
        |chain: &Chain<2>| plan(chain, &wall(), ReactionRules::default(), &between, &mut draws(1));
    let error = plan(&chain).unwrap_err();
    assert_eq!(error.place(), "planner");
    assert!(error.to_string().contains("connectors 0 and 5"), "{error}");
    chain.set_mobility(5, Mobility::Fixed).unwrap();
    assert_eq!(plan(&chain), Ok(None), "the chain is straight, and cannot move at all");
}

/// A spiral of twelve rods, in which the tool lies innermost: it gets out by uncurling alone.
#[test]
fn a_coiled_chain_uncurls_whatever_holds_it() {
    let rod = Rod::with_fixed_length(0.3, 0.01);
    let mut points = vec![[0.0, 0.0]];
    let mut direction_rad: f64 = 0.0;
    for i in 0..12 {
        let u =
            [sidestep_kernel::math::cos(direction_rad), sidestep_kernel::math::sin(direction_rad)];
        let [x, y] = points[i];
        points.push([x + 0.3 * u[0], y + 0.3 * u[1]]);
        direction_rad += 0.35 + 0.07 * i as f64;
    }
    let coil = Chain::new(points, vec![Connector::free(0.02); 13], vec![rod; 12]).unwrap();
    let rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    let query = PlanningQuery { k: 12, target: [1.0, -1.5], tolerance_m: 1e-3 };
    for base in [
        Mobility::Free,
        Mobility::Fixed,
        Mobility::OnSegment([[-3.0, 0.0], [3.0, 0.0]]),
        Mobility::OnPlane { normal: [0.0, 1.0], offset_m: 0.0 },
        Mobility::InBox { lo: [-1.0, -0.5], hi: [1.0, 0.0] },
    ] {
        let mut chain = coil.clone();
        chain.set_mobility(0, base).unwrap();
        let obstacles = Obstacles::default();
        let path = plan(&chain, &obstacles, rules, &query, &mut draws(1)).unwrap();
        let path = path.unwrap_or_else(|| panic!("{base:?}: no path"));
        let space = ChainConfigurationSpace::new(&chain, &obstacles, true, 12).unwrap();
        let mut from = space.present_posture();
        for next in &path {
            for part in 1..=200 {
                let at = space.interpolate(&from, next, f64::from(part) / 200.0);
                assert!(base.allows(at[0], chain.points()[0]), "{base:?}");
                for i in 0..12 {
                    for j in i + 2..12 {
                        let crosses = sidestep_rods::geometry::segments_cross(
                            [at[i], at[i + 1]],
                            [at[j], at[j + 1]],
                        );
                        assert!(!crosses, "{base:?}: rods {i} and {j}");
                    }
                }
            }
            from.clone_from(next);
        }
        let left_m = sidestep_rods::geometry::distance(from[12], query.target);
        assert!(left_m <= query.tolerance_m, "{base:?}: {left_m}");
    }
}

#[test]
fn a_search_heeds_an_interrupt() {
    let interrupt = Interrupt::default();
    interrupt.raise();
    let search = || {
        let _heeded = interrupt.attach();
        plan(&arm(), &wall(), ReactionRules::default(), &BEHIND, &mut draws(1))
    };
    let payload = catch_unwind(AssertUnwindSafe(search)).expect_err("it unwinds");
    assert!(interrupt.has_caused_unwind(payload.as_ref()));
}
