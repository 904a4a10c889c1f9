//! Velocities that lead from one place to the next: turn toward the line, go along it, turn to the heading, stop.
//!
//! The law along a line is proportional control of the remaining distance and of the heading toward a point ahead on the
//! line (Coulter 1992, "Implementation of the pure pursuit path tracking algorithm").

use super::DriveVelocity;
use super::grid::{BodyGrid, Pose2};
use super::plan::MotionPlan;
use crate::decide::Contact;
use crate::effector::Side;
use sidestep_kernel::math::{atan2, cos, hypot, sin, wrap_angle};

/// The limits of a drive, and when an action counts as done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveLimits {
    /// Largest speed in m/s.
    pub max_mps: f64,
    /// Largest rate of turning in rad/s.
    pub max_radps: f64,
    /// Largest change of the speed in m/s2; the robot must be able to brake so hard.
    pub max_mps2: f64,
    /// Largest distance from the end of an action, in meters.
    pub tolerance_m: f64,
    /// Largest angle from the heading at the end of an action, in radians.
    pub tolerance_rad: f64,
    /// Time in seconds for which a robot that is told to move may stand before it counts as stopped by something.
    pub stall_s: f64,
    /// Time in seconds of an action that waits.
    pub cycle_s: f64,
    /// Time in seconds after which an action ends where it is.
    pub action_timeout_s: f64,
}

/// Speed per remaining meter, 1/s.
const SPEED_GAIN: f64 = 1.5;
/// Rate of turning per remaining radian, 1/s.
const TURN_GAIN: f64 = 2.5;
/// The speed below which wheels may not move at all, in m/s.
const MIN_MPS: f64 = 0.03;
/// The rate below which wheels may not turn the robot, in rad/s.
const MIN_RADPS: f64 = 0.1;
/// A robot that points off its line by more turns on the spot first, in radians.
const MAX_OFF_LINE_RAD: f64 = 0.35;
/// Change of the rate of turning in a second, per limit of the rate: turning carries little momentum.
const TURN_RAMP_PER_S: f64 = 4.0;
/// The longest time between two measurements that counts as one step of control, in seconds.
const MAX_STEP_S: f64 = 0.5;
/// A robot that does less than this share of what it is told stands.
const STALL_SHARE: f64 = 0.25;
/// Commanded distances and turns below these say nothing about a stall.
const MIN_STALL_M: f64 = 0.03;
const MIN_STALL_RAD: f64 = 0.15;

/// A measurement of the robot that drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveState {
    /// The robot's own time in seconds.
    pub time_s: f64,
    /// Its pose in the frame of the map.
    pub pose: Pose2,
    /// Whether its bumper is pressed.
    pub is_touching: bool,
}

/// How an action went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActionOutcome {
    /// What stopped it.
    pub contact: Option<Contact>,
    /// Whether it took too long, and ended where it was.
    pub is_timed_out: bool,
}

/// What an action comes to in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActionProgress {
    /// The robot is to move so.
    UnderWay(DriveVelocity),
    /// It is over, and the robot is to stand.
    Done(ActionOutcome),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing moves until the time of a cycle is over.
    Wait,
    Go,
    Turn,
    /// Back to the start, after a contact.
    Return,
    TurnBack,
}

/// What was commanded and done since some time.
#[derive(Debug, Clone, Copy)]
struct StallWindow {
    since_s: f64,
    pose: Pose2,
    commanded_m: f64,
    commanded_rad: f64,
}

/// Drives one action.
#[derive(Debug, Clone)]
pub struct Controller {
    limits: DriveLimits,
    plan: MotionPlan,
    start: Pose2,
    target: Pose2,
    /// What stands in the way where the map has nothing.
    unknown_kind: u8,
    phase: Phase,
    velocity: DriveVelocity,
    began_s: f64,
    last_s: f64,
    /// Whether the bumper was pressed at the measurement before: one that stays pressed is no new contact.
    was_touching: bool,
    contact: Option<Contact>,
    window: StallWindow,
}

impl Controller {
    /// Starts an action. `unknown_kind` is the kind of what stops it where the map has nothing.
    pub fn start(
        limits: DriveLimits,
        grid: &BodyGrid,
        plan: MotionPlan,
        state: &DriveState,
        unknown_kind: u8,
    ) -> Self {
        let phase = match () {
            () if plan.is_rest() => Phase::Wait,
            () if plan.has_path() => Phase::Go,
            () => Phase::Turn,
        };
        Self {
            limits,
            plan,
            start: grid.center(plan.start),
            target: grid.center(plan.target),
            unknown_kind,
            phase,
            velocity: DriveVelocity::ZERO,
            began_s: state.time_s,
            last_s: state.time_s,
            was_touching: state.is_touching,
            contact: None,
            window: window_at(state),
        }
    }

    /// Returns the plan of the action.
    pub fn plan(&self) -> &MotionPlan {
        &self.plan
    }

    /// Returns the seconds since the action began.
    pub fn duration_s(&self) -> f64 {
        self.last_s - self.began_s
    }

    /// Takes the next measurement.
    pub fn update(&mut self, state: &DriveState) -> ActionProgress {
        let step_s = (state.time_s - self.last_s).clamp(0.0, MAX_STEP_S);
        if state.time_s - self.last_s > MAX_STEP_S {
            // Nothing was measured for a while, in which a guard has stopped the robot.
            self.window = window_at(state);
        }
        self.last_s = state.time_s;
        self.find_contact(state, step_s);
        if self.duration_s() > self.limits.action_timeout_s {
            return self.done(true);
        }
        let Some(wanted) = self.wanted(state) else { return self.done(false) };
        self.velocity = self.ramped(wanted, step_s);
        ActionProgress::UnderWay(self.velocity)
    }

    fn done(&self, is_timed_out: bool) -> ActionProgress {
        let contact = self.contact.or(self.plan.contact);
        ActionProgress::Done(ActionOutcome { contact, is_timed_out })
    }

    /// Goes back to the start at the first contact; a robot that cannot go back stays.
    fn find_contact(&mut self, state: &DriveState, step_s: f64) {
        let is_new_touch = state.is_touching && !self.was_touching;
        self.was_touching = state.is_touching;
        let is_stopped = self.is_stalled(state, step_s);
        match self.phase {
            Phase::Wait => {}
            Phase::Go | Phase::Turn if is_new_touch || is_stopped => {
                let side = if self.velocity.forward_mps < 0.0 { Side::Back } else { Side::Front };
                self.contact = Some(Contact { kind: self.unknown_kind, side });
                self.phase = Phase::Return;
                // It brakes at once.
                self.velocity = DriveVelocity::ZERO;
            }
            Phase::Return | Phase::TurnBack if is_stopped => {
                // It stands somewhere: where that is, the next percept says.
                self.phase = Phase::Wait;
            }
            Phase::Go | Phase::Turn | Phase::Return | Phase::TurnBack => {}
        }
    }

    /// Returns whether the robot was told to move for some time and did not.
    fn is_stalled(&mut self, state: &DriveState, step_s: f64) -> bool {
        self.window.commanded_m += self.velocity.forward_mps.abs() * step_s;
        self.window.commanded_rad += self.velocity.turn_radps.abs() * step_s;
        if state.time_s - self.window.since_s < self.limits.stall_s {
            return false;
        }
        let window = std::mem::replace(&mut self.window, window_at(state));
        let [dx_m, dy_m] = [0, 1].map(|k| state.pose.at_m[k] - window.pose.at_m[k]);
        let moved_m = hypot(dx_m, dy_m);
        let turned_rad = wrap_angle(state.pose.yaw_rad - window.pose.yaw_rad).abs();
        let is_told = window.commanded_m > MIN_STALL_M || window.commanded_rad > MIN_STALL_RAD;
        is_told
            && moved_m <= STALL_SHARE * window.commanded_m
            && turned_rad <= STALL_SHARE * window.commanded_rad.max(MIN_STALL_RAD)
    }

    /// Returns the velocity without limits of its change, and goes on to the next phase where one is done; none where all
    /// are.
    fn wanted(&mut self, state: &DriveState) -> Option<DriveVelocity> {
        loop {
            let wanted = match self.phase {
                Phase::Wait => {
                    let is_over = self.duration_s() >= self.limits.cycle_s;
                    return (!is_over).then_some(DriveVelocity::ZERO);
                }
                Phase::Go => self.toward(state, &self.target),
                Phase::Return => self.toward(state, &self.start),
                Phase::Turn => self.turn_to(state, self.target.yaw_rad),
                Phase::TurnBack => self.turn_to(state, self.start.yaw_rad),
            };
            if wanted.is_some() {
                return wanted;
            }
            self.phase = match self.phase {
                Phase::Go => Phase::Turn,
                Phase::Return => Phase::TurnBack,
                Phase::Turn | Phase::TurnBack | Phase::Wait => return None,
            };
        }
    }

    /// Returns the velocity along the heading of the start to a place; none where it is reached.
    fn toward(&self, state: &DriveState, place: &Pose2) -> Option<DriveVelocity> {
        let heading_rad = self.start.yaw_rad;
        let ux = cos(heading_rad);
        let uy = sin(heading_rad);
        let [dx_m, dy_m] = [0, 1].map(|k| place.at_m[k] - state.pose.at_m[k]);
        let remaining_m = dx_m * ux + dy_m * uy;
        if remaining_m.abs() <= self.limits.tolerance_m {
            return None;
        }
        // Above 0 where the robot is to the left of the line.
        let left_m = dx_m * uy - dy_m * ux;
        // A point ahead as far as the robot comes in a second, but not so near that it would turn hard for a centimeter.
        let lookahead_m = self.limits.max_mps.max(0.2);
        let toward_line_rad = -atan2(left_m, lookahead_m) * remaining_m.signum();
        let off_rad = wrap_angle(heading_rad + toward_line_rad - state.pose.yaw_rad);
        let turn_radps = bounded(TURN_GAIN * off_rad, 0.0, self.limits.max_radps);
        if off_rad.abs() > MAX_OFF_LINE_RAD {
            return Some(DriveVelocity { forward_mps: 0.0, turn_radps });
        }
        // Slower, the more it still has to turn.
        let share = 1.0 - off_rad.abs() / (2.0 * MAX_OFF_LINE_RAD);
        let forward_mps = bounded(SPEED_GAIN * remaining_m, MIN_MPS, self.limits.max_mps) * share;
        Some(DriveVelocity { forward_mps, turn_radps })
    }

    /// Returns the turn on the spot to a heading; none where it is reached.
    fn turn_to(&self, state: &DriveState, yaw_rad: f64) -> Option<DriveVelocity> {
        let off_rad = wrap_angle(yaw_rad - state.pose.yaw_rad);
        if off_rad.abs() <= self.limits.tolerance_rad {
            return None;
        }
        let turn_radps = bounded(TURN_GAIN * off_rad, MIN_RADPS, self.limits.max_radps);
        Some(DriveVelocity { forward_mps: 0.0, turn_radps })
    }

    fn ramped(&self, wanted: DriveVelocity, step_s: f64) -> DriveVelocity {
        let before = self.velocity;
        let speed_step_mps = self.limits.max_mps2 * step_s;
        let turn_step_radps = TURN_RAMP_PER_S * self.limits.max_radps * step_s;
        let near = |wanted: f64, before: f64, step: f64| wanted.clamp(before - step, before + step);
        DriveVelocity {
            forward_mps: near(wanted.forward_mps, before.forward_mps, speed_step_mps),
            turn_radps: near(wanted.turn_radps, before.turn_radps, turn_step_radps),
        }
    }
}

fn window_at(state: &DriveState) -> StallWindow {
    StallWindow { since_s: state.time_s, pose: state.pose, commanded_m: 0.0, commanded_rad: 0.0 }
}

/// Returns a value with a size from `low` to `high`.
fn bounded(value: f64, low: f64, high: f64) -> f64 {
    value.signum() * value.abs().max(low).min(high)
}
