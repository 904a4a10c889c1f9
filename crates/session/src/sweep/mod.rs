//! Many runs: a sweep -> cells -> one table.
//!
//! ```text
//! prepare.rs   every variant compiled, a plan     work.rs      cells -> outcomes, many at once
//! journey.rs   from the plan to the table         effort.rs    the time of all runs
//! gather.rs    the folder, and the finished runs in it
//! crew.rs      runners outside                    task.rs      cells that another process sends
//! piles.rs     finished runs -> the table, in blocks
//! told.rs      the results, for programs
//! look.rs      finished runs, for reports         stamped.rs   lines of a journal
//! status.rs    a sweep in progress elsewhere
//! ```

mod buckets;
mod cell_runner;
mod executor;
mod finished_runs;
mod folder;
mod journal;
mod json;
mod prepare;
mod run;
mod status;
mod task;
mod timing;

pub use executor::{CellBatch, CellExecutor, Engine, OutcomeSink};
pub(crate) use finished_runs::run_picture;
pub use finished_runs::{FinishedRuns, read_finished};
pub use folder::Folder;
pub use json::failed_rows;
pub use run::{
    SweepEnd, SweepResult, collect, create, open_or_create, run_in_memory, run_remaining, run_share,
};
pub use status::{FailedRun, ShareStatus, SweepStatus, read_status};
pub use task::Task;
pub use timing::SweepTiming;
