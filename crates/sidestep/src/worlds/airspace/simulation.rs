//! A run of an airspace: the compiled world, the state, the engine, and what is recorded.

use super::Optimization;
use super::events::Event;
use super::metrics::{Ledger, Metrics};
use super::rows::{Rows, Table};
use super::scenario::Compiled;
use super::state::{AirspaceState, Snapshot};
use super::view::entry;
use super::world::AirspaceWorld;
use crate::scenario::Source;
use sidestep_kernel::checkpoint::{self, CheckpointError, Header};
use sidestep_kernel::cycle::PhaseTimes;
use sidestep_kernel::engine::Engine;
use sidestep_kernel::ports::{RecordError, Recorder, SystemClock, TableSchema};
use sidestep_kernel::view::{Frame, Log, Look, PlaceRows, Scenery};
use sidestep_kernel::{Cycle, Digest, InputError, Simulation};
use std::sync::Arc;

/// A run of an airspace.
#[derive(Debug)]
pub struct AirspaceSimulation {
    compiled: Compiled,
    scenario: [u8; 16],
    state: AirspaceState,
    engine: Engine<AirspaceWorld>,
    cycle: Cycle,
    ledger: Ledger,
    decide_ns: u64,
    clock: SystemClock,
    /// What is to be recorded; nothing without recording.
    rows: Rows,
    /// Events that wait for the next frame.
    log: Log<Event>,
}

impl AirspaceSimulation {
    /// A run at its start.
    ///
    /// # Errors
    /// When the scenario is wrong.
    pub fn new(source: &Source, workers: usize) -> Result<Self, InputError> {
        Ok(Self::from_compiled(Compiled::new(source)?, source, workers))
    }

    /// A run of a compiled scenario at its start; the world is shared, not copied.
    pub fn from_compiled(compiled: Compiled, source: &Source, workers: usize) -> Self {
        let state = AirspaceState::restore(&compiled.world, &compiled.start_snapshot());
        let engine = Engine::new(&*compiled.world, compiled.world.airplanes.len(), workers);
        let scenario = *Digest::of(source.text.as_bytes()).as_bytes();
        let too_close = compiled.too_close.iter().map(|&(a, b)| (0, a, b)).collect();
        let ledger = Ledger { too_close, ..Ledger::default() };
        Self {
            compiled,
            scenario,
            state,
            engine,
            cycle: 0,
            ledger,
            decide_ns: 0,
            clock: SystemClock::default(),
            rows: Rows::default(),
            log: Log::default(),
        }
    }

    /// Continues from a checkpoint of the same scenario and program version.
    ///
    /// # Errors
    /// When the checkpoint is damaged or belongs to something else.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), CheckpointError> {
        let (cycle, (snapshot, ledger)): (Cycle, (Snapshot, Ledger)) =
            checkpoint::decode(bytes, &self.header())?;
        if snapshot.airplanes.len() != self.compiled.world.airplanes.len() {
            return Err(CheckpointError::Damaged);
        }
        self.state = AirspaceState::restore(&self.compiled.world, &snapshot);
        (self.cycle, self.ledger) = (cycle, ledger);
        Ok(())
    }

    /// From now on keeps what [`Simulation::record`] hands over.
    pub fn begin_recording(&mut self) {
        let record = &self.compiled.record;
        let asked = [record.trajectories, record.events, record.optimizations];
        self.rows
            .begin(Table::ALL.into_iter().zip(asked).filter(|(_, asked)| *asked).map(|(t, _)| t));
    }

    /// Uses all workers even where one would be faster; for tests and benchmarks.
    pub fn share_always(&mut self) {
        self.engine.share_always();
    }

    /// The world.
    pub fn world(&self) -> &Arc<AirspaceWorld> {
        &self.compiled.world
    }

    /// What the scenario asks for.
    pub fn compiled(&self) -> &Compiled {
        &self.compiled
    }

    /// The state.
    pub fn state(&self) -> &AirspaceState {
        &self.state
    }

    /// What was booked beside the state.
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// The state by id.
    pub fn snapshot(&self) -> Snapshot {
        self.state.snapshot(self.cycle)
    }

    /// Metrics so far.
    pub fn airspace_metrics(&self) -> Metrics {
        self.compiled.world.metrics(&self.state, &self.ledger, self.decide_ns as f64 / 1e9)
    }

    fn header(&self) -> Header {
        Header {
            format: checkpoint::FORMAT,
            program_version: env!("CARGO_PKG_VERSION").into(),
            world: "airspace".into(),
            scenario: self.scenario,
            cycle: self.cycle,
        }
    }

    fn keep_poses(&mut self) {
        let (state, world) = (&self.state, &self.compiled.world);
        for (id, cell) in (0..).zip(&state.airplanes) {
            if state.is_there(world, id, self.cycle) {
                self.rows.pose(self.cycle, id, cell.pose());
            }
        }
    }

    /// Takes over what the workers have gathered in a cycle, in an order that does not depend on
    /// who has gathered what.
    fn gather(&mut self) {
        let (mut events, mut optimizations) = (Vec::new(), Vec::new());
        for mate in self.engine.crew_mut() {
            let scratch = &mut mate.scratch;
            for (pair, record) in std::mem::take(&mut scratch.pairs) {
                self.ledger.add_pair(pair, record);
            }
            events.append(&mut scratch.events);
            optimizations.append(&mut scratch.optimizations);
            self.ledger.effort.traffic.add(std::mem::take(&mut scratch.exchanged));
            self.ledger.too_close.extend(std::mem::take(&mut scratch.too_close));
            self.decide_ns += std::mem::take(&mut scratch.decide_ns);
        }
        events.sort_unstable_by_key(Event::key);
        optimizations.sort_unstable_by_key(|one: &Optimization| (one.cycle, one.airplane));
        for event in events {
            self.ledger.add_event(&event);
            self.log.push(event);
            self.rows.event(event);
        }
        for optimization in optimizations {
            self.ledger.effort.add(&optimization);
            self.rows.optimization(optimization);
        }
    }
}

impl Simulation for AirspaceSimulation {
    fn world(&self) -> &'static str {
        "airspace"
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agents(&self) -> usize {
        self.compiled.world.airplanes.len()
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        // One by one: poses are kept at the start of each cycle, and a run may be over after
        // any. A cycle of airplanes costs far more than that.
        let mut done = 0;
        while done < cycles && (done == 0 || !self.is_over()) && !self.rows.is_full() {
            self.keep_poses();
            let span = (self.cycle, 1);
            self.engine.advance(&*self.compiled.world, &mut self.state, span, &self.clock);
            self.cycle += 1;
            done += 1;
            self.gather();
        }
        done
    }

    fn is_over(&self) -> bool {
        self.compiled.world.is_over(&self.state)
    }

    fn digest(&self) -> Digest {
        self.snapshot().digest()
    }

    fn checkpoint(&self) -> Vec<u8> {
        checkpoint::encode(&self.header(), &(self.snapshot(), &self.ledger))
    }

    fn schemas(&self) -> Vec<TableSchema> {
        self.rows.schemas()
    }

    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        self.rows.record(recorder)
    }

    fn scenery(&self) -> Scenery {
        self.compiled.world.scenery(&self.compiled.name)
    }

    fn watch(&mut self) {
        self.log.is_kept = true;
    }

    fn frame(&mut self, _: Look) -> Frame {
        let (events, log_left_out) = self.log.take();
        Frame {
            cycle: self.cycle,
            time_s: self.compiled.world.starts_s(self.cycle),
            bodies: self.compiled.world.visible_bodies(&self.state, self.cycle),
            scans: Vec::new(),
            log: events.iter().map(entry).collect(),
            log_left_out,
        }
    }

    fn place_rows(&self) -> Vec<PlaceRows> {
        AirspaceWorld::place_rows()
    }

    fn metrics(&self) -> serde_json::Value {
        serde_json::to_value(self.airspace_metrics()).unwrap_or_default()
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.times()
    }
}
