//! `sidestep reproduce loria`.

use super::{EXAMPLES, PaperResults, check_vacant, scene_picture, store_and_print};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::progress::StageBar;
use clap::Args;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep_document::document::Picture;
use sidestep_draw::{DrawError, TrailChoice, describe};
use sidestep_papers::Scene;
use sidestep_papers::loria::scenes;
use sidestep_papers::loria::{
    LoriaConfig, LoriaError, LoriaReport, NewRecorder, in_memory, run_recorded,
};
use sidestep_record::{ParquetRecorder, Provenance};
use std::path::{Path, PathBuf};

/// The extent of the experiments.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct LoriaArgs {
    /// Output folder (new or empty) for report.html, report.md, report.json and the figures
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Quick run: everything once; the numbers are not precise
    #[arg(long)]
    quick: bool,

    /// Number of seeds per variant
    #[arg(long, value_name = "N")]
    seeds: Option<usize>,

    /// Number of cycles of each run that measures behavior
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,

    /// Largest number of worker threads; behavior does not depend on it [default: all processors]
    #[arg(long, value_name = "W")]
    workers: Option<usize>,
}

impl LoriaArgs {
    fn plan(&self) -> LoriaConfig {
        let default = if self.quick { LoriaConfig::quick() } else { LoriaConfig::default() };
        LoriaConfig {
            seeds: self.seeds.unwrap_or(default.seeds),
            cycles: self.cycles.unwrap_or(default.cycles),
            workers: self.workers.unwrap_or(default.workers),
            most_workers: self.workers.unwrap_or(default.most_workers),
            ..default
        }
    }
}

pub(super) fn reproduce(args: &LoriaArgs, console: Console) -> Result<ExitCode, Failure> {
    let report = match &args.out {
        None => run(&args.plan(), &mut in_memory, console)?,
        Some(folder) => {
            check_vacant(folder)?;
            run_with_recordings(&args.plan(), folder, console)?
        }
    };
    let scenes = scenes::all(&report.plan);
    let pictures: Vec<Picture> = scenes.iter().map(described_picture).collect::<Result<_, _>>()?;
    store_and_print(
        &report,
        &PaperResults {
            document: report.document(pictures),
            claims: &report.claims,
            quick: report.plan.quick,
        },
        args.out.as_deref(),
        console,
    )
}

/// Returns a picture with a caption that starts with a description of the scene.
fn described_picture(scene: &Scene) -> Result<Picture, DrawError> {
    let description =
        describe(&scene.scenery, &scene.frame, &scene.trails, &TrailChoice::default());
    let picture = scene_picture(scene)?;
    Ok(Picture { caption: format!("{description} {}", picture.caption), ..picture })
}

fn run(
    plan: &LoriaConfig,
    recorders: &mut NewRecorder<'_>,
    console: Console,
) -> Result<LoriaReport, Failure> {
    let stages = StageBar::new(console);
    let report = run_recorded(plan, recorders, &mut |what, share| stages.set(what, share));
    stages.clear();
    report.map_err(|e| match e {
        LoriaError::Plan(e) => Failure::Input(e),
        LoriaError::Record(e) => Failure::Record(e),
    })
}

/// Runs the experiments with recordings on disk, as the paper did, because writing is a part of the measured time. They are
/// deleted at the end; after a failure also the folder, if it was created for them.
fn run_with_recordings(
    plan: &LoriaConfig,
    folder: &Path,
    console: Console,
) -> Result<LoriaReport, Failure> {
    let timed = folder.join("timed-runs");
    let had_folder = folder.exists();
    std::fs::create_dir_all(&timed).map_err(|e| Failure::cannot_write(&timed, &e))?;
    let recordings = TimedRecordings {
        folder: timed,
        created_folder: (!had_folder).then(|| folder.to_path_buf()),
    };
    let interrupted = recordings.clone();
    interrupt::on_interrupt(move || interrupted.remove(true))?;
    let mut count = 0;
    let report = run(
        plan,
        &mut |schemas: &[TableSchema]| {
            count += 1;
            recorder(&recordings.folder.join(format!("{count:04}")), schemas)
        },
        console,
    );
    recordings.remove(report.is_err());
    report
}

/// Recordings that are written only because writing is timed.
#[derive(Clone)]
struct TimedRecordings {
    folder: PathBuf,
    /// The folder of the results, if it was created for this run.
    created_folder: Option<PathBuf>,
}

impl TimedRecordings {
    /// Deletes the recordings; after a failure also the folder that was created, which is empty then.
    fn remove(&self, has_failed: bool) {
        // Leftovers harm nothing, and the error of the run matters more.
        let _ = std::fs::remove_dir_all(&self.folder);
        if let Some(folder) = self.created_folder.as_deref().filter(|_| has_failed) {
            let _ = std::fs::remove_dir(folder);
        }
    }
}

fn recorder(folder: &Path, schemas: &[TableSchema]) -> Result<Box<dyn Recorder>, RecordError> {
    std::fs::create_dir(folder).map_err(|e| RecordError::new(folder.display(), e))?;
    let origin = Provenance {
        program_version: env!("CARGO_PKG_VERSION").into(),
        scenario: "a timed run of `sidestep reproduce loria`".into(),
        seed: 1,
    };
    Ok(Box::new(ParquetRecorder::create(folder, schemas, &origin)?))
}
