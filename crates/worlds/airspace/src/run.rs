//! The hooks by which a run asks the world for more than its phases.

use super::decide::Optimization;
use super::events::Event;
use super::metrics::{self, Ledger, Metrics};
use super::rows::{FlownLeg, Rows};
use super::scenario::Compiled;
use super::state::{AirspaceState, Snapshot};
use super::world::AirspaceWorld;
use super::{Scratch, view, words};
use serde_json::Value;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{CellsMut, Order, OrderError, Teams};
use sidestep_kernel::ports::{Buffers, RecordError, Recorder, TableSchema};
use sidestep_kernel::view::{Frame, Inspection, Log, Look, PlaceRows, Scenery, Who};
use sidestep_kernel::words::{Lines, Said};
use sidestep_kernel::{Cycle, Digest, Effort, EntityId, InputError, Plan, Run, World};
use sidestep_scenario::Source;
use std::sync::Arc;

/// A run of an airspace.
pub type AirspaceRun = Run<AirspaceWorld>;

/// Returns a run of a scenario at its start.
///
/// # Errors
/// When the scenario is wrong.
pub fn airspace_run(source: &Source, workers: usize) -> Result<AirspaceRun, InputError> {
    Ok(Compiled::new(source)?.start(source, workers))
}

impl Compiled {
    /// Returns a run at its start; the world is shared, not copied. `source` names it in
    /// checkpoints.
    pub fn start(self, source: &Source, workers: usize) -> AirspaceRun {
        let state = AirspaceState::restore(&self.world, &self.start_snapshot());
        let mut ledger = Ledger::default();
        self.too_close.iter().for_each(|&pair| ledger.add_too_close(0, pair));
        let books = Books { ledger, rows: Rows::new(self.record), ..Books::default() };
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

/// Rows in the order in which the workers have gathered them.
#[derive(Debug, Default)]
struct Gathered {
    events: Vec<Event>,
    optimizations: Vec<Optimization>,
    flown: Vec<FlownLeg>,
}

/// Data that a run keeps beside its state.
#[derive(Debug, Default)]
pub struct Books {
    /// Sums from which metrics are computed.
    pub ledger: Ledger,
    /// Processor time in nanoseconds spent deciding in this process.
    decide_ns: u64,
    /// Rows that wait to be recorded; none without recording.
    rows: Rows,
    /// Events that wait for the next frame.
    log: Log<Event>,
    /// Rows as the workers have gathered them.
    gathered: Gathered,
}

impl World for AirspaceWorld {
    const NAME: &'static str = "airspace";
    const AGENT: &'static str = "airplane";
    const LOOKS_EACH_CYCLE: bool = true;

    type Books = Books;
    type Saved = (Snapshot, Ledger);
    type Metrics = Metrics;

    fn agents(&self) -> usize {
        self.airplanes.len()
    }

    fn room(&self, _: &AirspaceState, books: &Books, _: Cycle) -> u64 {
        if books.rows.is_full() { 0 } else { u64::MAX }
    }

    fn is_over(&self, state: &AirspaceState) -> bool {
        metrics::everybody_has_arrived(state)
    }

    fn gather(&self, books: &mut Books, scratch: &mut Scratch) {
        let ledger = &mut books.ledger;
        for (pair, record) in std::mem::take(&mut scratch.pairs) {
            ledger.add_pair(pair, record);
        }
        ledger.effort.beacons.add(std::mem::take(&mut scratch.grouped));
        ledger.effort.traffic.add(std::mem::take(&mut scratch.exchanged));
        for (now, a, b) in std::mem::take(&mut scratch.too_close) {
            ledger.add_too_close(now, (a, b));
        }
        books.decide_ns += std::mem::take(&mut scratch.decide_ns);
        books.gathered.events.append(&mut scratch.events);
        books.gathered.optimizations.append(&mut scratch.optimizations);
        books.gathered.flown.append(&mut scratch.flown);
    }

    fn book(&self, books: &mut Books) {
        let Gathered { mut events, mut optimizations, mut flown } =
            std::mem::take(&mut books.gathered);
        // Stable, because a pair may lose separation more than once in a cycle.
        events.sort_by_key(Event::key);
        optimizations.sort_unstable_by_key(|one| (one.cycle, one.airplane));
        // Stable, because an airplane may fly several legs in a cycle.
        flown.sort_by_key(FlownLeg::key);
        flown.into_iter().for_each(|leg| books.rows.flown(leg));
        for event in events {
            books.ledger.add_event(&event);
            books.log.push(event);
            books.rows.event(event);
        }
        for optimization in optimizations {
            books.ledger.effort.add(&optimization);
            books.rows.optimization(optimization);
        }
    }

    fn begin_recording(&self, _: &mut AirspaceState, books: &mut Books, _: Cycle) {
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
        _: &mut AirspaceState,
        books: &mut Books,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        books.rows.record(recorder)
    }

    fn digest(&self, state: &AirspaceState, now: Cycle) -> Digest {
        state.snapshot(now).digest()
    }

    fn save(&self, state: &AirspaceState, books: &Books, now: Cycle) -> (Snapshot, Ledger) {
        (state.snapshot(now), books.ledger.clone())
    }

    fn restore(
        &self,
        saved: Self::Saved,
        books: &mut Books,
    ) -> Result<AirspaceState, CheckpointError> {
        let (snapshot, ledger) = saved;
        if snapshot.airplanes.len() != self.airplanes.len() {
            return Err(CheckpointError::Damaged);
        }
        books.ledger = ledger;
        Ok(AirspaceState::restore(self, &snapshot))
    }

    fn scenery(&self, name: &str) -> Scenery {
        view::scenery(self, name)
    }

    fn frame(&self, state: &AirspaceState, books: &mut Books, now: Cycle, _: Look) -> Frame {
        let (events, log_left_out) = books.log.take();
        Frame {
            cycle: now,
            time_s: self.starts_s(now),
            bodies: view::visible_bodies(self, state, now),
            scans: Vec::new(),
            odometry: Vec::new(),
            log: events.iter().map(view::entry).collect(),
            log_left_out,
        }
    }

    fn inspect(
        &self,
        state: &AirspaceState,
        _: &Books,
        now: Cycle,
        who: Who,
    ) -> Option<Inspection> {
        AirspaceWorld::inspect(self, state, now, who)
    }

    fn teams(&self) -> Arc<Teams> {
        self.teams.clone()
    }

    fn check_order(&self, order: &Order<'_>) -> Result<(), String> {
        self.wish(order).map_or(Ok(()), |wish| wish.check())
    }

    fn order(&self, state: &mut AirspaceState, order: &Order<'_>) {
        self.note_order(state, order);
    }

    fn hand_over(
        &self,
        state: &mut AirspaceState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        self.note_controls(state, now, controls)
    }

    fn keeps_controls(&self, books: &Books) -> bool {
        books.rows.keep_controls()
    }

    fn observe(&self, state: &AirspaceState, now: Cycle, team: usize, room: &mut [CellsMut<'_>]) {
        AirspaceWorld::observe(self, state, now, team, room);
    }

    fn place_rows(&self, _: &Books) -> Vec<PlaceRows> {
        view::place_rows()
    }

    fn metrics(&self, state: &AirspaceState, books: &Books, now: Cycle, _: &Effort) -> Metrics {
        metrics::metrics(self, state, now, &books.ledger, books.decide_ns as f64 / 1e9)
    }

    fn agent_metrics(&self, state: &AirspaceState, _: &Books, _: Cycle) -> Value {
        let one = |id| {
            serde_json::to_value(metrics::airplane_metrics(self, state, id)).unwrap_or_default()
        };
        (0..self.airplanes.len() as EntityId).map(one).collect()
    }

    fn pair_metrics(&self, books: &Books) -> Value {
        serde_json::to_value(metrics::pair_metrics(self, &books.ledger)).unwrap_or_default()
    }

    fn outcome(&self, metrics: &Metrics) -> Lines {
        words::outcome(metrics)
    }

    fn poses(&self, state: &AirspaceState, now: Cycle) -> Said {
        words::poses(&state.snapshot(now))
    }
}
