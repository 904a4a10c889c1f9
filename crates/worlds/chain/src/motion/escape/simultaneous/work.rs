//! The work that rollouts of a chain may take: limited over time, so that a chain which is pressed from many sides still
//! reacts in real time. What is not done in a cycle is carried on in later ones.

use serde::{Deserialize, Serialize};

/// Work of rollouts in a second of simulated time: connectors times corrections of their rods, of which each takes about
/// 0.1 us with all that belongs to it. So rollouts take up to 0.4 of real time.
const WORK_PER_S: f64 = 4e6;
/// Work that a chain may save up for a search, where seconds pass without one: as long a search takes 0.2 s.
const MAX_RESERVE: u64 = 2_000_000;

/// What a chain has left of that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct WorkReserve {
    /// Work beyond what time has paid for.
    spent: u64,
}

impl WorkReserve {
    /// Adds what a tick brings.
    pub(super) fn refill(&mut self, dt_s: f64) {
        self.spent = self.spent.saturating_sub((WORK_PER_S * dt_s) as u64);
    }

    /// Returns the work that is left.
    pub(super) fn left(self) -> u64 {
        MAX_RESERVE.saturating_sub(self.spent)
    }

    /// Records that only `left` is left.
    pub(super) fn set_left(&mut self, left: u64) {
        self.spent = MAX_RESERVE.saturating_sub(left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_spent_comes_back_with_time_up_to_the_most() {
        let mut reserve = WorkReserve::default();
        assert_eq!(reserve.left(), MAX_RESERVE);
        reserve.set_left(0);
        for _ in 0..10 {
            reserve.refill(0.02);
        }
        assert_eq!(reserve.left(), 800_000);
        for _ in 0..1000 {
            reserve.refill(0.02);
        }
        assert_eq!(reserve, WorkReserve::default());
    }
}
