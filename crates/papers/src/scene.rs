//! What a picture of a report shows, as plain data.

use sidestep::kernel::view::{Frame, Scenery, Trail};

/// A moment of a run, the ways that led to it, and words.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// What it shows.
    pub title: String,
    /// Small print.
    pub caption: String,
    /// What stays as it is.
    pub scenery: Scenery,
    /// What is there.
    pub frame: Frame,
    /// The ways that led to it.
    pub trails: Vec<Trail>,
}
