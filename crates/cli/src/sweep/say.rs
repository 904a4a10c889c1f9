//! The results of a sweep, as text and as JSON.

use crate::console::{Console, LINE_COLS, aligned, duration, grouped, in_columns, wrapped};
use crate::exit::{ExitCode, Failure};
use crate::progress::Stages;
use serde_json::json;
use sidestep::experiment::sweep::rounds::{Stopped, stopped};
use sidestep::experiment::sweep::{LeftOut, Plan, RunTable, Shard, Summary};
use sidestep_document::Table;
use sidestep_session::shown;
use sidestep_session::sweep::{self, Done, Effort, Ended, Folder};

/// Largest number of failed runs that are listed.
const NAMED: usize = 5;

fn time_words(effort: &Effort) -> String {
    format!(
        "{} for {}, {} at once; {:.1} ms of simulation and {:.1} ms beside it each",
        duration(effort.wall_s),
        counted(effort.runs as usize, "run"),
        effort.at_once,
        1000.0 * effort.simulation_s_per_run(),
        effort.overhead_ms_per_run(),
    )
}

/// A sweep and the console that it is reported to.
#[derive(Clone, Copy)]
pub(crate) struct Told<'a> {
    pub(crate) plan: &'a Plan,
    /// The sweep's folder, if it has one.
    pub(crate) folder: Option<&'a Folder>,
    pub(crate) console: Console,
}

/// Summarizes the runs and prints the results; `already` mentions runs that were finished before.
/// Failed runs are listed, and make the exit code 1.
///
/// # Errors
/// When a metric that is to be reported does not exist, or the results cannot be written.
pub(crate) fn tell(told: Told<'_>, ended: Ended, already: &str) -> Result<ExitCode, Failure> {
    let Told { plan, folder, console } = told;
    let done = match ended {
        Ended::Done(done) => done,
        Ended::Interrupted(runs) => return interrupted(told, runs),
    };
    if done.was_done {
        console.note(already);
    }
    let table = &done.table;
    let stages = Stages::new(console);
    let summary = plan.summary_watched(table, &mut |share| stages.at("intervals", share));
    stages.clear();
    let summary = summary?;
    let failed = failures(told, table);
    let json = done.told(plan, folder, &summary);
    let short = || match folder {
        Some(folder) => format!("{}\n", folder.results_file().display()),
        None => tables(&summary),
    };
    console.result_or_short(&json, short, || {
        text(told, table, &summary, &stopped(plan, table), done.effort)
    })?;
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}

/// Prints how many runs of an interrupted sweep are finished.
fn interrupted(told: Told<'_>, finished: usize) -> Result<ExitCode, Failure> {
    let Told { plan, folder, console } = told;
    let path = folder.map(Folder::path);
    match path.map(shown) {
        None => console.note("Interrupted; nothing is kept without --out DIR."),
        Some(path) => {
            let all = plan.runs();
            let of = if plan.until.is_some() { String::new() } else { format!(" of {all}") };
            console.note(format!(
                "{finished}{of} runs are finished; `sidestep resume {path}` goes on."
            ));
        }
    }
    let json = json!({ "status": "interrupted", "runs": finished, "folder": path.map(shown) });
    console.result(&json, String::new)?;
    Ok(ExitCode::Interrupted)
}

/// Returns the tables of all metrics.
fn tables(summary: &Summary) -> String {
    let text = |table: &Table| {
        let title = wrapped(&table.title, LINE_COLS).join("\n");
        format!("{title}\n{}", in_columns(table))
    };
    summary.brief().iter().map(text).collect::<Vec<_>>().join("\n")
}

fn text(
    Told { plan, folder, .. }: Told<'_>,
    table: &RunTable,
    summary: &Summary,
    stopped: &[Stopped],
    effort: Effort,
) -> String {
    let name = if plan.name.is_empty() { &plan.world } else { &plan.name };
    let text = format!(
        "# {name}: {} of {}, seeds from {} on\n\n{}",
        counted(table.runs(), "run"),
        counted(plan.variants.len(), "variant"),
        plan.first_seed,
        tables(summary)
    );
    let mut lines = Vec::new();
    // Metrics that the user did not ask for need no remark.
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
        lines.push(("time".to_string(), time_words(&effort)));
    }
    if let Some(folder) = folder {
        lines.push(("results".to_string(), folder.results_file().display().to_string()));
        let report = format!("sidestep report {}", folder.path().display());
        lines.push(("look at it".to_string(), report));
    }
    format!("{text}\n{}", aligned(&lines))
}

/// Returns a number of things: `1 run`, `2 000 runs`.
pub(super) fn counted(n: usize, what: &str) -> String {
    format!("{} {what}{}", grouped(n as u64), if n == 1 { "" } else { "s" })
}

/// Returns which metrics have no table, and why.
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

/// Prints the first failed runs and how to run them again, and returns the number of all.
fn failures(told: Told<'_>, table: &RunTable) -> usize {
    let Told { plan, folder, console } = told;
    let cell = table.column("cell");
    let cell_of = |row: usize| {
        let id = cell.and_then(|c| c.values.number(row)).map(|id| id as u64);
        id.and_then(|id| plan.cell_of(id))
    };
    let failed: Vec<usize> = sweep::failed(table).collect();
    for &row in failed.iter().take(NAMED) {
        let Some(cell) = cell_of(row) else { continue };
        let again = folder.map_or_else(String::new, |folder| {
            let scenario = folder.scenario(cell.variant);
            format!("\n  again: sidestep run {} --seed {}", scenario.display(), cell.seed)
        });
        let variant = &plan.variants[cell.variant as usize];
        let why = table.column("failure").map_or_else(String::new, |c| c.values.text(row));
        console.warn(format!("a run failed: {variant}, seed {}: {why}{again}", cell.seed));
    }
    if failed.len() > NAMED {
        console.warn(format!("{} more runs failed", failed.len() - NAMED));
    }
    failed.len()
}

/// Prints that a share is done, or how many of its runs are finished.
///
/// # Errors
/// When that cannot be written.
pub(crate) fn tell_share(told: Told<'_>, shard: Shard, ended: Ended) -> Result<ExitCode, Failure> {
    let console = told.console;
    let Done { table, effort, was_done } = match ended {
        Ended::Done(done) => done,
        Ended::Interrupted(runs) => return interrupted(told, runs),
    };
    if was_done {
        console.note(format!("Share {shard} is finished already."));
    }
    let failed = failures(told, &table);
    let json = json!({
        "share": shard.to_string(),
        "runs": table.runs(),
        "failed": failed,
        "took": (effort.runs > 0).then(|| effort.told()),
    });
    console.result_or_short(&json, String::new, || {
        let time = (effort.runs > 0).then(|| ("time".to_string(), time_words(&effort)));
        let time: Vec<_> = time.into_iter().collect();
        let runs = grouped(table.runs() as u64);
        format!("Share {shard} is finished: {runs} runs\n{}", aligned(&time))
    })?;
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}
