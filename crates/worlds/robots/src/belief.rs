//! What a planner believes of robots that report: that its orders are carried out.

use crate::effector::ActionId;
use sidestep_kernel::distr::Bernoulli;
use sidestep_planners::{BusyAgent, GridPose};

/// How the robots of a team report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reports {
    /// Turns of the planner from one report of a robot to its next one. Robots report one after the other, so that at
    /// each turn about equally many do.
    pub(crate) every_steps: u64,
    /// Whether a report is lost.
    pub(crate) loss: Bernoulli,
}

/// What a planner believes of its robots.
#[derive(Debug, Clone, Default)]
pub(crate) struct Beliefs {
    /// By robot; empty for a planner that knows all that is true.
    pub(crate) robots: Vec<Belief>,
    /// Whether each robot has reported in the present cycle; no state, because it is set anew in each one.
    pub(crate) has_reported: Vec<bool>,
}

/// What a planner believes of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Belief {
    /// Its pose, or that to which its action leads.
    pub(crate) pose: GridPose,
    /// The place that it leaves; its own between actions.
    pub(crate) from: (u32, u32),
    /// Cycles until its action ends.
    pub(crate) steps_left: u32,
    /// Cycles of delay left.
    pub(crate) delay_steps: u32,
    /// The action that a caller has ordered and the robot has not got yet.
    pub(crate) order: Option<ActionId>,
}

/// The lengths of a turn of the planner and of an action.
#[derive(Clone, Copy)]
pub(crate) struct TurnLengths {
    /// Cycles from one turn of the planner to the next.
    pub(crate) period: u32,
    /// Cycles of an action.
    pub(crate) action: u32,
}

impl Beliefs {
    /// Creates those about a number of robots before the first cycle, in which all report.
    pub(crate) fn new(robots: usize) -> Self {
        Self { robots: vec![Belief::default(); robots], has_reported: vec![false; robots] }
    }
}

impl Belief {
    /// Returns what is true of a robot.
    pub(crate) fn of_truth(
        pose: GridPose,
        busy: Option<&BusyAgent>,
        order: Option<ActionId>,
    ) -> Self {
        let still = Self { pose, from: pose.position(), steps_left: 0, delay_steps: 0, order };
        match busy {
            Some(&BusyAgent { from, steps_left, delay_steps, .. }) => {
                Self { from, steps_left, delay_steps, ..still }
            }
            None => still,
        }
    }

    /// Returns what is believed a turn later of a robot without a report, which was ordered to come to a pose.
    pub(crate) fn after_turn(self, ordered: Option<GridPose>, lengths: TurnLengths) -> Self {
        if self.delay_steps > 0 {
            return Self { delay_steps: self.delay_steps.saturating_sub(lengths.period), ..self };
        }
        let begun = match ordered.filter(|&pose| self.steps_left == 0 && pose != self.pose) {
            Some(pose) => {
                Self { pose, from: self.pose.position(), steps_left: lengths.action, ..self }
            }
            None => self,
        };
        let steps_left = begun.steps_left.saturating_sub(1);
        let from = if steps_left > 0 { begun.from } else { begun.pose.position() };
        Self { from, steps_left, ..begun }
    }

    /// Returns why the robot cannot act, as far as is believed.
    pub(crate) fn busy(&self, agent: u32) -> Option<BusyAgent> {
        let Self { from, steps_left, delay_steps, .. } = *self;
        let is_busy = steps_left > 0 || delay_steps > 0;
        is_busy.then_some(BusyAgent { agent, from, steps_left, delay_steps })
    }
}

/// What a planner believed at its last turn, and the orders that it gave then.
pub(crate) struct Knowledge<'a> {
    pub(crate) beliefs: &'a mut Beliefs,
    /// Where the orders should have led.
    pub(crate) planned: &'a [Option<GridPose>],
    /// Turns of the planner so far.
    pub(crate) step: u64,
}
