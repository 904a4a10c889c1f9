//! The turn of a robot that may be delayed, before it decides.

use super::Scratch;
use super::cycle_context::CycleContext;
use super::purpose;
use super::state::BodyState;
use super::world::{RobotModel, Role};
use sidestep_kernel::space::OccupantWord;

impl<'a, T: OccupantWord> CycleContext<'a, T> {
    /// Returns the cycles for which a body is delayed, this one included: the rest of a delay, or one that starts now.
    pub(super) fn delay_cycles(&self, body: &BodyState, is_due: bool) -> u32 {
        let Some(model) = self.delayed_model(body) else { return 0 };
        let Some(delays) = &model.body.delays else { return 0 };
        let columns = &self.state.delays;
        let remaining = columns.remaining(body.id);
        if remaining > 0 {
            return remaining;
        }
        if !delays.may_start(is_due, columns.pause(body.id)) {
            return 0;
        }
        delays.sample(self.world.streams.block(body.id, self.now, purpose::DELAY, 0))
    }

    /// Returns the model of a robot that may be delayed.
    fn delayed_model(&self, body: &BodyState) -> Option<&'a RobotModel> {
        match &self.type_of(body).role {
            Role::Robot(model) => model.body.delays.is_some().then_some(model),
            Role::Mover(_) | Role::Door(_) => None,
        }
    }

    /// Counts a cycle of a delay, and returns whether the body is delayed in this cycle. A robot whose turn it is
    /// perceives all the same.
    pub(super) fn spend_delay(
        &self,
        body: &BodyState,
        is_due: bool,
        scratch: &mut Scratch,
    ) -> bool {
        let Some(model) = self.delayed_model(body) else { return false };
        let cycles = self.delay_cycles(body, is_due);
        if cycles == 0 {
            if is_due {
                self.state.delays.begin_action(body.id);
            }
            return false;
        }
        self.state.delays.spend(body.id, cycles, is_due);
        if is_due {
            self.state.count_wait(self.world, body);
        }
        // Nothing follows from the readings but the rows of a log.
        if is_due && scratch.keep_readings {
            self.sense(model, body, scratch);
        }
        true
    }
}

#[cfg(test)]
mod tests;
