//! Airplanes: how they move, what they are to reach, what they may do, where that leads.
//!
//! Plane metres, x east and y north; headings in radians, counter-clockwise from east; a
//! positive turn rate turns left. Source: section 3 of the paper; the step is exact.

use serde::{Deserialize, Serialize};
use sidestep_kernel::math;

/// A point of the plane, metres.
pub type Point = [f64; 2];

/// Distance of two points in metres.
#[inline]
pub fn distance_m(a: Point, b: Point) -> f64 {
    math::hypot(a[0] - b[0], a[1] - b[1])
}

/// What an airplane can do and must keep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Airspeed, constant.
    pub v_m_s: f64,
    /// Largest rate of turn.
    pub omega_max_rad_s: f64,
    /// Nobody else should come nearer than this.
    pub separation_m: f64,
    /// Number of evenly spaced turn rates, odd and at least 3.
    pub turns: usize,
}

impl Model {
    /// Radius of the tightest turn.
    pub fn turn_radius_m(&self) -> f64 {
        self.v_m_s / self.omega_max_rad_s
    }
}

/// Where an airplane is and where it heads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position.
    pub at: Point,
    /// Heading.
    pub psi_rad: f64,
}

impl Pose {
    /// The pose after `dtau_s` seconds at the turn rate `omega_rad_s`: exactly, in chord form,
    /// which stays exact as the turn rate goes to 0.
    #[inline]
    pub fn step(self, v_m_s: f64, omega_rad_s: f64, dtau_s: f64) -> Self {
        let half = 0.5 * omega_rad_s * dtau_s;
        let chord = v_m_s * dtau_s * sinc(half);
        let along = self.psi_rad + half;
        Self {
            at: [self.at[0] + chord * math::cos(along), self.at[1] + chord * math::sin(along)],
            psi_rad: self.psi_rad + omega_rad_s * dtau_s,
        }
    }

    /// The turn rate that would head for `goal` after `dtau_s`, within the limits.
    #[inline]
    pub fn steer(self, goal: Point, omega_max_rad_s: f64, dtau_s: f64) -> f64 {
        let bearing = math::atan2(goal[1] - self.at[1], goal[0] - self.at[0]);
        let wanted = math::wrap_angle(bearing - self.psi_rad) / dtau_s;
        wanted.clamp(-omega_max_rad_s, omega_max_rad_s)
    }
}

/// sin(a) / a.
#[inline]
fn sinc(a: f64) -> f64 {
    if a.abs() < 1e-4 { 1.0 - a * a / 6.0 } else { math::sin(a) / a }
}

/// How time is cut and when a way-point counts as reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Time between two optimizations.
    pub dt_s: f64,
    /// Time between two points of a prediction; divides `dt_s`.
    pub dtau_s: f64,
    /// Points of a prediction.
    pub horizon: usize,
}

impl Timing {
    /// Points of a prediction within one `dt_s`.
    pub fn points_per_dt(&self) -> usize {
        (self.dt_s / self.dtau_s).round() as usize
    }
}

/// What an airplane does after its last way-point, in predictions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum After {
    /// Flies straight on.
    #[default]
    Straight,
    /// Goes on steering for the last way-point.
    Pursue,
}

/// When an airplane has done with a way-point.
///
/// It is reached within a tolerance. But an airplane whose way-point lies inside one of its two
/// tightest turning circles would orbit it for ever: steering for it keeps the airplane on that
/// circle. Such a way-point counts as *passed* when it is abeam on the near side: within one turn
/// round the circle that is so, and there the airplane is as near as it comes without flying away
/// first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Passing {
    /// A way-point nearer than this is reached.
    pub tolerance_m: f64,
    /// Whether a way-point inside a turning circle can be passed.
    pub passes: bool,
}

impl Passing {
    /// Whether an airplane at `pose` has done with the way-point `goal`; its tightest turn has
    /// this radius, and it flies `step_m` from one look to the next.
    #[inline]
    pub fn is_done(&self, pose: Pose, goal: Point, radius_m: f64, step_m: f64) -> bool {
        let (dx, dy) = (goal[0] - pose.at[0], goal[1] - pose.at[1]);
        let square = dx * dx + dy * dy;
        if square < self.tolerance_m * self.tolerance_m {
            return true;
        }
        // No point farther than a diameter lies in a turning circle.
        if !self.passes || square >= 4.0 * radius_m * radius_m {
            return false;
        }
        // The circles' centres are a radius to the left and right: the goal is inside when its
        // distance to the nearer centre is below the radius.
        let (sin, cos) = (math::sin(pose.psi_rad), math::cos(pose.psi_rad));
        let (ahead, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let is_inside = square < 2.0 * radius_m * left.abs();
        // Abeam since the last look: on a circle, ahead changes by less than a step per step.
        is_inside && left.abs() < radius_m && (-step_m..=0.0).contains(&ahead)
    }
}

/// An action: a turn rate, held for some time, and then proceeding to the way-point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Action {
    /// The turn rate, for the whole horizon (the paper's g = 0).
    Hold {
        /// Turn rate.
        omega_rad_s: f64,
    },
    /// The turn rate for `hold_s` (the paper's g = 1 has dt) and then proceed.
    Then {
        /// Turn rate.
        omega_rad_s: f64,
        /// How long it is held.
        hold_s: f64,
    },
    /// The turn rate, then straight on, and then proceed: a leg to one side.
    Leg {
        /// Turn rate.
        omega_rad_s: f64,
        /// How long it is turned.
        turn_s: f64,
        /// When the leg ends, from the start of the turn.
        until_s: f64,
    },
    /// Proceed from the start: the optimal action.
    Proceed,
}

impl Action {
    /// The turn rate that the action asks for after `flown_s` seconds of it, if it does not
    /// proceed to the way-point by then.
    #[inline]
    pub fn held_rad_s(self, flown_s: f64) -> Option<f64> {
        // Rounding of step times must not decide.
        let before = |end_s: f64| flown_s < end_s - 1e-9;
        match self {
            Self::Hold { omega_rad_s } => Some(omega_rad_s),
            Self::Then { omega_rad_s, hold_s } => before(hold_s).then_some(omega_rad_s),
            Self::Leg { omega_rad_s, turn_s, .. } if before(turn_s) => Some(omega_rad_s),
            Self::Leg { until_s, .. } => before(until_s).then_some(0.0),
            Self::Proceed => None,
        }
    }
}

/// Ways around others: a turn, a straight leg, and then proceeding.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Legs {
    /// How long the turns may last.
    pub turns_s: Vec<f64>,
    /// When the legs may end, from the start of the turn.
    pub until_s: Vec<f64>,
}

impl Legs {
    /// Those of the default preset: heading changes of 10 to 60 degrees at the paper's turn
    /// rates, held for as long as most conflicts take to pass.
    pub fn usual() -> Self {
        Self { turns_s: vec![5.0, 10.0, 15.0], until_s: vec![60.0] }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.turns_s.is_empty() || self.until_s.is_empty()
    }

    /// Those that begin at a turn rate; straight on, how long one turns makes no difference.
    fn of(&self, omega_rad_s: f64) -> Vec<Action> {
        let straight = |&hold_s: &f64| Action::Then { omega_rad_s: 0.0, hold_s };
        if omega_rad_s == 0.0 {
            return self.until_s.iter().map(straight).collect();
        }
        let leg = |(&turn_s, &until_s): (&f64, &f64)| Action::Leg { omega_rad_s, turn_s, until_s };
        self.turns_s
            .iter()
            .flat_map(|turn_s| self.until_s.iter().map(move |until_s| leg((turn_s, until_s))))
            .collect()
    }
}

/// The action set of a model, ordered by turn rate, the optimal one last. Without legs it is the
/// paper's: `2 m + 1` actions, every rate held for ever and for `dt_s`. With legs, which never
/// begin a turn only to undo it, these take the place of the held turns; straight on for ever
/// remains. `holds_s` are further times for which turns are held.
pub fn actions(model: &Model, dt_s: f64, holds_s: &[f64], legs: &Legs) -> Vec<Action> {
    let m = model.turns;
    let rate = |k: usize| match 2.0 * k as f64 / (m - 1) as f64 - 1.0 {
        // The middle one is exactly straight.
        _ if 2 * k + 1 == m => 0.0,
        part => part * model.omega_max_rad_s,
    };
    let mut all = Vec::new();
    for omega_rad_s in (0..m).map(rate) {
        if legs.is_empty() || omega_rad_s == 0.0 {
            all.push(Action::Hold { omega_rad_s });
        }
        if legs.is_empty() {
            all.push(Action::Then { omega_rad_s, hold_s: dt_s });
        }
        all.extend(holds_s.iter().map(|&hold_s| Action::Then { omega_rad_s, hold_s }));
        all.extend(legs.of(omega_rad_s));
    }
    all.push(Action::Proceed);
    all
}

/// Where an action leads.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Prediction {
    /// Positions after 1, 2, ... steps of `dtau`.
    pub points: Vec<Point>,
    /// How many points count against others: those up to arrival at the last way-point.
    pub counted: usize,
}

/// An airplane on a predicted way: a pose, and what saves computing its sine and cosine anew in
/// every step. Equal to [`Pose::step`] but for rounding (a test holds them together).
#[derive(Debug, Clone, Copy)]
struct Flight {
    pose: Pose,
    /// Cosine and sine of the heading.
    along: Point,
    /// The turn rate of the last step and, for half of its turn, cosine, sine and sinc.
    omega_rad_s: f64,
    half_turn: [f64; 3],
}

impl Flight {
    fn new(pose: Pose) -> Self {
        let along = [math::cos(pose.psi_rad), math::sin(pose.psi_rad)];
        Self { pose, along, omega_rad_s: 0.0, half_turn: [1.0, 0.0, 1.0] }
    }

    /// Whether the goal lies dead ahead, so that steering for it changes nothing any more.
    #[inline]
    fn heads_for(&self, goal: Point) -> bool {
        let [dx, dy] = [goal[0] - self.pose.at[0], goal[1] - self.pose.at[1]];
        let [c, s] = self.along;
        let (ahead, across) = (dx * c + dy * s, dy * c - dx * s);
        ahead > 0.0 && across.abs() <= 1e-12 * ahead
    }

    #[inline]
    fn step(&mut self, v_m_s: f64, omega_rad_s: f64, dtau_s: f64) {
        if omega_rad_s != self.omega_rad_s {
            let half = 0.5 * omega_rad_s * dtau_s;
            self.omega_rad_s = omega_rad_s;
            self.half_turn = match omega_rad_s {
                0.0 => [1.0, 0.0, 1.0],
                _ => [math::cos(half), math::sin(half), sinc(half)],
            };
        }
        let [c, s, sinc] = self.half_turn;
        let turned = |[x, y]: Point| [x * c - y * s, x * s + y * c];
        let chord_m = v_m_s * dtau_s * sinc;
        let middle = turned(self.along);
        self.along = turned(middle);
        self.pose = Pose {
            at: [self.pose.at[0] + chord_m * middle[0], self.pose.at[1] + chord_m * middle[1]],
            psi_rad: self.pose.psi_rad + omega_rad_s * dtau_s,
        };
    }
}

/// Flies step by step: an action, the way-points, what comes after the last.
#[derive(Debug, Clone, Copy)]
pub struct Pilot<'a> {
    /// The airplane's model.
    pub model: &'a Model,
    /// Its way-points.
    pub mission: &'a [Point],
    /// When way-points count as reached.
    pub passing: Passing,
    /// What comes after the last.
    pub after: After,
    /// Seconds per step.
    pub dtau_s: f64,
}

impl Pilot<'_> {
    /// The turn rate of an action in the step that begins after `flown_s` seconds of it.
    #[inline]
    pub fn omega_rad_s(&self, action: Action, pose: Pose, next: usize, flown_s: f64) -> f64 {
        match action.held_rad_s(flown_s) {
            Some(omega_rad_s) => omega_rad_s,
            None => match (self.mission.get(next), self.after) {
                (Some(&goal), _) => pose.steer(goal, self.model.omega_max_rad_s, self.dtau_s),
                (None, After::Pursue) => {
                    let last = *self.mission.last().unwrap_or(&pose.at);
                    pose.steer(last, self.model.omega_max_rad_s, self.dtau_s)
                }
                (None, After::Straight) => 0.0,
            },
        }
    }

    /// The way-point after those that are done with at `pose`.
    #[inline]
    pub fn next(&self, pose: Pose, mut next: usize) -> usize {
        let (radius_m, step_m) = (self.model.turn_radius_m(), self.model.v_m_s * self.dtau_s);
        while let Some(&goal) = self.mission.get(next) {
            if !self.passing.is_done(pose, goal, radius_m, step_m) {
                break;
            }
            next += 1;
        }
        next
    }

    /// Predicts `timing.horizon` points of an action from `pose` towards way-point `next`.
    pub fn predict(&self, action: Action, pose: Pose, next: usize, timing: &Timing) -> Prediction {
        let mut points = Vec::with_capacity(timing.horizon);
        let (mut flight, mut next, mut counted) = (Flight::new(pose), next, timing.horizon);
        for k in 0..timing.horizon {
            let flown_s = k as f64 * self.dtau_s;
            let goal = self.mission.get(next).filter(|_| action.held_rad_s(flown_s).is_none());
            if self.after == After::Pursue {
                // One that comes back to its last way-point turns to the side that rounding
                // says, so it must be the rounding of the motion itself.
                let omega = self.omega_rad_s(action, flight.pose, next, flown_s);
                flight.pose = flight.pose.step(self.model.v_m_s, omega, self.dtau_s);
            } else if goal.is_some_and(|&g| flight.heads_for(g)) {
                flight.step(self.model.v_m_s, 0.0, self.dtau_s);
            } else {
                let omega = self.omega_rad_s(action, flight.pose, next, flown_s);
                flight.step(self.model.v_m_s, omega, self.dtau_s);
            }
            points.push(flight.pose.at);
            if next < self.mission.len() {
                next = self.next(flight.pose, next);
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
    use super::*;
    use proptest::prelude::*;

    fn model() -> Model {
        Model { v_m_s: 35.0, omega_max_rad_s: 4f64.to_radians(), separation_m: 500.0, turns: 5 }
    }

    proptest! {
        #[test]
        fn two_half_steps_are_one_step(
            x in -1e4f64..1e4, psi_rad in -3.0f64..3.0, omega in -0.1f64..0.1, dtau_s in 0.1f64..5.0,
        ) {
            let pose = Pose { at: [x, -x], psi_rad };
            let once = pose.step(35.0, omega, dtau_s);
            let twice = pose.step(35.0, omega, dtau_s / 2.0).step(35.0, omega, dtau_s / 2.0);
            prop_assert!(distance_m(once.at, twice.at) < 1e-8);
            prop_assert!((once.psi_rad - twice.psi_rad).abs() < 1e-12);
        }

        /// The prediction is the motion, step by step.
        #[test]
        fn a_predicted_way_is_the_one_that_is_flown(
            psi_rad in -3.2f64..3.2, x in -6000.0f64..6000.0, y in -6000.0f64..6000.0, which in 0usize..36,
        ) {
            let model = model();
            let mission = [[x, y], [-y, x]];
            let pilot = Pilot {
                model: &model,
                mission: &mission,
                passing: Passing { tolerance_m: 100.0, passes: true },
                after: After::Straight,
                dtau_s: 1.0,
            };
            let timing = Timing { dt_s: 5.0, dtau_s: 1.0, horizon: 200 };
            let some = Legs { turns_s: vec![5.0, 15.0], until_s: vec![20.0, 60.0] };
            let held = actions(&model, 5.0, &[30.0], &Legs::default());
            let all = [held, actions(&model, 5.0, &[], &some)].concat();
            let action = all[which % all.len()];
            let (mut pose, mut next) = (Pose { at: [0.0, 0.0], psi_rad }, 0);
            let predicted = pilot.predict(action, pose, next, &timing);
            for (k, point) in predicted.points.iter().enumerate() {
                let omega = pilot.omega_rad_s(action, pose, next, k as f64);
                pose = pose.step(model.v_m_s, omega, 1.0);
                next = pilot.next(pose, next);
                prop_assert!(distance_m(*point, pose.at) < 1e-6, "step {k}");
            }
        }

        /// Wherever a way-point lies, an airplane that proceeds has done with it before long.
        #[test]
        fn nobody_orbits_a_way_point_for_ever(
            psi_rad in -3.2f64..3.2, x in -3000.0f64..3000.0, y in -3000.0f64..3000.0,
            tolerance_m in 1.0f64..100.0,
        ) {
            let model = model();
            let mission = [[x, y]];
            let pilot = Pilot {
                model: &model,
                mission: &mission,
                passing: Passing { tolerance_m, passes: true },
                after: After::Straight,
                dtau_s: 1.0,
            };
            let pose = Pose { at: [0.0, 0.0], psi_rad };
            let timing = Timing { dt_s: 5.0, dtau_s: 1.0, horizon: 400 };
            let flown = pilot.predict(Action::Proceed, pose, 0, &timing);
            prop_assert!(flown.counted < 400, "still flying to {mission:?}");
            // It ends within the tolerance, or where it was about as near as it came at all.
            let apart_m = |k: usize| distance_m(flown.points[k], mission[0]);
            let last = flown.counted - 1;
            let nearest_m = (0..=last).map(apart_m).fold(f64::INFINITY, f64::min);
            prop_assert!(apart_m(last) < tolerance_m || apart_m(last) < nearest_m + 35.0);
        }
    }

    #[test]
    fn the_action_set_is_ordered_and_contains_straight_flight() {
        let all = actions(&model(), 5.0, &[30.0], &Legs::default());
        assert_eq!(all.len(), 5 * 3 + 1);
        assert_eq!(all[6], Action::Hold { omega_rad_s: 0.0 });
        assert_eq!(all[8], Action::Then { omega_rad_s: 0.0, hold_s: 30.0 });
        assert_eq!(all[15], Action::Proceed);
    }

    #[test]
    fn legs_take_the_place_of_turns_that_are_undone() {
        let legs = Legs { turns_s: vec![5.0, 15.0], until_s: vec![60.0] };
        let all = actions(&model(), 5.0, &[], &legs);
        let omega_rad_s = -4f64.to_radians();
        assert_eq!(all.len(), 4 * 2 + 2 + 1);
        assert_eq!(all[1], Action::Leg { omega_rad_s, turn_s: 15.0, until_s: 60.0 });
        assert_eq!(all[4], Action::Hold { omega_rad_s: 0.0 });
        assert_eq!(all[5], Action::Then { omega_rad_s: 0.0, hold_s: 60.0 });
        assert_eq!(all[10], Action::Proceed);
        let rates: Vec<_> = [0.0, 14.0, 15.0, 59.0, 60.0].map(|t| all[1].held_rad_s(t)).into();
        assert_eq!(rates, [Some(omega_rad_s), Some(omega_rad_s), Some(0.0), Some(0.0), None]);
    }
}
