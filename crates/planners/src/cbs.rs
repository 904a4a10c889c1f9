//! Conflict-based search: plans with the lowest sum of costs, for small teams.
//!
//! Each agent plans alone. Of the conflicts between their paths one is resolved in both ways, by a constraint on either
//! agent, in a tree that is searched by cost (Sharon, Stern, Felner and Sturtevant 2015, "Conflict-based search for
//! optimal multi-agent pathfinding", section 4). Of several conflicts it takes one that raises the cost in both ways,
//! if there is one (Boyarski et al. 2015, "ICBS": cardinal conflicts), which it finds by trying.

use crate::distances::GoalDistances;
use crate::graph::{AnchorGraph, NONE};
use crate::instance::Instance;
use crate::plan::Plan;
use crate::pose::ActionModel;
use sidestep_kernel::InputError;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashSet};
use std::rc::Rc;
use std::sync::Arc;

/// Conflicts of a node that are tried, to find one that raises the cost in both ways.
const MAX_TRIALS: usize = 4;

/// What came of a search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CbsOutcome {
    /// The plan with the lowest sum of costs; none if the budget was spent.
    pub plan: Option<Plan>,
    /// The lowest sum of costs that a plan can have, as far as the search knows: that of the plan, if there is one.
    pub lower_bound: u64,
    /// The number of nodes of the tree that were expanded.
    pub expansions: u64,
}

/// Plans by conflict-based search, with at most so many expansions. A problem without a solution spends any budget.
///
/// # Errors
/// Where no path leads from a start to its goal, even for an agent alone.
pub fn plan(instance: &Instance, budget_expansions: u64) -> Result<CbsOutcome, InputError> {
    let mut search = Search::new(instance)?;
    let mut outcome = CbsOutcome { plan: None, lower_bound: 0, expansions: 0 };
    while let Some((Reverse(cost), _, Reverse(index))) = search.open.pop() {
        outcome.lower_bound = cost;
        let conflicts = search.conflicts(&search.nodes[index as usize].paths);
        if conflicts.is_empty() {
            outcome.plan = Some(search.to_plan(index));
            break;
        }
        if outcome.expansions == budget_expansions {
            break;
        }
        outcome.expansions += 1;
        search.split(index, &conflicts);
    }
    Ok(outcome)
}

/// What an agent may not do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Constraint {
    /// Cover this box at this time.
    Cover(u32, u32),
    /// Begin a move at this time from one box to the other.
    Move(u32, u32, u32),
}

/// Two agents that cannot both keep their paths, and a constraint for either that one of them has to obey.
#[derive(Debug, Clone, Copy)]
struct Conflict {
    agents: [usize; 2],
    constraints: [Constraint; 2],
}

/// A node of the tree of constraints.
struct TreeNode {
    parent: u32,
    /// The constraint that it adds, and for whom; the root has none.
    constraint: Option<(usize, Constraint)>,
    paths: Vec<Rc<[u32]>>,
    cost: u64,
}

struct Search<'a> {
    instance: &'a Instance,
    distances: &'a [Arc<GoalDistances>],
    nodes: Vec<TreeNode>,
    /// Nodes by cost, then by the number of conflicts, then the oldest first.
    open: BinaryHeap<(Reverse<u64>, Reverse<usize>, Reverse<u32>)>,
}

impl<'a> Search<'a> {
    fn new(instance: &'a Instance) -> Result<Self, InputError> {
        let distances = instance.distances()?;
        let mut search = Self { instance, distances, nodes: Vec::new(), open: BinaryHeap::new() };
        let path =
            |agent| search.path(agent, &BTreeSet::new()).expect("a path without constraints");
        let paths: Vec<Rc<[u32]>> = (0..instance.agents().len()).map(path).collect();
        search.insert(TreeNode { parent: NONE, constraint: None, cost: cost(&paths), paths });
        Ok(search)
    }

    fn insert(&mut self, node: TreeNode) {
        let conflicts = self.conflicts(&node.paths).len();
        let index = self.nodes.len() as u32;
        self.open.push((Reverse(node.cost), Reverse(conflicts), Reverse(index)));
        self.nodes.push(node);
    }

    /// Resolves the best of some conflicts in both ways.
    fn split(&mut self, index: u32, conflicts: &[Conflict]) {
        let cost = self.nodes[index as usize].cost;
        let mut best: Option<(usize, Vec<TreeNode>)> = None;
        for conflict in conflicts.iter().take(MAX_TRIALS) {
            let children = self.children(index, conflict);
            // Without a child on one side, nothing is left there: that is the highest cost of all.
            let raised = 2 - children.iter().filter(|child| child.cost == cost).count();
            if best.as_ref().is_none_or(|(most, _)| raised > *most) {
                best = Some((raised, children));
            }
            if raised == 2 {
                break;
            }
        }
        for child in best.into_iter().flat_map(|(_, children)| children) {
            self.insert(child);
        }
    }

    fn children(&self, index: u32, conflict: &Conflict) -> Vec<TreeNode> {
        let options = conflict.agents.into_iter().zip(conflict.constraints);
        options.filter_map(|(agent, constraint)| self.child(index, agent, constraint)).collect()
    }

    fn child(&self, parent: u32, agent: usize, constraint: Constraint) -> Option<TreeNode> {
        let mut constraints = self.constraints(parent, agent);
        constraints.insert(constraint);
        let path = self.path(agent, &constraints)?;
        let mut paths = self.nodes[parent as usize].paths.clone();
        paths[agent] = path;
        let cost = cost(&paths);
        Some(TreeNode { parent, constraint: Some((agent, constraint)), paths, cost })
    }

    /// Returns what an agent may not do in a node of the tree.
    fn constraints(&self, mut index: u32, agent: usize) -> BTreeSet<Constraint> {
        let mut constraints = BTreeSet::new();
        while index != NONE {
            let node = &self.nodes[index as usize];
            if let Some((_, constraint)) = node.constraint.filter(|(of, _)| *of == agent) {
                constraints.insert(constraint);
            }
            index = node.parent;
        }
        constraints
    }

    fn path(&self, agent: usize, constraints: &BTreeSet<Constraint>) -> Option<Rc<[u32]>> {
        let low_level = LowLevel {
            graph: self.instance.graph(agent),
            model: self.instance.model(),
            distances: &self.distances[agent],
            goal: self.instance.goal_box(agent),
            constraints,
        };
        low_level.search(self.instance.start_node(agent)).map(Rc::from)
    }

    /// Returns the first conflict of each pair of agents, in the order of their times.
    fn conflicts(&self, paths: &[Rc<[u32]>]) -> Vec<Conflict> {
        let steps = paths.iter().map(|path| path.len()).max().unwrap_or(0);
        let mut found: BTreeMap<[usize; 2], Conflict> = BTreeMap::new();
        let mut in_order = Vec::new();
        let mut before = BTreeMap::new();
        for time in 0..steps as u32 {
            let covers = self.covers(paths, time);
            let overlaps = covers.iter().flat_map(|(&at, agents)| overlaps(at, time, agents));
            let swaps = self.swaps(paths, time, &before);
            for conflict in overlaps.chain(swaps) {
                if found.insert(conflict.agents, conflict).is_none() {
                    in_order.push(conflict);
                }
            }
            before = covers;
        }
        in_order
    }

    /// Returns the agents that cover each box at a time.
    fn covers(&self, paths: &[Rc<[u32]>], time: u32) -> BTreeMap<u32, Vec<usize>> {
        let mut covers: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (agent, path) in paths.iter().enumerate() {
            for covered in self.instance.graph(agent).body(node_at(path, time) / 4) {
                covers.entry(covered as u32).or_default().push(agent);
            }
        }
        covers
    }

    /// Returns the agents of one box that exchange their boxes in the step that ends at a time.
    fn swaps(
        &self,
        paths: &[Rc<[u32]>],
        time: u32,
        before: &BTreeMap<u32, Vec<usize>>,
    ) -> Vec<Conflict> {
        let mut swaps = Vec::new();
        let is_small = |agent: usize| self.instance.graph(agent).size() == 1;
        for (agent, path) in paths.iter().enumerate().filter(|&(agent, _)| is_small(agent)) {
            let Some(start) = time.checked_sub(1) else { continue };
            let from = node_at(path, start) / 4;
            let to = node_at(path, time) / 4;
            let others = before.get(&to).into_iter().flatten().copied();
            for other in others.filter(|&other| other > agent && is_small(other) && from != to) {
                if node_at(&paths[other], time) / 4 == from {
                    swaps.push(Conflict {
                        agents: [agent, other],
                        constraints: [
                            Constraint::Move(start, from, to),
                            Constraint::Move(start, to, from),
                        ],
                    });
                }
            }
        }
        swaps
    }

    fn to_plan(&self, index: u32) -> Plan {
        let paths = self.nodes[index as usize].paths.iter().enumerate();
        let poses = paths.map(|(agent, path)| {
            path.iter().map(|&node| self.instance.graph(agent).pose(node)).collect()
        });
        Plan::new(poses.collect())
    }
}

/// Returns the node of a path at a time; it stays at the last one.
fn node_at(path: &[u32], time: u32) -> u32 {
    path[(time as usize).min(path.len() - 1)]
}

fn cost(paths: &[Rc<[u32]>]) -> u64 {
    paths.iter().map(|path| path.len() as u64 - 1).sum()
}

/// Returns the conflicts of all pairs that cover a box at a time.
fn overlaps(at: u32, time: u32, agents: &[usize]) -> Vec<Conflict> {
    let constraints = [Constraint::Cover(time, at); 2];
    let pairs = agents
        .iter()
        .enumerate()
        .flat_map(|(index, &agent)| agents[index + 1..].iter().map(move |&other| [agent, other]));
    pairs.map(|agents| Conflict { agents, constraints }).collect()
}

/// A node at a time, and the label before it.
#[derive(Debug, Clone, Copy)]
struct Label {
    node: u32,
    time: u32,
    parent: u32,
}

/// Labels by the lower bound of the arrival at the goal; of equal ones the latest, which is the nearest.
type OpenList = BinaryHeap<(Reverse<u32>, u32, Reverse<u32>)>;

/// The search for the path of one agent.
struct LowLevel<'a> {
    graph: &'a AnchorGraph,
    model: ActionModel,
    distances: &'a GoalDistances,
    goal: u32,
    constraints: &'a BTreeSet<Constraint>,
}

impl LowLevel<'_> {
    /// Returns a shortest path that obeys the constraints, by A* in space and time.
    fn search(&self, start: u32) -> Option<Vec<u32>> {
        // Behind the last constraint, times do not differ.
        let horizon = self.constraints.iter().map(|constraint| constraint.time() + 1).max();
        let horizon = horizon.unwrap_or(0);
        let earliest_end = self.earliest_end();
        let mut closed = HashSet::new();
        let mut labels = Vec::new();
        let mut open = BinaryHeap::new();
        if !self.is_covered(start, 0) {
            self.reach(&mut open, &mut labels, Label { node: start, time: 0, parent: NONE });
        }
        while let Some((_, _, Reverse(index))) = open.pop() {
            let Label { node, time, .. } = labels[index as usize];
            if !closed.insert((node, time.min(horizon))) {
                continue;
            }
            if node / 4 == self.goal && time >= earliest_end {
                return Some(path_to(&labels, index));
            }
            for &next in self.graph.successors(self.model, node).as_slice() {
                if self.is_allowed(node, next, time) {
                    let label = Label { node: next, time: time + 1, parent: index };
                    self.reach(&mut open, &mut labels, label);
                }
            }
        }
        None
    }

    fn reach(&self, open: &mut OpenList, labels: &mut Vec<Label>, label: Label) {
        let distance = self.distances.steps(label.node);
        if distance != GoalDistances::UNREACHABLE {
            let index = labels.len() as u32;
            open.push((Reverse(label.time + distance), label.time, Reverse(index)));
            labels.push(label);
        }
    }

    /// Returns the first time from which on the agent may stay at its goal.
    fn earliest_end(&self) -> u32 {
        let body: Vec<u32> = self.graph.body(self.goal).map(|covered| covered as u32).collect();
        let ends = self.constraints.iter().filter_map(|constraint| match constraint {
            Constraint::Cover(time, at) if body.contains(at) => Some(time + 1),
            _ => None,
        });
        ends.max().unwrap_or(0)
    }

    fn is_allowed(&self, from: u32, to: u32, time: u32) -> bool {
        if self.is_covered(to, time + 1) {
            return false;
        }
        !self.constraints.contains(&Constraint::Move(time, from / 4, to / 4))
    }

    fn is_covered(&self, node: u32, time: u32) -> bool {
        let mut body = self.graph.body(node / 4);
        body.any(|covered| self.constraints.contains(&Constraint::Cover(time, covered as u32)))
    }
}

impl Constraint {
    fn time(self) -> u32 {
        match self {
            Self::Cover(time, _) | Self::Move(time, ..) => time,
        }
    }
}

fn path_to(labels: &[Label], mut index: u32) -> Vec<u32> {
    let mut path = Vec::new();
    while index != NONE {
        let label = labels[index as usize];
        path.push(label.node);
        index = label.parent;
    }
    path.reverse();
    path
}
