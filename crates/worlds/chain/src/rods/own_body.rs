//! A tree of boxes over the rods, which finds the chain's own parts nearby.
//!
//! Neighbors along the chain are neighbors in space, so the tree over the index needs no sorting
//! and never changes its shape. A rod that moves gets its new box at once; the boxes above it grow
//! as far as they must and shrink when the tree is rebuilt, which every motion does.

use super::geometry::Bounds;

/// Rods per leaf.
const LEAF: usize = 4;

/// Boxes around the rods and their connectors, and around groups of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct OwnBody<const D: usize> {
    rods: Vec<Bounds<D>>,
    /// A binary heap: node 1 is the root, `leaves..2 * leaves` are the leaves.
    nodes: Vec<Bounds<D>>,
    leaves: usize,
}

impl<const D: usize> OwnBody<D> {
    /// Builds the tree anew.
    pub(crate) fn rebuild(&mut self, boxes: impl Iterator<Item = Bounds<D>>) {
        self.rods.clear();
        self.rods.extend(boxes);
        self.leaves = self.rods.len().div_ceil(LEAF).next_power_of_two();
        self.nodes.clear();
        self.nodes.resize(2 * self.leaves, Bounds::nothing());
        for leaf in 0..self.leaves {
            self.nodes[self.leaves + leaf] = self.around_leaf(leaf);
        }
        for node in (1..self.leaves).rev() {
            self.nodes[node] = self.nodes[2 * node].joined(&self.nodes[2 * node + 1]);
        }
    }

    fn around_leaf(&self, leaf: usize) -> Bounds<D> {
        let from = (leaf * LEAF).min(self.rods.len());
        let to = (from + LEAF).min(self.rods.len());
        self.rods[from..to].iter().fold(Bounds::nothing(), |all, b| all.joined(b))
    }

    /// Updates the box of a rod that has moved.
    pub(crate) fn set(&mut self, rod: usize, bounds: Bounds<D>) {
        self.rods[rod] = bounds;
        let mut node = self.leaves + rod / LEAF;
        // If a node contains the box, so do all above it.
        while node > 0 && !self.nodes[node].contains(&bounds) {
            self.nodes[node] = self.nodes[node].joined(&bounds);
            node /= 2;
        }
    }

    /// Visits the rods whose boxes meet `near`, in the order of the chain.
    pub(crate) fn visit(&self, near: &Bounds<D>, mut look: impl FnMut(usize)) {
        // The depth of the tree is at most the number of bits of a usize.
        let mut waiting = [0usize; 66];
        let mut n = usize::from(!self.rods.is_empty());
        waiting[0] = 1;
        while n > 0 {
            n -= 1;
            let node = waiting[n];
            if !self.nodes[node].meets(near) {
                continue;
            }
            if node < self.leaves {
                (waiting[n], waiting[n + 1]) = (2 * node + 1, 2 * node);
                n += 2;
                continue;
            }
            let from = (node - self.leaves) * LEAF;
            for rod in from..(from + LEAF).min(self.rods.len()) {
                if self.rods[rod].meets(near) {
                    look(rod);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_query_visits_exactly_what_is_near(
            corners in prop::collection::vec(prop::array::uniform2(-9.0..9.0f64), 0..40),
            moved in prop::array::uniform2(-9.0..9.0f64),
            at in prop::array::uniform2(-9.0..9.0f64),
        ) {
            let mut boxes: Vec<_> = corners.iter().map(|p| Bounds::of(&[*p]).grown(0.5)).collect();
            let mut tree = OwnBody::default();
            tree.rebuild(boxes.iter().copied());
            if let Some(last) = boxes.last_mut() {
                *last = Bounds::of(&[moved]).grown(1.0);
                tree.set(boxes.len() - 1, *boxes.last().unwrap());
            }
            let near = Bounds::of(&[at]).grown(2.0);
            let mut seen = Vec::new();
            tree.visit(&near, |k| seen.push(k));
            let expected: Vec<_> = (0..boxes.len()).filter(|&k| boxes[k].meets(&near)).collect();
            prop_assert_eq!(seen, expected);
        }
    }
}
