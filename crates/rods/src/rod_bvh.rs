//! A bounding volume hierarchy over the rods, which finds the chain's own parts nearby.
//!
//! Neighbors along the chain are neighbors in space, so the tree over the index needs no sorting
//! and never changes its shape. A rod that moves gets its new box at once; the boxes above it grow
//! as far as they must, and shrink at the start of the next motion, which refits the changed leaves.

use super::geometry::Aabb;
use std::ops::Range;

/// Rods per leaf. More rods make a smaller tree, which is refitted in less time (with four it has a quarter of the
/// nodes), but more tests in a query; few of them are in vain, since neighbors along the chain mostly meet the same
/// query. The value was not tuned.
const RODS_PER_LEAF: usize = 4;

/// Boxes around the rods and their connectors, and around groups of them.
#[derive(Debug, Clone, Default)]
pub struct RodBvh<const D: usize> {
    rods: Vec<Aabb<D>>,
    /// A binary heap: node 1 is the root, `leaves..2 * leaves` are the leaves.
    nodes: Vec<Aabb<D>>,
    leaves: usize,
    /// Leaves whose boxes, or the ones above, may be larger than necessary.
    loose: Range<usize>,
}

impl<const D: usize> RodBvh<D> {
    /// Fits the tree to boxes: all of it if their number is new, otherwise only around those that differ.
    pub fn refit(&mut self, boxes: impl ExactSizeIterator<Item = Aabb<D>>) {
        if boxes.len() != self.rods.len() {
            return self.rebuild(boxes);
        }
        for (rod, bounds) in boxes.enumerate() {
            if self.rods[rod] != bounds {
                self.rods[rod] = bounds;
                self.mark_leaf_for_refit(rod / RODS_PER_LEAF);
            }
        }
        self.refit_loose_leaves();
    }

    /// Builds the tree anew, in the memory that it has.
    pub fn rebuild(&mut self, boxes: impl Iterator<Item = Aabb<D>>) {
        self.rods.clear();
        self.rods.extend(boxes);
        self.leaves = self.rods.len().div_ceil(RODS_PER_LEAF).next_power_of_two();
        self.nodes.clear();
        self.nodes.resize(2 * self.leaves, Aabb::empty());
        self.loose = 0..self.leaves;
        self.refit_loose_leaves();
    }

    fn mark_leaf_for_refit(&mut self, leaf: usize) {
        self.loose = if self.loose.is_empty() {
            leaf..leaf + 1
        } else {
            self.loose.start.min(leaf)..self.loose.end.max(leaf + 1)
        };
    }

    /// Fits the loose leaves, and everything above them.
    fn refit_loose_leaves(&mut self) {
        let loose = std::mem::take(&mut self.loose);
        if loose.is_empty() {
            return;
        }
        for leaf in loose.clone() {
            self.nodes[self.leaves + leaf] = self.leaf_bounds(leaf);
        }
        let mut from = self.leaves + loose.start;
        let mut to = self.leaves + loose.end - 1;
        while from > 1 {
            from /= 2;
            to /= 2;
            for node in from..=to {
                self.nodes[node] = self.nodes[2 * node].joined(&self.nodes[2 * node + 1]);
            }
        }
    }

    fn leaf_bounds(&self, leaf: usize) -> Aabb<D> {
        let from = (leaf * RODS_PER_LEAF).min(self.rods.len());
        let to = (from + RODS_PER_LEAF).min(self.rods.len());
        self.rods[from..to].iter().fold(Aabb::empty(), |all, b| all.joined(b))
    }

    /// Updates the box of a rod that has moved.
    pub fn set(&mut self, rod: usize, bounds: Aabb<D>) {
        self.rods[rod] = bounds;
        self.mark_leaf_for_refit(rod / RODS_PER_LEAF);
        let mut node = self.leaves + rod / RODS_PER_LEAF;
        // If a node contains the box, so do all above it.
        while node > 0 && !self.nodes[node].contains(&bounds) {
            self.nodes[node] = self.nodes[node].joined(&bounds);
            node /= 2;
        }
    }

    /// Visits the rods whose boxes meet `near`, in the order of the chain.
    #[inline]
    pub fn visit(&self, near: &Aabb<D>, mut visit_one: impl FnMut(usize)) {
        // The depth of the tree is at most the 64 bits of a usize, and each level leaves one node on the stack besides
        // the two on top.
        let mut stack = [0usize; 66];
        let mut n = usize::from(!self.rods.is_empty());
        stack[0] = 1;
        while n > 0 {
            n -= 1;
            let node = stack[n];
            if !self.nodes[node].intersects(near) {
                continue;
            }
            if node < self.leaves {
                // The lower child goes on top, so that rods come in the order of the chain.
                stack[n] = 2 * node + 1;
                stack[n + 1] = 2 * node;
                n += 2;
                continue;
            }
            let from = (node - self.leaves) * RODS_PER_LEAF;
            for rod in from..(from + RODS_PER_LEAF).min(self.rods.len()) {
                if self.rods[rod].intersects(near) {
                    visit_one(rod);
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
            let mut boxes: Vec<_> = corners.iter().map(|p| Aabb::from_points(&[*p]).grown(0.5)).collect();
            let mut tree = RodBvh::default();
            tree.rebuild(boxes.iter().copied());
            if let Some(last) = boxes.last_mut() {
                *last = Aabb::from_points(&[moved]).grown(1.0);
                tree.set(boxes.len() - 1, *boxes.last().unwrap());
            }
            check(&tree, &boxes, at)?;
            // The next motion starts there, and moves another part.
            if let Some(first) = boxes.first_mut() {
                *first = Aabb::from_points(&[at]).grown(0.1);
            }
            tree.refit(boxes.iter().copied());
            check(&tree, &boxes, at)?;
            let mut anew = RodBvh::default();
            anew.rebuild(boxes.iter().copied());
            prop_assert_eq!(tree.nodes, anew.nodes);
        }
    }

    fn check(tree: &RodBvh<2>, boxes: &[Aabb<2>], at: [f64; 2]) -> Result<(), TestCaseError> {
        let near = Aabb::from_points(&[at]).grown(2.0);
        let mut seen = Vec::new();
        tree.visit(&near, |k| seen.push(k));
        let expected: Vec<_> = (0..boxes.len()).filter(|&k| boxes[k].intersects(&near)).collect();
        prop_assert_eq!(seen, expected);
        Ok(())
    }
}
