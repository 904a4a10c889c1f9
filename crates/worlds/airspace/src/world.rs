//! A compiled airspace: everything that never changes during a run.

use super::airplane::{Action, After, Legs, Model, Passing, Pilot, Point, Pose, Timing, actions};
use super::deploy::{Deployment, Network};
use super::objective::Objective;
use super::orders::{FlightOrder, Later, Stage, Task, later};
use super::shield::Side;
use super::track::Track;
use serde::{Deserialize, Serialize};
use sidestep_collectives::Settings;
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
    /// What happens to messages.
    pub const NETWORK: Purpose = Purpose(5);
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
    /// The level with which the method takes it over.
    pub altitude_m: f64,
    /// When it appears, seconds after the start.
    pub appears_s: f64,
    /// When it vanishes, seconds after the start; infinite for never.
    pub leaves_s: f64,
    /// What it is told on its way, by rising time.
    pub orders: Vec<FlightOrder>,
    /// The way that it is recorded to have flown, and follows until it is handed over.
    pub track: Option<Track>,
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
    /// What its messages go over, if that is not to be relied on.
    pub network: Option<Network>,
    /// Bytes that the pair tables of a group may take; larger groups are not optimized.
    pub group_bytes: u64,
    /// Whether the shield filters decisions.
    pub shield: bool,
    /// Airplanes at least this far above each other do not mind each other: what the scenario
    /// asks for, less a hair, so that levels in feet are apart when they say they are.
    pub vertical_m: f64,
    /// Cycles in which recorded airplanes follow their tracks; after these the method flies them.
    pub replay_cycles: Cycle,
    /// A wind that all know.
    pub wind_m_s: Point,
    /// What nobody knows.
    pub disturbance: Disturbance,
    pub(super) streams: Streams,
    /// Actions of each airplane.
    pub(super) actions: Vec<Vec<Action>>,
    /// What each airplane flies after each of its orders.
    pub(super) later: Vec<Vec<Later>>,
    /// The greatest speed that each airplane flies.
    pub(super) top_m_s: Vec<f64>,
    /// Seconds that each airplane would need alone.
    pub(super) alone_s: Vec<f64>,
    /// Sides of the first fallbacks.
    pub(super) first_fallbacks: Vec<Side>,
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
        self.later = self.airplanes.iter().map(later).collect();
        self.top_m_s = (0..self.airplanes.len()).map(|i| self.top_m_s(i)).collect();
        self.alone_s = (0..self.airplanes.len()).map(|i| self.alone_s(i)).collect();
        self
    }

    fn top_m_s(&self, i: usize) -> f64 {
        let airplane = &self.airplanes[i];
        let recorded = airplane.track.as_ref().map_or(0.0, Track::top_speed_m_s);
        let told = airplane.orders.iter().filter_map(|order| match order.task {
            Task::Speed(v_m_s) => Some(v_m_s),
            _ => None,
        });
        told.fold(airplane.model.v_m_s.max(recorded), f64::max)
    }

    /// How an airplane flies through still air. In a wind, predictions are made in the moving
    /// air, towards way-points that drift; what is flown is flown over the ground, see
    /// [`AirspaceWorld::steer`] and [`AirspaceWorld::blown`].
    pub(super) fn pilot<'a>(&self, model: &'a Model, mission: &'a [Point]) -> Pilot<'a> {
        Pilot {
            model,
            mission,
            passing: self.passing,
            after: After::Straight,
            dtau_s: self.timing.dtau_s,
        }
    }

    /// From when the method takes it over; infinite where it never would come to its end.
    fn alone_s(&self, i: usize) -> f64 {
        let airplane = &self.airplanes[i];
        let joins_s = self.starts_s(self.joins_in(i));
        if airplane.track.as_ref().is_some_and(|track| track.ends_s() <= joins_s) {
            return 0.0;
        }
        let is_endless = airplane.keeps_a_heading() && airplane.leaves_s == f64::INFINITY;
        let mut pose = airplane.track.as_ref().map_or(airplane.start, |t| t.pose_at(joins_s));
        let (mut orders, mut next) = (0, 0);
        for step in 0..ENDLESS_STEPS {
            let flown_s = step as f64 * self.timing.dtau_s;
            if step % self.timing.points_per_dt() == 0 {
                (orders, next) = self.after_orders(i, orders, next, joins_s + flown_s);
            }
            let Stage { model, mission, .. } = self.stage(i as Slot, orders);
            if next == mission.len() || joins_s + flown_s >= airplane.leaves_s {
                return flown_s;
            }
            // It may come to its end before it is told to keep a heading.
            if is_endless && orders as usize == airplane.orders.len() {
                return f64::INFINITY;
            }
            let pilot = self.pilot(model, mission);
            let omega = self.steer(&pilot, pose, next);
            pose = self.blown(pose.step(model.v_m_s, omega, self.timing.dtau_s));
            next = pilot.next(pose, next);
        }
        f64::INFINITY
    }

    /// When an airplane would come to its end if it were alone, seconds after the start of the
    /// run.
    pub(super) fn ends_alone_s(&self, i: usize) -> f64 {
        let joins_s = self.starts_s(self.joins_in(i));
        match &self.airplanes[i].track {
            Some(track) if track.ends_s() <= joins_s => track.ends_s(),
            _ => joins_s + self.alone_s[i],
        }
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

    /// When a cycle starts, seconds after the start.
    pub fn starts_s(&self, now: Cycle) -> f64 {
        now as f64 * self.timing.dt_s
    }

    /// The cycle in which an airplane appears: at its start, or within it on a recorded way.
    pub fn appears_in(&self, i: usize) -> Cycle {
        let airplane = &self.airplanes[i];
        let cycles = airplane.appears_s / self.timing.dt_s;
        let is_on_track =
            airplane.track.is_some() && (cycles.floor() as Cycle) < self.replay_cycles;
        (if is_on_track { cycles.floor() } else { cycles.ceil() }) as Cycle
    }

    /// The cycle from which the method flies an airplane.
    pub fn joins_in(&self, i: usize) -> Cycle {
        let recorded = if self.airplanes[i].track.is_some() { self.replay_cycles } else { 0 };
        self.appears_in(i).max(recorded)
    }

    /// Whether an airplane follows its recorded way in a cycle.
    pub fn is_replayed(&self, slot: Slot, now: Cycle) -> bool {
        self.airplanes[slot as usize].track.is_some() && now < self.joins_in(slot as usize)
    }

    /// How far apart two airplanes may be and still have to mind each other: they could come
    /// too near within the horizon, or on orbits after the next `dt`.
    pub fn look_m(&self, a: usize, b: usize) -> f64 {
        let ((a, a_m_s), (b, b_m_s)) = (self.fastest(a), self.fastest(b));
        let horizon_s = self.timing.horizon as f64 * self.timing.dtau_s;
        let reach = |model: &Model, v_m_s: f64| {
            let orbit_m = v_m_s * self.timing.dt_s + 2.0 * (v_m_s / model.omega_max_rad_s);
            (v_m_s * horizon_s).max(orbit_m)
        };
        let gap_m = a.separation_m.max(b.separation_m) * self.objective.inflation.max(1.0);
        reach(a, a_m_s) + reach(b, b_m_s) + gap_m + 1.0
    }

    fn fastest(&self, i: usize) -> (&Model, f64) {
        (&self.airplanes[i].model, self.top_m_s[i])
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenario::Compiled;
    use proptest::prelude::*;
    use sidestep_kernel::math;
    use sidestep_scenario::Source;

    proptest! {
        /// Wherever a way-point lies and however the wind blows, flying to it ends.
        #[test]
        fn nobody_circles_in_the_wind_for_ever(
            speed in 0.0f64..30.0, from_rad in -3.2f64..3.2, x in -2000.0f64..2000.0,
            y in -2000.0f64..2000.0,
        ) {
            let wind = [speed * math::cos(from_rad), speed * math::sin(from_rad)];
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\n\
                 tolerance_m = 20.0\n\
                 [[airplanes]]\nat_m = [0, 0]\nheading_deg = 90\nway_points_m = [[{x}, {y}]]\n"
            );
            let world = Compiled::new(&Source::new("w", text, "")).expect("a scenario").world;
            prop_assert!(world.alone_s[0] < 3000.0, "{wind:?}: {}", world.alone_s[0]);
        }
    }

    #[test]
    fn an_order_after_the_arrival_makes_no_flight_endless() {
        let alone_s = |at_s: f64| {
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[[airplanes]]\nat_m = [0, 0]\n\
                 heading_deg = 0\nway_points_m = [[3500, 0]]\n\
                 orders = [{{ at_s = {at_s:?}, heading_deg = 90.0 }}]\n"
            );
            Compiled::new(&Source::new("o", text, "")).expect("a scenario").world.alone_s[0]
        };
        assert!((90.0..=100.0).contains(&alone_s(500.0)), "{}", alone_s(500.0));
        assert_eq!(alone_s(50.0), f64::INFINITY);
    }

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
