//! *Act*: the airplanes of a group decide together and fly for `dt`.
//!
//! ```text
//! prepare          airplanes enter, orders and commands are       entry.rs, orders.rs,
//!                  executed, and changes of level are cleared     commands.rs, levels.rs
//! Percept          what each perceives                            join.rs
//!   -> Control     the decision for each: by one process for all (direct.rs), their pilots (deploy/),
//!                  or pilots outside of the run (fleet.rs)
//! apply_controls   the controls are stored                        controls.rs, protect.rs
//! step_all         all fly                                        step.rs
//! ```

mod approaches;
mod areas;
#[cfg(test)]
pub(super) mod command_tests;
mod commands;
mod controls;
mod direct;
mod entry;
mod errors;
mod flight;
mod holds;
mod levels;
mod orders;
#[cfg(test)]
pub(super) mod performance_tests;
mod protect;
mod step;

use super::decide::{ManeuverCandidates, straight_profile};
use super::deploy;
use super::join::CooperativeGroup;
use super::perceive::{known_aircraft, ownship_state};
use super::pilot::{AirplaneControl, OwnshipState};
use super::scratch::PhaseContext;
use super::settings::Deployment;
use super::surveillance::PerceivedTraffic;
use super::trace::GroupDecisions;
use controls::{FlownProfile, apply_controls};
use flight::{AircraftCycleMotion, FlightPathSource};
use sidestep_kernel::EntitySlot;

/// Lets a group decide, the shield filter, and all fly, together with those on recorded tracks.
pub(super) fn act(context: &mut PhaseContext<'_>, group: &[EntitySlot]) {
    let PhaseContext { world, state, now, .. } = *context;
    let mut flying = std::mem::take(&mut context.scratch.flying);
    flying.clear();
    flying.extend(group.iter().filter(|&&slot| state.is_active(world, slot, now)));
    flying.sort_unstable();
    if !flying.is_empty() {
        let before = context.scratch.events.len();
        fly(context, &flying);
        // An event tells where its airplane is at the end of the cycle, which is known only now.
        for event in &mut context.scratch.events[before..] {
            let current = &state.airplanes[event.airplane as usize];
            let [x_m, y_m] = world.display_m(current.pose().at);
            event.at_m = Some([x_m, y_m, current.altitude_m.get()]);
        }
    }
    context.scratch.flying = flying;
}

/// Flies a group for one `dt`; `group` are the airplanes in the air, by id.
fn fly(context: &mut PhaseContext<'_>, group: &[EntitySlot]) {
    let PhaseContext { world, state, now, .. } = *context;
    let flown = prepare_decisions(context, group);
    let traffic = PerceivedTraffic::new(context, group);
    traffic.record(context, group);
    let mut profiles = decide_flown_profiles(context, &flown, &traffic).into_iter();
    holds::report_holds(context, &flown.ids);
    let flights = group.iter().map(|&slot| {
        let maneuver = match &world.airplanes[slot as usize].track {
            Some(track) if world.is_replayed(slot, now) => FlightPathSource::Track(track),
            _ if world.is_non_cooperative(slot, now) => {
                let known = known_aircraft(world, state, now, slot);
                FlightPathSource::Profile {
                    profile: straight_profile(world, known),
                    fallback: None,
                    segment: state.cleared_segment(world, slot),
                }
            }
            _ => {
                let FlownProfile { profile, fallback } = profiles.next().unwrap_or_default();
                let segment = state.cleared_segment(world, slot);
                FlightPathSource::Profile { profile, fallback, segment }
            }
        };
        AircraftCycleMotion::new(context, slot, maneuver)
    });
    let flights = flights.collect();
    step::fly_sub_steps(context, flights);
}

/// Prepares the decisions: airplanes enter, exemptions of pairs begin and end, orders that are due are executed, and
/// changes of level are cleared.
/// Returns the airplanes of a group that the method flies; `group` are those in the air, by id.
pub(super) fn prepare_decisions(
    context: &mut PhaseContext<'_>,
    group: &[EntitySlot],
) -> CooperativeGroup {
    // Nearness is that at the time when the group was formed, because orders change levels.
    let flown = CooperativeGroup::from_group(context, group);
    areas::pass_detours(context, &flown.ids);
    levels::keep_levels(context, group);
    if context.world.shield {
        entry::release_exempt(context, &flown.ids);
        let non_cooperative = PerceivedTraffic::non_cooperative_aircraft(context, group);
        entry::assign_fallbacks(context, &flown.ids, &non_cooperative);
        entry::renew_fallbacks(context, &flown.ids);
        areas::report_exempt_areas(context, &flown.ids);
        errors::report_beyond_bound(context, group, &flown.ids);
    }
    commands::hold_speeds(context, group);
    orders::execute_due_orders(context, group, &flown.ids);
    commands::carry_out(context, group, &flown.ids);
    levels::clear_levels(context, group, &flown.ids);
    flown
}

/// Returns what the airplanes that the method flies fly: as those aboard decide, or as given by pilots outside of the
/// run.
fn decide_flown_profiles(
    context: &mut PhaseContext<'_>,
    flown: &CooperativeGroup,
    traffic: &PerceivedTraffic,
) -> Vec<FlownProfile> {
    let PhaseContext { world, state, now, .. } = *context;
    let non_cooperative = &traffic.non_cooperative[..];
    let own: Vec<OwnshipState> =
        flown.ids.iter().map(|&slot| ownship_state(context, slot)).collect();
    let contacts = context.scratch.trace.as_ref().map(|trace| state.traffic_picture(trace.slot));
    let (controls, considered): (Vec<Option<AirplaneControl>>, Vec<ManeuverCandidates>) =
        if state.has_controls(now) {
            (state.take_controls(&flown.ids), vec![ManeuverCandidates::default(); own.len()])
        } else {
            let all = match world.deployment {
                Deployment::Direct => direct::decide(context, &own, traffic),
                _ => deploy::decide_group(context, flown, non_cooperative),
            };
            all.into_iter().map(|(control, considered)| (Some(control), considered)).unzip()
        };
    if let Some(trace) = &mut context.scratch.trace {
        trace.contacts = contacts.unwrap_or_default();
        let observations = traffic.observations.as_ref();
        trace.tracks = observations.map(|all| all.tracks_of(trace.slot).to_vec());
        let decided = GroupDecisions {
            own: &own,
            non_cooperative,
            controls: &controls,
            considered: &considered,
        };
        trace.record_decisions(world, now, &decided);
    }
    let profiles = apply_controls(context, &own, traffic, controls);
    if let Some(trace) = &mut context.scratch.trace {
        trace.flown = trace.own_part(&profiles).map(|flown| flown.profile.clone());
    }
    profiles
}
