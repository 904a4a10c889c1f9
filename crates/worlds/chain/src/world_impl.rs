//! The hooks that a run calls on the world beside its phases.

use super::events::Event;
use super::metric_info::METRIC_INFO;
use super::metrics::{ArmMetrics, ChainMetrics, ChainTally, JointLimits, Metrics};
use super::rows::RecordBuffers;
use super::scenario::{AnyChainScenario, ChainScenario};
use super::scratch::Scratch;
use super::state::{ChainWorldState, Snapshot};
use super::text;
use super::view::view_event;
use super::world::ChainWorld;
use serde_json::Value;
use sidestep_arms::Arm;
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{AgentTeams, BufferMut, Order, OrderError};
use sidestep_kernel::ports::{RecordError, Recorder, TableBuffers, TableSchema};
use sidestep_kernel::text::{JsonTextReport, KeyValues};
use sidestep_kernel::view::{
    BodyId, EventBuffer, Frame, FrameOptions, Inspection, PositionTableColumns, Scenery,
};
use sidestep_kernel::{
    CheckpointableWorld, ControllableWorld, Cycle, Digest, EntityId, InputError, RecordableWorld,
    Run, RunConfig, RunInputs, RunStats, Simulation, World, WorldMetrics, WorldView,
};
use sidestep_scenario::{Source, metric_label};
use std::sync::Arc;

/// A run whose number of dimensions is known; [`chain_run`] is for those who do not know it.
pub type ChainRun<const D: usize> = Run<ChainWorld<D>>;

/// Returns a run of a scenario at its start, in the plane or in space: a [`ChainRun`] behind the face that all worlds
/// share. Generic code is compiled again wherever it is named, and this is its name that is not generic.
///
/// # Errors
/// When the scenario is wrong; the error points at the place.
pub fn chain_run(source: &Source, workers: usize) -> Result<Box<dyn Simulation>, InputError> {
    Ok(match AnyChainScenario::new(source)? {
        AnyChainScenario::Plane(compiled) => Box::new(compiled.start(source, workers)),
        AnyChainScenario::Space(compiled) => Box::new(compiled.start(source, workers)),
    })
}

impl<const D: usize> ChainScenario<D> {
    /// Returns a run at its start; the world is shared, not copied. `source` names it in
    /// checkpoints.
    ///
    /// # Panics
    /// Never, because scripts are tried out when they are compiled.
    pub fn start(self, source: &Source, workers: usize) -> ChainRun<D> {
        let state =
            ChainWorldState::new(&self.world).expect("scripts are tried when they are compiled");
        let collector = Collector { rows: RecordBuffers::new(self.record), ..Collector::default() };
        let plan = self.plan();
        let start = RunInputs { config: plan, state, collector };
        Run::new(self.world, start, &source.text, workers)
    }

    /// Returns name, seed, length and checkpoints of a run.
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

/// Bookkeeping of a run beside its state.
#[derive(Debug, Default)]
pub struct Collector {
    /// Steps made before this process resumed the run.
    steps_before: u64,
    /// Rows to be recorded; none without recording.
    rows: RecordBuffers,
    /// Events that wait for the next frame.
    log: EventBuffer<Event>,
    /// Whether frames have the odometry of robots.
    has_odometry: bool,
    /// Events of a cycle in the order of the workers, until [`World::merge_worker_results`] sorts them.
    gathered: Vec<Event>,
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the counts of one chain so far, its progress, and the joint values of an arm.
    pub fn chain_metrics(&self, state: &ChainWorldState<D>, slot: usize) -> ChainMetrics {
        let body = state.body(slot);
        let spec = &self.chains[slot];
        let mut joints = None;
        let mut joint_limits = None;
        if let (Some(arm), Some(values)) = (&spec.arm, &body.joints) {
            let names = arm.serial.variables.iter().map(|variable| variable.name.clone());
            joints = Some(names.zip(values.iter().copied()).collect());
            joint_limits = Some(limits_of_joints(arm));
        }
        ChainMetrics {
            chain: slot as EntityId,
            name: spec.name.clone(),
            joints,
            joint_limits,
            progress: self.progress(slot, &body),
            tally: body.tally.clone(),
        }
    }
}

/// Returns the names of an arm's joints and the limits of their rates.
fn limits_of_joints(arm: &Arm) -> Vec<JointLimits> {
    let joints = arm.serial.variables.iter().zip(arm.motion.rates());
    joints
        .map(|(variable, rates)| JointLimits {
            name: variable.name.clone(),
            speed: rates.speed,
            acceleration: rates.acceleration,
            jerk: rates.jerk,
        })
        .collect()
}

impl<const D: usize> World for ChainWorld<D> {
    const NAME: &'static str = "chain";
    const AGENT: &'static str = "connector";
    // Positions are recorded before each cycle, which takes far longer than the barrier for that.
    const OBSERVES_EACH_CYCLE: bool = true;

    type Collector = Collector;

    fn agent_count(&self) -> usize {
        self.chains.iter().map(|spec| spec.start.points().len()).sum()
    }

    fn cycles_until_flush(&self, _: &ChainWorldState<D>, collector: &Collector, _: Cycle) -> u64 {
        // How many rows a cycle makes is not known before, so the buffers are checked after each.
        if collector.rows.is_full() { 0 } else { u64::MAX }
    }

    fn before_cycle(&self, state: &ChainWorldState<D>, collector: &mut Collector, now: Cycle) {
        collector.rows.record_positions(self, state, now);
    }

    fn is_over(&self, state: &ChainWorldState<D>) -> bool {
        self.is_all_done(state)
    }

    fn collect(&self, collector: &mut Collector, scratch: &mut Scratch<D>) {
        collector.gathered.append(&mut scratch.events);
    }

    fn merge_worker_results(&self, collector: &mut Collector) {
        // Events of one chain are already in order, so a stable sort by cycle and chain is enough.
        collector.gathered.sort_by_key(|event| (event.cycle, event.chain));
        for event in collector.gathered.drain(..) {
            collector.log.push(event);
            collector.rows.add_event(event);
        }
    }
}

impl<const D: usize> RecordableWorld for ChainWorld<D> {
    fn start_recording(&self, _: &mut ChainWorldState<D>, collector: &mut Collector, _: Cycle) {
        collector.rows.start(self);
    }

    fn enable_odometry(&self, collector: &mut Collector) {
        collector.has_odometry = true;
    }

    fn enable_events(&self, collector: &mut Collector) {
        collector.log.is_enabled = true;
    }

    fn schemas(&self, collector: &Collector) -> Vec<TableSchema> {
        collector.rows.schemas()
    }

    fn record(
        &self,
        _: &mut ChainWorldState<D>,
        collector: &mut Collector,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        collector.rows.record(recorder)
    }

    fn position_columns(&self, collector: &Collector) -> Vec<PositionTableColumns> {
        ChainWorld::<D>::position_columns(collector.rows.recording_interval())
    }
}

impl<const D: usize> CheckpointableWorld for ChainWorld<D> {
    type Snapshot = (Snapshot, Vec<ChainTally>);

    fn digest(&self, state: &ChainWorldState<D>, now: Cycle) -> Digest {
        state.snapshot(now).digest()
    }

    fn save(
        &self,
        state: &ChainWorldState<D>,
        _: &Collector,
        now: Cycle,
    ) -> (Snapshot, Vec<ChainTally>) {
        (state.snapshot(now), state.tallies())
    }

    fn restore(
        &self,
        (snapshot, tallies): (Snapshot, Vec<ChainTally>),
        collector: &mut Collector,
    ) -> Result<ChainWorldState<D>, CheckpointError> {
        collector.steps_before = tallies.iter().map(|t| t.steps).sum();
        ChainWorldState::restore(self, &snapshot, tallies)
    }
}

impl<const D: usize> WorldView for ChainWorld<D> {
    fn scenery(&self, name: &str) -> Scenery {
        ChainWorld::scenery(self, name)
    }

    fn frame(
        &self,
        state: &ChainWorldState<D>,
        collector: &mut Collector,
        now: Cycle,
        look: FrameOptions,
    ) -> Frame {
        let (events, log_left_out) = collector.log.take();
        Frame {
            cycle: now,
            time_s: self.cycle_start_time_s(now),
            bodies: self.view_bodies(state, now),
            scans: self.scans(state, now, &look.scans),
            odometry: self.odometry_poses(state, collector.has_odometry),
            joints: self.joint_values(state, collector.has_odometry),
            log: events.iter().map(view_event).collect(),
            log_left_out,
        }
    }

    fn inspect(
        &self,
        state: &ChainWorldState<D>,
        _: &Collector,
        now: Cycle,
        who: BodyId,
    ) -> Option<Inspection> {
        ChainWorld::inspect(self, state, now, who)
    }
}

impl<const D: usize> ControllableWorld for ChainWorld<D> {
    fn agent_teams(&self) -> Arc<AgentTeams> {
        self.teams.clone()
    }

    fn check_order(&self, order: &Order<'_>) -> Result<(), String> {
        self.check_possible(order)
    }

    fn order(&self, state: &mut ChainWorldState<D>, order: &Order<'_>) {
        self.record_order(state, order);
    }

    fn submit_controls(
        &self,
        state: &mut ChainWorldState<D>,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        self.record_controls(state, now, controls)
    }

    fn records_controls(&self, collector: &Collector) -> bool {
        collector.rows.records_controls()
    }

    fn observe(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
        team: usize,
        room: &mut [BufferMut<'_>],
    ) {
        ChainWorld::write_observations(self, state, now, team, room);
    }
}

impl<const D: usize> WorldMetrics for ChainWorld<D> {
    type Metrics = Metrics;

    fn metrics(
        &self,
        state: &ChainWorldState<D>,
        collector: &Collector,
        _: Cycle,
        effort: &RunStats,
    ) -> Metrics {
        let tallies = state.tallies();
        let progress: Vec<f64> =
            (0..state.len()).map(|slot| self.progress(slot, &state.body(slot))).collect();
        let steps = tallies.iter().map(|t| t.steps).sum::<u64>() - collector.steps_before;
        let cpu_s = effort.cpu_ns as f64 / 1e9;
        let arms = self.chains.iter().zip(&tallies);
        let arms = arms.filter_map(|(spec, tally)| Some((spec.arm.as_deref()?, tally)));
        Metrics {
            arms: ArmMetrics::from_tallies(arms),
            ..Metrics::from_tallies(&tallies, self.has_robots(), &progress, cpu_s, steps)
        }
    }

    fn metric_meaning(&self, name: &str) -> &'static str {
        metric_label(&METRIC_INFO, name).meaning
    }

    fn agent_metrics(&self, state: &ChainWorldState<D>, _: &Collector, _: Cycle) -> Value {
        let chains = (0..state.len()).map(|slot| self.chain_metrics(state, slot));
        chains.map(|metrics| serde_json::to_value(metrics).unwrap_or_default()).collect()
    }

    fn summary_lines(&self, metrics: &Metrics) -> KeyValues {
        text::summary_lines(metrics)
    }

    fn poses(&self, state: &ChainWorldState<D>, now: Cycle) -> JsonTextReport {
        text::describe_poses::<D>(&state.snapshot(now))
    }
}
