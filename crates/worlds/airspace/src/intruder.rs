//! Intruders: airplanes that mind nobody, recorded or silent, which all others must avoid.
//!
//! Others see where an intruder is, how it moves now, and how fast its kind can fly; not where it
//! wants to go. Methods take it to fly straight on. The shield knows where it can be within `dt`:
//! anywhere in a circle that grows at its greatest speed.

use crate::Turn;
use crate::flight::{Levels, Point, Pose, Prediction};
use crate::objective::Objective;
use crate::perceive::seen;
use sidestep_kernel::{Slot, math};

/// An intruder as all of a group see it.
#[derive(Debug, Clone, PartialEq)]
pub struct Intruder {
    /// The airplane.
    pub(crate) slot: Slot,
    /// Its place.
    pub(crate) at: Point,
    /// Its velocity through the air, in meters per second.
    pub(crate) velocity_m_s: Point,
    /// Its greatest speed through the air, in meters per second.
    pub(crate) top_m_s: f64,
    pub(crate) separation_m: f64,
    /// Bound in meters on how far it may be from where it is seen.
    pub(crate) error_m: f64,
    /// The levels that it can be on within `dt`.
    pub(crate) levels: Levels,
    /// Seconds of a `dt`.
    pub(crate) dt_s: f64,
}

impl Intruder {
    /// Returns the intruders of a group, by id.
    pub(crate) fn all(turn: &Turn<'_>, group: &[Slot]) -> Vec<Self> {
        let is_intruder = |slot: &&Slot| turn.world.is_intruder(**slot, turn.now);
        group.iter().filter(is_intruder).map(|&slot| Self::of(turn, slot)).collect()
    }

    fn of(turn: &Turn<'_>, slot: Slot) -> Self {
        let Turn { world, state, now, .. } = *turn;
        let (airplane, cell) = (&world.airplanes[slot as usize], &state.airplanes[slot as usize]);
        let Pose { at, heading_rad } = seen(world, slot, now, cell.pose());
        let [wx, wy] = world.wind_m_s;
        let stage = state.stage(world, slot);
        let along = |speed: f64| [speed * math::cos(heading_rad), speed * math::sin(heading_rad)];
        let dt_s = world.timing.dt_s;
        let altitude_m = cell.altitude_m.get();
        let (velocity_m_s, top_m_s, levels) = match &airplane.track {
            // Recorded speeds are over the ground.
            Some(track) if world.is_replayed(slot, now) => {
                let [vx, vy] = along(track.speed_m_s(world.starts_s(now)));
                let top_m_s = world.top_m_s[slot as usize] + math::hypot(wx, wy);
                let climb_m = track.top_climb_m_s() * dt_s;
                let levels = Levels::between(altitude_m - climb_m, altitude_m + climb_m);
                ([vx - wx, vy - wy], top_m_s, levels)
            }
            _ => {
                let levels = Levels::between(altitude_m, stage.altitude_m);
                (along(stage.model.v_m_s), world.top_m_s[slot as usize], levels)
            }
        };
        let (separation_m, error_m) = (stage.model.separation_m, world.bounds.position_m);
        Self { slot, at, velocity_m_s, top_m_s, separation_m, error_m, levels, dt_s }
    }

    /// Returns the distance in meters to keep from where it would be if it flew straight on: the
    /// separation, and as far as it gets within `dt`.
    pub(crate) fn wide_m(&self, separation_m: f64) -> f64 {
        self.separation_m.max(separation_m) + self.top_m_s * self.dt_s
    }

    /// Returns its place in the moving air after some seconds, if it flies straight on.
    pub(crate) fn ahead(&self, seconds: f64) -> Point {
        let ([x, y], [vx, vy]) = (self.at, self.velocity_m_s);
        [x + vx * seconds, y + vy * seconds]
    }

    /// Returns what a predicted way costs beside this intruder.
    pub(crate) fn cost(&self, objective: &Objective, way: &Prediction, wanted: &Wanted) -> f64 {
        if !self.levels.meets(&wanted.levels, objective.vertical_m) {
            return 0.0;
        }
        let point = |k: usize| self.ahead(k as f64 * wanted.dtau_s);
        let points: Vec<Point> = (1..=way.points.len()).map(point).collect();
        let straight = Prediction { counted: points.len(), points };
        let wide_m = self.wide_m(wanted.separation_m);
        objective.collision(way, &straight, [wide_m, 0.0])[0]
    }
}

/// What an airplane wants of others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    pub(crate) separation_m: f64,
    pub(crate) levels: Levels,
    pub(crate) dtau_s: f64,
}
