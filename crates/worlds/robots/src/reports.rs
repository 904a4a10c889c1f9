//! Robots that report where they are, and what their planner believes in between: that its orders are carried out.
//!
//! A report tells the true pose, and the action or delay that goes on. Without one, the planner takes it that a robot
//! began what it was last ordered to, unless that was late or in an action. Of other bodies it knows nothing.

use crate::belief::{Belief, Knowledge, TurnLengths};
use crate::purpose;
use crate::team::Team;
use crate::team_situation::TeamSituation;
use crate::world::RobotsWorld;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_map::{Cell, Rect};
use sidestep_planners::GridPose;

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
        if team.leader.reports.is_none() {
            return truth;
        }
        let Knowledge { beliefs, planned, step } = knowledge;
        self.update_beliefs(team, Knowledge { beliefs, planned, step }, &truth, now);
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
        knowledge: Knowledge<'_>,
        truth: &TeamSituation,
        now: Cycle,
    ) {
        let Some(reports) = &team.leader.reports else { return };
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
