//! One motion as it propagates outward: its direction, and its results so far.

use std::ops::Range;

/// Results of a request so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MotionEffects {
    /// First and one past the last connector that reacted.
    pub(super) from: usize,
    pub(super) to: usize,
    /// Connectors that changed, summed over sub-steps.
    pub(super) changed: usize,
    /// Rods that turned, summed over sub-steps.
    pub(super) rotated: usize,
    /// Longest move of a connector other than the initiator, meters.
    pub(super) max_slave_step_m: f64,
}

impl MotionEffects {
    /// Returns the tally of a motion of connector `first` that nothing has followed yet.
    #[inline]
    pub(super) fn start(first: usize) -> Self {
        Self { from: first, to: first, ..Self::default() }
    }

    /// Counts the connectors around the initiator that have reacted.
    #[inline]
    pub(super) fn record_touched_range(&mut self, run: Range<usize>) {
        self.from = self.from.min(run.start);
        self.to = self.to.max(run.end);
    }

    /// Adds the results of a separate motion.
    #[inline]
    pub(super) fn add(&mut self, motion: &Self) {
        self.record_touched_range(motion.from..motion.to);
        self.changed += motion.changed;
        self.rotated += motion.rotated;
        self.record_slave_move(motion.max_slave_step_m);
    }

    /// Counts a connector other than the initiator that moved by `travel_m`.
    #[inline]
    pub(super) fn record_slave_move(&mut self, travel_m: f64) {
        self.max_slave_step_m = self.max_slave_step_m.max(travel_m);
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChainDirection {
    /// Toward higher indices.
    Up,
    /// Toward lower indices.
    Down,
}

impl ChainDirection {
    /// Both directions, in the order in which sweeps are made.
    pub(super) const BOTH: [Self; 2] = [Self::Up, Self::Down];

    /// Returns the neighbor from which a sweep comes to a slave.
    #[inline]
    pub(super) fn master(self, slave: usize) -> usize {
        match self {
            Self::Up => slave - 1,
            Self::Down => slave + 1,
        }
    }

    /// Returns the connector after `i` of `n`, if there is one.
    #[inline]
    pub(super) fn next(self, i: usize, n: usize) -> Option<usize> {
        match self {
            Self::Up => (i + 1 < n).then_some(i + 1),
            Self::Down => i.checked_sub(1),
        }
    }
}
