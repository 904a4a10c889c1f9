//! *Act*: the airplanes of a group decide together and fly for `dt`.
//!
//! ```text
//! prepare          airplanes come in, orders are carried out      entry.rs, orders.rs
//! Percept          what each perceives                            join.rs
//!   -> Control     the decision for each: by one process for all (direct.rs), their pilots (deploy/),
//!                  or pilots outside of the run (fleet.rs)
//! apply_controls   the controls are stored                        controls.rs, protect.rs
//! step_all         all fly                                        step.rs
//! ```

mod approaches;
mod controls;
mod direct;
mod entry;
mod errors;
mod flight;
mod orders;
mod protect;
mod step;

use super::decide::{ManeuverCandidates, straight_profile};
use super::deploy;
use super::join::ControlledGroup;
use super::non_cooperative::NonCooperative;
use super::perceive::{known_aircraft, non_cooperative_aircraft, ownship_state};
use super::pilot::{Control, OwnshipState};
use super::scratch::PhaseContext;
use super::settings::Deployment;
use super::shield::TurnProfile;
use controls::apply_controls;
use flight::{AircraftMotion, FlownPath};
use sidestep_kernel::Slot;

/// Lets a group decide, the shield filter, and all fly, together with those on recorded ways.
pub(super) fn act(turn: &mut PhaseContext<'_>, group: &[Slot]) {
    let PhaseContext { world, state, now, .. } = *turn;
    let mut flying = std::mem::take(&mut turn.scratch.flying);
    flying.clear();
    flying.extend(group.iter().filter(|&&slot| state.is_active(world, slot, now)));
    flying.sort_unstable();
    if !flying.is_empty() {
        let before = turn.scratch.events.len();
        fly(turn, &flying);
        for event in &mut turn.scratch.events[before..] {
            let cell = &state.airplanes[event.airplane as usize];
            let [x_m, y_m] = cell.pose().at;
            event.at_m = Some([x_m, y_m, cell.altitude_m.get()]);
        }
    }
    turn.scratch.flying = flying;
}

/// Flies a group for one `dt`; `group` are the airplanes in the air, by id.
fn fly(turn: &mut PhaseContext<'_>, group: &[Slot]) {
    let PhaseContext { world, state, now, .. } = *turn;
    let flown = prepare(turn, group);
    let intruders = non_cooperative_aircraft(turn, group);
    let mut ways = turn_profiles(turn, &flown, &intruders).into_iter();
    let flights = group.iter().map(|&slot| {
        let course = match &world.airplanes[slot as usize].track {
            Some(track) if world.is_replayed(slot, now) => FlownPath::Track(track),
            _ if world.is_non_cooperative(slot, now) => {
                let known = known_aircraft(world, state, now, slot);
                FlownPath::Profile(straight_profile(world, known), state.segment(world, slot))
            }
            _ => FlownPath::Profile(ways.next().unwrap_or_default(), state.segment(world, slot)),
        };
        AircraftMotion::new(turn, slot, course)
    });
    let flights = flights.collect();
    step::step_all(turn, flights);
}

/// Prepares the decisions: airplanes come in, names of pairs begin and end, and orders that are due are carried out.
/// Returns the airplanes of a group that the method flies; `group` are those in the air, by id.
pub(super) fn prepare(turn: &mut PhaseContext<'_>, group: &[Slot]) -> ControlledGroup {
    // Nearness is that at the time when the group was formed, because orders change levels.
    let flown = ControlledGroup::from_group(turn, group);
    if turn.world.shield {
        entry::release_exempt(turn, &flown.ids);
        entry::assign_fallbacks(turn, &flown.ids);
        errors::report_beyond_bound(turn, &flown.ids);
    }
    orders::carry_out(turn, group, &flown.ids);
    flown
}

/// Returns the ways of the airplanes that the method flies: as those aboard decide, or as given by pilots outside of
/// the run.
fn turn_profiles(
    turn: &mut PhaseContext<'_>,
    flown: &ControlledGroup,
    intruders: &[NonCooperative],
) -> Vec<TurnProfile> {
    let PhaseContext { world, state, now, .. } = *turn;
    let own: Vec<OwnshipState> = flown.ids.iter().map(|&slot| ownship_state(turn, slot)).collect();
    let contacts = turn.scratch.trace.as_ref().map(|notes| state.traffic_picture(notes.slot));
    let (controls, considered): (Vec<Option<Control>>, Vec<ManeuverCandidates>) =
        if state.has_controls(now) {
            (state.take_controls(&flown.ids), vec![ManeuverCandidates::default(); own.len()])
        } else {
            let all = match world.deployment {
                Deployment::Direct => direct::decide(turn, &own, intruders),
                _ => deploy::decide_group(turn, flown, intruders),
            };
            all.into_iter().map(|(control, considered)| (Some(control), considered)).unzip()
        };
    if let Some(notes) = &mut turn.scratch.trace {
        notes.contacts = contacts.unwrap_or_default();
        notes.record_decisions(world, &own, intruders, &controls, &considered);
    }
    let ways = apply_controls(turn, &own, intruders, controls);
    if let Some(notes) = &mut turn.scratch.trace {
        notes.flown = notes.own_part(&ways).cloned();
    }
    ways
}
