//! Knowledge of airplanes about each other when messages get lost.

use super::participant::{InvalidMessage, are_valid_coordinates};
use crate::flight::{
    FlightConditions, FlightLevelRange, Frame, Point, Pose2, Prediction, distance_m,
};
use crate::objective::ActionPredictions;
use crate::shield::{OrbitSide, ShieldedAircraft};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId, math};
use std::collections::BTreeMap;

/// Factor on the separation from an airplane that is not heard: where it is presumed to fly is a guess.
const UNHEARD_SEPARATION_FACTOR: f64 = 1.5;

/// A message in which an airplane describes itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StateBeacon {
    /// Pose at the start of the cycle.
    pub pose: Pose2,
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
    /// The levels that it keeps or passes: in a proposal those of the next `dt`, else as far as methods have to mind them.
    pub levels: FlightLevelRange,
}

/// An orbit that an airplane may be on: pose, cycle and side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OrbitState {
    /// Pose at the start of the cycle `as_of`.
    pub pose: Pose2,
    /// Cycle of the pose.
    pub as_of: Cycle,
    /// The side to which it turns.
    pub side: OrbitSide,
}

/// One airplane's knowledge of another one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LastKnownState {
    /// Cycle in which the other was last heard; that of its appearance if it never was.
    pub heard_in: Cycle,
    /// Its message in that cycle.
    pub beacon: StateBeacon,
    /// The orbit on which it is presumed under the shield.
    pub presumed: Option<OrbitState>,
    /// The end of the plan that it sent in the exchange before, if it may have flown that one.
    pub planned: Option<PlanEnd>,
    /// The exchange, if it is the last one, in which it was present and not heard.
    pub unheard_in: Option<Cycle>,
}

/// The side to which an airplane turns at the end of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlanEnd {
    /// The plan ends at the start of this cycle.
    pub as_of: Cycle,
    /// The side to which it turns then.
    pub side: OrbitSide,
}

/// One airplane's knowledge of others, by id.
pub type TrafficPicture = BTreeMap<EntityId, LastKnownState>;

impl OrbitState {
    /// Returns its pose in a frame at the start of cycle `now`, carried by the wind since `as_of`.
    fn pose_in(
        &self,
        frame: Frame,
        air: &FlightConditions,
        beacon: &StateBeacon,
        now: Cycle,
    ) -> Pose2 {
        let elapsed_s = now.saturating_sub(self.as_of) as f64 * air.timing.dt_s;
        let omega_rad_s = self.side.sign() * beacon.orbit_rad_s;
        let Pose2 { at: [x, y], heading_rad } =
            frame.pose_to_local(self.pose).step(beacon.v_m_s, omega_rad_s, elapsed_s);
        let [wx, wy] = air.wind_m_s;
        Pose2 {
            at: [x + wx * elapsed_s, y + wy * elapsed_s],
            heading_rad: math::wrap_angle(heading_rad),
        }
    }
}

impl StateBeacon {
    /// Returns the beacon of an airplane whose next way-point is unknown.
    pub(crate) fn from_aircraft(aircraft: &ShieldedAircraft) -> Self {
        Self {
            pose: aircraft.pose,
            goal: None,
            v_m_s: aircraft.v_m_s,
            omega_max_rad_s: aircraft.omega_max_rad_s,
            orbit_rad_s: aircraft.orbit_rad_s,
            separation_m: aircraft.separation_m,
            levels: aircraft.levels,
        }
    }

    /// Checks its numbers; `top_m_s` is the greatest speed of the airplane.
    ///
    /// # Errors
    /// When they cannot be those of an airplane.
    pub(crate) fn check(&self, top_m_s: f64) -> Result<(), InvalidMessage> {
        let Self { pose: Pose2 { at: [x, y], heading_rad }, goal, v_m_s, levels, .. } = self;
        let numbers = [*x, *y, *heading_rad].into_iter().chain(goal.iter().flatten().copied());
        let is_valid_speed = 0.0 < *v_m_s && *v_m_s <= top_m_s;
        let FlightLevelRange { low_m, high_m } = levels;
        let is_valid_level = low_m <= high_m && are_valid_coordinates([*low_m, *high_m]);
        let is_valid = are_valid_coordinates(numbers) && is_valid_speed && is_valid_level;
        InvalidMessage::Number.ensure(is_valid)
    }
}

impl LastKnownState {
    /// Returns the knowledge of an airplane that has just been heard.
    pub(crate) fn from_beacon(beacon: StateBeacon, now: Cycle) -> Self {
        Self { heard_in: now, beacon, presumed: None, planned: None, unheard_in: None }
    }

    /// Returns the presumed flight of an airplane that is not heard: on the orbit on which the
    /// shield keeps it, or else straight to its last known way-point. Others keep farther away from
    /// it. `frame` is that in which the predictions lie: where the airplane is seen.
    pub(crate) fn presumed_predictions(
        &self,
        air: &FlightConditions,
        is_shielded: bool,
        now: Cycle,
        frame: Frame,
    ) -> ActionPredictions {
        let mut points = match &self.presumed {
            Some(orbiting) if is_shielded => self.orbit_points(frame, air, orbiting, now),
            _ => self.straight_points(frame, air, now),
        };
        air.move_to_common_air(&mut points);
        let prediction = Prediction { counted: points.len(), points };
        let separation_m = UNHEARD_SEPARATION_FACTOR * self.beacon.separation_m;
        ActionPredictions::new(vec![prediction], frame, separation_m, self.beacon.levels)
    }

    fn orbit_points(
        &self,
        frame: Frame,
        air: &FlightConditions,
        orbiting: &OrbitState,
        now: Cycle,
    ) -> Vec<Point> {
        let StateBeacon { v_m_s, orbit_rad_s, .. } = self.beacon;
        let pose = orbiting.pose_in(frame, air, &self.beacon, now);
        let omega_rad_s = orbiting.side.sign() * orbit_rad_s;
        (1..=air.timing.horizon)
            .map(|k| pose.step(v_m_s, omega_rad_s, k as f64 * air.timing.dtau_s).at)
            .collect()
    }

    fn straight_points(&self, frame: Frame, air: &FlightConditions, now: Cycle) -> Vec<Point> {
        let StateBeacon { pose, goal, v_m_s, .. } = self.beacon;
        let Pose2 { at, heading_rad } = frame.pose_to_local(pose);
        let goal = goal.map(|goal| frame.to_local(goal));
        let bearing_rad = match goal.map(|goal| air.aim_point(at, goal, v_m_s)) {
            Some(aim) if distance_m(at, aim) > 0.0 => math::atan2(aim[1] - at[1], aim[0] - at[0]),
            _ => heading_rad,
        };
        let vx = v_m_s * math::cos(bearing_rad);
        let vy = v_m_s * math::sin(bearing_rad);
        let [wx, wy] = air.wind_m_s;
        let elapsed_s = now.saturating_sub(self.heard_in) as f64 * air.timing.dt_s;
        let from = [at[0] + (vx + wx) * elapsed_s, at[1] + (vy + wy) * elapsed_s];
        (1..=air.timing.horizon)
            .map(|k| {
                let t_s = k as f64 * air.timing.dtau_s;
                [from[0] + vx * t_s, from[1] + vy * t_s]
            })
            .collect()
    }
}

/// Records the message in which another airplane described itself in cycle `now`.
pub(crate) fn record_beacon(
    contacts: &mut TrafficPicture,
    id: EntityId,
    beacon: StateBeacon,
    now: Cycle,
) {
    match contacts.get_mut(&id) {
        Some(contact) => {
            contact.beacon = beacon;
            contact.heard_in = now;
        }
        None => {
            contacts.insert(id, LastKnownState::from_beacon(beacon, now));
        }
    }
}
