//! The terminal as a watcher of sessions.

use crate::console::Console;
use crate::exit::Failure;
use crate::interrupt;
use crate::progress::{RunBar, StageBar};
use sidestep::kernel::Interrupt;
use sidestep_session::{Progress, Watcher, display_path};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Shows progress, prints warnings, and asks to stop after Ctrl-C.
#[derive(Debug)]
pub(crate) struct ConsoleWatcher {
    console: Console,
    /// What is on the terminal: a bar of its own kind for each kind of work, from the first progress to the last.
    display: Mutex<Option<ProgressDisplay>>,
}

#[derive(Debug)]
enum ProgressDisplay {
    Bar(RunBar),
    Stages(StageBar),
}

impl ConsoleWatcher {
    pub(crate) fn new(console: Console) -> Self {
        Self { console, display: Mutex::new(None) }
    }
}

impl Watcher for ConsoleWatcher {
    fn on_progress(&self, progress: Progress<'_>) {
        let mut display = self.display.lock().unwrap_or_else(PoisonError::into_inner);
        match progress {
            Progress::Cycles { from, done, until } => {
                let bar = display.get_or_insert_with(|| {
                    ProgressDisplay::Bar(RunBar::for_cycles(self.console, from, until))
                });
                bar.set(done);
            }
            Progress::Runs { before, done, of } => {
                let bar = display.get_or_insert_with(|| {
                    ProgressDisplay::Bar(RunBar::for_runs(self.console, before, of))
                });
                bar.set(done);
            }
            Progress::Stage { what, share } => {
                let stages = display
                    .get_or_insert_with(|| ProgressDisplay::Stages(StageBar::new(self.console)));
                if let ProgressDisplay::Stages(stages) = stages {
                    stages.set(what, share);
                }
            }
            Progress::Ended => match display.take() {
                Some(ProgressDisplay::Bar(bar)) => bar.clear(),
                Some(ProgressDisplay::Stages(stages)) => stages.clear(),
                None => {}
            },
        }
    }

    fn warn(&self, error: &Failure) {
        self.console.warn(error);
    }

    fn note_removal(&self, leftover: &Path) {
        self.console.note(removal_note(leftover));
    }

    fn should_continue(&self) -> bool {
        !interrupt::is_requested()
    }

    fn interrupt(&self) -> Interrupt {
        interrupt::cycle_interrupt()
    }
}

/// Returns the words about a folder that a killed process left, and that is removed now.
pub(crate) fn removal_note(leftover: &Path) -> String {
    format!("removed {}, which a killed command left there", display_path(leftover))
}

impl ProgressDisplay {
    fn set(&self, done: u64) {
        if let Self::Bar(bar) = self {
            bar.set(done);
        }
    }
}
