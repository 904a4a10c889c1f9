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

mod crew;
mod effort;
mod gather;
mod journey;
mod look;
mod piles;
mod prepare;
mod stamped;
mod status;
mod task;
mod told;
mod work;

pub use crew::{Crew, Deal, Engine, Taken};
pub use effort::Effort;
pub use gather::Folder;
pub use journey::{Done, Ended, collect, go_on, in_memory, planned, planned_or_there, share};
pub(crate) use look::picture_of;
pub use look::{Finished, finished};
pub use status::{Failure, ShareStatus, Status, status};
pub use task::Task;
pub use told::failed;
