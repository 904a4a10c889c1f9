//! The past of the airplanes, as the state keeps it.

use super::{AirspaceState, lock};
use crate::surveillance::{StateVector, StateVectorHistory};
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;
use std::sync::{Arc, Mutex};

/// Returns the past states of `n` airplanes from those of a snapshot, which may have fewer.
pub(super) fn restore(
    n: usize,
    saved: &[StateVectorHistory],
) -> Box<[Mutex<Arc<StateVectorHistory>>]> {
    let history = |i: usize| saved.get(i).cloned().unwrap_or_default();
    (0..n).map(|i| Mutex::new(Arc::new(history(i)))).collect()
}

impl AirspaceState {
    /// Returns the past states of an airplane, which are shared, not copied; none where all see all.
    pub(crate) fn state_vectors(&self, slot: EntitySlot) -> Arc<StateVectorHistory> {
        let history = self.state_vectors.get(slot as usize);
        history.map(|one| Arc::clone(&lock(one))).unwrap_or_default()
    }

    /// Returns copies of the past states of all airplanes, for a snapshot.
    pub(super) fn all_state_vectors(&self) -> Vec<StateVectorHistory> {
        self.state_vectors.iter().map(|one| StateVectorHistory::clone(&lock(one))).collect()
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
            // Nobody shares it by now: reports are read before airplanes move.
            Arc::make_mut(&mut lock(history)).extend(states, kept);
        }
    }
}
