//! Many runs: what was typed -> a sweep -> cells -> one table.
//!
//! ```text
//! ask.rs      options and files -> what to run         prepare.rs   every variant compiled, a plan
//! work.rs     cells -> outcomes, many at once          journey.rs   from the plan to the table
//! columns.rs  tables of runs <-> files                 say.rs       what it came to, in words
//! ```

mod ask;
mod columns;
mod journey;
mod prepare;
mod say;
mod work;

pub(crate) use ask::ManyArgs;
pub(crate) use journey::{Folder, collect, go_on, in_folder, in_memory, planned, share};
