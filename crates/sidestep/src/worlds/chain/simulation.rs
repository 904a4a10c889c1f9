//! A run of chains: the compiled world, the state, the engine, and what is recorded.

use super::arm::Arm;
use super::driver::in_space;
use super::events::Event;
use super::geometry::Core;
use super::kinematics::Recovered;
use super::metrics::{ChainMetrics, Metrics, Tally};
use super::rows::{Rows, Table};
use super::scenario::Compiled;
use super::state::{ChainState, Snapshot};
use super::swarm::drive::Pose;
use super::view::entry;
use super::world::ChainWorld;
use crate::scenario::Source;
use cpu_time::ThreadTime;
use sidestep_kernel::checkpoint::{self, CheckpointError, Header};
use sidestep_kernel::cycle::PhaseTimes;
use sidestep_kernel::engine::Engine;
use sidestep_kernel::ports::{RecordError, Recorder, SystemClock, TableSchema};
use sidestep_kernel::view::{Frame, Log, Look, PlaceRows, Scenery};
use sidestep_kernel::{Cycle, Digest, EntityId, Simulation};
use std::sync::Arc;

/// A run of chains in `D` dimensions.
#[derive(Debug)]
pub struct ChainSimulation<const D: usize> {
    compiled: Compiled<D>,
    scenario: [u8; 16],
    state: ChainState<D>,
    engine: Engine<ChainWorld<D>>,
    cycle: Cycle,
    /// Processor time of this process's part, and its steps.
    cpu_ns: u64,
    steps_before: u64,
    clock: SystemClock,
    /// What is to be recorded; nothing without recording.
    rows: Rows,
    /// Events that wait for the next frame.
    log: Log<Event>,
}

impl<const D: usize> ChainSimulation<D> {
    /// A run of a compiled scenario at its start; the world is shared, not copied.
    pub fn new(compiled: Compiled<D>, source: &Source, workers: usize) -> Self {
        let state =
            ChainState::new(&compiled.world).expect("scripts are tried when they are compiled");
        let engine = Engine::new(&*compiled.world, compiled.world.chains.len(), workers);
        let scenario = *Digest::of(source.text.as_bytes()).as_bytes();
        Self {
            compiled,
            scenario,
            state,
            engine,
            cycle: 0,
            cpu_ns: 0,
            steps_before: 0,
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
        let (cycle, (snapshot, tallies)): (Cycle, (Snapshot, Vec<Tally>)) =
            checkpoint::decode(bytes, &self.header())?;
        self.state = ChainState::restore(&self.compiled.world, &snapshot, tallies)?;
        self.cycle = cycle;
        self.steps_before = self.state.tallies().iter().map(|t| t.steps).sum();
        Ok(())
    }

    /// From now on keeps what [`Simulation::record`] hands over.
    pub fn begin_recording(&mut self) {
        let asked = self.compiled.record.tables();
        let tables = Table::ALL.into_iter().zip(asked).filter(|(_, asked)| *asked);
        let has_rows = |table: &Table| match table {
            Table::Movers => !self.compiled.world.movers.is_empty(),
            Table::Robots => self.compiled.world.chains.iter().any(|spec| spec.robots.is_some()),
            _ => true,
        };
        self.rows.begin(D, tables.map(|(table, _)| table).filter(has_rows));
    }

    /// Uses all workers even where one would be faster; for tests and benchmarks.
    pub fn share_always(&mut self) {
        self.engine.share_always();
    }

    /// The world.
    pub fn world(&self) -> &Arc<ChainWorld<D>> {
        &self.compiled.world
    }

    /// What the scenario asks for.
    pub fn compiled(&self) -> &Compiled<D> {
        &self.compiled
    }

    /// The state.
    pub fn state(&self) -> &ChainState<D> {
        &self.state
    }

    /// The state by id.
    pub fn snapshot(&self) -> Snapshot {
        self.state.snapshot(self.cycle)
    }

    /// Metrics so far.
    pub fn chain_metrics(&self) -> Metrics {
        let tallies = self.state.tallies();
        let progress: Vec<f64> = (0..self.state.len())
            .map(|slot| self.compiled.world.progress(slot, &self.state.body(slot)))
            .collect();
        let steps = tallies.iter().map(|t| t.steps).sum::<u64>() - self.steps_before;
        let told = |chain: EntityId| Some((chain, self.metrics_of(chain as usize).joints_error?));
        let is_arm = |chain: &EntityId| self.compiled.world.chains[*chain as usize].arm.is_some();
        Metrics {
            joints_errors: (0..tallies.len() as EntityId).filter(is_arm).filter_map(told).collect(),
            ..Metrics::of(&tallies, &progress, self.cpu_ns as f64 / 1e9, steps)
        }
    }

    /// Metrics of one chain.
    pub fn metrics_of(&self, slot: usize) -> ChainMetrics {
        let body = self.state.body(slot);
        let spec = &self.compiled.world.chains[slot];
        let points: Vec<_> = body.chain.points().iter().map(|p| in_space(*p)).collect();
        let joints = spec.arm.as_ref().map(|arm| (arm, arm.joints(&points)));
        let named = |(arm, recovered): (&Arm, Recovered)| {
            let names = arm.serial.variables.iter().map(|variable| variable.name.clone());
            names.zip(recovered.values).collect()
        };
        let (joints, joints_error) = match joints {
            None => (None, None),
            Some((arm, Ok(recovered))) => (Some(named((arm, recovered))), None),
            Some((_, Err(error))) => (None, Some(error.to_string())),
        };
        ChainMetrics {
            chain: slot as EntityId,
            name: spec.name.clone(),
            joints,
            joints_error,
            progress: self.compiled.world.progress(slot, &body),
            tally: body.tally.clone(),
        }
    }

    fn header(&self) -> Header {
        Header {
            format: checkpoint::FORMAT,
            program_version: env!("CARGO_PKG_VERSION").into(),
            world: "chain".into(),
            scenario: self.scenario,
            cycle: self.cycle,
        }
    }

    fn keep_places(&mut self) {
        if !self.cycle.is_multiple_of(self.compiled.record.every) {
            return;
        }
        let (now, world) = (self.cycle, &self.compiled.world);
        if self.rows.keeps(Table::Trajectories) {
            for slot in 0..self.state.len() {
                let body = self.state.body(slot);
                self.rows.connectors(now, slot as EntityId, body.chain.points());
            }
        }
        if self.rows.keeps(Table::Robots) {
            for slot in 0..self.state.len() {
                for (k, robot) in (0..).zip(&self.state.body(slot).robots) {
                    let Pose { at: [x, y], heading_rad } = robot.pose;
                    self.rows.robot(now, slot as EntityId, k, [x, y, heading_rad]);
                }
            }
        }
        if self.rows.keeps(Table::Movers) {
            for obstacle in world.movers.at(world.starts_s(now)) {
                self.rows.mover(now, obstacle.id, middle(&obstacle.core));
            }
        }
    }

    /// Takes over what the workers have gathered in a cycle, in an order that does not depend on
    /// who has gathered what.
    fn gather(&mut self) {
        let mut events: Vec<Event> = Vec::new();
        for mate in self.engine.crew_mut() {
            events.append(&mut mate.scratch.events);
            self.cpu_ns += std::mem::take(&mut mate.scratch.cpu_ns);
        }
        // One chain's events are in their order already.
        events.sort_by_key(|event| (event.cycle, event.chain));
        for event in events {
            self.log.push(event);
            self.rows.event(event);
        }
    }
}

/// A point of a core that moves with it.
fn middle<const D: usize>(core: &Core<D>) -> [f64; D] {
    match core {
        Core::Point(c) => *c,
        Core::Segment([a, b]) => std::array::from_fn(|i| 0.5 * (a[i] + b[i])),
        Core::Cuboid(cuboid) => cuboid.center,
    }
}

impl<const D: usize> Simulation for ChainSimulation<D> {
    fn world(&self) -> &'static str {
        "chain"
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agents(&self) -> usize {
        self.compiled.world.chains.iter().map(|spec| spec.start.points().len()).sum()
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        // One by one: places are kept at the start of a cycle, and a run may be over after any.
        let mut done = 0;
        while done < cycles && (done == 0 || !self.is_over()) && !self.rows.is_full() {
            let began = ThreadTime::now();
            self.keep_places();
            self.cpu_ns += began.elapsed().as_nanos() as u64;
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
        checkpoint::encode(&self.header(), &(self.snapshot(), self.state.tallies()))
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

    fn frame(&mut self, look: Look) -> Frame {
        let (events, log_left_out) = self.log.take();
        let (world, state) = (&self.compiled.world, &self.state);
        Frame {
            cycle: self.cycle,
            time_s: world.starts_s(self.cycle),
            bodies: world.visible_bodies(state, self.cycle),
            scans: world.scans(state, self.cycle, look.scanning_bodies),
            log: events.iter().map(entry).collect(),
            log_left_out,
        }
    }

    fn place_rows(&self) -> Vec<PlaceRows> {
        ChainWorld::<D>::place_rows(self.compiled.record.every)
    }

    fn metrics(&self) -> serde_json::Value {
        serde_json::to_value(self.chain_metrics()).unwrap_or_default()
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.times()
    }
}
