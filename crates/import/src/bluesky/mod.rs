//! Scenario files (`.scn`) of the air traffic simulator BlueSky, as its version 1.1.1 reads them.
//!
//! A line is `HH:MM:SS.ss>COMMAND arguments`. The syntax of such files:
//! - Of a time the first three parts count; minutes and seconds may be 60 or more.
//! - `#` starts a comment, `;` separates commands, `\` at the end continues a line after a blank, and a line of fewer
//!   than 10 characters that continues none is skipped.
//! - Arguments are separated by blanks, a comma, or both; `,,` and `*` leave one out, quotes hold one together. Letters
//!   may be small or capital. `KL204 ALT FL200` is `ALT KL204 FL200`; an aircraft alone is `POS`.
//! - Commands take effect in the order of their times, at one time in the order of the file. So
//!   a way-point must be defined, and an aircraft created, before it is used.
//! - `PCALL` reads a file in the same folder, with `%0`, `%1`, ... replaced, relative to the time of the call.
//!
//! The commands that take effect are `CRE`, `CRECMD`, `CLRCRECMD`, `CRECONFS`, `DEL`, `DEFWPT`, `ADDWPT`, `AFTER` and `BEFORE`
//! `.. ADDWPT`, `AT`, `RTA`, `ORIG`, `DEST`, `HDG`, `SPD`, `ALT`, `VS`, `LNAV`, `VNAV`, `SYN SUPER|WALL|MATRIX`, the
//! settings of [`Setting`] and [`AircraftSetting`], `PCALL`, `IC`, `SCHEDULE`, `DELAY`, `RESET` and `QUIT`. Nothing is
//! dropped silently: each line that has no effect is in [`ScnFile::unused`] with the reason, each command and argument
//! that is not acted on in [`ScnFile::report`], and errors and names that need a navigation database are listed.

mod calls;
mod interpreter;
mod lines;
mod navdata;
mod options;
mod schedule;
mod speed;
mod synthetic;
#[cfg(test)]
pub(super) mod tests;
mod text;
#[cfg(test)]
mod text_tests;
mod traffic;
mod values;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

pub use navdata::NavigationData;
pub use options::{ScnOptions, UnusedCommand};
pub use speed::{Airspeed, FOOT_M, KNOT_MPS};
pub use traffic::{
    AircraftCommand, AircraftSetting, HorizontalResolution, PositionRef, PriorityRule,
    ResolutionMethod, ScnAircraft, Setting, TimedSetting, Traffic, UnplacedAircraft, WayPoint,
    Wind,
};

use super::report::ImportReport;
use calls::CallFolder;
use interpreter::Interpreter;
use sidestep_kernel::InputError;
use text::ScnText;

/// The rule of a report for commands that have no effect on what flies.
pub const DISPLAY_RULE: &str = "commands that change or ask a display only";

/// The rule of types of aircraft, which a world that knows them takes out of the report.
pub const TYPES_RULE: &str =
    "types of aircraft: each flies with the speeds and climbs of its commands";

/// The maximum size of a scenario in bytes after decompression: some 160 times the longest known.
pub const MAX_SCN_BYTES: u64 = 1 << 24;

/// The maximum number of aircraft that one scenario may create.
pub const MAX_AIRCRAFT: usize = 100_000;

/// The maximum number of way-points in one aircraft's route.
pub const MAX_WAY_POINTS: usize = 10_000;

/// The content of a scenario file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScnFile {
    /// Number of lines with at least one command; a line and its continuations are one.
    pub command_lines: u64,
    /// Number of lines that were skipped because they have fewer than 10 characters; blank lines
    /// and comments do not count.
    pub short_lines: u64,
    /// Number of occurrences of each command, by its name in capital letters.
    pub commands: BTreeMap<String, u64>,
    /// Number of occurrences of each command that has no effect here. `SYN` and `AFTER` are
    /// followed by the variant that is not understood.
    pub not_understood: BTreeMap<String, u64>,
    /// Number of occurrences of each command that only changes or queries a display.
    pub ignored: BTreeMap<String, u64>,
    /// Lines and commands that cannot be parsed, in the order of the file.
    pub unparsed: Vec<InputError>,
    /// Commands that can be parsed but not be carried out, such as those to an aircraft that does
    /// not exist; in the order of their times.
    pub refused: Vec<InputError>,
    /// Names of places that the file does not define, one entry for each use.
    pub unresolved_places: Vec<UnresolvedPosition>,
    /// The commands without effect, in the order in which they were due, at most 100,000.
    pub unused: Vec<UnusedCommand>,
    /// What was read, and what is not acted on, by rule.
    pub report: ImportReport,
    /// The aircraft and their rules.
    pub traffic: Traffic,
}

/// A use of a name that only a navigation database can resolve.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnresolvedPosition {
    /// The name of the airport, runway or fix, in capital letters.
    pub name: String,
    /// The command that uses it.
    pub command: String,
    /// The aircraft it is for, if any.
    pub aircraft: Option<String>,
    /// Line in the file, from 1.
    pub line: usize,
}

/// Reads a scenario file, plain or compressed with gzip.
///
/// # Errors
/// When it cannot be read; errors in its text are listed in the result.
pub fn read(path: &Path) -> Result<ScnFile, InputError> {
    read_with(path, &ScnOptions::default())
}

/// Reads a scenario file, plain or compressed with gzip, and the tables of its places.
///
/// # Errors
/// When the file or a table cannot be read; errors in its text are listed in the result.
pub fn read_with(path: &Path, options: &ScnOptions) -> Result<ScnFile, InputError> {
    let navdata = match &options.navdata {
        Some(folder) => NavigationData::read(folder)?,
        None => NavigationData::default(),
    };
    read_with_places(path, &Arc::new(navdata))
}

/// Reads a scenario file, plain or compressed with gzip, with places that were read before.
///
/// # Errors
/// When it cannot be read; errors in its text are listed in the result.
pub fn read_with_places(path: &Path, places: &Arc<NavigationData>) -> Result<ScnFile, InputError> {
    let text = ScnText::read(path, MAX_SCN_BYTES)?;
    let folder = CallFolder::of_file(path);
    Ok(Interpreter::new(folder, Arc::clone(places)).run(&path.display().to_string(), &text))
}

/// Parses the text of a scenario; `place` is its name in errors. Files that it calls are not read.
pub fn parse(place: &dyn fmt::Display, text: &str) -> ScnFile {
    let text = ScnText { text: text.to_owned(), ..ScnText::default() };
    Interpreter::new(CallFolder::nowhere(), Arc::default()).run(&place.to_string(), &text)
}
