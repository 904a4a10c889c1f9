//! *Decide*: the choice of actions for the airplanes of a group, by the world's method.

mod external;
mod velocity;
mod wishes;

use super::Turn;
use super::agents::Decided;
use super::agents::traffic::Traffic;
use super::baseline::mvp::Resolving;
use super::flight::{Action, Known};
use super::intruder::Intruder;
use super::memory::group_takes_bytes;
use super::objective::{Options, game};
use super::perceive::known;
use super::pilot::Course;
use super::purpose;
use super::shield::{Decision, Way};
use super::wish::Wish;
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
    /// Beacons on the network, by which airplanes have found their groups.
    pub beacons: Traffic,
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

/// Everything that an airplane considers in a cycle.
#[derive(Debug, Clone, Default)]
pub(super) struct Considered {
    /// Its actions in the order in which it wants them; none by methods that give a heading.
    pub(super) actions: Vec<Action>,
    /// The different ways of the next `dt` that it may fly, the wanted one first.
    pub(super) ways: Vec<Way>,
    /// The optimizer's decision.
    pub(super) decided: Option<Decided>,
}

impl Considered {
    fn of(world: &AirspaceWorld, known: Known, actions: Vec<Action>) -> Self {
        Self { ways: wishes::ways(world, known, &actions), actions, decided: None }
    }

    fn of_ways(ways: Vec<Way>) -> Self {
        Self { ways, ..Self::default() }
    }

    /// Returns the course that follows from the shield's decision about those of its ways that were `allowed`.
    pub(super) fn course(&self, decision: Decision, allowed: &[usize]) -> Course {
        match decision.candidate.map(|k| allowed[k]) {
            Some(wish) => Course::Way {
                wish: wish as u32,
                way: self.ways[wish].clone(),
                side: decision.fallback,
            },
            None => Course::Orbit,
        }
    }
}

/// The way in which airplanes of a group find their wishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Manner {
    /// Each alone.
    Alone,
    /// All, by optimizing together.
    Optimizing,
    /// Each by the places and goals of all.
    Reacting,
    /// Each alone, because the group takes too much memory to be optimized.
    TooMany,
}

impl Manner {
    /// Returns the manner of a group beside some others that do not decide with it.
    pub(super) fn of(world: &AirspaceWorld, group: &[Known], others: usize) -> Self {
        let is_alone = group.is_empty() || group.len() + others < 2;
        match world.method {
            _ if Self::reacts(world) => Self::Reacting,
            Method::Pc if is_alone => Self::Alone,
            Method::Pc if group_takes_bytes(world, group) > world.group_bytes => Self::TooMany,
            Method::Pc => Self::Optimizing,
            _ => Self::Alone,
        }
    }

    /// Returns whether the method gives headings by the places and goals of all.
    pub(super) fn reacts(world: &AirspaceWorld) -> bool {
        matches!(world.method, Method::Mvp | Method::Orca)
    }
}

/// Returns the wishes of an airplane that decides alone: its way-point, or its order.
pub(super) fn alone(world: &AirspaceWorld, known: Known, wish: Option<&Wish>) -> Considered {
    match world.method {
        Method::External => external::as_ordered(world, known, wish),
        _ => Considered::of(world, known, straight(world, known)),
    }
}

/// Returns the wishes of an airplane by probability collectives: the chosen action first, then the others by the cost
/// that the optimizer expects of them.
pub(super) fn as_decided(
    world: &AirspaceWorld,
    known: Known,
    decided: Option<Decided>,
) -> Considered {
    let actions = match &decided {
        Some(decided) => wishes::by_cost(world, known, decided),
        // No decision reached it, so it flies straight on.
        None => straight(world, known),
    };
    Considered { decided, ..Considered::of(world, known, actions) }
}

/// Returns the wishes of the airplanes of a group by the world's method, if that gives them
/// headings. `memory` are the conflicts that they resolve.
pub(super) fn by_velocity(
    world: &AirspaceWorld,
    group: &[Known],
    intruders: &[Intruder],
    memory: &mut [Resolving],
) -> Vec<Considered> {
    let ways = velocity::by_velocity(world, group, intruders, memory);
    ways.into_iter().map(Considered::of_ways).collect()
}

/// Returns all the different ways of the next `dt` that the actions of an airplane lead.
pub(super) fn possible(world: &AirspaceWorld, known: Known) -> Vec<Way> {
    wishes::ways(world, known, world.actions_of(known.slot))
}

/// Returns the straight way to the next way-point of an airplane that minds no other.
pub(super) fn straight_way(turn: &Turn<'_>, slot: Slot) -> Way {
    let Turn { world, state, now, .. } = *turn;
    let known = known(world, state, now, slot);
    let wishes = straight(world, known);
    wishes::ways(world, known, &wishes[..1]).swap_remove(0)
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
