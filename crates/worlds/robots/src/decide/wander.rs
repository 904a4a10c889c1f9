//! Obstacle avoidance and corridor following, like the Nomad's basic behavior in the paper.

use super::{Behaviour, Decision, Memory, Percept, Sector};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT};
use sidestep_kernel::stream::Draws;

/// Goes ahead; turns to the freer side before a near obstacle or after a contact; now and then
/// turns into an open side, so that it explores crossings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wander {
    /// Mean number of its actions between two voluntary turns.
    pub turn_every: u32,
}

impl Default for Wander {
    fn default() -> Self {
        Self { turn_every: 40 }
    }
}

/// Word 0 of the memory: actions left until the next voluntary turn, plus 1; 0 = not drawn.
const STRIDE_WORD: usize = 0;
/// Word 1: the turn of the last avoidance plus 1, kept while the way stays blocked.
const AVOIDANCE_WORD: usize = 1;

impl Behaviour for Wander {
    #[inline]
    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let [ahead, left, right] = [Sector::Ahead, Sector::Left, Sector::Right]
            .map(|sector| percept.nearest_in[sector as usize]);
        if ahead == 0 || percept.contact.is_some() {
            return avoid(left, right, memory, draws).into();
        }
        memory.words[AVOIDANCE_WORD] = 0;
        if self.is_stride_over(memory, draws) {
            let open = [(left, LEFT), (right, RIGHT)];
            let mut open = open.iter().filter(|(class, _)| *class > 0).map(|&(_, turn)| turn);
            match (open.next(), open.next()) {
                (Some(a), Some(b)) => {
                    return if draws.uniform_below(2) == 0 { a } else { b }.into();
                }
                (Some(only), None) => return only.into(),
                _ => {}
            }
        }
        FORWARD.into()
    }
}

impl Wander {
    /// Counts down one action of the stride, and returns whether it is over; then it draws the
    /// next.
    #[inline]
    fn is_stride_over(self, memory: &mut Memory, draws: &mut Draws) -> bool {
        let stride = &mut memory.words[STRIDE_WORD];
        if *stride > 1 {
            *stride -= 1;
            return false;
        }
        let first = *stride == 0;
        *stride = draws.uniform_below(self.turn_every.saturating_mul(2)).saturating_add(2);
        !first
    }
}

/// Turns to the freer side, and keeps turning that way until the way is free.
fn avoid(left: u8, right: u8, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    let turn = match memory.words[AVOIDANCE_WORD] {
        0 if left != right => {
            if left > right {
                LEFT
            } else {
                RIGHT
            }
        }
        0 => {
            if draws.uniform_below(2) == 0 {
                LEFT
            } else {
                RIGHT
            }
        }
        kept => (kept - 1) as ActionId,
    };
    memory.words[AVOIDANCE_WORD] = u32::from(turn) + 1;
    turn
}
