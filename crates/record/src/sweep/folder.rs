//! The folder of a sweep: created in one step, then only added to.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::{ColumnWithRole, RecordError};
use sidestep_kernel::shell::sidestep_command;
use sidestep_kernel::{Digest, InputError};

use crate::create_error::{CreateError, PathError};
use crate::disk;
use crate::file_list::FileList;
use crate::file_manifest::FileManifest;
use crate::folder::check_vacant;
use crate::format::{self, FormatVersion};
use crate::manifest::SWEEP_MANIFEST as MANIFEST;
use crate::replacement::Replacement;
use crate::run_content::list_tree;
use crate::run_table;
use crate::sealed_json::{self, Seal};
use crate::staging::StagingFolder;

pub(super) const CELLS: &str = "cells.parquet";
pub(super) const RESULTS_STEM: &str = "results";
/// The tables that are listed with the results.
const RESULT_STEMS: [&str; 3] = ["results", "timings", "series"];
pub(super) const SHARES: &str = "shares";
pub(super) const VARIANTS: &str = "variants";
pub(super) const RUNS: &str = "runs";
const SCENARIO: &str = "scenario.toml";
/// Key of the fingerprint of all scenarios in the key-value pairs of a table.
pub(super) const FINGERPRINT: &str = "sidestep.fingerprint";
pub(super) const TEMP_FOLDER: &str = "joining.partial";

/// The content of `sweep.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SweepManifest<P> {
    /// Version of the folder's format.
    pub format: FormatVersion,
    /// Version of the program that made the plan; the same version makes the runs.
    pub program_version: String,
    /// Build of the program; early folders do not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub build: Option<String>,
    /// Fingerprint of the scenario of each variant and the files it names, see [`fingerprint`].
    pub fingerprints: Vec<String>,
    /// The plan, in a format of the caller's.
    pub plan: P,
    /// The table of the plan's trials and its digest; folders of older versions have none.
    #[serde(default, skip_serializing_if = "FileList::is_empty")]
    pub files: FileList,
}

/// The folder of a sweep, with a plan of type `P`.
#[derive(Debug, Clone)]
pub struct SweepFolder<P> {
    path: PathBuf,
    manifest: SweepManifest<P>,
    seal: Seal,
    /// Folders that killed processes left beside it, and that were removed when it was created.
    leftovers: Vec<PathBuf>,
}

/// A folder that is deleted when this is dropped.
#[derive(Debug)]
pub struct TempFolder(PathBuf);

impl TempFolder {
    /// Returns its path; no bucket of runs below it is left once this is dropped.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for TempFolder {
    fn drop(&mut self) {
        // This process has removed most of its files. Another's keeps the folder.
        let files = list_tree(&self.0).unwrap_or_default();
        for file in files.iter().filter(|file| is_bucket(file)) {
            let _ = fs::remove_file(self.0.join(file));
        }
        let _ = fs::remove_dir(&self.0);
    }
}

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
    /// Creates the folder at `path`, completely or not at all. `fill` writes the variants into the
    /// future folder (see [`write_variant`](Self::write_variant)) and returns the plan, the
    /// fingerprints of its variants and the table of its cells.
    ///
    /// # Errors
    /// Something else is there, no folder can be created there, or `fill` fails.
    pub fn create<R: Serialize, E: From<InputError> + PathError>(
        path: &Path,
        program_version: &str,
        build: &str,
        fill: impl FnOnce(&Path) -> Result<(P, Vec<String>, Vec<ColumnWithRole<R>>), E>,
    ) -> Result<Self, E> {
        if Self::is_at(path) {
            let resume = sidestep_command("resume", path);
            let remedy =
                format!("give another folder, or continue the sweep in this one: `{resume}`");
            let cause = "the folder holds a sweep already";
            return Err(InputError::new(path.display(), cause, remedy).into());
        }
        check_vacant(path, crate::IfExists::Refuse)?;
        let staging = StagingFolder::new(path).map_err(CreateError::into_error::<E>)?;
        check_vacant(path, crate::IfExists::Refuse)?;
        let manifest = staging.fill(|folder| {
            let (plan, fingerprints, cells) = fill(folder)?;
            make_folder(&folder.join(SHARES))?;
            let cells: Vec<_> = cells.iter().collect();
            let mut table = run_table::stream(&folder.join(CELLS), &cells, program_version, &[])?;
            let mut files = FileList::default();
            files.insert(CELLS, table.close()?);
            table.finish()?;
            let manifest = SweepManifest {
                format: format::CURRENT,
                program_version: program_version.into(),
                build: Some(build.into()),
                fingerprints,
                plan,
                files,
            };
            sealed_json::write_sealed(&folder.join(MANIFEST), &manifest)?;
            disk::sync_below(folder)?;
            Ok::<_, E>(manifest)
        })?;
        let leftovers = staging.leftovers().to_vec();
        staging.commit(&Replacement::default()).map_err(CreateError::into_error::<E>)?;
        Ok(Self { path: path.to_path_buf(), manifest, seal: Seal::Confirmed, leftovers })
    }

    /// Returns the folders that killed processes left beside it, and that were removed when it was created.
    pub fn leftovers(&self) -> &[PathBuf] {
        &self.leftovers
    }

    /// Writes the scenario of a variant, and the files it names, into a folder that
    /// [`create`](Self::create) makes.
    ///
    /// # Errors
    /// An I/O error.
    pub fn write_variant(
        folder: &Path,
        variant: u32,
        text: &str,
        files: &[(String, Vec<u8>)],
    ) -> Result<(), RecordError> {
        let folder = variant_folder(folder, variant);
        make_folder(&folder)?;
        for (name, bytes) in files {
            let file = folder.join(name);
            make_folder(disk::parent(&file))?;
            disk::write_new(&file, bytes)?;
        }
        disk::write_new(&folder.join(SCENARIO), text.as_bytes())
    }

    /// Returns whether a folder holds a sweep, even if its manifest is damaged.
    pub fn is_at(path: &Path) -> bool {
        path.join(MANIFEST).is_file()
    }

    /// Opens the folder at `path`.
    ///
    /// # Errors
    /// A folder without a sweep; a damaged manifest; another major format.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        if !Self::is_at(path) {
            let cause = format!("this is no sweep: it holds no `{MANIFEST}`");
            let remedy = "give the folder that a sweep was written to";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        let (manifest, seal) = sealed_json::read_sealed(&path.join(MANIFEST))?;
        Ok(Self { path: path.to_path_buf(), manifest, seal, leftovers: Vec::new() })
    }

    /// Returns whether the manifest confirms its own content; that of older versions has no digest.
    pub fn seal(&self) -> Seal {
        self.seal
    }

    /// Checks a file against the digest in `STEM.manifest.json` beside it. Folders of older versions have no such list.
    pub(super) fn check_listed(&self, file: &Path) -> Result<(), InputError> {
        let (Some(name), Some(stem)) = (file.file_name(), file.file_stem()) else { return Ok(()) };
        let stem = stem.to_str().unwrap_or_default();
        let stem = if RESULT_STEMS.contains(&stem) { RESULTS_STEM } else { stem };
        let list = file.with_file_name(FileManifest::name_for(stem));
        if self.seal == Seal::Missing && !list.exists() {
            return Ok(());
        }
        let (list, _) = FileManifest::read(&list)?;
        let name = name.to_string_lossy();
        if !list.files.contains(&name) {
            let remedy = "the list of its files was changed: restore it";
            return Err(InputError::new(
                file.display(),
                "no digest of this file is listed",
                remedy,
            ));
        }
        list.files.check_in(disk::parent(file), |listed| listed == name)
    }

    /// Returns the path of the folder, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the content of `sweep.json`, as it was read.
    pub fn manifest(&self) -> &SweepManifest<P> {
        &self.manifest
    }

    /// Returns the plan, which never changes after the folder was made.
    pub fn plan(&self) -> &P {
        &self.manifest.plan
    }

    /// Returns the path of the scenario file of a variant.
    pub fn scenario(&self, variant: u32) -> PathBuf {
        variant_folder(&self.path, variant).join(SCENARIO)
    }

    /// Checks that the scenario of a variant and its files have not changed since they were
    /// planned.
    ///
    /// # Errors
    /// A scenario or file that has changed, or cannot be read.
    pub fn check_variant(&self, variant: u32) -> Result<(), InputError> {
        let folder = variant_folder(&self.path, variant);
        let mut files = Vec::new();
        read_files(&folder, "", &mut files).map_err(|(path, e)| {
            let remedy = "put it back, or sweep into a new folder";
            InputError::new(path.display(), format!("cannot be read: {e}"), remedy)
        })?;
        let position = files.iter().position(|(name, _)| name == SCENARIO);
        let scenario = position.map(|k| files.swap_remove(k).1);
        let found = fingerprint(&scenario.unwrap_or_default(), &files);
        if self.manifest.fingerprints.get(variant as usize) == Some(&found) {
            return Ok(());
        }
        let cause = "the scenario of this variant is not as it was planned";
        let remedy = "put it back as it was, or sweep into a new folder";
        Err(InputError::new(folder.display(), cause, remedy))
    }

    /// Returns one digest of all variants, in hexadecimal.
    pub fn fingerprint(&self) -> String {
        Digest::hash_bytes(self.manifest.fingerprints.concat().as_bytes()).to_string()
    }

    /// Returns the folder in which the run of a cell is recorded, if it is.
    pub fn run_folder(&self, cell: u64) -> PathBuf {
        self.path.join(RUNS).join(format!("{cell:06}"))
    }

    /// Returns an empty folder of its own in this one, for data that does not fit in memory while runs are joined.
    /// Remains of a killed process are deleted there.
    ///
    /// # Errors
    /// An I/O error.
    pub fn temp_folder(&self) -> Result<TempFolder, RecordError> {
        let path = self.path.join(TEMP_FOLDER);
        let failed = |e: std::io::Error| RecordError::new(path.display(), e);
        if path.exists() {
            let remains = list_tree(&path).map_err(failed)?;
            let other = remains.iter().find(|file| !is_bucket(file));
            if let Some(other) = other {
                let cause = "this file is in the way: move it elsewhere";
                return Err(RecordError::new(path.join(other).display(), cause));
            }
            for file in remains {
                fs::remove_file(path.join(file)).map_err(failed)?;
            }
        }
        make_folder(&path)?;
        Ok(TempFolder(path))
    }
}

/// Returns whether a file has the name of a bucket of runs.
fn is_bucket(file: &Path) -> bool {
    let Some(name) = file.to_str().and_then(|name| name.strip_suffix(".jsonl")) else {
        return false;
    };
    !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_digit())
}

/// Returns a digest of a scenario and the files it names, in hexadecimal; their order does not
/// matter.
pub fn fingerprint(scenario: &[u8], files: &[(String, Vec<u8>)]) -> String {
    let mut sorted: Vec<_> = files.iter().collect();
    sorted.sort();
    let mut all = vec![hex_digest(scenario)];
    for (name, bytes) in sorted {
        all.push(name.clone());
        all.push(hex_digest(bytes));
    }
    hex_digest(all.join("\n").as_bytes())
}

fn hex_digest(bytes: &[u8]) -> String {
    Digest::hash_bytes(bytes).to_string()
}

/// Reads all files below a folder, by their path in it.
fn read_files(
    folder: &Path,
    under: &str,
    files: &mut Vec<(String, Vec<u8>)>,
) -> Result<(), (PathBuf, std::io::Error)> {
    for entry in fs::read_dir(folder).map_err(|e| (folder.to_path_buf(), e))? {
        let path = entry.map_err(|e| (folder.to_path_buf(), e))?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let name = format!("{under}{}", name.unwrap_or_default());
        if path.is_dir() {
            read_files(&path, &format!("{name}/"), files)?;
        } else {
            let bytes = fs::read(&path).map_err(|e| (path.clone(), e))?;
            files.push((name, bytes));
        }
    }
    Ok(())
}

fn variant_folder(folder: &Path, variant: u32) -> PathBuf {
    folder.join(VARIANTS).join(format!("{variant:04}"))
}

fn make_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|e| RecordError::new(path.display(), e))
}

#[cfg(test)]
mod tests;
