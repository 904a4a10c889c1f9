//! The progress of a sweep that other processes run, as text and as JSON.

use super::output::format_count;
use crate::console::{Console, align_pairs, format_duration, group_thousands};
use crate::exit::Failure;
use serde_json::json;
use sidestep::kernel::shell::sidestep_command;
use sidestep_session::display_path;
use sidestep_session::sweep::{Folder, ShareStatus, SweepStatus};

/// Largest number of failed runs that are listed: many have the same cause.
const MAX_LISTED_FAILURES: usize = 5;

/// Prints the progress of a sweep.
///
/// # Errors
/// When that cannot be written.
pub(crate) fn print_status(
    folder: &Folder,
    status: &SweepStatus,
    console: Console,
) -> Result<(), Failure> {
    let plan = folder.plan();
    let mut json =
        json!({ "folder": display_path(folder.path()), "name": plan.name, "world": plan.world });
    if let (Some(all), serde_json::Value::Object(fields)) = (json.as_object_mut(), status.to_json())
    {
        all.extend(fields);
    }
    let of = if status.until_precise && !status.is_complete { "of at most" } else { "of" };
    let short = format!("{} {of} {}\n", status.runs, status.total);
    console.print_result_or_short(&json, &short, || {
        let name = if plan.name.is_empty() { &plan.world } else { &plan.name };
        let runs = group_thousands(status.runs);
        let all = format_count(status.total as usize, "run");
        format!("# {name}: {runs} {of} {all}\n\n{}", align_pairs(&lines(folder, status)))
    })
}

fn lines(folder: &Folder, status: &SweepStatus) -> Vec<(String, String)> {
    let command = |command| sidestep_command(command, folder.path());
    let mut lines: Vec<(String, String)> = Vec::new();
    for share in &status.shares {
        lines.push(line(&format!("share {}", share.share), share_text(share)));
    }
    if let Some(rate) = status.runs_per_s.filter(|_| !status.is_complete) {
        lines.push(line("rate", format!("{rate:.3} runs per second recently")));
    }
    if let Some(eta_s) = status.eta_s.filter(|_| !status.is_complete) {
        lines.push(line("time left", format_duration(eta_s)));
    }
    lines.push(line("failed", group_thousands(status.failed as u64)));
    for failure in status.failures.iter().take(MAX_LISTED_FAILURES) {
        let text = format!("{}, seed {}: {}", failure.variant, failure.seed, failure.why);
        lines.push(line("", text));
    }
    if status.is_complete {
        lines.push(line("view it", command("report")));
    } else if status.is_active {
        // No advice: a second process would run the same trials again.
    } else if status.runs == status.total {
        lines.push(line("join them", command("sweep collect")));
    } else {
        lines.push(line("continue", command("resume")));
    }
    lines
}

fn line(name: &str, value: String) -> (String, String) {
    (name.to_string(), value)
}

fn share_text(share: &ShareStatus) -> String {
    let runs = format!("{} of {}", group_thousands(share.runs), group_thousands(share.of));
    match share.idle_s {
        _ if share.is_done => format!("{runs}, done"),
        Some(idle_s) => format!("{runs}, the last {} ago", format_duration(idle_s)),
        None => runs,
    }
}
