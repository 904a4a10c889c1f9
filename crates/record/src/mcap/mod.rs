//! Recordings for viewers, and frames for those that watch: MCAP files and a live server, with the schemas of
//! Foxglove.
//!
//! | topic | schema | when |
//! | --- | --- | --- |
//! | `/map` | `foxglove.Grid` | once: the floor, `occupancy` 0 free, 100 wall, 255 unknown |
//! | `/scenery` | `foxglove.SceneUpdate` | once: things that never move |
//! | `/scene` | `foxglove.SceneUpdate` | each frame: one entity per body; those that left are deleted |
//! | `/tf` | `foxglove.FrameTransforms` | each frame: from `world` to each agent, by its name |
//! | `/poses/KIND` | `foxglove.PosesInFrame` | each frame: agents of a kind, in the order of `/tf` |
//! | `/fix/NAME` | `foxglove.LocationFix` | each frame: where on earth an agent is, by its call sign or name |
//! | `/scan/BODY/SENSOR` | `foxglove.LaserScan` | each frame: ranges in the frame `world` |
//! | `/log` | `foxglove.Log` | each event, at its own time |
//!
//! Things that never move have a topic of their own, because a viewer that jumps to a moment shows the last
//! message of each topic before it.
//!
//! `log_time` is simulated time in nanoseconds; where the run has a date, nanoseconds since 1970, UTC, in a file, and since
//! the start of the run for live viewers. The scenario and its files are attachments; the
//! metadata record `sidestep` describes the run and how it ended. While it is incomplete, the file
//! is called `NAME.partial`. Equal runs give equal bytes.
//!
//! A live viewer gets the same topics: of each the last message at once, and then each frame that it keeps up
//! with. Because it may miss some, a live `/scene` deletes all bodies before it shows them.

mod bag;
mod check;
mod frame_encoder;
mod live;
mod messages;
mod reader;
mod scene_reader;
mod writer;

pub use bag::{BagSchema, BagWriter};
pub use check::check_mcap;
pub(crate) use check::is_begun_by_us;
pub use live::{
    LiveFrameWriter, LiveServer, Playback, PlaybackPhase, PlaybackRequest, ServedRun,
    start_live_server,
};
pub use reader::{McapRunInfo, is_mcap};
pub use scene_reader::McapSceneReader;
pub use writer::{McapFooter, McapProvenance, McapRecorder};

/// Name of the metadata record.
const METADATA: &str = "sidestep";
/// Name of the attachment with the scenario.
const SCENARIO: &str = "scenario.toml";
/// The frame of reference that all others are in.
const WORLD: &str = "world";
