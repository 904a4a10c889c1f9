//! Watchers: they observe the progress of work, and may ask it to stop.

use crate::Error;
use sidestep_kernel::{Cycle, Interrupt};
use std::path::Path;

/// The progress of work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress<'a> {
    /// A run advances.
    Cycles {
        /// The cycle at which this stretch of the run started.
        from: Cycle,
        /// Cycles done since the run's start.
        done: Cycle,
        /// The cycle at which the stretch ends.
        until: Cycle,
    },
    /// A sweep advances.
    Runs {
        /// Number of runs that were finished when this stretch started.
        before: u64,
        /// Number of finished runs.
        done: u64,
        /// Number of all runs.
        of: u64,
    },
    /// Other work advances.
    Stage {
        /// The work, in two or three words.
        what: &'a str,
        /// The part of it that is done, from 0 to 1.
        share: f64,
    },
    /// The work that was reported last has ended, or failed.
    Ended,
}

/// A terminal, a server or a program in another language that observes work. Runs of a sweep call
/// it from several threads, so it takes `&self`.
pub trait Watcher: Sync {
    /// Called with progress, at irregular intervals but at least every 30 ms of a run.
    fn on_progress(&self, _: Progress<'_>) {}

    /// Called with a failure that stops nothing, e.g. of the picture of a run.
    fn warn(&self, _: &Error) {}

    /// Called with a folder that a killed process left while it wrote to the same place, and that is removed now.
    fn note_removal(&self, _: &Path) {}

    /// Returns whether work shall continue; asked between slices of a run.
    fn should_continue(&self) -> bool {
        true
    }

    /// Returns the interrupt that a run checks within its cycles. A watcher raises it when the
    /// run has not reached its next slice some time after it was asked to stop.
    fn interrupt(&self) -> Interrupt {
        Interrupt::default()
    }
}

/// A watcher that does nothing: work runs to its end.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoWatcher;

impl Watcher for NoWatcher {}

/// A watcher of larger work: it passes on requests to stop, and does not report the cycles of the parts.
pub struct NestedWatcher<'a>(pub &'a dyn Watcher);

impl Watcher for NestedWatcher<'_> {
    fn warn(&self, error: &Error) {
        self.0.warn(error);
    }

    fn note_removal(&self, leftover: &Path) {
        self.0.note_removal(leftover);
    }

    fn should_continue(&self) -> bool {
        self.0.should_continue()
    }

    fn interrupt(&self) -> Interrupt {
        self.0.interrupt()
    }
}

/// A piece of work that is being watched; its end is always reported.
pub struct ProgressGuard<'a>(pub &'a dyn Watcher);

impl ProgressGuard<'_> {
    /// Passes on progress.
    pub fn report(&self, progress: Progress<'_>) {
        self.0.on_progress(progress);
    }
}

impl Drop for ProgressGuard<'_> {
    fn drop(&mut self) {
        self.0.on_progress(Progress::Ended);
    }
}
