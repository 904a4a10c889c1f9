use super::*;
use crate::fixtures::{TestRng, clearance_m};
use sidestep_rods::geometry::{distance, normalized, scaled};
use sidestep_rods::{Connector, Mobility, ReactionRules, Rod, TOLERANCE_M, VetoReason};

const DT_S: f64 = 0.02;
const SWARM: Rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };

/// The rules of the slides' own escape.
fn literal(dt_s: f64, speed_max_m_s: f64) -> ObstacleEscapeRules {
    ObstacleEscapeRules {
        method: EscapeMethod::Literal,
        ..ObstacleEscapeRules::new(dt_s, speed_max_m_s)
    }
}

fn swarm<const D: usize>(n_rods: usize) -> Chain<D> {
    let mut start = [0.0; D];
    start[0] = 0.4 * n_rods as f64;
    let back = std::array::from_fn(|i| if i == 0 { -1.0 } else { 0.0 });
    Chain::straight(start, back, n_rods, SWARM, Connector::free(0.25)).unwrap()
}

fn mover<const D: usize>(center: Point<D>, radius_m: f64, velocity_m_s: Point<D>) -> Obstacles<D> {
    let ball = Obstacle { velocity_m_s, ..Obstacle::ball(9, center, radius_m) };
    Obstacles::new(vec![ball], 1.0).unwrap()
}

/// Balls at random, none on the chain along the first axis, that keep their ways.
fn movers<const D: usize>(seed: u64, n: u32, speed_m_s: f64) -> Obstacles<D> {
    let mut numbers = TestRng::new(seed);
    let mut ball = |id| {
        let mut center: Point<D> = numbers.point(5.0);
        center[1] += 1.3_f64.copysign(center[1]);
        let u: Point<D> = normalized(numbers.point(1.0)).unwrap();
        let velocity_m_s = scaled(u, speed_m_s);
        Obstacle { velocity_m_s, ..Obstacle::ball(id, center, numbers.uniform(0.2, 0.5)) }
    };
    Obstacles::new((0..n).map(&mut ball).collect(), 1.0).unwrap()
}

/// One tick of obstacles and escape; checks the laws that hold in any case.
fn tick<const D: usize>(
    chain: &mut Chain<D>,
    obstacles: &mut Obstacles<D>,
    escaper: &mut ObstacleEscaper<D>,
    propagator: &mut Propagator<D>,
) -> EscapeReport<D> {
    let start = chain.points().to_vec();
    obstacles.advance(escaper.rules().dt_s);
    let told = escaper
        .escape(
            ObstacleEscapeInput { chain, obstacles, propagator, start: &start },
            &mut EscapePlan::default(),
        )
        .unwrap();
    for (k, (from, to)) in start.iter().zip(chain.points()).enumerate() {
        assert!(distance(*from, *to) <= escaper.rules().max_step_m() + 1e-12, "connector {k}");
        assert!(from == to || !chain.connectors()[k].is_still());
    }
    assert!(chain.max_rod_violation_m() <= 1e-9);
    let deepest_m = (-clearance_m(chain, obstacles)).max(0.0);
    assert!((told.deepest_m - deepest_m).abs() <= TOLERANCE_M, "{told:?} but {deepest_m}");
    assert_eq!(told.left.is_some(), told.deepest_m > 0.0);
    assert!(told.moves + told.vetoes <= escaper.rules().most);
    told
}

#[test]
fn a_chain_gets_out_of_the_way_of_a_ball_that_crosses_it() {
    fn crosses<const D: usize>(at_x: f64, ticks_ahead: f64) {
        let (mut center, mut velocity_m_s) = ([0.0; D], [0.0; D]);
        (center[0], center[1], velocity_m_s[1]) = (at_x, 2.0, -0.5);
        let (mut chain, mut obstacles) = (swarm::<D>(8), mover(center, 0.4, velocity_m_s));
        let mut escaper =
            ObstacleEscaper::new(ObstacleEscapeRules { ticks_ahead, ..literal(DT_S, 1.5) });
        for _ in 0..600 {
            let told = tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default());
            assert_eq!(told.deepest_m, 0.0, "{told:?}");
        }
    }
    for ticks_ahead in [0.0, 2.0, 20.0] {
        for at_x in [0.0, 0.37, -1.2, 2.9] {
            crosses::<2>(at_x, ticks_ahead);
            crosses::<3>(at_x, ticks_ahead);
        }
    }
}

#[test]
fn among_many_movers_no_connector_is_faster_than_its_limit_and_runs_are_equal() {
    fn run<const D: usize>(limit_m_s: f64, ticks: usize) -> Vec<Point<D>> {
        let (mut chain, mut obstacles) = (swarm::<D>(10), movers(3, 12, 0.8));
        let mut escaper = ObstacleEscaper::new(literal(DT_S, limit_m_s));
        for _ in 0..ticks {
            tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default());
        }
        chain.points().to_vec()
    }
    for limit_m_s in [0.3, 1.0, 3.0] {
        assert_eq!(run::<2>(limit_m_s, 200), run::<2>(limit_m_s, 200));
        // In space every refused push costs a search for another direction.
        assert_eq!(run::<3>(limit_m_s, 80), run::<3>(limit_m_s, 80));
    }
}

#[test]
fn the_limit_counts_what_a_connector_has_moved_before_in_the_tick() {
    let (mut chain, obstacles) = (swarm::<2>(0), mover([0.5, 0.0], 0.4, [-1.0, 0.0]));
    let mut start = chain.points().to_vec();
    start[0][0] += 0.015;
    let mut escaper =
        ObstacleEscaper::new(ObstacleEscapeRules { ticks_ahead: 0.0, ..literal(DT_S, 1.0) });
    escaper
        .escape(
            ObstacleEscapeInput {
                chain: &mut chain,
                obstacles: &obstacles,
                propagator: &mut Propagator::default(),
                start: &start,
            },
            &mut EscapePlan::default(),
        )
        .unwrap();
    assert!((distance(chain.points()[0], start[0]) - 0.02).abs() <= 1e-9);
}

#[test]
fn it_is_told_when_only_the_speed_limit_is_in_the_way() {
    let (mut chain, mut obstacles) = (swarm::<2>(4), mover([0.0, 0.8], 0.4, [0.0, -4.0]));
    let mut escaper =
        ObstacleEscaper::new(ObstacleEscapeRules { ticks_ahead: 0.0, ..literal(DT_S, 0.5) });
    let mut told = Vec::new();
    for _ in 0..6 {
        told.push(tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default()));
    }
    let last = told.last().unwrap();
    assert!(last.deepest_m > 0.1 && last.capped > 0);
    let left = last.left.unwrap();
    assert_eq!((left.obstacle, left.veto.unwrap().reason), (9, VetoReason::StepLimit));
}

#[test]
fn who_never_moves_is_told_and_nothing_changes() {
    let (mut chain, mut obstacles) = (swarm::<2>(2), mover([0.0, 0.7], 0.4, [0.0, -0.5]));
    for k in 0..3 {
        chain.set_connector_failed(k, true);
    }
    let before = chain.clone();
    let mut escaper = ObstacleEscaper::new(literal(DT_S, 1.0));
    let mut told = None;
    for _ in 0..20 {
        told = Some(tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default()));
    }
    assert_eq!(chain, before);
    let left = told.unwrap().left.unwrap();
    assert_eq!(
        (left.part, left.veto.unwrap().reason),
        (ChainPart::Connector(1), VetoReason::Failed)
    );
}

#[test]
fn an_arm_bends_away_and_its_base_keeps_every_bit() {
    for (y, velocity) in [(0.9, -0.3), (-0.9, 0.3)] {
        let rod = Rod::with_fixed_length(0.5, 0.05);
        let points = vec![[0.0, 0.0], [0.4, 0.3], [0.8, 0.0], [1.2, 0.3], [1.6, 0.0]];
        let mut chain = Chain::new(points, vec![Connector::free(0.08); 5], vec![rod; 4]).unwrap();
        chain.set_mobility(0, Mobility::Fixed).unwrap();
        let mut obstacles = mover([1.0, y], 0.2, [0.0, velocity]);
        let mut escaper = ObstacleEscaper::new(literal(DT_S, 1.5));
        for _ in 0..300 {
            let told = tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default());
            assert_eq!(told.deepest_m, 0.0, "{told:?}");
        }
        assert_eq!(chain.points()[0], [0.0, 0.0]);
    }
}

#[test]
fn a_connector_in_the_middle_of_a_mover_leaves_to_the_left_of_its_way() {
    let (mut chain, obstacles) = (swarm::<2>(0), mover([0.0, 0.0], 0.4, [0.0, -0.5]));
    let mut escaper = ObstacleEscaper::new(literal(DT_S, f64::INFINITY));
    let start = chain.points().to_vec();
    let told = escaper
        .escape(
            ObstacleEscapeInput {
                chain: &mut chain,
                obstacles: &obstacles,
                propagator: &mut Propagator::default(),
                start: &start,
            },
            &mut EscapePlan::default(),
        )
        .unwrap();
    assert_eq!(told.deepest_m, 0.0);
    let [x, y] = chain.points()[0];
    assert!(x > 0.65 && y.abs() < 1e-12, "{x} {y}");
}

#[test]
fn who_starts_inside_gets_out_little_by_little() {
    let (mut chain, mut obstacles) = (swarm::<2>(6), mover([0.1, 0.3], 0.4, [0.0, -0.2]));
    let mut escaper = ObstacleEscaper::new(literal(DT_S, 1.0));
    let mut before_m = f64::INFINITY;
    for _ in 0..60 {
        let told = tick(&mut chain, &mut obstacles, &mut escaper, &mut Propagator::default());
        assert!(told.deepest_m <= before_m);
        before_m = told.deepest_m;
    }
    assert_eq!(before_m, 0.0);
}

#[test]
fn with_self_collision_the_chain_does_not_run_into_itself() {
    let mut propagator =
        Propagator::new(ReactionRules { self_collision: true, ..ReactionRules::default() });
    for seed in 1..5 {
        let (mut chain, mut obstacles) = (swarm::<2>(10), movers(seed, 10, 0.5));
        let mut escaper = ObstacleEscaper::new(literal(DT_S, 1.5));
        for _ in 0..400 {
            tick(&mut chain, &mut obstacles, &mut escaper, &mut propagator);
            for (i, a) in chain.points().iter().enumerate() {
                let beyond = chain.points().iter().skip(i + 2);
                assert!(beyond.clone().all(|b| distance(*a, *b) >= 0.5 - 1e-9));
            }
        }
    }
}

#[test]
fn walls_stop_an_escape_and_are_not_passed() {
    let wall = Obstacle::capsule(1, [[-9.0, -0.3], [9.0, -0.3]], 0.0);
    let ball = Obstacle { velocity_m_s: [0.0, -0.3], ..Obstacle::ball(2, [0.1, 1.0], 0.3) };
    let mut obstacles = Obstacles::new(vec![wall, ball], 1.0).unwrap();
    let mut chain = swarm::<2>(2);
    let mut escaper = ObstacleEscaper::new(literal(DT_S, 1.5));
    for _ in 0..300 {
        obstacles.advance(DT_S);
        let start = chain.points().to_vec();
        escaper
            .escape(
                ObstacleEscapeInput {
                    chain: &mut chain,
                    obstacles: &obstacles,
                    propagator: &mut Propagator::default(),
                    start: &start,
                },
                &mut EscapePlan::default(),
            )
            .unwrap();
        assert!(chain.points().iter().all(|p| p[1] >= -0.05 - 1e-9));
    }
}

#[test]
fn where_nothing_moves_nothing_changes() {
    let mut chain = swarm::<2>(4);
    let before = chain.clone();
    let obstacles = Obstacles::new(vec![Obstacle::ball(1, [0.0, 0.2], 0.3)], 1.0).unwrap();
    let start = chain.points().to_vec();
    let told = ObstacleEscaper::new(literal(DT_S, 1.0))
        .escape(
            ObstacleEscapeInput {
                chain: &mut chain,
                obstacles: &obstacles,
                propagator: &mut Propagator::default(),
                start: &start,
            },
            &mut EscapePlan::default(),
        )
        .unwrap();
    assert_eq!((told.moves, told.left, &chain), (0, None, &before));
}

#[test]
fn wrong_numbers_are_named() {
    let mut chain = swarm::<2>(2);
    let start = chain.points().to_vec();
    let mut place = |rules: ObstacleEscapeRules, start: &[Point<2>]| {
        ObstacleEscaper::new(rules)
            .escape(
                ObstacleEscapeInput {
                    chain: &mut chain,
                    obstacles: &Obstacles::default(),
                    propagator: &mut Propagator::default(),
                    start,
                },
                &mut EscapePlan::default(),
            )
            .unwrap_err()
            .place()
            .to_string()
    };
    assert_eq!(place(literal(0.0, 1.0), &start), "escape");
    assert_eq!(place(literal(0.1, f64::NAN), &start), "escape");
    let blind = ObstacleEscapeRules { ticks_ahead: -1.0, ..literal(0.1, 1.0) };
    assert_eq!(place(blind, &start), "escape");
    assert_eq!(place(literal(0.1, 1.0), &start[1..]), "start of the tick");
}
