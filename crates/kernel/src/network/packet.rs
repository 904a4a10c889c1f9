//! Packets: the bytes that go over the network, around every message.
//!
//! ```text
//! magic  version  topic  fingerprint  cycle  members  sender  sequence  checksum  message ...
//! 2      1        1      8            8      8        4       4         8         bytes, little-endian
//! ```
//!
//! Bytes from a network may be anything. [`parse_packet`] lets through only those that another agent of the same
//! scenario and build has sent in this form; the receiver checks the message itself. The checksum detects damage in
//! transit, not forgery: the network below has to control access.

use crate::units::{Cycle, EntityId};
use serde::{Deserialize, Serialize};

/// The first bytes of each packet, so that those of other programs are recognized at once.
const MAGIC: [u8; 2] = *b"Ss";
/// Version of this layout and of its checksum; packets of other versions are dropped.
const VERSION: u8 = 2;
/// Number of bytes before the message.
pub const HEADER_BYTES: usize = 44;
/// The checksum is the last field, so that it covers all others.
const CHECKSUM_OFFSET: usize = HEADER_BYTES - 8;
/// Initial capacity of a packet in bytes: most messages then need no second allocation.
const TYPICAL_BYTES: usize = 512;

/// The topics of conversations in a world, rising in the order in which a cycle has them.
pub trait ConversationTopic: Copy + Ord {
    /// Returns its number on the wire.
    fn wire_number(self) -> u8;

    /// Returns the topic of a number, if there is one.
    fn from_wire_number(number: u8) -> Option<Self>;
}

/// The identity of a conversation: a message of one is never accepted in another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ConversationId<T> {
    /// The cycle that is decided.
    pub cycle: Cycle,
    /// The topic; a cycle has its topics in rising order.
    pub topic: T,
    /// A digest of the ids of all members: agents that assume different groups are in different conversations.
    pub members: u64,
}

impl<T: ConversationTopic> ConversationId<T> {
    /// Returns the identity of the conversation of these agents, by rising id.
    pub fn new(cycle: Cycle, topic: T, members: &[EntityId]) -> Self {
        let bytes: Vec<u8> = members.iter().flat_map(|id| id.to_le_bytes()).collect();
        Self { cycle, topic, members: digest_pieces([&bytes, &[]]) }
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
        let mut bytes = Vec::with_capacity(TYPICAL_BYTES);
        bytes.resize(HEADER_BYTES, 0);
        Self(postcard::to_extend(message, bytes).expect("messages are plain data"))
    }

    /// Returns the buffer of a message that was serialized before, with room for the header.
    pub fn from_bytes(message: &[u8]) -> Self {
        Self([&[0; HEADER_BYTES], message].concat())
    }

    /// Returns a message that is followed by bytes in a form of their own.
    pub fn from_parts<M: Serialize + ?Sized>(message: &M, bytes: &[u8]) -> Self {
        let Self(mut packet) = Self::from_message(message);
        packet.extend_from_slice(bytes);
        Self(packet)
    }

    /// The serialized message, without the room for the header.
    pub fn serialized_message(&self) -> &[u8] {
        &self.0[HEADER_BYTES..]
    }

    /// Number of bytes of the packet that it becomes.
    #[expect(clippy::len_without_is_empty, reason = "it always has a header")]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Writes the header and the checksum into the room before the message, without a copy of it.
    pub fn into_packet<T: ConversationTopic>(mut self, header: &PacketHeader<T>) -> Vec<u8> {
        header.write(&mut self.0[..CHECKSUM_OFFSET]);
        let (head, message) = self.0.split_at(HEADER_BYTES);
        let checksum = digest_pieces([&head[..CHECKSUM_OFFSET], message]).to_le_bytes();
        self.0[CHECKSUM_OFFSET..HEADER_BYTES].copy_from_slice(&checksum);
        self.0
    }
}

/// The header of a packet, without its checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketHeader<T> {
    /// Digest of scenario and build: packets with any other are dropped.
    pub fingerprint: u64,
    /// The conversation to which the packet belongs; each of its parts is in the header.
    pub conversation: ConversationId<T>,
    /// Id of the sender, which nothing in a packet proves.
    pub sender: EntityId,
    /// Number among the sender's packets of the conversation.
    pub sequence: u32,
}

impl<T: ConversationTopic> PacketHeader<T> {
    fn write(&self, bytes: &mut [u8]) {
        let ConversationId { cycle, topic, members } = self.conversation;
        bytes[..2].copy_from_slice(&MAGIC);
        bytes[2] = VERSION;
        bytes[3] = topic.wire_number();
        bytes[4..12].copy_from_slice(&self.fingerprint.to_le_bytes());
        bytes[12..20].copy_from_slice(&cycle.to_le_bytes());
        bytes[20..28].copy_from_slice(&members.to_le_bytes());
        bytes[28..32].copy_from_slice(&self.sender.to_le_bytes());
        bytes[32..36].copy_from_slice(&self.sequence.to_le_bytes());
    }

    /// Checks as little as it can: the checksum is not known to be right yet.
    fn read(bytes: &[u8]) -> Result<Self, DropReason> {
        if bytes[..2] != MAGIC {
            return Err(DropReason::NoPacket);
        }
        if bytes[2] != VERSION {
            return Err(DropReason::Version);
        }
        let topic = T::from_wire_number(bytes[3]).ok_or(DropReason::Damaged)?;
        Ok(Self {
            fingerprint: read_u64(bytes, 4),
            conversation: ConversationId {
                cycle: read_u64(bytes, 12),
                topic,
                members: read_u64(bytes, 20),
            },
            sender: read_u32(bytes, 28),
            sequence: read_u32(bytes, 32),
        })
    }
}

// Inlined, because both read the header of each packet: out of line they were 2 % of the instructions of a chain's team.
#[inline]
fn read_u64(bytes: &[u8], offset: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|k| bytes[offset + k]))
}

#[inline]
fn read_u32(bytes: &[u8], offset: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|k| bytes[offset + k]))
}

/// Returns the header of a packet, and its message.
///
/// # Errors
/// When the bytes are no packet of `fingerprint`, or were damaged.
pub fn parse_packet<T: ConversationTopic>(
    bytes: &[u8],
    fingerprint: u64,
) -> Result<(PacketHeader<T>, &[u8]), DropReason> {
    let Some((head, message)) = bytes.split_at_checked(HEADER_BYTES) else {
        return Err(DropReason::NoPacket);
    };
    let (fields, checksum) = head.split_at(CHECKSUM_OFFSET);
    // Before the checksum, which another version may compute differently.
    let header = PacketHeader::read(fields)?;
    if digest_pieces([fields, message]).to_le_bytes() != *checksum {
        return Err(DropReason::Damaged);
    }
    if header.fingerprint != fingerprint {
        return Err(DropReason::Fingerprint);
    }
    Ok((header, message))
}

/// A reason why a packet was dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum DropReason {
    /// Too short, or without the first bytes of a packet.
    NoPacket,
    /// The packet has another version of this format.
    Version,
    /// Its checksum is wrong.
    Damaged,
    /// The packet is of another scenario or build.
    Fingerprint,
    /// Larger than any message of its conversation.
    TooLarge,
    /// The sender is not in the group, or uses the id of another agent.
    Sender,
    /// The conversation is over for all members.
    Stale,
    /// The conversation has other members.
    OtherGroup,
    /// The conversation comes later, and the buffer for its messages is full.
    NoRoom,
    /// Its message cannot be read.
    Unreadable,
    /// Its message can be read, but its content is impossible.
    Unsound,
}

impl DropReason {
    /// Every reason once, by its index in [`DropCounts`].
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

/// Packets that were dropped, by [`DropReason`] as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DropCounts([u64; DropReason::ALL.len()]);

impl DropCounts {
    /// Adds one to the packets that were dropped for a reason.
    pub fn record(&mut self, reason: DropReason) {
        self.0[reason as usize] += 1;
    }

    /// Returns the number of packets that were dropped for a reason.
    pub fn get(&self, reason: DropReason) -> u64 {
        self.0[reason as usize]
    }

    /// Returns the number of all packets that were dropped.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// Returns a digest of two pieces of bytes, one after the other: fast, but no defense against forgery.
pub fn digest_pieces(pieces: [&[u8]; 2]) -> u64 {
    let mut sum = FACTOR;
    for piece in pieces {
        // With the length, so that a byte that moves from one piece to the other changes the digest.
        sum = fold_product(sum ^ digest_bytes(piece), FACTOR ^ piece.len() as u64);
    }
    sum
}

/// 2^64 divided by the golden ratio, an odd number with bits in no pattern.
const FACTOR: u64 = 0x9E37_79B9_7F4A_7C15;
/// The second prime of xxHash64, another odd number with bits in no pattern.
const OTHER_FACTOR: u64 = 0xC2B2_AE3D_27D4_EB4F;

/// Folds a 128-bit product to 64 bits, as wyhash does: every input bit reaches every output bit.
fn fold_product(a: u64, b: u64) -> u64 {
    let product = u128::from(a) * u128::from(b);
    product as u64 ^ (product >> 64) as u64
}

/// Returns a digest of some bytes. Four sums are computed side by side, because each product has to wait for the one
/// before it.
fn digest_bytes(bytes: &[u8]) -> u64 {
    const LANES: usize = 4;
    let (pairs, rest) = bytes.as_chunks::<16>();
    let (blocks, pairs) = pairs.as_chunks::<LANES>();
    // Different starts, so that equal blocks in two lanes give different sums.
    let mut sums: [u64; LANES] = [1, 2, 3, 4];
    for block in blocks {
        sums = std::array::from_fn(|lane| mix_pair(sums[lane], &block[lane]));
    }
    let sum = sums.into_iter().fold(0, |sum, lane| fold_product(sum ^ FACTOR, lane ^ OTHER_FACTOR));
    // Data that end in zeros differ from this padding by their length, which `digest` mixes in.
    let mut last = [0; 16];
    last[..rest.len()].copy_from_slice(rest);
    mix_pair(pairs.iter().fold(sum, mix_pair), &last)
}

fn mix_pair(sum: u64, bytes: &[u8; 16]) -> u64 {
    let (words, _) = bytes.as_chunks::<8>();
    let [a, b] = [words[0], words[1]].map(u64::from_le_bytes);
    fold_product(sum ^ a ^ FACTOR, b ^ OTHER_FACTOR)
}

/// Returns the digest of a scenario's text and seed.
pub fn fingerprint(text: &str, seed: u64) -> u64 {
    digest_pieces([text.as_bytes(), &seed.to_le_bytes()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    struct Weather;

    impl ConversationTopic for Weather {
        fn wire_number(self) -> u8 {
            9
        }

        fn from_wire_number(number: u8) -> Option<Self> {
            (number == 9).then_some(Self)
        }
    }

    /// Any flipped bit of a packet, and any cut: the checksum finds it.
    #[test]
    fn a_packet_of_which_a_bit_was_turned_is_damaged() {
        let conversation = ConversationId::new(7, Weather, &[1, 4, 9]);
        let header = PacketHeader {
            fingerprint: 0x0123_4567_89AB_CDEF,
            conversation,
            sender: 4,
            sequence: 3,
        };
        for length in [0, 1, 7, 16, 63, 64, 65, 200] {
            let message: Vec<u8> = (0..length).map(|k| (k * k) as u8).collect();
            let packet = PacketBuffer::from_bytes(&message).into_packet(&header);
            assert_eq!(parse_packet(&packet, header.fingerprint), Ok((header, &message[..])));
            for bit in 0..8 * packet.len() {
                let mut turned = packet.clone();
                turned[bit / 8] ^= 1 << (bit % 8);
                assert!(
                    parse_packet::<Weather>(&turned, header.fingerprint).is_err(),
                    "bit {bit} of {length} bytes"
                );
            }
        }
    }
}
