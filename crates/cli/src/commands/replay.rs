//! `sidestep replay`: a recorded run computed again, to its end or up to any cycle.

use crate::compare::compare;
use crate::console::{Console, grouped};
use crate::driver::{Sinks, drive};
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::picture::{origin, svg, write_png};
use crate::plan::WorkersArg;
use crate::rerun::Recorded;
use clap::Args;
use serde_json::json;
use sidestep::kernel::Simulation;
use sidestep::kernel::{Cycle, InputError};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep replay runs/office                       run it again and compare the digests
  sidestep replay office.mcap                       the same, from a recording for viewers
  sidestep replay runs/office --cycle 1234
  sidestep replay runs/office --cycle 1234 --png moment.png
  sidestep replay runs/office --cycle 1234 --json | jq '.bodies[0]'

Without --cycle the whole run is computed again from the recorded scenario, and the digest of
its last state compared with the recorded one. With --cycle the state is computed from the
last checkpoint before the cycle, else from the start, and compared with the recorded poses of
that cycle. A difference ends with exit code 1.";

/// Compute a recorded run again, and compare it with what was recorded.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReplayArgs {
    /// The run folder, or an MCAP file
    #[arg(value_name = "DIR|FILE")]
    recorded: PathBuf,

    /// Show the state at the beginning of this cycle [default: confirm the whole run]
    #[arg(long, value_name = "N")]
    cycle: Option<Cycle>,

    #[command(flatten)]
    workers: WorkersArg,

    /// Draw the state to this PNG file
    #[arg(long, value_name = "OUT")]
    png: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the folder or the cycle is wrong, or the state differs from what was recorded.
pub(crate) fn replay(args: &ReplayArgs, console: Console) -> Result<ExitCode, Failure> {
    let recorded = Recorded::open(&args.recorded)?;
    match args.cycle {
        Some(cycle) => replay_to(&recorded, cycle, args, console),
        None => replay_all(&recorded, args, console),
    }
}

/// Computes the whole run again.
fn replay_all(
    recorded: &Recorded,
    args: &ReplayArgs,
    console: Console,
) -> Result<ExitCode, Failure> {
    if recorded.digest.is_none() {
        let remedy = "end it with `sidestep resume DIR`, or give a --cycle";
        let cause = "the run is not complete: no digest of it is recorded";
        return Err(InputError::new(recorded.path.display(), cause, remedy).into());
    }
    let mut run = recorded.start(args.workers.count())?;
    interrupt::listen()?;
    let effort = drive(run.as_mut(), recorded.cycles_done, Sinks::default(), console)?;
    if interrupt::requested() && run.cycle() < recorded.cycles_done {
        return Ok(ExitCode::Interrupted);
    }
    if run.cycle() != recorded.cycles_done {
        let cause = format!(
            "the run is over after {} cycles, recorded are {}",
            run.cycle(),
            recorded.cycles_done
        );
        let remedy = "the recording was changed, or this is a bug: please report it";
        return Err(Failure::stopped(cause, remedy));
    }
    recorded.confirm(run.as_ref())?;
    draw(run.as_mut(), recorded, args)?;
    let digest = run.digest().to_string();
    let json = json!({
        "cycle": run.cycle(),
        "digest": digest,
        "confirmed": true,
        "complete": recorded.is_complete,
        "wall_s": effort.wall.as_secs_f64(),
    });
    let short = || format!("{digest}\n");
    console.result_or_short(&json, short, || {
        let cycles = grouped(run.cycle());
        format!("Confirmed: {cycles} cycles come to the recorded digest\n  digest {digest}\n")
    });
    Ok(ExitCode::Done)
}

/// Computes the state at a cycle.
fn replay_to(
    recorded: &Recorded,
    cycle: Cycle,
    args: &ReplayArgs,
    console: Console,
) -> Result<ExitCode, Failure> {
    let mut run = recorded.start_near(cycle, args.workers.count())?;
    check_cycle(cycle, run.plan().cycles)?;
    interrupt::listen()?;
    drive(run.as_mut(), cycle, Sinks::default(), console)?;
    if run.cycle() < cycle {
        return Ok(ExitCode::Interrupted);
    }
    let compared = match &recorded.folder {
        Some(folder) => {
            let again = recorded.start(args.workers.count())?;
            compare(run.as_ref(), again, folder)?
        }
        None => 0,
    };
    draw(run.as_mut(), recorded, args)?;
    show(run.as_ref(), compared, console);
    Ok(ExitCode::Done)
}

fn check_cycle(cycle: Cycle, planned: Cycle) -> Result<(), InputError> {
    if cycle <= planned {
        return Ok(());
    }
    let cause = format!("the run has {planned} cycles");
    Err(InputError::new(format!("--cycle {cycle}"), cause, format!("give 0 to {planned}")))
}

fn draw(run: &mut dyn Simulation, recorded: &Recorded, args: &ReplayArgs) -> Result<(), Failure> {
    let Some(png) = &args.png else { return Ok(()) };
    let origin = origin(run);
    let svg = svg(run, recorded.folder.as_deref(), &origin)?;
    write_png(png, &svg)
}

fn show(run: &dyn Simulation, compared: usize, console: Console) {
    let poses = run.poses();
    let digest = run.digest().to_string();
    let json = json!({
        "cycle": run.cycle(),
        "digest": digest,
        "compared_poses": compared,
        "bodies": poses.json,
    });
    let short = || format!("{digest}\n");
    console.result_or_short(&json, short, || {
        let compared = match compared {
            0 => "no pose of this cycle is recorded".into(),
            n => format!("equal to the {} recorded poses", grouped(n as u64)),
        };
        format!("Cycle {}: {compared}\n{}  digest {digest}\n", grouped(run.cycle()), poses.text)
    });
}
