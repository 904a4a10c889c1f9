//! The progress bar: cycles per second and time left, on a terminal only.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use sidestep::kernel::Cycle;
use std::fmt::Write;

use crate::console::{Console, grouped};

/// How far a run is.
#[derive(Debug)]
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// A bar from `from` to `until`; silent where nobody looks.
    pub(crate) fn new(console: Console, from: Cycle, until: Cycle) -> Self {
        let bar = ProgressBar::new(until);
        let shown = console.shows_progress();
        bar.set_draw_target(if shown {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        });
        bar.set_style(style());
        bar.set_position(from);
        // The rate is that of this process, not of what was done before.
        bar.reset_elapsed();
        bar.reset_eta();
        Self(bar)
    }

    /// Shows that `cycle` cycles are done.
    pub(crate) fn at(&self, cycle: Cycle) {
        self.0.set_position(cycle);
    }

    /// Takes the bar away.
    pub(crate) fn clear(&self) {
        self.0.finish_and_clear();
    }
}

fn style() -> ProgressStyle {
    let position = |s: &ProgressState, w: &mut dyn Write| {
        let _ = write!(w, "{} of {}", grouped(s.pos()), grouped(s.len().unwrap_or(0)));
    };
    let rate = |s: &ProgressState, w: &mut dyn Write| {
        let _ = write!(w, "{}", grouped(s.per_sec() as u64));
    };
    ProgressStyle::with_template("{bar:30} {cycles} cycles  {rate} cycles/s  {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("cycles", position)
        .with_key("rate", rate)
}
