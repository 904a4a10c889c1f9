//! The number of steps to a goal from every pose, turns included.

use crate::graph::AnchorGraph;
use crate::pose::ActionModel;

/// Steps from every node to a goal, by breadth-first search from the goal back.
#[derive(Debug, Clone)]
pub(crate) struct GoalDistances {
    /// 4 where headings count, else 1.
    headings: u32,
    steps: Vec<u32>,
}

impl GoalDistances {
    pub(crate) const UNREACHABLE: u32 = u32::MAX;

    pub(crate) fn new(graph: &AnchorGraph, model: ActionModel, goal: u32) -> Self {
        let headings = match model {
            ActionModel::Turns => 4,
            ActionModel::Classical => 1,
        };
        let steps = vec![Self::UNREACHABLE; graph.len() * headings as usize];
        let mut distances = Self { headings, steps };
        let mut queue: Vec<u32> = (0..headings).map(|heading| goal * 4 + heading).collect();
        for &node in &queue {
            distances.set(node, 0);
        }
        let mut head = 0;
        while let Some(&node) = queue.get(head) {
            head += 1;
            distances.expand(graph, node, &mut queue);
        }
        distances
    }

    /// Returns the steps from a node to the goal, or [`GoalDistances::UNREACHABLE`].
    #[inline]
    pub(crate) fn steps(&self, node: u32) -> u32 {
        self.steps[self.slot(node)]
    }

    #[inline]
    fn slot(&self, node: u32) -> usize {
        let slot = if self.headings == 4 { node } else { node / 4 };
        slot as usize
    }

    fn set(&mut self, node: u32, steps: u32) {
        let slot = self.slot(node);
        self.steps[slot] = steps;
    }

    /// Adds the nodes from which one step leads to this one.
    fn expand(&mut self, graph: &AnchorGraph, node: u32, queue: &mut Vec<u32>) {
        let steps = self.steps(node) + 1;
        let anchor = node / 4;
        let heading = node % 4;
        if self.headings == 1 {
            for (_, neighbor) in graph.neighbors(anchor) {
                self.reach(neighbor * 4, steps, queue);
            }
            return;
        }
        self.reach(anchor * 4 + (heading + 1) % 4, steps, queue);
        self.reach(anchor * 4 + (heading + 3) % 4, steps, queue);
        // Forward leads here from the box behind.
        let back = ((heading + 2) % 4) as u8;
        if graph.exits(anchor) >> back & 1 == 1 {
            self.reach(graph.step(anchor, back) * 4 + heading, steps, queue);
        }
    }

    fn reach(&mut self, node: u32, steps: u32, queue: &mut Vec<u32>) {
        if self.steps(node) == Self::UNREACHABLE {
            self.set(node, steps);
            queue.push(node);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_map::planning::FreeSpace;

    #[test]
    fn turns_count_as_steps_and_the_heading_at_the_goal_does_not_matter() {
        let graph = AnchorGraph::new(&FreeSpace::new(3, 2, |_, _| true), 1);
        let distances = GoalDistances::new(&graph, ActionModel::Turns, 2);
        let from = |heading| distances.steps(heading);
        assert_eq!([0, 1, 2, 3].map(from), [2, 3, 4, 3]);
        assert_eq!([8, 9, 10, 11].map(from), [0; 4]);
        let classical = GoalDistances::new(&graph, ActionModel::Classical, 2);
        assert_eq!([0, 1, 2, 3].map(|heading| classical.steps(heading)), [2; 4]);
    }
}
