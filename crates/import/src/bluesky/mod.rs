//! Scenario files (`.scn`) of the air traffic simulator BlueSky.
//!
//! A line is `HH:MM:SS.ss>COMMAND arguments`. The syntax of such files:
//! - `#` starts a comment, `;` separates commands, `\` at the end continues a line exactly as
//!   it stands, and a line of fewer than 10 characters that continues none is skipped.
//! - Arguments are separated by blanks, a comma, or both; `,,` and `*` leave one out. Letters
//!   may be small or capital. `KL204 ALT FL200` is `ALT KL204 FL200`; an aircraft alone is `POS`.
//! - Commands take effect in the order of their times, at one time in the order of the file. So
//!   a way-point must be defined, and an aircraft created, before it is used.
//!
//! The commands that take effect are `CRE`, `DEL`, `DEFWPT`, `ADDWPT`, `AFTER .. ADDWPT`, `ORIG`,
//! `DEST`, `HDG`, `SPD`, `ALT`, `VS`, `LNAV`, `VNAV`, `SYN SUPER|WALL|MATRIX`, `ASAS`, `CDMETHOD`,
//! `RESO`, `ZONER`, `ZONEDH`, `DTLOOK`, `WIND` and `NOISE`. Nothing is dropped silently: any other
//! command is counted, and errors and names that need a navigation database are listed. Arguments
//! after those named at each command are not read.

mod interpreter;
mod lines;
mod speed;
mod synthetic;
#[cfg(test)]
pub(super) mod tests;
mod values;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

pub use speed::{Airspeed, FOOT_M, KNOT_MPS};

use super::local_plane::LatLon;
use interpreter::Interpreter;
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

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
    /// Line of the last occurrence of each command, from 1.
    pub last_lines: BTreeMap<String, usize>,
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

/// The aircraft and their rules. Of settings that are given several times the last holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Traffic {
    /// Aircraft in the order of their creation. An identifier occurs twice where its first aircraft
    /// was deleted before.
    pub aircraft: Vec<ScnAircraft>,
    /// Aircraft that start at a place that the file does not define.
    pub unplaced: Vec<UnplacedAircraft>,
    /// Radius of the protected zone in nautical miles (`ZONER`).
    pub zone_radius_nm: f64,
    /// Half the height of the protected zone in ft (`ZONEDH`).
    pub zone_half_height_ft: f64,
    /// Time for which conflicts are predicted, in s (`DTLOOK`).
    pub lookahead_s: f64,
    /// Whether conflicts are detected (`ASAS`, `CDMETHOD`); `None` where the file has no such
    /// command. Without detection nothing is resolved.
    pub detection: Option<bool>,
    /// The method of resolving conflicts (`RESO`); `None` where the file has no such command.
    pub resolution: Option<ResolutionMethod>,
    /// Winds at places (`WIND`).
    pub wind: Vec<Wind>,
    /// Whether positions and turbulence are noisy (`NOISE`).
    pub noise: bool,
}

/// The defaults of the simulator BlueSky.
impl Default for Traffic {
    fn default() -> Self {
        Self {
            aircraft: Vec::new(),
            unplaced: Vec::new(),
            zone_radius_nm: 5.0,
            zone_half_height_ft: 1000.0,
            lookahead_s: 300.0,
            detection: None,
            resolution: None,
            wind: Vec::new(),
            noise: false,
        }
    }
}

/// A method of resolving conflicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResolutionMethod {
    /// No resolution.
    Off,
    /// Modified voltage potential.
    Mvp,
    /// Solution space diagram.
    Ssd,
    /// The method after Eby.
    Eby,
}

/// The wind at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wind {
    /// Its position.
    pub position: LatLon,
    /// Altitude in ft; `None` where the wind is the same at all altitudes.
    pub altitude_ft: Option<f64>,
    /// The direction it blows from, in degrees from true north, in [0, 360).
    pub from_deg: f64,
    /// Its speed, in kt.
    pub speed_kt: f64,
}

/// An aircraft and its commands.
#[derive(Debug, Clone, PartialEq)]
pub struct ScnAircraft {
    /// Identifier in capital letters.
    pub id: String,
    /// Type of airplane as written, such as `B744`; empty where it is left out.
    pub kind: String,
    /// Time of its creation, in s.
    pub created_s: f64,
    /// Latitude in degrees, positive to the north.
    pub lat_deg: f64,
    /// Longitude in degrees, positive to the east, in [-180, 180].
    pub lon_deg: f64,
    /// Heading in degrees from true north, in [0, 360); 0 where it is left out.
    pub heading_deg: f64,
    /// Altitude in ft; 0 where it is left out.
    pub altitude_ft: f64,
    /// Speed; 0 kt where it is left out.
    pub speed: Airspeed,
    /// The route, without origin and destination.
    pub way_points: Vec<WayPoint>,
    /// The place that it comes from.
    pub origin: Option<PositionRef>,
    /// The place that it goes to after the last way-point.
    pub destination: Option<PositionRef>,
    /// Time of the command that set the destination, in s.
    pub destination_s: Option<f64>,
    /// Changes with the time of their command in s, sorted by time.
    pub changes: Vec<(f64, AircraftCommand)>,
    /// Time of its deletion, in s.
    pub deleted_s: Option<f64>,
}

impl ScnAircraft {
    /// Returns the position of its creation.
    pub fn position(&self) -> LatLon {
        LatLon { lat_deg: self.lat_deg, lon_deg: self.lon_deg }
    }

    /// Returns the way-points with a known position, followed by the destination where its position
    /// is known: the goals that can be flown without a navigation database.
    pub fn known_goals(&self) -> impl Iterator<Item = LatLon> {
        let places = self.way_points.iter().map(|way_point| &way_point.place);
        places.chain(&self.destination).filter_map(PositionRef::position)
    }
}

/// An aircraft without a known position.
#[derive(Debug, Clone, PartialEq)]
pub struct UnplacedAircraft {
    /// The name of the place where it starts.
    pub place: String,
    /// All other data of the aircraft; its latitude and longitude are 0 and mean nothing.
    pub aircraft: ScnAircraft,
}

/// One point of a route.
#[derive(Debug, Clone, PartialEq)]
pub struct WayPoint {
    /// Its place.
    pub place: PositionRef,
    /// Altitude there in ft; `None` where it is left out.
    pub altitude_ft: Option<f64>,
    /// Speed there; `None` where it is left out.
    pub speed: Option<Airspeed>,
    /// Time at which it was added to the route, in s.
    pub added_s: f64,
}

/// A place in a scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum PositionRef {
    /// A latitude and a longitude.
    At(LatLon),
    /// A way-point that the file has defined before its use.
    Defined {
        /// Its name in capital letters.
        name: String,
        /// Its position.
        position: LatLon,
    },
    /// A name that only a navigation database can resolve, in capital letters. A runway follows its
    /// airport after a blank or a slash.
    Unresolved(String),
}

impl PositionRef {
    /// Returns its position, if that is known.
    pub fn position(&self) -> Option<LatLon> {
        match self {
            Self::At(position) | Self::Defined { position, .. } => Some(*position),
            Self::Unresolved(_) => None,
        }
    }

    /// Returns its name, if it has one.
    pub fn name(&self) -> Option<&str> {
        match self {
            Self::Defined { name, .. } | Self::Unresolved(name) => Some(name),
            Self::At(_) => None,
        }
    }
}

/// A command that changes the flight of an aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AircraftCommand {
    /// Turn to a heading in degrees from true north, in [0, 360), and leave the route.
    HeadingDeg(f64),
    /// Take a speed.
    Speed(Airspeed),
    /// Climb or descend to an altitude in ft.
    AltitudeFt(f64),
    /// Climb (positive) or descend with this vertical speed, in ft/min.
    VerticalSpeedFpm(f64),
    /// Follow the route horizontally, or stop doing so. Adding a way-point switches it on.
    LateralNavigation(bool),
    /// Follow the altitudes and speeds of the route, or stop doing so.
    VerticalNavigation(bool),
}

/// Reads a scenario file, plain or compressed with gzip.
///
/// # Errors
/// When it cannot be read; errors in its text are listed in the result.
pub fn read(path: &Path) -> Result<ScnFile, InputError> {
    Ok(parse(&path.display(), &read_text(path, MAX_SCN_BYTES)?))
}

/// Parses the text of a scenario; `place` is its name in errors.
pub fn parse(place: &dyn fmt::Display, text: &str) -> ScnFile {
    let (lines, short_lines) = lines::join_lines(text);
    let mut file = ScnFile { short_lines, ..ScnFile::default() };
    let mut commands = Vec::new();
    for line in &lines {
        match line.commands(place) {
            Ok(line_commands) => {
                file.command_lines += u64::from(!line_commands.is_empty());
                commands.extend(line_commands);
            }
            Err(error) => file.unparsed.push(error),
        }
    }
    // A stable sort, so that commands of one time stay in the order of the file.
    commands.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    let mut file = Interpreter::new(place, file).run(commands);
    file.unparsed.sort_by_key(InputError::line_and_column);
    file
}
