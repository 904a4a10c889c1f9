//! Many runs: a sweep -> cells -> one table.
//!
//! ```text
//! prepare.rs   every variant compiled, a plan     work.rs      cells -> outcomes, many at once
//! journey.rs   from the plan to the table         effort.rs    the time that all took
//! crew.rs      others who run cells            task.rs      cells that another process sends
//! told.rs      the results, for programs
//! look.rs      finished runs, for reports         stamped.rs   lines of a journal
//! status.rs    a sweep that others work on
//! ```

mod crew;
mod effort;
mod journey;
mod look;
mod prepare;
mod stamped;
mod status;
mod task;
mod told;
mod work;

pub use crew::{Crew, Deal, Engine, Taken};
pub use effort::Effort;
pub use journey::{
    Done, Ended, Folder, collect, go_on, in_memory, planned, planned_or_there, share,
};
pub(crate) use look::picture_of;
pub use look::{Finished, finished};
pub use status::{Failure, ShareStatus, Status, status};
pub use task::Task;
pub use told::failed;
