//! Messages between hosts, and how they are read: every message is checked before a host sees it.

use super::epoch::{CoordinatorEpoch, CoordinatorVersion};
use crate::agents::participant::InvalidMessage;
use serde::{Deserialize, Serialize};
use sidestep_kernel::network::PacketBuffer;

/// A message about one of the coordinators of a group.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) enum CoordinatorReplicaMessage {
    /// "The coordinator is on its way to you": with its state.
    Hop(CoordinatorVersion),
    /// "It has arrived here."
    Ack(CoordinatorVersion),
    /// "It was alive so many ticks ago, and I know it to have come as far as this": none ago, if it is in
    /// the sender's care. Hearsay ages, or else two hosts could keep telling each other forever.
    Alive(CoordinatorVersion, u64),
    /// "I have accepted a newer one."
    Stale(CoordinatorEpoch),
    /// "The coordinator is missed. Shall I bring it back?"
    Elect(VoteRequest),
    /// "You shall, as far as I am concerned": with the state of the copy that I have, if the
    /// candidate has no newer one.
    Vote(CoordinatorEpoch, Option<CoordinatorVersion>),
}

impl CoordinatorReplicaMessage {
    /// Returns whether the bytes of a state follow it.
    fn has_state(&self) -> bool {
        matches!(self, Self::Hop(_) | Self::Vote(_, Some(_)))
    }
}

/// A host that stands for election.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct VoteRequest {
    /// The epoch that it wants to begin.
    pub epoch: CoordinatorEpoch,
    /// The farthest that it knows the coordinator to have come.
    pub seen: CoordinatorVersion,
    /// The copy that it has.
    pub has: Option<CoordinatorVersion>,
    /// Whether it was lost on a hop from this very host, rather than not heard of for long.
    pub was_lost: bool,
}

/// A message as it was read: the number of the coordinator that it is about, and the bytes of a
/// state where it carries one.
pub(super) type ParsedCoordinatorReplicaMessage<'a> = (u16, CoordinatorReplicaMessage, &'a [u8]);

/// Returns a message in the form in which it travels: a state goes behind it.
pub(super) fn encode(
    number: u16,
    message: &CoordinatorReplicaMessage,
    state: &[u8],
) -> PacketBuffer {
    PacketBuffer::from_parts(&(number, message), state)
}

/// What a host has to know of itself to check a message.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageReceiverContext {
    /// Its place in the group.
    pub me: usize,
    /// Number of hosts of the group.
    pub group: usize,
    /// Number of coordinators of the group.
    pub replicas: usize,
}

/// Returns a message from host `from` to its reader.
///
/// # Errors
/// When it can be no such message.
pub(super) fn decode(
    bytes: &[u8],
    from: usize,
    reader: MessageReceiverContext,
) -> Result<ParsedCoordinatorReplicaMessage<'_>, InvalidMessage> {
    let MessageReceiverContext { me, group, replicas } = reader;
    let read = postcard::take_from_bytes::<(u16, CoordinatorReplicaMessage)>(bytes);
    let ((number, message), state) = read.map_err(|_| InvalidMessage::Form)?;
    InvalidMessage::Airplane.ensure(from < group && from != me)?;
    InvalidMessage::Kind.ensure(usize::from(number) < replicas)?;
    InvalidMessage::Form.ensure(message.has_state() || state.is_empty())?;
    let is_valid = match &message {
        CoordinatorReplicaMessage::Hop(at) => at.is_valid_for(group) && at.hop > 0,
        CoordinatorReplicaMessage::Ack(at) | CoordinatorReplicaMessage::Alive(at, _) => {
            at.is_valid_for(group)
        }
        CoordinatorReplicaMessage::Stale(epoch) => epoch.is_valid_for(group),
        CoordinatorReplicaMessage::Elect(VoteRequest { epoch, seen, has, .. }) => {
            let is_own = epoch.is_valid_for(group) && usize::from(epoch.owner) == from;
            is_own && seen.is_valid_for(group) && has.is_none_or(|has| has.is_valid_for(group))
        }
        CoordinatorReplicaMessage::Vote(epoch, copy) => {
            let is_mine = epoch.is_valid_for(group) && usize::from(epoch.owner) == me;
            is_mine && copy.is_none_or(|copy| copy.is_valid_for(group))
        }
    };
    InvalidMessage::Round.ensure(is_valid)?;
    Ok((number, message, state))
}
