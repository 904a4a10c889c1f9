//! The server's messages: replies, and notices without a request.

use super::{BodyTable, BodyTrail, Fleet, RunEvent, Scene, SessionId, Speed};
use serde::Serialize;
use sidestep_kernel::view::Inspection;
use sidestep_scenario::Editing;

/// The reply to a request.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Reply {
    /// The request's number; 0 for a request that could not be read.
    pub id: u32,
    /// The answer, or the reason why there is none.
    #[serde(flatten)]
    pub result: ReplyResult,
}

/// The outcome of a request.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::large_enum_variant, reason = "there is one at a time, for an instant")]
pub enum ReplyResult {
    /// The answer.
    Answer(ReplyBody),
    /// The reason why there is no answer.
    Problem(Problem),
}

/// The answer to a request.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "is", rename_all = "kebab-case")]
pub enum ReplyBody {
    /// It was done.
    Done,
    /// The content of a folder.
    Files {
        /// Its entries that can be opened, by name.
        entries: Vec<FileEntry>,
        /// Number of entries that were not looked at, or are not listed.
        left_out: u64,
    },
    /// What a file or a folder is.
    Identified {
        /// Its entry; of a copy of a file that the server has, the entry of that file.
        entry: FileEntry,
    },
    /// The scenarios that the program carries.
    Gallery {
        /// Their entries.
        entries: Vec<GalleryEntry>,
    },
    /// The memory that the server uses.
    Usage(ServerUsage),
    /// What becomes of a file that is read.
    ImportReport {
        /// Format, properties and counts, each with its name.
        lines: Vec<(String, String)>,
        /// What was not taken as it stood, one sentence each.
        findings: Vec<String>,
    },
    /// A session at its start.
    Opened {
        /// Its number.
        session: SessionId,
        /// The scene, which stays the same.
        scene: Scene,
        /// Its state.
        status: SessionStatus,
    },
    /// Facts and marks of a body: its percepts, decisions and actions.
    Inspection(#[cfg_attr(test, ts(type = "Inspection"))] Inspection),
    /// The rows of all metrics.
    Metrics {
        /// The metrics.
        names: Vec<MetricName>,
        /// Number of the first row here: the requested one, or the number of all rows.
        first: u32,
        /// The number of cycles done before each row.
        cycles: Vec<f64>,
        /// Values in each row, metric by metric; null where a metric has none.
        values: Vec<Vec<Option<f64>>>,
        /// The metrics of the session's present cycle; none of a recording that can only be shown.
        present: Option<MetricRow>,
    },
    /// The metrics of each agent at one cycle.
    AgentMetrics {
        /// The metrics that can be asked for; none if one was.
        names: Vec<MetricName>,
        /// The number of cycles done.
        cycle: f64,
        /// The value of the requested metric for each agent, by its number; null where it has none. Empty if none was
        /// requested.
        values: Vec<Option<f64>>,
    },
    /// The events that a search has found, the oldest first.
    FoundEvents {
        /// The events.
        entries: Vec<RunEvent>,
        /// Number of events found, those that are not here included.
        found: u64,
        /// Number of events that were searched.
        searched: u64,
        /// Number of events that could not be searched, because they were not kept.
        left_out: u64,
        /// The kinds of all events searched, with their numbers.
        kinds: Vec<(String, u64)>,
    },
    /// Events, the oldest first.
    Events {
        /// The events.
        entries: Vec<RunEvent>,
        /// Number of events of these cycles that are not here: beyond the requested number, or never kept.
        left_out: u64,
        /// The cycle before which all events are known: of a run those so far, of a recording soon all.
        known_until: f64,
    },
    /// The trails of some bodies, as far as they are known.
    Trails {
        /// The trails.
        trails: Vec<BodyTrail>,
    },
    /// The scenario's text.
    Source {
        /// Its name in problems.
        place: String,
        /// The text.
        text: String,
        /// Whether it cannot be replaced by another text.
        read_only: bool,
    },
    /// The names of a recording's tables; none for an MCAP file, or if it is no recording.
    Tables {
        /// The names.
        names: Vec<String>,
    },
    /// The finished runs of a sweep.
    Runs {
        /// The sweep's name; may be empty.
        name: String,
        /// Whether these are all runs.
        is_complete: bool,
        /// The results that differ between runs, those that the world is about first.
        columns: Vec<SweepColumn>,
        /// Number of results that are equal in all runs, or not listed.
        columns_left_out: u32,
        /// The runs.
        runs: Vec<SweepRun>,
        /// The rule by which a run is an outlier, in words.
        outlier_rule: String,
        /// Number of runs that are not listed.
        left_out: u64,
    },
    /// The errors of a text, and its surprises.
    Problems {
        /// The problems; none for a valid text without surprises.
        problems: Vec<Problem>,
    },
    /// A text with all edits.
    Edited {
        /// The text.
        text: String,
    },
    /// The values in a text.
    Model {
        /// The table of the text: dates are strings; numbers that JSON cannot hold are null.
        #[cfg_attr(test, ts(type = "unknown"))]
        value: serde_json::Value,
        /// Files that a key of the text can refer to, by the paths that it would use: those below its folder, and those
        /// outside that it refers to.
        files: Vec<String>,
    },
    /// The text is in a file.
    Saved {
        /// The file, which is the session's place from now on.
        place: String,
    },
    /// Nothing was written, because the file holds something else than the session has read or written.
    Differs {
        /// The content of the file.
        text: String,
    },
    /// The keys of a world's scenarios.
    Schema {
        /// JSON Schema, draft 2020-12.
        #[cfg_attr(test, ts(type = "unknown"))]
        schema: serde_json::Value,
        /// The tools for the canvas, as `crates/scenario/src/editing.rs` has them.
        #[cfg_attr(test, ts(type = "unknown"))]
        editing: Editing,
    },
}

/// An error as people read it: place, cause, remedy.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Problem {
    /// The file, option or request that is wrong.
    pub place: Box<str>,
    /// Its line, from 1.
    pub line: Option<u32>,
    /// Its column, from 1.
    pub column: Option<u32>,
    /// Line of its end, from 1.
    pub end_line: Option<u32>,
    /// Column after its end, from 1.
    pub end_column: Option<u32>,
    /// Key of the scenario that is wrong, as `--set` takes it: `robots.1.at.0`.
    pub key: Option<Box<str>>,
    /// The cause.
    pub cause: Box<str>,
    /// The remedy: the right way to write or to do it.
    pub remedy: Box<str>,
    /// Whether it is a warning: the text is valid.
    pub is_warning: bool,
}

impl Problem {
    /// Returns a problem without a line.
    pub fn new(
        place: impl Into<Box<str>>,
        cause: impl Into<Box<str>>,
        remedy: impl Into<Box<str>>,
    ) -> Self {
        Self {
            place: place.into(),
            line: None,
            column: None,
            end_line: None,
            end_column: None,
            key: None,
            cause: cause.into(),
            remedy: remedy.into(),
            is_warning: false,
        }
    }
}

/// Something in a folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FileEntry {
    /// Its path for other requests.
    pub path: String,
    /// Its name in its folder.
    pub name: String,
    /// Its kind.
    pub kind: FileKind,
    /// A few words on its content; may be empty.
    pub about: String,
}

/// A scenario that the program carries.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct GalleryEntry {
    /// Its name for other requests.
    pub name: String,
    /// The name of its world.
    pub world: String,
    /// Its title.
    pub title: String,
    /// A sentence on it.
    pub about: String,
}

/// The memory that a server uses, by what it is for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ServerUsage {
    /// What is kept, of each session and of all together.
    pub stores: Vec<StoreUsage>,
    /// Bytes of memory of the whole process; none where the system does not tell.
    pub resident_bytes: Option<u64>,
    /// Number of open sessions, of all pages.
    pub sessions: u32,
    /// Maximum number of open sessions.
    pub max_sessions: u32,
}

/// The memory of something that grows with use.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct StoreUsage {
    /// The session that it belongs to; none for what all share.
    pub session: Option<SessionId>,
    /// What is kept, for people.
    pub name: String,
    /// Its bytes.
    pub bytes: u64,
    /// The bytes that it never exceeds.
    pub max_bytes: u64,
}

/// A result of the runs of a sweep.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SweepColumn {
    /// Its name in results.
    pub key: String,
    /// A short label.
    pub label: String,
    /// Its unit; may be empty.
    pub unit: String,
}

/// A run of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SweepRun {
    /// The name of its variant.
    pub variant: String,
    /// Its seed, in decimal digits, because it may be larger than any exact integer of JavaScript.
    pub seed: String,
    /// The cause of its failure; empty if it did not fail.
    pub failure: String,
    /// Its recording; or its variant's scenario, which needs the seed.
    pub replay: TargetRef,
    /// Its results, column by column; null where it has none.
    pub values: Vec<Option<f64>>,
    /// The results that are far from those of the other runs of its variant.
    pub outliers: Vec<SweepOutlier>,
}

/// A result of a run that is far from those of the other runs of its variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SweepOutlier {
    /// The place of its column.
    pub column: u32,
    /// Whether it is above the others.
    pub is_high: bool,
    /// Its distance from the nearer quartile in interquartile ranges; null where the quartiles are equal.
    pub distance_ranges: Option<f64>,
}

/// The kind of a file or a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum FileKind {
    /// A folder of other things.
    Folder,
    /// A scenario.
    Scenario,
    /// The folder of a run.
    Run,
    /// An MCAP file.
    Recording,
    /// A sweep: its file, or its folder.
    Sweep,
    /// A file of another program that stands for a scenario.
    Foreign,
    /// A map or an image of a floor, which a scenario can name.
    Map,
    /// Links and joints of a robot, which a scenario can name.
    Model,
    /// Sensors and effectors that were learned from logs, which a scenario can name.
    Profile,
}

/// A message of the server without a request.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "notice", rename_all = "kebab-case")]
pub enum ServerNotification {
    /// The first of all notices.
    Hello {
        /// See [`VERSION`](super::VERSION).
        version: u32,
        /// The program and its build.
        program: String,
        /// The names of all worlds.
        worlds: Vec<String>,
        /// Whether texts of the page are refused.
        read_only: bool,
        /// The things that the command line asked to open.
        open: Vec<TargetRef>,
    },
    /// The bodies that the columns of frames with this number stand for; sent before the first such frame.
    Bodies(BodyTable),
    /// The state of a session; sent when it changes, at most ten times a second.
    Status(SessionStatus),
    /// The end of a session by itself, and the reason.
    Ended {
        /// The session.
        session: SessionId,
        /// The reason.
        problem: Problem,
    },
}

/// Something that the command line asked to open: a kind as in [`OpenTarget`](super::OpenTarget), with its path.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TargetRef {
    /// `scenario`, `recording`, `sweep` or `fleet`.
    pub kind: String,
    /// Its path, or the endpoint of a fleet.
    pub path: String,
}

/// The state of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SessionStatus {
    /// The session.
    pub session: SessionId,
    /// Its activity.
    pub state: SessionState,
    /// Cycles done.
    pub cycle: f64,
    /// Number of cycles of the whole run; of a recording, those that were recorded.
    pub cycles_planned: f64,
    /// Simulated seconds since the start.
    pub time_s: f64,
    /// Its speed now, or when it was last playing.
    pub speed: Speed,
    /// Cycles per second over the last second.
    pub cycles_per_s: f64,
    /// The seed, in decimal digits, because it may be larger than any exact integer of JavaScript.
    pub seed: String,
    /// Digest of the state, while the run is paused or over.
    pub digest: Option<String>,
    /// The verdict on a recording: whether its digest was confirmed, or will be.
    pub banner: Option<String>,
    /// The nodes of a fleet.
    pub fleet: Option<Box<Fleet>>,
}

/// The activity of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case")]
pub enum SessionState {
    /// It advances.
    Playing,
    /// It is paused.
    Paused,
    /// It seeks a requested cycle.
    Seeking,
    /// It runs in other processes, and is only watched here.
    Watched,
    /// The run has ended.
    Over,
    /// It has failed; the notice [`ServerNotification::Ended`] gives the reason.
    Failed,
}

/// A metric.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MetricName {
    /// Its name in results.
    pub key: String,
    /// A short label.
    pub label: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// Whether it is among those that the world is about, which charts show without being asked. They come first.
    pub is_primary: bool,
}

/// The metrics at one cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MetricRow {
    /// The number of cycles done.
    pub cycle: f64,
    /// A value for each metric; null where it has none.
    pub values: Vec<Option<f64>>,
}
