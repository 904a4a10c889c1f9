//! Arbitrary bytes: they are counted and dropped, and no pilot breaks off.

use super::*;
use crate::agents::packet::PacketHeader;
use proptest::prelude::*;
use sidestep_kernel::Seed;
use sidestep_kernel::network::{PacketBuffer, parse_packet};
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use std::collections::VecDeque;

const THREE: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 2600.0\n";

const KINDS: [&str; 14] = [
    "deployment = \"team\"",
    "deployment = \"compact-team\"",
    "deployment = \"team\"\npreset = \"paper\"",
    "deployment = \"compact-team\"\npreset = \"paper\"",
    "deployment = \"pim\"",
    "deployment = \"hierarchical-pim\"\npreset = \"paper\"",
    "deployment = \"pim\"\nnetwork = { loss = 0.2 }",
    "deployment = \"pim\"\npreset = \"paper\"\nnetwork = { loss = 0.2 }",
    "deployment = \"hierarchical-pim\"\nnetwork = { loss = 0.2 }",
    "deployment = \"team\"\nmethod = \"mvp\"",
    "deployment = \"team\"\nmethod = \"none\"\nnetwork = {}",
    "deployment = \"team\"\nnetwork = { loss = 0.2 }",
    "deployment = \"compact-team\"\ngroups = \"heard\"",
    "deployment = \"compact-team\"\ngroups = \"heard\"\nnetwork = { loss = 0.2 }",
];

/// The same where methods command levels and speeds.
const COMMANDING: [&str; 6] = [
    "deployment = \"team\"\nmethod = \"mvp\"\nmvp = { resolution = \"heading-speed-vertical\" }",
    "deployment = \"team\"\ngroups = \"heard\"\nmethod = \"mvp\"\nmvp = { resolution = \"vertical\" }\n\
     network = { loss = 0.2 }",
    "deployment = \"team\"",
    "deployment = \"compact-team\"\ngroups = \"heard\"\nnetwork = { loss = 0.2 }",
    "deployment = \"team\"\npreset = \"paper\"",
    "deployment = \"hierarchical-pim\"\npreset = \"paper\"\nnetwork = { loss = 0.2 }",
];

/// Returns a run of three that meet; by the larger numbers methods command levels and speeds, which are in force already.
fn run_of_kind(kind: usize) -> AirspaceRun {
    let Some(commanding) = kind.checked_sub(KINDS.len()) else { return run(KINDS[kind], THREE) };
    let changes =
        "[airplane]\nturns = 3\nlevel_changes_m = [-310.0, 310.0]\nspeed_changes_m_s = [-5.0]\n";
    let mut run = run(COMMANDING[commanding], &format!("{changes}{THREE}"));
    run.advance(4);
    run
}

/// Changes some bytes, or cuts some off, or adds some.
fn changed(bytes: &[u8], draws: &mut Draws) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + draws.uniform_below(4) {
        let at = draws.uniform_below(bytes.len().max(1) as u32) as usize;
        match draws.uniform_below(6) {
            0 => bytes.truncate(at),
            1 => bytes.extend((0..draws.uniform_below(40)).map(|k| k as u8)),
            2 if at < bytes.len() => drop(bytes.remove(at)),
            // Lengths, numbers of rounds, and parts of floats: large, or one off.
            3 if at < bytes.len() => bytes[at] = 0xFF,
            4 if at < bytes.len() => bytes[at] = bytes[at].wrapping_add(1),
            _ if at < bytes.len() => bytes[at] ^= 1 << draws.uniform_below(8),
            _ => {}
        }
    }
    bytes
}

/// Returns a packet that is well formed and says something else.
fn forged(payload: &[u8], draws: &mut Draws) -> Vec<u8> {
    let fingerprint = u64::from_le_bytes(std::array::from_fn(|k| payload[4 + k]));
    let (header, message) = parse_packet::<Protocol>(payload, fingerprint).expect("a real packet");
    PacketBuffer::from_bytes(&changed(message, draws)).into_packet(&header)
}

/// Returns a packet with a right message and a wrong head.
fn misplaced(payload: &[u8], draws: &mut Draws) -> Vec<u8> {
    let fingerprint = u64::from_le_bytes(std::array::from_fn(|k| payload[4 + k]));
    let (mut header, message) =
        parse_packet::<Protocol>(payload, fingerprint).expect("a real packet");
    let PacketHeader { conversation, .. } = &mut header;
    match draws.uniform_below(5) {
        0 => {
            conversation.cycle =
                conversation.cycle.wrapping_add(2 + u64::from(draws.uniform_below(1000)))
        }
        1 => conversation.members ^= 1,
        2 => header.sender = draws.uniform_below(9) + 3,
        3 => header.fingerprint ^= 4,
        _ => conversation.cycle = u64::MAX,
    }
    PacketBuffer::from_bytes(message).into_packet(&header)
}

/// Runs the conversations of pilots in one cycle. Each receives, before every packet, what `more` makes of it. Returns
/// the number of these additional packets.
fn run_with_extra_packets(
    run: &AirspaceRun,
    pilots: &mut [Pilot],
    mut more: impl FnMut(&[u8]) -> Vec<u8>,
) -> u64 {
    let mut due = VecDeque::new();
    let mut tick = 0;
    let mut extra_packets = 0;
    for percept in run.percepts() {
        let own = percept.own.id as usize;
        pilots[own].start(percept, tick);
    }
    loop {
        for pilot in &mut *pilots {
            for OutgoingPacket { to, payload, .. } in pilot.take_packets() {
                due.extend(to.iter().map(|&other| (pilot.id(), other, payload.clone())));
            }
        }
        tick += 1;
        let now = due.len();
        for (from, to, payload) in due.drain(..now).collect::<Vec<_>>() {
            let pilot = &mut pilots[to as usize];
            pilot.on_packet(from, &more(&payload), tick);
            pilot.on_packet(from, &payload, tick);
            extra_packets += 1;
        }
        let timers = pilots.iter().filter_map(Pilot::next_timer).filter(|due| *due < u64::MAX);
        match (now, timers.min()) {
            (0, None) => return extra_packets,
            (0, Some(next)) => tick = tick.max(next),
            _ => {}
        }
        pilots.iter_mut().for_each(|pilot| pilot.on_timer(tick));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(36))]

    /// Damaged on the way, or meant for others: only the real messages count.
    #[test]
    fn what_is_damaged_or_misplaced_is_counted_and_changes_nothing(
        seed in any::<u64>(), kind in 0..KINDS.len() + COMMANDING.len(), is_damaged in any::<bool>(),
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(902));
        let run = run_of_kind(kind);
        let mut alone = TestPilots::from_run(&run);
        let mut disturbed = TestPilots::from_run(&run);
        run_with_extra_packets(&run, &mut alone.pilots, <[u8]>::to_vec);
        let extra_packets = run_with_extra_packets(&run, &mut disturbed.pilots, |payload| {
            if is_damaged {
                let mut bytes = payload.to_vec();
                let at = draws.uniform_below(bytes.len() as u32) as usize;
                bytes[at] ^= 1 << draws.uniform_below(8);
                bytes
            } else {
                misplaced(payload, &mut draws)
            }
        });
        let refused: u64 = disturbed.pilots.iter().map(|pilot| pilot.drop_counts().total()).sum();
        prop_assert!(extra_packets > 0);
        prop_assert_eq!(refused, extra_packets, "each is counted");
        for (found, expected) in disturbed.pilots.iter().zip(&alone.pilots) {
            let (found, expected) = (found.control(), expected.control());
            let maneuver = |control: &Option<AirplaneControl>| control.as_ref().map(|one| one.maneuver.clone());
            prop_assert_eq!(maneuver(&found), maneuver(&expected));
        }
    }

    /// Well formed, with right checksums, and senseless or lying: no pilot breaks off.
    #[test]
    fn whatever_a_packet_says_nobody_breaks_off(
        seed in any::<u64>(), kind in 0..KINDS.len() + COMMANDING.len(), is_only in any::<bool>(),
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(903));
        let run = run_of_kind(kind);
        let mut all = TestPilots::from_run(&run);
        let mut real = Vec::new();
        run_with_extra_packets(&run, &mut all.pilots, |payload| {
            real.push(payload.to_vec());
            forged(payload, &mut draws)
        });
        // The same again to pilots that hear nothing else, in any order.
        let mut all = TestPilots::from_run(&run);
        let percepts = run.percepts();
        for percept in percepts.iter().filter(|_| is_only) {
            all.pilots[percept.own.id as usize].start(percept.clone(), 0);
        }
        for _ in 0..200 {
            let payload = &real[draws.uniform_below(real.len() as u32) as usize];
            let bytes = forged(payload, &mut draws);
            let from = EntityId::from(payload[28]);
            let to = (from as usize + 1 + draws.uniform_below(2) as usize) % 3;
            all.pilots[to].on_packet(from, &bytes, 1);
        }
        for percept in percepts {
            all.pilots[percept.own.id as usize].start(percept, 1);
        }
    }
}

/// A percept may come over a network, and a beacon of one that is not seen, too.
#[test]
fn commands_beyond_the_limits_of_an_airplane_are_refused() {
    use crate::flight::{LevelCommand, MethodCommand};
    let limited = format!("[airplane]\nceiling_m = 2000.0\nv_max_m_s = 40.0\n{THREE}");
    let airspace = |resolution: &str| {
        let mvp = format!("mvp = {{ resolution = \"{resolution}\" }}");
        format!("deployment = \"team\"\nmethod = \"mvp\"\n{mvp}")
    };
    let level = |altitude_m: f64, vertical_m_s: f64| MethodCommand {
        level: Some(LevelCommand { altitude_m, vertical_m_s }),
        v_m_s: None,
    };
    let speed = |v_m_s: f64| MethodCommand { level: None, v_m_s: Some(v_m_s) };
    let all = run(&airspace("heading-speed-vertical"), &limited);
    let speeds = run(&airspace("speed"), &limited);
    let none = run(&airspace("heading"), &limited);
    let right = [level(1500.0, 5.0), speed(38.0), MethodCommand::NONE];
    let wrong = [
        level(2000.5, 5.0),
        level(f64::NAN, 5.0),
        level(f64::NEG_INFINITY, 5.0),
        level(1500.0, -1.0),
        level(1500.0, f64::INFINITY),
        speed(40.5),
        speed(1.0),
        speed(f64::NAN),
    ];
    let is_taken = |run: &AirspaceRun, command: MethodCommand| {
        let mut percept = run.percepts().swap_remove(0);
        percept.group[1].command = command;
        let of_other = percept.check(run.world()).is_ok();
        let mut percept = run.percepts().swap_remove(0);
        percept.own.command = command;
        assert_eq!(percept.check(run.world()).is_ok(), of_other, "{command:?}");
        of_other
    };
    assert!(right.iter().all(|command| is_taken(&all, *command)));
    assert!(wrong.iter().all(|command| !is_taken(&all, *command)));
    assert!(is_taken(&speeds, speed(38.0)) && !is_taken(&speeds, level(1500.0, 5.0)));
    assert!(!is_taken(&none, speed(35.0)) && !is_taken(&none, level(0.0, 5.0)));
}

#[test]
fn who_floods_a_pilot_fills_no_memory() {
    let run = run("deployment = \"team\"", THREE);
    let mut all = TestPilots::from_run(&run);
    let percept = run.percepts().swap_remove(0);
    all.pilots[0].start(percept.clone(), 0);
    let header = |cycle: Cycle, sequence: u32| PacketHeader {
        fingerprint: run.world().fingerprint,
        conversation: ConversationId::new(cycle, Protocol::Shield, &percept.members()),
        sender: 1,
        sequence,
    };
    let large = vec![7; 1 << 18];
    for k in 0..100 {
        let packet = PacketBuffer::from_bytes(&large).into_packet(&header(u64::from(k) % 2, k));
        all.pilots[0].on_packet(1, &packet, 0);
    }
    let refused = all.pilots[0].drop_counts();
    assert!(refused.get(DropReason::NoRoom) > 80, "{refused:?}");
    let of_this = ConversationId::new(0, Protocol::Decision, &percept.members());
    let packet = PacketBuffer::from_bytes(&large)
        .into_packet(&PacketHeader { conversation: of_this, ..header(0, 0) });
    all.pilots[0].on_packet(1, &packet, 0);
    assert_eq!(all.pilots[0].drop_counts().get(DropReason::TooLarge), 1);
}

/// Each reason on its own.
#[test]
fn every_reason_differs_from_the_others() {
    let run = run("deployment = \"compact-team\"", THREE);
    let mut all = TestPilots::from_run(&run);
    for percept in run.percepts() {
        let own = percept.own.id as usize;
        all.pilots[own].start(percept, 0);
    }
    let packet = all.pilots[1].take_packets().swap_remove(0).payload;
    let (header, message) =
        parse_packet::<Protocol>(&packet, run.world().fingerprint).expect("a real packet");
    let with = |change: &dyn Fn(&mut PacketHeader)| {
        let mut header = header;
        change(&mut header);
        PacketBuffer::from_bytes(message).into_packet(&header)
    };
    let bent = |at: usize, to: u8| {
        let mut bytes = packet.clone();
        bytes[at] = to;
        bytes
    };
    let said = |bytes: &[u8]| PacketBuffer::from_bytes(bytes).into_packet(&header);
    let cases = [
        (packet[..43].to_vec(), DropReason::NoPacket),
        (bent(0, 0), DropReason::NoPacket),
        (bent(2, 9), DropReason::Version),
        (bent(60, 0xEE), DropReason::Damaged),
        (with(&|header| header.fingerprint += 1), DropReason::Fingerprint),
        (with(&|header| header.sender = 2), DropReason::Sender),
        (with(&|header| header.conversation.members += 1), DropReason::OtherGroup),
        (with(&|header| header.conversation.cycle = 7), DropReason::NoRoom),
        (said(&[9, 9, 9]), DropReason::Unreadable),
        (said(&[message, &[0]].concat()), DropReason::Unreadable),
        // A message with a number beyond all possible ones.
        (said(&[&[0, 0xFF, 0xFF, 0x03], &message[2..]].concat()), DropReason::Unsound),
    ];
    for (bytes, why) in cases {
        let before = all.pilots[0].drop_counts();
        all.pilots[0].on_packet(1, &bytes, 0);
        let after = all.pilots[0].drop_counts();
        assert_eq!(
            (after.get(why), after.total()),
            (before.get(why) + 1, before.total() + 1),
            "{why:?}"
        );
    }
    all.pilots[0].on_packet(1, &packet, 0);
    assert_eq!(all.pilots[0].drop_counts().total(), 11, "the real one is taken");
}
