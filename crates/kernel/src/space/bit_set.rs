//! A set of boxes that only grows, one bit per box.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Marked boxes of a grid, by index.
#[derive(Debug)]
pub struct AtomicBitSet(Box<[AtomicU64]>);

impl AtomicBitSet {
    /// Creates an empty set for `boxes` boxes.
    pub fn empty(boxes: usize) -> Self {
        Self((0..boxes.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    /// Returns whether a box is marked; during a phase that marks boxes, perhaps not yet.
    #[inline]
    pub fn contains(&self, index: usize) -> bool {
        self.0[index / 64].load(Relaxed) >> (index % 64) & 1 == 1
    }

    /// Marks a box, and returns whether it was unmarked before. Workers may mark boxes at the same
    /// time; of several that mark the same box, exactly one gets `true`.
    #[inline]
    pub fn insert(&self, index: usize) -> bool {
        let word = &self.0[index / 64];
        let bit = 1 << (index % 64);
        // Read first, because the box is almost always marked already and a load is far cheaper
        // than an atomic exchange.
        word.load(Relaxed) & bit == 0 && word.fetch_or(bit, Relaxed) & bit == 0
    }

    /// Bytes on the heap: an eighth of the number of boxes, in whole words.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_box_is_new_once_even_to_two_threads() {
        let marks = AtomicBitSet::empty(1000);
        let new = |from: usize| (from..1000).filter(|&i| marks.insert(i)).count();
        #[expect(clippy::disallowed_methods, reason = "tested from several threads")]
        let total: usize = std::thread::scope(|scope| {
            let workers = [scope.spawn(|| new(0)), scope.spawn(|| new(500))];
            workers.into_iter().map(|w| w.join().expect("no panic")).sum()
        });
        assert_eq!(total, 1000);
        assert!((0..1000).all(|i| marks.contains(i)));
    }
}
