//! The aircraft of a scenario, their routes, and the settings that hold for them.

use super::speed::Airspeed;
use crate::local_plane::LatLon;

/// The aircraft and their rules.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Traffic {
    /// Aircraft in the order of their creation. An identifier occurs twice where its first aircraft
    /// was deleted before.
    pub aircraft: Vec<ScnAircraft>,
    /// Aircraft that start at a place that the file does not define.
    pub unplaced: Vec<UnplacedAircraft>,
    /// Settings for all aircraft, in the order of their times.
    pub settings: Vec<TimedSetting>,
    /// Time at which the simulation ends (`QUIT`), in s.
    pub ends_s: Option<f64>,
}

/// A setting, and when it was given.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedSetting {
    /// Time from which it holds, in s.
    pub at_s: f64,
    /// Its command, as `ZONER`.
    pub command: &'static str,
    /// The file that it is in, as errors name it.
    pub file: String,
    /// Its line in that file, from 1.
    pub line: usize,
    /// The setting.
    pub setting: Setting,
}

/// A setting for all aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    /// Radius of the protected zone in nautical miles (`ZONER`); 5 unless given.
    ZoneRadiusNm(f64),
    /// Half the height of the protected zone in ft (`ZONEDH`); 1000 unless given.
    ZoneHalfHeightFt(f64),
    /// Time for which conflicts are predicted, in s (`DTLOOK`); 300 unless given.
    LookAheadS(f64),
    /// Whether conflicts are detected (`ASAS`, `CDMETHOD`). Without detection nothing is resolved.
    Detection(bool),
    /// The method of resolving conflicts (`RESO`).
    Resolution(ResolutionMethod),
    /// The factor on the zone out of which conflicts are resolved (`RFACH`); 1.05 unless given.
    ResolutionFactor(f64),
    /// What MVP changes in the horizontal (`RMETHH`).
    HorizontalResolution(HorizontalResolution),
    /// Whether MVP changes vertical speeds (`RMETHV`).
    VerticalResolution(bool),
    /// The factor on the zone's height to which conflicts are resolved in the vertical (`RFACV`); 1.01 unless given.
    VerticalResolutionFactor(f64),
    /// Who resolves a conflict by MVP (`PRIORULES`).
    PriorityRule(PriorityRule),
    /// A further wind at a place (`WIND`).
    AddedWind(Wind),
    /// The end of all winds (`DEL WIND`).
    NoWind,
    /// Whether positions and turbulence are noisy (`NOISE`).
    Noise(bool),
    /// All settings as at the start (`RESET`).
    Reset,
}

/// A setting of one aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AircraftSetting {
    /// Radius of its protected zone in nautical miles.
    ZoneRadiusNm(f64),
    /// Whether it avoids others (`RESOOFF` changes it).
    Avoids(bool),
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

/// What MVP changes in the horizontal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HorizontalResolution {
    /// Headings and speeds.
    Both,
    /// Speeds.
    Speed,
    /// Headings.
    Heading,
    /// No limit in the horizontal: without one in the vertical everything, else vertical speeds.
    Off,
}

/// Who resolves a conflict by MVP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorityRule {
    /// Both (`FF1`, and without a rule).
    Both,
    /// One that climbs or descends, beside one that cruises (`FF2`).
    CruisingFirst,
    /// One that cruises, beside one that climbs or descends: in the horizontal (`FF3`).
    ClimbingFirst,
    /// As `CruisingFirst`, and all in the horizontal (`LAY1`).
    CruisingFirstHorizontal,
    /// As `ClimbingFirst`, and all in the horizontal (`LAY2`).
    ClimbingFirstHorizontal,
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
    /// Settings of its own with their times in s, sorted by time. From the first of a kind on, those for all no longer
    /// hold for it.
    pub settings: Vec<(f64, AircraftSetting)>,
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
    /// Its name on the route, in capital letters: that of its place, or the aircraft's with a number.
    pub name: String,
    /// Its place.
    pub place: PositionRef,
    /// Altitude there in ft; `None` where it is left out.
    pub altitude_ft: Option<f64>,
    /// Speed there; `None` where it is left out.
    pub speed: Option<Airspeed>,
    /// Time at which the aircraft is to be there (`RTA`), in s; `None` where it is left out.
    pub required_s: Option<f64>,
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
