//! A way on for robots that wait for a contact where none can happen.
//!
//! Under the rule `renormalise` an action that may also do nothing never ends in a contact: before a
//! wall it does nothing. A robot notices that it does not get on, and takes this for a contact.

use super::{Behaviour, Contact, Decision, Memory, Percept};
use crate::effector::{FORWARD, Side};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;
use std::sync::Arc;

/// Decides as another behavior does, which perceives a contact in front after some vain steps. It
/// keeps word 3 of the memory to itself.
#[derive(Debug)]
pub struct StallDetector {
    /// The behavior that decides; it must not use word 3 of the memory.
    pub inner: Arc<dyn Behaviour>,
}

/// Index of the memory's word: vain steps above the place modulo 64.
const STALL_WORD: usize = 3;
/// Steps in vain that count as a contact. An action that does nothing now and then rarely does so
/// that often: a chance of 0.05 comes to one in 160,000.
const STALL_STEPS: u32 = 4;

impl Behaviour for StallDetector {
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let place = 1 << 12 | (percept.at.0 & 63) << 6 | percept.at.1 & 63;
        let (before, vain) = (memory.words[STALL_WORD] & 0x1fff, memory.words[STALL_WORD] >> 13);
        let vain = if before == place { vain } else { 0 };
        let touched = (vain >= STALL_STEPS).then_some(Contact { kind: 0, side: Side::Front });
        let percept = Percept { contact: percept.contact.or(touched), ..*percept };
        let decision = self.inner.decide(&percept, memory, draws);
        let vain = match decision.action {
            _ if touched.is_some() => 0,
            FORWARD => vain + 1,
            _ => vain,
        };
        memory.words[STALL_WORD] = vain << 13 | place;
        decision
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
