//! Keeping to the way until something is touched: the least that a robot without sensors can do.

use super::{Memory, Percept, Sector};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STAY};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;

/// Word 1: actions of an evasion that are left to do.
const EVASION_WORD: usize = 1;

/// Returns one action along the way; after a contact a short evasion.
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
        // No way from here (yet): wander until there is one.
        return if percept.contact.is_some() { random_turn(draws) } else { FORWARD };
    };
    match (4 + direction - percept.heading) % 4 {
        0 if percept.contact.is_some() => evade(percept, memory, draws),
        0 => FORWARD,
        1 => LEFT,
        3 => RIGHT,
        // The way leads back, and two turns to either side do it.
        _ => random_turn(draws),
    }
}

/// Waits or sidesteps, by a fair draw, because two robots that meet must not mirror each other.
fn evade(percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    if draws.uniform_below(3) == 0 {
        return STAY;
    }
    memory.words[EVASION_WORD] = 1 + draws.uniform_below(2);
    let clear = |sector| percept.nearest(sector).unwrap_or(u8::MAX);
    match clear(Sector::Left).cmp(&clear(Sector::Right)) {
        std::cmp::Ordering::Greater => LEFT,
        std::cmp::Ordering::Less => RIGHT,
        std::cmp::Ordering::Equal => random_turn(draws),
    }
}

fn random_turn(draws: &mut Draws) -> ActionId {
    if draws.uniform_below(2) == 0 { LEFT } else { RIGHT }
}
