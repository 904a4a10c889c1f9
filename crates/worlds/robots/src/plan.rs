//! *Plan*: teams with common knowledge, whose planner chooses the next action of each robot before anybody claims.
//!
//! The planner is a part of the environment, and privileged, unless its robots report: it knows where all bodies truly
//! stand, and which robots are delayed. It writes each action into the robot's memory, from where the robot's behavior
//! takes it.

use super::belief::Knowledge;
use super::effector::{FORWARD, LEFT, RIGHT, STAY};
use super::goal_distances::GoalDistances;
use super::perceive::memory_of;
use super::state::BodyRecord;
use super::state::RobotsState;
use super::team::{Team, TeamOrders, TeamState};
use super::team_memory::TeamMemory;
use super::team_situation::TeamSituation;
use super::world::{RobotsWorld, Role};
use super::{decide, purpose};
use sidestep_kernel::{Cycle, EntityId, Seed};
use sidestep_map::planning::FreeSpace;
use sidestep_planners::{Action, BusyAgent, GridPose, PlanCounts, TeamStep};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

impl RobotsWorld {
    /// Returns the state of each team before the first cycle.
    pub(crate) fn new_team_states(&self) -> Box<[TeamState]> {
        let free = FreeSpace::from_map(&self.map);
        let mut states = Vec::with_capacity(self.planner_teams.len());
        for team in &self.planner_teams {
            let sizes: Vec<u32> = team.robots.clone().map(|id| self.type_of(id).size.0).collect();
            let [high, low, ..] = self.streams.block(team.robots.start, 0, purpose::PLAN, 0);
            let seed = Seed(u64::from(high) << 32 | u64::from(low));
            let team_state = TeamState::new(&free, &sizes, team, seed);
            states.push(team_state.with_tasks(&free, &sizes, team.tasks.as_deref()));
        }
        states.into()
    }

    /// Prepares the steps to goals of the teams that a caller orders, who observes them.
    pub(crate) fn remember_goal_distances(&mut self) {
        for number in 0..self.planner_teams.len() {
            let team = &self.planner_teams[number];
            if team.leader.orders.is_none() {
                continue;
            }
            let size = self.type_of(team.robots.start).size.0;
            let distances = GoalDistances::new(FreeSpace::from_map(&self.map), size);
            self.planner_teams[number].goal_distances = Some(Arc::new(Mutex::new(distances)));
        }
    }

    /// Plans for each team whose robots are due, after bodies have given up what they left, and delays have
    /// started that are drawn together.
    pub(crate) fn plan(&self, state: &RobotsState, now: Cycle) {
        state.release_boxes(self);
        self.start_team_delays(state, now);
        for (team, team_state) in self.planner_teams.iter().zip(&state.planner_teams) {
            if self.bodies[team.robots.start as usize].is_due(now) {
                self.plan_team(state, team, team_state, now);
            }
        }
    }

    fn plan_team(&self, state: &RobotsState, team: &Team, team_state: &TeamState, now: Cycle) {
        let (mut planner, mut guard) = team_state.locked();
        let memory = &mut *guard;
        let truth = self.situation(state, team);
        memory.compare(&truth.poses);
        let mut situation = self.known_situation(team, memory.knowledge(), truth, now);
        let errands = self.errands(state, team, team_state, &situation.couriers());
        let last = &memory.planner.pibt.goals;
        let choose = || self.choose_goals(state, team, &situation.is_known, last);
        situation.goals = errands.unwrap_or_else(choose);
        let TeamSituation { poses, goals, others, busy, .. } = &situation;
        if team.leader.orders == Some(TeamOrders::Actions) {
            memory.planner.take_orders(goals);
            self.note_orders(state, team, memory, &situation);
            return;
        }
        let now = TeamStep { poses, goals, others, busy };
        let actions = planner.step(&mut memory.planner, now);
        let actions = actions.expect("goals are boxes where the body fits");
        for (robot, (id, &action)) in team.robots.clone().zip(actions).enumerate() {
            let waits = action == Action::Forward && self.must_wait(state, team, &situation, id);
            let action = if waits { Action::Wait } else { action };
            memory.planned[robot] = poses[robot].after(action);
            decide::Avoidance::order(&state.body(id).memory, action_id(action));
        }
    }

    /// Returns whether a robot has to wait before a box that is still held, as far as its planner knows.
    fn must_wait(
        &self,
        state: &RobotsState,
        team: &Team,
        situation: &TeamSituation,
        id: EntityId,
    ) -> bool {
        if team.leader.reports.is_none() {
            return self.is_kept_out(state, id);
        }
        let pose = situation.poses[(id - team.robots.start) as usize];
        let Some(next) = pose.after(Action::Forward) else { return false };
        meets(&situation.held, next.position(), self.type_of(id).size.0, Some(pose.position()))
    }

    /// Notes where the actions lead that a caller has ordered for a team.
    fn note_orders(
        &self,
        state: &RobotsState,
        team: &Team,
        memory: &mut TeamMemory,
        situation: &TeamSituation,
    ) {
        for (robot, id) in team.robots.clone().enumerate() {
            let pose = situation.poses[robot];
            let order = &state.body(id).memory;
            // Its order stands until it can act.
            if situation.busy_agent(robot).is_some() {
                memory.planned[robot] = Some(pose);
                // One that it has got already, and has not carried out since it is late, is gone.
                if team.leader.reports.is_some() {
                    decide::Avoidance::order(order, STAY);
                }
                continue;
            }
            if let Some(belief) = memory.beliefs.robots.get_mut(robot) {
                // An order that it did not carry out, because it was late, is gone: the planner takes it that it did.
                decide::Avoidance::order(order, belief.order.take().unwrap_or(STAY));
            }
            // As those that a planner leads.
            let is_forward = decide::Avoidance::ordered(order) == FORWARD;
            if is_forward && self.must_wait(state, team, situation, id) {
                decide::Avoidance::order(order, STAY);
            }
            let action = planned_action(decide::Avoidance::ordered(order));
            memory.planned[robot] = action.and_then(|action| pose.after(action));
        }
    }

    /// Returns where the robots of a team will be and who is busy in cycle `now`, the next one, as far as its planner will
    /// know.
    pub(crate) fn situation_known(
        &self,
        state: &RobotsState,
        team: &Team,
        team_state: &TeamState,
        now: Cycle,
    ) -> TeamSituation {
        let (_planner, memory) = team_state.locked();
        let mut beliefs = memory.beliefs.clone();
        let step = memory.planner.pibt.step;
        let knowledge = Knowledge { beliefs: &mut beliefs, planned: &memory.planned, step };
        self.known_situation(team, knowledge, self.situation(state, team), now)
    }

    /// Returns what the planner of a team will know in cycle `now`, the next one, if no robot is delayed anew before it.
    pub(crate) fn situation_ahead(
        &self,
        state: &RobotsState,
        team: &Team,
        team_state: &TeamState,
        now: Cycle,
    ) -> TeamSituation {
        let mut situation = self.situation_known(state, team, team_state, now);
        let (planner, memory) = team_state.locked();
        situation.actions_left = planner.actions_left(&memory.planner, &situation.poses);
        let errands = self.errands_ahead(team_state, &situation.couriers());
        let last = &memory.planner.pibt.goals;
        let choose = || self.choose_goals(state, team, &situation.is_known, last);
        situation.goals = errands.unwrap_or_else(choose);
        situation
    }

    /// Returns the poses of a team, which of it are delayed or in an action, and the boxes of all other bodies. Those that a
    /// body of the team leaves are none of them: they will be free, and are waited for.
    fn situation(&self, state: &RobotsState, team: &Team) -> TeamSituation {
        let mut situation =
            TeamSituation { is_known: vec![true; team.robots.len()], ..Default::default() };
        for (slot, body) in state.bodies.iter().enumerate() {
            let is_open = state.is_open_door(self, slot as u32);
            if !team.robots.contains(&body.id) && !is_open {
                let boxes = self.type_of(body.id).boxes(self.map_position(body.position()));
                let rows = boxes.row..boxes.row + boxes.height;
                let cols = boxes.col..boxes.col + boxes.width;
                let all = rows.flat_map(|row| cols.clone().map(move |col| (col, row)));
                situation.others.extend(all);
            }
        }
        for (robot, id) in (0..).zip(team.robots.clone()) {
            let body = state.body(id);
            let (col, row) = self.map_position(body.position());
            situation.poses.push(GridPose::new(col, row, body.facing.get().heading()));
            let steps_left = state.action_progress.left(id);
            let delay_steps = state.delays.remaining(id);
            if steps_left > 0 || delay_steps > 0 {
                let left = state.action_progress.place_left(id);
                let from = left.map_or((col, row), |place| self.map_position(place));
                situation.busy.push(BusyAgent { agent: robot, from, steps_left, delay_steps });
            }
        }
        situation
    }

    /// Returns the goal of each robot: the one that it had as long as it is a goal of its present trip, else the nearest
    /// box where its body fits and does not meet the goal of another one; where there is none, just the nearest. Of a robot
    /// that has not reported it is known only which one it had.
    fn choose_goals(
        &self,
        state: &RobotsState,
        team: &Team,
        is_known: &[bool],
        last: &[Option<(u32, u32)>],
    ) -> Vec<Option<(u32, u32)>> {
        let mut taken = BTreeSet::new();
        let mut goals = vec![None; last.len()];
        let mut undecided = Vec::new();
        for (robot, id) in team.robots.clone().enumerate() {
            let anchors = self.anchors(state, id);
            match last[robot].filter(|goal| !is_known[robot] || anchors.contains(goal)) {
                Some(goal) => {
                    goals[robot] = Some(goal);
                    taken.insert(goal);
                }
                None => undecided.push((robot, id, anchors)),
            }
        }
        for (robot, id, anchors) in undecided {
            let size = self.type_of(id).size.0;
            let at = self.map_position(state.body(id).position());
            let steps = |goal: (u32, u32)| at.0.abs_diff(goal.0) + at.1.abs_diff(goal.1);
            let is_taken = |goal: (u32, u32)| meets(&taken, goal, size, None);
            let nearest = anchors.iter().min_by_key(|&&goal| (is_taken(goal), steps(goal)));
            goals[robot] = nearest.copied();
            taken.extend(nearest);
        }
        goals
    }

    /// Returns the boxes to which a robot may go now.
    fn anchors(&self, state: &RobotsState, id: EntityId) -> &[(u32, u32)] {
        let Role::Robot(model) = &self.type_of(id).role else { return &[] };
        let body = state.body(id);
        let at = self.map_position(body.position());
        model.behaviour.planned_goals(at, &memory_of(body))
    }
}

impl RobotsState {
    /// Returns what the planner of a robot remembers of it, in words; none of a robot that decides alone.
    pub(crate) fn plan_words(&self, world: &RobotsWorld, id: EntityId) -> Vec<u32> {
        let place = place_in_team(world, id);
        place.map_or(Vec::new(), |(team, robot)| self.planner_teams[team].words(robot))
    }

    /// Takes over the tasks and what [`Self::plan_words`] returned for each robot, before a cycle: they are the end of its
    /// record.
    pub(crate) fn restore_plans(&self, world: &RobotsWorld, records: &[BodyRecord], cycle: Cycle) {
        for (team, team_state) in world.planner_teams.iter().zip(&self.planner_teams) {
            let mut shares = Vec::new();
            for id in team.robots.clone() {
                let words_before = world.kinds.len()
                    + self.delays.words(id).count()
                    + self.action_progress.words(id).count();
                let words = records[id as usize].contacts.get(words_before..);
                shares.push(self.restore_task(world, id, words.unwrap_or_default()));
            }
            let step = world.bodies[team.robots.start as usize].actions_before(cycle);
            team_state.restore(&shares, step);
        }
    }

    /// Returns what became of the plans of all teams so far.
    pub(crate) fn plan_counts(&self) -> PlanCounts {
        let mut total = PlanCounts::default();
        for team in &self.planner_teams {
            total += team.counts();
        }
        total
    }

    /// Returns how often a robot was elsewhere than planned.
    pub(crate) fn off_plan(&self, world: &RobotsWorld, id: EntityId) -> u32 {
        let place = place_in_team(world, id);
        place.map_or(0, |(team, robot)| self.planner_teams[team].off_plan(robot))
    }
}

/// Returns a robot's place in the list of teams, and within its team; none for one that decides alone.
pub(crate) fn place_in_team(world: &RobotsWorld, id: EntityId) -> Option<(usize, usize)> {
    let team = world.planner_teams.iter().position(|team| team.robots.contains(&id))?;
    Some((team, (id - world.planner_teams[team].robots.start) as usize))
}

/// Returns whether a body at a place covers a box that one of the same size does at another one, its own left out.
fn meets(
    taken: &BTreeSet<(u32, u32)>,
    (col, row): (u32, u32),
    size: u32,
    own: Option<(u32, u32)>,
) -> bool {
    let reach = size - 1;
    let rows = row.saturating_sub(reach)..=row + reach;
    for other_col in col.saturating_sub(reach)..=col + reach {
        let in_col = taken.range((other_col, *rows.start())..=(other_col, *rows.end()));
        if in_col.into_iter().any(|&other| Some(other) != own) {
            return true;
        }
    }
    false
}

/// Returns an action by its number among those that robots have for planners, in the order of these numbers.
pub(crate) fn action_of_order(number: u8) -> Action {
    planned_action(number).unwrap_or(Action::Wait)
}

/// Returns the number that an action of a planner has among those of a robot.
pub(crate) fn action_id(action: Action) -> decide::ActionId {
    match action {
        Action::Forward => FORWARD,
        Action::TurnLeft => LEFT,
        Action::TurnRight => RIGHT,
        // Robots have headings, so no planner of theirs moves them sideways.
        Action::Wait | Action::Move(_) => STAY,
    }
}

/// Returns what an action is for a planner; none of one that is not among the standard ones.
fn planned_action(action: decide::ActionId) -> Option<Action> {
    let actions = [Action::Forward, Action::TurnLeft, Action::TurnRight, Action::Wait];
    actions.into_iter().find(|&one| action_id(one) == action)
}

#[cfg(test)]
mod tests;
