//! The summary of a run: the content of `summary.json`, and text for people.

use crate::VERSION;
use crate::driver::RunTiming;
use crate::files::display_path;
use serde::{Serialize, Serializer};
use serde_json::Value;
use sidestep_kernel::Cycle;
use sidestep_kernel::Simulation;
use sidestep_kernel::text::KeyValues;
use sidestep_kernel::world::DecisionMode;
use sidestep_scenario::ImportedScenario;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Whether a run reached its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunStatus {
    /// All cycles are done.
    Complete,
    /// The run was stopped before its end.
    Incomplete,
}

/// The summary of the present state of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Version of the program.
    pub version: &'static str,
    /// Name of the world, as `world` in the scenario.
    pub world: &'static str,
    /// Noun for an agent of the world.
    #[serde(skip)]
    pub agent: &'static str,
    /// Name of the scenario.
    pub name: String,
    /// Whether the run reached its end.
    pub status: RunStatus,
    /// The seed, in case an option has replaced that of the scenario.
    pub seed: u64,
    /// Digest of the state after `cycles` cycles, in hexadecimal.
    pub digest: String,
    /// Cycles done since the run's start.
    pub cycles: Cycle,
    /// Cycles that the scenario asks for.
    pub cycles_planned: Cycle,
    /// The reason why the run ended before these, where its world gives one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_reason: Option<String>,
    /// Number of agents.
    pub agents: usize,
    /// Alias of `agents`, for readers of earlier summaries.
    robots: usize,
    /// Number of worker threads.
    pub workers: usize,
    /// Number of cycles done by this process; the times below are theirs.
    pub cycles_timed: u64,
    /// Elapsed time in seconds.
    pub wall_s: f64,
    /// CPU time of all threads in seconds.
    pub cpu_s: f64,
    /// Speed: agents times cycles per second of CPU time.
    pub agent_cycles_per_cpu_s: f64,
    /// Alias of `agent_cycles_per_cpu_s`.
    robot_cycles_per_cpu_s: f64,
    /// Seconds spent in each phase.
    pub phases_s: Phases,
    /// Metrics of the world.
    pub metrics: Value,
    /// The run folder, if there is one.
    #[serde(serialize_with = "as_shown")]
    pub folder: Option<PathBuf>,
    /// The recording for viewers, if there is one.
    #[serde(serialize_with = "as_shown", skip_serializing_if = "Option::is_none")]
    pub mcap: Option<PathBuf>,
    /// Report about a file of another program that the scenario was made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Value>,
    /// The same report as text.
    #[serde(skip)]
    pub file_lines: KeyValues,
    /// The world's own results as text.
    #[serde(skip)]
    pub outcome: KeyValues,
}

/// Writes a path as [`display_path`]: serde itself would fail on a name that is no text, at the end of a run.
fn as_shown<S: Serializer>(path: &Option<PathBuf>, to: S) -> Result<S::Ok, S::Error> {
    path.as_ref().map(display_path).serialize(to)
}

/// Seconds spent in each phase, by the clock of worker 0.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Phases {
    /// Bodies perceive, decide where agents decide alone, and claim.
    pub claim: f64,
    /// Claims become groups of bodies in conflict.
    pub join: f64,
    /// Groups decide where agents decide together, and all act.
    pub act: f64,
    /// Time of recording.
    pub record: f64,
    /// Aliases of the first three, for readers of earlier summaries.
    perceive_decide: f64,
    conflicts: f64,
    react: f64,
    /// The phase in which agents decide, which determines the names of phases for people.
    #[serde(skip)]
    pub decides: DecisionMode,
}

impl Phases {
    fn new(run: &dyn Simulation, record: Duration) -> Self {
        let times = run.phase_times();
        let [claim, join, act] =
            [times.claim_ns, times.join_ns, times.act_ns].map(|ns| ns as f64 / 1e9);
        Self {
            claim,
            join,
            act,
            record: record.as_secs_f64(),
            perceive_decide: claim,
            conflicts: join,
            react: act,
            decides: run.decision_mode(),
        }
    }
}

/// Time that a process spent on a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunCost {
    pub(crate) workers: usize,
    pub(crate) timing: RunTiming,
    /// Time spent on recording.
    pub(crate) recording: Duration,
}

impl Summary {
    /// Returns the summary of the present state of a run.
    pub(crate) fn new(run: &dyn Simulation, cost: RunCost, folder: Option<&Path>) -> Self {
        let config = run.config();
        let cycles = run.cycle();
        let agents = run.agent_count();
        let timing = cost.timing;
        let cpu_s = timing.cpu.as_secs_f64();
        // The CPU clock may not have moved in a run of a few cycles; JSON has no infinity.
        let agent_cycles_per_cpu_s = agents as f64 * timing.cycles as f64 / cpu_s.max(1e-9);
        let is_incomplete = cycles < config.cycles && !run.is_over();
        let status = if is_incomplete { RunStatus::Incomplete } else { RunStatus::Complete };
        Self {
            version: VERSION,
            world: run.world_name(),
            agent: run.agent_noun(),
            name: config.name.clone(),
            status,
            seed: config.seed,
            digest: run.digest().to_string(),
            cycles,
            cycles_planned: config.cycles,
            end_reason: run.end_reason(),
            agents,
            robots: agents,
            workers: cost.workers,
            cycles_timed: timing.cycles,
            wall_s: timing.wall.as_secs_f64(),
            cpu_s,
            agent_cycles_per_cpu_s,
            robot_cycles_per_cpu_s: agent_cycles_per_cpu_s,
            phases_s: Phases::new(run, cost.recording),
            metrics: run.metrics(),
            folder: folder.map(Path::to_path_buf),
            mcap: None,
            file: None,
            file_lines: Vec::new(),
            outcome: run.summary_lines(),
        }
    }

    /// Adds the report about the file that the scenario was made from.
    pub(crate) fn set_import_report(&mut self, foreign: ImportedScenario) {
        self.file = Some(foreign.json);
        self.file_lines = foreign.lines;
    }

    /// Adds the path of the recording for viewers.
    pub(crate) fn set_mcap_path(&mut self, path: PathBuf) {
        self.mcap = Some(path);
    }
}

/// The content of `summary.json`.
#[derive(Debug, Serialize)]
pub(crate) struct SummaryFile<'a> {
    #[serde(flatten)]
    pub(crate) summary: &'a Summary,
    /// Metrics of each agent.
    pub(crate) per_agent: Value,
    /// Metrics of pairs of agents, in worlds that have any.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub(crate) per_pair: Value,
}
