//! The directory of a replay in one file, from which the page answers its own requests.
//!
//! The file holds parts: deflated bytes as base64, one in a line. The first part is a [`ReplayFile`] as JSON; it refers
//! to the others by their numbers. The layout of frames is in `crates/server/src/replay_page/chunk.rs`.

use super::{BodyTable, Scan, Scene, SessionStatus};
use serde::Serialize;
use sidestep_kernel::view::Inspection;

/// All that a replay in one file holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayFile {
    /// See [`VERSION`](super::VERSION).
    pub version: u32,
    /// The program that made it, and its build.
    pub program: String,
    /// The runs, which are opened in this order.
    pub runs: Vec<ReplayRun>,
}

/// A recorded run in a replay.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayRun {
    /// The name of the recording, without the folder that it was in.
    pub name: String,
    /// The scene.
    pub scene: Scene,
    /// The state at the first frame.
    pub status: SessionStatus,
    /// Digest of the state at the last frame; none if the run ends later.
    pub digest: Option<String>,
    /// The part with the digest of each frame, 16 bytes, by which two runs are compared; none of a single run.
    pub digests: Option<u32>,
    /// The cycles of the frames: first cycle, cycles between two frames, number of frames.
    pub cycles: Vec<[f64; 3]>,
    /// The parts with body tables, in the order of their numbers from 1 on.
    pub tables: Vec<ReplayTables>,
    /// The part with the reply to the request for the scenario.
    pub source: u32,
    /// The part with the reply to the request for all rows of metrics.
    pub metrics: u32,
    /// The metrics of each agent, at some of the cycles; none in a world without any.
    pub agents: Option<ReplayAgentMetrics>,
    /// The parts with frames, in their order.
    pub chunks: Vec<ReplayChunk>,
    /// The parts with events, in their order.
    pub events: Vec<ReplaySpan>,
    /// Number of events that are not in the file.
    pub events_left_out: u64,
    /// Cycles with such events, and their numbers; cycles near each other are counted together.
    pub events_lost: Vec<[f64; 2]>,
    /// The parts with inspections, in their order.
    pub inspections: Vec<ReplaySpan>,
    /// What can be inspected, in words.
    pub inspected: String,
}

/// The metrics of each agent over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayAgentMetrics {
    /// The metrics.
    pub names: Vec<super::MetricName>,
    /// Number of agents.
    pub agents: u32,
    /// The number of cycles done before each row.
    pub cycles: Vec<f64>,
    /// For each metric, the part with its values, as a plane with a channel for each agent and a time for each row.
    pub parts: Vec<u32>,
}

/// A part with frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayChunk {
    /// Its number.
    pub part: u32,
    /// Number of frames.
    pub frames: u32,
}

/// A part with body tables, see [`ReplayTablesPart`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayTables {
    /// Its number.
    pub part: u32,
    /// Number of tables.
    pub tables: u32,
}

/// Some consecutive body tables: each is a selection of the bodies of all.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayTablesPart {
    /// The bodies of all tables, in the order that all have. Its session and its number mean nothing.
    pub all: BodyTable,
    /// For each table the bodies that come or go with it; before the first one there is none.
    pub changes: Vec<Vec<u32>>,
}

/// A part with things of some cycles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplaySpan {
    /// Its number.
    pub part: u32,
    /// The cycle of its first item.
    pub from: f64,
    /// The cycle of its last item.
    pub until: f64,
    /// Number of items.
    pub count: u32,
}

/// Events as columns: item i of each column belongs to event i. Fields are those of a `RunEvent`.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayEvents {
    /// The cycles since the event before; of the first event, its cycle.
    pub cycle: Vec<f64>,
    /// Severities.
    pub level: Vec<String>,
    /// Kinds.
    pub kind: Vec<String>,
    /// The bodies concerned.
    pub body: Vec<Option<super::BodyId>>,
    /// The others that took part.
    pub other: Vec<Option<super::BodyId>>,
    /// Places in meters.
    pub at_m: Vec<Option<[f64; 3]>>,
    /// Values.
    pub value: Vec<Option<f64>>,
    /// Units of the values.
    pub unit: Vec<String>,
    /// The events as text.
    pub text: Vec<String>,
}

/// What an agent perceived, decided and did in a cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ReplayInspection {
    /// The inspection, with its cycle.
    #[cfg_attr(test, ts(type = "Inspection"))]
    pub inspection: Inspection,
    /// The scans of the body.
    pub scans: Vec<Scan>,
}
