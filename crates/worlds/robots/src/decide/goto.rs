//! Going somewhere: along shortest ways on the static map, and around sensed obstacles.

use super::{Behaviour, Decision, Memory, Percept, Sector, Trip};
use crate::effector::{ActionId, FORWARD, LEFT, RIGHT, STAY};
use sidestep_kernel::stream::Draws;
use sidestep_map::planning::FlowField;
use std::sync::Arc;

/// Visits goals in order; each robot starts with the goals of its own list.
#[derive(Debug, Clone)]
pub struct Goto {
    /// Shortest ways to the goals, in order.
    pub goals: Vec<Arc<FlowField>>,
    /// Whether it starts again after the last goal, rather than staying there.
    pub repeat: bool,
}

/// Goes back and forth between two regions; a trip is there and back again.
#[derive(Debug, Clone)]
pub struct Shuttle {
    /// Shortest ways to the two regions.
    pub ends: [Arc<FlowField>; 2],
}

/// Word 0: number of goals reached (wraps at the length for a repeated list).
const REACHED: usize = 0;
/// Word 1: actions of an evasion that are left to do.
const EVADING: usize = 1;

impl Behaviour for Goto {
    fn ways(&self) -> &[Arc<FlowField>] {
        &self.goals
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let mut trip = None;
        let n = self.goals.len() as u32;
        while memory.words[REACHED] < n {
            let field = &self.goals[memory.words[REACHED] as usize];
            if !field.is_goal(percept.at.0, percept.at.1) {
                let action = follow(field, percept, memory, draws);
                return Decision { trip, ..action.into() };
            }
            trip = Some(Trip::Done);
            memory.words[REACHED] += 1;
            if self.repeat && memory.words[REACHED] == n {
                memory.words[REACHED] = 0;
                // Stop here, because a list whose goals all are here would loop for ever.
                break;
            }
        }
        Decision { trip, ..STAY.into() }
    }
}

impl Behaviour for Shuttle {
    fn ways(&self) -> &[Arc<FlowField>] {
        &self.ends
    }

    fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        let mut trip = None;
        let mut target = (memory.words[REACHED] % 2) as usize;
        if self.ends[target].is_goal(percept.at.0, percept.at.1) {
            memory.words[REACHED] = memory.words[REACHED].wrapping_add(1);
            if target == 0 {
                // The first arrival at end 0 only starts the first trip.
                trip = Some(if memory.words[REACHED] > 1 { Trip::Done } else { Trip::Begun });
            }
            target = 1 - target;
        }
        let action = follow(&self.ends[target], percept, memory, draws);
        Decision { trip, ..action.into() }
    }
}

/// Returns one action along the way; after a contact or before a near obstacle, a short evasion.
fn follow(
    field: &FlowField,
    percept: &Percept<'_>,
    memory: &mut Memory,
    draws: &mut Draws,
) -> ActionId {
    if memory.words[EVADING] > 0 {
        memory.words[EVADING] -= 1;
        let blocked = percept.contact.is_some() || percept.nearest(Sector::Ahead) == Some(0);
        return if blocked { turn_somewhere(draws) } else { FORWARD };
    }
    let Some(direction) = field.direction(percept.at.0, percept.at.1) else {
        // No way from here (yet): wander until there is one.
        return if percept.contact.is_some() { turn_somewhere(draws) } else { FORWARD };
    };
    match (4 + direction - percept.heading) % 4 {
        0 if percept.contact.is_some() => evade(percept, memory, draws),
        0 => FORWARD,
        1 => LEFT,
        3 => RIGHT,
        // The way leads back, and two turns to either side do it.
        _ => turn_somewhere(draws),
    }
}

/// Waits or sidesteps, by a fair draw, because two robots that meet must not mirror each other.
fn evade(percept: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> ActionId {
    if draws.below(3) == 0 {
        return STAY;
    }
    memory.words[EVADING] = 1 + draws.below(2);
    let clear = |sector| percept.nearest(sector).unwrap_or(u8::MAX);
    match clear(Sector::Left).cmp(&clear(Sector::Right)) {
        std::cmp::Ordering::Greater => LEFT,
        std::cmp::Ordering::Less => RIGHT,
        std::cmp::Ordering::Equal => turn_somewhere(draws),
    }
}

fn turn_somewhere(draws: &mut Draws) -> ActionId {
    if draws.below(2) == 0 { LEFT } else { RIGHT }
}
