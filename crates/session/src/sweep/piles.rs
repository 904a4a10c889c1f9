//! Finished runs in any order -> the table of runs, block by block, within a bounded memory.
//!
//! Each outcome is put on the pile of its cell: [`PILE`] consecutive cells. A sweep of one pile is joined in memory;
//! with more, piles are files, read one by one, and one below the other they form the table.

use super::gather::Folder;
use crate::Error;
use sidestep::experiment::sweep::{Outcome, Plan, Rows, RunTable, Shape, seeds::Trials};
use sidestep_record::sweep::Scratch;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::PathBuf;

/// Number of cells of a pile: with 40 metrics, 100 MB while it is sorted.
pub(super) const PILE: u64 = 1 << 18;

/// Outcomes that wait to be joined.
pub(super) struct Piles<'a> {
    plan: &'a Plan,
    shape: Shape,
    trials: Trials<'a>,
    cells: u64,
    kept: Kept,
    failure: Option<Error>,
}

/// The place of the piles.
enum Kept {
    /// Rows in memory: there is one pile.
    Here(Rows),
    /// Files of a folder.
    There(Scratch, Vec<BufWriter<File>>),
}

impl<'a> Piles<'a> {
    /// Makes room for all runs of a sweep, in piles of a number of cells.
    ///
    /// # Errors
    /// When files cannot be made.
    pub(super) fn new(folder: &'a Folder, cells: u64) -> Result<Self, Error> {
        let plan = folder.plan();
        let count = plan.len().div_ceil(cells);
        let kept = match count {
            0 | 1 => Kept::Here(Rows::default()),
            _ => {
                let scratch = folder.scratch()?;
                let create = |k| {
                    let path = pile(&scratch, k);
                    File::create(&path).map(BufWriter::new).map_err(|e| Error::write(&path, &e))
                };
                let files = (0..count).map(create).collect::<Result<_, _>>()?;
                Kept::There(scratch, files)
            }
        };
        let (shape, trials) = (Shape::default(), Trials::new(plan));
        Ok(Self { plan, shape, trials, cells, kept, failure: None })
    }

    /// Puts an outcome on its pile, unless it is not in the plan.
    pub(super) fn put(&mut self, outcome: &Outcome) {
        if self.failure.is_some() || self.plan.cell_of(outcome.cell).is_none() {
            return;
        }
        self.shape.note(outcome);
        self.trials.note(outcome);
        match &mut self.kept {
            Kept::Here(rows) => rows.push(outcome),
            Kept::There(scratch, files) => {
                let k = outcome.cell / self.cells;
                if let Err(error) = write_line(&mut files[k as usize], outcome) {
                    self.failure = Some(Error::write(&pile(scratch, k), &error));
                }
            }
        }
    }

    /// Passes on the blocks of the table, from the first cells to the last: at least one, even if it has no rows.
    ///
    /// # Errors
    /// When piles cannot be written or read, two runs of a cell differ, or `each` fails.
    pub(super) fn blocks(
        self,
        mut each: impl FnMut(RunTable) -> Result<(), Error>,
    ) -> Result<(), Error> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        let (scratch, files) = match self.kept {
            Kept::Here(rows) => return each(rows.block(self.plan, &self.shape, &self.trials)?),
            Kept::There(scratch, files) => (scratch, files),
        };
        let count = files.len() as u64;
        for (k, file) in (0..).zip(files) {
            file.into_inner().map_err(|e| Error::write(&pile(&scratch, k), e.error()))?;
        }
        for k in 0..count {
            let rows =
                read_pile(&pile(&scratch, k)).map_err(|e| Error::write(scratch.path(), &e))?;
            if k == 0 || !rows.is_empty() {
                each(rows.block(self.plan, &self.shape, &self.trials)?)?;
            }
        }
        Ok(())
    }
}

fn pile(scratch: &Scratch, k: u64) -> PathBuf {
    scratch.path().join(format!("{k:04}.jsonl"))
}

fn write_line(file: &mut BufWriter<File>, outcome: &Outcome) -> std::io::Result<()> {
    serde_json::to_writer(&mut *file, outcome)?;
    file.write_all(b"\n")
}

/// Reads a pile that this process has written.
fn read_pile(path: &std::path::Path) -> std::io::Result<Rows> {
    let mut rows = Rows::default();
    for line in BufReader::new(File::open(path)?).lines() {
        rows.push(&serde_json::from_str(&line?)?);
    }
    std::fs::remove_file(path)?;
    Ok(rows)
}
