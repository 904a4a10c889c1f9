//! Carrying out the tasks of a team: the planner says where, and what to do next.

use super::goto::take_order;
use super::{Behaviour, Decision, Memory, Percept, TripEvent};
use sidestep_kernel::column::AtomicCell;
use sidestep_kernel::stream::Draws;

/// Does what the planner of its team wrote into its memory before the cycle. A trip is a task: from when the robot got
/// it until its last errand is done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Errands;

/// Word 0: the mark of a trip that the robot has to make when it decides. Word 1 is the order of the planner.
const MARK_WORD: usize = 0;
/// Word 2: whether it has a task.
const TASK_WORD: usize = 2;
/// Values of the mark; 0 is none.
const STARTED: u32 = 1;
const COMPLETED: u32 = 2;

impl Errands {
    /// Writes whether a robot has a task.
    pub(crate) fn set_task(memory: &[AtomicCell<u32>; 4], has_task: bool) {
        memory[TASK_WORD].set(u32::from(has_task));
    }

    /// Notes that a robot has finished its task. The next one, if it gets one at once, starts there.
    pub(crate) fn mark_end(memory: &[AtomicCell<u32>; 4]) {
        memory[MARK_WORD].set(COMPLETED);
    }

    /// Notes that a robot has got a task, unless it still has to say that it finished one.
    pub(crate) fn mark_start(memory: &[AtomicCell<u32>; 4]) {
        if memory[MARK_WORD].get() == 0 {
            memory[MARK_WORD].set(STARTED);
        }
    }
}

impl Behaviour for Errands {
    fn decide(&self, _: &Percept<'_>, memory: &mut Memory, _: &mut Draws) -> Decision {
        let trip = match std::mem::take(&mut memory.words[MARK_WORD]) {
            STARTED => Some(TripEvent::Started),
            COMPLETED => Some(TripEvent::Completed),
            _ => None,
        };
        Decision { trip, ..take_order(memory).into() }
    }

    fn is_on_trip(&self, memory: &Memory) -> bool {
        memory.words[TASK_WORD] == 1
    }
}
