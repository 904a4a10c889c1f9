//! A check of the whole state against the world's laws (promise L1), for tests and doubt.

use super::state::{FREE, KIND_BITS, RobotsState};
use super::world::{RobotsWorld, Role};
use sidestep_kernel::Slot;

impl RobotsWorld {
    /// Checks that no two bodies share a box, nobody stands in a wall, and the grid shows
    /// exactly the bodies.
    ///
    /// # Errors
    /// Says what is wrong; that is a bug, not an outcome.
    pub fn audit(&self, state: &RobotsState) -> Result<(), String> {
        let mut owner = vec![None; self.walls.len()];
        for slot in 0..self.bodies.len() as Slot {
            let body = self.body_type(slot);
            let is_open =
                matches!(body.role, Role::Door(_)) && state.bodies[slot as usize].facing.get() == 1;
            if !is_open {
                self.audit_body(state, slot, &mut owner)?;
            }
        }
        for (index, (&wall, owner)) in self.walls.iter().zip(&owner).enumerate() {
            let kind = state.grid.get(index) & KIND_BITS;
            let expected = owner.map_or(wall, |slot| self.body_type(slot).kind);
            if kind != expected {
                return Err(format!("box {index} shows kind {kind} instead of {expected}"));
            }
        }
        Ok(())
    }

    fn audit_body(
        &self,
        state: &RobotsState,
        slot: Slot,
        owner: &mut [Option<Slot>],
    ) -> Result<(), String> {
        let at = state.at(slot);
        for &offset in &self.body_type(slot).own {
            let index = at.index(self.stride).wrapping_add_signed(offset) as usize;
            let is_wall = self.walls.get(index).is_none_or(|&w| w != FREE);
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
