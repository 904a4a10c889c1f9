//! Flights as a table of this program's own columns.

use super::{RecordedTraffic, Sample, Track};
use std::borrow::Cow;
use std::fmt::Write;

const HEADER: &str =
    "time_s,icao24,callsign,flight_id,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm,onground\n";

/// Returns the flights as CSV with the units in the names of the columns. Each flight has a `flight_id` and is in the
/// air, so that reading the table gives the same flights.
pub fn to_csv(traffic: &RecordedTraffic) -> String {
    let mut text = String::from(HEADER);
    for (k, track) in traffic.tracks.iter().enumerate() {
        // Flights that the file names may be parts of one: numbers are in the order of the flights.
        let name = format!("{:06}", k + 1);
        for sample in &track.samples {
            write_row(&mut text, track, &name, sample);
        }
    }
    text
}

fn write_row(text: &mut String, track: &Track, name: &str, sample: &Sample) {
    let Sample { time_s, position, altitude_ft, .. } = sample;
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "{time_s},{},{},{},{},{},{altitude_ft}",
        quoted(&track.icao24),
        quoted(&track.callsign),
        name,
        position.lat_deg,
        position.lon_deg
    );
    for value in [sample.ground_speed_kt, sample.track_deg, sample.vertical_speed_fpm] {
        let _ = match value {
            Some(value) => write!(text, ",{value}"),
            None => write!(text, ","),
        };
    }
    text.push_str(",false\n");
}

/// Returns a name as a field of a table.
fn quoted(name: &str) -> Cow<'_, str> {
    let plain: String = name.chars().filter(|c| !c.is_control()).collect();
    if plain.contains([',', ';', '"', '#']) || plain.len() < name.len() {
        return format!("\"{}\"", plain.replace('"', "\"\"")).into();
    }
    plain.into()
}
