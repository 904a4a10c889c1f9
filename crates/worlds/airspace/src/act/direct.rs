//! One process that decides for all airplanes of a group.

use crate::avoid::group_threats;
use crate::baseline::ReactiveMemory;
use crate::decide::{DecisionStrategy, ManeuverCandidates, candidates_alone, candidates_for_group};
use crate::events::{Event, EventKind, search_limit};
use crate::flight::KnownAircraft;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::pilot::{AirplaneControl, Maneuver, OptimizationStatus, OwnshipState, PilotMemory};
use crate::scratch::PhaseContext;
use crate::shield::{
    PlanCertainty, PlanEnding, PlanRules, ShieldedAircraft, Surroundings, TurnProfile,
    filter_maneuvers_beside,
};
use crate::world::AirspaceWorld;
use sidestep_kernel::{Cycle, EntitySlot};

/// Decides for the airplanes of a group. Returns the control of each, and what it has considered.
pub(super) fn decide(
    context: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    non_cooperative: &[NonCooperativeAircraft],
) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    let PhaseContext { world, clock, .. } = *context;
    let start_ns = clock.thread_cpu_ns();
    let mut all = find_candidates(context, own, non_cooperative);
    context.scratch.decide_ns += clock.thread_cpu_ns() - start_ns;
    let maneuvers: Vec<Maneuver> = if world.shield {
        shielded_maneuvers(context, own, non_cooperative, &mut all)
    } else {
        own.iter().zip(&all).map(|(own, (_, one))| unshielded_maneuver(own, one)).collect()
    };
    for ((control, considered), maneuver) in all.iter_mut().zip(maneuvers) {
        if world.has_resolution_memory() {
            control.memory.record_maneuver(&maneuver);
        }
        control.maneuver = maneuver;
        control.memory.command = considered.command;
    }
    all
}

/// Returns what the airplanes of a group consider, and controls that lack only the maneuver.
fn find_candidates(
    context: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    non_cooperative: &[NonCooperativeAircraft],
) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    let PhaseContext { world, state, now, .. } = *context;
    let slots: Vec<EntitySlot> = own.iter().map(|own| own.id).collect();
    let group: Vec<KnownAircraft> = own.iter().map(OwnshipState::as_known_aircraft).collect();
    let mut memories = state.take_memories(&slots);
    let strategy = DecisionStrategy::for_group(world, &group, non_cooperative.len());
    let considered: Vec<ManeuverCandidates> = match strategy {
        DecisionStrategy::Independent | DecisionStrategy::GroupTooLarge => own
            .iter()
            .map(|own| {
                candidates_alone(world, own.as_known_aircraft(), own.external_action.as_ref(), now)
            })
            .collect(),
        DecisionStrategy::Reactive | DecisionStrategy::Joint => {
            decide_together(world, &group, non_cooperative, &mut memories, now)
        }
    };
    let mut controls: Vec<AirplaneControl> = slots
        .into_iter()
        .zip(memories)
        .map(|(slot, memory)| AirplaneControl::stay_on_orbit(slot, now, memory))
        .collect();
    if strategy == DecisionStrategy::Joint {
        for (control, considered) in controls.iter_mut().zip(&considered) {
            control.optimized = Some(OptimizationStatus::from_choice(considered.decided.as_ref()));
        }
    }
    if strategy == DecisionStrategy::GroupTooLarge
        && let Some(first) = controls.first_mut()
    {
        let event = Event::new(now, EventKind::GroupTooLarge, first.id);
        first.events.push(event.with_value(own.len() as f64));
    }
    controls.into_iter().zip(considered).collect()
}

/// Returns the candidates of the airplanes of a group by a method that considers all of them.
fn decide_together(
    world: &AirspaceWorld,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
    memories: &mut [PilotMemory],
    now: Cycle,
) -> Vec<ManeuverCandidates> {
    let mut kept: Vec<ReactiveMemory> = Vec::with_capacity(memories.len());
    for memory in memories.iter_mut() {
        let resolving = std::mem::take(&mut memory.resolving);
        kept.push(ReactiveMemory { resolving, command: memory.command });
    }
    let candidates = candidates_for_group(world, group, non_cooperative, &mut kept, now);
    for (memory, kept) in memories.iter_mut().zip(kept) {
        memory.resolving = kept.resolving;
    }
    candidates
}

/// Returns the maneuver of an airplane that flies its first candidate.
fn unshielded_maneuver(own: &OwnshipState, considered: &ManeuverCandidates) -> Maneuver {
    let profile = considered.profiles.first().cloned().unwrap_or_default();
    Maneuver::Profile { candidate: 0, profile, fallback: own.fallback, is_common: false }
}

/// Returns the maneuvers that the shield allows to the airplanes of a group.
fn shielded_maneuvers(
    context: &PhaseContext<'_>,
    own: &[OwnshipState],
    non_cooperative: &[NonCooperativeAircraft],
    all: &mut [(AirplaneControl, ManeuverCandidates)],
) -> Vec<Maneuver> {
    let PhaseContext { world, now, .. } = *context;
    let group: Vec<ShieldedAircraft> =
        own.iter().map(|own| own.shielded_aircraft(world, now)).collect();
    let profiles: Vec<Vec<TurnProfile>> =
        all.iter().map(|(_, candidates)| candidates.profiles.clone()).collect();
    let beside = Surroundings {
        threats: group_threats(world.timing, &group, &profiles, non_cooperative),
        ..Surroundings::default()
    };
    let rules = PlanRules {
        steps: world.timing.points_per_dt(),
        dtau_s: world.timing.dtau_s,
        // In one process no message gets lost, so all fly the plans that they are given.
        certainty: PlanCertainty::Sure,
        ending: PlanEnding::AnyFallback,
    };
    let decisions = filter_maneuvers_beside(&group, &profiles, &beside, rules);
    let mut maneuvers = Vec::with_capacity(own.len());
    for ((decision, own), (control, candidates)) in decisions.into_iter().zip(own).zip(all) {
        control.events.extend(search_limit(&decision, own.id, now));
        maneuvers.push(Maneuver::from_decision(decision, candidates));
    }
    maneuvers
}
