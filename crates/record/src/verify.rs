//! Whether every file of a run, a sweep, a report or an export is as it was written.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sidestep_kernel::InputError;

use crate::file_list::DamagedFile;
use crate::file_manifest::{EXPORT, FileManifest};
use crate::manifest::{Manifest, SWEEP_MANIFEST, Status};
use crate::mcap::{check_mcap, is_begun_by_us, is_mcap};
use crate::part::first_cycle;
use crate::read::check_part;
use crate::run_content::{RunContent, list_tree, slashed, unreadable};
use crate::run_reader::{MANIFEST, RunReader};
use crate::sealed_json::Seal;
use crate::sweep::SweepFolder;

/// What a path was verified as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VerifiedKind {
    /// A run folder.
    Run,
    /// The folder of a sweep.
    Sweep,
    /// Files with a list beside them: a report or an export.
    Files,
}

impl VerifiedKind {
    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Sweep => "sweep",
            Self::Files => "files",
        }
    }
}

/// The result for one path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verification {
    /// The path, as it was given.
    pub path: PathBuf,
    /// What is there.
    pub kind: VerifiedKind,
    /// Number of files that are as they were written.
    pub sound: usize,
    /// The others: damaged, changed or missing.
    pub damaged: Vec<DamagedFile>,
    /// Files in the folder that this program did not write.
    pub others: Vec<PathBuf>,
    /// What could not be checked, and why.
    pub remarks: Vec<String>,
}

impl Verification {
    fn new(path: &Path, kind: VerifiedKind) -> Self {
        Self {
            path: path.to_path_buf(),
            kind,
            sound: 0,
            damaged: Vec::new(),
            others: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// Returns whether no file is damaged.
    pub fn is_sound(&self) -> bool {
        self.damaged.is_empty()
    }

    /// Records whether a file is sound.
    fn add(&mut self, path: impl Into<PathBuf>, checked: Result<(), InputError>) {
        match checked {
            Ok(()) => self.sound += 1,
            Err(error) => self.damaged.push(DamagedFile::from_error(path.into(), &error)),
        }
    }

    fn add_seal(&mut self, manifest: &Path, seal: Seal) {
        self.sound += 1;
        if seal == Seal::Missing {
            let manifest = manifest.display();
            let remark =
                format!("{manifest} has no digest of its own: written by an older version");
            self.remarks.push(remark);
        }
    }

    /// Adds the files of a list, and returns it.
    fn add_listed(&mut self, list: &Path) -> Option<FileManifest> {
        match FileManifest::read(list) {
            Err(error) => {
                self.damaged.push(DamagedFile::from_error(list.to_path_buf(), &error));
                None
            }
            Ok((manifest, seal)) => {
                self.add_seal(list, seal);
                let damaged = manifest.damaged_in(crate::disk::parent(list));
                self.sound += manifest.files.iter().count() - damaged.len();
                self.damaged.extend(damaged);
                Some(manifest)
            }
        }
    }

    /// Adds a file that no list names: a recording for viewers, or a file of others.
    fn add_other(&mut self, path: PathBuf) {
        if is_mcap(&path) && is_begun_by_us(&path) {
            let checked = check_mcap(&path);
            self.add(path, checked);
        } else {
            self.others.push(path);
        }
    }

    fn append(&mut self, other: Self) {
        self.sound += other.sound;
        self.damaged.extend(other.damaged);
        self.others.extend(other.others);
        self.remarks.extend(other.remarks);
    }
}

/// Verifies a run folder, the folder of a sweep, a report (its page or its list of files), an export (a folder or a file), or
/// an MCAP file.
///
/// # Errors
/// When it is none of these, or cannot be read at all. Damage is no error.
pub fn verify(path: &Path) -> Result<Verification, InputError> {
    if path.join(SWEEP_MANIFEST).is_file() {
        return verify_sweep(path);
    }
    if path.join(MANIFEST).is_file() {
        return verify_run(path);
    }
    match find_list(path) {
        Some(list) => verify_listed(path, &list),
        None if is_mcap(path) => Ok(verify_mcap(path)),
        None => {
            let cause =
                "this is no run, no sweep, and no report or export with a list of its files";
            let remedy = "give a folder that `sidestep run` or `sidestep sweep` wrote, the page of a report, or an exported file";
            Err(InputError::new(path.display(), cause, remedy))
        }
    }
}

/// Returns the list of the files of a report or an export.
fn find_list(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).ok()?.flatten();
        return entries.map(|entry| entry.path()).filter(|path| FileManifest::is_named(path)).min();
    }
    if FileManifest::is_named(path) {
        return Some(path.to_path_buf());
    }
    let stem = FileManifest::name_for(&path.file_stem()?.to_string_lossy());
    let of_folder = path.with_file_name(FileManifest::name_for(EXPORT));
    let mut lists = [FileManifest::beside(path), path.with_file_name(stem), of_folder].into_iter();
    lists.find(|list| list.is_file())
}

fn verify_mcap(path: &Path) -> Verification {
    let mut result = Verification::new(path, VerifiedKind::Files);
    result.add(path, check_mcap(path));
    result
}

/// Verifies the files of a list. A file may be given that it does not name.
fn verify_listed(path: &Path, list: &Path) -> Result<Verification, InputError> {
    let mut result = Verification::new(path, VerifiedKind::Files);
    let manifest = result.add_listed(list);
    let Some(manifest) = manifest else { return Ok(result) };
    let folder = crate::disk::parent(list);
    if path.is_dir() {
        let is_named =
            |file: &PathBuf| folder.join(file) == list || manifest.files.contains(&slashed(file));
        let all = list_tree(path).map_err(|e| unreadable(path, &e))?;
        let others = all.into_iter().filter(|file| !is_named(file));
        result.others.extend(others.map(|file| path.join(file)));
    } else if path != list
        && !manifest.files.iter().any(|(name, _)| list.with_file_name(name) == path)
    {
        let cause = format!("{} does not name this file", list.display());
        let remedy = "give the page of a report, or an exported file";
        return Err(InputError::new(path.display(), cause, remedy));
    }
    Ok(result)
}

fn verify_run(path: &Path) -> Result<Verification, InputError> {
    let mut result = Verification::new(path, VerifiedKind::Run);
    let manifest = path.join(MANIFEST);
    let (manifest, seal) = match Manifest::read(&manifest) {
        Ok((read, seal)) => {
            result.add_seal(&manifest, seal);
            (read, seal)
        }
        Err(error) => {
            result.damaged.push(DamagedFile::from_error(manifest, &error));
            return Ok(result);
        }
    };
    let reader = RunReader { path: path.to_path_buf(), manifest, scenario: String::new(), seal };
    let content = RunContent::new(&reader)?;
    result.damaged.extend(content.damaged.iter().cloned());
    let named = content.listed.len() + content.exported.len();
    result.sound += named.saturating_sub(content.damaged.len());
    for file in list_tree(path).map_err(|e| unreadable(path, &e))? {
        let is_named = content.listed.contains(&file) || content.exported.contains(&file);
        if is_named || file == Path::new(MANIFEST) {
            continue;
        }
        let whole = path.join(&file);
        let part = file.file_name().and_then(|name| name.to_str()).and_then(first_cycle);
        if part.is_some() && (seal == Seal::Missing || content.is_own(&file)) {
            // Its rows have checksums of their own.
            result.add(&whole, check_part(&whole, ""));
        } else if content.is_own(&file) {
            if whole.is_file()
                && !file.ends_with("run.lock")
                && reader.manifest.status != Status::Complete
            {
                result.remarks.push(format!("{} is of a run that was stopped", whole.display()));
            }
        } else if seal == Seal::Confirmed {
            result.add_other(whole);
        }
    }
    Ok(result)
}

fn verify_sweep(path: &Path) -> Result<Verification, InputError> {
    let mut result = Verification::new(path, VerifiedKind::Sweep);
    let manifest = path.join(SWEEP_MANIFEST);
    let folder = match SweepFolder::<Value>::open(path) {
        Ok(folder) => folder,
        Err(error) => {
            result.damaged.push(DamagedFile::from_error(manifest, &error));
            return Ok(result);
        }
    };
    result.add_seal(&manifest, folder.seal());
    let mut own: BTreeSet<PathBuf> = BTreeSet::from([manifest]);
    for (file, checked) in folder.check_all()? {
        result.add(&file, checked);
        own.insert(file);
    }
    for run in folder.run_folders()? {
        if run.join(MANIFEST).is_file() {
            result.append(verify_run(&run)?);
        } else {
            let remark = format!("{} was made by a process that was killed", run.display());
            result.remarks.push(remark);
        }
        own.insert(run);
    }
    let mut others = Vec::new();
    for file in list_tree(path).map_err(|e| unreadable(path, &e))? {
        let whole = path.join(&file);
        if own.iter().any(|own| whole.starts_with(own)) {
            continue;
        }
        if FileManifest::is_named(&whole) {
            let listed = result.add_listed(&whole);
            let folder = crate::disk::parent(&whole);
            let names = listed.iter().flat_map(|list| list.files.iter());
            own.extend(names.map(|(name, _)| folder.join(name)));
            own.insert(whole);
        } else {
            others.push(whole);
        }
    }
    // A report's files sort before its list.
    others.retain(|file| !own.contains(file));
    others.retain(|file| {
        !SweepFolder::<Value>::is_remains(&slashed(file.strip_prefix(path).unwrap_or(file)))
    });
    others.into_iter().for_each(|file| result.add_other(file));
    Ok(result)
}
