//! The content of a report's picture, as plain data.

use sidestep::kernel::view::{Frame, Scenery, Trail};

/// A moment of a run, the trails that led to it, and texts.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Its title: the content of the picture.
    pub title: String,
    /// Small print.
    pub caption: String,
    /// The parts that never move.
    pub scenery: Scenery,
    /// The visible bodies.
    pub frame: Frame,
    /// The trails that led to it.
    pub trails: Vec<Trail>,
}
