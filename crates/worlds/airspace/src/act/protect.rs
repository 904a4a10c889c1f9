//! Airplanes in the form that the shield knows, and the ways that it allows them.

use crate::Turn;
use crate::agents::contact::Contacts;
use crate::agents::exchange::Seen;
use crate::deploy;
use crate::events::{Event, EventKind};
use crate::flight::{Levels, Stage, distance_m};
use crate::shield::{Decision, Flyer, Way};
use crate::state::{AirspaceState, Cell};
use crate::world::AirspaceWorld;
use sidestep_kernel::Slot;

/// Distance in meters beyond which all goals rank alike.
const FARTHEST_M: f64 = 2e9;
/// Part of a `dt`'s way by which a refusal brings an airplane forward in rank, so that it does not
/// wait for ever.
const REFUSED_PART: f64 = 0.125;

/// Returns the part of an airplane that the shield knows.
pub(super) fn flyer(world: &AirspaceWorld, state: &AirspaceState, slot: Slot) -> Flyer {
    let (cell, stage) = (&state.airplanes[slot as usize], state.stage(world, slot));
    Flyer {
        id: slot,
        pose: cell.pose(),
        v_m_s: stage.model.v_m_s,
        omega_max_rad_s: stage.model.omega_max_rad_s,
        separation_m: stage.model.separation_m,
        levels: Levels::between(cell.altitude_m.get(), stage.altitude_m),
        vertical_m: world.vertical_m,
        fallback: cell.side(),
        came_too_close: cell.came_too_close(),
        rank: rank(world.timing.dt_s, cell, &stage, slot),
    }
}

/// Returns the rank of an airplane. It is higher the nearer its goal is, so that it is soon out of
/// the others' way, and the more often its wish was refused, so that nobody waits for ever. Whole
/// meters in the upper half; the id in the lower half makes it unique.
fn rank(dt_s: f64, cell: &Cell, stage: &Stage<'_>, slot: Slot) -> u64 {
    let ahead = &stage.mission[(cell.next.get() as usize).min(stage.mission.len())..];
    let legs = ahead
        .iter()
        .scan(cell.pose().at, |from, &to| Some(distance_m(std::mem::replace(from, to), to)));
    let refused_m = f64::from(cell.overrides.get()) * stage.model.v_m_s * dt_s;
    // The conversion saturates at the ends of the range.
    let first = (FARTHEST_M + REFUSED_PART * refused_m - legs.sum::<f64>()) as u32;
    u64::from(first) << 32 | u64::from(!slot)
}

/// Returns the ways that the airplanes of a group fly, out of those that they wish to fly.
pub(super) fn shielded(
    turn: &mut Turn<'_>,
    group: &[Slot],
    candidates: Vec<Vec<Way>>,
    contacts: &mut [Contacts],
) -> Vec<Way> {
    let Turn { world, state, .. } = *turn;
    let seen = |&slot: &Slot| Seen {
        flyer: flyer(world, state, slot),
        orbits: state.airplanes[slot as usize].orbiting.get() > 0,
    };
    let seen: Vec<Seen> = group.iter().map(seen).collect();
    let fallbacks: Vec<Way> = seen.iter().map(|seen| orbit(world, &seen.flyer)).collect();
    let (decisions, traffic) = deploy::shielded(turn, seen, &candidates, contacts);
    turn.scratch.exchanged.add(traffic);
    for (decision, &slot) in decisions.iter().zip(group) {
        note(turn, slot, decision);
    }
    let wishes = candidates.into_iter().zip(fallbacks);
    let flown = wishes.zip(decisions).map(|((mut wishes, fallback), decision)| {
        decision.candidate.map_or(fallback, |k| wishes.swap_remove(k))
    });
    flown.collect()
}

/// Stores the decision for an airplane, and records it as an event.
fn note(turn: &mut Turn<'_>, slot: Slot, decision: &Decision) {
    let &mut Turn { state, now, ref mut scratch, .. } = turn;
    let cell = &state.airplanes[slot as usize];
    cell.set_side(decision.fallback);
    if decision.candidate != Some(0) {
        cell.overrides.set(cell.overrides.get() + 1);
    }
    match decision.candidate {
        Some(k) => {
            cell.orbiting.set(0);
            if k > 0 {
                let event = Event::of(now, EventKind::Override, slot);
                scratch.events.push(event.with(k as f64));
            }
        }
        None => {
            cell.orbits.set(cell.orbits.get() + 1);
            cell.orbiting.set(cell.orbiting.get() + 1);
            scratch.events.push(Event::of(now, EventKind::Orbit, slot));
        }
    }
}

/// Returns the stored fallback of an airplane, for one `dt`.
fn orbit(world: &AirspaceWorld, flyer: &Flyer) -> Way {
    let omega = flyer.fallback.sign() * flyer.omega_max_rad_s;
    Way { omegas_rad_s: vec![omega; world.timing.points_per_dt()] }
}
