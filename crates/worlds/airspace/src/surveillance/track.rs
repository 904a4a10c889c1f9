//! A track: what an observer knows of another airplane by the last report that it has received.

use crate::baseline::AircraftState;
use crate::flight::{FlightLevelRange, Point, Pose2, rotated};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::geometry::{add_scaled, norm, sub};
use sidestep_kernel::math;

/// What an observer knows of another airplane by a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SurveillanceTrack {
    /// The airplane.
    pub(crate) slot: EntitySlot,
    /// The step in which it sent the report.
    pub(crate) step: u64,
    /// Seconds since then.
    pub(crate) age_s: f64,
    /// Where it was, with all errors, in coordinates of the scenario.
    pub(crate) at: Point,
    /// Its velocity over the ground, east and north there in meters per second, with all errors.
    pub(crate) velocity_m_s: Point,
    /// Its altitude then, in meters.
    pub(crate) altitude_m: f64,
    /// Its rate of climb in meters per second, negative downward.
    pub(crate) climb_m_s: f64,
}

/// A track that was moved on to a time, in the air in which motions of different airplanes are compared.
#[derive(Debug, Clone, Copy)]
struct ExtrapolatedTrack {
    /// Position, in coordinates of the scenario, and the direction of the velocity there.
    pose: Pose2,
    /// Velocity through that air, in meters per second.
    velocity_m_s: Point,
    altitude_m: f64,
}

impl SurveillanceTrack {
    /// Returns the track some seconds from now: straight on from the report.
    fn extrapolated(&self, world: &AirspaceWorld, seconds: f64) -> ExtrapolatedTrack {
        let frame = world.surface.frame_at(self.at);
        let elapsed_s = self.age_s + seconds;
        let at = add_scaled(frame.to_local(self.at), self.velocity_m_s, elapsed_s);
        let air_m_s = self.air_velocity_m_s(world);
        let heading_rad = math::atan2(air_m_s[1], air_m_s[0]);
        let pose = frame.pose_to_world(Pose2 { at, heading_rad });
        ExtrapolatedTrack {
            pose,
            velocity_m_s: rotated(air_m_s, pose.heading_rad - heading_rad),
            altitude_m: self.altitude_m + self.climb_m_s * elapsed_s,
        }
    }

    /// Returns its velocity through the common air, in the directions where it was.
    fn air_velocity_m_s(&self, world: &AirspaceWorld) -> Point {
        sub(self.velocity_m_s, world.wind_m_s)
    }

    /// Returns where the observer takes the airplane to be now, in coordinates of the scenario.
    pub(crate) fn present_position(&self, world: &AirspaceWorld) -> Point {
        self.extrapolated(world, 0.0).pose.at
    }

    /// Returns a cooperative airplane as a method considers it some seconds from now.
    pub(crate) fn aircraft_state(&self, world: &AirspaceWorld, seconds: f64) -> AircraftState {
        let ExtrapolatedTrack { pose, velocity_m_s, altitude_m } =
            self.extrapolated(world, seconds);
        let look_ahead_s = world.reactive_settings().look_ahead_s;
        AircraftState {
            slot: self.slot,
            at: pose.at,
            heading_rad: pose.heading_rad,
            velocity: velocity_m_s,
            // Its velocity is that in the common air.
            drift: [0.0; 2],
            // Nobody knows where it is bound for.
            preferred_rad: pose.heading_rad,
            separation_m: world.airplanes[self.slot as usize].model.separation_m,
            altitude_m,
            climb_m_s: self.climb_m_s,
            levels: FlightLevelRange::between(
                altitude_m,
                altitude_m + self.climb_m_s * look_ahead_s,
            ),
            yields: true,
            is_cooperative: true,
        }
    }

    /// Returns a non-cooperative airplane, with bounds on where it may be.
    pub(crate) fn non_cooperative_aircraft(&self, world: &AirspaceWorld) -> NonCooperativeAircraft {
        let ExtrapolatedTrack { pose, velocity_m_s, altitude_m } = self.extrapolated(world, 0.0);
        let i = self.slot as usize;
        let dt_s = world.timing.dt_s;
        let top_m_s = self.top_m_s(world);
        let look_ahead_s = world.reactive_settings().look_ahead_s.max(dt_s);
        let vertical_m = self.max_vertical_m_s(world) * (self.age_s + dt_s);
        let reachable =
            FlightLevelRange::between(self.altitude_m - vertical_m, self.altitude_m + vertical_m);
        let settings = world.surveillance.as_ref();
        let sensor_bound_m = settings.map_or(0.0, |settings| settings.position_bound_m);
        let wind_change_m_s = settings.map_or(0.0, |settings| settings.max_wind_change_m_s);
        // See the proof in the documentation of this module's parent.
        let growth_m_s = top_m_s + norm(self.air_velocity_m_s(world)) + wind_change_m_s;
        NonCooperativeAircraft {
            slot: self.slot,
            at: pose.at,
            velocity_m_s,
            top_m_s,
            separation_m: world.airplanes[i].model.separation_m,
            error_m: world.position_bound_m(i) + sensor_bound_m + growth_m_s * self.age_s,
            altitude_m,
            climb_m_s: self.climb_m_s,
            levels: reachable
                .extended_by_level(altitude_m)
                .extended_by_level(altitude_m + self.climb_m_s * look_ahead_s),
            dt_s,
        }
    }

    /// Returns its greatest speed through the common air, in meters per second, wherever and on whatever track it flies.
    fn top_m_s(&self, world: &AirspaceWorld) -> f64 {
        let i = self.slot as usize;
        let drift_m_s = world.surveillance.map_or(0.0, |settings| settings.max_drift_m_s);
        let kind_m_s = world.top_m_s[i] + drift_m_s;
        if world.airplanes[i].track.is_some() {
            // Recorded speeds are over the ground.
            return kind_m_s + norm(world.wind_m_s);
        }
        kind_m_s
    }

    /// Returns its greatest rate of climb or descent, in meters per second: on its track, by its orders, and by commands
    /// of a method that flew it before.
    fn max_vertical_m_s(&self, world: &AirspaceWorld) -> f64 {
        let airplane = &world.airplanes[self.slot as usize];
        let mut max_m_s = airplane.track.as_ref().map_or(0.0, |track| track.max_climb_m_s());
        for done in 0..=airplane.orders.len() {
            let segment = world.segment(self.slot, done as u32);
            max_m_s = max_m_s.max(segment.climb_m_s).max(segment.descent_m_s);
        }
        let commanded_m_s = world.surveillance.and_then(|settings| settings.commanded_climb_m_s);
        if let Some(unlimited_m_s) = commanded_m_s {
            let performance = &airplane.performance;
            for limit_m_s in [performance.climb_max_m_s, performance.descent_max_m_s] {
                let commanded_m_s = if limit_m_s.is_finite() { limit_m_s } else { unlimited_m_s };
                max_m_s = max_m_s.max(commanded_m_s);
            }
        }
        max_m_s
    }
}
