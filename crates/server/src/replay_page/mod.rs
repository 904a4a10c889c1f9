//! A recorded run as one file that any browser opens without a server: the studio's page, with all that it would ask
//! for.
//!
//! ```text
//! collector.rs  frames, events, metrics, inspections     chunk.rs, plane.rs  frames as few bytes
//! agents.rs     which agents are inspected               extent.rs           how exact places have to be
//! agent_rows.rs metrics of each agent over time
//! parts.rs      deflated and as base64                   html.rs, start.js   the document
//! tables.rs     body tables as few bytes
//! ```
//! The other side is `studio/src/replay/`: a socket without a server, which answers the page's requests from the parts.

mod agent_rows;
mod agents;
mod chunk;
mod collector;
mod extent;
mod html;
mod parts;
mod plane;
mod tables;
#[cfg(test)]
mod tests;

pub use agents::InspectionRequest;

use crate::metric_history::{MetricHistory, MetricWords};
use crate::page;
use crate::protocol::{ReplayFile, ReplayRun, VERSION};
use agent_rows::AgentRows;
use collector::{ReplayCollector, ReplayOptions, ReplayOrigin};
use parts::Parts;
use sidestep_kernel::text::group_thousands;
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Cycle, InputError};
use sidestep_scenario::Worlds;
use sidestep_session::export::{ExportFile, ExportResult, ExportScope, FrameSource};
use sidestep_session::{Error, RecordedRun, Watcher};
use std::path::Path;

/// Maximum number of frames, unless more are requested: every cycle of most runs, and a file of some megabytes.
const MAX_FRAMES: Cycle = 20_000;

/// A requested replay: its part of the run, and what of the agents it tells.
pub struct PageRequest<'a> {
    /// The part of the run, and the place of the file.
    pub scope: ExportScope<'a>,
    /// The inspections that the file holds.
    pub inspections: InspectionRequest,
    /// Another recorded run, which is shown beside it.
    pub beside: Option<&'a RecordedRun>,
}

/// The file that was written, and what is in it.
pub struct PageResult {
    /// The file.
    pub written: ExportResult,
    /// What is in it.
    pub content: PageContent,
}

/// What a replay holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageContent {
    /// Number of frames.
    pub frames: u64,
    /// Number of cycles between two frames.
    pub every: Cycle,
    /// Number of inspections.
    pub inspections: usize,
    /// Number of events that are not in it, because there were too many.
    pub events_left_out: u64,
    /// Whether the ends of all runs have the recorded digests.
    pub is_confirmed: bool,
}

/// Exports a recorded run as one page that needs no server.
///
/// # Errors
/// When the program has no page, the part or the place is wrong, the result cannot be stored, or the run differs from
/// the recorded one; [`Error::Interrupted`] when the watcher asked to stop.
pub fn export_page(
    worlds: &Worlds,
    recorded: &RecordedRun,
    request: &PageRequest<'_>,
    watcher: &dyn Watcher,
) -> Result<PageResult, Error> {
    check_has_page()?;
    let mut sources = vec![FrameSource::check(recorded, &request.scope, watcher)?];
    let file = ExportFile::check(&sources[0], ".html")?;
    if let Some(other) = request.beside {
        sources.push(FrameSource::check(other, &request.scope, watcher)?);
    }
    let ReplayPage { document, content, .. } = render(worlds, &request.spec(), &sources)?;
    let written = file.write(document.as_bytes(), content.is_confirmed)?;
    Ok(PageResult { written, content })
}

/// Returns the page of a recorded run, which the caller stores.
///
/// # Errors
/// Those of [`export_page`] but for the place.
pub fn page_document(
    worlds: &Worlds,
    recorded: &RecordedRun,
    request: &PageRequest<'_>,
    watcher: &dyn Watcher,
) -> Result<(String, PageContent), Error> {
    check_has_page()?;
    let source = FrameSource::check(recorded, &request.scope, watcher)?;
    let page = render(worlds, &request.spec(), &[source])?;
    Ok((page.document, page.content))
}

impl PageRequest<'_> {
    fn spec(&self) -> ReplaySpec<'_> {
        let Self { scope, inspections, .. } = self;
        ReplaySpec { every: scope.every, inspections, trial: None }
    }
}

/// What a replay is to hold.
pub(crate) struct ReplaySpec<'a> {
    /// Number of cycles between two frames; none for the default.
    pub(crate) every: Option<Cycle>,
    pub(crate) inspections: &'a InspectionRequest,
    /// What it is of a sweep; none for a run of its own.
    pub(crate) trial: Option<TrialReplay<'a>>,
}

/// What is different in a replay of a run of a sweep.
#[derive(Clone, Copy)]
pub(crate) struct TrialReplay<'a> {
    /// Its number in the sweep, as the name of a recording.
    pub(crate) name: &'a str,
    /// Its variant; empty if the sweep has only one.
    pub(crate) variant: &'a str,
    /// Longer side of its picture in pixels.
    pub(crate) picture_px: u32,
}

/// A replay: its document, and what is in it.
pub(crate) struct ReplayPage {
    pub(crate) document: String,
    pub(crate) content: PageContent,
    /// The picture of a run of a sweep, as PNG.
    pub(crate) picture: Option<Vec<u8>>,
}

/// Refuses a program that has no page.
pub(crate) fn check_has_page() -> Result<(), InputError> {
    page::entry_files().map(drop).ok_or_else(no_page)
}

/// Computes some runs again, and returns the page with what it will ask for.
pub(crate) fn render(
    worlds: &Worlds,
    spec: &ReplaySpec<'_>,
    sources: &[FrameSource<'_>],
) -> Result<ReplayPage, Error> {
    let files = page::entry_files().ok_or_else(no_page)?;
    let ReplayContent { title, parts, content, picture } = collect(worlds, spec, sources)?;
    Ok(ReplayPage { document: html::document(&title, &files, &parts), content, picture })
}

/// All of a replay but the page.
struct ReplayContent {
    title: String,
    parts: String,
    content: PageContent,
    picture: Option<Vec<u8>>,
}

/// Computes some runs again, and collects what the page will ask for.
fn collect(
    worlds: &Worlds,
    spec: &ReplaySpec<'_>,
    sources: &[FrameSource<'_>],
) -> Result<ReplayContent, Error> {
    let length = |source: &FrameSource<'_>| {
        let (from, until) = source.cycles();
        until - from
    };
    let longest = sources.iter().map(length).max().unwrap_or(0);
    let every = spec.every.unwrap_or_else(|| longest.div_ceil(MAX_FRAMES).max(1));
    let has_digests = sources.len() > 1;
    let options =
        ReplayOptions { every, has_digests, inspections: spec.inspections, trial: spec.trial };
    let mut parts = Parts::default();
    let mut runs = Vec::with_capacity(sources.len());
    let mut content =
        PageContent { frames: 0, every, inspections: 0, events_left_out: 0, is_confirmed: true };
    let mut picture = None;
    for source in sources {
        let replay = collect_run(worlds, source, &options, &mut parts)?;
        content.is_confirmed &= replay.is_confirmed;
        content.frames +=
            replay.run.chunks.iter().map(|chunk| u64::from(chunk.frames)).sum::<u64>();
        content.inspections += replay.inspections;
        content.events_left_out += replay.run.events_left_out;
        picture = replay.picture;
        runs.push(replay.run);
    }
    distinguish(&mut runs);
    let names: Vec<String> =
        runs.iter().map(|run| titled_name(run, spec.trial.is_some())).collect();
    let title = format!("{} · Sidestep replay", names.join(", "));
    let program = format!("sidestep {}", worlds.build());
    let file = ReplayFile { version: VERSION, program, runs };
    Ok(ReplayContent { title, parts: parts.into_text(&file)?, content, picture })
}

/// A run of a replay, and what the command tells of it.
struct CollectedRun {
    run: ReplayRun,
    is_confirmed: bool,
    inspections: usize,
    picture: Option<Vec<u8>>,
}

fn collect_run(
    worlds: &Worlds,
    source: &FrameSource<'_>,
    options: &ReplayOptions<'_>,
    parts: &mut Parts,
) -> Result<CollectedRun, Error> {
    let recorded = source.recorded();
    let (from, until) = source.cycles();
    let mut run = source.start()?;
    // Runs of a sweep may have fewer agents and cycles than others of it; the sweep is refused where none has them.
    if options.trial.is_none() {
        let first = run.frame(FrameOptions::WITHOUT_SCANS);
        options.inspections.check(&run.scenery(), &first, (from, until))?;
    }
    let world_type = worlds.find(run.world_name());
    let words = world_type.map(MetricWords::from_world).unwrap_or_default();
    // A recording that can only be shown has no metrics but those recorded.
    let recorded_series = if recorded.is_flight { recorded.series()? } else { None };
    let metrics = MetricHistory::from_run(run.as_mut(), until, recorded_series, words);
    let agents = AgentRows::new(words);
    let mut collector = ReplayCollector::new(run.as_mut(), metrics, agents, options, parts);
    let is_confirmed = source.drive(run.as_mut(), &mut collector)?;
    let last = run.cycle();
    let is_end = last == recorded.cycles_done;
    let origin = ReplayOrigin {
        name: options.trial.map_or_else(|| name_of(&recorded.path), |trial| trial.name.into()),
        scenario: recorded.resolved_scenario()?.text,
        banner: banner((from, last), options.every, is_confirmed),
        digest: is_end.then(|| run.digest().to_string()),
    };
    let picture = collector.picture(run.as_mut())?;
    let mut replay = collector.finish(run.as_mut(), origin)?;
    if let Some(trial) = options.trial {
        replay.scene.name = named_trial(&replay.scene.name, trial.variant);
    }
    Ok(CollectedRun {
        run: replay,
        is_confirmed,
        inspections: collector.inspection_count(),
        picture,
    })
}

/// Returns the name of a scenario with that of a variant of it.
fn named_trial(scenario: &str, variant: &str) -> String {
    match (scenario, variant) {
        (name, "") | ("", name) => name.to_string(),
        (scenario, variant) => format!("{scenario} ({variant})"),
    }
}

/// Returns the name of a run in the title of a page, with the seed that tells a run of a sweep from others.
fn titled_name(run: &ReplayRun, is_trial: bool) -> String {
    let name = displayed_name(run);
    if is_trial { format!("{name}, seed {}", run.status.seed) } else { name.to_string() }
}

/// Adds the names of the recordings to those of the scenarios, where these are the same.
fn distinguish(runs: &mut [ReplayRun]) {
    let is_same =
        runs.len() > 1 && runs.windows(2).all(|pair| pair[0].scene.name == pair[1].scene.name);
    for run in runs.iter_mut().filter(|_| is_same) {
        run.scene.name = format!("{} ({})", run.scene.name, run.name);
    }
}

/// Returns the name of the scenario, or that of the recording where it has none.
fn displayed_name(run: &ReplayRun) -> &str {
    if run.scene.name.is_empty() { &run.name } else { &run.scene.name }
}

/// Returns the name of a recording, without its folder.
fn name_of(path: &Path) -> String {
    // `.` has no name of its own.
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let stem = if whole.is_file() { whole.file_stem() } else { whole.file_name() };
    stem.unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns what people should know of the replay as a whole.
fn banner((from, until): (Cycle, Cycle), every: Cycle, is_confirmed: bool) -> String {
    let cycles = format!("cycles {} to {}", group_thousands(from), group_thousands(until));
    let frames = match every {
        1 => "every cycle is here".to_string(),
        _ => format!("one of {} cycles is here", group_thousands(every)),
    };
    let end = if is_confirmed { "; its end has the recorded digest" } else { "" };
    format!("A recorded run, {cycles}: {frames}, nothing is computed{end}.")
}

/// The error of a program that was built without the page.
fn no_page() -> InputError {
    let cause = "this program was built without the studio's page";
    let remedy = "build it with Node 20.19 or later: `SIDESTEP_PAGE=require cargo build --release`";
    InputError::new("--to page", cause, remedy)
}

/// The error of something that JSON cannot hold, which is a bug.
fn unwritable(error: &serde_json::Error) -> Error {
    Error::other(format!("a part of the replay cannot be written: {error}"), "please report it")
}
