//! Rows that can hardly be right: positions that are frozen, and those to which the reported speed does not lead.
//!
//! A row follows from an earlier one when the distance between them is at most what the reported speed allows, with room
//! for rounded times and positions, and the levels are as near as a steep climb brings them. Rows that follow from each
//! other are a chain; the longest chain of a flight is its way, and rows beside it are far from it.

use super::columns::{FOOT_M, NAUTICAL_MILE_M};
use super::rows::{Row, median};
use super::weighted_median;
use crate::local_plane::{EARTH_RADIUS_M, LatLon};
use sidestep_kernel::math;

/// Distance in m by which a position may be off, for whatever reason: half a nautical mile, a tenth of the separation
/// that controllers keep.
const TOLERANCE_M: f64 = NAUTICAL_MILE_M / 2.0;
/// The same in ft.
const TOLERANCE_FT: f64 = 1000.0;
/// How much faster than reported a row may be reached: wind, rounding and late messages take less.
const SPEED_FACTOR: f64 = 1.25;
/// The same for flights without reported speeds, whose typical speed stands for it: they climb at half of it.
const TYPICAL_SPEED_FACTOR: f64 = 2.0;
/// Steepest climb or descent in ft/s: 15,000 ft/min.
const MAX_CLIMB_FT_S: f64 = 250.0;
/// The longest time in s for which a position may be repeated, where the file has the time when it was received.
const MAX_POSITION_AGE_S: f64 = 15.0;
/// Number of chains that may go on at a time.
const MAX_OPEN_CHAINS: usize = 8;
/// Number of rows of a chain that begins after the way, or ends before it, and is a part of the flight elsewhere.
const MIN_LEG_ROWS: usize = 3;
/// Speeds over the ground in m/s of knots.
const KNOT_M_S: f64 = NAUTICAL_MILE_M / 3600.0;

/// What is suspicious about a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Suspicion {
    /// Its position is that of an earlier row, while the aircraft flies.
    Frozen,
    /// Its position or level cannot be reached from the rows around it.
    Far,
    /// It begins a part of the flight that cannot be reached from the part before.
    Jump,
}

/// Returns the great-circle distance of two positions in m.
pub(super) fn distance_m(a: LatLon, b: LatLon) -> f64 {
    let half_sine = |deg: f64| math::sin(deg.to_radians() / 2.0);
    let (north, east) = (half_sine(b.lat_deg - a.lat_deg), half_sine(b.lon_deg - a.lon_deg));
    let narrowing = math::cos(a.lat_deg.to_radians()) * math::cos(b.lat_deg.to_radians());
    let square = north * north + narrowing * east * east;
    2.0 * EARTH_RADIUS_M * math::asin(square.sqrt().min(1.0))
}

/// Returns the ratio of the speeds at which rows move to those that they report; `None` where too few do either.
pub(super) fn speed_ratio<'a>(flights: impl Iterator<Item = &'a Vec<Row>>) -> Option<f64> {
    /// Fewer stretches tell nothing about a unit.
    const MIN_STRETCHES: usize = 4;
    let mut ratios = Vec::new();
    for rows in flights {
        let mut stretch = Stretch::default();
        for pair in rows.windows(2) {
            stretch.push(pair);
            if stretch.duration_s >= MIN_STRETCH_S {
                ratios.extend(std::mem::take(&mut stretch).ratio());
            }
        }
    }
    if ratios.len() < MIN_STRETCHES { None } else { median(&mut ratios) }
}

/// Returns the median angle in degrees, from 0 to 180, between the directions in which rows move and those that they
/// report; `None` where too few do either.
pub(super) fn direction_offset_deg<'a>(flights: impl Iterator<Item = &'a Vec<Row>>) -> Option<f64> {
    /// Fewer steps tell nothing about a column.
    const MIN_STEPS: usize = 4;
    let mut offsets = Vec::new();
    for rows in flights {
        let Some(mut from) = rows.first() else { continue };
        for row in rows {
            // A short step is mostly noise, and in a long one an aircraft may turn.
            let length_m = distance_m(from.sample.position, row.sample.position);
            let duration_s = row.sample.time_s - from.sample.time_s;
            if length_m <= TOLERANCE_M && duration_s <= MIN_STRETCH_S {
                continue;
            }
            let before = std::mem::replace(&mut from, row);
            if let (Some(from_deg), Some(to_deg)) = (before.sample.track_deg, row.sample.track_deg)
                && angle_deg(from_deg, to_deg) < MAX_TURN_DEG
                && length_m > TOLERANCE_M
            {
                let moved_deg = bearing_deg(before.sample.position, row.sample.position);
                offsets.push(angle_deg(moved_deg, from_deg));
            }
        }
    }
    if offsets.len() < MIN_STEPS { None } else { median(&mut offsets) }
}

/// The greatest turn in degrees within a step whose direction tells something.
const MAX_TURN_DEG: f64 = 20.0;

/// Returns the angle between two directions, from 0 to 180.
fn angle_deg(a_deg: f64, b_deg: f64) -> f64 {
    let turn_deg = (a_deg - b_deg).rem_euclid(360.0);
    turn_deg.min(360.0 - turn_deg)
}

/// Returns the direction at `a` of the shortest way to `b`, in degrees, clockwise from north.
fn bearing_deg(a: LatLon, b: LatLon) -> f64 {
    let [a_rad, b_rad] = [a.lat_deg.to_radians(), b.lat_deg.to_radians()];
    let east_rad = (b.lon_deg - a.lon_deg).to_radians();
    let east = math::sin(east_rad) * math::cos(b_rad);
    let north = math::cos(a_rad) * math::sin(b_rad)
        - math::sin(a_rad) * math::cos(b_rad) * math::cos(east_rad);
    math::atan2(east, north).to_degrees()
}

/// The shortest time in s over which speeds are compared: positions may be repeated for some seconds.
const MIN_STRETCH_S: f64 = 30.0;

/// Successive rows of a flight.
#[derive(Debug, Default)]
struct Stretch {
    duration_s: f64,
    length_m: f64,
    /// The length by the reported speeds.
    reported_m: f64,
    is_incomplete: bool,
}

impl Stretch {
    fn push(&mut self, pair: &[Row]) {
        let duration_s = pair[1].sample.time_s - pair[0].sample.time_s;
        self.duration_s += duration_s;
        self.length_m += distance_m(pair[0].sample.position, pair[1].sample.position);
        match reported_m_s(&pair[0]).zip(reported_m_s(&pair[1])) {
            Some((from_m_s, to_m_s)) => self.reported_m += duration_s * (from_m_s + to_m_s) / 2.0,
            None => self.is_incomplete = true,
        }
    }

    /// Returns the ratio of both lengths; `None` where one of them says nothing: within a gap an aircraft may turn, and
    /// two short ways are mostly noise.
    fn ratio(self) -> Option<f64> {
        let is_telling = !self.is_incomplete
            && self.duration_s <= 4.0 * MIN_STRETCH_S
            && self.length_m.max(self.reported_m) > TOLERANCE_M
            && self.reported_m > 0.0;
        is_telling.then(|| self.length_m / self.reported_m)
    }
}

fn reported_m_s(row: &Row) -> Option<f64> {
    row.sample.ground_speed_kt.map(|kt| kt * KNOT_M_S)
}

/// Returns what is suspicious about each row of a flight, whose times rise strictly. `speed_ratio` is the factor from
/// reported speeds to those of the file's rows.
pub(super) fn suspicions(rows: &[Row], speed_ratio: f64) -> Vec<Option<Suspicion>> {
    let flight = Flight { rows, speed_ratio, typical_m_s: typical_speed_m_s(rows) };
    let mut found = vec![None; rows.len()];
    flight.mark_frozen(&mut found);
    flight.mark_far(&mut found);
    found
}

/// Returns the median speed of a flight over time: it is slower for half of its time. Rows that follow within a fraction
/// of a second, as of two receivers, say little.
pub(super) fn typical_speed_m_s(rows: &[Row]) -> f64 {
    let mut steps: Vec<[f64; 2]> = Vec::with_capacity(rows.len());
    for pair in rows.windows(2) {
        let length_m = distance_m(pair[0].sample.position, pair[1].sample.position);
        let step_s = pair[1].sample.time_s - pair[0].sample.time_s;
        steps.push([length_m / step_s, step_s]);
    }
    weighted_median(steps).unwrap_or(0.0)
}

struct Flight<'a> {
    rows: &'a [Row],
    speed_ratio: f64,
    typical_m_s: f64,
}

impl Flight<'_> {
    /// Returns the speed at which a row moves, by its report or by what is typical for the flight.
    fn speed_m_s(&self, row: usize) -> f64 {
        reported_m_s(&self.rows[row]).map_or(self.typical_m_s, |m_s| m_s * self.speed_ratio)
    }

    fn mark_frozen(&self, found: &mut [Option<Suspicion>]) {
        let mut first = 0;
        for (k, suspicion) in found.iter_mut().enumerate() {
            let here = &self.rows[k].sample;
            let there = &self.rows[first].sample;
            if here.position != there.position {
                first = k;
            }
            let still_m = (here.time_s - self.rows[first].sample.time_s) * self.speed_m_s(k);
            let is_old = self.rows[k].position_age_s > MAX_POSITION_AGE_S;
            if still_m > TOLERANCE_M || is_old {
                *suspicion = Some(Suspicion::Frozen);
            }
        }
    }

    /// Returns whether a row can be reached from an earlier one.
    fn follows(&self, from: usize, to: usize) -> bool {
        let (a, b) = (&self.rows[from].sample, &self.rows[to].sample);
        let duration_s = b.time_s - a.time_s;
        let has_reports = a.ground_speed_kt.is_some() && b.ground_speed_kt.is_some();
        let factor = if has_reports { SPEED_FACTOR } else { TYPICAL_SPEED_FACTOR };
        let reach_m = factor * self.speed_m_s(from).max(self.speed_m_s(to)) * duration_s;
        let climb_ft = (b.altitude_ft - a.altitude_ft).abs();
        climb_ft <= TOLERANCE_FT + MAX_CLIMB_FT_S * duration_s
            && distance_m(a.position, b.position) <= TOLERANCE_M + reach_m
    }

    fn mark_far(&self, found: &mut [Option<Suspicion>]) {
        let chains = self.chains(found);
        let Some(way) = (0..chains.len()).max_by_key(|&k| (chains[k].len(), std::cmp::Reverse(k)))
        else {
            return;
        };
        let [way_begin, way_end] = ends(&chains[way]);
        for (k, chain) in chains.iter().enumerate() {
            let [begin, end] = ends(chain);
            let is_leg = chain.len() >= MIN_LEG_ROWS && (end < way_begin || begin > way_end);
            if k == way {
                continue;
            }
            if is_leg {
                // The row at which the flight goes on elsewhere: the first of the later part.
                let later = if begin > way_end { begin } else { way_begin };
                found[later] = Some(Suspicion::Jump);
            } else {
                chain.iter().for_each(|&row| found[row] = Some(Suspicion::Far));
            }
        }
    }

    /// Returns the rows in chains, each of rows that follow from each other. Frozen rows are in none.
    fn chains(&self, found: &[Option<Suspicion>]) -> Vec<Vec<usize>> {
        let mut chains: Vec<Vec<usize>> = Vec::new();
        // Those that may go on, the latest last.
        let mut open: Vec<usize> = Vec::new();
        for (row, suspicion) in found.iter().enumerate() {
            if suspicion.is_some() {
                continue;
            }
            let fits = |chain: &usize| self.follows(ends(&chains[*chain])[1], row);
            let chain = match open.iter().rposition(fits) {
                Some(at) => open.remove(at),
                None => {
                    chains.push(Vec::new());
                    chains.len() - 1
                }
            };
            chains[chain].push(row);
            open.push(chain);
            if open.len() > MAX_OPEN_CHAINS {
                open.remove(0);
            }
        }
        chains
    }
}

/// Returns the first and the last row of a chain.
fn ends(chain: &[usize]) -> [usize; 2] {
    [chain[0], chain[chain.len() - 1]]
}

/// The unit that a column of speeds may have, when rows move at `ratio` times of what it says.
pub(super) fn likely_unit(ratio: f64) -> &'static str {
    const UNITS: [(f64, &str); 4] = [
        (1.0 / KNOT_M_S, "m/s"),
        (1000.0 / NAUTICAL_MILE_M, "km/h"),
        (1609.344 / NAUTICAL_MILE_M, "mph"),
        (FOOT_M / KNOT_M_S, "ft/s"),
    ];
    let near = UNITS.iter().find(|(factor, _)| (ratio / factor - 1.0).abs() < 0.08);
    near.map_or("another unit", |(_, unit)| unit)
}
