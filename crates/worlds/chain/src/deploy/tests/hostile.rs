//! Bytes that no agent sends: they are counted and dropped in any case, and never cause a panic.

use super::{network, sights};
use crate::agents::{ConnectorAgent, ConnectorPercept, Intention, MotionProtocol};
use crate::motion::recovery::{InitiatorSituation, RecoveryLimits, RecoveryMemory};
use proptest::prelude::*;
use sidestep_kernel::Cycle;
use sidestep_kernel::network::{
    ConversationId, DropReason, NetworkAgent, OutgoingPacket, PacketBuffer, PacketHeader,
    parse_packet,
};
use sidestep_rods::geometry::Point;
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{Chain, Connector, Obstacles, ReactionRules, RequestSource, Rod};

const N: usize = 5;

fn chain() -> Chain<2> {
    let rod = Rod { min_m: 0.4, max_m: 0.5, radius_m: 0.02 };
    Chain::straight([0.0, 0.0], [-1.0, 0.0], N - 1, rod, Connector::free(0.05)).expect("a chain")
}

fn shown(to: Point<2>) -> Vec<ConnectorPercept<2>> {
    let wish = Intention {
        to: WirePoint(to),
        source: RequestSource::Autonomous,
        situation: InitiatorSituation::default(),
        memory: RecoveryMemory::default(),
        is_empty: false,
        is_open: false,
    };
    sights(&chain(), &Obstacles::default(), 2, &wish)
}

fn agents() -> Vec<ConnectorAgent<2>> {
    let network = network(0.1, 0.0, 0.0, 500.0);
    let rules = ReactionRules { backtracks: 0, ..ReactionRules::default() };
    let agent = |k| {
        ConnectorAgent::from_chain(&chain(), k, &rules, RecoveryLimits::default())
            .with_network(Some(&network))
    };
    (0..N as u32).map(agent).collect()
}

/// All packets of a talk without losses, with their senders.
fn packets() -> Vec<(u32, OutgoingPacket)> {
    let mut agents = agents();
    let mut all = Vec::new();
    for (k, sight) in shown([-0.8, 0.6]).into_iter().enumerate() {
        agents[k].start(sight, 0).expect("a sight");
    }
    let mut waiting: Vec<(u32, OutgoingPacket)> = Vec::new();
    loop {
        for agent in &mut agents {
            let id = agent.id();
            waiting.extend(agent.take_packets().into_iter().map(|out| (id, out)));
        }
        if waiting.is_empty() {
            return all;
        }
        for (from, out) in std::mem::take(&mut waiting) {
            agents[out.to[0] as usize].on_packet(from, &out.payload, 0);
            all.push((from, out));
        }
    }
}

/// A packet around any bytes, as one of the chain would send it in a cycle.
fn sealed(sender: u32, cycle: Cycle, message: &[u8]) -> Vec<u8> {
    let talk = ConversationId::new(cycle, MotionProtocol, &[0, 1, 2, 3, 4]);
    PacketBuffer::from_bytes(message).into_packet(&PacketHeader {
        fingerprint: 0,
        conversation: talk,
        sender,
        sequence: 0,
    })
}

#[test]
fn what_cannot_be_read_and_who_is_no_neighbor_is_counted_and_dropped() {
    let mut agent = agents().remove(2);
    let sight = shown([-0.8, 0.6]).remove(2);
    agent.start(sight, 0).expect("a sight");
    let (from, out) = packets().remove(0);
    for (from, bytes) in
        [(1, vec![]), (1, vec![7; 40]), (1, vec![1; 100_000]), (0, out.payload.clone())]
    {
        agent.on_packet(from, &bytes, 1);
    }
    let mut longer = out.payload;
    longer.push(0);
    agent.on_packet(from.max(1), &longer, 1);
    agent.on_timer(1_000_000);
    assert_eq!(agent.control().expect("time is up").traffic.dropped, 5);
    let refused = agent.drop_counts();
    let counts =
        [DropReason::NoPacket, DropReason::Sender, DropReason::Damaged].map(|why| refused.get(why));
    assert_eq!(counts, [3, 1, 1]);
}

/// Floods of questions, and packets of cycles to come, take a bounded room.
#[test]
fn a_flood_takes_a_bounded_room() {
    let mut agent = agents().remove(4);
    let neighbor = agents().remove(3).id();
    agent.start(shown([-0.8, 0.6]).remove(4), 0).expect("a sight");
    let flood = |k: u32| {
        let mut bytes = vec![0];
        bytes.extend(postcard::to_stdvec(&(3 * k, 0u32)).expect("numbers"));
        // Three times "Where are you?", never a confirmation.
        bytes.extend([3, 5, 5, 5]);
        sealed(neighbor, 5, &bytes)
    };
    for k in 0..10_000 {
        agent.on_packet(neighbor, &flood(k), 1);
        agent.on_packet(neighbor, &sealed(neighbor, 9, &[0, 0, 0, 0]), 1);
    }
    let sent: usize = agent.take_packets().iter().map(|out| out.payload.len()).sum();
    assert!((1000..500_000).contains(&sent), "{sent} bytes");
    assert!(agent.control().is_none(), "its time is not up");
    agent.on_timer(1_000_000);
    assert_eq!(agent.control().expect("time is up").traffic.dropped, 10_000);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn bytes_of_any_kind_never_panic(
        k in 0usize..N, from in 0u32..6, bytes in prop::collection::vec(any::<u8>(), 0..80),
        begins in any::<bool>(),
    ) {
        let mut agent = agents().remove(k);
        if begins {
            agent.start(shown([-0.8, 0.6]).remove(k), 0).expect("a sight");
        }
        agent.on_packet(from, &bytes, 1);
        agent.on_packet(from, &sealed(from, 5, &bytes), 1);
        agent.take_packets();
        agent.on_timer(1000);
        prop_assert_eq!(agent.control().is_some(), begins);
    }

    /// Packets of a real talk, some of their bytes changed, in any order, to any neighbor: whichever
    /// neighbor lies or repeats itself, agents come to a decision, and decide only whether to go.
    #[test]
    fn packets_that_were_tampered_with_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>(), 0usize..N), 1..60),
    ) {
        let real = packets();
        let mut agents = agents();
        for (k, sight) in shown([-0.8, 0.6]).into_iter().enumerate() {
            agents[k].start(sight, 0).expect("a sight");
            agents[k].take_packets();
        }
        for (tick, (packet, at, byte, to)) in (1..).zip(changes) {
            let (_, out) = &real[packet.index(real.len())];
            let (seal, message) = parse_packet::<MotionProtocol>(&out.payload, 0).expect("a real packet");
            let mut message = message.to_vec();
            let at = at.index(message.len());
            message[at] ^= byte;
            for from in [to.checked_sub(1), Some(to + 1)].into_iter().flatten() {
                let sender = from as u32;
                let payload = PacketBuffer::from_bytes(&message).into_packet(&PacketHeader { sender, ..seal });
                agents[to].on_packet(sender, &payload, tick);
                agents[to].on_timer(tick);
                agents[to].take_packets();
            }
        }
        for agent in &mut agents {
            agent.on_timer(1_000_000);
            prop_assert!(agent.control().is_some());
        }
        let controls: Vec<_> = agents.iter().map(ConnectorAgent::control).collect();
        if let Some(points) = crate::deploy::final_positions(&chain(), &controls) {
            let mut moved = chain();
            moved.points_mut().copy_from_slice(&points);
            prop_assert!(moved.max_rod_violation_m() < 1.1e-9, "no rod is torn, whoever lies");
        }
    }
}
