//! The next actions of agents of one box that enter free boxes only: whose actions take several ticks, or where a box that
//! is left cannot be entered in the same one.
//!
//! An agent on its way from one box to the next holds both, and nobody enters a box that is held. There is no common step:
//! each agent that ended its action gets the next one at once, by priority inheritance (Okumura et al. 2022, "Priority
//! inheritance with backtracking for iterative multi-agent path finding") among all that are not late. Those in the midst
//! of an action take part from where it leads: so the box that they want next is kept for them, and others make way in
//! time. On two problems of the League of Robot Runners that gave 4 and 20 % more tasks than to leave them out.

use crate::goal_fields::GoalFields;
use crate::graph::{AnchorGraph, NONE};
use crate::pose::{Action, first_turn, quarter_turns};
use serde::{Deserialize, Serialize};
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_map::planning::FreeSpace;

/// Draws that decide between equal boxes.
const TIES: Purpose = Purpose(3);
/// Most agents that one pushes, one behind the other: more would take more than a tick to make way.
const MAX_CHAIN: u32 = 200;
/// Actions for which an agent keeps its lot among equal boxes.
const ACTIONS_PER_LOT: u64 = 8;
/// Holds a box for a body that is no agent: the number of no agent.
const OTHERS: u32 = NONE - 1;

/// The cost of a step or a turn, in the units of those below.
const STEP: u32 = 16;
/// The cost of a wait: agents that rather wait than go around each other jam. Of some values tried with three seeds on two
/// problems of the League of Robot Runners, this one was near the best of both.
const WAIT: u32 = 3 * STEP;
/// What is added for a box where an agent is, and where one is late.
const OCCUPIED: u32 = 12;
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

/// What a team of agents looks like before a tick.
#[derive(Debug, Clone, Copy)]
pub struct TickSituation<'a> {
    /// The number of ticks so far.
    pub tick: u64,
    /// The agents. Boxes are numbered row by row, from the first.
    pub agents: &'a [LifelongAgent],
    /// The goal of each agent.
    pub goals: &'a [Option<(u32, u32)>],
    /// Boxes in which other bodies stand: no agent enters them.
    pub others: &'a [(u32, u32)],
}

/// The planner: what it knows of the floor, and buffers. Its results depend on its arguments only.
#[derive(Debug, Clone)]
pub struct TickPlanner {
    pub(crate) graph: AnchorGraph,
    ticks_per_action: u32,
    pub(crate) fields: GoalFields,
    pub(crate) has_fields: bool,
    streams: Streams,
    /// Who holds a box, and who wants it next.
    pub(crate) holders: Vec<u32>,
    reserved: Vec<u32>,
    /// The next box of each agent, and whether that is decided.
    next: Vec<u32>,
    is_decided: Vec<bool>,
    pub(crate) goals: Vec<u32>,
    order: Vec<(u32, u32)>,
    actions: Vec<Action>,
}

impl TickPlanner {
    /// Creates the planner of so many agents whose step or turn takes so many ticks. The steps to the goals of all agents
    /// are kept from each box where that fits in `max_field_bytes`, else from region to region, by which ways are not always
    /// the shortest. Where not even that fits, agents go straight toward their goals, and can stick behind walls.
    pub fn new(
        free: &FreeSpace,
        agents: usize,
        ticks_per_action: u32,
        seed: Seed,
        max_field_bytes: usize,
    ) -> Self {
        let graph = AnchorGraph::new(free, 1);
        let fields = GoalFields::new(&graph, agents, max_field_bytes);
        Self {
            has_fields: fields.holds(agents),
            fields,
            ticks_per_action,
            streams: Streams::new(seed),
            holders: vec![NONE; graph.len()],
            reserved: vec![NONE; graph.len()],
            next: vec![NONE; agents],
            is_decided: vec![false; agents],
            goals: vec![NONE; agents],
            order: Vec::with_capacity(agents),
            actions: Vec::with_capacity(agents),
            graph,
        }
    }

    /// Returns the number of a box of the grid, as agents have it; the first one for boxes outside of it.
    pub fn box_number(&self, position: (u32, u32)) -> u32 {
        self.graph.index(position).unwrap_or(0)
    }

    /// Returns the next action of each agent that is between actions, and a wait for all others. If all are carried out,
    /// no box is held twice.
    ///
    /// # Panics
    /// When there are not as many agents and goals as the planner is for.
    pub fn step(&mut self, situation: TickSituation<'_>) -> &[Action] {
        let TickSituation { tick, agents, goals, others } = situation;
        // However long it takes: what is known must not depend on the steps before.
        self.fields.begin_tick(usize::MAX);
        self.hold(agents, others);
        for (own, goal) in self.goals.iter_mut().zip(goals) {
            *own = goal.and_then(|goal| self.graph.anchor(goal)).unwrap_or(NONE);
        }
        self.prepare_goals();
        self.decide_all(tick, agents);
        self.choose_actions(agents);
        &self.actions
    }

    /// Notes who holds which box.
    fn hold(&mut self, agents: &[LifelongAgent], others: &[(u32, u32)]) {
        self.holders.fill(NONE);
        for &position in others {
            if let Some(index) = self.graph.index(position) {
                self.holders[index as usize] = OTHERS;
            }
        }
        for (index, agent) in (0..).zip(agents) {
            self.holders[agent.at as usize] = index;
            self.holders[agent.to as usize] = index;
        }
    }

    /// Computes the steps to the goals of all agents, as far as there is work left for it.
    pub(crate) fn prepare_goals(&mut self) {
        if !self.has_fields {
            return;
        }
        for &goal in self.goals.iter().filter(|&&goal| goal != NONE) {
            self.fields.prepare(&self.graph, goal);
        }
    }

    /// Finds the next box of each agent that is not late; the oldest first.
    pub(crate) fn decide_all(&mut self, tick: u64, agents: &[LifelongAgent]) {
        self.order.clear();
        for (index, agent) in agents.iter().enumerate() {
            let is_late = agent.delay > 0;
            self.is_decided[index] = is_late;
            self.next[index] = agent.to;
            if !is_late {
                let rank =
                    if self.goals[index] == NONE { u32::MAX } else { u32::MAX - 1 - agent.age };
                self.order.push((rank, index as u32));
            }
        }
        self.order.sort_unstable();
        for index in 0..self.order.len() {
            let agent = self.order[index].1;
            if !self.is_decided[agent as usize] {
                self.decide(tick, agents, Push { agent, pusher: NONE, depth: 0 });
            }
        }
    }

    /// Finds the next box of an agent; it may not stay if another one pushes it. Returns whether it will leave its box,
    /// or may stay.
    fn decide(&mut self, tick: u64, agents: &[LifelongAgent], push: Push) -> bool {
        let Push { agent: index, pusher, depth } = push;
        self.is_decided[index as usize] = true;
        let at = agents[index as usize].to;
        let candidates = self.candidates(tick, agents, index);
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
            if self.becomes_free(tick, agents, to, Push { agent: index, pusher, depth }) {
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

    /// Returns whether whoever holds a box leaves it to an agent.
    fn becomes_free(&mut self, tick: u64, agents: &[LifelongAgent], to: u32, push: Push) -> bool {
        let holder = self.holders[to as usize];
        if holder == NONE {
            return true;
        }
        let Some(other) = agents.get(holder as usize) else { return false };
        if other.to != to {
            return true;
        }
        if self.is_decided[holder as usize] {
            // Two that wait for each other would wait forever.
            let next = self.next[holder as usize];
            return next != to && self.holders[next as usize] == NONE;
        }
        if other.ticks_left > 0 {
            // It would take too long to make way: to push it gave fewer tasks.
            return false;
        }
        let depth = push.depth + 1;
        depth <= MAX_CHAIN
            && self.decide(tick, agents, Push { agent: holder, pusher: push.agent, depth })
    }

    /// Returns the boxes that an agent can go to, the best first, with their costs.
    fn candidates(&self, tick: u64, agents: &[LifelongAgent], index: u32) -> [(u32, u32); 5] {
        let agent = agents[index as usize];
        let goal = self.goals[index as usize];
        let lot = tick / (ACTIONS_PER_LOT * u64::from(self.ticks_per_action));
        let ties = self.streams.block(index, lot, TIES, 0);
        let mut candidates = [(u32::MAX, NONE); 5];
        let steps = match goal {
            NONE => 0,
            goal => self.fields.steps(&self.graph, goal, agent.to, agent.heading),
        };
        candidates[4] = (steps * STEP + WAIT, agent.to);
        for (direction, neighbor) in self.graph.neighbors(agent.to) {
            let turns = u32::from(quarter_turns(agent.heading, direction));
            let crowd = match self.holders[neighbor as usize] {
                NONE => 0,
                other if agents.get(other as usize).is_some_and(|other| other.delay > 0) => LATE,
                _ => OCCUPIED,
            };
            let tie = ties[usize::from(direction)] >> 30;
            let steps = match goal {
                NONE => 1,
                goal => self.fields.steps_by(&self.graph, goal, agent.to, direction),
            };
            let cost = (steps + turns) * STEP + crowd + tie;
            candidates[usize::from(direction)] = (cost, neighbor);
        }
        candidates.sort_unstable();
        candidates
    }

    /// Chooses the action of each agent between actions that leads to its next box.
    pub(crate) fn choose_actions(&mut self, agents: &[LifelongAgent]) {
        self.actions.clear();
        self.actions.resize(agents.len(), Action::Wait);
        for &(_, index) in &self.order {
            let agent = &agents[index as usize];
            let to = self.next[index as usize];
            self.reserved[to as usize] = NONE;
            self.reserved[agent.to as usize] = NONE;
            if agent.ticks_left > 0 {
                continue;
            }
            let Some(direction) = self.graph.direction(agent.at, to) else { continue };
            self.actions[index as usize] = match first_turn(agent.heading, direction) {
                Some(turn) => turn,
                None if self.holders[to as usize] == NONE => Action::Forward,
                None => Action::Wait,
            };
        }
    }

    /// Returns the agents that are not late, with the rank of each, and the actions of all agents.
    pub(crate) fn chosen(&self) -> (&[(u32, u32)], &[Action]) {
        (&self.order, &self.actions)
    }

    /// Returns the next box of an agent.
    pub(crate) fn next(&self, agent: usize) -> u32 {
        self.next[agent]
    }
}

/// An agent that is asked for its next box, by whom, and how many push before it.
#[derive(Debug, Clone, Copy)]
struct Push {
    agent: u32,
    pusher: u32,
    depth: u32,
}
