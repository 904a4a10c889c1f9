//! The tracks of a run as a figure for print.

use crate::driver::{Sinks, drive};
use crate::picture::draw_tracks;
use crate::{Error, RecordedRun, Watcher};
use sidestep_draw::Style;
use sidestep_kernel::view::Trail;
use sidestep_scenario::Worlds;
use std::fmt::Write as _;
use std::path::Path;

/// The tracks of a run, drawn without a title and small print, which belong in the text around a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackFigure {
    /// What it shows.
    pub title: String,
    /// The drawing.
    pub svg: String,
    /// Its points as comma-separated values.
    pub csv: String,
}

/// Draws the tracks of the run in `folder` as they are at its end, as large as `style` says with all words, or higher
/// where it may grow, as charts do. A run of
/// this build is computed from its last checkpoint; one of another build is shown by what is recorded.
///
/// # Errors
/// When the folder is damaged, or the style leaves no room; [`Error::Interrupted`] when the watcher asked to stop.
pub fn track_figure(
    worlds: &Worlds,
    folder: &Path,
    style: (&Style, bool),
    watcher: &dyn Watcher,
) -> Result<TrackFigure, Error> {
    let recorded = RecordedRun::open(worlds, folder)?;
    let end = recorded.cycles_done;
    let mut run = match recorded.other_build() {
        Some(_) => recorded.start_for_viewing(1)?,
        None => recorded.start_near(end, 1)?,
    };
    drive(run.as_mut(), end, Sinks::default(), watcher)?;
    if run.cycle() < end && !run.is_over() {
        return Err(Error::Interrupted);
    }
    let (svg, trails) = draw_tracks(run.as_mut(), folder, style)?;
    let title = "Trajectories, and where everybody is at the end".into();
    Ok(TrackFigure { title, svg, csv: csv(&trails) })
}

/// Returns the points of trails as a table with a head.
fn csv(trails: &[Trail]) -> String {
    let mut text = String::from("body,cycle,x_m,y_m,z_m\n");
    for trail in trails {
        for (cycle, [x, y, z]) in &trail.points {
            // Writing into a String cannot fail.
            let _ = writeln!(text, "{},{cycle},{x},{y},{z}", trail.of);
        }
    }
    text
}
