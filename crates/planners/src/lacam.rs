//! LaCAM*: a first plan at once, better ones as long as it may search, the best one in the end.
//!
//! It searches in the space of the poses of all agents, depth first. The next poses are those of a PIBT step; each
//! visit of the same poses adds a constraint, who has to go where, so that in the end all successors were generated
//! (Okumura 2023, "LaCAM: search-based algorithm for quick multi-agent pathfinding", algorithm 1). After the first plan
//! it goes on: a shorter way to known poses is handed on to all that follows them, and what cannot be better than the
//! best plan is left out (Okumura 2023, "Improving LaCAM for scalable eventually optimal multi-agent pathfinding",
//! algorithm 1).

use crate::distances::GoalDistances;
use crate::graph::NONE;
use crate::inheritance::{Inheritance, Member};
use crate::instance::Instance;
use crate::plan::Plan;
use crate::pose::Action;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{InputError, Seed};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::rc::Rc;
use std::sync::Arc;

/// Draws that decide between equal boxes, and the order of constraints.
const TIES: Purpose = Purpose(3);

/// Bytes kept for the directions to goals.
const CACHE_BYTES: usize = 512 << 20;

/// What LaCAM* makes small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Objective {
    /// The sum of loss ([`Costs::sum_of_loss`](crate::Costs::sum_of_loss)).
    #[default]
    SumOfLoss,
    /// The makespan.
    Makespan,
}

/// The settings of [`plan`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LacamConfig {
    /// What it makes small.
    pub objective: Objective,
    /// Most expansions: PIBT steps that it computes. A first plan takes about as many as it has steps.
    pub budget_expansions: u64,
    /// Whether it ends with the first plan.
    pub is_first_enough: bool,
    /// Whether agents may go in circles, each into the box of the next: bodies that hold the boxes that they leave cannot.
    /// Without circles, what the search says of plans that do not exist is of plans without them.
    pub may_rotate: bool,
    /// The seed of the draws between equal boxes.
    pub seed: Seed,
}

impl Default for LacamConfig {
    fn default() -> Self {
        Self {
            objective: Objective::SumOfLoss,
            budget_expansions: 10_000,
            is_first_enough: false,
            may_rotate: true,
            seed: Seed(0),
        }
    }
}

/// What came of a search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LacamOutcome {
    /// The best plan that was found, if any.
    pub plan: Option<Plan>,
    /// Whether the search ended before its budget: then the plan is the best one there is, and without a plan the
    /// problem has no solution.
    pub is_exhaustive: bool,
    /// The number of expansions.
    pub expansions: u64,
}

/// Plans by LaCAM*. The same arguments give the same plan.
///
/// # Errors
/// Where no path leads from a start to its goal, even for an agent alone.
pub fn plan(instance: &Instance, config: LacamConfig) -> Result<LacamOutcome, InputError> {
    let mut search = Search::new(instance, config)?;
    let is_exhaustive = search.run();
    Ok(LacamOutcome {
        plan: search.best.map(|best| search.plan_to(best)),
        is_exhaustive,
        expansions: search.expansions,
    })
}

/// An agent has to be at a node after the step, and those of the parent constraints, too.
#[derive(Debug, Clone, Copy)]
struct Constraint {
    parent: u32,
    depth: u32,
    agent: u32,
    node: u32,
}

/// The poses of all agents at once, and the best known way to them.
struct Configuration {
    nodes: Rc<[u32]>,
    parent: u32,
    /// Cost of the way to it.
    cost: u64,
    /// Lower bound of the cost from it to the goals.
    bound: u64,
    /// Configurations that one step leads to, as far as known.
    successors: Vec<u32>,
    /// The tree of constraints in the order of a breadth-first search, and the next of them.
    constraints: Vec<Constraint>,
    head: usize,
    /// Steps since each agent was last at its goal.
    ages: Vec<u32>,
    /// The agents by age, the oldest first.
    order: Vec<u32>,
}

struct Search<'a> {
    instance: &'a Instance,
    config: LacamConfig,
    engine: Inheritance,
    distances: &'a [Arc<GoalDistances>],
    streams: Streams,
    configurations: Vec<Configuration>,
    known: BTreeMap<Rc<[u32]>, u32>,
    open: Vec<u32>,
    best: Option<u32>,
    expansions: u64,
}

impl<'a> Search<'a> {
    fn new(instance: &'a Instance, config: LacamConfig) -> Result<Self, InputError> {
        let graphs = instance.graphs().clone();
        let mut search = Self {
            instance,
            config,
            engine: Inheritance::new(graphs, instance.model(), CACHE_BYTES)
                .with_circles(config.may_rotate),
            distances: instance.distances()?,
            streams: Streams::new(config.seed),
            configurations: Vec::new(),
            known: BTreeMap::new(),
            open: Vec::new(),
            best: None,
            expansions: 0,
        };
        let agents = 0..instance.agents().len();
        let starts: Vec<u32> = agents.clone().map(|agent| instance.start_node(agent)).collect();
        // At first those with the longest way have priority.
        let steps = |agent: usize| search.distances[agent].steps(starts[agent]);
        let ages = agents.map(steps).collect();
        search.insert(starts.into(), NONE, ages);
        Ok(search)
    }

    /// Searches until nothing is left or the budget is spent; returns whether nothing is left.
    fn run(&mut self) -> bool {
        while let Some(&top) = self.open.last() {
            if self.config.is_first_enough && self.best.is_some() {
                return false;
            }
            let configuration = &self.configurations[top as usize];
            let is_done = configuration.head == configuration.constraints.len();
            if is_done || !self.is_promising(top) {
                self.open.pop();
                continue;
            }
            if self.expansions == self.config.budget_expansions {
                return false;
            }
            self.expansions += 1;
            self.expand(top);
        }
        true
    }

    /// Returns whether a better plan than the best one may lead through a configuration.
    fn is_promising(&self, index: u32) -> bool {
        let configuration = &self.configurations[index as usize];
        let best = self.best.map(|best| self.configurations[best as usize].cost);
        best.is_none_or(|best| configuration.cost + configuration.bound < best)
    }

    /// Generates one successor of a configuration.
    fn expand(&mut self, from: u32) {
        let configuration = &mut self.configurations[from as usize];
        let head = configuration.head;
        configuration.head += 1;
        self.grow_constraints(from, head);
        if !self.generate(from, head) {
            return;
        }
        let agents = self.instance.agents().len();
        let mut nodes = Vec::with_capacity(agents);
        for (agent, &node) in self.configurations[from as usize].nodes.iter().enumerate() {
            nodes.push(self.node_after(agent, node));
        }
        match self.known.get(nodes.as_slice()) {
            Some(&to) => self.connect(from, to),
            None => {
                let ages = self.ages_after(from, &nodes);
                self.insert(nodes.into(), from, ages);
            }
        }
    }

    /// Adds the constraints on one agent more to the tree.
    fn grow_constraints(&mut self, from: u32, head: usize) {
        let configuration = &mut self.configurations[from as usize];
        let depth = configuration.constraints[head].depth;
        let Some(&agent) = configuration.order.get(depth as usize) else { return };
        let node = configuration.nodes[agent as usize];
        let successors =
            self.instance.graph(agent as usize).successors(self.instance.model(), node);
        let mut nodes: Vec<u32> = successors.as_slice().to_vec();
        let lot = self.streams.block(agent, self.expansions, TIES, 1)[0] as usize;
        let middle = lot % nodes.len();
        nodes.rotate_left(middle);
        let parent = head as u32;
        let constraints =
            nodes.iter().map(|&node| Constraint { parent, depth: depth + 1, agent, node });
        configuration.constraints.extend(constraints);
    }

    /// Computes a step of all agents that obeys a constraint and its parents. Returns whether there is one.
    fn generate(&mut self, from: u32, head: usize) -> bool {
        let configuration = &self.configurations[from as usize];
        self.engine.begin();
        for (agent, &node) in configuration.nodes.iter().enumerate() {
            let member = Member {
                now: node / 4,
                heading: (node % 4) as u8,
                goal: self.instance.goal_box(agent),
                ties: self.streams.block(agent as u32, self.expansions, TIES, 0),
                may_swap: true,
            };
            let position = self.instance.graph(agent).position(member.now);
            self.engine.place(member, position);
        }
        let mut constraint = configuration.constraints[head];
        let mut forced = Vec::new();
        while constraint.depth > 0 {
            if !self.engine.force(constraint.agent as usize, constraint.node / 4) {
                return false;
            }
            forced.push(constraint);
            constraint = configuration.constraints[constraint.parent as usize];
        }
        self.engine.run(configuration.order.iter().copied());
        if self.engine.is_broken() {
            return false;
        }
        self.engine.hold();
        for constraint in forced {
            let agent = constraint.agent as usize;
            if self.engine.next(agent) != constraint.node / 4 {
                return false;
            }
            let now = configuration.nodes[agent];
            let turn = (constraint.node % 4 + 4 - now % 4) % 4;
            let turn =
                [Action::Wait, Action::TurnLeft, Action::Wait, Action::TurnRight][turn as usize];
            self.engine.set_turn(agent, turn);
        }
        true
    }

    fn node_after(&self, agent: usize, node: u32) -> u32 {
        let heading = node % 4;
        let heading = match self.engine.action(agent) {
            Action::TurnLeft => (heading + 1) % 4,
            Action::TurnRight => (heading + 3) % 4,
            _ => heading,
        };
        self.engine.next(agent) * 4 + heading
    }

    fn is_at_goal(&self, agent: usize, node: u32) -> bool {
        node / 4 == self.instance.goal_box(agent)
    }

    fn ages_after(&self, from: u32, nodes: &[u32]) -> Vec<u32> {
        let before = &self.configurations[from as usize].ages;
        let age = |(agent, &age): (usize, &u32)| {
            if self.is_at_goal(agent, nodes[agent]) { 0 } else { age + 1 }
        };
        before.iter().enumerate().map(age).collect()
    }

    fn insert(&mut self, nodes: Rc<[u32]>, parent: u32, ages: Vec<u32>) {
        let index = self.configurations.len() as u32;
        let cost = match parent {
            NONE => 0,
            _ => {
                let before = &self.configurations[parent as usize];
                before.cost + self.step_cost(&before.nodes, &nodes)
            }
        };
        let mut order: Vec<u32> = (0..nodes.len() as u32).collect();
        order.sort_by_key(|&agent| Reverse(ages[agent as usize]));
        let root = Constraint { parent: NONE, depth: 0, agent: NONE, node: NONE };
        self.configurations.push(Configuration {
            bound: self.bound(&nodes),
            nodes: nodes.clone(),
            parent,
            cost,
            successors: Vec::new(),
            constraints: vec![root],
            head: 0,
            ages,
            order,
        });
        self.known.insert(nodes, index);
        if parent != NONE {
            self.configurations[parent as usize].successors.push(index);
        }
        self.update_best(index);
        if self.is_promising(index) {
            self.open.push(index);
        }
    }

    fn step_cost(&self, before: &[u32], after: &[u32]) -> u64 {
        match self.config.objective {
            Objective::Makespan => 1,
            Objective::SumOfLoss => {
                let is_away = |agent: &usize| {
                    !self.is_at_goal(*agent, before[*agent])
                        || !self.is_at_goal(*agent, after[*agent])
                };
                (0..before.len()).filter(is_away).count() as u64
            }
        }
    }

    fn bound(&self, nodes: &[u32]) -> u64 {
        let steps = nodes.iter().zip(self.distances).map(|(&node, d)| u64::from(d.steps(node)));
        match self.config.objective {
            Objective::Makespan => steps.max().unwrap_or(0),
            Objective::SumOfLoss => steps.sum(),
        }
    }

    /// Keeps a configuration as the best one if it has all agents at their goals at a lower cost.
    fn update_best(&mut self, index: u32) {
        let nodes = &self.configurations[index as usize].nodes;
        let is_goal = nodes.iter().enumerate().all(|(agent, &node)| self.is_at_goal(agent, node));
        let cost = |index: u32| self.configurations[index as usize].cost;
        if is_goal && self.best.is_none_or(|best| cost(index) < cost(best)) {
            self.best = Some(index);
        }
    }

    /// Adds a step between known configurations, and hands the lower cost on that it may give (algorithm 1).
    fn connect(&mut self, from: u32, to: u32) {
        let successors = &mut self.configurations[from as usize].successors;
        if !successors.contains(&to) {
            successors.push(to);
        }
        let mut queue =
            BinaryHeap::from([(Reverse(self.configurations[from as usize].cost), from)]);
        while let Some((_, at)) = queue.pop() {
            for position in 0..self.configurations[at as usize].successors.len() {
                let next = self.configurations[at as usize].successors[position];
                if self.relax(at, next) {
                    queue.push((Reverse(self.configurations[next as usize].cost), next));
                }
            }
        }
        // What was found again is searched next, so that the search does not stay deep down.
        if self.is_promising(to) {
            self.open.push(to);
        }
    }

    /// Leads the way to a configuration through another one if that is cheaper; returns whether it is.
    fn relax(&mut self, from: u32, to: u32) -> bool {
        let before = &self.configurations[from as usize];
        let after = &self.configurations[to as usize];
        let cost = before.cost + self.step_cost(&before.nodes, &after.nodes);
        if cost >= after.cost {
            return false;
        }
        let after = &mut self.configurations[to as usize];
        after.cost = cost;
        after.parent = from;
        self.update_best(to);
        if self.best.is_some() && self.is_promising(to) {
            self.open.push(to);
        }
        true
    }

    fn plan_to(&self, mut index: u32) -> Plan {
        let mut indices = Vec::new();
        while index != NONE {
            indices.push(index);
            index = self.configurations[index as usize].parent;
        }
        indices.reverse();
        let path = |agent: usize| {
            let node = |index: &u32| self.configurations[*index as usize].nodes[agent];
            indices.iter().map(|index| self.instance.graph(agent).pose(node(index))).collect()
        };
        Plan::new((0..self.instance.agents().len()).map(path).collect())
    }
}
