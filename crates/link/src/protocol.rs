//! Words that parties of a fleet exchange, and the frames in which they travel.
//!
//! A frame is postcard after a magic number and the version of this format. An unreadable frame is counted and
//! dropped, so that none can do harm.

use crate::peer::Peer;
use serde::{Deserialize, Serialize};
use sidestep::kernel::{Cycle, EntityId};
pub use sidestep_session::fleet::{ClockMode, Topology};

/// First bytes of every frame: `Sk`, and the version of the format.
const MAGIC: [u8; 3] = [b'S', b'k', 2];

/// Most bytes of a frame: a longer one is not read.
pub const MAX_FRAME_BYTES: usize = 64 << 20;

/// One life of a party: a process that starts again begins another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Incarnation(pub u64);

/// A frame on a wire: a word for some parties, or only acknowledgments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame<W = Message> {
    /// The sender.
    pub from: Peer,
    /// The sender's life.
    pub life: Incarnation,
    /// The receivers.
    pub to: Vec<Recipient>,
    /// The word, which is the same for all of them.
    pub word: Option<W>,
}

/// A receiver of a frame, and the facts for it alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recipient {
    /// The receiver.
    pub party: Peer,
    /// Its life, where the sender knows of one.
    pub life: Option<Incarnation>,
    /// All letters of the receiver below this number have come.
    pub received: u64,
    /// Number of the word among the letters to the receiver, which are repeated until they have come; none for a
    /// note, which may be lost.
    pub number: Option<u64>,
}

/// A word from one party to another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// Node to server, as a note: "May I join?"
    Join(Join),
    /// Server to node, as a note: "You may."
    Welcome(Welcome),
    /// Server to node, as a note: "You may not", with the reasons.
    Refused(JoinError),
    /// Node to server, as a note: its status.
    Status(Status),
    /// Server to node: all nodes, when they are complete or have changed.
    Roster(Vec<Member>),
    /// Node to node: a test whether it is heard.
    Hello,
    /// Node to server: all other nodes have heard it.
    Ready,
    /// Server to node: a cycle begins.
    Begin(CycleStart),
    /// Server to node, where time is counted in ticks: go on to a tick.
    Tick(AdvanceGrant),
    /// Node to server: it has done a tick.
    Ticked(AdvanceDone),
    /// Node to node: packets of a talk, sent in one step.
    Packets(Vec<Packet>),
    /// Server to node: the cycle's talks are over, or its time is up.
    Close(Cycle),
    /// Node to server: the agent's control.
    Control(Control),
    /// Server to node, as a note: a sign of life.
    Beat,
    /// Node to server: packets that it has sent, where all are recorded.
    Log(Vec<PacketRecord>),
    /// Server to node: the fleet has ended.
    End,
    /// Node to server: it has sent its last word.
    Left,
}

/// A node that wants to join.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Join {
    /// Its agent.
    pub agent: EntityId,
    /// Fingerprint of the scenario that it has read.
    pub scenario: Fingerprint,
    /// The build of its program.
    pub build: String,
    /// Endpoints at which other nodes reach it; none in a star.
    pub listens: Vec<String>,
    /// Its process on its machine.
    pub process: u32,
}

/// A digest of the things that two processes must have in common, in hexadecimal digits.
pub type Fingerprint = String;

/// The server's answer to a node that may join.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Welcome {
    /// The clock by which time passes.
    pub clock: ClockMode,
    /// The way from node to node.
    pub topology: Topology,
    /// Changes of the scenario beyond those that the node was given, as `key=value`.
    pub overrides: Vec<String>,
    /// Whether all packets are recorded.
    pub logs_packets: bool,
}

/// The reason why a node may not join, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinError {
    /// The reason.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
}

/// A node of a fleet, as known to others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Member {
    /// Its agent.
    pub agent: EntityId,
    /// Its present life.
    pub life: Incarnation,
    /// Endpoints at which it is reached.
    pub listens: Vec<String>,
}

/// The start of a cycle for a node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleStart {
    /// The cycle.
    pub cycle: Cycle,
    /// The agent's percept, serialized.
    #[serde(with = "bytes")]
    pub sight: Vec<u8>,
    /// Agents that its radio does not reach, rising.
    pub beyond: Vec<EntityId>,
}

/// A tick that a node may go on to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct AdvanceGrant {
    /// The cycle.
    pub cycle: Cycle,
    /// The tick.
    pub tick: u64,
    /// Number of packets of the cycle that arrive at the node until then.
    pub packets: u64,
}

/// A node's report that it has done a tick.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AdvanceDone {
    /// The cycle.
    pub cycle: Cycle,
    /// The tick.
    pub tick: u64,
    /// Packets that it has sent in it: receiver, and the tick of arrival.
    pub sent: Vec<(EntityId, u64)>,
    /// The tick of its next timer.
    pub timer: Option<u64>,
    /// Whether its control is ready.
    pub is_done: bool,
}

/// A packet of a talk.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Packet {
    /// The cycle of the talk.
    pub cycle: Cycle,
    /// The tick in which all of it was on its way.
    pub left: u64,
    /// Its number among the sender's, in the talk or, in real time, in the cycle.
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
    /// The cycle of the talk.
    pub cycle: Cycle,
    /// The tick in which it was sent.
    pub sent: u64,
    /// The receiver.
    pub to: EntityId,
    /// Its number among the sender's, in the talk or, in real time, in the cycle.
    pub sequence: u32,
    /// Its size.
    pub bytes: u32,
    /// Number of times that it arrives: 0 if the scenario's faults take it, 2 if they double it.
    pub copies: u32,
    /// The tick in which it first arrives; 0 if it does not.
    pub arrives: u64,
}

/// The control of an agent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Control {
    /// The cycle.
    pub cycle: Cycle,
    /// The control, serialized.
    pub control: Vec<u8>,
}

/// The state of a node, reported twice a second.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Status {
    /// The cycle that it is in.
    pub cycle: Cycle,
    /// Words for its part in the cycle, e.g. `optimize`.
    pub doing: String,
    /// Number of rounds of the present talk.
    pub round: u32,
    /// Epoch of the coordinator that it follows.
    pub epoch: u64,
    /// Others that it heard in the last cycle.
    pub heard: Vec<EntityId>,
    /// Packets that it has sent so far.
    pub packets: u64,
    /// Bytes of these packets.
    pub bytes: u64,
    /// Frames that were sent again.
    pub retries: u64,
    /// Frames and packets that it has dropped, by reason.
    pub dropped: Vec<(String, u64)>,
}

/// The reason why a frame is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DecodeError {
    /// It is not one of ours, or of another version.
    Foreign,
    /// It is one of ours, and damaged.
    Damaged,
    /// It is longer than a frame may be.
    TooLong,
}

impl<W: Serialize> Frame<W> {
    /// Returns the bytes of the frame.
    pub fn encode(&self) -> Vec<u8> {
        postcard::to_extend(self, MAGIC.to_vec()).expect("frames are plain data")
    }
}

impl Frame {
    /// Reads a frame.
    ///
    /// # Errors
    /// With the reason why it cannot be read.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        if bytes.len() > MAX_FRAME_BYTES {
            return Err(DecodeError::TooLong);
        }
        let body = bytes.strip_prefix(&MAGIC).ok_or(DecodeError::Foreign)?;
        match postcard::take_from_bytes(body) {
            Ok((frame, [])) => Ok(frame),
            _ => Err(DecodeError::Damaged),
        }
    }
}

impl DecodeError {
    /// Returns the reason in a word, its name in metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Foreign => "foreign",
            Self::Damaged => "damaged",
            Self::TooLong => "too-long",
        }
    }
}

/// Bytes in one piece: reading them one by one takes ten times as long. The format is the same.
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

    fn frame(payload: Vec<u8>) -> Frame {
        let packet = Packet { cycle: 3, left: 5, sequence: 7, arrives: 6, payload };
        let address = |id, number| Recipient {
            party: Peer::Node(id),
            life: Some(Incarnation(2)),
            received: 11,
            number,
        };
        let to = vec![address(5, Some(9)), address(6, None)];
        let word = Some(Message::Packets(vec![packet.clone(), packet]));
        Frame { from: Peer::Node(4), life: Incarnation(1), to, word }
    }

    proptest! {
        #[test]
        fn frames_are_read_as_they_were_written(payload: Vec<u8>) {
            let frame = frame(payload);
            prop_assert_eq!(Frame::decode(&frame.encode()), Ok(frame));
        }

        #[test]
        fn no_bytes_do_harm(mut bytes: Vec<u8>, is_ours: bool) {
            if is_ours {
                bytes.splice(0..0, MAGIC);
            }
            let _ = Frame::decode(&bytes);
        }

        #[test]
        fn a_frame_that_is_cut_short_or_goes_on_is_not_read(payload: Vec<u8>, cut in 0usize..40) {
            let mut bytes = frame(payload).encode();
            bytes.push(0);
            prop_assert_eq!(Frame::decode(&bytes), Err(DecodeError::Damaged));
            let length = bytes.len() - 2 - cut.min(bytes.len() - 2);
            prop_assert!(Frame::decode(&bytes[..length]).is_err());
        }
    }
}
