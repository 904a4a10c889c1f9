//! The cycles that have a row, by their numbers alone.

use crate::units::Cycle;

/// Number of rows of a run with the planned number of cycles, at most.
const ROWS: Cycle = 1000;

/// A run with more planned cycles counts as one without an end: nobody waits for its last row.
const MAX_PLANNED_CYCLES: Cycle = 10_000_000;

/// The numbers of cycles after which the metrics of a run become a row: the multiples of a number. After a thousand rows the
/// number doubles, and again whenever the run is twice as long, so that a run without an end has few rows too.
///
/// A row depends on its cycle alone, and not on the length of the run, on its workers or on when it was interrupted.
///
/// ```
/// use sidestep_kernel::series::SeriesInterval;
///
/// let planned = SeriesInterval::from_planned_cycles(10_000);
/// assert_eq!((planned.every(), planned.next_due(0), planned.next_due(10)), (10, Some(10), Some(20)));
/// assert_eq!(planned.next_due(10_000), Some(10_020));
/// assert_eq!(SeriesInterval::every_cycles(7).next_due(99), Some(105));
/// assert_eq!(SeriesInterval::every_cycles(0).next_due(99), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeriesInterval {
    /// Cycles between two rows; 0 for no rows.
    every: Cycle,
    /// The number of cycles up to which that holds, and which doubles with it.
    span: Cycle,
}

impl Default for SeriesInterval {
    fn default() -> Self {
        Self::NONE
    }
}

impl SeriesInterval {
    /// No rows at all.
    pub const NONE: Self = Self { every: 0, span: Cycle::MAX };

    /// Returns the interval that gives a run of so many cycles some thousand rows.
    pub fn from_planned_cycles(planned: Cycle) -> Self {
        Self::with_rows(planned, ROWS)
    }

    /// Returns the interval that gives a run of so many cycles this number of rows, at most.
    pub fn with_rows(planned: Cycle, rows: Cycle) -> Self {
        let bounded = if planned <= MAX_PLANNED_CYCLES { planned } else { 0 };
        let every = bounded.div_ceil(rows.max(1)).max(1);
        Self { every, span: every.saturating_mul(rows.max(1)) }
    }

    /// Returns a fixed interval, which never doubles; 0 for no rows.
    pub fn every_cycles(every: Cycle) -> Self {
        Self { every, ..Self::NONE }
    }

    /// Returns the number of cycles between the first rows; 0 if there are none.
    pub fn every(self) -> Cycle {
        self.every
    }

    /// Returns the first number of cycles after `done` that has a row, if there is one.
    pub fn next_due(self, done: Cycle) -> Option<Cycle> {
        if self.every == 0 {
            return None;
        }
        let mut every = self.every;
        let mut span = self.span;
        while span <= done {
            every = every.saturating_mul(2);
            span = span.saturating_mul(2);
            if span == Cycle::MAX {
                break;
            }
        }
        (done / every).checked_add(1)?.checked_mul(every)
    }
}
