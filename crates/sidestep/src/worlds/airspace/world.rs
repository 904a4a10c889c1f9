//! A compiled airspace: everything that never changes during a run.

use super::airplane::{Action, After, Legs, Model, Passing, Pilot, Point, Pose, Timing, actions};
use super::deploy::Deployment;
use super::objective::Objective;
use crate::collectives::Settings;
use serde::{Deserialize, Serialize};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, Slot};

/// What random draws of this world are for.
pub mod purpose {
    use sidestep_kernel::stream::Purpose;

    /// Where generated airplanes begin and go.
    pub const PLACE: Purpose = Purpose(1);
    /// Samples of the optimizer, one stream per airplane and cycle.
    pub const SAMPLE: Purpose = Purpose(2);
    /// Errors of known positions.
    pub const POSITION: Purpose = Purpose(3);
    /// Disturbed headings.
    pub const HEADING: Purpose = Purpose(4);
}

/// How airplanes choose what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Probability collectives.
    #[default]
    Pc,
    /// Optimal reciprocal collision avoidance.
    Orca,
    /// Modified voltage potential.
    Mvp,
    /// Straight to the way-point, whoever is there.
    None,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Pc, Self::Orca, Self::Mvp, Self::None];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pc => "pc",
            Self::Orca => "orca",
            Self::Mvp => "mvp",
            Self::None => "none",
        }
    }
}

/// What the optimizer is not told.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Disturbance {
    /// Standard deviation of known positions, per coordinate.
    pub position_m: f64,
    /// Standard deviation of the heading's change per `dt` that nobody wanted.
    pub heading_rad: f64,
}

/// One airplane as it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Airplane {
    /// What it can do.
    pub model: Model,
    /// Where it begins.
    pub start: Pose,
    /// What it is to reach.
    pub mission: Vec<Point>,
    /// The level it keeps.
    pub altitude_m: f64,
    /// When it appears, seconds after the start.
    pub appears_s: f64,
}

/// The immutable world that runs share.
#[derive(Debug, Clone)]
pub struct AirspaceWorld {
    /// The airplanes by id.
    pub airplanes: Vec<Airplane>,
    /// How time is cut.
    pub timing: Timing,
    /// When way-points count as reached.
    pub passing: Passing,
    /// What is optimized,
    pub objective: Objective,
    /// and how.
    pub settings: Settings,
    /// Further hold times of actions.
    pub holds_s: Vec<f64>,
    /// Legs to the sides, which take the place of held turns.
    pub legs: Legs,
    /// Who decides.
    pub method: Method,
    /// Where the optimizer runs.
    pub deployment: Deployment,
    /// Whether the shield filters decisions.
    pub shield: bool,
    /// Airplanes at least this far above each other do not mind each other.
    pub vertical_m: f64,
    /// A wind that all know.
    pub wind_m_s: Point,
    /// What nobody knows.
    pub disturbance: Disturbance,
    pub(super) streams: Streams,
    /// Actions of each airplane.
    pub(super) actions: Vec<Vec<Action>>,
    /// Seconds that each airplane would need alone.
    pub(super) alone_s: Vec<f64>,
}

/// A flight alone that takes longer than this many steps is not expected to end.
const ENDLESS_STEPS: usize = 1_000_000;

impl AirspaceWorld {
    /// The `k`-th uniform number in [0, 1) of an airplane's samples in a cycle.
    pub(super) fn uniform(&self, slot: Slot, now: Cycle, k: u64) -> f64 {
        let words = self.streams.block(slot, now, purpose::SAMPLE, (k / 4) as u16);
        f64::from(words[(k % 4) as usize]) / 4_294_967_296.0
    }

    /// Prepares what follows from the fields.
    #[must_use]
    pub(super) fn prepared(mut self) -> Self {
        let of = |a: &Airplane| actions(&a.model, self.timing.dt_s, &self.holds_s, &self.legs);
        self.actions = self.airplanes.iter().map(of).collect();
        self.alone_s = (0..self.airplanes.len()).map(|i| self.alone_s(i)).collect();
        self
    }

    /// How airplane `i` flies through still air. In a wind, predictions are made in the moving
    /// air, towards way-points that drift; what is flown is flown over the ground, see
    /// [`AirspaceWorld::steer`] and [`AirspaceWorld::blown`].
    pub(super) fn pilot<'a>(&'a self, i: usize, mission: &'a [Point]) -> Pilot<'a> {
        Pilot {
            model: &self.airplanes[i].model,
            mission,
            passing: self.passing,
            after: After::Straight,
            dtau_s: self.timing.dtau_s,
        }
    }

    fn alone_s(&self, i: usize) -> f64 {
        let airplane = &self.airplanes[i];
        let (mut pose, mut next) = (airplane.start, 0);
        for step in 0..ENDLESS_STEPS {
            if next == airplane.mission.len() {
                return step as f64 * self.timing.dtau_s;
            }
            let pilot = self.pilot(i, &airplane.mission);
            let omega = self.steer(&pilot, pose, next);
            pose = self.blown(pose.step(airplane.model.v_m_s, omega, self.timing.dtau_s));
            next = pilot.next(pose, next);
        }
        f64::INFINITY
    }

    /// The turn rate that leads to way-point `next` on the ground, wind allowed for.
    pub(super) fn steer(&self, pilot: &Pilot<'_>, pose: Pose, next: usize) -> f64 {
        let Some(&goal) = pilot.mission.get(next) else { return 0.0 };
        let omega_max = pilot.model.omega_max_rad_s;
        pose.steer(self.aim(pose.at, goal, pilot.model.v_m_s), omega_max, pilot.dtau_s)
    }

    /// Where to head from `at` to come to `goal` on the ground: against the wind by the angle at
    /// which the airspeed cancels the wind's part across the way.
    pub(super) fn aim(&self, at: Point, goal: Point, v_m_s: f64) -> Point {
        let [wx, wy] = self.wind_m_s;
        if wx == 0.0 && wy == 0.0 {
            return goal;
        }
        let (dx, dy) = (goal[0] - at[0], goal[1] - at[1]);
        let length_m = sidestep_kernel::math::hypot(dx, dy).max(1e-9);
        let (ux, uy) = (dx / length_m, dy / length_m);
        let across = (wx * uy - wy * ux).clamp(-v_m_s, v_m_s);
        let along = (v_m_s * v_m_s - across * across).sqrt();
        // Along the way by `along`, against the crosswind by `across`.
        let heading = [ux * along - uy * across, uy * along + ux * across];
        [at[0] + heading[0], at[1] + heading[1]]
    }

    /// A pose after the wind has blown for one step.
    pub(super) fn blown(&self, pose: Pose) -> Pose {
        let dtau_s = self.timing.dtau_s;
        let at = [pose.at[0] + self.wind_m_s[0] * dtau_s, pose.at[1] + self.wind_m_s[1] * dtau_s];
        Pose { at, ..pose }
    }

    /// The cycle in which an airplane appears.
    pub fn appears_in(&self, i: usize) -> Cycle {
        (self.airplanes[i].appears_s / self.timing.dt_s).ceil() as Cycle
    }

    /// Whether two airplanes are on levels so near that they have to mind each other.
    pub fn on_one_level(&self, a: Slot, b: Slot) -> bool {
        let altitude_m = |slot: Slot| self.airplanes[slot as usize].altitude_m;
        (altitude_m(a) - altitude_m(b)).abs() < self.vertical_m
    }

    /// How far apart two airplanes may be and still have to mind each other: they could come
    /// too near within the horizon, or on orbits after the next `dt`.
    pub fn look_m(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (&self.airplanes[a].model, &self.airplanes[b].model);
        let horizon_s = self.timing.horizon as f64 * self.timing.dtau_s;
        let reach = |model: &Model| {
            let orbit_m = model.v_m_s * self.timing.dt_s + 2.0 * model.turn_radius_m();
            (model.v_m_s * horizon_s).max(orbit_m)
        };
        let gap_m = a.separation_m.max(b.separation_m) * self.objective.inflation.max(1.0);
        reach(a) + reach(b) + gap_m + 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenario::Compiled;
    use crate::scenario::Source;

    #[test]
    fn against_any_wind_an_airplane_tracks_its_way() {
        for wind in [[10.0, 0.0], [0.0, 10.0], [-7.0, 7.0]] {
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\n\
                 [[airplanes]]\nat_m = [0, 0]\nheading_deg = 90\nway_points_m = [[0, 9000]]\n"
            );
            let world = Compiled::new(&Source::new("w", text, "")).expect("a scenario").world;
            let along = 35f64 * 35.0 - wind[0] * wind[0];
            let expected_s = 8900.0 / (along.sqrt() + wind[1]);
            assert!((world.alone_s[0] - expected_s).abs() < 12.0, "{wind:?}: {}", world.alone_s[0]);
        }
    }
}
