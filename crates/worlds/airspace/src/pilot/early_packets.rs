//! Packets of conversations that an airplane has not come to yet: a faster neighbor is already there.

use crate::agents::packet::ConversationId;
use sidestep_kernel::EntityId;
use sidestep_kernel::network::DropReason;

/// Largest number of packets of one sender that are kept: an agent that has not heard another one sends only a few
/// messages, and asks for missing ones.
const MAX_PACKETS_PER_SENDER: usize = 16;
/// Largest number of bytes that are kept, so that no sender fills the memory.
const MAX_BYTES: usize = 64 << 20;

/// Packets that came early, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct EarlyPackets {
    kept: Vec<EarlyPacket>,
    bytes: usize,
}

/// The packets that no longer wait once a conversation starts.
#[derive(Debug, Default)]
pub(super) struct ConversationStartPackets {
    /// Senders and messages of the conversation, in the order in which they came.
    pub(super) messages: Vec<(EntityId, Vec<u8>)>,
    /// Number of dropped packets of earlier conversations.
    pub(super) stale: u64,
    /// Number of dropped packets of conversations of other members.
    pub(super) of_other_groups: u64,
}

#[derive(Debug)]
struct EarlyPacket {
    conversation: ConversationId,
    from: EntityId,
    message: Vec<u8>,
}

impl EarlyPackets {
    /// Keeps a message for a conversation.
    ///
    /// # Errors
    /// When there is no room for more.
    pub(super) fn push(
        &mut self,
        conversation: ConversationId,
        from: EntityId,
        message: &[u8],
    ) -> Result<(), DropReason> {
        let of_one = self.kept.iter().filter(|kept| kept.from == from).count();
        if of_one >= MAX_PACKETS_PER_SENDER || self.bytes + message.len() > MAX_BYTES {
            return Err(DropReason::NoRoom);
        }
        self.bytes += message.len();
        self.kept.push(EarlyPacket { conversation, from, message: message.to_vec() });
        Ok(())
    }

    /// Takes out the messages of a conversation that starts now, and drops those of conversations before it, and of
    /// conversations of other members at its time.
    pub(super) fn take(&mut self, conversation: &ConversationId) -> ConversationStartPackets {
        let mut taken = ConversationStartPackets::default();
        let mut later = Vec::new();
        for kept in std::mem::take(&mut self.kept) {
            if kept.conversation == *conversation {
                taken.messages.push((kept.from, kept.message));
            } else if conversation.is_before(&kept.conversation) {
                later.push(kept);
            } else if kept.conversation.is_before(conversation) {
                taken.stale += 1;
            } else {
                taken.of_other_groups += 1;
            }
        }
        self.bytes = later.iter().map(|kept| kept.message.len()).sum();
        self.kept = later;
        taken
    }
}
