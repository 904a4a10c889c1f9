//! The air that all fly through: how time is cut, when way-points count as reached, and the wind.
//!
//! In a wind, predictions are made in the moving air, towards way-points that drift; what is flown
//! is flown over the ground.

use super::action::Action;
use super::motion::{Model, Point, Pose, Timing, distance_m};
use super::pilot::{After, Passing, Pilot, Prediction};
use sidestep_kernel::math;

/// The air: all that is the same for every airplane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Steps of time.
    pub timing: Timing,
    /// Rule by which way-points count as reached.
    pub passing: Passing,
    /// A wind that all know.
    pub wind_m_s: Point,
}

impl Air {
    /// Returns how an airplane flies through still air.
    pub fn pilot<'a>(&self, model: &'a Model, mission: &'a [Point]) -> Pilot<'a> {
        Pilot {
            model,
            mission,
            passing: self.passing,
            after: After::Straight,
            dtau_s: self.timing.dtau_s,
        }
    }

    fn is_still(&self) -> bool {
        self.wind_m_s == [0.0, 0.0]
    }

    /// Returns the turn rate that leads to way-point `next` on the ground, wind allowed for.
    pub fn steer(&self, pilot: &Pilot<'_>, pose: Pose, next: usize) -> f64 {
        let Some(&goal) = pilot.mission.get(next) else { return 0.0 };
        let omega_max = pilot.model.omega_max_rad_s;
        pose.steer(self.aim(pose.at, goal, pilot.model.v_m_s), omega_max, pilot.dtau_s)
    }

    /// Returns where to head from `at` to come to `goal` on the ground: against the wind by the
    /// angle at which the airspeed cancels the wind's part across the way.
    pub fn aim(&self, at: Point, goal: Point, v_m_s: f64) -> Point {
        if self.is_still() {
            return goal;
        }
        let [wx, wy] = self.wind_m_s;
        let (dx, dy) = (goal[0] - at[0], goal[1] - at[1]);
        let length_m = math::hypot(dx, dy).max(1e-9);
        let (ux, uy) = (dx / length_m, dy / length_m);
        let across = (wx * uy - wy * ux).clamp(-v_m_s, v_m_s);
        let along = (v_m_s * v_m_s - across * across).sqrt();
        // Along the way by `along`, against the crosswind by `across`.
        let heading = [ux * along - uy * across, uy * along + ux * across];
        [at[0] + heading[0], at[1] + heading[1]]
    }

    /// Returns a pose after the wind has blown for one step.
    pub fn blown(&self, pose: Pose) -> Pose {
        let dtau_s = self.timing.dtau_s;
        let at = [pose.at[0] + self.wind_m_s[0] * dtau_s, pose.at[1] + self.wind_m_s[1] * dtau_s];
        Pose { at, ..pose }
    }

    /// Returns where each action leads an airplane on its way to way-point `next`.
    ///
    /// Over one horizon, way-points are taken where they will be met on a straight way.
    pub fn predictions(
        &self,
        model: &Model,
        actions: &[Action],
        mission: &[Point],
        (pose, next): (Pose, usize),
    ) -> Vec<Prediction> {
        let mission = self.drifted(mission, (pose.at, next), model.v_m_s);
        let pilot = self.pilot(model, &mission);
        actions.iter().map(|action| pilot.predict(*action, pose, next, &self.timing)).collect()
    }

    /// The mission as seen from the moving air: each way-point where it will be when the
    /// airplane comes to it.
    fn drifted(&self, mission: &[Point], (mut at, next): (Point, usize), v_m_s: f64) -> Vec<Point> {
        let mut drifted = mission.to_vec();
        if self.is_still() {
            return drifted;
        }
        let [wx, wy] = self.wind_m_s;
        let mut flown_s = 0.0;
        for goal in drifted.iter_mut().skip(next) {
            let heading = self.aim(at, *goal, v_m_s);
            let ground = [heading[0] - at[0] + wx, heading[1] - at[1] + wy];
            let speed_m_s = math::hypot(ground[0], ground[1]).max(1e-3);
            flown_s += distance_m(at, *goal) / speed_m_s;
            at = *goal;
            *goal = [goal[0] - wx * flown_s, goal[1] - wy * flown_s];
        }
        drifted
    }
}
