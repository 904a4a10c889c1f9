//! The object-safe face of a run: what the command, a server or a binding sees of any world.

use crate::checkpoint::CheckpointError;
use crate::cycle::PhaseTimes;
use crate::digest::Digest;
use crate::plan::Plan;
use crate::ports::{RecordError, Recorder, TableSchema};
use crate::units::Cycle;
use crate::view::{Frame, Look, PlaceRows, Scenery};
use crate::words::{Lines, Said};
use crate::world::Decides;

/// A world and a state that advances. [`crate::Run`] is the one implementation.
pub trait Simulation: Send {
    /// Name of the world, e.g. `robots`.
    fn world(&self) -> &'static str;

    /// Noun for one of its agents, e.g. `robot`.
    fn agent(&self) -> &'static str;

    /// Where its agents decide: it names the phases in reports.
    fn decides(&self) -> Decides;

    /// What the scenario asks for.
    fn plan(&self) -> &Plan;

    /// Cycles done.
    fn cycle(&self) -> Cycle;

    /// Number of entities that act (robots, connectors of chains, airplanes).
    fn agents(&self) -> usize;

    /// Whether nothing can happen any more, e.g. when everybody has arrived: then a run is
    /// complete before its planned number of cycles.
    fn is_over(&self) -> bool;

    /// Runs up to `cycles` cycles and returns how many were done: fewer when a buffer for
    /// recording is full or the run is over, never 0 unless `cycles` is 0.
    fn advance(&mut self, cycles: u64) -> u64;

    /// The digest of the present state: equal for equal scenario, seed and cycle.
    fn digest(&self) -> Digest;

    /// The present state as bytes for [`Simulation::restore`].
    fn checkpoint(&self) -> Vec<u8>;

    /// Continues from a checkpoint of the same scenario and program version.
    ///
    /// # Errors
    /// When the checkpoint is damaged or belongs to something else.
    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError>;

    /// Begins to keep what [`Simulation::record`] hands over.
    fn begin_recording(&mut self);

    /// The tables that [`Simulation::record`] fills.
    fn schemas(&self) -> Vec<TableSchema>;

    /// Hands everything that happened since the last call to a recorder.
    ///
    /// # Errors
    /// When the recorder cannot store it.
    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError>;

    /// What stays as it is during the run.
    fn scenery(&self) -> Scenery;

    /// Begins to keep what happens for the next [`Simulation::frame`]; no result depends on it.
    fn watch(&mut self);

    /// How things are now, and what happened since the last call (nothing without
    /// [`Simulation::watch`]). It changes no result.
    fn frame(&mut self, look: Look) -> Frame;

    /// Which recorded rows say where bodies were.
    fn place_rows(&self) -> Vec<PlaceRows>;

    /// What the run measured so far, as JSON (`metrics` of the summary).
    fn metrics(&self) -> serde_json::Value;

    /// Metrics of every agent by itself, as a JSON array.
    fn agent_metrics(&self) -> serde_json::Value;

    /// Metrics of pairs of agents; null in worlds without.
    fn pair_metrics(&self) -> serde_json::Value;

    /// What came of the run so far, in lines for people.
    fn outcome(&self) -> Lines;

    /// Where every body is.
    fn poses(&self) -> Said;

    /// Time spent per phase since the start of this process's run.
    fn phase_times(&self) -> PhaseTimes;
}
