//! Many runs of a scenario under varied parameters, and what they come to.
//!
//! ```text
//! table.rs     a table of runs: a row a run, typed columns with a role
//! label.rs     what a column is called on an axis, with its unit
//! groups.rs    runs by variant and replicate, and the mean over any group of variants
//! compare.rs   a variant against the baseline, on the same replicates
//! summary.rs   the table summed up: every number with its interval and number of runs
//! text.rs      the summary as tables
//! charts.rs    the summary as figures
//! ```

mod charts;
pub mod compare;
mod groups;
pub mod label;
pub mod summary;
pub mod table;
mod text;

pub use compare::Comparison;
pub use groups::{Level, Parameter};
pub use label::Label;
pub use summary::{Summary, SummaryOptions};
pub use table::{Role, RunColumn, RunTable, RunValues};

#[cfg(test)]
mod tests;
