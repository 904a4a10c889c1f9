//! Messages that the peers of a fleet exchange, and the frames that carry them.
//!
//! A frame is a magic number with the version of this format, followed by postcard and a digest of all before it. An
//! unreadable frame is counted and dropped: a foreign program on the same network must not be able to stop a fleet, nor
//! bits that flip on the way. The digest has no key, so it is no protection against somebody who writes whole frames:
//! that is what certificates are for.

use crate::peer::PeerId;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use sidestep::kernel::digest::Digest;
use sidestep::kernel::{Cycle, EntityId};
pub use sidestep_session::fleet::{ClockMode, Topology};
use std::net::SocketAddrV4;

/// First bytes of every frame: `Sk`, and the version of the format.
const MAGIC: [u8; 3] = [b'S', b'k', 6];

/// Bytes of the digest at the end of a frame: of 10^9 damaged ones, all are noticed but for a chance of 1 in 10^10.
const DIGEST_BYTES: usize = 8;

/// Maximum size of a frame, far above any percept: no node can make another one decode more than this.
pub const MAX_FRAME_BYTES: usize = 64 << 20;

/// Incarnation of a peer: a process that starts again gets a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Incarnation(pub u64);

/// A frame on a wire: a message for some peers, or only acknowledgments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TransportFrame<M = Message> {
    /// The sender.
    pub from: PeerId,
    /// The sender's incarnation.
    pub incarnation: Incarnation,
    /// Its number among the frames of this incarnation, from 0 on; one that comes twice was repeated on the way.
    pub number: u64,
    /// The receivers; another peer that gets the frame ignores it. An empty list, from a node, stands for all other nodes.
    pub to: Vec<RecipientHeader>,
    /// The message, the same for all receivers; none in a frame that only acknowledges.
    pub message: Option<M>,
}

/// A receiver of a frame, with the header fields that differ by receiver: so a message to many is serialized once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RecipientHeader {
    /// The receiver.
    pub peer: PeerId,
    /// Its incarnation, if the sender knows it; none in frames to many that may be lost, which acknowledge nothing.
    pub incarnation: Option<Incarnation>,
    /// Cumulative acknowledgment: the sender has received all reliable messages of the receiver below this number.
    pub ack: u64,
    /// Sequence number of the message among the reliable ones to the receiver; none for a best-effort message.
    pub sequence: Option<u64>,
}

/// A message from one peer to another.
///
/// Messages are reliable (retransmitted until acknowledged) unless said to be best-effort. Joining is best-effort,
/// because reliable messages need a known incarnation at both ends, and joining is how peers learn it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// Node to server, best-effort: asks to join.
    Join(JoinRequest),
    /// Server to node, best-effort: the node may join.
    Welcome(Welcome),
    /// Server to node, best-effort: the node may not join, or has lost its place, with the reasons.
    Refused(JoinError),
    /// Node to server, best-effort: its status.
    Status(NodeStatusReport),
    /// Server to node: all nodes, sent when they are complete or have changed.
    Roster(Vec<FleetMember>),
    /// Node to node: a test whether the other one receives it; the acknowledgment is the answer.
    Hello,
    /// Node to server: all other nodes have acknowledged its `Hello`.
    Ready,
    /// Server to node: a cycle begins.
    CycleStart(CycleStart),
    /// Server to node, where time is counted in ticks: advance to a tick.
    Grant(AdvanceGrant),
    /// Node to server: it has done a tick.
    TickDone(AdvanceDone),
    /// Node to node: packets of a conversation, sent in one step.
    Packets(Vec<AgentPacket>),
    /// Server to node: the cycle's conversations are over, or its time is up.
    Close(Cycle),
    /// Node to server: the agent's control.
    Control(Control),
    /// Server to node, best-effort: a sign of life.
    Heartbeat,
    /// Node to server: packets that it has sent, where all are recorded.
    PacketLog(Vec<PacketRecord>),
    /// Server to node: the fleet has ended.
    End,
    /// Node to server: goodbye, nothing follows.
    Goodbye,
    /// Node to server: it leaves before the fleet's end, with the reason. Best-effort from one that has had no answer.
    Left(String),
}

/// A node that wants to join.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinRequest {
    /// The agent that it would run.
    pub agent: EntityId,
    /// Fingerprint of the scenario that it has read.
    pub scenario: ScenarioFingerprint,
    /// The build of its program.
    pub build: String,
    /// Endpoints at which other nodes reach it; none in a star.
    pub listens: Vec<String>,
    /// Its process id on its machine.
    pub process: u32,
    /// The key by which it signs what other nodes receive; none without certificates.
    pub session: Option<SessionCertificate>,
}

/// A digest of a scenario and its files, in hexadecimal digits: two processes that differ in it would simulate
/// different worlds.
pub type ScenarioFingerprint = String;

/// The server's answer to a node that may join.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Welcome {
    /// The clock by which time passes.
    pub clock: ClockMode,
    /// The path of packets from node to node.
    pub topology: Topology,
    /// The group of all nodes, with multicast.
    pub multicast_group: Option<SocketAddrV4>,
    /// Changes of the scenario beyond those that the node was given, as `key=value`.
    pub overrides: Vec<String>,
    /// Whether all packets are recorded.
    pub logs_packets: bool,
}

/// The reason why a node may not join, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinError {
    /// What is wrong, for the node's user.
    pub cause: String,
    /// What the node's user can do about it.
    pub remedy: String,
}

/// A node of a fleet, as known to others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FleetMember {
    /// The agent that it runs; there is one node for each.
    pub agent: EntityId,
    /// Its present incarnation.
    pub incarnation: Incarnation,
    /// Endpoints at which it is reached.
    pub listens: Vec<String>,
    /// The key by which it signs what other nodes receive; none without certificates.
    pub session: Option<SessionCertificate>,
}

/// The public key by which a node's process signs its frames, and who says that it is (`signature.rs`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SessionCertificate {
    /// The public key: Ed25519.
    pub key: [u8; 32],
    /// The node's certificate, and those between it and the authority (DER).
    pub chain: Vec<Vec<u8>>,
    /// The kind of the signature, by its number in TLS.
    pub scheme: u16,
    /// The signature of the certificate's key: over the agent, the incarnation and the public key.
    pub signature: Vec<u8>,
}

/// The start of a cycle for a node, or of its agent's round where agents decide one after the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleStart {
    /// The cycle; the node gives up an earlier one.
    pub cycle: Cycle,
    /// The agent's percept, serialized.
    #[serde(with = "bytes")]
    pub percept: Vec<u8>,
    /// Agents out of range of its radio, in ascending order.
    pub out_of_range: Vec<EntityId>,
}

/// A tick to which a node may advance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct AdvanceGrant {
    /// The cycle; a node ignores a grant of another one.
    pub cycle: Cycle,
    /// The tick, in which a timer of the node ends or a packet arrives.
    pub tick: u64,
    /// Number of packets of the cycle that arrive at the node by that tick: it waits for all of them first, because
    /// other nodes' packets and this message travel over different links.
    pub packets: u64,
}

/// A node's report that it has done a tick.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AdvanceDone {
    /// The cycle; the server ignores a report of another one.
    pub cycle: Cycle,
    /// The tick that it has done.
    pub tick: u64,
    /// Packets that it has sent in it: receiver, and tick of arrival.
    pub sent: Vec<(EntityId, u64)>,
    /// The tick of its next timer; `None` where only a packet can make it go on.
    pub next_timer: Option<u64>,
    /// Whether its control is ready.
    pub is_done: bool,
}

/// A packet of a conversation between agents.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct AgentPacket {
    /// The cycle of the conversation.
    pub cycle: Cycle,
    /// The tick in which its last byte left the sender.
    pub departs: u64,
    /// Its number among the sender's, in the conversation or, in real time, in the cycle.
    pub sequence: u32,
    /// The tick in which it arrives, where time is counted in ticks.
    pub arrives: u64,
    /// Its content.
    #[serde(with = "bytes")]
    pub payload: Vec<u8>,
}

/// A packet to one receiver, as recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PacketRecord {
    /// The cycle of the conversation.
    pub cycle: Cycle,
    /// The tick in which it was sent.
    pub sent: u64,
    /// The receiver.
    pub to: EntityId,
    /// Its number among the sender's, in the conversation or, in real time, in the cycle.
    pub sequence: u32,
    /// Its size in bytes.
    pub bytes: u32,
    /// Number of times that it arrives: 0 if the scenario's faults drop it, 2 if they duplicate it.
    pub copies: u32,
    /// The tick in which it first arrives; 0 if it does not.
    pub arrives: u64,
}

/// The control of an agent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Control {
    /// The cycle for which it was decided; it is carried out in no other.
    pub cycle: Cycle,
    /// The control, serialized.
    pub control: Vec<u8>,
}

/// The state of a node, reported twice a second.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NodeStatusReport {
    /// The cycle that it is in.
    pub cycle: Cycle,
    /// Name of its activity in the cycle, e.g. `optimize`.
    pub activity: String,
    /// Number of rounds of the present conversation.
    pub round: u32,
    /// Epoch of the coordinator that it follows.
    pub epoch: u64,
    /// Other agents that it has heard in the last cycle.
    pub heard: Vec<EntityId>,
    /// Packets that it has sent so far.
    pub packets: u64,
    /// Bytes of these packets.
    pub bytes: u64,
    /// Bytes of all frames that it has sent: packets, controls and its status, but no headers of the network.
    pub frame_bytes: u64,
    /// Processor time in milliseconds that its process has used since its first cycle began; none where its system does
    /// not tell.
    pub processor_ms: Option<u64>,
    /// Messages that were retransmitted.
    pub retries: u64,
    /// Frames and packets that it has dropped, by reason.
    pub dropped: Vec<(String, u64)>,
}

/// The reason why a frame is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DecodeError {
    /// It is of another program, or of another version of this format.
    Foreign,
    /// It is of this format, and damaged.
    Damaged,
    /// It is longer than a frame may be.
    TooLong,
}

impl<M: Serialize> TransportFrame<M> {
    /// Returns the frame as a wire carries it, the magic number first.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = postcard::to_extend(self, MAGIC.to_vec()).expect("frames are plain data");
        let digest = frame_digest(&bytes);
        bytes.extend(digest);
        bytes
    }
}

impl TransportFrame {
    /// Returns the sender that a frame names, without reading the rest; `None` for another text.
    pub fn sender(bytes: &[u8]) -> Option<PeerId> {
        Self::sender_process(bytes).map(|(sender, _)| sender)
    }

    /// Returns the sender that a frame names, with its incarnation; `None` for another text.
    pub fn sender_process(bytes: &[u8]) -> Option<(PeerId, Incarnation)> {
        let body = bytes.strip_prefix(&MAGIC)?;
        postcard::take_from_bytes(body).ok().map(|(sender, _)| sender)
    }

    /// Reads a frame of a fleet.
    ///
    /// # Errors
    /// With the reason why it cannot be read.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        Self::read(bytes)
    }
}

impl<M: DeserializeOwned> TransportFrame<M> {
    /// Reads a frame with any kind of messages.
    ///
    /// # Errors
    /// With the reason why it cannot be read.
    pub fn read(bytes: &[u8]) -> Result<Self, DecodeError> {
        if bytes.len() > MAX_FRAME_BYTES {
            return Err(DecodeError::TooLong);
        }
        let body = bytes.strip_prefix(&MAGIC).ok_or(DecodeError::Foreign)?;
        let (body, digest) = body.split_last_chunk().ok_or(DecodeError::Damaged)?;
        if *digest != frame_digest(&bytes[..bytes.len() - DIGEST_BYTES]) {
            return Err(DecodeError::Damaged);
        }
        match postcard::take_from_bytes(body) {
            Ok((frame, [])) => Ok(frame),
            _ => Err(DecodeError::Damaged),
        }
    }
}

/// Returns the digest of a frame's bytes before it.
fn frame_digest(bytes: &[u8]) -> [u8; DIGEST_BYTES] {
    let digest = Digest::hash_bytes(bytes);
    let (first, _) = digest.as_bytes().split_first_chunk().expect("it is longer");
    *first
}

impl DecodeError {
    /// Returns the name of the reason in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Foreign => "foreign",
            Self::Damaged => "damaged",
            Self::TooLong => "too-long",
        }
    }
}

/// Bytes in one piece: serde reads a `Vec<u8>` number by number, which takes ten times as long. The encoded bytes are
/// the same.
mod bytes {
    use serde::de::{Deserializer, Error, Visitor};
    use serde::ser::Serializer;
    use std::fmt;

    pub(super) fn serialize<S: Serializer>(bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_bytes(bytes)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
        struct BytesVisitor;

        impl Visitor<'_> for BytesVisitor {
            type Value = Vec<u8>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("bytes")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
                Ok(bytes.to_vec())
            }
        }

        from.deserialize_bytes(BytesVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(payload: Vec<u8>) -> TransportFrame {
        let packet = AgentPacket { cycle: 3, departs: 5, sequence: 7, arrives: 6, payload };
        let recipient = |id, sequence| RecipientHeader {
            peer: PeerId::Node(id),
            incarnation: Some(Incarnation(2)),
            ack: 11,
            sequence,
        };
        let to = vec![recipient(5, Some(9)), recipient(6, None)];
        let message = Some(Message::Packets(vec![packet.clone(), packet]));
        let from = PeerId::Node(4);
        TransportFrame { from, incarnation: Incarnation(1), number: 300, to, message }
    }

    proptest! {
        #[test]
        fn frames_are_read_as_they_were_written(payload: Vec<u8>) {
            let frame = frame(payload);
            prop_assert_eq!(TransportFrame::decode(&frame.encode()), Ok(frame));
        }

        #[test]
        fn no_bytes_do_harm(mut bytes: Vec<u8>, is_ours: bool) {
            if is_ours {
                bytes.splice(0..0, MAGIC);
            }
            let _ = TransportFrame::decode(&bytes);
        }

        #[test]
        fn a_frame_that_is_cut_short_or_goes_on_is_not_read(payload: Vec<u8>, cut in 0usize..40) {
            let mut bytes = frame(payload).encode();
            bytes.push(0);
            prop_assert_eq!(TransportFrame::decode(&bytes), Err(DecodeError::Damaged));
            let length = bytes.len() - 2 - cut.min(bytes.len() - 2);
            prop_assert!(TransportFrame::decode(&bytes[..length]).is_err());
        }

        #[test]
        fn a_frame_of_which_any_bit_flips_is_not_read(payload: Vec<u8>) {
            let whole = frame(payload).encode();
            for bit in 0..8 * whole.len() {
                let mut bytes = whole.clone();
                bytes[bit / 8] ^= 1 << (bit % 8);
                prop_assert!(TransportFrame::decode(&bytes).is_err(), "bit {}", bit);
            }
        }
    }
}
