//! The past of the airplanes, as the state keeps it.

use super::{AirspaceState, lock};
use crate::surveillance::{StateVector, StateVectorHistory};
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;

impl AirspaceState {
    /// Returns the past states of an airplane; none where all see all.
    pub(crate) fn state_vectors(&self, slot: EntitySlot) -> StateVectorHistory {
        let history = self.state_vectors.get(slot as usize);
        history.map(|one| lock(one).clone()).unwrap_or_default()
    }

    /// Adds the states that an airplane has had in a cycle; nothing where all see all.
    pub(crate) fn add_state_vectors(
        &self,
        world: &AirspaceWorld,
        slot: EntitySlot,
        states: &[StateVector],
    ) {
        let history = self.state_vectors.get(slot as usize);
        if let Some((history, settings)) = history.zip(world.surveillance) {
            let kept = settings.kept_states(world.timing.points_per_dt());
            lock(history).extend(states, kept);
        }
    }
}
