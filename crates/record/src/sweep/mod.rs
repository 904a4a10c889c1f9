//! The folder of a sweep: what is to be run, what has been run, and the one table of all runs.
//!
//! ```text
//! sweep.json                the plan, written once: format, program version, variants, seeds
//! cells.parquet             one row a cell: number, variant, replicate, seed, parameters
//! variants/0007/            the scenario of a variant, complete in itself
//! shares/1-of-4.journal     the finished runs of a share, while it is under way
//! shares/1-of-4.parquet     the same, once the share is done
//! results.parquet           one row a run, of all shares: there if and only if the sweep is done
//! timings.parquet           what each run took
//! runs/000012/              run folders, where they were asked for
//! ```
//!
//! A run is finished once its line is in a journal: then no kill loses it, and nobody repeats it.
//! A killed process leaves at most half a line, which the next one takes away. Only the owner of a
//! share writes its journal; everything else is written once, under its name by a rename.

mod folder;
mod journal;

pub use folder::{Share, SweepFolder, SweepManifest, fingerprint};
pub use journal::{Journal, read_journal};
