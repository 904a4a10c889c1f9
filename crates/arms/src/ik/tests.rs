use super::alternate;
use super::*;
use proptest::prelude::*;
use sidestep_rods::geometry::{angle_between_rad, nearest_on_segment, normalized};
use sidestep_rods::{Connector, Mobility, Obstacle, Rod, VetoReason};

const ENGINES: [IkEngine; 4] = [IkEngine::Auto, IkEngine::Chain, IkEngine::Dls, IkEngine::Direct];

/// A chain through directions that are made of three numbers in [-1, 1] each.
fn chain_of<const D: usize>(turns: &[[f64; 3]], slack: f64) -> Chain<D> {
    let mut points = vec![std::array::from_fn(|i| 0.3 * i as f64 - 0.1)];
    let mut rods = Vec::new();
    for (i, turn) in turns.iter().enumerate() {
        let u = normalized(std::array::from_fn(|k| turn[k])).unwrap_or(unit_x());
        let length_m = 0.4 + 0.6 * (turn[2].abs() * 7.0).fract();
        points.push(add_scaled(points[i], u, length_m));
        let (min_m, max_m) = (length_m * (1.0 - slack), length_m * (1.0 + slack));
        rods.push(Rod { min_m, max_m, radius_m: 0.0 });
    }
    let n = points.len();
    Chain::new(points, vec![Connector::free(0.0); n], rods).expect("a chain")
}

/// The point at a part of the shell's thickness from the base, in a direction.
fn target_of<const D: usize>(chain: &Chain<D>, part: f64, toward: [f64; 3]) -> Point<D> {
    let spans: Vec<RodLengthRange> = chain.rods().iter().map(RodLengthRange::from_rod).collect();
    let ReachShell { hole_m, reach_m } = ReachShell::from_length_ranges(&spans);
    let u = normalized(std::array::from_fn(|k| toward[k])).unwrap_or(unit_x());
    add_scaled(chain.points()[0], u, hole_m + part * (reach_m - hole_m))
}

fn is_met<const D: usize>(
    chain: &Chain<D>,
    goal: &ChainIkGoal<D>,
    answer: &ChainIkResult<D>,
) -> Result<(), TestCaseError> {
    prop_assert!(answer.reached, "{:?} {:?}", answer.reason, answer.error_m);
    prop_assert!(answer.reason.is_none());
    prop_assert_eq!(answer.points[goal.base], chain.points()[goal.base]);
    prop_assert!(distance(answer.points[goal.k], goal.target) <= goal.tolerance_m);
    let whole =
        Chain::new(answer.points.clone(), chain.connectors().to_vec(), chain.rods().to_vec());
    prop_assert!(whole.is_ok(), "{:?}", whole.err());
    Ok(())
}

fn every_engine_meets<const D: usize>(
    chain: &Chain<D>,
    goal: ChainIkGoal<D>,
) -> Result<(), TestCaseError> {
    for engine in ENGINES {
        let goal = ChainIkGoal { engine, ..goal };
        let answer = IkSolver::default().solve(chain, &Obstacles::default(), &goal).expect("right");
        is_met(chain, &goal, &answer)?;
    }
    Ok(())
}

fn turns(most: usize) -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 1..most)
}

proptest! {
    #[test]
    fn whatever_the_rods_reach_is_reached_by_every_engine(
        turns in turns(40),
        slack in prop::sample::select(vec![0.0, 0.0, 0.1]),
        part in prop::sample::select(vec![0.0, 1e-6, 0.1, 0.5, 0.9, 0.999, 1.0]),
        toward in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let plane = chain_of::<2>(&turns, slack);
        let target = target_of(&plane, part, toward);
        every_engine_meets(&plane, ChainIkGoal::new(turns.len(), 0, target))?;
        let space = chain_of::<3>(&turns, slack);
        let target = target_of(&space, part, toward);
        every_engine_meets(&space, ChainIkGoal::new(turns.len(), 0, target))?;
    }

    #[test]
    fn a_base_inside_keeps_what_is_behind_it_and_what_is_beyond_follows(
        turns in turns(20),
        base in 0usize..20,
        k in 0usize..20,
        part in 0.0..1.0f64,
        toward in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let chain = chain_of::<3>(&turns, 0.0);
        let n = chain.points().len();
        let (base, k) = (base % n, k % n);
        prop_assume!(base != k);
        let spans: Vec<RodLengthRange> = chain.rods()[base.min(k)..base.max(k)].iter().map(RodLengthRange::from_rod).collect();
        let ReachShell { hole_m, reach_m } = ReachShell::from_length_ranges(&spans);
        let u = normalized(toward).unwrap_or(unit_x());
        let target = add_scaled(chain.points()[base], u, hole_m + part * (reach_m - hole_m));
        let goal = ChainIkGoal::new(k, base, target);
        let answer = IkSolver::default().solve(&chain, &Obstacles::default(), &goal).expect("right");
        is_met(&chain, &goal, &answer)?;
        for i in 0..n {
            let is_behind = if k > base { i <= base } else { i >= base };
            prop_assert!(!is_behind || answer.points[i] == chain.points()[i]);
        }
    }

    #[test]
    fn damped_least_squares_finds_the_nearest_posture(
        turns in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 4..12),
        nudge in prop::array::uniform3(-0.05..0.05f64),
    ) {
        let chain = chain_of::<3>(&turns, 0.0);
        let n = turns.len();
        // Straight chains are bowed first.
        let spread = (0..n - 1).filter_map(|i| chain.bend_rad(i + 1)).fold(0.0, f64::max);
        prop_assume!(spread > 1.0);
        // A posture not far away, and the one that is found for its tip.
        let vectors = |points: &[Point<3>]| -> Vec<Point<3>> {
            points.windows(2).map(|p| sub(p[1], p[0])).collect()
        };
        let old = vectors(chain.points());
        let other: Vec<Point<3>> = old
            .iter()
            .enumerate()
            .map(|(i, v)| {
                let shift = if i % 2 == 0 { nudge } else { scaled_by(nudge, -0.3) };
                scaled_by(normalized(add(*v, shift)).expect("not zero"), norm(*v))
            })
            .collect();
        let target = other.iter().fold(chain.points()[0], |at, v| add(at, *v));
        let goal = ChainIkGoal { tolerance_m: 1e-10, engine: IkEngine::Dls, ..ChainIkGoal::new(n, 0, target) };
        let answer = IkSolver::default().solve(&chain, &Obstacles::default(), &goal).expect("right");
        let way = |new: &[Point<3>]| -> f64 {
            new.iter().zip(&old).map(|(a, b)| distance(*a, *b) * distance(*a, *b)).sum()
        };
        prop_assert!(way(&vectors(&answer.points)) <= way(&other) + 1e-7);
    }
}

fn scaled_by(a: Point<3>, k: f64) -> Point<3> {
    sidestep_rods::geometry::scaled(a, k)
}

#[test]
fn one_double_pass_is_one_iteration_of_fabrik() {
    let chain = chain_of::<3>(&[[0.4, 0.3, 0.9], [0.1, -0.8, 0.2], [-0.5, 0.5, 0.4]], 0.0);
    let lengths: Vec<f64> = (0..3).map(|i| chain.length_m(i)).collect();
    let target = [0.4, 0.6, -0.3];
    let mut expected = chain.points().to_vec();
    let base = expected[0];
    // As the paper has it, with r and lambda.
    expected[3] = target;
    for i in (0..3).rev() {
        let lambda = lengths[i] / distance(expected[i + 1], expected[i]);
        expected[i] =
            std::array::from_fn(|k| (1.0 - lambda) * expected[i + 1][k] + lambda * expected[i][k]);
    }
    expected[0] = base;
    for i in 0..3 {
        let lambda = lengths[i] / distance(expected[i + 1], expected[i]);
        expected[i + 1] =
            std::array::from_fn(|k| (1.0 - lambda) * expected[i][k] + lambda * expected[i + 1][k]);
    }
    let mut points = chain.points().to_vec();
    let spans: Vec<RodLengthRange> = chain.rods().iter().map(RodLengthRange::from_rod).collect();
    let after_one = distance(expected[3], target);
    let (passes, left_m) = alternate::solve(&mut points, &spans, target, after_one + 1e-12);
    assert_eq!(passes, 1);
    assert!((left_m - after_one).abs() < 1e-14);
    for (a, b) in points.iter().zip(&expected) {
        assert!(distance(*a, *b) < 1e-14);
    }
}

#[test]
fn straight_and_folded_chains_are_no_trap() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
    let straight =
        Chain::<2>::straight([0.0, 0.0], [1.0, 0.0], 10, rod, Connector::free(0.0)).expect("right");
    let zigzag: Vec<Point<2>> = (0..11).map(|i| [f64::from(i % 2), 0.0]).collect();
    let folded = Chain::new(zigzag, vec![Connector::free(0.0); 11], vec![rod; 10]).expect("right");
    for chain in [&straight, &folded] {
        for x in [-10.0, -7.0, 0.0, 0.5, 3.0, 9.999, 10.0] {
            every_engine_meets(chain, ChainIkGoal::new(10, 0, [x, 0.0])).expect("met");
        }
    }
}

#[test]
fn out_of_reach_is_told_with_the_nearest_point() {
    let chain = chain_of::<3>(&[[1.0, 0.2, 0.3], [0.3, 1.0, 0.5], [0.2, 0.1, 1.0]], 0.0);
    let reach_m: f64 = (0..3).map(|i| chain.length_m(i)).sum();
    let base = chain.points()[0];
    let target = add_scaled(base, [0.0, 1.0, 0.0], reach_m + 0.5);
    let solve = |chain: &Chain<3>, goal: ChainIkGoal<3>| {
        IkSolver::default().solve(chain, &Obstacles::default(), &goal).expect("right")
    };
    let answer = solve(&chain, ChainIkGoal::new(3, 0, target));
    assert!(!answer.reached && (answer.error_m - 0.5).abs() < 1e-6, "{answer:?}");
    assert!(matches!(answer.reason, Some(ChainIkFailure::TooFar { .. })), "{answer:?}");

    let rods = vec![Rod::with_fixed_length(3.0, 0.0), Rod::with_fixed_length(1.0, 0.0)];
    let points = vec![[0.0; 3], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]];
    let long = Chain::new(points, vec![Connector::free(0.0); 3], rods).expect("right");
    let answer = solve(&long, ChainIkGoal::new(2, 0, [0.0, 0.5, 0.0]));
    assert!(!answer.reached && (answer.error_m - 1.5).abs() < 1e-6, "{answer:?}");
    assert!(matches!(answer.reason, Some(ChainIkFailure::TooNear { .. })), "{answer:?}");
    assert!(answer.reason.expect("a reason").to_string().contains("no nearer than 2"));
}

#[test]
fn wrong_goals_are_named() {
    let chain = chain_of::<2>(&[[1.0, 0.0, 0.2]; 3], 0.0);
    let right = ChainIkGoal::new(3, 0, [1.0, 0.0]);
    for (goal, place) in [
        (ChainIkGoal { k: 4, ..right }, "tip"),
        (ChainIkGoal { base: 3, ..right }, "base"),
        (ChainIkGoal { base: 9, ..right }, "base"),
        (ChainIkGoal { target: [f64::NAN, 0.0], ..right }, "target"),
        (ChainIkGoal { target: [1e300, 0.0], ..right }, "target"),
        (ChainIkGoal { tolerance_m: 0.0, ..right }, "tolerance"),
        (ChainIkGoal { tolerance_m: f64::NAN, ..right }, "tolerance"),
    ] {
        let error =
            IkSolver::default().solve(&chain, &Obstacles::default(), &goal).expect_err("wrong");
        assert_eq!(error.place(), place);
    }
    let mut still = chain;
    still.set_connector_failed(3, true);
    assert!(IkSolver::default().solve(&still, &Obstacles::default(), &right).is_err());
}

#[test]
fn a_failed_connector_on_the_way_is_the_base_that_counts() {
    let mut chain = chain_of::<2>(&[[1.0, 0.3, 0.2]; 6], 0.0);
    chain.set_connector_failed(2, true);
    let target = add(chain.points()[2], [0.5, 1.0]);
    let goal = ChainIkGoal::new(6, 0, target);
    let answer = IkSolver::default().solve(&chain, &Obstacles::default(), &goal).expect("right");
    assert!(answer.reached, "{:?}", answer.reason);
    assert_eq!(answer.points[..3], chain.points()[..3]);
}

/// An arm of 8 rods along the first axis, with discs around.
fn scene() -> (Chain<2>, Obstacles<2>, Vec<(Point<2>, f64)>) {
    let rod = Rod::with_fixed_length(1.0, 0.02);
    let mut chain =
        Chain::straight([0.0, 0.0], [1.0, 0.0], 8, rod, Connector::free(0.05)).expect("right");
    chain.set_mobility(0, Mobility::Fixed).expect("right");
    let discs =
        vec![([3.0, 1.5], 1.0), ([-1.0, 3.0], 1.2), ([-3.0, -1.0], 0.8), ([1.5, -2.5], 1.0)];
    let all = (0..).zip(&discs).map(|(id, (c, r))| Obstacle::ball(id, *c, *r)).collect();
    (chain, Obstacles::new(all, 1.1).expect("right"), discs)
}

fn is_clear(points: &[Point<2>], discs: &[(Point<2>, f64)]) -> bool {
    let apart = |p: &[Point<2>], c: Point<2>| distance(c, nearest_on_segment(c, p[0], p[1]));
    points.windows(2).all(|p| discs.iter().all(|(c, r)| apart(p, *c) >= r + 0.02 - 1e-8))
        && points.iter().all(|p| discs.iter().all(|(c, r)| distance(*p, *c) >= r + 0.05 - 1e-8))
}

#[test]
fn arms_among_discs_reach_without_touching_them() {
    let (mut chain, obstacles, discs) = scene();
    for i in 1..8 {
        chain.set_max_bend_rad(i, 1.2).expect("right");
    }
    let mut kinds = Vec::new();
    for target in [[5.0, 4.0], [-4.0, 4.0], [-5.0, -2.0], [0.5, 5.0], [6.0, -3.0]] {
        let goal = ChainIkGoal::new(8, 0, target);
        let solve = || IkSolver::default().solve(&chain, &obstacles, &goal).expect("right");
        let answer = solve();
        is_met(&chain, &goal, &answer).expect("met");
        assert!(is_clear(&answer.points, &discs), "{target:?} {:?}", answer.kind);
        for i in 1..8 {
            let p = &answer.points;
            let bend_rad = angle_between_rad(sub(p[i], p[i - 1]), sub(p[i + 1], p[i]));
            assert!(bend_rad <= 1.2 + 1e-8, "{bend_rad}");
        }
        assert_eq!(answer, solve(), "the same seed gives the same bits");
        kinds.push(answer.kind);
    }
    assert!(
        kinds.contains(&MotionOrPosture::Motion) && kinds.contains(&MotionOrPosture::Posture),
        "{kinds:?}"
    );
}

#[test]
fn what_blocks_the_target_is_named() {
    let (chain, obstacles, _) = scene();
    let goal = ChainIkGoal { restarts: 3, ..ChainIkGoal::new(8, 0, [3.0, 1.5]) };
    let answer = IkSolver::default().solve(&chain, &obstacles, &goal).expect("right");
    assert!(!answer.reached);
    let Some(ChainIkFailure::Blocked { veto }) = answer.reason else { panic!("{answer:?}") };
    assert_eq!((veto.obstacle, veto.from), (Some(0), 8));
    assert!(answer.reason.expect("a reason").to_string().contains("obstacle 0"));

    let mut stiff = chain.clone();
    for i in 1..8 {
        stiff.set_max_bend_rad(i, 0.1).expect("right");
    }
    let goal = ChainIkGoal { restarts: 3, ..ChainIkGoal::new(8, 0, [1.0, -1.0]) };
    let answer = IkSolver::default().solve(&stiff, &Obstacles::default(), &goal).expect("right");
    let Some(ChainIkFailure::Blocked { veto }) = answer.reason else { panic!("{answer:?}") };
    assert_eq!(veto.reason, VetoReason::BendLimit);
}

#[test]
fn whoever_wants_a_motion_gets_no_mere_posture() {
    let (chain, obstacles, _) = scene();
    for target in [[5.0, 4.0], [-4.0, 4.0], [-5.0, -2.0]] {
        let goal = ChainIkGoal { motion_only: true, ..ChainIkGoal::new(8, 0, target) };
        let answer = IkSolver::default().solve(&chain, &obstacles, &goal).expect("right");
        assert_eq!(answer.kind, MotionOrPosture::Motion);
    }
}

#[test]
fn a_chain_that_minds_itself_does_not_cross_itself() {
    let rod = Rod::with_fixed_length(1.0, 0.05);
    let chain =
        Chain::<2>::straight([0.0, 0.0], [1.0, 0.0], 10, rod, Connector::free(0.1)).expect("right");
    let rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    for target in [[0.6, 0.6], [-3.0, 1.0], [2.0, -2.0]] {
        let goal = ChainIkGoal::new(10, 0, target);
        let answer =
            IkSolver::new(rules).solve(&chain, &Obstacles::default(), &goal).expect("right");
        is_met(&chain, &goal, &answer).expect("met");
        let p = &answer.points;
        for i in 0..10 {
            for j in i + 3..10 {
                let apart =
                    sidestep_rods::geometry::between_segments([p[i], p[i + 1]], [p[j], p[j + 1]]);
                assert!(apart.distance_m >= 0.1 - 1e-8, "rods {i} and {j}");
            }
            for j in i + 2..=10 {
                assert!(distance(p[i], p[j]) >= 0.2 - 1e-8, "connectors {i} and {j}");
            }
        }
    }
}
