//! The hooks of a run beside the phases: start, recording, checkpoints, frames, control and metrics.

use super::metric_info::METRIC_INFO;
use super::metrics::Metrics;
use super::progress::{CHECK_CYCLES, Progress};
use super::rows::Collector;
use super::scenario::{Behaviours, Compiled, StorageOrder};
use super::state::{BodyRecord, Facing, LastContact, RobotsState, Snapshot};
use super::world::{CYCLE_S, RobotsWorld};
use super::{Scratch, text};
use serde_json::{Value, json};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{AgentTeams, BufferMut, Order, OrderError};
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep_kernel::text::{JsonTextReport, KeyValues};
use sidestep_kernel::view::{
    BodyId, Frame, FrameOptions, GridTeam, Inspection, PositionTableColumns, Scenery,
};
use sidestep_kernel::{
    CheckpointableWorld, ControllableWorld, Cycle, Digest, EntityId, InputError, RecordableWorld,
    Run, RunConfig, RunInputs, RunStats, World, WorldMetrics, WorldView,
};
use sidestep_scenario::{Source, metric_label};
use std::sync::Arc;

/// A run of a robots world, for callers that read its state or its typed metrics.
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
        let mut state = RobotsState::restore(&self.world, &self.start_snapshot());
        state.progress = self.world.start_progress(&state, 0);
        let config = self.plan();
        let collector = Collector::new(self.record);
        let start = RunInputs { config, state, collector };
        Run::new(self.world, start, &source.text, workers)
    }

    /// Returns the settings of a run, as the scenario gives them.
    pub fn plan(&self) -> RunConfig {
        RunConfig {
            name: self.name.clone(),
            seed: self.seed,
            cycles: self.cycles,
            checkpoint_every: self.record.checkpoint_every,
            series_every: self.record.series_every,
        }
    }

    /// Returns the state at the start, by entity id.
    pub(crate) fn start_snapshot(&self) -> Snapshot {
        let kinds = self.world.kinds.len();
        let mut bodies = Vec::with_capacity(self.start.len());
        for &(at, heading) in &*self.start {
            bodies.push(BodyRecord {
                at,
                facing: Facing::from_heading(heading),
                contact: LastContact::NONE,
                memory: [0; 4],
                voice: None,
                counts: [0; 3],
                trip: [0; 2],
                contacts: vec![0; kinds],
            });
        }
        let visited = vec![0; self.world.map.cells().len().div_ceil(8)];
        Snapshot { cycle: 0, bodies, visited, progress: Progress::default(), waits: Vec::new() }
    }
}

impl World for RobotsWorld {
    const NAME: &'static str = "robots";
    const AGENT: &'static str = "robot";

    type Collector = Collector;

    fn agent_count(&self) -> usize {
        self.robots.len()
    }

    fn cycles_until_flush(&self, state: &RobotsState, _: &Collector, now: Cycle) -> u64 {
        state.frames.as_ref().map_or(u64::MAX, |poses| poses.first + poses.capacity as u64 - now)
    }

    fn check_interval(&self) -> Option<Cycle> {
        (!self.watched_robots.is_empty()).then_some(CHECK_CYCLES)
    }

    fn check(&self, state: &mut RobotsState, collector: &mut Collector, now: Cycle) {
        // Moved out while it looks at the rest of the state.
        let mut progress = std::mem::take(&mut state.progress);
        collector.push_gridlocks(self.check_progress(&mut progress, state, now));
        state.progress = progress;
    }

    fn is_over(&self, state: &RobotsState) -> bool {
        self.stops_at_gridlock && state.progress.gridlocks_begun() > 0
    }

    fn end_reason(&self, state: &RobotsState) -> Option<String> {
        let first = state.progress.first_gridlock().filter(|_| self.is_over(state))?;
        Some(format!("a gridlock of {first}"))
    }

    fn collect(&self, collector: &mut Collector, scratch: &mut Scratch) {
        collector.collect(scratch);
    }

    fn merge_worker_results(&self, collector: &mut Collector) {
        collector.commit(self);
    }
}

impl RecordableWorld for RobotsWorld {
    fn start_recording(&self, state: &mut RobotsState, collector: &mut Collector, now: Cycle) {
        collector.start(self, state, now);
    }

    fn enable_events(&self, collector: &mut Collector) {
        collector.watch();
    }

    fn enable_odometry(&self, collector: &mut Collector) {
        collector.watch_odometry(self);
    }

    fn prepare_scratch(&self, collector: &Collector, scratch: &mut Scratch) {
        collector.prepare(scratch);
    }

    fn schemas(&self, collector: &Collector) -> Vec<TableSchema> {
        collector.schemas()
    }

    fn record(
        &self,
        state: &mut RobotsState,
        collector: &mut Collector,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        collector.record(self, state, now, recorder)
    }

    fn position_columns(&self, _: &Collector) -> Vec<PositionTableColumns> {
        RobotsWorld::position_columns(self)
    }
}

impl CheckpointableWorld for RobotsWorld {
    type Snapshot = Snapshot;

    fn digest(&self, state: &RobotsState, now: Cycle) -> Digest {
        let snapshot = state.snapshot(self, now);
        if !self.stops_at_gridlock {
            return snapshot.digest();
        }
        // When the run ends follows from it.
        let mut hasher = Hasher::default();
        hasher.write_bytes(snapshot.digest().as_bytes());
        snapshot.progress.write_to(&mut hasher);
        hasher.finish()
    }

    fn save(&self, state: &RobotsState, _: &Collector, now: Cycle) -> Snapshot {
        state.snapshot(self, now)
    }

    fn restore(
        &self,
        saved: Snapshot,
        collector: &mut Collector,
    ) -> Result<RobotsState, CheckpointError> {
        let fits = saved.bodies.len() == self.bodies.len()
            && saved.visited.len() == self.map.cells().len().div_ceil(8)
            && saved.progress.approaches.len() == self.watched_robots.len()
            && saved.waits.len() == self.waits_len();
        if !fits {
            return Err(CheckpointError::Damaged);
        }
        let mut state = RobotsState::restore(self, &saved);
        collector.resume(self, &mut state, saved.cycle);
        Ok(state)
    }
}

impl WorldView for RobotsWorld {
    fn scenery(&self, name: &str) -> Scenery {
        RobotsWorld::scenery(self, name)
    }

    fn frame(
        &self,
        state: &RobotsState,
        collector: &mut Collector,
        now: Cycle,
        options: FrameOptions,
    ) -> Frame {
        let (events, log_left_out) = collector.log.take();
        Frame {
            cycle: now,
            time_s: now as f64 * CYCLE_S,
            bodies: self.visible_bodies(state),
            scans: self.scans(state, now, &options.scans),
            odometry: self.odometry_poses(collector.odometry()),
            joints: Vec::new(),
            log: events.iter().map(|event| self.view_event(state, event)).collect(),
            log_left_out,
        }
    }

    fn inspect(
        &self,
        state: &RobotsState,
        _: &Collector,
        now: Cycle,
        body: BodyId,
    ) -> Option<Inspection> {
        RobotsWorld::inspect(self, state, now, body)
    }

    fn grid_team(
        &self,
        state: &RobotsState,
        now: Cycle,
        tasks_from: u64,
    ) -> Result<GridTeam, [String; 2]> {
        RobotsWorld::grid_team(self, state, now, tasks_from)
    }
}

impl ControllableWorld for RobotsWorld {
    fn agent_teams(&self) -> Arc<AgentTeams> {
        Arc::clone(&self.teams)
    }

    fn order(&self, state: &mut RobotsState, order: &Order<'_>) {
        self.record_order(state, order);
    }

    fn submit_controls(
        &self,
        state: &mut RobotsState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        self.store_controls(state, now, controls)
    }

    fn records_controls(&self, collector: &Collector) -> bool {
        collector.records_controls()
    }

    fn observe(&self, state: &RobotsState, now: Cycle, team: usize, buffers: &mut [BufferMut<'_>]) {
        RobotsWorld::observe(self, state, now, team, buffers);
    }
}

impl WorldMetrics for RobotsWorld {
    type Metrics = Metrics;

    fn metrics(&self, state: &RobotsState, _: &Collector, now: Cycle, stats: &RunStats) -> Metrics {
        RobotsWorld::metrics(self, state, now, stats)
    }

    fn metric_meaning(&self, name: &str) -> &'static str {
        metric_label(&METRIC_INFO, name).meaning
    }

    fn agent_metrics(&self, state: &RobotsState, _: &Collector, now: Cycle) -> Value {
        let robots = self.robots.iter();
        robots.map(|&id| json!({ "body": id, "counts": self.counts(state, now, id) })).collect()
    }

    fn summary_lines(&self, metrics: &Metrics) -> KeyValues {
        text::summary_lines(metrics)
    }

    fn poses(&self, state: &RobotsState, now: Cycle) -> JsonTextReport {
        text::poses(self, &state.snapshot(self, now))
    }
}
