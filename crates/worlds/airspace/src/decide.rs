//! *Decide*: the choice of actions for the airplanes of a group, by the world's method.

mod around_areas;
mod deviation_weights;
mod external;
mod group_memory;
mod local_flight;
#[cfg(test)]
mod optima_tests;
mod preferences;
#[cfg(test)]
mod tuple_tests;
mod velocity;

use super::agents::network_traffic::NetworkTraffic;
use super::agents::{ActionChoice, ReachedCost};
use super::baseline::ReactiveMemory;
use super::external_action::ExternalAction;
use super::flight::{Action, KnownAircraft, MethodCommand};
use super::method::MethodKind;
use super::non_cooperative::NonCooperativeAircraft;
use super::objective::{ActionPredictions, build_group_game, own_costs};
use super::purpose;
use super::settings::Deployment;
use super::shield::TurnProfile;
use super::world::AirspaceWorld;
use around_areas::has_areas_ahead;
pub(super) use group_memory::max_group_memory_bytes;
use preferences::rank_straight_first;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Game, find_minimum, is_at_bound, optimize, tight_lower_bound};
use sidestep_kernel::{Cycle, EntityId};
use velocity::OthersAt;
pub(super) use velocity::non_cooperative_state;

/// One optimization: of a group, in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptimizationRecord {
    /// Cycle for which the actions were chosen.
    pub cycle: Cycle,
    /// The member of the group with the smallest id.
    pub airplane: EntityId,
    /// Number of airplanes of the group.
    pub airplanes: u32,
    /// Number of rounds, of that airplane's agent.
    pub rounds: u32,
    /// Whether the distributions had settled.
    pub converged: bool,
    /// The cost of the chosen joint action, with a lower bound; none from agents that sample.
    pub reached: Option<ReachedCost>,
    /// The true minimum, in groups so small that the scenario asks for it.
    pub minimum: Option<f64>,
    /// Messages and bytes on the network.
    pub traffic: NetworkTraffic,
}

/// Sums over optimizations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OptimizationStats {
    /// Number of optimizations, each of one group in one cycle.
    pub optimizations: u64,
    /// Sum of their rounds.
    pub rounds: u64,
    /// Number of those that ended before they had converged.
    pub unconverged: u64,
    /// Number of those whose cost is at its lower bound, so that it is the minimum.
    pub proved_minima: u64,
    /// Number of those of which the true minimum was computed.
    pub known_minima: u64,
    /// Number of those that have reached it.
    pub reached_minima: u64,
    /// Messages on the network, including the shield's exchanges.
    pub traffic: NetworkTraffic,
    /// Beacons on the network, by which airplanes have found their groups.
    pub beacons: NetworkTraffic,
}

impl OptimizationStats {
    /// Adds an optimization that has ended; beacons are not part of one.
    pub fn add(&mut self, one: &OptimizationRecord) {
        self.optimizations += 1;
        self.rounds += u64::from(one.rounds);
        self.unconverged += u64::from(!one.converged);
        let is_proved = one.reached.is_some_and(|reached| reached.is_proved_minimum());
        self.proved_minima += u64::from(is_proved);
        if let (Some(minimum), Some(reached)) = (one.minimum, one.reached) {
            self.known_minima += 1;
            self.reached_minima += u64::from(is_at_bound(reached.cost, minimum));
        }
        self.traffic.add(one.traffic);
    }
}

/// Everything that an airplane considers flying in a cycle.
#[derive(Debug, Clone, Default)]
pub(super) struct ManeuverCandidates {
    /// Its actions by falling preference; none by methods that give a heading.
    pub(super) actions: Vec<Action>,
    /// The different turn profiles of the next `dt` that it may fly, the preferred one first.
    pub(super) profiles: Vec<TurnProfile>,
    /// The optimizer's decision.
    pub(super) decided: Option<ActionChoice>,
    /// The level and the speed that the method commands from the next cycle on.
    pub(super) command: MethodCommand,
}

impl ManeuverCandidates {
    fn from_actions(world: &AirspaceWorld, known: KnownAircraft, actions: Vec<Action>) -> Self {
        let first = actions.first().copied().unwrap_or(Action::OPTIMAL);
        Self {
            profiles: preferences::turn_profiles_from_actions(world, known, &actions),
            command: world.action_command(known, first),
            actions,
            decided: None,
        }
    }

    fn from_profiles(profiles: Vec<TurnProfile>) -> Self {
        Self { profiles, ..Self::default() }
    }
}

/// How airplanes of a group find their candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecisionStrategy {
    /// Each alone.
    Independent,
    /// All, by optimizing together.
    Joint,
    /// Each by the positions and goals of all.
    Reactive,
    /// Each alone, because the group takes too much memory to be optimized.
    GroupTooLarge,
}

impl DecisionStrategy {
    /// Returns the strategy of a group beside some others that do not decide with it.
    pub(super) fn for_group(world: &AirspaceWorld, group: &[KnownAircraft], others: usize) -> Self {
        let is_alone = group.is_empty() || group.len() + others < 2;
        match world.method {
            _ if Self::is_reactive(world) => Self::Reactive,
            MethodKind::Pc if is_alone => Self::Independent,
            MethodKind::Pc if max_group_memory_bytes(world, group) > world.group_bytes => {
                Self::GroupTooLarge
            }
            MethodKind::Pc => Self::Joint,
            _ => Self::Independent,
        }
    }

    /// Returns whether an airplane that knows the intentions of all finds its own decision by itself.
    pub(super) fn needs_intents_alone(world: &AirspaceWorld) -> bool {
        Self::is_reactive(world) || world.deployment == Deployment::ReplicaTeam
    }

    /// Returns whether the method gives headings by the positions and goals of all.
    pub(super) fn is_reactive(world: &AirspaceWorld) -> bool {
        matches!(
            world.method,
            MethodKind::Mvp | MethodKind::Orca | MethodKind::Bands | MethodKind::Own(_)
        )
    }
}

/// Returns the candidates of an airplane that decides alone: toward its way-point, or as ordered.
pub(super) fn candidates_alone(
    world: &AirspaceWorld,
    known: KnownAircraft,
    external_action: Option<&ExternalAction>,
    now: Cycle,
) -> ManeuverCandidates {
    match world.method {
        MethodKind::External => {
            external::candidates_for_external_action(world, known, external_action)
        }
        MethodKind::Pc if has_areas_ahead(world, known, now) => {
            let options = world.action_predictions(known, &[], now);
            let costs = own_costs(&world.objective, &options);
            ManeuverCandidates::from_actions(
                world,
                known,
                preferences::rank_by_own_cost(world, known, &costs),
            )
        }
        _ if has_areas_ahead(world, known, now) => {
            ManeuverCandidates::from_profiles(velocity::profiles_alone(world, known, now))
        }
        _ => ManeuverCandidates::from_actions(world, known, rank_straight_first(world, known)),
    }
}

/// Returns the candidates of an airplane by probability collectives: the chosen action first, then the others by the
/// cost that the optimizer expects of them.
pub(super) fn candidates_from_choice(
    world: &AirspaceWorld,
    known: KnownAircraft,
    decided: Option<ActionChoice>,
) -> ManeuverCandidates {
    let actions = match &decided {
        Some(decided) => preferences::rank_by_cost(world, known, decided),
        // No decision reached it, so it flies straight on.
        None => rank_straight_first(world, known),
    };
    ManeuverCandidates { decided, ..ManeuverCandidates::from_actions(world, known, actions) }
}

/// Returns the candidates of the airplanes of a group by the world's method, if that gives them
/// headings. `memory` is what it keeps of each.
pub(super) fn candidates_by_velocity(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
    memory: &mut [ReactiveMemory],
    now: Cycle,
) -> Vec<ManeuverCandidates> {
    let others_at = |seconds: f64| {
        let each = non_cooperative.iter();
        each.map(|one| non_cooperative_state(world, one, seconds)).collect()
    };
    candidates_in_traffic(world, group, &others_at, memory, now)
}

/// Returns the same for airplanes with all around them, of which `others_at` gives the states some seconds after the
/// start of the cycle.
pub(super) fn candidates_in_traffic(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    others_at: &OthersAt<'_>,
    memory: &mut [ReactiveMemory],
    now: Cycle,
) -> Vec<ManeuverCandidates> {
    let profiles = velocity::profiles_by_velocity(world, group, others_at, memory, now);
    let each = profiles.into_iter().zip(memory);
    each.map(|(profiles, memory)| ManeuverCandidates {
        command: memory.command,
        ..ManeuverCandidates::from_profiles(profiles)
    })
    .collect()
}

/// Returns the candidates of the airplanes of a group by the world's method, each with the knowledge of all. `memory` is
/// what it keeps of each.
pub(super) fn candidates_for_group(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
    memory: &mut [ReactiveMemory],
    now: Cycle,
) -> Vec<ManeuverCandidates> {
    match DecisionStrategy::for_group(world, group, non_cooperative.len()) {
        DecisionStrategy::Independent | DecisionStrategy::GroupTooLarge => {
            group.iter().map(|known| candidates_alone(world, *known, None, now)).collect()
        }
        DecisionStrategy::Reactive => {
            candidates_by_velocity(world, group, non_cooperative, memory, now)
        }
        DecisionStrategy::Joint => {
            let decided = decide_centrally(world, group, non_cooperative, now);
            let all = group.iter().zip(decided);
            all.map(|(known, decided)| candidates_from_choice(world, *known, decided)).collect()
        }
    }
}

/// Returns all the different turn profiles of the next `dt` that the actions of an airplane have.
pub(super) fn possible_profiles(world: &AirspaceWorld, known: KnownAircraft) -> Vec<TurnProfile> {
    preferences::turn_profiles_from_actions(world, known, &world.present_actions(known))
}

/// Returns the turn profile straight to the next way-point, for an airplane that avoids nobody.
pub(super) fn straight_profile(world: &AirspaceWorld, known: KnownAircraft) -> TurnProfile {
    let actions = rank_straight_first(world, known);
    preferences::turn_profiles_from_actions(world, known, &actions[..1]).swap_remove(0)
}

/// Decides for all airplanes of a group in one process.
pub(super) fn decide_centrally(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
    now: Cycle,
) -> Vec<Option<ActionChoice>> {
    let mut ids = Vec::new();
    let mut options = Vec::new();
    for (known, weight) in group.iter().zip(world.deviation_weights(group)) {
        ids.push(known.slot);
        let predictions = world.action_predictions(*known, non_cooperative, now);
        options.push(predictions.with_deviation_weight(weight));
    }
    decide_by_predictions(world, &ids, &options, now).into_iter().map(Some).collect()
}

/// Largest number of partial joint actions that the search for a true minimum looks at: about 50 ms, which hardly any
/// random game of up to twenty airplanes takes.
const MAX_MINIMUM_NODES: u64 = 10_000;

/// The objective of a joint action of a group, and its true minimum.
pub(super) struct JointActionCost {
    pub(super) reached: ReachedCost,
    /// None if the search for it takes too long.
    pub(super) minimum: Option<f64>,
}

/// Returns the cost of the joint action that a group has chosen, as one who knows all computes it.
pub(super) fn joint_action_cost(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
    joint: &[usize],
    now: Cycle,
) -> JointActionCost {
    let weights = world.deviation_weights(group);
    let options: Vec<ActionPredictions> = group
        .iter()
        .zip(weights)
        .map(|(known, weight)| {
            let predictions = world.action_predictions(*known, non_cooperative, now);
            predictions.with_deviation_weight(weight)
        })
        .collect();
    let game = build_group_game(&world.objective, &options);
    let cost = game.cost(joint);
    let minimum = find_minimum(&game, joint, MAX_MINIMUM_NODES);
    // The tight bound is dear, but the search is dearer.
    let bound = if minimum.is_proved { minimum.cost } else { tight_lower_bound(&game, joint) };
    JointActionCost {
        reached: ReachedCost { cost, bound },
        minimum: minimum.is_proved.then_some(minimum.cost),
    }
}

/// Decides for all airplanes of a group, by the predictions of their actions.
pub(super) fn decide_by_predictions(
    world: &AirspaceWorld,
    ids: &[EntityId],
    options: &[ActionPredictions],
    now: Cycle,
) -> Vec<ActionChoice> {
    let game = build_group_game(&world.objective, options);
    let outcome = optimize(&game, &world.settings, |player: usize, k: u64| {
        purpose::sample(&world.streams, ids[player], now, k)
    });
    let reached = ReachedCost::from_result(&outcome);
    let each = outcome.joint.into_iter().zip(outcome.expected).zip(outcome.q);
    each.map(|((chosen, expected), chances)| ActionChoice {
        chosen,
        expected,
        rounds: outcome.rounds,
        converged: outcome.converged,
        reached,
        chances,
    })
    .collect()
}
