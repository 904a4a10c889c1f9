//! `run.json`: the description of a run, and its progress.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::RecordError;

use crate::file_list::FileList;
use crate::format::{self, FormatVersion};
use crate::mcap_request::McapRequest;
use crate::origin::{CycleOrigin, OriginRange};
use crate::sealed_json::{self, Seal};

/// File by which a folder is known as that of a sweep.
pub(crate) const SWEEP_MANIFEST: &str = "sweep.json";

/// The progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// The run is in progress, or its process was killed and could not record that.
    Running,
    /// Finished; every table is complete.
    Complete,
    /// Stopped in good order before its end.
    Incomplete,
}

/// The content of `run.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the folder's format.
    pub format: FormatVersion,
    /// Version of the program that made the run.
    pub program_version: String,
    /// Build of the program; early folders do not have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub build: Option<String>,
    /// The world that was simulated, e.g. `robots`.
    pub world: String,
    /// The seed of the run, in case an option has replaced that of the scenario.
    pub seed: u64,
    /// Progress of the run.
    pub status: Status,
    /// Cycles that are certainly done; for a killed run, those before its last checkpoint.
    pub cycles_done: u64,
    /// Cycles that the scenario asks for.
    pub cycles_planned: u64,
    /// Digest of the final state, once the run is complete.
    pub digest: Option<String>,
    /// Cycle of the last checkpoint, if there is one.
    pub last_checkpoint: Option<u64>,
    /// The other files of the folder, and their digests; of a run in progress, those of its last checkpoint. Folders of
    /// older versions have none.
    #[serde(default, skip_serializing_if = "FileList::is_empty")]
    pub files: FileList,
    /// Whether each of the cycles done was flown or simulated, by rising cycles; early folders, all of which are
    /// simulated, do not have it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub origins: Vec<OriginRange>,
    /// Whether a flight in real time ended before its planned end: nothing can continue it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_cut_off: bool,
    /// The MCAP file that was asked for, if one was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mcap: Option<McapRequest>,
    /// Number of cycles between the first rows of the table of metrics over time, 0 for none; early folders do not have
    /// that table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub series_every: Option<u64>,
}

impl Manifest {
    /// Reads the manifest at `path`.
    ///
    /// # Errors
    /// A missing file, text that is not a manifest (with line and column), another major format, a wrong digest.
    pub(crate) fn read(path: &Path) -> Result<(Self, Seal), InputError> {
        sealed_json::read_sealed(path)
    }

    /// Replaces the manifest at `path` in one step: a reader finds the old or the new one. It ends with its digest, so
    /// it says that it is of the format that has one.
    pub(crate) fn write(&mut self, path: &Path) -> Result<(), RecordError> {
        self.format = format::CURRENT;
        sealed_json::write_sealed(path, self)
    }
}

/// Returns indented JSON that ends in a newline.
pub(crate) fn json(value: &impl Serialize, path: &Path) -> Result<Vec<u8>, RecordError> {
    let mut text =
        serde_json::to_vec_pretty(value).map_err(|e| RecordError::new(path.display(), e))?;
    text.push(b'\n');
    Ok(text)
}

/// Returns the manifest of a run that starts now.
pub(crate) fn new_manifest(
    world: &str,
    seed: u64,
    program_version: &str,
    cycles_planned: u64,
) -> Manifest {
    Manifest {
        format: format::CURRENT,
        program_version: program_version.to_string(),
        build: None,
        world: world.to_string(),
        seed,
        status: Status::Running,
        cycles_done: 0,
        cycles_planned,
        digest: None,
        last_checkpoint: None,
        files: FileList::default(),
        origins: Vec::new(),
        is_cut_off: false,
        mcap: None,
        series_every: None,
    }
}

impl Manifest {
    /// Returns whether any part of the run is a flight in real time.
    pub fn is_flight(&self) -> bool {
        self.origins.iter().any(|range| range.origin == CycleOrigin::Flown)
    }

    /// Returns whether the run is a flight that nothing has continued by simulation.
    pub fn ends_in_flight(&self) -> bool {
        self.origins.last().is_some_and(|last| last.origin == CycleOrigin::Flown)
    }

    /// Returns how each of the cycles done came about; a folder that does not say so was simulated.
    pub fn all_origins(&self) -> Vec<OriginRange> {
        if self.origins.is_empty() && self.cycles_done > 0 {
            let origin = CycleOrigin::Simulated;
            return vec![OriginRange { from: 0, until: self.cycles_done, origin }];
        }
        self.origins.clone()
    }

    /// Records that all cycles before `done` are done, those after the last recorded range by `origin`.
    pub(crate) fn record_progress(&mut self, done: u64, origin: CycleOrigin) {
        self.cycles_done = done;
        // A run that is continued at a checkpoint does the cycles after it again.
        self.origins.retain(|range| range.from < done || range.from == 0);
        match self.origins.last_mut() {
            Some(last) if last.origin == origin => last.until = done,
            Some(last) => {
                last.until = last.until.min(done);
                let from = last.until;
                self.origins.push(OriginRange { from, until: done, origin });
            }
            None => self.origins.push(OriginRange { from: 0, until: done, origin }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::origin::origins_text;

    /// Reads `text` as a manifest.
    fn read(text: &str) -> Result<Manifest, InputError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.json");
        std::fs::write(&path, text).unwrap();
        Manifest::read(&path).map(|(manifest, _)| manifest)
    }

    fn manifest() -> Manifest {
        new_manifest("robots", u64::MAX, "0.1.0", 5)
    }

    fn text() -> String {
        String::from_utf8(sealed_json::sealed_json(&manifest()).unwrap()).unwrap()
    }

    #[test]
    fn a_manifest_survives_its_json() {
        assert_eq!(read(&text()).unwrap(), manifest());
    }

    #[test]
    fn a_manifest_of_an_older_version_is_read_without_digests() {
        let older = String::from_utf8(json(&manifest(), Path::new("x")).unwrap()).unwrap();
        let older = older.replace("\"1.1\"", "\"1.0\"");
        assert_eq!(read(&older).unwrap().format.to_string(), "1.0");
    }

    #[test]
    fn a_newer_minor_with_unknown_keys_is_read() {
        let newer = text().replace("\"1.1\"", "\"1.7\", \"mood\": 3");
        assert!(read(&newer).unwrap_err().cause().contains("digest"), "it was edited");
        let newer = sealed_json::seal_again(&newer);
        assert_eq!(read(&newer).unwrap().format.to_string(), "1.7");
    }

    #[test]
    fn a_newer_major_is_refused_even_without_the_keys_of_this_one() {
        let error = read(r#"{"format": "2.0", "stages": []}"#).unwrap_err();
        assert!(error.remedy().contains("newer version"), "{error}");
    }

    #[test]
    fn a_damaged_manifest_is_refused_where_it_is_damaged() {
        let whole = text();
        let error = read(&whole[..whole.len() / 2]).unwrap_err();
        assert!(
            error.line_and_column().is_some() && error.cause().contains("no manifest"),
            "{error}"
        );
        assert!(read("").is_err());
        assert!(read("{}").is_err());
        assert!(read(&sealed_json::seal_again(&whole.replace("running", "sleeping"))).is_err());
    }

    #[test]
    fn a_flight_that_is_continued_by_simulation_says_so_of_every_cycle() {
        let mut manifest = new_manifest("airspace", 1, "0.1.0", 400);
        assert!(!manifest.is_flight() && manifest.all_origins().is_empty());
        manifest.record_progress(0, CycleOrigin::Flown);
        assert!(manifest.ends_in_flight(), "before its first cycle");
        manifest.record_progress(87, CycleOrigin::Flown);
        manifest.record_progress(87, CycleOrigin::Simulated);
        assert!(manifest.is_flight() && !manifest.ends_in_flight());
        manifest.record_progress(400, CycleOrigin::Simulated);
        let text = origins_text(&manifest.all_origins());
        assert_eq!(text, "cycles 0 to 86 flown, cycles 87 to 399 simulated");
    }

    #[test]
    fn an_early_folder_was_simulated() {
        let manifest = Manifest { cycles_done: 5, ..new_manifest("robots", 1, "0.1.0", 9) };
        assert_eq!(origins_text(&manifest.all_origins()), "cycles 0 to 4 simulated");
        assert!(!manifest.is_flight());
    }
}
