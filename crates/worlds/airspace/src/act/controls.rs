//! The controls of a group, stored and carried out.

use super::areas::report_areas_ahead;
use super::protect::{exempt_non_cooperative, store_maneuver};
use crate::agents::network_traffic::NetworkTraffic;
use crate::decide::{OptimizationRecord, joint_action_cost};
use crate::events::{Event, EventKind};
use crate::flight::KnownAircraft;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::pilot::{AirplaneControl, Maneuver, OptimizationStatus, OwnshipState};
use crate::scratch::PhaseContext;
use crate::shield::{Fallback, TurnProfile};
use crate::surveillance::PerceivedTraffic;
use sidestep_kernel::EntityId;

/// What an airplane flies for one `dt`.
#[derive(Debug, Default)]
pub(super) struct FlownProfile {
    pub(super) profile: TurnProfile,
    /// The fallback on which the profile keeps it, if it does.
    pub(super) fallback: Option<Fallback>,
}

/// Stores the controls of the airplanes of a group that the method flies, and returns the turn profiles that they
/// fly. One without a control stays on its stored fallback.
pub(super) fn apply_controls(
    context: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    traffic: &PerceivedTraffic,
    mut controls: Vec<Option<AirplaneControl>>,
) -> Vec<FlownProfile> {
    let PhaseContext { world, state, .. } = *context;
    record_outcomes(context, own, &traffic.non_cooperative, &controls);
    if world.shield && world.network.is_none() && controls.iter().any(Option::is_none) {
        // Plans that are sure are safe only if all fly them, and orbits always are.
        for control in controls.iter_mut().flatten() {
            control.maneuver = Maneuver::Orbit;
            if world.has_resolution_memory() {
                control.memory.record_maneuver(&control.maneuver);
            }
        }
    }
    state.drop_external_actions(&own.iter().map(|own| own.id).collect::<Vec<_>>());
    let near: Vec<&NonCooperativeAircraft> =
        traffic.non_cooperative.iter().chain(&traffic.unseen).collect();
    let mut profiles = Vec::with_capacity(own.len());
    for (own, control) in own.iter().zip(controls) {
        let maneuver = match control {
            Some(AirplaneControl { maneuver, memory, .. }) => {
                state.put_memory(own.id, memory);
                maneuver
            }
            None => Maneuver::Orbit,
        };
        store_maneuver(context, own.id, &maneuver);
        if world.shield {
            report_areas_ahead(context, own, &maneuver);
        }
        let flown = match maneuver {
            Maneuver::Profile { profile, .. } => FlownProfile { profile, fallback: None },
            Maneuver::Orbit => {
                FlownProfile { profile: own.fallback_profile(world), fallback: Some(own.fallback) }
            }
        };
        if world.shield {
            exempt_non_cooperative(context, own, &near, &flown.profile);
        }
        profiles.push(flown);
    }
    profiles
}

/// Records the outcome of the conversations of a group, and missing controls.
fn record_outcomes(
    context: &mut PhaseContext<'_>,
    own: &[OwnshipState],
    non_cooperative: &[NonCooperativeAircraft],
    controls: &[Option<AirplaneControl>],
) {
    let PhaseContext { world, now, .. } = *context;
    let scratch = &mut *context.scratch;
    for (own, control) in own.iter().zip(controls) {
        match control {
            Some(control) => scratch.events.extend_from_slice(&control.events),
            None => scratch.events.push(Event::new(now, EventKind::Absent, own.id)),
        }
    }
    let mut grouping = NetworkTraffic::default();
    let mut deciding = NetworkTraffic::default();
    let mut shielding = NetworkTraffic::default();
    let mut optimized: Vec<OptimizationStatus> = Vec::new();
    for control in controls.iter().flatten() {
        grouping.add_participant_traffic(control.grouping);
        deciding.add_participant_traffic(control.deciding);
        shielding.add_participant_traffic(control.shielding);
        optimized.extend(control.optimized);
    }
    scratch.grouped.add(grouping);
    scratch.exchanged.add(shielding);
    if optimized.is_empty() {
        // Nothing was optimized: the airplanes have exchanged their intentions.
        scratch.exchanged.add(deciding);
        return;
    }
    let are_all_decided =
        optimized.len() == own.len() && optimized.iter().all(|one| one.is_decided);
    // Where messages get lost, airplanes may know different costs: then that of what all fly is unknown.
    let first = optimized.first().and_then(|one| one.reached);
    let is_agreed = are_all_decided && optimized.iter().all(|one| one.reached == first);
    let mut reached = first.filter(|_| is_agreed);
    let mut minimum = None;
    if are_all_decided && own.len() <= world.minimum_up_to {
        let group: Vec<KnownAircraft> = own.iter().map(OwnshipState::as_known_aircraft).collect();
        let joint: Vec<usize> = optimized.iter().map(|one| one.chosen as usize).collect();
        let cost = joint_action_cost(world, &group, non_cooperative, &joint, now);
        reached = Some(cost.reached);
        minimum = cost.minimum;
    }
    let ids = own.iter().map(|own| own.id);
    scratch.optimizations.push(OptimizationRecord {
        cycle: now,
        airplane: ids.min().unwrap_or(EntityId::MAX),
        airplanes: own.len() as u32,
        rounds: optimized.iter().find(|one| one.is_decided).map_or(0, |one| one.rounds),
        converged: optimized.iter().any(|one| one.is_decided)
            && optimized.iter().all(|one| one.converged || !one.is_decided),
        reached,
        minimum,
        traffic: deciding,
    });
}
