//! The terminal as a watcher of sessions.

use crate::console::Console;
use crate::exit::Failure;
use crate::interrupt;
use crate::progress::{Bar, Stages};
use sidestep::kernel::Interrupt;
use sidestep_session::{Progress, Watcher};
use std::sync::{Mutex, PoisonError};

/// Shows progress, passes warnings on, and asks to stop after Ctrl-C.
#[derive(Debug)]
pub(crate) struct Watch {
    console: Console,
    shown: Mutex<Option<Shown>>,
}

#[derive(Debug)]
enum Shown {
    Bar(Bar),
    Stages(Stages),
}

impl Watch {
    /// Returns a watcher that prints to `console`.
    pub(crate) fn new(console: Console) -> Self {
        Self { console, shown: Mutex::new(None) }
    }
}

impl Watcher for Watch {
    fn at(&self, progress: Progress<'_>) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        match progress {
            Progress::Cycles { from, done, until } => {
                let new = || Shown::Bar(Bar::of_cycles(self.console, from, until));
                shown.get_or_insert_with(new).move_to(done);
            }
            Progress::Runs { before, done, of } => {
                let new = || Shown::Bar(Bar::of_runs(self.console, before, of));
                shown.get_or_insert_with(new).move_to(done);
            }
            Progress::Stage { what, share } => {
                let new = || Shown::Stages(Stages::new(self.console));
                if let Shown::Stages(stages) = shown.get_or_insert_with(new) {
                    stages.at(what, share);
                }
            }
            Progress::Ended => match shown.take() {
                Some(Shown::Bar(bar)) => bar.clear(),
                Some(Shown::Stages(stages)) => stages.clear(),
                None => {}
            },
        }
    }

    fn warn(&self, error: &Failure) {
        self.console.warn(error);
    }

    fn go_on(&self) -> bool {
        !interrupt::requested()
    }

    fn interrupt(&self) -> Interrupt {
        interrupt::within_a_cycle()
    }
}

impl Shown {
    fn move_to(&self, done: u64) {
        if let Self::Bar(bar) = self {
            bar.at(done);
        }
    }
}
