//! Messages between hosts, and how they are read: every message is checked before a host sees it.

use super::epoch::{Epoch, Position};
use crate::agents::party::Unsound;
use serde::{Deserialize, Serialize};
use sidestep_kernel::network::Draft;

/// A message about one of the coordinators of a group.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) enum Message {
    /// "The coordinator has set out to you": with its state.
    Hop(Position),
    /// "It has arrived here."
    Ack(Position),
    /// "It was alive so many ticks ago, and I know it to have come as far as this": none ago, if it is in
    /// the sender's care. Hearsay ages, or else two hosts could keep telling each other forever.
    Alive(Position, u64),
    /// "I have accepted a newer one."
    Stale(Epoch),
    /// "The coordinator is missed. Shall I bring it back?"
    Elect(Candidacy),
    /// "You shall, as far as I am concerned": with the state of the copy that I have, if the
    /// candidate has no newer one.
    Vote(Epoch, Option<Position>),
}

impl Message {
    /// Returns whether the bytes of a state follow it.
    fn has_state(&self) -> bool {
        matches!(self, Self::Hop(_) | Self::Vote(_, Some(_)))
    }
}

/// A host that stands for election.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Candidacy {
    /// The epoch that it wants to begin.
    pub epoch: Epoch,
    /// The farthest that it knows the coordinator to have come.
    pub seen: Position,
    /// The copy that it has.
    pub has: Option<Position>,
    /// Whether it was lost on a hop from this very host, rather than not heard of for long.
    pub was_lost: bool,
}

/// A message as it was read: the number of the coordinator that it is about, and the bytes of a
/// state where it carries one.
pub(super) type Read<'a> = (u16, Message, &'a [u8]);

/// Returns a message in the form in which it travels: a state goes behind it.
pub(super) fn written(seat: u16, message: &Message, state: &[u8]) -> Draft {
    Draft::with(&(seat, message), state)
}

/// A host that reads messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reader {
    /// Its place in the group.
    pub me: usize,
    /// Number of hosts of the group.
    pub group: usize,
    /// Number of coordinators of the group.
    pub seats: usize,
}

/// Returns a message from host `from` to its reader.
///
/// # Errors
/// When it can be no such message.
pub(super) fn read(bytes: &[u8], from: usize, reader: Reader) -> Result<Read<'_>, Unsound> {
    let Reader { me, group, seats } = reader;
    let read = postcard::take_from_bytes::<(u16, Message)>(bytes);
    let ((seat, message), state) = read.map_err(|_| Unsound::Form)?;
    Unsound::Airplane.unless(from < group && from != me)?;
    Unsound::Kind.unless(usize::from(seat) < seats)?;
    Unsound::Form.unless(message.has_state() || state.is_empty())?;
    let is_right = match &message {
        Message::Hop(at) => at.is_of(group) && at.hop > 0,
        Message::Ack(at) | Message::Alive(at, _) => at.is_of(group),
        Message::Stale(epoch) => epoch.is_of(group),
        Message::Elect(Candidacy { epoch, seen, has, .. }) => {
            let is_own = epoch.is_of(group) && usize::from(epoch.owner) == from;
            is_own && seen.is_of(group) && has.is_none_or(|has| has.is_of(group))
        }
        Message::Vote(epoch, copy) => {
            let is_mine = epoch.is_of(group) && usize::from(epoch.owner) == me;
            is_mine && copy.is_none_or(|copy| copy.is_of(group))
        }
    };
    Unsound::Round.unless(is_right)?;
    Ok((seat, message, state))
}
