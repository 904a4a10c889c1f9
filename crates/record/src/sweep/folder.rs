//! The folder of a sweep: created in one step, then only added to.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep_kernel::ports::{RecordError, RoleColumn};
use sidestep_kernel::{Digest, InputError};

use super::journal::{Journal, read_journal};
use crate::disk;
use crate::folder::check_vacant;
use crate::format::{self, FormatVersion};
use crate::manifest::{self, OF_SWEEP as MANIFEST, json};
use crate::staging::Staging;
use crate::whole::{self, GrowingTable, WholeTable};

const CELLS: &str = "cells.parquet";
const RESULTS: &str = "results.parquet";
const TIMINGS: &str = "timings.parquet";
const SHARES: &str = "shares";
const VARIANTS: &str = "variants";
const RUNS: &str = "runs";
const SCENARIO: &str = "scenario.toml";
const SCRATCH: &str = "joining.partial";

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
    /// The plan.
    pub plan: P,
}

/// A share of the cells: number `index` of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Share {
    /// Its number, from 0.
    pub index: u32,
    /// The number of shares.
    pub count: u32,
}

/// The folder of a sweep.
#[derive(Debug, Clone)]
pub struct SweepFolder<P> {
    path: PathBuf,
    manifest: SweepManifest<P>,
}

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

/// A folder that goes with whoever holds it.
#[derive(Debug)]
pub struct Scratch(PathBuf);

impl Scratch {
    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
    /// Creates the folder at `path`, completely or not at all. `fill` writes the variants into what
    /// becomes the folder (see [`write_variant`](Self::write_variant)) and returns the plan, the
    /// fingerprints of its variants and the table of its cells.
    ///
    /// # Errors
    /// Something else is there, no folder can be created there, or `fill` fails.
    pub fn create<R: Serialize, E: From<InputError> + From<RecordError>>(
        path: &Path,
        program_version: &str,
        build: &str,
        fill: impl FnOnce(&Path) -> Result<(P, Vec<String>, Vec<RoleColumn<R>>), E>,
    ) -> Result<Self, E> {
        if Self::is_at(path) {
            let remedy = "name another folder, or go on with what is there: sidestep resume DIR";
            let cause = "the folder holds a sweep already";
            return Err(InputError::new(path.display(), cause, remedy).into());
        }
        check_vacant(path, crate::Existing::Refuse)?;
        let staging = Staging::new(path)?;
        let (plan, fingerprints, cells) = fill(staging.path())?;
        let manifest = SweepManifest {
            format: format::CURRENT,
            program_version: program_version.into(),
            build: Some(build.into()),
            fingerprints,
            plan,
        };
        make_folder(&staging.path().join(SHARES))?;
        let cells: Vec<_> = cells.iter().collect();
        whole::write(&staging.path().join(CELLS), &cells, program_version, &[])?;
        let file = staging.path().join(MANIFEST);
        disk::replace(&file, &json(&manifest, &file)?)?;
        disk::sync_below(staging.path())?;
        staging.take_place_of(path)?;
        Ok(Self { path: path.to_path_buf(), manifest })
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
            disk::put(&file, bytes)?;
        }
        disk::put(&folder.join(SCENARIO), text.as_bytes())
    }

    /// Whether a folder holds a sweep, even if its manifest is damaged.
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
            let remedy = "name the folder that a sweep was written to";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        let manifest = manifest::read_json(&path.join(MANIFEST))?;
        Ok(Self { path: path.to_path_buf(), manifest })
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the content of `sweep.json`.
    pub fn manifest(&self) -> &SweepManifest<P> {
        &self.manifest
    }

    /// Returns the plan.
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
        let is_scenario = |(name, _): &(String, Vec<u8>)| name == SCENARIO;
        let scenario = files.iter().position(is_scenario).map(|k| files.swap_remove(k).1);
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
        Digest::of(self.manifest.fingerprints.concat().as_bytes()).to_string()
    }

    /// Returns the folder in which the run of a cell is recorded, if it is.
    pub fn run_folder(&self, cell: u64) -> PathBuf {
        self.path.join(RUNS).join(format!("{cell:06}"))
    }

    /// Opens the journal of a share to write, and passes its entries on; `None` if the share is
    /// done.
    ///
    /// # Errors
    /// A journal that another process writes, or that is damaged.
    pub fn journal<T: DeserializeOwned>(
        &self,
        share: Share,
        each: impl FnMut(T),
    ) -> Result<Option<Journal>, InputError> {
        if self.share_file(share, "parquet").is_file() {
            return Ok(None);
        }
        let path = self.share_file(share, "journal");
        Journal::open(&path, &self.manifest.program_version, each).map(Some)
    }

    /// Writes the runs of a share as its part, and deletes the journal.
    ///
    /// # Errors
    /// An I/O error; the journal stays then.
    pub fn end_share<R: Serialize>(
        &self,
        share: Share,
        journal: Journal,
        runs: &[&RoleColumn<R>],
    ) -> Result<(), RecordError> {
        let version = &self.manifest.program_version;
        whole::write(&self.share_file(share, "parquet"), runs, version, &[])?;
        drop(journal);
        let path = self.share_file(share, "journal");
        fs::remove_file(&path).map_err(|e| RecordError::new(path.display(), e))
    }

    /// Passes on the parts of shares that are done, one by one, and those block by block.
    ///
    /// # Errors
    /// A part that cannot be read; blocks before have been passed on.
    pub fn parts<R: DeserializeOwned + Clone>(
        &self,
        mut each: impl FnMut(WholeTable<R>),
    ) -> Result<(), InputError> {
        for share in self.shares_with("parquet")? {
            let path = self.share_file(share, "parquet");
            let mut version = Ok(());
            whole::read_blocks(&path, |block| {
                version = self.check_version(&path, &block);
                if version.is_ok() {
                    each(block);
                }
            })?;
            version?;
        }
        Ok(())
    }

    /// Passes on the runs of shares that are in progress or were stopped; not of those with a part,
    /// nor of `but`.
    ///
    /// # Errors
    /// A journal that cannot be read.
    pub fn journals<T: DeserializeOwned>(
        &self,
        but: Option<Share>,
        mut each: impl FnMut(T),
    ) -> Result<(), InputError> {
        let done = self.shares_with("parquet")?;
        for share in self.shares_with("journal")? {
            if !done.contains(&share) && Some(share) != but {
                let path = self.share_file(share, "journal");
                read_journal(&path, &self.manifest.program_version, &mut each)?;
            }
        }
        Ok(())
    }

    /// Returns the shares that somebody has begun, in order, and whether each is done.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn shares(&self) -> Result<Vec<(Share, bool)>, InputError> {
        // Journals first: a share that ends between both looks is seen as one that is done.
        let mut shares = self.shares_with("journal")?;
        let done = self.shares_with("parquet")?;
        shares.extend(&done);
        shares.sort();
        shares.dedup();
        Ok(shares.into_iter().map(|share| (share, done.contains(&share))).collect())
    }

    /// Passes on the finished runs of a share that is in progress or was stopped.
    ///
    /// # Errors
    /// A journal that cannot be read, also because the share has ended meanwhile.
    pub fn journal_of<T: DeserializeOwned>(
        &self,
        share: Share,
        each: impl FnMut(T),
    ) -> Result<(), InputError> {
        let path = self.share_file(share, "journal");
        read_journal(&path, &self.manifest.program_version, each)
    }

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
            .map_err(|e| RecordError::new(self.path.display(), e))?;
        let extra = [("sidestep.plan", plan), ("sidestep.fingerprint", self.fingerprint())];
        let version = &self.manifest.program_version;
        let table = |name: &str, columns| {
            GrowingTable::create(&self.path.join(name), columns, version, &extra)
        };
        Ok(Completion { timings: table(TIMINGS, timings)?, results: table(RESULTS, results)? })
    }

    /// Returns an empty folder of its own in this one, for what does not fit in memory while runs are joined. What a
    /// kill has left there is taken away.
    ///
    /// # Errors
    /// An I/O error.
    pub fn scratch(&self) -> Result<Scratch, RecordError> {
        let path = self.path.join(SCRATCH);
        let failed = |e: std::io::Error| RecordError::new(path.display(), e);
        if path.exists() {
            fs::remove_dir_all(&path).map_err(failed)?;
        }
        make_folder(&path)?;
        Ok(Scratch(path))
    }

    /// Whether the table of all runs exists.
    pub fn is_complete(&self) -> bool {
        self.results_file().is_file()
    }

    /// Returns the path of the table of all runs.
    pub fn results_file(&self) -> PathBuf {
        self.path.join(RESULTS)
    }

    /// Reads the table of all runs.
    ///
    /// # Errors
    /// A sweep that is not done, or a damaged table.
    pub fn results<R: DeserializeOwned + Clone>(&self) -> Result<WholeTable<R>, InputError> {
        if !self.is_complete() {
            let remedy = "go on with `sidestep resume DIR`, or run its shares and \
                          `sidestep sweep collect DIR`";
            return Err(InputError::new(self.path.display(), "the sweep is not done yet", remedy));
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
        whole::read(&self.path.join(TIMINGS))
    }

    fn check_version<R>(&self, path: &Path, table: &WholeTable<R>) -> Result<(), InputError> {
        let (wrote, ours) = (&table.program_version, &self.manifest.program_version);
        if wrote == ours {
            return Ok(());
        }
        let cause = format!("its runs are of sidestep {wrote}, the sweep is of {ours}");
        Err(InputError::new(path.display(), cause, "delete it, and run this share again"))
    }

    fn share_file(&self, share: Share, extension: &str) -> PathBuf {
        let Share { index, count } = share;
        self.path.join(SHARES).join(format!("{index}-of-{count}.{extension}"))
    }

    /// Returns the shares that have a file with this extension, in order.
    fn shares_with(&self, extension: &str) -> Result<Vec<Share>, InputError> {
        let folder = self.path.join(SHARES);
        let failed = |e: std::io::Error| {
            InputError::new(folder.display(), e.to_string(), "make the folder readable")
        };
        let mut shares = Vec::new();
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let name = entry.map_err(failed)?.file_name();
            shares.extend(name.to_str().and_then(|name| share_of(name, extension)));
        }
        shares.sort();
        Ok(shares)
    }
}

/// Returns a digest of a scenario and the files it names, in hexadecimal; their order does not
/// matter.
pub fn fingerprint(scenario: &[u8], files: &[(String, Vec<u8>)]) -> String {
    let mut sorted: Vec<_> = files.iter().collect();
    sorted.sort();
    let print = |bytes: &[u8]| Digest::of(bytes).to_string();
    let files = sorted.into_iter().flat_map(|(name, bytes)| [name.clone(), print(bytes)]);
    let all: Vec<String> = std::iter::once(print(scenario)).chain(files).collect();
    print(all.join("\n").as_bytes())
}

/// Reads all files below a folder, by their path in it.
fn read_files(
    folder: &Path,
    under: &str,
    files: &mut Vec<(String, Vec<u8>)>,
) -> Result<(), (PathBuf, std::io::Error)> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |e| (path, e)
    };
    for entry in fs::read_dir(folder).map_err(failed(folder))? {
        let path = entry.map_err(failed(folder))?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let name = format!("{under}{}", name.unwrap_or_default());
        match path.is_dir() {
            true => read_files(&path, &format!("{name}/"), files)?,
            false => files.push((name, fs::read(&path).map_err(failed(&path))?)),
        }
    }
    Ok(())
}

/// Returns the share whose file has this name.
fn share_of(name: &str, extension: &str) -> Option<Share> {
    let (index, count) = name.strip_suffix(extension)?.strip_suffix('.')?.split_once("-of-")?;
    Some(Share { index: index.parse().ok()?, count: count.parse().ok()? })
}

fn variant_folder(folder: &Path, variant: u32) -> PathBuf {
    folder.join(VARIANTS).join(format!("{variant:04}"))
}

fn make_folder(path: &Path) -> Result<(), RecordError> {
    fs::create_dir_all(path).map_err(|e| RecordError::new(path.display(), e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::Values;

    type Folder = SweepFolder<Vec<u32>>;

    #[derive(Debug, thiserror::Error)]
    #[error("{0}")]
    struct Failed(String);

    impl From<InputError> for Failed {
        fn from(e: InputError) -> Self {
            Self(e.to_string())
        }
    }

    impl From<RecordError> for Failed {
        fn from(e: RecordError) -> Self {
            Self(e.to_string())
        }
    }

    fn cells() -> Vec<RoleColumn<String>> {
        let values = Values::I64(vec![0, 1].into());
        vec![RoleColumn { name: "cell".into(), role: "cell".into(), values }]
    }

    fn create(path: &Path) -> Result<Folder, Failed> {
        Folder::create(path, "0.1.0", "0.1.0+a", |staging| {
            let files = [("inputs/a.txt".to_string(), b"a".to_vec())];
            Folder::write_variant(staging, 0, "seed = 1\n", &files)?;
            Ok((vec![4, 5], vec!["f".into()], cells()))
        })
    }

    #[test]
    fn a_sweep_goes_from_plan_over_shares_to_one_table() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("sweep");
        let folder = create(&path).unwrap();
        assert_eq!(fs::read_to_string(folder.scenario(0)).unwrap(), "seed = 1\n");
        let share = Share { index: 1, count: 2 };
        let mut journal = folder.journal(share, |_: u32| panic!("a run")).unwrap().unwrap();
        journal.append(&7u32).unwrap();
        let runs = |but| {
            let mut runs: Vec<u32> = Vec::new();
            folder.journals(but, |run| runs.push(run)).unwrap();
            runs
        };
        assert_eq!((runs(None), runs(Some(share))), (vec![7], vec![]));
        let cells_again = cells();
        let refs: Vec<_> = cells_again.iter().collect();
        folder.end_share(share, journal, &refs).unwrap();
        let again = folder.journal(share, |_: u32| ()).unwrap();
        assert!(again.is_none(), "a share that is done is done");
        assert!(runs(None).is_empty());
        let mut parts = Vec::new();
        folder.parts(|part| parts.push(part.columns)).unwrap();
        assert_eq!(parts, [cells()]);
        assert!(folder.results::<String>().unwrap_err().cause().contains("not done"));
        let mut completion = folder.completion(&refs, &refs).unwrap();
        assert!(!folder.is_complete());
        completion.append(&refs, &refs).unwrap();
        completion.append(&refs, &refs).unwrap();
        completion.finish().unwrap();
        let again = Folder::open(&path).unwrap();
        assert_eq!((again.plan(), again.is_complete()), (&vec![4, 5], true));
        let twice = Values::I64(vec![0, 1, 0, 1].into());
        assert_eq!(again.results::<String>().unwrap().columns[0].values, twice);
    }

    #[test]
    fn a_table_of_runs_that_is_not_finished_and_a_place_to_join_them_leave_nothing() {
        let place = tempfile::tempdir().unwrap();
        let folder = create(&place.path().join("sweep")).unwrap();
        let names = || {
            let entries = fs::read_dir(folder.path()).unwrap();
            let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        let before = names();
        let columns = cells();
        let refs: Vec<_> = columns.iter().collect();
        let mut completion = folder.completion(&refs, &refs).unwrap();
        completion.append(&refs, &refs).unwrap();
        drop(completion);
        // A kill leaves its files there.
        std::mem::forget(folder.scratch().unwrap());
        fs::write(folder.path().join(SCRATCH).join("old"), "rest").unwrap();
        let scratch = folder.scratch().unwrap();
        assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 0);
        drop(scratch);
        assert_eq!(names(), before);
    }

    #[test]
    fn a_plan_that_fails_leaves_nothing() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a/sweep");
        let made =
            Folder::create::<String, _>(&path, "0.1.0", "0.1.0+a", |_| Err(Failed("no".into())));
        assert!(made.is_err());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    }

    #[test]
    fn nothing_of_yours_is_overwritten() {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("letter.txt"), "dear").unwrap();
        assert!(create(place.path()).is_err());
        assert!(Folder::open(place.path()).unwrap_err().cause().contains("no sweep"));
    }
}
