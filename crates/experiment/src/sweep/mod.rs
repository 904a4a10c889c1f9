//! Sweeps: many variants of one scenario, each run with many seeds, and their results.
//!
//! ```text
//! file.rs      a sweep file (TOML) -> Sweep, with errors that point
//! overrides.rs changes that a command or a program makes to it
//! variant.rs   a scenario and a variant of it: settings, and perhaps a name
//! design.rs    the variants: a full grid, a list, a Latin hypercube, or products of them
//! baseline.rs  the variant that each is compared with, within the other factors
//! plan.rs      variants x replicates -> trials, and shares of them
//! trial.rs     one trial -> one outcome: a deterministic run, so a lost one is simply run again
//! series.rs    metrics over time of the runs, and their means over seeds
//! seeds.rs     variants in which seeds change nothing
//! scheduler.rs trials -> results, many at once
//! rounds.rs    the next trials, if a requested precision decides when to stop
//! rows.rs      outcomes -> a table of runs, the same for any order of arrival
//! column_schema.rs  the columns of that table, for writing it block by block
//!
//! table.rs     a table of runs: one row per run, typed columns with a role
//! outliers.rs  runs that lie far from the others of their variant
//! label.rs     the label of a column on an axis, with its unit
//! groups.rs    runs by variant and replicate, and the mean over any group of variants
//! compare.rs   a variant against the baseline, on the same replicates
//! summary.rs   a summary of the table: every number with its interval and number of runs
//! summarize.rs a table -> its summary
//! options.rs   options of a summary
//! plan_summary.rs  a plan's runs -> their summary
//! text.rs      the summary as tables
//! charts.rs    the summary as figures: each metric over each parameter
//! run_charts.rs    the runs of variants: joined by seed, differences, boxes, shares up to a value
//! forest_chart.rs  all comparisons against zero
//! front.rs         the variants that no other one beats in two metrics
//! lead_charts.rs   the first page: the figures that show what differs
//! ```
//!
//! The unit of work is a *trial*: a variant and a seed. Replicate `k` of every variant has the same
//! seed (common random numbers), so that differences between variants are compared pair by pair.
//! Nothing here writes files or starts processes: a row is a function of its trial alone,
//! regardless of the process that computes it, the place and the order.

pub mod baseline;
mod charts;
pub mod column_schema;
pub mod compare;
pub mod design;
pub mod file;
mod forest_chart;
mod front;
mod groups;
pub mod label;
mod lead_charts;
mod options;
pub mod outliers;
mod overrides;
pub mod plan;
mod plan_summary;
pub mod rounds;
pub mod rows;
mod run_charts;
pub mod scheduler;
pub mod seeds;
pub mod series;
mod summarize;
pub mod summary;
pub mod table;
mod text;
pub mod trial;
pub mod variant;

pub use baseline::{Baseline, BaselineSpec};
pub use column_schema::ColumnSchema;
pub use compare::Comparison;
pub use design::{Design, Factor, LatinHypercube, ParameterRange};
pub use file::{Precision, Sweep};
pub use front::{Aim, Better};
pub use groups::{Level, Parameter};
pub use label::Label;
pub use options::{BaselineChoice, SummaryOptions};
pub use overrides::SweepOverrides;
pub use plan::{PRIVILEGE_MARK, Plan, Shard, Trial};
pub use rows::RunTableBuilder;
pub use series::{BandPoint, SeriesBand, series_bands};
pub use summary::{OmittedMetric, Summary};
pub use table::{Role, RunColumn, RunTable};
pub use trial::{Outcome, TrialRun, start_trial};
pub use variant::{BaseScenario, Setting, Variant};

#[cfg(test)]
mod tests;
