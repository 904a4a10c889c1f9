//! What the program of a node and its guard share: the reference, and what the guard does.
//!
//! The program offers the reference of a cycle before that begins, with the stored fallback behind it for some cycles. What
//! is there when a cycle begins is flown: an offer that is late is refused, and then the fallback goes on. So the two never
//! disagree about what is flown, and a program that has ended leaves a fallback, and then nothing.

use super::time::FlightTime;
use crate::plant::aircraft::{AircraftState, Setpoint, TrafficReport};
use sidestep::kernel::Cycle;
use sidestep::worlds::airspace::flight::Pose2;
use sidestep::worlds::airspace::replica::{ReferenceCycle, ReferencePoint};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The board of a node: see the [module](self).
#[derive(Debug)]
pub struct FlightBoard {
    state: Mutex<BoardState>,
}

/// All that is on it.
#[derive(Debug)]
struct BoardState {
    time: Option<FlightTime>,
    reference: BTreeMap<Cycle, ReferenceCycle>,
    /// When the program has last given a sign of life.
    alive_at: Instant,
    guard: GuardReport,
    /// The others, for the display of the vehicle.
    traffic: Vec<TrafficReport>,
    /// Number of reports of traffic that the vehicle's own receiver has brought.
    seen_traffic: u64,
}

/// What the guard does, for the node's reports.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GuardReport {
    /// The last measurement.
    pub measured: Option<AircraftState>,
    /// Whether it was close enough to where it is to be, and led by its node.
    pub is_at_reference: bool,
    /// Why the vehicle was handed over, if it was.
    pub held: Option<String>,
    /// Distance in meters from the reference at the last measurement.
    pub deviation_m: Option<f64>,
    /// The largest one since the start.
    pub max_deviation_m: f64,
    /// What it has done since it was last asked.
    pub events: Vec<String>,
    /// Counts of the plant.
    pub counts: Vec<(String, u64)>,
}

/// What the guard is to do at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lead {
    /// Lead the vehicle there.
    To(Setpoint),
    /// The flight has ended.
    Ended,
    /// Nothing says where the vehicle is to be.
    Nothing,
}

impl Default for FlightBoard {
    fn default() -> Self {
        let state = BoardState {
            time: None,
            reference: BTreeMap::new(),
            alive_at: Instant::now(),
            guard: GuardReport::default(),
            traffic: Vec::new(),
            seen_traffic: 0,
        };
        Self { state: Mutex::new(state) }
    }
}

impl FlightBoard {
    fn lock(&self) -> MutexGuard<'_, BoardState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says when the cycles begin.
    pub fn set_time(&self, time: FlightTime) {
        self.lock().time = Some(time);
    }

    /// Returns when the cycles begin, if that is known.
    pub fn time(&self) -> Option<FlightTime> {
        self.lock().time
    }

    /// Puts up the first reference, of a vehicle that nobody leads yet.
    pub fn put_reference(&self, reference: Vec<ReferenceCycle>) {
        let mut state = self.lock();
        state.reference = reference.into_iter().map(|one| (one.cycle, one)).collect();
    }

    /// Offers the reference from a cycle on. Returns whether it is flown: not if the cycle has begun, or the vehicle was handed
    /// over.
    pub fn offer(&self, cycle: Cycle, reference: Vec<ReferenceCycle>, now_s: f64) -> bool {
        let mut state = self.lock();
        let begins_s = state.time.map(|time| time.cycle_at_s(cycle as i64, 0.0));
        if state.guard.held.is_some() || begins_s.is_none_or(|begins_s| now_s >= begins_s) {
            return false;
        }
        state.reference.retain(|&before, _| before < cycle && before + 1 >= cycle);
        state.reference.extend(reference.into_iter().map(|one| (one.cycle, one)));
        true
    }

    /// Gives a sign of life of the program.
    pub fn beat(&self) {
        self.lock().alive_at = Instant::now();
    }

    /// Returns the seconds since the last sign of life of the program.
    pub fn silent_s(&self) -> f64 {
        self.lock().alive_at.elapsed().as_secs_f64()
    }

    /// Returns where the vehicle is to be at a time. `run_up_s` seconds before the start it sets out toward its first pose.
    pub fn lead(&self, now_s: f64, run_up_s: f64) -> Lead {
        let state = self.lock();
        let Some(first) = state.reference.values().next().and_then(|one| one.points.first()) else {
            return Lead::Nothing;
        };
        let at_s = state.time.map_or(f64::NEG_INFINITY, |time| time.scenario_s(now_s));
        if at_s < first.at_s {
            // A node that has returned in the middle of a cycle knows where its vehicle is to be at its end.
            let run_up_s = if at_s < 0.0 { run_up_s } else { f64::INFINITY };
            return Lead::To(before_start(first, at_s - first.at_s, run_up_s));
        }
        let Some(time) = state.time else { return Lead::Nothing };
        let cycle = (at_s / time.dt_s) as Cycle;
        if let Some(reference) = state.reference.get(&cycle) {
            let end_s = reference.points.last().map_or(at_s, |point| point.at_s);
            let is_over = reference.is_last && at_s >= end_s;
            return if is_over { Lead::Ended } else { Lead::To(interpolated(reference, at_s)) };
        }
        let has_ended = state.reference.values().any(|one| one.is_last && one.cycle < cycle);
        if has_ended { Lead::Ended } else { Lead::Nothing }
    }

    /// Puts up where the others are.
    pub fn put_traffic(&self, traffic: Vec<TrafficReport>) {
        self.lock().traffic = traffic;
    }

    /// Returns where the others are.
    pub fn traffic(&self) -> Vec<TrafficReport> {
        self.lock().traffic.clone()
    }

    /// Counts what the vehicle's own receiver has seen.
    pub fn add_seen_traffic(&self, reports: u64) {
        self.lock().seen_traffic += reports;
    }

    /// Returns the number of reports of traffic that the vehicle's own receiver has brought.
    pub fn seen_traffic(&self) -> u64 {
        self.lock().seen_traffic
    }

    /// Stores what the guard does, and keeps events that nobody has taken yet.
    pub fn set_guard(&self, mut report: GuardReport) {
        let mut state = self.lock();
        let mut events = std::mem::take(&mut state.guard.events);
        events.append(&mut report.events);
        state.guard = GuardReport { events, ..report };
    }

    /// Returns what the guard does.
    pub fn guard(&self) -> GuardReport {
        self.lock().guard.clone()
    }

    /// Takes out what the guard has done since the last call.
    pub fn take_events(&self) -> Vec<String> {
        std::mem::take(&mut self.lock().guard.events)
    }
}

/// Returns where a vehicle is to be `at_s` seconds after its first pose, a negative number: on the straight line to it, at most
/// so far before it as it flies in its run-up.
fn before_start(first: &ReferencePoint, at_s: f64, run_up_s: f64) -> Setpoint {
    let back_s = (-at_s).min(run_up_s);
    let is_running = -at_s <= run_up_s;
    let back_m = back_s * first.ground_speed_m_s;
    let Pose2 { at: [x, y], heading_rad } = first.pose;
    let at = [x - back_m * heading_rad.cos(), y - back_m * heading_rad.sin()];
    Setpoint {
        pose: Pose2 { at, heading_rad },
        ground_speed_m_s: if is_running { first.ground_speed_m_s } else { 0.0 },
        turn_rate_rad_s: 0.0,
        altitude_m: first.altitude_m,
    }
}

/// Returns the setpoint at a time within a cycle.
fn interpolated(reference: &ReferenceCycle, at_s: f64) -> Setpoint {
    let points = &reference.points;
    let after = points.partition_point(|point| point.at_s <= at_s).clamp(1, points.len() - 1);
    let before = &points[after - 1];
    let next = &points[after];
    let span_s = next.at_s - before.at_s;
    let share = if span_s > 0.0 { ((at_s - before.at_s) / span_s).clamp(0.0, 1.0) } else { 0.0 };
    let between = |a: f64, b: f64| a + share * (b - a);
    let turned_rad = wrapped(next.pose.heading_rad - before.pose.heading_rad);
    Setpoint {
        pose: Pose2 {
            at: [0, 1].map(|k| between(before.pose.at[k], next.pose.at[k])),
            heading_rad: wrapped(before.pose.heading_rad + share * turned_rad),
        },
        ground_speed_m_s: between(before.ground_speed_m_s, next.ground_speed_m_s),
        turn_rate_rad_s: before.turn_rate_rad_s,
        altitude_m: between(before.altitude_m, next.altitude_m),
    }
}

fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cycle(number: Cycle, is_last: bool) -> ReferenceCycle {
        let point = |at_s: f64| ReferencePoint {
            at_s,
            pose: Pose2 { at: [10.0 * at_s, 0.0], heading_rad: 0.0 },
            altitude_m: 100.0,
            ground_speed_m_s: 10.0,
            turn_rate_rad_s: 0.0,
        };
        let from_s = number as f64;
        ReferenceCycle { cycle: number, points: vec![point(from_s), point(from_s + 1.0)], is_last }
    }

    fn board() -> FlightBoard {
        let board = FlightBoard::default();
        board.set_time(FlightTime { start_s: 100.0, speed: 1.0, dt_s: 1.0 });
        board.put_reference(vec![cycle(0, false), cycle(1, false)]);
        board
    }

    fn x_m(lead: Lead) -> f64 {
        match lead {
            Lead::To(setpoint) => setpoint.pose.at[0],
            Lead::Ended | Lead::Nothing => f64::NAN,
        }
    }

    #[test]
    fn a_vehicle_waits_at_its_first_pose_or_sets_out_so_that_it_passes_it_in_time() {
        let board = board();
        assert_eq!(x_m(board.lead(97.0, 0.0)), 0.0);
        assert_eq!(x_m(board.lead(97.0, 2.0)), -20.0);
        assert_eq!(x_m(board.lead(99.0, 2.0)), -10.0);
        assert!((x_m(board.lead(100.5, 2.0)) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn an_offer_is_flown_if_its_cycle_has_not_begun_and_else_what_is_there_goes_on() {
        let board = board();
        let mut other = cycle(1, false);
        other.points[0].pose.at[1] = 7.0;
        assert!(!board.offer(1, vec![other.clone()], 101.0), "it has begun");
        assert!((x_m(board.lead(101.5, 0.0)) - 15.0).abs() < 1e-9);
        assert!(board.offer(2, vec![cycle(2, true)], 101.9));
        assert!((x_m(board.lead(101.95, 0.0)) - 19.5).abs() < 1e-9, "the present cycle stays");
        assert!((x_m(board.lead(102.5, 0.0)) - 25.0).abs() < 1e-9);
        assert_eq!(board.lead(103.1, 0.0), Lead::Ended);
    }

    #[test]
    fn a_program_that_says_nothing_more_leaves_nothing_behind_its_fallback() {
        let board = board();
        assert_eq!(board.lead(102.1, 0.0), Lead::Nothing);
    }

    #[test]
    fn a_vehicle_that_was_handed_over_takes_no_offer() {
        let board = board();
        board.set_guard(GuardReport { held: Some("fence".into()), ..GuardReport::default() });
        assert!(!board.offer(1, vec![cycle(1, false)], 99.0));
    }
}
