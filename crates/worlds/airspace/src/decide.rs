//! *Decide*: the choice of actions for the airplanes of a group, by the world's method.

mod external;
mod velocity;
mod wishes;

use super::Turn;
use super::agents::Decided;
use super::agents::contact::Contacts;
use super::agents::network::Traffic;
use super::deploy::{self, Deployment};
use super::events::{Event, EventKind};
use super::flight::{Action, Known};
use super::intruder::Intruder;
use super::memory::group_takes_bytes;
use super::objective::{Options, game};
use super::perceive::known;
use super::purpose;
use super::shield::Way;
use super::world::{AirspaceWorld, Method};
use serde::{Deserialize, Serialize};
use sidestep_collectives::optimize;
use sidestep_kernel::{Cycle, EntityId, Slot};
use wishes::straight;

/// One optimization: of a group, in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Optimization {
    /// Cycle of the optimization.
    pub cycle: Cycle,
    /// The member of the group with the smallest id.
    pub airplane: EntityId,
    /// Number of airplanes of the group.
    pub airplanes: u32,
    /// Number of rounds, of that airplane's agent.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
    /// Messages and bytes on the network.
    pub traffic: Traffic,
}

/// Sums over optimizations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Effort {
    /// Number of optimizations.
    pub optimizations: u64,
    /// Sum of their rounds.
    pub rounds: u64,
    /// Number of those that ended before they had converged.
    pub unconverged: u64,
    /// Messages on the network, including the shield's exchanges.
    pub traffic: Traffic,
}

impl Effort {
    /// Adds one optimization.
    pub fn add(&mut self, one: &Optimization) {
        self.optimizations += 1;
        self.rounds += u64::from(one.rounds);
        self.unconverged += u64::from(!one.converged);
        self.traffic.add(one.traffic);
    }
}

/// Returns the ways that each airplane of a group may fly in the next `dt`, the wanted one first.
pub(super) fn wanted(
    turn: &mut Turn<'_>,
    group: &[Known],
    intruders: &[Intruder],
    contacts: &mut [Contacts],
) -> Vec<Vec<Way>> {
    let world = turn.world;
    match world.method {
        Method::Mvp | Method::Orca => return velocity::by_velocity(turn, group, intruders),
        Method::External => return external::as_ordered(turn, group),
        Method::Pc | Method::None => {}
    }
    let wishes = match world.method {
        _ if group.len() + intruders.len() < 2 => all_straight(world, group),
        _ if group.is_empty() => Vec::new(),
        Method::Pc => optimized(turn, group, intruders, contacts),
        _ => all_straight(world, group),
    };
    if let Some(notes) = &mut turn.scratch.notes {
        notes.wishes = notes.own(&wishes).cloned().unwrap_or_default();
    }
    group.iter().zip(wishes).map(|(known, wishes)| wishes::ways(world, *known, &wishes)).collect()
}

/// Returns the way straight to its next way-point of an airplane that minds nobody.
pub(super) fn straight_way(turn: &Turn<'_>, slot: Slot) -> Way {
    let Turn { world, state, now, .. } = *turn;
    let known = known(world, state, now, slot);
    let wishes = straight(world, known);
    wishes::ways(world, known, &wishes[..1]).swap_remove(0)
}

fn all_straight(world: &AirspaceWorld, group: &[Known]) -> Vec<Vec<Action>> {
    group.iter().map(|known| straight(world, *known)).collect()
}

/// Returns the wishes by probability collectives: the chosen action first, then the others by the
/// cost that the optimizer expects of them.
fn optimized(
    turn: &mut Turn<'_>,
    group: &[Known],
    intruders: &[Intruder],
    contacts: &mut [Contacts],
) -> Vec<Vec<Action>> {
    let &mut Turn { world, now, .. } = turn;
    if group_takes_bytes(world, group) > world.group_bytes {
        let event = Event::of(now, EventKind::GroupTooLarge, group[0].slot);
        turn.scratch.events.push(event.with(group.len() as f64));
        return all_straight(world, group);
    }
    let (decided, traffic) = match world.deployment {
        Deployment::Direct => (direct(world, group, intruders, now), Traffic::default()),
        _ => deploy::optimized(turn, group, intruders, contacts),
    };
    if let Some(notes) = &mut turn.scratch.notes {
        (notes.decided, notes.talk) = (notes.own(&decided).cloned().flatten(), traffic);
    }
    let first = decided.iter().flatten().next();
    turn.scratch.optimizations.push(Optimization {
        cycle: now,
        airplane: group[0].slot,
        airplanes: group.len() as u32,
        rounds: first.map_or(0, |decided| decided.rounds),
        converged: first.is_some() && decided.iter().flatten().all(|d| d.converged),
        traffic,
    });
    let ranked = |(decided, known): (&Option<Decided>, &Known)| match decided {
        Some(decided) => wishes::by_cost(world, *known, decided),
        // No decision reached it, so it flies straight on.
        None => straight(world, *known),
    };
    decided.iter().zip(group).map(ranked).collect()
}

/// Lets one process decide for all.
pub(super) fn direct(
    world: &AirspaceWorld,
    group: &[Known],
    intruders: &[Intruder],
    now: Cycle,
) -> Vec<Option<Decided>> {
    let options: Vec<Options> =
        group.iter().map(|known| world.options(*known, intruders)).collect();
    let game = game(&world.objective, &options);
    let uniform =
        |player: usize, k: u64| purpose::sample(&world.streams, group[player].slot, now, k);
    let outcome = optimize(&game, &world.settings, uniform);
    let (rounds, converged) = (outcome.rounds, outcome.converged);
    let each = outcome.joint.into_iter().zip(outcome.expected).zip(outcome.q);
    let decided = |((chosen, expected), chances)| {
        Some(Decided { chosen, expected, rounds, converged, chances })
    };
    each.map(decided).collect()
}
