//! Flight segments of EUROCONTROL's so6 files (m1: as planned, m3: as flown): 20 fields a line, separated by blanks.
//!
//! Fields, from 1: segment, origin, destination, aircraft type, time (HHMMSS) at begin and end, flight level at begin and
//! end, phase (0 climb, 1 descent, 2 cruise), call sign, date (YYMMDD) at begin and end, latitude and longitude in minutes
//! of arc at begin and end, flight, sequence, length (NM), parity. Source: EUROCONTROL, DDR2 Reference Manual for
//! Generic Users, appendix "SO6 segment file format".

use super::columns::{Field, Layout, Source};
use super::rows::{RowCollector, RowValues};
use super::time::days_since_1970;
use super::value::Value;
use crate::table::{data_lines, tokens};

/// Number of fields of a line.
const FIELD_COUNT: usize = 20;

/// An end of a segment, as a row.
struct SegmentEnd<'a> {
    time_s: f64,
    callsign: &'a str,
    flight_id: &'a str,
    lat_deg: f64,
    lon_deg: f64,
    altitude_ft: f64,
}

impl RowValues for SegmentEnd<'_> {
    fn value(&self, column: usize) -> Value<'_> {
        match column {
            0 => Value::Number(self.time_s),
            1 => Value::Text(self.callsign),
            2 => Value::Text(self.flight_id),
            3 => Value::Number(self.lat_deg),
            4 => Value::Number(self.lon_deg),
            _ => Value::Number(self.altitude_ft),
        }
    }
}

/// Returns whether a text is such a file, by its first line.
pub(super) fn is_so6(text: &str) -> bool {
    data_lines(text).next().is_some_and(|(_, line)| {
        let fields = fields(line);
        fields.is_some_and(|fields| segment_time_s(fields[4], fields[10]).is_some())
    })
}

/// Reads the ends of all segments; where one begins at the end of another, the position is kept once.
pub(super) fn collect(collector: &mut RowCollector, text: &str) {
    let layout = Layout::new(
        Source::Segments,
        &[
            (Field::Time, 0, 1.0),
            (Field::Callsign, 1, 1.0),
            (Field::FlightId, 2, 1.0),
            (Field::Latitude, 3, 1.0),
            (Field::Longitude, 4, 1.0),
            (Field::Altitude, 5, 1.0),
        ],
    );
    collector.describe_source(&layout, "EUROCONTROL so6");
    // The end of the line before, of the flight with this name.
    let mut last: Option<(&str, f64)> = None;
    for (number, line) in data_lines(text) {
        let Some([begin, end]) = fields(line).as_ref().and_then(segment_ends) else {
            collector.leave_out(number, 1, "lines that are no segment of a flight");
            continue;
        };
        if last != Some((begin.flight_id, begin.time_s)) {
            collector.push(number, &layout, &begin);
        }
        last = Some((end.flight_id, end.time_s));
        collector.push(number, &layout, &end);
    }
}

fn fields(line: &str) -> Option<[&str; FIELD_COUNT]> {
    let words: Vec<&str> = tokens(1, line).take(FIELD_COUNT + 1).map(|token| token.text).collect();
    words.try_into().ok()
}

fn segment_ends<'a>(fields: &[&'a str; FIELD_COUNT]) -> Option<[SegmentEnd<'a>; 2]> {
    let end = |k: usize| {
        Some(SegmentEnd {
            time_s: segment_time_s(fields[4 + k], fields[10 + k])?,
            callsign: fields[9],
            flight_id: fields[16],
            lat_deg: number(fields[12 + 2 * k])? / 60.0,
            lon_deg: number(fields[13 + 2 * k])? / 60.0,
            altitude_ft: number(fields[6 + k])? * 100.0,
        })
    };
    Some([end(0)?, end(1)?])
}

/// Returns the time in s since 1970 of `HHMMSS` on the day `YYMMDD`, both without leading zeros or with them.
fn segment_time_s(clock: &str, date: &str) -> Option<f64> {
    let [h, m, s] = pairs(clock)?;
    let [year, month, day] = pairs(date)?;
    let days = days_since_1970(2000 + year, month, day)?;
    let is_clock = h <= 24 && m < 60 && s < 60;
    is_clock.then(|| days as f64 * 86_400.0 + f64::from(h * 3600 + m * 60 + s))
}

/// Returns the three pairs of digits of a number of up to six.
fn pairs(text: &str) -> Option<[u32; 3]> {
    let is_number = (1..=6).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    let value: u32 = is_number.then(|| text.parse().ok()).flatten()?;
    Some([value / 10_000, value / 100 % 100, value % 100])
}

fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}
