//! The agents of robots elsewhere: their percepts in a cycle, and the controls that a world takes from them.
//!
//! A caller that runs agents in processes of their own asks for [`RobotsWorld::percepts_in_cycle`], sends each robot's to
//! its program ([`RobotAgent`](super::agents::RobotAgent)), hands the controls over as bytes
//! ([`sidestep_kernel::Simulation::submit_controls`]), and advances the run by a cycle. In such a cycle no robot decides
//! within the run: one that has sent nothing stays where it is, with the memory that it has.
//!
//! A planner leads its team in the run: it is a central one, and hands each robot its order by a word of the robot's memory,
//! which the percept has.

#[cfg(test)]
mod tests;

use super::Scratch;
use super::agents::{RobotControl, RobotPercept};
use super::cycle_context::with_cycle;
use super::state::RobotsState;
use super::submitted_controls::SubmittedControls;
use super::world::RobotsWorld;
use sidestep_kernel::control::OrderError;
use sidestep_kernel::{Cycle, EntityId, EntitySlot};
use sidestep_planners::GridPose;
use std::collections::BTreeMap;

impl RobotsWorld {
    /// Returns the number of robots, whose ids are those below.
    pub fn robot_count(&self) -> usize {
        self.robots.len()
    }

    /// Returns the first robot that follows the orders of a caller, and so has no program of its own.
    pub fn find_external_robot(&self) -> Option<EntityId> {
        let is_external =
            |id: &EntityId| self.robot_model(*id).is_some_and(|model| model.is_external);
        self.robots.iter().copied().find(is_external)
    }

    /// Returns the percepts of the robots that decide in the cycle to come, `now`, by rising id. The state does not change:
    /// the cycle is tried on a copy of it, up to the decisions.
    pub fn percepts_in_cycle(&self, state: &RobotsState, now: Cycle) -> Vec<RobotPercept> {
        let mut trial = state.trial_copy(self);
        // Those that were submitted already would be taken in place of percepts.
        trial.submitted = SubmittedControls::default();
        self.plan(&trial, now);
        let mut scratch = Scratch { percept_log: Some(Vec::new()), ..Scratch::default() };
        with_cycle!(self, &trial, now, |cycle| {
            for slot in 0..trial.bodies.len() as EntitySlot {
                cycle.perceive(slot, &mut scratch);
            }
        });
        let mut percepts = scratch.percept_log.unwrap_or_default();
        percepts.sort_unstable_by_key(|percept| percept.id);
        percepts
    }

    /// Returns the percepts of some robots that follow the orders of a caller, of those among them that act in the cycle
    /// to come, `now`, in their order. The state does not change.
    pub fn external_percepts(
        &self,
        state: &RobotsState,
        now: Cycle,
        robots: &[EntityId],
    ) -> Vec<RobotPercept> {
        let trial = state.trial_copy(self);
        let mut scratch = Scratch {
            percept_log: Some(Vec::new()),
            logs_external: true,
            // Without, robots under orders do not look.
            keep_readings: true,
            ..Scratch::default()
        };
        with_cycle!(self, &trial, now, |cycle| {
            for &id in robots.iter().filter(|&&id| self.is_external_robot(id)) {
                cycle.perceive(trial.slot_of_id[id as usize], &mut scratch);
            }
        });
        scratch.percept_log.unwrap_or_default()
    }

    /// Returns the boxes and the heading of a body.
    pub fn place(&self, state: &RobotsState, id: EntityId) -> Option<GridPose> {
        if id as usize >= self.bodies.len() {
            return None;
        }
        let body = state.body(id);
        let at = self.map_position(body.position());
        Some(GridPose::new(at.0, at.1, body.facing.get().heading()))
    }

    /// Returns whether the behavior of a robot is to follow the orders of a caller; robots of a planner have another one.
    pub fn is_external_robot(&self, id: EntityId) -> bool {
        self.robot_model(id).is_some_and(|model| model.behaviour.is_external())
    }

    /// Reads the control of a robot for cycle `now`.
    ///
    /// # Errors
    /// With the cause, when it is no control, or none of this robot in this cycle.
    pub fn read_control(
        &self,
        now: Cycle,
        id: EntityId,
        bytes: &[u8],
    ) -> Result<RobotControl, String> {
        let Some(model) = self.robot_model(id) else {
            return Err("there is no such robot; give ids of robots".into());
        };
        if model.is_external {
            return Err(
                "it follows the orders of a caller; give it orders in place of controls".into()
            );
        }
        let read = postcard::take_from_bytes::<RobotControl>(bytes).ok();
        let Some((control, _)) = read.filter(|(_, rest)| rest.is_empty()) else {
            return Err("its bytes are no control of this build".into());
        };
        if (control.id, control.cycle) != (id, now) {
            return Err(format!(
                "it is of robot {} and cycle {}; give that of robot {id} and cycle {now}",
                control.id, control.cycle
            ));
        }
        let actions = model.body.effector.actions.len();
        if usize::from(control.action) >= actions {
            let action = control.action;
            return Err(format!("it tries action {action}; give one of 0 to {}", actions - 1));
        }
        if control.broadcast.is_some() && self.radio.is_none() {
            return Err("it sends a message, and the scenario has no radio; add [radio]".into());
        }
        Ok(control)
    }

    /// Returns the controls, each as bytes, that cannot be carried out in cycle `now`, with the reasons.
    pub fn find_invalid_controls(
        &self,
        state: &RobotsState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Vec<(EntityId, String)> {
        let percepts = self.percepts_in_cycle(state, now);
        let mut invalid = Vec::new();
        for (id, bytes) in controls {
            if let Err(reason) = self.read_control_of_cycle(&percepts, now, (*id, bytes)) {
                invalid.push((*id, reason));
            }
        }
        invalid
    }

    /// Reads the control of a robot that must be one of those that decide in cycle `now`.
    fn read_control_of_cycle(
        &self,
        percepts: &[RobotPercept],
        now: Cycle,
        (id, bytes): (EntityId, &[u8]),
    ) -> Result<RobotControl, String> {
        let control = self.read_control(now, id, bytes)?;
        if percepts.binary_search_by_key(&id, |percept| percept.id).is_err() {
            let cause =
                "it does not decide in this cycle; give controls for those that have a percept";
            return Err(cause.into());
        }
        Ok(control)
    }

    /// Stores the controls of robots for cycle `now`, if all are valid: no robot decides within the run in it.
    pub(crate) fn store_controls(
        &self,
        state: &mut RobotsState,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        let percepts = self.percepts_in_cycle(state, now);
        let mut by_id = BTreeMap::new();
        for (id, bytes) in controls {
            let refused = |cause| OrderError::Control { agent: format!("robot {id}"), cause };
            let control = self.read_control_of_cycle(&percepts, now, (*id, bytes));
            if by_id.insert(*id, control.map_err(refused)?).is_some() {
                return Err(refused("there are two of it; give one for each robot".into()));
            }
        }
        state.submitted = SubmittedControls::new(now, by_id);
        Ok(())
    }
}
