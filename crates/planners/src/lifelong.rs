//! Agents that carry out tasks without end, tick by tick, although some are late.
//!
//! A step forward or a turn takes several ticks. An agent on its way from one box to the next holds both, and nobody
//! enters a box that is held ([`TickPlanner`]): so no two bodies overlap, whatever the delays. A delayed agent
//! stands still, in the midst of an action or between two.

use crate::assignment::CostMatrix;
use crate::goal_fields::straight_steps;
use crate::graph::NONE;
use crate::pose::Action;
use crate::tasks::{TaskList, TaskPolicy, TaskState};
pub use crate::tick_planner::LifelongAgent;
use crate::tick_planner::TickPlanner;
use serde::{Deserialize, Serialize};
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::FreeSpace;

/// Most pairs of agents and tasks that are compared in one tick by true steps.
const MAX_PAIRS: usize = 1 << 18;

/// All that changes from tick to tick, beside the steps to goals that are known so far ([`Lifelong::resume`]).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LifelongState {
    /// The number of ticks so far.
    pub tick: u64,
    /// The agents.
    pub agents: Vec<LifelongAgent>,
    /// Their tasks.
    pub tasks: TaskState,
}

/// The settings of [`Lifelong`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LifelongConfig {
    /// Ticks that a step forward or a turn takes.
    pub ticks_per_action: u32,
    /// How tasks are given to agents.
    pub policy: TaskPolicy,
    /// The seed of the draws between equal boxes.
    pub seed: Seed,
    /// Most bytes kept for the steps to goals.
    pub max_field_bytes: usize,
    /// Most boxes that are visited in a tick to compute the steps to goals.
    pub work_per_tick: usize,
}

impl Default for LifelongConfig {
    fn default() -> Self {
        Self {
            ticks_per_action: 3,
            policy: TaskPolicy::Nearest,
            seed: Seed(0),
            max_field_bytes: 1 << 30,
            work_per_tick: 1 << 20,
        }
    }
}

/// The planner and executor: what it knows of the floor, and buffers.
#[derive(Debug, Clone)]
pub struct Lifelong {
    planner: TickPlanner,
    config: LifelongConfig,
    tasks: TaskList<u32>,
}

impl Lifelong {
    /// Creates the planner for agents of one box at these starts, who face east, and these tasks, of which so many are
    /// known at any time. Returns it with the state before the first tick.
    ///
    /// # Errors
    /// When a start or a place of a task is not free, or two agents start in one box.
    pub fn new(
        free: &FreeSpace,
        starts: &[(u32, u32)],
        tasks: &[Vec<(u32, u32)>],
        known_tasks: usize,
        config: LifelongConfig,
    ) -> Result<(Self, LifelongState), InputError> {
        let mut planner = TickPlanner::new(
            free,
            starts.len(),
            config.ticks_per_action,
            config.seed,
            config.max_field_bytes,
        );
        let graph = &planner.graph;
        let place = |what: String, position: (u32, u32)| {
            graph.anchor(position).ok_or_else(|| {
                let cause = format!("the box {position:?} is a wall or outside the map");
                InputError::new(what, cause, "give a free box")
            })
        };
        let mut holders = vec![NONE; graph.len()];
        let mut agents = Vec::with_capacity(starts.len());
        for (agent, &start) in starts.iter().enumerate() {
            let at = place(format!("starts[{agent}]"), start)?;
            if holders[at as usize] != NONE {
                let cause = format!("agent {} starts in the same box", holders[at as usize]);
                let remedy = "give each agent a start of its own";
                return Err(InputError::new(format!("starts[{agent}]"), cause, remedy));
            }
            holders[at as usize] = agent as u32;
            agents.push(LifelongAgent { at, to: at, heading: 0, ticks_left: 0, delay: 0, age: 0 });
        }
        let mut lists = Vec::with_capacity(tasks.len());
        for (task, places) in tasks.iter().enumerate() {
            let boxes = places.iter().map(|&position| place(format!("tasks[{task}]"), position));
            lists.push(boxes.collect::<Result<Vec<u32>, InputError>>()?);
        }
        let tasks = TaskList::new(lists, known_tasks);
        let state = LifelongState { tick: 0, agents, tasks: tasks.begin(starts.len()) };
        planner.holders = holders;
        Ok((Self { planner, config, tasks }, state))
    }

    /// Returns whether the steps to the goals of all agents, at least from region to region, fit in
    /// [`LifelongConfig::max_field_bytes`]. Where they do not, agents go straight toward their goals and can stick behind
    /// walls.
    pub fn plans_around_walls(&self) -> bool {
        self.planner.has_fields
    }

    /// Goes on from a state that was kept. Steps to goals are not part of it: where they are not all known within
    /// [`LifelongConfig::work_per_tick`] of the next tick, agents can go other ways than in the run that was kept.
    pub fn resume(&mut self, state: &LifelongState) {
        self.planner.holders.fill(NONE);
        for (index, agent) in state.agents.iter().enumerate() {
            self.planner.holders[agent.at as usize] = index as u32;
            self.planner.holders[agent.to as usize] = index as u32;
        }
    }

    /// Advances all agents by one tick. New delays, in ticks, are added for agents that have none.
    pub fn tick(&mut self, state: &mut LifelongState, delays: &[(usize, u32)]) {
        for &(agent, ticks) in delays {
            if let Some(agent) = state.agents.get_mut(agent).filter(|agent| agent.delay == 0) {
                agent.delay = ticks;
            }
        }
        self.plan(state);
        self.act(state);
        state.tick += 1;
    }

    /// Visits places, gives tasks, and begins the next action of each agent between actions.
    fn plan(&mut self, state: &mut LifelongState) {
        self.planner.fields.begin_tick(self.config.work_per_tick);
        self.visit(state);
        self.assign(state);
        self.find_goals(state);
        self.planner.decide_all(state.tick, &state.agents);
        self.planner.choose_actions(&state.agents);
        self.begin_actions(state);
    }

    fn visit(&mut self, state: &mut LifelongState) {
        for (index, agent) in state.agents.iter_mut().enumerate() {
            if agent.ticks_left == 0 && self.tasks.visit(&mut state.tasks, index, agent.at) {
                agent.age = 0;
            }
        }
    }

    fn assign(&mut self, state: &mut LifelongState) {
        let is_new = self.tasks.reveal(&mut state.tasks);
        if !is_new && state.tasks.agents.iter().all(Option::is_some) {
            return;
        }
        let agents = state.agents.len();
        if is_new
            && self.planner.has_fields
            && agents * (agents + state.tasks.open.len()) <= MAX_PAIRS
        {
            self.tasks.take_back(&mut state.tasks);
        }
        if self.planner.fields.is_small() {
            for &task in &state.tasks.open {
                for &place in self.tasks.places(task) {
                    self.planner.fields.prepare(&self.planner.graph, place);
                }
            }
        }
        let fields = &self.planner.fields;
        let graph = &self.planner.graph;
        let tasks = &self.tasks;
        let agents = &state.agents;
        tasks.assign(&mut state.tasks, self.config.policy, |agent, task| {
            let places = tasks.places(task);
            let agent = &agents[agent];
            let first = fields.steps(graph, places[0], agent.to, agent.heading);
            if first == u32::from(u16::MAX) {
                return CostMatrix::IMPOSSIBLE;
            }
            let pairs = places.windows(2);
            let steps = |pair: &[u32]| {
                if fields.is_small() {
                    fields.steps(graph, pair[1], pair[0], 0)
                } else {
                    straight_steps(graph, pair[0], pair[1])
                }
            };
            first + pairs.map(steps).sum::<u32>()
        });
    }

    fn find_goals(&mut self, state: &LifelongState) {
        for agent in 0..state.agents.len() {
            self.planner.goals[agent] = self.tasks.goal(&state.tasks, agent).unwrap_or(NONE);
        }
        self.planner.prepare_goals();
    }

    fn begin_actions(&mut self, state: &mut LifelongState) {
        let (order, actions) = self.planner.chosen();
        for &(_, index) in order {
            let agent = &mut state.agents[index as usize];
            match actions[index as usize] {
                Action::TurnLeft => agent.heading = (agent.heading + 1) % 4,
                Action::TurnRight => agent.heading = (agent.heading + 3) % 4,
                Action::Forward => agent.to = self.planner.next(index as usize),
                Action::Wait | Action::Move(_) => continue,
            }
            agent.ticks_left = self.config.ticks_per_action;
        }
        for (index, agent) in (0..).zip(&state.agents) {
            self.planner.holders[agent.to as usize] = index;
        }
    }

    /// Lets the ticks of actions and delays pass.
    fn act(&mut self, state: &mut LifelongState) {
        for agent in &mut state.agents {
            agent.age = agent.age.saturating_add(1);
            if agent.delay > 0 {
                agent.delay -= 1;
                continue;
            }
            if agent.ticks_left == 0 {
                continue;
            }
            agent.ticks_left -= 1;
            if agent.ticks_left == 0 && agent.to != agent.at {
                self.planner.holders[agent.at as usize] = NONE;
                agent.at = agent.to;
            }
        }
    }
}

#[cfg(test)]
mod tests;
