//! Checkpoints that are kept as a run goes on, so that any earlier cycle is near one of them.
//!
//! They are spaced by computing time, not by cycles: the stretch between two of them takes about as long
//! everywhere. Beyond the bound of memory every second one goes, and the next ones are twice as far apart.

use sidestep_kernel::Cycle;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Duration;

/// The least time of computing between two keyframes, before any thinning.
const MIN_SPACING: Duration = Duration::from_millis(20);
/// The least ratio of computing time to the time spent on keyframes.
const MIN_COST_RATIO: u32 = 50;

/// The memory for the keyframes of all runs, which share it evenly.
#[derive(Debug)]
pub(crate) struct MemoryBudget {
    used: AtomicUsize,
    runs: AtomicUsize,
    most: usize,
    most_of_one: usize,
}

impl MemoryBudget {
    /// Returns a budget of `most` bytes in all, and at most `most_of_one` for one run.
    pub(crate) fn new(most: usize, most_of_one: usize) -> Self {
        Self { used: AtomicUsize::new(0), runs: AtomicUsize::new(0), most, most_of_one }
    }

    /// Returns the part of each run.
    fn share(&self) -> usize {
        (self.most / self.runs.load(Relaxed).max(1)).min(self.most_of_one)
    }
}

/// The keyframes of one run.
#[derive(Debug)]
pub(crate) struct Keyframes {
    kept: BTreeMap<Cycle, Vec<u8>>,
    bytes: usize,
    budget: Arc<MemoryBudget>,
    spacing: Duration,
    /// The computing time since the last keyframe.
    computed: Duration,
    /// The time that the last keyframe took.
    took: Duration,
}

impl Keyframes {
    /// Returns a store for one run's part of a budget, without anything in it.
    pub(crate) fn new(budget: &Arc<MemoryBudget>) -> Self {
        budget.runs.fetch_add(1, Relaxed);
        let (spacing, zero, budget) = (MIN_SPACING, Duration::ZERO, budget.clone());
        Self { kept: BTreeMap::new(), bytes: 0, budget, spacing, computed: zero, took: zero }
    }

    /// Notes that computing up to a cycle took a time; returns whether a keyframe of that cycle is wanted.
    pub(crate) fn is_due(&mut self, cycle: Cycle, took: Duration) -> bool {
        // Cycles computed before are kept already.
        if self.kept.last_key_value().is_some_and(|(&last, _)| cycle <= last) {
            return false;
        }
        self.computed += took;
        self.kept.is_empty()
            || self.computed >= self.spacing.max(self.took.saturating_mul(MIN_COST_RATIO))
    }

    /// Keeps a checkpoint that took a time to make.
    pub(crate) fn push(&mut self, cycle: Cycle, checkpoint: Vec<u8>, took: Duration) {
        (self.computed, self.took) = (Duration::ZERO, took);
        self.kept.insert(cycle, checkpoint);
        self.update_bytes();
        // Others may have more than their part for a while: the memory missing then is missing here.
        while self.budget.used.load(Relaxed) > self.budget.most && self.kept.len() > 1 {
            self.thin();
        }
        self.shrink_to_budget();
    }

    /// Drops keyframes beyond the run's part, which shrinks whenever another run begins.
    pub(crate) fn shrink_to_budget(&mut self) {
        while self.bytes > self.budget.share() && self.kept.len() > 1 {
            self.thin();
        }
    }

    /// Notes the number of bytes kept.
    fn update_bytes(&mut self) {
        let bytes = self.kept.values().map(Vec::len).sum();
        self.budget.used.fetch_add(bytes, Relaxed);
        self.budget.used.fetch_sub(std::mem::replace(&mut self.bytes, bytes), Relaxed);
    }

    /// Drops every second keyframe, but never the first.
    fn thin(&mut self) {
        let mut is_odd = true;
        self.kept.retain(|_, _| {
            is_odd = !is_odd;
            !is_odd
        });
        self.update_bytes();
        self.spacing = self.spacing.saturating_mul(2);
    }

    /// Returns the last keyframe that is not after a cycle.
    pub(crate) fn before(&self, cycle: Cycle) -> Option<(Cycle, &[u8])> {
        self.kept.range(..=cycle).next_back().map(|(&at, bytes)| (at, bytes.as_slice()))
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
            assert!(budget.used.load(Relaxed) <= 1000 && others[0].before(0).is_some());
        }
        first.shrink_to_budget();
        assert!(first.bytes <= 250 && first.before(0).is_some());
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
        assert_eq!(keyframes.before(5), None);
        for cycle in [0, 10, 20] {
            keyframes.push(cycle, vec![cycle as u8], MS);
        }
        let at = |cycle| keyframes.before(cycle).map(|(at, bytes)| (at, bytes[0]));
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
                let kept: usize = keyframes.kept.values().map(Vec::len).sum();
                prop_assert!(kept <= 1000 && kept == keyframes.bytes);
                prop_assert_eq!(keyframes.before(0).map(|(at, _)| at), Some(0));
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
            let at: Vec<Cycle> = keyframes.kept.keys().copied().collect();
            let widest = at.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            prop_assert!(widest <= 2 * (count / 7).max(2), "{at:?}");
        }
    }
}
