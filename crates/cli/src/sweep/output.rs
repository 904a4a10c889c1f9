//! The results of a sweep, as text and as JSON.

use crate::console::{
    Console, LINE_COLS, align_pairs, format_columns, format_duration, group_thousands, wrap_text,
};
use crate::exit::{ExitCode, Failure};
use crate::progress::StageBar;
use crate::worlds;
use serde_json::json;
use sidestep::experiment::sweep::rounds::{VariantStop, variant_stops};
use sidestep::experiment::sweep::{OmittedMetric, Plan, RunTable, Shard, Summary};
use sidestep::kernel::shell::sidestep_command;
use sidestep_session::display_path;
use sidestep_session::sweep::{self, Folder, SweepEnd, SweepResult, SweepTiming};

/// Largest number of failed runs, or of metrics without a table, that are listed: many have the same cause.
const MAX_LISTED_FAILURES: usize = 5;

fn timing_text(effort: &SweepTiming) -> String {
    format!(
        "{} for {}, {} at once; {:.1} ms of simulation and {:.1} ms of overhead per run",
        format_duration(effort.wall_s),
        format_count(effort.runs as usize, "run"),
        effort.at_once,
        1000.0 * effort.simulation_s_per_run(),
        effort.overhead_ms_per_run(),
    )
}

/// A sweep and the console that it is reported to.
#[derive(Clone, Copy)]
pub(crate) struct SweepOutput<'a> {
    pub(crate) plan: &'a Plan,
    /// The sweep's folder, if it has one.
    pub(crate) folder: Option<&'a Folder>,
    pub(crate) console: Console,
}

/// Summarizes the runs and prints the results; `done_note` is printed if all runs were finished before.
/// Failed runs are listed, and make the exit code 1.
///
/// # Errors
/// When a metric that is to be reported does not exist, or the results cannot be written.
pub(crate) fn print_results(
    output: SweepOutput<'_>,
    end: SweepEnd,
    done_note: &str,
) -> Result<ExitCode, Failure> {
    let SweepOutput { plan, folder, console } = output;
    let done = match end {
        SweepEnd::Done(done) => done,
        SweepEnd::Interrupted(runs) => return print_interrupted(output, runs),
    };
    if done.was_done {
        console.note(done_note);
    }
    let table = &done.table;
    let stages = StageBar::new(console);
    let summary =
        plan.summary_with_progress(worlds(), table, &mut |share| stages.set("intervals", share));
    stages.clear();
    let summary = summary?;
    let failed = print_failures(output, table);
    let json = done.to_json(plan, folder, &summary);
    let short = match folder {
        Some(folder) => format!("{}\n", folder.results_file().display()),
        None => tables(&summary),
    };
    console.print_result_or_short(&json, &short, || {
        text(output, table, &summary, &variant_stops(plan, table), done.effort)
    })?;
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}

/// Prints how many runs of an interrupted sweep are finished.
fn print_interrupted(output: SweepOutput<'_>, finished: usize) -> Result<ExitCode, Failure> {
    let SweepOutput { plan, folder, console } = output;
    let path = folder.map(Folder::path);
    match path {
        None => console.note("Interrupted; nothing is kept without --out DIR."),
        Some(path) => {
            let all = plan.runs();
            let of = if plan.until.is_some() { String::new() } else { format!(" of {all}") };
            console.note(format!(
                "{finished}{of} runs are finished; `{}` continues.",
                sidestep_command("resume", path)
            ));
        }
    }
    let json =
        json!({ "status": "interrupted", "runs": finished, "folder": path.map(display_path) });
    console.print_result(&json, String::new)?;
    Ok(ExitCode::Interrupted)
}

fn tables(summary: &Summary) -> String {
    let mut texts = Vec::new();
    for table in &summary.brief() {
        let title = wrap_text(&table.title, LINE_COLS).join("\n");
        texts.push(format!("{title}\n{}", format_columns(table)));
    }
    texts.join("\n")
}

fn text(
    SweepOutput { plan, folder, .. }: SweepOutput<'_>,
    table: &RunTable,
    summary: &Summary,
    stopped: &[VariantStop],
    effort: SweepTiming,
) -> String {
    let name = if plan.name.is_empty() { &plan.world } else { &plan.name };
    let text = format!(
        "# {name}: {} of {}, seeds from {} on\n\n{}",
        format_count(table.runs(), "run"),
        format_count(plan.variants.len(), "variant"),
        plan.first_seed,
        tables(summary)
    );
    let mut lines = Vec::new();
    // Metrics that the user did not ask for need no remark.
    if plan.metrics.is_empty()
        && let Some(omitted) = omitted_metrics_text(summary)
    {
        lines.push(("not shown".to_string(), omitted));
    }
    lines.extend(summary.notes.iter().map(|note| ("note".to_string(), note.clone())));
    for VariantStop { variant, runs, reason } in stopped {
        let stop = format!(
            "{} after {runs} runs: {}",
            plan.variants[*variant as usize],
            reason.describe()
        );
        lines.push(("stopped".to_string(), stop));
    }
    if effort.runs > 0 {
        lines.push(("time".to_string(), timing_text(&effort)));
    }
    if let Some(folder) = folder {
        lines.push(("results".to_string(), folder.results_file().display().to_string()));
        let report = sidestep_command("report", folder.path());
        lines.push(("look at it".to_string(), report));
    }
    format!("{text}\n{}", align_pairs(&lines))
}

/// Returns a number of things: `1 run`, `2 000 runs`.
pub(super) fn format_count(n: usize, what: &str) -> String {
    format!("{} {what}{}", group_thousands(n as u64), if n == 1 { "" } else { "s" })
}

/// Returns which metrics have no table, and why.
fn omitted_metrics_text(summary: &Summary) -> Option<String> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for OmittedMetric { metric, reason } in &summary.left_out {
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, metrics)) => metrics.push(metric),
            None => reasons.push((reason, vec![metric])),
        }
    }
    let texts: Vec<String> =
        reasons.iter().map(|(reason, metrics)| omitted_text(reason, metrics)).collect();
    (!texts.is_empty()).then(|| texts.join("; "))
}

fn omitted_text(reason: &str, metrics: &[&str]) -> String {
    let unlisted = metrics.len().saturating_sub(MAX_LISTED_FAILURES);
    let first = metrics[..metrics.len() - unlisted].join(", ");
    let more = if unlisted > 0 { format!(" and {unlisted} more") } else { String::new() };
    format!("{first}{more} ({reason})")
}

/// Prints the first failed runs and how to run them again, and returns the number of all.
fn print_failures(output: SweepOutput<'_>, table: &RunTable) -> usize {
    let SweepOutput { plan, folder, console } = output;
    let failed: Vec<usize> = sweep::failed_rows(table).collect();
    for &row in failed.iter().take(MAX_LISTED_FAILURES) {
        let id = table.column("cell").and_then(|ids| ids.values.number(row));
        let Some(trial) = id.and_then(|id| plan.trial_of(id as u64)) else { continue };
        let again = folder.map_or_else(String::new, |folder| {
            let run = sidestep_command("run", folder.scenario(trial.variant));
            format!("\n  again: `{run} --seed {}`", trial.seed)
        });
        let variant = &plan.variants[trial.variant as usize];
        let cause = table.column("failure").map_or_else(String::new, |c| c.values.text(row));
        console.warn(format!("a run failed: {variant}, seed {}: {cause}{again}", trial.seed));
    }
    if failed.len() > MAX_LISTED_FAILURES {
        console.warn(format!("{} more runs failed", failed.len() - MAX_LISTED_FAILURES));
    }
    failed.len()
}

/// Prints that a share is done, or how many of its runs are finished so far.
///
/// # Errors
/// When that cannot be written.
pub(crate) fn print_share(
    output: SweepOutput<'_>,
    shard: Shard,
    end: SweepEnd,
) -> Result<ExitCode, Failure> {
    let console = output.console;
    let SweepResult { table, effort, was_done, .. } = match end {
        SweepEnd::Done(done) => done,
        SweepEnd::Interrupted(runs) => return print_interrupted(output, runs),
    };
    if was_done {
        console.note(format!("Share {shard} is finished already."));
    }
    let failed = print_failures(output, &table);
    let json = json!({
        "share": shard.to_string(),
        "runs": table.runs(),
        "failed": failed,
        "took": (effort.runs > 0).then(|| effort.to_json()),
    });
    console.print_result_or_short(&json, "", || {
        let time = (effort.runs > 0).then(|| ("time".to_string(), timing_text(&effort)));
        let time: Vec<_> = time.into_iter().collect();
        let runs = group_thousands(table.runs() as u64);
        format!("Share {shard} is finished: {runs} runs\n{}", align_pairs(&time))
    })?;
    Ok(if failed == 0 { ExitCode::Done } else { ExitCode::Failed })
}
