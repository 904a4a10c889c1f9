use super::DriveVelocity;
use super::beacon::DriveBeacon;
use super::controller::{DriveLimits, DriveState};
use super::driver::{DriveGoalRefusal, DrivenAction, Driver};
use super::grid::{BodyGrid, GridLocalizer, Pose2};
use super::guard::{Guard, GuardCause, GuardLimits, GuardView};
use super::neighbors::Neighbors;
use super::percept::{PerceptBuilder, RobotSituation};
use super::plan_executor::PlanExecutor;
use super::scan::RangeScan;
use crate::agents::RobotPercept;
use crate::effector::FORWARD;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::world::RobotsWorld;
use crate::{RobotsRun, robots_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::math::{cos, hypot, sin, wrap_angle};
use sidestep_planners::GridPose;
use sidestep_scenario::Source;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const HALL: &str = "\
....................
....................
....##.....#........
....##.....#........
...........#....###.
................###.
....................
..####..............
....................
....................";

fn scenario(robots: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nseed = 5\ncycles = 1000\nregime = \"reliable\"\n\
         [map]\nbox_size_m = 0.5\nascii = \"\"\"\n{HALL}\n\"\"\"\n{robots}"
    )
}

fn run(text: &str) -> RobotsRun {
    robots_run(&Source::new("s.toml", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

fn world(text: &str) -> Arc<RobotsWorld> {
    run(text).world().clone()
}

/// Returns the distance at which a ray meets a disc.
fn disc_hit(from: [f64; 2], yaw_rad: f64, center: [f64; 2], radius_m: f64) -> Option<f64> {
    let [dx, dy] = [center[0] - from[0], center[1] - from[1]];
    let along = dx * cos(yaw_rad) + dy * sin(yaw_rad);
    let off = dx * sin(yaw_rad) - dy * cos(yaw_rad);
    let half = radius_m * radius_m - off * off;
    (half > 0.0 && along > 0.0).then(|| along - half.sqrt())
}

/// Returns the distance at which a ray meets a square that is smaller by a hair than its box, so that rays through corners
/// go on.
fn square_hit(from: [f64; 2], yaw_rad: f64, low: [f64; 2], side_m: f64) -> Option<f64> {
    const HAIR_M: f64 = 1e-7;
    let mut enter = 0.0_f64;
    let mut leave = f64::INFINITY;
    for (k, component) in [cos(yaw_rad), sin(yaw_rad)].into_iter().enumerate() {
        let ends = [low[k] + HAIR_M, low[k] + side_m - HAIR_M];
        if component.abs() < 1e-12 {
            if !(ends[0]..=ends[1]).contains(&from[k]) {
                return None;
            }
            continue;
        }
        let [a, b] = ends.map(|end| (end - from[k]) / component);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some(enter)
}

/// Returns the squares of the map's walls, and of a wall around it: lower-left corners, in meters.
fn wall_squares(world: &RobotsWorld) -> Vec<[f64; 2]> {
    let grid = BodyGrid::new(world, 0).expect("a robot");
    let side_m = grid.box_m();
    let mut squares = Vec::new();
    for col in -1..=i64::from(world.map.width()) {
        for row in -1..=i64::from(world.map.height()) {
            if !grid.is_free_box(col, row) {
                squares.push([col as f64 * side_m, row as f64 * side_m]);
            }
        }
    }
    squares
}

/// Rays of an exact scan: one for each beam of the presets.
const EXACT_RAYS: usize = 720;
/// Rays of a scan where robots move.
const RAYS: usize = 120;

fn scan_by(rays: usize, hit_m: impl Fn(f64) -> f64) -> RangeScan {
    let step_rad = TAU / rays as f64;
    let ranges_m = (0..rays).map(|k| hit_m(-PI + k as f64 * step_rad) as f32).collect();
    RangeScan { first_rad: -PI, step_rad, ranges_m, max_m: 12.0, ..RangeScan::default() }
}

/// Returns what an exact scanner sees that is in the middle of a robot of a run.
fn exact_scan(
    world: &RobotsWorld,
    pose: &Pose2,
    own: usize,
    percepts: &[RobotPercept],
) -> RangeScan {
    let side_m = world.map.box_size_m;
    let mut squares = wall_squares(world);
    for percept in percepts.iter().filter(|percept| percept.id as usize != own) {
        let size = world.type_of(percept.id).size;
        for (dx, dy) in (0..size.0).flat_map(|dx| (0..size.1).map(move |dy| (dx, dy))) {
            let corner = [percept.at.0 + dx, percept.at.1 + dy];
            squares.push(corner.map(|boxes| f64::from(boxes) * side_m));
        }
    }
    scan_by(EXACT_RAYS, |bearing_rad| {
        let yaw_rad = pose.yaw_rad + bearing_rad;
        let hits = squares.iter().filter_map(|low| square_hit(pose.at_m, yaw_rad, *low, side_m));
        hits.fold(f64::INFINITY, f64::min)
    })
}

#[test]
fn a_percept_by_an_exact_scan_is_that_of_the_simulator() {
    let mut run = run(&scenario(
        "[[robots]]\ncount = 4\nsensors = [\"sonar-8\", \"bumper-4\"]\neffector = \"nomad\"\n\
         behaviour = { kind = \"wander\" }\n\
         [[robots]]\ncount = 2\nsize = 3\nsensors = [\"sonar-ring\", \"camera\"]\n\
         behaviour = { kind = \"wander\" }\n",
    ));
    let world = run.world().clone();
    let mut near_robots = 0;
    for cycle in 0..60 {
        let percepts = run.world().percepts_in_cycle(run.state(), cycle);
        assert_eq!(percepts.len(), 6);
        for percept in &percepts {
            let grid = BodyGrid::new(&world, percept.id).expect("a robot");
            let at = GridPose { col: percept.at.0, row: percept.at.1, heading: percept.heading };
            let pose = grid.center(at);
            let scan = exact_scan(&world, &pose, percept.id as usize, &percepts);
            let builder = PerceptBuilder::new(&world, percept.id).expect("a robot");
            assert_eq!(builder.blind_beams(&scan), 0);
            let mut localizer = GridLocalizer::new(grid);
            let situation = RobotSituation {
                cycle,
                at: localizer.update(&pose).expect("on the map"),
                pose,
                contact: percept.contact,
                memory: percept.memory,
            };
            assert_eq!(builder.percept(&situation, &scan), *percept, "cycle {cycle}");
            near_robots += percept.readings.iter().filter(|seen| seen.observation == 4).count();
        }
        run.advance(1);
    }
    assert!(near_robots > 50, "robots see each other: {near_robots}");
}

#[test]
fn boxes_and_heading_stay_while_noise_is_less_than_its_margin() {
    let world = world(&scenario("[[robots]]\nat = [[3, 8, 1]]\n"));
    let grid = BodyGrid::new(&world, 0).expect("a robot");
    let at = GridPose { col: 3, row: 8, heading: 1 };
    let center = grid.center(at);
    let mut localizer = GridLocalizer::new(grid);
    let near = |dx_m: f64, yaw_rad: f64| Pose2 {
        at_m: [center.at_m[0] + dx_m, center.at_m[1]],
        yaw_rad: center.yaw_rad + yaw_rad,
    };
    for (dx_m, yaw_rad) in [(0.0, 0.0), (0.29, 0.0), (-0.29, 0.9), (0.24, -0.9)] {
        assert_eq!(localizer.update(&near(dx_m, yaw_rad)), Some(at));
    }
    assert_eq!(localizer.update(&near(0.31, 0.0)), Some(GridPose { col: 4, ..at }));
    assert_eq!(localizer.update(&near(0.21, 0.0)), Some(GridPose { col: 4, ..at }));
    assert_eq!(localizer.update(&near(-3.0, 0.0)), None, "off the map");
}

#[test]
fn poses_in_frames_come_back() {
    let outer = Pose2 { at_m: [1.0, -2.0], yaw_rad: 2.0 };
    let inner = Pose2 { at_m: [0.5, 0.25], yaw_rad: -2.5 };
    let back = outer.inverse().compose(&outer.compose(&inner));
    assert!((0..2).all(|k| (back.at_m[k] - inner.at_m[k]).abs() < 1e-12));
    assert!(wrap_angle(back.yaw_rad - inner.yaw_rad).abs() < 1e-12);
}

const LIMITS: DriveLimits = DriveLimits {
    max_mps: 0.4,
    max_radps: 1.2,
    max_mps2: 0.8,
    tolerance_m: 0.03,
    tolerance_rad: 0.05,
    stall_s: 1.0,
    cycle_s: 0.5,
    action_timeout_s: 30.0,
};

const RADIUS_M: f64 = 0.2;

const GUARD: GuardLimits = GuardLimits {
    max_mps: 0.4,
    max_radps: 1.2,
    braking_mps2: 0.8,
    radius_m: RADIUS_M,
    clearance_m: 0.02,
    patience_s: 0.5,
};

/// Numbers from -1 to 1, the same in each test.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        // Knuth's linear congruential generator (MMIX); its upper bits are even enough.
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A robot with two wheels that slip.
struct Plant {
    driver: Driver,
    pose: Pose2,
    velocity: DriveVelocity,
    ended: Vec<DrivenAction>,
}

/// A floor with such robots.
struct Floor {
    squares: Vec<[f64; 2]>,
    side_m: f64,
    /// Discs that the map does not have.
    discs: Vec<[f64; 2]>,
    plants: Vec<Plant>,
    noise: Noise,
    time_s: f64,
    is_blind: bool,
    has_bumpers: bool,
    /// Times that a robot was held up by something that it touched.
    touches: u64,
}

const STEP_S: f64 = 0.05;

impl Floor {
    fn new(text: &str) -> Self {
        let run = run(text);
        let world = run.world().clone();
        let mut drivers = Vec::new();
        for percept in run.world().percepts_in_cycle(run.state(), 0) {
            let grid = BodyGrid::new(&world, percept.id).expect("a robot");
            let at = GridPose { col: percept.at.0, row: percept.at.1, heading: percept.heading };
            let driver = Driver::new(&world, percept.id, LIMITS, GUARD).expect("it can drive");
            drivers.push((driver, grid.center(at)));
        }
        Self::of_plants(&world, drivers)
    }

    fn of_plants(world: &RobotsWorld, drivers: Vec<(Driver, Pose2)>) -> Self {
        let velocity = DriveVelocity::ZERO;
        let plants = drivers.into_iter();
        let plants =
            plants.map(|(driver, pose)| Plant { driver, pose, velocity, ended: Vec::new() });
        Self {
            squares: wall_squares(world),
            side_m: world.map.box_size_m,
            discs: Vec::new(),
            plants: plants.collect(),
            noise: Noise(7),
            time_s: 0.0,
            is_blind: false,
            has_bumpers: true,
            touches: 0,
        }
    }

    fn discs_but(&self, own: usize) -> Vec<[f64; 2]> {
        let others = self.plants.iter().enumerate().filter(|(k, _)| *k != own);
        self.discs.iter().copied().chain(others.map(|(_, plant)| plant.pose.at_m)).collect()
    }

    fn touches_something(&self, own: usize, at_m: [f64; 2]) -> bool {
        let is_near =
            |disc: &[f64; 2]| hypot(disc[0] - at_m[0], disc[1] - at_m[1]) < 2.0 * RADIUS_M;
        let is_in_wall = |low: &[f64; 2]| {
            let off = [0, 1].map(|k| at_m[k] - at_m[k].clamp(low[k], low[k] + self.side_m));
            hypot(off[0], off[1]) < RADIUS_M
        };
        self.discs_but(own).iter().any(is_near) || self.squares.iter().any(is_in_wall)
    }

    fn scan(&mut self, own: usize) -> RangeScan {
        let pose = self.plants[own].pose;
        let discs = self.discs_but(own);
        let mut scan = scan_by(RAYS, |bearing_rad| {
            let yaw_rad = pose.yaw_rad + bearing_rad;
            let walls = self
                .squares
                .iter()
                .filter_map(|low| square_hit(pose.at_m, yaw_rad, *low, self.side_m));
            let others = discs.iter().filter_map(|at| disc_hit(pose.at_m, yaw_rad, *at, RADIUS_M));
            walls.chain(others).fold(f64::INFINITY, f64::min)
        });
        for range_m in &mut scan.ranges_m {
            *range_m = if self.is_blind {
                f32::INFINITY
            } else {
                *range_m + 0.02 * self.noise.next() as f32
            };
        }
        scan
    }

    /// Lets a time pass.
    fn advance(&mut self, steps: usize) {
        for _ in 0..steps {
            self.time_s += STEP_S;
            for own in 0..self.plants.len() {
                self.move_plant(own);
                self.drive(own);
            }
        }
    }

    fn drive(&mut self, own: usize) {
        let scan = self.scan(own);
        let noise = [0.01, 0.01, 0.01].map(|size| size * self.noise.next());
        let plant = &self.plants[own];
        let at_m = [plant.pose.at_m[0] + noise[0], plant.pose.at_m[1] + noise[1]];
        let pose = Pose2 { at_m, yaw_rad: wrap_angle(plant.pose.yaw_rad + noise[2]) };
        let ahead = plant.pose.transform_point([0.01, 0.0]);
        let is_touching = self.has_bumpers && self.touches_something(own, ahead);
        let state = DriveState { time_s: self.time_s, pose, is_touching };
        let plant = &mut self.plants[own];
        let step = plant.driver.step(&state, &scan, 0.0).expect("a percept");
        plant.velocity = step.velocity;
        plant.ended.extend(step.ended);
    }

    /// Moves a robot: a tenth of each command is lost, more or less.
    fn move_plant(&mut self, own: usize) {
        let slip = [0, 1].map(|_| 0.9 + 0.1 * self.noise.next());
        let plant = &self.plants[own];
        let ahead_m = plant.velocity.forward_mps * slip[0] * STEP_S;
        let turn_rad = plant.velocity.turn_radps * slip[1] * STEP_S;
        let mut pose = plant.pose.compose(&Pose2 { at_m: [ahead_m, 0.0], yaw_rad: turn_rad });
        if self.touches_something(own, pose.at_m) {
            self.touches += 1;
            pose.at_m = self.plants[own].pose.at_m;
        }
        self.plants[own].pose = pose;
    }
}

#[test]
fn a_robot_with_wheels_that_slip_and_noise_arrives_box_by_box_and_touches_nothing() {
    let mut floor = Floor::new(&scenario(
        "[[robots]]\nat = [[0, 0, 1]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
         behaviour = { kind = \"goto\", goals = [[18, 8], [1, 1]], repeat = true }\n",
    ));
    let mut steps = 0;
    while floor.plants[0].driver.counts().trips < 2 {
        floor.advance(1);
        steps += 1;
        assert!(steps < 12_000, "10 minutes: {:?}", floor.plants[0].driver.counts());
    }
    assert_eq!(floor.touches, 0);
    let ended = &floor.plants[0].ended;
    assert!(ended.len() > 50, "{}", ended.len());
    for driven in ended.iter().filter(|driven| driven.action == FORWARD) {
        assert_eq!(driven.contact, None, "{driven:?}");
        assert_eq!((driven.motion.ahead, driven.motion.left, driven.motion.turn_deg), (1, 0, 0));
    }
}

#[test]
fn robots_that_wander_among_each_other_never_touch() {
    let mut floor = Floor::new(&scenario(
        "[[robots]]\nat = [[0, 0, 1], [4, 1, 0], [8, 8, 2], [10, 0, 3], [18, 9, 2]]\n\
         sensors = [\"sonar-8\"]\neffector = \"nomad\"\nbehaviour = { kind = \"wander\", turn_every = 6 }\n",
    ));
    floor.advance(2400);
    assert_eq!(floor.touches, 0, "two minutes");
    for plant in &floor.plants {
        let moved = plant.ended.iter().filter(|driven| driven.motion.ahead == 1).count();
        assert!(moved > 12, "{moved} {:?}", plant.driver.counts());
    }
}

/// A robot that goes ahead, and a thing on its way that the map does not have.
fn against_a_thing() -> Floor {
    let mut floor = Floor::new(&scenario(
        "[[robots]]\nat = [[2, 0, 0]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
         behaviour = { kind = \"replay\", actions = [\"forward\"] }\n",
    ));
    floor.discs.push([2.05, 0.25]);
    floor
}

fn first_action(floor: &mut Floor) -> DrivenAction {
    for _ in 0..600 {
        floor.advance(1);
        if let Some(driven) = floor.plants[0].ended.first() {
            return driven.clone();
        }
    }
    panic!("half a minute");
}

#[test]
fn a_contact_is_found_by_scan_bumper_or_stall_and_the_robot_goes_back() {
    for (is_blind, has_bumpers) in [(false, true), (true, true), (true, false)] {
        let mut floor = against_a_thing();
        floor.is_blind = is_blind;
        floor.has_bumpers = has_bumpers;
        let driven = first_action(&mut floor);
        let contact = driven.contact.expect("a contact");
        assert_eq!(usize::from(contact.kind), 2.max(usize::from(contact.kind)), "no wall");
        assert_eq!((driven.motion.ahead, driven.motion.turn_deg), (0, 0));
        let at_m = floor.plants[0].pose.at_m;
        assert!(hypot(at_m[0] - 1.25, at_m[1] - 0.25) < 0.08, "{at_m:?}");
        let has_noticed = !is_blind || has_bumpers;
        assert_eq!(floor.touches == 0, has_noticed, "only one that notices nothing is held up");
    }
}

#[test]
fn a_wall_of_the_map_is_a_contact_without_a_motion() {
    let mut floor = Floor::new(&scenario(
        "[[robots]]\nat = [[0, 0, 2]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
         behaviour = { kind = \"replay\", actions = [\"forward\"] }\n",
    ));
    let driven = first_action(&mut floor);
    assert_eq!(driven.contact.map(|contact| contact.kind), Some(crate::sensor::WALL));
    assert_eq!(floor.plants[0].pose.at_m, [0.25, 0.25]);
}

#[test]
fn the_guard_stops_without_fresh_measurements_and_off_the_map_and_bounds_speeds() {
    let world = world(&scenario("[[robots]]\nat = [[3, 8, 1]]\n"));
    let mut guard = Guard::new(GUARD, BodyGrid::new(&world, 0).expect("a robot"));
    let free = scan_by(RAYS, |_| f64::INFINITY);
    let pose = Pose2 { at_m: [1.75, 4.25], yaw_rad: 0.0 };
    let outside = Pose2 { at_m: [-0.1, 4.25], yaw_rad: 0.0 };
    let view = |pose, age_s| GuardView { pose: Some(pose), scan: Some(&free), age_s };
    let fast = DriveVelocity { forward_mps: 9.0, turn_radps: -9.0 };
    let bounded = DriveVelocity { forward_mps: 0.4, turn_radps: -1.2 };
    assert_eq!(guard.limit(fast, &view(&pose, 0.5)), bounded);
    assert_eq!(guard.limit(fast, &view(&pose, 0.51)), DriveVelocity::ZERO);
    assert_eq!(guard.limit(fast, &view(&pose, 2.0)), DriveVelocity::ZERO);
    assert_eq!((guard.cause(), guard.counts().old_states), (Some(GuardCause::OldState), 1));
    assert_eq!(guard.limit(fast, &view(&pose, 0.0)), bounded, "fresh again");
    assert_eq!(guard.limit(fast, &view(&outside, 0.0)), DriveVelocity::ZERO);
    let no_number = DriveVelocity { forward_mps: f64::NAN, turn_radps: 0.0 };
    assert_eq!(guard.limit(no_number, &view(&pose, 0.0)), DriveVelocity::ZERO);
    let near =
        scan_by(RAYS, |bearing_rad| if bearing_rad.abs() < 0.1 { 0.25 } else { f64::INFINITY });
    let view = GuardView { pose: Some(&pose), scan: Some(&near), age_s: 0.0 };
    assert_eq!(guard.limit(fast, &view).forward_mps, 0.0, "5 cm before it, and it needs more");
    assert_eq!(guard.limit(DriveVelocity { forward_mps: -9.0, ..fast }, &view).forward_mps, -0.4);
    let counts = guard.counts();
    assert_eq!((counts.off_map, counts.obstacles), (1, 1));
}

#[test]
fn robots_that_are_not_there_are_led_or_go_sideways_are_refused() {
    let refused = |text: &str, id| {
        let (cause, remedy) =
            Driver::new(&world(text), id, LIMITS, GUARD).expect_err("it is refused");
        assert!(!remedy.is_empty());
        cause
    };
    let one = "[[robots]]\nat = [[3, 8, 1]]\n";
    assert!(refused(&scenario(one), 7).contains("no robot 7"));
    let led = scenario(
        "[[robots]]\nat = [[3, 8, 1]]\nbehaviour = { kind = \"goto\", goals = [[0, 0]] }\n\
         planner = { method = \"pibt\" }\n",
    );
    assert!(refused(&led, 0).contains("planner"));
    let sideways = scenario(
        "[effectors.crab]\nforward = [{ p = 1.0, path = \"F\" }]\nleft = [{ p = 1.0, turn = 90 }]\n\
         right = [{ p = 1.0, turn = -90 }]\nslide = [{ p = 1.0, path = \"L\" }]\n\
         [[robots]]\nat = [[3, 8, 1]]\neffector = \"crab\"\n",
    );
    assert!(refused(&sideways, 0).contains("sideways"));
}

#[test]
fn a_robot_under_orders_is_driven_to_goals_from_outside_and_stands_without_one() {
    let text = scenario("[[robots]]\nat = [[2, 1, 0]]\nbehaviour = { kind = \"external\" }\n");
    let world = world(&text);
    let grid = BodyGrid::new(&world, 0).expect("a robot");
    let mut driver = Driver::new(&world, 0, LIMITS, GUARD).expect("it can drive");
    assert!(driver.takes_goals());
    let goal = Pose2 { at_m: [2.3, 0.8], yaw_rad: PI / 2.0 };
    assert_eq!(driver.set_goal(&goal), Err(DriveGoalRefusal::NoPlace));
    let pose = grid.center(GridPose { col: 2, row: 1, heading: 0 });
    let mut floor = Floor::of_plants(&world, vec![(driver, pose)]);
    floor.advance(100);
    assert_eq!(floor.plants[0].driver.counts().actions, 0, "it waits, which is no action");
    assert!(hypot(floor.plants[0].pose.at_m[0] - pose.at_m[0], 0.0) < 1e-9);
    let driver = &mut floor.plants[0].driver;
    let wall = driver.set_goal(&Pose2 { at_m: [2.4, 3.7], yaw_rad: 0.0 });
    assert!(matches!(wall, Err(DriveGoalRefusal::Goal(_))), "{wall:?}");
    assert_eq!(driver.set_goal(&goal), Ok(GridPose { col: 4, row: 1, heading: 1 }));
    floor.advance(1200);
    let plant = &floor.plants[0];
    assert_eq!((plant.driver.counts().trips, floor.touches), (1, 0));
    let target = grid.center(GridPose { col: 4, row: 1, heading: 1 });
    let off = [0, 1].map(|k| plant.pose.at_m[k] - target.at_m[k]);
    assert!(hypot(off[0], off[1]) < 0.1 && wrap_angle(plant.pose.yaw_rad - PI / 2.0).abs() < 0.1);
    let own =
        Driver::new(&self::world(&scenario("[[robots]]\nat = [[2, 1, 0]]\n")), 0, LIMITS, GUARD);
    let own = own.expect("it can drive").set_goal(&goal);
    assert_eq!(own, Err(DriveGoalRefusal::OwnProgram));
}

const RADIO: &str = "[radio]\nrange_m = 2.0\n[[robots]]\nat = [[0, 0, 0], [3, 0, 2], [9, 0, 2]]\n\
    sensors = [\"sonar-8\"]\neffector = \"nomad\"\nbehaviour = { kind = \"announce\" }\n";

#[test]
fn words_are_heard_as_in_a_run_by_those_in_range_until_a_robot_is_silent() {
    let mut run = run(&scenario(RADIO));
    run.advance(1);
    let world = run.world().clone();
    let percepts = world.percepts_in_cycle(run.state(), 1);
    let mut neighbors: Vec<Neighbors> =
        (0..3).map(|id| Neighbors::new(world.clone(), id)).collect();
    let snapshot = run.state().snapshot(&world, 1);
    for percept in &percepts {
        let at = GridPose { col: percept.at.0, row: percept.at.1, heading: percept.heading };
        let word = snapshot.bodies[percept.id as usize].voice;
        assert!(word.is_some());
        let beacon = beacon(percept.id, at, word);
        neighbors.iter_mut().for_each(|one| one.hear(beacon.clone()));
    }
    for percept in &percepts {
        let at = GridPose { col: percept.at.0, row: percept.at.1, heading: percept.heading };
        assert_eq!(neighbors[percept.id as usize].words_heard(at), percept.heard);
    }
    assert_eq!(percepts[0].heard.len(), 1, "the third one is too far");
    neighbors[0].forget(1);
    let at = GridPose { col: 0, row: 0, heading: 0 };
    assert_eq!(neighbors[0].words_heard(at), []);
    neighbors[0].hear(beacon(77, at, Some(1)));
    neighbors[0].hear(beacon(1, GridPose { col: 20, ..at }, Some(1)));
    assert_eq!(neighbors[0].words_heard(at), [], "there is no such robot, and no such box");
}

fn beacon(robot: u32, at: GridPose, word: Option<u64>) -> DriveBeacon {
    DriveBeacon { robot, at, word, request: 0, done: None, heard_done: Vec::new() }
}

#[test]
fn a_request_is_heard_by_the_first_robot_in_its_direction_only() {
    let world = world(&scenario(
        "[[robots]]\nat = [[0, 0, 0], [2, 0, 2], [1, 5, 2]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
         behaviour = { kind = \"goto\", goals = [[5, 0]], avoidance = \"plan\" }\n",
    ));
    // Of rank 1 to the east, and no further direction.
    let east = 1 << 5 | 4 << 2;
    let asks = |col: u32| DriveBeacon {
        request: east,
        ..beacon(0, GridPose { col, row: 0, heading: 0 }, None)
    };
    let at = GridPose { col: 2, row: 0, heading: 2 };
    let mut neighbors = Neighbors::new(world, 1);
    assert!(neighbors.has_requests());
    neighbors.hear(asks(0));
    assert_eq!(neighbors.request_to(at), east);
    assert_eq!(neighbors.request_to(GridPose { row: 1, ..at }), 0, "not on its way");
    assert_eq!(neighbors.request_to(GridPose { col: 3, ..at }), 0, "too far");
    neighbors.hear(beacon(2, GridPose { col: 1, row: 0, heading: 0 }, None));
    assert_eq!(neighbors.request_to(at), 0, "another one is between them");
    neighbors.forget(2);
    neighbors.forget(0);
    assert_eq!(neighbors.request_to(at), 0);
}

/// Robots that change sides through a door of one box.
fn door() -> String {
    let mut text = "format = 1\nworld = \"robots\"\ncycles = 200\nregime = \"reliable\"\n[map]\nbox_size_m = 0.5\n\
        ascii = \"\"\"\n....#....\n.........\n....#....\n\"\"\"\n"
        .to_string();
    let robots =
        [([0, 1, 0], [8, 0]), ([0, 2, 0], [8, 2]), ([8, 0, 2], [0, 1]), ([8, 2, 2], [0, 2])];
    // One planner leads all: those of a team of its own would take the others for walls.
    let mut leader = "name = \"all\"\nplanner = { method = \"lacam\" }";
    for (start, goal) in robots {
        text += &format!(
            "[[robots]]\nat = [{start:?}]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
             behaviour = {{ kind = \"goto\", goals = [{goal:?}] }}\n{leader}\n"
        );
        leader = "team = \"all\"";
    }
    text
}

#[test]
fn robots_with_a_plan_pass_a_door_in_its_order_and_touch_nobody() {
    let text = door();
    let source = Source::new("s.toml", &text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
    let compiled = compiled.expect("a scenario");
    let drivers: Vec<(Driver, Pose2)> = (0..4)
        .map(|id| {
            let driver = Driver::of_scenario(&compiled, &source, id, LIMITS, GUARD);
            let driver = driver.expect("it can drive");
            let ((col, row), heading) = compiled.start[id as usize];
            let grid = BodyGrid::new(&compiled.world, id).expect("a robot");
            (driver, grid.center(GridPose { col, row, heading }))
        })
        .collect();
    let digests = drivers.iter().map(|(driver, _)| {
        compiled.world.common_digest(driver.plan().map(PlanExecutor::plan)).to_string()
    });
    let digests: Vec<String> = digests.collect();
    assert!(digests.iter().all(|digest| *digest == digests[0]));
    assert_ne!(compiled.world.common_digest(None).to_string(), digests[0]);
    let mut floor = Floor::of_plants(&compiled.world, drivers);
    let mut steps = 0;
    let is_complete =
        |plant: &Plant| plant.driver.plan().is_some_and(PlanExecutor::is_complete_for_all);
    while !floor.plants.iter().all(is_complete) {
        floor.advance(1);
        let beacons: Vec<DriveBeacon> =
            floor.plants.iter().filter_map(|plant| plant.driver.beacon()).collect();
        for (own, plant) in floor.plants.iter_mut().enumerate() {
            let others = beacons.iter().filter(|beacon| beacon.robot as usize != own);
            others.for_each(|beacon| plant.driver.hear(beacon.clone()));
        }
        steps += 1;
        assert!(steps < 12_000, "10 minutes");
    }
    floor.advance(1);
    assert_eq!(floor.touches, 0);
    let waits: u64 = floor.plants.iter().map(|plant| plant.driver.counts().plan_waits).sum();
    assert!(waits > 0, "they cannot all be first");
    let trips: u64 = floor.plants.iter().map(|plant| plant.driver.counts().trips).sum();
    assert_eq!(trips, 4, "all arrive");
}
