//! The summary of a run as text.

use crate::console::{aligned, duration, grouped};
use sidestep::kernel::words::line;
use sidestep::kernel::world::Decides;
use sidestep_session::{Phases, Status, Summary};

/// Returns the summary as text for people.
pub(crate) fn text(summary: &Summary) -> String {
    let mut lines = vec![
        line(&format!("{}s", summary.agent), grouped(summary.agents as u64)),
        line("cycles", cycles_words(summary)),
    ];
    lines.extend(summary.outcome.iter().cloned());
    lines.extend(summary.file_lines.iter().cloned());
    if summary.cycles_timed > 0 {
        lines.push(line("speed", speed(summary)));
        lines.push(line("time", phases_words(&summary.phases_s)));
    }
    lines.push(line("digest", summary.digest.clone()));
    lines.extend(summary.folder.as_ref().map(|f| line("results", f.display().to_string())));
    lines.extend(summary.mcap.as_ref().map(|f| line("viewers", f.display().to_string())));
    format!("{}\n{}", heading(summary), aligned(&lines))
}

fn heading(summary: &Summary) -> String {
    let name = if summary.name.is_empty() { summary.world } else { &summary.name };
    format!("{name}, seed {}", summary.seed)
}

fn cycles_words(summary: &Summary) -> String {
    let done = grouped(summary.cycles);
    match summary.status {
        Status::Complete => done,
        Status::Incomplete => {
            format!("{done} of {}: INCOMPLETE", grouped(summary.cycles_planned))
        }
    }
}

fn speed(summary: &Summary) -> String {
    let per_second = summary.cycles_timed as f64 / summary.wall_s.max(1e-9);
    format!(
        "{} for {} cycles ({}/s); {} {}-cycles per CPU second on {} worker{}",
        duration(summary.wall_s),
        grouped(summary.cycles_timed),
        grouped(per_second as u64),
        rate(summary.agent_cycles_per_cpu_s),
        summary.agent,
        summary.workers,
        if summary.workers == 1 { "" } else { "s" },
    )
}

/// Returns the share of time of every phase, as text.
fn phases_words(phases_s: &Phases) -> String {
    let [first, last] = match phases_s.decides {
        Decides::Alone => ["perceive, decide and claim", "act"],
        Decides::Together => ["perceive and claim", "decide and act"],
    };
    let phases = [
        (first, phases_s.claim),
        ("join", phases_s.join),
        (last, phases_s.act),
        ("record", phases_s.record),
    ];
    let all: f64 = phases.iter().map(|(_, s)| s).sum();
    let share = |(name, s): &(&str, f64)| format!("{name} {:.0} %", 100.0 * s / all.max(1e-12));
    phases.iter().map(share).collect::<Vec<_>>().join(", ")
}

/// Formats a rate with as many digits as it needs.
fn rate(per_second: f64) -> String {
    match per_second < 1e5 {
        true => grouped(per_second as u64),
        false => format!("{:.2} million", per_second / 1e6),
    }
}
