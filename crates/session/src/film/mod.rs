//! What is made of frames while a run goes on: recordings for viewers, and films.

mod gif;
mod mcap;
mod pictures;

pub(crate) use gif::write_gif;
pub use mcap::{Ending, McapFilm};
pub(crate) use pictures::Pictures;

use crate::Error;
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;

/// Takes a picture of a run now and then.
pub trait Film {
    /// Pictures are taken in cycles that are multiples of this, and at the end.
    fn every(&self) -> Cycle;

    /// Takes one of the run as it is now.
    ///
    /// # Errors
    /// When it cannot be stored.
    fn shoot(&mut self, run: &mut dyn Simulation) -> Result<(), Error>;
}
