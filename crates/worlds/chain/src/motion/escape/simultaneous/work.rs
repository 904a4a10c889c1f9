//! The work that rollouts of a chain may take: limited over time, so that a chain which is pressed from many sides still
//! reacts in real time. What is not done in a cycle is carried on in later ones.

use serde::{Deserialize, Serialize};

/// Work of rollouts in a second of simulated time: connectors times corrections of their rods, of which each takes about
/// 0.1 us with all that belongs to it on a busy core. So rollouts take up to half of real time.
const WORK_PER_S: f64 = 5e6;
/// Work that a chain may save up for a search, where a second passes without one. It suffices for some 40 rollouts of the
/// 16 robots of a convoy, and for a dozen of the connectors around a ball of a thin snake.
const MAX_RESERVE: u64 = 4_000_000;

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

    /// Returns whether less than half of a full reserve is left, so that it is better saved for what is new.
    pub(super) fn is_low(self) -> bool {
        self.spent > MAX_RESERVE / 2
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
        assert_eq!(reserve.left(), 1_000_000);
        assert!(reserve.is_low());
        for _ in 0..1000 {
            reserve.refill(0.02);
        }
        assert_eq!(reserve, WorkReserve::default());
        assert!(!reserve.is_low());
    }
}
