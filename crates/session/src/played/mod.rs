//! A recording of another build, shown from its own tables or messages: nothing is computed again.
//!
//! The scenario defines the bodies, and the tables or messages their places. Anything missing there (scans,
//! conditions, metrics) is not shown, and no body can be inspected.

mod events;
mod places;

use places::Places;
use serde_json::{Value, json};
use sidestep::kernel::checkpoint::CheckpointError;
use sidestep::kernel::cycle::PhaseTimes;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep::kernel::view::{Body, Entry, Frame, Inspection, Look, PlaceRows, Scenery, Who};
use sidestep::kernel::words::{Lines, Said};
use sidestep::kernel::world::Decides;
use sidestep::kernel::{Cycle, Digest, InputError, Interrupt, Plan, Simulation};
use sidestep_record::McapScenes;
use std::path::Path;

/// A recorded run, shown as if it were running.
pub(crate) struct Played {
    /// The same scenario at its start, as understood by this build.
    start: Box<dyn Simulation>,
    cycle_s: f64,
    bodies: Bodies,
    events: Vec<Entry>,
    cycle: Cycle,
    until: Cycle,
    /// The cycle of the last frame.
    shown: Cycle,
}

/// The source of the bodies of a moment.
enum Bodies {
    Tables(Places),
    Messages(McapScenes),
}

impl Bodies {
    /// Returns the bodies of a cycle.
    fn at(&mut self, cycle: Cycle) -> Vec<Body> {
        match self {
            Self::Tables(places) => places.at(cycle),
            // The file could be read when it was opened. Parts that cannot be read now are not shown.
            Self::Messages(scenes) => scenes.bodies(cycle).unwrap_or_default(),
        }
    }
}

impl Played {
    /// Opens the messages of a recording for viewers.
    ///
    /// # Errors
    /// When they are damaged.
    pub(crate) fn of_messages(
        start: Box<dyn Simulation>,
        file: &Path,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let mut scenes = McapScenes::open(file)?;
        let events = scenes.events()?;
        scenes.bodies(until)?;
        Ok(Self::new(start, Bodies::Messages(scenes), events, until))
    }

    /// Opens the tables of a folder.
    ///
    /// # Errors
    /// When they are damaged.
    pub(crate) fn of_tables(
        mut start: Box<dyn Simulation>,
        folder: &Path,
        until: Cycle,
    ) -> Result<Self, InputError> {
        let first = start.frame(Look::BODIES).bodies;
        let rows = start.place_rows();
        let events = events::read(folder, &rows, &first)?;
        let places = Places::new(folder, rows, start.scenery(), first, until)?;
        Ok(Self::new(start, Bodies::Tables(places), events, until))
    }

    fn new(start: Box<dyn Simulation>, bodies: Bodies, events: Vec<Entry>, until: Cycle) -> Self {
        let cycle_s = start.scenery().cycle_s;
        Self { start, cycle_s, bodies, events, cycle: 0, until, shown: 0 }
    }

    /// Returns the events since the last frame; none if the time went back.
    fn log(&mut self) -> Vec<Entry> {
        let at = |cycle: Cycle| self.events.partition_point(|event| event.cycle < cycle);
        let (from, to) = (at(self.shown.min(self.cycle)), at(self.cycle));
        self.shown = self.cycle;
        self.events[from..to].to_vec()
    }
}

impl Simulation for Played {
    fn world(&self) -> &'static str {
        self.start.world()
    }

    fn agent(&self) -> &'static str {
        self.start.agent()
    }

    fn decides(&self) -> Decides {
        self.start.decides()
    }

    fn plan(&self) -> &Plan {
        self.start.plan()
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agents(&self) -> usize {
        self.start.agents()
    }

    fn is_over(&self) -> bool {
        self.cycle >= self.until
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        let done = cycles.min(self.until - self.cycle);
        self.cycle += done;
        done
    }

    fn heed(&mut self, _: Interrupt) {}

    /// The digest of the moment, because no state is known.
    fn digest(&self) -> Digest {
        Digest::of(&self.cycle.to_le_bytes())
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
        (self.cycle, self.shown) = (cycle, cycle);
        Ok(())
    }

    fn begin_recording(&mut self) {}

    fn schemas(&self) -> Vec<TableSchema> {
        Vec::new()
    }

    fn record(&mut self, _: &mut dyn Recorder) -> Result<(), RecordError> {
        Ok(())
    }

    fn scenery(&self) -> Scenery {
        self.start.scenery()
    }

    fn watch(&mut self) {}

    fn watch_odometry(&mut self) {}

    fn frame(&mut self, _: Look) -> Frame {
        let time_s = self.cycle as f64 * self.cycle_s;
        let bodies = self.bodies.at(self.cycle);
        Frame { cycle: self.cycle, time_s, bodies, log: self.log(), ..Frame::default() }
    }

    fn inspect(&self, _: Who) -> Option<Inspection> {
        None
    }

    fn place_rows(&self) -> Vec<PlaceRows> {
        self.start.place_rows()
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

    fn outcome(&self) -> Lines {
        Lines::new()
    }

    fn poses(&self) -> Said {
        Said { json: json!([]), text: String::new() }
    }

    fn phase_times(&self) -> PhaseTimes {
        PhaseTimes::default()
    }
}
