//! Finished runs in any order -> the table of runs, block by block, within a bounded memory.
//!
//! Each outcome is put into the bucket of its trial: [`BUCKET_TRIALS`] consecutive trials. A sweep of one bucket is joined
//! in memory; with more, buckets are files, read one by one, and one below the other they form the table.

use super::folder::Folder;
use crate::Error;
use sidestep_experiment::sweep::{
    ColumnSchema, Outcome, Plan, RunTable, RunTableBuilder, seeds::PilotRuns,
};
use sidestep_record::sweep::TempFolder;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::PathBuf;

/// Number of trials of a bucket: with 40 metrics, 100 MB while it is sorted.
pub(super) const BUCKET_TRIALS: u64 = 1 << 18;

/// Outcomes that wait to be joined.
pub(super) struct OutcomeBuckets<'a> {
    plan: &'a Plan,
    /// The columns of all outcomes so far: every block has those of the whole table.
    schema: ColumnSchema,
    pilots: PilotRuns<'a>,
    /// Consecutive trials that share a bucket.
    trials: u64,
    storage: BucketStorage,
    /// The first error of a file; reported at the end, because readers of journals pass outcomes on without errors.
    failure: Option<Error>,
}

/// The place of the buckets.
enum BucketStorage {
    /// One bucket is small enough to be joined in memory.
    Memory(RunTableBuilder),
    /// One file for each bucket; the folder deletes itself with them.
    Files(TempFolder, Vec<BufWriter<File>>),
}

impl<'a> OutcomeBuckets<'a> {
    /// Makes room for all runs of a sweep, in buckets of a number of trials.
    ///
    /// # Errors
    /// When files cannot be made.
    pub(super) fn new(folder: &'a Folder, trials: u64) -> Result<Self, Error> {
        let plan = folder.plan();
        let count = plan.len().div_ceil(trials);
        let storage = if count <= 1 {
            BucketStorage::Memory(RunTableBuilder::default())
        } else {
            BucketStorage::create_files(folder.temp_folder()?, count)?
        };
        Ok(Self {
            plan,
            schema: ColumnSchema::default(),
            pilots: PilotRuns::new(plan),
            trials,
            storage,
            failure: None,
        })
    }

    /// Puts an outcome into its bucket, unless it is not in the plan.
    pub(super) fn push(&mut self, outcome: &Outcome) {
        if self.failure.is_some() || self.plan.trial_of(outcome.trial).is_none() {
            return;
        }
        self.schema.add(outcome);
        self.pilots.add(outcome);
        match &mut self.storage {
            BucketStorage::Memory(rows) => rows.push(outcome),
            BucketStorage::Files(folder, files) => {
                let k = outcome.trial / self.trials;
                if let Err(error) = write_line(&mut files[k as usize], outcome) {
                    self.failure = Some(Error::cannot_store(&bucket_path(folder, k), &error));
                }
            }
        }
    }

    /// Passes on the blocks of the table, from the first trials to the last: at least one, even if it has no rows.
    ///
    /// # Errors
    /// When buckets cannot be written or read, two runs of a trial differ, or `each` fails.
    pub(super) fn for_each_block(
        self,
        mut each: impl FnMut(RunTable) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let (folder, files) = match self.storage {
            BucketStorage::Memory(rows) => {
                return each(rows.build_block(self.plan, &self.schema, &self.pilots)?);
            }
            BucketStorage::Files(folder, files) => (folder, files),
        };
        let count = files.len() as u64;
        for (k, file) in (0..).zip(files) {
            // Flushes the buffer and closes the file.
            file.into_inner()
                .map_err(|e| Error::cannot_store(&bucket_path(&folder, k), e.error()))?;
        }
        for k in 0..count {
            let rows = read_bucket(&bucket_path(&folder, k))
                .map_err(|e| Error::cannot_store(folder.path(), &e))?;
            if k == 0 || !rows.is_empty() {
                each(rows.build_block(self.plan, &self.schema, &self.pilots)?)?;
            }
        }
        Ok(())
    }
}

impl BucketStorage {
    fn create_files(folder: TempFolder, count: u64) -> Result<Self, Error> {
        let mut files = Vec::new();
        for k in 0..count {
            let path = bucket_path(&folder, k);
            let file = File::create(&path).map_err(|e| Error::cannot_store(&path, &e))?;
            files.push(BufWriter::new(file));
        }
        Ok(Self::Files(folder, files))
    }
}

fn bucket_path(folder: &TempFolder, k: u64) -> PathBuf {
    folder.path().join(format!("{k:04}.jsonl"))
}

fn write_line(file: &mut BufWriter<File>, outcome: &Outcome) -> std::io::Result<()> {
    serde_json::to_writer(&mut *file, outcome)?;
    file.write_all(b"\n")
}

/// Reads a bucket that this process has written, and removes its file, so that the disk holds no more than it must.
fn read_bucket(path: &std::path::Path) -> std::io::Result<RunTableBuilder> {
    let mut rows = RunTableBuilder::default();
    for line in BufReader::new(File::open(path)?).lines() {
        rows.push(&serde_json::from_str(&line?)?);
    }
    std::fs::remove_file(path)?;
    Ok(rows)
}
