//! The knowledge with which an airplane goes into a talk: its perceptions, and the filed flights.

use super::sight::{Own, Sight, Sighted};
use crate::agents::contact::{Beacon, Contact, Contacts, Orbiting};
use crate::agents::exchange::{Scene, Seen};
use crate::agents::{Briefing, Filed, OwnShip};
use crate::flight::{Known, Levels, Pose};
use crate::intruder::Intruder;
use crate::shield::{Certainty, Flyer, Side};
use crate::world::AirspaceWorld;
use sidestep_kernel::{EntityId, math};
use std::sync::Arc;

/// Returns the knowledge that all agents of a group share before they talk. The airplanes nearby that are `not_heard`
/// differ between agents; each takes its own to fly straight on.
pub(super) fn brief(world: &AirspaceWorld, sight: &Sight, not_heard: &[Sighted]) -> Arc<Briefing> {
    let straight = not_heard.iter().map(|one| unheard(world, one));
    Arc::new(Briefing {
        now: sight.cycle,
        ids: sight.members().into(),
        filed: sight.group.iter().map(|one| filed(world, one.id)).collect(),
        poses: sight.group.iter().map(|one| one.pose).collect(),
        air: world.air(),
        objective: world.objective,
        settings: world.settings,
        streams: world.streams,
        intruders: sight.intruders.iter().cloned().chain(straight).collect(),
        is_shielded: world.shield,
    })
}

/// Returns the knowledge of an airplane's agent; `contacts` hold its knowledge of others from earlier cycles.
pub(super) fn own_ship(
    world: &AirspaceWorld,
    sight: &Sight,
    unheard: &[Sighted],
    contacts: &Contacts,
) -> OwnShip {
    let (briefing, known) = (brief(world, sight, unheard), sight.own.known());
    let (beacon, mission) = (beacon(world, known), world.stage(known.slot, known.orders).mission);
    let me = sight.me();
    OwnShip {
        me,
        known,
        options: briefing.options(me, &beacon, mission, known.next),
        beacon,
        mission: mission.to_vec(),
        contacts: contacts.clone(),
        briefing,
    }
}

/// Returns a flight as it was filed.
pub(super) fn filed(world: &AirspaceWorld, id: EntityId) -> Filed {
    let orders = world.airplanes[id as usize].orders.len();
    let way_points = |done: usize| world.stage(id, done as u32).mission.len();
    Filed {
        model: world.airplanes[id as usize].model.clone(),
        actions: world.actions_of(id).to_vec(),
        contact: presumed(world, id),
        top_m_s: world.top_m_s[id as usize],
        most_way_points: (0..=orders).map(way_points).max().unwrap_or(0),
        orders,
    }
}

/// Returns the message in which an airplane describes itself.
fn beacon(world: &AirspaceWorld, known: Known) -> Beacon {
    let stage = world.stage(known.slot, known.orders);
    Beacon {
        pose: known.pose,
        goal: stage.mission.get(known.next).copied(),
        v_m_s: stage.model.v_m_s,
        omega_max_rad_s: stage.model.omega_max_rad_s,
        orbit_rad_s: world.orbit_rad_s[known.slot as usize],
        separation_m: stage.model.separation_m,
        levels: world.levels(known),
    }
}

/// Returns the knowledge that all have of a flight before they have heard it: its filed plan.
fn presumed(world: &AirspaceWorld, id: EntityId) -> Contact {
    let i = id as usize;
    let heard_in = world.appears_in(i);
    let pose = world.airplanes[i].start;
    let orbiting = Orbiting { pose, as_of: heard_in, side: world.first_fallbacks[i] };
    let altitude_m = world.airplanes[i].altitude_m;
    let known = Known { slot: id, pose, next: 0, orders: 0, altitude_m };
    Contact { presumed: Some(orbiting), ..Contact::heard(beacon(world, known), heard_in) }
}

/// Returns whether plans that all have made from the same messages are sure to be flown.
pub(super) fn certainty(world: &AirspaceWorld) -> Certainty {
    match world.network {
        Some(_) => Certainty::Mixable,
        None => Certainty::Sure,
    }
}

/// Returns the scene of the shield's exchange, as an airplane sees it: its group, and those nearby that are
/// `unheard`.
pub(super) fn scene(world: &AirspaceWorld, sight: &Sight, unheard: &[Sighted]) -> Scene {
    let seen = |(one, takes_part): (&Sighted, bool)| Seen {
        flyer: match one.id == sight.own.id {
            true => sight.own.flyer(world),
            false => other(world, &sight.own, one),
        },
        orbits: one.orbit.is_some(),
        takes_part,
        top_m_s: world.top_m_s[one.id as usize],
        // A way that was found by other means comes before those of its actions.
        most_ways: world.actions_of(one.id).len() + 1,
    };
    let present = sight.group.iter().map(|one| (one, true));
    let mut all: Vec<_> = present.chain(unheard.iter().map(|one| (one, false))).collect();
    all.sort_unstable_by_key(|(one, _)| one.id);
    Scene {
        air: world.air(),
        vertical_m: world.vertical_m,
        now: sight.cycle,
        certainty: certainty(world),
        airplanes: world.airplanes.len(),
        seen: all.into_iter().map(seen).collect(),
    }
}

/// Returns another airplane as the shield knows it from its visible state and its filed flight: where messages get
/// lost, no order changes its speed or its level.
fn other(world: &AirspaceWorld, own: &Own, one: &Sighted) -> Flyer {
    let stage = world.stage(one.id, 0);
    let named = own.named.binary_search(&one.id).map_or(&[][..], |_| std::slice::from_ref(&own.id));
    Flyer {
        id: one.id,
        pose: one.pose,
        held: one.pose,
        v_m_s: stage.model.v_m_s,
        omega_max_rad_s: stage.model.omega_max_rad_s,
        orbit_rad_s: world.orbit_rad_s[one.id as usize],
        separation_m: stage.model.separation_m,
        error_m: world.error_m(one.id as usize),
        levels: Levels::between(one.altitude_m, stage.altitude_m),
        vertical_m: world.vertical_m,
        fallback: one.orbit.unwrap_or(Side::Left),
        named: named.into(),
        rank: 0,
    }
}

/// Returns an airplane that was not heard as one that flies straight on, for methods that need no more than that.
pub(super) fn unheard(world: &AirspaceWorld, one: &Sighted) -> Intruder {
    let stage = world.stage(one.id, 0);
    let v_m_s = stage.model.v_m_s;
    let Pose { at, heading_rad } = one.pose;
    Intruder {
        slot: one.id,
        at,
        velocity_m_s: [v_m_s * math::cos(heading_rad), v_m_s * math::sin(heading_rad)],
        top_m_s: world.top_m_s[one.id as usize],
        separation_m: stage.model.separation_m,
        error_m: world.bounds.position_m,
        levels: Levels::between(one.altitude_m, stage.altitude_m),
        dt_s: world.timing.dt_s,
    }
}
