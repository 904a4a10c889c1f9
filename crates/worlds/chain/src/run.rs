//! The hooks that a run calls on the world beside its phases.

use super::arms::arm::Arm;
use super::events::Event;
use super::metrics::{ChainMetrics, Metrics, Tally};
use super::rows::Rows;
use super::scenario::{AnyCompiled, Compiled};
use super::scratch::Scratch;
use super::state::{ChainState, Snapshot};
use super::view::entry;
use super::words;
use super::world::ChainWorld;
use serde_json::Value;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{CellsMut, Order, OrderError, Teams};
use sidestep_kernel::ports::{Buffers, RecordError, Recorder, TableSchema};
use sidestep_kernel::view::{Frame, Inspection, Log, Look, PlaceRows, Scenery, Who};
use sidestep_kernel::words::{Lines, Said};
use sidestep_kernel::{Cycle, Digest, Effort, EntityId, InputError, Plan, Run, Simulation, World};
use sidestep_scenario::Source;
use std::sync::Arc;

/// A run of chains in `D` dimensions.
pub type ChainRun<const D: usize> = Run<ChainWorld<D>>;

/// Returns a run of a scenario at its start, in the plane or in space: a [`ChainRun`] behind the face that all worlds
/// share. Generic code is compiled again wherever it is named, and this is its name that is not generic.
///
/// # Errors
/// When the scenario is wrong; the error points at the place.
pub fn chain_run(source: &Source, workers: usize) -> Result<Box<dyn Simulation>, InputError> {
    Ok(match AnyCompiled::new(source)? {
        AnyCompiled::Plane(compiled) => Box::new(compiled.start(source, workers)),
        AnyCompiled::Space(compiled) => Box::new(compiled.start(source, workers)),
    })
}

impl<const D: usize> Compiled<D> {
    /// Returns a run at its start; the world is shared, not copied. `source` names it in
    /// checkpoints.
    ///
    /// # Panics
    /// Never, because scripts are tried out when they are compiled.
    pub fn start(self, source: &Source, workers: usize) -> ChainRun<D> {
        let state = ChainState::new(&self.world).expect("scripts are tried when they are compiled");
        let books = Books { rows: Rows::new(self.record), ..Books::default() };
        let plan = self.plan();
        Run::new(self.world, plan, state, books, &source.text, workers)
    }

    /// Returns the plan that the scenario asks for.
    pub fn plan(&self) -> Plan {
        Plan {
            name: self.name.clone(),
            seed: self.seed,
            cycles: self.cycles,
            checkpoint_every: self.record.checkpoint_every,
        }
    }
}

/// Bookkeeping of a run beside its state.
#[derive(Debug, Default)]
pub struct Books {
    /// Steps made before this process resumed the run.
    steps_before: u64,
    /// Rows to be recorded; none without recording.
    rows: Rows,
    /// Events that wait for the next frame.
    log: Log<Event>,
    /// Events gathered from the workers.
    gathered: Vec<Event>,
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the metrics of one chain.
    pub fn metrics_of(&self, state: &ChainState<D>, slot: usize) -> ChainMetrics {
        let body = state.body(slot);
        let spec = &self.chains[slot];
        let named = |(arm, values): (&Arc<Arm>, &Vec<f64>)| {
            let names = arm.serial.variables.iter().map(|variable| variable.name.clone());
            names.zip(values.iter().copied()).collect()
        };
        ChainMetrics {
            chain: slot as EntityId,
            name: spec.name.clone(),
            joints: spec.arm.as_ref().zip(body.joints.as_ref()).map(named),
            progress: self.progress(slot, &body),
            tally: body.tally.clone(),
        }
    }
}

impl<const D: usize> World for ChainWorld<D> {
    const NAME: &'static str = "chain";
    const AGENT: &'static str = "connector";
    const LOOKS_EACH_CYCLE: bool = true;

    type Books = Books;
    type Saved = (Snapshot, Vec<Tally>);
    type Metrics = Metrics;

    fn agents(&self) -> usize {
        self.chains.iter().map(|spec| spec.start.points().len()).sum()
    }

    fn room(&self, _: &ChainState<D>, books: &Books, _: Cycle) -> u64 {
        if books.rows.is_full() { 0 } else { u64::MAX }
    }

    fn before_cycle(&self, state: &ChainState<D>, books: &mut Books, now: Cycle) {
        books.rows.places(self, state, now);
    }

    fn is_over(&self, state: &ChainState<D>) -> bool {
        self.all_is_done(state)
    }

    fn gather(&self, books: &mut Books, scratch: &mut Scratch<D>) {
        books.gathered.append(&mut scratch.events);
    }

    fn book(&self, books: &mut Books) {
        // Events of one chain are already in order, so a stable sort by cycle and chain is enough.
        books.gathered.sort_by_key(|event| (event.cycle, event.chain));
        for event in books.gathered.drain(..) {
            books.log.push(event);
            books.rows.event(event);
        }
    }

    fn begin_recording(&self, _: &mut ChainState<D>, books: &mut Books, _: Cycle) {
        books.rows.begin(self);
    }

    fn watch(&self, books: &mut Books) {
        books.log.is_kept = true;
    }

    fn schemas(&self, books: &Books) -> Vec<TableSchema> {
        books.rows.schemas()
    }

    fn record(
        &self,
        _: &mut ChainState<D>,
        books: &mut Books,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        books.rows.record(recorder)
    }

    fn digest(&self, state: &ChainState<D>, now: Cycle) -> Digest {
        state.snapshot(now).digest()
    }

    fn save(&self, state: &ChainState<D>, _: &Books, now: Cycle) -> (Snapshot, Vec<Tally>) {
        (state.snapshot(now), state.tallies())
    }

    fn restore(
        &self,
        (snapshot, tallies): (Snapshot, Vec<Tally>),
        books: &mut Books,
    ) -> Result<ChainState<D>, CheckpointError> {
        books.steps_before = tallies.iter().map(|t| t.steps).sum();
        ChainState::restore(self, &snapshot, tallies)
    }

    fn scenery(&self, name: &str) -> Scenery {
        ChainWorld::scenery(self, name)
    }

    fn frame(&self, state: &ChainState<D>, books: &mut Books, now: Cycle, look: Look) -> Frame {
        let (events, log_left_out) = books.log.take();
        Frame {
            cycle: now,
            time_s: self.starts_s(now),
            bodies: self.visible_bodies(state, now),
            scans: self.scans(state, now, &look.scans),
            odometry: Vec::new(),
            log: events.iter().map(entry).collect(),
            log_left_out,
        }
    }

    fn inspect(
        &self,
        state: &ChainState<D>,
        _: &Books,
        now: Cycle,
        who: Who,
    ) -> Option<Inspection> {
        ChainWorld::inspect(self, state, now, who)
    }

    fn teams(&self) -> Arc<Teams> {
        self.teams.clone()
    }

    fn check_order(&self, order: &Order<'_>) -> Result<(), String> {
        self.is_possible(order)
    }

    fn order(&self, state: &mut ChainState<D>, order: &Order<'_>) {
        self.note_order(state, order);
    }

    fn hand_over(
        &self,
        state: &mut ChainState<D>,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        self.note_controls(state, now, controls)
    }

    fn keeps_controls(&self, books: &Books) -> bool {
        books.rows.keep_controls()
    }

    fn observe(&self, state: &ChainState<D>, now: Cycle, team: usize, room: &mut [CellsMut<'_>]) {
        ChainWorld::observe(self, state, now, team, room);
    }

    fn place_rows(&self, books: &Books) -> Vec<PlaceRows> {
        ChainWorld::<D>::place_rows(books.rows.every())
    }

    fn metrics(&self, state: &ChainState<D>, books: &Books, _: Cycle, effort: &Effort) -> Metrics {
        let tallies = state.tallies();
        let progress: Vec<f64> =
            (0..state.len()).map(|slot| self.progress(slot, &state.body(slot))).collect();
        let steps = tallies.iter().map(|t| t.steps).sum::<u64>() - books.steps_before;
        Metrics::of(&tallies, &progress, effort.cpu_ns as f64 / 1e9, steps)
    }

    fn agent_metrics(&self, state: &ChainState<D>, _: &Books, _: Cycle) -> Value {
        let one = |slot| serde_json::to_value(self.metrics_of(state, slot)).unwrap_or_default();
        (0..state.len()).map(one).collect()
    }

    fn outcome(&self, metrics: &Metrics) -> Lines {
        words::outcome(metrics)
    }

    fn poses(&self, state: &ChainState<D>, now: Cycle) -> Said {
        words::poses::<D>(&state.snapshot(now))
    }
}
