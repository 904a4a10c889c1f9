//! Where a body of n x n boxes can stand, and where it can go from there.

use crate::pose::{ActionModel, GridPose};
use sidestep_map::planning::FreeSpace;

/// No box, no agent, no label: an index that is never used.
pub(crate) const NONE: u32 = u32::MAX;

/// Set in the code of a box where the body fits; the bits below are the directions in which it can go.
const ANCHOR: u8 = 1 << 4;

/// The graph of a body of `size` x `size` boxes: its vertices are the boxes that can be the lower-left one of the body,
/// its edges the steps to the neighbors. Boxes are numbered row by row from the bottom.
///
/// A *node* is a box with a heading, `box * 4 + heading`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct AnchorGraph {
    width: u32,
    height: u32,
    size: u32,
    codes: Vec<u8>,
}

impl AnchorGraph {
    pub(crate) fn new(free: &FreeSpace, size: u32) -> Self {
        let anchors = free.anchors(size);
        let mut codes = vec![0; free.width() as usize * free.height() as usize];
        for row in 0..free.height() {
            for col in 0..free.width() {
                if anchors.is_free(col, row) {
                    let index = row as usize * free.width() as usize + col as usize;
                    codes[index] = ANCHOR | exits(&anchors, GridPose::new(col, row, 0));
                }
            }
        }
        Self { width: free.width(), height: free.height(), size, codes }
    }

    pub(crate) fn size(&self) -> u32 {
        self.size
    }

    /// Number of boxes of the grid.
    pub(crate) fn len(&self) -> usize {
        self.codes.len()
    }

    /// Returns the number of columns and rows.
    pub(crate) fn extent(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Returns the number of a box of the grid; none outside of it.
    pub(crate) fn index(&self, (col, row): (u32, u32)) -> Option<u32> {
        (col < self.width && row < self.height).then(|| row * self.width + col)
    }

    /// Returns the number of a box where the body fits.
    pub(crate) fn anchor(&self, position: (u32, u32)) -> Option<u32> {
        self.index(position).filter(|&index| self.is_anchor(index))
    }

    pub(crate) fn position(&self, index: u32) -> (u32, u32) {
        (index % self.width, index / self.width)
    }

    #[inline]
    pub(crate) fn is_anchor(&self, index: u32) -> bool {
        self.codes[index as usize] & ANCHOR != 0
    }

    /// Returns the directions in which the body can go from an anchor, one bit each.
    #[inline]
    pub(crate) fn exits(&self, index: u32) -> u8 {
        self.codes[index as usize] & (ANCHOR - 1)
    }

    /// Returns the neighbor in a direction that is an exit.
    #[inline]
    pub(crate) fn step(&self, index: u32, direction: u8) -> u32 {
        match direction {
            0 => index + 1,
            1 => index + self.width,
            2 => index - 1,
            _ => index - self.width,
        }
    }

    /// Returns the direction from a box to its neighbor; none if they are no neighbors.
    #[inline]
    pub(crate) fn direction(&self, from: u32, to: u32) -> Option<u8> {
        (0..4).find(|&direction| {
            self.exits(from) >> direction & 1 == 1 && self.step(from, direction) == to
        })
    }

    /// Returns the neighbors of an anchor, by direction.
    pub(crate) fn neighbors(&self, index: u32) -> impl Iterator<Item = (u8, u32)> + '_ {
        let exits = self.exits(index);
        (0..4)
            .filter(move |direction| exits >> direction & 1 == 1)
            .map(move |direction| (direction, self.step(index, direction)))
    }

    /// Returns the boxes of the body whose lower-left one is an anchor.
    #[inline]
    pub(crate) fn body(&self, anchor: u32) -> impl Iterator<Item = usize> + use<> {
        let width = self.width;
        let size = self.size;
        (0..size)
            .flat_map(move |row| (0..size).map(move |col| (anchor + row * width + col) as usize))
    }

    /// Returns the boxes within the grid of a body that may stand anywhere.
    pub(crate) fn clipped_body(&self, (col, row): (u32, u32)) -> Vec<u32> {
        let rows = row..row.saturating_add(self.size).min(self.height);
        let cols = move || col..col.saturating_add(self.size).min(self.width);
        rows.flat_map(|row| cols().map(move |col| (row, col)))
            .map(|(row, col)| row * self.width + col)
            .collect()
    }

    /// Returns the node of a pose whose body fits.
    pub(crate) fn node(&self, pose: GridPose) -> Option<u32> {
        let anchor = self.anchor(pose.position())?;
        (pose.heading < 4).then(|| anchor * 4 + u32::from(pose.heading))
    }

    pub(crate) fn pose(&self, node: u32) -> GridPose {
        let (col, row) = self.position(node / 4);
        GridPose::new(col, row, (node % 4) as u8)
    }

    /// Returns the nodes after one time step: those of moves first, the node itself last.
    pub(crate) fn successors(&self, model: ActionModel, node: u32) -> Nodes {
        let mut nodes = Nodes::default();
        let anchor = node / 4;
        let heading = node % 4;
        match model {
            ActionModel::Turns => {
                if self.exits(anchor) >> heading & 1 == 1 {
                    nodes.push(self.step(anchor, heading as u8) * 4 + heading);
                }
                nodes.push(anchor * 4 + (heading + 1) % 4);
                nodes.push(anchor * 4 + (heading + 3) % 4);
            }
            ActionModel::Classical => {
                for (_, neighbor) in self.neighbors(anchor) {
                    nodes.push(neighbor * 4 + heading);
                }
            }
        }
        nodes.push(node);
        nodes
    }
}

fn exits(anchors: &FreeSpace, pose: GridPose) -> u8 {
    let is_exit = |direction: &u8| {
        let neighbor = pose.after(crate::pose::Action::Move(*direction));
        neighbor.is_some_and(|neighbor| anchors.is_free(neighbor.col, neighbor.row))
    };
    (0..4u8).filter(is_exit).map(|direction| 1 << direction).sum()
}

/// At most five nodes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Nodes {
    nodes: [u32; 5],
    len: usize,
}

impl Nodes {
    fn push(&mut self, node: u32) {
        self.nodes[self.len] = node;
        self.len += 1;
    }

    pub(crate) fn as_slice(&self) -> &[u32] {
        &self.nodes[..self.len]
    }
}

/// The graphs of all sizes of bodies, and that of each agent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Graphs {
    graphs: Vec<AnchorGraph>,
    /// Index of the graph of each agent.
    of_agent: Vec<u32>,
}

impl Graphs {
    pub(crate) fn new(free: &FreeSpace, sizes: impl Iterator<Item = u32>) -> Self {
        let mut graphs: Vec<AnchorGraph> = Vec::new();
        let mut of_agent = Vec::new();
        for size in sizes {
            let index = graphs.iter().position(|graph| graph.size == size).unwrap_or_else(|| {
                graphs.push(AnchorGraph::new(free, size));
                graphs.len() - 1
            });
            of_agent.push(index as u32);
        }
        Self { graphs, of_agent }
    }

    pub(crate) fn agents(&self) -> usize {
        self.of_agent.len()
    }

    /// Returns the graph of an agent.
    #[inline]
    pub(crate) fn of(&self, agent: usize) -> &AnchorGraph {
        &self.graphs[self.of_agent[agent] as usize]
    }

    /// Returns the index of the graph of an agent in [`Graphs::all`].
    #[inline]
    pub(crate) fn index_of(&self, agent: usize) -> usize {
        self.of_agent[agent] as usize
    }

    pub(crate) fn all(&self) -> &[AnchorGraph] {
        &self.graphs
    }
}
