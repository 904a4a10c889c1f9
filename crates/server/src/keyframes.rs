//! Checkpoints that are kept as a run advances, so that any earlier cycle is near one of them.
//!
//! They are spaced by computing time, not by cycles, because the time of a cycle varies by orders of magnitude within a run
//! and a seek should take about as long everywhere. When the memory is full every second one is dropped, and the next
//! ones are twice as far apart.

use crate::usage_registry::StoreBytes;
use sidestep_kernel::Cycle;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Duration;

/// Minimum computing time between two keyframes, before any thinning. A seek computes half of it on average: nobody notices.
const MIN_SPACING: Duration = Duration::from_millis(20);
/// Minimum ratio of computing time to the time spent on keyframes: they slow a run down by 2 % at most.
const MIN_COST_RATIO: u32 = 50;

/// The memory for the keyframes of all runs, which share it evenly.
#[derive(Debug)]
pub(crate) struct MemoryBudget {
    used: AtomicUsize,
    runs: AtomicUsize,
    total_bytes: usize,
    max_bytes_per_run: usize,
}

impl MemoryBudget {
    pub(crate) fn new(total_bytes: usize, max_bytes_per_run: usize) -> Self {
        Self {
            used: AtomicUsize::new(0),
            runs: AtomicUsize::new(0),
            total_bytes,
            max_bytes_per_run,
        }
    }

    /// Returns the bytes of the keyframes of all runs.
    #[cfg(test)]
    pub(crate) fn used_bytes(&self) -> usize {
        self.used.load(Relaxed)
    }

    /// Returns the number of bytes that each run may use now; it changes as runs start and end.
    fn bytes_per_run(&self) -> usize {
        (self.total_bytes / self.runs.load(Relaxed).max(1)).min(self.max_bytes_per_run)
    }
}

/// The keyframes of one run; the first, at its start, is never dropped.
#[derive(Debug)]
pub(crate) struct Keyframes {
    checkpoints: BTreeMap<Cycle, Vec<u8>>,
    bytes: usize,
    budget: Arc<MemoryBudget>,
    spacing: Duration,
    /// The computing time since the last keyframe.
    computed: Duration,
    /// The time that it took to make the last keyframe.
    last_cost: Duration,
}

impl Keyframes {
    /// Returns an empty store for one run's share of a budget.
    pub(crate) fn new(budget: &Arc<MemoryBudget>) -> Self {
        budget.runs.fetch_add(1, Relaxed);
        Self {
            checkpoints: BTreeMap::new(),
            bytes: 0,
            budget: budget.clone(),
            spacing: MIN_SPACING,
            computed: Duration::ZERO,
            last_cost: Duration::ZERO,
        }
    }

    /// Records the time that it took to compute up to a cycle; returns whether a keyframe of that cycle is due.
    pub(crate) fn is_due(&mut self, cycle: Cycle, computing_time: Duration) -> bool {
        // A cycle that is computed again, after a seek backward, has its keyframes already.
        if self.checkpoints.last_key_value().is_some_and(|(&last, _)| cycle <= last) {
            return false;
        }
        self.computed += computing_time;
        let min_time = self.spacing.max(self.last_cost.saturating_mul(MIN_COST_RATIO));
        self.checkpoints.is_empty() || self.computed >= min_time
    }

    /// Keeps a checkpoint; `cost` is the time that it took to make it.
    pub(crate) fn push(&mut self, cycle: Cycle, checkpoint: Vec<u8>, cost: Duration) {
        self.computed = Duration::ZERO;
        self.last_cost = cost;
        self.checkpoints.insert(cycle, checkpoint);
        self.update_bytes();
        // Other runs shrink to their shares only when it is their turn: until then this one gets less than its own.
        while self.budget.used.load(Relaxed) > self.budget.total_bytes && self.checkpoints.len() > 1
        {
            self.drop_every_second();
        }
        self.shrink_to_budget();
    }

    /// Drops keyframes beyond the run's share, which shrinks whenever another run starts.
    pub(crate) fn shrink_to_budget(&mut self) {
        while self.bytes > self.budget.bytes_per_run() && self.checkpoints.len() > 1 {
            self.drop_every_second();
        }
    }

    /// Returns the bytes of all keyframes, and the run's present share of the budget.
    pub(crate) fn bytes(&self) -> StoreBytes {
        StoreBytes { used: self.bytes as u64, max: self.budget.bytes_per_run() as u64 }
    }

    /// Updates the number of bytes, here and in the budget.
    fn update_bytes(&mut self) {
        let bytes = self.checkpoints.values().map(Vec::len).sum();
        // In this order: the sum of all runs never falls below 0.
        self.budget.used.fetch_add(bytes, Relaxed);
        self.budget.used.fetch_sub(self.bytes, Relaxed);
        self.bytes = bytes;
    }

    /// Drops every second keyframe, but never the first: a seek to any cycle needs one before it.
    fn drop_every_second(&mut self) {
        let mut is_odd = true;
        self.checkpoints.retain(|_, _| {
            is_odd = !is_odd;
            !is_odd
        });
        self.update_bytes();
        self.spacing = self.spacing.saturating_mul(2);
    }

    /// Returns the last keyframe that is not after a cycle.
    pub(crate) fn latest_until(&self, cycle: Cycle) -> Option<(Cycle, &[u8])> {
        self.checkpoints.range(..=cycle).next_back().map(|(&at, bytes)| (at, bytes.as_slice()))
    }
}

impl Drop for Keyframes {
    fn drop(&mut self) {
        self.budget.runs.fetch_sub(1, Relaxed);
        self.budget.used.fetch_sub(self.bytes, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: Duration = Duration::from_millis(1);

    fn alone(most: usize) -> Keyframes {
        Keyframes::new(&Arc::new(MemoryBudget::new(most, most)))
    }

    #[test]
    fn runs_share_a_budget_and_give_back_what_another_one_needs() {
        let budget = Arc::new(MemoryBudget::new(1000, 600));
        let mut first = Keyframes::new(&budget);
        (0..40).for_each(|cycle| first.push(cycle, vec![0; 50], MS));
        assert!(first.bytes > 250 && first.bytes <= 600, "{}", first.bytes);
        let mut others: Vec<Keyframes> = (0..3).map(|_| Keyframes::new(&budget)).collect();
        for cycle in 0..40 {
            others.iter_mut().for_each(|other| other.push(cycle, vec![0; 50], MS));
            assert!(budget.used.load(Relaxed) <= 1000 && others[0].latest_until(0).is_some());
        }
        first.shrink_to_budget();
        assert!(first.bytes <= 250 && first.latest_until(0).is_some());
        assert!(others.iter().all(|other| other.bytes <= 250));
        drop((first, others));
        assert_eq!((budget.used.load(Relaxed), budget.runs.load(Relaxed)), (0, 0));
    }

    #[test]
    fn the_first_is_wanted_at_once_and_the_next_ones_after_some_time() {
        let mut keyframes = alone(1000);
        assert!(keyframes.is_due(0, Duration::ZERO));
        keyframes.push(0, vec![0; 10], MS / 100);
        assert!(!keyframes.is_due(10, 19 * MS));
        assert!(keyframes.is_due(20, MS));
        keyframes.push(20, vec![0; 10], 2 * MS);
        assert!(!keyframes.is_due(30, 99 * MS), "two in a hundred");
        assert!(keyframes.is_due(40, MS));
        assert!(!keyframes.is_due(15, 1000 * MS), "it was computed before");
    }

    #[test]
    fn the_nearest_before_is_found_and_nothing_in_an_empty_store() {
        let mut keyframes = alone(1000);
        assert_eq!(keyframes.latest_until(5), None);
        for cycle in [0, 10, 20] {
            keyframes.push(cycle, vec![cycle as u8], MS);
        }
        let at = |cycle| keyframes.latest_until(cycle).map(|(at, bytes)| (at, bytes[0]));
        assert_eq!(
            [at(0), at(9), at(10), at(99)],
            [Some((0, 0)), Some((0, 0)), Some((10, 10)), Some((20, 20))]
        );
    }

    proptest! {
        #[test]
        fn memory_stays_within_its_bound_and_the_start_is_never_lost(
            sizes in proptest::collection::vec(1_usize..400, 1..200),
        ) {
            let mut keyframes = alone(1000);
            for (cycle, size) in (0..).zip(sizes) {
                keyframes.push(cycle, vec![0; size], MS);
                let kept: usize = keyframes.checkpoints.values().map(Vec::len).sum();
                prop_assert!(kept <= 1000 && kept == keyframes.bytes);
                prop_assert_eq!(keyframes.latest_until(0).map(|(at, _)| at), Some(0));
            }
        }

        #[test]
        fn what_is_left_stays_evenly_spread(count in 2_u64..3000) {
            let mut keyframes = alone(1600);
            let mut cycle = 0;
            while cycle < count {
                if keyframes.is_due(cycle, MIN_SPACING / 2) {
                    keyframes.push(cycle, vec![0; 100], Duration::ZERO);
                }
                cycle += 1;
            }
            let at: Vec<Cycle> = keyframes.checkpoints.keys().copied().collect();
            let widest = at.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            prop_assert!(widest <= 2 * (count / 7).max(2), "{at:?}");
        }
    }
}
