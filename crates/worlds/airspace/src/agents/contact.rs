//! Knowledge of airplanes about each other when messages get lost.

use super::party::{Unsound, are_places};
use crate::flight::{Air, Levels, Point, Pose, Prediction, distance_m};
use crate::objective::Options;
use crate::shield::{Flyer, Side};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId, math};
use std::collections::BTreeMap;

/// Factor on the separation from an airplane that is not heard.
const WIDER: f64 = 1.5;

/// A message in which an airplane describes itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Beacon {
    /// Pose at the start of the cycle.
    pub pose: Pose,
    /// Its next way-point.
    pub goal: Option<Point>,
    /// Airspeed in meters per second.
    pub v_m_s: f64,
    /// Largest turn rate in radians per second.
    pub omega_max_rad_s: f64,
    /// Turn rate of its orbits in radians per second.
    pub orbit_rad_s: f64,
    /// The separation that it asks for, in meters.
    pub separation_m: f64,
    /// The levels that it is on and changes to.
    pub levels: Levels,
}

/// An orbit that an airplane may be on: pose, cycle and side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Orbiting {
    /// Pose at the start of the cycle `as_of`.
    pub pose: Pose,
    /// Cycle of the pose.
    pub as_of: Cycle,
    /// The side to which it turns.
    pub side: Side,
}

/// One airplane's knowledge of another one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Cycle in which the other was last heard.
    pub heard_in: Cycle,
    /// Its message in that cycle.
    pub beacon: Beacon,
    /// The orbit on which it is presumed under the shield.
    pub presumed: Option<Orbiting>,
    /// The end of the plan that it told in the exchange before, if it may have flown that one.
    pub planned: Option<Planned>,
    /// The exchange, if it is the last one, in which it was present and not heard.
    pub unheard_in: Option<Cycle>,
}

/// The side to which an airplane turns at the end of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// The plan ends at the start of this cycle.
    pub as_of: Cycle,
    /// The side to which it turns then.
    pub side: Side,
}

/// One airplane's knowledge of others, by id.
pub type Contacts = BTreeMap<EntityId, Contact>;

impl Orbiting {
    /// Returns its pose at the start of cycle `now`.
    fn pose(&self, air: &Air, beacon: &Beacon, now: Cycle) -> Pose {
        let gone_s = now.saturating_sub(self.as_of) as f64 * air.timing.dt_s;
        let omega_rad_s = self.side.sign() * beacon.orbit_rad_s;
        let Pose { at: [x, y], heading_rad } = self.pose.step(beacon.v_m_s, omega_rad_s, gone_s);
        let [wx, wy] = air.wind_m_s;
        Pose { at: [x + wx * gone_s, y + wy * gone_s], heading_rad: math::wrap_angle(heading_rad) }
    }
}

impl Beacon {
    /// Returns the beacon of an airplane with unknown wishes.
    pub(crate) fn of(flyer: &Flyer) -> Self {
        Self {
            pose: flyer.pose,
            goal: None,
            v_m_s: flyer.v_m_s,
            omega_max_rad_s: flyer.omega_max_rad_s,
            orbit_rad_s: flyer.orbit_rad_s,
            separation_m: flyer.separation_m,
            levels: flyer.levels,
        }
    }

    /// Checks its numbers; `top_m_s` is the greatest speed of the airplane.
    ///
    /// # Errors
    /// When they cannot be those of an airplane.
    pub(crate) fn check(&self, top_m_s: f64) -> Result<(), Unsound> {
        let Self { pose: Pose { at: [x, y], heading_rad }, goal, v_m_s, levels, .. } = self;
        let places = [*x, *y, *heading_rad].into_iter().chain(goal.iter().flatten().copied());
        let is_flown = 0.0 < *v_m_s && *v_m_s <= top_m_s;
        let Levels { low_m, high_m } = levels;
        let is_level = low_m <= high_m && are_places([*low_m, *high_m]);
        Unsound::Number.unless(are_places(places) && is_flown && is_level)
    }
}

impl Contact {
    /// Returns the knowledge of an airplane that has just been heard.
    pub(crate) fn heard(beacon: Beacon, now: Cycle) -> Self {
        Self { heard_in: now, beacon, presumed: None, planned: None, unheard_in: None }
    }

    /// Returns the presumed flight of an airplane that is not heard: on the orbit on which the
    /// shield keeps it, or else straight to its last known way-point. Others keep farther away from
    /// it.
    pub(crate) fn options(&self, air: &Air, is_shielded: bool, now: Cycle) -> Options {
        let points = match &self.presumed {
            Some(orbiting) if is_shielded => self.on_orbit(air, orbiting, now),
            _ => self.straight(air, now),
        };
        let prediction = Prediction { counted: points.len(), points };
        let separation_m = WIDER * self.beacon.separation_m;
        Options::new(vec![prediction], separation_m, self.beacon.levels)
    }

    fn on_orbit(&self, air: &Air, orbiting: &Orbiting, now: Cycle) -> Vec<Point> {
        let Beacon { v_m_s, orbit_rad_s, .. } = self.beacon;
        let pose = orbiting.pose(air, &self.beacon, now);
        let omega_rad_s = orbiting.side.sign() * orbit_rad_s;
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

/// Notes the message in which another airplane described itself in cycle `now`.
pub(crate) fn note(contacts: &mut Contacts, id: EntityId, beacon: Beacon, now: Cycle) {
    match contacts.get_mut(&id) {
        Some(contact) => (contact.beacon, contact.heard_in) = (beacon, now),
        None => drop(contacts.insert(id, Contact::heard(beacon, now))),
    }
}
