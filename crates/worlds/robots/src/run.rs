//! The hooks by which a run asks the world for more than its phases.

use super::metrics::Metrics;
use super::rows::Books;
use super::scenario::{Behaviours, Compiled, StorageOrder};
use super::state::{BodyRecord, Facing, LastContact, RobotsState, Snapshot};
use super::view::CYCLE_S;
use super::world::RobotsWorld;
use super::{Scratch, words};
use serde_json::{Value, json};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{CellsMut, Order, Teams};
use sidestep_kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep_kernel::view::{Frame, Inspection, Look, PlaceRows, Scenery, Who};
use sidestep_kernel::words::{Lines, Said};
use sidestep_kernel::{Cycle, Digest, Effort, EntityId, InputError, Plan, Run, World};
use sidestep_scenario::Source;
use std::sync::Arc;

/// A run of a robots world.
pub type RobotsRun = Run<RobotsWorld>;

/// Returns a run of a scenario at its start.
///
/// # Errors
/// When the scenario is wrong.
pub fn robots_run(source: &Source, workers: usize) -> Result<RobotsRun, InputError> {
    let compiled = Compiled::new(source, &Behaviours::new(), StorageOrder::Spatial)?;
    Ok(compiled.start(source, workers))
}

impl Compiled {
    /// Returns a run at its start; the world is shared, not copied. `source` names it in
    /// checkpoints.
    pub fn start(self, source: &Source, workers: usize) -> RobotsRun {
        let state = RobotsState::restore(&self.world, &self.start_snapshot());
        let (plan, books) = (self.plan(), Books::new(self.record));
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

    /// Returns the state at the start, by entity id.
    pub(crate) fn start_snapshot(&self) -> Snapshot {
        let kinds = self.world.kinds.len();
        let record = |&(at, heading): &((u32, u32), u8)| BodyRecord {
            at,
            facing: Facing::toward(heading),
            contact: LastContact::NONE,
            memory: [0; 4],
            voice: None,
            counts: [0; 3],
            trip: [0; 2],
            contacts: vec![0; kinds],
        };
        let visited = vec![0; self.world.map.cells().len().div_ceil(8)];
        Snapshot { cycle: 0, bodies: self.start.iter().map(record).collect(), visited }
    }
}

impl World for RobotsWorld {
    const NAME: &'static str = "robots";
    const AGENT: &'static str = "robot";

    type Books = Books;
    type Saved = Snapshot;
    type Metrics = Metrics;

    fn agents(&self) -> usize {
        self.robots.len()
    }

    fn room(&self, state: &RobotsState, _: &Books, now: Cycle) -> u64 {
        state.frames.as_ref().map_or(u64::MAX, |f| f.first + f.capacity as u64 - now)
    }

    fn gather(&self, books: &mut Books, scratch: &mut Scratch) {
        books.gather(scratch);
    }

    fn book(&self, books: &mut Books) {
        books.book(self);
    }

    fn begin_recording(&self, state: &mut RobotsState, books: &mut Books, now: Cycle) {
        books.begin(self, state, now);
    }

    fn watch(&self, books: &mut Books) {
        books.watch();
    }

    fn watch_odometry(&self, books: &mut Books) {
        books.watch_odometry(self);
    }

    fn prepare(&self, books: &Books, scratch: &mut Scratch) {
        books.prepare(scratch);
    }

    fn schemas(&self, books: &Books) -> Vec<TableSchema> {
        books.schemas()
    }

    fn record(
        &self,
        state: &mut RobotsState,
        books: &mut Books,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        books.record(self, state, now, recorder)
    }

    fn digest(&self, state: &RobotsState, now: Cycle) -> Digest {
        state.snapshot(self, now).digest()
    }

    fn save(&self, state: &RobotsState, _: &Books, now: Cycle) -> Snapshot {
        state.snapshot(self, now)
    }

    fn restore(&self, saved: Snapshot, books: &mut Books) -> Result<RobotsState, CheckpointError> {
        let fits = saved.bodies.len() == self.bodies.len()
            && saved.visited.len() == self.map.cells().len().div_ceil(8);
        if !fits {
            return Err(CheckpointError::Damaged);
        }
        let mut state = RobotsState::restore(self, &saved);
        books.go_on(self, &mut state, saved.cycle);
        Ok(state)
    }

    fn scenery(&self, name: &str) -> Scenery {
        RobotsWorld::scenery(self, name)
    }

    fn frame(&self, state: &RobotsState, books: &mut Books, now: Cycle, look: Look) -> Frame {
        let (events, log_left_out) = books.log.take();
        Frame {
            cycle: now,
            time_s: now as f64 * CYCLE_S,
            bodies: self.visible_bodies(state),
            scans: self.scans(state, now, &look.scans),
            odometry: self.claimed_poses(books.odometry()),
            log: events.iter().map(|event| self.entry(event)).collect(),
            log_left_out,
        }
    }

    fn inspect(&self, state: &RobotsState, _: &Books, now: Cycle, who: Who) -> Option<Inspection> {
        RobotsWorld::inspect(self, state, now, who)
    }

    fn teams(&self) -> Arc<Teams> {
        Arc::clone(&self.teams)
    }

    fn order(&self, state: &mut RobotsState, order: &Order<'_>) {
        self.note_order(state, order);
    }

    fn observe(&self, state: &RobotsState, now: Cycle, team: usize, room: &mut [CellsMut<'_>]) {
        RobotsWorld::observe(self, state, now, team, room);
    }

    fn place_rows(&self, _: &Books) -> Vec<PlaceRows> {
        RobotsWorld::place_rows(self)
    }

    fn metrics(&self, state: &RobotsState, _: &Books, now: Cycle, effort: &Effort) -> Metrics {
        RobotsWorld::metrics(self, state, now, &effort.groups)
    }

    fn agent_metrics(&self, state: &RobotsState, _: &Books, now: Cycle) -> Value {
        let one = |&id: &EntityId| json!({ "body": id, "counts": self.counts(state, now, id) });
        self.robots.iter().map(one).collect()
    }

    fn outcome(&self, metrics: &Metrics) -> Lines {
        words::outcome(metrics)
    }

    fn poses(&self, state: &RobotsState, now: Cycle) -> Said {
        words::poses(self, &state.snapshot(self, now))
    }
}
