//! Flight plans around areas.
//!
//! Where the straight way from one way-point to the next leads through an area that does not move, further way-points lead
//! around it, as a flight planner would file them; not around one that begins long after an airplane has passed. Methods only have to return to the route then, also from concave
//! areas. An airplane that others have pushed past such a way-point is done with it (`act/areas.rs`). Areas that move, and those that are over before an airplane could come to them, are left to the method.

use crate::areas::{Area, Areas, DetourPlanner};
use crate::flight::{AirplaneStart, FlightLevelRange, FlightTask, Point, Surface};
use std::mem;

/// Distance from borders at which a flight plan rounds corners, in tolerances of way-points: airplanes turn for the next
/// way-point as far before the present one as that is.
const GAP_TOLERANCES: f64 = 1.5;
/// Meters beside that, more than all margins of plans.
const MORE_GAP_M: f64 = 10.0;

/// Delays with which airplanes are reckoned to be through an area before it begins: a part of the time since the start of the
/// run, and seconds beside it.
const MAX_LATE_FRACTION: f64 = 0.2;
const MAX_LATE_S: f64 = 60.0;

/// What the flight plans of a scenario have to lead around, and how.
pub(super) struct DetourRules<'a> {
    pub(super) surface: Surface,
    pub(super) areas: &'a Areas,
    /// Distance within which way-points are reached, in meters.
    pub(super) tolerance_m: f64,
    /// Largest error of a position for which the shield allows, in meters.
    pub(super) error_m: f64,
}

impl DetourRules<'_> {
    /// Adds the way-points to all flight plans that lead around areas.
    pub(super) fn apply(&self, airplanes: &mut [AirplaneStart]) {
        if self.areas.is_empty() {
            return;
        }
        // Non-cooperative ones avoid nothing.
        for airplane in airplanes.iter_mut().filter(|one| !one.is_non_cooperative) {
            let levels = all_levels(airplane);
            let mut leg = Leg {
                from: airplane.start.at,
                at_s: airplane.appears_s,
                v_m_s: airplane.model.v_m_s,
                levels,
            };
            let mut detours = Vec::new();
            let mission = mem::take(&mut airplane.mission);
            airplane.mission = self.around_areas(mission, &mut leg, &mut detours);
            for order in &mut airplane.orders {
                // Nobody knows where it is when it is given the order, so only what comes after the first is planned.
                if let FlightTask::WayPoints(way_points) = &mut order.task
                    && let Some(&first) = way_points.first()
                {
                    leg.from = first;
                    leg.at_s = order.at_s;
                    let later = way_points[1..].to_vec();
                    let later = self.around_areas(later, &mut leg, &mut detours);
                    *way_points = [vec![first], later].concat();
                }
            }
            airplane.detours = detours;
        }
    }

    /// Returns way-points with further ones between them, which it adds to `detours` as well.
    fn around_areas(
        &self,
        way_points: Vec<Point>,
        leg: &mut Leg,
        detours: &mut Vec<Point>,
    ) -> Vec<Point> {
        let mut route = Vec::with_capacity(way_points.len());
        for way_point in way_points {
            let leg_s = self.surface.distance_m(leg.from, way_point) / leg.v_m_s;
            let all = self.areas.iter().map(|area| &**area);
            let areas = all.filter(|area| leg.may_meet(area, leg_s));
            let planner = DetourPlanner {
                surface: self.surface,
                areas: areas.collect(),
                gap_m: GAP_TOLERANCES * self.tolerance_m + self.error_m + MORE_GAP_M,
            };
            let detour = planner.way_points(leg.from, way_point);
            detours.extend_from_slice(&detour);
            for next in detour.into_iter().chain([way_point]) {
                leg.at_s += self.surface.distance_m(leg.from, next) / leg.v_m_s;
                leg.from = next;
                route.push(next);
            }
        }
        route
    }
}

/// The leg of a flight plan that is planned next.
struct Leg {
    from: Point,
    /// The earliest time at which it is flown, in seconds after the start of the run.
    at_s: f64,
    v_m_s: f64,
    levels: FlightLevelRange,
}

impl Leg {
    /// Returns whether it has to lead around an area, if it takes some seconds straight on: unless the area is over before,
    /// or begins long after.
    fn may_meet(&self, area: &Area, leg_s: f64) -> bool {
        let past_s = self.at_s + leg_s;
        let is_past = past_s + MAX_LATE_FRACTION * past_s + MAX_LATE_S < area.from_s;
        !area.is_moving() && area.until_s > self.at_s && !is_past && area.is_on_levels(&self.levels)
    }
}

/// Returns all levels that an airplane is ever on by its flight plan.
fn all_levels(airplane: &AirplaneStart) -> FlightLevelRange {
    let level = FlightLevelRange::from_level(airplane.altitude_m);
    airplane.orders.iter().fold(level, |levels, order| match order.task {
        FlightTask::Altitude { altitude_m, .. } => levels.extended_by_level(altitude_m),
        _ => levels,
    })
}
