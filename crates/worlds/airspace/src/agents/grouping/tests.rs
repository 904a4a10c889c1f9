//! Agents that look for their groups, over links of which some never carry anything.

use super::*;
use crate::flight::{MethodCommand, Pose2, Surface};
use crate::shield::{Fallback, OrbitSide};
use link::ProtocolAgent as _;
use proptest::prelude::*;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use std::sync::Arc;

/// Pairs that are near each other, and those of them that hear each other.
struct Links {
    near: Vec<Vec<bool>>,
    hears: Vec<Vec<bool>>,
}

impl Links {
    fn drawn(n: usize, near: f64, heard: f64, draws: &mut Draws) -> Self {
        let mut links = Self { near: vec![vec![false; n]; n], hears: vec![vec![false; n]; n] };
        for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let is_near = draws.uniform() < near;
            (links.near[i][j], links.near[j][i]) = (is_near, is_near);
            links.hears[i][j] = is_near && draws.uniform() < heard;
            links.hears[j][i] = is_near && draws.uniform() < heard;
        }
        links
    }

    /// Returns all airplanes to which a chain of pairs that hear each other leads.
    fn chain(&self, from: usize) -> Vec<EntityId> {
        let mut chain = vec![from];
        let mut k = 0;
        while k < chain.len() {
            let i = chain[k];
            let linked = |j: &usize| self.hears[i][*j] && self.hears[*j][i] && !chain.contains(j);
            let more: Vec<usize> = (0..self.near.len()).filter(linked).collect();
            chain.extend(more);
            k += 1;
        }
        chain.sort_unstable();
        chain.into_iter().map(id).collect()
    }

    fn agent(&self, i: usize, certainty: PlanCertainty) -> GroupingAgent {
        let near: Vec<usize> =
            (0..self.near.len()).filter(|&j| j == i || self.near[i][j]).collect();
        GroupingAgent::new(GroupingInput {
            me: near.iter().position(|&j| j == i).expect("it is among them"),
            expected: vec![true; near.len()],
            near: near.into_iter().map(sighted).collect(),
            non_cooperative: Vec::new(),
            airplanes: 100,
            command_limits: Arc::default(),
            surface: Surface::Plane,
            range_m: f64::INFINITY,
            certainty,
        })
    }
}

/// Ids differ from places.
fn id(place: usize) -> EntityId {
    3 * place as EntityId + 1
}

fn sighted(place: usize) -> SurveillanceReport {
    let pose = Pose2 { at: [1000.0 * place as f64, 0.0], heading_rad: 0.1 };
    SurveillanceReport {
        id: id(place),
        pose,
        altitude_m: 0.0,
        orbit: (place == 1).then_some(OrbitSide::Left),
        tracked: None,
        command: MethodCommand::NONE,
    }
}

/// Lets all look for their groups; messages come in any order. Returns the group that each has found, and the number
/// of messages sent.
fn found(
    links: &Links,
    certainty: PlanCertainty,
    draws: &mut Draws,
) -> (Vec<Vec<EntityId>>, usize) {
    let n = links.near.len();
    let mut agents: Vec<GroupingAgent> = (0..n).map(|i| links.agent(i, certainty)).collect();
    let (mut due, mut sent) = (Vec::new(), 0);
    let mut say = |due: &mut Vec<(usize, usize, Vec<GroupingMessageItem>)>,
                   from: usize,
                   outgoing: Vec<Vec<GroupingMessageItem>>| {
        for items in outgoing {
            let to = (0..n).filter(|&to| links.near[from][to]);
            sent += to.clone().count();
            due.extend(to.filter(|&to| links.hears[to][from]).map(|to| (from, to, items.clone())));
        }
    };
    for (i, agent) in agents.iter_mut().enumerate() {
        let outgoing = agent.start();
        say(&mut due, i, outgoing);
    }
    loop {
        while !due.is_empty() {
            let (from, to, items) = due.swap_remove(draws.uniform_below(due.len() as u32) as usize);
            let seen = &agents[to].input.near;
            let place = seen.binary_search_by_key(&id(from), |one| one.id).expect("near");
            agents[to].check_message(place, &items).expect("sound");
            let outgoing = agents[to].on_message(place, items);
            say(&mut due, to, outgoing);
        }
        if agents.iter().all(|agent| agent.is_done()) {
            break;
        }
        // One that is there answers that it waits, too, and is not given up.
        let never_answers = |i: usize, agent: &GroupingAgent| {
            let is_cut = |&place: &usize| {
                let other = (0..n).find(|&j| id(j) == agent.input.near[place].id).expect("near");
                !links.hears[i][other] || !links.hears[other][i]
            };
            agent.awaited_members().into_iter().find(is_cut)
        };
        let mut all = agents.iter().enumerate();
        let (i, place) = all
            .find_map(|(i, agent)| Some((i, never_answers(i, agent)?)))
            .expect("nobody waits for what never comes");
        let outgoing = agents[i].on_peer_gone(place, false);
        say(&mut due, i, outgoing);
    }
    let members = |agent: &GroupingAgent| {
        let found = agent.outcome().expect("done");
        found.members.iter().map(|one| one.id).collect()
    };
    (agents.iter().map(members).collect(), sent)
}

proptest! {
    /// Whichever links work, both ways or one way only: no two disagree.
    #[test]
    fn all_find_those_to_whom_others_lead_that_hear_each_other(
        seed in any::<u64>(), n in 1usize..9, near in 0.2f64..1.0, heard in 0.3f64..1.0,
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(904));
        let links = Links::drawn(n, near, heard, &mut draws);
        let (groups, _) = found(&links, PlanCertainty::Mixable, &mut draws);
        for (i, group) in groups.iter().enumerate() {
            prop_assert_eq!(group, &links.chain(i), "airplane {}", i);
        }
    }

    #[test]
    fn where_nothing_is_lost_all_find_the_whole_group_without_a_report(
        seed in any::<u64>(), n in 1usize..12, near in 0.1f64..1.0,
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(905));
        let links = Links::drawn(n, near, 1.0, &mut draws);
        let (groups, _) = found(&links, PlanCertainty::Sure, &mut draws);
        for (i, group) in groups.iter().enumerate() {
            prop_assert_eq!(group, &links.chain(i), "airplane {}", i);
        }
    }
}

proptest! {
    /// Items come in any order, again and again, and for some airplanes a lie comes before their own items.
    #[test]
    fn what_is_known_is_enough_as_soon_as_it_is_when_all_is_looked_at_anew(
        seed in any::<u64>(), n in 1usize..10, near in 0.1f64..1.0, heard in 0.3f64..1.0,
        is_sure in any::<bool>(),
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(908));
        let links = Links::drawn(n, near, heard, &mut draws);
        let ids = |of: &[bool]| (0..n).filter(|&j| of[j]).map(id).collect::<Vec<_>>();
        let beacon = |i: usize| Beacon { own: sighted(i), near: ids(&links.near[i]), non_cooperative: Vec::new() };
        let mut roster = BeaconStore::new(beacon(0), is_sure);
        for _ in 0..12 * n {
            let i = draws.uniform_below(n as u32) as usize;
            let lie = Beacon { near: Vec::new(), ..beacon(i) };
            // Whether it is new does not matter here.
            let _ = match draws.uniform_below(4) {
                0 if i > 0 => roster.add_beacon(lie, false),
                0 | 1 => roster.add_report(id(i), ids(&links.hears[i])),
                _ => roster.add_beacon(beacon(i), i > 0 && draws.uniform_below(2) == 0),
            };
            prop_assert_eq!(roster.advance_group_search(), roster.is_complete(id(0)));
        }
    }
}

/// A crowd in which all see all, and each passes on items that all have heard already: to look at all links at each
/// message would take minutes.
#[test]
fn a_crowd_of_hundreds_is_found_at_once() {
    let n = 600;
    let all: Vec<Vec<bool>> = (0..n).map(|i| (0..n).map(|j| i != j).collect()).collect();
    let links = Links { near: all.clone(), hears: all };
    let mut agent = links.agent(0, PlanCertainty::Sure);
    agent.start();
    let near = |i: usize| (0..n).filter(|&j| j != i).map(id).collect();
    for i in (1..n).rev() {
        let beacon = Beacon { own: sighted(i), near: near(i), non_cooperative: Vec::new() };
        for from in [i, 1 + i % (n - 1), i] {
            assert!(
                agent
                    .on_message(from, vec![GroupingMessageItem::Beacon(beacon.clone())])
                    .is_empty()
            );
        }
    }
    assert_eq!(agent.outcome().expect("all is known").members.len(), n);
}

#[test]
fn among_those_that_all_see_each_other_nothing_is_passed_on() {
    let mut draws = Streams::new(Seed(1)).draws(0, 0, Purpose(906));
    let links = Links::drawn(6, 1.0, 1.0, &mut draws);
    assert_eq!(found(&links, PlanCertainty::Sure, &mut draws).1, 6 * 5, "a beacon to each");
    assert_eq!(found(&links, PlanCertainty::Mixable, &mut draws).1, 2 * 6 * 5, "and a report");
}

#[test]
fn a_beacon_from_where_nobody_sees_its_airplane_is_refused() {
    let mut draws = Streams::new(Seed(1)).draws(0, 0, Purpose(907));
    let agent = Links::drawn(3, 1.0, 1.0, &mut draws).agent(0, PlanCertainty::Mixable);
    let right = Beacon { own: sighted(1), near: vec![id(0), id(2)], non_cooperative: Vec::new() };
    let check = |beacon: &Beacon| {
        agent.check_message(1, &vec![GroupingMessageItem::Beacon(beacon.clone())])
    };
    assert_eq!(check(&right), Ok(()));
    let altered = |alter: fn(&mut Beacon)| {
        let mut beacon = right.clone();
        alter(&mut beacon);
        check(&beacon)
    };
    assert_eq!(altered(|beacon| beacon.own.pose.at[0] += 1.0), Err(InvalidMessage::Plan));
    assert_eq!(altered(|beacon| beacon.own.altitude_m = f64::NAN), Err(InvalidMessage::Number));
    assert_eq!(altered(|beacon| beacon.near = vec![7, 1]), Err(InvalidMessage::Airplane));
    assert_eq!(altered(|beacon| beacon.near = vec![beacon.own.id]), Err(InvalidMessage::Airplane));
    assert_eq!(agent.check_message(1, &Vec::new()), Err(InvalidMessage::Length));
}

#[test]
fn a_report_takes_bytes_for_a_command_only_where_one_is_in_force() {
    let plain = sighted(1);
    let bytes = postcard::to_stdvec(&plain).expect("plain data");
    let SurveillanceReport { id, pose, altitude_m, orbit, tracked, .. } = plain;
    let without = postcard::to_stdvec(&(id, pose, altitude_m, orbit, tracked)).expect("plain data");
    assert_eq!(bytes, without);
    let tracked = TrackedState { next: 3, fallback: Fallback::from_side(OrbitSide::Right) };
    let command = MethodCommand { level: None, v_m_s: Some(31.0) };
    for tracked in [None, Some(tracked)] {
        for command in [MethodCommand::NONE, command] {
            let report = SurveillanceReport { tracked, command, ..plain };
            let bytes = postcard::to_stdvec(&report).expect("plain data");
            assert_eq!(postcard::from_bytes(&bytes), Ok(report));
        }
    }
}
