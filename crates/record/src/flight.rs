//! The recording of a flight in real time, which nothing can repeat: its rows are on disk while it lasts, and what a
//! kill leaves behind is cut to whole cycles.

use std::path::PathBuf;

use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::disk;
use crate::file_list::SharedFileList;
use crate::folder::RunFolder;
use crate::manifest::{Manifest, Status};
use crate::origin::CycleOrigin;
use crate::parquet::listed_name;
use crate::part::{first_cycle, next_cycle, parts};
use crate::read::{read_part, tables};
use crate::run_reader::MANIFEST;
use crate::table_file::write_part;

/// The progress of a flight in `run.json`, written by the thread that writes the rows.
#[derive(Debug)]
pub struct FlightProgress {
    path: PathBuf,
    manifest: Manifest,
    origin: CycleOrigin,
    /// The parts on the disk, with the digests of their present bytes.
    files: SharedFileList,
}

impl FlightProgress {
    /// Records that the rows of all cycles before `done` are on disk.
    ///
    /// # Errors
    /// An I/O error; the progress before this one stays.
    pub fn save(&mut self, done: u64) -> Result<(), RecordError> {
        self.manifest.record_progress(done, self.origin);
        self.manifest.files = self.files.lock().clone();
        self.manifest.write(&self.path)
    }
}

impl RunFolder {
    /// Returns the progress of the run, to be written while this value writes nothing.
    pub fn progress(&self) -> FlightProgress {
        FlightProgress {
            path: self.path().join(MANIFEST),
            manifest: self.manifest().clone(),
            origin: self.cycle_origin,
            files: self.files.clone(),
        }
    }

    /// Drops the rows of the cycle at which the recorded flight ends, and of later ones: of these some tables have rows
    /// and others do not. Returns that cycle.
    ///
    /// # Errors
    /// A damaged table; an I/O error.
    pub fn trim_flight(&self) -> Result<u64, InputError> {
        let end = self.manifest().cycles_done;
        for table in tables(self.path())? {
            self.trim_table(&table, end)?;
        }
        Ok(end)
    }

    /// Drops the rows of a table from cycle `end` on.
    fn trim_table(&self, table: &str, end: u64) -> Result<(), InputError> {
        let folder = self.path().join(table);
        let folder = if folder.is_dir() { folder } else { disk::partial_path(&folder) };
        for path in parts(&folder).map_err(storage_error)? {
            let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
            let listed = listed_name(table, name);
            if first_cycle(name).is_some_and(|first| first > end) {
                self.files.lock().retain(|other| other != listed);
                std::fs::remove_file(&path)
                    .map_err(|e| storage_error(RecordError::new(path.display(), e)))?;
            } else if next_cycle(&path).map_err(storage_error)?.is_none_or(|next| next > end) {
                let part = read_part(&path, table, end)?;
                let digest = write_part(&path, &part, end).map_err(storage_error)?;
                self.files.lock().insert(listed, digest);
            }
        }
        Ok(())
    }

    /// Declares a flight cut off after its first `cycles_done` cycles: this is its end. The digest is that of its last
    /// state, where that is known.
    ///
    /// # Errors
    /// An I/O error.
    pub fn cut_off(mut self, cycles_done: u64, digest: Option<&str>) -> Result<(), RecordError> {
        self.update(|manifest| {
            manifest.status = Status::Incomplete;
            manifest.is_cut_off = true;
            manifest.digest = digest.map(str::to_string);
            manifest.record_progress(cycles_done, CycleOrigin::Flown);
        })
    }
}

fn storage_error(error: RecordError) -> InputError {
    InputError::new(error.place, error.cause, "make the folder writable, and make room on its disk")
}
