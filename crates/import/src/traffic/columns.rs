//! The columns of the sources: what each means, and its unit.

use sidestep_kernel::InputError;

/// Meters of a foot.
pub(super) const FOOT_M: f64 = 0.3048;
/// Meters of a nautical mile.
pub(super) const NAUTICAL_MILE_M: f64 = 1852.0;
/// Feet of a meter.
const FT_PER_M: f64 = 1.0 / FOOT_M;
/// Knots of a meter per second.
const KT_PER_M_S: f64 = 3600.0 / NAUTICAL_MILE_M;
/// Feet per minute of a meter per second.
const FPM_PER_M_S: f64 = 60.0 / FOOT_M;
/// Knots of a kilometer per hour.
const KT_PER_KM_H: f64 = 1000.0 / NAUTICAL_MILE_M;
/// Knots of a statute mile per hour.
const KT_PER_MPH: f64 = 1609.344 / NAUTICAL_MILE_M;

/// The meaning of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Field {
    Time,
    /// A time that is UTC by the name of its column, where another column may have local times.
    UtcTime,
    Address,
    Callsign,
    FlightId,
    Latitude,
    Longitude,
    /// Latitude and longitude in one cell: `52.30,4.76`.
    Position,
    /// Altitude above standard pressure, or of a reference that the source does not name; in ft.
    Altitude,
    /// Altitude above the ellipsoid, in ft.
    GeometricAltitude,
    /// Speed over the ground, in kt.
    GroundSpeed,
    Track,
    /// Vertical speed, in ft/min.
    VerticalSpeed,
    OnGround,
    /// The time when the position was received.
    PositionTime,
    /// The time in s since the position was received.
    PositionAge,
}

/// Number of [`Field`]s.
const FIELD_COUNT: usize = 16;

/// A column by its name, with the factor that turns its numbers into the unit of the field. Of times it is the number of
/// units in a second.
pub(super) type NamedColumn = (&'static str, Field, f64);

/// A source of recorded traffic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Own,
    OpenSky,
    TrafficLibrary,
    Flightradar24,
    /// The decoder readsb, and the networks that give its JSON: adsb.lol, ADS-B Exchange, adsb.fi, airplanes.live.
    Readsb,
    /// The program Virtual Radar Server, whose JSON was that of ADS-B Exchange until 2020.
    VirtualRadar,
    /// The interface AeroAPI of FlightAware.
    FlightAware,
    /// Messages of BaseStation, which decoders give on port 30003.
    BaseStation,
    /// Segments of flights, of EUROCONTROL.
    Segments,
    /// Encounters of DAIDALUS.
    Encounter,
    /// Points of flights in EUROCONTROL's archive for research.
    FlightPoints,
}

impl Source {
    /// Finds the source by the names of columns, in lower case.
    fn of_columns(names: &[String]) -> Self {
        let has = |name: &str| names.iter().any(|column| column == name);
        let has_any = |names: &[&str]| names.iter().any(|name| has(name));
        let altitudes = ["baroaltitude", "geoaltitude", "baro_altitude", "geo_altitude"];
        if has("velocity") && has_any(&altitudes) {
            return Self::OpenSky;
        }
        if has("position") && has("direction") && has_any(&["timestamp", "utc"]) {
            return Self::Flightradar24;
        }
        if has("gspeed") && has("alt") {
            return Self::Flightradar24;
        }
        if has("alt_baro") && has_any(&["hex", "icao", "icao24"]) {
            return Self::Readsb;
        }
        if has("hex") && has("altitude") && has_any(&["seen_pos", "vert_rate"]) {
            return Self::Readsb;
        }
        if has("icao") && has("postime") {
            return Self::VirtualRadar;
        }
        if has("fa_flight_id") {
            return Self::FlightAware;
        }
        if has("ectrl_id") && has("time_over") {
            return Self::FlightPoints;
        }
        let is_library = ["timestamp", "latitude", "longitude", "altitude"].into_iter().all(has)
            && has_any(&["groundspeed", "flight_id"]);
        if is_library { Self::TrafficLibrary } else { Self::Own }
    }

    fn columns(self) -> &'static [NamedColumn] {
        match self {
            Self::Own => OWN,
            Self::OpenSky => OPENSKY,
            Self::TrafficLibrary => TRAFFIC_LIBRARY,
            Self::Flightradar24 => FLIGHTRADAR24,
            Self::FlightPoints => FLIGHT_POINTS,
            Self::Readsb => READSB,
            Self::VirtualRadar => VIRTUAL_RADAR,
            Self::FlightAware => FLIGHT_AWARE,
            Self::Segments | Self::Encounter | Self::BaseStation => &[],
        }
    }

    /// Returns its name, and its units where the names of its columns do not have them.
    pub(super) fn describe(self) -> (&'static str, &'static str) {
        match self {
            Self::Own => ("tracks", "as the names of the columns tell"),
            Self::OpenSky => ("OpenSky state vectors", "altitude m, speed m/s, vertical speed m/s"),
            Self::TrafficLibrary => {
                ("tracks of the library traffic", "altitude ft, speed kt, vertical speed ft/min")
            }
            Self::Flightradar24 => ("Flightradar24 track", "altitude ft, speed kt"),
            Self::Readsb => ("aircraft of readsb", "altitude ft, speed kt, vertical speed ft/min"),
            Self::VirtualRadar => {
                ("aircraft of Virtual Radar Server", "altitude ft, speed kt, vertical speed ft/min")
            }
            Self::FlightAware => ("positions of FlightAware", "altitude 100 ft, speed kt"),
            Self::BaseStation => {
                ("messages of BaseStation", "altitude ft, speed kt, vertical speed ft/min")
            }
            Self::Segments => ("flight segments", "flight levels, minutes of arc"),
            Self::FlightPoints => ("flight points of EUROCONTROL", "flight levels"),
            Self::Encounter => ("encounter", "as its second line tells"),
        }
    }
}

const OPENSKY: &[NamedColumn] = &[
    ("time", Field::Time, 1.0),
    ("timestamp", Field::Time, 1.0),
    ("icao24", Field::Address, 1.0),
    ("callsign", Field::Callsign, 1.0),
    ("flight_id", Field::FlightId, 1.0),
    ("lat", Field::Latitude, 1.0),
    ("latitude", Field::Latitude, 1.0),
    ("lon", Field::Longitude, 1.0),
    ("longitude", Field::Longitude, 1.0),
    ("baroaltitude", Field::Altitude, FT_PER_M),
    ("baro_altitude", Field::Altitude, FT_PER_M),
    ("geoaltitude", Field::GeometricAltitude, FT_PER_M),
    ("geo_altitude", Field::GeometricAltitude, FT_PER_M),
    ("velocity", Field::GroundSpeed, KT_PER_M_S),
    ("heading", Field::Track, 1.0),
    ("true_track", Field::Track, 1.0),
    ("track", Field::Track, 1.0),
    ("vertrate", Field::VerticalSpeed, FPM_PER_M_S),
    ("vertical_rate", Field::VerticalSpeed, FPM_PER_M_S),
    ("onground", Field::OnGround, 1.0),
    ("on_ground", Field::OnGround, 1.0),
    ("lastposupdate", Field::PositionTime, 1.0),
    ("time_position", Field::PositionTime, 1.0),
    ("last_position", Field::PositionTime, 1.0),
    // States that were written one by one have no other time.
    ("time_position", Field::Time, 1.0),
    ("lastposupdate", Field::Time, 1.0),
    ("last_contact", Field::Time, 1.0),
    ("lastcontact", Field::Time, 1.0),
];

const TRAFFIC_LIBRARY: &[NamedColumn] = &[
    ("timestamp", Field::Time, 1.0),
    ("icao24", Field::Address, 1.0),
    ("callsign", Field::Callsign, 1.0),
    ("flight_id", Field::FlightId, 1.0),
    ("latitude", Field::Latitude, 1.0),
    ("longitude", Field::Longitude, 1.0),
    ("altitude", Field::Altitude, 1.0),
    ("geoaltitude", Field::GeometricAltitude, 1.0),
    ("groundspeed", Field::GroundSpeed, 1.0),
    ("track", Field::Track, 1.0),
    ("vertical_rate", Field::VerticalSpeed, 1.0),
    ("onground", Field::OnGround, 1.0),
    ("on_ground", Field::OnGround, 1.0),
    ("last_position", Field::PositionTime, 1.0),
];

const FLIGHT_POINTS: &[NamedColumn] = &[
    ("time_over", Field::Time, 1.0),
    ("ectrl_id", Field::FlightId, 1.0),
    ("latitude", Field::Latitude, 1.0),
    ("longitude", Field::Longitude, 1.0),
    ("flight_level", Field::Altitude, 100.0),
];

const FLIGHTRADAR24: &[NamedColumn] = &[
    ("timestamp", Field::Time, 1.0),
    ("utc", Field::Time, 1.0),
    ("callsign", Field::Callsign, 1.0),
    ("position", Field::Position, 1.0),
    ("altitude", Field::Altitude, 1.0),
    ("speed", Field::GroundSpeed, 1.0),
    ("direction", Field::Track, 1.0),
    // The same quantities in its interface for programs.
    ("hex", Field::Address, 1.0),
    ("fr24_id", Field::FlightId, 1.0),
    ("lat", Field::Latitude, 1.0),
    ("lon", Field::Longitude, 1.0),
    ("alt", Field::Altitude, 1.0),
    ("gspeed", Field::GroundSpeed, 1.0),
    ("track", Field::Track, 1.0),
    ("vspeed", Field::VerticalSpeed, 1.0),
    ("on_ground", Field::OnGround, 1.0),
];

/// Names of readsb's JSON. Source: readsb, README-json.md.
const READSB: &[NamedColumn] = &[
    ("now", Field::Time, 1.0),
    ("time", Field::Time, 1.0),
    ("timestamp", Field::Time, 1.0),
    ("hex", Field::Address, 1.0),
    ("icao", Field::Address, 1.0),
    ("icao24", Field::Address, 1.0),
    ("flight", Field::Callsign, 1.0),
    ("callsign", Field::Callsign, 1.0),
    ("lat", Field::Latitude, 1.0),
    ("lon", Field::Longitude, 1.0),
    ("alt_baro", Field::Altitude, 1.0),
    ("alt_geom", Field::GeometricAltitude, 1.0),
    ("gs", Field::GroundSpeed, 1.0),
    ("track", Field::Track, 1.0),
    ("baro_rate", Field::VerticalSpeed, 1.0),
    ("geom_rate", Field::VerticalSpeed, 1.0),
    ("seen_pos", Field::PositionAge, 1.0),
    // Names of its predecessor dump1090.
    ("altitude", Field::Altitude, 1.0),
    ("speed", Field::GroundSpeed, 1.0),
    ("vert_rate", Field::VerticalSpeed, 1.0),
];

/// Names of Virtual Radar Server, which the archive of ADS-B Exchange has as well. Source: "AircraftList.json",
/// virtualradarserver.co.uk.
const VIRTUAL_RADAR: &[NamedColumn] = &[
    ("postime", Field::Time, 1e3),
    ("icao", Field::Address, 1.0),
    ("call", Field::Callsign, 1.0),
    ("lat", Field::Latitude, 1.0),
    ("long", Field::Longitude, 1.0),
    ("lon", Field::Longitude, 1.0),
    ("alt", Field::Altitude, 1.0),
    ("spd", Field::GroundSpeed, 1.0),
    ("trak", Field::Track, 1.0),
    ("vsi", Field::VerticalSpeed, 1.0),
    ("gnd", Field::OnGround, 1.0),
];

/// Names of AeroAPI, whose altitudes are in hundreds of feet. Source: AeroAPI, `/flights/{id}/track`.
const FLIGHT_AWARE: &[NamedColumn] = &[
    ("timestamp", Field::Time, 1.0),
    ("fa_flight_id", Field::FlightId, 1.0),
    ("ident", Field::Callsign, 1.0),
    ("latitude", Field::Latitude, 1.0),
    ("longitude", Field::Longitude, 1.0),
    ("altitude", Field::Altitude, 100.0),
    ("groundspeed", Field::GroundSpeed, 1.0),
    ("heading", Field::Track, 1.0),
];

const OWN: &[NamedColumn] = &[
    ("time_s", Field::Time, 1.0),
    ("time_ms", Field::Time, 1e3),
    ("time_us", Field::Time, 1e6),
    ("time_ns", Field::Time, 1e9),
    ("timestamp_s", Field::Time, 1.0),
    ("timestamp_ms", Field::Time, 1e3),
    ("timestamp_us", Field::Time, 1e6),
    ("timestamp_ns", Field::Time, 1e9),
    ("time", Field::Time, 1.0),
    ("timestamp", Field::Time, 1.0),
    ("datetime", Field::Time, 1.0),
    ("time_utc", Field::UtcTime, 1.0),
    ("timestamp_utc", Field::UtcTime, 1.0),
    ("datetime_utc", Field::UtcTime, 1.0),
    ("utc_time", Field::UtcTime, 1.0),
    ("utc", Field::UtcTime, 1.0),
    ("icao24", Field::Address, 1.0),
    ("icao", Field::Address, 1.0),
    ("icao_address", Field::Address, 1.0),
    ("hex", Field::Address, 1.0),
    ("address", Field::Address, 1.0),
    ("callsign", Field::Callsign, 1.0),
    ("call_sign", Field::Callsign, 1.0),
    ("flight", Field::Callsign, 1.0),
    ("ident", Field::Callsign, 1.0),
    ("flight_id", Field::FlightId, 1.0),
    ("lat_deg", Field::Latitude, 1.0),
    ("lat", Field::Latitude, 1.0),
    ("latitude", Field::Latitude, 1.0),
    ("latitude_deg", Field::Latitude, 1.0),
    ("lon_deg", Field::Longitude, 1.0),
    ("lon", Field::Longitude, 1.0),
    ("lng", Field::Longitude, 1.0),
    ("longitude", Field::Longitude, 1.0),
    ("longitude_deg", Field::Longitude, 1.0),
    ("alt_ft", Field::Altitude, 1.0),
    ("altitude_ft", Field::Altitude, 1.0),
    ("baroaltitude_ft", Field::Altitude, 1.0),
    ("alt_m", Field::Altitude, FT_PER_M),
    ("altitude_m", Field::Altitude, FT_PER_M),
    ("baroaltitude_m", Field::Altitude, FT_PER_M),
    ("flight_level", Field::Altitude, 100.0),
    ("fl", Field::Altitude, 100.0),
    ("geoaltitude_ft", Field::GeometricAltitude, 1.0),
    ("geoaltitude_m", Field::GeometricAltitude, FT_PER_M),
    ("gs_kt", Field::GroundSpeed, 1.0),
    ("groundspeed_kt", Field::GroundSpeed, 1.0),
    ("ground_speed_kt", Field::GroundSpeed, 1.0),
    ("speed_kt", Field::GroundSpeed, 1.0),
    ("gs_m_s", Field::GroundSpeed, KT_PER_M_S),
    ("groundspeed_m_s", Field::GroundSpeed, KT_PER_M_S),
    ("groundspeed_km_h", Field::GroundSpeed, KT_PER_KM_H),
    ("ground_speed_km_h", Field::GroundSpeed, KT_PER_KM_H),
    ("gs_mps", Field::GroundSpeed, KT_PER_M_S),
    ("ground_speed_m_s", Field::GroundSpeed, KT_PER_M_S),
    ("speed_m_s", Field::GroundSpeed, KT_PER_M_S),
    ("speed_mps", Field::GroundSpeed, KT_PER_M_S),
    ("velocity_m_s", Field::GroundSpeed, KT_PER_M_S),
    ("gs_km_h", Field::GroundSpeed, KT_PER_KM_H),
    ("speed_km_h", Field::GroundSpeed, KT_PER_KM_H),
    ("speed_kmh", Field::GroundSpeed, KT_PER_KM_H),
    ("speed_mph", Field::GroundSpeed, KT_PER_MPH),
    ("track_deg", Field::Track, 1.0),
    ("heading_deg", Field::Track, 1.0),
    ("track", Field::Track, 1.0),
    ("heading", Field::Track, 1.0),
    ("vs_fpm", Field::VerticalSpeed, 1.0),
    ("vertical_rate_fpm", Field::VerticalSpeed, 1.0),
    ("vertical_speed_fpm", Field::VerticalSpeed, 1.0),
    ("vs_m_s", Field::VerticalSpeed, FPM_PER_M_S),
    ("vertical_rate_m_s", Field::VerticalSpeed, FPM_PER_M_S),
    ("vertical_speed_m_s", Field::VerticalSpeed, FPM_PER_M_S),
    ("onground", Field::OnGround, 1.0),
    ("on_ground", Field::OnGround, 1.0),
    ("is_on_ground", Field::OnGround, 1.0),
    ("ground", Field::OnGround, 1.0),
    ("gnd", Field::OnGround, 1.0),
];

/// Where a field is in a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Column {
    pub(super) index: usize,
    /// Factor from the numbers of the column to the unit of the field.
    pub(super) factor: f64,
}

/// The columns of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub(super) source: Source,
    columns: [Option<Column>; FIELD_COUNT],
    /// The columns that this program does not use.
    pub(super) unused: Vec<String>,
    /// Names of used columns that the header has again.
    pub(super) repeated: Vec<String>,
}

impl Layout {
    /// Returns a layout with the given columns.
    pub(super) fn new(source: Source, columns: &[(Field, usize, f64)]) -> Self {
        let mut layout =
            Self { source, columns: [None; FIELD_COUNT], unused: Vec::new(), repeated: Vec::new() };
        for &(field, index, factor) in columns {
            layout.columns[field as usize] = Some(Column { index, factor });
        }
        layout
    }

    /// Finds the columns of a header. Of several columns for one field, the first name of the source's list counts.
    ///
    /// # Errors
    /// When a column is missing that a track cannot be without.
    pub(super) fn find(place: &str, header: &[String]) -> Result<Self, InputError> {
        let names: Vec<String> = header.iter().map(|name| plain_name(name)).collect();
        let source = Source::of_columns(&names);
        let mut layout = Self::new(source, &[]);
        let mut used = vec![false; names.len()];
        for &(name, field, factor) in source.columns() {
            let Some(index) = names.iter().position(|column| column == name) else { continue };
            let column = &mut layout.columns[field as usize];
            if column.is_none() {
                *column = Some(Column { index, factor });
                used[index] = true;
            }
        }
        for (k, name) in names.iter().enumerate() {
            if used[k] || name.is_empty() {
                continue;
            }
            let is_repeated = names[..k].iter().zip(&used).any(|(one, used)| *used && one == name);
            let list = if is_repeated { &mut layout.repeated } else { &mut layout.unused };
            list.push(header[k].clone());
        }
        layout.check(place, &names)?;
        Ok(layout)
    }

    fn check(&self, place: &str, names: &[String]) -> Result<(), InputError> {
        let missing = self.missing_fields();
        if missing.is_empty() {
            return Ok(());
        }
        let listed: Vec<String> =
            names.iter().take(MAX_LISTED).map(|name| format!("`{name:.40}`")).collect();
        let more = names.len().saturating_sub(MAX_LISTED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let listed = listed.join(", ");
        if self.columns.iter().all(Option::is_none) {
            let cause =
                format!("nothing in it is recorded traffic: its columns are {listed}{more}");
            let remedy =
                format!("see `sidestep inspect --help` for other kinds of files; {COLUMN_REMEDY}");
            return Err(InputError::new(place, cause, remedy));
        }
        let cause =
            format!("the table lacks {}; its columns are {listed}{more}", missing.join(", "));
        Err(InputError::new(place, cause, COLUMN_REMEDY))
    }

    /// Checks that the columns have what a track cannot be without.
    ///
    /// # Errors
    /// When they lack some of it.
    pub(super) fn check_fields(&self, place: &str) -> Result<(), InputError> {
        let missing = self.missing_fields();
        if missing.is_empty() {
            return Ok(());
        }
        let cause = format!("the table lacks {}", missing.join(", "));
        Err(InputError::new(place, cause, COLUMN_REMEDY))
    }

    /// Returns what a track cannot be without, and the columns lack.
    fn missing_fields(&self) -> Vec<&'static str> {
        let has = |field: Field| self.column(field).is_some();
        let mut missing = Vec::new();
        if !has(Field::Time) && !has(Field::UtcTime) {
            missing.push("a time (`time_s`)");
        }
        // A track of Flightradar24 is of one aircraft.
        let names_aircraft = has(Field::Address) || has(Field::Callsign) || has(Field::FlightId);
        if !names_aircraft && self.source != Source::Flightradar24 {
            missing.push("a name of the aircraft (`icao24` or `callsign`)");
        }
        if !has(Field::Position) && !has(Field::Latitude) {
            missing.push("a latitude (`lat_deg`)");
        }
        if !has(Field::Position) && !has(Field::Longitude) {
            missing.push("a longitude (`lon_deg`)");
        }
        if !has(Field::Altitude) && !has(Field::GeometricAltitude) {
            missing.push("an altitude with its unit (`alt_ft` or `alt_m`)");
        }
        missing
    }

    /// Returns the column of a field, where the file has one.
    pub(super) fn column(&self, field: Field) -> Option<Column> {
        self.columns[field as usize]
    }

    /// Returns the column of the altitude: of two, the one above standard pressure, by which aircraft are separated.
    pub(super) fn altitude(&self) -> Option<Column> {
        self.column(Field::Altitude).or(self.column(Field::GeometricAltitude))
    }
}

/// What a table needs that no known source has written.
const COLUMN_REMEDY: &str = "give each column the name of what it holds, with the unit that its numbers have: `alt_ft` or \
                             `alt_m`, `gs_kt` or `gs_m_s`, `vs_fpm` or `vs_m_s`; files of OpenSky, the library \
                             traffic, Flightradar24, FlightAware and readsb are read as they are";

/// Largest number of columns that an error lists.
const MAX_LISTED: usize = 16;

/// Returns the name of a column without the differences that mean nothing: `Altitude [ft]` is `altitude_ft`.
fn plain_name(name: &str) -> String {
    let name = name.trim().to_ascii_lowercase();
    let in_brackets = name.strip_suffix([']', ')']).and_then(|rest| rest.split_once(['[', '(']));
    let (quantity, unit) = match in_brackets {
        Some((quantity, unit)) => (quantity.trim_end(), unit.trim()),
        None => name.rsplit_once(['_', ' ']).unwrap_or((&name, "")),
    };
    let known = UNIT_NAMES.iter().find(|(_, others)| others.contains(&unit));
    let name = match known {
        Some((unit, _)) => format!("{quantity}_{unit}"),
        None if in_brackets.is_some() => format!("{quantity}_{unit}"),
        None => name,
    };
    name.replace([' ', '-'], "_")
}

/// Units as names of columns have them here, and what others write for them.
const UNIT_NAMES: [(&str, &[&str]); 9] = [
    ("ft", &["feet", "foot"]),
    ("m", &["meter", "meters", "metre", "metres"]),
    ("deg", &["degree", "degrees", "\u{b0}"]),
    ("kt", &["kts", "kn", "knot", "knots"]),
    ("m_s", &["m/s", "mps"]),
    ("km_h", &["km/h", "kmh", "kph"]),
    ("fpm", &["ft/min"]),
    ("s", &["sec", "second", "seconds"]),
    ("ms", &["millisecond", "milliseconds"]),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(header: &str) -> Result<Layout, InputError> {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        Layout::find("f.csv", &names)
    }

    #[test]
    fn sources_are_told_by_their_columns() {
        for (header, source) in [
            ("time_s,icao24,lat_deg,lon_deg,alt_ft,gs_kt", Source::Own),
            ("time,icao24,lat,lon,velocity,heading,baroaltitude", Source::OpenSky),
            ("timestamp,icao24,latitude,longitude,altitude,groundspeed", Source::TrafficLibrary),
            ("Timestamp,UTC,Callsign,Position,Altitude,Speed,Direction", Source::Flightradar24),
            ("ECTRL ID,Time Over,Flight Level,Latitude,Longitude", Source::FlightPoints),
            ("fr24_id,hex,callsign,lat,lon,track,alt,gspeed,timestamp", Source::Flightradar24),
            ("now,hex,flight,lat,lon,alt_baro,alt_geom,gs,track,seen_pos", Source::Readsb),
            ("fa_flight_id,altitude,groundspeed,latitude,longitude,timestamp", Source::FlightAware),
            ("now,hex,flight,lat,lon,altitude,speed,track,vert_rate", Source::Readsb),
            ("Icao,Call,Lat,Long,Alt,Spd,Trak,PosTime,Gnd", Source::VirtualRadar),
            ("icao24,time_position,longitude,latitude,baro_altitude,velocity", Source::OpenSky),
        ] {
            assert_eq!(layout(header).expect(header).source, source, "{header}");
        }
    }

    #[test]
    fn columns_have_the_units_of_their_source() {
        let found = layout("time,icao24,lat,lon,velocity,geoaltitude,squawk").unwrap();
        let speed = found.column(Field::GroundSpeed).unwrap();
        assert!((speed.factor * 230.0 - 447.08).abs() < 0.01);
        assert!((found.altitude().unwrap().factor * 10_668.0 - 35_000.0).abs() < 1e-6);
        assert_eq!(found.unused, ["squawk"]);
        let metric = layout("time_s,callsign,lat,lon,Alt_M,speed_km_h").unwrap();
        assert!((metric.altitude().unwrap().factor * 304.8 - 1000.0).abs() < 1e-9);
        assert!((metric.column(Field::GroundSpeed).unwrap().factor * 185.2 - 100.0).abs() < 1e-9);
    }

    #[test]
    fn units_in_brackets_or_spelled_out_are_those_of_the_column() {
        for header in [
            "Time [s],Callsign,Latitude [deg],Longitude [deg],Altitude [m],Ground speed [km/h]",
            "time(s),callsign,lat(\u{b0}),lon(\u{b0}),alt (meters),speed_kph",
            "time_seconds,callsign,lat_degrees,lon_degrees,altitude metres,gs_km_h",
        ] {
            let found = layout(header).expect(header);
            assert_eq!(found.unused, [""; 0], "{header}");
            assert!((found.altitude().unwrap().factor * 304.8 - 1000.0).abs() < 1e-9, "{header}");
            let speed = found.column(Field::GroundSpeed).unwrap();
            assert!((speed.factor * 185.2 - 100.0).abs() < 1e-9, "{header}");
        }
        assert!(layout("time,callsign,lat,lon,altitude [cubits]").is_err());
    }

    #[test]
    fn a_column_that_is_there_twice_is_named() {
        let found = layout("time,callsign,lat,lon,alt_ft,lat").unwrap();
        assert_eq!((found.repeated, found.unused), (vec!["lat".to_owned()], Vec::new()));
    }

    #[test]
    fn a_quantity_without_a_unit_is_asked_for_it() {
        let error = layout("time,icao24,lat,lon,altitude,speed").unwrap_err();
        assert!(
            error.cause().contains("an altitude with its unit (`alt_ft` or `alt_m`)"),
            "{error}"
        );
        let other = layout("a,b").unwrap_err();
        let words = "nothing in it is recorded traffic: its columns are `a`, `b`";
        assert_eq!(other.cause(), words);
        let part = layout("time,b").unwrap_err();
        assert!(part.cause().contains("lacks a name of the aircraft"), "{part}");
    }
}
