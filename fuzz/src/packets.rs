//! Agents of the worlds, which receive unchecked packets.

use sidestep::kernel::network::{
    ConversationId, NetworkAgent, OutgoingPacket, PacketBuffer, PacketHeader, parse_packet,
};
use sidestep::scenario::Source;
use sidestep::worlds::airspace::agents::traffic_state::TrafficPicture;
use sidestep::worlds::airspace::pilot::{Percept, Pilot, Protocol};
use sidestep::worlds::airspace::{AirspaceWorld, RemotePilotRun, airspace_run};
use sidestep::worlds::chain::ChainWorldState;
use sidestep::worlds::chain::agents::{ConnectorAgent, MotionProtocol};
use sidestep::worlds::chain::scenario::ChainScenario;
use std::collections::VecDeque;
use std::sync::{Arc, LazyLock};

/// Hands packets to the agent of a connector in the middle of a chain: each begins with its sender and its
/// length. For any packets, the agent comes to a decision once time is up.
pub(crate) fn to_a_connector(mut data: &[u8]) {
    static TEAM: LazyLock<ChainScenario<2>> = LazyLock::new(|| {
        let text = "format = 1\nworld = \"chain\"\n[chain]\nself_collision = false\nbacktracks = 0\n\
                    deployment = \"team\"\nnetwork = { loss = 0.1 }\n[[obstacles]]\nat_m = [0.5, 0.3]\n\
                    radius_m = 0.2\n[[chains]]\nconnectors = 5\nrod_m = [0.4, 0.5]\n[[chains.tasks]]\n\
                    kind = \"wander\"\nconnector = 2\n";
        ChainScenario::new(&Source::new("f", text, "")).expect("our own team")
    });
    let world = &*TEAM.world;
    let state = ChainWorldState::new(world).expect("a team at its start");
    let (chain, mut sights) = world.percepts_in_cycle(&state, 0).remove(0);
    let ids: Vec<u32> = (0..sights.len() as u32).collect();
    let talk = ConversationId::new(0, MotionProtocol, &ids);
    let mut agent = ConnectorAgent::new(world, chain, 2);
    agent.start(sights.remove(2), 0).expect("a sight");
    let mut tick = 0;
    while let Some((&[from, length], rest)) = data.split_first_chunk() {
        let (packet, rest) = rest.split_at(rest.len().min(usize::from(length)));
        tick += 1;
        let sender = u32::from(from & 0x7F);
        // Few bytes bear a right checksum: half of them are given one.
        if from & 0x80 > 0 {
            agent.on_packet(sender, packet, tick);
        } else {
            let seal = PacketHeader {
                fingerprint: world.fingerprint,
                conversation: talk,
                sender,
                sequence: 0,
            };
            agent.on_packet(sender, &PacketBuffer::from_bytes(packet).into_packet(&seal), tick);
        }
        agent.on_timer(tick);
        agent.take_packets();
        data = rest;
    }
    agent.on_timer(u64::MAX);
    assert!(agent.control().is_some(), "time is up");
}

/// Settings of airplanes that talk, with every kind of message.
const TALKS: [&str; 8] = [
    "deployment = \"team\"",
    "deployment = \"compact-team\"",
    "deployment = \"team\"\npreset = \"paper\"",
    "deployment = \"compact-team\"\npreset = \"paper\"",
    "deployment = \"pim\"",
    "deployment = \"team\"\nmethod = \"mvp\"",
    "deployment = \"replica-team\"\nnetwork = { budget_bytes_s = 4000.0 }",
    "deployment = \"hierarchical-pim\"\npreset = \"paper\"\nnetwork = { loss = 0.1 }",
];

/// Lets three pilots talk, on a network driven by the data: the first byte chooses the settings, and then each four
/// bytes are a step: a packet arrives as it is, or changed with a right checksum, or damaged, or time passes.
pub(crate) fn among_pilots(data: &[u8]) {
    static FLEETS: LazyLock<Vec<(Arc<AirspaceWorld>, Vec<Percept>)>> = LazyLock::new(|| {
        let fleet = |talk: &&str| {
            let text = format!(
                "format = 1\nworld = \"airspace\"\n[airspace]\n{talk}\nmax_rounds = 3\n\
                 [airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 2600.0\n"
            );
            let run = airspace_run(&Source::new("f", text, ""), 1).expect("our own scenario");
            (run.world().clone(), run.percepts())
        };
        TALKS.iter().map(fleet).collect()
    });
    let Some((&which, steps)) = data.split_first() else { return };
    let (world, sights) = &FLEETS[usize::from(which) % FLEETS.len()];
    let mut pilots: Vec<Pilot> =
        (0..3).map(|id| Pilot::new(world.clone(), id, TrafficPicture::new())).collect();
    let (mut due, mut tick) = (VecDeque::new(), 0);
    for (pilot, sight) in pilots.iter_mut().zip(sights) {
        pilot.start(sight.clone(), tick);
    }
    for step in steps.as_chunks::<4>().0 {
        for pilot in &mut pilots {
            for OutgoingPacket { to, payload, .. } in pilot.take_packets() {
                due.extend(to.iter().map(|&other| (pilot.id(), other, payload.clone())));
            }
        }
        tick += 1;
        arrive(world, &mut pilots, &mut due, tick, *step);
    }
}

/// Carries out a step of the network.
fn arrive(
    world: &AirspaceWorld,
    pilots: &mut [Pilot],
    due: &mut VecDeque<(u32, u32, Vec<u8>)>,
    tick: u64,
    [kind, place, high, change]: [u8; 4],
) {
    if kind % 4 == 3 {
        let next = pilots.iter().filter_map(Pilot::next_timer).min().unwrap_or(tick);
        return pilots.iter_mut().for_each(|pilot| pilot.on_timer(next.max(tick)));
    }
    let Some((from, to, payload)) = due.pop_front() else { return };
    let at = usize::from(place) | usize::from(high) << 8;
    let mut bytes = payload.clone();
    match (kind % 4, parse_packet::<Protocol>(&payload, world.fingerprint)) {
        (1, Ok((seal, message))) => {
            let mut message = message.to_vec();
            let at = at % message.len().max(1);
            match message.get_mut(at) {
                Some(byte) if change > 0 => *byte ^= change,
                _ => message.truncate(at),
            }
            bytes = PacketBuffer::from_bytes(&message).into_packet(&seal);
        }
        (2, _) => {
            let at = at % bytes.len();
            bytes[at] ^= change;
        }
        _ => {}
    }
    pilots[to as usize].on_packet(from, &bytes, tick);
    if kind & 4 > 0 {
        // It gets the real packet, too, or again.
        pilots[to as usize].on_packet(from, &payload, tick);
    }
}
