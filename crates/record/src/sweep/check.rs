//! Every file of a sweep, checked against what is known of it.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sidestep_kernel::InputError;

use super::folder::{CELLS, RESULTS_STEM, RUNS, SHARES, SweepFolder, TEMP_FOLDER, VARIANTS};
use super::results::{RESULTS, SERIES, TIMINGS};
use crate::disk;
use crate::file_manifest::FileManifest;
use crate::read::unreadable;
use crate::run_reader::LOCK;
use crate::run_table;

/// Files or folders, each with the result of its check.
type CheckedFiles = Vec<(PathBuf, Result<(), InputError>)>;

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
    /// Checks the plan's table, the scenarios, the shares and the results: each file or folder, and whether it is as it
    /// was written.
    ///
    /// # Errors
    /// When the folder cannot be listed.
    pub(crate) fn check_all(&self) -> Result<CheckedFiles, InputError> {
        let mut all = vec![(self.path().join(CELLS), self.check_trials())];
        for variant in 0..self.manifest().fingerprints.len() as u32 {
            let folder = disk::parent(&self.scenario(variant)).to_path_buf();
            all.push((folder, self.check_variant(variant)));
        }
        self.check_shares(&mut all)?;
        let list = self.path().join(FileManifest::name_for(RESULTS_STEM));
        if list.exists() {
            all.push((list.clone(), FileManifest::read(&list).map(drop)));
        }
        if list.exists() || self.is_complete() {
            let has_series = self.has_series();
            let tables = [TIMINGS, SERIES, RESULTS];
            for name in tables.into_iter().filter(|name| *name != SERIES || has_series) {
                let table = self.path().join(name);
                let checked = self.check_listed(&table).and_then(|()| check_rows(&table));
                all.push((table, checked));
            }
        }
        Ok(all)
    }

    fn check_trials(&self) -> Result<(), InputError> {
        self.manifest().files.check_in(self.path(), |_| true)?;
        check_rows(&self.path().join(CELLS))
    }

    fn check_shares(&self, all: &mut CheckedFiles) -> Result<(), InputError> {
        for (share, is_done) in self.shares()? {
            if is_done {
                let list = self.share_file(share, "manifest.json");
                if list.exists() {
                    all.push((list.clone(), FileManifest::read(&list).map(drop)));
                }
                let part = self.share_file(share, "parquet");
                let checked = self.check_listed(&part).and_then(|()| check_rows(&part));
                all.push((part, checked));
            }
            let journal = self.share_file(share, "journal");
            if journal.exists() {
                all.push((journal, self.journal_of(share, |_: Value| ())));
            }
        }
        Ok(())
    }

    /// Returns the folders of recorded runs, in order.
    ///
    /// # Errors
    /// When their folder cannot be listed.
    pub(crate) fn run_folders(&self) -> Result<Vec<PathBuf>, InputError> {
        let runs = self.path().join(RUNS);
        if !runs.is_dir() {
            return Ok(Vec::new());
        }
        let mut folders = disk::list(&runs).map_err(|e| unreadable(&runs, &e))?;
        folders.retain(|path| path.is_dir() && is_run_name(path));
        folders.sort();
        Ok(folders)
    }

    /// Returns whether a path in the folder is what a process leaves that is killed, or an empty folder of a sweep.
    pub(crate) fn is_remains(name: &str) -> bool {
        let whole = name.strip_suffix(".partial").unwrap_or(name);
        let is_share = name.starts_with(SHARES) && (whole != name || name.ends_with(".lock"));
        let is_table = [CELLS, RESULTS, TIMINGS, SERIES].contains(&whole);
        let is_folder = [SHARES, VARIANTS, RUNS, TEMP_FOLDER].contains(&name);
        is_share
            || is_table
            || is_folder
            || name.starts_with(&format!("{TEMP_FOLDER}/"))
            || name == LOCK
    }
}

/// Checks the rows of a table against their checksums, as its readers do.
fn check_rows(table: &Path) -> Result<(), InputError> {
    run_table::read_blocks::<Value>(table, |_| ())
}

fn is_run_name(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.len() >= 6 && name.bytes().all(|byte| byte.is_ascii_digit())
}
