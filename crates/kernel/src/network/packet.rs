//! Packets: the bytes that go over the network, around every message.
//!
//! ```text
//! magic  version  topic  fingerprint  cycle  members  sender  sequence  checksum  message ...
//! 2      1        1      8            8      8        4       4         8         bytes, little-endian
//! ```
//!
//! Bytes from a network may be anything. [`parse_packet`] lets through only those that another agent of the same
//! scenario and build has sent in this form, for a talk; the message itself is checked by the agent that
//! takes it. The checksum detects damage on the way, not forgery: the network below has to control access.

use crate::units::{Cycle, EntityId};
use serde::{Deserialize, Serialize};

const MAGIC: [u8; 2] = *b"Ss";
const VERSION: u8 = 2;
/// Number of bytes before the message.
pub const HEADER_BYTES: usize = 44;
/// Place of the checksum among them.
const CHECKSUM_OFFSET: usize = HEADER_BYTES - 8;
/// Number of bytes for which there is room in a new packet.
const TYPICAL_BYTES: usize = 512;

/// The subject of a talk, as a world names it.
pub trait Protocol: Copy + Ord {
    /// Returns its number on the wire.
    fn number(self) -> u8;

    /// Returns the topic of a number, if there is one.
    fn from_number(number: u8) -> Option<Self>;
}

/// The identity of a talk: messages of one are not meant for any other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ConversationId<T> {
    /// The cycle that is decided.
    pub cycle: Cycle,
    /// The subject.
    pub topic: T,
    /// A digest of the ids of all members: an agent that assumes a different group is in another
    /// talk.
    pub members: u64,
}

impl<T: Protocol> ConversationId<T> {
    /// Returns the identity of the talk of these agents, by rising id.
    pub fn new(cycle: Cycle, topic: T, members: &[EntityId]) -> Self {
        let bytes: Vec<u8> = members.iter().flat_map(|id| id.to_le_bytes()).collect();
        Self { cycle, topic, members: digest([&bytes, &[]]) }
    }

    /// Returns whether it comes before another one, regardless of its members.
    pub fn is_before(&self, other: &Self) -> bool {
        (self.cycle, self.topic) < (other.cycle, other.topic)
    }
}

/// A message in its serialized form, with room before it for the header of a packet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PacketBuffer(Vec<u8>);

impl PacketBuffer {
    /// Returns a message in the form in which it travels.
    pub fn from_message<M: Serialize + ?Sized>(message: &M) -> Self {
        let mut room = Vec::with_capacity(TYPICAL_BYTES);
        room.resize(HEADER_BYTES, 0);
        Self(postcard::to_extend(message, room).expect("messages are plain data"))
    }

    /// Returns an already serialized message.
    pub fn from_bytes(message: &[u8]) -> Self {
        Self([&[0; HEADER_BYTES], message].concat())
    }

    /// Returns a message that is followed by bytes in a form of their own.
    pub fn from_parts<M: Serialize + ?Sized>(message: &M, bytes: &[u8]) -> Self {
        let Self(mut draft) = Self::from_message(message);
        draft.extend_from_slice(bytes);
        Self(draft)
    }

    /// The message.
    pub fn message(&self) -> &[u8] {
        &self.0[HEADER_BYTES..]
    }

    /// Number of bytes of the packet that it becomes.
    #[expect(clippy::len_without_is_empty, reason = "it always has a header")]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the bytes of the packet.
    pub fn into_packet<T: Protocol>(mut self, seal: &PacketHeader<T>) -> Vec<u8> {
        seal.write(&mut self.0[..CHECKSUM_OFFSET]);
        let (head, message) = self.0.split_at(HEADER_BYTES);
        let checksum = digest([&head[..CHECKSUM_OFFSET], message]).to_le_bytes();
        self.0[CHECKSUM_OFFSET..HEADER_BYTES].copy_from_slice(&checksum);
        self.0
    }
}

/// The statements of a packet about its message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketHeader<T> {
    /// Digest of scenario and build: agents with any other are not understood.
    pub fingerprint: u64,
    /// The talk.
    pub conversation: ConversationId<T>,
    /// The sender.
    pub sender: EntityId,
    /// Number among the sender's packets of the talk.
    pub sequence: u32,
}

impl<T: Protocol> PacketHeader<T> {
    /// Writes the bytes before the checksum.
    fn write(&self, room: &mut [u8]) {
        let Self {
            fingerprint,
            conversation: ConversationId { cycle, topic, members },
            sender,
            sequence,
        } = *self;
        let [m, a] = MAGIC;
        room[..4].copy_from_slice(&[m, a, VERSION, topic.number()]);
        room[4..12].copy_from_slice(&fingerprint.to_le_bytes());
        room[12..20].copy_from_slice(&cycle.to_le_bytes());
        room[20..28].copy_from_slice(&members.to_le_bytes());
        room[28..32].copy_from_slice(&sender.to_le_bytes());
        room[32..36].copy_from_slice(&sequence.to_le_bytes());
    }

    /// Reads the bytes before the checksum.
    fn read(bytes: &[u8]) -> Result<Self, DropReason> {
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        let half = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| bytes[at + k]));
        if bytes[..2] != MAGIC {
            return Err(DropReason::NoPacket);
        }
        if bytes[2] != VERSION {
            return Err(DropReason::Version);
        }
        let topic = T::from_number(bytes[3]).ok_or(DropReason::Damaged)?;
        let talk = ConversationId { cycle: word(12), topic, members: word(20) };
        Ok(Self { fingerprint: word(4), conversation: talk, sender: half(28), sequence: half(32) })
    }
}

/// Returns the seal of a packet, and its message.
///
/// # Errors
/// When the bytes are no packet of `fingerprint`, or were damaged.
pub fn parse_packet<T: Protocol>(
    bytes: &[u8],
    fingerprint: u64,
) -> Result<(PacketHeader<T>, &[u8]), DropReason> {
    let Some((head, message)) = bytes.split_at_checked(HEADER_BYTES) else {
        return Err(DropReason::NoPacket);
    };
    let (said, checksum) = head.split_at(CHECKSUM_OFFSET);
    let seal = PacketHeader::read(said)?;
    if digest([said, message]).to_le_bytes() != *checksum {
        return Err(DropReason::Damaged);
    }
    if seal.fingerprint != fingerprint {
        return Err(DropReason::Fingerprint);
    }
    Ok((seal, message))
}

/// A reason why a packet was dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum DropReason {
    /// Too short, or without the first bytes of a packet.
    NoPacket,
    /// The packet is of another version of this form.
    Version,
    /// Its checksum is wrong.
    Damaged,
    /// The packet is of another scenario or build.
    Fingerprint,
    /// Larger than any message of its talk.
    TooLarge,
    /// The sender is not in the group, or gives the name of another agent.
    Sender,
    /// The talk is over for all.
    Stale,
    /// The talk has other members.
    OtherGroup,
    /// The talk comes later, and nothing more of it can be kept.
    NoRoom,
    /// Its message cannot be read.
    Unreadable,
    /// Its message can be read, but its content is impossible.
    Unsound,
}

impl DropReason {
    /// All reasons.
    pub const ALL: [Self; 11] = [
        Self::NoPacket,
        Self::Version,
        Self::Damaged,
        Self::Fingerprint,
        Self::TooLarge,
        Self::Sender,
        Self::Stale,
        Self::OtherGroup,
        Self::NoRoom,
        Self::Unreadable,
        Self::Unsound,
    ];

    /// Returns its name in metrics and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoPacket => "no-packet",
            Self::Version => "version",
            Self::Damaged => "damaged",
            Self::Fingerprint => "fingerprint",
            Self::TooLarge => "too-large",
            Self::Sender => "sender",
            Self::Stale => "stale",
            Self::OtherGroup => "other-group",
            Self::NoRoom => "no-room",
            Self::Unreadable => "unreadable",
            Self::Unsound => "unsound",
        }
    }
}

/// Packets that were dropped, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DropCounts([u64; DropReason::ALL.len()]);

impl DropCounts {
    /// Counts a packet that was dropped.
    pub fn record(&mut self, why: DropReason) {
        self.0[why as usize] += 1;
    }

    /// Returns the number of packets that were dropped for a reason.
    pub fn get(&self, why: DropReason) -> u64 {
        self.0[why as usize]
    }

    /// Returns the number of all packets that were dropped.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// Returns a digest of two pieces of bytes, one after the other: fast, but no defense against forgery.
pub fn digest(pieces: [&[u8]; 2]) -> u64 {
    let add = |sum: u64, piece: &[u8]| mix(sum ^ digest_bytes(piece), FACTOR ^ piece.len() as u64);
    pieces.into_iter().fold(FACTOR, add)
}

const FACTOR: u64 = 0x9E37_79B9_7F4A_7C15;
const OTHER_FACTOR: u64 = 0xC2B2_AE3D_27D4_EB4F;

/// Returns both halves of a product as one.
fn mix(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}

/// Returns a digest of some bytes. Four sums go side by side, because each product has to wait for the one before
/// it.
fn digest_bytes(bytes: &[u8]) -> u64 {
    const LANES: usize = 4;
    let both = |sum: u64, bytes: &[u8; 16]| {
        let (words, _) = bytes.as_chunks::<8>();
        let [a, b] = [words[0], words[1]].map(u64::from_le_bytes);
        mix(sum ^ a ^ FACTOR, b ^ OTHER_FACTOR)
    };
    let (pairs, rest) = bytes.as_chunks::<16>();
    let (blocks, pairs) = pairs.as_chunks::<LANES>();
    let mut sums: [u64; LANES] = [1, 2, 3, 4];
    for block in blocks {
        sums = std::array::from_fn(|lane| both(sums[lane], &block[lane]));
    }
    let sum = sums.into_iter().fold(0, |sum, lane| mix(sum ^ FACTOR, lane ^ OTHER_FACTOR));
    let mut last = [0; 16];
    last[..rest.len()].copy_from_slice(rest);
    both(pairs.iter().fold(sum, both), &last)
}

/// Returns the digest of a scenario's text and seed.
pub fn fingerprint(text: &str, seed: u64) -> u64 {
    digest([text.as_bytes(), &seed.to_le_bytes()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    struct Weather;

    impl Protocol for Weather {
        fn number(self) -> u8 {
            9
        }

        fn from_number(number: u8) -> Option<Self> {
            (number == 9).then_some(Self)
        }
    }

    /// Any flipped bit of a packet, and any cut: the checksum finds it.
    #[test]
    fn a_packet_of_which_a_bit_was_turned_is_damaged() {
        let talk = ConversationId::new(7, Weather, &[1, 4, 9]);
        let seal = PacketHeader {
            fingerprint: 0x0123_4567_89AB_CDEF,
            conversation: talk,
            sender: 4,
            sequence: 3,
        };
        for length in [0, 1, 7, 16, 63, 64, 65, 200] {
            let message: Vec<u8> = (0..length).map(|k| (k * k) as u8).collect();
            let packet = PacketBuffer::from_bytes(&message).into_packet(&seal);
            assert_eq!(parse_packet(&packet, seal.fingerprint), Ok((seal, &message[..])));
            for bit in 0..8 * packet.len() {
                let mut turned = packet.clone();
                turned[bit / 8] ^= 1 << (bit % 8);
                assert!(
                    parse_packet::<Weather>(&turned, seal.fingerprint).is_err(),
                    "bit {bit} of {length} bytes"
                );
            }
        }
    }
}
