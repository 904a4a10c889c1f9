//! Who carries out which task, whatever planner leads the agents: visits, new tasks, and who gets them.

use crate::assignment::CostMatrix;
use crate::goal_fields::{GoalFields, straight_steps};
use crate::graph::{AnchorGraph, NONE};
use crate::instance::check_sizes;
use crate::pose::GridPose;
use crate::tasks::{TaskList, TaskPolicy, TaskState};
use sidestep_kernel::InputError;
use sidestep_map::planning::FreeSpace;
use std::collections::BTreeSet;

/// Most pairs of agents and tasks for which tasks are given anew whenever there are new ones.
const MAX_PAIRS: usize = 1 << 18;
/// Most bytes kept for the steps to places. What is forgotten is computed again.
const MAX_FIELD_BYTES: usize = 1 << 28;

/// The tasks of a team, and how they are given to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TeamTasks {
    /// The places (column, row) that each task visits, in order; at the end, the list begins again.
    pub tasks: Vec<Vec<(u32, u32)>>,
    /// The number of tasks that are known and not finished at any time.
    pub known: usize,
    /// How tasks are given to agents.
    pub policy: TaskPolicy,
}

/// An agent that carries out tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Courier {
    /// Where it is, or where its action leads it.
    pub pose: GridPose,
    /// Whether it is in the midst of an action, so that it visits nothing yet.
    pub is_in_action: bool,
}

/// Gives tasks to agents of one size. Its results depend on its arguments and on the [`TaskState`]; what it remembers
/// besides only saves time.
#[derive(Debug, Clone)]
pub struct Dispatcher {
    graph: AnchorGraph,
    fields: GoalFields,
    /// Equal for boxes with a path between them.
    labels: Vec<u32>,
    tasks: TaskList<u32>,
    policy: TaskPolicy,
}

impl Dispatcher {
    /// Creates the dispatcher of agents with bodies of `size` x `size` boxes.
    ///
    /// # Errors
    /// When the size is 0, or the body does not fit at a place of a task.
    pub fn new(free: &FreeSpace, size: u32, team: &TeamTasks) -> Result<Self, InputError> {
        check_sizes([size].into_iter())?;
        let graph = AnchorGraph::new(free, size);
        let mut lists = Vec::with_capacity(team.tasks.len());
        for (task, places) in team.tasks.iter().enumerate() {
            let boxes = places.iter().map(|&place| {
                graph.anchor(place).ok_or_else(|| {
                    let cause =
                        format!("a body of {size} x {size} boxes does not fit at {place:?}");
                    let remedy = "give a box (column, row) where the whole body is on free boxes";
                    InputError::new(format!("tasks[{task}]"), cause, remedy)
                })
            });
            lists.push(boxes.collect::<Result<Vec<u32>, InputError>>()?);
        }
        Ok(Self {
            fields: GoalFields::new(&graph, 1, MAX_FIELD_BYTES),
            labels: component_labels(&graph),
            tasks: TaskList::new(lists, team.known),
            policy: team.policy,
            graph,
        })
    }

    /// Returns the state in which no task is revealed yet.
    pub fn begin(&self, agents: usize) -> TaskState {
        self.tasks.begin(agents)
    }

    /// Returns the place where an agent has to go next.
    pub fn goal(&self, state: &TaskState, agent: usize) -> Option<(u32, u32)> {
        self.tasks.goal(state, agent).map(|index| self.graph.position(index))
    }

    /// Returns the places of a task, in order.
    pub fn places(&self, task: u64) -> Vec<(u32, u32)> {
        self.tasks.places(task).iter().map(|&index| self.graph.position(index)).collect()
    }

    /// Returns the tasks of the list that no agent which starts at one of some places can carry out, because it cannot
    /// come to all of their places.
    pub fn tasks_out_of_reach(&self, starts: &[(u32, u32)]) -> Vec<u64> {
        let label = |index: u32| self.labels[index as usize];
        let boxes = starts.iter().filter_map(|&start| self.graph.anchor(start));
        let starts: BTreeSet<u32> = boxes.map(label).collect();
        let is_out_of_reach = |&task: &u64| {
            let places = self.tasks.places(task);
            let first = places.first().map(|&place| label(place));
            let is_whole = places.iter().all(|&place| Some(label(place)) == first);
            !is_whole || first.is_some_and(|first| !starts.contains(&first))
        };
        (0..self.tasks.count() as u64).filter(is_out_of_reach).collect()
    }

    /// Notes which agents are at the places where they had to go, reveals new tasks, and gives tasks to agents without
    /// one. Returns the agents that have finished a task.
    ///
    /// On floors of up to 16,384 boxes, the cost of a task are the steps and turns that it takes, beyond that those without
    /// walls. An agent without a path to all places of a task never gets it.
    pub fn advance(&mut self, state: &mut TaskState, couriers: &[Courier]) -> Vec<usize> {
        let mut finished = Vec::new();
        for (agent, courier) in couriers.iter().enumerate() {
            let at = self.graph.anchor(courier.pose.position()).filter(|_| !courier.is_in_action);
            let Some(at) = at else { continue };
            let before = state.finished;
            self.tasks.visit(state, agent, at);
            if state.finished > before {
                finished.push(agent);
            }
        }
        let is_new = self.tasks.reveal(state);
        if is_new || state.agents.iter().any(Option::is_none) {
            self.assign(state, couriers, is_new);
        }
        finished
    }

    fn assign(&mut self, state: &mut TaskState, couriers: &[Courier], is_new: bool) {
        let agents = couriers.len();
        if is_new && agents * (agents + state.open.len()) <= MAX_PAIRS {
            self.tasks.take_back(state);
        }
        let Self { graph, fields, labels, tasks, policy } = self;
        let mut steps = |goal: u32, at: u32, heading: u8| {
            if !fields.is_small() {
                return straight_steps(graph, at, goal);
            }
            // Each on its own, so that no number depends on what was asked before.
            fields.begin_tick(usize::MAX);
            fields.prepare(graph, goal);
            fields.steps(graph, goal, at, heading)
        };
        tasks.assign(state, *policy, |agent, task| {
            let pose = couriers[agent].pose;
            let Some(at) = graph.anchor(pose.position()) else { return CostMatrix::IMPOSSIBLE };
            let places = tasks.places(task);
            if places.iter().any(|&place| labels[place as usize] != labels[at as usize]) {
                return CostMatrix::IMPOSSIBLE;
            }
            let between: u32 = places.windows(2).map(|pair| steps(pair[1], pair[0], 0)).sum();
            steps(places[0], at, pose.heading) + between
        });
    }
}

/// Returns a number for each box, equal for those with a path between them.
fn component_labels(graph: &AnchorGraph) -> Vec<u32> {
    let mut labels = vec![NONE; graph.len()];
    let mut stack = Vec::new();
    for start in 0..graph.len() as u32 {
        if !graph.is_anchor(start) || labels[start as usize] != NONE {
            continue;
        }
        labels[start as usize] = start;
        stack.push(start);
        while let Some(at) = stack.pop() {
            for (_, neighbor) in graph.neighbors(at) {
                if labels[neighbor as usize] == NONE {
                    labels[neighbor as usize] = start;
                    stack.push(neighbor);
                }
            }
        }
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A free floor of 5 x 1 boxes, a wall, and two more boxes.
    fn free() -> FreeSpace {
        FreeSpace::new(8, 1, |col, _| col != 5)
    }

    fn couriers(cols: [u32; 2], is_in_action: bool) -> [Courier; 2] {
        cols.map(|col| Courier { pose: GridPose::new(col, 0, 0), is_in_action })
    }

    fn team(tasks: Vec<Vec<(u32, u32)>>) -> TeamTasks {
        TeamTasks { tasks, known: 2, policy: TaskPolicy::Nearest }
    }

    #[test]
    fn a_task_is_given_to_the_nearest_agent_that_can_come_to_all_of_its_places() {
        let tasks = team(vec![vec![(4, 0), (2, 0)], vec![(7, 0)]]);
        let mut dispatcher = Dispatcher::new(&free(), 1, &tasks).expect("fits");
        let mut state = dispatcher.begin(2);
        assert_eq!(dispatcher.advance(&mut state, &couriers([1, 0], false)), [0usize; 0]);
        assert_eq!(dispatcher.goal(&state, 0), Some((4, 0)));
        assert_eq!(dispatcher.goal(&state, 1), None, "nobody can come to (7, 0)");
        assert_eq!(state.open, [1]);
    }

    #[test]
    fn a_task_is_out_of_reach_without_a_start_from_where_all_of_its_places_are_reached() {
        let tasks = team(vec![vec![(4, 0)], vec![(7, 0)], vec![(4, 0), (6, 0)]]);
        let dispatcher = Dispatcher::new(&free(), 1, &tasks).expect("fits");
        assert_eq!(dispatcher.tasks_out_of_reach(&[(0, 0), (1, 0)]), [1, 2]);
        assert_eq!(dispatcher.tasks_out_of_reach(&[(0, 0), (6, 0)]), [2]);
    }

    #[test]
    fn a_place_is_visited_when_the_action_has_ended_that_leads_there() {
        let tasks = team(vec![vec![(4, 0), (2, 0)]]);
        let mut dispatcher = Dispatcher::new(&free(), 1, &tasks).expect("fits");
        let mut state = dispatcher.begin(2);
        dispatcher.advance(&mut state, &couriers([1, 6], false));
        dispatcher.advance(&mut state, &couriers([4, 6], true));
        assert_eq!(dispatcher.goal(&state, 0), Some((4, 0)));
        dispatcher.advance(&mut state, &couriers([4, 6], false));
        assert_eq!(dispatcher.goal(&state, 0), Some((2, 0)));
        assert_eq!(dispatcher.advance(&mut state, &couriers([2, 6], false)), [0]);
        assert_eq!(state.finished, 1);
    }

    #[test]
    fn a_place_in_a_wall_is_refused_with_the_number_of_its_task() {
        let error = Dispatcher::new(&free(), 1, &team(vec![vec![(1, 0)], vec![(5, 0)]]));
        let error = error.expect_err("a wall");
        assert_eq!(error.place(), "tasks[1]");
        assert!(error.cause().contains("does not fit at (5, 0)"), "{error}");
    }
}
