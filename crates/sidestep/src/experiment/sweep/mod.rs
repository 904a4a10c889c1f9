//! Sweeps: one scenario, many variants of it, each run with many seeds, and what they come to.
//!
//! ```text
//! file.rs      a sweep file (TOML) -> Sweep, with errors that point
//! design.rs    which variants: a full grid, a list, a Latin hypercube, or products of them
//! plan.rs      variants x replicates -> cells, and who runs which
//! cell.rs      one cell -> one outcome: a deterministic run, so a lost one is simply run again
//! rounds.rs    which cells are next, where a wanted precision says when to stop
//! rows.rs      outcomes -> a table of runs, the same in whatever order they came
//!
//! table.rs     a table of runs: a row a run, typed columns with a role
//! label.rs     what a column is called on an axis, with its unit
//! groups.rs    runs by variant and replicate, and the mean over any group of variants
//! compare.rs   a variant against the baseline, on the same replicates
//! summary.rs   the table summed up: every number with its interval and number of runs
//! text.rs      the summary as tables
//! charts.rs    the summary as figures
//! ```
//!
//! The unit of work is a *cell*: a variant and a seed. Replicate `k` of every variant has the same
//! seed (common random numbers), so that differences between variants are compared pair by pair.
//! Nothing here knows of files that are written, nor of processes: a row is a function of its
//! cell alone, whoever computes it, where and in what order.

pub mod cell;
mod charts;
pub mod compare;
pub mod design;
pub mod file;
mod groups;
pub mod label;
pub mod plan;
pub mod rounds;
pub mod rows;
pub mod summary;
pub mod table;
mod text;

pub use cell::{Outcome, Started, start};
pub use compare::Comparison;
pub use design::{Design, Factor, Hypercube, Range, Setting};
pub use file::{Sweep, Until};
pub use groups::{Level, Parameter};
pub use label::Label;
pub use plan::{Cell, Plan, Shard, Variant};
pub use rows::Rows;
pub use summary::{LeftOut, Summary, SummaryOptions};
pub use table::{Role, RunColumn, RunTable};

#[cfg(test)]
mod tests;
