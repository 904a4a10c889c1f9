//! A real robot that is driven by its program.

use super::output::print_message;
use super::parent_monitor::ParentMonitor;
use super::ros2::{network_error, with_ports};
use crate::drive::bag::DriveBag;
use crate::drive::beacon::{Beacons, CommonGround};
use crate::drive::motion_log::{MotionLog, MotionNames};
use crate::drive::{Drive, DriveEnd, DriveError};
use crate::plant::Plant;
use crate::plant::ros2::{PlantOptions, Ros2Plant};
use crate::ros2::node::RosNode;
use sidestep::kernel::InputError;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::RobotsWorld;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::controller::DriveLimits;
use sidestep::worlds::robots::drive::driver::Driver;
use sidestep::worlds::robots::drive::guard::GuardLimits;
use sidestep::worlds::robots::drive::plan_executor::PlanExecutor;
use sidestep::worlds::robots::scenario::Compiled;
use sidestep::worlds::robots::world::Role;
use sidestep_session::Error;
use sidestep_session::fleet::{DriveJob, DriveSettings, LinkMessage, RosNetwork};
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// Largest distance from the end of an action, as a share of a box; more would be noticed where two bodies pass.
const TOLERANCE_BOXES: f64 = 0.06;

/// Largest angle from the heading at the end of an action, in radians: 3 degrees.
const TOLERANCE_RAD: f64 = 0.052;

/// The radius of a robot, as a share of its side in the scenario, unless it is given: a disc in its boxes, and room for the
/// tolerances.
const RADIUS_SHARE: f64 = 0.4;

/// Time in seconds for which a robot may stand against its commands.
const STALL_S: f64 = 1.5;

/// Drives a robot to the end of its job, or until the parent process ends it.
///
/// # Errors
/// When anything is wrong with the job, no router answers, the robot is lost, or the table cannot be written.
pub(super) fn run(job: &DriveJob, parent: &ParentMonitor) -> Result<(), Error> {
    let flown = &job.common.flown;
    let (source, compiled) =
        sidestep_session::read_scenario(&WORLDS, &flown.file, &flown.overrides)?;
    let Some(building) = compiled.as_any().downcast_ref::<Compiled>() else {
        let cause = format!("agents of the world `{}` do not drive", compiled.world());
        let remedy = "give a scenario with world = \"robots\"";
        return Err(InputError::new(&source.place, cause, remedy).into());
    };
    let world = &building.world;
    let limits = drive_limits(&job.settings, world.map.box_size_m);
    let guard = guard_limits(&job.settings, side_m(world, job.robot));
    let driver = Driver::of_scenario(building, &source, job.robot, limits, guard)?;
    check_end(job, &driver)?;
    let peers = peer_topics(job, world)?;
    let beacons = beacons(job, world, &driver);
    let network = RosNetwork { listen: with_ports(&job.network.listen)?, ..job.network.clone() };
    let node = RosNode::open(&network, &format!("sidestep_drive_{}", job.robot));
    let node = node.map_err(network_error)?;
    // After the network: what is wrong there leaves no file behind.
    let log = motion_log(job, world)?;
    let options = PlantOptions { takes_goals: driver.takes_goals(), bag: drive_bag(job)?, peers };
    let mut plant = Ros2Plant::start(node, &job.topics, options).map_err(network_error)?;
    // So that the topic of commands is known before the first measurement, and a robot that moves stands.
    plant.command(DriveVelocity::ZERO).map_err(|cause| drive_error(DriveError::Plant(cause)))?;
    print_message(&LinkMessage::Listens(network.listen.clone()));
    print_message(&LinkMessage::Ros2(plant.node().graph()));
    let end = DriveEnd { actions: compiled.plan().cycles, trips: job.trips };
    let mut drive = Drive::new(&mut plant, driver, beacons, end, log);
    let passed = drive.pass(&|| parent.has_ended(), &mut |status| {
        print_message(&LinkMessage::Drives(status.clone()));
    });
    print_message(&LinkMessage::Driven(drive.final_status()));
    // The robot is told to stand before the node leaves.
    drop(drive);
    let stored = plant.end();
    passed.map_err(drive_error)?;
    stored.map_err(|error| drive_error(DriveError::Bag(error)))
}

/// Checks that a robot with a plan has no other end: those that wait for it would wait in vain.
fn check_end(job: &DriveJob, driver: &Driver) -> Result<(), InputError> {
    if job.trips.is_none() || driver.plan().is_none() {
        return Ok(());
    }
    let cause = "a plan ends when all robots have carried out their parts of it";
    Err(InputError::new("--trips", cause, "leave it out; fewer cycles make a shorter plan"))
}

fn beacons(job: &DriveJob, world: &RobotsWorld, driver: &Driver) -> Beacons {
    let common = CommonGround {
        robots: world.robot_count() as u32,
        digest: world.common_digest(driver.plan().map(PlanExecutor::plan)),
    };
    let patience = Duration::from_secs_f64(job.settings.beacon_patience_s);
    Beacons::new(job.robot, common, patience)
}

/// Returns the topics on which the robot hears the others of its scenario.
fn peer_topics(job: &DriveJob, world: &RobotsWorld) -> Result<Vec<String>, InputError> {
    let topic = &job.topics.beacon;
    let others = (0..world.robot_count() as u32).filter(|&robot| robot != job.robot);
    if topic.starts_with('/') {
        // One for all robots.
        return Ok(vec![topic.clone()]);
    }
    let pattern = job.topics.peers.clone();
    let pattern = pattern.or_else(|| peer_pattern(&job.network.namespace, job.robot));
    let Some(pattern) = pattern else {
        let has_others = world.robot_count() > 1;
        if has_others && world.listens_to_others(job.robot) {
            let cause = format!(
                "the namespace {} does not end with the id {} of the robot, so those of the others are not known",
                job.network.namespace, job.robot
            );
            let remedy = "give --peers with {} in place of the id, such as --peers robot_{}";
            return Err(InputError::new("--namespace", cause, remedy));
        }
        if has_others {
            tracing::warn!("the robot hears no others: give --peers, such as --peers robot_{{}}");
        }
        return Ok(Vec::new());
    };
    let of_robot = |robot: u32| {
        let namespace = pattern.replace("{}", &robot.to_string());
        format!("{}/{topic}", namespace.trim_end_matches('/'))
    };
    Ok(others.map(of_robot).collect())
}

/// Returns a namespace with `{}` in place of the id of its robot, if that is the number at its end.
fn peer_pattern(namespace: &str, robot: u32) -> Option<String> {
    let stem = namespace.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_id = namespace[stem.len()..].parse() == Ok(robot);
    is_id.then(|| format!("{stem}{{}}"))
}

fn side_m(world: &RobotsWorld, robot: u32) -> f64 {
    let bodies = world.bodies.len();
    let size = if (robot as usize) < bodies { world.type_of(robot).size.0 } else { 1 };
    f64::from(size) * world.map.box_size_m
}

fn drive_limits(settings: &DriveSettings, box_m: f64) -> DriveLimits {
    DriveLimits {
        max_mps: settings.speed_mps,
        max_radps: settings.turn_radps,
        max_mps2: settings.acceleration_mps2,
        tolerance_m: TOLERANCE_BOXES * box_m,
        tolerance_rad: TOLERANCE_RAD,
        stall_s: STALL_S,
        cycle_s: settings.cycle_s,
        action_timeout_s: settings.timeout_s,
    }
}

fn guard_limits(settings: &DriveSettings, side_m: f64) -> GuardLimits {
    GuardLimits {
        max_mps: settings.speed_mps,
        max_radps: settings.turn_radps,
        braking_mps2: settings.acceleration_mps2,
        radius_m: settings.radius_m.unwrap_or(RADIUS_SHARE * side_m),
        clearance_m: settings.clearance_m,
        patience_s: settings.patience_s,
    }
}

fn motion_log(job: &DriveJob, world: &Arc<RobotsWorld>) -> Result<Option<MotionLog>, Error> {
    let Some(path) = &job.out else { return Ok(None) };
    let Role::Robot(model) = &world.type_of(job.robot).role else { return Ok(None) };
    let names = MotionNames {
        robot: job.robot,
        effector: model.body.effector.name.clone(),
        actions: model.body.effector.actions.clone(),
        box_m: world.map.box_size_m,
        cycle_s: job.settings.cycle_s,
    };
    let log = MotionLog::create(path, job.replace, names);
    let log = log.map_err(|error| {
        let remedy = match error.kind() {
            io::ErrorKind::AlreadyExists => "give another file, or --replace",
            _ => "see whether its folder is there and can be written",
        };
        InputError::new(path.display().to_string(), error.to_string(), remedy)
    })?;
    Ok(Some(log))
}

fn drive_bag(job: &DriveJob) -> Result<Option<DriveBag>, Error> {
    let Some(folder) = &job.bag else { return Ok(None) };
    let bag = DriveBag::create(folder, job.replace).map_err(|error| {
        let remedy = match error.kind() {
            io::ErrorKind::AlreadyExists if job.replace => "give another folder",
            io::ErrorKind::AlreadyExists => "give another folder, or --replace",
            _ => "see whether its parent is there and can be written",
        };
        InputError::new(folder.display().to_string(), error.to_string(), remedy)
    })?;
    Ok(Some(bag))
}

fn drive_error(error: DriveError) -> Error {
    let remedy = match &error {
        DriveError::Interrupted => return Error::Interrupted,
        DriveError::Plant(_) => "see whether its router is still there",
        DriveError::Percept(_) => "its behavior and its sensors do not fit; see sidestep check",
        DriveError::Log(_) | DriveError::Bag(_) => "see whether the disk is full",
    };
    Error::other(error.to_string(), remedy)
}

#[cfg(test)]
mod tests {
    use super::peer_pattern;

    #[test]
    fn namespaces_of_others_are_known_where_the_own_one_ends_with_the_id() {
        assert_eq!(peer_pattern("/hall/robot_12", 12).as_deref(), Some("/hall/robot_{}"));
        assert_eq!(peer_pattern("/robot_1", 2), None);
        assert_eq!(peer_pattern("/kitchen", 2), None);
        assert_eq!(peer_pattern("/", 0), None);
    }
}
