//! Actions that take several cycles: the boxes that a body leaves and still holds.
//!
//! A body comes to its new boxes when an action begins, and gives up the old ones when it ends: in between it is as long
//! as its way, so nobody enters a box that is being left.

use super::action::StepPath;
use super::action_progress::ProgressColumns;
use super::cycle_context::{CycleContext, are_free, box_index, with_cycle};
use super::effector::FORWARD;
use super::state::{BodyState, RobotsState};
use super::world::RobotsWorld;
use sidestep_kernel::space::{GridPosition, OccupantWord};
use sidestep_kernel::{EntityId, EntitySlot};

impl RobotsState {
    /// Gives up the boxes that bodies have left whose actions have ended. The floor is all that changes, so it may be
    /// done at any time between cycles.
    pub(crate) fn release_boxes(&self, world: &RobotsWorld) {
        if !world.has_long_actions {
            return;
        }
        with_cycle!(world, self, 0, |cycle| {
            for slot in 0..cycle.state.bodies.len() as EntitySlot {
                cycle.release_boxes(slot);
            }
        });
    }

    /// Returns the boxes, by their index on the floor, that a body's action came through: those that it held before
    /// and after included. There are none without an action in progress that has made steps.
    pub(crate) fn way_boxes(&self, world: &RobotsWorld, body: &BodyState) -> Vec<usize> {
        let progress = &self.action_progress;
        let steps = ProgressColumns::word_of(&progress.steps, body.id) as usize;
        if steps == 0 {
            return Vec::new();
        }
        let id = body.id as usize;
        let base = GridPosition::from_word(progress.from.get(id)).row_major_index(world.stride);
        let ty = &world.types[usize::from(body.ty)];
        let word = progress.walk.get(id);
        let action = ty.actions.get((word >> 16) as usize);
        let walk = action.and_then(|action| action.walks.get((word & 0xffff) as usize));
        let entered = walk.iter().flat_map(|walk| walk.steps.iter().take(steps));
        let offsets = ty.own.iter().chain(entered.flat_map(|step| &step.enter));
        offsets.map(|&offset| box_index(base, offset)).collect()
    }

    /// Writes a body into the boxes that its action came through.
    pub(crate) fn hold_way(&self, world: &RobotsWorld, slot: EntitySlot) {
        for index in self.way_boxes(world, &self.bodies[slot as usize]) {
            self.floor.place(index, slot);
        }
    }
}

impl RobotsWorld {
    /// Returns whether a robot whose actions take several cycles would have to wait for the box ahead of it.
    pub(crate) fn is_kept_out(&self, state: &RobotsState, id: EntityId) -> bool {
        if self.bodies[id as usize].action_cycles == 1 {
            return false;
        }
        with_cycle!(self, state, 0, |cycle| {
            let body = state.body(id);
            let ty = cycle.type_of(body);
            let forward = ty.action_index(body.facing.get().heading(), FORWARD);
            let walk = ty.actions[usize::from(forward)].walks.first();
            walk.is_some_and(|walk| !are_free(cycle.floor, cycle.base(body), &walk.whole.enter))
        })
    }
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Returns whether a body holds the boxes that it leaves until its action ends.
    pub(super) fn holds_way(&self, body: &BodyState) -> bool {
        self.world.has_long_actions && self.world.bodies[body.id as usize].action_cycles > 1
    }

    /// Returns whether an action of a body goes on that began in an earlier cycle.
    pub(super) fn is_in_action(&self, body: &BodyState) -> bool {
        self.world.has_long_actions && self.state.action_progress.left(body.id) > 0
    }

    /// Returns whether a body may begin an action in this cycle, unless it is delayed.
    pub(super) fn is_turn(&self, body: &BodyState) -> bool {
        self.world.bodies[body.id as usize].is_due(self.now) && !self.is_in_action(body)
    }

    /// Begins the action that a body is about to do. One that neither moves nor turns it takes one cycle.
    pub(super) fn begin_action(&self, body: &BodyState, number: u8) {
        let cycles = self.world.bodies[body.id as usize].action_cycles;
        let ty = self.type_of(body);
        let index = ty.action_index(body.facing.get().heading(), number);
        let action = ty.actions.get(usize::from(index));
        let is_wait = action.is_none_or(|action| {
            action.walks.iter().all(|walk| walk.steps.is_empty() && walk.turn == 0)
        });
        self.state.action_progress.begin(body.id, if is_wait { 0 } else { cycles - 1 });
    }

    /// Notes the steps that a body makes, while it is where they begin.
    pub(super) fn note_way(&self, body: &BodyState, walk: &StepPath, steps: usize) {
        let id = body.id as usize;
        let action = body.action.get();
        let walks = &self.type_of(body).actions[usize::from(action)].walks;
        let transition = walks.iter().position(|one| std::ptr::eq(one, walk)).unwrap_or(0);
        let progress = &self.state.action_progress;
        progress.from.set(id, body.anchor.get());
        progress.walk.set(id, u32::from(action) << 16 | transition as u32);
        progress.steps.set(id, steps as u32);
    }

    /// Gives up the boxes that a body has left, if its action has ended.
    fn release_boxes(&self, slot: EntitySlot) {
        let body = self.body(slot);
        let id = body.id as usize;
        if self.state.action_progress.left.get(id) > 0
            || self.state.action_progress.steps.get(id) == 0
        {
            return;
        }
        for index in self.state.way_boxes(self.world, body) {
            self.floor.set(index, T::FREE);
        }
        let base = self.base(body);
        for &offset in &self.type_of(body).own {
            self.floor.set(box_index(base, offset), T::from_body(slot));
        }
        self.state.action_progress.steps.set(id, 0);
    }
}

#[cfg(test)]
mod tests;
