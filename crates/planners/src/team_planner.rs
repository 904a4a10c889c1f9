//! A team that a planner leads, step by step: it makes a plan, an executor carries it out, and where there is none the
//! team goes on by priority inheritance.

use crate::dependency_graph::DependencyGraph;
use crate::executor::{Execute, Execution, Executor};
use crate::graph::{AnchorGraph, Graphs};
use crate::instance::{Agent, Instance, check_sizes};
use crate::lacam::{self, LacamConfig};
use crate::pibt::PibtState;
use crate::plan::Plan;
use crate::pose::{Action, ActionModel, GridPose};
pub use crate::stepper::{BusyAgent, TeamStep};
use crate::stepper::{StepRules, Stepper};
use crate::{cbs, prioritized};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::FreeSpace;
use std::collections::{BTreeSet, VecDeque};
use std::ops::AddAssign;
use std::sync::Arc;

/// Actions' time by priority inheritance after a search without a plan, or a plan that came to a halt, before the next
/// search: the agents have to be elsewhere for another outcome, and a search that spends its budget takes long.
const ACTIONS_WITHOUT_PLAN: u64 = 8;

/// The algorithm by which a team plans.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Method {
    /// Priority inheritance with backtracking ([`Pibt`](crate::Pibt)): one step at a time, without an executor.
    Pibt,
    /// [`lacam`]: a first plan at once, then better ones within the budget.
    Lacam {
        /// Most expansions of a search.
        budget_expansions: u64,
    },
    /// [`prioritized`]: one agent after the other.
    Prioritized {
        /// Most orders of the agents that are tried.
        max_orders: u32,
    },
    /// [`cbs`]: the lowest sum of costs.
    Cbs {
        /// Most expansions of a search.
        budget_expansions: u64,
    },
    /// A plan that was made elsewhere, from the first step on; where it ends, or cannot be carried out any more, priority
    /// inheritance leads.
    Given(Arc<Plan>),
    /// Plans that a caller orders one after the other, see [`TeamPlannerState::ordered`]. Where one ends, or cannot be carried
    /// out any more, all wait for the next.
    Ordered,
}

/// The settings of a [`TeamPlanner`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TeamPlannerConfig {
    /// The algorithm.
    pub method: Method,
    /// How its plans are carried out.
    pub executor: Executor,
    /// Steps for which a plan is used, whatever becomes of goals meanwhile; without them a plan is made anew as soon as a
    /// goal changes.
    pub window: Option<u32>,
    /// Whether an agent can enter a box that another one leaves in the same step.
    pub may_follow: bool,
    /// Steps that an action takes, in which a body also holds the boxes that it leaves. Above 1 agents get out of step, so
    /// only [`Method::Pibt`] and [`Executor::Adg`] lead them well.
    pub action_steps: u32,
    /// Whether an agent may turn out to be behind where it was taken to be, since poses are beliefs: what has to be done
    /// again by [`Executor::Adg`] is taken back, and the plan kept.
    pub may_fall_back: bool,
    /// The seed of all draws.
    pub seed: Seed,
}

/// What became of the plans of a team so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PlanCounts {
    /// Searches, and of [`Method::Pibt`] steps.
    pub plans: u64,
    /// Searches that gave no plan.
    pub failures: u64,
    /// Expansions of all searches, and orders of prioritized planning.
    pub expansions: u64,
    /// The sum of costs of all plans that were found, and the lowest that they could have had, see
    /// [`Bounds`](crate::Bounds).
    pub costs: u64,
    /// See `costs`.
    pub bounds: u64,
}

impl AddAssign for PlanCounts {
    fn add_assign(&mut self, other: Self) {
        self.plans += other.plans;
        self.failures += other.failures;
        self.expansions += other.expansions;
        self.costs += other.costs;
        self.bounds += other.bounds;
    }
}

/// All that changes from step to step: to continue elsewhere, keep it.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct TeamPlannerState {
    /// Priorities, the number of steps, and the goals of the last one.
    pub pibt: PibtState,
    /// The plan that is carried out, if there is one.
    pub execution: Option<Execution>,
    /// The first step in which a plan may be made again.
    pub next_search: u64,
    /// What became of the plans so far.
    pub counts: PlanCounts,
    /// For each agent, the actions of a plan of [`Method::Ordered`] that the next step begins with, from where the agents are
    /// then; agents with fewer than others wait at the end. One that is wrong counts as a failure, and all wait.
    #[serde(default)]
    pub ordered: Option<Vec<Vec<Action>>>,
    /// The order of the plan's actions, which follows from the plan.
    #[serde(skip)]
    graph: Option<Arc<DependencyGraph>>,
}

impl PartialEq for TeamPlannerState {
    fn eq(&self, other: &Self) -> bool {
        // The graph is left out: a state that was kept elsewhere has none yet.
        self.pibt == other.pibt
            && self.execution == other.execution
            && self.next_search == other.next_search
            && self.counts == other.counts
            && self.ordered == other.ordered
    }
}

impl Eq for TeamPlannerState {}

impl TeamPlannerState {
    /// Creates the state before the first step.
    pub fn new(agents: usize) -> Self {
        Self { pibt: PibtState::new(agents), ..Self::default() }
    }

    /// Advances the state by one step in which others chose the actions.
    pub fn take_orders(&mut self, goals: &[Option<(u32, u32)>]) {
        self.counts.plans += 1;
        self.pibt.step += 1;
        self.pibt.goals.copy_from_slice(goals);
    }
}

/// The planner of a team: what it knows of the floor, and buffers. Its results depend on its arguments and on the
/// [`TeamPlannerState`].
#[derive(Debug, Clone)]
pub struct TeamPlanner {
    free: FreeSpace,
    graphs: Graphs,
    sizes: Vec<u32>,
    config: TeamPlannerConfig,
    stepper: Stepper,
    actions: Vec<Action>,
}

/// A plan and what its search took.
struct SearchOutcome {
    plan: Option<Plan>,
    expansions: u64,
    /// The lowest sum of costs that a plan could have.
    bound: u64,
    costs: u64,
}

impl TeamPlanner {
    /// Creates the planner of agents with bodies of these sizes, who have headings, on the free boxes of a floor.
    ///
    /// # Errors
    /// When a size is 0.
    pub fn new(
        free: &FreeSpace,
        sizes: &[u32],
        config: TeamPlannerConfig,
    ) -> Result<Self, InputError> {
        check_sizes(sizes.iter().copied())?;
        let TeamPlannerConfig { action_steps, may_follow, seed, .. } = config;
        let stepper = Stepper::new(free, sizes, StepRules { action_steps, may_follow }, seed)?;
        let graphs = Graphs::new(free, sizes.iter().copied());
        let sizes = sizes.to_vec();
        Ok(Self { free: free.clone(), graphs, sizes, config, stepper, actions: Vec::new() })
    }

    /// Returns the next action of each agent, and advances the state by one step.
    ///
    /// # Errors
    /// As [`Pibt::step`](crate::Pibt::step).
    pub fn step(
        &mut self,
        state: &mut TeamPlannerState,
        now: TeamStep<'_>,
    ) -> Result<&[Action], InputError> {
        if self.config.method != Method::Pibt {
            self.renew(state, now);
            if let (Some(execution), Some(graph)) = (&state.execution, &state.graph) {
                let idle: Vec<u32> = now.busy.iter().map(|busy| busy.agent).collect();
                self.actions = execution.actions(&self.execute(graph), &idle);
                // The next step by priority inheritance, if there is one, compares its goals with these.
                state.pibt.goals.copy_from_slice(now.goals);
                state.pibt.step += 1;
                return Ok(&self.actions);
            }
            if self.config.method == Method::Ordered {
                state.pibt.goals.copy_from_slice(now.goals);
                state.pibt.step += 1;
                self.actions = vec![Action::Wait; now.poses.len()];
                return Ok(&self.actions);
            }
        } else {
            state.counts.plans += 1;
        }
        self.stepper.step(&mut state.pibt, now)
    }

    /// Returns the poses that a plan still has for an agent after [`Self::step`], from the present one on; none without a
    /// plan.
    pub fn path_ahead(&self, state: &TeamPlannerState, agent: usize) -> Vec<GridPose> {
        let Some(execution) = &state.execution else { return Vec::new() };
        let Some(graph) = self.kept_graph(state, execution) else { return Vec::new() };
        execution.path_ahead(&self.execute(&graph), agent)
    }

    /// Returns the agents for which an agent waits by the order of its plan, by rising number.
    pub fn agents_before(&self, state: &TeamPlannerState, agent: usize) -> Vec<usize> {
        let Some(execution) = &state.execution else { return Vec::new() };
        let Some(graph) = self.kept_graph(state, execution) else { return Vec::new() };
        execution.agents_before(&self.execute(&graph), agent)
    }

    /// Returns the order of the actions of the present plan: after a restore it is not kept yet.
    fn kept_graph(
        &self,
        state: &TeamPlannerState,
        execution: &Execution,
    ) -> Option<Arc<DependencyGraph>> {
        state.graph.clone().or_else(|| self.graph_of(&execution.plan).map(Arc::new))
    }

    /// Drops the plan if it cannot go on or its time is over, and makes another one if it is time for that.
    fn renew(&self, state: &mut TeamPlannerState, now: TeamStep<'_>) {
        if let Some(actions) = state.ordered.take() {
            self.begin_ordered(state, now.poses, &actions);
            return;
        }
        if let Some(execution) = &mut state.execution {
            let graph = state.graph.take().or_else(|| self.graph_of(&execution.plan).map(Arc::new));
            let goes_on = graph.as_ref().is_some_and(|graph| {
                let by = self.execute(graph);
                let goes_on = execution.advance(&by, now.poses);
                if execution.is_stalled(&by) {
                    // From where the agents stand, the same plan might be made again.
                    state.next_search = state.pibt.step + self.steps_without_plan();
                }
                goes_on && !self.is_stale(execution, &by, &state.pibt.goals, now)
            });
            if goes_on {
                state.graph = graph;
                return;
            }
            state.execution = None;
        }
        let is_spent = match self.config.method {
            Method::Given(_) => state.counts.plans > 0,
            Method::Ordered => true,
            _ => false,
        };
        if state.pibt.step < state.next_search || is_spent {
            return;
        }
        let outcome = self.search(&state.counts, now);
        state.counts.plans += 1;
        state.counts.expansions += outcome.expansions;
        let graph = outcome.plan.as_ref().and_then(|plan| self.graph_of(plan));
        let (Some(plan), Some(graph)) = (outcome.plan, graph) else {
            state.counts.failures += 1;
            state.next_search = state.pibt.step + self.steps_without_plan();
            return;
        };
        state.counts.costs += outcome.costs;
        state.counts.bounds += outcome.bound;
        state.execution = Some(Execution::new(plan));
        state.graph = Some(Arc::new(graph));
    }

    /// Begins with a plan that a caller has ordered.
    fn begin_ordered(
        &self,
        state: &mut TeamPlannerState,
        poses: &[GridPose],
        actions: &[Vec<Action>],
    ) {
        state.counts.plans += 1;
        state.execution = None;
        let mut paths = Vec::with_capacity(poses.len());
        for (&start, actions) in poses.iter().zip(actions) {
            let mut path = vec![start];
            // Off the map there are no poses: such a path is shorter than it should be.
            path.extend(actions.iter().scan(start, |pose, &action| {
                *pose = pose.after(action)?;
                Some(*pose)
            }));
            if path.len() == actions.len() + 1 {
                paths.push(path);
            }
        }
        let is_whole = paths.len() == poses.len();
        let plan = is_whole.then(|| Plan::new(paths));
        let graph = plan.as_ref().and_then(|plan| self.graph_of(plan));
        let (Some(plan), Some(graph)) = (plan, graph) else {
            state.counts.failures += 1;
            return;
        };
        state.execution = Some(Execution::new(plan));
        state.graph = Some(Arc::new(graph));
    }

    /// Returns how many actions of its plan each agent still has to do in the next step, if that finds them at these poses.
    pub fn actions_left(&self, state: &TeamPlannerState, poses: &[GridPose]) -> Vec<usize> {
        let none = vec![0; poses.len()];
        let Some(mut execution) = state.execution.clone() else { return none };
        let Some(graph) = self.kept_graph(state, &execution) else { return none };
        let by = self.execute(&graph);
        if !execution.advance(&by, poses) {
            return none;
        }
        (0..poses.len()).map(|agent| execution.path_ahead(&by, agent).len() - 1).collect()
    }

    /// Returns the steps by priority inheritance before the next search.
    fn steps_without_plan(&self) -> u64 {
        ACTIONS_WITHOUT_PLAN * u64::from(self.config.action_steps.max(1))
    }

    /// Returns whether goals ask for another plan.
    fn is_stale(
        &self,
        execution: &Execution,
        by: &Execute<'_>,
        last_goals: &[Option<(u32, u32)>],
        now: TeamStep<'_>,
    ) -> bool {
        if matches!(self.config.method, Method::Given(_) | Method::Ordered) {
            return execution.is_over(by);
        }
        let mut agents = now.poses.iter().zip(now.goals);
        // A plan also leads those without a goal, out of the way of others: they are where they should be.
        let is_served = agents.all(|(pose, goal)| goal.is_none_or(|goal| pose.position() == goal));
        let is_over = execution.is_over(by) && !is_served;
        match self.config.window {
            Some(window) => is_over || execution.step >= window && !is_served,
            None => is_over || now.goals != last_goals,
        }
    }

    fn execute<'a>(&self, graph: &'a DependencyGraph) -> Execute<'a> {
        Execute {
            executor: self.config.executor,
            model: ActionModel::Turns,
            graph,
            may_follow: self.config.may_follow,
            may_fall_back: self.config.may_fall_back,
            action_steps: self.config.action_steps,
        }
    }

    /// Returns the order of a plan's actions; none if the plan is wrong.
    fn graph_of(&self, plan: &Plan) -> Option<DependencyGraph> {
        if plan.agents() != self.sizes.len() {
            return None;
        }
        let agents = self.sizes.iter().enumerate().map(|(agent, &size)| Agent {
            size,
            start: plan.pose(agent, 0),
            goal: plan.pose(agent, plan.steps()).position(),
        });
        let instance = Instance::new(&self.free, ActionModel::Turns, agents.collect()).ok()?;
        DependencyGraph::new(&instance, plan).ok()
    }

    fn search(&self, counts: &PlanCounts, now: TeamStep<'_>) -> SearchOutcome {
        let none = SearchOutcome { plan: None, expansions: 0, bound: 0, costs: 0 };
        if let Method::Given(plan) = &self.config.method {
            let starts = (0..plan.agents()).map(|agent| plan.pose(agent, 0));
            let is_first = counts.plans == 0 && starts.eq(now.poses.iter().copied());
            let plan = is_first.then(|| Plan::clone(plan));
            return SearchOutcome { plan, ..none };
        }
        let goals = self.goals_apart(now);
        let mut agents = Vec::with_capacity(goals.len());
        for ((&size, &start), goal) in self.sizes.iter().zip(now.poses).zip(goals) {
            let Some(goal) = goal else { return none };
            agents.push(Agent { size, start, goal });
        }
        let others: BTreeSet<(u32, u32)> = now.others.iter().copied().collect();
        // Other bodies are walls, unless an agent could not get anywhere: then they may move on.
        if !others.is_empty() {
            let is_free = |col, row| self.free.is_free(col, row) && !others.contains(&(col, row));
            let floor = FreeSpace::new(self.free.width(), self.free.height(), is_free);
            if let Ok(outcome) = self.search_on(&floor, &agents, counts) {
                return outcome;
            }
        }
        self.search_on(&self.free, &agents, counts).unwrap_or(none)
    }

    fn search_on(
        &self,
        floor: &FreeSpace,
        agents: &[Agent],
        counts: &PlanCounts,
    ) -> Result<SearchOutcome, InputError> {
        let instance = Instance::new(floor, ActionModel::Turns, agents.to_vec())?;
        let bound = instance.bounds()?.sum_of_costs;
        let (plan, expansions) = self.plan(&instance, counts)?;
        let costs = plan.as_ref().map_or(0, |plan| plan.costs(&instance).sum_of_costs);
        Ok(SearchOutcome { plan, expansions, bound, costs })
    }

    fn plan(
        &self,
        instance: &Instance,
        counts: &PlanCounts,
    ) -> Result<(Option<Plan>, u64), InputError> {
        match self.config.method {
            Method::Lacam { budget_expansions } => {
                // Each search has its own draws, so that one after a failure is another one.
                let seed = Seed(self.config.seed.0.wrapping_add(counts.plans));
                let may_rotate = self.config.action_steps <= 1;
                let config =
                    LacamConfig { budget_expansions, seed, may_rotate, ..LacamConfig::default() };
                let outcome = lacam::plan(instance, config)?;
                Ok((outcome.plan, outcome.expansions))
            }
            Method::Prioritized { max_orders } => {
                let outcome = prioritized::plan(instance, max_orders)?;
                Ok((outcome.plan, u64::from(outcome.orders)))
            }
            Method::Cbs { budget_expansions } => {
                let outcome = cbs::plan(instance, budget_expansions)?;
                Ok((outcome.plan, outcome.expansions))
            }
            Method::Pibt | Method::Given(_) | Method::Ordered => Ok((None, 0)),
        }
    }

    /// Returns goals of which no two overlap: those given, and for agents without one, or whose goal overlaps that of an
    /// agent before, the place nearest to where they are that overlaps none. None where there is no such place.
    fn goals_apart(&self, now: TeamStep<'_>) -> Vec<Option<(u32, u32)>> {
        let mut floor = ClaimedFloor::new(&self.free);
        let mut goals = vec![None; now.goals.len()];
        for (agent, &goal) in now.goals.iter().enumerate() {
            goals[agent] = goal.filter(|&goal| floor.claim(goal, self.sizes[agent]));
        }
        for (agent, &pose) in now.poses.iter().enumerate() {
            let size = self.sizes[agent];
            if goals[agent].is_none() {
                goals[agent] = floor.nearest(self.graphs.of(agent), pose.position());
                goals[agent].iter().for_each(|&goal| {
                    floor.claim(goal, size);
                });
            }
        }
        goals
    }
}

/// The boxes that goals take up.
struct ClaimedFloor {
    width: u32,
    height: u32,
    is_claimed: Vec<bool>,
}

impl ClaimedFloor {
    fn new(free: &FreeSpace) -> Self {
        let boxes = free.width() as usize * free.height() as usize;
        Self { width: free.width(), height: free.height(), is_claimed: vec![false; boxes] }
    }

    /// Claims the boxes of a body, unless one is claimed already; returns whether it did.
    fn claim(&mut self, at: (u32, u32), size: u32) -> bool {
        let Some(boxes) = self.unclaimed_boxes(at, size) else { return false };
        boxes.iter().for_each(|&index| self.is_claimed[index] = true);
        true
    }

    fn unclaimed_boxes(&self, (col, row): (u32, u32), size: u32) -> Option<Vec<usize>> {
        let mut boxes = Vec::new();
        for row in row..row + size {
            for col in col..col + size {
                let index = (row * self.width + col) as usize;
                if col >= self.width || row >= self.height || self.is_claimed[index] {
                    return None;
                }
                boxes.push(index);
            }
        }
        Some(boxes)
    }

    /// Returns the place that is the fewest steps away where no box of a body is claimed.
    fn nearest(&self, graph: &AnchorGraph, from: (u32, u32)) -> Option<(u32, u32)> {
        let start = graph.anchor(from)?;
        let mut is_seen = vec![false; graph.len()];
        is_seen[start as usize] = true;
        let mut queue = VecDeque::from([start]);
        while let Some(at) = queue.pop_front() {
            let position = graph.position(at);
            if self.unclaimed_boxes(position, graph.size()).is_some() {
                return Some(position);
            }
            for (_, next) in graph.neighbors(at) {
                if !std::mem::replace(&mut is_seen[next as usize], true) {
                    queue.push_back(next);
                }
            }
        }
        None
    }
}
