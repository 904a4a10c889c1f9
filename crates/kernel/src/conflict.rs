//! Conflict groups: bodies whose claims intersect, directly or through other bodies.
//!
//! A lock-free union-find over slots. Joining is commutative and associative, so the groups depend
//! neither on the worker that found a conflict nor on the order in which conflicts are found: a
//! group's leader is its smallest slot, and its members are the leader's descendants in the forest
//! of joins. A slot gets a parent at most once a cycle, so the forest needs three words per body
//! and no allocation.

use crate::column::AtomicColumn;
use crate::units::EntitySlot;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

const NONE: EntitySlot = EntitySlot::MAX;

/// The conflict groups of one cycle over slots `0..n`.
#[derive(Debug)]
pub struct ConflictGroups {
    /// Toward the leader; a leader points at itself.
    parent: AtomicColumn<EntitySlot>,
    /// Last slot that became a child of this one.
    first_child: AtomicColumn<EntitySlot>,
    /// The previous child of the same parent.
    next_sibling: AtomicColumn<EntitySlot>,
}

impl ConflictGroups {
    /// Creates groups of one slot each, for `n` slots.
    pub fn new(n: usize) -> Self {
        Self {
            parent: (0..n as EntitySlot).collect(),
            first_child: AtomicColumn::filled(n, NONE),
            next_sibling: AtomicColumn::filled(n, NONE),
        }
    }

    /// Makes `slot` a group of its own again; called by one worker, before the first join of a
    /// cycle.
    #[inline]
    pub fn make_singleton(&self, slot: EntitySlot) {
        self.parent.set(slot as usize, slot);
        // `next_sibling` is read of children only, and a join writes it when it makes a slot a child.
        self.first_child.set(slot as usize, NONE);
    }

    /// Returns the leader of a slot's group: its smallest member, once all joins are done.
    #[inline]
    pub fn leader(&self, mut slot: EntitySlot) -> EntitySlot {
        loop {
            let parent = self.parent.get(slot as usize);
            if parent == slot {
                return slot;
            }
            let grandparent = self.parent.get(parent as usize);
            // Path halving. A slot that has a parent keeps one, and parents only decrease, so a
            // racing store can at worst shorten the path less.
            self.parent.set(slot as usize, grandparent);
            slot = grandparent;
        }
    }

    /// Puts two slots into one group. Any worker may call it, at any time between two barriers.
    pub fn join_groups(&self, a: EntitySlot, b: EntitySlot) {
        let mut a = a;
        let mut b = b;
        loop {
            a = self.leader(a);
            b = self.leader(b);
            if a == b {
                return;
            }
            // The smaller leader becomes the parent: parents then only decrease, so no cycle of parents can
            // arise, and the last leader is the smallest slot whatever the order of the joins.
            let parent = a.min(b);
            let child = a.max(b);
            // Fails if another worker has given the child a parent since `leader` read it.
            if cell(&self.parent, child).compare_exchange(child, parent, Relaxed, Relaxed).is_ok() {
                let sibling = cell(&self.first_child, parent).swap(child, Relaxed);
                self.next_sibling.set(child as usize, sibling);
                return;
            }
        }
    }

    /// Returns whether a slot leads its group; valid after the barrier that ends joining.
    #[inline]
    pub fn is_leader(&self, slot: EntitySlot) -> bool {
        self.parent.get(slot as usize) == slot
    }

    /// Returns whether a leader is the only member of its group.
    #[inline]
    pub fn is_singleton(&self, slot: EntitySlot) -> bool {
        self.first_child.get(slot as usize) == NONE && self.is_leader(slot)
    }

    /// Writes the members of a leader's group into `members`, in no particular order.
    pub fn members(&self, leader: EntitySlot, members: &mut Vec<EntitySlot>) {
        members.clear();
        members.push(leader);
        // Breadth first, with the list itself as the queue.
        let mut expanded = 0;
        while expanded < members.len() {
            let mut child = self.first_child.get(members[expanded] as usize);
            while child != NONE {
                members.push(child);
                child = self.next_sibling.get(child as usize);
            }
            expanded += 1;
        }
    }

    /// Bytes on the heap: three words of 4 bytes per slot.
    pub fn heap_bytes(&self) -> usize {
        self.parent.heap_bytes() + self.first_child.heap_bytes() + self.next_sibling.heap_bytes()
    }
}

fn cell(column: &AtomicColumn<EntitySlot>, slot: EntitySlot) -> &AtomicU32 {
    &column.cells()[slot as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn partition(n: usize, groups: &ConflictGroups) -> Vec<Vec<EntitySlot>> {
        let mut all = Vec::new();
        for slot in (0..n as EntitySlot).filter(|&s| groups.is_leader(s)) {
            let mut members = Vec::new();
            groups.members(slot, &mut members);
            assert_eq!(groups.is_singleton(slot), members.len() == 1);
            members.sort_unstable();
            assert_eq!(members[0], slot, "the leader is the smallest member");
            all.push(members);
        }
        all
    }

    /// Components by repeated relabeling: slow and obviously right.
    fn oracle(n: usize, edges: &[(usize, usize)]) -> Vec<Vec<EntitySlot>> {
        let mut label: Vec<usize> = (0..n).collect();
        for _ in 0..n {
            for &(a, b) in edges {
                let low = label[a].min(label[b]);
                (label[a], label[b]) = (low, low);
            }
        }
        let mut groups = vec![Vec::new(); n];
        for (slot, &l) in label.iter().enumerate() {
            groups[l].push(slot as EntitySlot);
        }
        groups.retain(|g| !g.is_empty());
        groups
    }

    proptest! {
        #[test]
        fn groups_are_the_connected_components(edges in prop::collection::vec((0usize..40, 0usize..40), 0..60)) {
            let groups = ConflictGroups::new(40);
            for &(a, b) in &edges {
                groups.join_groups(a as EntitySlot, b as EntitySlot);
            }
            prop_assert_eq!(partition(40, &groups), oracle(40, &edges));
        }

        #[test]
        fn joining_from_two_threads_gives_the_same_groups(edges in prop::collection::vec((0usize..300, 0usize..300), 0..400)) {
            let groups = ConflictGroups::new(300);
            #[expect(clippy::disallowed_methods, reason = "tested from several threads")]
            std::thread::scope(|scope| {
                for part in 0..2 {
                    let (groups, edges) = (&groups, &edges);
                    scope.spawn(move || {
                        for (a, b) in edges.iter().skip(part).step_by(2) {
                            groups.join_groups(*a as EntitySlot, *b as EntitySlot);
                        }
                    });
                }
            });
            prop_assert_eq!(partition(300, &groups), oracle(300, &edges));
        }
    }

    #[test]
    fn reset_takes_a_group_apart() {
        let groups = ConflictGroups::new(3);
        groups.join_groups(0, 2);
        (0..3).for_each(|s| groups.make_singleton(s));
        assert!((0..3).all(|s| groups.is_singleton(s)));
    }
}
