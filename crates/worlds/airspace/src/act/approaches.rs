//! Closest approaches of pairs of airplanes, whether the method flies them or not.

use super::flight::{AircraftCycleMotion, SubStep};
use crate::events::{Event, EventKind};
use crate::flight::{
    ConstantRateLeg, PairApproach, PairPlane, RigidMotion, SeparationMinima, Surface,
    is_separation_lost,
};
use crate::scratch::Scratch;
use crate::state::PairRecord;
use crate::world::AirspaceWorld;
use sidestep_kernel::math;

/// Pairs farther apart than this many separations are not recorded: most pairs of a large scenario never come near.
const MAX_RECORDED_SEPARATIONS: f64 = 4.0;
/// Fraction of a step below which two times count as the same.
const ROUNDING: f64 = 1e-6;

/// Records the distances of all pairs during a step.
pub(super) fn record_distances(
    world: &AirspaceWorld,
    flights: &[AircraftCycleMotion<'_>],
    moment: SubStep,
    scratch: &mut Scratch,
) {
    let flying = flights.iter().enumerate().filter(|(_, flight)| flight.end.is_none());
    // Sorted along one direction, so that only neighbors have to be compared.
    let mut by_x: Vec<(f64, usize)> =
        flying.map(|(k, flight)| (sweep_m(world, flight), k)).collect();
    by_x.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let max_m = max_recorded_m(world, flights);
    for (k, &(x_m, i)) in by_x.iter().enumerate() {
        for &(_, j) in by_x[k + 1..].iter().take_while(|(other_m, _)| other_m - x_m <= max_m) {
            // Flights are sorted by id, and so are the two of a pair.
            let a = &flights[i.min(j)];
            let b = &flights[i.max(j)];
            if let Some(plane) = plane_of_near_pair(world, a, b) {
                let approach = closest_approach(world, &plane, [a, b], moment);
                record_pair(world, [a, b], approach, moment, scratch);
            }
        }
    }
}

/// Stores the record of a pair in one step.
fn record_pair(
    world: &AirspaceWorld,
    [a, b]: [&AircraftCycleMotion<'_>; 2],
    record: PairRecord,
    moment: SubStep,
    scratch: &mut Scratch,
) {
    // The two were never on one level.
    if record.nearest_m.is_infinite() {
        return;
    }
    if record.losses > 0 {
        let event = Event::new_for_pair(moment.now, EventKind::LossOfSeparation, a.slot, b.slot);
        scratch.events.push(event.with_value(record.nearest_m));
        let [phase, other] = [a, b].map(|one| world.flight_phase(one.slot, moment.step_s));
        if let Some((phase, other)) = phase.zip(other) {
            *scratch.losses_by_phase.entry(phase.both(other)).or_default() +=
                u64::from(record.losses);
        }
    }
    scratch.pairs.entry((a.slot, b.slot)).and_modify(|r| r.add(record)).or_insert(record);
}

/// Returns a distance in meters beyond which no two airplanes are worth noting.
fn max_recorded_m(world: &AirspaceWorld, flights: &[AircraftCycleMotion<'_>]) -> f64 {
    let mut max_gap_m: f64 = 0.0;
    let mut max_speed_m_s: f64 = 0.0;
    for flight in flights {
        let slot = flight.slot as usize;
        max_gap_m = max_gap_m.max(world.airplanes[slot].model.separation_m);
        max_speed_m_s = max_speed_m_s.max(world.top_m_s[slot] + world.max_drift_m_s());
    }
    let seconds = world.timing.dtau_s + seconds_since_sweep(world);
    MAX_RECORDED_SEPARATIONS * max_gap_m + 2.0 * max_speed_m_s * seconds
}

/// Returns the number by which airplanes are sorted: of where one is, or on the earth of where it was at the start of
/// this `dt`.
fn sweep_m(world: &AirspaceWorld, flight: &AircraftCycleMotion<'_>) -> f64 {
    match world.surface {
        Surface::Plane => world.surface.sweep_m(flight.pose.at),
        Surface::Earth => world.surface.sweep_m(flight.from),
    }
}

/// Returns for how long airplanes may have flown since they were where they are sorted.
fn seconds_since_sweep(world: &AirspaceWorld) -> f64 {
    match world.surface {
        Surface::Plane => 0.0,
        Surface::Earth => world.timing.dt_s,
    }
}

/// Returns the plane of two airplanes, if they may come so near within a step that it is to be recorded.
fn plane_of_near_pair(
    world: &AirspaceWorld,
    a: &AircraftCycleMotion<'_>,
    b: &AircraftCycleMotion<'_>,
) -> Option<PairPlane> {
    let dtau_s = world.timing.dtau_s;
    let speeds_m_s = world.top_m_s[a.slot as usize]
        + world.top_m_s[b.slot as usize]
        + 2.0 * world.max_drift_m_s();
    let limit_m = MAX_RECORDED_SEPARATIONS * pair_separation_m(world, a, b) + speeds_m_s * dtau_s;
    let from_origins_m = [a, b].map(|one| math::hypot(one.pose.at[0], one.pose.at[1]));
    if a.frame.is_surely_beyond(&b.frame, limit_m + from_origins_m[0] + from_origins_m[1]) {
        return None;
    }
    let plane = PairPlane::between(a.frame, b.frame);
    let is_near = plane.distance_m(a.pose.at, b.pose.at) <= limit_m
        && a.levels(dtau_s).overlaps(&b.levels(dtau_s), world.vertical_m);
    is_near.then_some(plane)
}

/// Returns the separation of a pair in meters.
fn pair_separation_m(
    world: &AirspaceWorld,
    a: &AircraftCycleMotion<'_>,
    b: &AircraftCycleMotion<'_>,
) -> f64 {
    let separation_a_m = world.airplanes[a.slot as usize].model.separation_m;
    let separation_b_m = world.airplanes[b.slot as usize].model.separation_m;
    separation_a_m.max(separation_b_m)
}

/// Returns by how many meters a distance may seem to change from one step to the next: on the earth the plane of a pair
/// is another one in each `dt`. A loss that began so near the separation counts once more rather than never.
fn plane_change_m(world: &AirspaceWorld) -> f64 {
    match world.surface {
        Surface::Plane => 0.0,
        Surface::Earth => 0.01,
    }
}

/// Returns legs in the plane of a pair.
fn legs_in_plane(
    flight: &AircraftCycleMotion<'_>,
    motion: Option<&RigidMotion>,
) -> Vec<ConstantRateLeg> {
    match motion {
        None => flight.legs.clone(),
        Some(motion) => flight.legs.iter().map(|leg| leg.moved(motion)).collect(),
    }
}

/// Returns the record of a pair in one step.
fn closest_approach(
    world: &AirspaceWorld,
    plane: &PairPlane,
    [a, b]: [&AircraftCycleMotion<'_>; 2],
    moment: SubStep,
) -> PairRecord {
    let zone =
        SeparationMinima { gap_m: pair_separation_m(world, a, b), vertical_m: world.vertical_m };
    // A loss continues from the end of the step before; there is no step before when one of the two
    // has just come into the air.
    let is_first_step = moment.step_s <= a.since_s.max(b.since_s) + ROUNDING * world.timing.dtau_s;
    let motions = plane.motions();
    let legs_a = legs_in_plane(a, motions.map(|motions| &motions[0]));
    let legs_b = legs_in_plane(b, motions.map(|motions| &motions[1]));
    let first_legs = legs_a.first().zip(legs_b.first());
    let before = SeparationMinima { gap_m: zone.gap_m - plane_change_m(world), ..zone };
    let continues_loss =
        !is_first_step && first_legs.is_some_and(|(a, b)| is_separation_lost(a, b, 0.0, before));
    let mut approach = PairApproach::new(continues_loss.then_some(0.0));
    for leg_a in &legs_a {
        for leg_b in &legs_b {
            if leg_a.from_s < leg_b.until_s && leg_b.from_s < leg_a.until_s {
                approach.add(leg_a, leg_b, zone);
            }
        }
    }
    PairRecord {
        nearest_m: approach.nearest_m,
        lost_ns: (approach.lost_s * 1e9).round() as u64,
        losses: approach.losses,
    }
}
