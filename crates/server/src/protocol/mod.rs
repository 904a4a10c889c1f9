//! The words between page and server: requests, replies and notifications as JSON text, frames as binary.
//!
//! ```text
//! page -> server   ClientRequest { id, session, call }   text; without `session` it is for the server itself
//! server -> page   Reply   { id, answer | problem }      text, one for each request
//!                  ServerNotification                    text, unasked
//!                  frame                                 binary, see below
//! ```
//! TypeScript's types are generated from these (`studio/src/protocol/types.ts`, see `typescript.rs`). A frame is
//! little-endian; every column starts at a multiple of 4 bytes, so typed arrays can view it without a copy:
//! ```text
//!  0 u32  magic 0x46545353 ("SSTF")      4 u16 version     6 u8 dimensions (2|3)    7 u8 1 with velocities, else 0
//!  8 u32  session                       12 u32 table (the body table that the columns follow)
//! 16 f64  cycle                         24 f64 time_s
//! 32 u32  bodies (n)                    36 u32 lines (k)   40 u32 points of all lines (p)
//! 44 u32  bytes of text (t)             48 u32 frames left out since the session began   52 u32 0
//! 56 f32[d*n]    place of each body, in meters: x y (z)        d = dimensions
//!    f32[n]      heading in rad (d = 2); f32[4n] quaternion x y z w (d = 3)
//!    u32[k+1]    first point of each line, in the order of the bodies that are lines
//!    f32[d*p]    the points
//!    f32[3n]     velocity of each body, in meters per second; of traffic only
//!    u8[n]       condition: 0 plain 1 leading 2 open 3 touching 4 failed; padded to 4
//!    u8[t]       FrameText as JSON: scans and events, which are few
//! ```
//! A page grants credit for frames ([`RunMethod::Credit`]), and gets none without it. At most
//! [`MAX_FRAMES_PER_S`](crate::MAX_FRAMES_PER_S) are made in a second; those that were due and could not be sent are left
//! out and counted.

mod edit;
mod fleet;
#[cfg(test)]
mod inspection;
mod replay;
mod reply;
mod request;
mod scene;
mod traffic;
#[cfg(test)]
mod typescript;

pub use edit::Edit;
pub use fleet::{Fleet, FleetNode};
pub use replay::{
    ReplayAgentMetrics, ReplayChunk, ReplayEvents, ReplayFile, ReplayInspection, ReplayRun,
    ReplaySpan, ReplayTables, ReplayTablesPart,
};
pub use reply::{
    FileEntry, FileKind, GalleryEntry, MetricName, MetricRow, Problem, Reply, ReplyBody,
    ReplyResult, ServerNotification, ServerUsage, SessionState, SessionStatus, StoreUsage,
    SweepColumn, SweepOutlier, SweepRun, TargetRef,
};
pub use request::{
    BodyId, ClientRequest, OpenTarget, RunMethod, ServerMethod, SessionMethod, Speed,
};
pub use scene::{
    Appearance, BodyName, BodyTable, FrameText, OccupancyGrid, RunEvent, Scan, Scene, SceneGroup,
    Shape, StaticBody,
};
pub use traffic::{BodyTrail, EarthChart, Traffic, TrafficArea, TrafficRoute};

/// Version of requests, replies, notifications and frames together.
pub const VERSION: u32 = 3;

/// A session's number, as the server gave it.
pub type SessionId = u32;
