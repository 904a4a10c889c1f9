//! A run of an airspace: the compiled world, the state, the engine, and what is recorded.

use super::metrics::{Ledger, Metrics};
use super::scenario::Compiled;
use super::state::{AirspaceState, Snapshot};
use super::world::AirspaceWorld;
use crate::scenario::Source;
use sidestep_kernel::checkpoint::{self, CheckpointError, Header};
use sidestep_kernel::cycle::PhaseTimes;
use sidestep_kernel::engine::Engine;
use sidestep_kernel::ports::{
    ColumnSpec, ColumnType, RecordError, Recorder, SystemClock, TableSchema, Values,
};
use sidestep_kernel::{Cycle, Digest, InputError, Simulation};
use std::sync::Arc;

/// Rows kept at most before they must be recorded.
const MAX_ROWS: usize = 1 << 20;

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
    /// Poses to be recorded, one row each; `None` without recording.
    rows: Option<Rows>,
}

#[derive(Debug, Default)]
struct Rows {
    cycle: Vec<u64>,
    airplane: Vec<u32>,
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    heading_rad: Vec<f64>,
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
            rows: None,
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
        if self.compiled.record.trajectories {
            self.rows = Some(Rows::default());
        }
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

    /// Whether rows must be recorded before more can be kept.
    fn is_full(&self) -> bool {
        self.rows.as_ref().is_some_and(|rows| rows.cycle.len() >= MAX_ROWS)
    }

    fn keep_rows(&mut self) {
        let Some(rows) = &mut self.rows else { return };
        for (id, cell) in (0..)
            .zip(&self.state.airplanes)
            .filter(|(id, _)| self.state.is_there(&self.compiled.world, *id, self.cycle))
        {
            let pose = cell.pose();
            rows.cycle.push(self.cycle);
            rows.airplane.push(id);
            rows.x_m.push(pose.at[0]);
            rows.y_m.push(pose.at[1]);
            rows.heading_rad.push(pose.psi_rad);
        }
    }

    fn gather(&mut self) {
        for mate in self.engine.crew_mut() {
            let scratch = &mut mate.scratch;
            for (pair, record) in std::mem::take(&mut scratch.pairs) {
                self.ledger.add_pair(pair, record);
            }
            self.ledger.too_close.extend(std::mem::take(&mut scratch.too_close));
            self.ledger.effort.add(std::mem::take(&mut scratch.effort));
            self.decide_ns += std::mem::take(&mut scratch.decide_ns);
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
        while done < cycles && (done == 0 || !self.is_over()) && !self.is_full() {
            self.keep_rows();
            let span = (self.cycle, 1);
            self.engine.advance(&*self.compiled.world, &mut self.state, span, &self.clock);
            self.cycle += 1;
            done += 1;
        }
        self.gather();
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
        if self.rows.is_none() {
            return Vec::new();
        }
        let column = |name: &str, ty, meaning: &str| ColumnSpec {
            name: name.into(),
            ty,
            meaning: meaning.into(),
            labels: Vec::new(),
        };
        vec![TableSchema {
            name: "trajectories".into(),
            columns: vec![
                column("cycle", ColumnType::U64, "cycle of dt at whose start this holds"),
                column("airplane", ColumnType::U32, "entity id"),
                column("x_m", ColumnType::F64, "position east"),
                column("y_m", ColumnType::F64, "position north"),
                column("heading_rad", ColumnType::F64, "heading, counter-clockwise from east"),
            ],
        }]
    }

    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        let Some(rows) = &mut self.rows else { return Ok(()) };
        let Rows { cycle, airplane, x_m, y_m, heading_rad } = std::mem::take(rows);
        let block = [
            Values::U64(cycle),
            Values::U32(airplane),
            Values::F64(x_m),
            Values::F64(y_m),
            Values::F64(heading_rad),
        ];
        recorder.append(0, &block)
    }

    fn metrics(&self) -> serde_json::Value {
        serde_json::to_value(self.airspace_metrics()).unwrap_or_default()
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.times()
    }
}
