//! Airplanes in the form that the shield knows, and the ways that it allows them.

use super::avoid::Beset;
use crate::Turn;
use crate::agents::contact::Contacts;
use crate::agents::exchange::Seen;
use crate::deploy;
use crate::events::{Event, EventKind};
use crate::flight::{Levels, Pose, Stage, distance_m};
use crate::intruder::Intruder;
use crate::perceive::seen;
use crate::shield::{Decision, Flyer, Holding, Way};
use crate::state::Cell;
use sidestep_kernel::Slot;
use sidestep_kernel::math::wrap_angle;

/// Distance in meters beyond which all goals rank alike.
const FARTHEST_M: f64 = 2e9;
/// Part of a `dt`'s way by which a refusal brings an airplane forward in rank, so that it does not
/// wait for ever.
const REFUSED_PART: f64 = 0.125;

/// Returns the part of an airplane that the shield knows: it is where all see it.
pub(super) fn flyer(turn: &Turn<'_>, slot: Slot) -> Flyer {
    let Turn { world, state, now, .. } = *turn;
    let (cell, stage) = (&state.airplanes[slot as usize], state.stage(world, slot));
    Flyer {
        id: slot,
        pose: seen(world, slot, now, cell.pose()),
        held: seen(world, slot, now, state.held(slot)),
        v_m_s: stage.model.v_m_s,
        omega_max_rad_s: stage.model.omega_max_rad_s,
        orbit_rad_s: world.orbit_rad_s[slot as usize],
        separation_m: stage.model.separation_m,
        error_m: world.error_m(slot as usize),
        levels: Levels::between(cell.altitude_m.get(), stage.altitude_m),
        vertical_m: world.vertical_m,
        fallback: cell.side(),
        named: state.named_with(slot),
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
    intruders: &[Intruder],
    contacts: &mut [Contacts],
) -> Vec<Way> {
    let flyers: Vec<Flyer> = group.iter().map(|&slot| flyer(turn, slot)).collect();
    let fallbacks: Vec<Way> = group.iter().map(|&slot| on_orbit(turn, slot)).collect();
    let dtau_s = turn.world.timing.dtau_s;
    let beset: Vec<Beset<'_>> =
        flyers.iter().map(|flyer| Beset::new(flyer, intruders, dtau_s)).collect();
    let wishes = candidates.iter().zip(&fallbacks);
    let allowed = beset.iter().zip(wishes).map(|(one, (wishes, own))| one.allowed(wishes, own));
    let allowed: Vec<Vec<usize>> = allowed.collect();
    let decisions = decided(turn, &flyers, &allowed, &candidates, contacts);
    if let Some(notes) = &mut turn.scratch.notes {
        notes.shielded(&flyers, &candidates, &decisions, dtau_s);
    }
    let mut flown = Vec::with_capacity(group.len());
    for (k, mut wishes) in candidates.into_iter().enumerate() {
        let way = decisions[k].candidate.map(|wish| wishes.swap_remove(wish));
        let way = way.unwrap_or_else(|| fallbacks[k].clone());
        note(turn, group[k], &decisions[k]);
        name_intruders(turn, group[k], intruders, &beset[k], &way);
        flown.push(way);
    }
    flown
}

/// Returns the decisions of the shield for airplanes that may fly only some of their `wishes`.
fn decided(
    turn: &mut Turn<'_>,
    flyers: &[Flyer],
    allowed: &[Vec<usize>],
    wishes: &[Vec<Way>],
    contacts: &mut [Contacts],
) -> Vec<Decision> {
    let state = turn.state;
    let as_seen = |flyer: &Flyer| Seen {
        flyer: flyer.clone(),
        orbits: state.airplanes[flyer.id as usize].orbiting.get() > 0,
    };
    let seen = flyers.iter().map(as_seen).collect();
    let of = |(allowed, wishes): (&Vec<usize>, &Vec<Way>)| {
        allowed.iter().map(|&k| wishes[k].clone()).collect()
    };
    let candidates: Vec<Vec<Way>> = allowed.iter().zip(wishes).map(of).collect();
    let (mut decisions, traffic) = deploy::shielded(turn, seen, &candidates, contacts);
    turn.scratch.exchanged.add(traffic);
    if let Some(notes) = &mut turn.scratch.notes {
        notes.exchanged = traffic;
    }
    for (decision, allowed) in decisions.iter_mut().zip(allowed) {
        decision.candidate = decision.candidate.map(|k| allowed[k]);
    }
    decisions
}

/// Names an airplane with the intruders that could come too near on its way within `dt`, and ends
/// the names of others.
fn name_intruders(turn: &mut Turn<'_>, slot: Slot, all: &[Intruder], beset: &Beset<'_>, way: &Way) {
    let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
    let named = state.named_with(slot);
    if all.is_empty() && named.is_empty() {
        return;
    }
    let reached: Vec<&Intruder> = beset.reached_by(way).collect();
    let is_reached = |other: Slot| reached.iter().any(|one| one.slot == other);
    state.keep_named(slot, |other| !world.is_intruder(other, now) || is_reached(other));
    for one in all.iter().filter(|one| !is_reached(one.slot)) {
        state.keep_named(one.slot, |other| other != slot);
    }
    for one in reached.iter().filter(|one| !named.contains(&one.slot)) {
        state.name(slot, one.slot);
        scratch.too_close.push((now, slot.min(one.slot), slot.max(one.slot)));
        let apart_m = distance_m(state.airplanes[slot as usize].pose().at, one.at);
        let event = Event::of_pair(now, EventKind::Intruder, slot, one.slot);
        scratch.events.push(event.with(apart_m));
    }
}

/// Stores the decision for an airplane, and records it as an event.
fn note(turn: &mut Turn<'_>, slot: Slot, decision: &Decision) {
    if decision.candidate.is_none() {
        move_held(turn, slot);
    }
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

/// Returns the way by which an airplane keeps to its stored orbit for one `dt`.
fn on_orbit(turn: &Turn<'_>, slot: Slot) -> Way {
    let Turn { world, state, .. } = turn;
    let (cell, model) = (&state.airplanes[slot as usize], state.stage(world, slot).model);
    let (side, rate_rad_s) = (cell.side(), world.orbit_rad_s[slot as usize]);
    let (steps, gust_rad) = (world.timing.points_per_dt(), world.bounds.heading_rad);
    if gust_rad == 0.0 {
        return Way { omegas_rad_s: vec![side.sign() * rate_rad_s; steps] };
    }
    let holding = Holding::new(cell.pose(), state.held(slot), model, rate_rad_s, side);
    Way { omegas_rad_s: holding.hold(steps, world.timing.dtau_s, gust_rad) }
}

/// Moves the stored pose of an airplane along its orbit for one `dt`.
fn move_held(turn: &Turn<'_>, slot: Slot) {
    let Turn { world, state, .. } = turn;
    let (side, v_m_s) =
        (state.airplanes[slot as usize].side(), state.stage(world, slot).model.v_m_s);
    let omega = side.sign() * world.orbit_rad_s[slot as usize];
    let mut held = state.held(slot);
    for _ in 0..world.timing.points_per_dt() {
        held = world.air().blown(held.step(v_m_s, omega, world.timing.dtau_s));
    }
    state.set_held(slot, Pose { heading_rad: wrap_angle(held.heading_rad), ..held });
}
