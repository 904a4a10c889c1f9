//! Following a path until something is touched: the least that a robot without sensors can do.

use super::{Memory, Percept, Sector, freer_side, random_turn};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STAY};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;

/// Word 1: actions of an evasion that are left to do.
const EVASION_WORD: usize = 1;

/// Returns one action along the path; after a contact a short evasion.
pub(super) fn follow(
    field: &FlowField,
    percept: &Percept<'_>,
    memory: &mut Memory,
    draws: &mut Draws,
) -> ActionId {
    if memory.words[EVASION_WORD] > 0 {
        memory.words[EVASION_WORD] -= 1;
        let blocked = percept.contact.is_some() || percept.nearest(Sector::Ahead) == Some(0);
        return if blocked { random_turn(draws) } else { FORWARD };
    }
    let Some(direction) = field.direction(percept.at.0, percept.at.1) else {
        // A slip can end in a box from which the goal cannot be reached: wander until there is a path.
        return if percept.contact.is_some() { random_turn(draws) } else { FORWARD };
    };
    match (4 + direction - percept.heading) % 4 {
        0 if percept.contact.is_some() => evade(percept, memory, draws),
        0 => FORWARD,
        1 => LEFT,
        3 => RIGHT,
        // The path leads back, and two turns to either side do it.
        _ => random_turn(draws),
    }
}

/// Waits or sidesteps by a draw, because two robots that meet must not mirror each other forever;
/// by one or two boxes only, because it does not see where it goes.
fn evade(percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    if draws.uniform_below(3) == 0 {
        return STAY;
    }
    memory.words[EVASION_WORD] = 1 + draws.uniform_below(2);
    freer_side(percept, draws)
}
