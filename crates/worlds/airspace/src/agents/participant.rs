//! Participants of a conversation: programs aboard that accept and produce messages, without a clock, a network, or
//! the packets around the messages.

use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::{DropReason, PacketBuffer};

/// A participant of a conversation, as a state machine: messages and ticks in, messages out.
///
/// It lives on after it has come to its outcome, and answers members that have not.
pub trait Participant: Send {
    /// Starts the conversation.
    fn start(&mut self, tick: u64);

    /// Takes a message of another member, as it came off the network: any bytes, any number of times, in
    /// any order.
    ///
    /// # Errors
    /// When the message cannot be read, or its content is impossible; nothing has changed then.
    fn on_message(
        &mut self,
        from: EntityId,
        message: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage>;

    /// Performs the actions that are due by a tick.
    fn on_timer(&mut self, tick: u64);

    /// Returns the tick in which something is due, unless a message comes before it.
    fn next_timer(&self) -> Option<u64>;

    /// Returns whether it has come to its outcome.
    fn is_done(&self) -> bool;

    /// Takes out the messages that it has to send, each once.
    fn take_messages(&mut self) -> Vec<OutgoingMessage>;

    /// Returns the largest number of bytes that a message to it may have.
    fn max_message_bytes(&self) -> usize;

    /// Returns its progress, for display.
    fn progress(&self) -> ConversationProgress {
        ConversationProgress::default()
    }
}

/// How far a participant has come; nothing depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ConversationProgress {
    /// Number of rounds made; 0 in a conversation without rounds.
    pub round: u32,
    /// Number of the newest epoch that it has accepted; 0 where no coordinator migrates, or none was lost.
    pub epoch: u32,
}

/// A participant that has not ended; once it has, it only answers others.
pub trait FinishableParticipant: Participant {
    /// What it finds, chooses or agrees on.
    type Outcome;

    /// Returns the end of the conversation for it; one that is not done ends because time is up.
    fn finish(&mut self) -> ConversationEnd<Self::Outcome>;
}

/// How a conversation has ended for one agent; for others it may have ended otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct ConversationEnd<O> {
    /// Its outcome; `None` if time was up before there was any.
    pub outcome: Option<O>,
    /// The others, by place, that it has not heard in spite of asking.
    pub unheard: Vec<usize>,
    /// Whether time was up before it was done.
    pub late: bool,
}

/// A message on its way out.
#[derive(Debug, Clone)]
pub struct OutgoingMessage {
    /// The receiver; `None` for all others of the conversation.
    pub to: Option<EntityId>,
    /// The message, with room for the header of its packet.
    pub message: PacketBuffer,
}

/// A reason to reject a message: its sender does not belong to the conversation, or lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum InvalidMessage {
    /// Its bytes are no message of the conversation.
    Form,
    /// It is of a kind that no agent sends with these settings.
    Kind,
    /// A list in it has another length than it must have.
    Length,
    /// A number in it is out of its bounds, or none at all.
    Number,
    /// It is about an airplane that is not in the group.
    Airplane,
    /// It is of a round that there is not.
    Round,
    /// It claims a place at which the airplane is not seen, or abilities that are not in its filed plan.
    Plan,
}

/// Largest number of meters that a message may contain: beyond it, distances and their squares lose all sense.
const MAX_COORDINATE_M: f64 = 1e15;

/// Returns whether coordinates and altitudes in meters can be computed with.
pub(super) fn are_valid_coordinates(values_m: impl IntoIterator<Item = f64>) -> bool {
    // Comparisons with NaN are false. Without an early exit the compiler compares several values at a time.
    values_m.into_iter().fold(true, |are_valid, m| are_valid & (m.abs() <= MAX_COORDINATE_M))
}

impl InvalidMessage {
    /// Returns `Ok` if something holds, or else this reason.
    pub(crate) fn ensure(self, holds: bool) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(self) }
    }
}

impl From<InvalidMessage> for DropReason {
    fn from(why: InvalidMessage) -> Self {
        if why == InvalidMessage::Form { Self::Unreadable } else { Self::Unsound }
    }
}
