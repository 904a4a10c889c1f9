//! Finished runs in any order -> the table of runs, block by block, within a bounded memory.
//!
//! Each outcome is put on the pile of its trial: [`BUCKET_TRIALS`] consecutive trials. A sweep of one pile is joined in memory;
//! with more, piles are files, read one by one, and one below the other they form the table.

use super::folder::Folder;
use crate::Error;
use sidestep_experiment::sweep::{
    ColumnSchema, Outcome, Plan, RunTable, RunTableBuilder, seeds::PilotRuns,
};
use sidestep_record::sweep::TempFolder;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::PathBuf;

/// Number of trials of a pile: with 40 metrics, 100 MB while it is sorted.
pub(super) const BUCKET_TRIALS: u64 = 1 << 18;

/// Outcomes that wait to be joined.
pub(super) struct OutcomeBuckets<'a> {
    plan: &'a Plan,
    shape: ColumnSchema,
    pilots: PilotRuns<'a>,
    trials: u64,
    kept: BucketStorage,
    failure: Option<Error>,
}

/// The place of the piles.
enum BucketStorage {
    /// Rows in memory: there is one pile.
    Memory(RunTableBuilder),
    /// Files of a folder.
    Files(TempFolder, Vec<BufWriter<File>>),
}

impl<'a> OutcomeBuckets<'a> {
    /// Makes room for all runs of a sweep, in piles of a number of trials.
    ///
    /// # Errors
    /// When files cannot be made.
    pub(super) fn new(folder: &'a Folder, trials: u64) -> Result<Self, Error> {
        let plan = folder.plan();
        let count = plan.len().div_ceil(trials);
        let kept = match count {
            0 | 1 => BucketStorage::Memory(RunTableBuilder::default()),
            _ => {
                let scratch = folder.temp_folder()?;
                let create = |k| {
                    let path = bucket_path(&scratch, k);
                    File::create(&path)
                        .map(BufWriter::new)
                        .map_err(|e| Error::cannot_write(&path, &e))
                };
                let files = (0..count).map(create).collect::<Result<_, _>>()?;
                BucketStorage::Files(scratch, files)
            }
        };
        let (shape, pilots) = (ColumnSchema::default(), PilotRuns::new(plan));
        Ok(Self { plan, shape, pilots, trials, kept, failure: None })
    }

    /// Puts an outcome on its pile, unless it is not in the plan.
    pub(super) fn push(&mut self, outcome: &Outcome) {
        if self.failure.is_some() || self.plan.trial_of(outcome.trial).is_none() {
            return;
        }
        self.shape.add(outcome);
        self.pilots.add(outcome);
        match &mut self.kept {
            BucketStorage::Memory(rows) => rows.push(outcome),
            BucketStorage::Files(scratch, files) => {
                let k = outcome.trial / self.trials;
                if let Err(error) = write_line(&mut files[k as usize], outcome) {
                    self.failure = Some(Error::cannot_write(&bucket_path(scratch, k), &error));
                }
            }
        }
    }

    /// Passes on the blocks of the table, from the first trials to the last: at least one, even if it has no rows.
    ///
    /// # Errors
    /// When piles cannot be written or read, two runs of a trial differ, or `each` fails.
    pub(super) fn for_each_block(
        self,
        mut each: impl FnMut(RunTable) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let (scratch, files) = match self.kept {
            BucketStorage::Memory(rows) => {
                return each(rows.build_block(self.plan, &self.shape, &self.pilots)?);
            }
            BucketStorage::Files(scratch, files) => (scratch, files),
        };
        let count = files.len() as u64;
        for (k, file) in (0..).zip(files) {
            file.into_inner()
                .map_err(|e| Error::cannot_write(&bucket_path(&scratch, k), e.error()))?;
        }
        for k in 0..count {
            let rows = read_bucket(&bucket_path(&scratch, k))
                .map_err(|e| Error::cannot_write(scratch.path(), &e))?;
            if k == 0 || !rows.is_empty() {
                each(rows.build_block(self.plan, &self.shape, &self.pilots)?)?;
            }
        }
        Ok(())
    }
}

fn bucket_path(scratch: &TempFolder, k: u64) -> PathBuf {
    scratch.path().join(format!("{k:04}.jsonl"))
}

fn write_line(file: &mut BufWriter<File>, outcome: &Outcome) -> std::io::Result<()> {
    serde_json::to_writer(&mut *file, outcome)?;
    file.write_all(b"\n")
}

/// Reads a pile that this process has written.
fn read_bucket(path: &std::path::Path) -> std::io::Result<RunTableBuilder> {
    let mut rows = RunTableBuilder::default();
    for line in BufReader::new(File::open(path)?).lines() {
        rows.push(&serde_json::from_str(&line?)?);
    }
    std::fs::remove_file(path)?;
    Ok(rows)
}
