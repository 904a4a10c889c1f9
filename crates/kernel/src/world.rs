//! The traits that a world implements, one for each role.
//!
//! ```text
//! Phases           claim, join, act: called by the cycle, on any number of workers; plan: on one
//! Auction          bids for claims, an extension of some worlds
//! World            its name, and the results of workers between cycles
//! WorldRecording   rows of tables, and events
//! WorldCheckpoint  digests, and states that are saved and restored
//! WorldView        scenery and frames
//! WorldControl     orders, controls and observations from outside; all optional
//! WorldMetrics     measurements, and texts for people
//! ```

use crate::checkpoint::CheckpointError;
use crate::conflict::ConflictGroups;
use crate::control::{AgentTeams, BufferMut, Order, OrderError};
use crate::digest::Digest;
use crate::ports::{Clock, RecordError, Recorder, TableSchema};
use crate::run_config::RunStats;
use crate::text::{JsonTextReport, KeyValues};
use crate::units::{Cycle, EntityId, EntitySlot};
use crate::view::{
    BodyId, Frame, FrameOptions, GridTeam, Inspection, PositionTableColumns, Scenery,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::ops::Range;
use std::sync::Arc;

/// The context of a worker in one phase of one cycle: its inputs and its own buffers.
pub struct PhaseContext<'a, W: Phases> {
    /// The immutable world.
    pub world: &'a W,
    /// The state; every slot of a column has one writer in each phase.
    pub state: &'a W::State,
    /// The present cycle.
    pub now: Cycle,
    /// The clock, for measuring durations; none of its readings may reach the state.
    pub clock: &'a dyn Clock,
    /// The worker's own buffers, events and sums.
    pub scratch: &'a mut W::Scratch,
}

/// The phase in which agents decide on their actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecisionMode {
    /// Each alone in the phase *claim*, before conflicts are known.
    Independent,
    /// Together with their conflict group in the phase *act*.
    Joint,
}

/// The phases of one cycle of a compiled, immutable world, in their order.
///
/// Each is called by several workers at once on disjoint parts, and everything a worker writes in
/// one phase is seen by all in the next. The state is shared, so its fields are
/// [`crate::column::AtomicColumn`]s (or other cells) with one writer per slot and phase. No result may
/// depend on a clock, a shared generator, or anything else that is not in the state.
pub trait Phases: Sync + Sized {
    /// The mutable state: everything that changes from cycle to cycle.
    type State: Sync;
    /// A worker's own buffers, events and sums, kept between tasks.
    type Scratch: Send;

    /// The phase in which agents decide, which determines the names of the phases in reports.
    const DECISION_MODE: DecisionMode = DecisionMode::Independent;

    /// Returns an empty scratch; called once per worker.
    fn new_scratch(&self) -> Self::Scratch;

    /// Number of bodies, which is the number of tasks in a pool.
    fn body_count(&self, state: &Self::State) -> usize;

    /// Moves bodies to other slots, occasionally between cycles, so that neighbors in the world are
    /// neighbors in memory and each worker stays in one part of both. No result may depend on it.
    fn reorder_slots(&self, _: &mut Self::State) {}

    /// Returns whether there is a phase *plan*, which costs a barrier in each cycle.
    fn has_plan(&self) -> bool {
        false
    }

    /// *Plan*: gives agents that are led together what they are about to do, from the frozen state, before any body
    /// claims. Called on one worker while all others wait, and only where [`Phases::has_plan`] holds. It is a part of
    /// the environment: it may read the whole state, and what it remembers is part of that.
    fn plan(_: &mut PhaseContext<'_, Self>) {}

    /// *Claim*: each body of `bodies` that is due perceives the frozen state, decides (where agents
    /// decide alone), and claims everything that its action may need. Writes only the intents and claims of
    /// these bodies.
    fn claim(context: &mut PhaseContext<'_, Self>, bodies: Range<usize>);

    /// *Join*: joins each body of `bodies` with every other whose claims meet its own. Writes
    /// only `groups`.
    fn join(context: &mut PhaseContext<'_, Self>, bodies: Range<usize>, groups: &ConflictGroups);

    /// *Act*: the bodies of one conflict group decide (where agents decide together) and act, in an
    /// order that depends on state and seed alone. Writes only things that the group has claimed.
    /// The order of `group` itself is arbitrary.
    fn act(context: &mut PhaseContext<'_, Self>, group: &mut [EntitySlot]);

    /// The auction by which bodies in conflict act, in worlds that hold one.
    fn auction(&self) -> Option<&dyn Auction<Self>> {
        None
    }
}

/// Bodies in conflict that act in rounds instead of group by group: in each round, the bodies with
/// the highest bid on everything they claim act, until all have acted. This runs in parallel even
/// inside a large group, and the outcome is the same as acting in the order of the bids.
pub trait Auction<W: Phases> {
    /// Bids for everything that a body claims, and adds the bids to the scratch.
    fn bid(&self, context: &mut PhaseContext<'_, W>, body: EntitySlot);

    /// Lets the bodies of `pending` with the highest bids act, and removes them from the list.
    fn act_on_bids(&self, context: &mut PhaseContext<'_, W>, pending: &mut Vec<EntitySlot>);

    /// Withdraws all bids of the scratch.
    fn retract_bids(&self, context: &mut PhaseContext<'_, W>);
}

/// A world that [`crate::Run`] runs, beside its phases: its name, and the results of workers between
/// cycles.
///
/// The state of [`Phases`] holds everything that changes and that results depend on. The collector
/// holds the rest of a run: sums for metrics, and rows and events that wait to be recorded or shown.
pub trait World: Phases<State: Send> + Send + 'static {
    /// Name of the world, as scenarios write it.
    const NAME: &'static str;
    /// The noun for one of its agents, e.g. `robot`.
    const AGENT: &'static str;
    /// Whether [`World::before_cycle`] and [`World::is_over`] are called before every cycle. A
    /// world with cycles of microseconds leaves it at `false`, because these calls need one more
    /// barrier in each cycle.
    const OBSERVES_EACH_CYCLE: bool = false;

    /// The sums, rows and events that a run keeps beside the state.
    type Collector: Send;

    /// Number of agents, the same in every cycle.
    fn agent_count(&self) -> usize;

    /// Number of cycles that may run before rows must be recorded.
    fn cycles_until_flush(&self, _: &Self::State, _: &Self::Collector, _: Cycle) -> u64 {
        u64::MAX
    }

    /// Keeps rows of the state at the start of a cycle, if they are recorded.
    fn before_cycle(&self, _: &Self::State, _: &mut Self::Collector, _: Cycle) {}

    /// Returns whether nothing can happen anymore, e.g. because all have arrived; the run is then
    /// complete before its planned number of cycles.
    fn is_over(&self, _: &Self::State) -> bool {
        false
    }

    /// Number of cycles from one call of [`World::check`] to the next; `None` for no calls.
    fn check_interval(&self) -> Option<Cycle> {
        None
    }

    /// Looks at the state after `now` cycles, a multiple of [`World::check_interval`], and keeps what it finds in parts
    /// of the state that no cycle reads. A cheaper way than [`World::before_cycle`] to see what changes slowly.
    fn check(&self, _: &mut Self::State, _: &mut Self::Collector, _now: Cycle) {}

    /// Returns the reason why the run is over before its planned number of cycles, in a few words; `None` where
    /// [`World::is_over`] is not true, or says enough.
    fn end_reason(&self, _: &Self::State) -> Option<String> {
        None
    }

    /// Moves the results of one worker from one or more cycles to the collector. The share of each
    /// worker differs from run to run.
    fn collect(&self, collector: &mut Self::Collector, scratch: &mut Self::Scratch);

    /// Adds the collected results of all workers to the sums and rows, in an order that does not
    /// depend on each worker's share.
    fn merge_worker_results(&self, collector: &mut Self::Collector);
}

/// The rows and events that a world keeps during a run.
pub trait RecordableWorld: World {
    /// Starts to keep the rows that [`RecordableWorld::record`] records.
    fn start_recording(&self, state: &mut Self::State, collector: &mut Self::Collector, now: Cycle);

    /// Starts to keep events for frames, which costs time and memory that no recording needs.
    fn enable_events(&self, collector: &mut Self::Collector);

    /// Starts to keep odometry for frames, in worlds with odometry errors.
    fn enable_odometry(&self, _: &mut Self::Collector) {}

    /// Sets up a worker's scratch for gathering rows and events, after
    /// [`RecordableWorld::start_recording`] and [`RecordableWorld::enable_events`].
    fn prepare_scratch(&self, _: &Self::Collector, _: &mut Self::Scratch) {}

    /// Returns the recorded tables; the index is a table's number in the recorder.
    fn schemas(&self, collector: &Self::Collector) -> Vec<TableSchema>;

    /// Records the rows of all cycles before `now` that were not recorded yet.
    ///
    /// # Errors
    /// When the recorder cannot store them.
    fn record(
        &self,
        state: &mut Self::State,
        collector: &mut Self::Collector,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError>;

    /// Records what lasts at `now`, of which else a row is recorded when it ends; returns whether there are such rows. They
    /// are of cycle `now`, so that a run that continues from there drops them, and records what has become of them.
    ///
    /// # Errors
    /// When the recorder cannot store them.
    fn record_open(
        &self,
        _: &mut Self::State,
        _: &mut Self::Collector,
        _now: Cycle,
        _: &mut dyn Recorder,
    ) -> Result<bool, RecordError> {
        Ok(false)
    }

    /// Returns the recorded tables and columns that hold the positions of bodies.
    fn position_columns(&self, _: &Self::Collector) -> Vec<PositionTableColumns> {
        Vec::new()
    }
}

/// The digests of a world's states, and the content of its checkpoints.
pub trait CheckpointableWorld: World {
    /// The content of a checkpoint: the state, and those parts of the collector on which results
    /// depend, by entity id.
    type Snapshot: Serialize + DeserializeOwned;

    /// Returns the digest of everything in a state that results depend on, in an order that does not depend on slots.
    fn digest(&self, state: &Self::State, now: Cycle) -> Digest;

    /// Returns the content of a checkpoint, by entity id and not by slot.
    fn save(&self, state: &Self::State, collector: &Self::Collector, now: Cycle) -> Self::Snapshot;

    /// Returns the state that was saved, and restores the saved parts of the collector.
    ///
    /// # Errors
    /// When it does not fit this world.
    fn restore(
        &self,
        saved: Self::Snapshot,
        collector: &mut Self::Collector,
    ) -> Result<Self::State, CheckpointError>;
}

/// The visible part of a world.
pub trait WorldView: World {
    /// Returns the scenery: everything that stays the same during the run.
    fn scenery(&self, name: &str) -> Scenery;

    /// Returns the present frame, with the events since the last one.
    fn frame(
        &self,
        state: &Self::State,
        collector: &mut Self::Collector,
        now: Cycle,
        options: FrameOptions,
    ) -> Frame;

    /// Returns the percepts and decisions of a body in cycle `now`, and their outcome if no other
    /// order is given before; `None` for a body that does not exist or has nothing to show. It
    /// works on a copy of the data, so that no result depends on it.
    fn inspect(
        &self,
        _: &Self::State,
        _: &Self::Collector,
        _: Cycle,
        _: BodyId,
    ) -> Option<Inspection> {
        None
    }

    /// Returns the agents in cycle `now` as formats of multi-agent path finding show them, with the errands of all tasks
    /// from the number `tasks_from` on.
    ///
    /// # Errors
    /// When they cannot be shown so: the cause, and a remedy.
    fn grid_team(
        &self,
        _: &Self::State,
        _now: Cycle,
        _tasks_from: u64,
    ) -> Result<GridTeam, [String; 2]> {
        let cause = format!("agents of the world {} are not on a grid", Self::NAME);
        Err([cause, "export a run of robots".to_string()])
    }
}

/// The control of agents from outside the run. A world without such control implements nothing of it.
pub trait ControllableWorld: World {
    /// Returns the teams of agents with the same observations and orders.
    fn agent_teams(&self) -> Arc<AgentTeams> {
        Arc::default()
    }

    /// Checks whether an order makes sense. Its values are within their bounds.
    ///
    /// # Errors
    /// When it does not: words for the reason, and for the remedy.
    fn check_order(&self, _: &Order<'_>) -> Result<(), String> {
        Ok(())
    }

    /// Keeps an order for the next decision of its agent. It was checked.
    fn order(&self, _: &mut Self::State, _: &Order<'_>) {}

    /// Keeps the actions of agents for cycle `now`, for which none were submitted yet: these agents
    /// have decided outside of the run. An agent that is missing has sent nothing.
    ///
    /// # Errors
    /// When an agent decides within the run, or an action is impossible; nothing is kept then.
    fn submit_controls(
        &self,
        _: &mut Self::State,
        _now: Cycle,
        _: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        let cause = format!("agents of the world {} decide in the run alone", Self::NAME);
        Err(OrderError::NoExternalAgents { cause })
    }

    /// Returns whether a recorded run keeps the submitted controls.
    fn records_controls(&self, _: &Self::Collector) -> bool {
        false
    }

    /// Writes the observations of a team's agents in cycle `now` from the frozen state into one
    /// buffer for each of the team's [`observation_spaces`]; their sizes were checked.
    ///
    /// [`observation_spaces`]: crate::control::AgentTeam::observation_spaces
    fn observe(&self, _: &Self::State, _: Cycle, _team: usize, _: &mut [BufferMut<'_>]) {}
}

/// The measurements of a run, and texts for people.
pub trait WorldMetrics: World {
    /// The measurements of a run; the names of its fields are the names of metrics. It has the same fields in every
    /// cycle of a run, because they are the columns of the table of metrics over time.
    type Metrics: Serialize;

    /// Returns the metrics of the run so far.
    fn metrics(
        &self,
        state: &Self::State,
        collector: &Self::Collector,
        now: Cycle,
        stats: &RunStats,
    ) -> Self::Metrics;

    /// Returns the thing that a metric counts or measures, in a phrase, by its dotted name, and of the number of entries of
    /// a list by `NAME_count`; empty for one without words. Lists without words have no column over time.
    fn metric_meaning(&self, _name: &str) -> &'static str {
        ""
    }

    /// Returns the metrics of each agent, as a JSON array.
    fn agent_metrics(&self, state: &Self::State, collector: &Self::Collector, now: Cycle) -> Value;

    /// Returns the metrics of pairs of agents; null in worlds without any.
    fn pair_metrics(&self, _: &Self::Collector) -> Value {
        Value::Null
    }

    /// Returns the outcome of a run, in lines for people.
    fn summary_lines(&self, metrics: &Self::Metrics) -> KeyValues;

    /// Returns the pose of every body at this cycle, as `sidestep replay` prints it.
    fn poses(&self, state: &Self::State, now: Cycle) -> JsonTextReport;
}
