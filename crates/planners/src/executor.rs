//! Carrying out a plan by agents that may be late, or slip: which action each does next, and when a plan has to be made
//! anew.
//!
//! An executor is told where the agents are before each step. What it knows of a plan is an [`Execution`], all of
//! which can be kept and taken up again.

use crate::dependency_graph::DependencyGraph;
use crate::plan::Plan;
use crate::pose::{Action, ActionModel, GridPose};
use serde::{Deserialize, Serialize};

/// Actions' time without progress of anybody after which a plan whose order is kept is given up: something that the plan
/// does not know stands in the way. Longer than most delays of a robot, of which all behind it would make a new plan.
const MAX_STALL_ACTIONS: u32 = 16;

/// The rule by which a plan is carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Executor {
    /// By the clock, whatever has come of the actions before.
    Blind,
    /// In the order in which the plan's agents pass each box, by its [`DependencyGraph`]: an agent waits until those that
    /// pass before it have. A plan is made anew where an agent is nowhere on its path.
    #[default]
    Adg,
    /// By the clock, and the plan is made anew every so many steps, and as soon as an agent is off its plan by more than
    /// so much.
    Replan {
        /// Steps for which a plan is used.
        every_steps: u32,
        /// Boxes and quarter turns by which an agent may be off its plan.
        max_deviation: u32,
    },
}

/// A plan in the course of being carried out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Execution {
    /// The plan.
    pub plan: Plan,
    /// Steps since it began.
    pub step: u32,
    /// Actions that each agent has done, waits aside; only [`Executor::Adg`] counts them.
    pub progress: Vec<u32>,
    /// The most actions that each agent had done at any time: more than `progress` where one has turned out to be behind.
    pub furthest: Vec<u32>,
    /// Steps since an agent has last made progress.
    pub stall_steps: u32,
}

/// What an executor knows beside the plan itself in a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Execute<'a> {
    pub(crate) executor: Executor,
    pub(crate) model: ActionModel,
    /// The order of the plan's actions.
    pub(crate) graph: &'a DependencyGraph,
    /// Whether an agent can enter a box that another one leaves in the same step.
    pub(crate) may_follow: bool,
    /// Whether an agent may turn out to be behind where it was taken to be.
    pub(crate) may_fall_back: bool,
    /// Steps that an action takes.
    pub(crate) action_steps: u32,
}

impl Execution {
    /// Creates what is known of a plan before its first step.
    pub fn new(plan: Plan) -> Self {
        let progress = vec![0; plan.agents()];
        Self { plan, step: 0, furthest: progress.clone(), progress, stall_steps: 0 }
    }

    /// Takes in where the agents have come to with the last step. Returns whether the plan can go on.
    pub(crate) fn advance(&mut self, by: &Execute<'_>, poses: &[GridPose]) -> bool {
        self.step += 1;
        match by.executor {
            Executor::Blind => true,
            Executor::Replan { every_steps, max_deviation } => {
                self.step < every_steps && self.deviation(poses) <= max_deviation
            }
            Executor::Adg => self.advance_in_order(by, poses),
        }
    }

    fn advance_in_order(&mut self, by: &Execute<'_>, poses: &[GridPose]) -> bool {
        let graph = by.graph;
        self.stall_steps += 1;
        for (agent, (&pose, progress)) in poses.iter().zip(&mut self.progress).enumerate() {
            let done = *progress as usize;
            if graph.action(agent, done).is_some_and(|(_, after)| after == pose) {
                *progress += 1;
                // What is done again is no progress, or a plan that something stands in the way of would never end.
                if *progress > self.furthest[agent] {
                    self.furthest[agent] = *progress;
                    self.stall_steps = 0;
                }
                continue;
            }
            let pose_after = |done: usize| match done.checked_sub(1) {
                Some(last) => graph.action(agent, last).map(|(_, after)| after),
                None => Some(self.plan.pose(agent, 0)),
            };
            if pose_after(done) == Some(pose) {
                continue;
            }
            let earlier = if by.may_fall_back { 0..done } else { 0..0 };
            let mut earlier = earlier.rev();
            match earlier.find(|&done| pose_after(done) == Some(pose)) {
                Some(done) => *progress = done as u32,
                None => return false,
            }
        }
        !self.is_stalled(by)
    }

    /// Returns whether nobody has made progress for too long. Whoever has no action left cannot make any.
    pub(crate) fn is_stalled(&self, by: &Execute<'_>) -> bool {
        // An agent that is behind needs its time to get to where it was taken to be.
        let behind = self.furthest.iter().zip(&self.progress);
        let behind = behind.map(|(&furthest, &progress)| furthest - progress).max().unwrap_or(0);
        let max_stall_steps = (MAX_STALL_ACTIONS + behind).saturating_mul(by.action_steps.max(1));
        self.stall_steps >= max_stall_steps && !self.is_complete(by.graph)
    }

    fn is_complete(&self, graph: &DependencyGraph) -> bool {
        let mut progress = self.progress.iter().enumerate();
        progress.all(|(agent, &done)| done as usize >= graph.actions(agent))
    }

    /// Returns by how much the agent that is farthest off its plan is.
    fn deviation(&self, poses: &[GridPose]) -> u32 {
        let step = self.step as usize;
        let deviations = poses.iter().enumerate();
        deviations
            .map(|(agent, &pose)| pose.steps_off(self.plan.pose(agent, step)))
            .max()
            .unwrap_or(0)
    }

    /// Returns the poses that are still ahead of an agent, from the one that its plan has for it now.
    pub(crate) fn path_ahead(&self, by: &Execute<'_>, agent: usize) -> Vec<GridPose> {
        if by.executor != Executor::Adg {
            let step = (self.step as usize).min(self.plan.steps());
            return self.plan.path(agent)[step..].to_vec();
        }
        let done = self.progress[agent] as usize;
        let pose_after = |index: usize| by.graph.action(agent, index).map(|(_, pose)| pose);
        let before = done.checked_sub(1).and_then(pose_after);
        let mut path = vec![before.unwrap_or(self.plan.pose(agent, 0))];
        path.extend((done..by.graph.actions(agent)).filter_map(pose_after));
        path
    }

    /// Returns the agents, by rising number, that have to do an action before an agent may do its next one, or together with
    /// it and cannot yet.
    pub(crate) fn agents_before(&self, by: &Execute<'_>, agent: usize) -> Vec<usize> {
        let index = self.progress[agent] as usize;
        if by.executor != Executor::Adg || index >= by.graph.actions(agent) {
            return Vec::new();
        }
        let is_open = |&(other, action): &(usize, usize)| self.progress[other] as usize <= action;
        let open = by.graph.dependencies(agent, index).filter(is_open);
        let mut others: Vec<usize> = open.map(|(other, _)| other).collect();
        if let Some((number, circle)) = by.graph.circle(agent, index) {
            let is_elsewhere = |&other: &usize| {
                let next = self.progress[other] as usize;
                by.graph.circle(other, next).is_none_or(|(other_number, _)| other_number != number)
            };
            others.extend(circle.iter().map(|&other| other as usize).filter(is_elsewhere));
        }
        others.sort_unstable();
        others.dedup();
        others
    }

    /// Returns whether the plan has no steps left, whoever has done them.
    pub(crate) fn is_over(&self, by: &Execute<'_>) -> bool {
        match by.executor {
            Executor::Adg => self.is_complete(by.graph),
            Executor::Blind | Executor::Replan { .. } => self.step as usize >= self.plan.steps(),
        }
    }

    /// Returns the next action of each agent; `idle` agents cannot act in this step.
    pub(crate) fn actions(&self, by: &Execute<'_>, idle: &[u32]) -> Vec<Action> {
        if by.executor == Executor::Adg {
            return self.actions_in_order(by, idle);
        }
        let step = self.step as usize;
        let action = |agent| {
            let [from, to] = [step, step + 1].map(|step| self.plan.pose(agent, step));
            by.model.action_between(from, to).unwrap_or(Action::Wait)
        };
        (0..self.plan.agents()).map(action).collect()
    }

    /// Returns the next actions of those who may begin theirs. Where agents may follow each other, all whose turn it is go
    /// on together with those for whom they wait: at first all may go, then whoever waits for one that does not is left
    /// out, until nobody is. So queues and circles move as one.
    fn actions_in_order(&self, by: &Execute<'_>, idle: &[u32]) -> Vec<Action> {
        let agents = self.progress.len();
        let next = |agent: usize| by.graph.action(agent, self.progress[agent] as usize);
        let mut may_go: Vec<bool> = (0..agents)
            .map(|agent| next(agent).is_some() && !idle.contains(&(agent as u32)))
            .collect();
        loop {
            let must_wait: Vec<usize> = (0..agents)
                .filter(|&agent| may_go[agent] && !self.is_free(by, agent, &may_go))
                .collect();
            if must_wait.is_empty() {
                break;
            }
            must_wait.iter().for_each(|&agent| may_go[agent] = false);
        }
        let action =
            |agent: usize| if may_go[agent] { next(agent).map(|(action, _)| action) } else { None };
        (0..agents).map(|agent| action(agent).unwrap_or(Action::Wait)).collect()
    }

    /// Returns whether all that an agent's next action waits for is done, or done in this step by one that may go.
    fn is_free(&self, by: &Execute<'_>, agent: usize, may_go: &[bool]) -> bool {
        let index = self.progress[agent] as usize;
        let is_done = |(other, action): (usize, usize)| {
            let done = self.progress[other] as usize;
            done > action || (by.may_follow && done == action && may_go[other])
        };
        // Those who rotate do not depend on each other in the graph, but none can go without the others.
        let is_whole = by.graph.circle(agent, index).is_none_or(|(number, agents)| {
            agents.iter().all(|&other| {
                let next = self.progress[other as usize] as usize;
                let circle = by.graph.circle(other as usize, next);
                may_go[other as usize]
                    && circle.is_some_and(|(other_number, _)| other_number == number)
            })
        });
        is_whole && by.graph.dependencies(agent, index).all(is_done)
    }
}
