//! Folders of results as documents.
//!
//! ```text
//! run.rs        a run folder -> a document       metrics.rs   numbers of a summary -> tables
//! sweep.rs      the folder of a sweep -> a document
//! tables.rs     its tables and columns           events.rs    timeline of events
//! text.rs       numbers as text                   series.rs    metrics over time
//! tracks.rs     the tracks of a run as a figure for print
//! ```

mod events;
mod metrics;
mod run;
mod series;
mod sweep;
mod sweep_series;
mod tables;
mod text;
mod tracks;

use crate::sweep::Folder;
use crate::{Error, Watcher};
use sidestep_document::Document;
use sidestep_scenario::Worlds;
use std::path::Path;

pub use text::format_duration;
pub use tracks::{TrackFigure, track_figure};

/// Returns the report of a run folder or of the folder of a sweep. Only this function distinguishes
/// the two.
///
/// # Errors
/// When the folder holds nothing to report, or something in it is damaged.
pub fn document(worlds: &Worlds, folder: &Path, watcher: &dyn Watcher) -> Result<Document, Error> {
    if Folder::is_at(folder) {
        sweep::document(worlds, &Folder::open(folder)?, watcher)
    } else {
        Ok(run::document(worlds, folder)?)
    }
}
