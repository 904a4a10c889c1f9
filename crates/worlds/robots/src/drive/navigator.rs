//! Actions that a navigator carries out, such as Nav2: it is told where an action ends, finds its way there, and keeps clear of
//! what it sees.
//!
//! What it does is known by the robot's poses alone. A robot that stands on its way for long was stopped by something: as after
//! any contact, it goes back to where the action began.

use super::controller::{ActionOutcome, ActionProgress, DriveState};
use super::grid::{BodyGrid, Pose2};
use super::plan::MotionPlan;
use crate::decide::Contact;
use crate::effector::Side;
use sidestep_kernel::math::{cos, hypot, sin, wrap_angle};

/// When an action of a navigator counts as done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigatorLimits {
    /// Largest distance from the end of an action, in meters: beyond that at which the navigator itself is content.
    pub tolerance_m: f64,
    /// Largest angle from the heading at the end of an action, in radians.
    pub tolerance_rad: f64,
    /// Time in seconds for which a robot may stand on its way before it counts as stopped by something.
    pub stall_s: f64,
    /// Time in seconds of standing on the way after which a goal is sent again: it may have been lost.
    pub resend_s: f64,
    /// Time in seconds of an action that waits.
    pub cycle_s: f64,
    /// Time in seconds after which an action ends where it is.
    pub action_timeout_s: f64,
}

/// Where a navigator is to bring its robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigatorGoal {
    /// The pose in the frame of the map.
    pub pose: Pose2,
    /// Grows with each goal of an action, and when one is to be sent again.
    pub number: u32,
}

/// What a navigator is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NavigatorOrder {
    /// Go on with what it does, or rest.
    Keep,
    /// Bring the robot there.
    Goal(NavigatorGoal),
    /// Give up its goal, and let the robot stand.
    Stop,
}

/// The change of a pose below which a robot stands, in meters and radians: more than the noise of localization.
const STANDING_M: f64 = 0.05;
const STANDING_RAD: f64 = 0.1;

/// The longest time between two measurements that counts as one, in seconds.
const MAX_STEP_S: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing moves until the time of a cycle is over.
    Wait,
    Go,
    /// Back to the start, after a contact.
    Return,
}

/// One action of a robot that a navigator leads.
#[derive(Debug, Clone)]
pub struct NavigatorAction {
    limits: NavigatorLimits,
    plan: MotionPlan,
    start: Pose2,
    target: Pose2,
    /// What stands in the way where the map has nothing.
    unknown_kind: u8,
    phase: Phase,
    /// Number of the present goal.
    number: u32,
    began_s: f64,
    last_s: f64,
    was_touching: bool,
    contact: Option<Contact>,
    /// Where the robot was when it moved last, and when.
    rest: (Pose2, f64),
    /// When the present goal was sent last.
    sent_s: f64,
}

impl NavigatorAction {
    /// Starts an action, whose goals have numbers from `number` on. `unknown_kind` is the kind of what stops it where the map
    /// has nothing.
    pub fn start(
        limits: NavigatorLimits,
        grid: &BodyGrid,
        plan: MotionPlan,
        state: &DriveState,
        unknown_kind: u8,
        number: u32,
    ) -> Self {
        Self {
            limits,
            plan,
            start: grid.center(plan.start),
            target: grid.center(plan.target),
            unknown_kind,
            phase: if plan.is_rest() { Phase::Wait } else { Phase::Go },
            number,
            began_s: state.time_s,
            last_s: state.time_s,
            was_touching: state.is_touching,
            contact: None,
            rest: (state.pose, state.time_s),
            sent_s: state.time_s,
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

    /// Returns the number of its last goal.
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Takes the next measurement.
    pub fn update(&mut self, state: &DriveState) -> ActionProgress {
        if state.time_s - self.last_s > MAX_STEP_S {
            // Nothing was measured for a while, in which the robot was told to stand.
            self.rest = (state.pose, state.time_s);
        }
        self.last_s = state.time_s;
        self.find_contact(state);
        let is_timed_out = self.duration_s() > self.limits.action_timeout_s;
        let goal = match self.phase {
            Phase::Wait => None,
            Phase::Go => Some(self.target),
            Phase::Return => Some(self.start),
        };
        let is_done = match goal {
            None => self.duration_s() >= self.limits.cycle_s,
            Some(goal) => self.is_at(&goal, &state.pose),
        };
        if is_done || is_timed_out {
            let contact = self.contact.or(self.plan.contact);
            return ActionProgress::Done(ActionOutcome { contact, is_timed_out: !is_done });
        }
        let order = match goal {
            Some(pose) => NavigatorOrder::Goal(NavigatorGoal { pose, number: self.number }),
            // It could not go back, and would try that on.
            None if self.contact.is_some() => NavigatorOrder::Stop,
            None => NavigatorOrder::Keep,
        };
        ActionProgress::Navigating(order)
    }

    fn is_at(&self, goal: &Pose2, pose: &Pose2) -> bool {
        let [dx_m, dy_m] = [0, 1].map(|k| goal.at_m[k] - pose.at_m[k]);
        let off_rad = wrap_angle(goal.yaw_rad - pose.yaw_rad).abs();
        hypot(dx_m, dy_m) <= self.limits.tolerance_m && off_rad <= self.limits.tolerance_rad
    }

    /// Goes back to the start at the first contact; a robot that cannot go back stays.
    fn find_contact(&mut self, state: &DriveState) {
        let is_new_touch = state.is_touching && !self.was_touching;
        self.was_touching = state.is_touching;
        let [dx_m, dy_m] = [0, 1].map(|k| state.pose.at_m[k] - self.rest.0.at_m[k]);
        let turned_rad = wrap_angle(state.pose.yaw_rad - self.rest.0.yaw_rad).abs();
        if hypot(dx_m, dy_m) > STANDING_M || turned_rad > STANDING_RAD {
            self.rest = (state.pose, state.time_s);
        }
        let stood_s = state.time_s - self.rest.1;
        let is_stopped = stood_s >= self.limits.stall_s;
        match self.phase {
            Phase::Wait => {}
            Phase::Go if is_new_touch || is_stopped => {
                self.contact = Some(Contact { kind: self.unknown_kind, side: self.side() });
                self.phase = Phase::Return;
                self.send_again(state);
                self.rest = (state.pose, state.time_s);
            }
            // It stands somewhere: where that is, the next percept says.
            Phase::Return if is_stopped => self.phase = Phase::Wait,
            Phase::Go | Phase::Return => {
                let is_lost = stood_s >= self.limits.resend_s
                    && state.time_s - self.sent_s >= self.limits.resend_s;
                if is_lost {
                    self.send_again(state);
                }
            }
        }
    }

    fn send_again(&mut self, state: &DriveState) {
        self.number += 1;
        self.sent_s = state.time_s;
    }

    /// Returns the side with which it goes ahead.
    fn side(&self) -> Side {
        let [dx_m, dy_m] = [0, 1].map(|k| self.target.at_m[k] - self.start.at_m[k]);
        let yaw_rad = self.start.yaw_rad;
        let is_back = dx_m * cos(yaw_rad) + dy_m * sin(yaw_rad) < 0.0;
        if is_back { Side::Back } else { Side::Front }
    }
}
