//! The one simulation: a world, its state, the engine, and the rows to record.

use crate::checkpoint::{self, CheckpointError, CheckpointHeader};
use crate::control::{
    self, AgentTeam, AgentTeams, BufferMut, ControlLog, ControlRow, MultiAgentOrder, OrderError,
    OrderLog, OrderRow,
};
use crate::cycle::{Observer, PhaseTimes, Scratches};
use crate::digest::Digest;
use crate::engine::{CycleRange, Engine};
use crate::interrupt::Interrupt;
use crate::ports::{
    ColumnSpec, RecordError, Recorder, SystemClock, TableBuffer, TableRowsBuffer, TableSchema,
};
use crate::run_config::{GroupSizeHistogram, RunConfig, RunStats};
use crate::series::{MetricSeries, SeriesInterval, SeriesRows};
use crate::simulation::Simulation;
use crate::text::{JsonTextReport, KeyValues};
use crate::units::{Cycle, EntityId};
use crate::view::{
    BodyId, Frame, FrameOptions, GridTeam, Inspection, PositionTableColumns, Scenery,
};
use crate::world::{
    CheckpointableWorld, ControllableWorld, DecisionMode, RecordableWorld, World, WorldMetrics,
    WorldView,
};
use serde_json::Value;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

/// The start of a run: its settings, its state, and the collector beside the state.
pub struct RunInputs<W: World> {
    /// The settings, from the keys that all scenarios share.
    pub config: RunConfig,
    /// The state before the first cycle.
    pub state: W::State,
    /// The empty collector.
    pub collector: W::Collector,
}

/// A world in progress: its state, its engine, and everything that waits to be replayed or recorded.
pub struct Run<W: World> {
    world: Arc<W>,
    config: RunConfig,
    /// Digest of the scenario's text, to which checkpoints belong.
    scenario: [u8; 16],
    state: W::State,
    collector: W::Collector,
    engine: Engine<W>,
    /// Conflict groups up to the checkpoint from which the run was resumed.
    groups_before: GroupSizeHistogram,
    cycle: Cycle,
    clock: SystemClock,
    /// Whether rows are kept for a recorder.
    records: bool,
    teams: Arc<AgentTeams>,
    /// Orders to be replayed when the run reaches their cycles.
    order_log: OrderLog,
    /// Controls to be replayed likewise.
    control_log: ControlLog,
    /// The last cycle for which that was done: `advance` may be called several times in one cycle.
    last_applied: Option<Cycle>,
    /// Orders that were given and wait to be recorded.
    order_rows: TableRowsBuffer<OrderRow>,
    /// Controls that were submitted and wait to be recorded.
    control_rows: TableRowsBuffer<ControlRow>,
    /// Metrics over time that wait to be recorded.
    series: MetricSeries,
    /// Metrics over time that wait to be taken, at cycles of their own.
    watched_series: MetricSeries,
}

impl<W: ControllableWorld> Run<W> {
    /// Creates a run at its start, with `workers` workers; the world is shared, not copied.
    /// `scenario` is the resolved scenario's text.
    pub fn new(world: Arc<W>, start: RunInputs<W>, scenario: &str, workers: usize) -> Self {
        let RunInputs { config, state, collector } = start;
        let engine = Engine::new(&*world, world.body_count(&state), workers);
        let teams = world.agent_teams();
        Self {
            world,
            config,
            scenario: *Digest::hash_bytes(scenario.as_bytes()).as_bytes(),
            state,
            collector,
            engine,
            groups_before: GroupSizeHistogram::default(),
            cycle: 0,
            clock: SystemClock::default(),
            records: false,
            teams,
            order_log: OrderLog::default(),
            control_log: ControlLog::default(),
            last_applied: None,
            order_rows: TableRowsBuffer::default(),
            control_rows: TableRowsBuffer::default(),
            series: MetricSeries::default(),
            watched_series: MetricSeries::default(),
        }
    }
}

impl<W: World> Run<W> {
    /// Uses all workers even where one would be faster; for tests and benchmarks.
    pub fn force_parallel(&mut self) {
        self.engine.force_parallel();
    }

    /// The world, which several runs may share and no cycle changes.
    pub fn world(&self) -> &Arc<W> {
        &self.world
    }

    /// The state at the start of the next cycle.
    pub fn state(&self) -> &W::State {
        &self.state
    }

    /// The sums, rows and events that are kept beside the state.
    pub fn collector(&self) -> &W::Collector {
        &self.collector
    }

    /// Bytes on the heap of the engine, which grow with the bodies.
    pub fn engine_heap_bytes(&self) -> usize {
        self.engine.heap_bytes()
    }

    /// Returns the conflict groups since the start of the run, and the processor time of all workers.
    pub fn stats(&self) -> RunStats {
        let mut stats = RunStats { groups: self.groups_before, cpu_ns: 0, plan_ns: 0 };
        for worker in self.engine.worker_states() {
            stats.groups.merge(&worker.stats.groups);
            stats.cpu_ns += worker.stats.cpu_ns;
            stats.plan_ns += worker.stats.plan_ns;
        }
        stats
    }

    fn checkpoint_header(&self) -> CheckpointHeader {
        CheckpointHeader {
            format: checkpoint::FORMAT_VERSION,
            program_version: env!("CARGO_PKG_VERSION").into(),
            world: W::NAME.into(),
            scenario: self.scenario,
            cycle: self.cycle,
        }
    }

    /// Moves the results of all workers to the collector.
    fn collect(&mut self) {
        let Self { world, collector, engine, .. } = self;
        for worker in engine.worker_states_mut() {
            world.collect(collector, &mut worker.scratch);
        }
        world.merge_worker_results(collector);
    }

    /// Number of cycles that may run before rows must be recorded.
    fn cycles_until_flush(&self) -> u64 {
        let cycles = self.world.cycles_until_flush(&self.state, &self.collector, self.cycle);
        let tables: [&dyn TableBuffer; 4] =
            [&self.order_rows, &self.control_rows, &self.series, &self.watched_series];
        if tables.iter().any(|rows| rows.is_full()) {
            // Not 0: a cycle adds no orders, which are given between cycles, and one row of metrics at most, and `advance`
            // promises to do at least one.
            cycles.min(1)
        } else {
            cycles
        }
    }

    /// Runs up to `cycles` cycles, before which nothing is to be replayed.
    fn run_segment(&mut self, cycles: u64) -> u64 {
        let cycles = cycles.min(self.cycles_until_flush());
        let Self { world, state, collector, engine, clock, .. } = self;
        let range = CycleRange { from: self.cycle, cycles };
        let done = if W::OBSERVES_EACH_CYCLE {
            let mut observer = WorldHookObserver { world: &**world, collector };
            engine.advance_with_observer(world, state, range, clock, &mut observer)
        } else {
            engine.advance(world, state, range, clock);
            cycles
        };
        self.cycle += done;
        done
    }

    /// Returns the first cycle after the present one before which orders or controls are replayed.
    fn next_replay_cycle(&self) -> Option<Cycle> {
        let orders = self.order_log.next_after(self.cycle);
        orders.into_iter().chain(self.control_log.next_after(self.cycle)).min()
    }

    /// Returns the first cycle after the present one at which the world looks at its state.
    fn next_check(&self) -> Option<Cycle> {
        let interval = self.world.check_interval()?;
        (self.cycle / interval + 1).checked_mul(interval)
    }

    /// Returns the first cycle after the present one after which metrics are kept.
    fn next_row(&self) -> Option<Cycle> {
        let rows = [&self.series, &self.watched_series].map(|rows| rows.next_due(self.cycle));
        rows.into_iter().flatten().min()
    }

    /// Returns the first cycle after the present one before which orders are replayed, or after which the world looks at
    /// its state or metrics are kept.
    fn next_stop(&self) -> Option<Cycle> {
        let stops = [self.next_replay_cycle(), self.next_check(), self.next_row()];
        stops.into_iter().flatten().min()
    }
}

impl<W: ControllableWorld> Run<W> {
    /// Gives an order, or refuses it as a whole.
    fn apply_orders(&mut self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.check_orders(orders)?;
        let Self { world, state, teams, .. } = self;
        teams.for_each_order(orders, |order| {
            world.order(state, order);
            Ok(())
        })?;
        if self.order_rows.is_enabled() {
            let names = self.teams.order_names();
            // An order to no agents may have any name, and has no rows either.
            let name = names.iter().position(|name| name == orders.order).unwrap_or(0) as u32;
            self.teams.for_each_order(orders, |order| {
                for (part, &value) in (0..).zip(order.values) {
                    self.order_rows.push(OrderRow {
                        cycle: self.cycle,
                        agent: order.agent,
                        order: name,
                        part,
                        value,
                    });
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Checks shape and bounds by the teams, and then each order by the world.
    fn check_orders(&self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.teams.for_each_order(orders, |order| {
            self.world.check_order(order).map_err(|cause| OrderError::Invalid {
                order: orders.order.into(),
                agent: self.teams.agent_name(order.agent),
                cause,
            })
        })
    }

    /// Submits the controls of the present cycle, or refuses them as a whole.
    fn apply_controls(&mut self, controls: &[(EntityId, Vec<u8>)]) -> Result<(), OrderError> {
        if self.records && !self.control_rows.is_enabled() {
            let cause = "it is recorded without its controls, so it could not be reproduced; set \
                         record.controls = true";
            return Err(OrderError::NoExternalAgents { cause: cause.into() });
        }
        self.world.submit_controls(&mut self.state, self.cycle, controls)?;
        self.control_rows.extend(control::control_rows(self.cycle, controls));
        Ok(())
    }

    /// Replays the orders and the controls of the present cycle.
    fn apply_due(&mut self) {
        if self.last_applied.replace(self.cycle) == Some(self.cycle) {
            return;
        }
        // Moved out while its orders are applied, which borrows the run.
        let order_log = std::mem::take(&mut self.order_log);
        for orders in order_log.orders_due(self.cycle) {
            self.apply_orders(&orders).expect("`replay_orders` has checked it");
        }
        self.order_log = order_log;
        let control_log = std::mem::take(&mut self.control_log);
        if let Some(controls) = control_log.get(self.cycle) {
            // Controls that can no longer be carried out are skipped. The run then differs, and its digest shows it.
            if self.apply_controls(controls).is_err() {
                let _ = self.apply_controls(&[]);
            }
        }
        self.control_log = control_log;
    }
}

impl<W: CheckpointableWorld> Run<W> {
    /// Returns the content that a checkpoint of the present state would have.
    pub fn snapshot(&self) -> W::Snapshot {
        self.world.save(&self.state, &self.collector, self.cycle)
    }
}

impl<W: WorldMetrics> Run<W> {
    /// Returns the measurements of the run so far.
    pub fn metrics(&self) -> W::Metrics {
        self.world.metrics(&self.state, &self.collector, self.cycle, &self.stats())
    }

    /// Keeps the present metrics as a row of the run over time, where one is due at the cycle `from` or after it.
    fn keep_metrics(&mut self, from: Cycle) {
        let cycle = self.cycle;
        let metrics = self.metrics();
        for rows in [&mut self.series, &mut self.watched_series] {
            if rows.next_due(from) == Some(cycle) {
                rows.push(cycle, &metrics);
            }
        }
    }

    /// Starts to keep metrics over time for a recorder.
    fn start_recorded_series(&mut self) {
        let metrics = self.metrics();
        let interval = self.config.series_interval();
        self.series.start(interval, &metrics, |name| self.world.metric_meaning(name));
    }
}

impl<W: RecordableWorld> Run<W> {
    /// Sets up all workers for gathering the rows and events that are now enabled.
    fn prepare_scratches(&mut self) {
        let Self { world, collector, engine, .. } = self;
        for worker in engine.worker_states_mut() {
            world.prepare_scratch(collector, &mut worker.scratch);
        }
    }
}

impl<W: World> fmt::Debug for Run<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Run").field("world", &W::NAME).field("cycle", &self.cycle).finish()
    }
}

/// An observer between cycles, for worlds that ask for one.
struct WorldHookObserver<'a, W: World> {
    world: &'a W,
    collector: &'a mut W::Collector,
}

impl<W: World> Observer<W> for WorldHookObserver<'_, W> {
    fn before_cycle(&mut self, now: Cycle, state: &W::State) {
        self.world.before_cycle(state, self.collector, now);
    }

    fn after_cycle(
        &mut self,
        now: Cycle,
        state: &W::State,
        mut scratches: Scratches<'_, W::Scratch>,
    ) -> ControlFlow<()> {
        scratches.for_each(|scratch| self.world.collect(self.collector, scratch));
        self.world.merge_worker_results(self.collector);
        let is_full = self.world.cycles_until_flush(state, self.collector, now + 1) == 0;
        if is_full || self.world.is_over(state) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl<W> Simulation for Run<W>
where
    W: CheckpointableWorld + ControllableWorld + WorldMetrics + RecordableWorld + WorldView,
{
    fn world_name(&self) -> &'static str {
        W::NAME
    }

    fn agent_noun(&self) -> &'static str {
        W::AGENT
    }

    fn decision_mode(&self) -> DecisionMode {
        W::DECISION_MODE
    }

    fn config(&self) -> &RunConfig {
        &self.config
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agent_count(&self) -> usize {
        self.world.agent_count()
    }

    fn is_over(&self) -> bool {
        self.world.is_over(&self.state)
    }

    fn end_reason(&self) -> Option<String> {
        self.world.end_reason(&self.state)
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        let mut done = 0;
        while done < cycles {
            self.apply_due();
            let mut segment = cycles - done;
            if let Some(next) = self.next_stop() {
                segment = segment.min(next - self.cycle);
            }
            let from = self.cycle;
            let next_row = self.next_row();
            let next_check = self.next_check();
            let segment_done = self.run_segment(segment);
            done += segment_done;
            // Before the row, which has what was found.
            let is_checked = next_check == Some(self.cycle);
            if is_checked {
                self.world.check(&mut self.state, &mut self.collector, self.cycle);
            }
            if next_row == Some(self.cycle) {
                self.keep_metrics(from);
            }
            // Rows must be recorded, or the run is over: where a segment ends with the cycle that ends the run, its length
            // does not say so.
            if segment_done < segment || self.world.is_over(&self.state) {
                break;
            }
        }
        done
    }

    fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.engine.set_interrupt(interrupt);
    }

    fn digest(&self) -> Digest {
        self.world.digest(&self.state, self.cycle)
    }

    fn checkpoint(&self) -> Vec<u8> {
        checkpoint::encode(&self.checkpoint_header(), &(self.stats().groups, self.snapshot()))
    }

    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let (cycle, (groups, snapshot)) =
            checkpoint::decode(checkpoint, &self.checkpoint_header())?;
        self.state = self.world.restore(snapshot, &mut self.collector)?;
        self.groups_before = groups;
        for worker in self.engine.worker_states_mut() {
            worker.stats.groups = GroupSizeHistogram::default();
        }
        self.cycle = cycle;
        self.last_applied = None;
        self.series.clear();
        self.watched_series.clear();
        Ok(())
    }

    fn start_recording(&mut self) {
        self.records = true;
        self.world.start_recording(&mut self.state, &mut self.collector, self.cycle);
        if self.teams.has_action_spaces() {
            self.order_rows
                .set_table(Some(control::orders_table(self.teams.order_names().to_vec())));
        }
        if self.world.records_controls(&self.collector) {
            self.control_rows.set_table(Some(control::controls_table()));
        }
        self.start_recorded_series();
        self.prepare_scratches();
    }

    fn schemas(&self) -> Vec<TableSchema> {
        let mut schemas = self.world.schemas(&self.collector);
        schemas.extend(self.order_rows.schema());
        schemas.extend(self.control_rows.schema());
        schemas.extend(self.series.schema());
        schemas
    }

    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        // Rows of past cycles are lost: an empty recording would hide that.
        if !self.records {
            let place = format!("the recording of `{}`", self.config.name);
            let cause = "no rows were kept; call `start_recording` before the first `advance`";
            return Err(RecordError::new(place, cause));
        }
        self.collect();
        self.world.record(&mut self.state, &mut self.collector, self.cycle, recorder)?;
        // These tables follow those of the world.
        let blocks = [self.order_rows.take(), self.control_rows.take(), self.series.take()];
        let mut tables = self.world.schemas(&self.collector).len()..;
        blocks
            .into_iter()
            .flatten()
            .zip(&mut tables)
            .try_for_each(|(block, table)| recorder.append(table, &block))
    }

    fn record_open(&mut self, recorder: &mut dyn Recorder) -> Result<bool, RecordError> {
        self.world.record_open(&mut self.state, &mut self.collector, self.cycle, recorder)
    }

    fn scenery(&self) -> Scenery {
        self.world.scenery(&self.config.name)
    }

    fn enable_events(&mut self) {
        self.world.enable_events(&mut self.collector);
        self.prepare_scratches();
    }

    fn enable_odometry(&mut self) {
        self.world.enable_odometry(&mut self.collector);
        self.prepare_scratches();
    }

    fn frame(&mut self, options: FrameOptions) -> Frame {
        self.collect();
        self.world.frame(&self.state, &mut self.collector, self.cycle, options)
    }

    fn inspect(&self, body: BodyId) -> Option<Inspection> {
        self.world.inspect(&self.state, &self.collector, self.cycle, body)
    }

    fn grid_team(&self, tasks_from: u64) -> Result<GridTeam, [String; 2]> {
        self.world.grid_team(&self.state, self.cycle, tasks_from)
    }

    fn agent_teams(&self) -> &[AgentTeam] {
        self.teams.as_slice()
    }

    fn observe(&self, team: usize, buffers: &mut [BufferMut<'_>]) -> Result<(), OrderError> {
        self.teams.check_buffers(team, buffers)?;
        self.world.observe(&self.state, self.cycle, team, buffers);
        Ok(())
    }

    fn check(&self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.check_orders(orders)
    }

    fn order(&mut self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        self.apply_orders(orders)
    }

    fn replay_orders(&mut self, orders: OrderLog) -> Result<(), OrderError> {
        orders.iter().try_for_each(|(_, orders)| self.check_orders(&orders))?;
        self.order_log = orders;
        self.last_applied = None;
        Ok(())
    }

    fn submit_controls(&mut self, controls: &[(EntityId, Vec<u8>)]) -> Result<(), OrderError> {
        self.apply_controls(controls)
    }

    fn replay_controls(&mut self, controls: ControlLog) {
        self.control_log = controls;
        self.last_applied = None;
    }

    fn position_columns(&self) -> Vec<PositionTableColumns> {
        self.world.position_columns(&self.collector)
    }

    fn metrics(&self) -> Value {
        serde_json::to_value(Run::metrics(self)).unwrap_or_default()
    }

    fn start_series(&mut self, interval: SeriesInterval) {
        let metrics = Run::metrics(self);
        self.watched_series.start(interval, &metrics, |name| self.world.metric_meaning(name));
    }

    fn series_columns(&self) -> &[ColumnSpec] {
        self.watched_series.columns()
    }

    fn take_series(&mut self) -> SeriesRows {
        self.watched_series.take_rows()
    }

    fn series_row(&self) -> Vec<f64> {
        self.watched_series.number_row(&Run::metrics(self))
    }

    fn agent_metrics(&self) -> Value {
        self.world.agent_metrics(&self.state, &self.collector, self.cycle)
    }

    fn pair_metrics(&self) -> Value {
        self.world.pair_metrics(&self.collector)
    }

    fn summary_lines(&self) -> KeyValues {
        self.world.summary_lines(&Run::metrics(self))
    }

    fn poses(&self) -> JsonTextReport {
        self.world.poses(&self.state, self.cycle)
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.phase_times()
    }
}
