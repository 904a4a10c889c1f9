//! `sidestep replay`: a recorded run computed again, to its end or up to any cycle.

use crate::console::{Console, group_thousands};
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::scenario_args::WorkersArg;
use crate::worlds;
use clap::Args;
use serde_json::json;
use sidestep::kernel::Cycle;
use sidestep_session::{RecordedRun, ReplayReport, replay_all, replay_to};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep replay runs/office           run it again and compare the digests
  sidestep replay office.mcap           the same, from a recording for viewers
  sidestep replay runs/office --cycle 1234
  sidestep replay runs/office --cycle 1234 --png moment.png
  sidestep replay runs/office --cycle 1234 --json | jq '.bodies[0]'

Without --cycle the whole run is computed again from the recorded scenario, and the digest of \
its last state and all rows of its tables are compared with the recorded ones. With --cycle the state is computed from the \
last checkpoint before the cycle, or from the start, and compared with the recorded poses of \
that cycle. If they differ, the exit code is 1.";

/// Compute a recorded run again, and compare it with the recording.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReplayArgs {
    /// Run folder, or MCAP file
    #[arg(value_name = "DIR|FILE")]
    recorded: PathBuf,

    /// Show the state at the start of this cycle [default: verify the whole run]
    #[arg(long, value_name = "N")]
    cycle: Option<Cycle>,

    #[command(flatten)]
    workers: WorkersArg,

    /// Print the state of all bodies, not only of the first
    #[arg(long, requires = "cycle")]
    all: bool,

    /// Draw the state to this PNG file
    #[arg(long, value_name = "OUT")]
    png: Option<PathBuf>,
}

/// # Errors
/// When the folder or the cycle is wrong, or the state differs from the recorded one.
pub(crate) fn replay(args: &ReplayArgs, console: Console) -> Result<ExitCode, Failure> {
    let recorded = RecordedRun::open(worlds(), &args.recorded)?;
    let workers = args.workers.count();
    let watch = ConsoleWatcher::new(console);
    interrupt::listen()?;
    let report = match args.cycle {
        Some(cycle) => replay_to(&recorded, cycle, workers, &watch),
        None => replay_all(&recorded, workers, &watch),
    };
    let mut report = match report {
        Err(Failure::Interrupted) => return Ok(ExitCode::Interrupted),
        other => other?,
    };
    if let Some(png) = &args.png {
        report.draw(&recorded, png)?;
    }
    match args.cycle {
        Some(_) => print_cycle(&report, args.all, console)?,
        None => print_end(&report, recorded.is_complete, console)?,
    }
    Ok(ExitCode::Done)
}

fn print_end(report: &ReplayReport, is_complete: bool, console: Console) -> Result<(), Failure> {
    let ReplayReport { run, effort, compared_rows, .. } = report;
    let digest = run.digest().to_string();
    let json = json!({
        "cycle": run.cycle(),
        "digest": digest,
        "confirmed": true,
        "complete": is_complete,
        "compared_rows": compared_rows,
        "wall_s": effort.wall.as_secs_f64(),
    });
    console.print_result_or_short(&json, &format!("{digest}\n"), || {
        let cycles = group_thousands(run.cycle());
        let rows = match compared_rows {
            0 => String::new(),
            rows => format!(" and the {} recorded rows", group_thousands(*rows)),
        };
        format!("Confirmed: {cycles} cycles give the recorded digest{rows}\n  digest {digest}\n")
    })
}

/// Lines of a state that are printed without `--all`: a heading, and some bodies.
const MAX_STATE_LINES: usize = 11;

/// Returns the first lines of a state, and the option that shows the others.
fn first_lines(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    match lines.len().saturating_sub(MAX_STATE_LINES) {
        // A single further line takes no more room than the line that would count it.
        0 | 1 => text.into(),
        more => format!(
            "{}\n  and {} more rows: --all\n",
            lines[..MAX_STATE_LINES].join("\n"),
            group_thousands(more as u64)
        ),
    }
}

fn print_cycle(report: &ReplayReport, shows_all: bool, console: Console) -> Result<(), Failure> {
    let ReplayReport { run, compared_poses, .. } = report;
    let poses = run.poses();
    let digest = run.digest().to_string();
    let json = json!({
        "cycle": run.cycle(),
        "digest": digest,
        "compared_poses": compared_poses,
        "bodies": poses.json,
    });
    console.print_result_or_short(&json, &format!("{digest}\n"), || {
        let compared = match *compared_poses {
            0 => "no pose of this cycle is recorded".into(),
            n => format!("equal to the {} recorded poses", group_thousands(n as u64)),
        };
        let state = if shows_all { poses.text } else { first_lines(&poses.text) };
        format!("Cycle {}: {compared}\n{state}  digest {digest}\n", group_thousands(run.cycle()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_state_is_cut_after_its_first_rows_and_the_others_are_counted() {
        let text = |rows: usize| (0..rows).map(|k| format!("  row {k}\n")).collect::<String>();
        assert_eq!(first_lines(&text(12)), text(12));
        assert_eq!(first_lines(&text(93)), text(11) + "  and 82 more rows: --all\n");
    }
}
