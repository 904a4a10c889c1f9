use super::*;
use sidestep_rods::geometry::distance;
use sidestep_rods::{Connector, Mobility, Obstacle, ReactionRules, Rod, VetoReason};

const STEP_M: f64 = 0.04;

fn chain() -> Chain<2> {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    Chain::straight([0.0, 0.0], [-1.0, 0.0], 4, rod, Connector::free(0.25)).unwrap()
}

fn wall(id: u32, ends: [[f64; 2]; 2]) -> Obstacle<2> {
    Obstacle::capsule(id, ends, 0.0)
}

/// The walls of a dead end around the leader, so near that it cannot move except back.
fn dead_end() -> Obstacles<2> {
    let walls = vec![
        wall(1, [[0.251, -2.0], [0.251, 2.0]]),
        wall(2, [[-3.0, 0.251], [2.0, 0.251]]),
        wall(3, [[-3.0, -0.251], [2.0, -0.251]]),
    ];
    Obstacles::new(walls, 1.0).unwrap()
}

fn ahead(chain: &Chain<2>, heading_rad: f64) -> MotionRequest<2> {
    let u = [cos(heading_rad), sin(heading_rad)];
    let to = add_scaled(chain.points()[0], u, STEP_M);
    MotionRequest {
        motion: RequestedMotion::Connector { k: 0, to },
        source: RequestSource::Autonomous,
        mode: VetoEffect::Exact,
    }
}

/// Climbs once, wanting to go along the first axis; checks that only motions change the chain.
fn climb(
    ladder: &mut RecoveryLadder,
    chain: &mut Chain<2>,
    obstacles: &Obstacles<2>,
    situation: &InitiatorSituation,
) -> RecoveryOutcome<2> {
    let before = chain.clone();
    let wanted = ahead(chain, 0.0);
    let mut propagator =
        Propagator::new(ReactionRules { self_collision: true, ..ReactionRules::default() });
    let came = ladder
        .move_or_recover(
            &mut DirectMover { chain, obstacles, propagator: &mut propagator },
            &wanted,
            situation,
        )
        .unwrap();
    match &came {
        RecoveryOutcome::Straight(_)
        | RecoveryOutcome::Shorter { .. }
        | RecoveryOutcome::Sideways { .. }
        | RecoveryOutcome::PulledBack { .. } => assert_ne!(*chain, before),
        _ => assert_eq!(*chain, before),
    }
    came
}

#[test]
fn where_nothing_is_in_the_way_it_goes_as_wanted() {
    let came = climb(
        &mut RecoveryLadder::default(),
        &mut chain(),
        &Obstacles::default(),
        &InitiatorSituation::default(),
    );
    assert!(matches!(came, RecoveryOutcome::Straight(_)));
}

#[test]
fn before_a_wall_it_takes_the_longest_part_of_a_step_that_fits() {
    let x = 0.25 + 0.3 * STEP_M;
    let obstacles = Obstacles::new(vec![wall(1, [[x, -9.0], [x, 9.0]])], 1.0).unwrap();
    let came = climb(
        &mut RecoveryLadder::default(),
        &mut chain(),
        &obstacles,
        &InitiatorSituation::default(),
    );
    assert!(matches!(came, RecoveryOutcome::Shorter { part: 0.25, .. }), "{came:?}");
}

#[test]
fn beside_an_obstacle_it_turns_as_little_as_it_can() {
    for (y, expected_rad) in [(0.2, -1.2), (-0.2, 1.2)] {
        let touching_m = norm([0.5, y]) - 0.25 - 1e-4;
        let ball = Obstacle::ball(1, [0.5, y], touching_m);
        let obstacles = Obstacles::new(vec![ball], 1.0).unwrap();
        let came = climb(
            &mut RecoveryLadder::default(),
            &mut chain(),
            &obstacles,
            &InitiatorSituation::default(),
        );
        let RecoveryOutcome::Sideways { turn_rad, plane: 0, .. } = came else { panic!("{came:?}") };
        assert_eq!(turn_rad, expected_rad);
    }
}

#[test]
fn it_goes_on_round_the_side_that_was_good() {
    let memory = |side| RecoveryMemory { side, ..RecoveryMemory::default() };
    let turns = |side| turn_sequence(&memory(side), 1).map(|(_, a)| a).collect::<Vec<_>>();
    assert_eq!(turns(0), [0.4, -0.4, 0.8, -0.8, 1.2, -1.2, 1.6, -1.6, 2.0, -2.0]);
    assert_eq!(turns(-1), [-0.4, -0.8, -1.2, -1.6, -2.0, 0.4, 0.8, 1.2, 1.6, 2.0]);
    let obstacles = Obstacles::new(vec![Obstacle::ball(1, [0.501, 0.0], 0.25)], 1.0).unwrap();
    let mut ladder = RecoveryLadder { memory: memory(-1), ..RecoveryLadder::default() };
    let came = climb(&mut ladder, &mut chain(), &obstacles, &InitiatorSituation::default());
    assert!(
        matches!(came, RecoveryOutcome::Sideways { turn_rad, .. } if turn_rad < 0.0),
        "{came:?}"
    );
}

#[test]
fn a_side_is_forgotten_after_a_straight_run() {
    let memory = RecoveryMemory { side: -1, ..RecoveryMemory::default() };
    let mut ladder = RecoveryLadder { memory, ..RecoveryLadder::default() };
    let mut chain = chain();
    for _ in 0..ladder.rungs.straight {
        assert_eq!(ladder.memory.side, -1);
        climb(&mut ladder, &mut chain, &Obstacles::default(), &InitiatorSituation::default());
    }
    assert_eq!(ladder.memory.side, 0);
}

#[test]
fn in_a_dead_end_it_turns_then_waits_then_is_pulled_back() {
    let mut ladder = RecoveryLadder::new(RecoveryLimits {
        turns: 2,
        waits: 3,
        pull_back: 5,
        ..RecoveryLimits::default()
    });
    let (mut chain, obstacles) = (chain(), dead_end());
    let situation =
        InitiatorSituation { can_turn: true, movers_near: true, ..InitiatorSituation::default() };
    let came: Vec<_> =
        (0..10).map(|_| climb(&mut ladder, &mut chain, &obstacles, &situation)).collect();
    assert!(came[..2].iter().all(|c| *c == RecoveryOutcome::TurnOnTheSpot { side: 1 }), "{came:?}");
    assert_eq!(came[2..5], [1, 2, 3].map(|n| RecoveryOutcome::Waiting { n }));
    assert!(came[5..].iter().all(|c| matches!(c, RecoveryOutcome::PulledBack { by: 4, .. })));
    // The rods give a little, then the leader is dragged out.
    assert!(chain.points()[4][0] < -3.3);
}

#[test]
fn it_does_not_wait_for_what_stands_still() {
    let mut ladder = RecoveryLadder::default();
    let came = climb(&mut ladder, &mut chain(), &dead_end(), &InitiatorSituation::default());
    assert!(matches!(came, RecoveryOutcome::PulledBack { .. }), "{came:?}");
}

#[test]
fn a_chain_that_cannot_move_says_who_objects_to_what() {
    let mut chain = chain();
    chain.set_mobility(4, Mobility::Fixed).unwrap();
    let came = climb(
        &mut RecoveryLadder::default(),
        &mut chain,
        &dead_end(),
        &InitiatorSituation::default(),
    );
    let RecoveryOutcome::Stuck { vetoes } = came else { panic!("{came:?}") };
    assert_eq!((vetoes[0].by, vetoes[0].reason), (0, VetoReason::TargetBlocked));
    let last = vetoes.last().unwrap();
    assert_eq!((last.from, last.by, last.reason), (4, 4, VetoReason::Fixed));
    let objections: Vec<_> = vetoes.iter().map(|v| (v.from, v.by, v.obstacle)).collect();
    assert!((1..objections.len()).all(|k| !objections[..k].contains(&objections[k])));
}

#[test]
fn going_to_and_fro_without_progress_hands_over_and_is_told_in_the_end() {
    // The goal is behind a wide wall with ends: the ladder alone finds no way around it.
    let walls = vec![
        wall(1, [[0.4, -1.0], [0.4, 1.0]]),
        wall(2, [[-4.0, 1.0], [0.4, 1.0]]),
        wall(3, [[-4.0, -1.0], [0.4, -1.0]]),
    ];
    let obstacles = Obstacles::new(walls, 1.0).unwrap();
    let mut ladder =
        RecoveryLadder::new(RecoveryLimits { pull_back: 10, ..RecoveryLimits::default() });
    let mut chain = chain();
    let goal = [3.0, 0.0];
    let (mut pulled, mut stuck) = (0, 0);
    for _ in 0..3000 {
        let at = chain.points()[0];
        let situation = InitiatorSituation {
            goal_distance_m: Some(distance(at, goal)),
            ..InitiatorSituation::default()
        };
        match climb(&mut ladder, &mut chain, &obstacles, &situation) {
            RecoveryOutcome::PulledBack { .. } => pulled += 1,
            RecoveryOutcome::Stuck { .. } => stuck += 1,
            _ => (),
        }
    }
    assert!(pulled >= 30 && stuck >= 1, "{pulled} {stuck}");
}

#[test]
fn a_planner_gets_the_veto() {
    let (mut chain, obstacles) = (chain(), dead_end());
    let before = chain.clone();
    for source in [RequestSource::Planner, RequestSource::Operator] {
        let wanted = MotionRequest { source, ..ahead(&chain, 0.0) };
        let mut ladder = RecoveryLadder::default();
        let came = ladder
            .move_or_recover(
                &mut DirectMover {
                    chain: &mut chain,
                    obstacles: &obstacles,
                    propagator: &mut Propagator::default(),
                },
                &wanted,
                &InitiatorSituation::default(),
            )
            .unwrap();
        assert!(
            matches!(came, RecoveryOutcome::Vetoed(v) if v.reason == VetoReason::TargetBlocked)
        );
        assert_eq!((&chain, &ladder), (&before, &RecoveryLadder::default()));
    }
}

#[test]
fn a_memory_that_was_stored_goes_on_as_the_original() {
    let mut ladder =
        RecoveryLadder::new(RecoveryLimits { turns: 0, pull_back: 7, ..RecoveryLimits::default() });
    let (mut first, obstacles) = (chain(), dead_end());
    let situation =
        InitiatorSituation { goal_distance_m: Some(2.0), ..InitiatorSituation::default() };
    for _ in 0..10 {
        climb(&mut ladder, &mut first, &obstacles, &situation);
    }
    let stored = serde_json::to_string(&ladder.memory).unwrap();
    let memory = serde_json::from_str(&stored).unwrap();
    let mut again = RecoveryLadder { memory, ..ladder.clone() };
    let mut second = first.clone();
    for _ in 0..40 {
        let came = climb(&mut ladder, &mut first, &obstacles, &situation);
        assert_eq!(came, climb(&mut again, &mut second, &obstacles, &situation));
    }
    assert_eq!((first, ladder), (second, again));
}

#[test]
fn in_space_it_turns_towards_the_second_axis_then_the_third() {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    let straight =
        Chain::straight([0.0; 3], [-1.0, 0.0, 0.0], 4, rod, Connector::free(0.25)).unwrap();
    let bar = |id, ends| Obstacle::capsule(id, ends, 0.25);
    let ahead = bar(1, [[0.502, 0.0, -5.0], [0.502, 0.0, 5.0]]);
    let beside = [-0.502, 0.502].map(|y| bar(2, [[-5.0, y, 0.0], [5.0, y, 0.0]]));
    for (obstacles, expected) in [(vec![ahead], 0), (vec![ahead, beside[0], beside[1]], 1)] {
        let obstacles = Obstacles::new(obstacles, 1.0).unwrap();
        let mut chain = straight.clone();
        let wanted = MotionRequest {
            motion: RequestedMotion::Connector { k: 0, to: [STEP_M, 0.0, 0.0] },
            source: RequestSource::Autonomous,
            mode: VetoEffect::Exact,
        };
        let mut propagator = Propagator::default();
        let came = RecoveryLadder::default()
            .move_or_recover(
                &mut DirectMover {
                    chain: &mut chain,
                    obstacles: &obstacles,
                    propagator: &mut propagator,
                },
                &wanted,
                &InitiatorSituation::default(),
            )
            .unwrap();
        let RecoveryOutcome::Sideways { plane, .. } = came else { panic!("{came:?}") };
        let way = chain.points()[0];
        assert_eq!(plane, expected);
        assert!((norm(way) - STEP_M).abs() < 1e-12 && way[plane + 1].abs() > 0.03, "{way:?}");
    }
}
