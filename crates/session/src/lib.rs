//! Drives runs of any world: starts, records, resumes and replays them, makes animations and
//! exports, runs sweeps, and makes the documents of reports.
//!
//! ```text
//! scenario.rs   a file and overrides -> a scenario     journey.rs    one run, to its end
//! driver.rs     advances in slices                     recording.rs  the folder of a run
//! orders.rs     orders from outside, followed again
//! film/         frames into files                      picture.rs    pictures into files
//! rerun.rs      recorded runs, computed again          replay.rs     ... and compared
//! played/       ... of other builds, from their tables or messages
//! export/       recorded runs in other formats         report/       folders -> documents
//! sweep/        many runs of one scenario              summary.rs    the results of a run
//! live/         viewers that watch and steer           beat.rs       when a cycle is due
//! watcher.rs    progress, and requests to stop         identity.rs   the build that made a run
//! attend.rs     work that its caller looks after       rows.rs       rows that are kept in memory
//! fleet.rs      the job of agents as processes
//! ```
//!
//! Nothing here knows a terminal, the options of a command, or a world: functions that need the
//! list of worlds take [`Worlds`](sidestep::scenario::Worlds), and report their progress to a
//! [`Watcher`].

mod attend;
mod beat;
mod compare;
mod driver;
mod error;
mod files;
mod film;
mod identity;
mod journey;
mod live;
mod orders;
mod picture;
mod played;
mod recorded;
mod recording;
mod replay;
mod rerun;
mod rows;
mod scenario;
mod summary;
mod watcher;

pub mod export;
pub mod fleet;
pub mod report;
pub mod sweep;

pub use attend::attended;
pub use beat::Beat;
pub use driver::{Effort, Sinks, drive};
pub use error::Error;
pub use files::{replace, shown};
pub use film::{Ending, Film, McapFilm, frame_rows};
pub use identity::{adds_code, build};
pub use journey::{Journey, Keep, RestoreError};
pub use live::{Steered, Viewers, ViewersAt, next_free};
pub use picture::write_png;
pub use recorded::{csv_table, stored_summary};
pub use recording::Recording;
pub use replay::{Replayed, replay_all, replay_to};
pub use rerun::Recorded;
pub use rows::Wanted;
pub use scenario::{problems, read};
pub use sidestep_record::{Playback, Playing, Steering};
pub use summary::{Phases, Status, Summary};
pub use watcher::{Progress, Unwatched, Watcher};
