//! Watchers: they look on while work is done, and may ask it to stop.

use crate::Error;
use sidestep::kernel::Cycle;

/// How far work is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress<'a> {
    /// A run advances.
    Cycles {
        /// The cycle at which this stretch of the run began.
        from: Cycle,
        /// Cycles done since the run's start.
        done: Cycle,
        /// The cycle at which the stretch ends.
        until: Cycle,
    },
    /// A sweep advances.
    Runs {
        /// Runs that were finished when this stretch began.
        before: u64,
        /// Finished runs.
        done: u64,
        /// Runs of which these are.
        of: u64,
    },
    /// Other work advances.
    Stage {
        /// The work, in two or three words.
        what: &'a str,
        /// The part of it that is done, from 0 to 1.
        share: f64,
    },
    /// The work that was told of last has ended, or failed.
    Ended,
}

/// A terminal, a server or a program in another language that looks on. Runs of a sweep call it
/// from several threads, so it takes `&self`.
pub trait Watcher: Sync {
    /// Takes note of how far work is: now and then, at the latest every 30 ms of a run.
    fn at(&self, _: Progress<'_>) {}

    /// Takes note of something that failed and stops nothing, e.g. the picture of a run.
    fn warn(&self, _: &Error) {}

    /// Returns whether to go on; asked between slices of a run.
    fn go_on(&self) -> bool {
        true
    }
}

/// Nobody: work goes to its end.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Watcher for Unwatched {}

/// A watcher of something larger, which is not told of the cycles of its parts.
pub(crate) struct Within<'a>(pub(crate) &'a dyn Watcher);

impl Watcher for Within<'_> {
    fn warn(&self, error: &Error) {
        self.0.warn(error);
    }

    fn go_on(&self) -> bool {
        self.0.go_on()
    }
}

/// A piece of work that is being watched; its end is told however it ends.
pub(crate) struct Watched<'a>(pub(crate) &'a dyn Watcher);

impl Watched<'_> {
    pub(crate) fn at(&self, progress: Progress<'_>) {
        self.0.at(progress);
    }
}

impl Drop for Watched<'_> {
    fn drop(&mut self) {
        self.0.at(Progress::Ended);
    }
}
