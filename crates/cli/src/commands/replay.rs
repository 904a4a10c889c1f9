//! `sidestep replay`: the state of a recorded run at any cycle, recomputed.

use super::resume::scenario_place;
use crate::console::{Console, grouped};
use crate::driver::drive;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::picture::{origin, write_png};
use crate::plan::WorkersArg;
use crate::recording::restore;
use crate::worlds::{Comparison, Compiled, Pictured, Run};
use clap::Args;
use serde_json::json;
use sidestep::kernel::checkpoint::decode_header;
use sidestep::kernel::{Cycle, InputError};
use sidestep::scenario::Source;
use sidestep_record::{ResumePoint, RunView};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep replay runs/office --cycle 1234
  sidestep replay runs/office --cycle 1234 --png moment.png
  sidestep replay runs/office --cycle 1234 --json | jq '.bodies[0]'

The state is recomputed from the last checkpoint before the cycle, else from the start, and
compared with the recorded poses of that cycle; a difference ends with exit code 1.";

/// Recompute a recorded run up to a cycle and show where everybody is.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReplayArgs {
    /// The run folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// Show the state at the beginning of this cycle
    #[arg(long, value_name = "N")]
    cycle: Cycle,

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
    let view = RunView::open(&args.folder)?;
    let source = Source::new(scenario_place(&args.folder), &*view.scenario, &args.folder);
    let mut run = Compiled::new(&source)?.start(&source, args.workers.count());
    check_version(&view)?;
    check_cycle(args.cycle, run.plan().cycles)?;
    start_near(run.as_mut(), &args.folder, args.cycle)?;
    interrupt::listen()?;
    drive(run.as_mut(), args.cycle, None, console)?;
    if run.cycle() < args.cycle {
        return Ok(ExitCode::Interrupted);
    }
    show(run.as_ref(), args, console)
}

/// Results may change between versions, so only the writer's own can be replayed.
fn check_version(view: &RunView) -> Result<(), InputError> {
    let (wrote, reads) = (&view.manifest.program_version, env!("CARGO_PKG_VERSION"));
    if wrote == reads {
        return Ok(());
    }
    let cause = format!("the run is of sidestep {wrote}, this is {reads}");
    let remedy = format!("replay it with sidestep {wrote}, or run its scenario again");
    Err(InputError::new(view.path.display(), cause, remedy))
}

fn check_cycle(cycle: Cycle, planned: Cycle) -> Result<(), InputError> {
    if cycle <= planned {
        return Ok(());
    }
    let cause = format!("the run has {planned} cycles");
    Err(InputError::new(format!("--cycle {cycle}"), cause, format!("give 0 to {planned}")))
}

/// Begins at the checkpoint, if it lies before the cycle.
fn start_near(run: &mut dyn Run, folder: &Path, cycle: Cycle) -> Result<(), InputError> {
    let Ok(bytes) = std::fs::read(folder.join("checkpoint.bin")) else { return Ok(()) };
    let is_near = decode_header(&bytes).is_ok_and(|header| header.cycle <= cycle);
    if is_near { restore(run, &ResumePoint::Checkpoint(bytes), folder) } else { Ok(()) }
}

fn show(run: &dyn Run, args: &ReplayArgs, console: Console) -> Result<ExitCode, Failure> {
    let compared = compare(run, &args.folder)?;
    if let Some(png) = &args.png {
        let origin = origin(run);
        let svg = run.picture(Pictured { folder: Some(&args.folder), origin: &origin })?;
        write_png(png, &svg)?;
    }
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
    Ok(ExitCode::Done)
}

/// Number of recorded poses that were compared.
fn compare(run: &dyn Run, folder: &Path) -> Result<usize, Failure> {
    match run.compare(folder)? {
        Comparison::NotRecorded => Ok(0),
        Comparison::Equal(poses) => Ok(poses),
        Comparison::Different(bodies) => {
            let cause = format!(
                "at cycle {} the poses of {} bodies differ from what was recorded, first of body {}",
                run.cycle(),
                bodies.len(),
                bodies[0],
            );
            let remedy =
                "the folder was changed, or this is a bug: please report it with the folder";
            Err(Failure::stopped(cause, remedy))
        }
    }
}
