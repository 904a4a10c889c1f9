//! The tables of a sweep that is done: of its runs, and of the times that they took.

use std::path::PathBuf;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{RecordError, RoleColumn};

use super::folder::SweepFolder;
use crate::whole::{self, GrowingTable, WholeTable};

const RESULTS: &str = "results.parquet";
const TIMINGS: &str = "timings.parquet";

/// The table of runs, and that of the times that they took, while they are written.
pub struct Completion {
    results: GrowingTable,
    timings: GrowingTable,
}

impl Completion {
    /// Appends runs to both.
    ///
    /// # Errors
    /// Other columns than it was begun with; an I/O error.
    pub fn append<R>(
        &mut self,
        results: &[&RoleColumn<R>],
        timings: &[&RoleColumn<R>],
    ) -> Result<(), RecordError> {
        self.results.append(results)?;
        self.timings.append(timings)
    }

    /// Completes both. The table of timings comes first, because the sweep is done once the results exist.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(self) -> Result<(), RecordError> {
        self.timings.finish()?;
        self.results.finish()
    }
}

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
    /// Begins the table of runs, with columns of these names, roles and types, and that of their times.
    ///
    /// # Errors
    /// An I/O error.
    pub fn completion<R: Serialize>(
        &self,
        results: &[&RoleColumn<R>],
        timings: &[&RoleColumn<R>],
    ) -> Result<Completion, RecordError> {
        let plan = serde_json::to_string(self.plan())
            .map_err(|e| RecordError::new(self.path().display(), e))?;
        let extra = [("sidestep.plan", plan), ("sidestep.fingerprint", self.fingerprint())];
        let version = &self.manifest().program_version;
        let table = |name: &str, columns| {
            GrowingTable::create(&self.path().join(name), columns, version, &extra)
        };
        Ok(Completion { timings: table(TIMINGS, timings)?, results: table(RESULTS, results)? })
    }

    /// Whether the table of all runs exists.
    pub fn is_complete(&self) -> bool {
        self.results_file().is_file()
    }

    /// Returns the path of the table of all runs.
    pub fn results_file(&self) -> PathBuf {
        self.path().join(RESULTS)
    }

    /// Reads the table of all runs.
    ///
    /// # Errors
    /// A sweep that is not done, or a damaged table.
    pub fn results<R: DeserializeOwned + Clone>(&self) -> Result<WholeTable<R>, InputError> {
        if !self.is_complete() {
            let remedy = "go on with `sidestep resume DIR`, or run its shares and \
                          `sidestep sweep collect DIR`";
            return Err(InputError::new(
                self.path().display(),
                "the sweep is not done yet",
                remedy,
            ));
        }
        whole::read(&self.results_file()).map_err(|e| {
            let remedy =
                "delete it; `sidestep resume DIR` makes it again from the runs in `shares`";
            InputError::new(e.place(), e.cause(), remedy)
        })
    }

    /// Reads the table of the times that the runs took.
    ///
    /// # Errors
    /// A sweep that is not done, or a damaged table.
    pub fn timings<R: DeserializeOwned + Clone>(&self) -> Result<WholeTable<R>, InputError> {
        whole::read(&self.path().join(TIMINGS))
    }
}
