//! One motion on its way outward: in which direction, and what it has come to.

use std::ops::Range;

/// What a request has done so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    /// First and one past the last connector that reacted.
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) changed: usize,
    pub(super) rotated: usize,
    pub(super) max_slave_step_m: f64,
}

impl Tally {
    #[inline]
    pub(super) fn start(first: usize) -> Self {
        Self { from: first, to: first, ..Self::default() }
    }

    /// Connectors around the initiator have reacted.
    #[inline]
    pub(super) fn touch(&mut self, run: Range<usize>) {
        (self.from, self.to) = (self.from.min(run.start), self.to.max(run.end));
    }

    /// A connector other than the initiator went some way.
    #[inline]
    pub(super) fn slave_went(&mut self, way_m: f64) {
        self.max_slave_step_m = self.max_slave_step_m.max(way_m);
    }
}

/// Direction along the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// To higher indices.
    Up,
    /// To lower ones.
    Down,
}

impl Direction {
    /// The master of a slave.
    #[inline]
    pub(super) fn before(self, slave: usize) -> usize {
        match self {
            Self::Up => slave - 1,
            Self::Down => slave + 1,
        }
    }

    /// The connector after `i` of `n`, if there is one.
    #[inline]
    pub(super) fn next(self, i: usize, n: usize) -> Option<usize> {
        match self {
            Self::Up => (i + 1 < n).then_some(i + 1),
            Self::Down => i.checked_sub(1),
        }
    }
}
