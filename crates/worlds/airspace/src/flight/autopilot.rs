//! Predictions: an autopilot flies actions and missions step by step, and returns the path.

use super::action::TurnAction;
use super::change::SteadyChange;
use super::motion::{AircraftModel, Point, Pose2, TimeDiscretization, distance_m, sinc};
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{dot, normalized, sub};
use sidestep_kernel::math;
use std::ops::RangeInclusive;

/// The flight after the last way-point, in predictions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AfterLastWaypoint {
    /// Flies straight on.
    #[default]
    Straight,
    /// Continues to steer for the last way-point.
    Pursue,
}

/// The rule by which an airplane is done with a way-point.
///
/// It is reached within a tolerance. But an airplane with a way-point inside one of its two
/// tightest turning circles would orbit it forever, because steering for it keeps the airplane on
/// that circle. Such a way-point counts as *passed* when it is abeam on the near side. That happens
/// within one turn round the circle, and there the airplane is as near as it can be without flying
/// away first.
///
/// An airplane that turns by more than a radian in a step is checked too rarely for that: it flies over a way-point,
/// or past where it is abeam, between two checks. It passes a way-point in the step in which it comes nearest to it,
/// if it is less than a step's length from it at either end.
///
/// An airplane that others keep off its route may be far beside a way-point when that is abeam. Where way-points are
/// *passed abeam*, it is done with one then, however far away that is, unless it is the last one: it flies on along its
/// route, as an airplane does whose flight management system sequences the way-points (BlueSky's `passedwp`), and does
/// not turn back for it. Abeam is the line through the way-point at right angles to the leg that leads there. The leg to
/// the first way-point begins where nobody keeps it; there it is the leg that leads on, and the airplane has to have the
/// way-point behind it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WaypointRule {
    /// Distance in meters below which a way-point is reached.
    pub tolerance_m: f64,
    /// Whether a way-point inside a turning circle can be passed.
    pub passes: bool,
    /// Whether all way-points but the last are passed abeam.
    pub passes_abeam: bool,
}

impl WaypointRule {
    /// Returns whether an airplane at `pose`, and at `before` one step earlier, is done with the way-point `goal`;
    /// its tightest turn has this radius, and it flies `step_m` meters in a step.
    // Called in every step of every prediction: not inlined, it takes a tenth of an optimization's time.
    #[inline(always)]
    pub fn is_done(
        &self,
        (before, pose): (Pose2, Pose2),
        goal: Point,
        radius_m: f64,
        step_m: f64,
    ) -> bool {
        let dx = goal[0] - pose.at[0];
        let dy = goal[1] - pose.at[1];
        let square_m2 = dx * dx + dy * dy;
        if square_m2 < self.tolerance_m * self.tolerance_m {
            return true;
        }
        // No point farther than a diameter lies in a turning circle. Nearly always it is farther, so only this much
        // is inlined, and the rest is a function.
        let is_far = step_m <= radius_m && square_m2 >= 4.0 * radius_m * radius_m;
        self.passes && !is_far && is_passed((before, pose), goal, radius_m, step_m)
    }
}

/// Returns whether an airplane has passed a way-point in its last step: flown over it, or had it abeam inside a
/// turning circle.
#[inline(never)]
fn is_passed((before, pose): (Pose2, Pose2), goal: Point, radius_m: f64, step_m: f64) -> bool {
    let dx = goal[0] - pose.at[0];
    let dy = goal[1] - pose.at[1];
    let square_m2 = dx * dx + dy * dy;
    if step_m > radius_m && is_flown_over((before, pose), goal, step_m) {
        return true;
    }
    if square_m2 >= 4.0 * radius_m * radius_m {
        return false;
    }
    // The circles' centers are a radius to the left and right: the goal is inside when its
    // distance to the nearer center is below the radius.
    let [ahead, left] = relative_position(pose, goal);
    let is_inside = square_m2 < 2.0 * radius_m * left.abs();
    // Abeam since the last step: on a circle, `ahead` changes by less than a step per step.
    is_inside && left.abs() < radius_m && (-step_m..=0.0).contains(&ahead)
}

/// Returns whether an airplane has a way-point abeam or behind that is not the last one.
#[inline(never)]
fn has_abeam_behind(mission: &[Point], next: usize, pose: Pose2) -> bool {
    let Some(leg) = leg_direction(mission, next) else { return false };
    let way_point = mission[next];
    let is_beyond = dot(sub(pose.at, way_point), leg) > 0.0;
    is_beyond && (next > 0 || relative_position(pose, way_point)[0] <= 0.0)
}

/// Returns the numbers of the way-points between which the leg lies that decides what is abeam of a way-point: that to
/// it from the last one at another place, or where there is none, from the first one.
pub(super) fn leg_ends(mission: &[Point], next: usize) -> RangeInclusive<usize> {
    let earlier = mission.get(..next).unwrap_or_default();
    let from = earlier.iter().rposition(|way_point| Some(way_point) != mission.get(next));
    match from {
        Some(from) => from..=next,
        None => 0..=next.max(1),
    }
}

/// Returns the direction of that leg; none where there is none, and for the last way-point.
pub(super) fn leg_direction(mission: &[Point], next: usize) -> Option<Point> {
    let (from, to) = leg_ends(mission, next).into_inner();
    let (&from, &to) = mission.get(from).zip(mission.get(to))?;
    normalized(sub(to, from)).filter(|_| next + 1 < mission.len())
}

/// Returns how far ahead of an airplane a place is, and how far to its left.
#[inline]
fn relative_position(pose: Pose2, place: Point) -> Point {
    let dx = place[0] - pose.at[0];
    let dy = place[1] - pose.at[1];
    let sin = math::sin(pose.heading_rad);
    let cos = math::cos(pose.heading_rad);
    [cos * dx + sin * dy, cos * dy - sin * dx]
}

/// Returns whether an airplane comes nearest to a place within a step of `step_m` meters, and is nearer than that at
/// either end of it.
fn is_flown_over((before, pose): (Pose2, Pose2), place: Point, step_m: f64) -> bool {
    let comes_nearest =
        relative_position(before, place)[0] > 0.0 && relative_position(pose, place)[0] <= 0.0;
    comes_nearest && distance_m(before.at, place).min(distance_m(pose.at, place)) < step_m
}

/// The path along which an action leads.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Prediction {
    /// Positions in meters after 1, 2, ... steps of `dtau`.
    pub points: Vec<Point>,
    /// Number of points that count against others: those up to arrival at the last way-point.
    pub counted: usize,
}

/// An airplane on a predicted path: a pose, and values that save computing its sine and cosine anew
/// in every step. Equal to [`Pose2::step`] except for rounding (a test compares them).
#[derive(Debug, Clone, Copy)]
struct PredictionState {
    pose: Pose2,
    /// Cosine and sine of the heading.
    along: Point,
    /// The turn rate of the last step; beside it, for half of its turn, cosine, sine and sinc.
    omega_rad_s: f64,
    half_turn: [f64; 3],
}

impl PredictionState {
    fn new(pose: Pose2) -> Self {
        let along = [math::cos(pose.heading_rad), math::sin(pose.heading_rad)];
        Self { pose, along, omega_rad_s: 0.0, half_turn: [1.0, 0.0, 1.0] }
    }

    /// Returns whether the goal lies dead ahead, so that steering for it no longer changes
    /// anything.
    #[inline]
    fn is_heading_for(&self, goal: Point) -> bool {
        let [dx, dy] = [goal[0] - self.pose.at[0], goal[1] - self.pose.at[1]];
        let [c, s] = self.along;
        let ahead = dx * c + dy * s;
        let across = dy * c - dx * s;
        // Over a horizon of a million meters, 1e-12 rad is a micrometer.
        ahead > 0.0 && across.abs() <= 1e-12 * ahead
    }

    #[inline]
    fn step(&mut self, v_m_s: f64, omega_rad_s: f64, dtau_s: f64) {
        if omega_rad_s != self.omega_rad_s {
            let half_turn_rad = 0.5 * omega_rad_s * dtau_s;
            self.omega_rad_s = omega_rad_s;
            self.half_turn = if omega_rad_s == 0.0 {
                [1.0, 0.0, 1.0]
            } else {
                [math::cos(half_turn_rad), math::sin(half_turn_rad), sinc(half_turn_rad)]
            };
        }
        let [cos, sin, sinc] = self.half_turn;
        let rotate = |[x, y]: Point| [x * cos - y * sin, x * sin + y * cos];
        let chord_m = v_m_s * dtau_s * sinc;
        let middle = rotate(self.along);
        self.along = rotate(middle);
        self.pose = Pose2 {
            at: [self.pose.at[0] + chord_m * middle[0], self.pose.at[1] + chord_m * middle[1]],
            heading_rad: self.pose.heading_rad + omega_rad_s * dtau_s,
        };
    }
}

/// Flies step by step: an action, the way-points, and the flight after the last.
#[derive(Debug, Clone, Copy)]
pub struct Autopilot<'a> {
    /// Gives the airspeed and the largest turn rate.
    pub model: &'a AircraftModel,
    /// All way-points; methods are given the index of the next one.
    pub mission: &'a [Point],
    /// Rule by which way-points count as reached.
    pub passing: WaypointRule,
    /// The flight after the last way-point.
    pub after: AfterLastWaypoint,
    /// Seconds per step.
    pub dtau_s: f64,
}

impl Autopilot<'_> {
    /// Returns the turn rate of an action in the step that starts after `flown_s` seconds of it.
    #[inline]
    pub fn omega_rad_s(&self, turn: TurnAction, pose: Pose2, next: usize, flown_s: f64) -> f64 {
        match turn.turn_rate_rad_s(flown_s) {
            Some(omega_rad_s) => omega_rad_s,
            None => match (self.mission.get(next), self.after) {
                (Some(&goal), _) => pose.steer(goal, self.model.omega_max_rad_s, self.dtau_s),
                (None, AfterLastWaypoint::Pursue) => {
                    let last = *self.mission.last().unwrap_or(&pose.at);
                    pose.steer(last, self.model.omega_max_rad_s, self.dtau_s)
                }
                (None, AfterLastWaypoint::Straight) => 0.0,
            },
        }
    }

    /// Returns the way-point after those that are done with at a pose, which is one step after the pose `before`.
    // Inlined for the same reason as `is_done`.
    #[inline(always)]
    pub fn next_way_point(&self, (before, pose): (Pose2, Pose2), mut next: usize) -> usize {
        let radius_m = self.model.turn_radius_m();
        let step_m = self.model.v_m_s * self.dtau_s;
        while let Some(&goal) = self.mission.get(next) {
            let is_done = self.passing.is_done((before, pose), goal, radius_m, step_m)
                || (self.passing.passes_abeam && has_abeam_behind(self.mission, next, pose));
            if !is_done {
                break;
            }
            next += 1;
        }
        next
    }

    /// Predicts `timing.horizon` points of a turn from `pose` toward way-point `next`.
    pub fn predict(
        &self,
        turn: TurnAction,
        pose: Pose2,
        next: usize,
        timing: &TimeDiscretization,
    ) -> Prediction {
        self.predict_at_speeds(turn, SteadyChange::constant(self.model.v_m_s), (pose, next), timing)
    }

    /// Predicts the same at airspeeds that change, from a pose toward a way-point by its number.
    pub(super) fn predict_at_speeds(
        &self,
        turn: TurnAction,
        speeds: SteadyChange,
        (pose, mut next): (Pose2, usize),
        timing: &TimeDiscretization,
    ) -> Prediction {
        let mut points = Vec::with_capacity(timing.horizon);
        let mut flight = PredictionState::new(pose);
        // If it does not arrive within the horizon, all points count.
        let mut counted = timing.horizon;
        for k in 0..timing.horizon {
            let flown_s = k as f64 * self.dtau_s;
            let v_m_s = if speeds.from == speeds.to {
                speeds.to
            } else {
                0.5 * (speeds.after(flown_s) + speeds.after(flown_s + self.dtau_s))
            };
            let before = flight.pose;
            let goal = self.mission.get(next).filter(|_| turn.turn_rate_rad_s(flown_s).is_none());
            if self.after == AfterLastWaypoint::Pursue {
                // An airplane that returns to its last way-point turns to the side that rounding
                // decides, so the rounding must be that of the motion itself.
                let omega = self.omega_rad_s(turn, flight.pose, next, flown_s);
                flight.pose = flight.pose.step(v_m_s, omega, self.dtau_s);
            } else if goal.is_some_and(|&g| flight.is_heading_for(g)) {
                // Most steps are such, and straight on needs no arctangent.
                flight.step(v_m_s, 0.0, self.dtau_s);
            } else {
                let omega = self.omega_rad_s(turn, flight.pose, next, flown_s);
                flight.step(v_m_s, omega, self.dtau_s);
            }
            points.push(flight.pose.at);
            if next < self.mission.len() {
                next = self.next_way_point((before, flight.pose), next);
                if next == self.mission.len() {
                    counted = k + 1;
                }
            }
        }
        Prediction { points, counted }
    }
}

#[cfg(test)]
mod tests {
    use super::super::action::{DetourAlternatives, actions};
    use super::super::change::ChangeAlternatives;
    use super::*;
    use proptest::prelude::*;

    fn model() -> AircraftModel {
        AircraftModel {
            v_m_s: 35.0,
            omega_max_rad_s: 4f64.to_radians(),
            separation_m: 500.0,
            turns: 5,
        }
    }

    /// Returns the number of way-points that are done with at a pose, on the way to number `next`.
    fn done_abeam(mission: &[Point], next: usize, pose: Pose2) -> usize {
        let model = model();
        let passing = WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: true };
        let after = AfterLastWaypoint::Straight;
        let pilot = Autopilot { model: &model, mission, passing, after, dtau_s: 1.0 };
        pilot.next_way_point((pose, pose), next)
    }

    #[test]
    fn a_way_point_that_is_abeam_is_passed_however_far_away_unless_it_is_the_last() {
        let route = [[9e3, 0.0], [18e3, 0.0], [27e3, 0.0]];
        let east = |x: f64| Pose2 { at: [x, 7e3], heading_rad: 0.0 };
        let south = |x: f64| Pose2 { at: [x, 7e3], heading_rad: -1.5 };
        assert_eq!([8.9e3, 9.1e3].map(|x| done_abeam(&route, 0, east(x))), [0, 1]);
        assert_eq!(done_abeam(&route, 0, south(9.1e3)), 0, "it still has the first one ahead");
        assert_eq!([17.9e3, 18.1e3].map(|x| done_abeam(&route, 1, east(x))), [1, 2]);
        assert_eq!(done_abeam(&route, 0, east(18.1e3)), 2, "it has passed two");
        assert_eq!(done_abeam(&route, 2, east(40e3)), 2, "it flies back to the last one");
    }

    /// On the way out it is nearer to the place to which the route comes back, and has turned away.
    #[test]
    fn a_way_point_from_which_the_route_comes_back_is_not_passed_on_the_way_there() {
        let route = [[0.0, 0.0], [30e3, 0.0], [0.0, 5e3], [-9e3, 5e3]];
        let aside = Pose2 { at: [8e3, 4e3], heading_rad: 2.0 };
        assert_eq!(done_abeam(&route, 1, aside), 1);
        // A heading for good is a way-point without a leg.
        assert_eq!(done_abeam(&[[1e12, 0.0]; 3], 1, aside), 1);
    }

    #[test]
    fn a_way_point_given_twice_is_passed_abeam_like_one_given_once() {
        let route = [[9e3, 0.0], [18e3, 0.0], [18e3, 0.0], [18e3, 0.0], [27e3, 0.0]];
        let east = |x: f64| Pose2 { at: [x, 7e3], heading_rad: 0.0 };
        for next in 1..=3 {
            assert_eq!(done_abeam(&route, next, east(17.9e3)), next);
            assert_eq!(done_abeam(&route, next, east(18.1e3)), 4);
        }
    }

    proptest! {
        #[test]
        fn two_half_steps_are_one_step(
            x in -1e4f64..1e4, heading_rad in -3.0f64..3.0, omega in -0.1f64..0.1, dtau_s in 0.1f64..5.0,
        ) {
            let pose = Pose2 { at: [x, -x], heading_rad };
            let once = pose.step(35.0, omega, dtau_s);
            let twice = pose.step(35.0, omega, dtau_s / 2.0).step(35.0, omega, dtau_s / 2.0);
            prop_assert!(distance_m(once.at, twice.at) < 1e-8);
            prop_assert!((once.heading_rad - twice.heading_rad).abs() < 1e-12);
        }

        /// A prediction equals the motion, step by step.
        #[test]
        fn a_predicted_way_is_the_one_that_is_flown(
            heading_rad in -3.2f64..3.2, x in -6000.0f64..6000.0, y in -6000.0f64..6000.0, which in 0usize..36,
        ) {
            let model = model();
            let mission = [[x, y], [-y, x]];
            let pilot = Autopilot {
                model: &model,
                mission: &mission,
                passing: WaypointRule { tolerance_m: 100.0, passes: true, passes_abeam: false },
                after: AfterLastWaypoint::Straight,
                dtau_s: 1.0,
            };
            let timing = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 200 };
            let some = DetourAlternatives { turns_s: vec![5.0, 15.0], until_s: vec![20.0, 60.0] };
            let none = ChangeAlternatives::default();
            let held = actions(&model, 5.0, &[30.0], &DetourAlternatives::default(), &none);
            let all = [held, actions(&model, 5.0, &[], &some, &none)].concat();
            let turn = all[which % all.len()].turn;
            let (mut pose, mut next) = (Pose2 { at: [0.0, 0.0], heading_rad }, 0);
            let predicted = pilot.predict(turn, pose, next, &timing);
            for (k, point) in predicted.points.iter().enumerate() {
                let omega = pilot.omega_rad_s(turn, pose, next, k as f64);
                let before = pose;
                pose = before.step(model.v_m_s, omega, 1.0);
                next = pilot.next_way_point((before, pose), next);
                prop_assert!(distance_m(*point, pose.at) < 1e-6, "step {k}");
            }
        }

        /// Wherever a way-point lies, an airplane that proceeds is done with it before long.
        #[test]
        fn nobody_orbits_a_way_point_for_ever(
            heading_rad in -3.2f64..3.2, x in -3000.0f64..3000.0, y in -3000.0f64..3000.0,
            tolerance_m in 1.0f64..100.0,
        ) {
            let model = model();
            let mission = [[x, y]];
            let pilot = Autopilot {
                model: &model,
                mission: &mission,
                passing: WaypointRule { tolerance_m, passes: true, passes_abeam: false },
                after: AfterLastWaypoint::Straight,
                dtau_s: 1.0,
            };
            let pose = Pose2 { at: [0.0, 0.0], heading_rad };
            let timing = TimeDiscretization { dt_s: 5.0, dtau_s: 1.0, horizon: 400 };
            let flown = pilot.predict(TurnAction::Proceed, pose, 0, &timing);
            prop_assert!(flown.counted < 400, "still flying to {mission:?}");
            // It ends within the tolerance, or where it was about as near as it ever was.
            let apart_m = |k: usize| distance_m(flown.points[k], mission[0]);
            let last = flown.counted - 1;
            let nearest_m = (0..=last).map(apart_m).fold(f64::INFINITY, f64::min);
            prop_assert!(apart_m(last) < tolerance_m || apart_m(last) < nearest_m + 35.0);
        }

        /// The same for airplanes that turn as fast as scenarios allow, in steps of all lengths.
        #[test]
        fn nobody_orbits_a_way_point_for_ever_however_fast_it_turns(
            heading_rad in -3.2f64..3.2, x in -300.0f64..300.0, y in -300.0f64..300.0,
            v_m_s in 5.0f64..40.0, omega_deg_s in 20.0f64..360.0, tolerance_m in 0.001f64..3.0,
            dtau_s in prop::sample::select(vec![0.1, 0.25, 0.5, 1.0, 2.0, 5.0]),
        ) {
            let omega_max_rad_s = omega_deg_s.to_radians();
            let model = AircraftModel { v_m_s, omega_max_rad_s, ..model() };
            let mission = [[x, y]];
            let passing = WaypointRule { tolerance_m, passes: true, passes_abeam: false };
            let pilot = Autopilot { model: &model, mission: &mission, passing, after: AfterLastWaypoint::Straight, dtau_s };
            let pose = Pose2 { at: [0.0, 0.0], heading_rad };
            let timing = TimeDiscretization { dt_s: 5.0, dtau_s, horizon: (200.0 / dtau_s) as usize };
            let flown = pilot.predict(TurnAction::Proceed, pose, 0, &timing);
            prop_assert!(flown.counted < timing.horizon, "still flying to {mission:?}");
            let end = flown.points[flown.counted - 1];
            let near_m = tolerance_m.max(2.0 * model.turn_radius_m()).max(2.0 * v_m_s * dtau_s);
            prop_assert!(distance_m(end, mission[0]) < near_m, "{end:?} is not {mission:?}");
        }
    }
}
