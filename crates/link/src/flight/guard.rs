//! The guard beside the program of a node: a thread of its own that leads the vehicle, and hands it over to its own autopilot
//! where anything is beyond the limits.
//!
//! It sends the setpoint of the reference about ten times a second, which is the proof of life for the autopilot's own
//! failsafe. When the program is late, the reference goes on along the stored fallback without it. It hands over, once and
//! for good, when
//!
//! - measurements are too old, or there are none,
//! - the vehicle is farther from its reference than the shield allows for,
//! - the fence is about to be left,
//! - the program has given no sign of life for some time (dead man's switch), or the reference has run out,
//! - the vehicle does not follow its node anymore: then nothing is commanded, because somebody else flies.
//!
//! Before the start it only leads the vehicle to its first pose, and says when it is there.

use super::board::{FlightBoard, GuardReport, Lead};
use super::fence::Fence;
use super::time::WallClock;
use crate::plant::aircraft::{AircraftPlant, AircraftState, Authority, Setpoint, TrafficReport};
use sidestep::worlds::airspace::flight::Surface;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two setpoints, in seconds of the scenario.
const LEAD_INTERVAL_S: f64 = 0.1;

/// Shortest time between two setpoints, however fast the scenario passes.
const MIN_LEAD_INTERVAL: Duration = Duration::from_millis(5);

/// Seconds of the scenario for which the fence looks ahead: an aircraft that is handed over needs them to stop or to turn.
const FENCE_LOOK_AHEAD_S: f64 = 1.0;

/// Time after which an aircraft that could not be handed over is asked again.
const HOLD_RETRY_DELAY: Duration = Duration::from_secs(1);

/// Time between two lists of the traffic around an aircraft.
const TRAFFIC_INTERVAL: Duration = Duration::from_secs(1);

/// The limits of a guard.
#[derive(Debug, Clone)]
pub struct GuardLimits {
    /// Largest distance from the reference in meters.
    pub max_deviation_m: f64,
    /// Largest age of a measurement in seconds.
    pub max_age_s: f64,
    /// Longest silence of the program in seconds.
    pub patience_s: f64,
    /// Seconds before the start from which on the vehicle flies toward its first pose.
    pub run_up_s: f64,
    /// The area that must not be left.
    pub fence: Fence,
    /// The surface over which it flies.
    pub surface: Surface,
}

/// Why an aircraft is handed over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HoldCause {
    /// There is no measurement, or the last one is so many seconds old.
    OldState(f64),
    /// It is so many meters from its reference.
    Deviation(f64),
    /// It is about to leave the fence.
    Fence,
    /// The program has given no sign of life for so many seconds.
    SilentProgram(f64),
    /// Nothing says where it is to be.
    NoReference,
    /// It does not follow its node.
    Authority(Authority),
}

/// What a guard judges by.
#[derive(Debug, Clone, Copy)]
pub struct GuardView {
    /// The last measurement.
    pub state: Option<AircraftState>,
    /// Where the aircraft was to be at the time of that.
    pub setpoint: Option<Setpoint>,
    /// Seconds since the last sign of life of the program.
    pub silent_s: f64,
}

impl HoldCause {
    /// Returns the cause in words.
    pub fn text(&self) -> String {
        match self {
            Self::OldState(age_s) if age_s.is_finite() => {
                format!("its measurements are {age_s:.1} s old")
            }
            Self::OldState(_) => "it measures nothing".into(),
            Self::Deviation(deviation_m) => {
                format!("it is {deviation_m:.1} m from where it is to be")
            }
            Self::Fence => "it is about to leave the fence".into(),
            Self::SilentProgram(silent_s) => {
                format!("its program has given no sign of life for {silent_s:.1} s")
            }
            Self::NoReference => "nothing says where it is to be".into(),
            Self::Authority(Authority::Ground) => "it is on the ground, or not armed".into(),
            Self::Authority(_) => "it does not follow its node: somebody else flies it".into(),
        }
    }
}

impl GuardLimits {
    /// Returns the distance in meters of an aircraft from where it was to be.
    pub fn deviation_m(&self, state: &AircraftState, setpoint: &Setpoint) -> f64 {
        let level_m = self.surface.distance_m(state.pose.at, setpoint.pose.at);
        level_m.hypot(state.altitude_m - setpoint.altitude_m)
    }

    /// Returns why an aircraft in flight has to be handed over, if it has to.
    pub fn check(&self, view: &GuardView) -> Option<HoldCause> {
        // A number that is none is beyond every limit.
        let Some(state) = view.state else { return Some(HoldCause::OldState(f64::INFINITY)) };
        if state.authority != Authority::Node {
            return Some(HoldCause::Authority(state.authority));
        }
        let is_fresh = state.age_s <= self.max_age_s;
        if !is_fresh {
            return Some(HoldCause::OldState(state.age_s));
        }
        let is_alive = view.silent_s <= self.patience_s;
        if !is_alive {
            return Some(HoldCause::SilentProgram(view.silent_s));
        }
        let Some(setpoint) = view.setpoint else { return Some(HoldCause::NoReference) };
        let deviation_m = self.deviation_m(&state, &setpoint);
        let is_near = deviation_m <= self.max_deviation_m;
        if !is_near {
            return Some(HoldCause::Deviation(deviation_m));
        }
        let ahead_m = state.ground_speed_m_s * FENCE_LOOK_AHEAD_S;
        let keeps = self.fence.keeps(state.pose, state.altitude_m, ahead_m);
        (!keeps).then_some(HoldCause::Fence)
    }
}

/// What has become of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GuardPhase {
    /// It is led.
    Leads,
    /// It has arrived, and was handed over.
    Arrived,
    /// It was handed over before.
    Held,
}

/// The guard of an aircraft: see the [module](self). When it is dropped in flight, it hands the aircraft over.
pub struct Guard {
    plant: Box<dyn AircraftPlant>,
    board: Arc<FlightBoard>,
    clock: WallClock,
    limits: GuardLimits,
    phase: GuardPhase,
    /// When the first setpoint was sent: some measure nothing before.
    first_led: Option<Instant>,
    /// When it hands over again, if the aircraft has refused.
    hold_again: Option<(Instant, String)>,
    traffic_at: Instant,
    report: GuardReport,
}

impl Guard {
    /// Returns the guard of an aircraft.
    pub fn new(
        plant: Box<dyn AircraftPlant>,
        board: Arc<FlightBoard>,
        clock: WallClock,
        limits: GuardLimits,
    ) -> Self {
        Self {
            plant,
            board,
            clock,
            limits,
            phase: GuardPhase::Leads,
            first_led: None,
            hold_again: None,
            traffic_at: Instant::now(),
            report: GuardReport::default(),
        }
    }

    /// Guards until it is told to end, and hands the aircraft over then, if it is still led.
    pub fn run(mut self, has_to_end: &AtomicBool) {
        while !has_to_end.load(Ordering::Relaxed) {
            self.step();
        }
    }

    /// Leads the aircraft, waits for news of it, and judges them.
    pub fn step(&mut self) {
        let lead = self.board.lead(self.clock.now_s(), self.limits.run_up_s);
        self.lead(lead);
        self.hold_again_if_due();
        self.show_traffic();
        let state = self.plant.wait(self.interval());
        self.judge(state);
        self.report.counts = self.plant.counts();
        self.board.set_guard(GuardReport {
            events: std::mem::take(&mut self.report.events),
            ..self.report.clone()
        });
    }

    fn interval(&self) -> Duration {
        let speed = self.board.time().map_or(1.0, |time| time.speed);
        let interval = Duration::try_from_secs_f64(LEAD_INTERVAL_S / speed).unwrap_or_default();
        interval.max(MIN_LEAD_INTERVAL)
    }

    fn lead(&mut self, lead: Lead) {
        if self.phase != GuardPhase::Leads {
            return;
        }
        match lead {
            Lead::To(setpoint) => {
                self.first_led.get_or_insert_with(Instant::now);
                if let Err(reason) = self.plant.lead(&setpoint) {
                    self.report.events.push(format!("a setpoint was not sent: {reason}"));
                }
            }
            Lead::Ended => {
                self.phase = GuardPhase::Arrived;
                self.report.events.push("it has arrived, and holds there by itself".into());
                self.hold("it has arrived".into());
            }
            // It is judged with the next measurement.
            Lead::Nothing => {}
        }
    }

    fn hold(&mut self, reason: String) {
        self.hold_again = match self.plant.hold(&reason) {
            Ok(()) => None,
            Err(refusal) => {
                self.report.events.push(format!("it was not handed over: {refusal}"));
                Some((Instant::now() + HOLD_RETRY_DELAY, reason))
            }
        };
    }

    fn hold_again_if_due(&mut self) {
        if self.hold_again.as_ref().is_some_and(|(due, _)| *due <= Instant::now())
            && let Some((_, reason)) = self.hold_again.take()
        {
            self.hold(reason);
        }
    }

    fn show_traffic(&mut self) {
        if self.traffic_at > Instant::now() {
            return;
        }
        self.traffic_at = Instant::now() + TRAFFIC_INTERVAL;
        let traffic: Vec<TrafficReport> = self.board.traffic();
        if let Err(reason) = self.plant.show_traffic(&traffic) {
            self.report.events.push(format!("traffic was not shown: {reason}"));
        }
        let seen = self.plant.take_traffic();
        self.board.add_seen_traffic(seen.len() as u64);
    }

    /// Judges a measurement.
    fn judge(&mut self, state: Option<AircraftState>) {
        let now_s = self.clock.now_s();
        self.report.measured = state;
        // Where it was to be when it was measured.
        let age_s = state.map_or(0.0, |state| state.age_s);
        let lead = self.board.lead(now_s - age_s, self.limits.run_up_s);
        let setpoint = match lead {
            Lead::To(setpoint) => Some(setpoint),
            Lead::Ended | Lead::Nothing => None,
        };
        let pair = state.as_ref().zip(setpoint.as_ref());
        let deviation_m = pair.map(|(state, setpoint)| self.limits.deviation_m(state, setpoint));
        self.report.deviation_m = deviation_m;
        let is_led = state.is_some_and(|state| state.authority == Authority::Node);
        let is_near = deviation_m.is_some_and(|it_m| it_m <= self.limits.max_deviation_m);
        self.report.is_at_reference = is_led && is_near;
        let has_started = self.board.time().is_some_and(|time| time.scenario_s(now_s) >= 0.0);
        if self.phase != GuardPhase::Leads || !has_started || lead == Lead::Ended {
            return;
        }
        if let Some(deviation_m) = deviation_m {
            self.report.max_deviation_m = self.report.max_deviation_m.max(deviation_m);
        }
        let led_s = self.first_led.map_or(0.0, |led| led.elapsed().as_secs_f64());
        if state.is_none() && led_s <= self.limits.max_age_s {
            return;
        }
        let view = GuardView { state, setpoint, silent_s: self.board.silent_s() };
        if let Some(cause) = self.limits.check(&view) {
            self.hand_over(cause);
        }
    }

    fn hand_over(&mut self, cause: HoldCause) {
        let reason = cause.text();
        self.phase = GuardPhase::Held;
        self.report.held = Some(reason.clone());
        self.report.events.push(format!("it was handed over to its autopilot: {reason}"));
        // Nobody is fought for an aircraft.
        if !matches!(cause, HoldCause::Authority(_)) {
            self.hold(reason);
        }
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        // On every way out, panics included; before the start, too, where it may be under way to its first pose. An error means
        // that nothing can be sent anymore: then its own failsafe acts, because setpoints stop.
        if self.phase == GuardPhase::Leads {
            let _ = self.plant.hold("its node ends");
        }
    }
}

#[cfg(test)]
mod tests;
