//! The teams that planners lead: their robots, and what a planner remembers of them.

use crate::belief::{Beliefs, Reports};
use crate::effector::ActionId;
use crate::errand_fields::ErrandFields;
use crate::goal_distances::GoalDistances;
use crate::team_memory::TeamMemory;
use crate::team_words;
use sidestep_kernel::{EntityId, Seed};
use sidestep_map::planning::{FlowField, FreeSpace};
use sidestep_planners::tasks::TaskState;
use sidestep_planners::{
    Action, Dispatcher, GridPose, Method, PlanCounts, TeamPlanner, TeamPlannerConfig,
    TeamPlannerState, TeamTasks,
};
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Robots that one planner leads: those of one section, or of several that follow each other. All have one size and act in
/// the same cycles.
#[derive(Debug, Clone)]
pub(crate) struct Team {
    /// Their ids.
    pub(crate) robots: Range<EntityId>,
    /// Who leads them.
    pub(crate) leader: TeamLeader,
    /// What they carry out; none for robots with goals of their own.
    pub(crate) tasks: Option<Arc<TeamTasks>>,
    /// The steps to their goals, where a caller orders them and so observes the steps. No result depends on which are kept,
    /// so all runs of a scenario share them.
    pub(crate) goal_distances: Option<Arc<Mutex<GoalDistances>>>,
}

impl Team {
    /// Returns the steps from a pose to a goal and by how much each neighbor is nearer; see [`GoalDistances::steps`].
    pub(crate) fn steps_to(&self, pose: GridPose, goal: Option<(u32, u32)>) -> (i64, [i64; 4]) {
        let distances = self.goal_distances.as_ref().zip(goal);
        distances.map_or((-1, [0; 4]), |(distances, goal)| lock(distances).steps(pose, goal))
    }
}

/// Who leads a team.
#[derive(Debug, Clone)]
pub(crate) struct TeamLeader {
    /// The planner. The seed is another one in each run.
    pub(crate) config: TeamPlannerConfig,
    /// What a caller orders all robots to do, instead of the planner.
    pub(crate) orders: Option<TeamOrders>,
    /// How robots report where they are; without it, the planner knows all that is true.
    pub(crate) reports: Option<Reports>,
}

/// What a caller orders the robots of a team to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TeamOrders {
    /// The next action.
    Actions,
    /// A plan of up to so many actions, which the executor carries out.
    Plans {
        /// The actions of an order; a shorter plan waits at its end.
        actions: u32,
    },
}

/// Where a robot with a task goes next.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Errand {
    /// Another one for its next errand.
    pub(crate) number: u32,
    /// Errands of its task that it has done.
    pub(crate) visited: u32,
    pub(crate) place: (u32, u32),
}

/// The planner of a team: what changes, and a cache.
#[derive(Debug)]
pub(crate) struct TeamState {
    /// Directions to goals and buffers. No result depends on what they hold, so copies of a state share them.
    planner: Arc<Mutex<TeamPlanner>>,
    /// Whether it plans step by step, and remembers no plan.
    is_stepwise: bool,
    /// Only the phase *plan* writes it, on one worker.
    memory: Mutex<TeamMemory>,
    /// The tasks of a team that has some; only the phase *plan* writes them.
    tasks: Option<Mutex<TaskMemory>>,
    /// The paths to errands, on floors where robots with tasks are looked at. No result depends on which are kept, so copies
    /// of a state share them.
    errand_fields: Option<Arc<Mutex<ErrandFields>>>,
}

/// The tasks of a team, and who gives them to its robots.
#[derive(Debug, Clone)]
pub(crate) struct TaskMemory {
    /// No result depends on what it remembers, so copies of a state share it.
    pub(crate) dispatcher: Arc<Mutex<Dispatcher>>,
    pub(crate) state: TaskState,
}

/// Locks a value. A poisoned lock is fine: after a panic nothing of the run is read.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl TeamState {
    /// Returns the state of a team of robots of these sizes before the first cycle.
    pub(crate) fn new(free: &FreeSpace, sizes: &[u32], team: &Team, seed: Seed) -> Self {
        let config = TeamPlannerConfig { seed, ..team.leader.config.clone() };
        let is_stepwise = config.method == Method::Pibt;
        let planner = TeamPlanner::new(free, sizes, config).expect("a body has at least one box");
        let robots = sizes.len();
        let has_reports = team.leader.reports.is_some();
        let memory = TeamMemory {
            planner: TeamPlannerState::new(robots),
            planned: vec![None; robots],
            off_plan: vec![0; robots],
            beliefs: Beliefs::new(if has_reports { robots } else { 0 }),
        };
        let planner = Arc::new(Mutex::new(planner));
        Self { planner, is_stepwise, memory: Mutex::new(memory), tasks: None, errand_fields: None }
    }

    /// Returns the same team with tasks, which were checked.
    pub(crate) fn with_tasks(
        self,
        free: &FreeSpace,
        sizes: &[u32],
        tasks: Option<&TeamTasks>,
    ) -> Self {
        let tasks = tasks.zip(sizes.first()).map(|(tasks, &size)| {
            let dispatcher = Dispatcher::new(free, size, tasks).expect("the tasks were checked");
            let state = dispatcher.begin(sizes.len());
            Mutex::new(TaskMemory { dispatcher: Arc::new(Mutex::new(dispatcher)), state })
        });
        let size = sizes.first().copied().unwrap_or(1);
        let errand_fields = tasks.as_ref().and_then(|_| ErrandFields::new(free, size));
        let errand_fields = errand_fields.map(|fields| Arc::new(Mutex::new(fields)));
        Self { tasks, errand_fields, ..self }
    }

    /// Returns the tasks of a team that has some.
    pub(crate) fn tasks(&self) -> Option<MutexGuard<'_, TaskMemory>> {
        self.tasks.as_ref().map(lock)
    }

    /// Returns the place where a robot with a task has to go next.
    pub(crate) fn goal_of_task(&self, robot: usize) -> Option<(u32, u32)> {
        let memory = self.tasks()?;
        lock(&memory.dispatcher).goal(&memory.state, robot)
    }

    /// Returns the errand of a robot; none without a task, and on floors where robots with tasks are not looked at.
    pub(crate) fn errand(&self, robot: usize) -> Option<Errand> {
        self.errand_fields.as_ref()?;
        let memory = self.tasks()?;
        let own = memory.state.agents[robot]?;
        let place = lock(&memory.dispatcher).goal(&memory.state, robot)?;
        // Six bits for the errands of a task: of two that would be mixed up, the robot has one long before the other.
        let number = (own.task as u32) << 6 | own.visited & 63;
        Some(Errand { number, visited: own.visited, place })
    }

    /// Returns the paths to the errand of a robot, as [`Self::errand`].
    pub(crate) fn errand_field(&self, robot: usize) -> Option<Arc<FlowField>> {
        let place = self.errand(robot)?.place;
        let fields = self.errand_fields.as_ref()?;
        Some(lock(fields).field(place))
    }

    /// Records the action that a caller orders for a robot that reports: it gets it when it is believed to be free.
    pub(crate) fn order_action(&self, robot: usize, action: ActionId) {
        lock(&self.memory).beliefs.robots[robot].order = Some(action);
    }

    /// Records the actions of a plan that a caller orders for a robot; the others wait, unless they are ordered, too.
    pub(crate) fn order_plan(&self, robot: usize, actions: Vec<Action>) {
        let mut memory = lock(&self.memory);
        let robots = memory.off_plan.len();
        let plan = memory.planner.ordered.get_or_insert_with(|| vec![Vec::new(); robots]);
        plan[robot] = actions;
    }

    /// Returns the planner and what it remembers, for planning a step.
    pub(crate) fn locked(&self) -> (MutexGuard<'_, TeamPlanner>, MutexGuard<'_, TeamMemory>) {
        (lock(&self.planner), lock(&self.memory))
    }

    /// Returns a copy for trying a cycle.
    pub(crate) fn trial_copy(&self) -> Self {
        let memory = Mutex::new(lock(&self.memory).clone());
        let tasks = self.tasks().map(|tasks| Mutex::new(tasks.clone()));
        let planner = Arc::clone(&self.planner);
        let errand_fields = self.errand_fields.clone();
        Self { planner, is_stepwise: self.is_stepwise, memory, tasks, errand_fields }
    }

    /// Returns a robot's share of the state in words.
    pub(crate) fn words(&self, robot: usize) -> Vec<u32> {
        team_words::words(&lock(&self.memory), robot, self.is_stepwise)
    }

    /// Takes over what [`Self::words`] returned for each robot. The number of steps follows from the cycle.
    pub(crate) fn restore(&self, words: &[&[u32]], step: u64) {
        let mut memory = lock(&self.memory);
        team_words::restore(&mut memory, words, self.is_stepwise);
        memory.planner.pibt.step = step;
        if self.is_stepwise {
            memory.planner.counts.plans = step;
        }
    }

    /// Returns how often a robot was elsewhere than planned.
    pub(crate) fn off_plan(&self, robot: usize) -> u32 {
        lock(&self.memory).off_plan[robot]
    }

    /// Returns the pose that a robot has after its planned action.
    pub(crate) fn planned(&self, robot: usize) -> Option<GridPose> {
        lock(&self.memory).planned[robot]
    }

    /// Returns what became of the plans so far.
    pub(crate) fn counts(&self) -> PlanCounts {
        lock(&self.memory).planner.counts
    }
}
