//! Airplanes that enter during a run: they appear, or the method takes over from their track. Also the pairs whose
//! separation the shield does not guarantee.
//!
//! Such a pair becomes *exempt* when the later of the two enters and no joint choice of fallbacks keeps the two apart
//! beside all others (`shield/joint_fallbacks.rs`). That concerns the pair, not the two airplanes: each of them stays apart from all others. It ends for good as soon as
//! their stored fallbacks are apart, their levels do not meet, or one of them is gone; from then on the invariant holds
//! for this pair as for any other.

use super::protect::shielded_aircraft;
use crate::avoid::NonCooperativeAvoidance;
use crate::events::{Event, EventKind};
use crate::flight::TimeDiscretization;
use crate::non_cooperative::NonCooperativeAircraft;
use crate::scratch::PhaseContext;
use crate::shield::{
    EntryFallbacks, EntryRole, Fallback, OrbitSide, ShieldedAircraft, TurnProfile, entry_fallbacks,
    renewed_fallbacks,
};
use sidestep_kernel::EntitySlot;
use std::sync::Arc;

/// Ends the exemption of pairs that are safe by now. `flown` are the group's airplanes that the method
/// flies, by id.
///
/// Two airplanes that are not in one group are too far from each other to meet on their orbits, or
/// on levels that do not meet.
pub(super) fn release_exempt(context: &PhaseContext<'_>, flown: &[EntitySlot]) {
    let PhaseContext { world, state, now, .. } = *context;
    for &slot in flown {
        let exempt = state.exempt_ids(slot);
        if exempt.is_empty() {
            continue;
        }
        let own = shielded_aircraft(context, slot);
        state.retain_exempt(slot, |other| {
            // Pairs with non-cooperative aircraft are checked anew in each `dt`, in `protect.rs`.
            world.is_non_cooperative(other, now)
                || flown.binary_search(&other).is_ok()
                    && state.exempt_ids(other).contains(&slot)
                    && !own.is_safe_with(&shielded_aircraft(context, other))
        });
    }
}

/// Replaces stored fallbacks that a wind which differs from level to level or from place to place drives together, and
/// exempts the pairs for which there are none that are apart. `flown` are the group's airplanes that the method flies, by
/// id.
pub(super) fn renew_fallbacks(context: &mut PhaseContext<'_>, flown: &[EntitySlot]) {
    let PhaseContext { world, state, now, .. } = *context;
    if world.wind_field.is_none() {
        return;
    }
    let group: Vec<ShieldedAircraft> =
        flown.iter().map(|&slot| shielded_aircraft(context, slot)).collect();
    let Some(renewed) = renewed_fallbacks(&group) else { return };
    for (&slot, fallback) in flown.iter().zip(renewed.fallbacks) {
        state.airplanes[slot as usize].fallback.set(fallback);
    }
    for (i, j) in renewed.too_close {
        state.exempt_pair(flown[i], flown[j]);
        context.scratch.too_close.push((now, flown[i], flown[j]));
    }
}

/// Chooses fallbacks for the airplanes of a group that enter now, apart from the stored ones, which stay as they are unless
/// only others are apart. Pairs without such fallbacks become exempt. `flown` are the group's airplanes that the method
/// flies, by id.
///
/// Airplanes that could be too near one that enters are in its group, so none is missed. `non_cooperative` are those of the
/// group that avoid nobody: one that flies already takes another fallback only if that is clear of no fewer of them.
pub(super) fn assign_fallbacks(
    context: &mut PhaseContext<'_>,
    flown: &[EntitySlot],
    non_cooperative: &[NonCooperativeAircraft],
) {
    let PhaseContext { world, state, now, .. } = *context;
    // At the start, the first fallbacks are those of the compiled scenario.
    if now == 0 {
        return;
    }
    // Under other rules each pair has to be apart anew.
    let is_changing = world.rules_begin_at(now);
    let is_entering =
        |slot: EntitySlot| is_changing || world.first_controlled_cycle(slot as usize) == now;
    if !flown.iter().any(|&slot| is_entering(slot)) {
        return;
    }
    let mut group: Vec<ShieldedAircraft> =
        flown.iter().map(|&slot| shielded_aircraft(context, slot)).collect();
    if world.network.is_some() {
        // Others reckon with orbits of one that has just entered.
        for one in &mut group {
            one.choices = OrbitSide::BOTH.map(Fallback::from_side).into();
        }
    }
    // Where messages get lost, others know the fallbacks of those that fly from having watched them.
    let others = if world.network.is_some() { EntryRole::Keep } else { EntryRole::Yield };
    for (one, &slot) in group.iter_mut().zip(flown) {
        // Another fallback may lead to a non-cooperative aircraft.
        if !is_entering(slot) {
            one.choices = clear_choices(one, non_cooperative, world.timing);
        }
    }
    let role = |&slot: &EntitySlot| if is_entering(slot) { EntryRole::Enter } else { others };
    let roles: Vec<EntryRole> = flown.iter().map(role).collect();
    let EntryFallbacks { fallbacks, too_close, unproved } = entry_fallbacks(&group, &roles);
    for ((&slot, role), fallback) in flown.iter().zip(roles).zip(fallbacks) {
        let current = &state.airplanes[slot as usize];
        current.fallback.set(fallback);
        if role == EntryRole::Enter {
            // It depends on fallbacks of others that not all need know.
            current.tracked.set(0);
        }
    }
    for (i, j) in too_close {
        state.exempt_pair(flown[i], flown[j]);
        context.scratch.too_close.push((now, flown[i], flown[j]));
    }
    for (i, j) in unproved {
        let event = Event::new_for_pair(now, EventKind::SearchLimit, flown[i], flown[j]);
        context.scratch.events.push(event);
    }
}

/// Returns those of the fallbacks that an airplane may choose which are clear of all non-cooperative aircraft of which its
/// stored one is clear, in the next `dt`.
fn clear_choices(
    aircraft: &ShieldedAircraft,
    non_cooperative: &[NonCooperativeAircraft],
    timing: TimeDiscretization,
) -> Arc<[Fallback]> {
    let avoidance = NonCooperativeAvoidance::new(aircraft, non_cooperative, timing.dtau_s);
    if avoidance.is_alone() {
        return Arc::clone(&aircraft.choices);
    }
    let threats = |fallback: Fallback| -> Vec<EntitySlot> {
        let holding = ShieldedAircraft { fallback, ..aircraft.clone() };
        let profile = TurnProfile::on_fallback(&holding, timing.points_per_dt());
        avoidance.threats(&profile).map(|one| one.slot).collect()
    };
    let present = threats(aircraft.fallback);
    let is_as_clear =
        |choice: &&Fallback| threats(**choice).iter().all(|one| present.contains(one));
    aircraft.choices.iter().filter(is_as_clear).copied().collect()
}
