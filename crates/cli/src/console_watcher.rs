//! The terminal as a watcher of sessions.

use crate::console::Console;
use crate::exit::Failure;
use crate::interrupt;
use crate::progress::{RunProgress, StageProgress};
use sidestep::kernel::Interrupt;
use sidestep_session::{Progress, Watcher};
use std::sync::{Mutex, PoisonError};

/// Shows progress, passes warnings on, and asks to stop after Ctrl-C.
#[derive(Debug)]
pub(crate) struct ConsoleWatcher {
    console: Console,
    shown: Mutex<Option<ProgressDisplay>>,
}

#[derive(Debug)]
enum ProgressDisplay {
    Bar(RunProgress),
    Stages(StageProgress),
}

impl ConsoleWatcher {
    /// Returns a watcher that prints to `console`.
    pub(crate) fn new(console: Console) -> Self {
        Self { console, shown: Mutex::new(None) }
    }
}

impl Watcher for ConsoleWatcher {
    fn on_progress(&self, progress: Progress<'_>) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        match progress {
            Progress::Cycles { from, done, until } => {
                let new =
                    || ProgressDisplay::Bar(RunProgress::for_cycles(self.console, from, until));
                shown.get_or_insert_with(new).set(done);
            }
            Progress::Runs { before, done, of } => {
                let new = || ProgressDisplay::Bar(RunProgress::for_runs(self.console, before, of));
                shown.get_or_insert_with(new).set(done);
            }
            Progress::Stage { what, share } => {
                let new = || ProgressDisplay::Stages(StageProgress::new(self.console));
                if let ProgressDisplay::Stages(stages) = shown.get_or_insert_with(new) {
                    stages.set(what, share);
                }
            }
            Progress::Ended => match shown.take() {
                Some(ProgressDisplay::Bar(bar)) => bar.clear(),
                Some(ProgressDisplay::Stages(stages)) => stages.clear(),
                None => {}
            },
        }
    }

    fn warn(&self, error: &Failure) {
        self.console.warn(error);
    }

    fn should_continue(&self) -> bool {
        !interrupt::is_requested()
    }

    fn interrupt(&self) -> Interrupt {
        interrupt::cycle_interrupt()
    }
}

impl ProgressDisplay {
    fn set(&self, done: u64) {
        if let Self::Bar(bar) = self {
            bar.set(done);
        }
    }
}
