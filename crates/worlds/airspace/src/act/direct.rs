//! One process that decides for all airplanes of a group.

use crate::avoid::group_threats;
use crate::baseline::ReactiveMemory;
use crate::decide::{
    DecisionStrategy, ManeuverCandidates, candidates_alone, candidates_for_group,
    candidates_in_traffic, non_cooperative_state,
};
use crate::events::{Event, EventKind, search_limit};
use crate::flight::KnownAircraft;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::pilot::{AirplaneControl, Maneuver, OptimizationStatus, OwnshipState, PilotMemory};
use crate::scratch::PhaseContext;
use crate::shield::{
    PlanCertainty, PlanEnding, PlanRules, ShieldedAircraft, Surroundings, TurnProfile,
    filter_maneuvers_beside,
};
use crate::surveillance::{GroupObservations, PerceivedTraffic, each_decides_by_tracks};
use sidestep_kernel::EntitySlot;

/// Decides for the airplanes of a group. Returns the control of each, and what it has considered.
pub(super) fn decide(
    context: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    traffic: &PerceivedTraffic,
) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    let PhaseContext { world, clock, .. } = *context;
    let start_ns = clock.thread_cpu_ns();
    let mut all = find_candidates(context, own, traffic);
    context.scratch.decide_ns += clock.thread_cpu_ns() - start_ns;
    let maneuvers: Vec<Maneuver> = if world.shield {
        shielded_maneuvers(context, own, &traffic.non_cooperative, &mut all)
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
    traffic: &PerceivedTraffic,
) -> Vec<(AirplaneControl, ManeuverCandidates)> {
    let PhaseContext { world, state, now, .. } = *context;
    let non_cooperative = &traffic.non_cooperative[..];
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
            let mut kept = take_reactive_memories(&mut memories);
            let candidates = match &traffic.observations {
                Some(observations) if each_decides_by_tracks(world) => {
                    candidates_by_tracks(context, &group, observations, &mut kept)
                }
                _ => candidates_for_group(world, &group, non_cooperative, &mut kept, now),
            };
            for (memory, kept) in memories.iter_mut().zip(kept) {
                memory.resolving = kept.resolving;
            }
            candidates
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

/// Takes out what a method keeps of the airplanes of a group.
fn take_reactive_memories(memories: &mut [PilotMemory]) -> Vec<ReactiveMemory> {
    let mut kept: Vec<ReactiveMemory> = Vec::with_capacity(memories.len());
    for memory in memories {
        let resolving = std::mem::take(&mut memory.resolving);
        kept.push(ReactiveMemory { resolving, command: memory.command });
    }
    kept
}

/// Returns the candidates of airplanes each of which decides by itself, from its own tracks.
fn candidates_by_tracks(
    context: &PhaseContext<'_>,
    group: &[KnownAircraft],
    observations: &GroupObservations,
    kept: &mut [ReactiveMemory],
) -> Vec<ManeuverCandidates> {
    let PhaseContext { world, now, .. } = *context;
    let mut all = Vec::with_capacity(group.len());
    for (known, memory) in group.iter().zip(kept) {
        let mut cooperative = Vec::new();
        let mut non_cooperative = Vec::new();
        for track in observations.tracks_of(known.slot) {
            if world.is_non_cooperative(track.slot, now) {
                non_cooperative.push(track.non_cooperative_aircraft(world));
            } else {
                cooperative.push(track);
            }
        }
        let others_at = |seconds: f64| {
            let mut others = Vec::with_capacity(cooperative.len() + non_cooperative.len());
            others.extend(cooperative.iter().map(|track| track.aircraft_state(world, seconds)));
            let avoiding_nobody = non_cooperative.iter();
            others.extend(avoiding_nobody.map(|one| non_cooperative_state(world, one, seconds)));
            others
        };
        let own = std::slice::from_ref(known);
        let memory = std::slice::from_mut(memory);
        all.extend(candidates_in_traffic(world, own, &others_at, memory, now));
    }
    all
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
