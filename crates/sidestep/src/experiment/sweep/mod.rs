//! Sweeps: one scenario, many variants of it, each run with many seeds.
//!
//! ```text
//! file.rs      a sweep file (TOML) -> Sweep, with errors that point
//! design.rs    which variants: a full grid, a list, a Latin hypercube, or products of them
//! plan.rs      variants x replicates -> cells, and who runs which
//! cell.rs      one cell -> one row: a deterministic run, so a lost one is simply run again
//! ```
//!
//! The unit of work is a *cell*: a variant and a seed. Replicate `k` of every variant has the same
//! seed (common random numbers), so that differences between variants are compared pair by pair.
//! Nothing here knows of files that are written, nor of processes: a row is a function of its
//! cell alone, whoever computes it, where and in what order.

pub mod cell;
pub mod design;
pub mod file;
pub mod plan;

pub use cell::{Outcome, Started, start};
pub use design::{Design, Factor, Hypercube, Range, Setting};
pub use file::{Sweep, Until};
pub use plan::{Cell, Plan, Shard, Variant};
