//! Packets of talks that an airplane has not come to yet: a faster neighbor is already there.

use crate::agents::packet::TalkId;
use sidestep_kernel::EntityId;
use sidestep_kernel::network::Refusal;

/// Largest number of packets of one sender that are kept: an agent that has not heard another one sends only a few
/// messages, and asks for missing ones.
const MOST_OF_ONE: usize = 16;
/// Largest number of bytes that are kept.
const MOST_BYTES: usize = 64 << 20;

/// Packets that came early, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Early {
    kept: Vec<Kept>,
    bytes: usize,
}

/// One packet.
#[derive(Debug)]
struct Kept {
    talk: TalkId,
    from: EntityId,
    message: Vec<u8>,
}

impl Early {
    /// Keeps a message for a talk.
    ///
    /// # Errors
    /// When there is no room for more.
    pub(super) fn keep(
        &mut self,
        talk: TalkId,
        from: EntityId,
        message: &[u8],
    ) -> Result<(), Refusal> {
        let of_one = self.kept.iter().filter(|kept| kept.from == from).count();
        if of_one >= MOST_OF_ONE || self.bytes + message.len() > MOST_BYTES {
            return Err(Refusal::NoRoom);
        }
        self.bytes += message.len();
        self.kept.push(Kept { talk, from, message: message.to_vec() });
        Ok(())
    }

    /// Takes out the messages of a talk that starts now. Returns them, and the number of those that are dropped:
    /// of talks before it, and of talks of other members beside it.
    pub(super) fn take(&mut self, talk: &TalkId) -> (Vec<(EntityId, Vec<u8>)>, [u64; 2]) {
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
