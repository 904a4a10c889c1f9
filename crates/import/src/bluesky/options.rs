//! What a caller chooses for the reading of a scenario, and what it is told of it.

use serde::Serialize;
use std::path::PathBuf;

/// Choices for the reading of a scenario.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ScnOptions {
    /// Folder with the tables of places, `airports.dat`, `fix.dat` and `nav.dat`.
    pub navdata: Option<PathBuf>,
}

/// A command that has no effect.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct UnusedCommand {
    /// Its place, as `line 7`, or `sub.scn line 7` in a file that was called.
    pub place: String,
    /// Its name in capital letters.
    pub command: String,
    /// The reason why it has no effect.
    pub reason: String,
}
