//! Which steps lead closer to a goal, kept for many goals in bounded memory.

use crate::graph::{AnchorGraph, NONE};

/// For each box, the directions whose step leads closer to one goal: half a byte per box.
///
/// A grid with four neighbors is bipartite, so every other step leads away by one: these bits are all that the order of
/// the neighbors by distance needs.
#[derive(Debug, Clone)]
struct DescentField {
    /// Even boxes in the low half of a byte.
    codes: Vec<u8>,
}

/// Mark of a box without a distance in the search; the others are distances modulo 3.
const UNREACHED: u8 = 3;

impl DescentField {
    /// Computes the field by breadth-first search from the goal back.
    fn new(graph: &AnchorGraph, goal: u32, buffers: &mut SearchBuffers) -> Self {
        let SearchBuffers { distances, queue } = buffers;
        distances.clear();
        distances.resize(graph.len(), UNREACHED);
        queue.clear();
        queue.push(goal);
        distances[goal as usize] = 0;
        let mut codes = vec![0u8; graph.len().div_ceil(2)];
        let mut head = 0;
        while let Some(&at) = queue.get(head) {
            head += 1;
            let distance = (distances[at as usize] + 1) % 3;
            for (direction, neighbor) in graph.neighbors(at) {
                let known = &mut distances[neighbor as usize];
                if *known == UNREACHED {
                    *known = distance;
                    queue.push(neighbor);
                }
                // Neighbors differ by one, so the same remainder is the same distance.
                if *known == distance {
                    let back = (direction + 2) % 4;
                    codes[neighbor as usize / 2] |= 1 << back << (neighbor % 2 * 4);
                }
            }
        }
        Self { codes }
    }

    #[inline]
    fn directions(&self, at: u32) -> u8 {
        self.codes[at as usize / 2] >> (at % 2 * 4) & 0xf
    }
}

#[derive(Debug, Clone, Default)]
struct SearchBuffers {
    distances: Vec<u8>,
    queue: Vec<u32>,
}

/// Fields of goals, computed when they are first asked for. What it forgets is computed again, so its size changes no
/// result.
#[derive(Debug, Clone)]
pub(crate) struct DescentCache {
    fields: Vec<Entry>,
    /// Index of the field of a goal, by graph and box.
    index: Vec<Vec<u32>>,
    /// Number of fields that may be kept.
    capacity: usize,
    buffers: SearchBuffers,
    /// Counts the steps, to know what was used in this one.
    now: u64,
}

#[derive(Debug, Clone)]
struct Entry {
    graph: usize,
    goal: u32,
    used: u64,
    field: DescentField,
}

impl DescentCache {
    /// Creates a cache that keeps at most so many bytes of fields, and at least one field.
    pub(crate) fn new(graphs: &[AnchorGraph], max_bytes: usize) -> Self {
        let boxes = graphs.first().map_or(0, AnchorGraph::len);
        let capacity = (max_bytes / boxes.div_ceil(2).max(1)).max(1);
        let index = graphs.iter().map(|graph| vec![NONE; graph.len()]).collect();
        Self { fields: Vec::new(), index, capacity, buffers: SearchBuffers::default(), now: 0 }
    }

    /// Begins a step: what it uses is kept longer than what it does not.
    pub(crate) fn begin_step(&mut self) {
        self.now += 1;
    }

    /// Returns the directions that lead from a box closer to a goal, one bit each: none at the goal, and where no path
    /// leads to it.
    #[inline]
    pub(crate) fn directions(&mut self, graphs: &[AnchorGraph], key: FieldKey, at: u32) -> u8 {
        let FieldKey { graph, goal } = key;
        if goal == NONE {
            return 0;
        }
        let mut index = self.index[graph][goal as usize];
        if index == NONE {
            index = self.insert(&graphs[graph], key);
        }
        let entry = &mut self.fields[index as usize];
        entry.used = self.now;
        entry.field.directions(at)
    }

    fn insert(&mut self, graph: &AnchorGraph, key: FieldKey) -> u32 {
        let field = DescentField::new(graph, key.goal, &mut self.buffers);
        let entry = Entry { graph: key.graph, goal: key.goal, used: self.now, field };
        let index = if self.fields.len() < self.capacity {
            self.fields.push(entry);
            self.fields.len() - 1
        } else {
            let index = self.victim();
            let old = std::mem::replace(&mut self.fields[index], entry);
            self.index[old.graph][old.goal as usize] = NONE;
            index
        };
        self.index[key.graph][key.goal as usize] = index as u32;
        index as u32
    }

    /// Returns the field that was not used for longest. Where all were used in this step, it is the last one: if it
    /// were the first, the next step would miss each of them in turn.
    fn victim(&self) -> usize {
        let oldest = (0..self.fields.len()).min_by_key(|&index| self.fields[index].used);
        oldest.filter(|&index| self.fields[index].used < self.now).unwrap_or(self.fields.len() - 1)
    }
}

/// The goal of an agent and the index of its graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FieldKey {
    pub(crate) graph: usize,
    /// Its box, or none.
    pub(crate) goal: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distances::GoalDistances;
    use crate::pose::ActionModel;
    use proptest::prelude::*;
    use sidestep_map::planning::FreeSpace;

    proptest! {
        #[test]
        fn exactly_the_steps_that_reduce_the_distance_are_descents_whatever_the_cache_keeps(
            width in 1u32..9, height in 1u32..9, walls in any::<[u128; 2]>(),
            goals in proptest::collection::vec(0u32..81, 1..6), max_bytes in 0usize..100,
        ) {
            let is_wall = |index: u32| walls.iter().all(|w| w.rotate_right(index) & 1 == 1);
            let free = FreeSpace::new(width, height, |col, row| !is_wall(row * 9 + col));
            let graphs = [AnchorGraph::new(&free, 1)];
            let mut cache = DescentCache::new(&graphs, max_bytes);
            for goal in goals.iter().map(|goal| goal % (width * height)) {
                if !graphs[0].is_anchor(goal) {
                    continue;
                }
                cache.begin_step();
                let distances = GoalDistances::new(&graphs[0], ActionModel::Classical, goal);
                for at in (0..width * height).filter(|&at| graphs[0].is_anchor(at)) {
                    let mut expected = 0;
                    for (direction, neighbor) in graphs[0].neighbors(at) {
                        if distances.steps(neighbor * 4) < distances.steps(at * 4) {
                            expected |= 1 << direction;
                        }
                    }
                    let key = FieldKey { graph: 0, goal };
                    prop_assert_eq!(cache.directions(&graphs, key, at), expected);
                }
            }
            prop_assert!(cache.fields.len() <= cache.capacity);
        }
    }
}
