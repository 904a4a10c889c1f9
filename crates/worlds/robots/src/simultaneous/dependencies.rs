//! Who waits for whom in a group that moves at once, and the order in which that is resolved.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Marks a node that the search has not reached, or that is in no component yet.
const NONE: u32 = u32::MAX;

/// A directed graph: an edge leads from a body to one that stands where it wants to go. Nodes are the turns of the
/// bodies, in the order of their draws.
#[derive(Debug, Default)]
pub(super) struct DependencyGraph {
    /// End of each node's edges in `targets`.
    ends: Vec<u32>,
    targets: Vec<u32>,
}

/// Sets of nodes in the order in which they are resolved.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    nodes: Vec<u32>,
    /// End of each set in `nodes`.
    ends: Vec<u32>,
}

impl Schedule {
    /// Returns the sets, the first one first; the nodes of each rise.
    pub(super) fn sets(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.nodes[start as usize..end as usize])
    }
}

impl DependencyGraph {
    /// Removes all nodes.
    pub(super) fn clear(&mut self) {
        self.ends.clear();
        self.targets.clear();
    }

    /// Adds an edge of the node that is added next.
    pub(super) fn add_edge(&mut self, target: u32) {
        let start = self.ends.last().copied().unwrap_or(0) as usize;
        // A body mostly meets the same one in several boxes.
        if !self.targets[start..].contains(&target) {
            self.targets.push(target);
        }
    }

    /// Adds a node with the edges that were added since the last one.
    pub(super) fn add_node(&mut self) {
        self.ends.push(self.targets.len() as u32);
    }

    fn targets_of(&self, node: u32) -> &[u32] {
        let end = self.ends[node as usize];
        let start = node.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.targets[start as usize..end as usize]
    }

    /// Returns the sets of nodes that reach each other, each after all that it leads to; of those that could be
    /// next, the one with the smallest node is.
    pub(super) fn schedule(&self) -> Schedule {
        let nodes: Vec<u32> = (0..self.ends.len() as u32).collect();
        if self.targets.is_empty() {
            let ends = nodes.iter().map(|node| node + 1).collect();
            return Schedule { nodes, ends };
        }
        Condensation::new(self, nodes).schedule()
    }

    /// Returns the number of each node's strongly connected component (Tarjan 1972).
    fn components(&self) -> Vec<u32> {
        let n = self.ends.len();
        let mut search = Search {
            graph: self,
            index: vec![NONE; n],
            low: vec![NONE; n],
            component: vec![NONE; n],
            open: Vec::new(),
            reached: 0,
            closed: 0,
        };
        for node in 0..n as u32 {
            if search.index[node as usize] == NONE {
                search.visit(node);
            }
        }
        search.component
    }
}

/// A search for components, without recursion, because a queue of robots may be long.
struct Search<'a> {
    graph: &'a DependencyGraph,
    /// The nodes by the order in which they were reached.
    index: Vec<u32>,
    /// The smallest index that a node reaches.
    low: Vec<u32>,
    component: Vec<u32>,
    /// Nodes that are in no component yet.
    open: Vec<u32>,
    reached: u32,
    closed: u32,
}

impl Search<'_> {
    fn visit(&mut self, root: u32) {
        let mut path = vec![self.reach(root)];
        while let Some(step) = path.last_mut() {
            let node = step.node;
            let Some(&target) = self.graph.targets_of(node).get(step.edge) else {
                path.pop();
                self.leave(node, path.last().map(|parent| parent.node));
                continue;
            };
            step.edge += 1;
            if self.index[target as usize] == NONE {
                path.push(self.reach(target));
            } else if self.component[target as usize] == NONE {
                self.lower(node, self.index[target as usize]);
            }
        }
    }

    fn reach(&mut self, node: u32) -> PathNode {
        self.index[node as usize] = self.reached;
        self.low[node as usize] = self.reached;
        self.reached += 1;
        self.open.push(node);
        PathNode { node, edge: 0 }
    }

    fn lower(&mut self, node: u32, to: u32) {
        let low = &mut self.low[node as usize];
        *low = (*low).min(to);
    }

    fn leave(&mut self, node: u32, parent: Option<u32>) {
        if let Some(parent) = parent {
            self.lower(parent, self.low[node as usize]);
        }
        if self.low[node as usize] != self.index[node as usize] {
            return;
        }
        while let Some(member) = self.open.pop() {
            self.component[member as usize] = self.closed;
            if member == node {
                break;
            }
        }
        self.closed += 1;
    }
}

/// A node on the path of a search, and the number of its edge that is next.
struct PathNode {
    node: u32,
    edge: usize,
}

/// The components of a graph as nodes of a graph without circles.
struct Condensation {
    /// By component, rising within each.
    nodes: Vec<u32>,
    /// Start of each component in `nodes`, and the end of the last.
    starts: Vec<usize>,
    /// Pairs of a component and one that waits for it, sorted.
    dependents: Vec<(u32, u32)>,
    /// Number of edges for which each component waits.
    waits: Vec<u32>,
}

impl Condensation {
    fn new(graph: &DependencyGraph, mut nodes: Vec<u32>) -> Self {
        let component = graph.components();
        let mut dependents = Vec::new();
        for &node in &nodes {
            let own = component[node as usize];
            let others = graph.targets_of(node).iter().map(|&target| component[target as usize]);
            dependents.extend(others.filter(|&other| other != own).map(|other| (other, own)));
        }
        dependents.sort_unstable();
        // Stable, so that the nodes of a component still rise.
        nodes.sort_by_key(|&node| component[node as usize]);
        let count = component.iter().max().map_or(0, |last| last + 1);
        let starts = (0..=count)
            .map(|k| nodes.partition_point(|&node| component[node as usize] < k))
            .collect();
        let mut waits = vec![0; count as usize];
        dependents.iter().for_each(|&(_, waiting)| waits[waiting as usize] += 1);
        Self { nodes, starts, dependents, waits }
    }

    fn members(&self, component: u32) -> &[u32] {
        &self.nodes[self.starts[component as usize]..self.starts[component as usize + 1]]
    }

    fn schedule(mut self) -> Schedule {
        let mut schedule = Schedule::default();
        let first = |this: &Self, component| Reverse((this.members(component)[0], component));
        let ready = (0..self.waits.len() as u32).filter(|&k| self.waits[k as usize] == 0);
        let mut ready: BinaryHeap<_> = ready.map(|k| first(&self, k)).collect();
        while let Some(Reverse((_, component))) = ready.pop() {
            schedule.nodes.extend_from_slice(self.members(component));
            schedule.ends.push(schedule.nodes.len() as u32);
            let start = self.dependents.partition_point(|&(on, _)| on < component);
            let end = self.dependents.partition_point(|&(on, _)| on <= component);
            for k in start..end {
                let waiting = self.dependents[k].1;
                self.waits[waiting as usize] -= 1;
                if self.waits[waiting as usize] == 0 {
                    ready.push(first(&self, waiting));
                }
            }
        }
        schedule
    }
}

#[cfg(test)]
mod tests {
    use super::DependencyGraph;

    fn sets(edges: &[&[u32]]) -> Vec<Vec<u32>> {
        let mut graph = DependencyGraph::default();
        for targets in edges {
            targets.iter().for_each(|&target| graph.add_edge(target));
            graph.add_node();
        }
        graph.schedule().sets().map(<[u32]>::to_vec).collect()
    }

    #[test]
    fn bodies_that_wait_for_nobody_go_by_their_draws() {
        assert_eq!(sets(&[&[], &[], &[]]), [[0], [1], [2]]);
    }

    #[test]
    fn a_queue_is_resolved_from_its_head() {
        assert_eq!(sets(&[&[1], &[2], &[]]), [[2], [1], [0]]);
    }

    #[test]
    fn a_ring_is_one_set_and_comes_before_those_that_wait_for_it() {
        assert_eq!(sets(&[&[1], &[2], &[3], &[1], &[]]), [vec![1, 2, 3], vec![0], vec![4]]);
    }

    #[test]
    fn of_two_that_wait_for_the_same_body_the_smaller_draw_is_first() {
        // The queue behind 2 does not make it come before 1.
        assert_eq!(sets(&[&[2], &[3], &[3], &[]]), [[3], [1], [2], [0]]);
    }
}
