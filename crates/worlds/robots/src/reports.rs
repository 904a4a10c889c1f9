//! Robots that report where they are, and what their planner believes in between: that its orders are carried out.
//!
//! A report tells the true pose, and the action or delay that goes on. Without one, the planner takes it that a robot
//! began what it was last ordered to, unless that was late or in an action. Of other bodies it knows nothing.

use crate::plan::TeamSituation;
use crate::purpose;
use crate::team::Team;
use crate::team_memory::TeamMemory;
use crate::world::RobotsWorld;
use sidestep_kernel::Cycle;
use sidestep_kernel::distr::Bernoulli;
use sidestep_planners::{BusyAgent, GridPose};

/// How the robots of a team report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reports {
    /// Actions from one report of a robot to its next one. Robots report in turn, so that in each cycle about equally many
    /// do.
    pub(crate) every_steps: u32,
    /// Whether a report is lost.
    pub(crate) loss: Bernoulli,
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
}

impl Belief {
    /// Returns what is believed a cycle later of a robot without a report, which was ordered to come to a pose by an
    /// action of so many cycles.
    fn after_cycle(self, ordered: Option<GridPose>, action_steps: u32) -> Self {
        if self.delay_steps > 0 {
            return Self { delay_steps: self.delay_steps - 1, ..self };
        }
        let begun = match ordered.filter(|&pose| self.steps_left == 0 && pose != self.pose) {
            Some(pose) => {
                Self { pose, from: self.pose.position(), steps_left: action_steps, ..self }
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

impl RobotsWorld {
    /// Returns what the planner of a team knows in cycle `now`, and remembers it: all that is true without `reports`.
    pub(crate) fn known_situation(
        &self,
        team: &Team,
        memory: &mut TeamMemory,
        truth: TeamSituation,
        now: Cycle,
    ) -> TeamSituation {
        let Some(reports) = &team.leader.reports else { return truth };
        self.take_reports(team, *reports, memory, &truth, now);
        let poses = memory.beliefs.iter().map(|belief| belief.pose).collect();
        let beliefs = (0..).zip(&memory.beliefs);
        let busy = beliefs.filter_map(|(robot, belief)| belief.busy(robot)).collect();
        TeamSituation { poses, busy, is_known: memory.has_reported.clone(), ..Default::default() }
    }

    /// Brings the beliefs about a team up to date with the reports that arrive in cycle `now`.
    fn take_reports(
        &self,
        team: &Team,
        reports: Reports,
        memory: &mut TeamMemory,
        truth: &TeamSituation,
        now: Cycle,
    ) {
        let action_steps = team.leader.config.action_steps.max(1);
        let step = memory.planner.pibt.step;
        let mut true_busy = vec![None; truth.poses.len()];
        for busy in &truth.busy {
            true_busy[busy.agent as usize] = Some(*busy);
        }
        for (robot, id) in team.robots.clone().enumerate() {
            let [word, ..] = self.streams.block(id, now, purpose::REPORT, 0);
            let is_sent = (step + robot as u64).is_multiple_of(u64::from(reports.every_steps));
            // Where they start is known.
            let has_reported = step == 0 || is_sent && !reports.loss.sample(word);
            memory.has_reported[robot] = has_reported;
            let belief = &mut memory.beliefs[robot];
            if !has_reported {
                *belief = belief.after_cycle(memory.planned[robot], action_steps);
                continue;
            }
            let pose = truth.poses[robot];
            let still = Belief { pose, from: pose.position(), steps_left: 0, delay_steps: 0 };
            *belief = match true_busy[robot] {
                Some(BusyAgent { from, steps_left, delay_steps, .. }) => {
                    Belief { from, steps_left, delay_steps, ..still }
                }
                None => still,
            };
        }
    }
}

#[cfg(test)]
mod tests;
