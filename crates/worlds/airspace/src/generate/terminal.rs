//! Traffic of a terminal area: departures from one runway, arrivals to the same field, and overflights that change their
//! level on the way.

use super::{GeneratorParams, MAX_TRIES, airplane, airplane_draws, on_circle};
use crate::flight::{AircraftModel, AirplaneStart, FlightOrder, FlightTask, Point, distance_m};
use sidestep_kernel::stream::{Draws, Streams};
use sidestep_kernel::{interrupt, math};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Heading of the runway, in radians: to the north.
const RUNWAY_RAD: f64 = FRAC_PI_2;
/// Distance of the fixes at which arrivals end, in radii of the area. They are on a circle of that radius which the
/// field touches, south of it: behind the runway, from where a final approach begins.
const FIX_RADII: f64 = 0.25;
/// Angle in radians by which the fix of an arrival is off the direction from which it comes: no two fly to one fix.
const FIX_OFFSET_RAD: f64 = 0.3;
/// Largest angle in radians between the path of an overflight and the way through the middle.
const OVERFLIGHT_RAD: f64 = 0.4;
/// The lowest and the highest level at which arrivals end, as fractions of the lowest level of cruise.
const APPROACH_FRACTIONS: [f64; 2] = [0.3, 0.6];
/// The part of its flight, as fractions of its duration, in which an overflight begins to change its level.
const CHANGE_FRACTIONS: [f64; 2] = [0.1, 0.6];
/// Times between two that follow each other are their mean, and up to this fraction of it more or less.
const INTERVAL_SPREAD: f64 = 0.4;
/// Levels this many times as far from each other as they have to be do not meet while both change theirs for a while.
const LEVEL_MARGIN: f64 = 1.5;

/// The traffic of a terminal area.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct TerminalParams {
    /// Number of airplanes that descend to the field; all others that do not fly over depart.
    pub(in super::super) arrivals: usize,
    /// Number of airplanes that cross the area.
    pub(in super::super) overflights: usize,
    /// Mean time between two departures, in seconds.
    pub(in super::super) departure_interval_s: f64,
    /// Mean time between two arrivals at the border of the area, in seconds.
    pub(in super::super) arrival_interval_s: f64,
    /// The lowest and the highest level of cruise, in meters.
    pub(in super::super) levels_m: [f64; 2],
    /// Height between two levels, in meters.
    pub(in super::super) vertical_m: f64,
    /// The smallest and the largest airspeed, in meters per second.
    pub(in super::super) speeds_m_s: [f64; 2],
    /// The smallest and the largest rate of climb and descent, in meters per second.
    pub(in super::super) climbs_m_s: [f64; 2],
}

impl TerminalParams {
    /// Returns the numbers of the lowest and the highest level in a range of altitudes, counted from the ground.
    pub(in super::super) fn level_numbers(&self, [low_m, high_m]: [f64; 2]) -> [f64; 2] {
        // Whole numbers stay what they are when rounding has moved them a little.
        let low = (low_m / self.vertical_m - 1e-9).ceil();
        let high = (high_m / self.vertical_m + 1e-9).floor();
        [low, high]
    }

    /// Returns the range of altitudes, in meters, in which arrivals end.
    pub(in super::super) fn approach_levels_m(&self) -> [f64; 2] {
        APPROACH_FRACTIONS.map(|fraction| fraction * self.levels_m[0])
    }
}

/// What an airplane of a terminal area does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    Departure,
    Arrival,
    Overflight,
}

/// The time at which an airplane comes in, and what it does.
struct Entry {
    id: usize,
    operation: Operation,
    appears_s: f64,
}

/// Returns the traffic, or, as an error, the number of airplanes that found a place before there was none left.
pub(super) fn terminal_traffic(
    params: &GeneratorParams<'_>,
    terminal: &TerminalParams,
    streams: &Streams,
) -> Result<Vec<AirplaneStart>, usize> {
    let traffic = TerminalTraffic { params, terminal };
    let mut entries = traffic.entries(streams);
    // By time, so that each has to find a place beside those only that are in the air already.
    entries.sort_by(|a, b| a.appears_s.total_cmp(&b.appears_s).then(a.id.cmp(&b.id)));
    let mut placed: Vec<(usize, AirplaneStart)> = Vec::with_capacity(entries.len());
    for entry in entries {
        let mut draws = airplane_draws(streams, entry.id);
        let found = (0..MAX_TRIES).map(|_| traffic.flight(&entry, &mut draws)).find(|one| {
            // Departures come from one runway: their times alone keep them apart.
            entry.operation == Operation::Departure || traffic.has_room(one, &placed)
        });
        let count = placed.len();
        placed.push((entry.id, found.ok_or(count)?));
    }
    placed.sort_by_key(|(id, _)| *id);
    Ok(placed.into_iter().map(|(_, airplane)| airplane).collect())
}

struct TerminalTraffic<'a> {
    params: &'a GeneratorParams<'a>,
    terminal: &'a TerminalParams,
}

impl TerminalTraffic<'_> {
    /// Returns the times of all, by id: departures first, then arrivals, then overflights.
    fn entries(&self, streams: &Streams) -> Vec<Entry> {
        let &TerminalParams { arrivals, overflights, .. } = self.terminal;
        let departures = self.params.n - arrivals - overflights;
        // Beside those of the flights, which are of the ids.
        let mut draws = airplane_draws(streams, self.params.n);
        let mut all = Vec::with_capacity(self.params.n);
        let mut end_s: f64 = 0.0;
        let queues = [
            (Operation::Departure, departures, self.terminal.departure_interval_s),
            (Operation::Arrival, arrivals, self.terminal.arrival_interval_s),
        ];
        for (operation, count, interval_s) in queues {
            let mut appears_s = 0.0;
            for _ in 0..count {
                all.push(Entry { id: all.len(), operation, appears_s });
                end_s = end_s.max(appears_s);
                let spread = INTERVAL_SPREAD * (2.0 * draws.uniform() - 1.0);
                appears_s += interval_s * (1.0 + spread);
            }
        }
        for _ in 0..overflights {
            let appears_s = end_s * draws.uniform();
            all.push(Entry { id: all.len(), operation: Operation::Overflight, appears_s });
        }
        all
    }

    fn flight(&self, entry: &Entry, draws: &mut Draws) -> AirplaneStart {
        interrupt::check();
        let TerminalParams { levels_m, speeds_m_s, climbs_m_s, .. } = *self.terminal;
        let radius_m = self.params.radius_m;
        let bearing_rad = TAU * draws.uniform();
        let border = on_circle(radius_m, bearing_rad);
        let level_m = self.draw_level_m(levels_m, draws);
        let v_m_s = draw_between(speeds_m_s, draws);
        let climb_m_s = draw_between(climbs_m_s, draws);
        // The same draws for all, so that a change of one key changes as little as it can.
        let other_level_m = match entry.operation {
            Operation::Arrival => self.draw_level_m(self.terminal.approach_levels_m(), draws),
            Operation::Departure | Operation::Overflight => self.draw_level_m(levels_m, draws),
        };
        let part = draws.uniform();
        let (start, goal) = match entry.operation {
            Operation::Departure => ([0.0; 2], border),
            Operation::Arrival => (border, arrival_fix(radius_m, bearing_rad)),
            Operation::Overflight => {
                let turn_rad = OVERFLIGHT_RAD * (2.0 * draws.uniform() - 1.0);
                (border, on_circle(radius_m, bearing_rad + PI + turn_rad))
            }
        };
        let flight_s = distance_m(start, goal) / v_m_s;
        let (altitude_m, to_m, after_s) = match entry.operation {
            Operation::Departure => (0.0, level_m, 0.0),
            Operation::Arrival => {
                // Early enough to be down at the fix, if that is possible.
                let descent_s = (level_m - other_level_m) / climb_m_s;
                (level_m, other_level_m, part * (flight_s - descent_s).max(0.0))
            }
            Operation::Overflight => {
                let [from, to] = CHANGE_FRACTIONS;
                (level_m, other_level_m, (from + part * (to - from)) * flight_s)
            }
        };
        let order = FlightOrder {
            at_s: entry.appears_s + after_s,
            task: FlightTask::Altitude { altitude_m: to_m, climb_m_s },
        };
        let model = AircraftModel {
            v_m_s,
            omega_max_rad_s: self.params.performance.turn.omega_rad_s(v_m_s),
            ..self.params.model.clone()
        };
        let mut one = airplane(self.params, start, vec![goal]);
        if entry.operation == Operation::Departure {
            one.start.heading_rad = RUNWAY_RAD;
        }
        AirplaneStart {
            callsign: Some(self.callsign(entry)),
            model,
            altitude_m,
            appears_s: entry.appears_s,
            orders: if to_m == altitude_m { Vec::new() } else { vec![order] },
            ..one
        }
    }

    /// Returns a call sign: what it does, and its number among those that do it.
    fn callsign(&self, entry: &Entry) -> String {
        let &TerminalParams { arrivals, overflights, .. } = self.terminal;
        let departures = self.params.n - arrivals - overflights;
        match entry.operation {
            Operation::Departure => format!("DEP{}", entry.id + 1),
            Operation::Arrival => format!("ARR{}", entry.id - departures + 1),
            Operation::Overflight => format!("OVR{}", entry.id - departures - arrivals + 1),
        }
    }

    /// Draws a level, in meters.
    fn draw_level_m(&self, range_m: [f64; 2], draws: &mut Draws) -> f64 {
        let [low, high] = self.terminal.level_numbers(range_m);
        let number = low + (draws.uniform() * (high - low + 1.0)).floor();
        number.min(high) * self.terminal.vertical_m
    }

    /// Returns whether an airplane comes in so far from all that are in the air by then, if they fly straight to their
    /// way-points, that first fallbacks are apart.
    fn has_room(&self, one: &AirplaneStart, placed: &[(usize, AirplaneStart)]) -> bool {
        placed.iter().all(|(_, other)| {
            interrupt::check();
            let flown_s = one.appears_s - other.appears_s;
            let Some(at) = straight_position(other, flown_s) else { return true };
            let height_m = (altitude_after_m(other, flown_s) - one.altitude_m).abs();
            let radii_m = one.model.turn_radius_m() + other.model.turn_radius_m();
            let gap_m = 2.0 * radii_m + one.model.separation_m + self.params.errors_m + 1.0;
            height_m >= LEVEL_MARGIN * self.terminal.vertical_m
                || distance_m(at, one.start.at) >= gap_m
        })
    }
}

/// Returns where an arrival that comes from a direction ends.
fn arrival_fix(radius_m: f64, bearing_rad: f64) -> Point {
    let fix_m = FIX_RADII * radius_m;
    let [x, y] = on_circle(fix_m, bearing_rad + FIX_OFFSET_RAD);
    [x, y - fix_m]
}

fn draw_between([low, high]: [f64; 2], draws: &mut Draws) -> f64 {
    low + draws.uniform() * (high - low)
}

/// Returns where an airplane is some seconds after it has come in, on the straight way to its way-point; `None` when it
/// is there by then.
fn straight_position(airplane: &AirplaneStart, flown_s: f64) -> Option<Point> {
    let start = airplane.start.at;
    let goal = airplane.mission.first().copied()?;
    let whole_m = distance_m(start, goal);
    let flown_m = airplane.model.v_m_s * flown_s;
    let [dx, dy] = [goal[0] - start[0], goal[1] - start[1]];
    let angle_rad = math::atan2(dy, dx);
    let [x, y] = on_circle(flown_m, angle_rad);
    (flown_m < whole_m).then_some([start[0] + x, start[1] + y])
}

/// Returns its altitude in meters then, if nothing holds it.
fn altitude_after_m(airplane: &AirplaneStart, flown_s: f64) -> f64 {
    let from_m = airplane.altitude_m;
    let Some(FlightOrder { at_s, task: FlightTask::Altitude { altitude_m, climb_m_s } }) =
        airplane.orders.first()
    else {
        return from_m;
    };
    let climbs_s = (airplane.appears_s + flown_s - at_s).max(0.0);
    let max_m = climb_m_s * climbs_s;
    from_m + (altitude_m - from_m).clamp(-max_m, max_m)
}
