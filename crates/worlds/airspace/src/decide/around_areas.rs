//! Headings around areas, for all methods that give airplanes headings.
//!
//! Flight plans lead around areas that do not move (`scenario/detours.rs`), so a heading leads into one only where an
//! airplane was pushed aside, or where the area moves. It is then replaced with the heading nearest to it on which the
//! airplane would fly straight on clear of all areas for as long as the method looks ahead, or else for longest.

use super::local_flight::LocalFlight;
use crate::areas::{LocalArea, LocalAreas};
use crate::flight::{KnownAircraft, Pose2, distance_m};
use crate::method::Steering;
use crate::world::AirspaceWorld;
use sidestep_kernel::{Cycle, math};

/// Difference of two headings that are tried, in degrees.
const HEADING_STEP_DEG: f64 = 5.0;
/// Number of headings that are tried to either side: up to the opposite one.
const HEADINGS: u32 = 36;
/// Distance that is kept from borders where there is room, in separations.
const GAP_SEPARATIONS: f64 = 0.1;
/// Part of its distance from a border that an airplane keeps that is nearer than that already.
const NEAR_FRACTION: f64 = 0.9;

/// An airplane in one step of a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct SteeredAircraft {
    pub(super) known: KnownAircraft,
    pub(super) now: Cycle,
    /// Seconds since the cycle began.
    pub(super) elapsed_s: f64,
}

/// Returns whether there are areas that an airplane may come to while the method looks ahead.
pub(super) fn has_areas_ahead(world: &AirspaceWorld, known: KnownAircraft, now: Cycle) -> bool {
    let aircraft = SteeredAircraft { known, now, elapsed_s: 0.0 };
    !world.areas.is_empty() && areas_ahead(world, aircraft, world.timing.dt_s).is_some()
}

/// Returns the areas that an airplane may come to while the method looks ahead, and some seconds more.
fn areas_ahead(world: &AirspaceWorld, aircraft: SteeredAircraft, more_s: f64) -> LocalAreas {
    let SteeredAircraft { known, now, elapsed_s } = aircraft;
    let segment = world.known_segment(known);
    let seconds = world.reactive_settings().look_ahead_s + more_s;
    let reach_m = segment.model.v_m_s * seconds + segment.model.separation_m;
    let mut context = world.area_context(now, seconds);
    context.now_s += elapsed_s;
    context.wind_m_s = world.air_around(known).wind_m_s;
    context.near(world.surface.frame_at(known.pose.at), known.pose.at, reach_m)
}

/// Returns the steering of an airplane for one step, with a heading that is clear of areas if there is one.
pub(super) fn steer_around_areas(
    world: &AirspaceWorld,
    aircraft: SteeredAircraft,
    steering: Steering,
) -> Steering {
    let known = aircraft.known;
    let Some(areas) = areas_ahead(world, aircraft, 0.0) else { return steering };
    let levels = world.levels(known);
    let areas: Vec<&LocalArea> = areas.iter().filter(|area| area.is_on_levels(&levels)).collect();
    let flight = LocalFlight::new(world, known, world.timing.dtau_s);
    let look_ahead_s = world.reactive_settings().look_ahead_s;
    let v_m_s = flight.model.v_m_s;
    let (desired_rad, for_s) = match (steering, flight.goal()) {
        (Steering::Heading(heading_rad), _) => (heading_rad, look_ahead_s),
        (Steering::Velocity([vx, vy]), _) if [vx, vy] != [0.0; 2] => {
            (math::atan2(vy, vx), look_ahead_s)
        }
        (Steering::Proceed | Steering::Velocity(_), Some(goal)) => {
            let from = flight.pose.at;
            let aim = flight.air.aim_point(from, goal, v_m_s);
            // Beyond its way-point it flies elsewhere.
            let flight_s = distance_m(from, goal) / v_m_s;
            (math::atan2(aim[1] - from[1], aim[0] - from[0]), look_ahead_s.min(flight_s))
        }
        // A turn rate is no heading, and after its last way-point an airplane is gone.
        _ => return steering,
    };
    let gap_m = GAP_SEPARATIONS * flight.model.separation_m;
    let ray = StraightFlight { areas, at: flight.pose.at, v_m_s, for_s, gap_m };
    match ray.clear_heading_rad(desired_rad) {
        heading_rad if heading_rad == desired_rad => steering,
        heading_rad => Steering::Heading(heading_rad),
    }
}

/// Straight flight from a place among areas.
struct StraightFlight<'a> {
    areas: Vec<&'a LocalArea>,
    at: crate::flight::Point,
    v_m_s: f64,
    for_s: f64,
    gap_m: f64,
}

impl StraightFlight<'_> {
    /// Returns the heading nearest to a desired one that is clear for the whole flight, or else the one that is for longest.
    fn clear_heading_rad(&self, desired_rad: f64) -> f64 {
        let inside = self
            .areas
            .iter()
            .find(|area| area.lasts_at(0.0) && area.clearance_m(self.at, 0.0) < 0.0);
        if let Some(area) = inside {
            // The shortest way out.
            return area.direction_to_border_rad(self.at);
        }
        let mut best = (self.clear_s(desired_rad), desired_rad);
        for k in 1..=HEADINGS {
            if best.0 == f64::INFINITY {
                break;
            }
            let turn_rad = (HEADING_STEP_DEG * f64::from(k)).to_radians();
            for heading_rad in [desired_rad + turn_rad, desired_rad - turn_rad] {
                let clear_s = self.clear_s(heading_rad);
                if clear_s > best.0 {
                    best = (clear_s, heading_rad);
                }
            }
        }
        math::wrap_angle(best.1)
    }

    /// Returns for how many seconds it is clear with a heading; infinite for the whole flight.
    fn clear_s(&self, heading_rad: f64) -> f64 {
        let pose = Pose2 { at: self.at, heading_rad };
        let conflicts_s = self.areas.iter().map(|area| {
            let clearance_m = area.clearance_m(self.at, 0.0);
            let gap_m = self.gap_m.min(NEAR_FRACTION * clearance_m).max(0.0);
            area.straight_conflict_s(pose, self.v_m_s, self.for_s, gap_m)
        });
        conflicts_s.fold(f64::INFINITY, f64::min)
    }
}
