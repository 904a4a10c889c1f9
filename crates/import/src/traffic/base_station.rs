//! Messages of BaseStation (SBS-1), as decoders give them on port 30003: 22 fields a line, separated by commas.
//!
//! Fields, from 1: `MSG`, kind of message, session, aircraft, address, flight, date and time of the message, date and time
//! of its record, call sign, altitude (ft), speed (kt), direction, latitude, longitude, vertical speed (ft/min), squawk, and
//! flags, the last for the ground, -1 for yes. No kind has all: positions are in kinds 2 and 3, speeds in 4, call signs in 1.
//! Source: "Socket Data and BST Files", woodair.net/sbs/article/barebones42_socket_data.htm.

use super::columns::{Field, Layout, Source};
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use crate::table::data_lines;
use std::collections::BTreeMap;

/// Number of fields of a line.
const FIELD_COUNT: usize = 22;
/// Words with which lines begin.
const KINDS: [&str; 6] = ["MSG", "SEL", "ID", "AIR", "STA", "CLK"];
/// The most lines after a message of speed in which a position of the same aircraft has that speed. It is no time: a
/// decoder gives a speed twice a second, and its clock may be unset.
const MAX_SPEED_AGE: u32 = 10;
/// The greatest number of bytes of a call sign, which all later positions of the aircraft have.
const MAX_CALLSIGN_BYTES: usize = 64;

/// What an aircraft has said of itself.
#[derive(Debug, Clone, Copy, Default)]
struct Known<'a> {
    callsign: &'a str,
    /// Speed, direction and vertical speed.
    motion: [&'a str; 3],
    /// Number of its lines since then.
    motion_age: u32,
}

/// A position, with what is known of its aircraft.
struct Message<'a> {
    fields: [&'a str; FIELD_COUNT],
    time: String,
    known: Known<'a>,
}

impl RowValues for Message<'_> {
    fn value(&self, column: usize) -> Value<'_> {
        let [speed, track, climb] = self.known.motion;
        Value::from_text(match column {
            0 => &self.time,
            1 => self.fields[4],
            2 => self.known.callsign,
            3 => self.fields[14],
            4 => self.fields[15],
            5 => self.fields[11],
            6 => speed,
            7 => track,
            8 => climb,
            _ => self.fields[21],
        })
    }
}

/// Returns whether a text is such a file, by its first line.
pub(super) fn is_base_station(text: &str) -> bool {
    data_lines(text).next().is_some_and(|(_, line)| {
        let kind = line.split(',').next().unwrap_or("").trim();
        KINDS.contains(&kind) && line.matches(',').count() >= 9
    })
}

/// Reads the positions of a text.
pub(super) fn collect(collector: &mut RowCollector, text: &str) {
    let fields = [
        Field::Time,
        Field::Address,
        Field::Callsign,
        Field::Latitude,
        Field::Longitude,
        Field::Altitude,
        Field::GroundSpeed,
        Field::Track,
        Field::VerticalSpeed,
        Field::OnGround,
    ];
    let columns: Vec<(Field, usize, f64)> =
        fields.into_iter().enumerate().map(|(index, field)| (field, index, 1.0)).collect();
    let layout = Layout::new(Source::BaseStation, &columns);
    collector.describe_source(&layout, "SBS-1");
    let mut aircraft: BTreeMap<&str, Known> = BTreeMap::new();
    for (number, line) in data_lines(text) {
        let kind = line.split(',').next().unwrap_or("").trim();
        if kind != KINDS[0] && KINDS.contains(&kind) {
            continue;
        }
        let words: Vec<&str> = line.split(',').map(str::trim).take(FIELD_COUNT + 1).collect();
        let fields = <[&str; FIELD_COUNT]>::try_from(words)
            .ok()
            .filter(|fields| kind == KINDS[0] && fields[10].len() <= MAX_CALLSIGN_BYTES);
        let Some(fields) = fields else {
            collector.leave_out(number, 1, "lines that are no message of 22 fields");
            continue;
        };
        let known = aircraft.entry(fields[4]).or_default();
        known.update(&fields);
        if !fields[14].is_empty() || !fields[15].is_empty() {
            let time = format!("{} {}", fields[6], fields[7]);
            collector.push(number, &layout, &Message { fields, time, known: *known });
        }
    }
}

impl<'a> Known<'a> {
    fn update(&mut self, fields: &[&'a str; FIELD_COUNT]) {
        if !fields[10].is_empty() {
            self.callsign = fields[10];
        }
        self.motion_age = self.motion_age.saturating_add(1);
        if !fields[12].is_empty() {
            self.motion = [fields[12], fields[13], fields[16]];
            self.motion_age = 0;
        } else if self.motion_age > MAX_SPEED_AGE {
            self.motion = [""; 3];
        }
    }
}
