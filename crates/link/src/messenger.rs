//! A peer's messages to and from all others over one wire: best-effort ones, which may be lost, and reliable ones.

use crate::arq::ArqLink;
use crate::protocol::{
    FleetMember, Incarnation, Message, RecipientHeader, SessionCertificate, TransportFrame,
};
use crate::replay_window::ReplayWindow;
use crate::signature::{ForgedFrame, KnownKeys, SessionKey};
use crate::wire::{PeerId, Wire, WireSetupError};
use sidestep::kernel::EntityId;
use sidestep_session::fleet::Tls;
use std::collections::BTreeMap;
use std::hash::{BuildHasher, RandomState};
use std::net::SocketAddrV4;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time without an acknowledgment from another node after which the direct link to it is probed: as long as Zenoh waits
/// for a sign of life before it gives up a broken link by itself.
const LINK_CHECK_TIMEOUT: Duration = Duration::from_secs(2);

/// Time of not listening that counts as an absence: of a process that was stopped, or got no processor.
const MIN_ABSENCE: Duration = Duration::from_millis(100);

/// Time of not listening after which the silence of all others is forgotten: links are broken after as long, so others
/// need time to be heard again. Shorter absences are taken off the silence, so that a process which is often late does
/// notice that another one is gone.
const RENEWAL_ABSENCE: Duration = LINK_CHECK_TIMEOUT;

/// A clock: the time since a fixed start.
type Clock = Box<dyn Fn() -> Duration + Send>;

/// Reasons for which a messenger drops frames and messages: the labels of metrics.
mod drop_reason {
    /// The frame is for an earlier process of this peer.
    pub(super) const FORMER_LIFE: &str = "former-life";
    /// The message is reliable, and the two peers have not connected.
    pub(super) const STRANGER: &str = "stranger";
    /// Its sender is not who it says.
    pub(super) const FORGED: &str = "forged";
    /// The same frame has arrived before, or so many later ones have that nobody can tell.
    pub(super) const REPEATED: &str = "repeated";
    /// The message is a duplicate, or one before it is missing.
    pub(super) const OUT_OF_ORDER: &str = "out-of-order";
}

/// Counts of a messenger.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MessengerStats {
    /// Frames sent.
    pub frames: u64,
    /// Bytes of these frames.
    pub bytes: u64,
    /// Messages that were retransmitted.
    pub retries: u64,
    /// Frames that were dropped, by reason.
    pub dropped: BTreeMap<&'static str, u64>,
}

/// Another peer, in its present incarnation.
#[derive(Debug)]
struct PeerState {
    incarnation: Incarnation,
    link: ArqLink,
    /// Its frames that have arrived.
    arrived: Box<ReplayWindow>,
    /// Time at which it was last heard, or connected; later by the absences of this messenger since.
    last_heard: Duration,
}

impl PeerState {
    /// Returns the recipient of a frame to this peer; `sequence` is that of a reliable message.
    fn recipient_header(&mut self, peer: PeerId, sequence: Option<u64>) -> RecipientHeader {
        RecipientHeader {
            peer,
            incarnation: Some(self.incarnation),
            ack: self.link.take_outgoing_ack(),
            sequence,
        }
    }
}

/// A received message.
#[derive(Debug, PartialEq)]
pub struct ReceivedMessage {
    /// The sender.
    pub from: PeerId,
    /// The sender's incarnation.
    pub incarnation: Incarnation,
    /// The message; reliable ones of a sender come in order.
    pub message: Message,
}

/// A peer's reliable and best-effort messages to and from all other peers.
pub struct Messenger {
    me: PeerId,
    incarnation: Incarnation,
    /// Number of the next frame.
    next_number: u64,
    wire: Box<dyn Wire>,
    clock: Clock,
    /// Time at which it last listened.
    listened_at: Duration,
    /// The peers with which it has connected.
    peers: BTreeMap<PeerId, PeerState>,
    stats: MessengerStats,
    /// The key by which it signs what other nodes receive; none without certificates, and of the server.
    session_key: Option<SessionKey>,
    /// The keys by which other nodes sign; none without certificates.
    known_keys: Option<KnownKeys>,
}

impl Messenger {
    /// Returns the messenger of a peer in a new incarnation, not connected with any other.
    pub fn new(me: PeerId, wire: Box<dyn Wire>) -> Self {
        let started = Instant::now();
        Self {
            me,
            incarnation: new_incarnation(),
            next_number: 0,
            wire,
            clock: Box::new(move || started.elapsed()),
            listened_at: Duration::ZERO,
            peers: BTreeMap::new(),
            stats: MessengerStats::default(),
            session_key: None,
            known_keys: None,
        }
    }

    /// Makes it believe nodes only by keys that their certificates have signed, and, if it is a node, sign what it sends
    /// to others. The agents' certificates have the given common names, by their ids.
    ///
    /// # Errors
    /// When a file of certificates cannot be read.
    pub fn with_signatures(mut self, tls: &Tls, names: Vec<String>) -> Result<Self, String> {
        self.known_keys = Some(KnownKeys::new(tls, names)?);
        if let PeerId::Node(agent) = self.me {
            self.session_key = Some(SessionKey::new(tls, agent, self.incarnation)?);
        }
        Ok(self)
    }

    /// Returns the key by which it signs, for others; none where it does not.
    pub fn session(&self) -> Option<SessionCertificate> {
        self.session_key.as_ref().map(|key| key.certificate().clone())
    }

    /// Checks that the key of a node is its own, where there are certificates.
    ///
    /// # Errors
    /// With the reason why nobody can tell.
    pub fn check_session(
        &self,
        agent: EntityId,
        incarnation: Incarnation,
        session: Option<&SessionCertificate>,
    ) -> Result<(), String> {
        let Some(known) = &self.known_keys else { return Ok(()) };
        known.check(agent, incarnation, session)
    }

    /// Connects with another node, and returns whether it has: not where there are certificates and its key is not its own.
    pub fn connect_member(&mut self, member: &FleetMember) -> bool {
        if let Some(known) = &mut self.known_keys {
            let session = member.session.as_ref();
            if let Err(reason) = known.learn(member.agent, member.incarnation, session) {
                self.count_drop(drop_reason::FORGED);
                let agent = member.agent;
                tracing::warn!(agent, reason, "a node is not believed");
                return false;
            }
        }
        self.connect(PeerId::Node(member.agent), member.incarnation);
        true
    }

    /// Returns the peer's own incarnation.
    pub fn incarnation(&self) -> Incarnation {
        self.incarnation
    }

    /// Returns the counts so far.
    pub fn stats(&self) -> &MessengerStats {
        &self.stats
    }

    /// Returns whether all reliable messages to another peer were acknowledged, or the two are not connected.
    pub fn has_delivered_to(&self, peer: PeerId) -> bool {
        self.peers.get(&peer).is_none_or(|state| state.link.has_delivered())
    }

    fn now(&self) -> Duration {
        (self.clock)()
    }

    /// Connects with one incarnation of another peer, so that reliable messages can be exchanged. Those that an earlier
    /// incarnation has not acknowledged are lost with it.
    pub fn connect(&mut self, peer: PeerId, incarnation: Incarnation) {
        if !self.is_connected(peer, incarnation) {
            let last_heard = self.now();
            let state = PeerState {
                incarnation,
                link: ArqLink::default(),
                arrived: Box::default(),
                last_heard,
            };
            self.peers.insert(peer, state);
        }
    }

    /// Ends the exchange with another peer; reliable messages that it has not acknowledged are lost.
    pub fn disconnect(&mut self, peer: PeerId) {
        self.peers.remove(&peer);
    }

    /// Returns the time since a connected peer was last heard, without the absences of this messenger: who has not listened
    /// cannot tell whether others were silent.
    pub fn silent_for(&self, peer: PeerId) -> Option<Duration> {
        let last_heard = self.peers.get(&peer)?.last_heard;
        Some(self.listened_at.saturating_sub(last_heard))
    }

    /// Returns whether the direct link to another node is half-open: no message arrives there, and the link's other end
    /// has left probes unanswered for the given time.
    pub fn is_half_open(&mut self, member: &FleetMember, within: Duration) -> bool {
        let state = self.peers.get(&PeerId::Node(member.agent));
        let Some(since) = state.and_then(|state| state.link.unacked_since()) else { return false };
        self.now().saturating_sub(since) > LINK_CHECK_TIMEOUT
            && self.wire.is_half_open(member, within)
    }

    /// Closes the direct links to all other nodes, without waiting for that, and opens them again.
    ///
    /// # Errors
    /// When an endpoint cannot be bound yet: everything goes through the server then, and the call is to be repeated.
    pub fn reopen_links(&mut self) -> Result<(), WireSetupError> {
        self.wire.reopen_links()
    }

    /// Returns whether all reliable messages to all peers were acknowledged.
    pub fn has_delivered(&self) -> bool {
        self.peers.values().all(|state| state.link.has_delivered())
    }

    /// Sends a message that may be lost.
    pub fn send_best_effort(&mut self, to: PeerId, message: Message) {
        self.multicast_best_effort(&[to], &message);
    }

    /// Sends a message that may be lost to several peers.
    pub fn multicast_best_effort(&mut self, to: &[PeerId], message: &Message) {
        // Ids and header fields of many receivers would take more bytes than the message, and it matters little which
        // process of a peer gets what may be lost.
        if self.are_all_other_nodes(to) {
            self.publish(to, Vec::new(), Some(message));
            return;
        }
        let is_to_one = to.len() == 1;
        let mut recipients = Vec::with_capacity(to.len());
        for &peer in to {
            recipients.push(match self.peers.get_mut(&peer) {
                Some(state) if is_to_one => state.recipient_header(peer, None),
                _ => RecipientHeader { peer, incarnation: None, ack: 0, sequence: None },
            });
        }
        self.send_frame(recipients, Some(message));
    }

    /// Sends a message that may be lost to one incarnation of another peer, whether or not it is the connected one: a
    /// second process for an agent that has a node already must be answered, too.
    pub fn reply(&mut self, to: PeerId, incarnation: Incarnation, message: Message) {
        let recipient =
            RecipientHeader { peer: to, incarnation: Some(incarnation), ack: 0, sequence: None };
        self.send_frame(vec![recipient], Some(&message));
    }

    /// Sends a message that is retransmitted until it has arrived; it is lost if the peer is not connected.
    pub fn send_reliable(&mut self, to: PeerId, message: Message) {
        self.multicast_reliable(&[to], message);
    }

    /// Sends a message to several peers, to each of which it is retransmitted until it has arrived there; it is lost for
    /// peers that are not connected.
    pub fn multicast_reliable(&mut self, to: &[PeerId], message: Message) {
        let now = self.now();
        let message = Arc::new(message);
        let mut recipients = Vec::with_capacity(to.len());
        for &peer in to {
            let Some(state) = self.peers.get_mut(&peer) else {
                self.count_drop(drop_reason::STRANGER);
                continue;
            };
            let sequence = state.link.push_unacked(message.clone(), now);
            recipients.push(state.recipient_header(peer, Some(sequence)));
        }
        self.send_frame(recipients, Some(&message));
    }

    fn send_frame(&mut self, to: Vec<RecipientHeader>, message: Option<&Message>) {
        if to.is_empty() {
            return;
        }
        let peers: Vec<PeerId> = to.iter().map(|recipient| recipient.peer).collect();
        self.publish(&peers, to, message);
    }

    /// Returns whether these are all other nodes with which it has connected, and more than one.
    fn are_all_other_nodes(&self, peers: &[PeerId]) -> bool {
        let is_node = |peer: &PeerId| matches!(peer, PeerId::Node(_));
        let nodes = self.peers.keys().filter(|peer| is_node(peer));
        is_node(&self.me)
            && peers.len() > 1
            && peers.len() == nodes.count()
            && peers.iter().all(|peer| is_node(peer) && self.peers.contains_key(peer))
    }

    /// Sends a frame with a list of receivers to some peers.
    fn publish(&mut self, peers: &[PeerId], to: Vec<RecipientHeader>, message: Option<&Message>) {
        let number = self.next_number;
        self.next_number += 1;
        let from = self.me;
        let incarnation = self.incarnation;
        let mut frame = TransportFrame { from, incarnation, number, to, message }.encode();
        if let Some(key) = &self.session_key
            && is_signed(from, peers)
        {
            frame = key.sign(frame);
        }
        self.stats.frames += 1;
        self.stats.bytes += frame.len() as u64;
        self.wire.send(peers, &frame);
    }

    fn count_drop(&mut self, reason: &'static str) {
        *self.stats.dropped.entry(reason).or_default() += 1;
    }

    /// Counts a frame that no peer has sent in this form. Of many, only the first and each doubling is told: somebody could
    /// else fill the log.
    fn count_bad_frame(&mut self, reason: &'static str) {
        self.count_drop(reason);
        let count = self.stats.dropped[reason];
        if count.is_power_of_two() {
            tracing::warn!(me = %self.me, reason, count, "frames are dropped: they were changed, repeated or forged on the way");
        }
    }

    /// Sends the frames that are due: retransmissions and acknowledgments.
    fn send_due(&mut self) {
        let now = self.now();
        let mut due_peers = Vec::new();
        for (&peer, state) in &self.peers {
            if state.link.next_send_time().is_some_and(|at| at <= now) {
                due_peers.push(peer);
            }
        }
        for peer in due_peers {
            let Some(state) = self.peers.get_mut(&peer) else { continue };
            let due = state.link.take_due_retransmissions(now);
            let recipient = state.recipient_header(peer, None);
            self.stats.retries += due.retransmissions.len() as u64;
            for (sequence, message) in due.retransmissions {
                let recipient = RecipientHeader { sequence: Some(sequence), ..recipient };
                self.send_frame(vec![recipient], Some(&message));
            }
            if due.acknowledge {
                self.send_frame(vec![recipient], None);
            }
        }
    }

    /// Acknowledges at once what has arrived: at the end no later frame carries the acknowledgments.
    pub fn send_acks(&mut self) {
        let owed = self.peers.iter().filter(|(_, state)| state.link.owes_ack());
        let owed: Vec<PeerId> = owed.map(|(&peer, _)| peer).collect();
        for peer in owed {
            let Some(state) = self.peers.get_mut(&peer) else { continue };
            let recipient = state.recipient_header(peer, None);
            self.send_frame(vec![recipient], None);
        }
    }

    /// Makes what goes to other nodes go by a multicast group from now on.
    ///
    /// # Errors
    /// When this machine cannot take part in it.
    pub fn join_multicast(&mut self, group: SocketAddrV4) -> Result<(), WireSetupError> {
        self.wire.join_multicast(group)
    }

    /// Opens the direct links from this node to all others, where there are any.
    ///
    /// # Errors
    /// When an endpoint cannot be bound.
    pub fn connect_mesh(
        &mut self,
        me: EntityId,
        members: &[FleetMember],
    ) -> Result<(), WireSetupError> {
        self.wire.connect_mesh(me, members)
    }

    /// Returns the next message that arrives within some time, if any. Reliable messages arrive in the order in which
    /// their sender has sent them. Peers that are not connected can send only best-effort messages.
    pub fn receive(&mut self, within: Duration) -> Option<ReceivedMessage> {
        let now = self.now();
        self.excuse_absence(now.saturating_sub(self.listened_at));
        let until = now.saturating_add(within);
        loop {
            self.send_due();
            let now = self.now();
            // Wakes up for retransmissions and acknowledgments that become due while it waits.
            let next_due =
                self.peers.values().filter_map(|state| state.link.next_send_time()).min();
            let wake_at = next_due.map_or(until, |due| due.min(until));
            let bytes = self.wire.receive(wake_at.saturating_sub(now));
            // The wire has dropped these by their keys.
            for _ in 0..self.wire.take_forged() {
                self.count_bad_frame(drop_reason::FORGED);
            }
            self.listened_at = self.now();
            self.excuse_absence(self.listened_at.saturating_sub(wake_at));
            if let Some(bytes) = bytes {
                if let Some(received) = self.decode_frame(&bytes) {
                    return Some(received);
                }
            } else if self.now() >= until {
                return None;
            }
        }
    }

    /// Takes a time in which this messenger has not listened off the silence of all peers; after a long one they count as
    /// heard just now.
    fn excuse_absence(&mut self, absence: Duration) {
        if absence < MIN_ABSENCE {
            return;
        }
        let now = self.now();
        let excuse = if absence < RENEWAL_ABSENCE { absence } else { Duration::MAX };
        for state in self.peers.values_mut() {
            state.last_heard = state.last_heard.saturating_add(excuse).min(now);
        }
    }

    /// Returns a frame without its signature, where it must have one; an error is the reason why it is not believed.
    fn open_frame<'a>(&self, bytes: &'a [u8]) -> Result<&'a [u8], &'static str> {
        let Some(known) = &self.known_keys else { return Ok(bytes) };
        let Some((from, incarnation)) = TransportFrame::sender_process(bytes) else {
            // To be counted as what it is instead.
            return Ok(bytes);
        };
        let PeerId::Node(agent) = from else { return Ok(bytes) };
        if !is_signed(from, &[self.me]) {
            return Ok(bytes);
        }
        match known.open(agent, incarnation, bytes) {
            Ok(Some(frame)) => Ok(frame),
            Ok(None) => Err(drop_reason::STRANGER),
            Err(ForgedFrame) => Err(drop_reason::FORGED),
        }
    }

    fn decode_frame(&mut self, bytes: &[u8]) -> Option<ReceivedMessage> {
        let bytes = match self.open_frame(bytes) {
            Ok(bytes) => bytes,
            Err(drop_reason::STRANGER) => {
                self.count_drop(drop_reason::STRANGER);
                return None;
            }
            Err(reason) => {
                self.count_bad_frame(reason);
                return None;
            }
        };
        let frame = match TransportFrame::decode(bytes) {
            Ok(frame) => frame,
            Err(reason) => {
                self.count_bad_frame(reason.name());
                return None;
            }
        };
        let TransportFrame { from, incarnation, number, to, message } = frame;
        let is_among_nodes = matches!((from, self.me), (PeerId::Node(_), PeerId::Node(_)));
        let recipient = if to.is_empty() && is_among_nodes {
            RecipientHeader { peer: self.me, incarnation: None, ack: 0, sequence: None }
        } else {
            // A frame for most nodes is published to all of them, so some frames are not for this peer.
            to.into_iter().find(|recipient| recipient.peer == self.me)?
        };
        // A frame to the process that was here before has sequence numbers that mean nothing to this one.
        if recipient.incarnation.is_some_and(|to| to != self.incarnation) {
            self.count_drop(drop_reason::FORMER_LIFE);
            return None;
        }
        // What nodes say to each other is for members alone: another fleet may have the same multicast group.
        if is_among_nodes && !self.is_connected(from, incarnation) {
            self.count_drop(drop_reason::STRANGER);
            return None;
        }
        if !self.is_new(from, incarnation, number) {
            self.count_bad_frame(drop_reason::REPEATED);
            return None;
        }
        if let Err(reason) = self.process_header(from, incarnation, &recipient) {
            self.count_drop(reason);
            return None;
        }
        Some(ReceivedMessage { from, incarnation, message: message? })
    }

    fn is_connected(&self, peer: PeerId, incarnation: Incarnation) -> bool {
        self.peers.get(&peer).is_some_and(|state| state.incarnation == incarnation)
    }

    /// Records the arrival of a frame, and returns whether it is new. Of peers that are not connected all are: what they may
    /// send does no harm if it comes twice.
    fn is_new(&mut self, from: PeerId, incarnation: Incarnation, number: u64) -> bool {
        let state = self.peers.get_mut(&from).filter(|state| state.incarnation == incarnation);
        state.is_none_or(|state| state.arrived.record(number))
    }

    /// Processes the acknowledgment and the sequence number of a frame; an error is the reason why its message is dropped.
    fn process_header(
        &mut self,
        from: PeerId,
        incarnation: Incarnation,
        header: &RecipientHeader,
    ) -> Result<(), &'static str> {
        let now = self.now();
        let state = self.peers.get_mut(&from).filter(|state| state.incarnation == incarnation);
        let Some(state) = state else {
            return if header.sequence.is_none() { Ok(()) } else { Err(drop_reason::STRANGER) };
        };
        if now.saturating_sub(state.last_heard) > LINK_CHECK_TIMEOUT {
            state.link.hasten(now);
        }
        state.last_heard = now;
        // Without an incarnation the frame is for many, or of one that is not connected: it acknowledges nothing.
        if header.incarnation.is_some() {
            state.link.on_ack(header.ack, now);
        }
        match header.sequence {
            Some(sequence) if !state.link.accept_in_order(sequence, now) => {
                Err(drop_reason::OUT_OF_ORDER)
            }
            _ => Ok(()),
        }
    }
}

/// Returns whether a frame has a signature, where there are certificates: one from a node to other nodes, which the server
/// may relay. No frame is for nodes and the server.
fn is_signed(from: PeerId, to: &[PeerId]) -> bool {
    from != PeerId::Server && !to.contains(&PeerId::Server)
}

/// Returns a random number, so that no two processes of a peer share it.
fn new_incarnation() -> Incarnation {
    // The standard library seeds its hash maps from the system's source of randomness.
    Incarnation(RandomState::new().hash_one(std::process::id()))
}

#[cfg(test)]
mod tests;
