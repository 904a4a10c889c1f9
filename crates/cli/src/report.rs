//! The summary of a run as text.

use crate::console::{align_pairs, format_duration, group_thousands};
use sidestep::kernel::text::key_value_pair;
use sidestep::kernel::world::DecisionMode;
use sidestep_session::{Phases, RunStatus, Summary};

pub(crate) fn summary_text(summary: &Summary) -> String {
    let mut lines = vec![
        key_value_pair(&format!("{}s", summary.agent), group_thousands(summary.agents as u64)),
        key_value_pair("cycles", cycles_text(summary)),
    ];
    lines.extend(summary.outcome.iter().cloned());
    lines.extend(summary.file_lines.iter().cloned());
    if summary.cycles_timed > 0 {
        lines.push(key_value_pair("speed", speed(summary)));
        lines.push(key_value_pair("time", phases_text(&summary.phases_s)));
    }
    lines.push(key_value_pair("digest", summary.digest.clone()));
    lines.extend(
        summary.folder.as_ref().map(|f| key_value_pair("results", f.display().to_string())),
    );
    lines.extend(summary.mcap.as_ref().map(|f| key_value_pair("viewers", f.display().to_string())));
    format!("{}\n{}", heading(summary), align_pairs(&lines))
}

fn heading(summary: &Summary) -> String {
    let name = if summary.name.is_empty() { summary.world } else { &summary.name };
    format!("{name}, seed {}", summary.seed)
}

fn cycles_text(summary: &Summary) -> String {
    let done = group_thousands(summary.cycles);
    match summary.status {
        RunStatus::Complete => match &summary.end_reason {
            Some(reason) => {
                format!("{done} of {}, ended by {reason}", group_thousands(summary.cycles_planned))
            }
            None => done,
        },
        RunStatus::Incomplete => {
            format!("{done} of {}: INCOMPLETE", group_thousands(summary.cycles_planned))
        }
    }
}

fn speed(summary: &Summary) -> String {
    let per_second = summary.cycles_timed as f64 / summary.wall_s.max(1e-9);
    format!(
        "{} for {} cycles ({}/s); {} {}-cycles per CPU second on {} worker{}",
        format_duration(summary.wall_s),
        group_thousands(summary.cycles_timed),
        group_thousands(per_second as u64),
        format_rate(summary.agent_cycles_per_cpu_s),
        summary.agent,
        summary.workers,
        if summary.workers == 1 { "" } else { "s" },
    )
}

/// Returns the share of time of every phase, as text.
fn phases_text(phases_s: &Phases) -> String {
    let [first, last] = match phases_s.decides {
        DecisionMode::Independent => ["perceive, decide and claim", "act"],
        DecisionMode::Joint => ["perceive and claim", "decide and act"],
    };
    let phases = [
        (first, phases_s.claim),
        ("join", phases_s.join),
        (last, phases_s.act),
        ("record", phases_s.record),
    ];
    let all: f64 = phases.iter().map(|(_, s)| s).sum();
    // A run of no cycles takes no time.
    let all = all.max(1e-12);
    let shares = phases.map(|(name, s)| format!("{name} {:.0} %", 100.0 * s / all));
    shares.join(", ")
}

/// Formats a rate: whole below 100 000, above it in millions with two decimals.
fn format_rate(per_second: f64) -> String {
    if per_second < 1e5 {
        return group_thousands(per_second as u64);
    }
    format!("{:.2} million", per_second / 1e6)
}
