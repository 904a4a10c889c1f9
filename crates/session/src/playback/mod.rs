//! A recording of another build, shown from its own tables or messages: nothing is computed again.
//!
//! The scenario defines the bodies, and the tables or messages their places. Anything missing there (scans,
//! conditions, metrics) is not shown, and no body can be inspected.

mod events;
mod pose_reader;

use pose_reader::PoseReader;
use serde_json::{Value, json};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::cycle::PhaseTimes;
use sidestep_kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep_kernel::text::{JsonTextReport, KeyValues};
use sidestep_kernel::view::{
    Body, BodyId, Frame, FrameOptions, Inspection, Kinds, LogEvent, PositionTableColumns, Scenery,
};
use sidestep_kernel::world::DecisionMode;
use sidestep_kernel::{Cycle, Digest, InputError, Interrupt, RunConfig, Simulation};
use sidestep_record::McapSceneReader;
use std::path::Path;

/// A recorded run, shown as if it were running.
pub(crate) struct RecordedPlayback {
    /// The same scenario at its start, as understood by this build.
    start: Box<dyn Simulation>,
    cycle_s: f64,
    bodies: BodySource,
    events: Vec<LogEvent>,
    cycle: Cycle,
    until: Cycle,
    /// The cycle of the last frame.
    shown: Cycle,
}

/// The source of the bodies of a moment.
enum BodySource {
    Tables(PoseReader),
    Messages(McapSceneReader),
}

impl BodySource {
    /// Returns the bodies of a cycle, which may be before the last one.
    fn bodies_at(&mut self, cycle: Cycle) -> Vec<Body> {
        match self {
            Self::Tables(places) => places.bodies_at(cycle),
            // The file could be read when it was opened. Parts that cannot be read now are not shown, because a frame
            // cannot fail.
            Self::Messages(scenes) => scenes.bodies(cycle).unwrap_or_default(),
        }
    }
}

impl RecordedPlayback {
    /// Opens the messages of a recording for viewers, with bodies of these kinds.
    ///
    /// # Errors
    /// When they are damaged.
    pub(crate) fn from_messages(
        start: Box<dyn Simulation>,
        file: &Path,
        kinds: Kinds,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let mut scenes = McapSceneReader::open(file, kinds)?;
        let events = scenes.events()?;
        // Read once to report damage now.
        scenes.bodies(until)?;
        Ok(Self::new(start, BodySource::Messages(scenes), events, until))
    }

    /// Opens the tables of a folder.
    ///
    /// # Errors
    /// When they are damaged.
    pub(crate) fn from_tables(
        mut start: Box<dyn Simulation>,
        folder: &Path,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let first = start.frame(FrameOptions::WITHOUT_SCANS).bodies;
        let rows = start.position_columns();
        let events = events::read_events(folder, &rows, &first)?;
        let places = PoseReader::new(folder, rows, start.scenery(), first, until)?;
        Ok(Self::new(start, BodySource::Tables(places), events, until))
    }

    fn new(
        start: Box<dyn Simulation>,
        bodies: BodySource,
        events: Vec<LogEvent>,
        until: Cycle,
    ) -> Self {
        let cycle_s = start.scenery().cycle_s;
        Self { start, cycle_s, bodies, events, cycle: 0, until, shown: 0 }
    }

    /// Returns the events since the last frame; none if the time went back.
    fn new_events(&mut self) -> Vec<LogEvent> {
        let shown = self.shown.min(self.cycle);
        let from = self.events.partition_point(|event| event.cycle < shown);
        let to = self.events.partition_point(|event| event.cycle < self.cycle);
        self.shown = self.cycle;
        self.events[from..to].to_vec()
    }
}

impl Simulation for RecordedPlayback {
    fn world_name(&self) -> &'static str {
        self.start.world_name()
    }

    fn agent_noun(&self) -> &'static str {
        self.start.agent_noun()
    }

    fn decision_mode(&self) -> DecisionMode {
        self.start.decision_mode()
    }

    fn config(&self) -> &RunConfig {
        self.start.config()
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agent_count(&self) -> usize {
        self.start.agent_count()
    }

    fn is_over(&self) -> bool {
        self.cycle >= self.until
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        let done = cycles.min(self.until - self.cycle);
        self.cycle += done;
        done
    }

    fn set_interrupt(&mut self, _: Interrupt) {}

    /// The digest of the moment, because no state is known.
    fn digest(&self) -> Digest {
        Digest::hash_bytes(&self.cycle.to_le_bytes())
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.cycle.to_le_bytes().to_vec()
    }

    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let bytes = checkpoint.try_into().map_err(|_| CheckpointError::NotACheckpoint)?;
        let cycle = Cycle::from_le_bytes(bytes);
        if cycle > self.until {
            return Err(CheckpointError::Damaged);
        }
        self.cycle = cycle;
        // The next frame is of another time, so its events are those from here on.
        self.shown = cycle;
        Ok(())
    }

    fn start_recording(&mut self) {}

    fn schemas(&self) -> Vec<TableSchema> {
        Vec::new()
    }

    fn record(&mut self, _: &mut dyn Recorder) -> Result<(), RecordError> {
        Ok(())
    }

    fn record_open(&mut self, _: &mut dyn Recorder) -> Result<bool, RecordError> {
        Ok(false)
    }

    fn scenery(&self) -> Scenery {
        self.start.scenery()
    }

    fn enable_events(&mut self) {}

    fn enable_odometry(&mut self) {}

    fn frame(&mut self, _: FrameOptions) -> Frame {
        let time_s = self.cycle as f64 * self.cycle_s;
        let bodies = self.bodies.bodies_at(self.cycle);
        Frame { cycle: self.cycle, time_s, bodies, log: self.new_events(), ..Frame::default() }
    }

    fn inspect(&self, _: BodyId) -> Option<Inspection> {
        None
    }

    fn position_columns(&self) -> Vec<PositionTableColumns> {
        self.start.position_columns()
    }

    fn metrics(&self) -> Value {
        json!({})
    }

    fn agent_metrics(&self) -> Value {
        json!([])
    }

    fn pair_metrics(&self) -> Value {
        Value::Null
    }

    fn summary_lines(&self) -> KeyValues {
        KeyValues::new()
    }

    fn poses(&self) -> JsonTextReport {
        JsonTextReport { json: json!([]), text: String::new() }
    }

    fn phase_times(&self) -> PhaseTimes {
        PhaseTimes::default()
    }
}
