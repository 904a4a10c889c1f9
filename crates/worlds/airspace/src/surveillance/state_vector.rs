//! The past of an airplane, as its reports tell it.

use crate::flight::{ConstantRateLeg, Frame, Point, Pose2, rotated};
use serde::{Deserialize, Serialize};
use sidestep_kernel::geometry::{add, scaled};
use std::collections::VecDeque;

/// The state of an airplane at the start of a step, without errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StateVector {
    /// Number of the step of `dtau` in the run.
    pub step: u64,
    /// Pose, in coordinates of the scenario.
    pub pose: Pose2,
    /// Velocity over the ground, east and north in meters per second.
    pub velocity_m_s: Point,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// Rate of climb in meters per second, negative downward.
    pub climb_m_s: f64,
}

impl StateVector {
    /// Returns the state at the start of a leg in a frame.
    pub(crate) fn from_leg(step: u64, frame: Frame, leg: &ConstantRateLeg) -> Self {
        let pose = frame.pose_to_world(leg.pose);
        let velocity_m_s = add(scaled(leg.direction(), leg.v_m_s), leg.drift_m_s);
        // East is another direction in another place on the earth.
        let turn_rad = pose.heading_rad - leg.pose.heading_rad;
        Self {
            step,
            pose,
            velocity_m_s: rotated(velocity_m_s, turn_rad),
            altitude_m: leg.altitude_m,
            climb_m_s: leg.climb_m_s,
        }
    }
}

/// The latest states of an airplane, one for each step, by rising step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StateVectorHistory(VecDeque<StateVector>);

impl StateVectorHistory {
    /// Adds the states of the next steps; of all, the last `kept` stay.
    pub(crate) fn extend(&mut self, states: &[StateVector], kept: usize) {
        self.0.extend(states);
        let excess = self.0.len().saturating_sub(kept);
        self.0.drain(..excess);
    }

    /// Returns the state at the start of a step, if it is known.
    pub(crate) fn at_step(&self, step: u64) -> Option<&StateVector> {
        let first = self.0.front()?.step;
        let place = usize::try_from(step.checked_sub(first)?).ok()?;
        self.0.get(place).filter(|one| one.step == step)
    }
}
