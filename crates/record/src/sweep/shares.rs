//! Shares of a sweep: each has a journal while it runs, and a part of the table once it is done.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnWithRole, RecordError};

use super::folder::{FINGERPRINT, SHARES, SweepFolder};
use super::journal::{Journal, SweepIdentity, is_locked, read_journal};
use crate::disk;
use crate::file_manifest::FileManifest;
use crate::read::unreadable;
use crate::run_table::{self, LoadedTable};

/// A share of the cells: number `index` of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Share {
    /// Its number, from 0.
    pub index: u32,
    /// The number of shares into which the trials are split; those of other numbers may exist beside.
    pub count: u32,
}

impl<P: Serialize + DeserializeOwned> SweepFolder<P> {
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
        Journal::open(&path, self.identity(&self.fingerprint()), each).map(Some)
    }

    /// Writes the runs of a share as its part, and deletes the journal.
    ///
    /// # Errors
    /// An I/O error; the journal stays then.
    pub fn finish_share<R: Serialize>(
        &self,
        share: Share,
        journal: Journal,
        runs: &[&ColumnWithRole<R>],
    ) -> Result<(), RecordError> {
        let version = &self.manifest().program_version;
        let extra = [(FINGERPRINT, self.fingerprint())];
        let mut part =
            run_table::stream(&self.share_file(share, "parquet"), runs, version, &extra)?;
        let mut list = FileManifest::new("table", version);
        list.files.insert(share_name(share, "parquet"), part.close()?);
        list.write(&self.share_file(share, "manifest.json"))?;
        part.finish()?;
        journal.delete()
    }

    /// Passes on the parts of shares that are done, one by one, and those block by block.
    ///
    /// # Errors
    /// A part that cannot be read; blocks before have been passed on.
    pub fn parts<R: DeserializeOwned + Clone>(
        &self,
        mut each: impl FnMut(LoadedTable<R>),
    ) -> Result<(), InputError> {
        for share in self.shares_with("parquet")? {
            let path = self.share_file(share, "parquet");
            self.check_part(&path)?;
            self.check_listed(&path)?;
            let mut version = Ok(());
            run_table::read_blocks(&path, |block| {
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
        let fingerprint = self.fingerprint();
        for share in self.shares_with("journal")? {
            if !done.contains(&share) && Some(share) != but {
                let path = self.share_file(share, "journal");
                read_journal(&path, self.identity(&fingerprint), &mut each)?;
            }
        }
        Ok(())
    }

    /// Returns the shares that were started, in order, and whether each is done.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn shares(&self) -> Result<Vec<(Share, bool)>, InputError> {
        // Journals first: a share that ends between both listings counts as done, not as missing.
        let mut shares = self.shares_with("journal")?;
        let done = self.shares_with("parquet")?;
        shares.extend(&done);
        shares.sort();
        shares.dedup();
        Ok(shares.into_iter().map(|share| (share, done.contains(&share))).collect())
    }

    /// Returns whether a process writes the journal of a share now; none where the file system has no locks.
    pub fn is_locked(&self, share: Share) -> Option<bool> {
        is_locked(&self.share_file(share, "journal"))
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
        read_journal(&path, self.identity(&self.fingerprint()), each)
    }

    fn identity<'a>(&'a self, fingerprint: &'a str) -> SweepIdentity<'a> {
        SweepIdentity { program_version: &self.manifest().program_version, fingerprint }
    }

    /// Checks that the scenarios of a part are those of this sweep.
    fn check_part(&self, path: &Path) -> Result<(), InputError> {
        let [fingerprint] = run_table::read_key_values(path, [FINGERPRINT])?;
        // Parts that are older than this check have no fingerprint.
        if fingerprint.is_none_or(|fingerprint| fingerprint == self.fingerprint()) {
            return Ok(());
        }
        let remedy = "delete it, and run this share again";
        Err(InputError::new(path.display(), "its runs are of another sweep", remedy))
    }

    fn check_version<R>(&self, path: &Path, table: &LoadedTable<R>) -> Result<(), InputError> {
        let part_version = &table.program_version;
        let sweep_version = &self.manifest().program_version;
        if part_version == sweep_version {
            return Ok(());
        }
        let cause =
            format!("its runs are of sidestep {part_version}, the sweep is of {sweep_version}");
        Err(InputError::new(path.display(), cause, "delete it, and run this share again"))
    }

    pub(super) fn share_file(&self, share: Share, extension: &str) -> PathBuf {
        self.path().join(SHARES).join(share_name(share, extension))
    }

    /// Returns the shares that have a file with this extension, in order.
    fn shares_with(&self, extension: &str) -> Result<Vec<Share>, InputError> {
        let folder = self.path().join(SHARES);
        let mut shares = Vec::new();
        for path in disk::list(&folder).map_err(|e| unreadable(&folder, &e))? {
            let name = path.file_name().and_then(|name| name.to_str());
            shares.extend(name.and_then(|name| share_of(name, extension)));
        }
        shares.sort();
        Ok(shares)
    }
}

fn share_name(Share { index, count }: Share, extension: &str) -> String {
    format!("{index}-of-{count}.{extension}")
}

fn share_of(name: &str, extension: &str) -> Option<Share> {
    let (index, count) = name.strip_suffix(extension)?.strip_suffix('.')?.split_once("-of-")?;
    Some(Share { index: index.parse().ok()?, count: count.parse().ok()? })
}
