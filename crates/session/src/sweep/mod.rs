//! Many runs: a sweep -> trials -> one table.
//!
//! ```text
//! prepare.rs        every variant compiled, a plan  trial_runner.rs  trials -> outcomes, many at once
//! run.rs            from the plan to the table      timing.rs       the time of all runs
//! folder.rs         the folder, and the finished runs in it
//! executor.rs       runners in other processes      task.rs         trials that another process sends
//! buckets.rs        finished runs -> the table, in blocks
//! json.rs           the results, for programs
//! finished_runs.rs  finished runs, for reports      journal.rs      lines of a journal
//! status.rs         a sweep in progress elsewhere
//! ```

mod buckets;
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
mod trial_runner;

pub use executor::{Engine, OutcomeSink, TrialBatch, TrialExecutor};
pub(crate) use finished_runs::run_picture;
pub use finished_runs::{FinishedRuns, read_finished};
pub use folder::Folder;
pub(crate) use folder::check_build;
pub use json::failed_rows;
pub(crate) use prepare::check_variants;
pub use run::{
    SweepEnd, SweepResult, collect, create, open_or_create, run_in_memory, run_remaining, run_share,
};
pub use status::{FailedRun, ShareStatus, SweepStatus, read_status};
pub use task::Task;
pub use timing::SweepTiming;
pub use trial_runner::runs_at_once;
