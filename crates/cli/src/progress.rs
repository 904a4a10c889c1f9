//! The progress bar: cycles per second and time left, on a terminal only.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use sidestep::kernel::Cycle;
use sidestep::kernel::terminal::escape_controls;
use std::fmt::Write;

use crate::console::{Console, group_thousands};

/// The progress bar of a run, in cycles, or of many, in runs.
#[derive(Debug)]
pub(crate) struct RunBar(ProgressBar);

impl RunBar {
    /// Returns a bar from cycle `from` to `until`; hidden if the console shows no progress.
    pub(crate) fn for_cycles(console: Console, from: Cycle, until: Cycle) -> Self {
        let bar = new_bar(console, until);
        bar.set_style(style());
        bar.set_position(from);
        // Of a resumed run, the rate and the time left follow from the cycles of this process alone.
        bar.reset_elapsed();
        bar.reset_eta();
        Self(bar)
    }

    /// Returns a bar of `all` runs, `before` of which were done earlier.
    pub(crate) fn for_runs(console: Console, before: u64, all: u64) -> Self {
        let bar = new_bar(console, all);
        bar.set_style(
            ProgressStyle::with_template("{bar:30} {pos} of {len} runs  {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        bar.set_position(before);
        bar.reset_elapsed();
        bar.reset_eta();
        Self(bar)
    }

    /// Shows that `done` cycles (or runs) are done.
    pub(crate) fn set(&self, done: u64) {
        self.0.set_position(done);
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

/// Returns a bar that is hidden if the console shows no progress.
fn new_bar(console: Console, length: u64) -> ProgressBar {
    let is_shown = console.shows_progress();
    let target = if is_shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    ProgressBar::with_draw_target(Some(length), target)
}

/// The progress bar of work in several stages.
#[derive(Debug)]
pub(crate) struct StageBar(ProgressBar);

/// Length of the bar of a [`StageBar`]: indicatif counts in whole steps, and a tenth of a percent is less than a
/// character of the bar.
const STEPS: f64 = 1000.0;

impl StageBar {
    /// Returns a bar at its start; hidden if the console shows no progress.
    pub(crate) fn new(console: Console) -> Self {
        let bar = new_bar(console, STEPS as u64);
        let style = ProgressStyle::with_template("{bar:30} {percent} %  {eta} left  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self(bar)
    }

    /// Shows the name of the stage, and the share of all work that is done (0 to 1).
    pub(crate) fn set(&self, what: &str, share: f64) {
        self.0.set_position((STEPS * share) as u64);
        self.0.set_message(escape_controls(what).into_owned());
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {cycles} cycles  {rate} cycles/s  {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("cycles", write_position)
        .with_key("rate", write_rate)
}

fn write_position(state: &ProgressState, out: &mut dyn Write) {
    let position = group_thousands(state.pos());
    let length = group_thousands(state.len().unwrap_or(0));
    let _ = write!(out, "{position} of {length}");
}

fn write_rate(state: &ProgressState, out: &mut dyn Write) {
    let _ = write!(out, "{}", group_thousands(state.per_sec() as u64));
}
