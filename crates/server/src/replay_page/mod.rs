//! A recorded run as one file that any browser opens without a server: the studio's page, with all that it would ask for.
//!
//! ```text
//! collector.rs  frames, events, samples, inspections     chunk.rs, plane.rs  frames as few bytes
//! agents.rs     which agents are inspected               extent.rs           how exact places have to be
//! parts.rs      deflated and as base64                   html.rs, start.js   the document
//! ```
//! The other side is `studio/src/replay/`: a socket without a server, which answers the page's requests from the parts.

mod agents;
mod chunk;
mod collector;
mod extent;
mod html;
mod parts;
mod plane;
#[cfg(test)]
mod tests;

pub use agents::{AgentNumber, CycleWindow, InspectionRequest};

use crate::page;
use crate::protocol::{ReplayFile, VERSION};
use collector::{ReplayCollector, ReplayOrigin};
use sidestep_kernel::text::group_thousands;
use sidestep_kernel::view::FrameOptions;
use sidestep_kernel::{Cycle, InputError};
use sidestep_scenario::Worlds;
use sidestep_session::export::{ExportResult, ExportScope, FrameExport};
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
}

/// The file that was written, and what is in it.
pub struct PageResult {
    /// The file.
    pub written: ExportResult,
    /// Number of frames.
    pub frames: u64,
    /// Number of cycles between two frames.
    pub every: Cycle,
    /// Number of inspections.
    pub inspections: usize,
    /// Number of events that are not in it, because there were too many.
    pub events_left_out: u64,
}

/// Exports a recorded run as one page that needs no server.
///
/// # Errors
/// When the program has no page, the part or the place is wrong, the result cannot be stored, or the run differs from the
/// recorded one; [`Error::Interrupted`] when the watcher asked to stop.
pub fn export_page(
    worlds: &Worlds,
    recorded: &RecordedRun,
    request: &PageRequest<'_>,
    watcher: &dyn Watcher,
) -> Result<PageResult, Error> {
    let files = page::entry_files().ok_or_else(no_page)?;
    let export = FrameExport::check(recorded, &request.scope, ".html", watcher)?;
    let content = collect(worlds, recorded, request, &export)?;
    let document = html::document(&content.title, &files, &content.parts);
    let written = export.write(document.as_bytes(), content.is_confirmed)?;
    let ReplayContent { frames, every, inspections, events_left_out, .. } = content;
    Ok(PageResult { written, frames, every, inspections, events_left_out })
}

/// All of a replay but the page.
struct ReplayContent {
    title: String,
    parts: String,
    is_confirmed: bool,
    frames: u64,
    every: Cycle,
    inspections: usize,
    events_left_out: u64,
}

/// Computes the run again, and collects what the page will ask for.
fn collect(
    worlds: &Worlds,
    recorded: &RecordedRun,
    request: &PageRequest<'_>,
    export: &FrameExport<'_>,
) -> Result<ReplayContent, Error> {
    let (from, until) = export.cycles();
    let cycles = until - from;
    let every = request.scope.every.unwrap_or_else(|| cycles.div_ceil(MAX_FRAMES).max(1));
    let mut run = export.start()?;
    request.inspections.check(&run.frame(FrameOptions::WITHOUT_SCANS), (from, until))?;
    let world_type = worlds.find(run.world_name());
    let infos = world_type.map_or(&[][..], |world_type| world_type.metric_infos());
    let mut collector =
        ReplayCollector::new(run.as_mut(), cycles, every, &request.inspections, infos);
    let is_confirmed = export.drive(run.as_mut(), &mut collector)?;
    let last = run.cycle();
    let is_end = last == recorded.cycles_done;
    let origin = ReplayOrigin {
        name: name_of(&recorded.path),
        scenario: recorded.resolved_scenario()?.text,
        banner: banner((from, last), every, is_confirmed),
        digest: is_end.then(|| run.digest().to_string()),
    };
    let replay = collector.finish(run.as_mut(), origin)?;
    let frames = collector.frame_count();
    let inspections = collector.inspection_count();
    let events_left_out = replay.events_left_out;
    let title = title(&replay.scene.name, &replay.name);
    let program = format!("sidestep {}", worlds.build());
    let file = ReplayFile { version: VERSION, program, runs: vec![replay] };
    let parts = collector.parts.into_text(&file)?;
    Ok(ReplayContent { title, parts, is_confirmed, frames, every, inspections, events_left_out })
}

/// Returns the name of a recording, without its folder.
fn name_of(path: &Path) -> String {
    // `.` has no name of its own.
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let stem = if whole.is_file() { whole.file_stem() } else { whole.file_name() };
    stem.unwrap_or_default().to_string_lossy().into_owned()
}

fn title(scenario: &str, recording: &str) -> String {
    let name = if scenario.is_empty() { recording } else { scenario };
    format!("{name} · Sidestep replay")
}

/// Returns what people should know of the replay as a whole.
fn banner((from, until): (Cycle, Cycle), every: Cycle, is_confirmed: bool) -> String {
    let cycles = format!("cycles {} to {}", group_thousands(from), group_thousands(until));
    let frames = match every {
        1 => "every cycle is here".to_string(),
        _ => format!("every {}th cycle is here", group_thousands(every)),
    };
    let end = if is_confirmed { "; its end has the recorded digest" } else { "" };
    format!("A recorded run, {cycles}: {frames}, nothing is computed{end}.")
}

/// The error of a program that was built without the page.
fn no_page() -> Error {
    let cause = "this program was built without the studio's page";
    let remedy = "build it with Node 20.19 or later: `SIDESTEP_PAGE=require cargo build --release`";
    InputError::new("--to page", cause, remedy).into()
}

/// The error of something that JSON cannot hold, which is a bug.
fn unwritable(error: &serde_json::Error) -> Error {
    Error::other(format!("a part of the replay cannot be written: {error}"), "please report it")
}
