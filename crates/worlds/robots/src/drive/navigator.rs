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

#[cfg(test)]
mod tests {
    use super::super::plan::ActionPlanner;
    use super::*;
    use crate::robots_run;
    use crate::sensor::WALL;
    use sidestep_planners::GridPose;
    use sidestep_scenario::Source;

    const FLOOR: &str = "format = 1\nworld = \"robots\"\nseed = 1\ncycles = 1\n[map]\nbox_size_m = 0.5\nascii = \"\"\"\n\
        .....\n.....\n\"\"\"\n[[robots]]\nat = [[1, 0, 0]]\neffector = \"nomad\"\n";

    const LIMITS: NavigatorLimits = NavigatorLimits {
        tolerance_m: 0.15,
        tolerance_rad: 0.3,
        stall_s: 10.0,
        resend_s: 4.0,
        cycle_s: 1.0,
        action_timeout_s: 60.0,
    };

    /// The number of the goal of an action that follows four goals.
    const FIRST: u32 = 5;

    /// Starts an action in the middle of box 1, facing east.
    fn action(number: u8) -> (NavigatorAction, DriveState) {
        let run = robots_run(&Source::new("s.toml", FLOOR, ""), 1).expect("a scenario");
        let grid = BodyGrid::new(run.world(), 0).expect("a robot");
        let planner = ActionPlanner::new(run.world(), 0).expect("two wheels");
        let plan = planner.plan(number, GridPose { col: 1, row: 0, heading: 0 });
        let pose = Pose2 { at_m: [0.75, 0.25], yaw_rad: 0.0 };
        let state = DriveState { time_s: 0.0, pose, is_touching: false };
        (NavigatorAction::start(LIMITS, &grid, plan, &state, WALL, FIRST), state)
    }

    fn at(state: &DriveState, time_s: f64, x_m: f64) -> DriveState {
        let pose = Pose2 { at_m: [x_m, 0.25], ..state.pose };
        DriveState { time_s, pose, ..*state }
    }

    fn goal(progress: ActionProgress) -> ([f64; 2], u32) {
        match progress {
            ActionProgress::Navigating(NavigatorOrder::Goal(goal)) => (goal.pose.at_m, goal.number),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_goal_is_where_the_action_ends_and_is_sent_again_to_a_robot_that_stands() {
        let (mut action, state) = action(crate::effector::FORWARD);
        assert_eq!(goal(action.update(&at(&state, 0.1, 0.75))), ([1.25, 0.25], FIRST));
        let mut numbers = Vec::new();
        for step in 1..90 {
            numbers.push(goal(action.update(&at(&state, 0.1 * f64::from(step), 0.75))).1);
        }
        numbers.dedup();
        assert_eq!(numbers, [FIRST, FIRST + 1, FIRST + 2]);
        assert_eq!(goal(action.update(&at(&state, 9.1, 0.9))), ([1.25, 0.25], FIRST + 2));
        let near = action.update(&at(&state, 9.2, 1.15));
        let arrived = ActionOutcome { contact: None, is_timed_out: false };
        assert_eq!(near, ActionProgress::Done(arrived));
        assert_eq!(action.number(), FIRST + 2);
    }

    #[test]
    fn a_robot_that_stands_for_long_is_sent_back_and_given_up_where_it_cannot_go_back() {
        let (mut action, state) = action(crate::effector::FORWARD);
        let mut ends = Vec::new();
        for step in 1..300 {
            let time_s = 0.1 * f64::from(step);
            match action.update(&at(&state, time_s, 1.0)) {
                ActionProgress::Navigating(NavigatorOrder::Goal(goal)) => ends.push(goal.pose.at_m),
                ActionProgress::Done(outcome) => {
                    let contact = outcome.contact.expect("something was in its way");
                    assert_eq!((contact.side, outcome.is_timed_out), (Side::Front, false));
                    ends.dedup();
                    assert_eq!(ends, [[1.25, 0.25], [0.75, 0.25]]);
                    return;
                }
                other => panic!("{other:?}"),
            }
        }
        panic!("it never ends");
    }

    #[test]
    fn a_new_touch_is_a_contact_and_an_old_one_is_none() {
        let (mut action, state) = action(crate::effector::FORWARD);
        let touching = DriveState { is_touching: true, ..at(&state, 0.1, 0.9) };
        assert_eq!(goal(action.update(&touching)), ([0.75, 0.25], FIRST + 1));
        let back = DriveState { is_touching: true, ..at(&state, 0.2, 0.85) };
        let ActionProgress::Done(outcome) = action.update(&back) else { panic!("it is back") };
        assert!(outcome.contact.is_some());
    }
}
