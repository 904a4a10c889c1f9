//! What an airplane has reported last, kept on its own machine.
//!
//! An airplane whose node was started again goes on along the fallback that it has reported last. Others remember that, too,
//! but a radio loses reports, so they may remember an earlier one; and several nodes that end at the same time forget each
//! other. What is written down before it is sent is never older than what anybody has heard.

use super::message::FlightReport;
use serde::{Deserialize, Serialize};
use sidestep::kernel::digest::Digest;
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;

/// What stands in the file, after its digest.
#[derive(Debug, Serialize, Deserialize)]
struct JournalEntry {
    /// The number of the flight, by its scenario and the build of the program.
    flight: u64,
    /// When cycle 0 began, in seconds since 1970: the same scenario is flown many times.
    start_s: f64,
    report: FlightReport,
}

/// The journal of one airplane: a file with its last report.
#[derive(Debug)]
pub struct FlightJournal {
    path: PathBuf,
    flight: u64,
}

impl FlightJournal {
    /// Returns the journal of an airplane in a flight. The file need not be there.
    pub fn new(path: PathBuf, flight: u64) -> Self {
        Self { path, flight }
    }

    /// Keeps a report in place of the one before.
    ///
    /// # Errors
    /// When it cannot be written. The one before is still there then.
    pub fn store(&self, start_s: f64, report: &FlightReport) -> io::Result<()> {
        let entry = JournalEntry { flight: self.flight, start_s, report: report.clone() };
        let body = postcard::to_stdvec(&entry).map_err(io::Error::other)?;
        // A file that is written in part must never be read, so it gets its name when it is whole and on disk.
        let written = self.path.with_extension("part");
        let mut file = File::create(&written)?;
        file.write_all(Digest::hash_bytes(&body).as_bytes())?;
        file.write_all(&body)?;
        file.sync_data()?;
        std::fs::rename(&written, &self.path)
    }

    /// Returns the report that was kept of the flight that began at a time; none if there is no such file, or it is of another
    /// flight or damaged.
    pub fn load(&self, start_s: f64) -> Option<FlightReport> {
        let bytes = std::fs::read(&self.path).ok()?;
        let (digest, body) = bytes.split_at_checked(Digest::hash_bytes(&[]).as_bytes().len())?;
        if digest != Digest::hash_bytes(body).as_bytes() {
            return None;
        }
        let entry: JournalEntry = postcard::from_bytes(body).ok()?;
        let is_of_flight = entry.flight == self.flight && entry.start_s == start_s;
        is_of_flight.then_some(entry.report)
    }
}

#[cfg(test)]
mod tests {
    use super::super::message::Standing;
    use super::*;
    use sidestep::scenario::Source;
    use sidestep::worlds::WORLDS;
    use sidestep::worlds::airspace::replica::Replica;
    use sidestep::worlds::airspace::scenario::CompiledAirspace;

    fn report() -> FlightReport {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\ndeployment = \"replica-team\"\ngroups = \"heard\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
        let compiled = WORLDS.compile(&Source::new("two.toml", text, "")).expect("a scenario");
        let airspace: &CompiledAirspace = compiled.as_any().downcast_ref().expect("an airspace");
        let report = Replica::new(airspace, 1).report();
        FlightReport { report, control: Some(vec![1, 2]), standing: Standing::Leads }
    }

    #[test]
    fn what_was_stored_last_is_loaded_and_nothing_of_other_flights_or_damaged_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("airplane-1.journal");
        let journal = FlightJournal::new(path.clone(), 7);
        assert_eq!(journal.load(10.0), None, "there is no file");
        let report = report();
        let before = FlightReport { control: None, ..report.clone() };
        journal.store(10.0, &before).expect("written");
        journal.store(10.0, &report).expect("written");
        assert_eq!(journal.load(10.0), Some(report));
        assert_eq!(journal.load(11.0), None, "another start");
        assert_eq!(FlightJournal::new(path.clone(), 8).load(10.0), None, "another flight");
        let mut bytes = std::fs::read(&path).expect("a file");
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        std::fs::write(&path, &bytes).expect("written");
        assert_eq!(journal.load(10.0), None, "it is damaged");
        std::fs::write(&path, &bytes[..5]).expect("written");
        assert_eq!(journal.load(10.0), None, "it is cut off");
    }

    #[test]
    fn what_cannot_be_written_leaves_what_was_there() {
        let folder = tempfile::tempdir().expect("a folder");
        let journal = FlightJournal::new(folder.path().join("missing/airplane.journal"), 7);
        assert!(journal.store(10.0, &report()).is_err());
    }
}
