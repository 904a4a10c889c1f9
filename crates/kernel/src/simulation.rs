//! The object-safe face of a run: what the command, a server or a binding sees of any world.

use crate::cycle::PhaseTimes;
use crate::digest::Digest;
use crate::ports::{RecordError, Recorder, TableSchema};
use crate::units::Cycle;
use crate::view::{Frame, Look, PlaceRows, Scenery};

/// A world and a state that advances.
pub trait Simulation: Send {
    /// Name of the world, e.g. `robots`.
    fn world(&self) -> &'static str;

    /// Cycles done.
    fn cycle(&self) -> Cycle;

    /// Entities that act (robots, chains, airplanes).
    fn agents(&self) -> usize;

    /// Whether nothing can happen any more, e.g. when everybody has arrived: then a run is
    /// complete before its planned number of cycles.
    fn is_over(&self) -> bool {
        false
    }

    /// Runs up to `cycles` cycles and says how many were done: fewer when a buffer for
    /// recording is full or the run is over, never 0 unless `cycles` is 0.
    fn advance(&mut self, cycles: u64) -> u64;

    /// The digest of the present state: equal for equal scenario, seed and cycle.
    fn digest(&self) -> Digest;

    /// The present state as bytes for [`crate::checkpoint::decode`].
    fn checkpoint(&self) -> Vec<u8>;

    /// The tables that [`Simulation::record`] fills.
    fn schemas(&self) -> Vec<TableSchema>;

    /// Hands everything that happened since the last call to a recorder.
    ///
    /// # Errors
    /// When the recorder cannot store it.
    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError>;

    /// What stays as it is during the run.
    fn scenery(&self) -> Scenery;

    /// From now on keeps what happens for the next [`Simulation::frame`]; no result depends on it.
    fn watch(&mut self);

    /// How things are now, and what happened since the last call (nothing without
    /// [`Simulation::watch`]). It changes no result.
    fn frame(&mut self, look: Look) -> Frame;

    /// Which recorded rows say where bodies were.
    fn place_rows(&self) -> Vec<PlaceRows> {
        Vec::new()
    }

    /// What the run measured so far, as JSON (`metrics` of the summary).
    fn metrics(&self) -> serde_json::Value;

    /// Time spent per phase since the start of this process's run.
    fn phase_times(&self) -> PhaseTimes;
}
