//! A check of the whole state against the world's laws (promise L1), for tests and debugging.

use super::sensor::FREE;
use super::state::RobotsState;
use super::world::RobotsWorld;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::space::Occupant;

impl RobotsWorld {
    /// Checks that no two bodies share a box, that no body stands in a wall, and that the grid
    /// shows exactly the bodies.
    ///
    /// # Errors
    /// Returns a description of the first fault found; that is a bug, not an outcome.
    pub fn audit(&self, state: &RobotsState) -> Result<(), String> {
        state.release_boxes(self);
        let mut owner = vec![None; self.walls.len()];
        for slot in 0..self.bodies.len() as EntitySlot {
            if !state.is_open_door(self, slot) {
                self.audit_body(state, slot, &mut owner)?;
            }
        }
        for (index, (&kind, owner)) in self.walls.iter().zip(&owner).enumerate() {
            let expected = match owner {
                Some(slot) => Occupant::Body(*slot),
                None if kind == FREE => Occupant::Empty,
                None => Occupant::Wall,
            };
            let shown = state.floor.occupant(index);
            if shown != expected {
                return Err(format!("box {index} shows {shown:?} instead of {expected:?}"));
            }
        }
        Ok(())
    }

    fn audit_body(
        &self,
        state: &RobotsState,
        slot: EntitySlot,
        owner: &mut [Option<EntitySlot>],
    ) -> Result<(), String> {
        let base = state.position(slot).row_major_index(self.stride);
        let own = &state.body_type(self, slot).own;
        let mut boxes: Vec<usize> =
            own.iter().map(|&offset| base.wrapping_add_signed(offset) as usize).collect();
        boxes.extend(state.way_boxes(self, &state.bodies[slot as usize]));
        boxes.sort_unstable();
        boxes.dedup();
        for index in boxes {
            let is_wall = self.walls.get(index).is_none_or(|&kind| kind != FREE);
            if is_wall {
                return Err(format!("body {slot} stands in a wall at box {index}"));
            }
            if let Some(other) = owner[index].replace(slot) {
                return Err(format!("bodies {slot} and {other} share box {index}"));
            }
        }
        Ok(())
    }
}
