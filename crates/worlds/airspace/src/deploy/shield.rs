//! The shield of a group, over the network of the deployment.

use super::drive::{Talk, Topic, run};
use super::{Deployment, note_end};
use crate::Turn;
use crate::agents::bytes_of;
use crate::agents::contact::Contacts;
use crate::agents::exchange::{Agent, Agreed, Message, Proposal, Scene, Seen};
use crate::agents::network::Traffic;
use crate::events::{Event, EventKind};
use crate::shield::{Certainty, Decision, Flyer, Way, filter};
use sidestep_kernel::EntityId;
use std::sync::Arc;

/// Filters the wishes of the airplanes of a group. Returns the decision for each, and the traffic
/// on the network; `contacts` receive what they have heard of each other.
pub(crate) fn shielded(
    turn: &mut Turn<'_>,
    seen: Vec<Seen>,
    candidates: &[Vec<Way>],
    contacts: &mut [Contacts],
) -> (Vec<Decision>, Traffic) {
    let &mut Turn { world, state, now, ref mut scratch, .. } = turn;
    if world.network.is_none() {
        let flyers: Vec<Flyer> = seen.iter().map(|seen| seen.flyer.clone()).collect();
        let frame = (world.timing.points_per_dt(), world.timing.dtau_s);
        let decisions = filter(&flyers, candidates, frame, Certainty::Sure);
        return (decisions, proposals(world.deployment, &flyers, candidates));
    }
    let ids: Arc<[EntityId]> = seen.iter().map(|seen| seen.flyer.id).collect();
    let scene = Arc::new(Scene { air: world.air(), vertical_m: world.vertical_m, now, seen });
    let agent =
        |(me, ways): (usize, &Vec<Way>)| Agent::new(scene.clone(), me, ways, contacts[me].clone());
    let agents = candidates.iter().enumerate().map(agent).collect();
    let talk = Talk::new(world, state, Topic::Shield, now);
    let (ended, traffic) = run(&talk, &ids, agents);
    let mut decisions = Vec::with_capacity(ids.len());
    for (me, end) in ended.into_iter().enumerate() {
        note_end(world, now, &end, (me, &ids), &contacts[me], &mut scratch.events);
        let agreed = end.outcome;
        if agreed.as_ref().is_some_and(|agreed| agreed.held_back) {
            scratch.events.push(Event::of(now, EventKind::HeldBack, ids[me]));
        }
        let fallback = Decision { candidate: None, fallback: scene.seen[me].flyer.fallback };
        let decided = |agreed: Agreed| (agreed.decision, agreed.contacts);
        // Without an agreement it no longer knows where any other airplane is.
        let (decision, known) = agreed.map_or((fallback, Contacts::new()), decided);
        contacts[me] = known;
        decisions.push(decision);
    }
    (decisions, traffic)
}

/// Returns the traffic that the proposals alone take on a network that loses nothing.
fn proposals(deployment: Deployment, flyers: &[Flyer], candidates: &[Vec<Way>]) -> Traffic {
    let mut traffic = Traffic::default();
    if deployment == Deployment::Direct || flyers.len() < 2 {
        return traffic;
    }
    for (flyer, ways) in flyers.iter().zip(candidates) {
        let message = Message::Proposal(Proposal::new(flyer, ways));
        traffic.count(flyers.len() - 1, bytes_of(&message).len());
    }
    traffic
}
