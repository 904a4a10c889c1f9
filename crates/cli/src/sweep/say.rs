//! What a sweep came to, in words and as JSON.

use super::journey::Folder;
use crate::console::{Console, aligned, duration, grouped, in_columns};
use crate::exit::{ExitCode, Failure};
use serde_json::json;
use sidestep::experiment::sweep::rounds::{Stopped, stopped};
use sidestep::experiment::sweep::{LeftOut, Outcome, Plan, RunTable, Shard, Summary};
use std::fmt::Write;
use std::time::Instant;

/// Failed runs that are named.
const NAMED: usize = 5;

/// What runs took in this process.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Effort {
    begun: Option<Instant>,
    wall_s: f64,
    /// Wall time of workers, and what of it was simulation.
    worked_s: f64,
    simulated_s: f64,
    runs: u64,
    at_once: usize,
}

impl Effort {
    /// From now on.
    pub(super) fn begin() -> Self {
        Self { begun: Some(Instant::now()), ..Self::default() }
    }

    /// A run is finished.
    pub(super) fn note(&mut self, outcome: &Outcome) {
        self.runs += 1;
        self.simulated_s += outcome.costs.get("run_wall_s").and_then(|v| v.as_f64()).unwrap_or(0.0);
    }

    /// All are, on so many workers at once.
    pub(super) fn end(&mut self, at_once: usize) {
        self.wall_s = self.begun.map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        self.worked_s = self.wall_s * at_once as f64;
        self.at_once = at_once;
    }

    /// With another stretch after it.
    pub(super) fn add(&mut self, later: Self) {
        self.wall_s += later.wall_s;
        self.worked_s += later.worked_s;
        self.simulated_s += later.simulated_s;
        self.runs += later.runs;
        self.at_once = self.at_once.max(later.at_once);
    }

    /// What a run took beyond its simulation: reading and compiling its scenario, storing its row,
    /// waiting for work at the end.
    fn overhead_ms(&self) -> f64 {
        1000.0 * (self.worked_s - self.simulated_s) / self.runs.max(1) as f64
    }

    fn words(&self) -> String {
        format!(
            "{} for {} runs, {} at once; {:.1} ms of simulation and {:.1} ms beside it each",
            duration(self.wall_s),
            grouped(self.runs),
            self.at_once,
            1000.0 * self.simulated_s / self.runs.max(1) as f64,
            self.overhead_ms(),
        )
    }

    fn json(&self) -> serde_json::Value {
        json!({
            "runs": self.runs,
            "at_once": self.at_once,
            "wall_s": self.wall_s,
            "simulation_s_per_run": self.simulated_s / self.runs.max(1) as f64,
            "overhead_ms_per_run": self.overhead_ms(),
        })
    }
}

/// Sums the runs up and prints it. Runs that failed are told, and end with exit code 1.
///
/// # Errors
/// When a metric that is to be reported does not exist.
pub(super) fn say(
    plan: &Plan,
    table: &RunTable,
    effort: Effort,
    folder: Option<&Folder>,
    console: Console,
) -> Result<ExitCode, Failure> {
    let summary = plan.summary(table)?;
    let stopped = stopped(plan, table);
    let failed = failures(plan, table, folder, console);
    let json = json!({
        "status": "complete",
        "name": plan.name,
        "world": plan.world,
        "parameters": plan.parameters,
        "first_seed": plan.first_seed,
        "runs": table.runs(),
        "failed": failed,
        "stopped": stopped,
        "took": (effort.runs > 0).then(|| effort.json()),
        "results": folder.map(Folder::results_file),
        "summary": summary,
    });
    console.result(&json, || text(plan, table, &summary, &stopped, effort, folder));
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}

fn text(
    plan: &Plan,
    table: &RunTable,
    summary: &Summary,
    stopped: &[Stopped],
    effort: Effort,
    folder: Option<&Folder>,
) -> String {
    let name = if plan.name.is_empty() { &plan.world } else { &plan.name };
    let mut text = format!(
        "# {name}: {} runs of {} variants, seeds from {} on\n",
        grouped(table.runs() as u64),
        grouped(plan.variants.len() as u64),
        plan.first_seed
    );
    for table in summary.brief() {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{}\n{}", table.title, in_columns(&table));
    }
    let mut lines = Vec::new();
    // Who names metrics knows that the others are not shown.
    if plan.metrics.is_empty()
        && let Some(words) = left_out(summary)
    {
        lines.push(("not shown".to_string(), words));
    }
    lines.extend(summary.notes.iter().map(|note| ("note".to_string(), note.clone())));
    for Stopped { variant, runs, reason } in stopped {
        let words =
            format!("{} after {runs} runs: {}", plan.variants[*variant as usize], reason.words());
        lines.push(("stopped".to_string(), words));
    }
    if effort.runs > 0 {
        lines.push(("time".to_string(), effort.words()));
    }
    if let Some(folder) = folder {
        lines.push(("results".to_string(), folder.results_file().display().to_string()));
        let report = format!("sidestep report {}", folder.path().display());
        lines.push(("look at it".to_string(), report));
    }
    format!("{text}\n{}", aligned(&lines))
}

/// Metrics that have no table, by the reason.
fn left_out(summary: &Summary) -> Option<String> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for LeftOut { metric, reason } in &summary.left_out {
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, metrics)) => metrics.push(metric),
            None => reasons.push((reason, vec![metric])),
        }
    }
    let words = |(reason, metrics): &(&str, Vec<&str>)| {
        let more = metrics.len().saturating_sub(NAMED);
        let first = metrics[..metrics.len() - more].join(", ");
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{first}{more} ({reason})")
    };
    let all: Vec<String> = reasons.iter().map(words).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Tells the first runs that failed, and how to run them again; their number.
fn failures(plan: &Plan, table: &RunTable, folder: Option<&Folder>, console: Console) -> usize {
    let Some(column) = table.column("failure") else { return 0 };
    let cell = table.column("cell");
    let cell_of = |row: usize| {
        let id = cell.and_then(|c| c.values.number(row)).map(|id| id as u64);
        id.and_then(|id| plan.cell_of(id))
    };
    let rows = (0..table.runs()).filter(|&row| !column.values.text(row).is_empty());
    let failed: Vec<usize> = rows.collect();
    for &row in failed.iter().take(NAMED) {
        let Some(cell) = cell_of(row) else { continue };
        let again = folder.map_or_else(String::new, |folder| {
            let scenario = folder.scenario(cell.variant);
            format!("\n  again: sidestep run {} --seed {}", scenario.display(), cell.seed)
        });
        let variant = &plan.variants[cell.variant as usize];
        let why = column.values.text(row);
        console.warn(format!("a run failed: {variant}, seed {}: {why}{again}", cell.seed));
    }
    if failed.len() > NAMED {
        console.warn(format!("{} more runs failed", failed.len() - NAMED));
    }
    failed.len()
}

/// Says that a share is done.
pub(super) fn say_share(
    table: &RunTable,
    shard: Shard,
    effort: Effort,
    folder: &Folder,
    console: Console,
) -> Result<ExitCode, Failure> {
    let failed = failures(folder.plan(), table, Some(folder), console);
    let json = json!({
        "share": shard.to_string(),
        "runs": table.runs(),
        "failed": failed,
        "took": (effort.runs > 0).then(|| effort.json()),
    });
    console.result(&json, || {
        let time = (effort.runs > 0).then(|| ("time".to_string(), effort.words()));
        let time: Vec<_> = time.into_iter().collect();
        let runs = grouped(table.runs() as u64);
        format!("Share {shard} is finished: {runs} runs\n{}", aligned(&time))
    });
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}
