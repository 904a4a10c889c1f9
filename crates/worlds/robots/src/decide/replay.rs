//! Actions that are known in advance.

use super::{Behaviour, Decision, Memory, Percept};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::stream::Draws;

/// A fixed list of actions, then nothing, or the list again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replay {
    /// The actions, one for each decision.
    pub actions: Vec<ActionId>,
    /// Whether it starts again at the end of the list.
    pub repeat: bool,
}

impl Behaviour for Replay {
    fn decide(&self, _: &Percept<'_>, memory: &mut Memory, _: &mut Draws) -> Decision {
        let step = memory.words[0] as usize;
        if step >= self.actions.len() {
            return STAY.into();
        }
        // Word 0 counts up to the length of the list, and stays there, so that it cannot overflow.
        memory.words[0] += 1;
        if self.repeat && memory.words[0] as usize == self.actions.len() {
            memory.words[0] = 0;
        }
        self.actions[step].into()
    }
}
