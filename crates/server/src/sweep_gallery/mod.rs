//! The runs of a sweep as a folder of pages: variants x seeds with their metrics, and replays of some runs or of all.
//!
//! ```text
//! mod.rs     runs -> pages, many at once     choice.rs  which runs get a replay
//! index.rs   the page that opens them
//! ```

mod choice;
mod index;

pub use choice::RunChoice;

use crate::replay_page::{InspectionRequest, ReplaySpec, TrialReplay, check_has_page, render};
use sidestep_experiment::sweep::outliers::{OUTLIER_RULE, Outlier, outliers};
use sidestep_experiment::sweep::scheduler::run_trials;
use sidestep_experiment::sweep::{Role, RunTable, Summary, Trial};
use sidestep_kernel::InputError;
use sidestep_report::gallery_page;
use sidestep_scenario::Worlds;
use sidestep_session::export::{ExportPlace, ExportScope, FrameSource};
use sidestep_session::sweep::{FinishedRuns, Folder, read_finished, runs_at_once};
use sidestep_session::{
    Error, NestedWatcher, Progress, ProgressGuard, RecordedRun, RunEnd, Watcher, write_atomically,
};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The page that opens the others.
const INDEX: &str = "index.html";
/// Longer side of the pictures of runs in pixels: twice the size at which a page shows them.
const PICTURE_PX: u32 = 560;

/// A requested gallery.
pub struct GalleryRequest<'a> {
    /// The place, the number of workers and that of cycles between frames; runs are there from start to end.
    pub scope: ExportScope<'a>,
    /// The inspections that replays hold.
    pub inspections: InspectionRequest,
    /// The runs that get a replay.
    pub runs: RunChoice,
}

/// What was written, and what is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GalleryResult {
    /// The page that opens the others.
    pub index: PathBuf,
    /// What is in it.
    pub content: GalleryContent,
}

/// What a gallery holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GalleryContent {
    /// Number of finished runs.
    pub runs: usize,
    /// Number of runs that are outliers in some metric.
    pub outliers: usize,
    /// Number of replays; all end with the digest that the sweep has.
    pub replays: usize,
    /// Number of inspections in them.
    pub inspections: usize,
    /// Number of events that are in none of them, because there were too many.
    pub events_left_out: u64,
    /// Size of all pages.
    pub bytes: u64,
}

/// Stores a file of a gallery under its name.
pub type FileStore<'a> = dyn FnMut(&str, &[u8]) -> Result<(), Error> + Send + 'a;

/// Exports the runs of a sweep as a folder of pages.
///
/// # Errors
/// When no run is finished, the program has no page, the place is taken, or a run differs from that of the sweep;
/// [`Error::Interrupted`] when the watcher asked to stop. Nothing is left then.
pub fn export_gallery(
    worlds: &Worlds,
    folder: &Folder,
    request: &GalleryRequest<'_>,
    watcher: &dyn Watcher,
) -> Result<GalleryResult, Error> {
    let place = ExportPlace::check(folder.path(), &request.scope, "-gallery")?;
    let content = place.write(watcher, |partial| {
        write_gallery(
            worlds,
            folder,
            request,
            &mut |name, bytes| {
                let path = partial.join(name);
                let parent = path.parent().unwrap_or(partial);
                std::fs::create_dir_all(parent).map_err(|e| Error::cannot_write(parent, &e))?;
                write_atomically(&path, |file| file.write_all(bytes))
            },
            watcher,
        )
    })?;
    Ok(GalleryResult { index: place.path().join(INDEX), content })
}

/// Makes the pages of a gallery, and hands each to `store`: replays in no order, then the page that opens them.
///
/// # Errors
/// Those of [`export_gallery`] but for the place.
pub fn write_gallery(
    worlds: &Worlds,
    folder: &Folder,
    request: &GalleryRequest<'_>,
    store: &mut FileStore<'_>,
    watcher: &dyn Watcher,
) -> Result<GalleryContent, Error> {
    check_has_page()?;
    let sweep = FinishedSweep::read(worlds, folder)?;
    let chosen = request.runs.choose(&sweep.runs);
    if chosen.is_empty() {
        return Err(no_run(folder, request.runs).into());
    }
    let mut content = GalleryContent {
        runs: sweep.runs.len(),
        outliers: sweep.runs.iter().filter(|run| run.distance > 0.0).count(),
        ..GalleryContent::default()
    };
    let context = ReplayContext { worlds, folder, sweep: &sweep, request, watcher };
    let mut replays = context.write_replays(&chosen, &mut content, store)?;
    if content.inspections == 0 {
        request.inspections.refuse_without_any()?;
    }
    replays.sort_by_key(|replay| replay.run);
    let index = gallery_page(&index::gallery(&sweep, folder, &replays));
    content.bytes += index.len() as u64;
    store(INDEX, index.as_bytes())?;
    Ok(content)
}

/// The finished runs of a sweep, and what is far from the others in them.
struct FinishedSweep {
    table: RunTable,
    is_complete: bool,
    summary: Summary,
    /// The names of all variants of the plan.
    names: Vec<String>,
    runs: Vec<FinishedRun>,
    /// The outliers of each row.
    outliers: BTreeMap<usize, Vec<Outlier>>,
}

/// A finished run.
struct FinishedRun {
    /// Its row in the table.
    row: usize,
    trial: Trial,
    /// Its end; none if it failed.
    end: Option<RunEnd>,
    /// How far its farthest metric is from the runs of its variant, in interquartile ranges; 0 if it is no outlier.
    distance: f64,
}

/// A replay that was written.
struct WrittenReplay {
    /// The index of its run.
    run: usize,
    page: String,
    picture: Option<Vec<u8>>,
}

impl FinishedSweep {
    fn read(worlds: &Worlds, folder: &Folder) -> Result<Self, InputError> {
        let FinishedRuns { table, is_complete, .. } = read_finished(folder)?;
        let plan = folder.plan();
        let summary = plan.summary(worlds, &table)?;
        let metrics: Vec<&str> =
            summary.metrics.iter().map(|metric| metric.name.as_str()).collect();
        let mut by_row: BTreeMap<usize, Vec<Outlier>> = BTreeMap::new();
        for outlier in outliers(&table, &metrics) {
            by_row.entry(outlier.row).or_default().push(outlier);
        }
        let mut runs = Vec::with_capacity(table.runs());
        for row in 0..table.runs() {
            let id = number(&table, Role::Trial, row);
            let Some(trial) = id.and_then(|id| plan.trial_of(id)) else { continue };
            let of_run = by_row.get(&row).into_iter().flatten();
            let distance = of_run.map(|outlier| outlier.distance_ranges).fold(0.0, f64::max);
            runs.push(FinishedRun { row, trial, end: run_end(&table, row), distance });
        }
        let names = plan.names();
        Ok(Self { table, is_complete, summary, names, runs, outliers: by_row })
    }

    /// Returns the variant of a run; empty if there is only one.
    fn variant_name(&self, run: &FinishedRun) -> &str {
        let name = self.names.get(run.trial.variant as usize).map_or("", String::as_str);
        if self.names.len() > 1 { name } else { "" }
    }
}

fn number(table: &RunTable, role: Role, row: usize) -> Option<u64> {
    let number = table.columns_with_role(role).next()?.values.number(row)?;
    Some(number as u64)
}

/// Returns the end of the run in a row; none if it failed.
fn run_end(table: &RunTable, row: usize) -> Option<RunEnd> {
    let digest = table.columns_with_role(Role::Digest).next()?.values.text(row);
    let cycles = table.column("cycles_run")?.values.number(row)? as u64;
    (!digest.is_empty()).then_some(RunEnd { cycles, digest })
}

/// What all replays are made with.
#[derive(Clone, Copy)]
struct ReplayContext<'a> {
    worlds: &'a Worlds,
    folder: &'a Folder,
    sweep: &'a FinishedSweep,
    request: &'a GalleryRequest<'a>,
    watcher: &'a dyn Watcher,
}

/// A replay that is not stored yet.
struct MadeReplay {
    run: usize,
    document: String,
    picture: Option<Vec<u8>>,
    inspections: usize,
    events_left_out: u64,
}

impl ReplayContext<'_> {
    /// Makes the replays of the chosen runs, many at once, and stores each as soon as it is made.
    fn write_replays(
        &self,
        chosen: &[usize],
        content: &mut GalleryContent,
        store: &mut FileStore<'_>,
    ) -> Result<Vec<WrittenReplay>, Error> {
        let workers = self.request.scope.workers;
        let at_once = runs_at_once(self.folder.plan().agents, workers, chosen.len());
        let each = (workers / at_once).max(1);
        let watched = ProgressGuard(self.watcher);
        let of = chosen.len() as u64;
        watched.report(Progress::Runs { before: 0, done: 0, of });
        let mut written = Vec::with_capacity(chosen.len());
        let mut accept = |replay: MadeReplay| {
            let page = format!("runs/{}.html", page_name(&self.sweep.runs[replay.run]));
            store(&page, replay.document.as_bytes())?;
            content.replays += 1;
            content.inspections += replay.inspections;
            content.events_left_out += replay.events_left_out;
            content.bytes += replay.document.len() as u64;
            written.push(WrittenReplay { run: replay.run, page, picture: replay.picture });
            watched.report(Progress::Runs { before: 0, done: written.len() as u64, of });
            Ok(())
        };
        run_trials(chosen, at_once, |run| self.make_replay(*run, each), &mut accept)?;
        if written.len() < chosen.len() {
            return Err(Error::Interrupted);
        }
        Ok(written)
    }

    /// Computes a run again, up to its end, which has to be that of the sweep; none if it was interrupted.
    fn make_replay(&self, index: usize, workers: usize) -> Option<Result<MadeReplay, Error>> {
        if !self.watcher.should_continue() {
            return None;
        }
        match self.replay(index, workers) {
            Err(Error::Interrupted | Error::InterruptedInCycle(_)) => None,
            result => Some(result),
        }
    }

    fn replay(&self, index: usize, workers: usize) -> Result<MadeReplay, Error> {
        let run = &self.sweep.runs[index];
        let end = run.end.clone().ok_or_else(|| no_run(self.folder, self.request.runs))?;
        let recorded = RecordedRun::from_sweep(self.worlds, self.folder, run.trial, end)?;
        let scope = ExportScope { workers, ..self.request.scope.clone() };
        let watcher = NestedWatcher(self.watcher);
        let source = FrameSource::check(&recorded, &scope, &watcher)?;
        let name = page_name(run);
        let spec = ReplaySpec {
            every: scope.every,
            inspections: &self.request.inspections,
            trial: Some(TrialReplay {
                name: &name,
                variant: self.sweep.variant_name(run),
                picture_px: PICTURE_PX,
            }),
        };
        let page = render(self.worlds, &spec, &[source])?;
        Ok(MadeReplay {
            run: index,
            document: page.document,
            picture: page.picture,
            inspections: page.content.inspections,
            events_left_out: page.content.events_left_out,
        })
    }
}

/// Returns the name of the page of a run, that of its folder where a sweep records runs.
fn page_name(run: &FinishedRun) -> String {
    format!("{:06}", run.trial.id)
}

/// The error of a choice that no run fits.
fn no_run(folder: &Folder, choice: RunChoice) -> InputError {
    let place = folder.path().display();
    match choice {
        RunChoice::Outliers => {
            let cause = format!("no run is an outlier. {OUTLIER_RULE}");
            InputError::new(place, cause, "give `--runs all`, or a number of runs")
        }
        _ => InputError::new(place, "all finished runs failed", "see `sidestep report` for why"),
    }
}

/// Returns the folder of a sweep at a path; none if there is none.
///
/// # Errors
/// When it is damaged.
pub fn find_sweep(path: &Path) -> Result<Option<Folder>, InputError> {
    if Folder::is_at(path) { Folder::open(path).map(Some) } else { Ok(None) }
}
