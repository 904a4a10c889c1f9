//! Many runs: what was typed -> a sweep -> cells -> one table.
//!
//! ```text
//! ask.rs      options and files -> what to run         prepare.rs   every variant compiled, a plan
//! work.rs     cells -> outcomes, many at once          journey.rs   from the plan to the table
//! say.rs      what it came to, in words                look.rs      what a report needs
//! ```

mod ask;
mod journey;
mod look;
mod prepare;
mod say;
mod work;

pub(crate) use ask::ManyArgs;
pub(crate) use journey::{Folder, collect, go_on, in_folder, in_memory, planned, share};
pub(crate) use look::{Finished, finished, picture_of};
