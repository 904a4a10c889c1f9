//! Whole runs: the leader alone, and with its followers (slides E2, N6).

use super::leader::{TurnMode, WallLossCriterion};
use super::{DifferentialDrive, Laser, Pose2};
use crate::fixtures::convoy::{Convoy, ConvoyConfig, ConvoyStats, ConvoySurroundings};
use crate::fixtures::{TestRng, corridor_line, corridor_walls};
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Obstacle, Obstacles};
use std::f64::consts::PI;

struct Course {
    obstacles: Obstacles<2>,
    target: Option<Point<2>>,
    finish: Point<2>,
    finish_radius_m: f64,
    limit_s: f64,
}

fn corridor(width_m: f64) -> Course {
    let line = corridor_line(0.16);
    Course {
        obstacles: Obstacles::new(corridor_walls(width_m), 1.3).unwrap(),
        target: None,
        finish: line[line.len() - 7].0,
        finish_radius_m: 0.5 * width_m,
        limit_s: 250.0,
    }
}

/// Discs of 0.2 to 0.5 m in 20 m x 20 m, away from start and target in opposite corners.
fn field(seed: u64, discs: usize) -> Course {
    let mut numbers = TestRng::new(seed);
    let mut all = Vec::new();
    while all.len() < discs {
        let (at, radius_m) = (numbers.point(10.0), numbers.uniform(0.2, 0.5));
        if distance(at, [-8.5, -8.5]).min(distance(at, [8.5, 8.5])) > radius_m + 1.5 {
            all.push(Obstacle::ball(all.len() as u32, at, radius_m));
        }
    }
    Course {
        obstacles: Obstacles::new(all, 1.3).unwrap(),
        target: Some([8.5, 8.5]),
        finish: [8.5, 8.5],
        finish_radius_m: 0.5,
        limit_s: 300.0,
    }
}

struct Run {
    arrived: bool,
    measures: ConvoyStats,
    convoy: Convoy,
}

fn run(plan: ConvoyConfig, start: Pose2, course: &Course, seed: u64) -> Run {
    let dt_s = plan.dt_s;
    let (obstacles, target) = (course.obstacles.clone(), course.target);
    let mut convoy =
        Convoy::new(plan, start, ConvoySurroundings { obstacles, target, seed }).unwrap();
    let mut measures = ConvoyStats::default();
    let mut arrived = false;
    for _ in 0..(course.limit_s / dt_s) as u64 {
        let tick = convoy.advance_tick();
        measures.record(&convoy, &course.obstacles, &tick);
        assert!(convoy.chain().max_rod_violation_m() <= 1e-9);
        arrived = distance(convoy.leader_pose().at, course.finish) <= course.finish_radius_m;
        if arrived {
            break;
        }
    }
    Run { arrived, measures, convoy }
}

fn at(x_m: f64, y_m: f64) -> Pose2 {
    Pose2 { at: [x_m, y_m], heading_rad: 0.0 }
}

fn alone() -> ConvoyConfig {
    ConvoyConfig::new(0, 0.5).unwrap()
}

#[test]
fn a_leader_passes_the_pinned_corridor_and_touches_nothing() {
    for width_m in [1.2, 1.6, 2.0, 2.5, 3.0] {
        let Run { arrived, measures, .. } = run(alone(), at(2.0, 0.0), &corridor(width_m), 1);
        assert!(arrived && measures.vetoes == 0, "{width_m}: {measures:?}");
        assert!(measures.leader_clearance_m > 0.24, "{width_m}: {measures:?}");
    }
}

#[test]
fn in_a_corridor_as_wide_as_its_band_a_leader_hardly_slows_down() {
    for leaving in [WallLossCriterion::Latched, WallLossCriterion::Range, WallLossCriterion::Level]
    {
        let mut plan = alone();
        plan.leader.leaving = leaving;
        let Run { arrived, measures, .. } = run(plan, at(2.0, 0.0), &corridor(1.6), 1);
        let mean_m_s = measures.way_m / (measures.ticks as f64 * 0.02);
        assert!(arrived && mean_m_s > 0.45, "{leaving:?}: {mean_m_s} m/s");
    }
}

#[test]
fn a_leader_with_a_nearer_band_passes_where_it_can_hardly_turn() {
    for (width_m, near_m, far_m) in [(1.0, 0.7, 0.9), (0.8, 0.45, 0.65)] {
        let mut plan = alone();
        (plan.leader.near_m, plan.leader.far_m) = (near_m, far_m);
        plan.leader.turning = TurnMode::OnTheSpotWhereBlocked;
        let Run { arrived, measures, .. } = run(plan, at(2.0, 0.0), &corridor(width_m), 1);
        assert!(arrived && measures.leader_clearance_m > 0.0, "{width_m}: {measures:?}");
    }
}

#[test]
fn a_leader_turns_back_in_a_dead_end() {
    for width_m in [1.4, 1.8, 2.2] {
        let half_m = 0.5 * width_m;
        let walls = [
            [[0.0, half_m], [10.0, half_m]],
            [[0.0, -half_m], [10.0, -half_m]],
            [[10.0, -half_m], [10.0, half_m]],
        ];
        let walls = walls.iter().map(|&ends| Obstacle::capsule(0, ends, 0.0)).collect();
        let course = Course {
            obstacles: Obstacles::new(walls, 1.0).unwrap(),
            target: None,
            finish: [0.5, 0.0],
            finish_radius_m: half_m,
            limit_s: 90.0,
        };
        let Run { arrived, measures, .. } = run(alone(), at(2.0, 0.0), &course, 1);
        assert!(arrived && measures.leader_clearance_m > 0.0, "{width_m}: {measures:?}");
    }
}

#[test]
fn a_leader_reaches_its_target_among_25_discs_thirty_times_of_thirty() {
    for seed in 0..30 {
        let start = Pose2 { at: [-8.5, -8.5], heading_rad: TestRng::new(seed).uniform(-PI, PI) };
        let Run { arrived, measures, .. } = run(alone(), start, &field(seed, 25), 1);
        assert!(arrived && measures.leader_clearance_m > 0.0, "{seed}: {measures:?}");
    }
}

#[test]
fn a_leader_that_takes_leaving_literally_turns_for_ever_in_the_open() {
    let mut plan = alone();
    (plan.leader.leaving, plan.leader.leave_rule) = (WallLossCriterion::Level, None);
    let course = Course { limit_s: 60.0, ..field(0, 0) };
    let Run { arrived, measures, .. } = run(plan, at(-8.5, -8.5), &course, 1);
    assert!(!arrived && measures.layers == [0, 0, 0, measures.ticks, 0, 0]);
}

#[test]
fn fifteen_followers_pass_the_corridor_and_no_bumper_is_pressed() {
    for width_m in [1.2, 2.0, 3.0] {
        let plan = ConvoyConfig::new(15, 0.5).unwrap();
        let Run { arrived, measures, .. } = run(plan, at(12.3, 0.0), &corridor(width_m), 1);
        assert!(arrived && measures.vetoes == 0, "{width_m}: {measures:?}");
        assert!(measures.connector_clearance_m >= -1e-9, "{width_m}: {measures:?}");
        assert_eq!((measures.bumped, measures.held), (0, 0), "{width_m}");
        assert!(measures.follower_clearance_m > 0.04, "{width_m}: {measures:?}");
        assert!(measures.max_lag_m < 0.15, "{width_m}: {measures:?}");
        assert!(measures.pairs_m[0] > 0.6 && measures.pairs_m[1] < 1.0, "{width_m}: {measures:?}");
    }
}

/// In 3 m the inner wall of a bend has a radius of 0.1 m, around which connectors are pulled three
/// times as fast as the leader goes.
#[test]
fn a_leader_waits_for_late_followers_and_would_lose_them_otherwise() {
    let mut cared = ConvoyConfig::new(15, 0.5).unwrap();
    cared.follower.slide_m = 0.0;
    let careless = ConvoyConfig { lag_limit_m: f64::INFINITY, ..cared.clone() };
    let [cared, careless] =
        [cared, careless].map(|plan| run(plan, at(12.3, 0.0), &corridor(3.0), 1).measures);
    assert!(cared.fastest > 2.0 && cared.slowed > 0 && cared.bumped == 0, "{cared:?}");
    assert!(careless.slowed == 0 && careless.bumped > 0, "{careless:?}");
    assert!((cared.ticks as f64) < 1.05 * careless.ticks as f64, "it hardly takes longer");
}

#[test]
fn wheels_as_fast_as_the_leaders_are_enough_for_a_leader_that_waits() {
    let mut plan = ConvoyConfig::new(15, 0.5).unwrap();
    plan.follower.drive = DifferentialDrive::new(0.4, 0.5).unwrap();
    let Run { arrived, measures, .. } = run(plan, at(12.3, 0.0), &corridor(2.5), 1);
    assert!(arrived && measures.bumped == 0 && measures.max_lag_m < 0.15, "{measures:?}");
}

#[test]
fn followers_that_only_stop_hang_on_walls_that_they_shall_graze() {
    let mut plan = ConvoyConfig {
        margin_m: 0.0,
        lag_limit_m: f64::INFINITY,
        ..ConvoyConfig::new(15, 0.5).unwrap()
    };
    plan.follower.slide_m = 0.0;
    let Run { measures, .. } = run(plan, at(12.3, 0.0), &corridor(2.0), 1);
    assert!(measures.bumped > measures.ticks, "{measures:?}");
    // They stand there, and do not go through.
    assert!(measures.follower_clearance_m > -1e-3, "{measures:?}");
}

#[test]
fn followers_that_slide_graze_walls_and_arrive() {
    for width_m in [1.2, 2.0, 2.5] {
        let plan = ConvoyConfig { margin_m: 0.0, ..ConvoyConfig::new(15, 0.5).unwrap() };
        let Run { arrived, measures, .. } = run(plan, at(12.3, 0.0), &corridor(width_m), 1);
        assert!(arrived && measures.max_lag_m < 0.15, "{width_m}: {measures:?}");
        assert!(
            measures.bumped == 0 && measures.follower_clearance_m > 0.0,
            "{width_m}: {measures:?}"
        );
    }
}

#[test]
fn a_laser_that_errs_by_two_centimeters_finds_the_way_too() {
    let mut plan = ConvoyConfig::new(5, 0.5).unwrap();
    plan.leader.laser = Laser::new(180, 3.2, PI, 0.02).unwrap();
    let Run { arrived, measures, .. } = run(plan, at(6.0, 0.0), &corridor(1.6), 7);
    assert!(arrived && measures.bumped == 0, "{measures:?}");
    assert!(measures.leader_clearance_m > 0.3, "{measures:?}");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
    let end = |seed| {
        let mut plan = ConvoyConfig::new(3, 0.5).unwrap();
        plan.leader.laser = Laser::new(180, 3.2, PI, 0.02).unwrap();
        let course = Course { limit_s: 20.0, ..corridor(1.6) };
        let convoy = run(plan, at(6.0, 0.0), &course, seed).convoy;
        convoy.followers().iter().map(|f| f.at.map(f64::to_bits)).collect::<Vec<_>>()
    };
    assert_eq!(end(3), end(3));
    assert_ne!(end(3), end(4));
}

#[test]
fn a_leader_that_is_blocked_stands_or_turns_on_the_spot() {
    // A box that leaves no room to swing around.
    let corners = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]];
    let walls = sidestep_rods::outline_walls(0, &corners, 0.0);
    let course = Course {
        obstacles: Obstacles::new(walls, 1.0).unwrap(),
        target: None,
        finish: [9.0, 0.0],
        finish_radius_m: 0.1,
        limit_s: 10.0,
    };
    for (turning, turns) in
        [(TurnMode::AboutAWheel, false), (TurnMode::OnTheSpotWhereBlocked, true)]
    {
        let mut plan = alone();
        plan.leader.turning = turning;
        let Run { measures, convoy, .. } = run(plan, at(0.0, 0.0), &course, 1);
        assert!(measures.leader_clearance_m >= -1e-9 && measures.vetoes > 100);
        let pose = convoy.leader_pose();
        assert!(pose.at[0].abs() <= 0.05 + 1e-6 && pose.at[1].abs() <= 0.05 + 1e-6);
        assert_eq!(measures.vetoes < measures.ticks - 50, turns, "{measures:?}");
    }
}
