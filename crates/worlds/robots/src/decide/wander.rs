//! Obstacle avoidance and corridor following, like the Nomad's basic behavior in the paper.

use super::{Behaviour, Decision, Memory, Percept, Sector, random_turn};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT};
use sidestep_kernel::stream::Draws;
use std::cmp::Ordering;

/// Goes ahead; turns to the freer side before a near obstacle or after a contact; at intervals
/// turns into an open side, so that it explores crossings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wander {
    /// Mean number of its actions between two voluntary turns.
    pub turn_every: u32,
}

impl Default for Wander {
    fn default() -> Self {
        // Ten meters in boxes of 0.25 m: it crosses a room undisturbed, and still turns off a
        // corridor.
        Self { turn_every: 40 }
    }
}

/// Word 0 of the memory: actions left until the next voluntary turn, plus 1; 0 = not drawn.
const STRIDE_WORD: usize = 0;
/// Word 1: the turn of the last avoidance plus 1, kept while the front stays blocked, because a robot in a
/// corner would otherwise turn to and fro.
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
            // A side with something in the nearest class is a wall of the corridor, and no crossing.
            match (left > 0, right > 0) {
                (true, true) => return random_turn(draws).into(),
                (true, false) => return LEFT.into(),
                (false, true) => return RIGHT.into(),
                (false, false) => {}
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
        let is_first = *stride == 0;
        // Uniform over twice the mean, so that robots that start together do not turn together.
        *stride = draws.uniform_below(self.turn_every.saturating_mul(2)).saturating_add(2);
        !is_first
    }
}

/// Turns to the side on which the nearest thing is farther, and keeps turning that way until the front is free.
fn avoid(left: u8, right: u8, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    let kept = memory.words[AVOIDANCE_WORD];
    let turn = if kept != 0 {
        (kept - 1) as ActionId
    } else {
        match left.cmp(&right) {
            Ordering::Greater => LEFT,
            Ordering::Less => RIGHT,
            Ordering::Equal => random_turn(draws),
        }
    };
    memory.words[AVOIDANCE_WORD] = u32::from(turn) + 1;
    turn
}
