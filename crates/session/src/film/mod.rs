//! Recordings for viewers and animations, made from frames while a run advances.

mod bag;
mod gif;
mod mcap;
mod pictures;
mod rows;

pub(crate) use bag::BagFilm;
pub(crate) use gif::write_gif;
pub(crate) use mcap::LOOK;
pub use mcap::{Ending, McapFilm};
pub(crate) use pictures::Pictures;
pub(crate) use rows::FrameRows;
pub use rows::frame_rows;

use crate::Error;
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;

/// Takes frames of a run at regular cycles.
pub trait Film {
    /// Returns the number of cycles between frames: they are taken at its multiples, and at the
    /// end.
    fn every(&self) -> Cycle;

    /// Takes a frame of the present state of the run.
    ///
    /// # Errors
    /// When it cannot be stored.
    fn shoot(&mut self, run: &mut dyn Simulation) -> Result<(), Error>;

    /// Returns the number of cycles between looks at the run by [`Film::follow`]; `None` if nothing
    /// between frames matters.
    fn follows_every(&self) -> Option<Cycle> {
        None
    }

    /// Looks at the run between two frames.
    fn follow(&mut self, _run: &mut dyn Simulation) {}
}
