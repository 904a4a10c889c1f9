//! Tasks that never end: which are known, who has which, and which place comes next.
//!
//! A task is a list of places that one agent visits in order. Some tasks are revealed at any time; whenever one is
//! finished, the next of the list is. A task can change hands until its first place was visited.

use crate::assignment::{CostMatrix, kuhn_munkres};
use serde::{Deserialize, Serialize};

/// Most pairs that are compared at once.
const MAX_PAIRS: usize = 1 << 18;

/// How tasks are given to agents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskPolicy {
    /// The pair with the lowest cost first, again and again.
    #[default]
    Nearest,
    /// The task that was revealed first, to the agent with the lowest cost.
    Fifo,
    /// The lowest sum of costs, for at most so many agents and twice as many tasks at once.
    Optimal {
        /// Most agents at once.
        window: usize,
    },
}

/// The task of an agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskOfAgent {
    /// Its number among all that were revealed.
    pub task: u64,
    /// The number of its places that were visited.
    pub visited: u32,
}

/// All that changes: to continue elsewhere, keep it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskState {
    /// The number of tasks that were revealed.
    pub revealed: u64,
    /// Tasks that nobody has, in the order in which they were revealed.
    pub open: Vec<u64>,
    /// The task of each agent.
    pub agents: Vec<Option<TaskOfAgent>>,
    /// The number of tasks that were finished.
    pub finished: u64,
}

/// A list of tasks, which begins again where it ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskList<P> {
    tasks: Vec<Vec<P>>,
    /// The number of tasks that are known and not finished at any time.
    known: usize,
}

impl<P: Copy + PartialEq> TaskList<P> {
    /// Creates the list; tasks without any place are left out.
    pub fn new(tasks: Vec<Vec<P>>, known: usize) -> Self {
        let tasks = tasks.into_iter().filter(|task| !task.is_empty()).collect();
        Self { tasks, known }
    }

    /// Returns the state in which no task is revealed yet.
    pub fn begin(&self, agents: usize) -> TaskState {
        TaskState { revealed: 0, open: Vec::new(), agents: vec![None; agents], finished: 0 }
    }

    /// Returns the number of tasks in the list.
    pub fn count(&self) -> usize {
        self.tasks.len()
    }

    /// Returns the places of a task, in order.
    pub fn places(&self, task: u64) -> &[P] {
        &self.tasks[(task % self.tasks.len() as u64) as usize]
    }

    /// Reveals tasks until as many are known as there should be. Returns whether there are new ones.
    pub fn reveal(&self, state: &mut TaskState) -> bool {
        if self.tasks.is_empty() {
            return false;
        }
        let before = state.revealed;
        while state.revealed - state.finished < self.known as u64 {
            state.open.push(state.revealed);
            state.revealed += 1;
        }
        state.revealed > before
    }

    /// Returns the place where an agent has to go next.
    pub fn goal(&self, state: &TaskState, agent: usize) -> Option<P> {
        let own = state.agents[agent]?;
        self.places(own.task).get(own.visited as usize).copied()
    }

    /// Notes that an agent is at a place. Returns whether it was its goal.
    pub fn visit(&self, state: &mut TaskState, agent: usize, place: P) -> bool {
        if self.goal(state, agent) != Some(place) {
            return false;
        }
        if let Some(own) = &mut state.agents[agent] {
            own.visited += 1;
            if own.visited as usize == self.places(own.task).len() {
                state.agents[agent] = None;
                state.finished += 1;
            }
        }
        true
    }

    /// Takes back all tasks whose first place was not visited.
    pub fn take_back(&self, state: &mut TaskState) {
        for own in &mut state.agents {
            if own.is_some_and(|own| own.visited == 0) {
                state.open.extend(own.take().map(|own| own.task));
            }
        }
        state.open.sort_unstable();
    }

    /// Gives tasks to agents without one. The cost of a pair is any number; those of
    /// [`CostMatrix::IMPOSSIBLE`] are never made.
    pub fn assign(
        &self,
        state: &mut TaskState,
        policy: TaskPolicy,
        mut cost: impl FnMut(usize, u64) -> u32,
    ) {
        let mut free: Vec<usize> = Vec::new();
        free.extend((0..state.agents.len()).filter(|&agent| state.agents[agent].is_none()));
        match policy {
            TaskPolicy::Nearest => {
                // The others get theirs at the next call.
                free.truncate((MAX_PAIRS / state.open.len().max(1)).max(1));
                assign_nearest(state, &free, cost);
            }
            TaskPolicy::Fifo => assign_fifo(state, free, cost),
            TaskPolicy::Optimal { window } => {
                for agents in free.chunks(window.max(1)) {
                    let tasks = state.open[..state.open.len().min(2 * window.max(1))].to_vec();
                    let costs = CostMatrix::new(agents.len(), tasks.len(), |agent, task| {
                        cost(agents[agent], tasks[task])
                    });
                    for (agent, task) in agents.iter().zip(kuhn_munkres(&costs)) {
                        if let Some(task) = task {
                            give(state, *agent, tasks[task]);
                        }
                    }
                }
            }
        }
    }
}

fn give(state: &mut TaskState, agent: usize, task: u64) {
    if let Ok(index) = state.open.binary_search(&task) {
        state.open.remove(index);
        state.agents[agent] = Some(TaskOfAgent { task, visited: 0 });
    }
}

/// Makes the cheapest pair of all, then the cheapest of those left.
fn assign_nearest(state: &mut TaskState, free: &[usize], mut cost: impl FnMut(usize, u64) -> u32) {
    let mut pairs = Vec::with_capacity(free.len() * state.open.len());
    for &agent in free {
        for &task in &state.open {
            let cost = cost(agent, task);
            if cost != CostMatrix::IMPOSSIBLE {
                pairs.push((cost, agent as u32, task));
            }
        }
    }
    pairs.sort_unstable();
    for (_, agent, task) in pairs {
        if state.agents[agent as usize].is_none() {
            give(state, agent as usize, task);
        }
    }
}

fn assign_fifo(
    state: &mut TaskState,
    mut free: Vec<usize>,
    mut cost: impl FnMut(usize, u64) -> u32,
) {
    for task in state.open.clone() {
        let costs = free.iter().enumerate().map(|(index, &agent)| (cost(agent, task), index));
        let best = costs.filter(|(cost, _)| *cost != CostMatrix::IMPOSSIBLE).min();
        if let Some((_, index)) = best {
            give(state, free.swap_remove(index), task);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places and agents on a line; the cost is the distance to the first place.
    fn line(policy: TaskPolicy) -> (TaskList<u32>, TaskState) {
        let list = TaskList::new(vec![vec![50, 51], vec![10], vec![], vec![21]], 3);
        let mut state = list.begin(2);
        assert!(list.reveal(&mut state));
        let at = [0u32, 20];
        list.assign(&mut state, policy, |agent, task| at[agent].abs_diff(list.places(task)[0]));
        (list, state)
    }

    #[test]
    fn each_policy_gives_tasks_in_its_own_order() {
        let tasks = |policy| {
            let (_, state) = line(policy);
            state.agents.iter().map(|own| own.map(|own| own.task)).collect::<Vec<_>>()
        };
        assert_eq!(tasks(TaskPolicy::Nearest), [Some(1), Some(2)]);
        assert_eq!(tasks(TaskPolicy::Fifo), [Some(1), Some(0)]);
        assert_eq!(tasks(TaskPolicy::Optimal { window: 8 }), [Some(1), Some(2)]);
    }

    #[test]
    fn places_are_visited_in_order_and_a_finished_task_reveals_the_next() {
        let (list, mut state) = line(TaskPolicy::Fifo);
        assert!(!list.visit(&mut state, 1, 51));
        assert!(list.visit(&mut state, 1, 50));
        assert_eq!((list.goal(&state, 1), state.finished), (Some(51), 0));
        assert!(!list.reveal(&mut state));
        assert!(list.visit(&mut state, 1, 51));
        assert_eq!((list.goal(&state, 1), state.finished), (None, 1));
        assert!(list.reveal(&mut state));
        assert_eq!((state.revealed, list.places(3)), (4, &[50, 51][..]));
    }

    #[test]
    fn a_task_changes_hands_only_until_its_first_place_was_visited() {
        let (list, mut state) = line(TaskPolicy::Fifo);
        list.visit(&mut state, 1, 50);
        list.take_back(&mut state);
        assert_eq!((state.agents[0], list.goal(&state, 1)), (None, Some(51)));
        assert_eq!(state.open, [1, 2]);
    }
}
