//! Recorded air traffic: a CSV table with one row per aircraft and instant.
//!
//! Columns, found by name: `time_s` (UTC, s), `icao24` (the transponder's address), `callsign`,
//! `lat_deg`, `lon_deg`, `alt_ft` (barometric), `gs_kt`, `track_deg` and `vs_fpm`. The table may
//! lack `callsign` and `vs_fpm`, and fields of these two may be empty. Other columns are ignored.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use super::local_plane::{LatLon, LocalPlane};
use super::table::{CsvRow, CsvTable, Token};
use sidestep_kernel::{InputError, math};
use std::ops::RangeInclusive;

/// All tracks of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedTraffic {
    /// One track per aircraft, sorted by `icao24`.
    pub tracks: Vec<Track>,
    /// Number of rows of the table, without the header.
    pub rows: usize,
    /// Number of rows that repeat the instant of an earlier row of the same aircraft; they are left
    /// out.
    pub repeated_rows: usize,
}

/// The track of one aircraft.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Address of the transponder, as written.
    pub icao24: String,
    /// The first call sign in the file; empty where there is none.
    pub callsign: String,
    /// The samples, at least one, with strictly increasing times.
    pub samples: Vec<Sample>,
}

/// An aircraft at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time in s since the start of 1970, UTC.
    pub time_s: f64,
    /// Its position on the earth, as the transponder reports it.
    pub position: LatLon,
    /// Barometric altitude above standard pressure in ft, so not the height above ground.
    pub altitude_ft: f64,
    /// Speed over the ground in kt, not negative.
    pub ground_speed_kt: f64,
    /// Direction of motion over the ground in degrees, clockwise from true north, in [0, 360).
    pub track_deg: f64,
    /// Vertical speed in ft/min, positive upward.
    pub vertical_speed_fpm: Option<f64>,
}

/// Reads a file, plain or compressed with gzip.
///
/// # Errors
/// When it cannot be read or is not as described in the [module](self).
pub fn read(path: &Path) -> Result<RecordedTraffic, InputError> {
    tracks(&CsvTable::read(path)?)
}

/// Parses text; `place` is its name in errors.
///
/// # Errors
/// When it is not as described in the [module](self).
pub fn parse(place: &dyn fmt::Display, text: &str) -> Result<RecordedTraffic, InputError> {
    tracks(&CsvTable::parse(place, text)?)
}

/// The range of times in s since the start of 1970. Milliseconds of the present day are beyond it.
const TIMES_S: RangeInclusive<f64> = -1e11..=1e11;

/// The longest time in s between the earliest row and the latest: no recording takes 30 years.
const MAX_DURATION_S: f64 = 1e9;

/// The range of altitudes in ft: beyond it the column must hold another quantity.
const ALTITUDES_FT: RangeInclusive<f64> = -1e6..=1e6;

/// The greatest speed between two rows, in m/s: beyond it one of the two positions is wrong. The simulator bounds
/// airplanes by it as well; here an error points at the row.
pub const MAX_SPEED_M_S: f64 = 1e6;

/// The indices of the columns; the optional ones may be missing.
struct ColumnIndices<'a> {
    place: &'a str,
    time: usize,
    icao24: usize,
    callsign: Option<usize>,
    lat: usize,
    lon: usize,
    altitude: usize,
    ground_speed: usize,
    track: usize,
    vertical_speed: Option<usize>,
}

impl<'a> ColumnIndices<'a> {
    fn find(table: &'a CsvTable) -> Result<Self, InputError> {
        let names = ["time_s", "icao24", "lat_deg", "lon_deg", "alt_ft", "gs_kt", "track_deg"];
        let [time, icao24, lat, lon, altitude, ground_speed, track] = table.columns(names)?;
        Ok(Self {
            place: table.place(),
            time,
            icao24,
            callsign: table.find("callsign"),
            lat,
            lon,
            altitude,
            ground_speed,
            track,
            vertical_speed: table.find("vs_fpm"),
        })
    }

    fn sample(&self, row: CsvRow) -> Result<Sample, InputError> {
        let vertical_speed = self.vertical_speed.map(|column| row.field(column));
        let vertical_speed = vertical_speed.filter(|word| !word.text.is_empty());
        Ok(Sample {
            time_s: self.time_s(row.field(self.time))?,
            position: LatLon {
                lat_deg: self.number_in(row.field(self.lat), -90.0..=90.0)?,
                lon_deg: self.number_in(row.field(self.lon), -180.0..=180.0)?,
            },
            altitude_ft: self.number_in(row.field(self.altitude), ALTITUDES_FT)?,
            ground_speed_kt: self.number_in(row.field(self.ground_speed), 0.0..=10_000.0)?,
            // 360 is north, as is 0.
            track_deg: self.number_in(row.field(self.track), 0.0..=360.0)? % 360.0,
            vertical_speed_fpm: vertical_speed.map(|word| word.number(&self.place)).transpose()?,
        })
    }

    fn time_s(&self, word: Token) -> Result<f64, InputError> {
        let value = word.number(&self.place)?;
        if TIMES_S.contains(&value) {
            return Ok(value);
        }
        let cause = format!("a time of {value:?} s since 1970");
        Err(word.error(&self.place, cause, "give seconds; divide milliseconds by 1000"))
    }

    fn number_in(&self, word: Token, range: RangeInclusive<f64>) -> Result<f64, InputError> {
        let value = word.number(&self.place)?;
        if range.contains(&value) {
            return Ok(value);
        }
        let cause = format!("{value:?} is not between {} and {}", range.start(), range.end());
        Err(word.error(&self.place, cause, "restore the value or delete the row"))
    }

    fn icao24<'t>(&self, row: CsvRow<'t>) -> Result<&'t str, InputError> {
        let word = row.field(self.icao24);
        if word.text.is_empty() {
            let cause = "the row has no aircraft".to_string();
            return Err(word.error(&self.place, cause, "write its icao24 address"));
        }
        Ok(word.text)
    }
}

/// A track that is being read, with the words of the times of its samples, at which errors point.
struct TrackBuilder<'t> {
    track: Track,
    times: Vec<Token<'t>>,
}

fn tracks(table: &CsvTable) -> Result<RecordedTraffic, InputError> {
    let columns = ColumnIndices::find(table)?;
    let mut by_aircraft: BTreeMap<&str, TrackBuilder<'_>> = BTreeMap::new();
    let mut rows = 0;
    for row in table.rows() {
        rows += 1;
        let icao24 = columns.icao24(row)?;
        let TrackBuilder { track, times } =
            by_aircraft.entry(icao24).or_insert_with(|| new_builder(icao24));
        if let (Some(column), "") = (columns.callsign, track.callsign.as_str()) {
            row.field(column).text.clone_into(&mut track.callsign);
        }
        track.samples.push(columns.sample(row)?);
        times.push(row.field(columns.time));
    }
    let mut builders: Vec<TrackBuilder<'_>> = by_aircraft.into_values().collect();
    let repeated_rows = builders.iter_mut().map(sort_by_time).sum();
    check_times(columns.place, &builders)?;
    check_speeds(columns.place, &builders)?;
    let tracks = builders.into_iter().map(|builder| builder.track).collect();
    Ok(RecordedTraffic { tracks, rows, repeated_rows })
}

fn new_builder<'t>(icao24: &str) -> TrackBuilder<'t> {
    let track = Track { icao24: icao24.to_owned(), callsign: String::new(), samples: Vec::new() };
    TrackBuilder { track, times: Vec::new() }
}

/// Sorts the samples; of several at one instant the first is kept. Returns the number of those removed.
fn sort_by_time(builder: &mut TrackBuilder<'_>) -> usize {
    let TrackBuilder { track: Track { samples, .. }, times } = builder;
    let all = samples.len();
    let mut both: Vec<(Sample, Token<'_>)> = samples.drain(..).zip(times.drain(..)).collect();
    // A stable sort, so that the first row of an instant in the file stays the first.
    both.sort_by(|(a, _), (b, _)| a.time_s.total_cmp(&b.time_s));
    both.dedup_by_key(|(sample, _)| sample.time_s);
    (*samples, *times) = both.into_iter().unzip();
    all - samples.len()
}

/// Refuses rows that are decades later than the first.
fn check_times(place: &str, builders: &[TrackBuilder<'_>]) -> Result<(), InputError> {
    let samples = builders.iter().flat_map(|builder| &builder.track.samples);
    let first_s = samples.map(|sample| sample.time_s).fold(f64::INFINITY, f64::min);
    for TrackBuilder { track, times } in builders {
        for (sample, word) in track.samples.iter().zip(times) {
            let after_s = sample.time_s - first_s;
            if after_s > MAX_DURATION_S {
                let cause = format!("{after_s:?} s after the first row of the table");
                let remedy = format!(
                    "restore the time of one of the two: up to {MAX_DURATION_S:e} s are between them"
                );
                return Err(word.error(&place, cause, &remedy));
            }
        }
    }
    Ok(())
}

/// Refuses rows with a position that no aircraft reaches from the previous one, on the plane of the simulation.
fn check_speeds(place: &str, builders: &[TrackBuilder<'_>]) -> Result<(), InputError> {
    let samples = builders.iter().flat_map(|builder| &builder.track.samples);
    let Some(plane) = LocalPlane::from_positions(samples.map(|sample| sample.position)) else {
        return Ok(());
    };
    for TrackBuilder { track, times } in builders {
        for (pair, word) in track.samples.windows(2).zip(&times[1..]) {
            let [from, to] = [pair[0], pair[1]].map(|sample| plane.to_plane_m(sample.position));
            let distance_m = math::hypot(to[0] - from[0], to[1] - from[1]);
            let duration_s = pair[1].time_s - pair[0].time_s;
            if distance_m / duration_s >= MAX_SPEED_M_S {
                let cause = format!(
                    "{} flies {:.0} km in {duration_s} s, from its previous row",
                    track.icao24,
                    distance_m / 1e3
                );
                let remedy = format!(
                    "restore its position or its time, or delete the row: nothing flies {MAX_SPEED_M_S:e} m/s"
                );
                return Err(word.error(&place, cause, &remedy));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_testing::shared_data as shared;

    const HEADER: &str = "time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm\n";

    fn parsed(rows: &str) -> Result<RecordedTraffic, InputError> {
        parse(&"t.csv", &format!("{HEADER}{rows}"))
    }

    #[test]
    fn rows_become_tracks_by_aircraft_sorted_by_time() {
        let traffic = parsed(
            "20,b,,46,6,38000,460,360,\n10,a,X1,46,6,38000,460,10,-64\n10,b,Y2,47,6,38000,460,0,0\n",
        )
        .unwrap();
        assert_eq!(traffic.rows, 3);
        let names: Vec<_> = traffic.tracks.iter().map(|track| track.callsign.as_str()).collect();
        assert_eq!(names, ["X1", "Y2"]);
        assert_eq!(traffic.tracks[0].samples[0].vertical_speed_fpm, Some(-64.0));
        let b = &traffic.tracks[1].samples;
        assert_eq!((b[0].time_s, b[1].time_s), (10.0, 20.0));
        assert_eq!((b[1].track_deg, b[1].vertical_speed_fpm), (0.0, None));
    }

    #[test]
    fn a_second_row_for_one_instant_is_left_out_and_counted() {
        let traffic = parsed("10,a,,46,6,1,2,3,\n10,a,,47,6,1,2,3,\n").unwrap();
        assert_eq!((traffic.rows, traffic.repeated_rows), (2, 1));
        assert_eq!(traffic.tracks[0].samples[0].position.lat_deg, 46.0);
    }

    #[test]
    fn wrong_fields_are_pointed_at() {
        for (row, column) in [
            ("x,a,,46,6,1,2,3,", 1),
            ("1,,,46,6,1,2,3,", 3),
            ("1,a,,,6,1,2,3,", 6),
            ("1,a,,91,6,1,2,3,", 6),
            ("1,a,,46,181,1,2,3,", 9),
            ("1,a,,46,6,1,-2,3,", 13),
            ("1,a,,46,6,1,2,3,up", 17),
        ] {
            let error = parsed(row).unwrap_err();
            assert_eq!(error.line_and_column(), Some((2, column)), "{row}: {error}");
        }
        assert!(parse(&"t.csv", "time_s\n1\n").unwrap_err().cause().contains("icao24"));
    }

    #[test]
    fn times_altitudes_and_jumps_that_cannot_be_are_pointed_at_in_the_users_own_rows() {
        for (rows, place, cause) in [
            ("1700000000000,a,,46,6,1,2,3,\n1700000010000,a,,46,6,1,2,3,\n", (2, 1), "since 1970"),
            ("1,a,,46,6,1e7,2,3,\n", (2, 11), "not between"),
            ("5,a,,46,6,1,2,3,\n2e9,b,,46,6,1,2,3,\n", (3, 1), "after the first row"),
            (
                "12,a,,46.02,6,1,2,3,\n10,a,,46,6,1,2,3,\n11,a,,-46.01,-174,1,2,3,\n",
                (4, 1),
                "a flies",
            ),
        ] {
            let error = parsed(rows).expect_err(rows);
            assert_eq!(error.line_and_column(), Some(place), "{error}");
            assert!(error.cause().contains(cause), "{error}");
        }
    }

    #[test]
    fn a_table_without_call_signs_and_vertical_speeds_is_traffic_too() {
        let text = "time_s,icao24,lat_deg,lon_deg,alt_ft,gs_kt,track_deg\n1,a,46,6,1,2,3\n";
        let traffic = parse(&"t.csv", text).unwrap();
        assert_eq!(traffic.tracks[0].samples[0].vertical_speed_fpm, None);
        assert_eq!(traffic.tracks[0].callsign, "");
    }

    #[test]
    fn the_recording_over_switzerland_has_the_expected_aircraft_and_rows() {
        let Some(path) = shared("airspace/opensky/switzerland_20180801_dev.csv") else { return };
        let traffic = read(&path).unwrap();
        assert_eq!((traffic.tracks.len(), traffic.rows, traffic.repeated_rows), (88, 6112, 0));
        let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
        assert_eq!(samples().count(), 6112);
        let range = |of: fn(&Sample) -> f64| {
            let ends = (f64::INFINITY, f64::NEG_INFINITY);
            samples().map(of).fold(ends, |(low, high), value| (low.min(value), high.max(value)))
        };
        assert_eq!(range(|s| s.time_s), (1_533_114_900.0, 1_533_116_690.0));
        assert_eq!(range(|s| s.altitude_ft), (31_000.0, 43_000.0));
        assert_eq!(range(|s| s.ground_speed_kt), (393.2, 509.0));
    }

    #[test]
    fn a_packed_file_reads_the_same() {
        use std::io::Write;
        let text = format!("{HEADER}10,a,,46,6,1,2,3,\n");
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        gzip.write_all(text.as_bytes()).unwrap();
        file.write_all(&gzip.finish().unwrap()).unwrap();
        assert_eq!(read(file.path()), parse(&"t.csv", &text));
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_traffic_or_an_error(rows in "([0-9a-z.,-]{0,30}\n){0,4}") {
            let _ = parsed(&rows);
        }
    }
}
