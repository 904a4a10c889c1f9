//! Agents that carry out tasks without end, tick by tick, although some are late.
//!
//! A step forward or a turn takes several ticks. An agent on its way from one box to the next holds both, and nobody
//! enters a box that is held: so no two bodies overlap, whatever the delays. A delayed agent stands still, in the
//! midst of an action or between two.
//!
//! There is no common step: each agent that ended its action gets the next one at once, by priority inheritance
//! (Okumura et al. 2022, "Priority inheritance with backtracking for iterative multi-agent path finding") among those
//! that are between actions. Those in the midst of one are obstacles, which leave their box or not.

use crate::assignment::CostMatrix;
use crate::goal_fields::{GoalFields, straight_steps};
use crate::graph::{AnchorGraph, NONE};
use crate::pose::{Action, first_turn, quarter_turns};
use crate::tasks::{TaskList, TaskPolicy, TaskState};
use serde::{Deserialize, Serialize};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::FreeSpace;

/// Draws that decide between equal boxes.
const TIES: Purpose = Purpose(3);
/// Most agents that one pushes, one behind the other: more would take more than a tick to make way.
const MAX_CHAIN: u32 = 200;
/// Most pairs of agents and tasks that are compared in one tick by true steps.
const MAX_PAIRS: usize = 1 << 18;

/// The cost of a step or a turn, in the units of those below.
const STEP: u32 = 16;
/// The cost of a wait: agents that rather wait than go around each other jam. Of some values tried with three seeds on two
/// problems of the League of Robot Runners, this one was near the best of both.
const WAIT: u32 = 3 * STEP;
/// What is added for a box where an agent is, and where one is late.
const OCCUPIED: u32 = 6;
const LATE: u32 = 24;

/// An agent and what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct LifelongAgent {
    /// The box that it is in, or leaves.
    pub at: u32,
    /// The box that it enters; the same as `at` if it does not move.
    pub to: u32,
    /// Heading: 0 east, 1 north, 2 west, 3 south; after a turn in progress, the new one.
    pub heading: u8,
    /// Ticks until the action ends; 0 between actions.
    pub ticks_left: u32,
    /// Ticks of delay left.
    pub delay: u32,
    /// Ticks since it got its goal.
    pub age: u32,
}

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
    graph: AnchorGraph,
    config: LifelongConfig,
    fields: GoalFields,
    has_fields: bool,
    tasks: TaskList<u32>,
    streams: Streams,
    /// Who holds a box, and who wants it next.
    holders: Vec<u32>,
    reserved: Vec<u32>,
    /// The next box of each agent, and whether that is decided.
    next: Vec<u32>,
    is_decided: Vec<bool>,
    goals: Vec<u32>,
    order: Vec<(u32, u32)>,
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
        let graph = AnchorGraph::new(free, 1);
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
        let fields = GoalFields::new(&graph, config.max_field_bytes);
        let state = LifelongState { tick: 0, agents, tasks: tasks.begin(starts.len()) };
        let planner = Self {
            has_fields: fields.holds(starts.len()),
            fields,
            tasks,
            streams: Streams::new(config.seed),
            reserved: vec![NONE; graph.len()],
            next: vec![NONE; starts.len()],
            is_decided: vec![false; starts.len()],
            goals: vec![NONE; starts.len()],
            order: Vec::with_capacity(starts.len()),
            holders,
            graph,
            config,
        };
        Ok((planner, state))
    }

    /// Returns whether the steps to the goals of all agents fit in [`LifelongConfig::max_field_bytes`]. Where they do not,
    /// agents go straight toward their goals and can stick behind walls.
    pub fn plans_around_walls(&self) -> bool {
        self.has_fields
    }

    /// Goes on from a state that was kept. Steps to goals are not part of it: where they are not all known within
    /// [`LifelongConfig::work_per_tick`] of the next tick, agents can go other ways than in the run that was kept.
    pub fn resume(&mut self, state: &LifelongState) {
        self.holders.fill(NONE);
        for (index, agent) in state.agents.iter().enumerate() {
            self.holders[agent.at as usize] = index as u32;
            self.holders[agent.to as usize] = index as u32;
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
        self.fields.begin_tick(self.config.work_per_tick);
        self.visit(state);
        self.assign(state);
        self.find_goals(state);
        self.decide_all(state);
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
        if is_new && self.has_fields && agents * (agents + state.tasks.open.len()) <= MAX_PAIRS {
            self.tasks.take_back(&mut state.tasks);
        }
        if self.fields.is_small() {
            for &task in &state.tasks.open {
                for &place in self.tasks.places(task) {
                    self.fields.prepare(&self.graph, place);
                }
            }
        }
        let fields = &self.fields;
        let graph = &self.graph;
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
            let goal = self.tasks.goal(&state.tasks, agent).unwrap_or(NONE);
            self.goals[agent] = goal;
            if self.has_fields && goal != NONE {
                self.fields.prepare(&self.graph, goal);
            }
        }
    }

    /// Finds the next box of each agent between actions; the oldest first.
    fn decide_all(&mut self, state: &LifelongState) {
        self.order.clear();
        for (index, agent) in state.agents.iter().enumerate() {
            let is_ready = agent.ticks_left == 0 && agent.delay == 0;
            self.is_decided[index] = !is_ready;
            self.next[index] = agent.to;
            if is_ready {
                let rank =
                    if self.goals[index] == NONE { u32::MAX } else { u32::MAX - 1 - agent.age };
                self.order.push((rank, index as u32));
            }
        }
        self.order.sort_unstable();
        for index in 0..self.order.len() {
            let agent = self.order[index].1;
            if !self.is_decided[agent as usize] {
                self.decide(state, agent, NONE, 0);
            }
        }
    }

    /// Finds the next box of an agent; it may not stay if another one pushes it. Returns whether it will leave its box,
    /// or may stay.
    fn decide(&mut self, state: &LifelongState, index: u32, pusher: u32, depth: u32) -> bool {
        self.is_decided[index as usize] = true;
        let at = state.agents[index as usize].at;
        let candidates = self.candidates(state, index);
        for &(_, to) in &candidates {
            if to == NONE || self.reserved[to as usize] != NONE {
                continue;
            }
            if to == at {
                if pusher == NONE {
                    break;
                }
                continue;
            }
            self.reserved[to as usize] = index;
            self.next[index as usize] = to;
            if self.becomes_free(state, index, to, depth) {
                return true;
            }
            self.reserved[to as usize] = NONE;
            self.next[index as usize] = at;
        }
        if self.reserved[at as usize] == NONE {
            self.reserved[at as usize] = index;
        }
        pusher == NONE
    }

    /// Returns whether whoever holds a box leaves it.
    fn becomes_free(&mut self, state: &LifelongState, index: u32, to: u32, depth: u32) -> bool {
        let holder = self.holders[to as usize];
        if holder == NONE {
            return true;
        }
        let other = state.agents[holder as usize];
        if other.ticks_left > 0 {
            return other.to != to;
        }
        if self.is_decided[holder as usize] {
            // Two that wait for each other would wait forever.
            let next = self.next[holder as usize];
            return other.delay == 0 && next != to && self.holders[next as usize] == NONE;
        }
        depth < MAX_CHAIN && self.decide(state, holder, index, depth + 1)
    }

    /// Returns the boxes that an agent can go to, the best first, with their costs.
    fn candidates(&self, state: &LifelongState, index: u32) -> [(u32, u32); 5] {
        let agent = state.agents[index as usize];
        let goal = self.goals[index as usize];
        let lot = state.tick / u64::from(8 * self.config.ticks_per_action);
        let ties = self.streams.block(index, lot, TIES, 0);
        let mut candidates = [(u32::MAX, NONE); 5];
        let steps = |at: u32, heading: u8| match goal {
            NONE => 0,
            goal => self.fields.steps(&self.graph, goal, at, heading),
        };
        candidates[4] = (steps(agent.at, agent.heading) * STEP + WAIT, agent.at);
        for (direction, neighbor) in self.graph.neighbors(agent.at) {
            let turns = u32::from(quarter_turns(agent.heading, direction));
            let holder = self.holders[neighbor as usize];
            let crowd = match holder {
                NONE => 0,
                other if state.agents[other as usize].delay > 0 => LATE,
                _ => OCCUPIED,
            };
            let tie = ties[usize::from(direction)] >> 30;
            let cost = (steps(neighbor, direction)
                + self.fields.weight(&self.graph, agent.at, direction)
                + turns)
                * STEP
                + crowd
                + tie;
            candidates[usize::from(direction)] = (cost, neighbor);
        }
        candidates.sort_unstable();
        candidates
    }

    fn begin_actions(&mut self, state: &mut LifelongState) {
        for &(_, index) in &self.order {
            let agent = &mut state.agents[index as usize];
            let to = self.next[index as usize];
            self.reserved[to as usize] = NONE;
            self.reserved[agent.at as usize] = NONE;
            let Some(direction) = self.graph.direction(agent.at, to) else { continue };
            match first_turn(agent.heading, direction) {
                Some(Action::TurnLeft) => agent.heading = (agent.heading + 1) % 4,
                Some(_) => agent.heading = (agent.heading + 3) % 4,
                None if self.holders[to as usize] == NONE => {
                    self.holders[to as usize] = index;
                    agent.to = to;
                }
                None => continue,
            }
            agent.ticks_left = self.config.ticks_per_action;
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
                self.holders[agent.at as usize] = NONE;
                agent.at = agent.to;
            }
        }
    }
}

#[cfg(test)]
mod tests;
