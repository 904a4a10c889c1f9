//! Areas in a run: from which of them airplanes are exempt, and how they enter them.

use super::flight::{AircraftCycleMotion, SubStep};
use super::protect::shielded_aircraft;
use crate::areas::{Area, AreaPlane};
use crate::events::{Event, EventKind};
use crate::flight::{ConstantRateLeg, FlightLevelRange, Frame};
use crate::metrics::AreaRecord;
use crate::pilot::{Maneuver, OwnshipState};
use crate::scratch::{PhaseContext, Scratch};
use crate::shield::SafeManeuver;
use crate::world::AirspaceWorld;
use sidestep_kernel::geometry::{dot, sub};
use sidestep_kernel::{EntitySlot, math};

/// Length in seconds below which a time in an area is no longer halved: the time of an entry is as exact as that.
const MIN_INTERVAL_S: f64 = 1e-3;
/// Meters by which an airplane may seem to be beyond a border because of rounding.
const ROUNDING_M: f64 = 1e-6;
/// Fraction of a step below which two times count as the same.
const ROUNDING: f64 = 1e-6;

/// Lets airplanes of a group go on that have a way-point behind them, however far away, which only leads around areas:
/// nobody has to be there, and one that others have pushed past it would fly back.
pub(super) fn pass_detours(context: &PhaseContext<'_>, group: &[EntitySlot]) {
    let PhaseContext { world, state, .. } = *context;
    for &slot in group {
        let airplane = &world.airplanes[slot as usize];
        if airplane.detours.is_empty() {
            continue;
        }
        let current = &state.airplanes[slot as usize];
        let mission = state.segment(world, slot).mission;
        let mut next = current.next.get() as usize;
        while next + 1 < mission.len() && airplane.detours.contains(&mission[next]) {
            let before = next.checked_sub(1).map_or(airplane.start.at, |before| mission[before]);
            let frame = world.surface.frame_at(mission[next]);
            let [way_point, before, at] =
                [mission[next], before, current.pose().at].map(|place| frame.to_local(place));
            if dot(sub(at, way_point), sub(way_point, before)) <= 0.0 {
                break;
            }
            next += 1;
        }
        current.next.set(next as u32);
    }
}

/// Reports the airplanes of `flown` that enter now with fallbacks that are not clear of an area: they are exempt from it.
pub(super) fn report_exempt_areas(context: &mut PhaseContext<'_>, flown: &[EntitySlot]) {
    let PhaseContext { world, now, .. } = *context;
    if world.areas.is_empty() {
        return;
    }
    let is_entering = |slot: EntitySlot| {
        world.rules_begin_at(now) || world.first_controlled_cycle(slot as usize) == now
    };
    for &slot in flown.iter().filter(|&&slot| is_entering(slot)) {
        let aircraft = shielded_aircraft(context, slot);
        for number in aircraft.unclear_areas(aircraft.fallback) {
            record_exempt_area(context, slot, number);
        }
    }
}

/// Reports the areas that an airplane may enter in this `dt` with a maneuver.
pub(super) fn report_areas_ahead(
    context: &mut PhaseContext<'_>,
    own: &OwnshipState,
    maneuver: &Maneuver,
) {
    let PhaseContext { world, now, .. } = *context;
    if world.areas.is_empty() {
        return;
    }
    let aircraft = own.shielded_aircraft(world, now);
    if aircraft.areas.is_none() {
        return;
    }
    let dtau_s = world.timing.dtau_s;
    let plan = match maneuver {
        Maneuver::Profile { profile, fallback, .. } => {
            SafeManeuver::new(aircraft.clone(), profile, dtau_s, *fallback)
        }
        Maneuver::Orbit => {
            SafeManeuver::on_fallback(aircraft.clone(), world.timing.points_per_dt(), dtau_s)
        }
    };
    for number in aircraft.areas_entered_within_dt(&plan) {
        record_exempt_area(context, own.id, number);
    }
}

fn record_exempt_area(context: &mut PhaseContext<'_>, slot: EntitySlot, number: u32) {
    let event = Event::new(context.now, EventKind::AreaExempt, slot);
    context.scratch.events.push(event.with_value(f64::from(number)));
    context.scratch.exempt_areas.push((context.now, slot, number));
}

/// Records the times in areas of all airplanes during a step.
pub(super) fn record_area_times(
    world: &AirspaceWorld,
    flights: &[AircraftCycleMotion<'_>],
    moment: SubStep,
    scratch: &mut Scratch,
) {
    for (number, area) in (0..).zip(world.areas.iter()) {
        let ends_s = moment.step_s + world.timing.dtau_s;
        if ends_s <= area.from_s || area.until_s <= moment.step_s {
            continue;
        }
        let is_near = |flight: &&AircraftCycleMotion<'_>| {
            let flown_m = 1.01 * world.top_m_s[flight.slot as usize] * world.timing.dt_s;
            let range_m = flown_m + world.max_wind_m_s() * world.timing.dt_s;
            flight.end.is_none() && !area.is_surely_far(world.surface, flight.from, ends_s, range_m)
        };
        for flight in flights.iter().filter(is_near) {
            let record = area_record(world, area, flight, moment);
            if record == AreaRecord::default() {
                continue;
            }
            if record.entries > 0 {
                let event = Event::new(moment.now, EventKind::AreaEntry, flight.slot);
                scratch.events.push(event.with_value(f64::from(number)));
            }
            let all = &mut scratch.areas;
            all.entry((flight.slot, number)).or_default().add(record);
        }
    }
}

/// Returns the record of an airplane and an area in one step.
fn area_record(
    world: &AirspaceWorld,
    area: &Area,
    flight: &AircraftCycleMotion<'_>,
    moment: SubStep,
) -> AreaRecord {
    let mut record = AreaRecord::default();
    // Where the airplane was in the step before, if it was in the air, it is at the start of this one.
    let is_first_step =
        moment.step_s <= flight.since_s.max(area.from_s) + ROUNDING * world.timing.dtau_s;
    let mut inside_until_s = if is_first_step { f64::NEG_INFINITY } else { 0.0 };
    for leg in &flight.legs {
        let stay = AreaStay { area, leg, flight, moment, world };
        let Some(span) = stay.span_on_levels() else { continue };
        let mut inside = Vec::new();
        stay.find_inside(span, &mut inside);
        for [from_s, until_s] in inside {
            record.inside_ns += ((until_s - from_s) * 1e9).round() as u64;
            record.entries += u32::from(from_s > inside_until_s);
            inside_until_s = until_s;
        }
    }
    record
}

/// One leg of an airplane beside an area.
struct AreaStay<'a> {
    area: &'a Area,
    leg: &'a ConstantRateLeg,
    flight: &'a AircraftCycleMotion<'a>,
    moment: SubStep,
    world: &'a AirspaceWorld,
}

impl AreaStay<'_> {
    /// Returns the times, in seconds after the start of the step, in which the leg is on the levels of the area while that
    /// lasts.
    fn span_on_levels(&self) -> Option<[f64; 2]> {
        let Self { area, leg, moment, .. } = self;
        let mut from_s = leg.from_s.max(area.from_s - moment.step_s);
        let mut until_s = leg.until_s.min(area.until_s - moment.step_s);
        let FlightLevelRange { low_m, high_m } = area.levels;
        if leg.climb_m_s == 0.0 {
            let is_on_level = low_m < leg.altitude_m && leg.altitude_m < high_m;
            return (is_on_level && from_s < until_s).then_some([from_s, until_s]);
        }
        let passes_s =
            [low_m, high_m].map(|level_m| leg.from_s + (level_m - leg.altitude_m) / leg.climb_m_s);
        from_s = from_s.max(passes_s[0].min(passes_s[1]));
        until_s = until_s.min(passes_s[0].max(passes_s[1]));
        (from_s < until_s).then_some([from_s, until_s])
    }

    /// Returns how far the airplane is from where it must not be, in meters; negative there.
    fn clearance_m(&self, t_s: f64) -> f64 {
        let plane = self.plane_at(t_s);
        let at = self.frame().to_world(self.leg.position_at(t_s));
        let in_area = plane.to_area(at);
        let at_least_m = self.area.min_clearance_m(in_area);
        // Nearly always it is far away, and no border needs to be looked at.
        if at_least_m > 0.0 { at_least_m } else { self.area.clearance_m(in_area) + ROUNDING_M }
    }

    fn plane_at(&self, t_s: f64) -> AreaPlane {
        self.area.plane_at(self.world.surface, self.moment.step_s + t_s)
    }

    fn frame(&self) -> Frame {
        self.flight.frame
    }

    /// Returns how fast the clearance may change, in meters per second.
    fn max_speed_m_s(&self) -> f64 {
        let [wx, wy] = self.leg.drift_m_s;
        let [vx, vy] = self.area.velocity_m_s;
        // A little more, for planes that touch the earth in different places.
        1.01 * (self.leg.v_m_s + math::hypot(wx, wy) + math::hypot(vx, vy))
    }

    /// Adds the parts of an interval in which it is where it must not be. An interval is halved until its middle is so far
    /// from the border that no end can be beyond it.
    fn find_inside(&self, [from_s, until_s]: [f64; 2], inside: &mut Vec<[f64; 2]>) {
        let middle_s = 0.5 * (from_s + until_s);
        let half_s = 0.5 * (until_s - from_s);
        let clearance_m = self.clearance_m(middle_s);
        let is_one_side = clearance_m.abs() > self.max_speed_m_s() * half_s;
        if !is_one_side && 2.0 * half_s > MIN_INTERVAL_S {
            self.find_inside([from_s, middle_s], inside);
            self.find_inside([middle_s, until_s], inside);
            return;
        }
        if clearance_m >= 0.0 {
            return;
        }
        match inside.last_mut().filter(|last| last[1] == from_s) {
            Some(last) => last[1] = until_s,
            None => inside.push([from_s, until_s]),
        }
    }
}
