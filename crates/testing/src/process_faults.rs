//! Processes that a test kills, or stops for a time.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What happens to a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcessFault {
    /// It is gone, as by a failure of its machine.
    Kill,
    /// It does nothing for a time, and knows nothing of it, as on a machine that is too busy.
    Stop(Duration),
}

impl ProcessFault {
    /// Returns a fault from two random words: a kill as often as a stop of at most five seconds.
    #[must_use]
    pub fn random(what: u32, how_long: u32) -> Self {
        if what.is_multiple_of(2) {
            Self::Kill
        } else {
            Self::Stop(Duration::from_millis(100 + u64::from(how_long % 4_900)))
        }
    }
}

/// The processes that are stopped now. What is left goes on when it is dropped.
#[derive(Debug, Default)]
pub struct StoppedProcesses(Vec<(Instant, u32)>);

impl StoppedProcesses {
    /// Lets a fault happen to a process, by its number. Returns whether the process was there.
    ///
    /// # Panics
    /// Without the program `kill`.
    pub fn inflict(&mut self, process: u32, fault: ProcessFault) -> bool {
        match fault {
            ProcessFault::Kill => try_signal(process, "KILL"),
            ProcessFault::Stop(time) => {
                let is_there = try_signal(process, "STOP");
                if is_there {
                    self.0.push((Instant::now() + time, process));
                }
                is_there
            }
        }
    }

    /// Lets those go on whose time is over.
    ///
    /// # Panics
    /// Without the program `kill`.
    pub fn wake(&mut self) {
        let now = Instant::now();
        for (_, process) in self.0.extract_if(.., |(until, _)| *until <= now) {
            try_signal(process, "CONT");
        }
    }
}

impl Drop for StoppedProcesses {
    fn drop(&mut self) {
        for (_, process) in &self.0 {
            try_signal(*process, "CONT");
        }
    }
}

/// Sends a signal to a process that may have ended meanwhile; returns whether it had not.
///
/// # Panics
/// Without the program `kill`.
pub fn try_signal(process: u32, name: &str) -> bool {
    let mut kill = Command::new("kill");
    let sent =
        kill.args([&format!("-{name}"), &process.to_string()]).stderr(Stdio::null()).status();
    sent.expect("kill is there").success()
}
