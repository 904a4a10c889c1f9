//! Knowledge of airplanes about each other when messages get lost.

use crate::flight::{Air, Levels, Point, Pose, Prediction, distance_m};
use crate::objective::Options;
use crate::shield::{Flyer, Side};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId, math};
use std::collections::BTreeMap;

/// Factor on the separation from an airplane of which nothing is heard.
const WIDER: f64 = 1.5;

/// Message in which an airplane tells of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Beacon {
    /// Its pose.
    pub pose: Pose,
    /// Its next way-point.
    pub goal: Option<Point>,
    /// Its airspeed.
    pub v_m_s: f64,
    /// Its largest turn rate.
    pub omega_max_rad_s: f64,
    /// The separation it asks for.
    pub separation_m: f64,
    /// The levels that it is on and comes to.
    pub levels: Levels,
}

/// An orbit that somebody may be on: where, to which side, and when that was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Orbiting {
    /// Where it is at the beginning of a cycle,
    pub pose: Pose,
    /// of this one.
    pub as_of: Cycle,
    /// The side it turns to.
    pub side: Side,
}

/// Knowledge of one airplane about another one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Cycle in which it was last heard of.
    pub heard_in: Cycle,
    /// Its message then.
    pub beacon: Beacon,
    /// The orbits it may be on since then, under the shield.
    pub possible: Vec<Orbiting>,
    /// Exchanges of the shield in a row in which it was there and not heard,
    pub unheard: u32,
    /// up to this one.
    pub met_in: Cycle,
}

/// Knowledge of an airplane about others, by id.
pub type Contacts = BTreeMap<EntityId, Contact>;

impl Orbiting {
    /// Returns its place at the beginning of cycle `now`.
    fn pose(&self, air: &Air, beacon: &Beacon, now: Cycle) -> Pose {
        let gone_s = now.saturating_sub(self.as_of) as f64 * air.timing.dt_s;
        let omega_rad_s = self.side.sign() * beacon.omega_max_rad_s;
        let Pose { at: [x, y], heading_rad } = self.pose.step(beacon.v_m_s, omega_rad_s, gone_s);
        let [wx, wy] = air.wind_m_s;
        Pose { at: [x + wx * gone_s, y + wy * gone_s], heading_rad: math::wrap_angle(heading_rad) }
    }
}

impl Beacon {
    /// Returns all that can be told of one without knowing where it wants to go.
    pub(crate) fn of(flyer: &Flyer) -> Self {
        Self {
            pose: flyer.pose,
            goal: None,
            v_m_s: flyer.v_m_s,
            omega_max_rad_s: flyer.omega_max_rad_s,
            separation_m: flyer.separation_m,
            levels: flyer.levels,
        }
    }
}

impl Contact {
    /// One that has just been heard.
    pub(crate) fn heard(beacon: Beacon, now: Cycle) -> Self {
        Self { heard_in: now, beacon, possible: Vec::new(), unheard: 0, met_in: now }
    }

    /// Where one that is not heard is taken to fly: on the orbit on which the shield keeps it,
    /// or else straight to the way-point it had. Others keep farther away from it.
    pub(crate) fn options(&self, air: &Air, is_shielded: bool, now: Cycle) -> Options {
        let points = match self.possible.first() {
            Some(orbiting) if is_shielded => self.on_orbit(air, orbiting, now),
            _ => self.straight(air, now),
        };
        let prediction = Prediction { counted: points.len(), points };
        let separation_m = WIDER * self.beacon.separation_m;
        Options::new(vec![prediction], separation_m, self.beacon.levels)
    }

    fn on_orbit(&self, air: &Air, orbiting: &Orbiting, now: Cycle) -> Vec<Point> {
        let Beacon { v_m_s, omega_max_rad_s, .. } = self.beacon;
        let pose = orbiting.pose(air, &self.beacon, now);
        let omega_rad_s = orbiting.side.sign() * omega_max_rad_s;
        let point = |k: usize| pose.step(v_m_s, omega_rad_s, k as f64 * air.timing.dtau_s).at;
        (1..=air.timing.horizon).map(point).collect()
    }

    fn straight(&self, air: &Air, now: Cycle) -> Vec<Point> {
        let Beacon { pose: Pose { at, heading_rad }, goal, v_m_s, .. } = self.beacon;
        let toward = match goal.map(|goal| air.aim(at, goal, v_m_s)) {
            Some(aim) if distance_m(at, aim) > 0.0 => math::atan2(aim[1] - at[1], aim[0] - at[0]),
            _ => heading_rad,
        };
        let [vx, vy] = [v_m_s * math::cos(toward), v_m_s * math::sin(toward)];
        let [wx, wy] = air.wind_m_s;
        let gone_s = now.saturating_sub(self.heard_in) as f64 * air.timing.dt_s;
        let from = [at[0] + (vx + wx) * gone_s, at[1] + (vy + wy) * gone_s];
        let point = |k: usize| {
            let t_s = k as f64 * air.timing.dtau_s;
            [from[0] + vx * t_s, from[1] + vy * t_s]
        };
        (1..=air.timing.horizon).map(point).collect()
    }
}

/// Notes what another has told of itself in cycle `now`.
pub(crate) fn note(contacts: &mut Contacts, id: EntityId, beacon: Beacon, now: Cycle) {
    match contacts.get_mut(&id) {
        Some(contact) => (contact.beacon, contact.heard_in) = (beacon, now),
        None => drop(contacts.insert(id, Contact::heard(beacon, now))),
    }
}
