//! Messengers over a wire in memory that loses, repeats and changes frames.

use super::*;
use crate::protocol::DecodeError;
use crate::wire::memory::MemoryHub;
use std::sync::Mutex;

const SOON: Duration = Duration::from_millis(1);
const LATER: Duration = Duration::from_secs(20);

/// A wire that loses the first frames to their last receiver.
struct Lossy {
    wire: Box<dyn Wire>,
    drops: usize,
}

impl Wire for Lossy {
    fn send(&mut self, to: &[PeerId], frame: &[u8]) {
        match self.drops {
            0 => self.wire.send(to, frame),
            _ => {
                self.drops -= 1;
                self.wire.send(&to[..to.len() - 1], frame);
            }
        }
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        self.wire.receive(within)
    }
}

fn messenger(hub: &MemoryHub, me: PeerId, drops: usize) -> Messenger {
    Messenger::new(me, Box::new(Lossy { wire: Box::new(hub.open_wire(me)), drops }))
}

#[test]
fn a_reliable_message_arrives_although_its_frame_is_lost_and_a_best_effort_one_does_not() {
    let hub = MemoryHub::default();
    let (a, b) = (PeerId::Server, PeerId::Node(3));
    let (mut first, mut second) = (messenger(&hub, a, 2), messenger(&hub, b, 0));
    first.connect(b, second.incarnation());
    second.connect(a, first.incarnation());
    first.send_best_effort(b, Message::Hello);
    first.send_reliable(b, Message::End);
    assert_eq!(second.receive(SOON), None, "both frames were lost");
    std::thread::scope(|scope| {
        let sends = scope.spawn(move || {
            while !first.has_delivered() {
                first.receive(SOON);
            }
            first.stats().retries
        });
        let received = second.receive(LATER).expect("it is sent again");
        assert_eq!((received.from, received.message), (a, Message::End));
        while !sends.is_finished() {
            assert_eq!(second.receive(SOON), None, "it arrives once");
        }
        assert!(sends.join().expect("no panic") >= 1);
    });
}

/// A wire that records the frames that are sent.
struct RecordingWire(Arc<Mutex<Vec<Vec<u8>>>>);

impl Wire for RecordingWire {
    fn send(&mut self, _: &[PeerId], frame: &[u8]) {
        self.0.lock().expect("no panic").push(frame.to_vec());
    }

    fn receive(&mut self, _: Duration) -> Option<Vec<u8>> {
        None
    }
}

#[test]
fn a_frame_to_all_other_nodes_names_none_of_them_and_is_read_by_members_alone() {
    let frames = Arc::new(Mutex::new(Vec::new()));
    let mut sender = Messenger::new(PeerId::Node(0), Box::new(RecordingWire(frames.clone())));
    let others: Vec<PeerId> = (1..50).map(PeerId::Node).collect();
    let hub = MemoryHub::default();
    let mut member = messenger(&hub, PeerId::Node(7), 0);
    let mut stranger = messenger(&hub, PeerId::Node(8), 0);
    member.connect(PeerId::Node(0), sender.incarnation());
    for &peer in others.iter().chain(&[PeerId::Server]) {
        sender.connect(peer, Incarnation(u64::MAX));
    }
    sender.multicast_best_effort(&others, &Message::Heartbeat);
    sender.multicast_best_effort(&others[1..], &Message::Heartbeat);
    let sent = frames.lock().expect("no panic").clone();
    assert!(sent[0].len() < 40, "{} bytes", sent[0].len());
    assert!(sent[1].len() > 4 * 48, "some of them are named");
    let heard = member.decode_frame(&sent[0]).expect("it is for all nodes");
    assert_eq!((heard.from, heard.message), (PeerId::Node(0), Message::Heartbeat));
    assert_eq!(stranger.decode_frame(&sent[0]), None);
    let mut server = messenger(&hub, PeerId::Server, 0);
    assert_eq!(server.decode_frame(&sent[0]), None, "it is no node");
}

#[test]
fn a_reliable_multicast_arrives_once_at_each_peer_in_the_order_of_its_link() {
    let hub = MemoryHub::default();
    let [a, b, c] = [1, 2, 3].map(PeerId::Node);
    let mut first = messenger(&hub, a, 0);
    let mut peers = [b, c].map(|peer| messenger(&hub, peer, 0));
    first.connect(b, peers[0].incarnation());
    first.send_reliable(b, Message::Hello);
    first.multicast_reliable(&[b, c], Message::Close(1));
    assert_eq!(first.stats().dropped["stranger"], 1, "one of them is not connected");
    first.connect(c, peers[1].incarnation());
    first.wire = Box::new(Lossy { wire: Box::new(hub.open_wire(a)), drops: 1 });
    first.multicast_reliable(&[b, c], Message::Close(2));
    for peer in &mut peers {
        peer.connect(a, first.incarnation());
    }
    let mut received = [Vec::new(), Vec::new()];
    while !first.has_delivered() {
        first.receive(SOON);
        for (peer, received) in peers.iter_mut().zip(&mut received) {
            received.extend(peer.receive(SOON).map(|received| received.message));
        }
    }
    assert_eq!(received[0], [Message::Hello, Message::Close(1), Message::Close(2)]);
    assert_eq!(received[1], [Message::Close(2)], "lost at first, and sent again");
}

/// A wire on which nothing arrives. A wait takes as long as it shall, and the time in which its process is stopped, by
/// the clock of a test.
struct SilentWire {
    clock: Arc<Mutex<Duration>>,
    stop: Duration,
}

impl Wire for SilentWire {
    fn send(&mut self, _: &[PeerId], _: &[u8]) {}

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        *self.clock.lock().expect("no panic") += within + self.stop;
        None
    }
}

#[test]
fn the_silence_of_another_is_the_time_in_which_this_process_has_listened() {
    let second = Duration::from_secs(1);
    let stop = RENEWAL_ABSENCE / 4;
    for (stop_in_wait, stop_between) in [(stop, Duration::ZERO), (Duration::ZERO, stop)] {
        let clock = Arc::new(Mutex::new(Duration::ZERO));
        let wire = SilentWire { clock: clock.clone(), stop: stop_in_wait };
        let mut messenger = Messenger::new(PeerId::Server, Box::new(wire));
        let own = clock.clone();
        messenger.clock = Box::new(move || *own.lock().expect("no panic"));
        let peer = PeerId::Node(3);
        messenger.connect(peer, Incarnation(1));
        for listened in 1..5 {
            *clock.lock().expect("no panic") += stop_between;
            assert_eq!(messenger.receive(second), None);
            assert_eq!(messenger.silent_for(peer), Some(listened * second));
            // Nor before it listens again.
            *clock.lock().expect("no panic") += stop_between;
            assert_eq!(messenger.silent_for(peer), Some(listened * second));
        }
    }
}

/// Links are broken by then, and all processes of a machine that was suspended were stopped together.
#[test]
fn who_was_stopped_for_long_takes_nobody_for_silent() {
    let second = Duration::from_secs(1);
    let stop = RENEWAL_ABSENCE;
    for (stop_in_wait, stop_between) in [(stop, Duration::ZERO), (Duration::ZERO, stop)] {
        let clock = Arc::new(Mutex::new(Duration::ZERO));
        let wire = SilentWire { clock: clock.clone(), stop: Duration::ZERO };
        let mut messenger = Messenger::new(PeerId::Server, Box::new(wire));
        let own = clock.clone();
        messenger.clock = Box::new(move || *own.lock().expect("no panic"));
        let peer = PeerId::Node(3);
        messenger.connect(peer, Incarnation(1));
        assert_eq!(messenger.receive(9 * second), None);
        assert_eq!(messenger.silent_for(peer), Some(9 * second));
        messenger.wire = Box::new(SilentWire { clock: clock.clone(), stop: stop_in_wait });
        *clock.lock().expect("no panic") += stop_between;
        assert_eq!(messenger.receive(Duration::ZERO), None);
        assert_eq!(messenger.silent_for(peer), Some(Duration::ZERO));
    }
}

#[test]
fn frames_that_are_repeated_or_changed_on_the_way_are_dropped_counted_and_do_no_harm() {
    let hub = MemoryHub::default();
    let (a, b) = (PeerId::Server, PeerId::Node(3));
    let (mut first, mut second) = (messenger(&hub, a, 0), messenger(&hub, b, 0));
    let mut on_the_way = hub.open_wire(PeerId::Node(4));
    first.connect(b, second.incarnation());
    second.connect(a, first.incarnation());
    // What somebody between the two sees.
    first.wire = Box::new(hub.open_wire(a));
    let mut frames = Vec::new();
    for message in [Message::Heartbeat, Message::Hello] {
        let header = first.peers.get_mut(&b).expect("connected").recipient_header(b, None);
        let frame = TransportFrame {
            from: a,
            incarnation: first.incarnation(),
            number: frames.len() as u64,
            to: vec![header],
            message: Some(message),
        };
        frames.push(frame.encode());
    }
    for frame in [&frames[1], &frames[0], &frames[1], &frames[0]] {
        on_the_way.send(&[b], frame);
    }
    let mut flipped = frames[0].clone();
    flipped[5] ^= 4;
    on_the_way.send(&[b], &flipped);
    let received = [second.receive(SOON), second.receive(SOON), second.receive(SOON)];
    let messages = received.map(|received| received.map(|received| received.message));
    assert_eq!(messages, [Some(Message::Hello), Some(Message::Heartbeat), None]);
    let dropped = &second.stats().dropped;
    assert_eq!((dropped[drop_reason::REPEATED], dropped[DecodeError::Damaged.name()]), (2, 1));
}

#[test]
fn frames_to_a_former_incarnation_and_reliable_messages_of_strangers_are_dropped_and_counted() {
    let hub = MemoryHub::default();
    let (a, b) = (PeerId::Server, PeerId::Node(3));
    let (mut first, mut second) = (messenger(&hub, a, 0), messenger(&hub, b, 0));
    first.connect(b, Incarnation(17));
    first.send_reliable(b, Message::End);
    assert_eq!(second.receive(SOON), None);
    assert_eq!(second.stats().dropped["former-life"], 1);
    let incarnation = second.incarnation();
    first.connect(b, incarnation);
    first.send_reliable(b, Message::End);
    assert_eq!(second.receive(SOON), None, "it has not connected with the server");
    assert_eq!(second.stats().dropped["stranger"], 1);
    hub.open_wire(PeerId::Node(9)).send(&[b], b"something else");
    assert_eq!(second.receive(SOON), None);
    assert_eq!(second.stats().dropped["foreign"], 1);
}
