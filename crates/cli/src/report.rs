//! What a run says at its end: `summary.json`, the JSON on standard output, and a table.

use crate::console::{aligned, duration, grouped};
use crate::driver::Effort;
use serde::Serialize;
use serde_json::Value;
use sidestep::kernel::Cycle;
use sidestep::kernel::Simulation;
use sidestep::kernel::world::Decides;
use sidestep::scenario::Foreign;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Names and values, one per line.
pub(crate) type Lines = Vec<(String, String)>;

/// Whether a run reached its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Status {
    /// All cycles are done.
    Complete,
    /// It was stopped before.
    Incomplete,
}

/// The report of a run.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Summary {
    /// Version of the program.
    version: &'static str,
    /// Name of the world.
    world: &'static str,
    #[serde(skip)]
    agent: &'static str,
    /// Name of the scenario.
    name: String,
    status: Status,
    seed: u64,
    /// Digest of the state after `cycles` cycles, in hexadecimal.
    digest: String,
    /// Cycles done since the run's start.
    cycles: Cycle,
    cycles_planned: Cycle,
    agents: usize,
    /// Alias of `agents`, for readers of earlier summaries.
    robots: usize,
    workers: usize,
    /// Cycles done by this process; the times below are theirs.
    cycles_timed: u64,
    wall_s: f64,
    cpu_s: f64,
    agent_cycles_per_cpu_s: f64,
    /// Alias of `agent_cycles_per_cpu_s`.
    robot_cycles_per_cpu_s: f64,
    phases_s: Phases,
    metrics: Value,
    /// The run folder, if there is one.
    folder: Option<PathBuf>,
    /// The recording for viewers, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    mcap: Option<PathBuf>,
    /// What was found in the file of another program's form that the scenario was made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<Value>,
    #[serde(skip)]
    file_lines: Lines,
}

/// Seconds per phase, by the clock of worker 0.
#[derive(Debug, Clone, Copy, Serialize)]
struct Phases {
    claim: f64,
    join: f64,
    act: f64,
    record: f64,
    /// Aliases of the first three, for readers of earlier summaries.
    perceive_decide: f64,
    conflicts: f64,
    react: f64,
    #[serde(skip)]
    decides: Decides,
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
            decides: run.decides(),
        }
    }

    /// Shares of the whole, in words.
    fn words(self) -> String {
        let [first, last] = match self.decides {
            Decides::Alone => ["perceive, decide and claim", "act"],
            Decides::Together => ["perceive and claim", "decide and act"],
        };
        let phases =
            [(first, self.claim), ("join", self.join), (last, self.act), ("record", self.record)];
        let all: f64 = phases.iter().map(|(_, s)| s).sum();
        let share = |(name, s): &(&str, f64)| format!("{name} {:.0} %", 100.0 * s / all.max(1e-12));
        phases.iter().map(share).collect::<Vec<_>>().join(", ")
    }
}

/// What a process spent on a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cost {
    pub(crate) workers: usize,
    pub(crate) effort: Effort,
    /// Time spent on recording.
    pub(crate) recording: Duration,
}

impl Summary {
    /// The report of a run as it stands.
    pub(crate) fn new(run: &dyn Simulation, cost: Cost, folder: Option<&Path>) -> Self {
        let plan = run.plan();
        let (cycles, agents, effort) = (run.cycle(), run.agents(), cost.effort);
        let cpu_s = effort.cpu.as_secs_f64();
        let agent_cycles_per_cpu_s = agents as f64 * effort.cycles as f64 / cpu_s.max(1e-9);
        let status = match cycles < plan.cycles && !run.is_over() {
            true => Status::Incomplete,
            false => Status::Complete,
        };
        Self {
            version: env!("CARGO_PKG_VERSION"),
            world: run.world(),
            agent: run.agent(),
            name: plan.name.clone(),
            status,
            seed: plan.seed,
            digest: run.digest().to_string(),
            cycles,
            cycles_planned: plan.cycles,
            agents,
            robots: agents,
            workers: cost.workers,
            cycles_timed: effort.cycles,
            wall_s: effort.wall.as_secs_f64(),
            cpu_s,
            agent_cycles_per_cpu_s,
            robot_cycles_per_cpu_s: agent_cycles_per_cpu_s,
            phases_s: Phases::new(run, cost.recording),
            metrics: run.metrics(),
            folder: folder.map(Path::to_path_buf),
            mcap: None,
            file: None,
            file_lines: Vec::new(),
        }
    }

    /// Adds what was found in the file that the scenario was made from.
    pub(crate) fn tell_of_file(&mut self, foreign: Foreign) {
        self.file = Some(foreign.json);
        self.file_lines = foreign.lines;
    }

    /// Adds where the recording for viewers is.
    pub(crate) fn tell_of_mcap(&mut self, path: PathBuf) {
        self.mcap = Some(path);
    }

    /// Whether the run reached its end.
    pub(crate) fn status(&self) -> Status {
        self.status
    }

    /// The digest in hexadecimal.
    pub(crate) fn digest(&self) -> &str {
        &self.digest
    }

    /// The report for people; `outcome` is the world's part.
    pub(crate) fn text(&self, outcome: Lines) -> String {
        let mut lines = vec![
            line(&format!("{}s", self.agent), grouped(self.agents as u64)),
            line("cycles", self.cycles_words()),
        ];
        lines.extend(outcome);
        lines.extend(self.file_lines.iter().cloned());
        if self.cycles_timed > 0 {
            lines.push(line("speed", self.speed()));
            lines.push(line("time", self.phases_s.words()));
        }
        lines.push(line("digest", self.digest.clone()));
        lines.extend(self.folder.as_ref().map(|f| line("results", f.display().to_string())));
        lines.extend(self.mcap.as_ref().map(|f| line("viewers", f.display().to_string())));
        format!("{}\n{}", self.heading(), aligned(&lines))
    }

    fn heading(&self) -> String {
        let name = if self.name.is_empty() { self.world } else { &self.name };
        format!("{name}, seed {}", self.seed)
    }

    fn cycles_words(&self) -> String {
        let done = grouped(self.cycles);
        match self.status {
            Status::Complete => done,
            Status::Incomplete => {
                format!("{done} of {}: INCOMPLETE", grouped(self.cycles_planned))
            }
        }
    }

    fn speed(&self) -> String {
        let per_second = self.cycles_timed as f64 / self.wall_s.max(1e-9);
        format!(
            "{} for {} cycles ({}/s); {} {}-cycles per CPU second on {} worker{}",
            duration(self.wall_s),
            grouped(self.cycles_timed),
            grouped(per_second as u64),
            rate(self.agent_cycles_per_cpu_s),
            self.agent,
            self.workers,
            if self.workers == 1 { "" } else { "s" },
        )
    }
}

/// A rate with as many digits as tell it apart.
fn rate(per_second: f64) -> String {
    match per_second < 1e5 {
        true => grouped(per_second as u64),
        false => format!("{:.2} million", per_second / 1e6),
    }
}

fn line(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

/// What `summary.json` adds to the report.
#[derive(Debug, Serialize)]
pub(crate) struct SummaryFile<'a> {
    #[serde(flatten)]
    pub(crate) summary: &'a Summary,
    /// Metrics of every agent by itself,
    pub(crate) per_agent: Value,
    /// and of pairs of agents, in worlds that have any.
    #[serde(skip_serializing_if = "Value::is_null")]
    pub(crate) per_pair: Value,
}
