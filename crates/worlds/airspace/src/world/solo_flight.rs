//! Solo flights: how long each airplane would fly if there were no other, and what that would cost.

use super::AirspaceWorld;
use crate::flight::{
    AirplaneStart, ConstantRateLeg, FlightConditions, InterOrderSegment, Pose2, RoutePosition,
    Surface, distance_m,
};
use crate::measures::FlightEffort;
use sidestep_kernel::{EntitySlot, interrupt};

/// Seconds, or steps where these are longer, after which a flight counts as endless: no flight of a scenario is as
/// long as 11 days.
const MAX_FLIGHT_S: f64 = 1e6;
/// Most steps computed singly, enough for 1e6 s in steps of 0.1 s; beyond it a flight also counts as endless. Long
/// straight stretches are flown at once, and cost one.
const MAX_COMPUTED_STEPS: usize = 10_000_000;

/// An airplane on its flight alone.
struct SoloFlight<'a> {
    world: &'a AirspaceWorld,
    airplane: &'a AirplaneStart,
    slot: EntitySlot,
    /// The time at which the method takes it over, in seconds after the start of the run.
    joins_s: f64,
    pose: Pose2,
    altitude_m: f64,
    orders: u32,
    next: usize,
    /// Number of steps flown, those of straight stretches among them.
    steps: usize,
    /// Whether it flies on forever after its last order.
    ends_on_heading: bool,
    effort: FlightEffort,
    /// The air through which it flies in this cycle.
    air: FlightConditions,
}

/// The duration and the cost of a solo flight.
pub(super) struct SoloOutcome {
    /// Seconds from when the method takes it over; infinite if it would never end.
    pub(super) duration_s: f64,
    /// What it costs until then; nothing where that is not measured.
    pub(super) effort: FlightEffort,
}

impl SoloFlight<'_> {
    fn elapsed_s(&self) -> f64 {
        self.steps as f64 * self.world.timing.dtau_s
    }

    /// Executes the orders that are due, and enters the air that is there, at the start of a cycle, as in a run.
    fn start_cycle(&mut self) {
        let Self { world, slot, orders, next, .. } = *self;
        if self.steps.is_multiple_of(world.timing.points_per_dt()) {
            self.air = world.air_at(self.pose.at, self.altitude_m);
            let now_s = self.joins_s + self.elapsed_s();
            (self.orders, self.next) =
                world.progress_after_orders(slot as usize, orders, next, now_s);
        }
    }

    /// Returns the seconds of the flight if it is over, infinite if it never will be.
    fn end_s(&self) -> Option<f64> {
        let flown_s = self.elapsed_s();
        let airplane = self.airplane;
        let way_points = self.world.segment(self.slot, self.orders).mission.len();
        if self.next == way_points || self.joins_s + flown_s >= airplane.leaves_s {
            return Some(flown_s);
        }
        // Endless only after the last order, because the flight may end before that one.
        let is_endless = self.ends_on_heading && self.orders as usize == airplane.orders.len();
        let most_s = MAX_FLIGHT_S * self.world.timing.dtau_s.max(1.0);
        (is_endless || flown_s >= most_s).then_some(f64::INFINITY)
    }

    /// Flies all steps at once in which it certainly flies straight on to its way-point. On the earth that is along the
    /// shortest path, on which a wind would blow from ever other sides.
    fn fly_straight(&mut self) {
        let Self { world, air, .. } = *self;
        let InterOrderSegment { model, mission, .. } = world.segment(self.slot, self.orders);
        let frame = world.surface.frame_at(self.pose.at);
        let pose = frame.pose_to_local(self.pose);
        let route = RoutePosition { mission, next: self.next, pose };
        let mission = air.local_mission(frame, &model, route, world.timing.dtau_s);
        let straight = air.straight_step_count(&air.autopilot(&model, &mission), pose, self.next);
        let after = air.after_straight_steps(pose, model.v_m_s, straight);
        if let Some(measures) = world.measures.flights {
            let flown_s = straight as f64 * world.timing.dtau_s;
            let ground_m = distance_m(pose.at, after.at);
            let leg = ConstantRateLeg::new(0.0, flown_s, pose, model.v_m_s, 0.0);
            self.effort.add_leg_of_length(&leg, ground_m, measures);
        }
        self.pose = frame.pose_to_world(after);
        self.steps = self.steps.saturating_add(straight);
    }

    /// Changes the level by a step, and adds the cost of that step.
    fn add_step_effort(&mut self, segment: &InterOrderSegment<'_>, pose: Pose2, omega_rad_s: f64) {
        let Self { world, air, .. } = *self;
        let dtau_s = world.timing.dtau_s;
        let altitude_m = segment.altitude_after_m(self.altitude_m, dtau_s);
        let Some(measures) = world.measures.flights else {
            self.altitude_m = altitude_m;
            return;
        };
        let climb_m_s = (altitude_m - self.altitude_m) / dtau_s;
        let leg = ConstantRateLeg::new(0.0, dtau_s, pose, segment.model.v_m_s, omega_rad_s)
            .with_climb(self.altitude_m, climb_m_s)
            .in_wind(air.wind_m_s);
        self.effort.add_leg(&leg, measures);
        self.altitude_m = altitude_m;
    }

    /// Flies a step, and all those before it in which it certainly flies straight on, at once.
    fn step(&mut self) {
        let Self { world, air, .. } = *self;
        let segment = world.segment(self.slot, self.orders);
        let InterOrderSegment { model, mission, .. } = &segment;
        let has_no_orders =
            self.airplane.orders.is_empty() && self.airplane.leaves_s == f64::INFINITY;
        let is_same_wind = world.wind_field.as_ref().is_none_or(|field| !field.varies_by_place());
        let can_skip =
            has_no_orders && is_same_wind && !(world.surface == Surface::Earth && air.has_wind());
        if can_skip {
            self.fly_straight();
        }
        let frame = world.surface.frame_at(self.pose.at);
        let before = frame.pose_to_local(self.pose);
        let route = RoutePosition { mission, next: self.next, pose: before };
        let mission = air.local_mission(frame, model, route, world.timing.dtau_s);
        let pilot = air.autopilot(model, &mission);
        let omega = air.steer(&pilot, before, self.next);
        let after = air.after_wind_step(before.step(model.v_m_s, omega, world.timing.dtau_s));
        let next = pilot.next_way_point((before, after), self.next);
        self.add_step_effort(&segment, before, omega);
        self.pose = frame.pose_to_world(after);
        // Far from the origin a step may be lost to rounding, and then all later ones are too: the flight is endless.
        let is_stuck = has_no_orders && after == before && self.next == next;
        self.next = next;
        self.steps = if is_stuck { usize::MAX } else { self.steps.saturating_add(1) };
    }
}

impl AirspaceWorld {
    /// Returns how long a flight would take alone, and what it would cost.
    pub(super) fn solo_outcome(&self, i: usize) -> SoloOutcome {
        let airplane = &self.airplanes[i];
        let joins_s = self.cycle_start_s(self.first_controlled_cycle(i));
        if airplane.track.as_ref().is_some_and(|track| track.end_s() <= joins_s) {
            return SoloOutcome { duration_s: 0.0, effort: FlightEffort::default() };
        }
        let ends_on_heading =
            airplane.has_fixed_heading(airplane.orders.len()) && airplane.leaves_s == f64::INFINITY;
        let mut flight = SoloFlight {
            world: self,
            airplane,
            slot: i as EntitySlot,
            joins_s,
            pose: airplane.track.as_ref().map_or(airplane.start, |track| track.pose_at(joins_s)),
            altitude_m: airplane.altitude_m,
            orders: 0,
            next: 0,
            steps: 0,
            ends_on_heading,
            effort: FlightEffort::default(),
            air: self.flight_environment(),
        };
        for _ in 0..MAX_COMPUTED_STEPS {
            interrupt::check();
            flight.start_cycle();
            if let Some(duration_s) = flight.end_s() {
                return SoloOutcome { duration_s, effort: flight.effort };
            }
            flight.step();
        }
        SoloOutcome { duration_s: f64::INFINITY, effort: flight.effort }
    }
}
