//! The hooks by which a run asks the world for more than its phases.

use super::decide::OptimizationRecord;
use super::encounters::{EncounterRecord, SweepBuffers};
use super::events::Event;
use super::flown_leg::FlownLeg;
use super::metric_info::METRIC_INFO;
use super::metrics::{self, Counters, Metrics};
use super::rows::RecordBuffers;
use super::scenario::CompiledAirspace;
use super::scratch::Scratch;
use super::state::{AirspaceState, Snapshot};
use super::world::AirspaceWorld;
use super::{text, view};
use serde_json::Value;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{AgentTeams, BufferMut, Order, OrderError};
use sidestep_kernel::ports::{RecordError, Recorder, TableBuffers, TableSchema};
use sidestep_kernel::text::{JsonTextReport, KeyValues};
use sidestep_kernel::view::{
    BodyId, EventBuffer, Frame, FrameOptions, Inspection, PositionTableColumns, Scenery,
};
use sidestep_kernel::{
    CheckpointableWorld, ControllableWorld, Cycle, Digest, EntityId, InputError, RecordableWorld,
    Run, RunConfig, RunInputs, RunStats, World, WorldMetrics, WorldView,
};
use sidestep_scenario::{Source, metric_label};
use std::sync::Arc;

/// A run of an airspace, which is a [`RemotePilotRun`](crate::RemotePilotRun) as well.
pub type AirspaceRun = Run<AirspaceWorld>;

/// Returns a run of a scenario at its start.
///
/// # Errors
/// When the scenario is wrong.
pub fn airspace_run(source: &Source, workers: usize) -> Result<AirspaceRun, InputError> {
    Ok(CompiledAirspace::new(source)?.start(source, workers))
}

impl CompiledAirspace {
    /// Returns a run at its start; the world is shared, not copied. `source` names it in
    /// checkpoints.
    pub fn start(self, source: &Source, workers: usize) -> AirspaceRun {
        let state = AirspaceState::restore(&self.world, &self.start_snapshot());
        let mut counters = Counters::default();
        self.too_close.iter().for_each(|&pair| counters.add_too_close_pair(0, pair));
        counters.add_unproved_pairs(self.unproved_pairs);
        let collector =
            Collector { counters, rows: RecordBuffers::new(self.record), ..Collector::default() };
        let plan = self.plan();
        let start = RunInputs { config: plan, state, collector };
        Run::new(self.world, start, &source.text, workers)
    }

    /// Returns the plan that the scenario asks for.
    pub fn plan(&self) -> RunConfig {
        RunConfig {
            name: self.name.clone(),
            seed: self.seed,
            cycles: self.cycles,
            checkpoint_every: self.record.checkpoint_every,
            series_every: self.record.series_every,
        }
    }
}

/// Rows in the order in which the workers have gathered them.
#[derive(Debug, Default)]
struct WorkerRows {
    events: Vec<Event>,
    optimizations: Vec<OptimizationRecord>,
    flown: Vec<FlownLeg>,
}

/// Data that a run keeps beside its state.
#[derive(Debug, Default)]
pub struct Collector {
    /// Sums from which metrics are computed.
    pub counters: Counters,
    /// Processor time in nanoseconds spent deciding in this process.
    decide_ns: u64,
    /// Rows that wait to be recorded; none without recording.
    rows: RecordBuffers,
    /// Events that wait for the next frame.
    log: EventBuffer<Event>,
    /// Rows as the workers have gathered them.
    pending: WorkerRows,
    /// Buffers of the search for encounters.
    sweep: SweepBuffers,
}

impl World for AirspaceWorld {
    const NAME: &'static str = "airspace";
    const AGENT: &'static str = "airplane";
    const OBSERVES_EACH_CYCLE: bool = true;

    type Collector = Collector;

    fn agent_count(&self) -> usize {
        self.airplanes.len()
    }

    fn cycles_until_flush(&self, _: &AirspaceState, collector: &Collector, _: Cycle) -> u64 {
        if collector.rows.is_full() { 0 } else { u64::MAX }
    }

    fn is_over(&self, state: &AirspaceState) -> bool {
        metrics::have_all_ended(state)
    }

    fn collect(&self, collector: &mut Collector, scratch: &mut Scratch) {
        let counters = &mut collector.counters;
        for (phase, losses) in std::mem::take(&mut scratch.losses_by_phase) {
            *counters.losses_by_phase.entry(phase).or_default() += losses;
        }
        for (pair, record) in std::mem::take(&mut scratch.pairs) {
            counters.add_pair(pair, record);
        }
        counters.effort.beacons.add(std::mem::take(&mut scratch.grouped));
        counters.effort.traffic.add(std::mem::take(&mut scratch.exchanged));
        for (now, a, b) in std::mem::take(&mut scratch.too_close) {
            counters.add_too_close_pair(now, (a, b));
        }
        for (key, record) in std::mem::take(&mut scratch.areas) {
            counters.add_area(key, record);
        }
        for (now, slot, number) in std::mem::take(&mut scratch.exempt_areas) {
            counters.add_exempt_area(now, (slot, number));
        }
        counters.observed.add(std::mem::take(&mut scratch.observed));
        collector.decide_ns += std::mem::take(&mut scratch.decide_ns);
        collector.pending.events.append(&mut scratch.events);
        collector.pending.optimizations.append(&mut scratch.optimizations);
        collector.pending.flown.append(&mut scratch.flown);
    }

    fn merge_worker_results(&self, collector: &mut Collector) {
        let WorkerRows { mut events, mut optimizations, mut flown } =
            std::mem::take(&mut collector.pending);
        // Stable, because a pair may lose separation more than once in a cycle.
        events.sort_by_key(Event::sort_key);
        optimizations.sort_unstable_by_key(|one| (one.cycle, one.airplane));
        // Stable, because an airplane may fly several legs in a cycle.
        flown.sort_by_key(FlownLeg::key);
        let rules = flown.first().map_or(self, |leg| self.with_rules_of(leg.cycle));
        let mut encounters = Vec::new();
        let counted = &mut collector.counters.encounters;
        counted.add_cycle(rules, &flown, &mut collector.sweep, &mut encounters);
        flown.into_iter().for_each(|leg| collector.rows.push_flown_leg(leg));
        for event in events {
            collector.counters.add_event(&event);
            collector.log.push(event);
            collector.rows.push_event(event);
        }
        // After the events, which report airplanes beyond the bounds.
        encounters.sort_unstable_by_key(EncounterRecord::sort_key);
        for mut encounter in encounters {
            encounter.is_reported = collector.counters.is_reported(encounter.airplanes);
            collector.rows.push_encounter(encounter);
        }
        for optimization in optimizations {
            collector.counters.effort.add(&optimization);
            collector.rows.push_optimization(optimization);
        }
    }
}

impl RecordableWorld for AirspaceWorld {
    fn start_recording(&self, _: &mut AirspaceState, collector: &mut Collector, _: Cycle) {
        collector.rows.start(self);
    }

    fn enable_events(&self, collector: &mut Collector) {
        collector.log.is_enabled = true;
    }

    fn schemas(&self, collector: &Collector) -> Vec<TableSchema> {
        collector.rows.schemas()
    }

    fn record(
        &self,
        _: &mut AirspaceState,
        collector: &mut Collector,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        collector.rows.record(recorder)
    }

    fn record_open(
        &self,
        _: &mut AirspaceState,
        collector: &mut Collector,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<bool, RecordError> {
        let Collector { counters, rows, .. } = collector;
        if !rows.is_recording_pairs() {
            return Ok(false);
        }
        let mut has_any = false;
        for mut encounter in counters.encounters.open_records(now) {
            encounter.is_reported = counters.is_reported(encounter.airplanes);
            rows.push_encounter(encounter);
            has_any = true;
        }
        rows.record(recorder)?;
        Ok(has_any)
    }

    fn position_columns(&self, _: &Collector) -> Vec<PositionTableColumns> {
        view::position_columns()
    }
}

impl CheckpointableWorld for AirspaceWorld {
    type Snapshot = (Snapshot, Counters);

    fn digest(&self, state: &AirspaceState, now: Cycle) -> Digest {
        state.snapshot(now).digest()
    }

    fn save(
        &self,
        state: &AirspaceState,
        collector: &Collector,
        now: Cycle,
    ) -> (Snapshot, Counters) {
        (state.snapshot(now), collector.counters.clone())
    }

    fn restore(
        &self,
        saved: Self::Snapshot,
        collector: &mut Collector,
    ) -> Result<AirspaceState, CheckpointError> {
        let (snapshot, counters) = saved;
        if snapshot.airplanes.len() != self.airplanes.len() {
            return Err(CheckpointError::Damaged);
        }
        collector.counters = counters;
        Ok(AirspaceState::restore(self, &snapshot))
    }
}

impl WorldView for AirspaceWorld {
    fn scenery(&self, name: &str) -> Scenery {
        view::scenery(self, name)
    }

    fn frame(
        &self,
        state: &AirspaceState,
        collector: &mut Collector,
        now: Cycle,
        _: FrameOptions,
    ) -> Frame {
        let (events, log_left_out) = collector.log.take();
        Frame {
            cycle: now,
            time_s: self.cycle_start_s(now),
            bodies: view::visible_bodies(self, state, now),
            scans: Vec::new(),
            odometry: Vec::new(),
            joints: Vec::new(),
            log: events.iter().map(view::to_log_event).collect(),
            log_left_out,
        }
    }

    fn inspect(
        &self,
        state: &AirspaceState,
        _: &Collector,
        now: Cycle,
        who: BodyId,
    ) -> Option<Inspection> {
        AirspaceWorld::inspect(self, state, now, who)
    }
}

impl ControllableWorld for AirspaceWorld {
    fn agent_teams(&self) -> Arc<AgentTeams> {
        self.teams.clone()
    }

    fn check_order(&self, order: &Order<'_>) -> Result<(), String> {
        self.external_action(order).map_or(Ok(()), |action| action.check())
    }

    fn order(&self, state: &mut AirspaceState, order: &Order<'_>) {
        self.store_order(state, order);
    }

    fn submit_controls(
        &self,
        state: &mut AirspaceState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        self.store_controls(state, now, controls)
    }

    fn records_controls(&self, collector: &Collector) -> bool {
        collector.rows.is_recording_controls()
    }

    fn observe(
        &self,
        state: &AirspaceState,
        now: Cycle,
        team: usize,
        buffers: &mut [BufferMut<'_>],
    ) {
        AirspaceWorld::observe(self, state, now, team, buffers);
    }
}

impl WorldMetrics for AirspaceWorld {
    type Metrics = Metrics;

    fn metrics(
        &self,
        state: &AirspaceState,
        collector: &Collector,
        now: Cycle,
        _: &RunStats,
    ) -> Metrics {
        metrics::metrics(self, state, now, &collector.counters, collector.decide_ns as f64 / 1e9)
    }

    fn metric_meaning(&self, name: &str) -> &'static str {
        metric_label(&METRIC_INFO, name).meaning
    }

    fn agent_metrics(&self, state: &AirspaceState, _: &Collector, _: Cycle) -> Value {
        (0..self.airplanes.len() as EntityId)
            .map(|id| metrics::airplane_metrics(self, state, id))
            .map(|metrics| serde_json::to_value(metrics).unwrap_or_default())
            .collect()
    }

    fn pair_metrics(&self, collector: &Collector) -> Value {
        serde_json::to_value(metrics::pair_metrics(self, &collector.counters)).unwrap_or_default()
    }

    fn summary_lines(&self, metrics: &Metrics) -> KeyValues {
        text::outcome(metrics)
    }

    fn poses(&self, state: &AirspaceState, now: Cycle) -> JsonTextReport {
        text::poses(self.surface, &state.snapshot(now))
    }
}
