//! Recorded air traffic: one row per aircraft and instant, from the sources that people have.
//!
//! | source | told by | units |
//! |-|-|-|
//! | this program | `time_s`, `lat_deg`, `lon_deg`, `alt_ft`, ... | in the names |
//! | OpenSky Network, state vectors (CSV, JSON) | `velocity`, `baroaltitude` or `geoaltitude`; `states` | m/s, m |
//! | library `traffic` (CSV, Parquet) | `timestamp`, `latitude`, `longitude`, `altitude`, `groundspeed` or `flight_id` | kt, ft, ft/min |
//! | Flightradar24 (CSV) | `Timestamp`, `Position`, `Direction` | kt, ft |
//! | readsb, adsb.lol, ADS-B Exchange (JSON: aircraft, traces) | `alt_baro`, `hex`; `trace` | kt, ft, ft/min |
//! | Flightradar24 and FlightAware (JSON of their interfaces) | `gspeed`; `fa_flight_id` | kt, ft or 100 ft |
//! | BaseStation (SBS-1) | lines of `MSG` and 22 fields | kt, ft, ft/min |
//! | EUROCONTROL so6, m1 and m3 | 20 fields a line | flight levels, minutes of arc |
//! | EUROCONTROL R&D data archive, flight points (CSV) | `ECTRL ID`, `Time Over` | flight levels, day before month |
//! | DAIDALUS (.daa) | a line of names, a line of units | in the second line |
//! | any other table | names with units: `alt_m`, `gs_m_s` | in the names |
//!
//! Tables have commas, semicolons, tabs or `|`, decimal points or commas, and times as ISO 8601 or as seconds, milliseconds,
//! microseconds or nanoseconds since 1970. Files may be compressed with gzip.
//!
//! Rows without a position are left out. The rows of an aircraft become flights: they are split at gaps, at changes of
//! call sign and at stops on the ground, whose rows are no traffic. Rows that can hardly be right are named; see
//! [`TrafficOptions`]. All of it stands in the report.

mod base_station;
mod clean;
mod columns;
mod csv_source;
mod daa;
mod flights;
mod json_frames;
mod json_items;
mod json_source;
#[cfg(test)]
mod json_tests;
mod named;
mod options;
#[cfg(test)]
mod other_tests;
mod parquet_source;
#[cfg(test)]
mod parquet_tests;
mod plausibility;
mod rows;
mod so6;
mod standing;
mod summary;
#[cfg(test)]
mod tests;
pub(crate) mod text;
mod time;
mod value;
#[cfg(test)]
mod wild_tests;

use super::local_plane::LatLon;
use super::report::ImportReport;
use rows::RowCollector;
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_bytes;
use std::fmt;
use std::path::Path;

pub use clean::to_csv;
pub use flights::SINGLE_ROW_RULE;
pub(crate) use named::begins_as_traffic;
pub use named::{has_extension, is_traffic};
pub use options::TrafficOptions;
pub use time::format_utc;

/// All flights of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedTraffic {
    /// The flights, by address and time.
    pub tracks: Vec<Track>,
    /// Number of rows of the file, without the header.
    pub rows: usize,
    /// Number of rows that repeat the instant of an earlier row of the same aircraft; they are left out.
    pub repeated_rows: usize,
    /// Whether the file shows one instant: every flight has one sample, with its speed and direction.
    pub is_snapshot: bool,
    /// What was found in the file, what was kept, and what was not taken as it stood.
    pub report: ImportReport,
}

/// One flight of an aircraft, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Address of the transponder as the flight's first row has it, in lower case; empty where the file has none.
    pub icao24: String,
    /// The call sign; empty where there is none.
    pub callsign: String,
    /// The name of the flight, where the file gives one.
    pub flight_id: String,
    /// The samples, with strictly increasing times: at least two, or one of a snapshot.
    pub samples: Vec<Sample>,
}

/// An aircraft at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time in s since the start of 1970, UTC.
    pub time_s: f64,
    /// Its position on the earth, as the transponder reports it.
    pub position: LatLon,
    /// Altitude in ft: above standard pressure where the file has that, so not the height above ground.
    pub altitude_ft: f64,
    /// Speed over the ground in kt, not negative.
    pub ground_speed_kt: Option<f64>,
    /// Direction of motion over the ground in degrees, clockwise from true north, in [0, 360).
    pub track_deg: Option<f64>,
    /// Vertical speed in ft/min, positive upward.
    pub vertical_speed_fpm: Option<f64>,
}

/// The greatest speed between two rows, in m/s: beyond it one of the two positions is wrong. The simulator bounds
/// airplanes by it as well.
pub const MAX_SPEED_M_S: f64 = 1e6;

/// The maximum size of a file in bytes after decompression.
pub const MAX_TRAFFIC_BYTES: u64 = super::table::MAX_CSV_BYTES;

/// What to give in place of a file for maps.
const POINTS_REMEDY: &str = "give a table with a row for each point: `time_s`, `callsign`, `lat_deg`, `lon_deg`, `alt_m` \
                             (heights in KML, GPX and GeoJSON are in meters)";

impl Track {
    /// Returns its median speed over the ground over time, in m/s: that of its rows, whatever they report. A jump takes
    /// one step, and changes it little.
    pub fn median_speed_m_s(&self) -> Option<f64> {
        let step = |pair: &[Sample]| {
            let length_m = plausibility::distance_m(pair[0].position, pair[1].position);
            let step_s = pair[1].time_s - pair[0].time_s;
            [length_m / step_s, step_s]
        };
        weighted_median(self.samples.windows(2).map(step).collect())
    }
}

/// Returns the value of pairs of value and weight below which half of the weight lies.
fn weighted_median(mut pairs: Vec<[f64; 2]>) -> Option<f64> {
    pairs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let half = 0.5 * pairs.iter().map(|[_, weight]| weight).sum::<f64>();
    let mut below = 0.0;
    pairs
        .iter()
        .find(|[_, weight]| {
            below += weight;
            below >= half
        })
        .map(|[value, _]| *value)
}

/// Reads a file, plain or compressed with gzip.
///
/// # Errors
/// When it cannot be read, its source is unknown, more than half of its rows are bad, or nothing remains.
pub fn read(path: &Path) -> Result<RecordedTraffic, InputError> {
    read_with(path, &TrafficOptions::default())
}

/// Reads a file like [`read`], with options.
///
/// # Errors
/// Those of [`read`].
pub fn read_with(path: &Path, options: &TrafficOptions) -> Result<RecordedTraffic, InputError> {
    let bytes = read_bytes(path, MAX_TRAFFIC_BYTES)?;
    from_bytes(&path.display(), bytes, options)
}

/// Parses text; `place` is its name in errors.
///
/// # Errors
/// Those of [`read`].
pub fn parse(place: &dyn fmt::Display, text: &str) -> Result<RecordedTraffic, InputError> {
    parse_with(place, text, &TrafficOptions::default())
}

/// Parses text like [`parse`], with options.
///
/// # Errors
/// Those of [`read`].
pub fn parse_with(
    place: &dyn fmt::Display,
    text: &str,
    options: &TrafficOptions,
) -> Result<RecordedTraffic, InputError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut collector = RowCollector::new(place, "line");
    collect(&mut collector, text)?;
    flights::into_traffic(collector, options)
}

/// Reads the rows of a text, whose source its first lines tell.
fn collect(collector: &mut RowCollector, text: &str) -> Result<(), InputError> {
    let start = text.trim_start();
    if start.starts_with(['{', '[']) {
        return json_source::collect(collector, text);
    }
    if start.starts_with('<') {
        let cause = "is XML, as KML and GPX are, and tracks are not read from that";
        return Err(InputError::new(collector.place(), cause, POINTS_REMEDY));
    }
    if so6::is_so6(text) {
        so6::collect(collector, text);
        return Ok(());
    }
    if base_station::is_base_station(text) {
        base_station::collect(collector, text);
        return Ok(());
    }
    if daa::is_daa(text) {
        return daa::collect(collector, text);
    }
    csv_source::collect(collector, text)
}

/// Parses the content of a file, text or Parquet; `place` is its name in errors.
///
/// # Errors
/// Those of [`read`].
pub fn from_bytes(
    place: &dyn fmt::Display,
    bytes: Vec<u8>,
    options: &TrafficOptions,
) -> Result<RecordedTraffic, InputError> {
    if parquet_source::is_parquet(&bytes) {
        let mut collector = RowCollector::new(place, "row");
        parquet_source::collect(&mut collector, bytes)?;
        return flights::into_traffic(collector, options);
    }
    let mut collector = RowCollector::new(place, "line");
    let text = text::decode(bytes, &mut collector)?;
    collect(&mut collector, text.strip_prefix('\u{feff}').unwrap_or(&text))?;
    flights::into_traffic(collector, options)
}
