//! The controls of robots that have decided outside of a run, until it has carried them out.

use super::agents::RobotControl;
use super::decide::{Decision, Memory};
use super::effector::STAY;
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeMap;

/// The controls of robots for one cycle; none before the first ones.
#[derive(Debug, Clone, Default)]
pub(crate) struct SubmittedControls {
    /// The cycle for which they are.
    cycle: Option<Cycle>,
    by_id: BTreeMap<EntityId, RobotControl>,
}

impl SubmittedControls {
    /// Returns the controls of robots, by their ids, for a cycle.
    pub(crate) fn new(cycle: Cycle, by_id: BTreeMap<EntityId, RobotControl>) -> Self {
        Self { cycle: Some(cycle), by_id }
    }

    /// Returns the controls if they are for this cycle: then all robots decide outside of the run.
    #[inline(always)]
    pub(crate) fn of_cycle(&self, now: Cycle) -> Option<&Self> {
        (self.cycle == Some(now)).then_some(self)
    }

    /// Returns the decision of a robot and its memory after that, which is `before` if it has sent nothing.
    pub(crate) fn decision(&self, id: EntityId, before: Memory) -> (Decision, Memory) {
        match self.by_id.get(&id) {
            Some(control) => (control.decision(), Memory { words: control.memory }),
            None => (STAY.into(), before),
        }
    }
}
