//! Rows of all aircraft, put together as flights.

use super::columns::NAUTICAL_MILE_M;
use super::options::TrafficOptions;
use super::plausibility::{self, Suspicion, distance_m, likely_unit, suspicions};
use super::rows::{
    CheckedRows, Row, RowCollector, SAME_INSTANT_RULE, UNREACHED_RULE, UNUSED_COLUMNS_RULE,
    aircraft_key, remedy_of,
};
use super::standing::stands_by_rows;
use super::summary::describe;
use super::time::format_utc;
use super::{MAX_SPEED_M_S, RecordedTraffic, Track};
use crate::report::{ImportReport, MAX_PLACES, Treatment};
use sidestep_kernel::InputError;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, PI};

/// The longest time in s on the ground, between two rows in the air, within one flight: a flag that was wrong for a
/// moment ends no flight.
const MAX_TOUCH_S: f64 = 60.0;

/// The shortest time in s for which an aircraft has another call sign, between two rows of one.
const MIN_CALLSIGN_S: f64 = 60.0;

/// What reported speeds may differ from those of rows, before their unit is in doubt.
const SPEED_RATIOS: std::ops::RangeInclusive<f64> = 0.75..=1.35;

/// The greatest median speed between the rows of a flight in m/s, some 5,000 kt: with a greater one most of its positions
/// are wrong.
const MAX_TYPICAL_SPEED_M_S: f64 = 2_600.0;

/// What units of speed may differ from the one that a column says.
const UNIT_RATIOS: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// The greatest ratio of the speeds of rows to those that they report where positions are in radians: pi over 180, and
/// more where meridians come together.
const MAX_RADIAN_RATIO: f64 = 0.1;

/// What reported directions may differ from those of rows, in degrees: in the median, no wind does that.
const MAX_DIRECTION_OFFSET_DEG: f64 = 45.0;

/// A speed in kt that no aircraft reaches below [`LOW_FT`] on most of its way.
const FAST_KT: f64 = 300.0;
const LOW_FT: f64 = 1000.0;
/// The number of fast rows that say something of their column, and that of a file of mostly fast rows: a row or two may
/// be wrong.
const MIN_FAST_ROWS: usize = 20;
const MIN_FAST_ROWS_OF_FEW: usize = 5;

/// The speed of aircraft in kt that report none.
const USUAL_SPEED_KT: f64 = 500.0;
/// What positions may differ by error, in m: those of transponders have steps of some meters.
const POSITION_ERROR_M: f64 = 30.0;
/// What altitudes may differ within a second, in ft: a step of transponders, and what aircraft climb.
const SECOND_CLIMB_FT: f64 = 200.0;

/// The rule by which flights of a single row are left out.
pub const SINGLE_ROW_RULE: &str = "flights of a single row";

const LEAVE_OUT: &str = "add `--set import.leave_out_suspicious=true` to leave them out";

/// Returns the flights of all rows, with the report.
///
/// # Errors
/// When too many rows are bad, or no flight remains.
pub(super) fn into_traffic(
    collector: RowCollector,
    options: &TrafficOptions,
) -> Result<RecordedTraffic, InputError> {
    let CheckedRows { place, noun, rows, row_count, bad_count, report } = collector.finish()?;
    let mut builder = FlightBuilder { options, noun, report, repeated_rows: 0, bad_count };
    let mut flights = Vec::new();
    for rows in builder.by_aircraft(rows) {
        let rows = builder.sort_by_time(rows);
        let (rows, ends) = builder.leave_out_ground(rows);
        for part in
            split(rows, |before, row| ends.contains(&row.number) || builder.is_gap(before, row))
        {
            flights.extend(builder.split_at_callsigns(part));
        }
    }
    let ratio = builder.check_speed_unit(&flights);
    builder.check_directions(&flights);
    builder.check_levels(&flights);
    let mut parts = Vec::new();
    for flight in flights {
        let (rows, jumps) = builder.check_positions(flight, ratio);
        parts.extend(split(rows, |before, row| {
            jumps.contains(&row.number) || builder.is_gap(before, row)
        }));
    }
    builder.count_gaps(&parts);
    let is_snapshot = is_snapshot(&parts);
    let tracks: Vec<Track> =
        parts.into_iter().filter_map(|rows| builder.track(rows, is_snapshot)).collect();
    builder.check_bad_count(&place, row_count)?;
    if tracks.is_empty() {
        return Err(builder.nothing_left(&place, row_count));
    }
    let FlightBuilder { mut report, repeated_rows, .. } = builder;
    describe(&mut report, &tracks);
    if is_snapshot {
        let rule = "aircraft of one instant fly straight on, at their speed and level";
        report.record(Treatment::Guessed, rule, "", "give rows of several instants");
    }
    Ok(RecordedTraffic { tracks, rows: row_count, repeated_rows, is_snapshot, report })
}

struct FlightBuilder<'a> {
    options: &'a TrafficOptions,
    noun: &'static str,
    report: ImportReport,
    repeated_rows: usize,
    /// Number of rows that cannot be used.
    bad_count: usize,
}

impl FlightBuilder<'_> {
    fn record(&mut self, treatment: Treatment, rule: &str, row: &Row, remedy: &str) {
        let known = self
            .report
            .findings
            .iter()
            .find(|finding| finding.treatment == treatment && finding.rule == rule);
        let has_places = known.is_some_and(|finding| finding.places.len() >= MAX_PLACES);
        let place = if has_places { String::new() } else { self.place(row) };
        self.report.record(treatment, rule, place, remedy);
    }

    /// Returns a row as people find it: its line, aircraft, time and position.
    fn place(&self, row: &Row) -> String {
        let name = [&row.callsign, &row.address, &row.flight_id];
        let name = name.into_iter().find(|name| !name.is_empty()).map_or("", String::as_str);
        let at = row.sample.position;
        let utc = format_utc(row.sample.time_s);
        format!(
            "{} {} ({name} at {utc}, {:.4} {:.4})",
            self.noun, row.number, at.lat_deg, at.lon_deg
        )
    }

    /// Returns the rows by aircraft, in the order of their keys, each in the order of the file.
    fn by_aircraft(&mut self, rows: Vec<Row>) -> Vec<Vec<Row>> {
        let mut by_key: BTreeMap<[String; 2], Vec<Row>> = BTreeMap::new();
        for mut row in rows {
            row.callsign = row.callsign.to_ascii_uppercase();
            let key = aircraft_key(&row);
            let of_aircraft = by_key.entry(key).or_default();
            if let Some(first) = of_aircraft.first()
                && first.address != row.address
            {
                let rule = "addresses in several spellings are one aircraft's";
                self.record(Treatment::Repaired, rule, &row, "");
            }
            of_aircraft.push(row);
        }
        by_key.into_values().collect()
    }

    /// Sorts rows by time; of several at one instant the first is kept.
    fn sort_by_time(&mut self, mut rows: Vec<Row>) -> Vec<Row> {
        let mut latest_s = f64::NEG_INFINITY;
        for row in &rows {
            if row.sample.time_s < latest_s {
                let rule = "rows out of order are sorted by time";
                self.record(Treatment::Repaired, rule, row, "");
            }
            latest_s = latest_s.max(row.sample.time_s);
        }
        // A stable sort, so that the first row of an instant in the file stays the first.
        rows.sort_by(|a, b| a.sample.time_s.total_cmp(&b.sample.time_s));
        let mut kept: Vec<Row> = Vec::with_capacity(rows.len());
        for row in rows {
            let Some(last) = kept.last().filter(|last| last.sample.time_s == row.sample.time_s)
            else {
                kept.push(row);
                continue;
            };
            self.repeated_rows += 1;
            let is_same = last.sample.position == row.sample.position
                && last.sample.altitude_ft == row.sample.altitude_ft;
            if is_same {
                self.record(Treatment::Repaired, "rows given twice are kept once", &row, "");
            } else if is_within_second(last, &row) {
                let rule = "rows of one second, which has no fractions, are kept once";
                self.record(Treatment::Repaired, rule, &row, "");
            } else {
                self.bad_count += 1;
                self.record(Treatment::Dropped, SAME_INSTANT_RULE, &row, "");
            }
        }
        kept
    }

    /// Leaves out rows on the ground. Returns those in the air, and the numbers of rows before which the aircraft was on
    /// the ground for long.
    fn leave_out_ground(&mut self, rows: Vec<Row>) -> (Vec<Row>, Vec<usize>) {
        let limit_kt = self.options.ground_speed_kt;
        let slow = format!(
            "rows without a flag for the ground, slower than {limit_kt} kt: taken as on the ground"
        );
        let mut kept: Vec<Row> = Vec::with_capacity(rows.len());
        let mut ends = Vec::new();
        let mut has_landed = false;
        let stands = stands_by_rows(&rows, limit_kt, self.options.max_gap_s);
        for (row, stands) in rows.into_iter().zip(stands) {
            let is_slow = row.sample.ground_speed_kt.map_or(stands, |kt| kt < limit_kt);
            match row.is_on_ground {
                Some(true) => {
                    let rule = "rows of aircraft on the ground, which are no traffic";
                    self.record(Treatment::NotUsed, rule, &row, "");
                }
                None if is_slow => {
                    let remedy = "add `--set import.ground_speed_kt=0` to keep them";
                    self.record(Treatment::Guessed, &slow, &row, remedy);
                }
                _ => {
                    let last_s = kept.last().map_or(f64::INFINITY, |last| last.sample.time_s);
                    if has_landed && row.sample.time_s - last_s > MAX_TOUCH_S {
                        ends.push(row.number);
                    }
                    has_landed = false;
                    kept.push(row);
                    continue;
                }
            }
            has_landed = true;
        }
        (kept, ends)
    }

    fn is_gap(&self, before: &Row, row: &Row) -> bool {
        row.sample.time_s - before.sample.time_s > self.options.max_gap_s
    }

    /// Names the gaps between flights of one aircraft.
    fn count_gaps(&mut self, parts: &[Vec<Row>]) {
        let rule = format!(
            "gaps of more than {} s end a flight, and nothing is flown in them",
            self.options.max_gap_s
        );
        for pair in parts.windows(2) {
            let (Some(before), Some(row)) = (pair[0].last(), pair[1].first()) else { continue };
            if aircraft_key(before) == aircraft_key(row) && self.is_gap(before, row) {
                let twice_s = 2.0 * self.options.max_gap_s;
                let remedy = format!("add `--set import.max_gap_s={twice_s}` for twice that limit");
                self.record(Treatment::Guessed, &rule, row, &remedy);
            }
        }
    }

    /// Returns rows without gaps by their call signs.
    fn split_at_callsigns(&mut self, mut rows: Vec<Row>) -> Vec<Vec<Row>> {
        fill_callsigns(&mut rows);
        let mut runs = split(rows, |before, row| before.callsign != row.callsign);
        if runs.len() > 2 && returns_to_a_callsign(&runs) {
            if is_two_aircraft(&runs) {
                return self.separate_aircraft(runs);
            }
            self.relabel_short_runs(&mut runs);
            runs = split(runs.into_iter().flatten().collect(), |before, row| {
                before.callsign != row.callsign
            });
        }
        for run in runs.iter().skip(1) {
            self.record(Treatment::Repaired, "changes of call sign end a flight", &run[0], "");
        }
        runs
    }

    /// Returns the rows of two aircraft with one address, whose call signs tell them apart.
    fn separate_aircraft(&mut self, runs: Vec<Vec<Row>>) -> Vec<Vec<Row>> {
        let mut by_callsign: BTreeMap<String, Vec<Row>> = BTreeMap::new();
        for row in runs.into_iter().flatten() {
            by_callsign.entry(row.callsign.clone()).or_default().push(row);
        }
        for rows in by_callsign.values().skip(1) {
            let rule = "aircraft that have the address of another one at the same time, told apart by call sign";
            self.record(Treatment::Suspicious, rule, &rows[0], "");
        }
        by_callsign.into_values().collect()
    }

    /// Gives rows with another call sign for a moment that of the rows around them.
    fn relabel_short_runs(&mut self, runs: &mut [Vec<Row>]) {
        for k in 1..runs.len() - 1 {
            let [first, last] = [&runs[k][0], &runs[k][runs[k].len() - 1]];
            let is_short = last.sample.time_s - first.sample.time_s < MIN_CALLSIGN_S;
            let around = runs[k - 1][0].callsign.clone();
            if !is_short || around != runs[k + 1][0].callsign {
                continue;
            }
            let rule = "rows with another call sign for less than a minute";
            let row = runs[k][0].clone();
            self.record(Treatment::Repaired, rule, &row, "");
            runs[k].iter_mut().for_each(|row| row.callsign.clone_from(&around));
        }
    }

    /// Returns the factor from reported speeds to those of the rows, which it names where it is far from 1.
    fn check_speed_unit(&mut self, flights: &[Vec<Row>]) -> f64 {
        let ratio = plausibility::speed_ratio(flights.iter()).unwrap_or(1.0);
        if SPEED_RATIOS.contains(&ratio) {
            return 1.0;
        }
        if ratio < MAX_RADIAN_RATIO && flights.iter().flatten().all(is_in_radians) {
            let rule = format!(
                "rows move at {ratio:.3} times of the speeds that they report: positions may be in radians"
            );
            self.report.record(Treatment::Suspicious, &rule, "", "write positions in degrees");
            return 1.0;
        }
        let rule = format!(
            "rows move at {ratio:.2} times of the speeds that they report: the column may have {}",
            likely_unit(ratio)
        );
        let remedy = "write the speeds in the unit of the column";
        self.report.record(Treatment::Suspicious, rule, "", remedy);
        // No unit is that different: then positions are wrong, and rows are compared with what they report.
        if UNIT_RATIOS.contains(&ratio) { ratio } else { 1.0 }
    }

    /// Names a column of directions that is not where the rows move to: for one instant, nothing else would tell.
    fn check_directions(&mut self, flights: &[Vec<Row>]) {
        let Some(offset_deg) = plausibility::direction_offset_deg(flights.iter()) else { return };
        if offset_deg <= MAX_DIRECTION_OFFSET_DEG {
            return;
        }
        let mut rows = flights.iter().flatten();
        let has_small_numbers =
            rows.all(|row| row.sample.track_deg.is_none_or(|deg| deg <= std::f64::consts::TAU));
        let likely = if has_small_numbers { "radians" } else { "another quantity or unit" };
        let rule = format!(
            "rows move in a direction {offset_deg:.0} deg from the one that they report: the column may have {likely}"
        );
        let remedy = "write the directions of motion in degrees, clockwise from north";
        self.report.record(Treatment::Suspicious, rule, "", remedy);
    }

    /// Names levels at which nobody flies as fast as the rows say.
    fn check_levels(&mut self, flights: &[Vec<Row>]) {
        let samples = flights.iter().flatten().map(|row| &row.sample);
        let mut row_count = 0;
        let mut fast = Vec::new();
        for sample in samples {
            row_count += 1;
            if sample.ground_speed_kt.is_some_and(|kt| kt > FAST_KT) {
                fast.push(sample.altitude_ft);
            }
        }
        let is_most = fast.len() >= MIN_FAST_ROWS_OF_FEW && fast.len() * 2 > row_count;
        if fast.len() < MIN_FAST_ROWS && !is_most {
            return;
        }
        let low = fast.iter().filter(|altitude_ft| **altitude_ft < LOW_FT).count();
        if low * 2 <= fast.len() {
            return;
        }
        let rule = format!(
            "{low} of {} rows faster than {FAST_KT} kt are below {LOW_FT} ft: the column may have flight levels, or \
             numbers that stand for none",
            fast.len()
        );
        let remedy = "name a column of flight levels `flight_level`, and leave cells without an altitude empty";
        self.report.record(Treatment::Suspicious, rule, "", remedy);
    }

    /// Refuses a file of which more than half is left out.
    fn check_bad_count(&self, place: &str, row_count: usize) -> Result<(), InputError> {
        if self.bad_count * 2 <= row_count {
            return Ok(());
        }
        let dropped =
            self.report.findings.iter().filter(|found| found.treatment == Treatment::Dropped);
        let rules: Vec<String> = dropped.map(ToString::to_string).collect();
        let bad = self.bad_count;
        let cause = format!("{bad} of {row_count} rows cannot be used: {}", rules.join("; "));
        Err(InputError::new(place, cause, remedy_of(&self.report)))
    }

    /// Names rows that can hardly be right, and leaves them out where that is wanted. Returns the others, and the numbers
    /// of rows at which the flight goes on elsewhere.
    fn check_positions(&mut self, rows: Vec<Row>, ratio: f64) -> (Vec<Row>, Vec<usize>) {
        let leaves_out = self.options.leaves_out_suspicious;
        let found = suspicions(&rows, ratio);
        let mut kept = Vec::with_capacity(rows.len());
        let mut jumps = Vec::new();
        for (row, suspicion) in rows.into_iter().zip(found) {
            let Some(suspicion) = suspicion else {
                kept.push(row);
                continue;
            };
            let rule = match suspicion {
                Suspicion::Frozen => {
                    "rows with the position of an earlier row, while the aircraft flies"
                }
                Suspicion::Far => {
                    "rows that the reported speed does not lead to, from the rows around them"
                }
                Suspicion::Jump => {
                    "flights that go on elsewhere, where the reported speed does not lead"
                }
            };
            match (leaves_out, suspicion) {
                (false, _) => self.record(Treatment::Suspicious, rule, &row, LEAVE_OUT),
                (true, Suspicion::Jump) => {
                    self.record(Treatment::Repaired, &format!("{rule}: split there"), &row, "");
                    jumps.push(row.number);
                }
                (true, _) => {
                    self.record(Treatment::Dropped, rule, &row, "");
                    continue;
                }
            }
            kept.push(row);
        }
        (self.leave_out_impossible(kept), jumps)
    }

    /// Leaves out rows that nothing reaches from the row before.
    fn leave_out_impossible(&mut self, rows: Vec<Row>) -> Vec<Row> {
        let mut kept: Vec<Row> = Vec::with_capacity(rows.len());
        for row in rows {
            let is_possible = kept.last().is_none_or(|last| {
                let length_m = distance_m(last.sample.position, row.sample.position);
                // The plane of the simulation stretches distances far from its center.
                length_m < 0.1 * MAX_SPEED_M_S * (row.sample.time_s - last.sample.time_s)
            });
            if is_possible {
                kept.push(row);
            } else {
                self.bad_count += 1;
                self.record(Treatment::Dropped, UNREACHED_RULE, &row, "");
            }
        }
        kept
    }

    /// Returns a flight; `None` for one that leads nowhere.
    fn track(&mut self, rows: Vec<Row>, is_snapshot: bool) -> Option<Track> {
        let first = rows.first()?;
        let sample = &first.sample;
        if !is_snapshot && rows.len() < 2 {
            self.record(Treatment::Dropped, SINGLE_ROW_RULE, first, "");
            return None;
        }
        if plausibility::typical_speed_m_s(&rows) > MAX_TYPICAL_SPEED_M_S {
            let rule = "rows of flights that are faster than anything that flies";
            rows.iter().for_each(|row| self.record(Treatment::Dropped, rule, row, ""));
            self.bad_count += rows.len();
            return None;
        }
        if is_snapshot && (sample.ground_speed_kt.is_none() || sample.track_deg.is_none()) {
            let rule = "aircraft of one instant without a speed or a direction";
            self.record(Treatment::Dropped, rule, first, "");
            return None;
        }
        Some(Track {
            icao24: first.address.to_ascii_lowercase(),
            callsign: first.callsign.clone(),
            flight_id: first.flight_id.clone(),
            samples: rows.iter().map(|row| row.sample).collect(),
        })
    }

    fn nothing_left(&self, place: &str, row_count: usize) -> InputError {
        let findings =
            self.report.findings.iter().filter(|found| found.rule != UNUSED_COLUMNS_RULE);
        let rules: Vec<String> = findings.map(ToString::to_string).collect();
        let cause = format!("no flight remains of {row_count} rows: {}", rules.join("; "));
        let remedy = "give a recording of aircraft in the air, each in two rows at least";
        InputError::new(place, cause, remedy)
    }
}

fn is_in_radians(row: &Row) -> bool {
    let position = row.sample.position;
    position.lat_deg.abs() <= FRAC_PI_2 && position.lon_deg.abs() <= PI
}

/// Returns whether every aircraft has one row: with more, rows that are far apart are no picture of one instant.
fn is_snapshot(parts: &[Vec<Row>]) -> bool {
    let mut aircraft = BTreeSet::new();
    !parts.is_empty()
        && parts.iter().all(|rows| rows.len() == 1 && aircraft.insert(aircraft_key(&rows[0])))
}

/// Returns whether a row can be of the same second as another one: times are whole, and it is no farther than an aircraft
/// flies and climbs in a second.
fn is_within_second(first: &Row, row: &Row) -> bool {
    let [a, b] = [&first.sample, &row.sample];
    let reported_kt = a.ground_speed_kt.into_iter().chain(b.ground_speed_kt).reduce(f64::max);
    let step_m = reported_kt.unwrap_or(USUAL_SPEED_KT) * NAUTICAL_MILE_M / 3600.0;
    a.time_s.fract() == 0.0
        && distance_m(a.position, b.position) <= step_m + POSITION_ERROR_M
        && (a.altitude_ft - b.altitude_ft).abs() <= SECOND_CLIMB_FT
}

/// Gives rows without a call sign that of the row before, or else that of the row after.
fn fill_callsigns(rows: &mut [Row]) {
    let first = rows.iter().find(|row| !row.callsign.is_empty()).map(|row| row.callsign.clone());
    let Some(mut known) = first else { return };
    for row in rows {
        if row.callsign.is_empty() {
            row.callsign.clone_from(&known);
        } else {
            known.clone_from(&row.callsign);
        }
    }
}

fn returns_to_a_callsign(runs: &[Vec<Row>]) -> bool {
    let mut callsigns: Vec<&str> = runs.iter().map(|run| run[0].callsign.as_str()).collect();
    callsigns.sort_unstable();
    callsigns.windows(2).any(|pair| pair[0] == pair[1])
}

/// Returns whether most changes of call sign lead to a place that the reported speed does not.
fn is_two_aircraft(runs: &[Vec<Row>]) -> bool {
    let mut far = 0;
    for pair in runs.windows(2) {
        let (Some(before), Some(after)) = (pair[0].last(), pair[1].first()) else { continue };
        let step = [before.clone(), after.clone()];
        far += usize::from(suspicions(&step, 1.0).iter().any(Option::is_some));
    }
    far * 2 > runs.len() - 1
}

/// Returns rows in parts; a part ends before a row where `ends` says so, of the row before and the row.
fn split(rows: Vec<Row>, ends: impl Fn(&Row, &Row) -> bool) -> Vec<Vec<Row>> {
    let mut parts: Vec<Vec<Row>> = Vec::new();
    for row in rows {
        match parts.last_mut() {
            Some(part) if !part.last().is_some_and(|before| ends(before, &row)) => part.push(row),
            _ => parts.push(vec![row]),
        }
    }
    parts
}
