//! A robot's own part of a plan: which action it does next, by what others tell of theirs.
//!
//! An action begins when those of others on which it depends are told done ([`DependencyGraph::permission`]). What is done
//! stays done, so a silent robot makes those that wait for it wait, and nobody else.
//!
//! A robot that starts anew finds out by its place how far it was. A robot may be at one place of its path several times; so
//! all robots whose progress is not known take the fewest actions that lead to their places and that others can have
//! relied on: no fewer than others have heard of, and than the actions of others needed. Such numbers of all robots together are
//! a state of the plan, from which it can go on, whatever was before; and as sets of such states are closed under their
//! smallest one, all robots that know the same find the same.
//!
//! [`DependencyGraph::permission`]: sidestep_planners::DependencyGraph::permission

use super::beacon::DriveBeacon;
use super::team_plan::TeamPlan;
use sidestep_kernel::EntityId;
use sidestep_planners::{Action, GridPose, Permission};
use std::fmt;
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// Why a robot stands instead of doing its next action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanHold {
    /// These were not heard yet, and how far it was cannot be told without them.
    Unheard(Vec<EntityId>),
    /// These have to do an action first.
    Others(Vec<EntityId>),
    /// Its place is none of its path, or none that it can have reached.
    OffPlan,
}

impl PlanHold {
    /// Returns the robots for which it waits.
    pub fn robots(&self) -> &[EntityId] {
        match self {
            Self::Unheard(robots) | Self::Others(robots) => robots,
            Self::OffPlan => &[],
        }
    }
}

impl fmt::Display for PlanHold {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids: Vec<String> = self.robots().iter().map(ToString::to_string).collect();
        let ids = ids.join(", ");
        match self {
            Self::Unheard(_) => write!(f, "waits: nothing was heard yet of robots {ids}"),
            Self::Others(_) => write!(f, "waits for robots {ids}, who have to go on first"),
            Self::OffPlan => write!(
                f,
                "stands: it is not where its plan can have led it; put it back on its way, or all robots to their starts"
            ),
        }
    }
}

/// What a robot does now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanOrder {
    /// Its next action.
    Act(Action),
    /// It stands.
    Hold(PlanHold),
    /// It has done all of its actions.
    Complete,
}

/// What was heard of a robot.
#[derive(Debug, Clone, Default)]
struct Told {
    at: Option<GridPose>,
    /// The most actions that it has told to have done; none before it has found out.
    done: Option<u32>,
    /// What it knew of each robot's actions.
    heard_done: Vec<u32>,
}

/// The part of one robot in a plan.
#[derive(Debug)]
pub struct PlanExecutor {
    plan: Arc<TeamPlan>,
    own: usize,
    done: Option<u32>,
    told: Vec<Told>,
}

impl PlanExecutor {
    /// Returns the part of a robot who does not know yet how far it is.
    pub fn new(plan: Arc<TeamPlan>, own: EntityId) -> Self {
        let robots = plan.robots();
        let told = Told { heard_done: vec![0; robots], ..Told::default() };
        Self { plan, own: own as usize, done: None, told: vec![told; robots] }
    }

    /// Returns the plan of all.
    pub fn plan(&self) -> &TeamPlan {
        &self.plan
    }

    /// Returns how many of its actions the robot has done; none before it has found out.
    pub fn done(&self) -> Option<u32> {
        self.done
    }

    /// Returns the number of its actions.
    pub fn actions(&self) -> u32 {
        self.plan.actions(self.own)
    }

    /// Returns whether it has done all of its actions.
    pub fn is_complete(&self) -> bool {
        self.done == Some(self.actions())
    }

    /// Returns whether all robots have done all of their actions, as far as is known.
    pub fn is_complete_for_all(&self) -> bool {
        self.others().all(|robot| self.told[robot].done == Some(self.plan.actions(robot)))
            && self.is_complete()
    }

    /// Returns the robots that have not told yet that they know this robot's end.
    pub fn uninformed(&self) -> Vec<EntityId> {
        let is_uninformed = |&robot: &usize| self.told[robot].heard_done[self.own] < self.actions();
        self.others().filter(is_uninformed).map(|robot| robot as EntityId).collect()
    }

    /// Returns what is known of the actions that others have done, by rising ids.
    pub fn heard_done(&self) -> Vec<(EntityId, u32)> {
        let known = |robot: usize| self.told[robot].done.map(|done| (robot as EntityId, done));
        self.others().filter_map(known).collect()
    }

    /// Takes what another robot tells. More actions than it has are none.
    pub fn hear(&mut self, beacon: &DriveBeacon) {
        let robot = beacon.robot as usize;
        if robot >= self.told.len() || robot == self.own {
            return;
        }
        let is_possible = |robot: usize, done: u32| {
            robot < self.plan.robots() && done <= self.plan.actions(robot)
        };
        let told = &mut self.told[robot];
        told.at = Some(beacon.at);
        // What was done stays done, also where the robot has started anew and does not know it.
        if let Some(done) = beacon.done.filter(|&done| is_possible(robot, done)) {
            told.done = told.done.max(Some(done));
        } else if beacon.done.is_none() && told.done.is_some() {
            // It looks for its place: what it has told stays a lower bound by what this robot has heard.
            let before = told.done.take().unwrap_or(0);
            told.heard_done[robot] = told.heard_done[robot].max(before);
        }
        for &(other, done) in &beacon.heard_done {
            let other = other as usize;
            if is_possible(other, done) {
                self.told[robot].heard_done[other] = self.told[robot].heard_done[other].max(done);
            }
        }
    }

    /// Returns what the robot does at a place. It is asked only between actions.
    pub fn next_order(&mut self, at: GridPose) -> PlanOrder {
        let Some(done) = self.done.or_else(|| self.find_place(at)) else {
            let unheard = self.unheard();
            let is_lost = unheard.is_empty();
            let hold = if is_lost { PlanHold::OffPlan } else { PlanHold::Unheard(unheard) };
            return PlanOrder::Hold(hold);
        };
        let is_next = self.plan.pose_after(self.own, done + 1) == Some(at);
        let done = if is_next { done + 1 } else { done };
        self.done = Some(done);
        // There is one after each number of actions that it can have done.
        let Some(pose) = self.plan.pose_after(self.own, done) else { return PlanOrder::Complete };
        if pose.position() != at.position() {
            return PlanOrder::Hold(PlanHold::OffPlan);
        }
        if pose.heading != at.heading {
            // A turn enters no box, so it may turn back at any time.
            let is_right = (4 + pose.heading - at.heading % 4) % 4 == 3;
            return PlanOrder::Act(if is_right { Action::TurnRight } else { Action::TurnLeft });
        }
        let progress = self.progress(done);
        match self.plan.graph().permission(self.own, &progress) {
            Permission::Complete => PlanOrder::Complete,
            Permission::Wait => PlanOrder::Hold(PlanHold::Others(self.awaited(done, &progress))),
            // Plans have no rings.
            Permission::Go | Permission::GoTogether(_) => {
                let action = self.plan.action_after(self.own, done);
                action.map_or(PlanOrder::Complete, PlanOrder::Act)
            }
        }
    }

    fn others(&self) -> impl Iterator<Item = usize> + use<> {
        let own = self.own;
        (0..self.told.len()).filter(move |&robot| robot != own)
    }

    /// Returns the robots of which nothing was heard since the start.
    fn unheard(&self) -> Vec<EntityId> {
        let is_unheard = |&robot: &usize| self.told[robot].at.is_none();
        self.others().filter(is_unheard).map(|robot| robot as EntityId).collect()
    }

    /// Returns how many actions each robot has done for certain.
    fn progress(&self, own_done: u32) -> Vec<usize> {
        let mut progress = Vec::with_capacity(self.told.len());
        for robot in 0..self.told.len() {
            let done = if robot == self.own { own_done } else { self.least(robot) };
            progress.push(done as usize);
        }
        progress
    }

    /// Returns the actions that a robot has done at least: it has told them, or others have heard of them.
    fn least(&self, robot: usize) -> u32 {
        let heard = self.told.iter().map(|told| told.heard_done[robot]).max().unwrap_or(0);
        self.told[robot].done.unwrap_or(0).max(heard)
    }

    /// Returns the robots that have to do an action before the robot's next one.
    fn awaited(&self, done: u32, progress: &[usize]) -> Vec<EntityId> {
        let mut awaited = Vec::new();
        for (other, index) in self.plan.graph().dependencies(self.own, done as usize) {
            let id = other as EntityId;
            if progress[other] <= index && !awaited.contains(&id) {
                awaited.push(id);
            }
        }
        awaited.sort_unstable();
        awaited
    }

    /// Returns how many actions the robot has done, by its place and what others tell; none if that cannot be told.
    fn find_place(&self, at: GridPose) -> Option<u32> {
        if !self.unheard().is_empty() {
            return None;
        }
        let mut state: Vec<u32> = (0..self.told.len()).map(|robot| self.least(robot)).collect();
        let mut is_known: Vec<bool> = self.told.iter().map(|told| told.done.is_some()).collect();
        is_known[self.own] = false;
        let places: Vec<Option<GridPose>> = self.told.iter().map(|told| told.at).collect();
        loop {
            let mut raised = self.raised_by_needs(&state);
            for robot in 0..raised.len() {
                if is_known[robot] {
                    // One that knows its place has done no less than others needed.
                    if raised[robot] > state[robot] {
                        return None;
                    }
                    continue;
                }
                let place = if robot == self.own { Some(at) } else { places[robot] };
                raised[robot] = self.first_at(robot, place?, raised[robot])?;
            }
            if raised == state {
                return Some(state[self.own]);
            }
            state = raised;
        }
    }

    /// Returns a state with the actions that the actions of others in it needed.
    fn raised_by_needs(&self, state: &[u32]) -> Vec<u32> {
        let mut raised = state.to_vec();
        for (robot, &done) in state.iter().enumerate() {
            for (other, needed) in self.plan.needed_by(robot, done) {
                raised[other] = raised[other].max(needed);
            }
        }
        raised
    }

    /// Returns the fewest actions, and at least some number, after which a robot is at a place.
    fn first_at(&self, robot: usize, place: GridPose, least: u32) -> Option<u32> {
        (least..=self.plan.actions(robot))
            .find(|&done| self.plan.pose_after(robot, done) == Some(place))
    }
}
