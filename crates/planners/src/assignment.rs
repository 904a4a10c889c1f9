//! Who gets which task.
//!
//! Rows are agents and columns are tasks; a cost is any number, such as the steps to the task. Agents or tasks may be
//! left over, and pairs without a path are never assigned.

/// The cost of each task for each agent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CostMatrix {
    agents: usize,
    tasks: usize,
    costs: Vec<u32>,
}

impl CostMatrix {
    /// The cost of a task that an agent cannot do.
    pub const IMPOSSIBLE: u32 = u32::MAX;

    /// Creates the matrix with `cost(agent, task)` for each pair.
    pub fn new(agents: usize, tasks: usize, mut cost: impl FnMut(usize, usize) -> u32) -> Self {
        let pairs = (0..agents).flat_map(|agent| (0..tasks).map(move |task| (agent, task)));
        let costs = pairs.map(|(agent, task)| cost(agent, task)).collect();
        Self { agents, tasks, costs }
    }

    /// Returns the cost of a task for an agent, or [`CostMatrix::IMPOSSIBLE`].
    ///
    /// # Panics
    /// When there is no such agent or task.
    pub fn cost(&self, agent: usize, task: usize) -> u32 {
        assert!(task < self.tasks, "task {task} of {}", self.tasks);
        self.costs[agent * self.tasks + task]
    }

    /// Returns the sum of the costs of an assignment, which has the task of each agent.
    pub fn total(&self, assignment: &[Option<usize>]) -> u64 {
        let pairs = assignment.iter().enumerate();
        let costs = pairs.filter_map(|(agent, task)| Some(self.cost(agent, (*task)?)));
        costs.map(u64::from).sum()
    }

    /// The cost in a sum that has first of all as few impossible pairs as possible.
    fn weight(&self, agent: usize, task: usize) -> i64 {
        match self.cost(agent, task) {
            // More than all others together, and as many of them as there may be agents still fit.
            Self::IMPOSSIBLE => 1 << 44,
            cost => i64::from(cost),
        }
    }
}

/// Assigns as many tasks as possible at the lowest sum of costs, by the Hungarian method (Kuhn 1955; Munkres 1957) with
/// shortest augmenting paths: time grows with the square of the smaller number times the larger one. Returns the task
/// of each agent.
pub fn kuhn_munkres(costs: &CostMatrix) -> Vec<Option<usize>> {
    let is_wide = costs.agents <= costs.tasks;
    let mut assignment = vec![None; costs.agents];
    let pairs = if is_wide {
        let weight = |row: usize, col: usize| costs.weight(row, col);
        assign_rows(costs.agents, costs.tasks, weight)
    } else {
        let weight = |row: usize, col: usize| costs.weight(col, row);
        assign_rows(costs.tasks, costs.agents, weight)
    };
    for (row, col) in pairs.into_iter().enumerate() {
        let [agent, task] = if is_wide { [row, col] } else { [col, row] };
        if costs.cost(agent, task) != CostMatrix::IMPOSSIBLE {
            assignment[agent] = Some(task);
        }
    }
    assignment
}

/// Potentials and matches of the Hungarian method. Row and column 0 are only there to begin from.
struct Matching {
    row_potentials: Vec<i64>,
    col_potentials: Vec<i64>,
    /// Row of each column, 0 if it is free.
    row_of: Vec<usize>,
}

/// Assigns a column to each row; there are at least as many columns.
fn assign_rows(rows: usize, cols: usize, weight: impl Fn(usize, usize) -> i64) -> Vec<usize> {
    let mut matching = Matching {
        row_potentials: vec![0; rows + 1],
        col_potentials: vec![0; cols + 1],
        row_of: vec![0; cols + 1],
    };
    for row in 1..=rows {
        matching.augment(row, &weight);
    }
    let mut col_of = vec![0; rows];
    for (col, &row) in matching.row_of.iter().enumerate().skip(1) {
        if row > 0 {
            col_of[row - 1] = col - 1;
        }
    }
    col_of
}

impl Matching {
    /// Matches one row more, along the shortest path of reduced costs to a free column.
    fn augment(&mut self, row: usize, weight: &impl Fn(usize, usize) -> i64) {
        let cols = self.row_of.len();
        let mut slacks = vec![i64::MAX; cols];
        let mut before = vec![0; cols];
        let mut is_done = vec![false; cols];
        let mut at = 0;
        self.row_of[0] = row;
        while self.row_of[at] != 0 {
            is_done[at] = true;
            let from = self.row_of[at];
            let mut nearest = 0;
            let mut delta = i64::MAX;
            for col in (1..cols).filter(|&col| !is_done[col]) {
                let reduced = weight(from - 1, col - 1)
                    - self.row_potentials[from]
                    - self.col_potentials[col];
                if reduced < slacks[col] {
                    slacks[col] = reduced;
                    before[col] = at;
                }
                if slacks[col] < delta {
                    delta = slacks[col];
                    nearest = col;
                }
            }
            self.shift(&is_done, &mut slacks, delta);
            at = nearest;
        }
        while at != 0 {
            self.row_of[at] = self.row_of[before[at]];
            at = before[at];
        }
    }

    fn shift(&mut self, is_done: &[bool], slacks: &mut [i64], delta: i64) {
        for (col, slack) in slacks.iter_mut().enumerate() {
            if is_done[col] {
                self.row_potentials[self.row_of[col]] += delta;
                self.col_potentials[col] -= delta;
            } else if *slack < i64::MAX {
                *slack -= delta;
            }
        }
    }
}

/// Gives each agent in turn the nearest task that is left; of equal ones the first. Returns the task of each agent.
pub fn nearest(costs: &CostMatrix) -> Vec<Option<usize>> {
    let mut is_taken = vec![false; costs.tasks];
    let mut choose = |agent: usize| {
        let tasks = (0..costs.tasks).filter(|&task| !is_taken[task]);
        let possible = tasks.filter(|&task| costs.cost(agent, task) != CostMatrix::IMPOSSIBLE);
        let best = possible.min_by_key(|&task| costs.cost(agent, task))?;
        is_taken[best] = true;
        Some(best)
    };
    (0..costs.agents).map(&mut choose).collect()
}

/// Gives each task in turn, the first one first, to the nearest agent without a task; of equal ones the first. Returns
/// the task of each agent.
pub fn fifo(costs: &CostMatrix) -> Vec<Option<usize>> {
    let mut assignment = vec![None; costs.agents];
    for task in 0..costs.tasks {
        let agents = (0..costs.agents).filter(|&agent| assignment[agent].is_none());
        let possible = agents.filter(|&agent| costs.cost(agent, task) != CostMatrix::IMPOSSIBLE);
        if let Some(best) = possible.min_by_key(|&agent| costs.cost(agent, task)) {
            assignment[best] = Some(task);
        }
    }
    assignment
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the most pairs and the lowest cost of them, by trying all.
    fn best(costs: &CostMatrix, agent: usize, taken: &mut Vec<bool>) -> (i64, u64) {
        if agent == costs.agents {
            return (0, 0);
        }
        let mut found = best(costs, agent + 1, taken);
        for task in 0..costs.tasks {
            if !taken[task] && costs.cost(agent, task) != CostMatrix::IMPOSSIBLE {
                taken[task] = true;
                let (pairs, cost) = best(costs, agent + 1, taken);
                taken[task] = false;
                found = found.min((pairs - 1, cost + u64::from(costs.cost(agent, task))));
            }
        }
        found
    }

    fn pairs(assignment: &[Option<usize>]) -> i64 {
        assignment.iter().flatten().count() as i64
    }

    proptest! {
        #[test]
        fn no_assignment_has_more_pairs_or_a_lower_cost(
            agents in 0usize..6, tasks in 0usize..6, costs in proptest::collection::vec(0u32..12, 36),
        ) {
            let cost = |agent: usize, task: usize| match costs[agent * 6 + task] {
                9.. => CostMatrix::IMPOSSIBLE,
                cost => cost,
            };
            let matrix = CostMatrix::new(agents, tasks, cost);
            let assignment = kuhn_munkres(&matrix);
            let found = (-pairs(&assignment), matrix.total(&assignment));
            prop_assert_eq!(found, best(&matrix, 0, &mut vec![false; tasks]));
            for other in [nearest(&matrix), fifo(&matrix)] {
                let mut tasks: Vec<usize> = other.iter().flatten().copied().collect();
                tasks.sort_unstable();
                tasks.dedup();
                prop_assert_eq!(tasks.len() as i64, pairs(&other));
                prop_assert!((-pairs(&other), matrix.total(&other)) >= found);
            }
        }
    }

    #[test]
    fn agents_choose_in_turn_by_nearest_and_tasks_in_turn_by_fifo() {
        let costs = [[5, 1], [4, 2]];
        let matrix = CostMatrix::new(2, 2, |agent, task| costs[agent][task]);
        assert_eq!(nearest(&matrix), [Some(1), Some(0)]);
        assert_eq!(fifo(&matrix), [Some(1), Some(0)]);
        let costs = [[1, 2], [0, 5]];
        let matrix = CostMatrix::new(2, 2, |agent, task| costs[agent][task]);
        assert_eq!(nearest(&matrix), [Some(0), Some(1)]);
        assert_eq!(fifo(&matrix), [Some(1), Some(0)]);
    }
}
