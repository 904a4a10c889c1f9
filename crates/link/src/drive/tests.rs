use super::beacon::{Beacons, CommonGround};
use super::motion_log::{MotionLog, MotionNames};
use super::{Drive, DriveEnd, DriveError};
use crate::plant::{Measured, Plant, PlantState};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::RobotsWorld;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::controller::DriveLimits;
use sidestep::worlds::robots::drive::driver::Driver;
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::drive::guard::GuardLimits;
use sidestep::worlds::robots::drive::scan::RangeScan;
use sidestep::worlds::robots::scenario::Compiled;
use std::cell::Cell;
use std::sync::Arc;
use std::time::{Duration, Instant};

const CORRIDOR: &str = "format = 1\nworld = \"robots\"\n[map]\nbox_size_m = 0.5\nascii = \"\"\"\n..........\n\"\"\"\n\
    [[robots]]\nat = [[0, 0, 0]]\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
    behaviour = { kind = \"replay\", actions = [\"forward\"], repeat = true }\n";

fn world() -> Arc<RobotsWorld> {
    let compiled = WORLDS.compile(&Source::new("s.toml", CORRIDOR, "")).expect("a scenario");
    compiled.as_any().downcast_ref::<Compiled>().expect("robots").world.clone()
}

fn driver() -> Driver {
    let limits = DriveLimits {
        max_mps: 0.5,
        max_radps: 1.0,
        max_mps2: 1.0,
        tolerance_m: 0.03,
        tolerance_rad: 0.05,
        stall_s: 1.0,
        cycle_s: 0.5,
        action_timeout_s: 30.0,
    };
    let guard = GuardLimits {
        max_mps: 0.5,
        max_radps: 1.0,
        braking_mps2: 1.0,
        radius_m: 0.2,
        clearance_m: 0.02,
        patience_s: 0.5,
    };
    Driver::new(&world(), 0, limits, guard).expect("it can drive")
}

fn beacons() -> Beacons {
    let common = CommonGround { robots: 1, digest: world().common_digest(None) };
    Beacons::new(0, common, Duration::from_secs(2))
}

/// A robot in a corridor that does what it is told, and whose measurements stop to come after a number of poses.
struct Corridor {
    state: Pose2,
    velocity: DriveVelocity,
    time_s: f64,
    poses: usize,
    silent_from: usize,
    last: Option<PlantState>,
    commands: Vec<DriveVelocity>,
}

impl Corridor {
    fn new(silent_from: usize) -> Self {
        Self {
            state: Pose2 { at_m: [0.25, 0.25], yaw_rad: 0.0 },
            velocity: DriveVelocity::ZERO,
            time_s: 0.0,
            poses: 0,
            silent_from,
            last: None,
            commands: Vec::new(),
        }
    }
}

impl Plant for Corridor {
    fn wait(&mut self, _: Duration) -> PlantState {
        const STEP_S: f64 = 0.05;
        self.poses += 1;
        if self.poses >= self.silent_from {
            // The age of the last state is that of a plant that is silent for long.
            let mut last = self.last.clone().unwrap_or_default();
            if let Some(pose) = &mut last.pose {
                pose.arrived -= Duration::from_secs(1);
            }
            return last;
        }
        self.time_s += STEP_S;
        self.state.at_m[0] += self.velocity.forward_mps * STEP_S;
        let arrived = Instant::now();
        let scan = RangeScan {
            first_rad: -3.0,
            step_rad: 0.1,
            ranges_m: vec![f32::INFINITY; 61],
            max_m: 9.0,
            ..RangeScan::default()
        };
        let state = PlantState {
            pose: Some(Measured { value: self.state, time_s: self.time_s, arrived }),
            scan: Some(Measured { value: Arc::new(scan), time_s: self.time_s, arrived }),
            ..PlantState::default()
        };
        self.last = Some(state.clone());
        state
    }

    fn command(&mut self, velocity: DriveVelocity) -> Result<(), String> {
        self.velocity = velocity;
        self.commands.push(velocity);
        Ok(())
    }
}

#[test]
fn a_drive_ends_after_its_actions_with_a_table_and_a_robot_that_stands() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("motions.csv");
    let names = MotionNames {
        robot: 0,
        effector: "nomad".into(),
        actions: ["forward", "left", "right", "stay"].map(String::from).to_vec(),
        box_m: 0.5,
        cycle_s: 0.5,
    };
    let log = MotionLog::create(&path, false, names.clone()).expect("a file");
    let mut plant = Corridor::new(usize::MAX);
    let end = DriveEnd { actions: 3, trips: None };
    let mut statuses = Vec::new();
    let mut drive = Drive::new(&mut plant, driver(), beacons(), end, Some(log));
    drive.pass(&|| false, &mut |status| statuses.push(status.clone())).expect("it is done");
    assert_eq!(drive.final_status().actions, 3);
    drop(drive);
    assert_eq!(plant.commands.last(), Some(&DriveVelocity::ZERO));
    assert!(plant.commands.iter().all(|velocity| velocity.forward_mps <= 0.5));
    assert!((plant.state.at_m[0] - 1.75).abs() < 0.1, "{:?}", plant.state);
    assert_eq!(statuses.last().and_then(|status| status.at), Some((3, 0)));
    let table = std::fs::read_to_string(&path).expect("text");
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows.len(), 4);
    assert!(rows[2].starts_with("1,0,forward,1,0,0,no,nomad,0.5,"), "{table}");
    assert!(MotionLog::create(&path, false, names.clone()).is_err(), "it is there");
    assert!(MotionLog::create(&path, true, names).is_ok());
}

#[test]
fn a_plant_that_falls_silent_is_told_to_stand_and_that_is_counted_once() {
    let mut plant = Corridor::new(40);
    let looks = Cell::new(0);
    let has_to_end = || {
        looks.set(looks.get() + 1);
        looks.get() > 60
    };
    let end = DriveEnd { actions: 99, trips: None };
    let mut drive = Drive::new(&mut plant, driver(), beacons(), end, None);
    let passed = drive.pass(&has_to_end, &mut |_| {});
    assert!(matches!(passed, Err(DriveError::Interrupted)));
    assert_eq!(drive.final_status().old_states, 1);
    drop(drive);
    let moving = plant.commands.iter().rposition(|velocity| *velocity != DriveVelocity::ZERO);
    let standing = plant.commands.len() - 1 - moving.expect("it has moved");
    assert!(standing >= 20, "{standing}");
}
