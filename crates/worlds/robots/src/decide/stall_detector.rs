//! Contacts for behaviors that wait for one where none can happen.
//!
//! Under the rule `renormalise` an action that may also do nothing never ends in a contact: before a
//! wall it does nothing. A robot notices that its steps have no effect, and takes this for a contact.

use super::{Behaviour, Contact, Decision, Memory, Percept};
use crate::effector::{FORWARD, Side};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;
use std::sync::Arc;

/// Decides as another behavior does, which perceives a contact in front after some steps without effect.
/// It keeps word 3 of the memory to itself.
#[derive(Debug)]
pub struct StallDetector {
    /// The behavior that decides; it must not use word 3 of the memory.
    pub inner: Arc<dyn Behaviour>,
}

/// Index of the memory's word: the place, column and row modulo 64, below the number of steps in vain.
const STALL_WORD: usize = 3;
/// Bits of the word that hold the place.
const PLACE_BITS: u32 = 13;
/// A bit of every place, so that a memory of 0 is no place.
const IS_PLACE: u32 = 1 << 12;
/// Steps in vain that count as a contact. An action that may do nothing rarely does so that often: a
/// chance of 0.05 comes to one in 160,000.
const STALL_STEPS: u32 = 4;

impl Behaviour for StallDetector {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let place = IS_PLACE | (percept.at.0 & 63) << 6 | percept.at.1 & 63;
        let word = memory.words[STALL_WORD];
        let last_place = word & ((1 << PLACE_BITS) - 1);
        let in_vain = if last_place == place { word >> PLACE_BITS } else { 0 };
        let is_stalled = in_vain >= STALL_STEPS;
        // Kind 0 is that of free boxes and of no obstacle: the robot does not know what stops it.
        let assumed = is_stalled.then_some(Contact { kind: 0, side: Side::Front });
        let percept = Percept { contact: percept.contact.or(assumed), ..*percept };
        let decision = self.inner.decide(&percept, memory, draws);
        let in_vain = if is_stalled {
            0
        } else {
            // Turns and waiting leave a robot where it is, and are not in vain.
            in_vain + u32::from(decision.action == FORWARD)
        };
        memory.words[STALL_WORD] = in_vain << PLACE_BITS | place;
        decision
    }

    fn is_on_trip(&self, memory: &Memory) -> bool {
        self.inner.is_on_trip(memory)
    }

    fn goal(&self, memory: &Memory) -> Option<usize> {
        self.inner.goal(memory)
    }

    fn flow_fields(&self) -> &[Arc<FlowField>] {
        self.inner.flow_fields()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::{RandomPolicy, UNSEEN};
    use sidestep_kernel::Seed;
    use sidestep_kernel::stream::{Purpose, Streams};

    #[test]
    fn vain_steps_count_as_a_contact_and_steps_that_lead_on_do_not() {
        let patient = StallDetector { inner: Arc::new(RandomPolicy::bounce()) };
        let turns = |stride: u32| {
            let (mut memory, streams) = (Memory::default(), Streams::new(Seed(1)));
            let action = |now: u32| {
                let percept = Percept {
                    now: u64::from(now),
                    id: 0,
                    readings: &[],
                    sectors: &[],
                    nearest_in: [UNSEEN; 4],
                    contact: None,
                    at: (now * stride, 7),
                    heading: 0,
                    heard: &[],
                };
                let mut draws = streams.draws(0, u64::from(now), Purpose(3));
                patient.decide(&percept, &mut memory, &mut draws).action
            };
            (0..50).map(action).filter(|&action| action != FORWARD).count()
        };
        assert_eq!([turns(0), turns(1)], [10, 0]);
    }
}
