//! A relay between nodes that changes, repeats and renames what it carries.

use crate::tls::{authority, certificate};
use sidestep_link::messenger::Messenger;
use sidestep_link::protocol::{FleetMember, Incarnation, Message, TransportFrame};
use sidestep_link::signature::SIGNATURE_BYTES;
use sidestep_link::wire::memory::{MemoryHub, MemoryWire};
use sidestep_link::wire::{PeerId, Wire};
use sidestep_session::fleet::Tls;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SOON: Duration = Duration::from_millis(1);

/// The wire of a node whose frames all end up at a relay.
struct RelayedWire {
    own: MemoryWire,
    at_relay: Arc<Mutex<Vec<Vec<u8>>>>,
}

impl Wire for RelayedWire {
    fn send(&mut self, _: &[PeerId], frame: &[u8]) {
        self.at_relay.lock().expect("no panic").push(frame.to_vec());
    }

    fn receive(&mut self, within: Duration) -> Option<Vec<u8>> {
        self.own.receive(within)
    }
}

/// A node, and its frames that the relay has.
struct RelayedNode {
    agent: u32,
    messenger: Messenger,
    at_relay: Arc<Mutex<Vec<Vec<u8>>>>,
}

impl RelayedNode {
    fn new(hub: &MemoryHub, agent: u32, tls: Option<&Tls>) -> Self {
        let at_relay = Arc::<Mutex<_>>::default();
        let me = PeerId::Node(agent);
        let wire = RelayedWire { own: hub.open_wire(me), at_relay: at_relay.clone() };
        let messenger = Messenger::new(me, Box::new(wire));
        let names = (0..3).map(|agent| format!("airplane-{agent}")).collect();
        let messenger = match tls {
            Some(tls) => messenger.with_signatures(tls, names).expect("certificates"),
            None => messenger,
        };
        Self { agent, messenger, at_relay }
    }

    fn member(&self) -> FleetMember {
        FleetMember {
            agent: self.agent,
            incarnation: self.messenger.incarnation(),
            listens: Vec::new(),
            session: self.messenger.session(),
        }
    }

    /// Sends a message to node 1, and returns its frame.
    fn frame(&mut self, message: Message) -> Vec<u8> {
        self.messenger.send_best_effort(PeerId::Node(1), message);
        self.at_relay.lock().expect("no panic").pop().expect("sent")
    }
}

/// Returns nodes 0, 1 and 2 with their certificates; none where there is no program to make these.
fn nodes(hub: &MemoryHub, folder: &std::path::Path) -> Option<[RelayedNode; 3]> {
    authority(folder, "ours", 2)?;
    let mut nodes = Vec::new();
    for agent in 0..3 {
        let tls = certificate(folder, "ours", &format!("airplane-{agent}"), 2)?;
        nodes.push(RelayedNode::new(hub, agent, Some(&tls)));
    }
    nodes.try_into().ok()
}

#[test]
fn what_a_relay_changes_repeats_or_puts_under_another_name_is_dropped_and_counted() {
    let (hub, folder) = (MemoryHub::default(), tempfile::tempdir().expect("a folder"));
    let Some([mut first, mut second, mut third]) = nodes(&hub, folder.path()) else { return };
    let mut relay = hub.open_wire(PeerId::Server);
    let mut relayed = |frame: &[u8], to: &mut Messenger| {
        relay.send(&[PeerId::Node(1)], frame);
        to.receive(SOON).map(|received| (received.from, received.message))
    };
    for member in [first.member(), third.member()] {
        assert!(second.messenger.connect_member(&member));
    }
    let [a, c] = [0, 2].map(PeerId::Node);
    let whole = first.frame(Message::Close(3));
    let forged = |second: &RelayedNode| second.messenger.stats().dropped.get("forged").copied();
    // A frame of other content with a fitting digest, with the signature of the first one.
    let (unsigned, signature) = whole.split_at(whole.len() - SIGNATURE_BYTES);
    let read = TransportFrame::decode(unsigned).expect("a frame before the signature");
    let mut changed = read.clone();
    changed.message = Some(Message::Close(4));
    assert_eq!(relayed(&[&changed.encode(), signature].concat(), &mut second.messenger), None);
    assert_eq!(forged(&second), Some(1), "changed");
    for bit in (8 * 20..8 * whole.len()).step_by(7) {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(relayed(&bytes, &mut second.messenger), None, "bit {bit}");
    }
    let before = forged(&second);
    // The frame of one node under the name of another, signed by that one or by nobody.
    let mut renamed = TransportFrame { from: c, ..read.clone() };
    renamed.incarnation = third.messenger.incarnation();
    for bytes in [[&renamed.encode(), signature].concat(), renamed.encode(), unsigned.to_vec()] {
        assert_eq!(relayed(&bytes, &mut second.messenger), None);
    }
    assert_eq!(forged(&second), before.map(|count| count + 3), "renamed, or not signed");
    assert_eq!(relayed(&whole, &mut second.messenger), Some((a, Message::Close(3))));
    assert_eq!(relayed(&whole, &mut second.messenger), None);
    assert_eq!(second.messenger.stats().dropped["repeated"], 1);
    let other = third.frame(Message::Close(5));
    assert_eq!(relayed(&other, &mut second.messenger), Some((c, Message::Close(5))));
}

#[test]
fn a_key_that_the_certificate_of_its_agent_has_not_signed_is_not_believed() {
    let (hub, folder) = (MemoryHub::default(), tempfile::tempdir().expect("a folder"));
    let Some([first, mut second, third]) = nodes(&hub, folder.path()) else { return };
    let others = tempfile::tempdir().expect("a folder");
    let Some(_) = authority(others.path(), "ours", 2) else { return };
    let Some(stranger) = certificate(others.path(), "ours", "airplane-0", 2) else { return };
    let stranger = RelayedNode::new(&hub, 0, Some(&stranger));
    let server = Tls {
        authority: folder.path().join("ours-ca.pem"),
        certificate: folder.path().join("ours-server2.pem"),
        key: folder.path().join("ours-server2.key"),
    };
    let of_server = RelayedNode::new(&hub, 0, Some(&server)).member();
    let own = first.member();
    for (member, why) in [
        (FleetMember { session: third.messenger.session(), ..own.clone() }, "of another agent"),
        (FleetMember { incarnation: Incarnation(7), ..own.clone() }, "of another process"),
        (FleetMember { session: None, ..own.clone() }, "none"),
        (stranger.member(), "of another authority"),
    ] {
        assert!(!second.messenger.connect_member(&member), "{why}");
    }
    assert!(second.messenger.connect_member(&of_server), "the server runs whom it likes");
    assert!(second.messenger.connect_member(&own));
    assert!(!second.messenger.connect_member(&of_server), "but nobody who has run by itself");
    let own_tls = Tls {
        certificate: folder.path().join("ours-airplane-02.pem"),
        key: folder.path().join("ours-airplane-02.key"),
        ..server
    };
    let next = RelayedNode::new(&hub, 0, Some(&own_tls)).member();
    assert!(second.messenger.connect_member(&next));
    assert!(!second.messenger.connect_member(&own), "a former process");
    assert!(second.messenger.connect_member(&next));
}

#[test]
fn without_certificates_frames_are_not_signed() {
    let hub = MemoryHub::default();
    let mut first = RelayedNode::new(&hub, 0, None);
    let frame = first.frame(Message::Close(3));
    assert!(TransportFrame::decode(&frame).is_ok() && first.messenger.session().is_none());
}
