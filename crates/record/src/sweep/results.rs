//! The tables of a sweep that is done: of its runs, of the times that they took, and of their metrics over time.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnWithRole, RecordError};
use sidestep_kernel::shell::sidestep_command;

use super::folder::{FINGERPRINT, RESULTS_STEM, SHARES, SweepFolder};
use crate::file_manifest::FileManifest;
use crate::run_table::{self, LoadedTable, TableStream};

pub(super) const RESULTS: &str = "results.parquet";
pub(super) const TIMINGS: &str = "timings.parquet";
pub(super) const SERIES: &str = "series.parquet";
/// Key of the plan in the key-value pairs of a table.
const PLAN: &str = "sidestep.plan";

/// Columns of the tables of some runs.
#[derive(Debug)]
pub struct ResultColumns<'a, R> {
    /// The columns of the table of runs.
    pub results: &'a [&'a ColumnWithRole<R>],
    /// Those of the times that they took.
    pub timings: &'a [&'a ColumnWithRole<R>],
    /// Those of their metrics over time; without columns there is no such table.
    pub series: &'a [&'a ColumnWithRole<R>],
}

/// The table of runs, that of the times that they took, and that of their metrics over time, while they are written.
pub struct ResultsWriter {
    results: TableStream,
    timings: TableStream,
    series: Option<TableStream>,
    /// The path of the list of all.
    manifest: PathBuf,
    program_version: String,
}

impl ResultsWriter {
    /// Appends runs to all tables.
    ///
    /// # Errors
    /// Columns other than those it was started with; an I/O error.
    pub fn append<R>(&mut self, columns: &ResultColumns<'_, R>) -> Result<(), RecordError> {
        self.results.append(columns.results)?;
        if let Some(series) = &mut self.series {
            series.append(columns.series)?;
        }
        self.timings.append(columns.timings)
    }

    /// Completes all. Their digests come first, because the sweep is done once the results exist, and the other tables
    /// before the results for the same reason.
    ///
    /// # Errors
    /// An I/O error.
    pub fn finish(mut self) -> Result<(), RecordError> {
        let mut list = FileManifest::new("table", &self.program_version);
        list.files.insert(TIMINGS, self.timings.close()?);
        if let Some(series) = &mut self.series {
            list.files.insert(SERIES, series.close()?);
        }
        list.files.insert(RESULTS, self.results.close()?);
        list.write(&self.manifest)?;
        self.timings.finish()?;
        self.series.map_or(Ok(()), TableStream::finish)?;
        self.results.finish()
    }
}

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
    /// Begins the tables, with columns of these names, roles and types.
    ///
    /// # Errors
    /// An I/O error.
    pub fn results_writer<R: Serialize>(
        &self,
        columns: &ResultColumns<'_, R>,
    ) -> Result<ResultsWriter, RecordError> {
        let plan = serde_json::to_string(self.plan())
            .map_err(|e| RecordError::new(self.path().display(), e))?;
        let extra = [(PLAN, plan), (FINGERPRINT, self.fingerprint())];
        let version = &self.manifest().program_version;
        let create = |name: &str, columns: &[&ColumnWithRole<R>]| {
            TableStream::create(&self.path().join(name), columns, version, &extra)
        };
        let timings = create(TIMINGS, columns.timings)?;
        let has_series = !columns.series.is_empty();
        let series = has_series.then(|| create(SERIES, columns.series)).transpose()?;
        let results = create(RESULTS, columns.results)?;
        let manifest = self.path().join(FileManifest::name_for(RESULTS_STEM));
        let program_version = version.clone();
        Ok(ResultsWriter { timings, series, results, manifest, program_version })
    }

    /// Returns whether metrics over time of the runs are kept: a sweep with very many runs has none.
    pub fn has_series(&self) -> bool {
        let list = self.path().join(FileManifest::name_for(RESULTS_STEM));
        let is_listed =
            FileManifest::read(&list).is_ok_and(|(list, _)| list.files.contains(SERIES));
        is_listed || self.path().join(SERIES).exists()
    }

    /// Reads the table of the metrics over time; none of a sweep without them.
    ///
    /// # Errors
    /// A table that is missing though it is listed, damaged, or of another sweep.
    pub fn series<R: DeserializeOwned + Clone>(
        &self,
    ) -> Result<Option<LoadedTable<R>>, InputError> {
        self.has_series().then(|| self.table(SERIES)).transpose()
    }

    /// Returns whether the table of all runs exists.
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
    /// A sweep that is not done; a table that is damaged, or of another sweep.
    pub fn results<R: DeserializeOwned + Clone>(&self) -> Result<LoadedTable<R>, InputError> {
        if !self.is_complete() {
            let resume = sidestep_command("resume", self.path());
            let collect = sidestep_command("sweep collect", self.path());
            let remedy = format!("go on with `{resume}`, or run its shares and `{collect}`");
            return Err(InputError::new(
                self.path().display(),
                "the sweep is not done yet",
                remedy,
            ));
        }
        self.table(RESULTS)
    }

    /// Reads the table of the times that the runs took.
    ///
    /// # Errors
    /// A sweep that is not done; a table that is damaged, or of another sweep.
    pub fn timings<R: DeserializeOwned + Clone>(&self) -> Result<LoadedTable<R>, InputError> {
        self.table(TIMINGS)
    }

    fn table<R: DeserializeOwned + Clone>(&self, name: &str) -> Result<LoadedTable<R>, InputError> {
        let path = self.path().join(name);
        self.check_own(&path)
            .and_then(|()| self.check_listed(&path))
            .and_then(|()| run_table::read(&path))
            .map_err(|e| {
                // The results mark the sweep as done: without them everything is joined again.
                let resume = sidestep_command("resume", self.path());
                let remedy = format!(
                    "delete `{RESULTS}`; `{resume}` makes it again from the runs in `{SHARES}`"
                );
                InputError::new(e.place(), e.cause(), remedy)
            })
    }

    /// Checks that a table is of this plan and these scenarios.
    fn check_own(&self, path: &Path) -> Result<(), InputError> {
        let [plan, fingerprint] = run_table::read_key_values(path, [PLAN, FINGERPRINT])?;
        // Compared as it is read: another version may have written the same plan in other words.
        let read = plan.and_then(|text| serde_json::from_str::<P>(&text).ok());
        let own = serde_json::to_value(self.plan()).ok();
        let is_same_plan = read.is_some_and(|read| serde_json::to_value(&read).ok() == own);
        if is_same_plan && fingerprint == Some(self.fingerprint()) {
            return Ok(());
        }
        Err(InputError::new(path.display(), "the table is of another sweep", String::new()))
    }
}
