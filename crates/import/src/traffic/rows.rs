//! The rows of a file, each checked: those with a position at a time are kept, all others counted.

use super::columns::{Field, Layout, Source};
use super::time::{UnixUnit, WrittenTime, parse_day_first, parse_time};
use super::value::{NotANumber, Value};
use super::{LatLon, Sample};
use crate::report::{ImportReport, MAX_PLACES, Treatment};
use sidestep_kernel::InputError;
use std::collections::BTreeSet;
use std::fmt;
use std::ops::RangeInclusive;

/// The range of altitudes in ft: beyond it the column must hold another quantity.
const ALTITUDES_FT: RangeInclusive<f64> = -5_000.0..=200_000.0;

/// The range of speeds in kt: nothing that flies in air is faster, and 9999 stands for no speed.
const SPEEDS_KT: RangeInclusive<f64> = 0.0..=5_000.0;

/// The longest time in s between the middle row and any other: no recording takes 30 years.
const MAX_DURATION_S: f64 = 1e9;

/// The least time in s since 1970 of a recording of traffic, in the year 1973: smaller numbers count from elsewhere.
const MIN_PRESENT_S: f64 = 1e8;

/// The rule by which columns are not used.
pub(super) const UNUSED_COLUMNS_RULE: &str = "columns";

/// Largest latitude and longitude in degrees of what is near 0 0: an aircraft that flies over it has rows there, too.
const NEAR_DEG: f64 = 1.0;

const NO_TIME: &str = "rows with a time that is neither ISO 8601 nor a number since 1970";
const NO_POSITION: &str = "rows without a position";
const NO_ALTITUDE: &str = "rows without an altitude";
/// What readsb lists beside traffic: aircraft that answer radar alone, and those not heard of for long.
const SILENT_RULE: &str = "rows of aircraft that send no position";
const NO_NUMBER_POSITION: &str = "rows with a position that is no number";
const NO_NUMBER_ALTITUDE: &str = "rows with an altitude that is no number";
/// The rule by which rows with a wrong number of fields are left out.
pub(super) const MISFIT_RULE: &str = "rows with fewer or more fields than the header";
/// The rule by which one of several rows of an instant is kept.
pub(super) const SAME_INSTANT_RULE: &str =
    "rows with another position at the instant of an earlier row";
/// The rule by which rows are left out that nothing reaches.
pub(super) const UNREACHED_RULE: &str =
    "rows with a position that nothing reaches from the row before";

/// What helps where most rows are left out by a rule.
const REMEDIES: [(&str, &str); 6] = [
    (NO_TIME, "write times as 2018-08-01T09:00:00Z, or as seconds since 1970: 1533114000"),
    (
        NO_NUMBER_POSITION,
        "write degrees as plain numbers, negative in the south and west: 47.5 and -7.25",
    ),
    (
        NO_NUMBER_ALTITUDE,
        "write plain numbers in the unit that the column's name has: 35000 in `alt_ft`, 350 in `flight_level`",
    ),
    (MISFIT_RULE, "give every row one field per column of the header"),
    (SAME_INSTANT_RULE, "write times with all their digits: fractions of a second as well"),
    (
        UNREACHED_RULE,
        "see that times are seconds since 1970 or ISO 8601, not days, and that positions are degrees",
    ),
];

/// A row of one aircraft.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// Its number in the file.
    pub(super) number: usize,
    /// The address, as written.
    pub(super) address: String,
    pub(super) callsign: String,
    pub(super) flight_id: String,
    /// Whether it is on the ground, where the file tells.
    pub(super) is_on_ground: Option<bool>,
    /// The time in s for which its position was not received anew, where the file tells.
    pub(super) position_age_s: f64,
    /// Whether its altitude is the geometric one, in a file that has others.
    is_geometric: bool,
    pub(super) sample: Sample,
}

/// A row whose time waits for its unit.
#[derive(Debug)]
struct TimedRow {
    row: Row,
    time: WrittenTime,
    position_time: Option<WrittenTime>,
}

/// The word that readsb writes for the altitude of an aircraft on the ground.
const GROUND_WORD: &str = "ground";

/// A row as its file holds it.
pub(super) trait RowValues {
    /// Returns the cell in a column.
    fn value(&self, column: usize) -> Value<'_>;
}

/// What is read from a file.
#[derive(Debug)]
pub(super) struct RowCollector {
    place: String,
    /// What a row is called in the report: `line`.
    noun: &'static str,
    rows: Vec<TimedRow>,
    row_count: usize,
    bad_count: usize,
    first_bad: Option<usize>,
    pub(super) report: ImportReport,
}

impl RowCollector {
    /// Returns a collector without rows; `place` is the file's name in errors.
    pub(super) fn new(place: &dyn fmt::Display, noun: &'static str) -> Self {
        Self {
            place: place.to_string(),
            noun,
            rows: Vec::new(),
            row_count: 0,
            bad_count: 0,
            first_bad: None,
            report: ImportReport::new(""),
        }
    }

    /// Returns the name of the file in errors.
    pub(super) fn place(&self) -> &str {
        &self.place
    }

    /// Returns the word for a row.
    pub(super) fn noun(&self) -> &'static str {
        self.noun
    }

    /// Sets the word for a row.
    pub(super) fn set_noun(&mut self, noun: &'static str) {
        self.noun = noun;
    }

    /// Names the source of the rows, and what is not used of it.
    pub(super) fn describe_source(&mut self, layout: &Layout, format: &str) {
        let (name, units) = layout.source.describe();
        self.report.format = format!("{name} ({format})");
        self.report.add_fact("units", units);
        if layout.column(Field::Altitude).is_none() {
            let rule = "the only altitude is the geometric one, and levels are compared by it";
            self.report.record(Treatment::Guessed, rule, "", "");
        }
        for name in &layout.repeated {
            let rule = "columns of a name that the header has several times: the first one is read";
            let remedy = "give each column a name of its own";
            self.report.record(Treatment::Guessed, rule, format!("`{name:.40}`"), remedy);
        }
        for name in &layout.unused {
            self.report.record(
                Treatment::NotUsed,
                UNUSED_COLUMNS_RULE,
                format!("`{name:.40}`"),
                "",
            );
        }
    }

    /// Counts rows that are left out.
    pub(super) fn leave_out(&mut self, number: usize, count: usize, rule: &str) {
        self.row_count += count;
        self.bad_count += count;
        self.first_bad.get_or_insert(number);
        let place = self.row_place(rule, number);
        self.report.record(Treatment::Dropped, rule, place, "");
        for _ in 1..count {
            self.report.record(Treatment::Dropped, rule, "", "");
        }
    }

    /// Returns the place of a row, as long as the rule needs places.
    fn row_place(&self, rule: &str, number: usize) -> String {
        let known = self.report.findings.iter().find(|finding| finding.rule == rule);
        if known.is_some_and(|finding| finding.places.len() >= MAX_PLACES) {
            return String::new();
        }
        format!("{} {number}", self.noun)
    }

    /// Reads a row; one that cannot be used is left out.
    pub(super) fn push(&mut self, number: usize, layout: &Layout, values: &dyn RowValues) {
        let reader = RowReader { layout, values };
        match reader.row(number) {
            Ok(row) => self.push_row(row),
            Err(NO_POSITION) if reader.is_silent() => {
                self.row_count += 1;
                let place = self.row_place(SILENT_RULE, number);
                self.report.record(Treatment::NotUsed, SILENT_RULE, place, "");
            }
            Err(rule) => self.leave_out(number, 1, rule),
        }
    }

    fn push_row(&mut self, read: ReadRow) {
        self.row_count += 1;
        let number = read.timed.row.number;
        for rule in read.bad_cells.into_iter().flatten() {
            let place = self.row_place(rule, number);
            self.report.record(Treatment::Dropped, rule, place, "");
        }
        self.rows.push(read.timed);
    }

    /// Returns all usable rows, in the order of the file.
    ///
    /// # Errors
    /// When there is none, or more than half of all are bad.
    pub(super) fn finish(mut self) -> Result<CheckedRows, InputError> {
        let unit = self.unix_unit();
        let has_early_times = self.has_early_times();
        let mut zoneless = 0;
        let mut rows = Vec::with_capacity(self.rows.len());
        for timed in std::mem::take(&mut self.rows) {
            let TimedRow { mut row, time, position_time } = timed;
            zoneless += usize::from(matches!(time, WrittenTime::Calendar { has_zone: false, .. }));
            row.sample.time_s = seconds(time, unit);
            if let Some(time) = position_time {
                row.position_age_s = row.sample.time_s - seconds(time, unit);
            }
            rows.push(row);
        }
        if zoneless > 0 {
            let rule = "times without a zone are UTC";
            self.report.record(Treatment::Guessed, rule, "", "write `Z` or the offset behind them");
        }
        if has_early_times {
            let rule = "times are seconds since 1970 and lie before 1973: they may count from another start";
            let remedy =
                "add the seconds from 1970 to that start, for dates and hours in what comes out";
            self.report.record(Treatment::Guessed, rule, "", remedy);
        }
        if unit != UnixUnit::Seconds {
            let rule = format!("times are {} since 1970, by their size", unit.name());
            self.report.record(Treatment::Guessed, rule, "", "");
        }
        self.leave_out_far_times(&mut rows);
        self.leave_out_zero_positions(&mut rows);
        self.leave_out_geometric(&mut rows);
        self.check_counts(rows.len())?;
        Ok(CheckedRows {
            place: self.place,
            noun: self.noun,
            rows,
            row_count: self.row_count,
            bad_count: self.bad_count,
            report: self.report,
        })
    }

    /// Returns the middle one of the numbers since 1970, where there are any.
    fn middle_number(&self) -> Option<f64> {
        let mut numbers = Vec::new();
        for timed in &self.rows {
            if let WrittenTime::Unix(value) = timed.time {
                numbers.push(value);
            }
        }
        median(&mut numbers)
    }

    /// Returns the unit of numbers since 1970: that of the middle one.
    fn unix_unit(&self) -> UnixUnit {
        self.middle_number().map_or(UnixUnit::Seconds, UnixUnit::of_size)
    }

    /// Returns whether times are numbers that nobody has recorded as seconds since 1970.
    fn has_early_times(&self) -> bool {
        self.middle_number().is_some_and(|middle| middle.abs() < MIN_PRESENT_S)
    }

    /// Leaves out rows whose time is decades from that of the middle row.
    fn leave_out_far_times(&mut self, rows: &mut Vec<Row>) {
        let mut times: Vec<f64> = rows.iter().map(|row| row.sample.time_s).collect();
        let Some(middle_s) = median(&mut times) else { return };
        let mut far = Vec::new();
        rows.retain(|row| {
            let is_near = (row.sample.time_s - middle_s).abs() <= MAX_DURATION_S;
            if !is_near {
                far.push(row.number);
            }
            is_near
        });
        // These were counted as rows when they were read.
        self.row_count -= far.len();
        for number in far {
            self.leave_out(number, 1, "rows with a time decades from that of the others");
        }
    }

    /// Leaves out rows at latitude 0 and longitude 0, which stand for no position, unless others are near that place.
    fn leave_out_zero_positions(&mut self, rows: &mut Vec<Row>) {
        let has_neighbors = rows.iter().any(|row| {
            let LatLon { lat_deg, lon_deg } = row.sample.position;
            !is_zero_position(row) && lat_deg.abs() < NEAR_DEG && lon_deg.abs() < NEAR_DEG
        });
        if has_neighbors {
            return;
        }
        let mut zero = Vec::new();
        rows.retain(|row| {
            let is_zero = is_zero_position(row);
            if is_zero {
                zero.push(row.number);
            }
            !is_zero
        });
        // These were counted as rows when they were read.
        self.row_count -= zero.len();
        for number in zero {
            let rule = "rows at latitude 0 and longitude 0, which stand for no position";
            self.leave_out(number, 1, rule);
        }
    }

    /// Leaves out rows with another kind of altitude than the other rows of their aircraft: between the two are steps.
    fn leave_out_geometric(&mut self, rows: &mut Vec<Row>) {
        if !rows.iter().any(|row| row.is_geometric) {
            return;
        }
        let has_level = |row: &&Row| !row.is_geometric && row.is_on_ground != Some(true);
        let with_level: BTreeSet<_> = rows.iter().filter(has_level).map(aircraft_key).collect();
        let mut geometric = BTreeSet::new();
        let mut left_out = Vec::new();
        rows.retain(|row| {
            if !row.is_geometric {
                return true;
            }
            let key = aircraft_key(row);
            let is_kept = !with_level.contains(&key);
            if is_kept {
                geometric.insert(key);
            } else {
                left_out.push(row.number);
            }
            is_kept
        });
        for [name, _] in &geometric {
            let rule = "aircraft with geometric altitudes alone, whose levels are compared by them";
            self.report.record(Treatment::Guessed, rule, format!("`{name:.40}`"), "");
        }
        // These were counted as rows when they were read.
        self.row_count -= left_out.len();
        for number in left_out {
            self.leave_out(number, 1, NO_ALTITUDE);
        }
    }

    fn check_counts(&self, kept: usize) -> Result<(), InputError> {
        if kept > 0 && self.bad_count * 2 <= self.row_count {
            return Ok(());
        }
        if self.row_count == 0 {
            let remedy = "give a recording with one row per aircraft and instant";
            return Err(InputError::new(&self.place, "has no rows", remedy));
        }
        let dropped = self.report.findings.iter().filter(|found| {
            found.treatment == Treatment::Dropped || found.rule == SILENT_RULE && kept == 0
        });
        let rules: Vec<String> = dropped.map(|found| found.to_string()).collect();
        let unused = if kept == 0 { self.row_count } else { self.bad_count };
        let cause =
            format!("{unused} of {} rows cannot be used: {}", self.row_count, rules.join("; "));
        let error = InputError::new(&self.place, cause, remedy_of(&self.report));
        Err(match self.first_bad {
            Some(line) if self.noun == "line" => error.with_position(line, 1),
            _ => error,
        })
    }
}

/// Returns what helps against the rule that left out the most.
pub(super) fn remedy_of(report: &ImportReport) -> &'static str {
    let dropped = report.findings.iter().filter(|found| found.treatment == Treatment::Dropped);
    let first = dropped.max_by_key(|found| found.count);
    let known = REMEDIES.iter().find(|(rule, _)| first.is_some_and(|found| found.rule == *rule));
    known.map_or("restore these rows, or delete them and read the rest", |(_, remedy)| remedy)
}

/// Rows of a file that can be used, and what became of the others.
#[derive(Debug)]
pub(super) struct CheckedRows {
    pub(super) place: String,
    pub(super) noun: &'static str,
    pub(super) rows: Vec<Row>,
    pub(super) row_count: usize,
    /// The number of rows that were left out.
    pub(super) bad_count: usize,
    pub(super) report: ImportReport,
}

/// Returns what tells aircraft apart: the address, which has no case and no leading zeros, or else a name; and the
/// flight, where the file names it.
pub(super) fn aircraft_key(row: &Row) -> [String; 2] {
    let address = plain_address(&row.address);
    let address = address.strip_prefix("0x").unwrap_or(&address).trim_start_matches('0');
    let flight = row.flight_id.clone();
    if row.address.is_empty() && flight.is_empty() {
        return [format!("callsign {}", row.callsign), flight];
    }
    [address.to_string(), flight]
}

/// Returns an address in lower case, its pairs of digits without marks between them: `4B:12:34` is `4b1234`.
fn plain_address(address: &str) -> String {
    let address = address.to_ascii_lowercase();
    let bare = address.replace([':', '-', ' '], "");
    let is_of_pairs = bare.len() == 6 && bare.bytes().all(|byte| byte.is_ascii_hexdigit());
    if is_of_pairs { bare } else { address }
}

/// Returns the middle one of some numbers, which it sorts.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

fn seconds(time: WrittenTime, unit: UnixUnit) -> f64 {
    match time {
        WrittenTime::Unix(value) => value / unit.per_s(),
        WrittenTime::Calendar { utc_s, .. } => utc_s,
    }
}

/// A row, and the rules by which cells of it were left out.
struct ReadRow {
    timed: TimedRow,
    bad_cells: [Option<&'static str>; 4],
}

/// Reads the cells of one row.
struct RowReader<'a> {
    layout: &'a Layout,
    values: &'a dyn RowValues,
}

/// The rule by which a row is left out.
type Rule = &'static str;

impl RowReader<'_> {
    fn row(&self, number: usize) -> Result<ReadRow, Rule> {
        let has_time = [Field::Time, Field::UtcTime]
            .into_iter()
            .any(|field| self.value(field) != Value::Missing);
        let time = match self.row_time() {
            Some(time) => time,
            None if !has_time => return Err("rows without a time"),
            None => {
                return Err(NO_TIME);
            }
        };
        let position = self.position()?;
        let (altitude_ft, is_geometric) = self.altitude_ft()?;
        let (ground_speed_kt, bad_speed) = self.optional(Field::GroundSpeed, SPEEDS_KT);
        let (track_deg, bad_track) = self.optional(Field::Track, -360.0..=360.0);
        let (vertical_speed_fpm, bad_climb) =
            self.optional(Field::VerticalSpeed, f64::MIN..=f64::MAX);
        let flag = self.value(Field::OnGround);
        let bad_flag = flag != Value::Missing && flag.flag().is_none();
        let row = Row {
            number,
            address: self.name(Field::Address),
            callsign: self.name(Field::Callsign),
            flight_id: self.name(Field::FlightId),
            is_on_ground: self.is_on_ground(altitude_ft),
            position_age_s: self.scaled(Field::PositionAge).ok().flatten().unwrap_or(0.0),
            is_geometric,
            sample: Sample {
                time_s: 0.0,
                position,
                altitude_ft,
                ground_speed_kt,
                track_deg: track_deg.map(|deg| deg.rem_euclid(360.0) % 360.0),
                vertical_speed_fpm,
            },
        };
        let is_named = [&row.address, &row.callsign, &row.flight_id].iter().any(|n| !n.is_empty());
        if !is_named && self.layout.source != Source::Flightradar24 {
            return Err("rows without the name of an aircraft");
        }
        let position_time = self.time(Field::PositionTime);
        Ok(ReadRow {
            timed: TimedRow { row, time, position_time },
            bad_cells: [
                bad_speed.then_some("cells with a speed that is none"),
                bad_track.then_some("cells with a direction that is none"),
                bad_climb.then_some("cells with a vertical speed that is none"),
                bad_flag.then_some("cells with a flag for the ground that is none"),
            ],
        })
    }

    fn value(&self, field: Field) -> Value<'_> {
        self.layout.column(field).map_or(Value::Missing, |column| self.values.value(column.index))
    }

    fn name(&self, field: Field) -> String {
        self.value(field).name()
    }

    fn time(&self, field: Field) -> Option<WrittenTime> {
        let units_per_s = self.layout.column(field).map_or(1.0, |column| column.factor);
        let time = match self.value(field) {
            Value::Number(value) if value.is_finite() => Some(WrittenTime::Unix(value)),
            Value::Text(text) if self.layout.source == Source::FlightPoints => {
                parse_day_first(text)
            }
            Value::Text(text) => parse_time(text),
            _ => None,
        };
        match time {
            Some(WrittenTime::Unix(value)) => Some(WrittenTime::Unix(value / units_per_s)),
            other => other,
        }
    }

    /// Returns the time of the row: of two columns the one that is UTC by its name, where the other has no zone.
    fn row_time(&self) -> Option<WrittenTime> {
        let utc = self.time(Field::UtcTime).map(|time| match time {
            WrittenTime::Calendar { utc_s, .. } => WrittenTime::Calendar { utc_s, has_zone: true },
            WrittenTime::Unix(_) => time,
        });
        let time = self.time(Field::Time);
        let is_local = matches!(time, None | Some(WrittenTime::Calendar { has_zone: false, .. }));
        if is_local { utc.or(time) } else { time }
    }

    fn position(&self) -> Result<LatLon, Rule> {
        const NONE: Rule = NO_POSITION;
        let (lat, lon) = match self.value(Field::Position) {
            Value::Text(text) => {
                let (lat, lon) = text.split_once(',').ok_or(NONE)?;
                (Value::from_text(lat).number(), Value::from_text(lon).number())
            }
            _ => (self.degrees(Field::Latitude, "NS"), self.degrees(Field::Longitude, "EW")),
        };
        let lat_deg = lat.map_err(|NotANumber| NO_NUMBER_POSITION)?.ok_or(NONE)?;
        let lon_deg = lon.map_err(|NotANumber| NO_NUMBER_POSITION)?.ok_or(NONE)?;
        let is_on_earth = (-90.0..=90.0).contains(&lat_deg) && (-180.0..=360.0).contains(&lon_deg);
        if !is_on_earth {
            return Err("rows with a position that is not on the earth");
        }
        let lon_deg = if lon_deg > 180.0 { lon_deg - 360.0 } else { lon_deg };
        Ok(LatLon { lat_deg, lon_deg })
    }

    /// Returns an angle in degrees, which may have the letter of its half of the earth: `7.5W` is -7.5.
    fn degrees(&self, field: Field, letters: &str) -> Result<Option<f64>, NotANumber> {
        let Value::Text(text) = self.value(field) else { return self.scaled(field) };
        let is_letter = |c: char| letters.contains(c.to_ascii_uppercase());
        let bare = text.strip_suffix(is_letter).or_else(|| text.strip_prefix(is_letter));
        let Some(bare) = bare else { return self.scaled(field) };
        let size =
            Value::from_text(bare).number()?.filter(|size| *size >= 0.0).ok_or(NotANumber)?;
        let is_negative = text.contains(['S', 's', 'W', 'w']);
        Ok(Some(if is_negative { -size } else { size }))
    }

    /// Returns a number in the unit of its field.
    fn scaled(&self, field: Field) -> Result<Option<f64>, NotANumber> {
        let Some(column) = self.layout.column(field) else { return Ok(None) };
        let value = self.values.value(column.index).number()?;
        Ok(value.map(|value| value * column.factor))
    }

    /// Returns whether the aircraft sends no position, and is in the file all the same.
    fn is_silent(&self) -> bool {
        let lacks = |field| matches!(self.value(field).number(), Ok(None));
        self.layout.source == Source::Readsb && lacks(Field::Latitude) && lacks(Field::Longitude)
    }

    /// Returns the altitude, and whether it is the geometric one in a file that has others.
    fn altitude_ft(&self) -> Result<(f64, bool), Rule> {
        let mut column = self.layout.altitude().ok_or(NO_ALTITUDE)?;
        let cell = self.values.value(column.index);
        let is_missing = matches!(cell.number(), Ok(None));
        if (is_missing || is_ground_word(cell)) && self.is_on_ground(f64::NAN) == Some(true) {
            // Transponders report no level there, and the row is no traffic anyway.
            return Ok((0.0, false));
        }
        let other = self.layout.column(Field::GeometricAltitude).filter(|other| *other != column);
        let is_geometric = is_missing && other.is_some();
        if is_missing && let Some(other) = other {
            column = other;
        }
        let cell = self.values.value(column.index);
        let altitude_ft = match flight_level_ft(cell) {
            Some(level_ft) => level_ft,
            None => {
                let value = cell.number().map_err(|NotANumber| NO_NUMBER_ALTITUDE)?;
                value.ok_or(NO_ALTITUDE)? * column.factor
            }
        };
        if !ALTITUDES_FT.contains(&altitude_ft) {
            return Err("rows with an altitude that no aircraft has");
        }
        Ok((altitude_ft, is_geometric))
    }

    /// Returns a quantity that a row may lack, and whether its cell is wrong.
    fn optional(&self, field: Field, range: RangeInclusive<f64>) -> (Option<f64>, bool) {
        match self.scaled(field) {
            Ok(None) => (None, false),
            Ok(Some(value)) if range.contains(&value) => (Some(value), false),
            _ => (None, true),
        }
    }

    fn is_on_ground(&self, altitude_ft: f64) -> Option<bool> {
        // Flightradar24 writes altitude 0 for an aircraft on the ground, whatever the airport's elevation.
        if self.layout.source == Source::Flightradar24 && altitude_ft == 0.0 {
            return Some(true);
        }
        if is_ground_word(self.value(Field::Altitude)) {
            return Some(true);
        }
        self.value(Field::OnGround).flag()
    }
}

/// Returns the altitude in ft of a level that is written as one, whatever the column: `FL350`.
fn flight_level_ft(cell: Value<'_>) -> Option<f64> {
    let Value::Text(text) = cell else { return None };
    let level = text.strip_prefix("FL").or_else(|| text.strip_prefix("fl"))?;
    let level: f64 = level.trim_start().parse().ok()?;
    level.is_finite().then_some(100.0 * level)
}

fn is_ground_word(cell: Value<'_>) -> bool {
    matches!(cell, Value::Text(text) if text.eq_ignore_ascii_case(GROUND_WORD))
}

fn is_zero_position(row: &Row) -> bool {
    row.sample.position == (LatLon { lat_deg: 0.0, lon_deg: 0.0 })
}
