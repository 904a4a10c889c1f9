//! The search for the exit with the least time inside, which may take several ticks.

use super::rollout::{IMPROVEMENT_FACTOR, MIN_BENEFIT_TICKS, Rollout, RolloutOptions};
use super::solve_input::ExitDirection;
use super::work::WorkReserve;
use serde::{Deserialize, Serialize};

/// What is known from the last search.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct ExitSearch {
    /// The cost of the present course as foreseen last; none before the first rollout.
    foreseen: Option<f64>,
    /// The candidate to go on with; 0 if all have been tried.
    next: u32,
}

impl ExitSearch {
    /// Returns whether rollouts foresee that no part touches an obstacle.
    pub(super) fn foresees_no_contact(&self) -> bool {
        self.foreseen == Some(0.0)
    }

    /// Returns whether all candidates have been tried.
    #[cfg(test)]
    pub(super) fn is_complete(&self) -> bool {
        self.next == 0
    }

    /// Returns the best exit, which is the present one unless another is clearly better. The candidates are computed only
    /// if they are to be tried.
    pub(super) fn find_exit<const D: usize>(
        &mut self,
        rollout: &Rollout<'_, D>,
        now: Option<ExitDirection<D>>,
        candidates: impl FnOnce() -> Vec<ExitDirection<D>>,
        reserve: &mut WorkReserve,
    ) -> Option<ExitDirection<D>> {
        let mut left = reserve.left();
        let cost_now = rollout.cost(&RolloutOptions::with_exit(now), f64::INFINITY, &mut left);
        let rollout_work = reserve.left() - left;
        let mut best = now;
        if left == 0 {
            // A rollout that was cut off says nothing.
            self.foreseen = None;
        } else if reserve.is_low() && self.is_foreseen(cost_now) {
            self.foreseen = Some(cost_now);
        } else {
            // Another exit must be clearly better, or the chain would alternate between two and leave by neither.
            let mut enough = IMPROVEMENT_FACTOR * cost_now - MIN_BENEFIT_TICKS;
            let mut cost = cost_now;
            let first = std::mem::take(&mut self.next) as usize;
            let exits = candidates().into_iter().map(Some);
            for (k, exit) in std::iter::once(None).chain(exits).enumerate().skip(first) {
                // Nothing takes less time than none.
                if enough <= 0.0 {
                    break;
                }
                if k > first && left < rollout_work {
                    self.next = k as u32;
                    break;
                }
                let exit_cost = rollout.cost(&RolloutOptions::with_exit(exit), enough, &mut left);
                if left == 0 && k > first {
                    // It was cut off, and says nothing: it is the first one next time.
                    self.next = k as u32;
                    break;
                }
                if exit_cost < enough {
                    enough = exit_cost;
                    cost = exit_cost;
                    best = exit;
                }
            }
            self.foreseen = Some(cost);
        }
        reserve.set_left(left);
        best
    }

    /// Returns whether the present course costs no more than was foreseen when all candidates had been tried: while all
    /// goes as foreseen, another search would find much the same.
    fn is_foreseen(&self, cost_now: f64) -> bool {
        self.next == 0 && self.foreseen.is_some_and(|cost| cost_now <= cost + MIN_BENEFIT_TICKS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_that_costs_what_was_foreseen_is_searched_no_more() {
        let complete = ExitSearch { foreseen: Some(20.0), next: 0 };
        assert!(complete.is_foreseen(20.4));
        assert!(complete.is_foreseen(12.0));
        assert!(!complete.is_foreseen(21.0), "it became worse");
        assert!(!ExitSearch { next: 3, ..complete }.is_foreseen(20.0), "candidates are left");
        assert!(!ExitSearch::default().is_foreseen(0.0), "nothing was foreseen");
    }
}
