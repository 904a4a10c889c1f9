//! Drives runs of any world: starts, records, resumes and replays them, makes animations and
//! exports, runs sweeps, and makes the documents of reports.
//!
//! ```text
//! scenario.rs      a file and overrides -> a scenario   managed_run.rs   one run, to its end
//! driver.rs        advances in slices                   run_recorder.rs  the folder of a run
//! orders.rs        external orders, followed again      run_tables.rs    tables of a recorded run
//! frame_sink/      frames into files                    picture.rs       pictures into files
//! recorded_run.rs  recorded runs, computed again        replay.rs        ... and compared (compare.rs)
//! playback/        ... of other builds, from their tables or messages
//! recorded_series.rs  ... and their metrics over time
//! export/          recorded runs in other formats       report/          folders -> documents
//! sweep/           many runs of one scenario            summary.rs       the results of a run
//! live/            viewers that watch and steer         pacer.rs         when a cycle is due
//! watcher.rs       progress, and requests to stop       identity.rs      the build that made a run
//! polling.rs       work that its caller polls           row_store.rs     rows that are kept in memory
//! files.rs         files written completely or not      fleet.rs         the job of agents as processes
//! inspect.rs       what any file is, and what becomes of it
//! trajectory.rs    the motions of arms in a recorded run
//! thumbnail.rs     a small picture of a run
//! ros/             frames of a run as messages of ROS 2
//! ```
//!
//! Nothing here knows a terminal, the options of a command, or a world: functions that need the
//! list of worlds take [`Worlds`](sidestep_scenario::Worlds), and report their progress to a
//! [`Watcher`].

mod compare;
mod compare_rows;
mod driver;
mod error;
mod files;
mod flight;
mod flight_recorder;
mod frame_sink;
mod identity;
mod inspect;
mod live;
mod managed_run;
mod orders;
mod pacer;
mod picture;
mod playback;
mod polling;
mod recorded_run;
mod recorded_series;
mod replay;
mod row_store;
mod run_recorder;
mod run_tables;
mod scenario;
mod summary;
#[cfg(test)]
mod testing;
mod thumbnail;
mod trajectory;
mod watcher;

pub mod export;
pub mod fleet;
pub mod report;
pub mod ros;
pub mod sweep;

pub use driver::{RunTiming, Sinks, drive};
pub use error::{Error, STORAGE_REMEDY};
pub use files::{display_path, write_atomically};
pub use flight::{CutFlight, close_flight, cut_off_text};
pub use flight_recorder::FlightRecorder;
pub use frame_sink::{EndReason, FrameSink, McapSink};
pub use identity::VERSION;
pub use inspect::{InspectedFile, inspect, write_clean};
pub use live::{LiveControl, ViewerAddress, ViewerOptions, ViewerServer, next_free_port};
pub use managed_run::{ManagedRun, OutputPaths, RestoreError};
pub use pacer::Pacer;
pub use picture::{PictureLook, png_bytes, write_png};
pub use polling::run_polling;
pub use recorded_run::{RecordedRun, RunEnd};
pub use recorded_series::RecordedSeries;
pub use replay::{ReplayReport, replay_all, replay_to};
pub use row_store::RowSelection;
pub use run_recorder::{RecordingPlan, RunRecorder};
pub use run_tables::{RecordedCsv, csv_table, read_summary};
pub use scenario::{GivenScenario, problems, read_scenario};
pub use sidestep_record::{Playback, PlaybackPhase, PlaybackRequest};
pub use summary::{Phases, RunStatus, Summary};
pub use thumbnail::Thumbnail;
pub use trajectory::{ArmTrajectory, arm_trajectories};
pub use watcher::{NestedWatcher, NoWatcher, Progress, ProgressGuard, Watcher};
