//! The folder of a sweep: the plan, the finished runs, and the table of all runs.
//!
//! ```text
//! sweep.json                the plan, written once: format, program version, variants, seeds
//! cells.parquet             one row per cell: number, variant, replicate, seed, parameters
//! variants/0007/            the scenario of a variant, self-contained
//! shares/1-of-4.journal     the finished runs of a share, while it is in progress
//! shares/1-of-4.parquet     the same, once the share is done; its digest is in 1-of-4.manifest.json
//! results.manifest.json     the digests of the next three
//! results.parquet           one row per run, of all shares: exists if and only if the sweep is done
//! timings.parquet           the times that each run took
//! series.parquet            metrics over time: one row per run and cycle, where they were kept
//! joining.partial/          runs sorted into piles, while they are joined: if they are too many for the memory
//! runs/000012/              run folders, if they were requested
//! ```
//!
//! A run is finished once its line is in a journal: then no kill loses it, and it is not repeated.
//! A killed process leaves at most an incomplete line, which the next one deletes. Only the owner
//! of a share writes its journal; everything else is written once, and appears by a rename.

mod check;
mod folder;
mod journal;
mod results;
mod shares;

pub use folder::{SweepFolder, SweepManifest, TempFolder, fingerprint};
pub use journal::{Journal, SweepIdentity, read_journal};
pub use results::{ResultColumns, ResultsWriter};
pub use shares::Share;
