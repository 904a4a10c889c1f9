//! Limits that hold whatever the program decides: the map, largest speeds, room to brake, and measurements that are fresh.

use super::DriveVelocity;
use super::grid::{BodyGrid, Pose2};
use super::scan::{Echo, RangeScan};
use sidestep_kernel::math::hypot;

/// The limits of a guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardLimits {
    /// Largest speed in m/s.
    pub max_mps: f64,
    /// Largest rate of turning in rad/s.
    pub max_radps: f64,
    /// How hard the robot brakes at least, in m/s2.
    pub braking_mps2: f64,
    /// Radius of the robot in meters.
    pub radius_m: f64,
    /// Distance in meters that the robot keeps from what its scanner sees before it.
    pub clearance_m: f64,
    /// Age in seconds from which on a measurement is not fresh.
    pub patience_s: f64,
}

/// Why a robot was stopped or slowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardCause {
    /// Its measurements are too old: the dead man's switch.
    OldState,
    /// Its center is not on a free box of the map.
    OffMap,
    /// Its scanner sees something so near that it could not brake.
    Obstacle,
}

/// What a guard looks at.
#[derive(Debug, Clone, Copy)]
pub struct GuardView<'a> {
    /// The pose in the frame of the map; none before the first one.
    pub pose: Option<&'a Pose2>,
    /// The last scan; none before the first one.
    pub scan: Option<&'a RangeScan>,
    /// The age in seconds of the older one of them.
    pub age_s: f64,
}

/// How often a guard has stepped in, for each cause: times that it began to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GuardCounts {
    /// Stops because measurements were too old.
    pub old_states: u64,
    /// Stops because the robot was off the free boxes of the map.
    pub off_map: u64,
    /// Times that the robot was slowed or stopped because something was near.
    pub obstacles: u64,
}

/// The time in seconds that passes from a measurement to the effect of a command on the wheels.
const REACTION_S: f64 = 0.15;

/// Echoes within this share of the radius are of the robot itself.
const OWN_SHARE: f64 = 0.7;

/// What is off the line by more than this share of the radius is passed: noise of ranges must not stop a robot beside a wall.
const LANE_SHARE: f64 = 0.9;

/// A guard beside the program of a robot.
#[derive(Debug, Clone)]
pub struct Guard {
    limits: GuardLimits,
    grid: BodyGrid,
    counts: GuardCounts,
    present: Option<GuardCause>,
}

impl Guard {
    /// Returns a guard that has not stepped in yet.
    pub fn new(limits: GuardLimits, grid: BodyGrid) -> Self {
        Self { limits, grid, counts: GuardCounts::default(), present: None }
    }

    /// Returns how often it has stepped in.
    pub fn counts(&self) -> GuardCounts {
        self.counts
    }

    /// Returns why it steps in at present, if it does.
    pub fn cause(&self) -> Option<GuardCause> {
        self.present
    }

    /// Returns whether measurements of an age in seconds are fresh.
    pub fn is_fresh(&self, age_s: f64) -> bool {
        age_s <= self.limits.patience_s
    }

    /// Returns the velocity that is allowed in place of a wanted one.
    pub fn limit(&mut self, wanted: DriveVelocity, view: &GuardView<'_>) -> DriveVelocity {
        let fresh = view.pose.zip(view.scan).filter(|_| self.is_fresh(view.age_s));
        let Some((pose, scan)) = fresh else {
            self.record(Some(GuardCause::OldState));
            return DriveVelocity::ZERO;
        };
        if !self.grid.is_inside(pose) {
            self.record(Some(GuardCause::OffMap));
            return DriveVelocity::ZERO;
        }
        let bounded = self.within_limits(wanted);
        let max_mps = self.max_speed(scan, bounded.forward_mps);
        if bounded.forward_mps.abs() <= max_mps {
            self.record(None);
            return bounded;
        }
        self.record(Some(GuardCause::Obstacle));
        DriveVelocity { forward_mps: bounded.forward_mps.signum() * max_mps, ..bounded }
    }

    /// Returns a velocity within the limits; numbers that are none stop.
    fn within_limits(&self, wanted: DriveVelocity) -> DriveVelocity {
        if !wanted.forward_mps.is_finite() || !wanted.turn_radps.is_finite() {
            return DriveVelocity::ZERO;
        }
        let Self { limits, .. } = self;
        DriveVelocity {
            forward_mps: wanted.forward_mps.clamp(-limits.max_mps, limits.max_mps),
            turn_radps: wanted.turn_radps.clamp(-limits.max_radps, limits.max_radps),
        }
    }

    fn record(&mut self, cause: Option<GuardCause>) {
        if cause != self.present {
            match cause {
                Some(GuardCause::OldState) => self.counts.old_states += 1,
                Some(GuardCause::OffMap) => self.counts.off_map += 1,
                Some(GuardCause::Obstacle) => self.counts.obstacles += 1,
                None => {}
            }
        }
        self.present = cause;
    }

    /// Returns the largest speed from which the robot can still brake before what is in its way, even if that comes toward
    /// it as fast and brakes as hard.
    fn max_speed(&self, scan: &RangeScan, forward_mps: f64) -> f64 {
        let gap_m = self.gap(scan, forward_mps.signum());
        let free_m = gap_m - self.limits.clearance_m - forward_mps.abs() * REACTION_S;
        // Two robots need v^2 / (2 a) each.
        (self.limits.braking_mps2 * free_m.max(0.0)).sqrt()
    }

    /// Returns how far the robot, a disc, can go straight ahead (1) or back (-1) until it touches something, in meters.
    fn gap(&self, scan: &RangeScan, direction: f64) -> f64 {
        let radius_m = self.limits.radius_m;
        let mut gap_m = f64::INFINITY;
        for index in 0..scan.ranges_m.len() {
            let Some(Echo::At([x_m, y_m])) = scan.echo(index) else { continue };
            let ahead_m = x_m * direction;
            let is_in_way = ahead_m > 0.0 && y_m.abs() < LANE_SHARE * radius_m;
            if is_in_way && hypot(x_m, y_m) > OWN_SHARE * radius_m {
                gap_m = gap_m.min(ahead_m - (radius_m * radius_m - y_m * y_m).sqrt());
            }
        }
        gap_m
    }
}
