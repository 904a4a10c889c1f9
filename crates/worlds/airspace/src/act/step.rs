//! The steps of one `dt`: all airplanes fly, and the results are stored.

use super::approaches;
use super::areas::record_area_times;
use super::flight::{AircraftCycleMotion, FlightPathSource, SubStep};
use crate::events::{Event, EventKind};
use crate::flight::{ConstantRateLeg, FlightConditions, Pose2};
use crate::flown_leg::FlownLeg;
use crate::measures::{CourseStep, Maneuvering};
use crate::metrics::airplane_metrics;
use crate::purpose;
use crate::scratch::PhaseContext;
use crate::state::FlightEnd;
use crate::world::AirspaceWorld;
use sidestep_kernel::Cycle;
use sidestep_kernel::distr::normal;
use sidestep_kernel::geometry::sub;
use sidestep_kernel::interrupt;
use sidestep_kernel::math::wrap_angle;

/// Flies all steps of this `dt`.
pub(super) fn fly_sub_steps(
    context: &mut PhaseContext<'_>,
    mut flights: Vec<AircraftCycleMotion<'_>>,
) {
    let PhaseContext { world, now, .. } = *context;
    let steps = world.timing.points_per_dt();
    for k in 0..steps {
        interrupt::check();
        let step = now * steps as u64 + k as u64;
        let moment = SubStep { now, k, step, step_s: step as f64 * world.timing.dtau_s };
        for flight in flights.iter_mut().filter(|f| f.end.is_none()) {
            let leaves_s = world.airplanes[flight.slot as usize].leaves_s;
            flight.end = (leaves_s <= moment.step_s).then_some(FlightEnd::Left(step));
        }
        for flight in flights.iter_mut().filter(|f| f.end.is_none()) {
            flight.find_step_legs(moment, world.timing.dtau_s);
            if world.surveillance.is_some() {
                flight.record_state(step);
            }
        }
        // Distances are those during the step: the legs of all are known, and nobody has flown yet.
        approaches::record_distances(world, &flights, moment, context.scratch);
        record_area_times(world, &flights, moment, context.scratch);
        for flight in flights.iter_mut().filter(|f| f.end.is_none()) {
            fly(world, flight, moment);
        }
    }
    flights.into_iter().for_each(|flight| store_flight(context, flight));
}

fn fly(
    world: &AirspaceWorld,
    flight: &mut AircraftCycleMotion<'_>,
    SubStep { now, k, step, .. }: SubStep,
) {
    let air = flight.air;
    let dtau_s = world.timing.dtau_s;
    if !world.is_non_cooperative(flight.slot, now) {
        count_maneuver(&air, flight, k);
    }
    let is_at_end = match &flight.path {
        FlightPathSource::Profile { profile, segment, .. } => {
            let omega = profile.omegas_rad_s[k];
            let altitude_m = segment.altitude_after_m(flight.altitude_m, dtau_s);
            flight.altitude_m = altitude_m;
            let before = flight.pose;
            flight.pose = air.after_wind_step(before.step(segment.model.v_m_s, omega, dtau_s));
            let autopilot = air.autopilot(&segment.model, &flight.mission);
            flight.next = autopilot.next_way_point((before, flight.pose), flight.next);
            flight.next == segment.mission.len()
        }
        FlightPathSource::Track(track) => {
            let after_s = (step + 1) as f64 * dtau_s;
            flight.pose = flight.frame.pose_to_local(track.pose_at(after_s));
            flight.altitude_m = track.altitude_at_m(after_s);
            track.end_s() <= after_s
        }
    };
    flight.end = is_at_end.then_some(FlightEnd::Arrived(step + 1));
}

/// Counts the maneuver that an airplane begins in the step that it is about to fly, if it begins one.
fn count_maneuver(air: &FlightConditions, flight: &mut AircraftCycleMotion<'_>, k: usize) {
    let FlightPathSource::Profile { profile, segment, .. } = &flight.path else { return };
    let Some(effort) = &mut flight.effort else { return };
    let omega_rad_s = profile.omegas_rad_s[k];
    let omega_max_rad_s = segment.model.omega_max_rad_s;
    let ahead = flight.legs.first().zip(flight.mission.get(flight.next));
    if let Some((leg, &way_point)) = ahead.filter(|_| !air.has_wind()) {
        let step = CourseStep {
            along: leg.direction(),
            offset_m: sub(way_point, flight.pose.at),
            omega_rad_s,
            omega_max_rad_s,
            dtau_s: air.timing.dtau_s,
        };
        if step.is_surely_on_course() {
            effort.add_planned_step();
            return;
        }
    }
    let autopilot = air.autopilot(&segment.model, &flight.mission);
    let planned_rad_s = air.steer(&autopilot, flight.pose, flight.next);
    effort.add_maneuver_step(&Maneuvering { omega_rad_s, planned_rad_s, omega_max_rad_s });
}

/// Returns the rows of an airplane: its legs, and the position where its flight ended.
fn leg_rows(
    world: &AirspaceWorld,
    cycle: Cycle,
    flight: &AircraftCycleMotion<'_>,
) -> Vec<FlownLeg> {
    let airplane = flight.slot;
    let row = |leg: ConstantRateLeg| {
        let start = flight.frame.pose_to_world(leg.pose);
        FlownLeg { cycle, airplane, leg, start }
    };
    let mut rows: Vec<FlownLeg> = flight.flown.iter().map(|&leg| row(leg)).collect();
    if let Some(FlightEnd::Arrived(step) | FlightEnd::Left(step)) = flight.end {
        let at_s = step as f64 * world.timing.dtau_s;
        let end = ConstantRateLeg::new(at_s, at_s, flight.pose, 0.0, 0.0)
            .with_climb(flight.altitude_m, 0.0);
        rows.push(row(end));
    }
    rows
}

fn store_flight(context: &mut PhaseContext<'_>, flight: AircraftCycleMotion<'_>) {
    let &mut PhaseContext { world, state, now, ref mut scratch, .. } = context;
    let current = &state.airplanes[flight.slot as usize];
    let mut pose = flight.frame.pose_to_world(flight.pose);
    scratch.flown.extend(leg_rows(world, now, &flight));
    let is_disturbed = matches!(flight.path, FlightPathSource::Profile { .. });
    let turn_rate_rad_s = match &flight.path {
        FlightPathSource::Profile { profile, .. } => {
            profile.omegas_rad_s.last().copied().unwrap_or_default()
        }
        FlightPathSource::Track(_) => 0.0,
    };
    state.set_turn_rate_rad_s(flight.slot, turn_rate_rad_s);
    state.add_state_vectors(world, flight.slot, &flight.states);
    if let Some((mut effort, measures)) = flight.effort.zip(world.measures.flights) {
        flight.flown.iter().for_each(|leg| effort.add_leg(leg, measures));
        state.set_effort(flight.slot, effort);
    }
    // While it orbits, `store_maneuver` has moved the pose along already, without the errors of the flight.
    if current.orbiting.get() == 0 {
        state.set_orbit_pose(
            flight.slot,
            Pose2 { heading_rad: wrap_angle(pose.heading_rad), ..pose },
        );
    }
    if is_disturbed && world.disturbance.heading_rad > 0.0 {
        let mut draws = world.streams.draws(flight.slot, now, purpose::HEADING);
        pose.heading_rad += world.disturbance.heading_rad * normal(&mut draws);
    }
    pose.heading_rad = wrap_angle(pose.heading_rad);
    current.set_pose(pose);
    current.altitude_m.set(flight.altitude_m);
    current.next.set(flight.next as u32);
    if let Some(end) = flight.end {
        current.set_end(end);
        if let Some(delay_s) = airplane_metrics(world, state, flight.slot).delay_s() {
            let event = Event::new(now, EventKind::Arrival, flight.slot);
            scratch.events.push(event.with_value(delay_s));
        }
    }
}
