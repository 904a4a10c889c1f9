//! Robots that report where they are, and what their planner believes in between: that its orders are carried out.
//!
//! A report tells the true pose, and the action or delay that goes on. Without one, the planner takes it that a robot
//! began what it was last ordered to, unless that was late or in an action. Of other bodies it knows nothing.

use crate::plan::TeamSituation;
use crate::purpose;
use crate::team::Team;
use crate::world::RobotsWorld;
use sidestep_kernel::distr::Bernoulli;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_map::{Cell, Rect};
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
    has_reported: Vec<bool>,
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
    /// The action that a caller has ordered and the robot has not got yet, and 1; 0 without.
    pub(crate) order: u32,
}

/// How long things take at which a planner looks.
#[derive(Clone, Copy)]
struct TurnLengths {
    /// Cycles from one turn of the planner to the next.
    period: u32,
    /// Cycles of an action.
    action: u32,
}

impl Beliefs {
    /// Creates those about a number of robots before the first cycle, in which all report.
    pub(crate) fn new(robots: usize) -> Self {
        Self { robots: vec![Belief::default(); robots], has_reported: vec![false; robots] }
    }
}

impl Belief {
    /// Returns what is true of a robot.
    fn of_truth(pose: GridPose, busy: Option<&BusyAgent>, order: u32) -> Self {
        let still = Self { pose, from: pose.position(), steps_left: 0, delay_steps: 0, order };
        match busy {
            Some(&BusyAgent { from, steps_left, delay_steps, .. }) => {
                Self { from, steps_left, delay_steps, ..still }
            }
            None => still,
        }
    }

    /// Returns what is believed a turn later of a robot without a report, which was ordered to come to a pose.
    fn after_turn(self, ordered: Option<GridPose>, lengths: TurnLengths) -> Self {
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

    fn busy(&self, agent: u32) -> Option<BusyAgent> {
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

impl RobotsWorld {
    /// Returns what the planner of a team knows in cycle `now`, and brings its beliefs up to date: all that is true without
    /// reports.
    pub(crate) fn known_situation(
        &self,
        team: &Team,
        knowledge: Knowledge<'_>,
        truth: TeamSituation,
        now: Cycle,
    ) -> TeamSituation {
        let Some(reports) = &team.leader.reports else { return truth };
        let Knowledge { beliefs, planned, step } = knowledge;
        self.update_beliefs(team, *reports, Knowledge { beliefs, planned, step }, &truth, now);
        let poses = beliefs.robots.iter().map(|belief| belief.pose).collect();
        let robots = (0..).zip(&beliefs.robots);
        let busy = robots.filter_map(|(robot, belief)| belief.busy(robot)).collect();
        // Where an action takes one cycle, the world decides who may follow whom.
        let has_long_actions = team.leader.config.action_steps > 1;
        let places = beliefs.robots.iter().flat_map(|one| [one.pose.position(), one.from]);
        let held = places.filter(|_| has_long_actions).collect();
        let is_known = beliefs.has_reported.clone();
        TeamSituation { poses, busy, held, is_known, ..Default::default() }
    }

    /// Takes in the reports that arrive in cycle `now`, and moves the beliefs about all others on.
    fn update_beliefs(
        &self,
        team: &Team,
        reports: Reports,
        knowledge: Knowledge<'_>,
        truth: &TeamSituation,
        now: Cycle,
    ) {
        let Knowledge { beliefs, planned, step } = knowledge;
        let timing = &self.bodies[team.robots.start as usize];
        let lengths =
            TurnLengths { period: timing.period, action: team.leader.config.action_steps.max(1) };
        let is_turn = timing.is_due(now);
        for (robot, id) in team.robots.clone().enumerate() {
            let [word, ..] = self.streams.block(id, now, purpose::REPORT, 0);
            // Robots report at their turns alone.
            let is_sent = is_turn && (step + robot as u64).is_multiple_of(reports.every_steps);
            // Where they start is known.
            let has_reported = step == 0 || is_sent && !reports.loss.sample(word);
            beliefs.has_reported[robot] = has_reported;
            let belief = &mut beliefs.robots[robot];
            *belief = if has_reported {
                Belief::of_truth(truth.poses[robot], truth.busy_agent(robot), belief.order)
            } else {
                // An order of a caller may lead into a wall, or off the map, which is known.
                let ordered = planned[robot].filter(|&pose| self.fits_on_map(id, pose));
                belief.after_turn(ordered, lengths)
            };
        }
    }

    /// Returns whether the body of a robot at a pose would be on free boxes of the map alone.
    fn fits_on_map(&self, id: EntityId, pose: GridPose) -> bool {
        let Rect { col, row, width, height } = self.type_of(id).boxes(pose.position());
        let is_inside = col + width <= self.map.width() && row + height <= self.map.height();
        let mut boxes =
            (row..row + height).flat_map(|row| (col..col + width).map(move |col| (col, row)));
        is_inside && boxes.all(|(col, row)| self.map.cell(col, row) == Cell::Free)
    }
}

#[cfg(test)]
mod tests;
