//! Actions that are known in advance, or handed in by a caller.

use super::{Behaviour, Decision, Memory, Percept};
use crate::effector::{ActionId, STAY};
use sidestep_kernel::stream::Draws;

/// A fixed list of actions, then nothing, or the list again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replay {
    /// The actions in order.
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
        memory.words[0] += 1;
        if self.repeat && memory.words[0] as usize == self.actions.len() {
            memory.words[0] = 0;
        }
        self.actions[step].into()
    }
}

/// Does the action that the caller ordered before the cycle; stays when there is no order.
///
/// The world stores the order in word 3 of the memory as `action + 1`, and removes it afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct External;

/// Index of the memory's word that holds the order.
pub const ORDER: usize = 3;

impl Behaviour for External {
    fn decide(&self, _: &Percept<'_>, memory: &mut Memory, _: &mut Draws) -> Decision {
        match std::mem::take(&mut memory.words[ORDER]) {
            0 => STAY.into(),
            order => ((order - 1) as ActionId).into(),
        }
    }
}
