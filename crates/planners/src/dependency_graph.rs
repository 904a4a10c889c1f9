//! Carrying out a plan although agents are late: who must have left a box before whom.
//!
//! A plan is safe only if all agents keep its times. What has to be kept instead is the order in which agents pass each
//! box (Hönig, Kiesel, Tinka, Durham and Ayanian 2019, "Persistent and robust execution of MAPF schedules in
//! warehouses", the action dependency graph). An agent that keeps it meets nobody, however late others are, and where
//! everybody goes on in the end, everybody arrives.

use crate::graph::NONE;
use crate::instance::Instance;
use crate::plan::{Plan, PlanError};
use crate::pose::{Action, GridPose};

/// What an agent may do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Permission<'a> {
    /// It has done all its actions.
    Complete,
    /// Somebody has to leave a box first.
    Wait,
    /// It may begin its next action.
    Go,
    /// It may begin its next action together with these agents, who rotate in a circle: each enters the box that
    /// another one leaves, so all have to move in one step.
    GoTogether(&'a [u32]),
}

/// One action of an agent; waiting is none.
#[derive(Debug, Clone)]
struct ActionNode {
    step: u32,
    action: Action,
    /// Pose after the action.
    pose: GridPose,
    /// Actions of others that have to be done before, as agent and number of actions.
    after: Vec<(u32, u32)>,
    /// The circle that it is a part of, or none.
    circle: u32,
}

/// The order in which the actions of a plan may be done.
#[derive(Debug, Clone)]
pub struct DependencyGraph {
    actions: Vec<Vec<ActionNode>>,
    /// Agents that move in one step together.
    circles: Vec<Vec<u32>>,
}

impl DependencyGraph {
    /// Creates the graph of a plan.
    ///
    /// # Errors
    /// When the plan is wrong.
    pub fn new(instance: &Instance, plan: &Plan) -> Result<Self, PlanError> {
        plan.validate(instance)?;
        let agents = 0..plan.agents();
        let actions = agents.map(|agent| actions(instance, plan.path(agent))).collect();
        let mut graph = Self { actions, circles: Vec::new() };
        graph.add_dependencies(instance, plan);
        graph.find_circles(plan.steps());
        Ok(graph)
    }

    /// Returns the number of actions of an agent, waiting aside.
    ///
    /// # Panics
    /// When there is no such agent.
    pub fn actions(&self, agent: usize) -> usize {
        self.actions[agent].len()
    }

    /// Returns an action of an agent and the pose that it leads to; none if it has done all.
    ///
    /// # Panics
    /// When there is no such agent.
    pub fn action(&self, agent: usize, index: usize) -> Option<(Action, GridPose)> {
        let node = self.actions[agent].get(index)?;
        Some((node.action, node.pose))
    }

    /// Returns the actions of others, as agent and index, that have to be done before an action of an agent.
    ///
    /// # Panics
    /// When there is no such action.
    pub fn dependencies(&self, agent: usize, index: usize) -> impl Iterator<Item = (usize, usize)> {
        let after = &self.actions[agent][index].after;
        after.iter().map(|&(other, done)| (other as usize, done as usize - 1))
    }

    /// Returns the circle of which an action of an agent is a part, by its number and its agents.
    pub(crate) fn circle(&self, agent: usize, index: usize) -> Option<(u32, &[u32])> {
        let number = self.actions[agent].get(index)?.circle;
        let agents = self.circles.get(number as usize)?;
        Some((number, agents))
    }

    /// Returns the circles: agents who have to move in one step, since each enters the box of another. Without them the
    /// graph has no cycle.
    pub fn circles(&self) -> &[Vec<u32>] {
        &self.circles
    }

    /// Returns what an agent may do, if each agent has done so many of its actions.
    ///
    /// # Panics
    /// When there is no such agent, or `progress` has another length than there are agents.
    pub fn permission(&self, agent: usize, progress: &[usize]) -> Permission<'_> {
        assert_eq!(progress.len(), self.actions.len(), "one number of done actions per agent");
        let Some(node) = self.actions[agent].get(progress[agent]) else {
            return Permission::Complete;
        };
        if node.circle == NONE {
            let is_free = is_free(node, progress);
            return if is_free { Permission::Go } else { Permission::Wait };
        }
        let circle = &self.circles[node.circle as usize];
        let is_ready = |&other: &u32| {
            let next = self.actions[other as usize].get(progress[other as usize]);
            next.is_some_and(|next| next.circle == node.circle && is_free(next, progress))
        };
        if circle.iter().all(is_ready) { Permission::GoTogether(circle) } else { Permission::Wait }
    }

    /// Returns whether the actions, circles counted as one, can all be done in some order. It holds for each graph of a
    /// plan.
    pub fn is_acyclic(&self) -> bool {
        let mut progress = vec![0; self.actions.len()];
        loop {
            let mut has_moved = false;
            for agent in 0..self.actions.len() {
                while let Some(movers) = self.movers(agent, &progress) {
                    movers.iter().for_each(|&mover| progress[mover as usize] += 1);
                    has_moved = true;
                }
            }
            if !has_moved {
                return (0..progress.len()).all(|agent| progress[agent] == self.actions(agent));
            }
        }
    }

    /// Returns who moves if an agent may, itself among them.
    fn movers(&self, agent: usize, progress: &[usize]) -> Option<Vec<u32>> {
        match self.permission(agent, progress) {
            Permission::Complete | Permission::Wait => None,
            Permission::Go => Some(vec![agent as u32]),
            Permission::GoTogether(circle) => Some(circle.to_vec()),
        }
    }

    /// Adds to each action that enters a box the one by which the agent before left it.
    fn add_dependencies(&mut self, instance: &Instance, plan: &Plan) {
        let boxes = instance.graphs().all().first().map_or(0, |graph| graph.len());
        // Who left each box last, and how many actions it had done then.
        let mut last_left = vec![(NONE, 0u32); boxes];
        let mut done = vec![0u32; plan.agents()];
        for step in 1..=plan.steps() {
            let mut entered = Vec::new();
            for (agent, done) in done.iter_mut().enumerate() {
                let before = plan.pose(agent, step - 1);
                let after = plan.pose(agent, step);
                if before == after {
                    continue;
                }
                *done += 1;
                let old: Vec<usize> = body(instance, agent, before).collect();
                let new: Vec<usize> = body(instance, agent, after).collect();
                for &left in old.iter().filter(|left| !new.contains(left)) {
                    last_left[left] = (agent as u32, *done);
                }
                let is_new = |at: &&usize| !old.contains(at);
                entered.extend(new.iter().filter(is_new).map(|&at| (agent, *done, at)));
            }
            // Only now, because a box may be left in the step in which it is entered.
            for (agent, done, at) in entered {
                self.add_dependency(agent, done, last_left[at]);
            }
        }
    }

    fn add_dependency(&mut self, agent: usize, done: u32, (other, left): (u32, u32)) {
        let after = &mut self.actions[agent][done as usize - 1].after;
        if other != NONE && other != agent as u32 && !after.contains(&(other, left)) {
            after.push((other, left));
        }
    }

    /// Finds the actions of each step that depend on each other in a circle. Dependencies lead from a step to an
    /// earlier one or to the same, so a cycle lies within a step.
    fn find_circles(&mut self, steps: usize) {
        let mut by_step: Vec<Vec<(u32, u32)>> = vec![Vec::new(); steps + 1];
        for (agent, nodes) in self.actions.iter().enumerate() {
            for (index, node) in nodes.iter().enumerate() {
                by_step[node.step as usize].push((agent as u32, index as u32));
            }
        }
        for nodes in by_step {
            let edges = self.edges_within(&nodes);
            for circle in find_groups(&edges) {
                let number = self.circles.len() as u32;
                let agents = circle.iter().map(|&position| nodes[position].0).collect();
                for &position in &circle {
                    let (agent, index) = nodes[position];
                    self.enclose(&nodes, &circle, (agent, index), number);
                }
                self.circles.push(agents);
            }
        }
    }

    /// Marks an action as part of a circle; it does not wait for the others of it.
    fn enclose(
        &mut self,
        nodes: &[(u32, u32)],
        circle: &[usize],
        (agent, index): (u32, u32),
        number: u32,
    ) {
        let node = &mut self.actions[agent as usize][index as usize];
        node.circle = number;
        let is_inside = |&(other, done): &(u32, u32)| {
            circle.iter().any(|&position| nodes[position] == (other, done - 1))
        };
        node.after.retain(|dependency| !is_inside(dependency));
    }

    /// Returns the dependencies within one step, by the positions of its actions.
    fn edges_within(&self, nodes: &[(u32, u32)]) -> Vec<Vec<usize>> {
        let position = |node: (u32, u32)| nodes.binary_search(&node).ok();
        let edges = nodes.iter().map(|&(agent, index)| {
            let after = &self.actions[agent as usize][index as usize].after;
            after.iter().filter_map(|&(other, done)| position((other, done - 1))).collect()
        });
        edges.collect()
    }
}

fn is_free(node: &ActionNode, progress: &[usize]) -> bool {
    node.after.iter().all(|&(other, done)| progress[other as usize] >= done as usize)
}

fn actions(instance: &Instance, path: &[GridPose]) -> Vec<ActionNode> {
    let mut actions = Vec::new();
    for (step, pair) in path.windows(2).enumerate() {
        let action = instance.model().action_between(pair[0], pair[1]);
        let action = action.expect("checked by validation");
        if action != Action::Wait {
            actions.push(ActionNode {
                step: step as u32 + 1,
                action,
                pose: pair[1],
                after: Vec::new(),
                circle: NONE,
            });
        }
    }
    actions
}

fn body(instance: &Instance, agent: usize, pose: GridPose) -> impl Iterator<Item = usize> + use<> {
    let graph = instance.graph(agent);
    graph.body(graph.anchor(pose.position()).expect("checked by validation"))
}

/// Returns the groups of nodes that lie on cycles or between them: what is left when nodes without edges to others, or
/// from others, are removed until there is none. Each group is a connected part of that.
fn find_groups(edges: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut is_left = vec![true; edges.len()];
    loop {
        let mut has_entry = vec![false; edges.len()];
        let mut has_exit = vec![false; edges.len()];
        for (from, others) in edges.iter().enumerate().filter(|&(from, _)| is_left[from]) {
            for &to in others.iter().filter(|&&to| is_left[to]) {
                has_exit[from] = true;
                has_entry[to] = true;
            }
        }
        let removed: Vec<usize> = (0..edges.len())
            .filter(|&node| is_left[node] && !(has_entry[node] && has_exit[node]))
            .collect();
        if removed.is_empty() {
            break;
        }
        removed.iter().for_each(|&node| is_left[node] = false);
    }
    connected_groups(edges, &mut is_left)
}

/// Returns the connected parts of the nodes that are left.
fn connected_groups(edges: &[Vec<usize>], is_left: &mut [bool]) -> Vec<Vec<usize>> {
    let mut both_ways: Vec<Vec<usize>> = vec![Vec::new(); edges.len()];
    for (from, others) in edges.iter().enumerate() {
        for &to in others {
            both_ways[from].push(to);
            both_ways[to].push(from);
        }
    }
    let mut groups = Vec::new();
    for first in 0..edges.len() {
        if !std::mem::replace(&mut is_left[first], false) {
            continue;
        }
        let mut group = vec![first];
        let mut head = 0;
        while let Some(&node) = group.get(head) {
            head += 1;
            for &other in &both_ways[node] {
                if std::mem::replace(&mut is_left[other], false) {
                    group.push(other);
                }
            }
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}
