//! Recordings for viewers and animations, made from frames while a run advances.

mod animation;
mod bag;
mod gif;
mod mcap;
mod rows;

pub(crate) use animation::AnimationFrames;
pub(crate) use bag::BagSink;
pub(crate) use gif::write_gif;
pub(crate) use mcap::FRAME_OPTIONS;
pub use mcap::{EndReason, McapSink};
pub(crate) use rows::FrameRows;
pub(crate) use rows::frame_rows;

use crate::Error;
use sidestep_kernel::Cycle;
use sidestep_kernel::Simulation;

/// Takes frames of a run at regular cycles.
pub trait FrameSink {
    /// Returns the number of cycles between frames: they are taken at its multiples, and at the
    /// end.
    fn interval(&self) -> Cycle;

    /// Takes a frame of the present state of the run.
    ///
    /// # Errors
    /// When it cannot be stored.
    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error>;

    /// Returns the number of cycles between calls of [`FrameSink::sample`]; `None` if nothing between frames matters.
    fn sample_interval(&self) -> Option<Cycle> {
        None
    }

    /// Called with the run between two frames.
    fn sample(&mut self, _run: &mut dyn Simulation) {}
}
