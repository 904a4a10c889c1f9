//! The air that all fly through: the steps of time, the rule for way-points, and the wind.
//!
//! In a wind, predictions are made in the moving air, toward way-points that drift; the real flight
//! is over the ground. Where the wind differs, each airplane's are made in the air around it, and then stated in an air
//! that is common to all, so that they can be compared.

use super::action::Action;
use super::autopilot::{AfterLastWaypoint, Autopilot, Prediction, WaypointRule};
use super::change::{ChangeableFlight, SteadyChange};
use super::motion::{AircraftModel, Point, Pose2, TimeDiscretization, distance_m};
use super::surface::{Frame, Surface, way_point_reach_m};
use sidestep_kernel::geometry::{add_scaled, sub};
use sidestep_kernel::{interrupt, math};
use std::borrow::Cow;

/// Difference of heading and bearing in radians below which an airplane no longer turns: in an hour at 250 m/s it
/// leads 0.1 mm astray.
const ALIGNED_RAD: f64 = 1e-10;

/// The air that an airplane flies through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightConditions {
    /// Lengths of a cycle, of the steps in it, and of the horizon.
    pub timing: TimeDiscretization,
    /// Rule by which way-points count as reached.
    pub passing: WaypointRule,
    /// The wind, which all know, in meters per second.
    pub wind_m_s: Point,
    /// The velocity of the air in which predictions of different airplanes are compared, in meters per second: the wind
    /// itself, unless that differs from level to level or from place to place.
    pub common_wind_m_s: Point,
    /// The surface that all fly over.
    pub surface: Surface,
}

/// An airplane's position on its route.
#[derive(Debug, Clone, Copy)]
pub struct RoutePosition<'a> {
    /// All way-points of the route, also those behind it.
    pub mission: &'a [Point],
    /// Number of way-points done with, which is the index of the one that it flies to.
    pub next: usize,
    /// The pose from which it flies there, in the coordinates of the way-points unless a method says otherwise.
    pub pose: Pose2,
}

impl FlightConditions {
    /// Returns how an airplane flies through still air.
    pub fn autopilot<'a>(&self, model: &'a AircraftModel, mission: &'a [Point]) -> Autopilot<'a> {
        Autopilot {
            model,
            mission,
            passing: self.passing,
            after: AfterLastWaypoint::Straight,
            dtau_s: self.timing.dtau_s,
        }
    }

    /// Returns the way-points of a route in a frame, as far as an airplane gets in some seconds from a pose in that
    /// frame; see [`Frame::local_mission`].
    pub(crate) fn local_mission<'a>(
        &self,
        frame: Frame,
        model: &AircraftModel,
        route: RoutePosition<'a>,
        seconds: f64,
    ) -> Cow<'a, [Point]> {
        let RoutePosition { mission, next, pose } = route;
        let drift_m = math::hypot(self.wind_m_s[0], self.wind_m_s[1]) * seconds;
        let from_m = math::hypot(pose.at[0], pose.at[1]);
        let reach_m =
            from_m + drift_m + way_point_reach_m(model, seconds, self.passing.tolerance_m);
        frame.local_mission((mission, next), reach_m, self.passing.passes_abeam)
    }

    /// Returns whether the air moves.
    pub(crate) fn has_wind(&self) -> bool {
        !self.is_windless()
    }

    fn is_windless(&self) -> bool {
        self.wind_m_s == [0.0, 0.0]
    }

    /// Returns the velocity of this air relative to the common one, in meters per second.
    pub(crate) fn drift_m_s(&self) -> Point {
        sub(self.wind_m_s, self.common_wind_m_s)
    }

    /// Moves the points of a path, one after each step, from this air to the common one.
    pub(crate) fn move_to_common_air(&self, points: &mut [Point]) {
        // Where the wind is the same everywhere, this is the common air.
        if self.wind_m_s == self.common_wind_m_s {
            return;
        }
        let drift_m_s = self.drift_m_s();
        for (k, point) in (1..).zip(points) {
            *point = add_scaled(*point, drift_m_s, f64::from(k) * self.timing.dtau_s);
        }
    }

    /// Returns the turn rate that leads to way-point `next` on the ground, corrected for the wind.
    pub fn steer(&self, autopilot: &Autopilot<'_>, pose: Pose2, next: usize) -> f64 {
        let Some(&goal) = autopilot.mission.get(next) else { return 0.0 };
        let AircraftModel { v_m_s, omega_max_rad_s, .. } = *autopilot.model;
        pose.steer(self.aim_point(pose.at, goal, v_m_s), omega_max_rad_s, autopilot.dtau_s)
    }

    /// Returns the point to head for from `at` in order to reach `goal` on the ground: turned into
    /// the wind by the angle at which the airspeed cancels the crosswind.
    pub fn aim_point(&self, at: Point, goal: Point, v_m_s: f64) -> Point {
        if self.is_windless() {
            return goal;
        }
        let [wx, wy] = self.wind_m_s;
        let dx = goal[0] - at[0];
        let dy = goal[1] - at[1];
        // At the goal any direction will do, but it must be a number.
        let length_m = math::hypot(dx, dy).max(1e-9);
        let ux = dx / length_m;
        let uy = dy / length_m;
        // No scenario has a wind as fast as its airplanes, but a speed that came in a message may be lower.
        let crosswind_m_s = (wx * uy - wy * ux).clamp(-v_m_s, v_m_s);
        let along_m_s = (v_m_s * v_m_s - crosswind_m_s * crosswind_m_s).sqrt();
        // The velocity through the air: along the course, and against the crosswind.
        let velocity = [ux * along_m_s - uy * crosswind_m_s, uy * along_m_s + ux * crosswind_m_s];
        [at[0] + velocity[0], at[1] + velocity[1]]
    }

    /// Returns a number of steps in which an airplane certainly flies straight on to way-point `next`
    /// without reaching it: none while it still turns there, or is near.
    pub fn straight_step_count(
        &self,
        autopilot: &Autopilot<'_>,
        pose: Pose2,
        next: usize,
    ) -> usize {
        let Some(&goal) = autopilot.mission.get(next) else { return 0 };
        let model = autopilot.model;
        let [x, y] = self.aim_point(pose.at, goal, model.v_m_s);
        let bearing_rad = math::atan2(y - pose.at[1], x - pose.at[0]);
        if math::wrap_angle(bearing_rad - pose.heading_rad).abs() > ALIGNED_RAD {
            return 0;
        }
        let step_m = distance_m(pose.at, self.after_straight_steps(pose, model.v_m_s, 1).at);
        // Nearer than a turning circle's diameter, the way-point may count as passed.
        let near_m = self.passing.tolerance_m.max(2.0 * model.turn_radius_m()) + step_m;
        // Where the wind holds it in place, a step may be lost in rounding.
        if step_m <= 0.0 {
            return 0;
        }
        // The conversion makes a negative number 0.
        ((distance_m(pose.at, goal) - near_m) / step_m) as usize
    }

    /// Returns a pose after some steps straight on, carried along by the wind: all at once.
    pub fn after_straight_steps(&self, pose: Pose2, v_m_s: f64, steps: usize) -> Pose2 {
        let flown_s = steps as f64 * self.timing.dtau_s;
        let [wx, wy] = self.wind_m_s;
        let vx = v_m_s * math::cos(pose.heading_rad) + wx;
        let vy = v_m_s * math::sin(pose.heading_rad) + wy;
        Pose2 { at: [pose.at[0] + vx * flown_s, pose.at[1] + vy * flown_s], ..pose }
    }

    /// Returns a pose moved by the wind of one step, which [`Pose2::step`] leaves out.
    pub fn after_wind_step(&self, pose: Pose2) -> Pose2 {
        let dtau_s = self.timing.dtau_s;
        let at = [pose.at[0] + self.wind_m_s[0] * dtau_s, pose.at[1] + self.wind_m_s[1] * dtau_s];
        Pose2 { at, ..pose }
    }

    /// Returns where each action leads an airplane that is at a point of its route, in the frame of that point and in the
    /// common air.
    ///
    /// Predictions are made in the moving air, where way-points drift. Over one horizon, each is taken where it will
    /// be when the airplane, flying straight, reaches it. `flight` is given where actions change level or speed.
    pub(crate) fn predictions(
        &self,
        model: &AircraftModel,
        actions: &[Action],
        route: RoutePosition<'_>,
        flight: Option<&ChangeableFlight<'_>>,
    ) -> Vec<Prediction> {
        let RoutePosition { mission, next, pose } = route;
        interrupt::check();
        let frame = self.surface.frame_at(pose.at);
        let pose = frame.pose_to_local(pose);
        // A step more, within which the last point may still change the way-point.
        let seconds = self.timing.horizon_s() + self.timing.dtau_s;
        let local = RoutePosition { mission, next, pose };
        let mission = self.local_mission(frame, model, local, seconds);
        let mission = self.wind_corrected_mission(&mission, pose.at, next, model.v_m_s);
        let autopilot = self.autopilot(model, &mission);
        let speeds = |action: &Action| match flight {
            Some(flight) => flight.speeds(action.change),
            None => SteadyChange::constant(model.v_m_s),
        };
        let predicted = actions.iter().map(|action| {
            autopilot.predict_at_speeds(action.turn, speeds(action), (pose, next), &self.timing)
        });
        let mut predictions: Vec<Prediction> = predicted.collect();
        for prediction in &mut predictions {
            self.move_to_common_air(&mut prediction.points);
        }
        predictions
    }

    /// Returns the seconds of a straight flight over the ground to `goal`.
    pub fn straight_flight_time_s(&self, at: Point, goal: Point, v_m_s: f64) -> f64 {
        if self.is_windless() {
            return distance_m(at, goal) / v_m_s;
        }
        let [wx, wy] = self.wind_m_s;
        let aim = self.aim_point(at, goal, v_m_s);
        let ground_velocity = [aim[0] - at[0] + wx, aim[1] - at[1] + wy];
        // Against a wind of its own speed it would never arrive.
        let speed_m_s = math::hypot(ground_velocity[0], ground_velocity[1]).max(1e-3);
        distance_m(at, goal) / speed_m_s
    }

    /// Returns the mission as seen from the moving air: each way-point at its place when the
    /// airplane reaches it.
    fn wind_corrected_mission(
        &self,
        mission: &[Point],
        mut at: Point,
        next: usize,
        v_m_s: f64,
    ) -> Vec<Point> {
        let mut drifted = mission.to_vec();
        if self.is_windless() {
            return drifted;
        }
        let [wx, wy] = self.wind_m_s;
        let mut flown_s = 0.0;
        for goal in drifted.iter_mut().skip(next) {
            flown_s += self.straight_flight_time_s(at, *goal, v_m_s);
            at = *goal;
            *goal = [goal[0] - wx * flown_s, goal[1] - wy * flown_s];
        }
        drifted
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::coordinates_from_degrees;
    use proptest::prelude::*;

    proptest! {
        /// Only way-points that an airplane can get to are found in its frame; it needs no others.
        #[test]
        fn way_points_beyond_reach_are_not_missed(
            lat in -80.0f64..80.0, lon in -180.0f64..180.0, heading_rad in -3.1f64..3.1,
            offsets_m in prop::collection::vec(prop::array::uniform2(-20_000.0f64..20_000.0), 2..7),
            next in 0usize..4, turns in prop::collection::vec(-1.0f64..=1.0, 1..30), passes_abeam in any::<bool>(),
        ) {
            let surface = Surface::Earth;
            let at = coordinates_from_degrees([lat, lon]);
            let frame = surface.frame_at(at);
            let mission: Vec<Point> = offsets_m.iter().map(|&offset| frame.to_world(offset)).collect();
            let timing = TimeDiscretization { dt_s: 10.0, dtau_s: 5.0, horizon: 30 };
            let passing = WaypointRule { tolerance_m: 1852.0, passes: true, passes_abeam };
            let air = FlightConditions { timing, passing, wind_m_s: [0.0; 2], common_wind_m_s: [0.0; 2], surface };
            let model = AircraftModel { v_m_s: 230.0, omega_max_rad_s: 0.02, separation_m: 9260.0, turns: 5 };
            let pose = Pose2 { at: [0.0; 2], heading_rad };
            let route = RoutePosition { mission: &mission, next, pose };
            let near = air.local_mission(frame, &model, route, 5.0 * turns.len() as f64);
            let [mut by_near, mut by_all] = [next; 2];
            let mut flown = pose;
            for turn in &turns {
                let before = flown;
                flown = before.step(model.v_m_s, turn * model.omega_max_rad_s, 5.0);
                by_near = air.autopilot(&model, &near).next_way_point((before, flown), by_near);
                by_all = air.autopilot(&model, &offsets_m).next_way_point((before, flown), by_all);
                prop_assert_eq!(by_near, by_all);
                if let Some(goal) = near.get(by_near) {
                    prop_assert!(distance_m(*goal, offsets_m[by_near]) < 1e-3, "the next one is known");
                }
            }
        }
    }
}
