//! The optimization of a group, by the deployment of the world.

use super::drive::{Talk, Topic, drive, run};
use super::{Deployment, note_end};
use crate::Turn;
use crate::agents::contact::{self, Beacon, Contact, Contacts, Orbiting};
use crate::agents::coordinator::{Host, Journey, parts};
use crate::agents::network::Traffic;
use crate::agents::{Briefing, Conclusion, Decided, Ended, Filed, OwnShip, informed, sampling};
use crate::flight::{Known, Point};
use crate::intruder::Intruder;
use crate::world::AirspaceWorld;
use sidestep_collectives::Estimator;
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Decisions of the agents of a group, where there are any, and the traffic.
pub(crate) type Deployed = (Vec<Option<Decided>>, Traffic);

/// Lets the agents of a group decide, and notes in `contacts` what they hear of each other.
pub(crate) fn optimized(
    turn: &mut Turn<'_>,
    group: &[Known],
    intruders: &[Intruder],
    contacts: &mut [Contacts],
) -> Deployed {
    let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
    let briefing = brief(world, now, group, intruders);
    let own = |(me, contacts): (usize, &Contacts)| {
        own_ship(world, &briefing, me, group[me], contacts.clone())
    };
    let own: Vec<OwnShip> = contacts.iter().enumerate().map(own).collect();
    let (ended, traffic) = talked(world, &Talk::new(world, state, Topic::Optimization, now), own);
    if world.network.is_some() {
        for (me, end) in ended.iter().enumerate() {
            note_end(world, now, end, (me, &briefing.ids), &contacts[me], &mut scratch.events);
            let heard = end.outcome.iter().flat_map(|came| came.beacons.iter().zip(&*briefing.ids));
            for (beacon, &id) in heard {
                if let Some(beacon) = beacon {
                    contact::note(&mut contacts[me], id, beacon.clone(), now);
                }
            }
        }
    }
    let decided = ended.into_iter().map(|end| end.outcome.and_then(|came| came.decided));
    (decided.collect(), traffic)
}

/// Builds the agents of the deployment and a network for them, and lets them talk.
fn talked(
    world: &AirspaceWorld,
    talk: &Talk<'_>,
    own: Vec<OwnShip>,
) -> (Vec<Ended<Conclusion>>, Traffic) {
    let ids = own[0].briefing.ids.clone();
    match (world.deployment, world.settings.estimator) {
        (Deployment::Pim, _) => migrated(talk, own, [(0..ids.len()).collect()].into()),
        (Deployment::HierarchicalPim, _) => {
            let at: Vec<Point> = own.iter().map(|own| own.known.pose.at).collect();
            migrated(talk, own, parts(&at).into())
        }
        (Deployment::Team, Estimator::Sampled { block, ageing }) => {
            let agents = own.into_iter().map(|own| sampling::Agent::new(own, block, ageing));
            run(talk, &ids, agents.collect())
        }
        (deployment, _) => {
            let by_model = deployment == Deployment::CompactTeam;
            let agents = own.into_iter().map(|own| informed::Agent::new(own, by_model));
            run(talk, &ids, agents.collect())
        }
    }
}

/// Lets a coordinator for each part of a group migrate.
fn migrated(
    talk: &Talk<'_>,
    own: Vec<OwnShip>,
    parts: Arc<[Vec<usize>]>,
) -> (Vec<Ended<Conclusion>>, Traffic) {
    let ((begin, end), patience) = (talk.ticks(), talk.patience());
    let host = |own: OwnShip| {
        let is_silent = talk.is_silent(own.known.slot);
        Host::new(own, parts.clone(), &Journey { begin, ticks: end - begin, patience, is_silent })
    };
    drive(talk, own.into_iter().map(host).collect())
}

/// Returns the knowledge that all agents of a group share before they talk.
pub fn brief(
    world: &AirspaceWorld,
    now: Cycle,
    group: &[Known],
    intruders: &[Intruder],
) -> Arc<Briefing> {
    let filed = |known: &Known| Filed {
        model: world.stage(known.slot, known.orders).model.clone(),
        actions: world.actions_of(known.slot).to_vec(),
        contact: filed(world, known.slot),
    };
    Arc::new(Briefing {
        now,
        ids: group.iter().map(|known| known.slot).collect(),
        filed: group.iter().map(filed).collect(),
        air: world.air(),
        objective: world.objective,
        settings: world.settings,
        streams: world.streams,
        intruders: intruders.to_vec(),
        is_shielded: world.shield,
    })
}

/// Returns the knowledge of the agent at place `me` of a group about its own airplane; `contacts`
/// hold what it has heard of others before.
pub fn own_ship(
    world: &AirspaceWorld,
    briefing: &Arc<Briefing>,
    me: usize,
    known: Known,
    contacts: Contacts,
) -> OwnShip {
    let (beacon, mission) = (beacon(world, known), world.stage(known.slot, known.orders).mission);
    OwnShip {
        me,
        known,
        options: briefing.options(me, &beacon, mission, known.next),
        beacon,
        mission: mission.to_vec(),
        contacts,
        briefing: briefing.clone(),
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
fn filed(world: &AirspaceWorld, id: EntityId) -> Contact {
    let i = id as usize;
    let heard_in = world.appears_in(i);
    let pose = world.airplanes[i].start;
    let orbiting = Orbiting { pose, as_of: heard_in, side: world.first_fallbacks[i] };
    let altitude_m = world.airplanes[i].altitude_m;
    let known = Known { slot: id, pose, next: 0, orders: 0, altitude_m };
    let beacon = beacon(world, known);
    Contact { presumed: Some(orbiting), ..Contact::heard(beacon, heard_in) }
}
