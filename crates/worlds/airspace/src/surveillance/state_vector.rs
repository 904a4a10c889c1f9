//! The past of an airplane, as its reports tell it.

use crate::flight::{ConstantRateLeg, Frame, Point, Pose2, rotated};
use crate::perceive::observed_pose;
use crate::purpose;
use crate::scratch::PhaseContext;
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntitySlot;
use sidestep_kernel::distr::normal_pair;
use sidestep_kernel::geometry::{add, scaled};
use sidestep_kernel::math;
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

    /// Returns the state of an airplane at the start of the present cycle, in which its change of level is cleared.
    pub(crate) fn at_present(context: &PhaseContext<'_>, slot: EntitySlot) -> Self {
        let PhaseContext { world, state, now, .. } = *context;
        let current = &state.airplanes[slot as usize];
        let pose = current.pose();
        let altitude_m = current.altitude_m.get();
        let step = now * world.timing.points_per_dt() as u64;
        let direction = [math::cos(pose.heading_rad), math::sin(pose.heading_rad)];
        match &world.airplanes[slot as usize].track {
            Some(track) if world.is_replayed(slot, now) => {
                let now_s = world.cycle_start_s(now);
                let dtau_s = world.timing.dtau_s;
                let climb_m = track.altitude_at_m(now_s + dtau_s) - track.altitude_at_m(now_s);
                // Recorded speeds are over the ground.
                let velocity_m_s = scaled(direction, track.speed_m_s(now_s));
                Self { step, pose, velocity_m_s, altitude_m, climb_m_s: climb_m / dtau_s }
            }
            _ => {
                let segment = state.cleared_segment(world, slot);
                let air = world.flown_air(slot, now, (pose.at, altitude_m));
                let velocity_m_s = add(scaled(direction, segment.model.v_m_s), air.wind_m_s);
                let climb_m_s = segment.signed_climb_m_s(altitude_m);
                Self { step, pose, velocity_m_s, altitude_m, climb_m_s }
            }
        }
    }

    /// Returns it with the errors of the airplane's own navigation, as it reports it.
    pub(super) fn with_navigation_errors(
        self,
        context: &PhaseContext<'_>,
        slot: EntitySlot,
    ) -> Self {
        let world = context.world;
        let cycle = self.step / world.timing.points_per_dt() as u64;
        let pose = observed_pose(world, slot, cycle, self.pose);
        let noise_m_s = world.velocity_noise_m_s(slot as usize);
        let mut velocity_m_s = self.velocity_m_s;
        if noise_m_s > 0.0 {
            let words = world.streams.block(slot, cycle, purpose::VELOCITY, 0);
            let error = normal_pair(words);
            velocity_m_s = add(velocity_m_s, scaled(error, noise_m_s));
        }
        Self { pose, velocity_m_s, ..self }
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
