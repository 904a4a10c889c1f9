//! The object-safe interface of a run, through which the command, a server or a binding uses any world.

use crate::checkpoint::CheckpointError;
use crate::control::{
    AgentTeam, AgentTeams, BufferMut, ControlLog, MultiAgentOrder, OrderError, OrderLog,
};
use crate::cycle::PhaseTimes;
use crate::digest::Digest;
use crate::interrupt::Interrupt;
use crate::ports::{ColumnSpec, RecordError, Recorder, TableSchema};
use crate::run_config::RunConfig;
use crate::series::{SeriesInterval, SeriesRows};
use crate::text::{JsonTextReport, KeyValues};
use crate::units::{Cycle, EntityId};
use crate::view::{
    BodyId, Frame, FrameOptions, GridTeam, Inspection, PositionTableColumns, Scenery,
};
use crate::world::DecisionMode;
use std::any::Any;

/// A world and a state that advances. [`crate::Run`] is the one implementation that computes; a recording that can
/// only be shown implements it too, without metrics, teams or inspections. Code that knows the world downcasts to its
/// [`crate::Run`] by [`Any`].
pub trait Simulation: Any + Send {
    /// Name of the world, e.g. `robots`.
    fn world_name(&self) -> &'static str;

    /// The noun for one of its agents, e.g. `robot`.
    fn agent_noun(&self) -> &'static str;

    /// The phase in which its agents decide, which determines the names of the phases in reports.
    fn decision_mode(&self) -> DecisionMode;

    /// The settings of the run, from its scenario.
    fn config(&self) -> &RunConfig;

    /// Cycles done, which is the number of the next one.
    fn cycle(&self) -> Cycle;

    /// Number of entities that act (robots, connectors of chains, airplanes).
    fn agent_count(&self) -> usize;

    /// Returns whether the run has finished early, e.g. because every agent has arrived.
    fn is_over(&self) -> bool;

    /// Returns the reason why the run is over early, in a few words, where its world gives one.
    fn end_reason(&self) -> Option<String> {
        None
    }

    /// Runs up to `cycles` cycles and returns the number done: fewer when a buffer for recording
    /// is full or the run is over, and 0 only if `cycles` is 0.
    fn advance(&mut self, cycles: u64) -> u64;

    /// Lets [`Simulation::advance`] unwind when `interrupt` is raised; the run is then useless
    /// except for its recording.
    fn set_interrupt(&mut self, interrupt: Interrupt);

    /// Returns the digest of the present state: equal for equal scenario, seed and cycle.
    fn digest(&self) -> Digest;

    /// Returns the present state as bytes for [`Simulation::restore`].
    fn checkpoint(&self) -> Vec<u8>;

    /// Continues from a checkpoint of the same scenario and program version.
    ///
    /// # Errors
    /// When the checkpoint is damaged or belongs to another world, scenario or version.
    fn restore(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError>;

    /// Starts to keep the rows that [`Simulation::record`] records.
    fn start_recording(&mut self);

    /// The tables that [`Simulation::record`] fills.
    fn schemas(&self) -> Vec<TableSchema>;

    /// Records all rows since the last call.
    ///
    /// # Errors
    /// When the recorder cannot store it, or [`Simulation::start_recording`] was never called.
    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError>;

    /// Records what still lasts at the end of a recording, after all other rows; returns whether there are such rows. They
    /// are of the present cycle: a run that continues from here drops them first.
    ///
    /// # Errors
    /// When the recorder cannot store it.
    fn record_open(&mut self, recorder: &mut dyn Recorder) -> Result<bool, RecordError>;

    /// The scenery: everything that stays the same during the run.
    fn scenery(&self) -> Scenery;

    /// Starts to keep events for the next [`Simulation::frame`]; no result depends on it.
    fn enable_events(&mut self);

    /// Starts to keep odometry for the next [`Simulation::frame`], which takes longer than events do;
    /// no result depends on it.
    fn enable_odometry(&mut self);

    /// Returns the present frame, with the events since the last call and the odometry
    /// since [`Simulation::enable_odometry`] (none without it). No result depends on it.
    fn frame(&mut self, options: FrameOptions) -> Frame;

    /// Returns the percepts and decisions of a body in the next cycle, and their outcome; `None` for a body that does
    /// not exist or has nothing to show. No result depends on it.
    fn inspect(&self, body: BodyId) -> Option<Inspection>;

    /// Returns the agents as formats of multi-agent path finding show them, with the errands of all tasks from the number
    /// `tasks_from` on. No result depends on it.
    ///
    /// # Errors
    /// When they cannot be shown so: the cause, and a remedy.
    fn grid_team(&self, _tasks_from: u64) -> Result<GridTeam, [String; 2]> {
        let cause = "it was recorded by another build, and can only be shown".to_string();
        Err([cause, "run its scenario again with this program".to_string()])
    }

    /// The teams of agents with the same observations and orders.
    fn agent_teams(&self) -> &[AgentTeam] {
        &[]
    }

    /// Writes the observations of a team's agents, in its order, in the next cycle: one buffer for
    /// each of its spaces. No result depends on it.
    ///
    /// # Errors
    /// When there is no such team, or the buffers have another shape.
    fn observe(&self, team: usize, _: &mut [BufferMut<'_>]) -> Result<(), OrderError> {
        Err(OrderError::NoTeam { team, teams: 0 })
    }

    /// Checks an order as [`Simulation::order`] does, without giving it. The answer is the same in every
    /// cycle, and with every seed of a scenario.
    ///
    /// # Errors
    /// When one of them cannot be obeyed.
    fn check(&self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        AgentTeams::default().check(orders)
    }

    /// Gives an order to several agents for the next cycle. An order stands until its agent has
    /// acted; a later one replaces it.
    ///
    /// # Errors
    /// When one of them cannot be obeyed; no agent gets an order then.
    fn order(&mut self, orders: &MultiAgentOrder<'_>) -> Result<(), OrderError> {
        AgentTeams::default().check(orders)
    }

    /// Gives these orders, each before its cycle, whenever the run gets there: also after
    /// [`Simulation::restore`]. They replace those of an earlier call.
    ///
    /// # Errors
    /// When one of them cannot be obeyed; all then remain as they were.
    fn replay_orders(&mut self, orders: OrderLog) -> Result<(), OrderError> {
        orders.iter().try_for_each(|(_, orders)| AgentTeams::default().check(&orders))
    }

    /// Submits the actions of agents that decide outside of the run, for the next cycle, each as a message of its
    /// world. An agent that is missing does the safe thing. In later cycles agents decide as usual, unless
    /// this is called again.
    ///
    /// # Errors
    /// When no agents of this world decide outside of the run, or an action is impossible; when the run is recorded
    /// without its controls, and could not be reproduced.
    fn submit_controls(&mut self, _: &[(EntityId, Vec<u8>)]) -> Result<(), OrderError> {
        let cause = format!("agents of the world {} decide only within the run", self.world_name());
        Err(OrderError::NoExternalAgents { cause })
    }

    /// Submits these controls again, each before its cycle, whenever the run gets there: also after
    /// [`Simulation::restore`]. They replace those of an earlier call. One that can no longer be carried out counts
    /// as missing, and the state shows that.
    fn replay_controls(&mut self, _: ControlLog) {}

    /// The recorded tables and columns that hold the positions of bodies.
    fn position_columns(&self) -> Vec<PositionTableColumns>;

    /// Returns the metrics of the run so far, as JSON (`metrics` of the summary).
    fn metrics(&self) -> serde_json::Value;

    /// Keeps the metrics from now on after the cycles of an interval, for [`Simulation::take_series`]. It is independent of
    /// a recording, whose rows have an interval of their own. A recording that can only be shown has none.
    fn start_series(&mut self, _: SeriesInterval) {}

    /// The metrics that [`Simulation::take_series`] gives, which are numbers or truth values and measured by no clock, as
    /// columns of a table; none before [`Simulation::start_series`].
    fn series_columns(&self) -> &[ColumnSpec] {
        &[]
    }

    /// Returns the rows since the last call. Those of an abandoned past, before [`Simulation::restore`], are forgotten.
    fn take_series(&mut self) -> SeriesRows {
        SeriesRows::default()
    }

    /// Returns the present metrics, one for each of the columns; NaN where a metric has no value.
    fn series_row(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Returns the metrics of each agent, as a JSON array.
    fn agent_metrics(&self) -> serde_json::Value;

    /// Returns the metrics of pairs of agents; null in worlds without any.
    fn pair_metrics(&self) -> serde_json::Value;

    /// Returns the outcome of the run so far, in lines of text.
    fn summary_lines(&self) -> KeyValues;

    /// Returns the pose of every body at this cycle, as `sidestep replay` prints it.
    fn poses(&self) -> JsonTextReport;

    /// Returns the time spent in each phase in this process.
    fn phase_times(&self) -> PhaseTimes;
}
