//! Packets of talks that an airplane has not come to yet: a faster neighbor is already there.

use crate::agents::packet::ConversationId;
use sidestep_kernel::EntityId;
use sidestep_kernel::network::DropReason;

/// Largest number of packets of one sender that are kept: an agent that has not heard another one sends only a few
/// messages, and asks for missing ones.
const MAX_PACKETS_PER_SENDER: usize = 16;
/// Largest number of bytes that are kept.
const MAX_BYTES: usize = 64 << 20;

/// Packets that came early, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct EarlyPackets {
    kept: Vec<EarlyPacket>,
    bytes: usize,
}

/// One packet.
#[derive(Debug)]
struct EarlyPacket {
    talk: ConversationId,
    from: EntityId,
    message: Vec<u8>,
}

impl EarlyPackets {
    /// Keeps a message for a talk.
    ///
    /// # Errors
    /// When there is no room for more.
    pub(super) fn push(
        &mut self,
        talk: ConversationId,
        from: EntityId,
        message: &[u8],
    ) -> Result<(), DropReason> {
        let of_one = self.kept.iter().filter(|kept| kept.from == from).count();
        if of_one >= MAX_PACKETS_PER_SENDER || self.bytes + message.len() > MAX_BYTES {
            return Err(DropReason::NoRoom);
        }
        self.bytes += message.len();
        self.kept.push(EarlyPacket { talk, from, message: message.to_vec() });
        Ok(())
    }

    /// Takes out the messages of a talk that starts now. Returns them, and the number of those that are dropped:
    /// of talks before it, and of talks of other members beside it.
    pub(super) fn take(&mut self, talk: &ConversationId) -> (Vec<(EntityId, Vec<u8>)>, [u64; 2]) {
        let (mut taken, mut later, mut dropped) = (Vec::new(), Vec::new(), [0; 2]);
        for kept in std::mem::take(&mut self.kept) {
            if kept.talk == *talk {
                taken.push((kept.from, kept.message));
            } else if talk.is_before(&kept.talk) {
                later.push(kept);
            } else {
                dropped[usize::from(!kept.talk.is_before(talk))] += 1;
            }
        }
        self.bytes = later.iter().map(|kept| kept.message.len()).sum();
        self.kept = later;
        (taken, dropped)
    }
}
